"""The report on an architecture: one self-contained page, modelled figures said as such."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.fusion import CausalAnalysis, load_architecture, multisensor
from sbas.fusion.architecture.architecture_fields import to_table
from sbas.reporting import causal_report, render_html
from sbas.reporting.causal_report import causal_report_of
from sbas.reporting.document import Report
from sbas.reporting.sections import sensor_combinations
from tests.fusion.test_causal_analysis import of_laboratory, with_rates, with_states

SECTIONS = ["verdict", "combinations", "importance", "findings", "model"]


@cache
def answer(model: str = "arch1") -> CausalAnalysis:
    return multisensor(model, runs=300, replicates=100)


@cache
def document(model: str = "arch1") -> Report:
    return causal_report_of(answer(model))


def tables(report: Report) -> dict[str, Any]:
    return {t.title: t for s in report.sections for t in s.tables}


def words(report: Report) -> str:
    return " ".join(report.sections[0].callouts[0].paragraphs)


def test_refers_to_nothing_outside() -> None:
    page = render_html(document())
    assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)", re.sub(r"base64,[^\"]*", "", page))
    assert not re.search(r"<(script|link|iframe|object)\b", page)
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(set(ids)) == len(ids)
    assert set(re.findall(r'href="#([^"]*)"', page)) <= set(ids)
    sources = re.findall(r'(?:src|href|xlink:href)="([^"]*)"', page)
    assert all(source.startswith(("#", "data:image/png;base64,")) for source in sources)
    # Incidence, ribbon, importance, decision tree.
    assert page.count('role="img"') == 4
    assert len(page) < 1_500_000


def test_the_same_bytes_each_time(tmp_path: Path) -> None:
    again = multisensor("arch1", runs=300, replicates=100)
    page = causal_report(again, tmp_path / "arch1.html")
    assert page.read_bytes() == render_html(document()).encode()


@pytest.mark.parametrize("model", ["arch1", "arch1bis", "arch1ter", "arch2"])
def test_every_architecture_has_its_sections(model: str) -> None:
    report = document(model)
    assert [section.key for section in report.sections] == SECTIONS
    json.dumps(report.to_dict(), allow_nan=False)
    verdict = report.sections[0].callouts[0]
    assert (verdict.tone, verdict.title) == ("modelled", "Modelled, not demonstrated")
    assert model in report.title


def test_hostile_names_are_text() -> None:
    calm: Any = load_architecture("arch1")
    odometer = replace(calm.sensors[0], name=r"<b>$\frac{</b>")
    receiver = replace(calm.sensors[2], missing=replace(calm.sensors[2].missing, by=odometer.name))
    hostile = replace(
        calm,
        name='<script>alert(1)</script>"><img src=x onerror=alert(2)>',
        sensors=(odometer, calm.sensors[1], receiver),
        reported=("</p><script>alert(3)</script>",),
    )
    page = render_html(causal_report_of(multisensor(hostile, runs=50, replicates=100)))
    assert "<script" not in page
    assert "<img" not in page
    assert "<b>$" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    assert "&lt;script&gt;alert(3)&lt;/script&gt;" in page
    assert r"&lt;b&gt;$\frac{&lt;/b&gt;" in page


def test_the_step_that_is_too_long_is_among_the_findings() -> None:
    listed = {row[2].text for row in tables(document())["Findings"].rows}
    assert "the step of 1 s is not shorter than the critical times found" in listed


def test_the_combinations_are_those_of_the_answer() -> None:
    found = answer()
    (shown,) = (t for title, t in tables(document()).items() if title.startswith("Combinations"))
    table = found.critical.table
    by_name = {row[0].text: row for row in shown.rows}
    assert set(by_name) == set(table.index)
    for name, row in by_name.items():
        assert row[1].text == table.loc[name, "verdict"]
        assert int(row[5].text.replace(",", "")) == table.loc[name, "events"]
    red = {name for name, row in by_name.items() if row[1].tone == "bad"}
    assert set(found.critical.critical) <= red
    assert all(name in words(document()) for name in found.critical.critical)


def test_a_critical_combination_is_never_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sensor_combinations, "SHOWN", 2)
    found = answer()
    (shown,) = sensor_combinations.section(found).tables
    frequent = found.critical.table["epochs"].nlargest(2).index
    names = [row[0].text for row in shown.rows]
    assert set(names) == {*frequent, *found.critical.critical}
    left = len(found.critical.table) - len(names)
    assert f"{left} rarer combinations, none critical, are left out." in " ".join(shown.notes)


def test_the_time_to_alert_is_said_in_words() -> None:
    late = with_states([0, 0, 2, 2, 2, 2, 2], [0, 0, 0, 1, 1, 2, 2])
    assert "combination are U has 1.5 s: U." in words(causal_report_of(late))
    assert answer().time_to_alert_s == 0
    assert "are U has no time, since so many begin so: " in words(document())
    calm = with_states([0, 0, 1, 1], [0, 0, 1, 1])
    assert "no time within which an alert must come" in words(causal_report_of(calm))


def test_output_and_hardware_are_counted() -> None:
    found = with_rates(answer(), (0.0, 36.0, 0.0))
    shown = tables(causal_report_of(found))
    counts = {row[0].text: row[1].text.replace(",", "") for row in shown["Output"].rows}
    states = found.runs.output_state
    assert {name: int(n) for name, n in counts.items()} == {
        "N": np.sum(states == 0), "DA": np.sum(states == 1), "U": np.sum(states == 2),
        "no data": np.sum(states == -1),
    }  # fmt: skip
    hardware = {row[0].text: row[1].text for row in shown["Hardware"].rows}
    # 1 - exp(-36/h 100 s) = 1 - exp(-1) = 0.63212, rounded up.
    assert hardware == {"odo": "none given", "acc": "0.633", "gps": "none given"}


def test_every_key_of_the_model_is_listed() -> None:
    found = answer("arch1ter")
    listed = {row[0].text: row[1].text for row in tables(document("arch1ter"))["Model"].rows}
    assert listed["sensors.gps.multipath.rate_per_s"] == str(1 / 60)
    assert listed["thresholds.alert_limit_m"] == "2.5"
    table = to_table(found.architecture)
    for sensor in table["sensors"]:
        assert all(f"sensors.{sensor['name']}.{key}" in listed or isinstance(value, dict)
                   for key, value in sensor.items())  # fmt: skip
    assert set(table) - {"reported"} <= {key.split(".")[0] for key in listed}


def test_a_recorded_receiver_has_a_section_of_its_own() -> None:
    found = of_laboratory()
    assert found.recorded is not None
    report = causal_report_of(found)
    assert [s.key for s in report.sections] == [*SECTIONS[:3], "recorded", *SECTIONS[3:]]
    assert "those of a recording" in words(report)
    states = tables(report)["States of the recording by what its level declared"]
    shown = sum(int(c.text.replace(",", "")) for row in states.rows for c in row[1:])
    assert shown == found.recorded.counts.judged


def test_an_absent_folder_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        causal_report(answer(), tmp_path / "absent" / "arch1.html")
