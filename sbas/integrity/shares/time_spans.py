"""Spans of time: when a state held, exact in integer nanoseconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.integrity.events import Runs
from sbas.timescales import NS_PER_S

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Spans:
    """(k,) disjoint spans of time in order, each [start, end).

    Parameters
    ----------
    start_ns, end_ns : (k,) GPS times [ns]; spans may touch.

    Raises
    ------
    InputError : spans without length, out of order or overlapping.
    """

    start_ns: Ints
    end_ns: Ints

    def __post_init__(self) -> None:
        start, end = self.start_ns, self.end_ns
        if start.shape != end.shape or np.any(end <= start) or np.any(start[1:] < end[:-1]):
            raise InputError("spans of time must have a length, be in order and not overlap")

    def __len__(self) -> int:
        return self.start_ns.size

    @property
    def duration_s(self) -> Floats:
        """(k,) durations [s]."""
        return (self.end_ns - self.start_ns) / NS_PER_S

    @property
    def total_s(self) -> float:
        return float(np.sum(self.end_ns - self.start_ns)) / NS_PER_S

    def until(self, time_s: Floats, origin_ns: int) -> Floats:
        """Time within the spans before each instant [s]; the cumulative sum of the state.

        Parameters
        ----------
        time_s : instants [s] after `origin_ns`.
        origin_ns : GPS time [ns].
        """
        if len(self) == 0:
            return np.zeros(np.shape(time_s))
        edges = np.column_stack([self.start_ns, self.end_ns]).ravel() - origin_ns
        held = np.cumsum(self.duration_s)
        sums = np.column_stack([held - self.duration_s, held]).ravel()
        return np.asarray(np.interp(time_s, edges / NS_PER_S, sums))

    def without(self, inner: Spans) -> Spans:
        """What remains of these spans after others, which lie within them, are taken out."""
        times = np.concatenate([self.start_ns, self.end_ns, inner.start_ns, inner.end_ns])
        steps = np.repeat([1, -1, -1, 1], [len(self), len(self), len(inner), len(inner)])
        edges, where = np.unique(times, return_inverse=True)
        level = np.cumsum(np.bincount(where, steps, minlength=edges.size)[:-1])
        if np.any(level < 0):
            raise InputError("the spans to take out do not lie within the others")
        return Spans(edges[:-1][level > 0], edges[1:][level > 0]).merged(0.0)

    def merged(self, merge_s: float) -> Spans:
        """The spans with those made one that are at most `merge_s` apart."""
        if len(self) == 0:
            return self
        apart = self.start_ns[1:] - self.end_ns[:-1] > round(merge_s * NS_PER_S)
        heads = np.concatenate([[0], np.flatnonzero(apart) + 1])
        tails = np.concatenate([heads[1:] - 1, [len(self) - 1]])
        return Spans(self.start_ns[heads], self.end_ns[tails])


def spans_of_runs(runs: Runs, *, interval_ns: int) -> Spans:
    """The time of runs of epochs: [first epoch, last epoch + dt), never beyond the next run.

    Parameters
    ----------
    runs : runs of epochs, such as `find_runs` gives.
    interval_ns : sampling interval dt [ns].
    """
    end = runs.last_ns + interval_ns
    # Steps shorter than dt (jitter, or a shifted epoch after a gap) must not count twice.
    end[:-1] = np.minimum(end[:-1], runs.start_ns[1:])
    return Spans(runs.start_ns.copy(), end)
