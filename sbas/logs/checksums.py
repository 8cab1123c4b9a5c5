"""Cyclic redundancy checks of receiver logs, for many blocks at a time.

CRC-16 with polynomial 0x1021 and seed 0 for SBF (PolaRx5TR Reference Guide 5.5.0, p. 297; equal
to Python's `binascii.crc_hqx(data, 0)`), CRC-24Q with polynomial 0x1864CFB for RTCM 3 frames
(RTCM 10403, section 4). Both start from zero, so zeros in front of a message change nothing.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

_STRIP_ROWS = 8192
_SEGMENT_BYTES = 1024

Bytes = NDArray[np.uint8]
Crc = NDArray[np.uint16]


def _after_zero_bits(bits: int) -> Crc:
    """CRC-16 after some further zero bits, of each CRC before them."""
    crc: NDArray[Any] = np.arange(65536, dtype=np.uint32)
    for _ in range(bits):
        crc = (crc << 1) ^ np.where(crc & 0x8000, np.uint32(0x11021), np.uint32(0))
    return crc.astype(np.uint16)


def _word_table() -> Crc:
    """CRC-16 of each two-byte word, both the word and the CRC with their bytes swapped.

    A file's words are read as little-endian, but the CRC takes the first byte as the more
    significant. Swapping bytes commutes with XOR: a swapped table spares swapping the data.
    """
    table = np.empty(65536, np.uint16)
    table[np.arange(65536, dtype=np.uint16).byteswap()] = _after_zero_bits(16).byteswap()
    return table


_WORD_CRC = _word_table()


def crc16_of_rows(rows: Bytes) -> Crc:
    """CRC-16 of each of (n, length) rows of bytes; `length` is even.

    Two bytes a step through a table of 65,536 entries, all rows of a strip at once.
    """
    result = np.empty(len(rows), np.uint16)
    words = rows.view("<u2")
    for start in range(0, len(rows), _STRIP_ROWS):
        strip = words[start : start + _STRIP_ROWS]
        crc = np.zeros(len(strip), np.uint16)
        index = np.empty(len(strip), np.intp)
        for column in range(strip.shape[1]):
            np.bitwise_xor(strip[:, column], crc, out=index)
            np.take(_WORD_CRC, index, out=crc, mode="wrap")
        result[start : start + _STRIP_ROWS] = crc.byteswap()
    return result


@cache
def _shift_tables() -> tuple[Crc, ...]:
    """CRC-16 after 2**k further zero bytes, k = 0..15, of each CRC before them."""
    tables = [_after_zero_bits(8)]
    for _ in range(15):
        tables.append(tables[-1][tables[-1]])
    return tuple(tables)


def _shifted(crc: Crc, zero_bytes: NDArray[np.int64]) -> Crc:
    """(n,) CRC-16 after (n,) further zero bytes, each fewer than 65,536."""
    for k, table in enumerate(_shift_tables()):
        crc = np.where(zero_bytes >> k & 1 == 1, table[crc], crc)
    return crc


def crc16_of_spans(data: Bytes, start: NDArray[np.int64], end: NDArray[np.int64]) -> Crc:
    """CRC-16 of the spans data[start:end], in time proportional to the data, however they overlap.

    Every span's CRC follows from those of two prefixes of the data, for the CRC is linear:
    crc(a..b) = crc(0..b) XOR crc(0..a followed by b - a zeros).

    Parameters
    ----------
    data : (n,) bytes.
    start, end : (m,) spans, each shorter than 65,536 bytes.
    """
    segments = -(-len(data) // _SEGMENT_BYTES) + 1
    padded = np.zeros((segments, _SEGMENT_BYTES), np.uint8)
    padded.reshape(-1)[: len(data)] = data
    one_byte = _shift_tables()[0]
    inside = np.zeros((_SEGMENT_BYTES + 1, segments), np.uint16)
    for i in range(_SEGMENT_BYTES):
        inside[i + 1] = one_byte[inside[i] ^ (padded[:, i].astype(np.uint16) << 8)]
    before = [0]
    across = _shift_tables()[_SEGMENT_BYTES.bit_length() - 1].tolist()
    for whole in inside[_SEGMENT_BYTES].tolist():
        before.append(across[before[-1]] ^ whole)
    prefix_of_segment = np.array(before, np.uint16)

    def prefix(at: NDArray[np.int64]) -> Crc:
        segment, within = np.divmod(at, _SEGMENT_BYTES)
        return _shifted(prefix_of_segment[segment], within) ^ inside[within, segment]

    return prefix(end) ^ _shifted(prefix(start), end - start)


@cache
def _crc24q_table() -> NDArray[np.uint32]:
    crc: NDArray[Any] = np.arange(256, dtype=np.uint32) << 16
    for _ in range(8):
        crc = (crc << 1) ^ np.where(crc & 0x800000, np.uint32(0x1864CFB), np.uint32(0))
    return crc


def crc24q_of_rows(rows: Bytes) -> NDArray[np.uint32]:
    """CRC-24Q of each of (n, length) rows of bytes; shorter messages have zeros in front."""
    table = _crc24q_table()
    crc = np.zeros(len(rows), np.uint32)
    for column in range(rows.shape[1]):
        crc = (crc << 8 & 0xFFFFFF) ^ table[(crc >> 16) ^ rows[:, column]]
    return crc
