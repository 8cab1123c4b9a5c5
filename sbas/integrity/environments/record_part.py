"""A part of a record, such as the epochs of one environment, as rows and as time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.integrity.correlation.error_grid import ErrorGrid, room
from sbas.integrity.events import Runs
from sbas.integrity.shares.time_spans import Spans

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class RecordPart:
    """Stretches of successive epochs, and the time that belongs to them.

    Parameters
    ----------
    first, stop : (s,) rows of the record, each stretch [first, stop).
    start_ns, end_ns : (s,) GPS times [ns], each stretch [start, end): from its first epoch to the
        first of the next stretch, so that a gap belongs to the epoch before it; the last stretch
        of a record ends one interval after its last epoch. The parts of a record share its rows
        and its time without overlap and without rest.
    """

    first: Ints
    stop: Ints
    start_ns: Ints
    end_ns: Ints

    @classmethod
    def of_all(cls, runs: Runs, interval_ns: int) -> RecordPart:
        """The whole record that some runs were found in."""
        ends = ([0], [runs.rows], [runs.begin_ns], [runs.end_ns + interval_ns])
        return cls(*(np.array(end, np.int64) for end in ends))

    @property
    def rows(self) -> int:
        return int(np.sum(self.stop - self.first))

    @property
    def spans(self) -> Spans:
        """The time of the part, gaps included."""
        return Spans(self.start_ns, self.end_ns)

    def rows_between(self, first: Ints, stop: Ints) -> Ints:
        """(k,) how many of the rows [first, stop) belong to the part."""
        return _before(stop, self.first, self.stop) - _before(first, self.first, self.stop)

    def ns_between(self, start_ns: Ints, end_ns: Ints) -> Ints:
        """(k,) how much of the time [start, end) belongs to the part [ns]."""
        before_end = _before(end_ns, self.start_ns, self.end_ns)
        return before_end - _before(start_ns, self.start_ns, self.end_ns)

    def holds(self, row: Ints) -> Bools:
        """(k,) True where a row belongs to the part."""
        within: Bools = self.rows_between(row, row + 1) > 0
        return within

    def grid_of(self, grid: ErrorGrid) -> ErrorGrid | Refusal:
        """The cells of the part's time, cut to their extent, with all others missing."""
        step = grid.step_ns
        cells = grid.values.shape[1]
        edges = (np.stack([self.start_ns, self.end_ns]) - grid.begin_ns + step // 2) // step
        # Two stretches that begin in one cell leave it to the later one, as its value is.
        begin, end = np.clip(edges, 0, cells)
        begin, end = begin[end > begin], end[end > begin]
        if begin.size == 0:
            return Refusal("its epochs have no time of their own on the regular grid of the record")
        low, high = int(begin[0]), int(end[-1])
        steps = np.zeros(high - low + 1, np.int8)
        np.add.at(steps, begin - low, 1)
        np.add.at(steps, end - low, -1)
        outside = np.cumsum(steps[:-1], dtype=np.int8) == 0
        values = room((2, high - low))
        values[:] = grid.values[:, low:high]
        values[:, outside] = np.nan
        hpl = None
        if grid.hpl_m is not None:
            hpl = room((high - low,))
            hpl[:] = grid.hpl_m[low:high]
            hpl[outside] = np.nan
        modes = None if grid.modes is None else grid.modes[low:high]
        return ErrorGrid(values, step, grid.begin_ns + low * step, hpl, modes)


def _before(at: Ints, start: Ints, end: Ints) -> Ints:
    """(k,) length of the disjoint intervals [start, end), in order, that lies before each point."""
    length = end - start
    held = np.cumsum(length) - length
    i = np.searchsorted(start, at, side="right") - 1
    inside = np.minimum(at, end[i]) - start[i]
    return np.where(i < 0, 0, held[i] + inside)


def shared(a: Spans, b: Spans) -> Spans:
    """The time that lies in the spans of both."""
    times = np.concatenate([a.start_ns, a.end_ns, b.start_ns, b.end_ns])
    steps = np.repeat([1, -1, 1, -1], [len(a), len(a), len(b), len(b)])
    edges, where = np.unique(times, return_inverse=True)
    level = np.cumsum(np.bincount(where, steps, minlength=edges.size)[:-1])
    return Spans(edges[:-1][level > 1.5], edges[1:][level > 1.5]).merged(0.0)
