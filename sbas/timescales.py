"""GPS time, UTC, weeks and leap seconds, in integer nanoseconds throughout.

All times in `sbas` are GPS time as datetime64[ns] without a zone. Integers only: seconds as
floating point would break joins between epochs.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError

TimeScale = Literal["GPST", "UTC", "GST", "QZSST", "BDT", "GLONASST"]

NS_PER_S = 1_000_000_000
WEEK_S = 604_800
GPS_EPOCH_NS = 315_964_800 * NS_PER_S
"""1980-01-06 00:00:00, the origin of GPS time, on the datetime64 scale."""

_LEAPS = (
    # First UTC instant from which GPST - UTC has the given value (IERS Bulletins C).
    ("1980-01-06", 0), ("1981-07-01", 1), ("1982-07-01", 2), ("1983-07-01", 3),
    ("1985-07-01", 4), ("1988-01-01", 5), ("1990-01-01", 6), ("1991-01-01", 7),
    ("1992-07-01", 8), ("1993-07-01", 9), ("1994-07-01", 10), ("1996-01-01", 11),
    ("1997-07-01", 12), ("1999-01-01", 13), ("2006-01-01", 14), ("2009-01-01", 15),
    ("2012-07-01", 16), ("2015-07-01", 17), ("2017-01-01", 18),
)  # fmt: skip
_LEAP_UTC_NS = np.array([np.datetime64(day, "ns") for day, _ in _LEAPS]).astype(np.int64)
_LEAP_S = np.array([seconds for _, seconds in _LEAPS], dtype=np.int64)
LEAP_TABLE_EXPIRES = np.datetime64("2027-06-28", "ns")
"""First UTC time at which the table might be wrong (tzdata 2026f, through IERS Bulletin C)."""


def gps_time(week: ArrayLike, tow_ns: ArrayLike) -> NDArray[np.datetime64]:
    """GPS time from continuous week numbers and nanoseconds of week.

    Parameters
    ----------
    week : (n,) integer weeks since 1980-01-06, without rollover.
    tow_ns : (n,) integer time of week [ns].

    Returns
    -------
    (n,) datetime64[ns]. Source: IS-GPS-200, 20.3.3.3.1.
    """
    weeks = np.asarray(week, dtype=np.int64)
    return (GPS_EPOCH_NS + weeks * (WEEK_S * NS_PER_S) + np.asarray(tow_ns, np.int64)).view(
        "M8[ns]"
    )


def week_and_tow_ns(time: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Continuous GPS week and nanoseconds of week of (n,) GPS times; inverse of `gps_time`."""
    ns = np.asarray(time, dtype="M8[ns]").astype(np.int64) - GPS_EPOCH_NS
    week, tow_ns = np.divmod(ns, WEEK_S * NS_PER_S)
    return week, tow_ns


def gpst_minus_utc_s(utc: ArrayLike) -> NDArray[np.int64]:
    """Leap seconds GPST - UTC in force at (n,) UTC times [s].

    Raises
    ------
    InputError : a time before 1980-01-06, where GPS time is not defined.
    """
    ns = np.asarray(utc, dtype="M8[ns]").astype(np.int64)
    index = np.searchsorted(_LEAP_UTC_NS, ns, side="right") - 1
    if np.any(index < 0):
        raise InputError(
            "a UTC time lies before GPS time began",
            evidence=f"earliest {np.min(np.asarray(utc, dtype='M8[ns]'))}, GPS begins 1980-01-06",
            cure="check the date column and its format",
        )
    seconds: NDArray[np.int64] = _LEAP_S[index]
    return seconds


def utc_to_gps(utc: ArrayLike) -> NDArray[np.datetime64]:
    """GPS time of (n,) UTC times. A stamp hh:mm:60 must be split before (it is no datetime64)."""
    times = np.asarray(utc, dtype="M8[ns]")
    return (times.astype(np.int64) + gpst_minus_utc_s(times) * NS_PER_S).astype("M8[ns]")


def gps_to_utc(gps: ArrayLike) -> NDArray[np.datetime64]:
    """UTC of (n,) GPS times; within an inserted leap second the stamp 23:59:59 is repeated."""
    times = np.asarray(gps, dtype="M8[ns]")
    ns = times.astype(np.int64)
    switch = _LEAP_UTC_NS + _LEAP_S * NS_PER_S
    index = np.searchsorted(switch, ns, side="right") - 1
    if np.any(index < 0):
        raise InputError("a GPS time lies before 1980-01-06", cure="check weeks and time of week")
    utc = ns - _LEAP_S[index] * NS_PER_S
    # GPS instants inside the leap second itself lie between the new offset and the old one.
    following = np.minimum(index + 1, len(_LEAPS) - 1)
    inside = (following > index) & (utc >= _LEAP_UTC_NS[following])
    return (utc - inside * NS_PER_S).astype("M8[ns]")


def to_gps(time: ArrayLike, scale: TimeScale) -> NDArray[np.datetime64]:
    """GPS time of (n,) times of another scale.

    GST and QZSST are steered to GPS time within nanoseconds and taken as equal; BDT is
    GPST - 14 s (BDS-SIS-ICD, 3.3); GLONASST is UTC + 3 h (GLONASS ICD, 3.3.3).
    """
    times = np.asarray(time, dtype="M8[ns]")
    match scale:
        case "GPST" | "GST" | "QZSST":
            return times
        case "BDT":
            return (times.astype(np.int64) + 14 * NS_PER_S).astype("M8[ns]")
        case "UTC":
            return utc_to_gps(times)
        case "GLONASST":
            return utc_to_gps(times - np.timedelta64(3, "h"))
        case _:
            raise InputError(
                f"unknown time scale {scale!r}", cure="use GPST, UTC, GST, QZSST, BDT or GLONASST"
            )
