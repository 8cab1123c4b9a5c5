"""The HTML report: self-contained, the same each time, and safe against hostile text."""

from __future__ import annotations

import dataclasses
import importlib
import json
import re
from decimal import ROUND_CEILING, Decimal
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

import sbas
from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.evaluation import evaluate
from sbas.integrity.results import Evaluation
from sbas.integrity.tails.tail_fit import TailFit
from sbas.reporting import render_html, report, report_of
from sbas.reporting.document import Report
from sbas.reporting.sections import (
    decorrelation_and_k,
    error_tail,
    event_list,
    results,
    verdict,
)
from sbas.reporting.sections.method_trace import METHODS
from tests.plots.synthetic import KINDS, TRUTH, evaluated, synthetic_recording

VOID = {"meta", "br", "hr", "img", "input", "link"}


class _Page(HTMLParser):
    """References, ids, tags and text outside style of a page; fails on unbalanced tags."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.ids: list[str] = []
        self.tags: list[str] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(page)
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)
        if tag not in VOID:
            self._open.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href", "action", "data", "poster", "srcset"):
                self.links.append(value)
            if name == "id":
                self.ids.append(value)

    def handle_startendtag(self, tag: str, attrs: Any) -> None:
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self._open:
            self.text += data


def _words(page: str) -> str:
    return " ".join(_Page(page).text.split())


@cache
def document(kind: str) -> Report:
    """The report of `evaluated(kind)`, drawn once."""
    return report_of(evaluated(kind))


@pytest.mark.parametrize("kind", KINDS)
def test_refers_to_nothing_outside(kind: str, tmp_path: Path) -> None:
    path = report(evaluated(kind), tmp_path / "report.html")
    page = path.read_text(encoding="utf-8")
    assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)", re.sub(r"base64,[^\"]*", "", page))
    seen = _Page(page)
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in seen.links)
    assert not {"script", "link", "iframe", "object"} & set(seen.tags)
    assert len(set(seen.ids)) == len(seen.ids)
    assert {link[1:] for link in seen.links if link.startswith("#")} <= set(seen.ids)
    # Two of the tail exist only where one was fitted.
    fitted = isinstance(evaluated(kind).process.tail, TailFit)
    assert page.count('role="img"') == 8 + 2 * fitted
    assert len(page) < 1_500_000


def test_same_input_gives_the_same_bytes(tmp_path: Path) -> None:
    recording = synthetic_recording(500, spikes={100: 90.0})
    pages = [
        report(evaluate(recording, truth=TRUTH), tmp_path / f"{i}.html").read_bytes()
        for i in range(2)
    ]
    assert pages[0] == pages[1]


def test_a_hostile_file_name_is_text() -> None:
    name = "<script>alert(1)</script>.pos"
    page = render_html(report_of(evaluate(synthetic_recording(50, path=name), truth=TRUTH)))
    assert "<script" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;.pos" in page
    assert name in _words(page)


def test_a_hostile_header_is_text() -> None:
    recording = synthetic_recording(50)
    meta = dataclasses.replace(recording.meta, receiver='"><img src=x onerror=alert(1)>')
    page = render_html(report_of(evaluate(recording.replace(meta=meta), truth=TRUTH)))
    assert "<img" not in page


def _with_rates(evaluation: Evaluation, hours: float, only: float | None = None) -> Evaluation:
    """The evaluation with HMI rates as if no event had come in so many hours."""

    def longer(result: Any) -> Any:
        if only not in (None, result.alert_limit_m):
            return result
        bound = poisson_bounds(0, hours, 0.95)
        rate = dataclasses.replace(result.rates["hmi"], demonstrated=bound, events=0, hours=hours)
        return dataclasses.replace(result, rates={**result.rates, "hmi": rate})

    limits = tuple(longer(r) for r in evaluation.alert_limits)
    return dataclasses.replace(evaluation, alert_limits=limits)


def _verdict(evaluation: Evaluation) -> tuple[str, str]:
    first = verdict.section(evaluation).callouts[0]
    return first.title, " ".join(first.paragraphs)


def test_short_record_is_not_demonstrated_and_says_how_long_it_takes() -> None:
    """Hours for 1e-7/h: -ln(0.05)/1e-7 = 2.9957e7 h = 3417 years of 8766 h."""
    title, text = _verdict(evaluated("ordinary"))
    assert title.startswith("NOT DEMONSTRATED")
    assert "Counting alone cannot reach" in text
    assert "2.996×10⁷ h" in text
    assert "3,417 years" in text
    rate = evaluated("ordinary").at(25.0).rates["hmi"]
    assert rate.events == 1
    # One HMI event: 4.743865 expected ones would show more with 95 % (Garwood, exact).
    upper = Decimal(4.743865 / rate.hours).quantize(Decimal("0.001"), rounding=ROUND_CEILING)
    assert f"{upper} times per hour for alert limits of 25, 20 m: 1 event" in text


def test_long_record_is_demonstrated() -> None:
    title, text = _verdict(_with_rates(evaluated("ordinary"), 1e9))
    assert title.startswith("DEMONSTRATED:")
    assert "not demonstrated" not in text
    assert "2.996×10⁻⁹ times per hour" in text
    page = _words(render_html(report_of(_with_rates(evaluated("ordinary"), 1e9))))
    assert "NOT DEMONSTRATED" not in page
    assert "SIL 4" in page


def test_one_limit_of_three_is_demonstrated_in_part() -> None:
    title, text = _verdict(_with_rates(evaluated("ordinary"), 1e9, only=50.0))
    assert title.startswith("DEMONSTRATED IN PART")
    assert "for an alert limit of 50 m" in text
    assert "for alert limits of 25, 20 m" in text


def test_a_bound_on_the_claim_itself_is_not_demonstrated() -> None:
    evaluation = _with_rates(evaluated("ordinary"), 1e9)
    tie = dataclasses.replace(
        evaluation.alert_limits[0].rates["hmi"].demonstrated, value=0.0, upper=1e-7
    )
    rates = {"hmi": dataclasses.replace(evaluation.alert_limits[0].rates["hmi"], demonstrated=tie)}
    limits = tuple(dataclasses.replace(r, rates=rates) for r in evaluation.alert_limits)
    assert _verdict(dataclasses.replace(evaluation, alert_limits=limits))[0].startswith("NOT")


def test_a_lower_bound_is_said_and_no_rate_is_given() -> None:
    found = document("own_median")
    titles = [callout.title for callout in found.sections[0].callouts]
    assert titles[0].startswith("NOT DEMONSTRATED")
    assert "Errors are a lower bound" in titles
    words = _words(render_html(found))
    assert "only a lower bound" in words
    assert isinstance(evaluated("own_median").alert_limits[0].rates["hmi"].demonstrated, Refusal)


def test_without_truth_no_error_figure_is_printed() -> None:
    words = _words(render_html(document("moving_without_truth")))
    assert "There is no truth for this recording" in words
    assert "HPE 95 %" not in words


@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.key)
def test_every_traced_function_exists_and_is_documented(method: Any) -> None:
    parts = method.function.split(".")
    for depth in range(len(parts) - 1, 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:depth]))
        except ModuleNotFoundError:
            continue
        for name in parts[depth:]:
            found = getattr(found, name)
        break
    assert callable(found)
    assert found.__doc__


def test_first_50_events_are_listed_and_the_rest_counted() -> None:
    """63 epochs, each 70 s apart, put 100 m beside the truth; an epoch is 10 s."""
    recording = synthetic_recording(70 * 63)
    table = recording.table.iloc[::10].copy()
    table.iloc[::7, table.columns.get_loc("lat_deg")] += 100 / 111_200
    evaluation = evaluate(recording.replace(table=table), truth=TRUTH)
    tables = {t.title: t for t in event_list.section(evaluation).tables}
    shown = tables["HPE ≥ AL at an alert limit of 50 m: 63"]
    assert len(shown.rows) == 50
    assert shown.notes == ("13 more are counted but not listed.",)
    assert shown.rows[1][1].text == "2009-09-19 00:01:10"
    assert shown.rows[1][2].text == "10"


def test_the_same_object_gives_json() -> None:
    plain = document("ordinary").to_dict()
    text = json.dumps(plain, allow_nan=False)
    assert "<svg" not in text
    assert [s["key"] for s in plain["sections"]][:2] == ["verdict", "figures"]


def test_inputs_name_digest_and_size() -> None:
    words = _words(render_html(document("ordinary")))
    assert "ab" * 32 in words
    assert "300,000" in words


def test_a_folder_that_is_not_there_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        report(evaluated("two_epochs"), tmp_path / "absent" / "report.html")


def _section(report: Report, key: str) -> Any:
    return next(s for s in report.sections if s.key == key)


def test_the_verdict_on_the_published_k_is_that_of_the_evaluation() -> None:
    evaluation = evaluate(synthetic_recording(40_000), truth=TRUTH)
    judged = evaluation.railway
    assert not isinstance(judged, Refusal)
    section = decorrelation_and_k.section(evaluation)
    said = " ".join(section.callouts[0].paragraphs)
    assert judged.as_claimed.verdict in said
    assert evaluation.process.decorrelation.interval_text in said
    tables = {t.title: t for t in section.tables}
    (k_table,) = (t for title, t in tables.items() if title.startswith("K factor for"))
    printed = {row[0].text: float(row[1].text) for row in k_table.rows}
    assert printed == {name: round(m.k, 4) for name, m in judged.models.models.items()}
    (levels,) = (t for title, t in tables.items() if "railway HPL" in title)
    assert [row[0].text for row in levels.rows] == ["50", "25", "20"]


def test_a_short_record_says_that_it_cannot_tell() -> None:
    section = _section(document("ordinary"), "decorrelation")
    said = " ".join(section.callouts[0].paragraphs)
    assert "too short to confirm or reject 360 s" in said
    assert "cannot be told" in said


def test_modelled_rates_and_their_bounds_are_printed_or_refused_in_words() -> None:
    evaluation = evaluate(synthetic_recording(40_000), truth=TRUTH, alert_limits_m=(10.0,))
    (rates,) = (t for t in results.section(evaluation).tables if "Rates" in t.title)
    upper = [c.title for c in rates.columns].index("Modelled: upper bound at 95 % [1/h]")
    kinds = {row[1].text: row[upper].text for row in rates.rows}
    modelled = evaluation.at(10.0).rates["exceeds_al"].modelled
    if isinstance(modelled, Refusal):
        assert kinds["HPE ≥ AL"] == "not given"
        assert any(modelled.reason in note for note in rates.notes)
    else:
        assert kinds["HPE ≥ AL"] != "not given"
    tail = error_tail.section(evaluation)
    fitted = evaluation.process.tail
    refusal = fitted if isinstance(fitted, Refusal) else fitted.refusal
    assert (tail.callouts[0].title == "No rate is modelled") == (refusal is not None)


def test_likely_causes_are_listed_the_worst_first() -> None:
    recording = synthetic_recording(spikes={1500: 100.0, 2000: 60.0})
    causes = sbas.explain(recording, truth=TRUTH)
    assert len(causes.events) == 2
    section = _section(report_of(evaluated("ordinary"), causes=causes), "causes")
    counts, events = section.tables
    assert sum(int(row[2].text) for row in counts.rows) == 2
    ratios = [float(row[4].text) for row in events.rows]
    assert ratios == sorted(ratios, reverse=True)
    alone = _section(document("ordinary"), "causes")
    assert "Not explained" in alone.paragraphs[0]
