"""What surrounds one event: how things were before, and what changed as it began."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sbas.timescales import NS_PER_S

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

AT_ONCE_STEPS = 2
"""What changed within so many intervals before an event began changed with it; a step in time
longer than that is a gap that parts the event from what was before."""
REFERENCE_S = 300.0
"""Calm epochs within this time before and after an event say how things usually are [s]."""
FOOT_S = 600.0
"""An event's rise is followed back by at most this [s]."""


@dataclass(frozen=True, eq=False)
class EpochArrays:
    """(n,) columns of a recording, NaN or -1 where missing; `calm` epochs belong to no event."""

    time_ns: Ints
    interval_ns: int
    hpl_m: Floats
    hpe_m: Floats
    reference_m: Floats
    hdop: Floats
    n_sv: Ints
    mode: Ints
    k: Floats
    geo_prn: Ints
    age_s: Floats
    environment: Ints
    calm: Bools

    @cached_property
    def after_gap(self) -> Bools:
        """(n,) True where the step from the epoch before is too long to see what happened."""
        step = np.diff(self.time_ns, prepend=self.time_ns[:1])
        return np.asarray(step > AT_ONCE_STEPS * self.interval_ns + self.interval_ns // 2)


@dataclass(frozen=True, eq=False)
class Context:
    """One event: its rows, and those of the calm epochs around it.

    `foot` is the row at which the rise began, `first` and `last` the event's own, `peak` its
    worst.
    """

    arrays: EpochArrays
    foot: int
    first: int
    last: int
    peak: int

    @cached_property
    def calm_before(self) -> Ints:
        """Rows of calm epochs before the rise, within `REFERENCE_S`."""
        return self._calm(self.foot, -1)

    @cached_property
    def calm_around(self) -> Ints:
        """Rows of calm epochs before the rise and after the event."""
        return np.concatenate([self.calm_before, self._calm(self.last, 1)])

    def _calm(self, row: int, side: int) -> Ints:
        time = self.arrays.time_ns
        reach = round(REFERENCE_S * NS_PER_S)
        if side < 0:
            low = int(np.searchsorted(time, time[row] - reach, side="left"))
            rows = np.arange(low, row)
        else:
            high = int(np.searchsorted(time, time[row] + reach, side="right"))
            rows = np.arange(row + 1, high)
        return rows[self.arrays.calm[rows]]

    @property
    def begins_after_gap(self) -> bool:
        """True when the rise begins with the first epoch after a gap."""
        return bool(self.arrays.after_gap[self.foot])

    @property
    def gap_s(self) -> float:
        """Length of the step before the rise [s]."""
        time = self.arrays.time_ns
        return float(time[self.foot] - time[max(self.foot - 1, 0)]) / NS_PER_S

    def usual(self, values: Floats) -> float:
        """Median of a column over the calm epochs around; NaN where none is known."""
        around = values[self.calm_around]
        around = around[np.isfinite(around)]
        return float(np.median(around)) if around.size else float("nan")

    def changed(self, codes: Ints) -> tuple[int, int] | None:
        """(before, at the peak) of a state that changed as the event began and differs at its
        peak; None where it did not, or is not known.

        Parameters
        ----------
        codes : (n,) a state, -1 where it is missing.
        """
        time = self.arrays.time_ns
        earliest = time[self.foot] - AT_ONCE_STEPS * self.arrays.interval_ns
        row = int(np.searchsorted(time, earliest))
        reach = round(REFERENCE_S * NS_PER_S)
        earlier = codes[int(np.searchsorted(time, time[self.foot] - reach)) : row]
        known = earlier[earlier >= 0]
        at_peak = int(codes[self.peak])
        if known.size == 0 or at_peak < 0 or known[-1] == at_peak:
            return None
        return int(known[-1]), at_peak

    def fewer(self, counts: Ints) -> tuple[int, int] | None:
        """(usual, at the peak) of a count that is lower at the peak than at the calm epochs, the
        last one before the rise or most of those around; None where it is not, or not known.

        Parameters
        ----------
        counts : (n,) a count, -1 where it is missing.
        """
        at_peak = int(counts[self.peak])
        around = counts[self.calm_around]
        around = around[around >= 0]
        if at_peak < 0 or around.size == 0:
            return None
        usual = math.floor(float(np.median(around)))
        if self.calm_before.size:
            usual = max(usual, int(counts[self.calm_before[-1]]))
        return (usual, at_peak) if at_peak < usual else None


def rise_begins(signal: Floats, first: int, arrays: EpochArrays, *, calm_below: float) -> int:
    """Row at which the rise to an event began, not beyond a gap nor `FOOT_S`.

    Parameters
    ----------
    signal : (n,) what rose, such as HPL over its usual value.
    first : first row of the event.
    calm_below : the rise is followed back while the signal is above this.
    """
    row = first
    earliest = arrays.time_ns[first] - round(FOOT_S * NS_PER_S)
    while (
        row > 0
        and not arrays.after_gap[row]
        and signal[row - 1] > calm_below
        and arrays.time_ns[row - 1] >= earliest
    ):
        row -= 1
    return row
