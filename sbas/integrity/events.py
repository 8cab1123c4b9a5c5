"""Events: runs of consecutive epochs, found batch by batch and joined across their borders.

Epochs are not events: a rate counts events. A run ends at an epoch that does not satisfy the
condition, at a gap and at the record's end; where its true end was not seen it is censored.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sbas.timescales import NS_PER_S

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Stretch:
    """The epochs of one batch: their (n,) increasing times and the longest step within a run."""

    time_ns: Ints
    max_step_ns: int

    @cached_property
    def gap_before(self) -> Bools:
        """(n,) True where the step to the epoch before is a gap; the first epoch is False."""
        return np.diff(self.time_ns, prepend=self.time_ns[:1]) > self.max_step_ns


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs in a stretch of a record, and what is needed to join it with the next one.

    `first`, `last` are rows counted from the stretch's start; `cut_start`, `cut_end` are True
    where the epoch beyond that end is absent (gap, record end) or cannot be judged.
    """

    first: Ints
    last: Ints
    start_ns: Ints
    last_ns: Ints
    cut_start: Bools
    cut_end: Bools
    rows: int
    begin_ns: int
    end_ns: int
    begin_judged: bool
    end_judged: bool
    max_step_ns: int

    def __len__(self) -> int:
        return self.first.size


def find_runs(index: Ints, stretch: Stretch, judged: Bools | None = None) -> Runs:
    """Runs of consecutive epochs among the (m,) increasing rows `index` of a stretch.

    Parameters
    ----------
    index : rows that satisfy the condition.
    stretch : the batch's epochs, at least one.
    judged : (n,) False where the condition cannot be judged; None when it always can.
    """
    time, rows = stretch.time_ns, stretch.time_ns.size
    gap = stretch.gap_before
    breaks = np.flatnonzero((np.diff(index) > 1) | gap[index[1:]])
    first = index[np.concatenate([[0], breaks + 1])] if index.size else index
    last = index[np.concatenate([breaks, [index.size - 1]])] if index.size else index
    seen = np.ones(rows, bool) if judged is None else judged
    before = np.maximum(first - 1, 0)
    after = np.minimum(last + 1, rows - 1)
    return Runs(
        first,
        last,
        time[first],
        time[last],
        (first == 0) | gap[first] | ~seen[before],
        (last == rows - 1) | gap[after] | ~seen[after],
        rows,
        int(time[0]),
        int(time[-1]),
        bool(seen[0]),
        bool(seen[-1]),
        stretch.max_step_ns,
    )


def join_runs(a: Runs, b: Runs) -> Runs:
    """Runs of a stretch and the one that follows it, as if they had never been parted."""
    together = b.begin_ns - a.end_ns <= a.max_step_ns
    a_touches = len(a) > 0 and a.last[-1] == a.rows - 1
    b_touches = len(b) > 0 and b.first[0] == 0
    a_cut, b_cut = a.cut_end.copy(), b.cut_start.copy()
    if together and a_touches:
        a_cut[-1] = not b.begin_judged
    if together and b_touches:
        b_cut[0] = not a.end_judged
    # A run that goes on: a's last loses its end, b's first its start.
    fused = int(together and a_touches and b_touches)
    keep_a = len(a) - fused
    return Runs(
        np.concatenate([a.first, b.first[fused:] + a.rows]),
        np.concatenate([a.last[:keep_a], b.last + a.rows]),
        np.concatenate([a.start_ns, b.start_ns[fused:]]),
        np.concatenate([a.last_ns[:keep_a], b.last_ns]),
        np.concatenate([a.cut_start, b_cut[fused:]]),
        np.concatenate([a_cut[:keep_a], b.cut_end]),
        a.rows + b.rows,
        a.begin_ns,
        b.end_ns,
        a.begin_judged,
        b.end_judged,
        a.max_step_ns,
    )


@dataclass(frozen=True, eq=False)
class Events:
    """(k,) events: start, end (exclusive) and whether an end was not seen.

    The duration of a censored event is a lower bound.
    """

    start_ns: Ints
    end_ns: Ints
    censored: Bools

    def __len__(self) -> int:
        return self.start_ns.size

    @property
    def duration_s(self) -> NDArray[np.float64]:
        """(k,) durations [s]."""
        return (self.end_ns - self.start_ns) / NS_PER_S


def find_events(
    runs: Runs, *, interval_ns: int, merge_s: float = 0.0, minimum_s: float = 0.0
) -> Events:
    """Events from runs: merged first, then those of at least a duration kept.

    Parameters
    ----------
    runs : runs of bad epochs of the whole record.
    interval_ns : sampling interval dt [ns]; an event is [first epoch, last epoch + dt).
    merge_s : runs with start - previous end <= merge_s are one event [s].
    minimum_s : shorter events are dropped [s], such as the time to alert; within half an
        interval of it counts as reached, since stamps jitter; a censored one is kept whatever
        its length, since it may have lasted longer than was seen.
    """
    start, end = runs.start_ns, runs.last_ns + interval_ns
    cut = runs.cut_start | runs.cut_end
    if start.size:
        apart = start[1:] - end[:-1] > round(merge_s * NS_PER_S)
        heads = np.concatenate([[0], np.flatnonzero(apart) + 1])
        tails = np.concatenate([heads[1:] - 1, [start.size - 1]])
        start, end = start[heads], end[tails]
        cut = np.logical_or.reduceat(cut, heads)
    long_enough = (end - start + interval_ns // 2 >= round(minimum_s * NS_PER_S)) | cut
    return Events(start[long_enough], end[long_enough], cut[long_enough])
