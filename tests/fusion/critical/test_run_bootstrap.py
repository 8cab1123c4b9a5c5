"""Intervals of shares over runs: exact binomial bounds, sampling theory, coverage."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.fusion.critical.run_bootstrap import (
    drawn_runs,
    percentile_bounds,
    share_bounds,
    sums_over_runs,
)


def test_samples_are_multinomial_and_the_first_is_what_was_seen() -> None:
    drawn = drawn_runs(400, replicates=3000, seed=3)
    assert drawn.shape == (400, 3001)
    assert np.all(drawn[:, 0] == 1)
    assert np.all(drawn.sum(axis=0, dtype=np.int64) == 400)
    # Of one run: variance 1 - 1/400, and exp(-1)-ish (1 - 1/400)^400 of the samples lack it.
    counts = drawn[:, 1:].astype(float)
    assert counts.var() == pytest.approx(1 - 1 / 400, rel=0.01)
    assert np.mean(counts == 0) == pytest.approx((1 - 1 / 400) ** 400, abs=0.002)
    np.testing.assert_array_equal(drawn, drawn_runs(400, replicates=3000, seed=3))
    assert not np.array_equal(drawn, drawn_runs(400, replicates=3000, seed=4))


def test_fewer_replicates_are_the_first_of_more() -> None:
    few, many = (drawn_runs(50, replicates=n, seed=1) for n in (10, 30))
    np.testing.assert_array_equal(few, many[:, :11])


def test_sums_are_those_of_the_runs_drawn() -> None:
    rng = np.random.default_rng(7)
    weights = drawn_runs(30, replicates=5, seed=0)
    quantity, run, value = (rng.integers(0, top, 200) for top in (3, 30, 9))
    sums = sums_over_runs(quantity, run, value, quantities=4, weights=weights)
    for q in range(4):
        for b in range(6):
            expected = sum(
                v * int(weights[r, b]) for i, r, v in zip(quantity, run, value, strict=True)
                if i == q
            )  # fmt: skip
            assert sums.drawn[q, b] == expected
    part, whole = sums.part_and_whole([0], [0, 1, 2, 3])
    assert part.sum() == value[quantity == 0].sum()
    assert whole.sum() == value.sum()


def test_bounds_are_order_statistics_that_skip_what_is_undefined() -> None:
    values = np.arange(1.0, 1001.0)
    assert percentile_bounds(values) == (25, 976)
    mixed = np.concatenate([values, np.full(500, np.nan)])
    assert percentile_bounds(mixed) == (25, 976)
    assert percentile_bounds(np.array([1.0, np.inf, np.inf])) == (1, np.inf)
    assert np.all(np.isnan(percentile_bounds(np.full(4, np.nan))))


@pytest.mark.parametrize(
    ("hits", "trials", "lower", "upper"),
    [
        # Clopper-Pearson at 95 %; 1 - 0.025^(1/10) and its like are exact, the rest is printed
        # in tables of the binomial law.
        (0, 10, 0.0, 1 - 0.025**0.1),
        (1, 10, 1 - 0.975**0.1, 0.4450),
        (2, 10, 0.0252, 0.5561),
        (4, 20, 0.0573, 0.4366),
        (10, 10, 0.025**0.1, 1.0),
        (19, 20, 0.7513, 0.975 ** (1 / 20)),
    ],
)
def test_few_runs_have_exact_bounds(hits: int, trials: int, lower: float, upper: float) -> None:
    part = (np.arange(trials) < hits).astype(np.int64)
    whole = np.ones(trials, np.int64)
    found = share_bounds(part, whole, np.full(1000, hits / trials))
    assert found == pytest.approx((lower, upper), abs=6e-5)


def test_cases_of_one_run_do_not_count_as_evidence_of_their_own() -> None:
    """No event in 10 runs of 1000 episodes each: the bound is that of 10 trials."""
    whole = np.full(10, 1000, np.int64)
    lower, upper = share_bounds(np.zeros(10, np.int64), whole, np.zeros(1000))
    assert lower == 0
    assert upper == pytest.approx(1 - 0.025**0.1)
    part = np.zeros(10, np.int64)
    part[0] = 900
    lower, upper = share_bounds(part, whole, np.full(1000, 0.09))
    assert lower < 1e-4 < 900 / 10_000 < upper
    assert np.all(np.isnan(share_bounds(part[:0], whole[:0], np.full(10, np.nan))))


def test_clustered_shares_are_held_as_often_as_promised() -> None:
    """Runs with their own probability, Beta(1, 9), of 5 to 15 cases each: the true share is
    0.1. 400 records of 80 runs; the standard error of the coverage is 1.1 %, and percentiles
    of so few runs hold somewhat less than 95 %. Bounds that took cases as independent hold
    about 78 %."""
    rng = np.random.default_rng(11)
    held = naive = 0
    weights = drawn_runs(80, replicates=400, seed=5).astype(float)
    for _ in range(400):
        whole = rng.integers(5, 16, 80)
        part = rng.binomial(whole, rng.beta(1, 9, 80))
        replicates = (part @ weights) / (whole @ weights)
        lower, upper = share_bounds(part, whole, replicates[1:])
        held += lower <= 0.1 <= upper
        share = replicates[0]
        naive += abs(share - 0.1) <= 1.96 * np.sqrt(share * (1 - share) / whole.sum())
    assert 0.90 <= held / 400 <= 0.975
    assert naive / 400 < 0.87
