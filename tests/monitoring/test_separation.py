from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.normal_equations import geometry, ranges
from sbas.monitoring.separation import (
    SeparationBudget,
    separation_factors,
    separation_level_m,
)
from tests.monitoring.skies import design_of, random_sky, refit, sky

UP = np.array([0.0, 0.0, 1.0])


def tail_quantile(p: float) -> float:
    with mp.workdps(40):
        return float(mp.sqrt(2) * mp.erfinv(1 - 2 * mp.mpf(p)))


def test_factors_share_the_budget_equally() -> None:
    budget = SeparationBudget(risk=1e-7, false_alarm=1e-3, prior=1e-4)
    k = separation_factors(budget, np.array([8]), 1)
    assert k.fault_free[0] == pytest.approx(tail_quantile(1e-7 / 4), rel=1e-10)
    assert k.alarm[0] == pytest.approx(tail_quantile(1e-3 / 16), rel=1e-10)
    assert k.missed[0] == pytest.approx(tail_quantile(1e-7 / 2 / (8 * 1e-4)), rel=1e-10)
    two = separation_factors(budget, np.array([8]), 2)
    assert two.alarm[0] == pytest.approx(tail_quantile(1e-3 / 32), rel=1e-10)
    assert two.missed[0] == pytest.approx(tail_quantile(1e-7 / 4 / (8 * 1e-4)), rel=1e-10)


def test_a_level_is_that_of_refits_without_each_range() -> None:
    rng = np.random.default_rng(6)
    elevation, azimuth, sigma = random_sky(rng, 7, 10)
    budget = SeparationBudget(1e-7, 1e-3, 1e-4)
    level = separation_level_m(geometry(ranges(elevation, azimuth, sigma)), UP, budget, 1)
    k_ff, k_fa = tail_quantile(1e-7 / 4), tail_quantile(1e-3 / 14)
    k_md = tail_quantile(1e-7 / 2 / (7 * 1e-4))
    for t in range(10):
        y = np.zeros(7)
        rows = design_of(elevation[:, t], azimuth[:, t], np.zeros(7))
        whole = refit(rows, sigma[:, t], y)[2][2, 2]
        worst = k_ff * np.sqrt(whole)
        for i in range(7):
            keep = np.arange(7) != i
            part = refit(rows[keep], sigma[keep, t], y[keep])[2][2, 2]
            worst = max(worst, k_fa * np.sqrt(part - whole) + k_md * np.sqrt(part))
        assert level[t] == pytest.approx(worst, rel=1e-7)


def test_the_stated_risk_is_kept_with_a_fault_of_any_size() -> None:
    """Given a fault, an error beyond the level without an alarm is rarer than its share."""
    rng = np.random.default_rng(10)
    elevation, azimuth, sigma = (v[:, [0]] for v in random_sky(rng, 7, 1))
    budget = SeparationBudget(risk=2e-3, false_alarm=1e-2, prior=0.05)
    g = geometry(ranges(elevation, azimuth, sigma))
    level = separation_level_m(g, UP, budget, 1)[0]
    k = separation_factors(budget, np.array([7]), 1)
    share = budget.risk / 2 / 7 / budget.prior
    n = 200_000
    noise = rng.standard_normal((7, n)) * sigma
    for i in range(7):
        for shift in (0.0, 3.0, 5.0, 7.0, 9.0):
            y = noise.copy()
            y[i] += shift * sigma[i, 0] / np.sqrt(g.redundancy[i, 0])
            up = (g.gain[2] * y).sum(axis=0)
            keep = np.arange(7) != i
            reduced = geometry(ranges(elevation[keep], azimuth[keep], sigma[keep]))
            other = (reduced.gain[2] * y[keep]).sum(axis=0)
            separation = np.sqrt(reduced.covariance[5] - g.covariance[5])
            silent = np.abs(up - other) <= k.alarm * separation
            rate = (silent & (np.abs(up) > level)).mean()
            # The level takes one tail of the reduced fix; the other one adds next to nothing.
            assert rate <= share + 4 * np.sqrt(share / n)


def test_faults_that_would_not_show_leave_no_finite_level() -> None:
    budget = SeparationBudget()
    assert np.isinf(separation_level_m(geometry(sky("A")), UP, budget, 1)[0])
    four = geometry(ranges(*random_sky(np.random.default_rng(0), 4, 1)))
    assert np.isnan(separation_level_m(four, UP, budget, 1)[0])


def test_two_faults_are_counted_by_their_pairs() -> None:
    assert SeparationBudget(prior=1e-5).two_faults(10) == pytest.approx(45e-10)
    assert SeparationBudget().two_faults(1) == 0


@pytest.mark.parametrize("wrong", [{"risk": 0.0}, {"prior": 1.0}, {"false_alarm": -1e-3}])
def test_what_is_no_probability_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError):
        SeparationBudget(**wrong)
