"""Protection levels counted finely by mode: what another K would do, without a second look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.recording import MODES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEVEL_STEP = 5e-4
"""Ratio less 1 of successive edges [1]: at 6 sigma a level off by it changes a risk by 2 %."""
_EDGES = np.exp(np.arange(np.log(1e-2), np.log(1e5), LEVEL_STEP))


@dataclass(frozen=True, eq=False)
class LevelPairs:
    """Distinct pairs of K and bin, (c,) each.

    `lower_m`, `upper_m` are the edges of the bin [m], `epochs` how many lie in it, `fresh` how
    many of them follow on no level of the same K, `rises` the same and epochs that follow on a
    lower level, less those that are followed by a higher one.
    """

    k: Floats
    lower_m: Floats
    upper_m: Floats
    epochs: Ints
    fresh: Ints
    rises: Ints
    _falls: Ints

    def rises_below(self, limit_m: float) -> Ints:
        """(c,) rises of a chance that is 0 from a level on [m]: passing it is a rise as well.

        A level that comes down below the limit, or goes up past it, counts in the highest bin
        below: more than its part, the safe side.
        """
        below = self.lower_m < limit_m
        rises = np.where(below, self.rises, 0)
        for k in np.unique(self.k[below]):
            mine = np.flatnonzero(below & (self.k == k))
            up, down = self.rises[mine] - self.fresh[mine], self._falls[mine]
            rises[mine[np.argmax(self.lower_m[mine])]] += down.sum() - up.sum()
        return rises


@dataclass(frozen=True, eq=False)
class LevelCounts:
    """Epochs with a level, by mode and size, and how the level moved from epoch to epoch.

    Parameters
    ----------
    counts : (m + 1, b) epochs of each of `MODES` (the last row: no mode stated) with a level
        in each bin; levels outside 1 cm to 100 km lie in the first and the last.
    fresh : (m + 1, b) those that follow on no level of the same mode (a gap, a missing one).
    ups, downs : (m + 1, b) moves to a higher, a lower level that end in the bin, less those
        that begin in it.
    epochs : all epochs of the record, with a level or not.
    """

    counts: Ints
    fresh: Ints
    ups: Ints
    downs: Ints
    epochs: int

    @property
    def upper_m(self) -> Floats:
        """(b,) upper edge of each bin [m]: the level its epochs count with, on the safe side."""
        return np.append(_EDGES, np.inf)

    @property
    def lower_m(self) -> Floats:
        """(b,) lower edge of each bin [m]."""
        return np.append(0.0, _EDGES)

    def by_k(self, k_of_mode: Floats) -> LevelPairs:
        """Pairs of K and bin that occur.

        Parameters
        ----------
        k_of_mode : (m + 1,) K of each mode, NaN where unknown: those epochs are left out.
        """
        mode, bin_ = np.nonzero(self.counts)
        known = np.isfinite(k_of_mode[mode])
        at = mode[known], bin_[known]
        fresh = self.fresh[at]
        return LevelPairs(
            k_of_mode[at[0]], self.lower_m[at[1]], self.upper_m[at[1]], self.counts[at],
            fresh, fresh + self.ups[at], self.downs[at],
        )  # fmt: skip

    def share_below(self, limit_m: float, factor_of_mode: Floats) -> float:
        """Share of all epochs whose level, times a factor, is below an alert limit.

        Parameters
        ----------
        limit_m : horizontal alert limit [m].
        factor_of_mode : (m + 1,) factor of each mode's levels, such as the railway's K over the
            mode's own; NaN where unknown: those epochs count as above.
        """
        mode, bin_ = np.nonzero(self.counts)
        # Every level of a bin lies below its upper edge; what is unknown compares as false.
        below = self.upper_m[bin_] * factor_of_mode[mode] <= limit_m
        return float(self.counts[mode[below], bin_[below]].sum()) / max(self.epochs, 1)


_NONE = -1


class LevelCounter:
    """Counts batches to `LevelCounts`.

    Parameters
    ----------
    max_step_ns : a longer step is a gap: the epoch after it follows on none [ns].
    """

    def __init__(self, max_step_ns: int) -> None:
        shape = (len(MODES) + 1, _EDGES.size + 1)
        self._max_step_ns = max_step_ns
        self._sums = {name: np.zeros(shape, np.int64) for name in ("all", "fresh", "up", "down")}
        self._epochs = 0
        self._first: tuple[int, int, int] | None = None
        self._last = (0, _NONE, _NONE)

    def update(self, time_ns: Ints, hpl_m: Floats, mode_codes: NDArray[np.int8]) -> None:
        """Count (n,) epochs: times [ns], levels [m] (NaN where there is none), modes (-1: none)."""
        if not time_ns.shape == hpl_m.shape == mode_codes.shape:
            raise InputError("times, levels and modes differ in length")
        if time_ns.size == 0:
            return
        # A level on an edge belongs to the bin above, as "HPL < AL" demands.
        bins = np.searchsorted(_EDGES, hpl_m, side="right")
        bins[~np.isfinite(hpl_m)] = _NONE
        rows = mode_codes.astype(np.int64) % (len(MODES) + 1)
        if self._first is None:
            self._first = (int(time_ns[0]), int(bins[0]), int(rows[0]))
        last_ns, last_bin, last_row = self._last
        before = np.concatenate([[last_bin], bins[:-1]])
        row_before = np.concatenate([[last_row], rows[:-1]])
        steps = np.diff(time_ns, prepend=last_ns)
        self._add(bins, rows, before, row_before, steps)
        self._epochs += time_ns.size
        self._last = (int(time_ns[-1]), int(bins[-1]), int(rows[-1]))

    def _add(self, bins: Ints, rows: Ints, before: Ints, row_before: Ints, steps: Ints) -> None:
        known = bins != _NONE
        follows = known & (before != _NONE) & (row_before == rows) & (steps <= self._max_step_ns)
        self._count("all", rows[known], bins[known])
        self._count("fresh", rows[known & ~follows], bins[known & ~follows])
        for name, moved in (("up", bins > before), ("down", bins < before)):
            moved &= follows
            self._count(name, rows[moved], bins[moved])
            self._count(name, rows[moved], before[moved], -1)

    def _count(self, name: str, rows: Ints, bins: Ints, sign: int = 1) -> None:
        np.add.at(self._sums[name], (rows, bins), sign)

    def merge(self, other: LevelCounter) -> None:
        """Add the counts of the part of the record that follows."""
        for name, sums in self._sums.items():
            sums += other._sums[name]
        if other._first is not None:
            # Its first epoch counted as fresh: what it really follows on is known only here.
            time, bin_, row = other._first
            if bin_ != _NONE:
                self._sums["all"][row, bin_] -= 1
                self._sums["fresh"][row, bin_] -= 1
                last_ns, last_bin, last_row = self._last
                one = (np.array([value]) for value in
                       (bin_, row, last_bin, last_row, time - last_ns))  # fmt: skip
                self._add(*one)
            self._first = self._first or other._first
            self._last = other._last
        self._epochs += other._epochs

    def result(self) -> LevelCounts:
        sums = self._sums
        return LevelCounts(sums["all"], sums["fresh"], sums["up"], sums["down"], self._epochs)
