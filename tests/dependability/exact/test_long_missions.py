from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf

from sbas.dependability.exact.exact import solve
from sbas.dependability.exact.leaf_courses import Work
from sbas.dependability.exact.long_missions import long_rows, occupation, steady_state
from sbas.dependability.exact.plan import tree_of
from sbas.dependability.tree.model import (
    And,
    CausalAnd,
    Component,
    Dur,
    Failed,
    HybridFaultTree,
    MeanRule,
    Options,
    Or,
    Undeveloped,
)
from sbas.exceptions import InputError
from tests.dependability.paper_models import check_unit, localisation_unit

YEAR_S = 365 * 86400.0


def one_component(
    alpha: float, mu: float, *, mission_s: float, rule: MeanRule = "epochs", dur_s: float = 0.0
) -> HybridFaultTree:
    return HybridFaultTree(
        "one", 1.0, mission_s, (Component("c", alpha, mu),), (), (Failed("e", "c"),),
        (Dur("t", dur_s, "e"),), "t", options=Options(mean_rule=rule),
    )  # fmt: skip


@pytest.mark.parametrize(("alpha", "mu"), [(6.06e-6, 1 / 24), (0.3, 2.0), (2e-9, 0.5), (1e-5, 0.0)])
@pytest.mark.parametrize("rule", ["epochs", "left", "trapezoid", "integral"])
def test_a_year_of_a_component_by_closed_form(alpha: float, mu: float, rule: MeanRule) -> None:
    model = one_component(alpha, mu, mission_s=YEAR_S, rule=rule)
    row = solve(model, names=["e"], first_passage=True).rows["e"]
    with mp.workdps(40):
        a, s, n = mpf(alpha), mpf(alpha) + mpf(mu), int(YEAR_S)
        h = mpf(1) / 3600
        e = mp.exp(-s * h)
        last = a / s * (1 - e**n)
        epochs = a / s * (1 - e * (1 - e**n) / (1 - e) / n)
        means = {
            "epochs": epochs,
            "left": epochs - last / n,
            "trapezoid": epochs - last / 2 / n,
            "integral": a / s * (1 - (1 - mp.exp(-s * n * h)) / (s * n * h)),
        }
        to_failed = a / s * (1 - e)
        occurrences = to_failed * (n - a / s * (n - (1 - e**n) / (1 - e)))
        once = -mp.expm1(n * mp.log1p(-to_failed))
        expected = [float(v) for v in (means[rule], last, occurrences, once)]
    measured = [row.mean_unavailability, row.at_end, row.occurrences, row.at_least_once]
    assert measured == pytest.approx(expected, rel=1e-11, abs=0.0)
    assert row.method == "doubling"


@pytest.mark.parametrize("rule", ["epochs", "left", "trapezoid", "integral"])
def test_doubling_against_a_step_for_each_epoch(rule: MeanRule) -> None:
    unit = check_unit(mission_s=20_000.0)
    unit = replace(unit, options=replace(unit.options, mean_rule=rule))
    stepped = solve(unit).rows
    doubled = long_rows(Work(unit, tree_of(unit), 100_000), list(stepped), passages=False)
    for name, row in stepped.items():
        for measure in ("mean_unavailability", "at_start", "at_end", "occurrences"):
            assert getattr(doubled[name], measure) == pytest.approx(
                getattr(row, measure), rel=1e-11, abs=0.0
            ), (name, measure)


def test_a_hundred_thousand_epochs_and_first_passages() -> None:
    names = ["BE1", "IE6", "C"]
    unit = localisation_unit(mission_s=1e5)
    stepped = solve(unit, names=names, first_passage=True).rows
    doubled = long_rows(Work(unit, tree_of(unit), 100_000), names, passages=True)
    for name in names:
        for measure in ("mean_unavailability", "at_end", "occurrences", "at_least_once"):
            assert getattr(doubled[name], measure) == pytest.approx(
                getattr(stepped[name], measure), rel=1e-11, abs=0.0
            ), (name, measure)


@pytest.mark.parametrize("epochs", [0, 1, 2, 3, 7, 64, 1000])
def test_occupation_by_stepping(epochs: int) -> None:
    rng = np.random.default_rng(4)
    moves = rng.random((5, 5)) ** 6
    moves /= moves.sum(axis=1, keepdims=True)
    law = first = np.array([0.2, 0.0, 0.5, 0.3, 0.0])
    total = np.zeros(5)
    for _ in range(epochs):
        total, law = total + law, law @ moves
    summed, end = occupation(first, moves, epochs)
    np.testing.assert_allclose(summed, total, rtol=1e-12, atol=0.0)
    np.testing.assert_allclose(end, law, rtol=1e-12, atol=0.0)


def test_the_long_run_of_repairable_components() -> None:
    # mu/(alpha + mu) of the time up; a DUR of d epochs: each failure is cut by its first d - 1.
    alpha, mu = 0.02, 0.5
    rows = steady_state(one_component(alpha, mu, mission_s=60.0, dur_s=120.0))
    s = alpha + mu
    to_failed = alpha / s * -np.expm1(-s / 3600.0)
    stay = 1.0 + mu / s * np.expm1(-s / 3600.0)
    assert 1.0 - rows["e"].unavailability == pytest.approx(mu / s, rel=1e-14)
    assert rows["e"].occurrences_per_h == pytest.approx(3600.0 * mu / s * to_failed, rel=1e-13)
    assert rows["t"].unavailability == pytest.approx(alpha / s * stay**120, rel=1e-12)
    assert rows["t"].mean_duration_s == pytest.approx(1.0 / (1.0 - stay), rel=1e-9)


def test_a_long_mission_comes_to_the_long_run() -> None:
    unit = check_unit(mission_s=1e9)
    steady = steady_state(unit)
    for name, row in solve(unit).rows.items():
        assert row.at_end == pytest.approx(steady[name].unavailability, rel=1e-11)
        assert row.mean_unavailability == pytest.approx(steady[name].unavailability, rel=1e-5)
        assert row.occurrences * 3600.0 / 1e9 == pytest.approx(
            steady[name].occurrences_per_h, rel=1e-5
        )


def test_hardware_that_is_never_repaired_ends_failed() -> None:
    rows = steady_state(one_component(1e-5, 0.0, mission_s=60.0))
    assert (rows["e"].unavailability, rows["e"].occurrences_per_h) == (1.0, 0.0)
    assert rows["e"].mean_duration_s is None


def test_refusals() -> None:
    two = HybridFaultTree(
        "two", 1.0, 60.0, (Component("c", 1.0, 1.0),), (),
        (Failed("e", "c"), Undeveloped("u", 0.1)),
        (Or("t", ("e", "u")), And("both", ("e", "u")), CausalAnd("d", 2.0, ("e", "u"))), "t",
    )  # fmt: skip
    with pytest.raises(InputError, match="no stationary law"):
        steady_state(two, ["t"])
    with pytest.raises(InputError, match="nobody"):
        steady_state(two, ["nobody"])
    with pytest.raises(InputError, match="2500 states"):
        solve(localisation_unit(mission_s=YEAR_S), names=["TOP"], first_passage=True)
    with pytest.raises(InputError, match="2500 states"):
        solve(localisation_unit(mission_s=YEAR_S, first_fix_s=1500.0), names=["TOP"])
