"""Layouts of the UBX messages that the reader understands: where their fields lie.

Offsets count from the first byte of the payload. Source: the tables of pyubx2 1.4.0, and for the
invalidity reasons of NAV-PL `nav_pl.rs` of ublox-rs. Later versions of a message only add fields,
so a longer payload than known is read by the fields that are known.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sbas.logs.ublox.ubx_framing import EXTRA_BYTES, HEADER_BYTES, Frames

NAV_PVT, NAV_DOP, NAV_COV, NAV_PL = 0x0107, 0x0104, 0x0136, 0x0162
NAV_SBAS, NAV_TIMEGPS, NAV_EOE = 0x0132, 0x0120, 0x0161
RXM_RAW, RXM_RAWX, RXM_SFRB, RXM_SFRBX = 0x0210, 0x0215, 0x0211, 0x0213

Raw = dict[str, NDArray[Any]]
"""Fields of messages of one kind by name, (n,) each, with `position`: their place in the file."""


@dataclass(frozen=True)
class Message:
    """One kind of message: its shortest payload [bytes], and (offset, dtype) of its fields."""

    name: str
    shortest: int
    fields: dict[str, tuple[int, str]]


def _message(name: str, shortest: int, layout: str) -> Message:
    """Message from words `offset:type:name`."""
    fields = {}
    for word in layout.split():
        offset, kind, field_name = word.split(":")
        shape, type_ = kind[: -len("u4")], kind[-len("u4") :]
        fields[field_name] = (int(offset), f"{shape}<{type_}")
    return Message(name, shortest, fields)


MESSAGES: dict[int, Message] = {
    NAV_PVT: _message("NAV-PVT", 84, """0:u4:itow_ms 4:u2:year 6:u1:month 7:u1:day 8:u1:hour
        9:u1:minute 10:u1:second 11:u1:valid 16:i4:nano 20:u1:fix_type 21:u1:fix_flags
        23:u1:n_sv 24:i4:lon 28:i4:lat 32:i4:height 36:i4:altitude 40:u4:h_accuracy
        44:u4:v_accuracy 48:i4:vn 52:i4:ve 56:i4:vd 60:i4:speed 76:u2:pdop 78:u2:fix_flags_3"""),
    NAV_DOP: _message("NAV-DOP", 18, "0:u4:itow_ms 6:u2:pdop 10:u2:vdop 12:u2:hdop"),
    NAV_COV: _message("NAV-COV", 64, """0:u4:itow_ms 5:u1:position_valid
        16:f4:nn 20:f4:ne 28:f4:ee 36:f4:dd"""),
    NAV_PL: _message("NAV-PL", 52, """1:u1:risk_digits 2:i1:risk_exponent 3:u1:valid 4:u1:axes
        8:u1:reason 12:u4:itow_ms 16:u4:level_1 20:u4:level_2 24:u4:level_3"""),
    NAV_SBAS: _message("NAV-SBAS", 12, "0:u4:itow_ms 4:u1:geo"),
    NAV_TIMEGPS: _message("NAV-TIMEGPS", 16, "0:u4:itow_ms 8:i2:week 10:i1:leap_s 11:u1:valid"),
    NAV_EOE: _message("NAV-EOE", 4, "0:u4:itow_ms"),
    RXM_RAW: _message("RXM-RAW", 8, "0:i4:itow_ms 4:i2:week"),
    RXM_RAWX: _message("RXM-RAWX", 16, "0:f8:tow_s 8:u2:week"),
    RXM_SFRB: _message("RXM-SFRB", 42, "1:u1:prn 2:(8,)u4:words"),
    RXM_SFRBX: _message("RXM-SFRBX", 8, "0:u1:gnss 1:u1:prn 2:u1:signal 4:u1:n_words"),
}  # fmt: skip
"""Every message that the reader understands, by class << 8 | id."""

SFRBX_SBAS = _message("RXM-SFRBX with 8 words", 40, """0:u1:gnss 1:u1:prn 2:u1:signal
    4:u1:n_words 8:(8,)u4:words""")  # fmt: skip
"""RXM-SFRBX as it is for a frame of 250 bits."""

POSITIONS_NOT_READ = {
    0x0101: "NAV-POSECEF", 0x0102: "NAV-POSLLH", 0x0106: "NAV-SOL", 0x0113: "NAV-HPPOSECEF",
    0x0114: "NAV-HPPOSLLH", 0x2907: "NAV2-PVT",
}  # fmt: skip
"""Messages with a position beside NAV-PVT; named where a log has no other."""


def long_enough(frames: Frames, key: int, shortest: int) -> tuple[NDArray[np.int64], int]:
    """Places of the frames of one kind whose payload suffices, and how many are too short.

    An empty payload asks for the message instead of being one, and counts as neither.
    """
    at = np.flatnonzero(frames.key == key)
    payload = frames.end[at] - frames.start[at] - EXTRA_BYTES
    short = payload < shortest
    if not short.any():
        return frames.start[at], 0
    return frames.start[at[~short]], int(np.count_nonzero(short & (payload > 0)))


def read_fields(
    frames: Frames, start: NDArray[np.int64], message: Message, names: Iterable[str]
) -> Raw:
    """Raw values of some fields of the frames that begin at `start`, with their `position`."""
    offsets = {name: message.fields[name] for name in names}
    size = max((at + np.dtype(kind).itemsize for at, kind in offsets.values()), default=0)
    raw: Raw = {"position": start}
    if not size or not len(start):
        return raw | {name: np.empty(0, kind) for name, (_, kind) in offsets.items()}
    rows = sliding_window_view(frames.data, size)[start - frames.offset + HEADER_BYTES]
    layout = np.dtype(
        {
            "names": list(offsets),
            "formats": [kind for _, kind in offsets.values()],
            "offsets": [at for at, _ in offsets.values()],
            "itemsize": size,
        }
    )
    records = rows.view(layout)[:, 0]
    return raw | {name: np.ascontiguousarray(records[name]) for name in offsets}
