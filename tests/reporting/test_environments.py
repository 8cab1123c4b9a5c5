"""The report's section by environment: every figure of the evaluation, and refusals in words."""

from __future__ import annotations

from functools import cache

import numpy as np
import pandas as pd

from sbas.estimate import Estimate
from sbas.integrity.evaluation import evaluate
from sbas.integrity.results import Evaluation
from sbas.numerals import count, metres, number, share, upward
from sbas.recording import Recording
from sbas.reporting import render_html, report_of
from sbas.reporting.content import Table
from sbas.reporting.sections import environments
from tests.examples import POINT, recording


def rail() -> Recording:
    n = 1200
    error = np.where(np.arange(n) % 10 == 0, 2.0, 0.5)
    error[396:416] = 60.0
    labels = ["open"] * 400 + ["urban"] * 400 + [None] * 100 + ["<b>tunnel</b>"] * 300
    r = recording(error, np.zeros(n), np.full(n, 11.0), environment=pd.Categorical(labels))
    return r.replace(table=r.table.assign(lat_deg=r.table["lat_deg"].mask(np.arange(n) >= 900)))


@cache
def evaluated() -> Evaluation:
    return evaluate(rail(), truth=POINT, alert_limits_m=(50.0, 20.0))


def rows(table: Table) -> list[list[str]]:
    return [[cell.text for cell in row] for row in table.rows]


def test_a_row_a_label_below_that_of_the_record() -> None:
    found = evaluated()
    sizes = rows(environments.section(found).tables[0])
    expected = {"whole record": found, **found.environments}
    assert [row[0] for row in sizes] == ["whole record", "open", "urban", "<b>tunnel</b>",
                                         "unlabelled"]  # fmt: skip
    for row, e in zip(sizes, expected.values(), strict=True):
        assert row[1:3] == [count(e.epochs), number(e.hours, 6)]
        hpe = ["none"] * 3 if e.hpe_m is None else [
            metres(v) for v in (e.hpe_m.median, e.hpe_m.p95, e.hpe_m.max)
        ]  # fmt: skip
        assert row[3:6] == hpe
        assert e.hpl_m is not None
        assert row[6:8] == [metres(e.hpl_m.median), metres(e.hpl_m.p95)]
        assert row[8:] == [share(e.at(al).availability.availability.value) for al in (50.0, 20.0)]
    assert sizes[3][3] == "none"
    assert sizes[3][8] == "0 %"


def test_hmi_of_each_label_with_its_bound_or_that_nothing_is_demonstrated() -> None:
    found = evaluated()
    table = environments.section(found).tables[1]
    lines = {(row[0], row[1]): row for row in rows(table)}
    for name in ("open", "urban"):
        rate = found.environments[name].at(20.0).rates["hmi"]
        assert isinstance(rate.demonstrated, Estimate)
        assert rate.demonstrated.upper is not None
        # One event lies across their border and counts on both sides.
        assert lines[name, "20"][2:5] == [
            "1", number(rate.hours, 6), upward(rate.demonstrated.upper)
        ]  # fmt: skip
    assert lines["whole record", "20"][2] == "1"
    assert lines["<b>tunnel</b>", "50"][2:5] == ["0", "0", "NOT DEMONSTRATED"]
    assert any(
        note.startswith("Not demonstrated: no time remains") and "<b>tunnel</b>, 50 m" in note
        for note in table.notes
    )


def test_decorrelation_is_given_or_refused_in_words() -> None:
    table = environments.section(evaluated()).tables[-1]
    assert rows(table)[0][0] == "whole record"
    assert all(row[1] == "not given" and len(row[4]) > 10 for row in rows(table)[1:])


def test_the_page_has_the_section_only_where_there_are_labels() -> None:
    page = render_html(report_of(evaluated()))
    assert 'id="environments"' in page
    assert "<b>tunnel" not in page
    assert "&lt;b&gt;tunnel" in page
    keys = [section.key for section in report_of(evaluated()).sections]
    assert keys.index("environments") == keys.index("figures") + 1
    r = rail()
    bare = evaluate(r.replace(table=r.table.drop(columns="environment")), truth=POINT)
    assert "environments" not in [section.key for section in report_of(bare).sections]


def test_without_truth_levels_and_availability_remain() -> None:
    r = rail()
    moving = r.replace(table=r.table.assign(lon_deg=r.table["lon_deg"] + np.arange(len(r)) / 1e4))
    section = environments.section(evaluate(moving))
    assert [table.title for table in section.tables] == [
        "Sizes and availability by environment", "Decorrelation time by environment",
    ]  # fmt: skip
    own = environments.section(evaluate(rail(), alert_limits_m=(20.0,)))
    assert any("lower bound" in note for note in own.tables[0].notes)
    assert {row[4] for row in rows(own.tables[1])} == {"NOT DEMONSTRATED"}
