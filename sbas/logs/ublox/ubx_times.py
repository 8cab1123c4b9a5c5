"""GPS time of UBX messages: time of week from the message, the week from what states it.

NAV-TIMEGPS, RXM-RAWX and RXM-RAW state the week. NAV-PVT states a UTC date, which gives it:
week = round((UTC + leap seconds - time of week) / 604800 s). All other messages have a time of
week only.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.logs.ublox import ubx_messages as ubx
from sbas.logs.ublox.ubx_messages import Raw
from sbas.timescales import GPS_EPOCH_NS, WEEK_S, gpst_minus_utc_s

WEEK_MS = WEEK_S * 1000
_LAST_WEEK = 14_000
"""Weeks beyond (year 2248) do not fit datetime64[ns]; they count as no time."""
_DATE_AND_TIME = 3
_TIME_AND_WEEK = 3
_LEAP_VALID = 4
_LOOSE_MS = 1500
"""Date and time of week of one message differ by less, by rounding and clock error alone."""

Times = NDArray[np.int64]


@dataclass(frozen=True)
class Anchors:
    """Messages that state their whole GPS time: (n,) place in the file, (n,) time [ms]."""

    position: Times
    time_ms: Times

    @classmethod
    def none(cls) -> Anchors:
        return cls(np.empty(0, np.int64), np.empty(0, np.int64))

    def before(self, position: Times) -> Times:
        """(n,) time of the last anchor before each place, -1 where there is none."""
        index = np.searchsorted(self.position, position) - 1
        if not len(self.position):
            return np.full(len(position), -1, np.int64)
        return np.where(index < 0, -1, self.time_ms[index])

    def joined(self, *others: Anchors) -> Anchors:
        """All of them in file order."""
        position = np.concatenate([a.position for a in (self, *others)])
        time_ms = np.concatenate([a.time_ms for a in (self, *others)])
        order = np.argsort(position, kind="stable")
        return Anchors(position[order], time_ms[order])


def anchors_of(raw: Raw) -> Anchors:
    """Those messages of one kind whose `time_ms` is known."""
    known = raw["time_ms"] >= 0
    return Anchors(raw["position"][known], raw["time_ms"][known])


def gps_times(time_ms: Times) -> NDArray[np.datetime64]:
    """GPS time of (n,) milliseconds since 1980-01-06; NaT for -1."""
    times: NDArray[np.datetime64] = (time_ms * 1_000_000 + GPS_EPOCH_NS).view("M8[ns]")
    if len(times) and time_ms.min() < 0:
        times[time_ms < 0] = np.datetime64("NaT", "ns")
    return times


def _of_week(week: Times, itow_ms: Times) -> Times:
    usable = (week >= 0) & (week < _LAST_WEEK) & (itow_ms >= 0) & (itow_ms < WEEK_MS)
    return np.where(usable, week * WEEK_MS + itow_ms, -1)


def week_near(itow_ms: Times, near_ms: Times) -> Times:
    """(n,) week in which a time of week lies next to a whole time, the later of two as near."""
    week: Times = (near_ms - itow_ms + WEEK_MS // 2) // WEEK_MS
    return week


def time_of_pvt(raw: Raw) -> tuple[Times, Counter[int]]:
    """Times [ms] of NAV-PVT, and by how many seconds their UTC contradicts them, how often.

    Without validDate and validTime, or with a date that is none, the time is unknown (-1).
    """
    itow = raw["itow_ms"].astype(np.int64)
    year, month, day = (raw[name].astype(np.int64) for name in ("year", "month", "day"))
    good = (raw["valid"] & _DATE_AND_TIME) == _DATE_AND_TIME
    good &= (year > 1980) & (year < 2248) & (month >= 1) & (month <= 12) & (day >= 1)
    good &= (raw["hour"] < 24) & (raw["minute"] < 60) & (raw["second"] <= 60) & (itow < WEEK_MS)
    months = np.where(good, (year - 1970) * 12 + month - 1, 132)
    first = months.astype("M8[M]").astype("M8[D]").astype(np.int64)
    following = (months + 1).astype("M8[M]").astype("M8[D]").astype(np.int64)
    good &= first + day <= following
    days = first + np.where(good, day - 1, 0)
    # The offset is that of the day's begin: at hh:mm:60 the new one does not hold yet.
    leap_s = gpst_minus_utc_s((days * 86_400_000_000_000).view("M8[ns]"))
    seconds = raw["hour"].astype(np.int64) * 3600 + raw["minute"].astype(np.int64) * 60
    seconds += raw["second"]
    stated = (days * 86_400 + seconds + leap_s) * 1000 + raw["nano"] // 1_000_000
    stated -= GPS_EPOCH_NS // 1_000_000
    time_ms = _of_week(np.where(good, week_near(itow, stated), -1), itow)
    apart = np.where(time_ms >= 0, stated - time_ms, 0)
    loose = np.abs(apart) > _LOOSE_MS
    contradicting: Counter[int] = Counter()
    if loose.any():
        off, count = np.unique(np.rint(apart[loose] / 1000).astype(np.int64), return_counts=True)
        contradicting.update(dict(zip(off.tolist(), count.tolist(), strict=True)))
    return time_ms, contradicting


def time_of_timegps(raw: Raw) -> tuple[Times, NDArray[np.int8]]:
    """Times [ms] of NAV-TIMEGPS, -1 where not valid, and the leap seconds that it states."""
    good = (raw["valid"] & _TIME_AND_WEEK) == _TIME_AND_WEEK
    week = np.where(good, raw["week"].astype(np.int64), -1)
    leap_s: NDArray[np.int8] = raw["leap_s"][(raw["valid"] & _LEAP_VALID) != 0]
    return _of_week(week, raw["itow_ms"].astype(np.int64)), leap_s


def time_of_raw(raw: Raw) -> Times:
    """Times [ms] of RXM-RAW or RXM-RAWX; week 0 stands for a week not yet known."""
    if "tow_s" in raw:
        tow_s = raw["tow_s"]
        usable = (tow_s >= 0) & (tow_s < WEEK_S)
        itow = np.where(usable, np.rint(np.where(usable, tow_s, 0) * 1000), -1).astype(np.int64)
    else:
        itow = raw["itow_ms"].astype(np.int64)
    week = raw["week"].astype(np.int64)
    return _of_week(np.where(week > 0, week, -1), itow)


TIME_FIELDS: dict[int, tuple[str, ...]] = {
    ubx.NAV_PVT: ("itow_ms", "year", "month", "day", "hour", "minute", "second", "valid", "nano"),
    ubx.NAV_TIMEGPS: ("itow_ms", "week", "leap_s", "valid"),
    ubx.RXM_RAW: ("itow_ms", "week"),
    ubx.RXM_RAWX: ("tow_s", "week"),
}
"""Fields that the time of a message needs."""
