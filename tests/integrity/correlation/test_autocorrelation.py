"""Autocorrelation with gaps, against sums over all pairs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.integrity.correlation.autocorrelation import (
    autocorrelation,
    bartlett_sigma,
    lagged_products,
)


def direct(values: np.ndarray, max_lag: int) -> tuple[np.ndarray, np.ndarray]:
    """Sums of products and counts of pairs, pair by pair."""
    known = np.isfinite(values[0])
    sums, pairs = np.zeros((len(values), max_lag + 1)), np.zeros(max_lag + 1, int)
    for lag in range(max_lag + 1):
        for i in range(values.shape[1] - lag):
            if known[i] and known[i + lag]:
                pairs[lag] += 1
                sums[:, lag] += values[:, i] * values[:, i + lag]
    return sums, pairs


@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(20, 150),
    lost=st.sampled_from([0.0, 0.1, 0.6]),
    block=st.sampled_from([32, 64, 1 << 18]),
)
def test_products_and_pairs_equal_the_direct_sum(
    seed: int, n: int, lost: float, block: int
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.standard_normal((2, n))
    values[:, rng.random(n) < lost] = np.nan
    max_lag = min(n // 5, 7)
    products, pairs = lagged_products(values, max_lag, block=block)
    expected, counted = direct(values, max_lag)
    np.testing.assert_allclose(products, expected, rtol=0, atol=1e-10)
    np.testing.assert_array_equal(pairs, counted)


@pytest.mark.parametrize("lost", [0.0, 0.15])
def test_blocks_equal_one_transform(lost: float) -> None:
    rng = np.random.default_rng(4)
    values = np.cumsum(rng.standard_normal((2, 40_000)), axis=1)
    values -= values.mean(axis=1, keepdims=True)
    values[:, rng.random(40_000) < lost] = np.nan
    whole = autocorrelation(values, step_s=1.0, max_lag=900)
    blocks = autocorrelation(values, step_s=1.0, max_lag=900, block=4096)
    np.testing.assert_allclose(blocks.components, whole.components, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(blocks.pairs, whole.pairs)


def test_what_is_left_out_counts_as_missing() -> None:
    rng = np.random.default_rng(5)
    values = rng.standard_normal((2, 500))
    out = rng.random(500) < 0.2
    masked = np.where(out, np.nan, values)
    left_out = autocorrelation(values, step_s=1.0, max_lag=20, leave_out=out)
    missing = autocorrelation(masked, step_s=1.0, max_lag=20)
    np.testing.assert_allclose(left_out.components, missing.components, atol=1e-13)


def test_a_lag_that_gaps_leave_without_pairs_has_no_value() -> None:
    values = np.random.default_rng(6).standard_normal((1, 600))
    values[:, 1::3] = values[:, 2::3] = np.nan
    r = autocorrelation(values, step_s=2.0, max_lag=6)
    np.testing.assert_array_equal(np.isfinite(r.mean), [True, False, False] * 2 + [True])
    np.testing.assert_array_equal(r.lag_s, 2.0 * np.arange(7))


def test_band_is_bartletts_for_a_finely_sampled_process() -> None:
    # Brockwell and Davis, example 7.2.3: AR(1), variance of r(i) over n.
    rho, n = np.exp(-1 / 5000), 10**7
    i = np.array([1, 10, 100, 2500, 5000, 20_000])
    exact = (1 - rho ** (2 * i)) * (1 + rho**2) / (1 - rho**2) - 2 * i * rho ** (2.0 * i)
    sigma = bartlett_sigma(i.astype(float), tau_s=5000.0, length_s=float(n))
    np.testing.assert_allclose(sigma[3:], np.sqrt(exact / n)[3:], rtol=1e-3)
    assert bartlett_sigma(np.zeros(1), tau_s=5.0, length_s=9.0)[0] == 0
    np.testing.assert_allclose(
        bartlett_sigma(np.array([1e9]), tau_s=360.0, length_s=3e5), np.sqrt(360 / 3e5)
    )
