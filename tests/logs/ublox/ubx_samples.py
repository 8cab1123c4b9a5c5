"""UBX messages that several tests share; packed with `struct`, not with the reader's layouts."""

from __future__ import annotations

import struct
from datetime import UTC, datetime, timedelta

WEEK = 2408
ITOW = 324_000_000
"""2026-03-04 18:00:00 GPST."""
LEAP_S = 18
NMEA = b"$GPGGA,093000.00,5002.0700,N,01546.2720,E,2,08,1.1,245.3,M,44.5,M,3.0,0120*47\r\n"
RTCM_1005 = bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")


def checksum(body: bytes) -> bytes:
    """CK_A and CK_B over class to payload, byte by byte (RFC 1145)."""
    a = b = 0
    for byte in body:
        a = (a + byte) & 255
        b = (b + a) & 255
    return bytes((a, b))


def ubx(key: int, payload: bytes) -> bytes:
    body = struct.pack(">HH", key, 0)[:2] + struct.pack("<H", len(payload)) + payload
    return b"\xb5\x62" + body + checksum(body)


def utc_of(itow_ms: int, week: int = WEEK) -> datetime:
    gps = timedelta(weeks=week, milliseconds=itow_ms)
    return datetime(1980, 1, 6, tzinfo=UTC) + gps - timedelta(seconds=LEAP_S)


def pvt(itow_ms: int, **changes: object) -> bytes:
    """NAV-PVT of a differential 3D fix; `utc` and `length` change date and payload length."""
    f: dict[str, object] = {
        "valid": 7, "fix_type": 3, "flags": 3, "n_sv": 12, "lon": 157_712_000, "lat": 500_345_000,
        "height": 289_400, "altitude": 244_900, "h_acc": 1200, "v_acc": 1900, "vn": 100, "ve": -200,
        "vd": 30, "speed": 224, "pdop": 151, "flags_3": 3 << 1, "utc": utc_of(itow_ms),
        "length": 92,
    } | changes  # fmt: skip
    t: datetime = f["utc"]  # type: ignore[assignment]
    nano = f.get("nano", t.microsecond * 1000)
    payload = struct.pack(
        "<IHBBBBBBIiBBBBiiiiIIiiiiiIIHH",
        itow_ms, t.year, t.month, t.day, t.hour, t.minute, t.second, f["valid"], 30, nano,
        f["fix_type"], f["flags"], 0, f["n_sv"], f["lon"], f["lat"], f["height"], f["altitude"],
        f["h_acc"], f["v_acc"], f["vn"], f["ve"], f["vd"], f["speed"], 0, 0, 0, f["pdop"],
        f["flags_3"],
    )  # fmt: skip
    return ubx(0x0107, payload.ljust(f["length"], b"\0"))  # type: ignore[arg-type]


def dop(itow_ms: int, pdop: int = 150, vdop: int = 120, hdop: int = 90) -> bytes:
    return ubx(0x0104, struct.pack("<IHHHHHHH", itow_ms, 180, pdop, 100, vdop, hdop, 60, 70))


def cov(
    itow_ms: int,
    nn: float = 1.0,
    ne: float = 0.1,
    ee: float = 0.25,
    dd: float = 4.0,
    valid: int = 1,
) -> bytes:
    head = struct.pack("<IBBB9x", itow_ms, 0, valid, 1)
    return ubx(0x0136, head + struct.pack("<12f", nn, ne, 0.5, ee, 0.6, dd, *[0.0] * 6))


def pl(
    itow_ms: int,
    levels: tuple[int, int, int] = (3000, 4000, 9000),
    *,
    risk: tuple[int, int] = (5, 0),
    valid: int = 1,
    frame: int = 1,
    reason: int = 0,
) -> bytes:
    return ubx(
        0x0162,
        struct.pack("<BBbBBBBBBBB", 0, *risk, valid, frame, valid, frame, valid, reason, 0, 0)
        + struct.pack("<xI6IHHII", itow_ms, *levels, 7, 7, 7, 0, 0, 1, 0),
    )


def sbas(itow_ms: int, geo: int = 123) -> bytes:
    return ubx(0x0132, struct.pack("<IBBbBBBH", itow_ms, geo, 1, 1, 7, 0, 0, 0))


def timegps(itow_ms: int, *, week: int = WEEK, leap_s: int = LEAP_S, valid: int = 7) -> bytes:
    return ubx(0x0120, struct.pack("<IihbBI", itow_ms, -1500, week, leap_s, valid, 12))


def eoe(itow_ms: int) -> bytes:
    return ubx(0x0161, struct.pack("<I", itow_ms))


def raw(itow_ms: int, week: int = WEEK) -> bytes:
    """RXM-RAW of no satellite."""
    return ubx(0x0210, struct.pack("<ihBB", itow_ms, week, 0, 0))


def rawx(tow_s: float, week: int = WEEK) -> bytes:
    """RXM-RAWX of no satellite."""
    return ubx(0x0215, struct.pack("<dHbB4x", tow_s, week, LEAP_S, 0))


FRAME = bytes.fromhex("9a6a4812e0a705b836ffdffefff7843429614b09503e81d20e70738009e8c700")
"""A real frame of PRN 136, MT 26, CRC-24Q good (methods page, section 11)."""


def sfrbx(prn: int, frame: bytes = FRAME, *, gnss: int = 1, signal: int = 0) -> bytes:
    words = struct.pack(f"<{len(frame) // 4}I", *struct.unpack(f">{len(frame) // 4}I", frame))
    return ubx(0x0213, struct.pack("<8B", gnss, prn, signal, 0, len(frame) // 4, 0, 2, 0) + words)


def epoch(itow_ms: int, **changes: object) -> bytes:
    """All messages of one epoch."""
    return (
        dop(itow_ms) + pvt(itow_ms, **changes) + timegps(itow_ms) + sbas(itow_ms) + cov(itow_ms)
        + pl(itow_ms) + eoe(itow_ms)
    )  # fmt: skip


def reference_frames(data: bytes, max_payload: int = 8192) -> list[tuple[int, int, bytes]]:
    """(place, class << 8 | id, bytes) of every frame, by a plain loop.

    After a failure it goes on two bytes on; after a frame, behind the frame.
    """
    found = []
    at = data.find(b"\xb5\x62")
    while at >= 0:
        length = int.from_bytes(data[at + 4 : at + 6], "little")
        whole = data[at : at + 8 + length]
        if (
            length <= max_payload
            and len(whole) == 8 + length
            and at + 8 <= len(data)
            and checksum(whole[2:-2]) == whole[-2:]
        ):
            found.append((at, whole[2] << 8 | whole[3], whole))
            at = data.find(b"\xb5\x62", at + 8 + length)
        else:
            at = data.find(b"\xb5\x62", at + 2)
    return found
