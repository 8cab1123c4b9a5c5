"""The slot simulation against closed forms, the check set and every history of small models."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from sbas.dependability.simulation.agreement import agreement
from sbas.dependability.simulation.slot_simulation import simulate_model
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Con,
    Dur,
    Failed,
    HybridFaultTree,
    InState,
    MarkovSource,
    Options,
    Or,
    Undeveloped,
)
from sbas.exceptions import InputError
from tests.dependability.paper_models import check_unit, localisation_unit
from tests.dependability.path_enumeration import by_paths, random_model

CHECK_SET = {
    "IE1": (0.0198948915, 0.0251467251, 0.5113853807, 4.0656164),
    "IE2": (0.1598464517, 0.1877105205, 0.9182663815, 2.0895146),
    "IE5": (0.0347991524, 0.0336791338, 0.9999005258, 56.4160888),
    "IE6": (0.0113802117, 0.0130658610, 0.5029835723, 18.4881251),
    "BE1": (0.0527592647, 0.0623961527, 0.3294565926, 0.3785666),
    "BE2": (0.1003816068, 0.1175160265, 0.5503715277, 0.7190415),
    "B": (0.1626304541, 0.1909083977, 0.9592676203, 5.8355406),
    "C": (0.0427527765, 0.0428083586, 0.9999027860, 69.3281439),
    "TOP": (0.2466654844, 0.2815298826, 1.0, 71.4747344),
}
"""Mean, point at 1 h, F, W of the method page, section 10.3."""

Z = 4.2
"""The page's limit for 36 figures: Phi^-1(1 - 0.0005/36)."""


def near(value: float, error: float, exact: float) -> bool:
    return abs(value - exact) <= Z * max(error, 1e-6 * abs(exact))


def hardware(*components: Component, gates: tuple = (), **changes) -> HybridFaultTree:  # type: ignore
    events = tuple(Failed(f"{c.name} failed", c.name) for c in components)
    fields = {"top": events[0].name, "mission_s": 3600.0, **changes}
    return HybridFaultTree("hardware", 1.0, sources=(), components=components, events=events,
                           gates=gates, **fields)  # fmt: skip


def test_check_set_of_the_method_page() -> None:
    simulation = simulate_model(check_unit(), histories=4000, rng=np.random.default_rng(1))
    for name, (mean, at_end, passage, occurrences) in CHECK_SET.items():
        row = simulation.row(name)
        assert near(row.mean, row.mean_se, mean), name
        assert near(row.at_end, row.at_end_se, at_end), name
        assert near(row.occurrences, row.occurrences_se, occurrences), name
        if passage < 0.99:
            assert near(row.first_passage, row.first_passage_se, passage), name
        else:
            assert 4000 * (1 - row.first_passage) <= 6  # 0.4 expected
    correct = simulation.row("correct output")
    assert near(correct.mean, correct.mean_se, 0.5030784347)


@pytest.mark.parametrize("rule", ["epochs", "left", "trapezoid"])
def test_hardware_follows_its_closed_form(rule: str) -> None:
    alpha, mu, hours = 0.7, 2.0, 1.0
    model = hardware(Component("c", alpha, mu), options=Options(mean_rule=rule))  # type: ignore
    row = simulate_model(model, histories=20_000, rng=np.random.default_rng(2)).row("c failed")
    t = np.arange(3601) / 3600.0
    p = alpha / (alpha + mu) * -np.expm1(-(alpha + mu) * t)
    mean = {"epochs": p[1:], "left": p[:-1], "trapezoid": (p[1:] + p[:-1]) / 2}[rule].mean()
    assert near(row.mean, row.mean_se, mean)
    assert near(row.at_end, row.at_end_se, p[-1])
    # The first failure is seen unless it is repaired within its epoch: 3e-4 of them.
    assert near(row.first_passage, row.first_passage_se + 1e-4, -math.expm1(-alpha * hours))


def test_a_component_may_be_failed_at_the_start() -> None:
    model = hardware(Component("c", 0.0, 1.5, 0.4))
    row = simulate_model(model, histories=20_000, rng=np.random.default_rng(3)).row("c failed")
    assert near(row.at_end, row.at_end_se, 0.4 * math.exp(-1.5))
    assert row.occurrences == 0.0


def test_micro_model_of_the_method_page() -> None:
    def source(name: str, fail: float, repair: float) -> MarkovSource:
        rows = ((1 - fail, fail), (repair, 1 - repair))
        return MarkovSource(name, ("up", "failed"), rows, (1.0, 0.0))

    model = HybridFaultTree(
        "micro", 1.0, 50.0, (), (source("a", 0.02, 0.3), source("b", 0.05, 0.4)),
        (InState("ea", "a", ("failed",)), InState("eb", "b", ("failed",))),
        (Dur("da", 2.0, "ea"), Con("cb", 2, "eb"), Or("t", ("da", "cb"))), "t",
    )  # fmt: skip
    simulation = simulate_model(model, histories=100_000, rng=np.random.default_rng(4))
    for name, mean in (("da", 0.0280984375), ("cb", 0.0637037037), ("t", 0.0899429435)):
        assert near(simulation.row(name).mean, simulation.row(name).mean_se, mean)
    top = simulation.row("t")
    assert near(top.first_passage, top.first_passage_se, 0.8546483909)
    assert near(top.occurrences, top.occurrences_se, 1.6797117580)


@pytest.mark.parametrize("seed", range(0, 200, 8))
def test_random_models_against_every_history(seed: int) -> None:
    model = random_model(seed)
    rule = ("epochs", "left", "trapezoid")[seed % 3]
    model = replace(model, options=replace(model.options, mean_rule=rule))  # type: ignore
    exact = {}
    for name, paths in by_paths(model).items():
        left, right = paths.on[:-1], paths.on[1:]
        mean = {"epochs": right, "left": left, "trapezoid": (left + right) / 2}[rule].mean()
        exact[name] = (float(mean), paths.once)
    simulation = simulate_model(model, histories=10_000, rng=np.random.default_rng(seed))
    found = agreement(exact, simulation)
    assert [c for c in found.comparisons if c.verdict == "disagrees"] == []
    for name, paths in by_paths(model).items():
        row = simulation.row(name)
        assert abs(row.occurrences - paths.occurrences) <= 5 * row.occurrences_se + 1e-3


def test_forced_failures_against_the_closed_form() -> None:
    a, b, c = (Component(name, rate) for name, rate in (("a", 1e-7), ("b", 3e-6), ("c", 2e-8)))
    gates = (And("all", ("a failed", "b failed", "c failed")),
             AtLeast("two", 2, ("a failed", "b failed", "c failed")))  # fmt: skip
    model = hardware(a, b, c, gates=gates)
    simulation = simulate_model(model, histories=8000, rng=np.random.default_rng(5))
    pa, pb, pc = (-math.expm1(-x.failure_rate_per_h) for x in (a, b, c))
    assert simulation.row("all").at_end == pytest.approx(pa * pb * pc, rel=1e-9)
    two = pa * pb * (1 - pc) + pa * (1 - pb) * pc + (1 - pa) * pb * pc + pa * pb * pc
    assert simulation.row("two").at_end == pytest.approx(two, rel=1e-9)
    # Without repair P(all at t) is a product of t nearly uniform times: mean about 1/4 of F.
    t = np.arange(1, 3601)
    p = np.prod([-np.expm1(-x.failure_rate_per_h * t / 3600) for x in (a, b, c)], axis=0)
    row = simulation.row("all")
    assert near(row.mean, row.mean_se, p.mean())
    assert 0.0 < row.mean_se < 0.1 * row.mean


def test_rare_rows_of_the_paper_are_seen_with_forced_failures() -> None:
    force = [("ecs",), ("ecs", "antenna"), ("ecs", "receiver")]
    simulation = simulate_model(
        localisation_unit(), histories=9000, rng=np.random.default_rng(6), force=force
    )
    ie1, ie6 = simulation.row("IE1"), simulation.row("IE6")
    assert near(ie1.mean, ie1.mean_se, 8.34e-11)  # Table II, calibrated rows
    assert near(ie6.mean, ie6.mean_se, 1.63e-8)
    assert ie1.mean_se < 0.08 * ie1.mean
    # Left out is only the set of all three: 2e-6 * 4e-6 * 4.08e-6.
    assert ie1.unsampled == pytest.approx(3.264e-17, rel=1e-4)
    assert simulation.row("IE2").unsampled == pytest.approx(1.0, rel=1e-5)


def test_undeveloped_events_are_drawn_once_and_held() -> None:
    model = replace(
        hardware(Component("c", 1.0)), events=(Failed("f", "c"), Undeveloped("u", 0.3)), top="f"
    )
    row = simulate_model(model, histories=20_000, rng=np.random.default_rng(7)).row("u")
    assert row.mean == row.first_passage == row.at_end
    assert near(row.mean, row.mean_se, 0.3)
    assert row.occurrences == 0.0


def test_one_seed_gives_one_result() -> None:
    def run(seed: int) -> float:
        rng = np.random.default_rng(seed)
        return simulate_model(check_unit(), histories=200, rng=rng).row("TOP").mean

    assert run(8) == run(8)
    assert run(8) != run(9)


def test_what_it_cannot_read_is_refused() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="reads hardware at the epochs"):
        simulate_model(check_unit(options=Options(mean_rule="integral")), histories=100, rng=rng)
    with pytest.raises(InputError, match="2 histories"):
        simulate_model(check_unit(), histories=1, rng=rng)
