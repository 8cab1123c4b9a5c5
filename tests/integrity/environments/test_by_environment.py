"""Every figure by environment against a count epoch by epoch, and against the whole record."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.evaluation import evaluate
from sbas.integrity.failure_rates import failure_rate
from sbas.integrity.position_error import position_errors
from sbas.integrity.results import Evaluation
from sbas.integrity.stanford import REGIONS, stanford_regions
from sbas.recording import Recording
from tests.examples import POINT, quiet, recording
from tests.integrity.environments import plain_evaluation as plain

ENVIRONMENTS = ("open", "cutting", "tunnel")
KINDS = ("hmi", "mi", "exceeds_al")


def labelled(r: Recording, labels: Sequence[str | None]) -> Recording:
    return r.replace(table=r.table.assign(environment=pd.Categorical(labels)))


def plain_epochs(r: Recording, labels: Sequence[str | None], step_s: float) -> plain.Epochs:
    time = r.time.astype(np.int64) - r.time[0].astype(np.int64)
    return plain.Epochs(
        (time / 1e9).tolist(),
        position_errors(r, POINT)["hpe_m"].tolist(),
        r.table["hpl_m"].tolist(),
        r.table["lat_deg"].notna().tolist(),
        [label or "unlabelled" for label in labels],
        step_s,
    )


@st.composite
def records(draw: st.DrawFn) -> tuple[Recording, list[str | None]]:
    n = draw(st.integers(2, 40))
    rows = [
        draw(
            st.tuples(
                st.sampled_from([1.0, 1.0, 1.0, 0.4, 1.3, 2.5, 30.0]),
                st.sampled_from([0.5, 0.5, 12.0, 30.0, 60.0, math.nan]),
                st.sampled_from([5.0, 5.0, 40.0, 90.0, math.nan]),
            )
        )
        for _ in range(n)
    ]
    labels: list[str | None] = []
    while len(labels) < n:
        label = draw(st.sampled_from([*ENVIRONMENTS, None]))
        labels += [label] * draw(st.sampled_from([1, 1, 2, 3, 5, 20]))
    steps, error, level = (np.array(column) for column in zip(*rows, strict=True))
    r = recording(np.nan_to_num(error), np.zeros(n), level, time_s=np.cumsum(steps))
    table = r.table.assign(lat_deg=np.where(np.isnan(error), np.nan, r.table["lat_deg"]))
    return r.replace(table=table), labels[:n]


SETTINGS: dict[str, Any] = {
    "truth": POINT, "alert_limits_m": (20.0, 50.0), "time_to_alert_s": 3.0, "merge_s": 4.0,
}  # fmt: skip


@settings(max_examples=30)
@given(records())
def test_every_label_is_as_counted_epoch_by_epoch(made: tuple[Recording, list[Any]]) -> None:
    r, labels = made
    assume(any(labels))
    found = evaluate(labelled(r, labels), **SETTINGS)
    e = plain_epochs(r, labels, found.input.survey.interval_ns / 1e9)
    assert set(found.environments) == set(e.label)
    for label, mine in found.environments.items():
        sizes = plain.sizes(e, label)
        hours = mine.exposure
        assert mine.epochs == sizes["epochs"]
        assert mine.hours == hours.recorded_hours
        for name, hours_h in (
            ("recorded_s", hours.recorded_hours), ("judged_s", hours.judged_hours),
            ("error_s", hours.error_hours), ("gap_s", hours.gap_hours),
            ("level_s", hours.recorded_hours - hours.without_level_hours),
        ):  # fmt: skip
            assert hours_h * 3600 == pytest.approx(sizes[name], abs=1e-6)
        here = np.array([x == label for x in e.label])
        known = np.array(e.hpe_m)[here & np.isfinite(e.hpe_m)]
        assert (mine.hpe_m is None) == (known.size == 0)
        if mine.hpe_m is not None:
            assert mine.hpe_m.p95 == pytest.approx(np.quantile(known, 0.95), rel=1e-12)
        for al in SETTINGS["alert_limits_m"]:
            _check_limit(mine, e, label, al)


def _check_limit(mine: Evaluation, e: plain.Epochs, label: str, al: float) -> None:
    here = np.array([x == label for x in e.label])
    codes = stanford_regions(np.array(e.hpe_m)[here], np.array(e.hpl_m)[here], al)
    at = mine.at(al)
    assert at.regions == dict(zip(REGIONS, np.bincount(codes, minlength=6).tolist(), strict=True))
    up, expected = at.availability, plain.service(e, label, al)
    assert up.availability.value == pytest.approx(expected["availability"], abs=1e-12)
    assert up.availability_excluding_gaps.value == pytest.approx(
        expected["excluding_gaps"], abs=1e-12
    )
    assert (up.losses, up.recoveries) == (expected["losses"], expected["recoveries"])
    assert up.continuity_risk == pytest.approx(expected["risk"], abs=1e-12)
    assert up.continuity_risk_excluding_gaps == pytest.approx(
        expected["risk_excluding_gaps"], abs=1e-12
    )
    for kind in KINDS:
        counted = plain.rate(e, label, kind, al, merge_s=4.0, least_s=3.0)
        rate = at.rates[kind]
        assert (rate.events, rate.runs) == (counted["events"], counted["runs"])
        assert rate.event_hours * 3600 == pytest.approx(counted["event_s"], abs=1e-6)
        assert rate.hours * 3600 == pytest.approx(counted["hours_s"], abs=1e-6)
        listed = plain.events_of(
            plain.runs_of(e, kind, al), merge_s=0.0, least_s=3.0 if kind == "hmi" else 0.0,
            step_s=e.step_s,
        )  # fmt: skip
        listed = [x for x in listed if label in x.labels]
        assert len(at.events[kind]) == len(listed)
        np.testing.assert_allclose(
            at.events[kind].duration_s, [x.end_s - x.start_s for x in listed], atol=1e-6
        )


@settings(max_examples=30)
@given(records())
def test_over_all_labels_epochs_and_hours_sum_to_the_record_and_events_to_no_less(
    made: tuple[Recording, list[Any]],
) -> None:
    r, labels = made
    assume(any(labels))
    whole = evaluate(labelled(r, labels), **SETTINGS)
    parts = list(whole.environments.values())
    assert sum(p.epochs for p in parts) == whole.epochs
    for name, hours in vars(whole.exposure).items():
        total = sum(getattr(p.exposure, name) for p in parts)
        assert total == pytest.approx(hours, abs=1e-12), name
    for al in SETTINGS["alert_limits_m"]:
        at, of_parts = whole.at(al), [p.at(al) for p in parts]
        for name in ("losses", "recoveries"):
            total = sum(getattr(p.availability, name) for p in of_parts)
            assert total == getattr(at.availability, name)
        for name in ("up_hours", "down_hours", "gap_hours"):
            total = sum(getattr(p.availability, name) for p in of_parts)
            assert total == pytest.approx(getattr(at.availability, name), abs=1e-12)
        for kind in KINDS:
            assert sum(p.rates[kind].events for p in of_parts) >= at.rates[kind].events
            assert sum(_free_s(p, al, kind) for p in parts) <= _free_s(whole, al, kind) + 1e-6
            assert sum(len(p.events[kind]) for p in of_parts) >= len(at.events[kind])


def _free_s(evaluation: Evaluation, al: float, kind: Any) -> float:
    """Time without events before it is cut off at none [s]."""
    rate, hours = evaluation.at(al).rates[kind], evaluation.exposure
    judged = hours.error_hours if kind == "exceeds_al" else hours.judged_hours
    return (judged - rate.event_hours) * 3600 - rate.events * evaluation.merge_s


def _figures(evaluation: Evaluation) -> dict[str, Any]:
    plain_values = evaluation.to_dict()
    del plain_values["environments"], plain_values["findings"]
    return plain_values


@settings(max_examples=30)
@given(records())
def test_one_label_for_all_gives_the_figures_of_the_record(made: tuple[Recording, Any]) -> None:
    r, _ = made
    bare = _figures(evaluate(r, **SETTINGS))
    whole = evaluate(labelled(r, ["open"] * len(r)), **SETTINGS)
    assert list(whole.environments) == ["open"]
    assert _figures(whole) == bare
    assert _figures(whole.environments["open"]) == bare


def test_one_label_for_all_of_an_hour_long_record_gives_its_intervals_and_tails() -> None:
    rng = np.random.default_rng(4)
    n, tau = 20_000, 30.0
    noise = rng.standard_normal((2, n)) * math.sqrt(1 - math.exp(-2 / tau))
    errors = np.zeros((2, n))
    for i in range(1, n):
        errors[:, i] = math.exp(-1 / tau) * errors[:, i - 1] + noise[:, i]
    hpl = np.where(rng.random(n) < 0.01, 60.0, 9.0)
    r = recording(*errors, hpl)
    r = r.replace(table=r.table.drop(r.table.index[7000:7100]))
    whole = evaluate(labelled(r, ["open"] * len(r)), truth=POINT)
    mine = whole.environments["open"]
    assert _figures(mine) == _figures(whole)
    assert not isinstance(mine.process.decorrelation.tau_s, Refusal)
    assert mine.at(50.0).availability.availability.lower is not None


def test_an_event_across_a_border_counts_on_both_sides_and_stays_one_for_its_length() -> None:
    error = np.full(400, 0.5)
    error[96:108] = 60.0  # 4 s in the open, 8 s in the cutting: 12 s in all
    r = recording(error, np.zeros(400), np.full(400, 11.0))
    found = evaluate(labelled(r, ["open"] * 100 + ["cutting"] * 300), truth=POINT)
    assert len(found.at(50.0).events["hmi"]) == 1
    for label in ("open", "cutting"):
        events = found.environments[label].at(50.0).events["hmi"]
        # Each side alone is shorter than the time to alert of 10 s.
        assert events.duration_s.tolist() == [12.0]
        assert not events.censored.any()
    hours = {k: v.at(50.0).rates["hmi"].event_hours for k, v in found.environments.items()}
    assert hours == {"open": pytest.approx(4 / 3600), "cutting": pytest.approx(8 / 3600)}


def test_flicker_across_a_border_is_one_lasting_event_of_both_sides() -> None:
    error = np.full(400, 0.5)
    error[94:100] = error[101:107] = 60.0  # 6 s, good for 1 s, 6 s
    r = recording(error, np.zeros(400), np.full(400, 11.0))
    found = evaluate(labelled(r, ["open"] * 100 + ["cutting"] * 300), truth=POINT, merge_s=60.0)
    assert found.at(50.0).rates["hmi"].events == 1
    assert [e.at(50.0).rates["hmi"].events for e in found.environments.values()] == [1, 1]


def test_a_stretch_of_another_label_is_no_gap_and_no_loss() -> None:
    n = 3000
    hpl = np.where((np.arange(n) // 100) % 3 == 2, 99.0, 11.0)  # down in every tunnel
    labels = [ENVIRONMENTS[i // 100 % 3] for i in range(n)]
    r = quiet(n)
    r = r.replace(table=r.table.assign(hpl_m=hpl))
    found = evaluate(labelled(r, labels), truth=POINT)
    for label in ("open", "cutting"):
        up = found.environments[label].at(50.0).availability
        assert up.availability.value == 1.0
        assert up.losses == 0
        assert up.gap_hours == 0
    tunnel = found.environments["tunnel"].at(50.0).availability
    assert tunnel.availability.value == 0.0
    # Lost on entry ten times; the last outage does not end.
    assert (tunnel.losses, tunnel.recoveries) == (10, 9)
    assert tunnel.mttf.value == 0.0
    assert "never up" in tunnel.mttf.caveats[0]
    assert tunnel.mttr is not None
    assert tunnel.mttr.value == pytest.approx(1000 / 9 / 3600)
    # Epochs in the cutting within 15 of the next tunnel are at risk.
    assert found.environments["cutting"].at(50.0).availability.continuity_risk == 0.15


def test_a_label_without_a_fix_has_levels_and_no_error_and_says_so() -> None:
    r = quiet(200)
    lat = r.table["lat_deg"].where(np.arange(200) < 120)
    r = labelled(r.replace(table=r.table.assign(lat_deg=lat)), ["open"] * 120 + ["tunnel"] * 80)
    tunnel = evaluate(r, truth=POINT).environments["tunnel"]
    assert (tunnel.hpe_m, tunnel.exposure.error_hours) == (None, 0)
    assert tunnel.hpl_m is not None
    assert tunnel.at(50.0).availability.availability.value == 0
    assert isinstance(tunnel.at(50.0).rates["hmi"].demonstrated, Refusal)
    assert [f.message for f in tunnel.findings if f.code == "E01"] == [
        "no epoch has a position: no error was formed"
    ]


def test_a_gap_belongs_to_the_label_before_it() -> None:
    time = np.concatenate([np.arange(100), np.arange(160, 300)])
    r = recording(np.zeros(240), np.full(240, 0.5), np.full(240, 11.0), time_s=time)
    r = labelled(r, ["open"] * 100 + ["tunnel"] * 140)
    found = evaluate(r, truth=POINT).environments
    assert found["open"].exposure.gap_hours == pytest.approx(60 / 3600)
    assert found["tunnel"].exposure.gap_hours == 0
    assert found["open"].at(50.0).availability.losses == 1
    assert found["open"].at(50.0).availability.availability.value == pytest.approx(100 / 160)


def test_batches_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    n = 2000
    error = np.where(rng.random(n) < 0.03, 60.0, 0.5)
    labels = rng.choice(["a", "b", None], n // 10, p=[0.6, 0.3, 0.1]).repeat(10).tolist()
    r = labelled(recording(error, np.zeros(n), np.full(n, 11.0)), labels)
    whole = evaluate(r, truth=POINT).to_dict()["environments"]
    monkeypatch.setattr("sbas.recording.BATCH_ROWS", 137)
    parts = evaluate(r, truth=POINT).to_dict()["environments"]
    assert list(parts) == list(whole)
    for label in whole:
        for size in ("hpe_m", "vpe_m", "hpl_m", "vpl_m"):
            mean = parts[label][size].pop("mean")
            assert mean == pytest.approx(whole[label][size].pop("mean"), rel=1e-12)
    assert parts == whole


def test_without_labels_there_are_no_environments() -> None:
    assert evaluate(quiet(100), truth=POINT).environments == {}
    none = labelled(quiet(100), [None] * 100)
    assert evaluate(none, truth=POINT).environments == {}


def test_too_many_labels_leave_the_record_alone_and_say_so() -> None:
    r = quiet(400)
    found = evaluate(labelled(r, [f"km {i // 10}" for i in range(400)]), truth=POINT)
    assert found.environments == {}
    assert any("more than 32 environment labels" in f.message for f in found.findings)
    assert found.hpe_m == evaluate(r, truth=POINT).hpe_m
    with pytest.raises(InputError, match="km 3"):
        failure_rate(
            labelled(r, [f"km {i // 10}" for i in range(400)]), truth=POINT, alert_limit_m=20,
            environment="km 3",
        )  # fmt: skip


def test_a_moving_record_without_truth_gives_levels_by_label() -> None:
    n = 600
    r = recording(np.arange(n) * 10.0, np.zeros(n), np.where(np.arange(n) < 300, 11.0, 30.0))
    found = evaluate(labelled(r, ["open"] * 300 + ["urban"] * 300))
    urban = found.environments["urban"]
    assert urban.hpe_m is None
    assert urban.at(25.0).regions is None
    assert urban.at(25.0).availability.availability.value == 0.0
    assert found.environments["open"].at(25.0).availability.availability.value == 1.0


def test_json_has_the_same_keys_by_label() -> None:
    r = labelled(quiet(300), ["open"] * 200 + ["urban"] * 100)
    plain_values = json.loads(json.dumps(evaluate(r, truth=POINT).to_dict()))
    assert list(plain_values["environments"]) == ["open", "urban"]
    for label in plain_values["environments"].values():
        assert label.keys() == plain_values.keys()
    assert plain_values["environments"]["urban"]["begin_gpst"] == "2009-09-19T00:03:20.000000000"


def test_a_failure_rate_of_one_environment() -> None:
    error = np.full(4000, 0.5)
    error[3000:3030] = 60.0
    r = labelled(
        recording(error, np.zeros(4000), np.full(4000, 11.0)), ["open"] * 2000 + ["urban"] * 2000
    )
    whole = failure_rate(r, truth=POINT, alert_limit_m=25)
    parts = {
        label: failure_rate(r, truth=POINT, alert_limit_m=25, environment=label)
        for label in ("open", "urban")
    }
    assert whole.environment is None
    assert whole.evidence.events == 1
    assert [p.evidence.events for p in parts.values()] == [0, 1]
    assert parts["open"].evidence.hours == pytest.approx(2000 / 3600)
    assert parts["urban"].to_dict()["environment"] == "urban"
    full = evaluate(r, truth=POINT, alert_limits_m=(25.0,)).environments["urban"]
    assert dataclasses.asdict(parts["urban"].evidence) == dataclasses.asdict(
        full.at(25.0).rates["hmi"]
    )
    for unknown in (r, quiet(100)):
        with pytest.raises(InputError, match="woody"):
            failure_rate(unknown, truth=POINT, alert_limit_m=25, environment="woody")
