"""What lies between SBF blocks: NMEA sentences, RTCM frames, a cut last block, or damage.

A stretch between blocks is searched for NMEA 0183 sentences with a good checksum and RTCM 3
frames with a good CRC-24Q; what belongs to neither is an orphan byte.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import reduce
from io import FileIO
from operator import xor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sbas.logs.checksums import crc24q_of_rows
from sbas.logs.septentrio.sbf_blocks import SYNC
from sbas.logs.septentrio.sbf_framing import HEADER_BYTES, MIN_LENGTH, read_span

PIECE_BYTES = 4 << 20
MANY_STRETCHES = 1 << 16
_LONGEST_FRAME = 1030
_OFFSETS_KEPT = 5
_CROWDED = 16
_NMEA = re.compile(rb"[$!]([ \"#%-)+-~]{1,1020})\*([0-9A-Fa-f]{2})(?:\r?\n)?")
_RTCM = re.compile(rb"(?=\xd3[\x00-\x03])", re.DOTALL)

Positions = NDArray[np.int64]


@dataclass
class Foreign:
    """Counts over all stretches between blocks."""

    orphan_bytes: int = 0
    nmea_sentences: int = 0
    rtcm_frames: int = 0
    first_orphans: list[int] = field(default_factory=list)
    orphan_end: int = -1


def _nmea_spans(data: bytes) -> list[tuple[int, int]]:
    return [
        match.span() for match in _NMEA.finditer(data) if reduce(xor, match[1]) == int(match[2], 16)
    ]


def _rtcm_spans(data: bytes) -> list[tuple[int, int]]:
    """RTCM 3 frames: D3, 6 zero bits, 10 bits of length, payload, CRC-24Q."""
    spans = []
    for match in _RTCM.finditer(data):
        start = match.start()
        end = start + 6 + int.from_bytes(data[start + 1 : start + 3], "big")
        if len(data) > start + 3 and end <= len(data):
            spans.append((start, end))
    # Frames heaped upon each other are no stream of a receiver; their bytes count as orphans.
    if not spans or sum(end - start for start, end in spans) > _CROWDED * len(data):
        return []
    good = np.empty(len(spans), np.bool_)
    for low in range(0, len(spans), 1024):
        part = spans[low : low + 1024]
        width = max(end - start for start, end in part)
        rows = np.zeros((len(part), width), np.uint8)
        for row, (start, end) in zip(rows, part, strict=True):
            row[width - (end - start) :] = np.frombuffer(data, np.uint8, end - start, start)
        # A message followed by its own CRC leaves no remainder.
        good[low : low + 1024] = crc24q_of_rows(rows) == 0
    return [span for span, right in zip(spans, good.tolist(), strict=True) if right]


class Leftovers:
    """What lies between the blocks of a file, counted while it is read.

    The last stretch waits until the end: a block that the end of the file cuts may be in it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._found = Foreign()
        self._start = self._end = np.empty(0, np.int64)

    def add(self, start: Positions, end: Positions) -> None:
        """Take note of (n,) stretches [start, end) that are no block, in file order."""
        self._start = np.concatenate((self._start, start))
        self._end = np.concatenate((self._end, end))
        if len(self._start) > MANY_STRETCHES:
            count_foreign(self.path, self._start[:-1], self._end[:-1], self._found)
            self._start, self._end = self._start[-1:], self._end[-1:]

    def finish(self) -> tuple[Foreign, tuple[int, int] | None]:
        """Counts over all stretches, and place and stated length of a cut last block if any."""
        size = self.path.stat().st_size
        cut = None
        if len(self._end) and self._end[-1] == size:
            cut = cut_block(self.path, int(self._start[-1]), size)
        if cut is not None:
            self._end[-1] = cut[0]
        count_foreign(self.path, self._start, self._end, self._found)
        return self._found, cut


def count_foreign(path: Path, start: Positions, end: Positions, found: Foreign) -> None:
    """Add the sentences, frames and orphan bytes in the stretches [start, end) of a file.

    Parameters
    ----------
    path : the file.
    start, end : (n,) stretches that are no SBF block, in file order.
    found : counts that grow; stretches before these are in them already.
    """
    if not len(start):
        return
    with path.open("rb", buffering=0) as file:
        low = 0
        while low < len(start):
            # Stretches close to each other are read together, long ones piece by piece.
            high = max(int(np.searchsorted(end, start[low] + PIECE_BYTES, side="right")), low + 1)
            offset = int(start[low])
            span = min(int(end[high - 1]), offset + PIECE_BYTES)
            data = read_span(file, offset, span).tobytes()
            for first, after in zip(start[low:high].tolist(), end[low:high].tolist(), strict=True):
                piece = data[first - offset : after - offset]
                if first + len(piece) == after:
                    _count(piece, first, found, len(piece))
                else:
                    _count_long(file, first, after, found)
            low = high


def _count_long(file: FileIO, first: int, after: int, found: Foreign) -> None:
    while first < after:
        data = read_span(file, first, min(first + PIECE_BYTES, after)).tobytes()
        if not data:
            return
        whole = first + len(data) >= after
        first += _count(data, first, found, len(data) if whole else len(data) - _LONGEST_FRAME)


def _count(data: bytes, offset: int, found: Foreign, commit: int) -> int:
    """Count what begins before `commit`; returns where the next piece begins in `data`."""
    nmea = _nmea_spans(data) if b"*" in data else []
    rtcm = _rtcm_spans(data) if b"\xd3" in data else []
    spans = sorted([(*span, True) for span in nmea] + [(*span, False) for span in rtcm])
    at = 0
    for start, end, is_nmea in spans:
        if start >= commit:
            break
        if start < at:
            continue
        _orphans(start - at, offset + at, found)
        found.nmea_sentences += is_nmea
        found.rtcm_frames += not is_nmea
        at = end
    _orphans(max(commit - at, 0), offset + at, found)
    return max(commit, at)


def _orphans(count: int, offset: int, found: Foreign) -> None:
    if count and offset != found.orphan_end and len(found.first_orphans) < _OFFSETS_KEPT:
        found.first_orphans.append(offset)
    if count:
        found.orphan_bytes += count
        found.orphan_end = offset + count


def cut_block(path: Path, start: int, end: int) -> tuple[int, int] | None:
    """Place and stated length of a last block that the end of the file cuts, if there is one.

    Parameters
    ----------
    path : the file.
    start, end : what follows the last block, up to the end of the file.
    """
    low = max(start, end - 65535)
    with path.open("rb", buffering=0) as file:
        tail = read_span(file, low, end).tobytes()
    at = tail.find(SYNC)
    while at >= 0:
        length = int.from_bytes(tail[at + 6 : at + HEADER_BYTES], "little")
        if at + HEADER_BYTES > len(tail):
            return low + at, 0
        if length >= MIN_LENGTH and length % 4 == 0 and at + length > len(tail):
            return low + at, length
        at = tail.find(SYNC, at + 1)
    return None
