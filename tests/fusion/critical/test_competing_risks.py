"""Cumulative incidence against a hand case, exact mathematics and a plain loop over times."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.fusion.critical.competing_risks import (
    cumulative_incidence,
    event_time_quantile,
    incidence_of_counts,
    reach_time,
)


def test_the_case_by_hand() -> None:
    """T = 1,1,2,2,3,3, outcomes 1,2,1,0,2,1: F = 1/6, 1/3, 7/12 (fractions by hand)."""
    found = cumulative_incidence(np.array([1, 1, 2, 2, 3, 3]), np.array([1, 2, 1, 0, 2, 1]))
    np.testing.assert_array_equal(found.time, [1, 2, 3])
    np.testing.assert_allclose(found.incidence, [1 / 6, 1 / 3, 7 / 12], rtol=1e-15)
    np.testing.assert_allclose(found.free, [2 / 3, 1 / 2, 0], rtol=1e-15)


outcomes = st.lists(
    st.tuples(st.integers(0, 6), st.integers(0, 2), st.integers(0, 4)), min_size=1, max_size=30
)


@given(outcomes)
def test_equals_the_definition_in_fractions(cases: list[tuple[int, int, int]]) -> None:
    time, outcome, weights = (np.array(column) for column in zip(*cases, strict=True))
    found = cumulative_incidence(time, outcome, weights=weights.astype(float))
    free, reached = Fraction(1), Fraction(0)
    for i, t in enumerate(sorted({t for t, _, _ in cases})):
        n = sum(w for u, _, w in cases if u >= t)
        d1 = sum(w for u, o, w in cases if u == t and o == 1)
        d2 = sum(w for u, o, w in cases if u == t and o == 2)
        if n:
            reached += free * Fraction(d1, n)
            free *= 1 - Fraction(d1 + d2, n)
        assert found.time[i] == t
        assert found.incidence[i] == pytest.approx(float(reached), rel=1e-13, abs=1e-15)
        assert found.free[i] == pytest.approx(float(free), rel=1e-13, abs=1e-15)
    assert 0 <= found.incidence[-1] <= 1 + 1e-12


def test_many_sets_of_weights_are_many_estimates() -> None:
    rng = np.random.default_rng(5)
    time, outcome = rng.integers(1, 9, 50), rng.integers(0, 3, 50)
    weights = rng.poisson(1.0, (50, 7)).astype(float)
    together = cumulative_incidence(time, outcome, weights=weights)
    for b in range(7):
        alone = cumulative_incidence(time, outcome, weights=weights[:, b])
        np.testing.assert_allclose(together.incidence[:, b], alone.incidence, rtol=1e-14)
        repeated = np.repeat(np.arange(50), weights[:, b].astype(int))
        copies = cumulative_incidence(time[repeated], outcome[repeated])
        np.testing.assert_allclose(
            alone.incidence[np.isin(alone.time, copies.time)], copies.incidence, rtol=1e-13
        )


def test_geometric_competition_has_its_closed_form() -> None:
    """Hazards p of the event and q of leaving at each step: F(k) = p (1 - s^k)/(1 - s),
    s = 1 - p - q (exact). Expected counts of a cohort take the place of a sample."""
    p, q, k = 0.03, 0.11, np.arange(1, 40)
    alive = (1 - p - q) ** (k - 1)
    counts = np.stack([np.zeros(k.size), p * alive, q * alive])
    counts[0, -1] = (1 - p - q) ** k[-1]
    incidence, free = incidence_of_counts(counts)
    np.testing.assert_allclose(incidence, p * (1 - (1 - p - q) ** k) / (p + q), rtol=1e-12)
    np.testing.assert_allclose(free, (1 - p - q) ** k, rtol=1e-12)


def test_the_two_quantiles_answer_two_questions() -> None:
    """100 episodes: 4 there at entry; of the other 96, 12 reach the event, the rest leave."""
    time = np.array([1.0, 2.0, 3.0])
    events = np.array([2.0, 4.0, 6.0])
    counts = np.stack([np.zeros(3), events, [20.0, 30.0, 34.0]])
    incidence, _ = incidence_of_counts(counts)
    assert event_time_quantile(time, events, 0.05) == 1
    assert event_time_quantile(time, events, 0.5) == 2
    # 4 + 2, 4 + 6, 4 + 12 of 100 have come by 1, 2, 3 s; nothing was cut, so shares are exact.
    at_entry = np.float64(0.04)
    for p, at in (
        (0.04, 0),
        (0.05, 1),
        (0.06, 1),
        (0.0601, 2),
        (0.10, 2),
        (0.16, 3),
        (0.17, np.inf),
    ):
        assert reach_time(time, incidence, at_entry, p) == at
    assert np.isnan(reach_time(time, incidence, np.float64("nan"), 0.05))
    assert np.isnan(event_time_quantile(time, np.zeros(3), 0.05))


@pytest.mark.parametrize("p", [0.05, 0.1, 0.3, 0.7])
def test_a_quantile_met_exactly_is_not_missed_by_rounding(p: float) -> None:
    for total in range(10, 200, 10):
        events = np.full(total, 1.0)
        expected = np.ceil(Fraction(str(p)) * total)
        assert event_time_quantile(np.arange(1.0, total + 1), events, p) == expected


@pytest.mark.parametrize(
    ("time", "outcome", "weights"),
    [
        ([1, 2], [1], None),
        ([1], [3], None),
        ([-1], [1], None),
        ([np.nan], [1], None),
        ([1], [1], np.array([-1.0])),
        ([1], [1], np.array([1.0, 1.0])),
    ],
)
def test_what_is_no_sample_is_refused(
    time: list[float], outcome: list[int], weights: np.ndarray | None
) -> None:
    with pytest.raises(InputError):
        cumulative_incidence(np.array(time), np.array(outcome), weights=weights)
