"""gLAB output: the reference runs field by field, joins, damage, stand-ins."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs import text_input
from sbas.logs.programs import glab_output
from sbas.recording import Flag, Recording
from tests.logs.programs import glab_samples as make

RUNS = (
    # file, epochs, mode, GEO, K_H; PROVENANCE of the runs: shared/reference/glab.
    ("glab_vehicle_cres_129_PA.out", 240, "sbas_pa", 129, 6.0),
    ("glab_vehicle_cres_129_PA_breakdown.out", 240, "sbas_pa", 129, 6.0),
    ("glab_vehicle_cres_129_NPA.out", 310, "sbas_npa", 129, 6.18),
    ("glab_vehicle_cres_129_NPA_breakdown.out", 310, "sbas_npa", 129, 6.18),
    ("glab_msas_kamakura_PA.out", 10617, "sbas_pa", 137, 6.0),
    ("glab_msas_kamakura_NPA.out", 10679, "sbas_npa", 137, 6.18),
    ("glab_msas_kamakura_PA_breakdown30s.out", 354, "sbas_pa", 137, 6.0),
    ("glab_msas_kamakura_NPA_breakdown30s.out", 356, "sbas_npa", 137, 6.18),
    ("glab_waas_stanford_PA.out", 4034, "sbas_pa", 131, 6.0),
    ("glab_waas_stanford_PA_breakdown30s.out", 135, "sbas_pa", 131, 6.0),
)


def read(folder: Path, text: str | bytes, **options: object) -> Recording:
    path = folder / "glab.out"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return glab_output.read(path, **options)  # type: ignore[arg-type]


def codes(recording: Recording) -> list[tuple[str, str]]:
    return [(f.code, f.severity) for f in recording.meta.findings]


@pytest.mark.parametrize(("name", "epochs", "mode", "geo", "k_h"), RUNS)
def test_reference_runs(
    reference_data: Path, tmp_path: Path, name: str, epochs: int, mode: str, geo: int, k_h: float
) -> None:
    path = make.unpacked(reference_data, name, tmp_path)
    text = path.read_text()
    recording = glab_output.read(path)
    table = recording.table
    levels = list(make.plain_lines(text, "SBASOUT"))
    assert len(recording) == epochs == len(levels)
    assert table["hpl_m"].tolist() == [float(f[15]) for f in levels]
    assert table["vpl_m"].tolist() == [float(f[18]) for f in levels]
    assert table["n_sv_tracked"].tolist() == [int(f[22]) for f in levels]
    assert table["n_sv"].tolist() == [int(f[23]) for f in levels]
    assert set(table["x_hal_m"]) == {40.0}
    assert set(table["x_val_m"]) == {50.0}
    assert set(table["mode"]) == {mode}
    assert set(table["geo_prn"]) == {geo}
    expected = [
        np.datetime64(f"{f[1]}-01-01", "ns") + np.timedelta64(int(f[2]) - 1, "D")
        + np.timedelta64(round(float(f[3]) * 1000), "ms")
        for f in levels
    ]  # fmt: skip
    assert recording.time.tolist() == np.array(expected).tolist()
    fixes = list(make.plain_lines(text, "OUTPUT"))
    if fixes:
        assert table["lat_deg"].tolist() == [float(f[20]) for f in fixes]
        assert table["lon_deg"].tolist() == [float(f[21]) for f in fixes]
        assert table["height_m"].tolist() == [float(f[22]) for f in fixes]
        for column, field in (("pdop", 36), ("hdop", 38), ("vdop", 39)):
            assert table[column].tolist() == [float(f[field]) for f in fixes]
        assert not table["flags"].any()
    else:
        assert "lat_deg" not in table
        assert ("E25", "warning") in codes(recording)
    assert not [f for f in recording.meta.findings if f.code == "E10"]
    pl = recording.meta.pl
    assert (pl.kind, pl.k_h, pl.k_v) == ("do229", k_h, 5.33)


def test_the_vehicle_run_of_the_page(reference_data: Path, tmp_path: Path) -> None:
    # Expected: shared/methods/formats.md, section 11.
    path = make.unpacked(reference_data, "glab_vehicle_cres_129_PA.out", tmp_path)
    recording = glab_output.read(path)
    assert len(recording) == 240
    assert recording.table["hpl_m"].agg(["min", "max"]).tolist() == [16.5128, 35.1474]
    assert recording.table["vpl_m"].iloc[-1] == 51.5519
    assert recording.time[0] == np.datetime64("2008-05-26T06:01:36")
    assert recording.meta.versions == {"gLAB": "v6.0.0"}
    assert recording.meta.findings == ()
    # Its a-priori position is unknown and its errors are 0.0000: nothing may look like an error.
    assert set(recording.columns) == {
        "lat_deg", "lon_deg", "height_m", "pdop", "hdop", "vdop", "n_sv", "n_sv_tracked", "hpl_m",
        "vpl_m", "x_hal_m", "x_val_m", "geo_prn", "mode", "flags",
    }  # fmt: skip


def test_equipment_of_the_header(tmp_path: Path) -> None:
    meta = read(tmp_path, make.run(3)).meta
    assert (meta.antenna, meta.receiver) == ("TRM59800.00", "SEPT POLARX5")
    assert (meta.pl.k_h, meta.pl.k_v) == (6.0, 5.33)
    assert meta.findings == ()


def test_an_epoch_with_one_message_only_is_flagged(tmp_path: Path) -> None:
    text = make.output(10) + make.sbasout(10) + make.output(11) + make.sbasout(12)
    recording = read(tmp_path, text)
    table = recording.table
    assert table["hpl_m"].isna().tolist() == [False, True, False]
    assert table["lat_deg"].isna().tolist() == [False, False, True]
    assert table["flags"].tolist() == [0, Flag.EPOCH_INCOMPLETE, Flag.EPOCH_INCOMPLETE]
    assert table["mode"].tolist() == ["sbas_pa", "sbas", "sbas_pa"]
    found = next(f for f in recording.meta.findings if f.code == "E10")
    assert found.evidence == "1 without OUTPUT, 1 without SBASOUT"


@pytest.mark.parametrize(
    ("processing", "mode"), [(0, "standalone"), (1, "other"), (5, "sbas"), (7, "dgnss")]
)
def test_fixes_without_levels(tmp_path: Path, processing: int, mode: str) -> None:
    recording = read(tmp_path, make.output(10, processing=processing))
    assert recording.table["mode"].tolist() == [mode]
    assert "hpl_m" not in recording.table
    assert codes(recording) == [("E25", "warning")]
    assert recording.meta.pl.kind == "unknown"


def test_zero_stands_for_not_computed(tmp_path: Path) -> None:
    text = make.output(10, hdop=0.0) + make.sbasout(10, hpl=0.0)
    recording = read(tmp_path, text + make.output(11) + make.sbasout(11))
    assert recording.table["hpl_m"].isna().tolist() == [True, False]
    assert recording.table["hdop"].isna().tolist() == [True, False]
    assert recording.table["flags"].tolist() == [Flag.PL_SENTINEL, 0]
    finding = recording.meta.findings[0]
    assert finding.code == "E07"
    assert "hpl_m: 1 x 0 (not computed); hdop: 1 x 0 (not computed)" in finding.evidence


def test_words_for_missing_levels_are_counted(tmp_path: Path) -> None:
    line = make.sbasout(10).replace("18.5000", "    nan")
    recording = read(tmp_path, make.output(10) + line)
    assert recording.table["vpl_m"].isna().all()
    assert "SBASOUT vpl_m: 1 x NaN" in recording.meta.findings[0].evidence


def test_dual_frequency_levels_are_not_those_of_do229(tmp_path: Path) -> None:
    text = make.output(10, processing=6) + make.sbasout(10, processing=6)
    recording = read(tmp_path, text)
    assert recording.table["hpl_m"].tolist() == [11.25]
    assert recording.meta.pl.kind == "unknown"
    assert ("E23", "warning") in codes(recording)


@pytest.mark.parametrize(("geo", "kept"), [(0, 0), (158, 158), (37, -1)])
def test_number_of_the_sbas_satellite(tmp_path: Path, geo: int, kept: int) -> None:
    recording = read(tmp_path, make.output(10) + make.sbasout(10, geo=geo))
    assert recording.table["geo_prn"].tolist() == [kept]
    assert bool(recording.table["flags"].iloc[0] & Flag.OUT_OF_RANGE) == (kept == -1)


DAMAGES = {
    "latitude": (r"(OUTPUT.*) 50\.0345", r"\1 50.0445"),
    "height": (r"289\.8", "280.8"),
    "week": (" 2353 ", " 2354 "),
    "second of day": (r"(SBASOUT.*) 43262\.00", r"\1 43263.00"),
    "satellites in use": (r" 10  8 ", " 10  9 "),
    "satellite": (r"\+G09", "+Q09"),
    "mode": ("  PA ", "  PB "),
    "a field lost": (r" 40\.00 ", " "),
    "a letter in a number": (r"11\.2500", "11.25o0"),
    "day of year": (" 2025 046 ", " 2025 366 "),
    "message": ("SBASOUT", "SBASOUX"),
    "a blank in front": ("SBASOUT", " SBASOUT"),
    "a quotation mark": (" 40.00 ", ' "40.00 '),
    "beyond all numbers": (r"11\.2500", "1e999"),
    "a day without end": (" 046 ", " 99999999999999999999 "),
}


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_damaged_line_is_left_out_and_counted(tmp_path: Path, kind: str) -> None:
    good = make.output(43_262) + make.sbasout(43_262)
    pattern, changed = DAMAGES[kind]
    bad, changes = re.subn(pattern, changed, good)
    assert changes
    recording = read(tmp_path, bad + make.run(5, 43_270.0))
    assert ("E10", "error") in codes(recording)
    clean = read(tmp_path, make.run(5, 43_270.0))
    whole = recording.table[recording.table["flags"] == 0]
    pd.testing.assert_frame_equal(whole, clean.table[list(whole.columns)])
    assert len(recording) <= 6


def test_a_last_line_without_end_was_cut(tmp_path: Path) -> None:
    text = make.run(4)
    recording = read(tmp_path, text[:-3])
    assert recording.table["hpl_m"].isna().tolist() == [False, False, False, True]
    assert codes(recording)[0] == ("E10", "error")
    assert "without line end" in recording.meta.findings[0].evidence


def test_rows_stay_in_file_order(tmp_path: Path) -> None:
    seconds = [13, 11, 12, 11]
    text = "".join(make.output(s) + make.sbasout(s, hpl=s + i) for i, s in enumerate(seconds))
    table = read(tmp_path, text).table
    assert (table.index.to_numpy().astype("M8[s]").astype(int) % 60).tolist() == seconds
    assert table["hpl_m"].tolist() == [13.0, 12.0, 14.0, 14.0]
    assert table["lat_deg"].notna().all()


def test_no_solution(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="computed no solution") as caught:
        read(tmp_path, make.HEADER)
    assert caught.value.code == "E15"
    with pytest.raises(InputError, match="no line of the gLAB output"):
        read(tmp_path, make.HEADER + "rubbish\n")


def test_columns_restrict_the_table(tmp_path: Path) -> None:
    recording = read(tmp_path, make.run(3), columns=["hpl_m", "herl_m"])
    assert recording.columns == ("hpl_m", "herl_m")
    assert recording.table["herl_m"].isna().all()


def test_the_size_of_blocks_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = make.run(200) + "".join(make.sbasvar(43_262 + i, 9) for i in range(200))
    whole = read(tmp_path, text)
    for size in (997, 5_000):
        monkeypatch.setattr(text_input, "BLOCK_BYTES", size)
        pieces = read(tmp_path, text)
        pd.testing.assert_frame_equal(pieces.table, whole.table)
        pd.testing.assert_frame_equal(
            pieces.side_tables["satellites"], whole.side_tables["satellites"]
        )
        assert pieces.meta == whole.meta


def test_line_ends_of_windows(tmp_path: Path) -> None:
    text = make.run(3) + make.unselected(43_262, 5, 14, "Satellite flagged")
    plain, windows = read(tmp_path, text), read(tmp_path, text.replace("\n", "\r\n"))
    pd.testing.assert_frame_equal(plain.table, windows.table)
    pd.testing.assert_frame_equal(
        plain.side_tables["satellites"], windows.side_tables["satellites"]
    )


def test_a_file_cut_anywhere_gives_rows_of_the_whole_one(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    folder = tmp_path_factory.mktemp("cut")
    text = make.run(6)
    whole = read(folder, text).table
    for at in range(1, len(text), 29):
        with contextlib.suppress(InputError):
            cut = read(folder, text[:at]).table
            # Before the first SBASOUT line, PA or NPA is not known.
            both = cut[cut["flags"] == 0].drop(columns=[] if "hpl_m" in cut else ["mode"])
            pd.testing.assert_frame_equal(both, whole.loc[both.index, list(both.columns)])


@given(
    lat=st.floats(0.001, 89.9) | st.floats(-89.9, -0.001),
    lon=st.floats(-179.99, 180),
    height=st.floats(-400, 9000),
    hpl=st.floats(0.001, 9999),
    vpl=st.floats(0.001, 9999),
    second=st.integers(0, 8_639_999),
    mode=st.sampled_from(["PA", "NPA"]),
    used=st.integers(4, 14),
)
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory,
    lat: float,
    lon: float,
    height: float,
    hpl: float,
    vpl: float,
    second: int,
    mode: str,
    used: int,
) -> None:
    folder = tmp_path_factory.getbasetemp()
    names = [f"G{i + 1:02d}" for i in range(used)]
    text = make.output(second / 100, lat, lon, height) + make.sbasout(
        second / 100, hpl, vpl, mode=mode, used=names, unused=["S120", "R03"]
    )
    recording = read(folder, text)
    row = recording.table.iloc[0]
    assert abs(row["lat_deg"] - lat) <= 5.1e-10
    assert abs(row["lon_deg"] - lon) <= 5.1e-10
    assert abs(row["height_m"] - height) <= 5.1e-5
    assert abs(row["hpl_m"] - hpl) <= 5.1e-5
    assert abs(row["vpl_m"] - vpl) <= 5.1e-5
    assert (row["n_sv"], row["n_sv_tracked"]) == (used, used + 2)
    assert row["mode"] == f"sbas_{mode.lower()}"
    start = np.datetime64("2025-02-15", "ns") + np.timedelta64(second * 10, "ms")
    assert recording.time[0] == start
    satellites = recording.side_tables["satellites"]
    assert satellites["satellite"].tolist() == [*names, "R03", "S20"]
    assert satellites["used"].tolist() == [True] * used + [False] * 2


def test_sniff(reference_data: Path, tmp_path: Path) -> None:
    for name, *_ in RUNS:
        head = make.unpacked(reference_data, name, tmp_path).read_bytes()
        assert glab_output.sniff(head[:65536], b"", b"", Path(name)).score == 95
    body = make.output(10).encode()
    assert glab_output.sniff(body, b"", b"", Path("x")).score == 95
    assert glab_output.sniff(body.replace(b" GPS ", b" "), b"", b"", Path("x")).score == 0
    for other in (b"", b"\x00" * 100, b"time,lat,lon\n1,2,3\n", b"INFO nothing of the kind\n"):
        assert glab_output.sniff(other, other, other, Path("x")).score == 0
