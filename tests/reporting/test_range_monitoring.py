"""The report's section on RAIM: what it says, and that nothing untested has passed."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from sbas.estimate import Refusal
from sbas.monitoring.level_comparison import raim_against_sbas
from sbas.reporting import render_html, report_of
from sbas.reporting.sections.range_monitoring import section
from tests.cli.test_verbs import Answer
from tests.monitoring.recordings import noisy
from tests.plots.synthetic import evaluated


def test_levels_verdicts_and_both_availabilities_stand_in_tables() -> None:
    found = raim_against_sbas(noisy(4, 9, 50, hpl_m=12.0, hdop=np.full(50, 1.1)))
    part = section(found)
    text = str(part.to_dict())
    assert found.statement() in text
    verdicts, levels, both = part.tables
    assert verdicts.rows[0][0].text == "passed"
    assert verdicts.rows[0][1].text == str(found.raim.available)
    assert sum(int(row[1].text) for row in verdicts.rows) == 50
    assert [row[0].text.split(":")[0] for row in levels.rows][:2] == ["SBAS HPL", "HERL"]
    assert levels.rows[0][2].text == "12.000"
    assert [cell.text for cell in both.rows[1]] == ["SBAS yes", "1", "49"]
    assert len(part.pictures) == 3
    assert "not a bound" in part.pictures[0].caption


def test_what_cannot_be_tested_has_not_passed() -> None:
    part = section(raim_against_sbas(noisy(4, 4, 20, hpl_m=12.0)))
    assert [row[0].text for row in part.tables[0].rows] == ["not available"]
    assert "nothing to test" in part.tables[0].notes[1]


def test_a_refusal_is_said() -> None:
    part = section(Refusal("no factor", "risk=2e-9"))
    assert "no factor" in part.paragraphs[0]
    assert not part.tables


def test_only_a_recording_with_raim_has_the_section() -> None:
    evaluation = evaluated("ordinary")
    plain = [s.key for s in report_of(evaluation).sections]
    assert "raim" not in plain
    found = raim_against_sbas(noisy(4, 9, 50, hpl_m=12.0))
    with_raim = report_of(evaluation, raim=found)
    keys = [s.key for s in with_raim.sections]
    assert keys.index("raim") == keys.index("pictures") + 1
    assert 'id="raim"' in render_html(with_raim)
    assert dataclasses.replace(with_raim).to_dict()


def test_the_verb_finds_the_ranges_of_a_parquet_recording(
    reference_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = reference_data / "data/msas_vehicle_2008147"
    out, page = tmp_path / "pa.parquet", tmp_path / "pa.html"
    made = Answer(
        capsys, "protect", "--obs", folder / "cres_20080526.obs", "--nav",
        folder / "cres_20080526.nav", "--nav", folder / "all.nav", "--messages",
        folder / "msas_129.ems", "--geo", 129, "--out", out,
    )  # fmt: skip
    assert made.code == 0
    assert Answer(capsys, "evaluate", out, "--report", page).code == 0
    text = page.read_text()
    assert "computed here from the ranges of each fix" in text
    assert "HERL is larger than HPL at 239 of 239 epochs" in text
