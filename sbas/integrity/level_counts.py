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
class LevelCounts:
    """Epochs with a level, by mode and size.

    Parameters
    ----------
    counts : (m + 1, b) epochs of each of `MODES` (the last row: no mode stated) with a level
        in each bin; levels outside 1 cm to 100 km lie in the first and the last.
    epochs : all epochs of the record, with a level or not.
    """

    counts: Ints
    epochs: int

    @property
    def upper_m(self) -> Floats:
        """(b,) upper edge of each bin [m]: the level its epochs count with, on the safe side."""
        return np.append(_EDGES, np.inf)

    @property
    def lower_m(self) -> Floats:
        """(b,) lower edge of each bin [m]."""
        return np.append(0.0, _EDGES)

    def by_k(self, k_of_mode: Floats) -> tuple[Floats, Floats, Floats, Ints]:
        """Distinct pairs of K and bin: (c,) K [1], (c,) edges of the bin [m], (c,) epochs in it.

        Parameters
        ----------
        k_of_mode : (m + 1,) K of each mode, NaN where unknown: those epochs are left out.
        """
        mode, bin_ = np.nonzero(self.counts)
        known = np.isfinite(k_of_mode[mode])
        mode, bin_ = mode[known], bin_[known]
        return k_of_mode[mode], self.lower_m[bin_], self.upper_m[bin_], self.counts[mode, bin_]

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


class LevelCounter:
    """Counts batches to `LevelCounts`."""

    def __init__(self) -> None:
        self.counts = np.zeros((len(MODES) + 1, _EDGES.size + 1), np.int64)
        self.epochs = 0

    def update(self, hpl_m: Floats, mode_codes: NDArray[np.int8]) -> None:
        """Count (n,) levels [m], NaN where there is none, with their modes, -1 where unstated."""
        if hpl_m.shape != mode_codes.shape:
            raise InputError("levels and modes differ in length")
        self.epochs += hpl_m.size
        known = np.isfinite(hpl_m)
        # A level on an edge belongs to the bin above, as "HPL < AL" demands.
        bin_ = np.searchsorted(_EDGES, hpl_m[known], side="right")
        rows = mode_codes[known].astype(np.int64) % (len(MODES) + 1)
        flat = np.bincount(rows * self.counts.shape[1] + bin_, minlength=self.counts.size)
        self.counts += flat.reshape(self.counts.shape)

    def merge(self, other: LevelCounter) -> None:
        """Add the counts of another part of the record."""
        self.counts += other.counts
        self.epochs += other.epochs

    def result(self) -> LevelCounts:
        return LevelCounts(self.counts, self.epochs)
