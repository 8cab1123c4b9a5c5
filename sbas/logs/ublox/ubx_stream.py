"""Frames to rows, chunk by chunk: the way that a log and messages as hex in CSV have in common."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.logs.ublox import ubx_messages as ubx
from sbas.logs.ublox.ubx_epochs import KINDS, Open, assemble
from sbas.logs.ublox.ubx_frames import SbasFrames, Timed, frame_table, sbas_frames
from sbas.logs.ublox.ubx_framing import Frames
from sbas.logs.ublox.ubx_leftovers import Leftovers
from sbas.logs.ublox.ubx_levels import HorizontalLevel
from sbas.logs.ublox.ubx_messages import MESSAGES, POSITIONS_NOT_READ, Raw
from sbas.logs.ublox.ubx_table import (
    Part,
    Tally,
    Whole,
    fill,
    finish,
    frame_of,
    joined,
    needed,
    plan,
    repeated_rows,
)
from sbas.logs.ublox.ubx_times import (
    TIME_FIELDS,
    Anchors,
    anchors_of,
    time_of_pvt,
    time_of_raw,
    time_of_timegps,
)

Positions = NDArray[np.int64]


@dataclass(frozen=True)
class Chunk:
    """What is kept of the frames of one stretch of the file.

    Parameters
    ----------
    raw : fields by kind of message, those of `KINDS`.
    anchors : messages that state their whole time.
    frames : SBAS frames.
    first, end : first byte of the first frame, and first byte after the last; -1 without frames.
    gap_start, gap_end : (k,) stretches between these frames.
    short : messages too short to be what they say, by name.
    positions_not_read : messages with a position that is not read, by name.
    leap_s : leap seconds stated, in file order.
    contradicting : seconds between date and time of week -> how often.
    """

    raw: Mapping[int, Raw]
    anchors: Anchors
    frames: SbasFrames
    first: int
    end: int
    gap_start: Positions
    gap_end: Positions
    short: Counter[str]
    positions_not_read: Counter[str]
    leap_s: NDArray[np.int8]
    contradicting: Counter[int]


def extract(frames: Frames, fields: Mapping[int, tuple[str, ...]]) -> Chunk:
    """Keep of some frames what the fields asked for, times, and SBAS frames need."""
    raw: dict[int, Raw] = {}
    anchors = []
    short: Counter[str] = Counter()
    leap_s = np.empty(0, np.int8)
    contradicting: Counter[int] = Counter()
    for key in (*KINDS, ubx.RXM_RAW, ubx.RXM_RAWX):
        message = MESSAGES[key]
        start, too_short = ubx.long_enough(frames, key, message.shortest)
        if too_short:
            short[message.name] = too_short
        if not len(start):
            continue
        for_time = TIME_FIELDS.get(key, ("itow_ms",))
        kept = fields.get(key, ())
        read = ubx.read_fields(frames, start, message, dict.fromkeys((*for_time, *kept)))
        values = {name: read[name] for name in ("position", *kept)}
        if key in KINDS:
            values["itow_ms"] = read["itow_ms"]
        if key == ubx.NAV_PVT:
            values["time_ms"], contradicting = time_of_pvt(read)
        elif key == ubx.NAV_TIMEGPS:
            values["time_ms"], leap_s = time_of_timegps(read)
        elif key in TIME_FIELDS:
            values["time_ms"] = time_of_raw(read)
        if key in TIME_FIELDS:
            anchors.append(anchors_of(values))
        if key in KINDS:
            raw[key] = values
    gap = frames.start[1:] > frames.end[:-1]
    other = {
        name: int(np.count_nonzero(frames.key == key)) for key, name in POSITIONS_NOT_READ.items()
    }
    some = len(frames.start) > 0
    return Chunk(
        raw,
        Anchors.none().joined(*anchors),
        sbas_frames(frames),
        int(frames.start[0]) if some else -1,
        int(frames.end[-1]) if some else -1,
        frames.end[:-1][gap],
        frames.start[1:][gap],
        short,
        +Counter(other),
        leap_s,
        contradicting,
    )


@dataclass
class Seen:
    """What was met on the way through a file, for its findings and metadata."""

    leftovers: Leftovers | None = None
    tally: Tally = field(default_factory=Tally)
    short: Counter[str] = field(default_factory=Counter)
    positions_not_read: Counter[str] = field(default_factory=Counter)
    leap_s: Counter[int] = field(default_factory=Counter)
    last_leap_s: int | None = None
    contradicting: Counter[int] = field(default_factory=Counter)
    end: int = 0
    frames: int = 0
    frames_before_time: int = 0
    other_frames: int = 0
    other_signals: int = 0
    first_ms: int = -1
    last_ms: int = -1
    longest_step_ms: int = 0

    def add(self, chunk: Chunk) -> None:
        """Count what a chunk holds, but for its rows."""
        self.short.update(chunk.short)
        self.positions_not_read.update(chunk.positions_not_read)
        if len(chunk.leap_s):
            self.leap_s.update(chunk.leap_s.tolist())
            self.last_leap_s = int(chunk.leap_s[-1])
        self.contradicting.update(chunk.contradicting)
        if chunk.first >= 0:
            if self.leftovers is not None:
                before = slice(chunk.first > self.end)
                self.leftovers.add(np.array([self.end])[before], np.array([chunk.first])[before])
                self.leftovers.add(chunk.gap_start, chunk.gap_end)
            self.end = chunk.end
        self.other_frames += chunk.frames.other
        if len(times := chunk.anchors.time_ms):
            if self.first_ms < 0:
                self.first_ms = self.last_ms = int(times[0])
            steps = np.diff(times, prepend=self.last_ms)
            self.longest_step_ms = max(self.longest_step_ms, int(steps.max()))
            self.last_ms = int(times[-1])

    def add_frames(self, timed: Timed) -> None:
        self.frames += len(timed.time_ms)
        self.frames_before_time += int(np.count_nonzero(timed.time_ms < 0))
        self.other_signals += int(np.count_nonzero(~timed.frames.on_l1))


def stream(
    chunks: Iterable[Chunk], want: Set[str], horizontal: HorizontalLevel, seen: Seen
) -> Iterator[tuple[Part, Timed]]:
    """Rows and SBAS frames of the chunks of a file, in file order.

    Parameters
    ----------
    chunks : in file order.
    want : columns to fill, with those that they need.
    horizontal : how the two horizontal levels of NAV-PL become one.
    seen : counts, added to; whole once the iterator is at its end.
    """
    held = Open()
    for chunk in chunks:
        seen.add(chunk)
        timed = Timed.of(chunk.frames, held.anchors.joined(chunk.anchors))
        seen.add_frames(timed)
        rows, held = assemble(held, chunk.raw, chunk.anchors, final=False)
        part, tally = fill(rows, want, horizontal)
        seen.tally.add(tally)
        yield part, timed
    rows, _ = assemble(held, {}, Anchors.none(), final=True)
    part, tally = fill(rows, want, horizontal)
    seen.tally.add(tally)
    yield part, Timed.of(SbasFrames.none(), Anchors.none())


def whole_of(seen: Seen, time_ms: NDArray[np.int64]) -> Whole:
    """What the whole file tells, of its counts and its (rows,) times."""
    return Whole(seen.tally.kinds, seen.tally.levels.risk, repeated_rows(time_ms))


def load(
    chunks: Iterable[Chunk], asked: tuple[str, ...], horizontal: HorizontalLevel, seen: Seen
) -> tuple[pd.DataFrame, dict[str, pd.DataFrame]]:
    """Epoch table with the columns asked, and side tables; `seen` is whole afterwards."""
    parts, pieces = [], []
    for part, timed in stream(chunks, needed(asked), horizontal, seen):
        parts.append(part)
        if len(timed.time_ms):
            pieces.append(timed)
    part = joined(parts)
    part = finish(part, whole_of(seen, part.time_ms))
    frames = frame_table(pieces, seen.first_ms)
    return frame_of(part, asked), {} if frames is None else {"sbas_frames": frames}


def fields_for(asked: Set[str]) -> dict[int, tuple[str, ...]]:
    """Fields to keep of each kind of message for the columns asked."""
    return plan(needed(asked))
