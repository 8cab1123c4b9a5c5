"""A step of whole seconds in the time that is no gap: a leap second, or its correction (E11).

A receiver learns the leap seconds up to 12.5 minutes after its start and then corrects its UTC;
UTC stamps taken for GPS time repeat a second when one is inserted. In a moving recording both
show: time steps by the interval plus k seconds while the position moves on by one interval. Where
nothing moves they look like a gap of k seconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.input_check.judgement import Judged, judged, place
from sbas.recording_survey import Ints, Rows, Tail
from sbas.timescales import GPS_EPOCH_NS, NS_PER_S, gpst_minus_utc_s

MOST_LEAP_S = 18
"""GPST - UTC since 2017: no receiver that starts with an older value is off by more."""
STAMP_TOLERANCE_NS = NS_PER_S // 100
LEAST_MOTION_M = 10.0
"""k seconds of the motion must be this long, or the two explanations cannot be told apart."""
POSITION_TOLERANCE_M = 3.0
MOST_SLOWING_MPS2 = 3.0
"""Emergency braking: nothing on rails or roads waits out a gap and is back at speed faster."""
_ROUND = 3
_M_PER_DEG = 111_195.0

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LeapStep:
    """The step before `row` is the interval plus `seconds`; `moved_m` the way in that step.

    `inserted`: UTC has a leap second there, so that the stamps are UTC.
    """

    row: int
    before_ns: int
    after_ns: int
    seconds: int
    moved_m: float = np.nan
    speed_mps: float = np.nan
    inserted: bool = False


class LeapSteps:
    """Looks for them, from the three epochs on either side of each odd step.

    Parameters
    ----------
    interval_ns : the median step.
    """

    COLUMNS = ("lat_deg", "lon_deg")

    def __init__(self, interval_ns: int) -> None:
        self.interval_ns = interval_ns
        self._found: dict[int, LeapStep] = {}
        self._six = Tail(2 * _ROUND - 1, self.COLUMNS)
        self._one = Tail(1, ())

    @property
    def steps(self) -> tuple[LeapStep, ...]:
        """Those found, in order."""
        return tuple(self._found[row] for row in sorted(self._found))

    def update(self, rows: Rows) -> None:
        self._look_for_inserted_seconds(rows)
        joined, _ = self._six.before(rows)
        odd_ns = np.diff(joined.time_ns) - self.interval_ns
        k = np.rint(odd_ns / NS_PER_S).astype(np.int64)
        odd = (k != 0) & (np.abs(k) <= MOST_LEAP_S)
        odd &= np.abs(odd_ns - k * NS_PER_S) <= STAMP_TOLERANCE_NS
        row = np.flatnonzero(odd) + 1
        row = row[(row >= _ROUND) & (row + _ROUND <= len(joined))]
        if row.size:
            self._judge(joined, row, k[row - 1])

    def _look_for_inserted_seconds(self, rows: Rows) -> None:
        joined, _ = self._one.before(rows)
        time = joined.time_ns
        odd_ns = np.diff(time) - self.interval_ns + NS_PER_S
        back = (np.diff(time) <= 0) & (np.abs(odd_ns) <= STAMP_TOLERANCE_NS)
        row = np.flatnonzero(back) + 1
        for i in row[_at_a_leap_second(time[row])].tolist():
            at = joined.first + i
            self._found[at] = LeapStep(at, int(time[i - 1]), int(time[i]), -1, inserted=True)

    def _judge(self, joined: Rows, row: Ints, k: Ints) -> None:
        """Keep the odd steps over which the position moved on by one interval."""
        time = joined.time_ns
        around = row[:, None] + np.array([-2, -1, 1, 2])
        steps = time[around] - time[around - 1]
        regular = (np.abs(steps - self.interval_ns) <= self.interval_ns // 100 + 1).all(axis=1)
        row, k = row[regular], k[regular]
        interval_s = self.interval_ns / NS_PER_S
        lat, lon = joined.values["lat_deg"], joined.values["lon_deg"]

        def moved(a: Ints, b: Ints) -> Floats:
            east = ((lon[b] - lon[a] + 180) % 360 - 180) * np.cos(np.radians(lat[a]))
            return np.stack([lat[b] - lat[a], east]) * _M_PER_DEG

        before = moved(row - 3, row - 1) / (2 * interval_s)
        after = moved(row, row + 2) / (2 * interval_s)
        jump, mean = moved(row - 1, row), (before + after) / 2
        speed = np.hypot(*mean)
        tolerance = np.maximum(POSITION_TOLERANCE_M, 0.1 * speed * interval_s)
        travelled = speed * np.abs(k)
        # A missing position makes each of these comparisons False.
        one_step = np.hypot(*(jump - mean * interval_s)) <= tolerance
        one_step &= np.hypot(*(after - before)) <= np.maximum(2.0, 0.2 * speed)
        one_step &= (travelled >= LEAST_MOTION_M) & (tolerance <= 0.3 * travelled)
        least = _least_distance_m(np.hypot(*before), np.hypot(*after), interval_s + k)
        # A gap of that length would have taken it farther, however hard it braked.
        no_gap = least - speed * interval_s >= np.maximum(LEAST_MOTION_M, 3 * tolerance)
        for i in np.flatnonzero(one_step & ((k < 0) | no_gap)).tolist():
            at = joined.first + int(row[i])
            step = LeapStep(
                at, int(time[row[i] - 1]), int(time[row[i]]), int(k[i]),
                float(np.hypot(*jump[:, i])), float(speed[i]),
            )  # fmt: skip
            self._found.setdefault(at, step)

    def judgements(self, early_fits: bool = False) -> Iterator[Judged]:
        """E11, once for all steps found.

        Parameters
        ----------
        early_fits : a truth says that the stamps before the first step are the right ones.
        """
        if not self.steps:
            return
        first = self.steps[0]
        inserted = [step for step in self.steps if step.inserted]
        listed = "; ".join(
            f"row {s.row:,}: {s.seconds:+d} s"
            + ("" if s.inserted else f" while it moves {s.moved_m:.3g} m at {s.speed_mps:.3g} m/s")
            for s in self.steps[:5]
        )
        if inserted:
            message = "the stamps repeat a second where UTC has a leap second: they are UTC"
            cure, repair = "--time UTC", {"time": "UTC"}
        else:
            message = "time steps by whole seconds, the position does not: a leap second corrected"
            cure = "--leap-slip fix (the stamps behind the step stand)"
            repair = {"leap_slip": "fix"}
            if early_fits:
                cure = "--leap-slip fix-after (the stamps before it stand: they fit the truth)"
                repair = {"leap_slip": "fix-after"}
        mixed = bool(inserted) and len(inserted) < len(self.steps)
        yield judged(
            "E11", "error", message,
            where=place(first.row, first.after_ns),
            evidence=listed + (f"; {len(self.steps)} in all" if len(self.steps) > 5 else ""),
            cure=cure, repair={} if mixed else repair,
        )  # fmt: skip


def _at_a_leap_second(label_ns: Ints) -> NDArray[np.bool_]:
    """(n,) True where a label lies within 2 s of a leap second, were it UTC."""
    later = np.maximum(label_ns, GPS_EPOCH_NS) + 2 * NS_PER_S
    earlier = np.maximum(label_ns - 2 * NS_PER_S, GPS_EPOCH_NS)
    after, before = (gpst_minus_utc_s(t.view("M8[ns]")) for t in (later, earlier))
    return np.asarray(after != before)


def _least_distance_m(
    v1: NDArray[np.floating[Any]],
    v2: NDArray[np.floating[Any]],
    duration_s: NDArray[np.floating[Any]],
) -> NDArray[np.floating[Any]]:
    """(n,) shortest ways [m] from speeds v1 to v2 [m/s], braking and speeding up at most."""
    a = MOST_SLOWING_MPS2
    braking = np.clip((duration_s + (v1 - v2) / a) / 2, 0, np.maximum(duration_s, 0))
    rest = duration_s - braking
    stopped = v1 - a * braking <= 0
    through = v1 * braking - a * braking**2 / 2 + v2 * rest - a * rest**2 / 2
    return np.where(stopped, (v1**2 + v2**2) / (2 * a), through)
