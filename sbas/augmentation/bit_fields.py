"""Numbers from the bits of many messages at once; bit 0 is the first one sent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bits = NDArray[np.uint8]
Ints = NDArray[np.int64]

FRAME_BYTES = 32
DATA_BITS = 226


def bits_of(frames: NDArray[np.uint8]) -> Bits:
    """(n, 256) bits of (n, 32) bytes."""
    return np.unpackbits(frames, axis=1)


def unsigned(bits: Bits, start: int, length: int) -> Ints:
    """(n,) integers of `length` bits from `start`."""
    value = np.zeros(len(bits), np.int64)
    for column in bits[:, start : start + length].T:
        value <<= 1
        value |= column
    return value


def signed(bits: Bits, start: int, length: int) -> Ints:
    """(n,) integers in two's complement."""
    value = unsigned(bits, start, length)
    return value - (bits[:, start].astype(np.int64) << length)


def unsigned_series(bits: Bits, start: int, length: int, count: int, stride: int) -> Ints:
    """(n, count) integers of `length` bits, the first from `start`, each `stride` on."""
    value = np.zeros((len(bits), count), np.int64)
    first = start + stride * np.arange(count)
    for k in range(length):
        value <<= 1
        value |= bits[:, first + k]
    return value


def signed_series(bits: Bits, start: int, length: int, count: int, stride: int) -> Ints:
    """(n, count) integers in two's complement; as `unsigned_series`."""
    value = unsigned_series(bits, start, length, count, stride)
    sign = bits[:, start + stride * np.arange(count)].astype(np.int64)
    return value - (sign << length)
