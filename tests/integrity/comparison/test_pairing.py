from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.comparison.pairing import common_epochs, pair_epochs

MS = 1_000_000
S = 1000 * MS
TIMES = st.lists(st.integers(0, 400), max_size=80, unique=True).map(
    lambda found: np.array(sorted(found), np.int64)
)


@given(TIMES, TIMES, st.integers(0, 10))
def test_each_epoch_is_used_once_and_within_the_tolerance(
    a: np.ndarray, b: np.ndarray, tolerance: int
) -> None:
    pairs = pair_epochs(a, b, tolerance_ns=tolerance)
    assert np.unique(pairs.row_a).size == np.unique(pairs.row_b).size == len(pairs)
    assert np.all(np.diff(pairs.row_a) > 0)
    assert np.all(np.diff(pairs.row_b) > 0)
    np.testing.assert_array_equal(b[pairs.row_b] - a[pairs.row_a], pairs.offset_ns)
    assert np.all(np.abs(pairs.offset_ns) <= tolerance)
    # Nobody who is left has a closer partner that is left as well.
    left_a = np.delete(a, pairs.row_a)
    left_b = np.delete(b, pairs.row_b)
    assert not set(left_a.tolist()) & set(left_b.tolist())


@pytest.mark.parametrize("offset_ms", [-500, -300, 0, 1, 499, 500])
def test_a_constant_offset_up_to_half_an_interval_pairs_every_epoch(offset_ms: int) -> None:
    a = np.arange(100) * S
    pairs = pair_epochs(a, a + offset_ms * MS, tolerance_ns=S // 2)
    # At half an interval the first or last epoch may belong to a neighbour that is not there.
    assert len(pairs) >= 99
    assert abs(offset_ms) == 500 or np.all(pairs.offset_ns == offset_ms * MS)


def test_empty_and_disordered_times() -> None:
    none = np.empty(0, np.int64)
    assert len(pair_epochs(none, np.arange(3), tolerance_ns=1)) == 0
    with pytest.raises(InputError, match="times of B do not increase"):
        pair_epochs(np.arange(3), np.array([0, 2, 2]), tolerance_ns=1)


def test_one_hertz_against_five() -> None:
    one = 10 * S + np.arange(60) * S
    five = np.arange(500) * S // 5 + 30 * MS
    common = common_epochs(one, five, interval_a_ns=S, interval_b_ns=S // 5)
    assert common.interval_ns == S
    np.testing.assert_array_equal(common.time_ns, one)
    assert common.paired.all()
    assert np.all(common.offset_ns == 30 * MS)
    assert (common.unpaired_a, common.outside_a) == (0, 0)
    assert common.outside_b + common.unpaired_b + 60 == five.size
    assert common.between_b == common.unpaired_b
    turned = common_epochs(five, one, interval_a_ns=S // 5, interval_b_ns=S)
    np.testing.assert_array_equal(turned.row_b, common.row_a)
    np.testing.assert_array_equal(turned.offset_ns, -common.offset_ns)
    assert turned.between_a == common.between_b


def test_a_gap_of_one_recording_keeps_the_others_epochs() -> None:
    a = np.delete(np.arange(100), np.s_[40:60]) * S
    b = np.delete(np.arange(100), np.s_[55:70]) * S
    common = common_epochs(a, b, interval_a_ns=S, interval_b_ns=S)
    # Neither recorded 55 to 59.
    np.testing.assert_array_equal(common.time_ns // S, np.delete(np.arange(100), np.s_[55:60]))
    assert (common.time_ns[common.row_a < 0] // S).tolist() == list(range(40, 55))
    assert (common.time_ns[common.row_b < 0] // S).tolist() == list(range(60, 70))
    assert (common.unpaired_a, common.unpaired_b) == (10, 15)
    assert (common.between_a, common.between_b) == (0, 0)


def test_a_gap_of_the_coarse_recording_is_filled_at_its_own_interval() -> None:
    coarse = np.delete(np.arange(100), np.s_[40:60]) * S
    fine = np.arange(500) * S // 5
    common = common_epochs(coarse, fine, interval_a_ns=S, interval_b_ns=S // 5)
    np.testing.assert_array_equal(common.time_ns // S, np.arange(100))
    assert (common.row_a < 0).sum() == 20
    assert np.all(common.row_b >= 0)
    assert common.between_b == fine.size - 100 - common.outside_b


def test_recordings_of_other_hours_are_refused_with_their_spans() -> None:
    with pytest.raises(InputError, match="share no time") as caught:
        common_epochs(np.arange(10) * S, np.arange(20, 30) * S, interval_a_ns=S, interval_b_ns=S)
    assert "1970-01-01T00:00:09" in str(caught.value)
    assert "time scale" in caught.value.cure
