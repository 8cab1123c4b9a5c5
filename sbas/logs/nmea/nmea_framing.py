"""Bytes to NMEA 0183 sentences: found between whatever else a port delivers, checksums compared.

A sentence is `$`, printable text without `$` and `*`, then `*` and two hexadecimal digits, the
XOR of the text. It is told from its own bytes alone, so chunks can be searched independently.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

MAX_BODY = 1024
"""Longest accepted text between `$` and `*`; the standard allows 82 characters a sentence."""
CHUNK_BYTES = 2 << 20
_OVERLAP = MAX_BODY + 8
_PAD = 32
_COMMA, _STAR, _DOLLAR, _NO_TEXT = 1, 2, 3, 4
_NO_HEX = 256


def _classes() -> bytes:
    table = bytearray(256)
    for byte in (*range(32), *range(127, 256)):
        table[byte] = _NO_TEXT
    for byte, kind in zip(b",*$", (_COMMA, _STAR, _DOLLAR), strict=True):
        table[byte] = kind
    return bytes(table)


def _hex_values() -> NDArray[np.int16]:
    table = np.full(256, _NO_HEX, np.int16)
    for text in (b"0123456789ABCDEF", b"0123456789abcdef"):
        table[np.frombuffer(text, np.uint8)] = np.arange(16)
    return table


_CLASSES = _classes()
_HEX = _hex_values()

Bytes = NDArray[np.uint8]
Positions = NDArray[np.int64]


@dataclass(frozen=True)
class Sentences:
    """Sentences of a stretch of bytes, in file order.

    Parameters
    ----------
    data : bytes of the stretch, with some zeros behind them.
    marks : (m,) places in `data` of commas, stars, dollars and bytes that are no text.
    first : (n,) index in `marks` of each sentence's dollar; its commas and its end follow.
    commas : (n,) number of commas.
    end : (n,) place in `data` behind the sentence and its line end.
    address : (n,) the 8 bytes behind the dollar as a little-endian number.
    """

    data: Bytes
    marks: Positions
    first: Positions
    commas: Positions
    end: Positions
    address: NDArray[np.uint64]

    def __len__(self) -> int:
        return len(self.first)

    def __getitem__(self, rows: Any) -> Sentences:
        return Sentences(
            self.data,
            self.marks,
            self.first[rows],
            self.commas[rows],
            self.end[rows],
            self.address[rows],
        )

    @property
    def start(self) -> Positions:
        """(n,) places of the dollars in `data`."""
        return self.marks[self.first]


def find(raw: bytes, *, commit: int | None = None, unchecked: bool = False) -> Sentences:
    """The sentences that begin in `raw[:commit]` and end in `raw`.

    Parameters
    ----------
    raw : bytes of a file, or a part.
    commit : where a sentence may begin at most; by default anywhere.
    unchecked : whether a sentence without `*hh` passes, if its line end is there.
    """
    padded = raw + bytes(_PAD)
    data = np.frombuffer(padded, np.uint8)
    kinds = np.frombuffer(padded.translate(_CLASSES), np.uint8)
    marks = np.flatnonzero(kinds != 0)
    kinds = kinds[marks]
    # Where a dollar is followed by a star, commas apart, there is nothing but text between.
    border = np.flatnonzero(kinds != _COMMA)
    kinds = kinds[border]
    opened = kinds[:-1] == _DOLLAR
    starred = np.flatnonzero(opened & (kinds[1:] == _STAR))
    chosen = starred[_checksum_right(data, marks[border[starred]], marks[border[starred + 1]])]
    if unchecked:
        bare = np.flatnonzero(opened & (kinds[1:] == _NO_TEXT))
        after = data[marks[border[bare + 1]]]
        bare = bare[(after == 0x0D) | (after == 0x0A)]
        chosen = np.union1d(chosen, bare)
    first, last = border[chosen], border[chosen + 1]
    start, end = marks[first], marks[last]
    end = end + 3 * (data[end] == 0x2A)
    keep = (start < (len(raw) if commit is None else commit)) & (end <= len(raw))
    keep &= (marks[last] - start - 1 <= MAX_BODY) & (marks[last] - start > 5)
    rows = sliding_window_view(data, 8)[np.where(keep, start, 0) + 1]
    keep &= _named(rows)
    end = end + (data[end] == 0x0D)
    end = end + (data[end] == 0x0A)
    address = rows[keep].view("<u8")[:, 0]
    first = first[keep]
    return Sentences(data, marks, first, (last[keep] - first - 1), end[keep], address)


def _checksum_right(data: Bytes, start: Positions, star: Positions) -> NDArray[np.bool_]:
    """(n,) whether the XOR of the text in (start, star) is what the digits behind the star say."""
    if not len(start):
        return np.empty(0, np.bool_)
    spans = np.empty(2 * len(start), np.intp)
    spans[::2], spans[1::2] = start + 1, star
    # An empty span gives its first byte, the star: no hexadecimal number that matters.
    found = np.bitwise_xor.reduceat(data, spans)[::2]
    given = _HEX[data[star + 1]] * 16 + _HEX[data[star + 2]]
    right: NDArray[np.bool_] = found == given
    return right


def _named(rows: Bytes) -> NDArray[np.bool_]:
    """(n,) whether (n, 8) bytes begin with an address: three capitals or digits, at least."""
    head = rows[:, :3]
    capital, digit = head - np.uint8(65) < 26, head - np.uint8(48) < 10
    named: NDArray[np.bool_] = (capital | digit).all(axis=1) & capital[:, 0]
    return named


def chunks(size: int, chunk_bytes: int) -> Iterator[tuple[int, int]]:
    """(low, high) of stretches of a file; a sentence belongs to the one it begins in."""
    for low in range(0, size, chunk_bytes):
        yield low, min(low + chunk_bytes, size)


def sentences_of(path: Path, low: int, high: int, *, unchecked: bool) -> Sentences:
    """The sentences that begin at the bytes [low, high) of a file."""
    with path.open("rb") as file:
        file.seek(low)
        raw = file.read(high - low + _OVERLAP)
    return find(raw, commit=high - low, unchecked=unchecked)
