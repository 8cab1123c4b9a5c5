"""Dates before GNSS receivers, in the future, or off by a rollover of the week number (E22)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sbas.input_check.judgement import Judged, judged, stamp
from sbas.recording_survey import Survey
from sbas.timescales import GPS_EPOCH_NS, NS_PER_S, WEEK_S, gps_to_utc, gpst_minus_utc_s
from sbas.truth import Trajectory, Truth

FIRST_DATE_NS = int(np.datetime64("1999-01-01", "ns").astype(np.int64))
"""No SBAS was received before."""
ROLLOVER_WEEKS = 1024
ROLLOVER_NS = ROLLOVER_WEEKS * WEEK_S * NS_PER_S
_CANDIDATES = (ROLLOVER_WEEKS, 2 * ROLLOVER_WEEKS, -ROLLOVER_WEEKS, -2 * ROLLOVER_WEEKS)


def dates(
    facts: Survey,
    *,
    min_ns: int,
    max_ns: int,
    leap_seconds: int | None,
    truth: Truth | None,
    today: np.datetime64,
) -> Iterator[Judged]:
    """E22 from the clock, from the leap seconds that the source states, and from a trajectory.

    Parameters
    ----------
    facts : of the recording.
    min_ns, max_ns : its earliest and latest time [ns].
    leap_seconds : GPST - UTC as the source states it, if it does.
    truth : a trajectory's dates tell which rollover fits.
    today : the clock's date.
    """
    last_ns = int((today + np.timedelta64(2, "D")).astype("M8[ns]").astype(np.int64))

    def fits(weeks: int) -> bool:
        shift = weeks * WEEK_S * NS_PER_S
        return min_ns + shift >= FIRST_DATE_NS and max_ns + shift < last_ns

    known = [w for w in _CANDIDATES if fits(w) and _agrees(min_ns, max_ns, w, truth)]
    where = f"recording runs {stamp(min_ns)} to {stamp(max_ns)} GPST"
    if fits(0) and _agrees(min_ns, max_ns, 0, truth):
        if leap_seconds is not None and (weeks := _leaps_fit(min_ns, leap_seconds, known)):
            yield judged(
                "E22", "error", "the source's leap seconds belong to another date",
                where=where,
                evidence=f"it states {leap_seconds} s, that date has {_leaps(min_ns)} s, the date "
                f"{weeks:+d} weeks later has {leap_seconds} s",
                cure=f"--week-rollover {weeks}",
                repair={"week_rollover": weeks},
            )  # fmt: skip
        return
    inside = fits(0)
    if inside and not known:
        return
    if inside:
        what = "the recording's dates are a week rollover away from the truth's"
    elif min_ns < FIRST_DATE_NS and max_ns >= FIRST_DATE_NS:
        what = "some dates lie before 1999"
    else:
        what = "the dates lie before 1999" if max_ns < FIRST_DATE_NS else "dates lie in the future"
    candidates = ", ".join(
        f"{w:+d} weeks: {stamp(min_ns + w * WEEK_S * NS_PER_S)[:10]}" for w in known
    )
    yield judged(
        "E22", "error", what,
        where=where,
        evidence=f"today is {today.astype('M8[D]')}; "
        + (f"a week rollover would explain it, {candidates}" if known else "no rollover fits"),
        cure=f"--week-rollover {known[0]}" if known else
        "leave out what the receiver wrote before its first fix, or correct the date column",
        # Receivers fall behind, never ahead: a later date than the right one has another cause.
        repair={"week_rollover": known[0]} if len(known) == 1 and known[0] > 0 else {},
    )  # fmt: skip


def _agrees(min_ns: int, max_ns: int, weeks: int, truth: Truth | None) -> bool:
    """Whether the shifted recording shares time with a trajectory; without one it may."""
    if not isinstance(truth, Trajectory):
        return True
    shift = weeks * WEEK_S * NS_PER_S
    begin, end = truth.table.index.to_numpy()[[0, -1]].astype(np.int64).tolist()
    return bool(min_ns + shift <= end and max_ns + shift >= begin)


def _leaps(gps_ns: int) -> int:
    utc = gps_to_utc(np.array([gps_ns], np.int64).view("M8[ns]"))
    return int(gpst_minus_utc_s(utc)[0])


def _leaps_fit(min_ns: int, stated: int, candidates: list[int]) -> int:
    """The one rollover after which the date has the stated leap seconds; 0 where none has."""
    if min_ns < GPS_EPOCH_NS or _leaps(min_ns) == stated:
        return 0
    fitting = [w for w in candidates if _leaps(min_ns + w * WEEK_S * NS_PER_S) == stated]
    return fitting[0] if len(fitting) == 1 else 0
