"""Extremal index and clusters against the estimator by hand and a process with a known index."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.exposure.extremal_clusters import (
    clustered_risk,
    exceedance_positions,
    ferro_segers_clusters,
    ferro_segers_index,
    run_clusters,
)
from sbas.integrity.exposure.gauss_markov_sampled import extremal_index, sampled_risk
from sbas.integrity.k_factors import exceedance

EXAMPLE = [10, 11, 13, 50, 52, 200]


def test_check_value_with_a_tie_at_the_cut() -> None:
    # Gaps 1 2 37 2 148: 2 * 185^2 / (5 * 22722); ceil(0.6025 * 6) = 4, a tie lowers it to 3.
    assert ferro_segers_index(EXAMPLE) == pytest.approx(0.602500, rel=1e-6)
    clusters = ferro_segers_clusters(EXAMPLE)
    assert clusters.count == 3
    assert list(zip(clusters.first, clusters.last, strict=True)) == [(10, 13), (50, 52), (200, 200)]


def test_few_exceedances() -> None:
    assert ferro_segers_clusters([]).count == 0
    assert ferro_segers_clusters([7]).count == 1
    assert ferro_segers_clusters([7, 8, 10, 11]).count == 1
    assert ferro_segers_clusters([7, 1000]).count == 2
    # All gaps 1: 2 (sum T)^2/(n sum T^2) = 2, capped.
    assert ferro_segers_index([1, 2, 3, 4]) == 1.0
    with pytest.raises(InputError, match="two exceedances"):
        ferro_segers_index([5])


def test_runs_merge_up_to_the_merge_time() -> None:
    # Methods page, section 9: bad 3-5, 10, 12, 13, 30-36, merge time 3 steps.
    bad = [3, 4, 5, 10, 12, 13, *range(30, 37)]
    raw = run_clusters(bad, merge_samples=0)
    assert list(raw.first) == [3, 10, 12, 30]
    assert list(raw.last) == [5, 10, 13, 36]
    merged = run_clusters(bad, merge_samples=3)
    assert list(merged.first) == [3, 10, 30]
    assert list(merged.last) == [5, 13, 36]
    assert run_clusters(bad, merge_samples=4).count == 2
    assert run_clusters([], merge_samples=3).count == 0


def test_positions_count_ties_and_pass_over_missing() -> None:
    errors = [1, 5, math.nan, 6, 4.999, math.inf]
    assert list(exceedance_positions(errors, level=5)) == [1, 3, 5]


@given(st.lists(st.integers(1, 400), min_size=0, max_size=60), st.floats(0, 500))
def test_clusters_partition_the_exceedances(gaps: list[int], merge: float) -> None:
    at = np.cumsum([0, *gaps])
    for clusters in (ferro_segers_clusters(at), run_clusters(at, merge_samples=merge)):
        assert 1 <= clusters.count <= at.size
        assert clusters.first[0] == at[0]
        assert clusters.last[-1] == at[-1]
        assert np.all(clusters.first <= clusters.last)
        assert np.all(clusters.first[1:] > clusters.last[:-1])


@pytest.mark.parametrize("theta", [0.25, 0.5])
def test_index_of_a_moving_maximum(theta: float) -> None:
    """max of m independent values in a row has the extremal index 1/m exactly."""
    rng = np.random.default_rng(11)
    m, n = round(1 / theta), 200_000
    values = np.lib.stride_tricks.sliding_window_view(rng.random(n), m).max(axis=1)
    at = exceedance_positions(values, level=1 - 0.002)
    clusters = ferro_segers_clusters(at)
    # About 400 clusters: standard error about 5 %.
    assert ferro_segers_index(at) == pytest.approx(theta, rel=0.15)
    assert clusters.count == pytest.approx(n * 0.002, rel=0.25)


def test_index_of_a_gauss_markov_record_against_the_quadrature() -> None:
    rng = np.random.default_rng(4)
    correlation, n, k = math.exp(-1 / 20), 400_000, 3.0
    noise = math.sqrt(1 - correlation**2) * rng.standard_normal((n, 2))
    error = np.empty((n, 2))
    state = rng.standard_normal(2)
    for i in range(n):
        state = correlation * state + noise[i]
        error[i] = state
    at = exceedance_positions(np.hypot(error[:, 0], error[:, 1]), level=k)
    exact = extremal_index(k, correlation=correlation)
    # About 600 clusters; the estimator is known to be high at finite levels.
    assert 0.9 * exact < ferro_segers_index(at) < 1.35 * exact


def test_clustered_risk_carries_a_sample_to_an_exposure() -> None:
    k, correlation = 6.182851757, math.exp(-1 / 360)
    theta = extremal_index(k, correlation=correlation)
    p = exceedance(k)
    risk = clustered_risk(p, theta=theta, samples=3600)
    # The index leaves out the start: low by about one sample's risk.
    exact = sampled_risk(k, correlation=correlation, samples=3600)
    assert 0 < exact / p - risk / p < 1.5
    assert clustered_risk(p, theta=1, samples=10) == pytest.approx(5e-8, rel=1e-7)
    assert clustered_risk(p, theta=0.1, samples=1) == pytest.approx(p, rel=1e-12)


@pytest.mark.parametrize("bad", [[3, 3], [5, 4], [1.5, 2.5], [[1, 2]]])
def test_positions_that_are_none(bad: list[float]) -> None:
    with pytest.raises(InputError, match="positions"):
        run_clusters(bad, merge_samples=1)


def test_arguments_out_of_range() -> None:
    with pytest.raises(InputError, match="merge_samples"):
        run_clusters([1], merge_samples=-1)
    with pytest.raises(InputError, match="theta"):
        clustered_risk(1e-9, theta=0, samples=10)
    with pytest.raises(InputError, match="level"):
        exceedance_positions([1.0], level=math.nan)
    with pytest.raises(InputError, match="series"):
        exceedance_positions([[1.0]], level=1)
