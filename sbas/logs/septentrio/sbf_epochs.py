"""Blocks of one epoch belong together: the outer join of SBF blocks on week and time of week."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.timescales import GPS_EPOCH_NS, WEEK_S

_WEEK_MS = WEEK_S * 1000
_LAST_WEEK = 14_000
"""Weeks beyond (year 2248) do not fit datetime64[ns]; they count as no time."""

Index = NDArray[np.int64]


def block_times(tow_ms: NDArray[np.uint32], week: NDArray[np.uint16]) -> Index:
    """(n,) GPS time since 1980-01-06 [ms], -1 where a block has no usable time."""
    time_ms = week.astype(np.int64) * _WEEK_MS + tow_ms
    unusable = (tow_ms >= _WEEK_MS) | (week >= _LAST_WEEK)
    if unusable.any():
        time_ms[unusable] = -1
    return time_ms


def gps_times(time_ms: Index) -> NDArray[np.datetime64]:
    """(n,) datetime64[ns] of (n,) GPS times since 1980-01-06 [ms]."""
    return (time_ms * 1_000_000 + GPS_EPOCH_NS).view("M8[ns]")


@dataclass(frozen=True)
class Stamps:
    """Where and when the blocks of one number are: (n,) place in the file, (n,) time [ms]."""

    position: Index
    time_ms: Index


@dataclass(frozen=True)
class Epochs:
    """Rows of the epoch table, in the order in which they first appear in the file.

    Parameters
    ----------
    time_ms : (rows,) GPS time since 1980-01-06 [ms].
    first : (rows,) place in the file of the first block of each.
    row_of : block number -> (n,) row of each of its blocks, -1 for a block that makes no row;
        `None` where block i is row i throughout.
    duplicate : (rows,) whether an earlier row has the same time, or `None` where none has.
    """

    time_ms: Index
    first: Index
    row_of: Mapping[int, Index | None]
    duplicate: NDArray[np.bool_] | None


def join(stamps: Mapping[int, Stamps], closing: int) -> Epochs:
    """Join blocks of several numbers to epochs.

    Blocks with the same time are one epoch wherever they lie, unless a block number occurs twice
    at that time. Then the epoch is there twice, as in two logs joined to one file: each run of
    blocks is a row of its own, so that no row mixes values of the two.

    Parameters
    ----------
    stamps : block number -> places and times of its blocks, in file order.
    closing : number of the block that closes an epoch (EndOfPVT); makes no row by itself.
    """
    present = {number: s for number, s in stamps.items() if len(s.time_ms)}
    if not any(number != closing for number in present):
        nothing: Index = np.empty(0, np.int64)
        no_row = {number: np.full(len(s.time_ms), -1) for number, s in stamps.items()}
        return Epochs(nothing, nothing, no_row, None)
    epochs = _join_ordered(present, closing) or _join_any(present, closing)
    absent = {number: np.empty(0, np.int64) for number in stamps if number not in present}
    return replace(epochs, row_of={**absent, **epochs.row_of})


def _join_ordered(stamps: Mapping[int, Stamps], closing: int) -> Epochs | None:
    """The join where each number's times only increase and rows come in order; else None."""
    if not all((np.diff(s.time_ms) > 0).all() for s in stamps.values()):
        return None
    own = [s.time_ms for number, s in stamps.items() if number != closing]
    longest = max(own, key=len)
    other = [times for times in own if not np.array_equal(times, longest)]
    time_ms = np.unique(np.concatenate([longest, *other])) if other else longest
    row_of: dict[int, Index | None] = {}
    first = np.full(len(time_ms), np.iinfo(np.int64).max)
    for number, s in stamps.items():
        if len(s.time_ms) == len(time_ms) and np.array_equal(s.time_ms, time_ms):
            row_of[number] = None
            if number != closing:
                first = np.minimum(first, s.position)
            continue
        row = np.searchsorted(time_ms, s.time_ms)
        if number == closing:
            near = np.minimum(row, len(time_ms) - 1)
            row_of[number] = np.where(time_ms[near] == s.time_ms, near, -1)
        else:
            row_of[number] = row
            first[row] = np.minimum(first[row], s.position)
    return Epochs(time_ms, first, row_of, None) if (np.diff(first) > 0).all() else None


def _join_any(stamps: Mapping[int, Stamps], closing: int) -> Epochs:
    """The join for any order, with times that come again."""
    numbers = list(stamps)
    position = np.concatenate([stamps[number].position for number in numbers])
    order = np.argsort(position, kind="stable")
    time = np.concatenate([stamps[number].time_ms for number in numbers])[order]
    kind = np.repeat(np.arange(len(numbers)), [len(stamps[n].time_ms) for n in numbers])[order]
    _, time_id = np.unique(time, return_inverse=True)
    pair, count = np.unique(time_id * len(numbers) + kind, return_counts=True)
    twice = np.zeros(time_id.max() + 1, np.bool_)
    twice[pair[count > 1] // len(numbers)] = True

    closes = kind == (numbers.index(closing) if closing in numbers else -1)
    begins = np.ones(len(time), np.bool_)
    begins[1:] = (np.diff(time) != 0) | closes[:-1]
    run = np.cumsum(begins) - 1
    split = _split_repeats(run, kind, len(numbers))
    # One group a time, or a group a run where the time is there twice.
    group = np.where(twice[time_id], time_id.max() + 1 + split, time_id)
    makes_row = np.zeros(group.max() + 1, np.bool_)
    makes_row[group[~closes]] = True
    kept = np.flatnonzero(makes_row[group])
    groups, first = np.unique(group[kept], return_index=True)
    by_place = np.argsort(first, kind="stable")
    row_of_group = np.full(len(makes_row), -1, np.int64)
    row_of_group[groups[by_place]] = np.arange(len(groups))
    row = np.empty(len(time), np.int64)
    row[order] = row_of_group[group]
    time_ms = time[kept][first[by_place]]
    ends = np.cumsum([len(stamps[number].time_ms) for number in numbers])
    row_of: dict[int, Any] = dict(zip(numbers, np.split(row, ends[:-1]), strict=True))
    duplicate = np.ones(len(time_ms), np.bool_)
    duplicate[np.unique(time_ms, return_index=True)[1]] = False
    return Epochs(time_ms, position[order][kept][first[by_place]], row_of, duplicate)


def _split_repeats(run: Index, kind: Index, kinds: int) -> Index:
    """(n,) runs split further wherever a kind of block comes again within one."""
    pair, count = np.unique(run * kinds + kind, return_counts=True)
    again = np.unique(pair[count > 1] // kinds)
    begins = np.zeros(len(run), np.bool_)
    seen: set[int] = set()
    last = -1
    # Only runs with repeats are walked; they are as rare as two logs written at once.
    for i in np.flatnonzero(np.isin(run, again)).tolist():
        if run[i] != last or int(kind[i]) in seen:
            begins[i] = run[i] == last
            last, seen = run[i], set()
        seen.add(int(kind[i]))
    starts = np.concatenate(([True], np.diff(run) != 0)) | begins
    split: Index = np.cumsum(starts) - 1
    return split
