"""What lies between the sentences: binary frames, sentences that were rejected, orphan bytes.

Frames of UBX, SBF and RTCM 3 with a good checksum belong in a receiver's log. All else but line
ends is damage: an untimed sentence behind it may belong to an epoch that it swallowed.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sbas.logs.checksums import crc24q_of_rows
from sbas.logs.nmea.nmea_framing import MAX_BODY, Bytes, Positions
from sbas.logs.septentrio.sbf_framing import frame, read_span

PIECE_BYTES = 4 << 20
_LONGEST_FRAME = 1 << 16
_UBX_MAX_PAYLOAD = 8192
_OFFSETS_KEPT = 5
_CROWDED = 16
"""Bytes of RTCM candidates to check, in lengths of the data, that no real log comes near."""
_REJECTED = re.compile(rb"\$[A-Z][A-Z0-9]{2,7},[ -#%-~]{0,8192}")

Spans = tuple[Positions, Positions]


@dataclass
class Between:
    """Counts over all that lies between the sentences of a file."""

    orphan_bytes: int = 0
    first_orphans: list[int] = field(default_factory=list)
    frames: Counter[str] = field(default_factory=Counter)
    rejected: int = 0
    first_rejected: str = ""
    too_long: int = 0
    first_too_long: int = -1
    _orphan_end: int = -1

    def look(self, path: Path, start: Positions, end: Positions) -> Positions:
        """Count what the stretches [start, end) of a file hold; returns the damaged ones' starts.

        Parameters
        ----------
        path : the file.
        start, end : (n,) stretches between sentences, in file order.
        """
        damaged = np.zeros(len(start), np.bool_)
        with path.open("rb", buffering=0) as file:
            low = 0
            while low < len(start):
                # Stretches close to each other are read together, long ones piece by piece.
                reach = start[low] + PIECE_BYTES
                high = max(int(np.searchsorted(end, reach, side="right")), low + 1)
                at, stop = int(start[low]), int(end[high - 1])
                while at < stop:
                    data = read_span(file, at, min(at + PIECE_BYTES, stop))
                    if not len(data):
                        return start[damaged]
                    whole = at + len(data) >= stop
                    first = np.maximum(start[low:high] - at, 0)
                    after = np.minimum(end[low:high] - at, len(data))
                    commit = len(data) if whole else len(data) - _LONGEST_FRAME
                    done, some = self._piece(data, at, first, after, commit)
                    damaged[low:high] |= some
                    at += done
                low = high
        return start[damaged]

    def _piece(
        self, data: Bytes, offset: int, start: Positions, end: Positions, commit: int
    ) -> tuple[int, NDArray[np.bool_]]:
        """Count what begins before `commit`; returns what is done with, and which are damaged."""
        edges = np.zeros(len(data) + 1, np.int8)
        edges[start] += 1
        edges[end] -= 1
        left = np.cumsum(edges[:-1], dtype=np.int8).astype(np.bool_)
        done = commit
        for first, after in self._frames(data, start, end, commit):
            left[first:after] = False
            done = max(done, after)
        text = np.where(left, data, np.uint8(0)).tobytes()
        unreadable = left & (data != 0x0A) & (data != 0x0D)
        for match in _REJECTED.finditer(text, 0, len(text)):
            first, after = match.span()
            if first >= commit:
                break
            self._reject(match[0], offset + first)
            left[first:after] = False
            done = max(done, after)
        unreadable[done:] = False
        orphans = np.flatnonzero(left[:done] & unreadable[:done])
        self._count_orphans(orphans, offset)
        hit = np.searchsorted(start, np.flatnonzero(unreadable), side="right") - 1
        damaged = np.zeros(len(start), np.bool_)
        damaged[hit] = True
        return done, damaged

    def _frames(
        self, data: Bytes, start: Positions, end: Positions, commit: int
    ) -> list[tuple[int, int]]:
        """Frames that begin before `commit`, within one stretch, and in no frame before."""
        raw = data.tobytes()
        found: list[tuple[int, int, str]] = []
        for name, sync, search in _PROTOCOLS:
            if sync in raw:
                first, after = search(data)
                stretch = np.maximum(np.searchsorted(start, first, side="right") - 1, 0)
                inside = (first >= start[stretch]) & (after <= end[stretch]) & (first < commit)
                found += [
                    (a, b, name)
                    for a, b in zip(first[inside].tolist(), after[inside].tolist(), strict=True)
                ]
        accepted, free = [], 0
        # Each acceptance depends on the one before; there are few frames among sentences.
        for a, b, name in sorted(found):
            if a >= free:
                accepted.append((a, b))
                self.frames[name] += 1
                free = b
        return accepted

    def _reject(self, text: bytes, offset: int) -> None:
        self.rejected += 1
        if not self.first_rejected:
            self.first_rejected = f"byte {offset:,}: {text[:80].decode('ascii')}"
        if len(text) > MAX_BODY + 4:
            self.too_long += 1
            self.first_too_long = offset if self.first_too_long < 0 else self.first_too_long

    def _count_orphans(self, at: NDArray[np.intp], offset: int) -> None:
        if not len(at):
            return
        begin = np.ones(len(at), np.bool_)
        begin[1:] = np.diff(at) != 1
        begin[0] = at[0] + offset != self._orphan_end
        wanted = _OFFSETS_KEPT - len(self.first_orphans)
        self.first_orphans += (at[begin][:wanted] + offset).tolist()
        self.orphan_bytes += len(at)
        self._orphan_end = int(at[-1]) + offset + 1


def binary_bytes(data: Bytes) -> tuple[int, int]:
    """Bytes in UBX, SBF and RTCM frames of a sample, and how many of them are UBX or SBF."""
    size = blocks = 0
    for name, sync, search in _PROTOCOLS:
        if sync in data.tobytes():
            start, end = search(data)
            size += int((end - start).sum())
            blocks += len(start) * (name != "RTCM")
    return size, blocks


def ubx_frames(data: Bytes) -> Spans:
    """Start and end of UBX frames with a good checksum, in order, nested ones included.

    `B5 62`, class, id, length, payload, and the two sums A = sum of b_i, B = sum of (n - i) b_i
    modulo 256 over class to payload (u-blox M8 protocol specification, 32.4).
    """
    at = np.flatnonzero((data[:-1] == 0xB5) & (data[1:] == 0x62))
    at = at[at + 8 <= len(data)]
    length = data[at + 4].astype(np.int64) | data[at + 5].astype(np.int64) << 8
    end = at + 8 + length
    keep = (length <= _UBX_MAX_PAYLOAD) & (end <= len(data))
    at, end = at[keep], end[keep]
    plain = np.zeros(len(data) + 1, np.uint32)
    np.cumsum(data, dtype=np.uint32, out=plain[1:])
    weighed = np.zeros(len(data) + 1, np.uint32)
    np.cumsum(np.arange(len(data), dtype=np.uint32) * data, dtype=np.uint32, out=weighed[1:])
    first, after = at + 2, end - 2
    a = plain[after] - plain[first]
    b = after.astype(np.uint32) * a - (weighed[after] - weighed[first])
    good = (a & 0xFF == data[after]) & (b & 0xFF == data[after + 1])
    return at[good], end[good]


def _sbf_blocks(data: Bytes) -> Spans:
    blocks = frame(data)
    return blocks.start, blocks.end


def rtcm_frames(data: Bytes) -> Spans:
    """RTCM 3 frames: D3, 6 zero bits, 10 bits of length, payload, CRC-24Q."""
    at = np.flatnonzero((data[:-1] == 0xD3) & (data[1:] < 4))
    at = at[at + 6 <= len(data)]
    length = 6 + (data[at + 1].astype(np.int64) << 8 | data[at + 2])
    keep = at + length <= len(data)
    at, length = at[keep], length[keep]
    good = np.zeros(len(at), np.bool_)
    if int(length.sum()) <= _CROWDED * len(data):
        for size in np.unique(length).tolist():
            rows = np.flatnonzero(length == size)
            # A message followed by its own CRC leaves no remainder.
            good[rows] = crc24q_of_rows(sliding_window_view(data, size)[at[rows]]) == 0
    return at[good], (at + length)[good]


_PROTOCOLS = (
    ("UBX", b"\xb5\x62", ubx_frames),
    ("SBF", b"$@", _sbf_blocks),
    ("RTCM", b"\xd3", rtcm_frames),
)
