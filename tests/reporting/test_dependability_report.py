"""The report on a localisation unit: modelled figures, said as such, in one self-contained page."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from sbas.cli import main
from sbas.dependability import Dependability, depend, dump_model, receiver_states, solve
from sbas.dependability.analysis.architectures import compare_architectures
from sbas.dependability.analysis.importance import importance
from sbas.dependability.receiver.thinned_states import state_strip
from sbas.dependability.tree.model import Options
from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.reporting import dependability_report, dependability_report_of, render_html
from tests.dependability.small_unit import small_unit
from tests.dependability.state_recordings import TRUTH, chain_states, state_recording

ROWS = [[0.97, 0.02, 0.01], [0.5, 0.45, 0.05], [0.1, 0.0, 0.9]]


@cache
def answer() -> Dependability:
    return depend(small_unit(), first_passage=True, simulate=2000)


@cache
def of_two() -> Dependability:
    return depend({"open": small_unit(hazard_per_h=5e-8, runs=False, mission_s=3600.0),
                   "forest": small_unit()})  # fmt: skip


def verdict(found: Dependability) -> tuple[str, str, str]:
    callout = dependability_report_of(found).sections[0].callouts[0]
    return callout.tone, callout.title, " ".join(callout.paragraphs)


def tables(document: Any) -> dict[str, Any]:
    return {t.title: t for s in document.sections for t in s.tables}


def test_one_page_that_refers_to_nothing_outside(tmp_path: Path) -> None:
    recording = state_recording(chain_states(ROWS, 2000, 1))
    path = dependability_report(
        replace(answer(), solutions={"unit": solve(small_unit(), curve=True)}),
        tmp_path / "unit.html",
        states=receiver_states(recording, truth=TRUTH, threshold_m=50),
        strip=state_strip(recording, truth=TRUTH, threshold_m=50),
        importances=importance(small_unit()),
    )
    page = path.read_text(encoding="utf-8")
    assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)", re.sub(r"base64,[^\"]*", "", page))
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(set(ids)) == len(ids)
    assert set(re.findall(r'href="#([^"]*)"', page)) <= set(ids)
    # Tree, curves, importance, ribbon, runs of wrong and of missing.
    assert page.count('role="img"') == 6
    assert "<script" not in page


@pytest.mark.parametrize(
    ("rate", "tone", "band"),
    [(5e-8, "warning", "band of SIL 3"), (2e-7, "warning", "band of SIL 2"),
     (2e-5, "bad", "no SIL"), (0.0, "warning", "never true in this model")],
)  # fmt: skip
def test_the_band_is_that_of_the_rate_and_never_demonstrated(
    rate: float, tone: str, band: str
) -> None:
    """A part without repair fails 1 - exp(-rate T) times in an hour: the rate itself here."""
    found = depend(small_unit(hazard_per_h=rate, runs=False, mission_s=3600.0))
    own, title, text = verdict(found)
    assert own == tone
    assert title.startswith("MODELLED: Case C")
    assert band in text
    assert "modelled, not demonstrated" in text
    assert "DEMONSTRATED" not in text
    if rate:
        (times,) = re.findall(r"begins ([\d.×⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+) times per hour", title)
        mantissa, power = times.split("×10⁻")
        exponent = int(power.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")))
        assert rate * 0.999 < float(mantissa) * 10.0**-exponent <= rate * 1.001
    else:
        assert "SIL" not in text.replace("a SIL band", "")


def test_the_worst_environment_leads_and_all_are_compared() -> None:
    document = dependability_report_of(of_two())
    callout = document.sections[0].callouts[0]
    assert "worst of 2 environments (forest)" in " ".join(callout.paragraphs)
    assert document.subtitle == (
        "open, forest; missions of 1 h in epochs of 1 s, 1 min in epochs of 1 s"
    )
    rates = {n: s.occurrences_per_h("Case C") for n, s in of_two().solutions.items()}
    assert rates["forest"] > rates["open"]
    assert document.sections[0].tiles[2].note.startswith("worst: forest")
    compared = tables(document)["Environments compared"]
    assert [row[0].text for row in compared.rows] == ["open", "forest"]
    assert {row[-1].text for row in compared.rows} == {"modelled"}
    assert [s.key for s in document.sections] == [
        "verdict", "measures-0", "measures-1", "simulation", "findings", "model",
    ]  # fmt: skip


def test_every_row_is_listed_with_what_was_asked() -> None:
    measures = tables(dependability_report_of(answer()))["Events and gates"]
    solution = answer().solutions["small unit"]
    assert {row[0].text for row in measures.rows} == set(solution.rows)
    by_name = {row[0].text: [cell.text for cell in row] for row in measures.rows}
    assert by_name["Run"][1] == "CON 3"
    assert by_name["Silent"][1] == "DUR 5 s"
    assert float(by_name["Wrong"][2]) == pytest.approx(
        solution.rows["Wrong"].mean_unavailability, rel=1e-4
    )
    unasked = tables(dependability_report_of(of_two()))["Events and gates"]
    assert {row[4].text for row in unasked.rows} == {"not asked"}


def test_what_is_taken_for_granted_and_its_sources_are_said() -> None:
    document = dependability_report_of(answer())
    page = render_html(document)
    assert "the rows are made up" in page
    assert "claimed by its maker" in page
    assert "Source: made up." in page
    options = tables(document)["Options: how open points are read"]
    assert {row[0].text for row in options.rows} == set(vars(small_unit().options))


def test_options_that_differ_between_environments_are_told_apart() -> None:
    strict = replace(small_unit(), options=Options(dur_rule="strict"))
    found = depend({"open": small_unit(), "forest": strict})
    options = tables(dependability_report_of(found))["Options: how open points are read"]
    readings = {row[0].text: row[1].text for row in options.rows}
    assert readings["dur_rule"] == "age (open); strict (forest)"
    assert readings["pand_latched"] == "no"


def test_a_simulation_that_contradicts_is_not_to_be_missed() -> None:
    found = answer()
    agreement = found.agreements["small unit"]
    assert not any("simulation" in c.title
                   for c in dependability_report_of(found).sections[0].callouts)  # fmt: skip
    first = replace(agreement.comparisons[0], verdict="disagrees")
    broken = replace(agreement, comparisons=(first, *agreement.comparisons[1:]))
    callouts = dependability_report_of(
        replace(found, agreements={"small unit": broken})
    ).sections[0].callouts  # fmt: skip
    assert callouts[1].tone == "bad"
    assert "does not confirm" in callouts[1].title


def test_hostile_names_are_text_and_the_bytes_are_the_same_each_time(tmp_path: Path) -> None:
    hostile = replace(small_unit(), name="<script>alert(1)</script>")
    found = depend(hostile)
    pages = [dependability_report(found, tmp_path / f"{i}.html").read_bytes() for i in range(2)]
    assert pages[0] == pages[1]
    assert b"<script" not in pages[0]
    json.dumps(dependability_report_of(found).to_dict(), allow_nan=False)


def test_absent_importance_says_why_and_an_absent_folder_is_bad_input(tmp_path: Path) -> None:
    found = of_two()
    page = render_html(dependability_report_of(found, importances=Refusal("too large", "less")))
    assert "Not given: too large (cure: less)." in page
    with pytest.raises(InputError, match="cannot be written"):
        dependability_report(found, tmp_path / "absent" / "unit.html")


def test_architectures_are_compared_with_the_target_as_modelled() -> None:
    units = {"frail": small_unit(hazard_per_h=1e-3), "sound": small_unit(hazard_per_h=1e-9)}
    ladder = compare_architectures(units, thr_per_h=1e-7)
    document = dependability_report_of(answer(), ladder=ladder)
    (found,) = (t for title, t in tables(document).items() if title == "By the rate of Case C")
    assert [row[0].text for row in found.rows] == ["frail", "sound"]
    assert [row[-1].text for row in found.rows] == ["no", "yes"]
    assert found.rows[1][-1].tone == "modelled"
    assert found.rows[1][-2].text == "band of SIL 4"


def test_findings_of_the_recording_are_listed_beside_those_of_the_model() -> None:
    states = receiver_states(state_recording("1121213331"), truth=TRUTH, threshold_m=50)
    states = replace(states, findings=(Finding("E07", "warning", "a remark on the log"),))
    listed = tables(dependability_report_of(answer(), states=states))["Findings"]
    assert "a remark on the log" in {row[2].text for row in listed.rows}


def run(*arguments: object) -> int:
    with pytest.raises(SystemExit) as stop:
        main([str(a) for a in arguments])
    return int(stop.value.code or 0)


def test_the_verb_writes_the_report_and_spares_its_inputs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, page = tmp_path / "unit.toml", tmp_path / "unit.html"
    dump_model(small_unit(), model)
    assert run("depend", model, "--report", page, "--json") == 0
    assert json.loads(capsys.readouterr().out)["report"] == str(page)
    text = page.read_text(encoding="utf-8")
    assert "MODELLED: Case C" in text
    assert 'id="importance"' in text
    before = model.read_bytes()
    assert run("depend", model, "--report", model) != 0
    assert "overwrite" in capsys.readouterr().err
    assert model.read_bytes() == before
