"""Stretches of an SBF file: the fields kept of its blocks, in file order, with their times.

A file comes in parts of one chunk each; parts are joined, and cut at a place in the file.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.logs.format import Progress
from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio.sbf_epochs import Index, Stamps, block_times
from sbas.logs.septentrio.sbf_framing import Frames, Group, scan
from sbas.logs.septentrio.sbf_plan import SATELLITES, Plan
from sbas.logs.septentrio.sbf_sub_blocks import (
    SubBlocks,
    concatenate_sub_blocks,
    read_sub_blocks,
)

Raw = dict[str, NDArray[Any]]


@dataclass
class Part:
    """What was kept of a stretch of a file; blocks without a usable time are only counted.

    Parameters
    ----------
    raw : block number -> `position`, `time_ms` and the fields of the plan.
    sub : block number -> its sub-blocks.
    without_time : name of a block -> how many had no usable time.
    unfit : name of a block -> how many had sub-blocks that do not add up to its length.
    encapsulated : EncapsulatedOutput blocks, whose content is not read.
    """

    raw: dict[int, Raw] = field(default_factory=dict)
    sub: dict[int, SubBlocks] = field(default_factory=dict)
    without_time: Counter[str] = field(default_factory=Counter)
    unfit: Counter[str] = field(default_factory=Counter)
    encapsulated: int = 0

    def stamps(self, number: int) -> Stamps:
        """Where and when the blocks of a number are."""
        blocks = self.sub[number].blocks if number in self.sub else self.raw.get(number)
        if blocks is None:
            nothing = np.empty(0, np.int64)
            return Stamps(nothing, nothing)
        return Stamps(blocks["position"], blocks["time_ms"])

    def cut(self, place: int) -> tuple[Part, Part]:
        """The blocks before a place in the file, with all counts, and those from it on."""
        left = Part({}, {}, self.without_time, self.unfit, self.encapsulated)
        right = Part()
        for number, raw in self.raw.items():
            at = int(np.searchsorted(raw["position"], place))
            for part, keep in ((left, slice(at)), (right, slice(at, None))):
                if len(raw["position"][keep]):
                    part.raw[number] = {name: values[keep] for name, values in raw.items()}
        for number, sub in self.sub.items():
            end = len(sub.count)
            at = int(np.searchsorted(sub.blocks["position"], place))
            for part, low, high in ((left, 0, at), (right, at, end)):
                if low < high:
                    part.sub[number] = sub.part(low, high)
        return left, right


def joined(parts: Sequence[Part]) -> Part:
    """Parts that follow each other as one."""
    whole = Part()
    pieces: dict[int, list[Raw]] = defaultdict(list)
    sub: dict[int, list[SubBlocks]] = defaultdict(list)
    for part in parts:
        for number, raw in part.raw.items():
            pieces[number].append(raw)
        for number, blocks in part.sub.items():
            sub[number].append(blocks)
        whole.without_time.update(part.without_time)
        whole.unfit.update(part.unfit)
        whole.encapsulated += part.encapsulated
    for number in sorted(pieces):
        whole.raw[number] = _concatenated(pieces.pop(number))
    for number in sorted(sub):
        whole.sub[number] = concatenate_sub_blocks(sub.pop(number))
    return whole


def parts_of(
    path: Path,
    plan: Plan,
    chunk_bytes: int,
    progress: Progress | None,
    between: Callable[[Index, Index], None] | None = None,
) -> Iterator[Part]:
    """The parts of a file, chunk by chunk.

    Parameters
    ----------
    plan : block number -> fields to keep.
    between : called with (n,) starts and ends [start, end) of stretches that are no block, in
        file order; the last is that behind the last block.
    """

    def extract(frames: Frames) -> Part:
        return _part(frames, plan)

    done = 0
    for frames, part in scan(path, extract, chunk_bytes=chunk_bytes, progress=progress):
        if len(frames.start):
            before = np.concatenate(([done], frames.end[:-1]))
            gap = frames.start > before
            if between is not None and gap.any():
                between(before[gap], frames.start[gap])
            done = int(frames.end[-1])
        yield part
    size = path.stat().st_size
    if between is not None and size > done:
        between(np.array([done]), np.array([size]))


def _part(frames: Frames, plan: Plan) -> Part:
    part = Part()
    groups: dict[int, list[Group]] = defaultdict(list)
    for group in frames.groups:
        if group.number == sbf.ENCAPSULATED:
            part.encapsulated += len(group.position)
        elif group.number in plan:
            groups[group.number].append(group)
    for number, found in groups.items():
        name = sbf.BLOCKS[number].name
        if number in SATELLITES:
            sub, untimed, unfit = read_sub_blocks(number, found)
            if unfit:
                part.unfit[name] = unfit
            if len(sub.count):
                part.sub[number] = sub
        else:
            raw, untimed = _timed(_fields(number, found, plan[number]))
            if len(raw["position"]):
                part.raw[number] = raw
        if untimed:
            part.without_time[name] = untimed
    return part


def _fields(number: int, groups: Sequence[Group], fields: Sequence[str]) -> Raw:
    names = ("tow_ms", "week", *fields)
    raw = _concatenated(
        [
            {
                "position": group.position,
                **sbf.read_fields(group.rows, number, group.revision, names),
            }
            for group in groups
        ]
    )
    if len(groups) > 1:  # blocks of several revisions or lengths
        order = np.argsort(raw["position"], kind="stable")
        raw = {name: values[order] for name, values in raw.items()}
    return raw


def _timed(raw: Raw) -> tuple[Raw, int]:
    """The raw fields with `time_ms`, and how many blocks were left out for want of one."""
    time_ms = block_times(raw.pop("tow_ms"), raw.pop("week"))
    raw = {**raw, "time_ms": time_ms}
    timed = time_ms >= 0
    untimed = len(timed) - int(np.count_nonzero(timed))
    if untimed:
        raw = {name: values[timed] for name, values in raw.items()}
    return raw, untimed


def _concatenated(pieces: Sequence[Raw]) -> Raw:
    if len(pieces) == 1:
        return pieces[0]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
