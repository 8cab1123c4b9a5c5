"""The report's section on RAIM: what it says, and that nothing untested has passed."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from sbas.cli.writing import write_recording
from sbas.estimate import Refusal
from sbas.monitoring.level_comparison import raim_against_sbas
from sbas.monitoring.receiver_flags import with_raim_flags
from sbas.monitoring.recording_monitor import raim
from sbas.recording import Recording
from sbas.reporting import render_html, report_of
from sbas.reporting.sections.range_monitoring import section
from tests.cli.test_verbs import Answer
from tests.monitoring.recordings import noisy, recording_of
from tests.plots.synthetic import evaluated


def test_levels_verdicts_and_both_availabilities_stand_in_tables() -> None:
    found = raim_against_sbas(noisy(4, 9, 50, hpl_m=12.0, hdop=np.full(50, 1.1)))
    part = section(found)
    text = str(part.to_dict())
    assert found.statement() in text
    verdicts, levels, both = part.tables[:3]
    assert verdicts.rows[0][0].text == "passed"
    assert verdicts.rows[0][1].text == str(found.raim.available)
    assert sum(int(row[1].text) for row in verdicts.rows) == 50
    assert [row[0].text.split(":")[0] for row in levels.rows][:2] == ["SBAS HPL", "HERL"]
    assert [cell.text for cell in levels.rows[0][1:4]] == ["50", "0", "12.000"]
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


def test_findings_of_raim_stand_in_the_section() -> None:
    recording = noisy(1, 8, 50, hpl_m=12.0)
    side = recording.side_tables["satellites"]
    side = side.assign(sigma_m=100 * side["sigma_m"])
    found = raim_against_sbas(recording.replace(side_tables={"satellites": side}))
    rows = section(found).tables[3].rows
    assert ["E08", "warning"] in [[row[0].text, row[1].text] for row in rows]
    assert any("variances, or another unit" in row[2].text for row in rows)


def test_infinite_levels_count_and_levels_of_zero_do_not_stop_the_report() -> None:
    found = raim_against_sbas(noisy(1, 8, 5, hpl_m=[0.0, 12.0, np.inf, np.inf, np.inf]))
    part = section(found)
    row = [cell.text for cell in part.tables[1].rows[0]]
    assert row[1:6] == ["5", "3", "infinite", "infinite", "infinite"]
    azimuth = np.repeat([[0.0], [0.0], [180.0], [180.0], [90.0]], 3, 1)
    elevation = np.repeat([[20.0], [60.0], [20.0], [60.0], [10.0]], 3, 1)
    hidden = section(
        raim_against_sbas(recording_of(elevation, azimuth, 1.0, np.zeros((5, 3)), hpl_m=9.0))
    )
    assert [cell.text for cell in hidden.tables[1].rows[1][1:4]] == ["3", "3", "infinite"]
    assert "Vertically RAIM is available at 3 of 3" in hidden.tables[0].notes[-1]
    section(raim_against_sbas(noisy(1, 8, 5, hpl_m=0.0)))


def test_only_a_receiver_is_said_to_have_reported() -> None:
    recording = noisy(4, 9, 5, hpl_m=12.0)
    flagged = with_raim_flags(recording, raim(recording)).replace(side_tables={})
    said = section(raim_against_sbas(flagged)).paragraphs[0]
    assert "no receiver reported it" in said
    assert "missed detection 0.0001" in said
    unmarked = flagged.replace(meta=dataclasses.replace(flagged.meta, options={}))
    said = section(raim_against_sbas(unmarked)).paragraphs[0]
    assert "as the recording has it" in said
    both = section(raim_against_sbas(unmarked, alert_limit_m=1.0)).tables[2]
    assert "verdict" in both.notes[0]


def moving() -> Recording:
    """One minute with positions, ranges and HPL."""
    place = {"lat_deg": 50.0, "lon_deg": 15.0, "height_m": 300.0}
    return noisy(4, 9, 60, hpl_m=12.0, **place)


@pytest.mark.parametrize("name", ["pa.pq", "PA.PARQUET", "pa.Pq"])
def test_ranges_are_found_whatever_a_parquet_file_is_called(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = moving()
    out, page = tmp_path / name, tmp_path / "pa.html"
    write_recording(out, [with_raim_flags(recording, raim(recording))])
    assert Answer(capsys, "evaluate", out, "--report", page).code == 0
    assert "computed here from the ranges of each fix" in page.read_text()


@pytest.mark.parametrize("problem", ["is missing", "was altered"])
def test_a_lost_companion_is_said_and_its_flags_are_nobodys(
    problem: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = moving()
    out, page = tmp_path / "pa.parquet", tmp_path / "pa.html"
    write_recording(out, [with_raim_flags(recording, raim(recording))])
    companion = tmp_path / "pa.satellites.parquet"
    if problem == "is missing":
        companion.unlink()
    else:
        companion.write_bytes(companion.read_bytes() + b" ")
    answer = Answer(capsys, "evaluate", out, "--report", page)
    assert answer.code == 0
    assert f"side table satellites {problem}" in answer.out
    text = page.read_text()
    assert f"side table satellites {problem}" in text
    assert "no receiver reported it" in text
    plain = Answer(capsys, "evaluate", out, "--report", page, "--json").json
    assert any(problem in finding["message"] for finding in plain["findings"])
