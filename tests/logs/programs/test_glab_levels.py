"""K factors of gLAB: closed form of the solution's sigma, the header, contradictions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sbas.logs.programs import glab_output
from sbas.logs.programs.glab_levels import deviations_m, stated_factors
from tests.logs.programs import glab_samples as make

ELEVATION = 30.0
AZIMUTHS = (0.0, 90.0, 180.0, 270.0)


def cross(sigma: float) -> pd.DataFrame:
    """Four satellites at one elevation in the four directions, and one above."""
    return pd.DataFrame(
        {
            "time": np.array(["2025-02-15T00:00:10"] * 5, "M8[ns]"),
            "satellite": pd.Categorical([f"G{i:02d}" for i in range(1, 6)]),
            "elevation_deg": [ELEVATION] * 4 + [90.0],
            "azimuth_deg": [*AZIMUTHS, 0.0],
            "sigma_m": [sigma] * 5,
            "used": [True] * 5,
        }
    )


def closed_form(sigma: float) -> tuple[float, float]:
    # Normal matrix by hand: east 2 cos^2 e / s^2; up and clock [[4 sin^2 e + 1, 4 sin e + 1],
    # [4 sin e + 1, 5]] / s^2, whose inverse has 5 / (4 (1 - sin e)^2) for up.
    sine, cosine = np.sin(np.radians(ELEVATION)), np.cos(np.radians(ELEVATION))
    return sigma / (np.sqrt(2) * cosine), sigma * np.sqrt(5) / (2 * (1 - sine))


def test_sigma_of_the_solution_in_closed_form() -> None:
    found = deviations_m(cross(2.5))
    major, up = closed_form(2.5)
    assert found["major_m"].tolist() == pytest.approx([major], rel=1e-12)
    assert found["up_m"].tolist() == pytest.approx([up], rel=1e-12)


@pytest.mark.parametrize(
    ("column", "row", "value"),
    [("sigma_m", 0, np.nan), ("sigma_m", 0, 0.0), ("elevation_deg", 3, np.nan), ("used", 1, False)],
)
def test_an_epoch_that_cannot_be_solved_is_left_out(column: str, row: int, value: object) -> None:
    table = cross(1.0)
    table.loc[row, column] = value
    assert len(deviations_m(table)) == 0


def test_another_clock_is_another_unknown() -> None:
    table = cross(1.0)
    table["satellite"] = pd.Categorical(["G01", "G02", "G03", "G04", "R05"])
    assert len(deviations_m(table)) == 0


def test_factors_of_the_header() -> None:
    text = make.HEADER + "INFO MODELLING SBAS Kh factor NPA: 6.18\n"
    assert stated_factors(text) == {
        ("h", "sbas_pa"): 6.0, ("v", "sbas_pa"): 5.33, ("h", "sbas_npa"): 6.18,
    }  # fmt: skip


def text_of(k_h: float, k_v: float, mode: str = "PA", header: str = "") -> str:
    major, up = closed_form(2.5)
    names = [f"G{i:02d}" for i in range(1, 6)]
    lines = [make.output(10), make.sbasout(10, k_h * major, k_v * up, mode=mode, used=names)]
    for i, azimuth in enumerate((*AZIMUTHS, 0.0)):
        elevation = ELEVATION if i < 4 else 90.0
        lines.append(make.sbasvar(10, i + 1, elevation=elevation, azimuth=azimuth, mode=mode))
    return header + "".join(lines)


@pytest.mark.parametrize(("mode", "k_h"), [("PA", 6.0), ("NPA", 6.18)])
def test_factors_told_by_the_variances(tmp_path: Path, mode: str, k_h: float) -> None:
    path = tmp_path / "glab.out"
    path.write_text(text_of(k_h, 5.33, mode))
    pl = glab_output.read(path).meta.pl
    assert (pl.kind, pl.k_h, pl.k_v) == ("do229", k_h, 5.33)


def test_factors_that_nothing_tells(tmp_path: Path) -> None:
    path = tmp_path / "glab.out"
    path.write_text(make.output(10) + make.sbasout(10))
    pl = glab_output.read(path).meta.pl
    assert (pl.kind, pl.k_h, pl.k_v) == ("do229", None, None)


def test_own_factors_of_a_run(tmp_path: Path) -> None:
    path = tmp_path / "glab.out"
    path.write_text(text_of(7.0, 5.33, header=make.HEADER.replace("PA: 6\n", "PA: 7\n")))
    assert glab_output.read(path).meta.pl.k_h == 7.0


@pytest.mark.parametrize(("k_h", "k_v", "word"), [(6.18, 5.33, "hpl_m"), (6.0, 6.0, "vpl_m")])
def test_levels_that_contradict_the_variances(
    tmp_path: Path, k_h: float, k_v: float, word: str
) -> None:
    path = tmp_path / "glab.out"
    path.write_text(text_of(k_h, k_v, header=make.HEADER))
    meta = glab_output.read(path).meta
    assert meta.pl.kind == "unknown"
    assert (meta.pl.k_h is None) == (word == "hpl_m")
    found = next(f for f in meta.findings if f.code == "E23")
    assert found.message.startswith(word)
    assert f"{k_h if word == 'hpl_m' else k_v:.2f}" in found.evidence
