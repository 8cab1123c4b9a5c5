"""Times counted piece by piece say what the times at once say."""

from __future__ import annotations

from itertools import chain

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.logs.time_stamps import Stamps, stamps_to_gps
from sbas.logs.time_tally import TimeTally

SECOND = 10**9
# 2016-12-31 to 2017-01-02: GPST - UTC goes from 17 s to 18 s (IERS Bulletin C 52).
BEGIN = int(np.datetime64("2016-12-31", "ns").astype(np.int64))


def stamps(seconds: list[int], zoned: bool = False) -> Stamps:
    ns = BEGIN + np.array(seconds, np.int64) * SECOND
    yes = np.ones(len(ns), bool)
    return Stamps(ns, yes, ~yes, yes & zoned)


@given(
    st.lists(st.lists(st.integers(0, 2 * 86_400), max_size=4), min_size=1, max_size=5),
    st.sampled_from(["UTC", "BDT", "GPST", "JST", "GLONASST"]),
)
def test_pieces_convert_as_the_whole(pieces: list[list[int]], scale: str) -> None:
    tally = sum((TimeTally.of(stamps(piece)) for piece in pieces), TimeTally())
    _, leap_seconds, findings = stamps_to_gps(stamps(list(chain.from_iterable(pieces))), scale)
    assert tally.rows == sum(map(len, pieces))
    assert tally.conversions(scale) == (leap_seconds, findings)


def test_dates_beyond_the_leap_table_are_told() -> None:
    late = stamps([0, 20 * 366 * 86_400, 5])
    tally = TimeTally.of(late[:2]) + TimeTally.of(late[2:])
    assert [f.severity for f in tally.conversions("UTC")[1]] == ["info", "warning"]
    assert tally.conversions("UTC")[1] == stamps_to_gps(late, "UTC")[2]


@pytest.mark.parametrize("zoned", [0, 1, 3])
def test_zones_are_counted(zoned: int) -> None:
    tally = TimeTally.of(stamps([1] * zoned, True)) + TimeTally.of(stamps([2] * (3 - zoned)))
    assert tally.zones().zoned.tolist() == [True] * zoned + [False] * (3 - zoned)
