"""SBF files stretch by stretch, in bounded memory, with the same epochs as all at once.

The join to epochs falls apart wherever no time stands on both sides of a place in the file. So
blocks wait until such a place is found some way behind them, and what lies before it is a
segment: its join is that part of the join of the whole file. Where a time comes again beyond
its segment there is no such place, which the first look at the file finds out.
"""

from __future__ import annotations

from bisect import bisect
from collections import deque
from collections.abc import Iterator, Sequence, Set
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from sbas.logs.format import Progress
from sbas.logs.septentrio.sbf_epochs import Index, Stamps
from sbas.logs.septentrio.sbf_parts import Part, Raw, joined, parts_of
from sbas.logs.septentrio.sbf_plan import FRAMES, SATELLITES, epoch_plan, with_needs
from sbas.logs.septentrio.sbf_report import Seen
from sbas.logs.septentrio.sbf_segment import EPOCH_NUMBERS, Segment, decode_part, epoch_table
from sbas.recording import RecordingMeta, with_columns

SEGMENT_BYTES = 16 << 20
_WAITING = 8
"""The last of so many shares of a segment waits for blocks that come late."""
_LONGEST = 4
"""Segments' lengths that a stretch may have before the file is taken as out of order."""
_STRETCHES = 256

_TIMED = (*EPOCH_NUMBERS, *SATELLITES)


class RevisitedTime(Exception):
    """A time comes again farther behind in the file than a segment reaches."""


@dataclass
class Reading:
    """A file read: what it holds, segment by segment, and what was seen on the way.

    Parameters
    ----------
    segments : all of the file.
    seen : counts over all of them.
    frames : fields of the blocks with frames, by number.
    """

    segments: list[Segment]
    seen: Seen
    frames: dict[int, Raw]


def read_all(parts: Iterator[Part], want: Set[str], segment_bytes: int) -> Reading:
    """Decode the parts of a file segment by segment while they come, or else all at once."""
    kept: list[Part] = []

    def recorded() -> Iterator[Part]:
        for part in parts:
            kept.append(part)
            yield part

    try:
        segments, seen = [], Seen()
        for segment in _decoded(recorded(), want, segment_bytes, seen, _KnownTimes()):
            segments.append(segment)
    except RevisitedTime:
        kept.extend(parts)
        whole = joined(kept)
        seen = Seen()
        seen.add_part(whole)
        segments = [decode_part(whole, want)]
        seen.add_segment(segments[0].filled, segments[0].satellites)
    frames = joined([Part({n: p.raw[n] for n in FRAMES if n in p.raw}) for p in kept]).raw
    return Reading(segments, seen, frames)


def survey(parts: Iterator[Part], want: Set[str], segment_bytes: int) -> Seen:
    """Look through the parts of a file as `read_all` does, keeping the counts only.

    Raises
    ------
    RevisitedTime : the file cannot be read segment by segment.
    """
    seen = Seen()
    for _ in _decoded(parts, want, segment_bytes, seen, _KnownTimes()):
        pass
    return seen


@dataclass(frozen=True, eq=False)
class SbfEpochs:
    """Epochs of an SBF file, decoded segment by segment; an EpochSource.

    Parameters
    ----------
    path : the file, which `survey` found to be readable so.
    meta, columns : as of the recording.
    rows, kinds : epochs, and kinds of block, as `survey` found them.
    chunk_bytes, segment_bytes : bytes framed at once, and decoded at once.
    progress : called with bytes done and in all.
    """

    path: Path
    meta: RecordingMeta
    columns: tuple[str, ...]
    rows: int
    kinds: int
    chunk_bytes: int
    segment_bytes: int
    progress: Progress | None = None

    def __len__(self) -> int:
        return self.rows

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Tables of the epochs of a segment each, in file order; see EpochSource."""
        asked = [name for name in self.columns if name in set(columns)]
        want = with_needs(asked)
        parts = parts_of(self.path, epoch_plan(want), self.chunk_bytes, self.progress)
        before_ms = None
        for segment in _decoded(parts, want, self.segment_bytes):
            if len(segment) or not self.rows:
                table = epoch_table(segment, asked, self.kinds, before_ms)
                yield with_columns(table, columns)
            if len(segment):
                before_ms = int(segment.epochs.time_ms[-1])


def _decoded(
    parts: Iterator[Part],
    want: Set[str],
    segment_bytes: int,
    seen: Seen | None = None,
    known: _KnownTimes | None = None,
) -> Iterator[Segment]:
    """Segments of a file, at least one; the next one is decoded while one is at work.

    Parameters
    ----------
    seen : counts to which those of each segment are added.
    known : times so far, where it is not known that none comes again.
    """
    pending: deque[Future[Segment]] = deque()

    def first() -> Segment:
        segment = pending.popleft().result()
        if seen is not None:
            seen.add_segment(segment.filled, segment.satellites)
        return segment

    with ThreadPoolExecutor(1) as pool:
        for part in _segments(parts, segment_bytes):
            if known is not None:
                known.add(part)
            if seen is not None:
                seen.add_part(part)
            pending.append(pool.submit(decode_part, part, want))
            if len(pending) > 1:
                yield first()
        while pending:
            yield first()


def _segments(parts: Iterator[Part], segment_bytes: int) -> Iterator[Part]:
    """Parts cut anew, so that no time stands in two that follow each other."""
    waiting: list[Part] = []
    begin = end = 0
    for part in parts:
        waiting.append(part)
        end = max([end, *(int(stamps.position[-1]) for stamps in _stamps(part))])
        if end - begin < segment_bytes:
            continue
        whole = joined(waiting)
        waiting = [whole]
        share = segment_bytes // _WAITING
        place = _cut(whole, end - share, share)
        if place is None:
            if end - begin > _LONGEST * segment_bytes:
                raise RevisitedTime
            continue
        left, right = whole.cut(place)
        yield left
        waiting, begin = [right], place
    yield joined(waiting)


def _stamps(part: Part) -> list[Stamps]:
    found = [part.stamps(number) for number in _TIMED]
    return [stamps for stamps in found if len(stamps.position)]


def _cut(part: Part, limit: int, window: int) -> int | None:
    """A block's place, at most `limit`, such that no time stands on both sides; else None."""
    stamps = _stamps(part)
    begin = [int(np.searchsorted(s.position, limit - window)) for s in stamps]
    near = _by_place(
        [s.position[at:] for s, at in zip(stamps, begin, strict=True)],
        [s.time_ms[at:] for s, at in zip(stamps, begin, strict=True)],
    )
    earlier = [int(s.time_ms[:at].max()) for s, at in zip(stamps, begin, strict=True) if at]
    if earlier:
        # In a file whose times only increase, all before is earlier than all behind.
        position, time_ms = near
        newest = np.maximum.accumulate(np.concatenate(([max(earlier)], time_ms[:-1])))
        oldest = np.minimum.accumulate(time_ms[::-1])[::-1]
        places = position[(newest < oldest) & (position <= limit)]
        if len(places):
            return int(places[-1])
    position, time_ms = _by_place([s.position for s in stamps], [s.time_ms for s in stamps])
    _, label = np.unique(time_ms, return_inverse=True)
    last = np.empty(len(label), np.int64)
    last[label] = np.arange(len(label))
    reach = np.maximum.accumulate(last[label])
    places = position[1:][(reach[:-1] < np.arange(1, len(label))) & (position[1:] <= limit)]
    return int(places[-1]) if len(places) else None


def _by_place(positions: list[Index], times: list[Index]) -> tuple[Index, Index]:
    position = np.concatenate(positions)
    order = np.argsort(position, kind="stable")
    return position[order], np.concatenate(times)[order]


class _KnownTimes:
    """Spans of time that segments had, to find a time that comes again."""

    def __init__(self) -> None:
        self._spans: list[list[int]] = []
        self._latest: list[int] | None = None

    def add(self, part: Part) -> None:
        """Take note of the times of a segment; RevisitedTime where an earlier one has them."""
        spans = _spans_of(part)
        if any(low <= b and high >= a for low, high in spans for a, b in self._spans):
            raise RevisitedTime
        for low, high in spans:
            at = bisect(self._spans, [low])
            before = self._spans[at - 1] if at else None
            if before is not None and before is self._latest:
                before[1] = high
            else:
                self._latest = [low, high]
                self._spans.insert(at, self._latest)
        if len(self._spans) > _STRETCHES:
            raise RevisitedTime


def _spans_of(part: Part) -> list[list[int]]:
    """Spans of time of a part, in order and apart from each other."""
    found = []
    for stamps in _stamps(part):
        times = stamps.time_ms
        ends = np.append(np.flatnonzero(np.diff(times) < 0), len(times) - 1)
        if len(ends) > _STRETCHES:
            raise RevisitedTime
        begins = np.concatenate(([0], ends[:-1] + 1))
        found += np.column_stack([times[begins], times[ends]]).tolist()
    apart: list[list[int]] = []
    for low, high in sorted(found):
        if apart and low <= apart[-1][1]:
            apart[-1][1] = max(apart[-1][1], high)
        else:
            apart.append([low, high])
    return apart
