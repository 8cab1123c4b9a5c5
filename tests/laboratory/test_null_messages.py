"""Null messages against broadcast frames and a shift register."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sbas.laboratory.null_messages import PREAMBLES, crc24q, null_frame, null_frame_table


def shift_register(bits):
    """CRC-24Q bit by bit: taps of x^24 + x^23 + x^18 + ... + 1 without the leading term."""
    register = 0
    for bit in bits:
        out = (register >> 23 & 1) ^ bit
        register = (register << 1) & 0xFFFFFF
        if out:
            register ^= 0x864CFB
    return register


def bits_of(frame, count):
    return [frame[i // 8] >> (7 - i % 8) & 1 for i in range(count)]


# Broadcast messages: MSAS types 2, 18 and 26 (RTKLIB log, 58 hex digits, 226 bits of data) and
# WAAS type 6 (64 digits, with its CRC).
BROADCAST = {
    "5308DFFC010005FFC00DFFC009FFDFFC001FFDFFDFFFBABBBBBB9BBB80": 0x0EA738,
    "5348DF0000000000FC0000FFC0007FF0003FFC001FFC0007FF8003FF80": 0x5CB54C,
    "9A680053E21F17F897C000000000000000000000000000000000006000": 0x5DC1E2,
    "C618027B95795579B9FB17BB9F97B9D5F97BBFBBBBBBBBBBBBBBBBBB978ADA00": 0x5E2B68,
}


@pytest.mark.parametrize(("text", "crc"), BROADCAST.items())
def test_crc_of_broadcast_messages(text, crc):
    data = int(text, 16) >> (len(text) * 4 - 226)
    assert crc24q(data, 226) == crc


def test_crc_is_part_of_the_broadcast_frame():
    frame = bytes.fromhex("C618027B95795579B9FB17BB9F97B9D5F97BBFBBBBBBBBBBBBBBBBBB978ADA00")
    whole = int.from_bytes(frame, "big") >> 6
    assert whole & 0xFFFFFF == crc24q(whole >> 24, 226)


@pytest.mark.parametrize("preamble", PREAMBLES)
def test_null_frame_layout_and_crc(preamble):
    frame = null_frame(preamble)
    bits = bits_of(frame, 256)
    assert len(frame) == 32
    assert frame[0] == preamble
    assert bits[8:14] == [1] * 6
    assert not any(bits[14:226])
    assert not any(bits[250:])
    crc = int("".join(map(str, bits[226:250])), 2)
    assert crc == shift_register(bits[:226])
    # Six zero bits in front, as for byte-wise checking, do not change it.
    assert crc == shift_register([0] * 6 + bits[:226])


def test_table_has_documented_columns_and_cycles_the_preambles():
    # The message received by 00:00:01 of the GPS week is its first, with the first preamble.
    time = np.datetime64("2009-09-20T00:00:01", "ns") + np.arange(7) * np.timedelta64(1, "s")
    table = null_frame_table(time, prn=120)
    assert list(table.columns) == ["time", "prn", "crc_passed", "signal", "frame"]
    assert table["prn"].dtype == np.int16
    assert table["crc_passed"].dtype == bool
    assert table["crc_passed"].all()
    assert (table["signal"] == "L1").all()
    assert isinstance(table["frame"].dtype, pd.ArrowDtype)
    assert str(table["frame"].dtype.pyarrow_dtype) == "fixed_size_binary[32]"
    assert [frame[0] for frame in table["frame"]] == [0x53, 0x9A, 0xC6, 0x53, 0x9A, 0xC6, 0x53]
    assert table["frame"].iloc[1] == null_frame(0x9A)
    assert len(null_frame_table(time[:0], prn=120)) == 0
