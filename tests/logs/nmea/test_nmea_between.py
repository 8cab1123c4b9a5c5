"""What lies between sentences: frames of three protocols, rejected sentences, orphans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sbas.logs.nmea import nmea_between
from sbas.logs.nmea.nmea_between import Between, binary_bytes, ubx_frames

# A DOP block of pysbf2's tests, and message 1005, the example of RTCM 10403.3, 4.2.
DOP = bytes.fromhex("244057f9a10f2000e052c91c3f0925004f0028002c004200f5e77840fc96b540")
RTCM = bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")


def ubx(payload: bytes) -> bytes:
    """A frame with its checksum by the loop of the protocol specification."""
    body = b"\x02\x13" + len(payload).to_bytes(2, "little") + payload
    a = b = 0
    for byte in body:
        a = (a + byte) % 256
        b = (b + a) % 256
    return b"\xb5\x62" + body + bytes((a, b))


def looked(path: Path, data: bytes, start: int = 0) -> tuple[Between, list[int]]:
    path.write_bytes(data)
    between = Between()
    damaged = between.look(path, np.array([start]), np.array([len(data)]))
    return between, damaged.tolist()


def test_ubx_checksums() -> None:
    rng = np.random.default_rng(1)
    good = [ubx(rng.bytes(int(n))) for n in rng.integers(0, 900, 60)]
    data = np.frombuffer(b"".join(good) + b"\xb5\x62\x01", np.uint8)
    start, end = ubx_frames(data)
    lengths = np.array([len(frame) for frame in good])
    assert set(np.cumsum(lengths)) <= set(end.tolist())
    assert lengths.sum() == binary_bytes(data)[0]
    hurt = data.copy()
    hurt[start[3] + 7] ^= 1
    assert len(ubx_frames(hurt)[0]) == len(start) - 1


def test_counts(tmp_path: Path) -> None:
    data = b"\r\n" + DOP + RTCM + ubx(b"payload") + b"orphan" + b"$GPGGA,1,2*00\r\n" + DOP[:9]
    between, damaged = looked(tmp_path / "x", data)
    assert between.frames == {"SBF": 1, "RTCM": 1, "UBX": 1}
    assert between.rejected == 1
    assert between.first_rejected.endswith("$GPGGA,1,2*00")
    at = data.index(b"orphan")
    assert between.first_orphans == [at, len(data) - 9]
    assert between.orphan_bytes == 6 + 9
    assert damaged == [0]
    whole, harmless = looked(tmp_path / "x", data[:at])
    assert (whole.orphan_bytes, harmless) == (0, [])


def test_a_frame_reaches_into_no_sentence(tmp_path: Path) -> None:
    frame = ubx(b"x" * 50)
    between, _ = looked(tmp_path / "x", frame, start=10)
    assert between.orphan_bytes == len(frame) - 10


def test_long_stretches_are_looked_at_piece_by_piece(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(2)
    parts = [ubx(rng.bytes(300)), DOP, RTCM, b"junk", b"$GPGGA,1*00\r\n", rng.bytes(70)]
    data = b"".join(parts[k] for k in rng.integers(0, len(parts), 6000))
    whole, _ = looked(tmp_path / "x", data)
    assert len(data) > 400_000
    assert min(whole.frames.values()) > 900
    assert whole.rejected > 900
    monkeypatch.setattr(nmea_between, "PIECE_BYTES", 90_000)
    assert looked(tmp_path / "x", data)[0] == whole
