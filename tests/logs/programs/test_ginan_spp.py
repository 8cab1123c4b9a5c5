"""Ginan `.SPP`: both versions of its columns, the alarm's stand-in, damage."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs import text_input
from sbas.logs.programs import ginan_spp
from sbas.recording import Flag, Recording

HEADER = (
    "\n*YYYY-MM-DDTHH:MM:SS.SSS YYYY.YYYYYYYYY        X             Y              Z           "
    "HDOP       VDOP       GDOP      - - -       N recv          E recv       H recv   - - - -     "
    "HPL        VPL      - - -"
)
LAT, LON, HEIGHT = -35.2801, 149.1310, 600.5


def record(
    second: float,
    hpl: float = 11.25,
    vpl: float = 18.5,
    *,
    position: tuple[float, float, float] = (LAT, LON, HEIGHT),
    geodetic: tuple[float, float, float] | None = None,
    differences: bool = False,
    hdop: float = 0.9,
) -> str:
    x, y, z = pymap3d.geodetic2ecef(*position, deg=True)
    lat, lon, height = geodetic or position
    between = f"{0.1:11.5f} {0.2:11.5f} {0.3:11.5f} {0.4:11.5f}" if differences else "- - - -"
    return (
        f"\n 2024-03-05T10:{int(second) // 60:02d}:{second % 60:06.3f} {2024.177:14.9f} "
        f"{x:14.5f} {y:14.5f} {z:14.5f} {hdop:11.4f} {1.5:11.4f} {2.1:11.4f} - - - "
        f"{lat:15.10f} {lon:15.10f} {height:11.5f} {between} {hpl:11.5f} {vpl:11.5f} - - -"
    )


def run(count: int) -> str:
    return HEADER + "".join(record(i, 11.25 + i % 7) for i in range(count))


def read(folder: Path, text: str | bytes, **options: object) -> Recording:
    path = folder / "station.SPP"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return ginan_spp.read(path, **options)  # type: ignore[arg-type]


def codes(recording: Recording) -> list[tuple[str, str]]:
    return [(f.code, f.severity) for f in recording.meta.findings]


USUAL = [("E25", "info"), ("E23", "info")]


def test_every_column(tmp_path: Path) -> None:
    recording = read(tmp_path, run(3))
    table = recording.table
    assert recording.time[2] == np.datetime64("2024-03-05T10:00:02")
    assert table["hpl_m"].tolist() == [11.25, 12.25, 13.25]
    assert table["vpl_m"].tolist() == [18.5] * 3
    assert table["hdop"].tolist() == [0.9] * 3
    assert table["vdop"].tolist() == [1.5] * 3
    assert table["lat_deg"].tolist() == pytest.approx([LAT] * 3, abs=1e-10)
    assert table["lon_deg"].tolist() == pytest.approx([LON] * 3, abs=1e-10)
    assert table["height_m"].tolist() == pytest.approx([HEIGHT] * 3, abs=2e-5)
    assert table["mode"].tolist() == ["sbas"] * 3
    assert codes(recording) == USUAL
    assert (recording.meta.pl.kind, recording.meta.pl.k_h, recording.meta.pl.k_v) == (
        "unknown", None, 5.33,
    )  # fmt: skip


def test_the_stand_in_of_an_alarm_is_no_level(tmp_path: Path) -> None:
    text = HEADER + record(0) + record(1, 8000.0, 100.0) + record(2, 8000.0, 99.0)
    recording = read(tmp_path, text)
    table = recording.table
    assert table["hpl_m"].isna().tolist() == [False, True, False]
    assert table["vpl_m"].isna().tolist() == [False, True, False]
    assert table["flags"].tolist() == [0, Flag.PL_SENTINEL, 0]
    assert "8000 (beside VPL 100)" in recording.meta.findings[0].evidence


def test_no_level_and_no_dilution(tmp_path: Path) -> None:
    recording = read(tmp_path, HEADER + record(0, 0.0, 0.0, hdop=0.0) + record(1))
    table = recording.table
    assert table[["hpl_m", "vpl_m", "hdop"]].isna().all(axis=1).tolist() == [True, False]
    assert table["mode"].isna().tolist() == [True, False]
    assert ("E07", "warning") in codes(recording)


def test_positions_of_x_y_z_where_an_earlier_version_writes_the_a_priori_ones(
    tmp_path: Path,
) -> None:
    # `pos = ecef2pos(apriori)` in writeSPP of earlier versions of Ginan.
    apriori = (LAT + 2e-5, LON, HEIGHT)
    text = HEADER + "".join(
        record(i, position=(LAT, LON, HEIGHT + i), geodetic=apriori, differences=True)
        for i in range(3)
    )
    recording = read(tmp_path, text)
    assert recording.table["lat_deg"].tolist() == pytest.approx([LAT] * 3, abs=1e-10)
    assert recording.table["height_m"].tolist() == pytest.approx([HEIGHT + i for i in range(3)])
    found = recording.meta.findings[0]
    assert (found.code, found.severity) == ("E25", "warning")
    assert "3 of 3 records" in found.evidence


def test_one_record_with_another_position_was_damaged(tmp_path: Path) -> None:
    lines = run(5).split("\n")
    lines[4] = lines[4].replace("149.1310", "149.1410")
    recording = read(tmp_path, "\n".join(lines))
    assert len(recording) == 4
    assert codes(recording)[0] == ("E10", "error")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("- - -", "- -"),
        (" 2.1000 - ", " 2.1000 7 "),
        ("T10:00:00", "T10:61:00"),
        ("T10:00:00.000", "T10:00:60.000"),
        ("11.25000", "11.2x000"),
        ("2024-03", "2024-13"),
        ("149.1310000000", "1e999"),
        ("11.25000", "1e999"),
    ],
)
def test_a_damaged_record_is_left_out(tmp_path: Path, old: str, new: str) -> None:
    bad = record(0).replace(old, new, 1)
    assert bad != record(0)
    recording = read(tmp_path, HEADER + bad + record(5) + record(6))
    assert len(recording) == 2
    assert codes(recording)[0] == ("E10", "error")


def test_the_last_record_has_no_line_end(tmp_path: Path) -> None:
    whole = read(tmp_path, run(3))
    assert len(whole) == 3
    assert len(read(tmp_path, run(3) + "\n")) == 3
    cut = read(tmp_path, run(3)[:-2])
    assert len(cut) == 2
    assert codes(cut)[0] == ("E10", "error")


def test_a_file_cut_anywhere_gives_rows_of_the_whole_one(tmp_path: Path) -> None:
    text = run(3)
    whole = read(tmp_path, text).table
    for at in range(1, len(text), 5):
        with contextlib.suppress(InputError):
            cut = read(tmp_path, text[:at]).table
            pd.testing.assert_frame_equal(cut, whole.loc[cut.index])


def test_order_and_repetition_stay(tmp_path: Path) -> None:
    recording = read(tmp_path, HEADER + record(5) + record(3) + record(5))
    assert (recording.time.astype("M8[s]").astype(int) % 60).tolist() == [5, 3, 5]


def test_a_second_header_is_no_record(tmp_path: Path) -> None:
    recording = read(tmp_path, run(2) + HEADER + record(9))
    assert len(recording) == 3
    assert codes(recording) == USUAL


def test_no_record(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="header and no data") as caught:
        read(tmp_path, HEADER + "\n")
    assert caught.value.code == "E15"
    with pytest.raises(InputError, match="no record"):
        read(tmp_path, HEADER + "\n nonsense\n")


def test_the_size_of_blocks_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = read(tmp_path, run(150))
    monkeypatch.setattr(text_input, "BLOCK_BYTES", 701)
    pieces = read(tmp_path, run(150))
    pd.testing.assert_frame_equal(pieces.table, whole.table)
    assert pieces.meta == whole.meta


@given(
    lat=st.floats(0.001, 89) | st.floats(-89, -0.001),
    lon=st.floats(-179.9, 179.9),
    height=st.floats(-300, 9000),
    hpl=st.floats(0.1, 600),
    ms=st.integers(0, 3_599_999),
)
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory,
    lat: float,
    lon: float,
    height: float,
    hpl: float,
    ms: int,
) -> None:
    text = HEADER + record(ms / 1000, hpl, position=(lat, lon, height))
    recording = read(tmp_path_factory.getbasetemp(), text)
    row = recording.table.iloc[0]
    metre = 1 / 111_000
    assert abs(row["lat_deg"] - lat) < 2e-5 * metre
    assert abs(row["lon_deg"] - lon) * np.cos(np.radians(lat)) < 2e-5 * metre
    assert abs(row["height_m"] - height) < 2e-5
    assert abs(row["hpl_m"] - hpl) <= 5.1e-6
    start = np.datetime64("2024-03-05T10:00:00", "ns")
    assert recording.time[0] == start + np.timedelta64(ms, "ms")


def test_sniff() -> None:
    assert ginan_spp.sniff(run(1).encode(), b"", b"", Path("x")).score == 95
    for differences in (False, True):
        alone = record(3, differences=differences).encode()
        assert ginan_spp.sniff(alone, b"", b"", Path("x")).score == 95
    for other in (b"", b"\n 2024-03-05T10:00:00.000 1 2 3\n", b"\xff" * 99):
        assert ginan_spp.sniff(other, b"", b"", Path("x")).score == 0
