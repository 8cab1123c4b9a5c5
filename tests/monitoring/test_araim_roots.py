"""The level equation: exact roots, the fixed point, jumps, and probabilities down to 1e-15."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.monitoring.araim_roots import TOLERANCE_M, level_of_risk, risk_of_level
from tests.monitoring.araim_reference import quantile, tail

Case = tuple[np.ndarray, ...]


def draw(seed: int, rows: int = 40, modes: int = 9) -> Case:
    """Budgets 1e-15..1e-2 and priors 1e-15..1e-2, some of them absent."""
    rng = np.random.default_rng(seed)
    budget = 10.0 ** rng.uniform(-15, -2, rows)
    prior = 10.0 ** rng.uniform(-15, -2, (modes, rows)) * (rng.random((modes, rows)) < 0.8)
    offset = rng.uniform(0, 40, (modes, rows))
    sigma = 10.0 ** rng.uniform(-1, 1.5, (modes, rows))
    return budget, rng.uniform(0.3, 4, rows), rng.uniform(0, 3, rows), prior, offset, sigma


def exact_risk(level: object, row: int, case: Case) -> mp.mpf:
    _, sigma_0, bias_0, prior, offset, sigma = case
    level = mp.mpf(level)
    total = 2 * tail((level - mp.mpf(bias_0[row])) / mp.mpf(sigma_0[row]))
    for k in range(len(prior)):
        u = (level - mp.mpf(offset[k, row])) / mp.mpf(sigma[k, row])
        total += mp.mpf(prior[k, row]) * (tail(u) if u > 0 else 1)
    return total


def test_risk_agrees_with_thirty_digits_down_to_its_smallest_terms() -> None:
    case = draw(1)
    level = np.linspace(1.0, 90.0, 40)
    found = risk_of_level(level, *case[1:])
    for row in range(40):
        # The tail at u loses about u^2 ulp to the rounding of u itself.
        assert found[row] == pytest.approx(float(exact_risk(level[row], row, case)), rel=3e-12)


def test_levels_are_the_exact_roots_rounded_up() -> None:
    case = draw(2)
    found = level_of_risk(*case)
    for row in range(40):
        low, high = mp.mpf(found[row]) - 1, mp.mpf(found[row]) + 1
        assert exact_risk(low, row, case) > case[0][row] > exact_risk(high, row, case)
        for _ in range(50):
            middle = (low + high) / 2
            above = exact_risk(middle, row, case) > mp.mpf(case[0][row])
            low, high = (middle, high) if above else (low, middle)
        assert -1e-12 * found[row] <= found[row] - float(high) <= TOLERANCE_M


@given(st.integers(0, 10**6))
def test_fixed_point(seed: int) -> None:
    case = draw(seed)
    level = level_of_risk(*case)
    plain = (case[3] > 0).sum(axis=0) == 0
    risk = risk_of_level(level, *case[1:])
    assert (risk[~plain] <= case[0][~plain]).all()
    assert risk[plain] == pytest.approx(case[0][plain], rel=1e-12)
    below = risk_of_level(level - 1.01 * TOLERANCE_M, *case[1:])
    assert (below[~plain] > case[0][~plain]).all()


@given(st.integers(0, 10**6), st.floats(1.0, 3.0))
def test_levels_grow_with_everything_that_is_worse(seed: int, factor: float) -> None:
    budget, sigma_0, bias_0, prior, offset, sigma = draw(seed)
    first = level_of_risk(budget, sigma_0, bias_0, prior, offset, sigma)
    worse = (
        (budget / factor, sigma_0, bias_0, prior, offset, sigma),
        (budget, sigma_0 * factor, bias_0, prior, offset, sigma),
        (budget, sigma_0, bias_0 * factor, prior, offset, sigma),
        (budget, sigma_0, bias_0, prior * factor, offset, sigma),
        (budget, sigma_0, bias_0, prior, offset * factor, sigma),
        (budget, sigma_0, bias_0, prior, offset, sigma * factor),
    )
    for case in worse:
        assert (level_of_risk(*case) >= first - TOLERANCE_M).all()


@given(st.integers(0, 10**6), st.floats(0.1, 100.0))
def test_levels_scale_with_lengths(seed: int, factor: float) -> None:
    budget, sigma_0, bias_0, prior, offset, sigma = draw(seed)
    first = level_of_risk(budget, sigma_0, bias_0, prior, offset, sigma)
    scaled = level_of_risk(
        budget, sigma_0 * factor, bias_0 * factor, prior, offset * factor, sigma * factor
    )
    # Each of the two is rounded up on its own.
    assert np.abs(scaled - factor * first).max() <= (1 + factor) * TOLERANCE_M + 1e-11 * factor


@pytest.mark.parametrize("budget", [1e-15, 1e-9, 1e-3, 0.3])
def test_without_modes_the_closed_form(budget: float) -> None:
    none = np.zeros((3, 1)), np.zeros((3, 1)), np.ones((3, 1))
    found = level_of_risk(np.array([budget]), np.array([1.7]), np.array([0.4]), *none)
    exact = mp.mpf(0.4) + mp.mpf(1.7) * quantile(mp.mpf(budget) / 2)
    assert found[0] == pytest.approx(float(exact), abs=1e-13)
    empty = np.empty((0, 1))
    assert level_of_risk(
        np.array([budget]), np.array([1.7]), np.array([0.4]), empty, empty, empty
    ) == pytest.approx(found)


def test_a_jump_gives_its_upper_side() -> None:
    # One mode of prior 1e-3 at 30 m: its share falls from 1e-3 to 5e-4 there, across the budget.
    found = level_of_risk(
        np.array([8e-4]), np.array([1.0]), np.array([0.0]),
        np.array([[1e-3]]), np.array([[30.0]]), np.array([[2.0]]),
    )  # fmt: skip
    assert 30.0 < found[0] <= 30.0 + TOLERANCE_M


def test_a_prior_that_equals_the_budget_does_not_stop_at_its_offset() -> None:
    found = level_of_risk(
        np.array([1e-3]), np.array([1.0]), np.array([0.0]),
        np.array([[1e-3]]), np.array([[30.0]]), np.array([[2.0]]),
    )  # fmt: skip
    # Below 30 m the mode takes 1e-3 and the fix a little more: the sum fits only beyond.
    assert 30.0 < found[0] <= 30.0 + TOLERANCE_M


def test_no_budget_no_level() -> None:
    case = draw(5, rows=3)
    found = level_of_risk(np.array([0.0, -1.0, 1e-7]), *case[1:])
    assert np.isinf(found).tolist() == [True, True, False]


def test_rows_do_not_depend_on_each_other_but_for_the_tolerance() -> None:
    case = draw(6, rows=60)
    together = level_of_risk(*case)
    for row in range(60):
        alone = level_of_risk(*(part[..., row : row + 1] for part in case))
        assert alone[0] == pytest.approx(together[row], abs=TOLERANCE_M)


@pytest.mark.parametrize("bias", [1e9, 1e11, 1e13, 1e300, np.inf])
def test_biases_beyond_all_sense_are_bounded_or_have_no_level(bias: float) -> None:
    budget, sigma_0, bias_0, prior, offset, sigma = draw(8)
    found = level_of_risk(budget, sigma_0, bias_0, prior, offset + bias, sigma)
    # A mode rarer than the budget may be left out of the level; the others contain the bias.
    large = (prior > budget).any(axis=0)
    assert large.any()
    assert (found[large] > bias if bias < 1e12 else np.isinf(found[large])).all()
    plain = level_of_risk(budget, sigma_0, bias_0 + bias, np.zeros_like(prior), offset, sigma)
    assert (plain >= bias if bias < 1e12 else np.isinf(plain)).all()


def test_huge_lengths_end_as_well() -> None:
    budget, sigma_0, bias_0, prior, offset, sigma = draw(7)
    found = level_of_risk(budget, 1e9 * sigma_0, bias_0, prior, 1e9 * offset, 1e9 * sigma)
    small = level_of_risk(budget, sigma_0, 1e-9 * bias_0, prior, offset, sigma)
    assert found == pytest.approx(1e9 * small, rel=1e-7)
