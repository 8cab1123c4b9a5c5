"""Simulated tails: right in the mean, scattering as correlated records do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.integrity.tails.tail_reference import (
    STATISTICS,
    THRESHOLD,
    _simulate,
    summarise_tail,
    tail_reference,
)


def test_summary_of_exact_exponential_quantiles() -> None:
    """-ln(1 - p) at p = (i + 1/2)/n: quantile -ln 0.05, mean excess 1, shape 0."""
    n = 200_000
    found = summarise_tail(-np.log1p(-(np.arange(n) + 0.5) / n))
    assert found.threshold[THRESHOLD] == pytest.approx(-math.log(0.05), abs=1e-4)
    np.testing.assert_allclose(found.excess, 1.0, atol=2e-3)
    assert found.statistic[STATISTICS.index("shape of the excesses over 95 %")] == pytest.approx(
        0, abs=2e-3
    )
    np.testing.assert_allclose(found.statistic[:3], 0, atol=2e-3)


def test_shape_of_exact_pareto_quantiles() -> None:
    """Generalised Pareto of shape 0.2: the excesses over any threshold have that shape."""
    n, shape = 2_000_000, 0.2
    p = (np.arange(n) + 0.5) / n
    found = summarise_tail(((1 - p) ** -shape - 1) / shape)
    assert found.statistic[5] == pytest.approx(shape, abs=5e-3)


def test_a_tail_without_spread_is_not_finite() -> None:
    assert not np.isfinite(summarise_tail(np.ones(1000)).statistic).all()


def test_single_precision_is_summed_in_double() -> None:
    y = np.random.default_rng(1).exponential(size=1_000_000)
    double, single = summarise_tail(y), summarise_tail(y.astype(np.float32))
    np.testing.assert_allclose(single.excess, double.excess, rtol=1e-6)
    np.testing.assert_allclose(single.statistic, double.statistic, atol=1e-6)
    assert single.statistic.dtype == single.excess.dtype == np.float64


@pytest.mark.parametrize("nugget", [0.0, 0.2])
def test_the_same_length_gives_the_same_digits(nugget: float) -> None:
    """Whatever thread comes first; and the first record is the first that is drawn."""
    first, second = (_simulate.__wrapped__(500, 10, 0.5, nugget) for _ in range(2))
    np.testing.assert_array_equal(first.statistic, second.statistic)
    drawn = np.random.default_rng(20261122).standard_normal((2, 50, 2, 500))
    r, error = math.exp(-1 / 10), drawn[0, 0].copy()
    for i in range(1, 500):
        error[:, i] = r * error[:, i - 1] + math.sqrt(1 - r * r) * drawn[0, 0, :, i]
    error = math.sqrt(1 - nugget) * error + math.sqrt(nugget) * drawn[1, 0]
    y = (error[0] ** 2 + (0.5 * error[1]) ** 2) / 2
    assert first.threshold[0] == pytest.approx(np.sort(y)[[250, 450, 475, 490, 495]])


def test_centre_and_spread_follow_the_length() -> None:
    short, long = (tail_reference(t, per_tau=25.0) for t in (200.0, 20_000.0))
    # ln(-ln 0.05) and ln 1: exact for an exponential; the record's own bias is of order 1/length.
    assert np.median(long.log_threshold) == pytest.approx(math.log(-math.log(0.05)), abs=0.003)
    assert np.median(long.log_excess) == pytest.approx(0.0, abs=0.006)
    # A hundred times as long: a tenth of the deviation.
    assert long.log_excess.std() == pytest.approx(short.log_excess.std() / 10, rel=0.15)


def test_deviation_of_the_threshold_by_the_laguerre_series() -> None:
    """Exact for large lengths: var F_n(u) = tau/T sum A_n^2/n, A_n = e^-u (L_n - L_{n-1})(u).

    The eigenfunctions of the squared size of a Gauss-Markov error are Laguerre polynomials,
    decaying with rates 2 n/tau.
    """
    u, taus = -math.log(0.05), 5000.0
    before, now, total = 1.0, 1 - u, 0.0
    for n in range(1, 4000):
        total += (math.exp(-u) * (now - before)) ** 2 / n
        before, now = now, ((2 * n + 1 - u) * now - n * before) / (n + 1)
    deviation = math.sqrt(total / taus) / 0.05 / u
    reference = tail_reference(taus, per_tau=25.0)
    # 600 records: 3 %, and the shrinking from 400 tau.
    assert reference.log_threshold.std() == pytest.approx(deviation, rel=0.1)


def test_nothing_finite_is_the_worst_misfit() -> None:
    reference = tail_reference(100.0, per_tau=25.0)
    assert reference.misfit(np.full(7, np.nan))[1] == 0.0
    assert reference.misfit(reference.centre)[1] == 1.0
