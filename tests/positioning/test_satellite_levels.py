"""Levels from the satellites of any recording: gLAB's budgets, SBF corrections, and what must
give no level."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest

import sbas
from sbas.exceptions import InputError
from sbas.positioning.satellite_levels import levels_from_satellites
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE, satellite_table
from tests.logs.septentrio.sbf_samples import block, corrections_block, positions_block
from tests.positioning.test_protection_levels import BUTE

START = np.datetime64("2017-02-19T23:01:30", "ns")


def recording(epochs: int = 3, names: list[str] | None = None, **changes: object) -> Recording:
    """Epochs of the second published sky; columns of the satellite table changed by name."""
    sky = BUTE[1][0]
    m = len(sky)
    time = START + np.arange(epochs) * np.timedelta64(1, "s")
    elevation, azimuth, sigma = (np.tile(column, epochs) for column in zip(*sky, strict=True))
    columns: dict[str, object] = {
        "satellite": pd.Categorical((names or [f"G{i + 1:02d}" for i in range(m)]) * epochs),
        "elevation_deg": elevation,
        "azimuth_deg": azimuth,
        "sigma_m": sigma,
        "used": np.ones(m * epochs, bool),
        **changes,
    }
    side = satellite_table(np.repeat(time, m), columns)
    table = pd.DataFrame(
        {"hpl_m": np.full(epochs, 99.0)}, index=pd.DatetimeIndex(time, name="time")
    )
    return Recording(table, side_tables={SIDE_TABLE: side})


def test_published_levels() -> None:
    got = levels_from_satellites(recording(), k_h=6.0, k_v=5.33)
    assert got.table["hpl_m"].to_numpy() == pytest.approx([7.4850] * 3, abs=6e-5)
    assert got.table["vpl_m"].to_numpy() == pytest.approx([12.3840] * 3, abs=6e-5)
    assert got.table["n_sv"].tolist() == [9, 9, 9]
    assert (got.meta.pl.kind, got.meta.pl.k_h, got.meta.pl.k_v) == ("do229", 6.0, 5.33)
    assert not got.meta.findings
    axis = sbas.recording.major_semi_axis_m(
        *(got.table[name].to_numpy() for name in ("sigma_e_m", "sigma_n_m", "cov_en_m2"))
    )
    assert 6.0 * axis == pytest.approx(got.table["hpl_m"].to_numpy())


def test_rows_in_any_order_and_satellites_not_used() -> None:
    base = recording()
    side = base.side_tables[SIDE_TABLE]
    unused = side.assign(used=False, sigma_m=0.1)
    mixed = pd.concat([side, unused]).sample(frac=1.0, random_state=1).reset_index(drop=True)
    got = levels_from_satellites(base.replace(side_tables={SIDE_TABLE: mixed}), k_h=6.0, k_v=5.33)
    assert got.table["hpl_m"].to_numpy() == pytest.approx([7.4850] * 3, abs=6e-5)


def cell(column: str, row: int, value: object) -> dict[str, object]:
    values = recording().side_tables[SIDE_TABLE][column].to_numpy(copy=True)
    values[row] = value
    return {column: values}


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        (cell("sigma_m", 10, np.nan), "a satellite without sigma"),
        (cell("sigma_m", 10, 0.0), "a satellite without sigma"),
        (cell("sigma_m", 10, np.inf), "a satellite without sigma"),
        (cell("elevation_deg", 10, np.nan), "a satellite without direction"),
        (
            {"satellite": pd.Categorical(
                [f"G{i + 1:02d}" for i in range(9)] + ["G01", "G01"]
                + [f"G{i + 1:02d}" for i in range(2, 9)] + [f"G{i + 1:02d}" for i in range(9)]
            )},
            "a satellite twice",
        ),
        (
            {"satellite": pd.Categorical(
                [f"G{i + 1:02d}" for i in range(9)] + ["G01", "E02"]
                + [f"G{i + 1:02d}" for i in range(2, 9)] + [f"G{i + 1:02d}" for i in range(9)]
            )},
            "a satellite of a system that DO-229 does not cover",
        ),
    ],
)  # fmt: skip
def test_satellites_that_do_not_make_up_the_fix_give_no_level(
    changes: dict[str, object], why: str
) -> None:
    got = levels_from_satellites(recording(**changes), k_h=6.0, k_v=5.33)
    assert np.isfinite(got.table["hpl_m"].to_numpy()).tolist() == [True, False, True]
    assert np.isfinite(got.table["vpl_m"].to_numpy()).tolist() == [True, False, True]
    (finding,) = got.meta.findings
    assert f"{why}: 1 epochs" in finding.evidence


def test_too_few_satellites_and_epochs_without_any() -> None:
    base = recording(epochs=4)
    side = base.side_tables[SIDE_TABLE]
    first, second = base.time[0], base.time[1]
    few = side[~((side["time"] == first) & (side.groupby("time").cumcount() >= 3))]
    few = few[few["time"] != second].reset_index(drop=True)
    got = levels_from_satellites(base.replace(side_tables={SIDE_TABLE: few}), k_h=6.0, k_v=5.33)
    assert np.isfinite(got.table["hpl_m"].to_numpy()).tolist() == [False, False, True, True]
    assert got.table["n_sv"].tolist() == [3, 0, 9, 9]
    (finding,) = got.meta.findings
    assert finding.evidence == (
        "no satellite: 1 epochs; fewer than four satellites, or a degenerate geometry: 1 epochs"
    )
    nothing = side.iloc[:0]
    none = levels_from_satellites(base.replace(side_tables={SIDE_TABLE: nothing}), k_h=6, k_v=5)
    assert none.table["hpl_m"].isna().all()


def test_tables_that_do_not_serve() -> None:
    with pytest.raises(InputError, match="which satellites were used"):
        levels_from_satellites(recording().replace(side_tables={}), k_h=6.0, k_v=5.33)
    side = recording().side_tables[SIDE_TABLE].drop(columns="sigma_m")
    with pytest.raises(InputError) as raised:
        levels_from_satellites(recording().replace(side_tables={SIDE_TABLE: side}), k_h=6, k_v=5)
    assert "sigma_m" in raised.value.evidence


@pytest.mark.parametrize(
    ("output", "k_h"),
    [
        ("glab_waas_stanford_PA_breakdown30s", 6.0),
        ("glab_msas_kamakura_NPA_breakdown30s", 6.18),
        ("glab_vehicle_cres_129_PA_breakdown", 6.0),
    ],
)
def test_levels_of_glab_from_its_printed_budgets(
    reference_data: Path, output: str, k_h: float
) -> None:
    theirs = sbas.read(reference_data / "reference" / "glab" / f"{output}.out.gz")
    mine = levels_from_satellites(theirs, k_h=k_h, k_v=5.33)
    # Page section 12.1: good to 1 mm (precision approach), 3 mm (else) from printed values.
    tolerance = 0.003 if k_h == 6.18 else 0.002
    for level in ("hpl_m", "vpl_m"):
        assert (mine.table[level] - theirs.table[level]).abs().max() < tolerance
        assert mine.table[level].notna().all()


def test_an_sbf_log_with_corrections(tmp_path: Path) -> None:
    """PVTGeodetic, PVTSatCartesian and GEOCorrections blocks made byte by byte: the published sky
    with its variances parted among the four terms."""
    lat, lon, height = 47.48, 19.06, 200.0
    pieces = []
    for tow_ms, (sky, _, _) in zip((0, 1000, 2000), BUTE, strict=True):
        places, variances = {}, {}
        for number, (elevation, azimuth, sigma) in enumerate(sky, 1):
            xyz = pymap3d.aer2ecef(azimuth, elevation, 2.2e7, lat, lon, height)
            places[number] = tuple(float(value) for value in xyz)
            variances[number] = tuple(sigma**2 * part for part in (0.4, 0.3, 0.2, 0.1))
        pieces += [
            block(4007, 2, tow_ms=tow_ms, mode=6, wa_corr_info=31, lat=math.radians(lat),
                  lon=math.radians(lon), height=height, n_sv=len(sky)),
            positions_block(tow_ms, places),
            corrections_block(tow_ms, variances),
        ]  # fmt: skip
    path = tmp_path / "log.sbf"
    path.write_bytes(b"".join(pieces))
    got = levels_from_satellites(sbas.read(path), k_h=6.0, k_v=5.33).table
    assert got["hpl_m"].to_numpy() == pytest.approx([hpl for _, hpl, _ in BUTE], abs=1e-4)
    assert got["vpl_m"].to_numpy() == pytest.approx([vpl for _, _, vpl in BUTE], abs=1e-4)
