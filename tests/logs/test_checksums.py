"""Checksums against the published check value, Python's own, and a plain bitwise division."""

from __future__ import annotations

from binascii import crc_hqx

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sbas.logs.checksums import crc16_of_rows, crc16_of_spans, crc24q_of_rows


def test_crc16_check_value_of_xmodem() -> None:
    # 0x31C3 is the published check value of CRC-16/XMODEM; a zero in front makes the length even.
    row = np.frombuffer(b"\0" + b"123456789", np.uint8)[None, :]
    assert crc16_of_rows(row).tolist() == [0x31C3]


@given(st.integers(0, 40), st.integers(0, 50), st.integers(0, 2**32))
def test_crc16_of_rows_equals_python(rows: int, words: int, seed: int) -> None:
    data = np.random.default_rng(seed).integers(0, 256, (rows, 2 * words), dtype=np.uint8)
    assert crc16_of_rows(data).tolist() == [crc_hqx(row.tobytes(), 0) for row in data]


def test_crc16_of_rows_over_more_rows_than_a_strip() -> None:
    data = np.random.default_rng(1).integers(0, 256, (8193, 16), dtype=np.uint8)
    assert crc16_of_rows(data).tolist() == [crc_hqx(row.tobytes(), 0) for row in data]


@given(st.integers(1, 140_000), st.integers(0, 2**32))
def test_crc16_of_spans_equals_python(size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    data = rng.integers(0, 256, size, dtype=np.uint8)
    start = rng.integers(0, size + 1, 8)
    end = np.minimum(start + rng.integers(0, 65536, 8), size)
    expected = [crc_hqx(data[a:b].tobytes(), 0) for a, b in zip(start, end, strict=True)]
    assert crc16_of_spans(data, start, end).tolist() == expected


def bitwise_crc24q(data: bytes) -> int:
    remainder = int.from_bytes(data, "big") << 24
    for bit in range(8 * len(data) - 1, -1, -1):
        if remainder >> (bit + 24) & 1:
            remainder ^= 0x1864CFB << bit
    return remainder


def test_crc24q_check_value() -> None:
    # Check value of CRC-24/LTE-A, which is CRC-24Q under another name: 0xCDE703.
    row = np.frombuffer(b"123456789", np.uint8)[None, :]
    assert crc24q_of_rows(row).tolist() == [0xCDE703]


@given(st.binary(max_size=60))
def test_crc24q_equals_long_division(data: bytes) -> None:
    row = np.frombuffer(bytes(5) + data, np.uint8)[None, :]
    assert crc24q_of_rows(row).tolist() == [bitwise_crc24q(data)]
