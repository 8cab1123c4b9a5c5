"""Time scales against published instants (IS-GPS-200, IERS Bulletins C)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.timescales import (
    gps_time,
    gps_to_utc,
    gpst_minus_utc_s,
    to_gps,
    utc_to_gps,
    week_and_tow_ns,
)


def at(text: str) -> np.ndarray:
    return np.array([text], "M8[ns]")


def test_week_1549_of_the_laboratory_recording() -> None:
    # 2009-09-19 00:00:00 GPST = 2009-09-18 23:59:45 UTC (fifteen leap seconds in 2009).
    time = gps_time([1549], [518_400 * 1_000_000_000])
    assert time[0] == np.datetime64("2009-09-19T00:00:00")
    assert gps_to_utc(time)[0] == np.datetime64("2009-09-18T23:59:45")


def test_around_the_leap_second_at_the_end_of_2016() -> None:
    assert gpst_minus_utc_s(at("2016-12-31T23:59:59"))[0] == 17
    assert gpst_minus_utc_s(at("2017-01-01T00:00:00"))[0] == 18
    gps = np.array(["2017-01-01T00:00:16", "2017-01-01T00:00:17", "2017-01-01T00:00:18"], "M8[ns]")
    assert gps_to_utc(gps).astype(str).tolist() == [
        "2016-12-31T23:59:59.000000000",
        "2016-12-31T23:59:59.000000000",  # 23:59:60, which datetime64 cannot write
        "2017-01-01T00:00:00.000000000",
    ]


@pytest.mark.parametrize(
    ("scale", "expected"),
    [
        ("GPST", "2020-05-01T12:00:00"),
        ("UTC", "2020-05-01T12:00:18"),
        ("BDT", "2020-05-01T12:00:14"),
        ("GLONASST", "2020-05-01T09:00:18"),
    ],
)
def test_scales_to_gps(scale: str, expected: str) -> None:
    assert to_gps(at("2020-05-01T12:00:00"), scale)[0] == np.datetime64(expected)  # type: ignore[arg-type]


def test_unknown_scale_and_times_before_gps_are_refused() -> None:
    with pytest.raises(InputError, match="unknown time scale"):
        to_gps(at("2020-05-01"), "TAI")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="before GPS time"):
        utc_to_gps(at("1979-12-31"))
    with pytest.raises(InputError, match="before 1980"):
        gps_to_utc(at("1979-12-31"))


@given(st.integers(0, 4000), st.integers(0, 604_800 * 10**9 - 1))
def test_weeks_and_nanoseconds_round_trip(week: int, tow_ns: int) -> None:
    weeks, tows = week_and_tow_ns(gps_time([week], [tow_ns]))
    assert (weeks[0], tows[0]) == (week, tow_ns)


@given(st.integers(315_964_800 * 10**9, 4_000_000_000 * 10**9))
def test_utc_round_trip(ns: int) -> None:
    utc = np.array([ns], "M8[ns]")
    assert gps_to_utc(utc_to_gps(utc))[0] == utc[0]
