"""Written dates and times of day as integer nanoseconds, and their way to GPS time.

Stamps are read digit by digit as arrays: no float seconds, which would break joins between
epochs, and `hh:mm:60` of a leap second stays legal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.timescales import (
    LEAP_TABLE_EXPIRES,
    NS_PER_S,
    TimeScale,
    gpst_minus_utc_s,
    to_gps,
)

DAY_NS = 86_400 * NS_PER_S
JST_MINUS_UTC_NS = 9 * 3600 * NS_PER_S
_AHEAD_OF_UTC_NS = {"UTC": 0, "JST": JST_MINUS_UTC_NS, "GLONASST": 3 * 3600 * NS_PER_S}
_GPS_FIRST_DAY = 3657  # 1980-01-06 in days since 1970
_LONGEST = 48  # characters of a stamp
_LAST_YEAR = 2261  # the last whole year of datetime64[ns]


@dataclass(frozen=True)
class Stamps:
    """Times on the scale they were written in.

    Parameters
    ----------
    ns : (n,) int64, nanoseconds since 1970 on the datetime64 scale; the stamp of a leap second
        hh:mm:60 is held as hh:mm:59.
    readable : (n,) whether the text is a time at all.
    leap : (n,) whether a second is to be added after conversion (seconds field 60).
    zoned : (n,) whether the stamp named a zone; `ns` is then UTC.
    """

    ns: NDArray[np.int64]
    readable: NDArray[np.bool_]
    leap: NDArray[np.bool_]
    zoned: NDArray[np.bool_]

    def __getitem__(self, rows: Any) -> Stamps:
        return Stamps(self.ns[rows], self.readable[rows], self.leap[rows], self.zoned[rows])


def concatenate(parts: list[Stamps]) -> Stamps:
    """One Stamps of several, in order."""
    if not parts:
        return _unreadable(0)
    return Stamps(*(np.concatenate([getattr(p, f) for p in parts]) for f in Stamps.__annotations__))


def parse_stamps(column: Any) -> Stamps:
    """Times of (n,) texts `YYYY-MM-DD hh:mm[:ss[.f]][zone]`; `/` and `T` serve as well."""
    return _by_length(column, _stamps_of_length)


def parse_date_and_clock(dates: Any, clocks: Any) -> Stamps:
    """Times of (n,) dates `YYYY-MM-DD` or `YYYY/MM/DD` and (n,) clocks `hh:mm[:ss[.f]][zone]`."""
    day = _by_length(dates, _dates_of_length)
    clock = _by_length(clocks, _clocks_of_length)
    return Stamps(day.ns + clock.ns, day.readable & clock.readable, clock.leap, clock.zoned)


def week_stamps(week: NDArray[np.float64], tow_s: NDArray[np.float64]) -> Stamps:
    """Times of (n,) weeks and (n,) seconds of week, rounded to the nanosecond.

    A week has 604,800 s, and float64 spaces them by 1e-10 s: the nanosecond is exact.
    """
    good = (week >= 0) & (week < 12_000) & (week == np.floor(week))
    good &= (tow_s >= 0) & (tow_s <= 604_800)
    weeks = np.where(good, week, 0).astype(np.int64)
    tow_ns = np.rint(np.where(good, tow_s, 0) * 1e9).astype(np.int64)
    ns = _GPS_FIRST_DAY * DAY_NS + weeks * (7 * DAY_NS) + tow_ns
    none = np.zeros(len(ns), bool)
    return Stamps(ns, good, none, none)


def scale_of_stamps(
    stamps: Stamps,
    asked: str | None,
    *,
    said: str,
    header: str,
    by_week: bool = False,
    where: str = "",
) -> tuple[str, tuple[Finding, ...]]:
    """Scale that stamps are on: what was asked, else a zone in them, else what the header said.

    Parameters
    ----------
    stamps : readable stamps.
    asked : option `time_scale`.
    said : scale that the header names, or "".
    header : name of the column.
    by_week : whether the stamps are GPS weeks, which no other scale has.
    where : file, for messages.

    Raises
    ------
    InputError : stamps with and without zone, or a zone beside a scale that is not UTC.
    """
    zoned = bool(stamps.zoned.any())
    if zoned and not stamps.zoned.all():
        raise InputError(
            "some times name a zone and some do not",
            where=where,
            evidence=f"{np.count_nonzero(stamps.zoned):,} of {len(stamps.zoned):,} with a zone",
            cure="write all times alike",
        )
    scale = asked or ("UTC" if zoned else said or "GPST")
    if zoned and (scale != "UTC" or (asked is None and said == "GPST")):
        raise InputError(
            f"times name a zone, so they are UTC, but they are said to be {asked or said}",
            where=where,
            evidence=f"column {header!r}",
            cure="take the zone (such as Z) off the times, or say --time-scale UTC",
        )
    if by_week and scale != "GPST":
        raise InputError(
            f"week and seconds of week are GPS time, not {scale}",
            where=where,
            cure="leave out --time-scale, or write the times as dates",
        )
    if asked and said and asked != said:
        finding = Finding(
            "E26",
            "warning",
            f"times read as {asked} as asked, though the header says {said}",
            evidence=f"column {header!r}",
        )
        return scale, (finding,)
    return scale, ()


def stamps_to_gps(
    stamps: Stamps, scale: TimeScale | str
) -> tuple[NDArray[np.datetime64], int | None, tuple[Finding, ...]]:
    """GPS time of readable stamps of one scale (those of `sbas.timescales`, or JST).

    Returns
    -------
    times : (n,) datetime64[ns].
    leap_seconds : GPST - UTC applied at the first stamp; None where no UTC was involved.
    findings : one that counts the conversion, and one where the leap second table may be wrong.
    """
    ns = stamps.ns
    if scale == "GPST" or not len(ns):
        return ns.astype("M8[ns]"), None, ()
    leap_seconds = None
    findings = []
    if scale in _AHEAD_OF_UTC_NS:
        utc = (ns - _AHEAD_OF_UTC_NS[scale]).astype("M8[ns]")
        times = to_gps(utc, "UTC") + stamps.leap * np.timedelta64(1, "s")
        steps = gpst_minus_utc_s(np.array([utc.min(), utc.max(), utc[0]]))
        leap_seconds = int(steps[2])
        detail = f"GPST - UTC = {steps[0]} s" + (f" to {steps[1]} s" * bool(steps[0] != steps[1]))
        if utc.max() >= LEAP_TABLE_EXPIRES:
            findings.append(
                Finding(
                    "E25",
                    "warning",
                    "times lie beyond the known end of the leap second table",
                    where=f"from {LEAP_TABLE_EXPIRES} UTC",
                    evidence=f"latest {utc.max()}",
                    cure="update sbas",
                )
            )
    else:
        times = to_gps(ns.astype("M8[ns]"), scale)  # type: ignore[arg-type]
        detail = f"offset {(times[0].astype(np.int64) - ns[0]) // NS_PER_S} s"
    findings.insert(
        0,
        Finding(
            "E25", "info", f"{len(ns):,} times converted from {scale} to GPS time", evidence=detail
        ),
    )
    return times, leap_seconds, tuple(findings)


def counts_leap_seconds(scale: str) -> bool:
    """Whether a stamp hh:mm:60 can stand on the scale."""
    return scale in _AHEAD_OF_UTC_NS


def leap_stamps_of_utc(stamps: Stamps) -> NDArray[np.bool_]:
    """(n,) stamps of a second 60 where UTC had a leap second: no other scale has them."""
    before = np.where(stamps.leap, stamps.ns, 2 * _GPS_FIRST_DAY * DAY_NS)
    before -= before % NS_PER_S
    following = (before + NS_PER_S).astype("M8[ns]")
    inserted = gpst_minus_utc_s(following) > gpst_minus_utc_s(before.astype("M8[ns]"))
    return np.asarray(stamps.leap & inserted)


def leap_stamp_finding(count: int, scale: str) -> tuple[Finding, ...]:
    """E02 for `count` stamps of a leap second of UTC in a file taken as another scale."""
    if not count:
        return ()
    return (
        Finding(
            "E02",
            "error",
            f"stamps of a leap second, which UTC has and {scale} has not: the times are UTC",
            evidence=f"{count:,} times with a second 60; as {scale} all are 18 s off, and those "
            "are left out",
            cure="--time-scale UTC",
        ),
    )


def _unreadable(rows: int) -> Stamps:
    none = np.zeros(rows, bool)
    return Stamps(np.zeros(rows, np.int64), none, none, none)


def _by_length(column: Any, parse: Callable[[NDArray[np.uint8]], Stamps]) -> Stamps:
    """Parse (n,) pyarrow strings in groups of one length, each an array (length, n) of bytes."""
    column = column.cast(pa.string()).fill_null("")
    rows = len(column)
    if rows == 0:
        return _unreadable(0)
    _, offset_buffer, data = column.buffers()
    offsets = np.frombuffer(offset_buffer, np.int32)[column.offset : column.offset + rows + 1]
    raw = np.frombuffer(data, np.uint8) if data is not None else np.zeros(0, np.uint8)
    lengths = np.diff(offsets)
    first = int(lengths[0])
    if 0 < first <= _LONGEST and np.all(lengths == first):
        matrix = raw[offsets[0] : offsets[-1]].reshape(rows, first)
        return parse(np.ascontiguousarray(matrix.T))
    result = Stamps(
        np.zeros(rows, np.int64), np.zeros(rows, bool), np.zeros(rows, bool), np.zeros(rows, bool)
    )
    # Longer than any stamp is no stamp; so there are few lengths, whatever the file holds.
    for length in np.unique(lengths[(lengths > 0) & (lengths <= _LONGEST)]):
        at = np.flatnonzero(lengths == length)
        part = parse(np.ascontiguousarray(raw[offsets[at] + np.arange(length)[:, None]]))
        for name in Stamps.__annotations__:
            getattr(result, name)[at] = getattr(part, name)
    return result


def _number(digits: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(n,) integers of (k, n) digit values."""
    value = np.zeros(digits.shape[1], np.int64)
    for row in digits:
        value *= 10
        value += row
    return value


def _digits(text: NDArray[np.uint8], rows: list[int]) -> NDArray[np.bool_]:
    """(n,) whether the rows of (k, n) bytes are all digits."""
    good = np.ones(text.shape[1], bool)
    for row in rows:
        good &= text[row] - np.uint8(48) <= 9
    return good


def _dates_of_length(text: NDArray[np.uint8]) -> Stamps:
    length, rows = text.shape
    if length != 10:
        return _unreadable(rows)
    good = _digits(text, [0, 1, 2, 3, 5, 6, 8, 9]) & (text[4] == text[7])
    good &= (text[4] == ord("-")) | (text[4] == ord("/"))
    value = text & np.uint8(15)
    year, month, day = _number(value[:4]), _number(value[5:7]), _number(value[8:10])
    good &= (year >= 1980) & (year <= _LAST_YEAR) & (month >= 1) & (month <= 12) & (day >= 1)
    months = np.where(good, (year - 1970) * 12 + month - 1, 120)
    first = months.astype("M8[M]").astype("M8[D]").astype(np.int64)
    following = (months + 1).astype("M8[M]").astype("M8[D]").astype(np.int64)
    days = first + np.where(good, day - 1, 0)
    good &= (days < following) & (days >= _GPS_FIRST_DAY)
    none = np.zeros(rows, bool)
    return Stamps(days * DAY_NS, good, none, none)


def _clocks_of_length(text: NDArray[np.uint8]) -> Stamps:
    length, rows = text.shape
    if length < 5:
        return _unreadable(rows)
    # The zone is cut off first; what then remains has one length again.
    z = (text[-1] == ord("Z")) | (text[-1] == ord("z"))
    signs = {
        k: (text[-k] == ord("+")) | (text[-k] == ord("-")) for k in (3, 5, 6) if length > k + 4
    }
    result = Stamps(
        np.zeros(rows, np.int64), np.zeros(rows, bool), np.zeros(rows, bool), np.zeros(rows, bool)
    )
    rest = ~z
    groups = [(z, 1)]
    for size, sign in signs.items():
        groups.append((sign & rest, size))
        rest = rest & ~sign
    for chosen, zone in [*groups, (rest, 0)]:
        if not chosen.any():
            continue
        part = text if chosen.all() else text[:, chosen]
        ns, good, leap = _plain_clock(part[: length - zone])
        if zone > 1:
            offset_ns, offset_good = _zone_ns(part[length - zone :])
            ns, good = ns - offset_ns, good & offset_good
        result.ns[chosen], result.readable[chosen], result.leap[chosen] = ns, good, leap
        result.zoned[chosen] = zone > 0
    return result


def _zone_ns(text: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Offsets of (k, n) zones `+hh`, `+hhmm`, `+hh:mm`, and which are readable."""
    minute_rows = {3: [], 5: [3, 4], 6: [4, 5]}[len(text)]
    good = _digits(text, [1, 2, *minute_rows])
    if len(text) == 6:
        good &= text[3] == ord(":")
    value = text & np.uint8(15)
    minutes = _number(value[1:3]) * 60 + (_number(value[minute_rows]) if minute_rows else 0)
    good &= minutes <= 14 * 60
    return np.where(text[0] == ord("-"), -minutes, minutes) * (60 * NS_PER_S), good


def _plain_clock(
    text: NDArray[np.uint8],
) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
    """(n,) nanoseconds of day, readable, leap second, of (k, n) bytes `hh:mm[:ss[.f]]`."""
    length, rows = text.shape
    nothing = np.zeros(rows, np.int64), np.zeros(rows, bool), np.zeros(rows, bool)
    if length not in (5, 8) and length < 10:
        return nothing
    has_seconds = length >= 8
    good = _digits(text, [0, 1, 3, 4]) & (text[2] == ord(":"))
    value = text & np.uint8(15)
    hour, minute = _number(value[:2]), _number(value[3:5])
    good &= (hour < 24) & (minute < 60)
    ns = (hour * 3600 + minute * 60) * NS_PER_S
    if not has_seconds:
        return ns, good, np.zeros(rows, bool)
    good &= _digits(text, [6, 7]) & (text[5] == ord(":"))
    second = _number(value[6:8])
    good &= second <= 60
    leap = second == 60
    ns += (second - leap) * NS_PER_S
    if length > 8:
        good &= (text[8] == ord(".")) | (text[8] == ord(","))
        good &= _digits(text, list(range(9, length)))
        kept = min(length - 9, 9)  # digits beyond the nanosecond are cut off
        ns += _number(value[9 : 9 + kept]) * 10 ** (9 - kept)
    return ns, good, leap & good


def _stamps_of_length(text: NDArray[np.uint8]) -> Stamps:
    length, rows = text.shape
    if length < 16:
        return _unreadable(rows)
    day, clock = _dates_of_length(text[:10]), _clocks_of_length(text[11:])
    between = (text[10] == ord("T")) | (text[10] == ord("t")) | (text[10] == ord(" "))
    return Stamps(
        day.ns + clock.ns, day.readable & clock.readable & between, clock.leap, clock.zoned
    )
