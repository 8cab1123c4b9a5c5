"""Bytes to SBF blocks: find, check by CRC, and gather by kind, whole arrays at a time.

Framing after Septentrio PolaRx5TR Reference Guide 5.5.0, pages 295-300. A block is accepted if
its length is possible, its CRC right, and it does not begin inside the block accepted before;
after a failure the search goes on two bytes on. So the result depends on the bytes alone, never
on how they are cut into chunks.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sbas.logs.checksums import crc16_of_rows, crc16_of_spans
from sbas.logs.format import Progress
from sbas.logs.septentrio.sbf_blocks import MAX_LENGTH

CHUNK_BYTES = 4 << 20
HEADER_BYTES = 8
MIN_LENGTH = 16
_LIKELY_LENGTH = 4096
_FEW_ROWS = 64
_ROUNDS = 4
_CROWDED = 4
"""Bytes of candidates to check, in lengths of the data, that no real log comes near."""
_WORKERS = 2

Bytes = NDArray[np.uint8]
Positions = NDArray[np.int64]


@dataclass(frozen=True)
class Group:
    """Blocks of one ID and length, in file order: their place in the file and their bytes."""

    number: int
    revision: int
    position: Positions
    rows: Bytes


@dataclass(frozen=True)
class Frames:
    """The accepted blocks of a stretch of the file.

    Parameters
    ----------
    groups : the blocks by ID and length.
    start, end : (n,) first byte and first byte after each block, in file order.
    """

    groups: tuple[Group, ...]
    start: Positions
    end: Positions


class _Candidates:
    """Places where a whole block may lie, in file order, and which of them the CRC confirms."""

    def __init__(self, data: Bytes, commit: int) -> None:
        self.data = data
        sync = np.empty(len(data) + 1, np.bool_)
        np.equal(data[:-1], 0x24, out=sync[:-2])
        sync[:-2] &= data[1:] == 0x40
        sync[-2:] = False, True
        at = np.flatnonzero(sync[: min(commit, len(data))])
        at = at[at + MIN_LENGTH <= len(data)]
        head = sliding_window_view(data, HEADER_BYTES)[at].view("<u2")
        length = head[:, 3]
        end = at + length
        keep = (length >= MIN_LENGTH) & (length & 3 == 0) & (end <= len(data))
        self.start, self.end = at[keep], end[keep]
        self.crc, self.id, self.length = head[keep, 1], head[keep, 2], length[keep]
        # Real blocks mostly end where the next one begins, chance candidates hardly ever.
        self.likely = sync[self.end] & (self.length <= _LIKELY_LENGTH)
        self.good = np.zeros(len(self.start), np.bool_)
        self.rows: list[tuple[NDArray[np.intp], Bytes]] = []
        self._without_rows: list[NDArray[np.intp]] = []

    def check(self, index: NDArray[np.intp]) -> None:
        """Find out the CRC of some candidates, keeping the rows of the good ones."""
        start, end = self.start[index] + 4, self.end[index]
        if int((end - start).sum()) > _CROWDED * len(self.data):
            # Heaped upon each other, as in a hostile file: each by itself would take hours.
            good = crc16_of_spans(self.data, start, end) == self.crc[index]
            self.good[index] = good
            self._without_rows.append(index[good])
            return
        view = self.data.data
        for group in self._groups(index):
            if len(group) < _FEW_ROWS:
                # Setting up whole columns would not pay.
                spans = zip((self.start[group] + 4).tolist(), self.end[group].tolist(), strict=True)
                crc = [crc_hqx(view[first:after], 0) for first, after in spans]
                good = np.array(crc, np.uint16) == self.crc[group]
                rows = self._gather(group[good]) if good.any() else None
            else:
                rows = self._gather(group)
                good = crc16_of_rows(rows[:, 4:]) == self.crc[group]
                rows = rows if good.all() else rows[good]
            self.good[group] = good
            if rows is not None and len(rows):
                self.rows.append((group[good], rows))

    def gather_accepted(self, chosen: NDArray[np.bool_]) -> None:
        """Keep the rows of those accepted candidates that were checked in a heap."""
        for index in self._without_rows:
            self.rows += [
                (group, self._gather(group)) for group in self._groups(index[chosen[index]])
            ]

    def _groups(self, index: NDArray[np.intp]) -> list[NDArray[np.intp]]:
        """Candidates by ID and length, each group in file order."""
        # Stable, so that the order stays; keys of 16 bits are sorted by radix.
        index = index[np.argsort(self.length[index], kind="stable")]
        index = index[np.argsort(self.id[index], kind="stable")]
        ids, lengths = self.id[index], self.length[index]
        cuts = np.flatnonzero((ids[1:] != ids[:-1]) | (lengths[1:] != lengths[:-1])) + 1
        return np.split(index, cuts) if len(index) else []

    def _gather(self, group: NDArray[np.intp]) -> Bytes:
        rows: Bytes = sliding_window_view(self.data, int(self.length[group[0]]))[self.start[group]]
        return rows


def _outermost(start: Positions, end: Positions, free_from: int) -> NDArray[np.bool_]:
    """Which of the CRC-good blocks to accept: those that begin in no accepted one."""
    accepted = np.ones(len(start), np.bool_)
    if len(start) and (start[0] < free_from or (start[1:] < end[:-1]).any()):
        # Rare: blocks inside EncapsulatedOutput, or a chance hit. One pass, in file order.
        for i, (first, after) in enumerate(zip(start.tolist(), end.tolist(), strict=True)):
            accepted[i] = first >= free_from
            free_from = after if first >= free_from else free_from
    return accepted


def frame(data: Bytes, *, offset: int = 0, commit: int | None = None, free_from: int = 0) -> Frames:
    """The blocks that begin in `data[:commit]`.

    A candidate that begins inside an accepted block need not be checked, since it cannot be
    accepted itself. So the likely ones come first, then those that the accepted leave open,
    until none is open.

    Parameters
    ----------
    data : (n,) bytes; blocks that reach beyond them are not accepted.
    offset : place of `data[0]` in the file; positions in the result are places in the file.
    commit : where in `data` a block may begin at most; by default anywhere.
    free_from : place in the file where the block accepted before ends.
    """
    if len(data) < MIN_LENGTH:
        return Frames((), np.empty(0, np.int64), np.empty(0, np.int64))
    found = _Candidates(data, len(data) if commit is None else commit)
    unchecked = np.ones(len(found.start), np.bool_)
    turn = np.flatnonzero(found.likely)
    for round_ in range(_ROUNDS):
        found.check(turn)
        unchecked[turn] = False
        good = np.flatnonzero(found.good)
        outermost = _outermost(found.start[good], found.end[good], free_from - offset)
        accepted = good[outermost]
        rest = np.flatnonzero(unchecked)
        free = np.concatenate(([free_from - offset], found.end[accepted]))
        turn = rest[found.start[rest] >= free[np.searchsorted(accepted, rest)]]
        if not len(turn):
            break
        if round_ == _ROUNDS - 2:
            turn = rest
    chosen = np.zeros(len(found.start), np.bool_)
    chosen[accepted] = True
    found.gather_accepted(chosen)
    groups = []
    for index, rows in found.rows:
        keep = chosen[index]
        if keep.any():
            index, rows = (index, rows) if keep.all() else (index[keep], rows[keep])
            block_id = int(found.id[index[0]])
            position = found.start[index] + offset
            groups.append(Group(block_id & 0x1FFF, block_id >> 13, position, rows))
    return Frames(tuple(groups), found.start[accepted] + offset, found.end[accepted] + offset)


T = TypeVar("T")


def read_span(file: FileIO, low: int, high: int) -> Bytes:
    """The bytes [low, high) of a file, fewer where it ends before."""
    file.seek(low)
    buffer = np.empty(max(high - low, 0), np.uint8)
    view = buffer.data
    done = 0
    while done < len(buffer) and (count := file.readinto(view[done:])):
        done += count
    return buffer[:done]


def scan(
    path: Path,
    extract: Callable[[Frames], T],
    *,
    chunk_bytes: int = CHUNK_BYTES,
    progress: Progress | None = None,
) -> Iterator[tuple[Frames, T]]:
    """Frame a file chunk by chunk, in bounded memory, two chunks at a time.

    Parameters
    ----------
    path : the file.
    extract : Frames -> what to keep of them; runs beside the framing of the next chunk.
    chunk_bytes : bytes a chunk; changes speed and memory, never the result.
    progress : called with bytes done and bytes in all.

    Returns
    -------
    Iterator of (frames without their groups' bytes, what `extract` gave), in file order.
    """
    size = path.stat().st_size
    chunk_bytes = max(chunk_bytes, MAX_LENGTH + 1)

    def work(low: int, free_from: int) -> tuple[Frames, T]:
        high = min(low + chunk_bytes, size)
        with path.open("rb", buffering=0) as file:
            data = read_span(file, low, min(high + MAX_LENGTH, size))
        frames = frame(data, offset=low, commit=high - low, free_from=free_from)
        slim = Frames((), frames.start, frames.end)
        return slim, extract(frames)

    free_from = 0
    with ThreadPoolExecutor(_WORKERS) as pool:
        pending: deque[tuple[int, Future[tuple[Frames, T]]]] = deque()
        starts = iter(range(0, size, chunk_bytes))

        def submit() -> None:
            low = next(starts, None)
            if low is not None:
                pending.append((low, pool.submit(work, low, 0)))

        for _ in range(_WORKERS + 1):
            submit()
        while pending:
            low, future = pending.popleft()
            frames, kept = future.result()
            submit()
            if len(frames.start) and frames.start[0] < free_from:
                # A good block lies inside the last one of the chunk before: walk again.
                frames, kept = work(low, free_from)
            if len(frames.end):
                free_from = int(frames.end[-1])
            if progress is not None:
                progress(min(low + chunk_bytes, size), size)
            yield frames, kept
