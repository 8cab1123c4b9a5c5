"""The fault tree of sensor states: against enumeration, truth tables, files and runs by hand."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import mpmath  # type: ignore[import-untyped]
import numpy as np
import pytest

from sbas.dependability import MarkovSource, depend, dump_model, load_model
from sbas.dependability.tree.gate_truth import gate_truth
from sbas.dependability.tree.model_text import model_text
from sbas.exceptions import InputError, ModelError
from sbas.fusion.logic.boolean_form import two_line_form
from sbas.fusion.logic.published_tables import figure_9
from sbas.fusion.logic.truth_table import TruthTable, table_from_letters
from sbas.fusion.recorded.state_sources import combination_source, sensor_source
from sbas.fusion.recorded.tree_events import failed_or, hardware_probability, state_fault_tree
from sbas.fusion.states import combination_states

NAMES = ("Odo", "Acc", "GPS")
RATE = 3.6  # per hour, so that hardware matters within 100 s


def chain(name: str, d: float, u: float, *, silent: float = 0.0) -> MarkovSource:
    """A source whose every row is its stationary law: N, DA, U and no data."""
    law = (1 - d - u - silent, d, u, silent)
    return MarkovSource(name, ("N", "DA", "U", "no data"), (law,) * 4, law)


def sticky(name: str, seed: int) -> MarkovSource:
    """A source of simulated states that last."""
    rng = np.random.default_rng(seed)
    state = np.repeat(rng.choice([0, 0, 0, 1, 1, 2], (40, 50)), 5, axis=0).astype(np.int8)
    return sensor_source(name, state, step_s=1.0, start="stationary")


def enumerated(table: TruthTable, laws: Any, failed: Any, condition: str) -> float:
    """P(condition) over all states of all sensors and of their hardware, term by term."""
    terms = []
    for states in itertools.product(range(len(laws[0])), repeat=len(laws)):
        for broken in itertools.product((0, 1), repeat=len(laws)):
            p = math.prod(
                law[s] * (h if b else 1 - h)
                for law, s, h, b in zip(laws, states, failed, broken, strict=True)
            )
            # The fourth state is no data; with it, or without hardware, a sensor is as if U.
            levels = [2 if b else min(s, 2) for s, b in zip(states, broken, strict=True)]
            outcome = table.outcome(levels)
            terms.append(p * (outcome == 2 if condition == "isU" else outcome > 0))
    return math.fsum(terms)


@pytest.mark.parametrize("condition", ["isU", "notN"])
@pytest.mark.parametrize("version", ["corrected", "printed"])
def test_the_exact_solution_is_the_enumeration_of_stationary_laws(
    condition: Any, version: Any
) -> None:
    table = figure_9(version)
    sources = {name: sticky(name, seed) for seed, name in enumerate(NAMES)}
    model = state_fault_tree(
        table, sources, condition=condition, step_s=1.0, mission_s=50.0,
        failure_rates_per_h={"Odo": RATE, "GPS": RATE / 2},
    )  # fmt: skip
    solution = depend(model).solutions[model.name]
    rates = (RATE, 0.0, RATE / 2)
    laws = [sources[name].initial for name in NAMES]
    for at, seconds in ((solution.top.at_start, 0.0), (solution.top.at_end, 50.0)):
        failed = [1 - math.exp(-rate * seconds / 3600) for rate in rates]
        assert at == pytest.approx(enumerated(table, laws, failed, condition), rel=1e-10)


def test_the_check_values_of_the_page() -> None:
    # Page, section 11: d = .2, .2, .15; u = .1, .07, .07: P(isU) 4.9e-4, P(notN) .22759.
    laws = {"Odo": (0.2, 0.1), "Acc": (0.2, 0.07), "GPS": (0.15, 0.07)}
    sources = {name: chain(name, d, u) for name, (d, u) in laws.items()}
    expected: float
    condition: Any
    for condition, expected in (("isU", 4.9e-4), ("notN", 0.22759)):
        model = state_fault_tree(
            two_line_form(NAMES), sources, condition=condition, step_s=1.0, mission_s=5.0
        )
        top = depend(model).solutions[model.name].top
        assert top.mean_unavailability == pytest.approx(expected, rel=1e-12)


def test_no_data_counts_as_unacceptable() -> None:
    sources = {name: chain(name, 0.2, 0.1, silent=0.1) for name in NAMES}
    model = state_fault_tree(two_line_form(NAMES), sources, step_s=1.0, mission_s=5.0)
    assert depend(model).solutions[model.name].top.at_end == pytest.approx(0.2**3)
    assert any("without data counts as U" in note for note in model.notes)


@pytest.mark.parametrize("condition", ["isU", "notN"])
@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("version", ["corrected", "printed"])
def test_the_gates_are_the_truth_table(condition: Any, joint: bool, version: Any) -> None:
    table = figure_9(version)
    states = combination_states(np.arange(27), 3)
    if joint:
        # One run through all combinations, and back to the first.
        series = np.concatenate([states, states[:, :1]], axis=1)
        source = combination_source(series, step_s=1.0, start="stationary", estimate="counts")
        model = state_fault_tree(table, source, condition=condition, step_s=1.0, mission_s=26.0)
        words = ["".join("NDU"[s] for s in column) for column in states.T]
        histories = {"sensors": np.array([[source.states.index(word) for word in words]])}
    else:
        sources = {name: chain(name, 0.2, 0.1) for name in NAMES}
        model = state_fault_tree(table, sources, condition=condition, step_s=1.0, mission_s=26.0)
        histories = {s.name: states[NAMES.index(s.name)][None] for s in model.sources}
    truth = gate_truth(model, histories)[condition][0]
    expected = table.outcomes == 2 if condition == "isU" else table.outcomes > 0
    assert truth.tolist() == expected.tolist()


def test_common_causes_live_in_the_joint_source() -> None:
    rng = np.random.default_rng(7)
    common = np.repeat(rng.choice([0, 0, 0, 2], (60, 80)), 4, axis=0)
    own = rng.choice([0, 0, 0, 1], (3, 240, 80))
    states = np.where(common[None] == 2, 2, own).astype(np.int8)
    table = two_line_form(NAMES)
    joint = state_fault_tree(
        table,
        combination_source(states, step_s=1.0, start="stationary", estimate="counts"),
        step_s=1.0,
        mission_s=20.0,
    )
    apart = state_fault_tree(
        table, {
            n: sensor_source(n, s, step_s=1.0, start="stationary")
            for n, s in zip(NAMES, states, strict=True)
        },
        step_s=1.0, mission_s=20.0,
    )  # fmt: skip
    together = depend(joint).solutions[joint.name].top.at_end
    # Edges of runs: the stationary law of the counts is the share of epochs but for 1 in 240.
    assert together == pytest.approx(float(np.mean(common == 2)), rel=0.02)
    assert depend(apart).solutions[apart.name].top.at_end == pytest.approx(together**3, rel=0.06)
    assert any("common causes are left out" in note for note in apart.notes)
    assert not any("common causes are left out" in note for note in joint.notes)


def test_drifting_runs_have_their_own_shares_at_every_epoch() -> None:
    # Dead reckoning: both sensors leave N once and for all; the output of the pair is U with both.
    rng = np.random.default_rng(2)
    common = rng.integers(5, 60, 3000)
    at = np.arange(40)[:, None]
    late = np.stack([at > common, at > np.minimum(common, rng.integers(5, 60, 3000))])
    states = np.where(late, np.int8(2), np.int8(0))
    model = state_fault_tree(
        two_line_form(("A", "B")),
        combination_source(states, step_s=1.0, stages=39, estimate="counts"),
        step_s=1.0, mission_s=39.0,
    )  # fmt: skip
    row = depend(model).solutions[model.name].top
    simulated = (states == 2).all(axis=0).mean(axis=1)
    assert row.at_end == pytest.approx(simulated[-1], rel=1e-9)
    assert row.mean_unavailability == pytest.approx(float(simulated[1:].mean()), rel=1e-9)


def test_a_critical_combination_is_a_duration_gate() -> None:
    sources = {name: chain(name, 0.2, 0.1) for name in NAMES}
    model = state_fault_tree(
        two_line_form(NAMES), sources, step_s=1.0, mission_s=11.0, critical={"UUN": 2.7}
    )
    assert model.top == "TOP"
    assert model.cases == ("isU", "UUN or worse lasts")
    #                 U U lasts from 2 to 5: true from 4 on; the third sensor may get worse
    odo = np.array([[0, 0, 2, 2, 2, 2, 0, 2, 2, 0, 2, 2]])
    acc = np.array([[0, 2, 2, 2, 2, 2, 0, 2, 2, 2, 2, 1]])
    gps = np.array([[0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0]])
    truth = gate_truth(model, {"Odo": odo, "Acc": acc, "GPS": gps})
    # 2.7 s are rounded down to 2 steps: the time since the entry is 2 s at the third epoch.
    assert np.flatnonzero(truth["UUN or worse lasts"][0]).tolist() == [4, 5]
    assert np.flatnonzero(truth["isU"][0]).tolist() == [8]
    assert np.flatnonzero(truth["TOP"][0]).tolist() == [4, 5, 8]


def test_a_silent_sensor_of_a_critical_combination_may_also_be_unacceptable() -> None:
    sources = {name: chain(name, 0.2, 0.1, silent=0.1) for name in NAMES}
    model = state_fault_tree(
        two_line_form(NAMES), sources, step_s=1.0, mission_s=3.0, critical={"DN-": 0.0}
    )
    odo, gps = np.array([[1, 2, 3, 1]]), np.array([[3, 2, 3, 1]])
    truth = gate_truth(model, {"Odo": odo, "Acc": np.zeros((1, 4), int), "GPS": gps})
    assert truth["DN- or worse lasts"][0].tolist() == [True, True, True, False]


def test_a_critical_time_of_nothing_and_on_the_grid() -> None:
    sources = {name: chain(name, 0.2, 0.1) for name in NAMES}
    for seconds, epochs in ((0.0, 0), (0.05, 0), (0.3, 3), (0.1 + 0.2, 3), (0.39, 3)):
        model = state_fault_tree(
            two_line_form(NAMES), sources, step_s=0.1, mission_s=1.0, critical={"NDU": seconds}
        )
        (gate,) = [g for g in model.gates if g.name == "NDU or worse lasts"]
        assert gate.seconds == pytest.approx(0.1 * epochs)  # type: ignore[union-attr]
    # The gate "DA or worse" of the second sensor, U of the third, for 2 s: (d + u)^3 u^3 where
    # every epoch is drawn anew.
    model = state_fault_tree(
        table_from_letters(("A", "B"), "NND NND DDU", provenance="made up"),
        {name: chain(name, 0.2, 0.1) for name in ("A", "B")},
        step_s=1.0, mission_s=10.0, critical={"DU": 2.0},
    )  # fmt: skip
    row = depend(model).solutions[model.name].rows["DU or worse lasts"]
    assert row.at_end == pytest.approx(0.3**3 * 0.1**3)


def test_the_model_is_read_again_and_printed(tmp_path: Path) -> None:
    model = state_fault_tree(
        figure_9(), {name: sticky(name, seed) for seed, name in enumerate(NAMES)},
        condition="notN", step_s=1.0, mission_s=100.0,
        failure_rates_per_h=dict.fromkeys(NAMES, 4e-6), critical={"NNU": 3.0, "UU-": 1.0},
    )  # fmt: skip
    for name in ("tree.toml", "tree.json"):
        dump_model(model, tmp_path / name)
        assert load_model(tmp_path / name) == model
    text = model_text(model)
    assert "NNU or worse lasts: DUR, 3 s by 'age'" in text
    assert "geometric" in text
    assert "truth table stands for the fusion" in text


def test_hardware_is_added_exactly() -> None:
    # Page, section 6: 2.8e-8 in 100 s at 1e-6/h; all digits from mpmath.
    with mpmath.workdps(30):
        expected = float(-mpmath.expm1(-mpmath.mpf("1e-6") / 36))
    assert float(hardware_probability(1e-6, 100.0)) == pytest.approx(expected, rel=1e-15)
    assert f"{float(hardware_probability(1e-6, 100.0)):.1e}" == "2.8e-08"
    assert float(failed_or(0.0, 1e-6, 100.0)) == pytest.approx(expected, rel=1e-15)
    both = failed_or([0.0, 0.25, 1.0], 3600.0, 1.0)
    assert both == pytest.approx(1 - np.array([1.0, 0.75, 0.0]) * math.exp(-1))
    for wrong in ((-1.0, 1.0), (1.0, -1.0), (math.nan, 1.0)):
        with pytest.raises(InputError, match="0 or more"):
            hardware_probability(*wrong)
    with pytest.raises(InputError, match="between 0 and 1"):
        failed_or(1.1, 1e-6, 100.0)


def test_hardware_alone_stands_for_a_state_that_was_never_seen() -> None:
    states = np.zeros((2, 30), np.int8)
    states[0, ::4] = 1
    states[1, 5:9] = 2
    table = two_line_form(("A", "B"))
    source = combination_source(states, step_s=1.0, start="stationary")
    with pytest.raises(InputError, match="A was never seen to be U"):
        state_fault_tree(table, source, step_s=1.0, mission_s=10.0)
    model = state_fault_tree(
        table, source, step_s=1.0, mission_s=10.0, failure_rates_per_h={"A": RATE}
    )
    at_end = depend(model).solutions[model.name].top.at_end
    share = math.fsum(p for s, p in zip(source.states, source.initial, strict=True) if s[1] == "U")
    assert at_end == pytest.approx(share * -math.expm1(-RATE * 10 / 3600), rel=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"failure_rates_per_h": {"Sonar": 1e-6}}, "no sensor 'Sonar'"),
        ({"critical": {"NNN": 2.0}}, "has no fault"),
        ({"critical": {"UN": 2.0}}, "no combination of"),
        ({"critical": {"UXN": 2.0}}, "no combination of"),
        ({"critical": {"UUN": math.nan}}, "not known"),
        ({"critical": {"UUN": math.inf}}, "not known"),
        ({"critical": {"UUN": -1.0}}, "not known"),
        ({"condition": "isN"}, "no condition"),
    ],
)
def test_what_means_nothing_is_refused(options: dict[str, Any], message: str) -> None:
    sources = {name: chain(name, 0.2, 0.1) for name in NAMES}
    with pytest.raises(InputError, match=message):
        state_fault_tree(two_line_form(NAMES), sources, step_s=1.0, mission_s=5.0, **options)


def test_sources_of_other_sensors_are_refused() -> None:
    table = two_line_form(NAMES)
    good = {name: chain(name, 0.2, 0.1) for name in NAMES}
    with pytest.raises(InputError, match="not those of the table's sensors"):
        state_fault_tree(table, {"Odo": good["Odo"]}, step_s=1.0, mission_s=5.0)
    with pytest.raises(InputError, match="not those of the table's sensors"):
        state_fault_tree(table, {**good, "Odo": good["Acc"]}, step_s=1.0, mission_s=5.0)
    with pytest.raises(InputError, match="no letter a sensor"):
        state_fault_tree(table, good["Odo"], step_s=1.0, mission_s=5.0)
    with pytest.raises(InputError, match="'isU' is never true"):
        state_fault_tree(
            table_from_letters(NAMES, "N" * 27, provenance="nothing"), good,
            step_s=1.0, mission_s=5.0,
        )  # fmt: skip
    with pytest.raises(ModelError):
        state_fault_tree(table, good, step_s=1.0, mission_s=5.5)
