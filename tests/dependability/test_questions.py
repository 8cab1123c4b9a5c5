"""From a model to its answer: the paper's system, static trees, a receiver from a recording."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

import sbas
from sbas.dependability import HybridFaultTree, ReceiverStates, depend, load_any, with_receiver
from sbas.dependability.questions import static_answer
from sbas.dependability.static.static_tree import BasicEvent, StaticGate, StaticTree
from sbas.dependability.tree.model import Component, Failed, Or
from sbas.exceptions import InputError, ModelError
from sbas.recording import Recording
from tests.plots.synthetic import TRUTH, synthetic_recording


@pytest.fixture(scope="module")
def galoroi() -> dict[str, HybridFaultTree]:
    return dict(load_any("galoroi").models)


@pytest.fixture(scope="module")
def states() -> ReceiverStates:
    return sbas.receiver_states(synthetic_recording(4000), truth=TRUTH, threshold_m=1.0)


# Nguyen, Beugin, Marais 2013, Table II (means over an hour); the relative departures of the
# exact solution are those that Monte Carlo of some 1e7 histories explains.
TABLE_II = {
    "urban": (1.65e-4, 0.01), "tunnel": (1.53e-2, 0.001), "woody": (7.59e-2, 0.001),
    "cutting": (7.17e-4, 0.001),
}  # fmt: skip


def test_service_failure_in_all_environments_of_the_paper(
    galoroi: dict[str, HybridFaultTree],
) -> None:
    answer = depend(galoroi)
    assert list(answer.solutions) == list(TABLE_II)
    for name, (published, apart) in TABLE_II.items():
        assert answer.solutions[name].top.mean_unavailability == pytest.approx(published, rel=apart)
    plain = json.loads(json.dumps(answer.to_dict(), allow_nan=False))
    urban = plain["environments"]["urban"]
    assert urban["top"]["name"] == "TOP"
    assert urban["events"]["IE1"]["mean_unavailability"] == pytest.approx(8.34e-11, rel=1e-9)
    assert urban["availability"] == pytest.approx(0.99984, abs=1e-5)


def test_one_environment_has_no_level_of_environments() -> None:
    answer = depend(load_any("galoroi", environment="urban").models)
    assert set(answer.to_dict()) >= {"top", "events", "findings"}
    assert answer.to_dict()["top"]["at_least_once"] is None


def test_simulation_agrees_and_its_seed_repeats(galoroi: dict[str, HybridFaultTree]) -> None:
    short = dataclasses.replace(galoroi["woody"], mission_s=120.0)
    first, again = (depend(short, first_passage=True, simulate=20_000, seed=4) for _ in range(2))
    assert first.agrees
    assert first.to_dict() == again.to_dict()
    (agreement,) = first.agreements.values()
    assert sum(c.verdict == "agrees" for c in agreement.comparisons) >= 10


def test_simulation_of_one_component_without_repair_agrees() -> None:
    """Nearly every forced history fails: what was not forced is no part of the comparison."""
    model = HybridFaultTree(
        "one", 1.0, 3600.0, (Component("c", 1e-3),), (), (Failed("f", "c"),), (), "f"
    )
    answer = depend(model, first_passage=True, simulate=20_000)
    assert answer.agrees
    # 1 - exp(-1e-3) over 3600 epochs of a second.
    once = answer.solutions["one"].top.at_least_once
    assert once == pytest.approx(-math.expm1(-1e-3), rel=1e-12)


def test_gates_nested_too_deeply_are_refused_in_words() -> None:
    gates = tuple(Or(f"g{i}", (f"g{i + 1}",)) for i in range(5000))
    deep = HybridFaultTree(
        "deep", 1.0, 10.0, (Component("c", 1e-3),), (), (Failed("f", "c"),),
        (*gates, Or("g5000", ("f",))), "g0",
    )  # fmt: skip
    with pytest.raises(InputError, match="nested too deeply"):
        depend(deep)


def test_rates_beyond_any_hardware_are_refused() -> None:
    model = HybridFaultTree(
        "fast", 1.0, 10.0, (Component("c", 1e308, 1e308),), (), (Failed("f", "c"),), (), "f"
    )
    with pytest.raises(ModelError, match="out of range"):
        depend(model)


def test_fixed_probabilities_hold_throughout() -> None:
    tree = StaticTree(
        "two", (BasicEvent("a", 1e-9), BasicEvent("b", 1e-12)),
        (StaticGate("top", "or", ("a", "b")),), "top",
    )  # fmt: skip
    plain = static_answer(tree)
    exact = 1e-9 + 1e-12 - 1e-21
    for key in ("mean_unavailability", "at_end", "at_least_once"):
        assert plain["top"][key] == pytest.approx(exact, rel=1e-15)
        assert plain["events"]["b"][key] == 1e-12


def test_a_recording_takes_the_place_of_the_receiver(
    galoroi: dict[str, HybridFaultTree], states: ReceiverStates
) -> None:
    urban = galoroi["urban"]
    model = with_receiver(urban, states, estimate="posterior")
    (old,), (new,) = urban.sources, model.sources
    assert (new.name, new.guard, new.down, new.first_fix_s) == (
        old.name, old.guard, old.down, old.first_fix_s,
    )  # fmt: skip
    i, j = states.chain.counts[0][:2]
    total = sum(states.chain.counts[0])
    # Mean of the Dirichlet law with 1/2 added to each of three counts.
    assert new.rows[0][:2] == pytest.approx(((i + 0.5) / (total + 1.5), (j + 0.5) / (total + 1.5)))
    assert not any("calibrated" in note for note in model.notes)
    assert "urban" not in model.name
    assert depend(model).solutions[model.name].top.mean_unavailability > 0


def test_a_semi_markov_receiver_says_how_long_the_longest_runs_were() -> None:
    found = sbas.receiver_states(_three_states(), truth=TRUTH, threshold_m=5.0)
    model = with_receiver(load_any("galoroi").models["urban"], found, semi_markov=True)
    (note,) = (n for n in model.notes if "longest runs" in n)
    assert "wrong 3" in note
    assert "missing 2" in note
    # No run of six wrong epochs was seen: CON 6 cannot become true, and the note says so.
    answer = depend(model).solutions[model.name]
    assert answer.rows["IE5"].mean_unavailability == 0.0


def _three_states() -> Recording:
    """Correct but for runs of 1 to 3 wrong epochs and of 1 to 2 without a position."""
    recording = synthetic_recording(1200)
    latitude = np.full(1200, TRUTH.lat_deg)
    for k, start in enumerate(range(20, 1180, 20)):
        latitude[start : start + 1 + k % 3] += 1e-3
        latitude[start + 10 : start + 11 + k % 2] = np.nan
    table = recording.table.assign(lat_deg=latitude, lon_deg=TRUTH.lon_deg)
    return recording.replace(table=table)


def test_states_pass_through_json(states: ReceiverStates) -> None:
    again = ReceiverStates.from_dict(json.loads(json.dumps(states.to_dict())))
    assert again.chain.counts == states.chain.counts
    assert again.to_dict() == states.to_dict()


def test_a_state_never_seen_and_another_step_are_refused(
    galoroi: dict[str, HybridFaultTree], states: ReceiverStates
) -> None:
    with pytest.raises(InputError, match="missing"):
        with_receiver(galoroi["urban"], states)
    slow = dataclasses.replace(galoroi["urban"], step_s=2.0)
    with pytest.raises(InputError, match="step"):
        with_receiver(slow, states, estimate="posterior")
    with pytest.raises(InputError, match="no single source"):
        with_receiver(dataclasses.replace(galoroi["urban"], sources=()), states)
