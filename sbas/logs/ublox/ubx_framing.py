"""Bytes to UBX frames: find and check them, whole arrays at a time.

A frame is B5 62, class, id, length (u2, little-endian), payload, CK_A, CK_B, with the Fletcher
checksum of RFC 1145 over class to payload (u-blox M8 receiver description UBX-13003221, UBX
protocol; pyubx2 1.4.0). A frame is accepted if its length is possible, both checksum bytes are
right and it does not begin inside the frame accepted before; after a failure the search goes on
two bytes on. So the result depends on the bytes alone, never on how they are cut into chunks.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sbas.logs.format import Progress
from sbas.logs.septentrio.sbf_framing import read_span

CHUNK_BYTES = 4 << 20
HEADER_BYTES = 6
EXTRA_BYTES = 8
"""Bytes of a frame beside its payload."""
MAX_PAYLOAD = 8192
_CROWDED = 4
"""Bytes of candidates to check, in lengths of the data, that no real log comes near."""
_WORKERS = 2

Bytes = NDArray[np.uint8]
Positions = NDArray[np.int64]
T = TypeVar("T")


@dataclass(frozen=True)
class Frames:
    """The accepted frames of a stretch of the file, in file order.

    Parameters
    ----------
    data : bytes of the stretch.
    offset : place of `data[0]` in the file.
    start, end : (n,) first byte and first byte after each frame, places in the file.
    key : (n,) class << 8 | id.
    """

    data: Bytes
    offset: int
    start: Positions
    end: Positions
    key: NDArray[np.uint16]


def checksums_of_spans(data: Bytes, start: Positions, end: Positions) -> tuple[Bytes, Bytes]:
    """Checksum bytes A = sum b_i and B = sum (n - i) b_i, mod 256, of spans data[start:end].

    Parameters
    ----------
    data : (n,) bytes.
    start, end : (m,) spans of at least one byte that end before the data do, in any overlap.

    Returns
    -------
    (m,) A, (m,) B. Source: RFC 1145, with the position counted from the end of the span.
    """
    if int((end - start).sum()) > _CROWDED * len(data):
        # Heaped upon each other, as in a hostile file: prefix sums take time linear in the data.
        first = np.zeros(len(data) + 1, np.uint8)
        np.cumsum(data, dtype=np.uint8, out=first[1:])
        second = np.cumsum(first, dtype=np.uint8)
        before = first[start]
        length = ((end - start) & 255).astype(np.uint8)
        return first[end] - before, second[end] - second[start] - length * before
    pairs = np.empty(2 * len(start), np.intp)
    pairs[::2], pairs[1::2] = start, end
    sum_a: Bytes = np.add.reduceat(data, pairs, dtype=np.uint8)[::2]
    place = np.resize(np.arange(256, dtype=np.uint8), len(data))
    place *= data
    weighted: Bytes = np.add.reduceat(place, pairs, dtype=np.uint8)[::2]
    return sum_a, (end & 255).astype(np.uint8) * sum_a - weighted


def _outermost(start: Positions, end: Positions, free_from: int) -> NDArray[np.bool_]:
    """Which of the good frames to accept: those that begin in no accepted one."""
    accepted = np.ones(len(start), np.bool_)
    if len(start) and (start[0] < free_from or (start[1:] < end[:-1]).any()):
        # Rare: a frame carried inside another, or a chance hit. One pass, in file order.
        for i, (first, after) in enumerate(zip(start.tolist(), end.tolist(), strict=True)):
            accepted[i] = first >= free_from
            free_from = after if first >= free_from else free_from
    return accepted


def frame(
    data: Bytes,
    *,
    offset: int = 0,
    commit: int | None = None,
    free_from: int = 0,
    max_payload: int = MAX_PAYLOAD,
) -> Frames:
    """The frames that begin in `data[:commit]`.

    Parameters
    ----------
    data : (n,) bytes; frames that reach beyond them are not accepted.
    offset : place of `data[0]` in the file; positions in the result are places in the file.
    commit : where in `data` a frame may begin at most; by default anywhere.
    free_from : place in the file where the frame accepted before ends.
    max_payload : payloads beyond are taken for damage [bytes].
    """
    last = max(len(data) - EXTRA_BYTES + 1, 0)
    start = np.flatnonzero(data[: last if commit is None else min(commit, last)] == 0xB5)
    start = start[data[start + 1] == 0x62]
    length = data[start + 4] | data[start + 5].astype(np.int64) << 8
    end = start + EXTRA_BYTES + length
    possible = (length <= max_payload) & (end <= len(data))
    start, end = start[possible], end[possible]
    if len(start):
        sum_a, sum_b = checksums_of_spans(data, start + 2, end - 2)
        good = (data[end - 2] == sum_a) & (data[end - 1] == sum_b)
        start, end = start[good], end[good]
        accepted = _outermost(start, end, free_from - offset)
        start, end = start[accepted], end[accepted]
    key = data[start + 2].astype(np.uint16) << 8 | data[start + 3]
    return Frames(data, offset, start + offset, end + offset, key)


def scan(
    path: Path,
    extract: Callable[[Frames], T],
    *,
    chunk_bytes: int = CHUNK_BYTES,
    max_payload: int = MAX_PAYLOAD,
    progress: Progress | None = None,
) -> Iterator[T]:
    """Frame a file chunk by chunk, in bounded memory, two chunks at a time.

    Parameters
    ----------
    path : the file.
    extract : Frames -> what to keep of them; runs beside the framing of the next chunk.
    chunk_bytes : bytes a chunk; changes speed and memory, never the result.
    max_payload : payloads beyond are taken for damage [bytes].
    progress : called with bytes done and bytes in all.

    Returns
    -------
    Iterator of what `extract` gave, in file order.
    """
    size = path.stat().st_size
    longest = max_payload + EXTRA_BYTES
    chunk_bytes = max(chunk_bytes, longest)

    def work(low: int, free_from: int) -> tuple[int, int, T]:
        high = min(low + chunk_bytes, size)
        with path.open("rb", buffering=0) as file:
            data = read_span(file, low, min(high + longest, size))
        frames = frame(
            data, offset=low, commit=high - low, free_from=free_from, max_payload=max_payload
        )
        first, after = size, free_from
        if len(frames.start):
            first, after = int(frames.start[0]), int(frames.end[-1])
        return first, after, extract(frames)

    free_from = 0
    with ThreadPoolExecutor(_WORKERS) as pool:
        pending: deque[tuple[int, Future[tuple[int, int, T]]]] = deque()
        starts = iter(range(0, size, chunk_bytes))

        def submit() -> None:
            low = next(starts, None)
            if low is not None:
                pending.append((low, pool.submit(work, low, 0)))

        for _ in range(_WORKERS + 1):
            submit()
        while pending:
            low, future = pending.popleft()
            first, after, kept = future.result()
            submit()
            if first < free_from:
                # A good frame begins inside the last one of the chunk before: walk again.
                first, after, kept = work(low, free_from)
            free_from = max(free_from, after)
            if progress is not None:
                progress(min(low + chunk_bytes, size), size)
            yield kept
