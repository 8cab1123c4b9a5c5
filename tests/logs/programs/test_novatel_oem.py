"""NovAtel logs: messages that the library makes, damage, and a file without the library."""

from __future__ import annotations

import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sbas.exceptions import InputError
from sbas.logs.programs import novatel_oem
from sbas.recording import Flag, Recording

WEEK = 2353


def message(number: int, body: bytes, tow_ms: int, *, week: int = WEEK, status: int = 180) -> bytes:
    """A binary message with the long header (OEM7 manual, 1.1.3)."""
    header = (
        b"\xaa\x44\x12" + bytes([28]) + number.to_bytes(2, "little") + b"\0\0"
        + len(body).to_bytes(2, "little") + b"\0\0" + b"\0" + bytes([status])
        + week.to_bytes(2, "little") + tow_ms.to_bytes(4, "little") + b"\0" * 8
    )  # fmt: skip
    crc = zlib.crc32(header + body, 0xFFFFFFFF) ^ 0xFFFFFFFF
    return header + body + crc.to_bytes(4, "little")


def position(
    tow_ms: int, *, status: int = 0, kind: int = 18, lat: float = 50.0345, time_status: int = 180,
    station: bytes = b"123\0", sigma: float = 0.5, datum: int = 61,
) -> bytes:  # fmt: skip
    fields = np.array(
        (status, kind, lat, 15.7712, 245.3, 44.5, datum, sigma, 0.25, 0.75, station, 3.0, 0.0,
         11, 8),
        dtype=[("s", "<u4"), ("k", "<u4"), ("lat", "<f8"), ("lon", "<f8"), ("h", "<f8"),
               ("u", "<f4"), ("d", "<u4"), ("sn", "<f4"), ("se", "<f4"), ("su", "<f4"),
               ("id", "S4"), ("age", "<f4"), ("sol", "<f4"), ("tr", "u1"), ("us", "u1")],
    )  # fmt: skip
    return message(42, fields.tobytes() + b"\0" * 6, tow_ms, status=time_status)


def levels(tow_ms: int, *, hpl_status: int = 1, integrity: int = 1) -> bytes:
    fields = np.array(
        (1, integrity, hpl_status, 12.5, 1, 20.25, 0),
        dtype=[("m", "<u4"), ("i", "<u4"), ("hs", "<u4"), ("h", "<f8"), ("vs", "<u4"),
               ("v", "<f8"), ("n", "<u4")],
    )  # fmt: skip
    return message(1286, fields.tobytes(), tow_ms)


def dilution(tow_ms: int) -> bytes:
    body = np.array([2.25, 1.5, 1.25, 1.3, 0.5, 5.0], "<f4").tobytes()
    return message(174, body + (0).to_bytes(4, "little"), tow_ms)


def velocity(tow_ms: int, track: float = 30.0) -> bytes:
    fields = np.array(
        (0, 8, 0.15, 0.0, 10.0, track, -0.5, 0),
        dtype=[("s", "<u4"), ("k", "<u4"), ("l", "<f4"), ("a", "<f4"), ("h", "<f8"), ("t", "<f8"),
               ("v", "<f8"), ("r", "<f4")],
    )  # fmt: skip
    return message(99, fields.tobytes(), tow_ms)


TOW = 561_662_000
RUN = b"".join(
    part(TOW + 1000 * i) for i in range(40) for part in (position, levels, dilution, velocity)
)
NMEA = b"$GPGGA,093000.00,5002.0700,N,01546.2720,E,2,08,1.1,245.3,M,44.5,M,3.0,0120*47\r\n"


@pytest.fixture(scope="module")
def library() -> Any:
    return pytest.importorskip("novatel_edie", reason="the extra 'novatel' is not installed")


def read(folder: Path, data: bytes, **options: object) -> Recording:
    path = folder / "rover.gps"
    path.write_bytes(data)
    return novatel_oem.read(path, **options)  # type: ignore[arg-type]


def codes(recording: Recording) -> list[tuple[str, str]]:
    return [(f.code, f.severity) for f in recording.meta.findings]


def test_every_column(library: Any, tmp_path: Path) -> None:
    recording = read(tmp_path, RUN)
    assert len(recording) == 40
    assert recording.time[0] == np.datetime64("2025-02-15T12:01:02")
    row = recording.table.iloc[-1]
    expected = {
        "lat_deg": 50.0345, "lon_deg": 15.7712, "height_m": 289.8, "sigma_n_m": 0.5,
        "sigma_e_m": 0.25, "sigma_u_m": 0.75, "correction_age_s": 3.0, "n_sv": 8,
        "n_sv_tracked": 11, "geo_prn": 123, "hdop": 1.25, "pdop": 1.5, "speed_mps": 10.0,
        "vel_e_mps": 5.0, "vel_n_mps": 10 * np.cos(np.pi / 6), "vel_u_mps": -0.5, "hpl_m": 12.5,
        "vpl_m": 20.25, "flags": int(Flag.RAIM_PASSED),
    }  # fmt: skip
    assert {name: row[name] for name in expected} == pytest.approx(expected, rel=1e-12)
    assert row["mode"] == "sbas"
    assert recording.meta.pl.kind == "raim"
    assert recording.meta.frame == "WGS84"
    assert codes(recording) == [("E23", "warning")]


def test_ascii_says_the_same(library: Any, tmp_path: Path) -> None:
    parser = library.oem.Parser()
    parser.write(RUN)
    text = b"".join(m.to_ascii().message for m in parser)
    assert text.startswith(b"#BESTPOSA")
    binary, ascii_ = read(tmp_path, RUN), read(tmp_path, text)
    pd.testing.assert_frame_equal(binary.table, ascii_.table)
    assert novatel_oem.sniff(text, b"", b"", Path("x")).score == 98


@pytest.mark.parametrize(
    ("status", "kind", "mode"),
    [
        (0, 16, "standalone"), (0, 17, "dgnss"), (0, 18, "sbas"), (0, 50, "rtk"), (0, 34, "rtk"),
        (0, 69, "other"), (0, 52, "other"), (1, 18, "none"), (0, 0, "none"),
    ],
)  # fmt: skip
def test_modes(library: Any, tmp_path: Path, status: int, kind: int, mode: str) -> None:
    data = position(TOW, status=status, kind=kind) + levels(TOW)
    row = read(tmp_path, data).table.iloc[0]
    assert row["mode"] == mode
    assert np.isnan(row["lat_deg"]) == (mode == "none")
    assert bool(row["flags"] & Flag.PL_OUTSIDE_SBAS) == (mode != "sbas")
    assert row["geo_prn"] == (123 if mode == "sbas" else -1)


def test_a_level_that_is_not_available_is_none(library: Any, tmp_path: Path) -> None:
    data = position(TOW) + levels(TOW, hpl_status=0, integrity=0)
    data += position(TOW + 1000) + levels(TOW + 1000, integrity=2)
    table = read(tmp_path, data).table
    assert table["hpl_m"].isna().tolist() == [True, False]
    assert table["flags"].tolist() == [
        Flag.PL_DECLARED_INVALID | Flag.RAIM_NOT_AVAILABLE,
        Flag.RAIM_FAILED,
    ]


def test_no_reliable_time_no_epoch(library: Any, tmp_path: Path) -> None:
    recording = read(tmp_path, position(TOW, time_status=60) + RUN)
    assert len(recording) == 40
    assert ("E10", "warning") in codes(recording)


def test_other_datum_no_frame(library: Any, tmp_path: Path) -> None:
    assert read(tmp_path, position(TOW, datum=63)).meta.frame == ""


def test_a_sigma_of_zero_is_none(library: Any, tmp_path: Path) -> None:
    recording = read(tmp_path, position(TOW, sigma=0.0))
    assert np.isnan(recording.table["sigma_n_m"].iloc[0])
    assert codes(recording) == [("E07", "warning"), ("E25", "warning")]


def test_messages_of_one_kind_alone(library: Any, tmp_path: Path) -> None:
    only_levels = read(tmp_path, levels(TOW)).table
    assert only_levels["hpl_m"].tolist() == [12.5]
    assert only_levels["lat_deg"].isna().all()
    assert only_levels["mode"].isna().all()
    assert len(read(tmp_path, dilution(TOW) + velocity(TOW))) == 0
    both = read(tmp_path, position(TOW) + levels(TOW + 1000)).table
    assert both["flags"].tolist()[0] == Flag.EPOCH_INCOMPLETE


def test_damage_is_counted_and_nothing_invented(library: Any, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    whole = read(tmp_path, RUN).table
    for _ in range(20):
        damaged = bytearray(RUN)
        for at in rng.integers(0, len(RUN), 10).tolist():
            damaged[at] ^= 1 << int(rng.integers(8))
        recording = read(tmp_path, bytes(damaged))
        assert any(code == "E24" for code, _ in codes(recording))
        for name in ("lat_deg", "hpl_m", "hdop", "speed_mps"):
            kept = recording.table[name].dropna()
            assert kept.tolist() == whole.loc[kept.index, name].tolist()


def test_nmea_between_is_no_damage(library: Any, tmp_path: Path) -> None:
    size = len(position(TOW))
    recording = read(tmp_path, RUN[:size] + NMEA * 3 + RUN[size:])
    pd.testing.assert_frame_equal(recording.table, read(tmp_path, RUN).table)
    assert codes(recording) == [("E23", "warning")]
    bad = read(tmp_path, RUN[:size] + NMEA.replace(b"N", b"S") + RUN[size:])
    assert ("E24", "warning") in codes(bad)


def test_a_cut_last_message_is_counted(library: Any, tmp_path: Path) -> None:
    recording = read(tmp_path, RUN[:-20])
    assert recording.table["speed_mps"].isna().tolist() == [False] * 39 + [True]
    assert codes(recording)[0][0] == "E24"


def test_the_size_of_chunks_changes_nothing(
    library: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = RUN[:500] + NMEA + RUN[500:900] + b"junk\n" + RUN[900:]
    whole = read(tmp_path, data)
    for size in (61, 1000):
        monkeypatch.setattr(novatel_oem, "CHUNK_BYTES", size)
        pieces = read(tmp_path, data)
        pd.testing.assert_frame_equal(pieces.table, whole.table)
        assert pieces.meta == whole.meta


def test_more_than_the_librarys_buffer(library: Any, tmp_path: Path) -> None:
    # A piece larger than the space left in that buffer is not taken at all.
    count = 6000
    data = b"".join(position(TOW + 10 * i) for i in range(count))
    assert len(data) > 2 * novatel_oem.CHUNK_BYTES
    assert len(read(tmp_path, data)) == count


def test_order_and_repetition_stay(library: Any, tmp_path: Path) -> None:
    data = b"".join(position(TOW + 1000 * i) for i in (3, 1, 3))
    times = read(tmp_path, data).time
    assert ((times - times[1]) / np.timedelta64(1, "s")).tolist() == [2, 0, 2]


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "novatel_edie", None)
    with pytest.raises(InputError, match="not installed") as caught:
        read(tmp_path, RUN)
    assert caught.value.cure == "pip install 'sbas[novatel]'"


def test_sniff() -> None:
    assert novatel_oem.sniff(RUN[:2000], b"", b"", Path("x")).score == 98
    assert novatel_oem.sniff(b"xy" + position(1), b"", b"", Path("x")).score == 85
    short = b"\xaa\x44\x13" + bytes([8]) + (508).to_bytes(2, "little") + b"\0" * 14
    crc = zlib.crc32(short, 0xFFFFFFFF) ^ 0xFFFFFFFF
    assert novatel_oem.sniff(short + crc.to_bytes(4, "little"), b"", b"", Path("x")).score == 85
    damaged = bytearray(position(1))
    damaged[40] ^= 1
    for other in (b"", bytes(damaged), NMEA, b"\xaa\x44\x12", b"\xaa\x44\x13\xff"):
        assert novatel_oem.sniff(other, other, other, Path("x")).score == 0
