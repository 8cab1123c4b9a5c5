"""Tests of the Markov property: page values, exact small cases, and their rates of rejection."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from sbas.dependability.receiver.markov_tests import (
    MarkovTest,
    order_test,
    pooling_test,
    sojourn_test,
    tail_test,
)
from sbas.estimate import Refusal
from tests.dependability.state_recordings import chain_states


def made(test: MarkovTest | Refusal) -> MarkovTest:
    assert isinstance(test, MarkovTest)
    return test


def triples_of(states: Any) -> Any:
    counts = np.zeros((3, 3, 3), int)
    np.add.at(counts, (states[:-2] - 1, states[1:-1] - 1, states[2:] - 1), 1)
    return counts


def test_order_of_the_page_record() -> None:
    record = np.array([int(c) for c in "1112213331122211131112211333311123311"])
    test = made(order_test(triples_of(record)))
    assert test.statistic == pytest.approx(15.593090743, abs=5e-10)
    # Middle state 2 came from two states and went to two, 3 went to two: 4 + ... as counted below.
    assert test.df == 4 + 2 + 2
    assert "same margins" in test.method


def test_statistics_are_those_of_independent_tables() -> None:
    """scipy's contingency test is the oracle: one table for each middle state."""
    counts = np.random.default_rng(1).integers(20, 60, (3, 3, 3))
    ours = made(order_test(counts))
    peers = [
        stats.chi2_contingency(counts[:, j, :], correction=False, lambda_="log-likelihood")
        for j in range(3)
    ]
    assert ours.statistic == pytest.approx(sum(p.statistic for p in peers), rel=1e-12)
    assert ours.df == sum(p.dof for p in peers) == 12
    assert ours.p == pytest.approx(stats.chi2.sf(ours.statistic, 12), rel=1e-12)
    pooled = made(pooling_test(counts))
    peers = [
        stats.chi2_contingency(counts[:, i, :], correction=False, lambda_="log-likelihood")
        for i in range(3)
    ]
    assert pooled.statistic == pytest.approx(sum(p.statistic for p in peers), rel=1e-12)
    assert pooled.df == 6 * (3 - 1)


def test_a_small_table_has_its_exact_p() -> None:
    """Two by two with fixed margins: Fisher's tables, by the order of their G2."""
    table = np.array([[5, 1], [1, 4]])
    counts = np.zeros((2, 2, 2), int)
    counts[:, 0, :] = table
    test = made(order_test(counts))

    def g2(a: int) -> float:
        t = np.array([[a, 6 - a], [6 - a, a - 1]], float)
        e = t.sum(1, keepdims=True) * t.sum(0) / t.sum()
        return float(2 * sum(x * math.log(x / y) for x, y in zip(t.flat, e.flat, strict=True) if x))

    law = stats.hypergeom(11, 6, 6)
    exact = sum(law.pmf(a) for a in range(1, 7) if g2(a) >= g2(5) - 1e-9)
    assert test.p == pytest.approx(exact, abs=4 * math.sqrt(exact / 9999))


def test_second_order_is_seen_and_first_order_is_not_rejected() -> None:
    first = chain_states(((0.8, 0.1, 0.1), (0.3, 0.5, 0.2), (0.3, 0.2, 0.5)), 20_000, 3)
    assert made(order_test(triples_of(first))).p > 0.01
    doubled = np.repeat(first[::2], 2)
    assert made(order_test(triples_of(doubled))).p < 1e-6


def test_nothing_to_compare() -> None:
    assert isinstance(order_test(np.zeros((3, 3, 3), int)), Refusal)
    assert isinstance(pooling_test(np.zeros((1, 3, 3), int)), Refusal)
    assert isinstance(sojourn_test("wrong", None, (), ()), Refusal)
    assert isinstance(tail_test("wrong", 6, 0.0, 5, (), (), ((1, 5),)), Refusal)


def lengths(values: Any) -> tuple[tuple[int, int], ...]:
    found, counts = np.unique(values, return_counts=True)
    return tuple(zip(found.tolist(), counts.tolist(), strict=True))


def test_sojourn_without_cuts_is_pearsons_test() -> None:
    """Runs 1, 2, .. of 1000, with rooms without end: classes and expected counts by hand."""
    runs = np.random.default_rng(2).geometric(0.5, 1000)
    stay = 1 - runs.size / runs.sum()
    test = made(sojourn_test("wrong", stay, lengths(runs), ((10**6, runs.size),)))
    expected, seen, r = [], [], 1
    while 1000 * stay**r >= 5 and 1000 * (1 - stay) * stay ** (r - 1) >= 5:
        expected.append(1000 * (1 - stay) * stay ** (r - 1))
        seen.append(int(np.sum(runs == r)))
        r += 1
    expected.append(1000 * stay ** (r - 1))
    seen.append(int(np.sum(runs >= r)))
    x2 = sum((o - e) ** 2 / e for o, e in zip(seen, expected, strict=True))
    assert test.df == len(seen) - 2
    assert test.statistic == pytest.approx(x2, rel=1e-9)
    assert test.p == pytest.approx(stats.chi2.sf(x2, len(seen) - 2), rel=1e-9)


def test_cuts_do_not_pass_for_short_runs() -> None:
    """Geometric runs of mean 50, each cut after 1 to 60 epochs: not rejected more than due."""
    rng = np.random.default_rng(4)
    rejected = 0
    for _ in range(200):
        runs, rooms = rng.geometric(0.02, 800), rng.integers(1, 61, 800)
        ended = runs < rooms
        at_risk = int(np.where(ended, runs, rooms - 1).sum())
        stay = 1 - ended.sum() / at_risk
        sojourn = made(sojourn_test("correct", stay, lengths(runs[ended]), lengths(rooms)))
        cut = lengths(rooms[~ended])
        tail = made(
            tail_test("correct", 20, stay, at_risk, lengths(runs[ended]), cut, lengths(rooms))
        )
        rejected += (sojourn.p < 0.05) + (tail.p < 0.05)
    # 400 tests at 5 %: 20 expected, sd 4.4.
    assert 5 <= rejected <= 36


def test_tail_has_the_stated_variance() -> None:
    """z of many records without cuts: mean 0, variance 1."""
    rng = np.random.default_rng(5)
    z = []
    for _ in range(600):
        runs = rng.geometric(0.5, 2000)
        stay = 1 - runs.size / runs.sum()
        test = made(
            tail_test("wrong", 6, stay, int(runs.sum()), lengths(runs), (), ((10**6, runs.size),))
        )
        z.append(test.statistic)
    assert abs(np.mean(z)) < 4 / math.sqrt(600)
    assert abs(np.var(z) - 1) < 4 * math.sqrt(2 / 600)


def test_a_heavy_tail_is_seen_even_if_rare() -> None:
    runs = np.concatenate([np.random.default_rng(6).geometric(0.7, 3000), np.full(20, 12)])
    stay = 1 - runs.size / runs.sum()
    test = made(
        tail_test("wrong", 6, stay, int(runs.sum()), lengths(runs), (), ((10**6, runs.size),))
    )
    assert test.observed is not None
    assert test.expected is not None
    assert test.observed > test.expected
    assert test.p < 1e-3


def test_few_expected_is_the_binomial_law() -> None:
    test = made(tail_test("wrong", 6, 0.3, 100, ((1, 98), (7, 2)), (), ((1000, 100),)))
    law = stats.binom(100, 0.3**5)
    assert test.method == "binomial"
    assert test.p == pytest.approx(2 * law.sf(1), rel=1e-12)
    none = made(tail_test("wrong", 6, 0.3, 100, ((1, 100),), (), ((1000, 100),)))
    assert none.p == 1.0
