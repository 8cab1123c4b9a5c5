"""The rule of agreement: it passes what is right, finds what is wrong, says what it cannot tell."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.dependability.exact.exact import solve
from sbas.dependability.simulation.agreement import agreement, check_by_simulation
from sbas.dependability.simulation.simulation_result import SimulatedRow, Simulation, Stratum
from sbas.dependability.simulation.slot_simulation import simulate_model
from sbas.exceptions import InputError
from tests.dependability.paper_models import check_unit, localisation_unit


def simulated(hits: int, histories: int = 1000, mean: float = 0.25, **changes) -> Simulation:  # type: ignore
    passage = hits / histories
    row = SimulatedRow(
        "row", mean, 0.01, mean, 0.01, passage,
        math.sqrt(passage * (1 - passage) / (histories - 1)), 1.0, 0.1,
        (hits,), (hits,), (0,), (True,), **changes,
    )  # fmt: skip
    return Simulation("made up", "epochs", (Stratum((), (), 1.0, histories),), (row,))


def verdicts(mean: float, passage: float | None, simulation: Simulation) -> list[str]:
    return [c.verdict for c in agreement({"row": (mean, passage)}, simulation).comparisons]


def test_limit_is_that_of_the_rule() -> None:
    # Phi^-1(1 - 0.0005) and Phi^-1(1 - 0.00025): 3.2905, 3.4808 (tables of the normal law).
    one = agreement({"row": (0.25, None)}, simulated(500))
    assert one.limit == pytest.approx(3.2905, abs=1e-4)
    two = agreement({"row": (0.25, 0.5)}, simulated(500))
    assert two.limit == pytest.approx(3.4808, abs=1e-4)
    assert two.agrees


def test_beyond_the_limit_it_disagrees_and_within_it_does_not() -> None:
    assert verdicts(0.25 - 0.0329, None, simulated(500)) == ["agrees"]
    assert verdicts(0.25 - 0.0330, None, simulated(500)) == ["disagrees"]
    assert verdicts(0.25 + 0.0330, None, simulated(500)) == ["disagrees"]


def test_few_hits_test_nothing_but_refute_what_they_exclude() -> None:
    nothing = simulated(0, mean=0.0)
    found = agreement({"row": (1e-5, 1e-4)}, nothing)
    assert [c.verdict for c in found.comparisons] == ["not tested"] * 2
    assert found.comparisons[1].bound == pytest.approx(3.0 / 1000, rel=2e-3)
    assert not found.agrees
    assert verdicts(0.01, 0.3, nothing)[1] == "disagrees"
    assert verdicts(0.01, 0.03, simulated(29, mean=0.01))[1] == "not tested"


def test_a_row_that_always_happens_refutes_a_small_first_passage() -> None:
    always = simulated(1000)
    assert verdicts(0.25, 0.9999, always) == ["agrees", "not tested"]
    assert verdicts(0.25, 0.9, always) == ["agrees", "disagrees"]


def test_what_was_not_drawn_may_explain_a_larger_exact_value_only() -> None:
    assert verdicts(0.35, None, simulated(500, unsampled=0.2)) == ["not tested"]
    assert verdicts(0.15, None, simulated(500, unsampled=0.2)) == ["disagrees"]


def test_exact_solution_agrees_with_the_simulation() -> None:
    model = check_unit(mission_s=600.0)
    found = check_by_simulation(
        model, solve(model, first_passage=True), np.random.default_rng(1), histories=2000
    )
    assert found.agrees
    assert not found.repeated
    assert found.histories == 2000
    assert set(found.summary()["verdict"]) <= {"agrees", "not tested"}


def test_another_model_is_found_out_and_only_after_the_repetition() -> None:
    model, other = check_unit(mission_s=600.0), check_unit(mission_s=600.0, t2_s=11.0)
    found = check_by_simulation(
        model, solve(other, first_passage=True), np.random.default_rng(2), histories=3000
    )
    assert found.repeated
    assert found.histories == 30_000
    wrong = {c.name for c in found.comparisons if c.verdict == "disagrees"}
    assert "IE2" in wrong
    assert not wrong & {"IE1", "IE5", "IE6", "BE1", "BE2"}


def test_rare_rows_of_the_paper_agree_by_forced_failures() -> None:
    model = localisation_unit()
    simulation = simulate_model(model, histories=4000, rng=np.random.default_rng(3))
    # Means of the method page, 10.5; F of the cases on the epoch grid.
    exact = {
        "A": (2.9891698e-6, 6.0599466e-6), "B": (3.8599926e-6, 8.1514077e-6),
        "C": (1.5701615e-4, 0.3222799), "TOP": (1.6386482e-4, 0.3222906),
        "IE1": (8.34e-11, None), "IE6": (1.63e-8, None),
    }  # fmt: skip
    found = agreement(exact, simulation)
    by_key = {(c.name, c.measure): c.verdict for c in found.comparisons}
    assert "disagrees" not in by_key.values()
    assert by_key["IE1", "mean"] == by_key["IE6", "mean"] == by_key["B", "mean"] == "agrees"


def test_nothing_to_compare_is_an_error() -> None:
    with pytest.raises(InputError, match="no row"):
        agreement({}, simulated(500))
