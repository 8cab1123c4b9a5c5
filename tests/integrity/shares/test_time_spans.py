from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.events import Stretch, find_runs
from sbas.integrity.shares.time_spans import Spans, spans_of_runs

S = 1_000_000_000


def spans(*pairs: tuple[int, int]) -> Spans:
    both = np.array(pairs, np.int64).reshape(-1, 2)
    return Spans(both[:, 0] * S, both[:, 1] * S)


def on_grid(state: np.ndarray, step_ns: int = S) -> Spans:
    stretch = Stretch(np.arange(state.size, dtype=np.int64) * step_ns, step_ns)
    return spans_of_runs(find_runs(np.flatnonzero(state), stretch), interval_ns=step_ns)


@given(st.lists(st.booleans(), min_size=1, max_size=60))
def test_time_until_an_instant_is_the_count_of_epochs_before_it(bits: list[bool]) -> None:
    state = np.array(bits)
    found = on_grid(state).until(np.arange(state.size + 1.0), 0)
    np.testing.assert_allclose(found, np.concatenate([[0], np.cumsum(state)]), atol=1e-9)


@given(st.lists(st.sampled_from([0, 1, 2]), min_size=1, max_size=60))
def test_what_is_taken_out_and_what_remains_fill_the_whole(levels: list[int]) -> None:
    """Level 0: not observed, 1: observed, 2: observed and in the state."""
    level = np.array(levels)
    left = on_grid(level > 0).without(on_grid(level == 2))
    np.testing.assert_array_equal(left.start_ns, on_grid(level == 1).start_ns)
    np.testing.assert_array_equal(left.end_ns, on_grid(level == 1).end_ns)


def test_spans_merge_up_to_the_merge_time_and_not_beyond() -> None:
    merged = spans((0, 10), (70, 80), (141, 150)).merged(60.0)
    assert (merged.start_ns // S).tolist() == [0, 141]
    assert (merged.end_ns // S).tolist() == [80, 150]
    assert len(spans().merged(60.0)) == 0


def test_a_shifted_epoch_after_a_gap_is_not_counted_twice() -> None:
    """Epochs at 0, 1 and, after a shift of the clock's phase, at 2.6 s and 3.1 s with a gap."""
    time = (np.array([0.0, 1.0, 2.6, 3.1]) * S).astype(np.int64)
    stretch = Stretch(time, int(1.5 * S))
    found = spans_of_runs(find_runs(np.array([0, 1, 3]), stretch), interval_ns=S)
    assert found.total_s == pytest.approx(3.0)
    found = spans_of_runs(find_runs(np.array([0, 1, 2, 3]), stretch), interval_ns=S)
    assert found.total_s == pytest.approx(3.5)


@pytest.mark.parametrize("pairs", [[(5, 5)], [(5, 4)], [(0, 10), (9, 12)], [(10, 12), (0, 1)]])
def test_impossible_spans_are_refused(pairs: list[tuple[int, int]]) -> None:
    with pytest.raises(InputError, match="spans"):
        spans(*pairs)


def test_taking_out_what_is_not_inside_is_refused() -> None:
    with pytest.raises(InputError, match="within"):
        spans((0, 10)).without(spans((5, 15)))
