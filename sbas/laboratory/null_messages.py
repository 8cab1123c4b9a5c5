"""SBAS null messages (type 63) as a receiver hands them on: 250 bits with preamble and CRC."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.timescales import GPS_EPOCH_NS, NS_PER_S

PREAMBLES = (0x53, 0x9A, 0xC6)
NULL_MESSAGE_TYPE = 63
FRAME_BYTES = 32
_CRC24Q = 0x1864CFB


def crc24q(message: int, bits: int) -> int:
    """CRC-24Q of the `bits` bits of an integer, most significant bit first.

    Remainder of message * 2^24 by 0x1864CFB, start value 0, no reflection.
    Source: RTCA DO-229D, A.4.3.3.
    """
    remainder = message << 24
    for position in range(bits + 23, 23, -1):
        if remainder >> position & 1:
            remainder ^= _CRC24Q << (position - 24)
    return remainder


def null_frame(preamble: int) -> bytes:
    """The 250 bits of a null message in received order, padded with six zero bits to 32 bytes."""
    data = (preamble << 6 | NULL_MESSAGE_TYPE) << 212
    return ((data << 24 | crc24q(data, 226)) << 6).to_bytes(FRAME_BYTES, "big")


_FRAMES = np.frombuffer(b"".join(map(null_frame, PREAMBLES)), np.uint8).reshape(3, FRAME_BYTES)


def null_frame_table(time: NDArray[np.datetime64], *, prn: int) -> pd.DataFrame:
    """Side table `sbas_frames` with one null message at each of (n,) whole seconds of GPS time.

    `time` is the reception of the last bit; a message takes one second, and the first preamble
    begins with every third second of the week. Columns: time, prn (i2), crc_passed (bool),
    signal ("L1"), frame (32 bytes).
    """
    second = (time.astype("M8[ns]").astype(np.int64) - GPS_EPOCH_NS) // NS_PER_S - 1
    frames = pa.Array.from_buffers(
        pa.binary(FRAME_BYTES), len(time), [None, pa.py_buffer(_FRAMES[second % 3].tobytes())]
    )
    return pd.DataFrame(
        {
            "time": time,
            "prn": np.full(len(time), prn, np.int16),
            "crc_passed": np.ones(len(time), bool),
            "signal": pd.array(np.full(len(time), "L1"), dtype="str"),
            "frame": pd.arrays.ArrowExtensionArray(frames),
        }
    )
