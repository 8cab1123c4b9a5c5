"""One-pass, mergeable summaries: what lets a year at 1 Hz pass through bounded memory.

Each takes batches by `update`, joins with another of its kind by `merge`, and gives the same
answer however the record was cut.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

EXACT_VALUES = 1 << 22
"""Values kept as they are (32 MiB); beyond, a distribution goes over to counts on a grid."""
MAX_CELLS = 1 << 20


class Distribution:
    """Order statistics of a stream of finite numbers.

    Exact while at most `EXACT_VALUES` numbers have come; then counts on a grid of `resolution`,
    which doubles whenever more than `MAX_CELLS` cells are occupied. Minimum, maximum, mean and
    count stay exact; `error` bounds the error of a quantile.
    """

    def __init__(self, resolution: float = 1e-3) -> None:
        self.resolution = resolution
        self.count = 0
        self.total = 0.0
        self.min = math.inf
        self.max = -math.inf
        self._kept: list[Floats] = []
        self._cells: NDArray[np.int64] | None = None
        self._counts: NDArray[np.int64] = np.empty(0, np.int64)

    def update(self, values: Floats) -> None:
        """Add (n,) values; those that are not finite are left out."""
        values = values[np.isfinite(values)]
        if values.size == 0:
            return
        self.count += values.size
        self.total += float(values.sum())
        self.min = min(self.min, float(values.min()))
        self.max = max(self.max, float(values.max()))
        if self._cells is None and self.count <= EXACT_VALUES:
            self._kept.append(np.array(values))
            return
        self._to_grid()
        self._add_cells(*_occupied(np.floor(values / self.resolution)))

    def merge(self, other: Distribution) -> None:
        """Add what another distribution has seen."""
        self.total += other.total
        self.count += other.count
        self.min, self.max = min(self.min, other.min), max(self.max, other.max)
        self._kept += other._kept
        if self._cells is None and other._cells is None and self.count <= EXACT_VALUES:
            return
        self._to_grid()
        if other._cells is not None:
            while self.resolution < other.resolution:
                self._coarsen()
            shift = round(math.log2(self.resolution / other.resolution))
            self._add_cells(other._cells >> shift, other._counts)

    def _to_grid(self) -> None:
        if self._cells is None:
            self._cells = np.empty(0, np.int64)
        kept, self._kept = self._kept, []
        for values in kept:
            self._add_cells(*_occupied(np.floor(values / self.resolution)))

    def _coarsen(self) -> None:
        assert self._cells is not None
        self.resolution *= 2
        cells, counts = self._cells >> 1, self._counts
        self._cells = np.empty(0, np.int64)
        self._add_cells(cells, counts)

    def _add_cells(self, cells: NDArray[np.int64], counts: NDArray[np.int64]) -> None:
        assert self._cells is not None
        merged, where = np.unique(np.concatenate([self._cells, cells]), return_inverse=True)
        sums = np.zeros(merged.size, np.int64)
        np.add.at(sums, where, np.concatenate([self._counts if self._cells.size else [], counts]))
        self._cells, self._counts = merged, sums
        while self._cells.size > MAX_CELLS:
            self._coarsen()

    @property
    def error(self) -> float:
        """Largest possible error of a quantile: 0 while exact."""
        return 0.0 if self._cells is None else self.resolution

    @property
    def mean(self) -> float:
        return self.total / self.count if self.count else math.nan

    def quantile(self, q: float) -> float:
        """The q-quantile (linear between order statistics); NaN when nothing has come."""
        if self.count == 0:
            return math.nan
        if self._cells is None:
            return float(np.quantile(np.concatenate(self._kept), q))
        ends = np.cumsum(self._counts)
        rank = q * (self.count - 1)
        low, high = (
            float(self._cells[np.searchsorted(ends, r, side="right")])
            for r in (math.floor(rank), math.ceil(rank))
        )
        middle = low + (rank - math.floor(rank)) * (high - low) + 0.5
        return min(max(middle * self.resolution, self.min), self.max)


def _occupied(cells: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Distinct cells and their counts; by counting where the range is narrow, else by sorting."""
    keys = np.clip(cells, -(2.0**62), 2.0**62).astype(np.int64)
    low = int(keys.min())
    if int(keys.max()) - low < 1 << 24:
        counts = np.bincount(keys - low)
        found = np.flatnonzero(counts)
        return found + low, counts[found]
    distinct, counts = np.unique(keys, return_counts=True)
    return distinct, counts


class ThinnedSeries:
    """Smallest and largest value of each column in equal bins of time: no spike is lost.

    Parameters
    ----------
    begin_ns, end_ns : span of the record [ns].
    columns : names of the quantities.
    bins : number of bins over the span.
    """

    def __init__(self, begin_ns: int, end_ns: int, columns: tuple[str, ...], bins: int) -> None:
        self.begin_ns, self.end_ns = begin_ns, max(end_ns, begin_ns + 1)
        self.columns, self.bins = columns, bins
        self.low = np.full((len(columns), bins), np.nan)
        self.high = np.full((len(columns), bins), np.nan)

    def update(self, time_ns: NDArray[np.int64], values: dict[str, Floats]) -> None:
        """Add (n,) increasing times and (n,) values a column; NaN counts as nothing."""
        if time_ns.size == 0:
            return
        span = self.end_ns - self.begin_ns
        where = ((time_ns - self.begin_ns) / span * self.bins).astype(np.int64)
        where = np.clip(where, 0, self.bins - 1)
        starts = np.flatnonzero(np.diff(where, prepend=-1))
        rows = where[starts]
        for i, name in enumerate(self.columns):
            column = values[name]
            low, high = np.fmin.reduceat(column, starts), np.fmax.reduceat(column, starts)
            self.low[i, rows] = np.fmin(self.low[i, rows], low)
            self.high[i, rows] = np.fmax(self.high[i, rows], high)

    def merge(self, other: ThinnedSeries) -> None:
        """Add a series over the same span."""
        self.low, self.high = np.fmin(self.low, other.low), np.fmax(self.high, other.high)

    @property
    def time(self) -> NDArray[np.datetime64]:
        """(bins,) middles of the bins."""
        step = (self.end_ns - self.begin_ns) / self.bins
        ns: NDArray[Any] = self.begin_ns + ((np.arange(self.bins) + 0.5) * step).astype(np.int64)
        return ns.astype("M8[ns]")

    def band(self, column: str) -> tuple[Floats, Floats]:
        """(bins,) lows and highs of a column; NaN where no value came."""
        i = self.columns.index(column)
        return self.low[i], self.high[i]


class DensityGrid:
    """Counts of points in the plane on a square grid about the origin that grows as it must.

    The cell doubles (up to `MAX_CELL`) until the points fit; what lies farther is counted in
    `outside`.
    """

    SIDE = 256
    MAX_CELL = 64.0

    def __init__(self, cell: float = 0.03125) -> None:
        self.cell = cell
        self.counts = np.zeros((self.SIDE, self.SIDE), np.int64)
        self.outside = 0

    def update(self, x: Floats, y: Floats) -> None:
        """Add (n,) points; those with NaN are left out."""
        known = np.isfinite(x) & np.isfinite(y)
        x, y = x[known], y[known]
        if x.size == 0:
            return
        reach = float(max(np.abs(x).max(), np.abs(y).max()))
        while reach >= self.half_range and self.cell < self.MAX_CELL:
            self._coarsen()
        half = self.SIDE // 2
        column = np.floor(x / self.cell) + half
        row = np.floor(y / self.cell) + half
        inside = (column >= 0) & (column < self.SIDE) & (row >= 0) & (row < self.SIDE)
        self.outside += int(x.size - inside.sum())
        flat = (row[inside] * self.SIDE + column[inside]).astype(np.int64)
        self.counts += np.bincount(flat, minlength=self.SIDE**2).reshape(self.SIDE, self.SIDE)

    def merge(self, other: DensityGrid) -> None:
        """Add another grid's counts."""
        while self.cell < other.cell:
            self._coarsen()
        while other.cell < self.cell:
            other._coarsen()
        self.counts = self.counts + other.counts
        self.outside += other.outside

    def _coarsen(self) -> None:
        quarter, half = self.SIDE // 4, self.SIDE // 2
        small = self.counts.reshape(half, 2, half, 2).sum(axis=(1, 3))
        self.counts = np.zeros_like(self.counts)
        self.counts[quarter : quarter + half, quarter : quarter + half] = small
        self.cell *= 2

    @property
    def half_range(self) -> float:
        """Distance from the origin to the grid's border, in the unit of the points."""
        return self.cell * self.SIDE / 2
