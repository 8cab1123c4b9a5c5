"""Satellites of gLAB output: every field of the reference runs, repeated lines, reasons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest

from sbas.logs.programs import glab_output
from sbas.logs.programs.glab_satellites import SATELLITE_MESSAGES
from sbas.recording import Recording
from sbas.satellite_table import SATELLITE_COLUMNS, SIDE_TABLE
from tests.logs.programs import glab_samples as make


def read(folder: Path, text: str) -> tuple[Recording, pd.DataFrame]:
    path = folder / "glab.out"
    path.write_text(text)
    recording = glab_output.read(path)
    return recording, recording.side_tables[SIDE_TABLE]


BREAKDOWNS = (
    "glab_vehicle_cres_129_PA_breakdown.out",
    "glab_vehicle_cres_129_NPA_breakdown.out",
    "glab_msas_kamakura_PA_breakdown30s.out",
    "glab_msas_kamakura_NPA_breakdown30s.out",
    "glab_waas_stanford_PA_breakdown30s.out",
)


@pytest.mark.parametrize("name", BREAKDOWNS)
def test_every_field_of_the_reference_runs(reference_data: Path, tmp_path: Path, name: str) -> None:
    path = make.unpacked(reference_data, name, tmp_path)
    table = glab_output.read(path).side_tables[SIDE_TABLE]
    assert not table.duplicated(["time", "satellite"]).any()
    day = table["time"].dt.strftime("%Y %j")
    second = (table["time"] - table["time"].dt.normalize()).dt.total_seconds()
    key = list(zip(day, second, table["satellite"], strict=True))
    row_of = {k: i for i, k in enumerate(key)}
    text = path.read_text()
    for word, message in SATELLITE_MESSAGES.items():
        last = {}
        for f in make.plain_lines(text, word):
            last[f"{f[1]} {f[2]}", float(f[3]), f"G{int(f[6]):02d}"] = f
        if not last:
            continue
        rows = [row_of[k] for k in last]
        for number, column in message.columns.items():
            if column in ("system", "prn", "reason"):
                continue
            if column in ("elevation_deg", "azimuth_deg") and word != "SBASVAR":
                continue  # SBASVAR goes before, with the same two numbers
            written = np.array([float(f[number - 1]) for f in last.values()])
            if column == "azimuth_deg":
                written %= 360
            if column == "x_iode":
                written = np.where(written == 999, np.nan, written)
            # SBASCORR gives pierce points with a decimal more than SBASIONO, and goes before.
            coarse = word == "SBASIONO" and column.startswith("x_pierce")
            np.testing.assert_allclose(
                table[column].to_numpy()[rows],
                written,
                rtol=0,
                atol=5.1e-4 if coarse else 0,
                err_msg=f"{word} {column}",
            )


def test_used_and_reason_of_a_reference_run(reference_data: Path, tmp_path: Path) -> None:
    path = make.unpacked(reference_data, "glab_vehicle_cres_129_PA_breakdown.out", tmp_path)
    table = glab_output.read(path).side_tables[SIDE_TABLE]
    text = path.read_text()
    pluses = sum(item.startswith("+") for f in make.plain_lines(text, "SBASOUT") for item in f[24:])
    assert int(table["used"].sum()) == pluses
    assert table.loc[table["used"], "reason"].isna().all()
    written = {(code, f[3], f[6]) for f in make.plain_lines(text, "SBASUNSEL") for code in f[9:10]}
    reasons = table["reason"].value_counts()
    for code, reason in (
        ("14", "Satellite flagged as 'Not monitored' (UDREI=14)"),
        ("40", "Not enough IGPs available in ionospheric grid mask [PA only]"),
    ):
        assert reasons[reason] == sum(c == code for c, _, _ in written) > 200
    used = table[table["used"]]
    squares = sum(used[f"sigma_{n}_m"] ** 2 for n in ("flt", "uire", "air", "tropo"))
    # Four decimals of each sigma: the sum of squares must be theirs (DO-229D, J.1).
    np.testing.assert_allclose(np.sqrt(squares), used["sigma_m"], atol=2.1e-4)
    assert (used["elevation_deg"] >= 5).all()
    assert used["azimuth_deg"].between(0, 360).all()


def test_positions_are_turned_to_the_frame_of_reception(
    reference_data: Path, tmp_path: Path
) -> None:
    # Unturned, the range would be off by up to 30 m; 0.7 m are the step from a-priori to fix.
    fixes = glab_output.read(
        make.unpacked(reference_data, "glab_waas_stanford_PA.out", tmp_path)
    ).table
    table = glab_output.read(
        make.unpacked(reference_data, "glab_waas_stanford_PA_breakdown30s.out", tmp_path)
    ).side_tables[SIDE_TABLE]
    table = table[table["time"].isin(fixes.index) & table["x_ecef_m"].notna()]
    at = fixes.loc[table["time"]]
    xyz = pymap3d.geodetic2ecef(at["lat_deg"], at["lon_deg"], at["height_m"])
    apart = [
        table[f"{a}_ecef_m"].to_numpy() - np.asarray(p) for a, p in zip("xyz", xyz, strict=True)
    ]
    distance = np.sqrt(sum(d**2 for d in apart))
    assert np.abs(distance - table["x_geometric_range_m"]).max() < 1.0


def test_every_column_is_documented_or_named_aside() -> None:
    for message in SATELLITE_MESSAGES.values():
        for column in message.columns.values():
            documented = column in SATELLITE_COLUMNS or column in ("system", "prn")
            assert documented or column.startswith("x_")


def test_of_repeated_lines_the_last_without_a_star_stands(tmp_path: Path) -> None:
    text = (
        make.output(10)
        + make.sbasout(10, used=("G09", "G04"), unused=())
        + make.sbasvar(10, 9, sigma=1.0)
        + make.sbasvar(10, 9, sigma=2.0)
        + make.sbasvar(10, 9, sigma=3.0, star="*")
        + make.sbasvar(10, 4, sigma=4.0, star="*")
    )
    recording, table = read(tmp_path, text)
    assert table["satellite"].tolist() == ["G04", "G09"]
    assert table["sigma_m"].tolist() == [4.0, 2.0]
    assert table["used"].tolist() == [True, True]
    found = next(f for f in recording.meta.findings if f.code == "E26")
    assert "2 earlier lines" in found.evidence


def test_terms_of_the_budget(tmp_path: Path) -> None:
    _, table = read(tmp_path, make.output(10) + make.sbasout(10) + make.sbasvar(10, 9))
    row = table[table["satellite"] == "G09"].iloc[0]
    expected = {
        "elevation_deg": 45.0, "azimuth_deg": 287.695, "sigma_m": 2.5, "sigma_flt_m": 1.8723,
        "x_sigma_udre_m": 1.8237, "x_delta_udre": 1.012, "x_delta_udre_message": 28,
        "x_fast_degradation_m": 0.0261, "x_range_rate_degradation_m": 0.0011,
        "x_long_term_degradation_m": 0.0022, "x_en_route_degradation_m": 0.0033,
        "x_root_sum_square_flag": 1, "sigma_uire_m": 1.6206, "sigma_tropo_m": 0.147,
        "sigma_air_m": 0.3835, "x_sigma_noise_m": 0.36, "x_sigma_multipath_m": 0.132,
        "x_sigma_divergence_m": 0.001,
    }  # fmt: skip
    assert {name: row[name] for name in expected} == pytest.approx(expected, rel=1e-12)


def test_reasons_and_their_rank(tmp_path: Path) -> None:
    text = (
        make.output(10)
        + make.sbasout(10, used=("G09",), unused=("G05", "G07"))
        + make.satsel(10, 9, 0, "Selected")
        + make.satsel(10, 5, 100, "SBAS corrections unavailable (GEO 123)")
        + make.satsel(10, 7, 48, "Elevation too low (4.44 degrees)")
        + make.unselected(10, 5, 15, "Satellite flagged as 'Do not use' (UDREI=15)")
    )
    _, table = read(tmp_path, text)
    assert table["satellite"].tolist() == ["G05", "G07", "G09"]
    assert table["reason"].tolist()[:2] == [
        "Satellite flagged as 'Do not use' (UDREI=15)",
        "Elevation too low (4.44 degrees)",
    ]
    assert table["reason"].isna().tolist() == [False, False, True]
    assert table["x_unselected_code"].tolist()[0] == 15
    assert table["x_selection_code"].tolist() == [100, 48, 0]


def test_satellites_of_an_epoch_without_solution(tmp_path: Path) -> None:
    text = make.sbasvar(9, 9) + make.output(10) + make.sbasout(10, used=("G09",), unused=())
    recording, table = read(tmp_path, text)
    assert table["used"].tolist() == [False, True]
    assert table["x_epoch_solved"].tolist() == [False, True]
    assert any("1 of 2 rows" in f.evidence for f in recording.meta.findings)


def test_a_file_of_satellites_alone_is_an_empty_recording(tmp_path: Path) -> None:
    text = make.sbasvar(9, 9) + make.sbasvar(9, 4, star="*")
    recording, table = read(tmp_path, text)
    assert len(recording) == 0
    assert table["satellite"].tolist() == ["G04", "G09"]
    assert table["used"].tolist() == [False, True]


def test_dual_frequency_lines(tmp_path: Path) -> None:
    # The sample of gLAB's message help.
    line = (
        "SBASDFMCVAR     2019 183   366.00 00:06:06.00 GAL  26 GALILEO-2        203   1    367   "
        "14.645   32.278  PA 122         1.3482         1.0003  5 0   1.0000   1.0000   0.0230   "
        "0.0000   0.1021   0.4678   0.7667   0.4000   0.6541   0.0000   0.1900  36.0000   0.0010   "
        "1.0000   0.0010   0.0000   0.0000\n"
    )
    recording, table = read(tmp_path, line)
    row = table.iloc[0]
    assert row["satellite"] == "E26"
    assert row["time"] == pd.Timestamp("2019-07-02 00:06:06")
    sigmas = row[["sigma_flt_m", "sigma_uire_m", "sigma_air_m", "sigma_tropo_m"]].tolist()
    assert sigmas == [1.0003, 0.1021, 0.7667, 0.4678]
    assert np.hypot.reduce(sigmas) == pytest.approx(row["sigma_m"], abs=1e-4)
    assert recording.meta.findings[0].code == "E25"


def test_model_lines(tmp_path: Path) -> None:
    # The sample of gLAB's message help.
    line = (
        "MODEL     2019 025 85862.00 23:51:02.00 GPS 15 BLOCK_IIR-M       55   1    363    9.133   "
        "56.540 C1C      LNAV    1  0  0 39110018.66000         0.0817  -5849446.9671  "
        "19529241.5438  16560946.2782     -1025.8786     -1939.4413      1934.8478  24502508.9762 "
        "    99139.2638   0.00000   0.00000   0.00000   0.00000  -0.00000   1.12021   0.00000  "
        "13.46324   1.71706   0.00000   0.00000   0.00000   0.00000   0.00000   0.00000   0.00000 "
        " -3.21084   0.00000   0.00000  -3.21084   53.000  24601663.5797\n"
    )
    _, table = read(tmp_path, line + line.replace("  53.000", " 999.000").replace(" 15 B", " 16 B"))
    assert table["satellite"].tolist() == ["G15", "G16"]
    assert table["x_ecef_m"].tolist() == [-5849446.9671] * 2
    assert table["elevation_deg"].tolist() == [9.133] * 2
    assert table["x_snr_dbhz"].isna().tolist() == [False, True]


@pytest.mark.parametrize(
    ("old", "new"), [("GPS", "GQS"), ("   9 B", " 999 B"), ("45.000", "1e999"), ("45.000", "4x")]
)
def test_a_damaged_satellite_line_is_counted(tmp_path: Path, old: str, new: str) -> None:
    bad = make.sbasvar(10, 9).replace(old, new, 1)
    assert bad != make.sbasvar(10, 9)
    text = make.output(10) + make.sbasout(10, used=("G04",), unused=()) + bad
    recording, table = read(tmp_path, text)
    assert table["satellite"].tolist() == ["G04"]
    assert recording.meta.findings[0].code == "E10"
