"""Steps of the robust estimator, against exact autocorrelations and plain least squares."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.estimate import Refusal
from sbas.integrity.correlation.autocorrelation import Autocorrelation
from sbas.integrity.correlation.robust_tau import (
    Cleaned,
    block_means,
    clean,
    fit_exponentials,
    fitting_periods,
    longest_lag,
    other_definitions,
)

LAG = np.arange(20_000.0)


def cleaned(values: np.ndarray, step_s: float = 1.0) -> Cleaned:
    result = clean(values.astype(np.float32), step_s)
    assert isinstance(result, Cleaned)
    return result


@pytest.mark.parametrize(("scale", "amplitude"), [(1.0, 1.0), (1 / 1.09, 0.917431)])
def test_fit_of_an_exact_exponential_with_and_without_white_noise(
    scale: float, amplitude: float
) -> None:
    # Method page, section 9: tau 360 and A, for r(0) = 1 and r = scale exp(-t/360) beyond.
    r = scale * np.exp(-LAG / 360)
    r[0] = 1.0
    fit = fit_exponentials(r[None], 1.0)
    assert fit.tau_s[0] == pytest.approx(360, rel=1e-9)
    assert fit.amplitude[0] == pytest.approx(amplitude, rel=1e-6)


def test_fit_runs_from_below_09_to_above_03_and_weights_by_r() -> None:
    rng = np.random.default_rng(1)
    r = np.exp(-LAG[:300] / 60) + 0.02 * rng.standard_normal(300)
    r[0] = 1.0
    first = int(np.argmax(r < 0.9))
    stop = int(np.argmax(r < 0.3))
    part = np.arange(first, stop)
    slope, ordinate = np.polyfit(part, np.log(r[part]), 1, w=r[part])
    fit = fit_exponentials(np.stack([r, r]), 2.0)
    assert (fit.first[0], fit.stop[0]) == (first, stop)
    np.testing.assert_allclose(fit.tau_s, -2.0 / slope, rtol=1e-9)
    np.testing.assert_allclose(fit.amplitude, np.exp(ordinate), rtol=1e-9)


def test_a_correlation_that_never_falls_has_no_tau() -> None:
    r = np.linspace(1, 0.31, 50)
    fit = fit_exponentials(np.stack([r, np.exp(-np.arange(50.0) / 10)]), 1.0)
    assert fit.tau_s[0] == np.inf
    assert np.isnan(fit.amplitude[0])
    assert fit.tau_s[1] == pytest.approx(10)


def test_at_least_five_lags_are_fitted() -> None:
    r = np.exp(-np.arange(50.0) / 1.5)
    fit = fit_exponentials(r[None], 1.0)
    assert fit.stop[0] - fit.first[0] == 5
    assert fit.tau_s[0] == pytest.approx(1.5)


def test_drift_and_daily_terms_are_those_of_least_squares() -> None:
    n, step = 6000, 60.0
    t = step * np.arange(n)
    rng = np.random.default_rng(2)
    noise = rng.uniform(-1, 1, (2, n))
    x = noise + 3 + 1e-5 * t + 2 * np.sin(2 * np.pi * t / 86400 + 1)
    x[:, rng.random(n) < 0.2] = np.nan
    known = np.isfinite(x[0])
    turns = [2 * np.pi * t / p for p in (86400.0, 43200.0)]
    rows = np.array([np.ones(n), t / t[-1], *(f(a) for a in turns for f in (np.cos, np.sin))]).T
    solution = np.linalg.lstsq(rows[known], x[:, known].T, rcond=None)[0]
    expected = (x.T - rows @ solution).T
    result = cleaned(x, step)
    assert result.periods_s == (86400.0, 43200.0)
    assert result.samples == known.sum()
    np.testing.assert_array_equal(np.isfinite(result.values[0]), known)
    np.testing.assert_allclose(result.values[:, known], expected[:, known], atol=2e-5)
    assert result.cross == pytest.approx(np.corrcoef(result.values[:, known])[0, 1], abs=1e-5)


def test_periods_need_two_of_their_kind() -> None:
    assert fitting_periods(86399.0) == ()
    assert fitting_periods(86400.0) == (43200.0,)
    assert fitting_periods(172800.0) == (86400.0, 43200.0)


def test_outliers_are_clipped_and_counted() -> None:
    rng = np.random.default_rng(3)
    x = rng.standard_normal((2, 5000))
    x[0, 100:110] = 60.0
    x[1, 105:115] = -60.0
    result = cleaned(x)
    assert result.clipped[100:115].all()
    assert result.clipped.sum() <= 15 + 5
    assert np.abs(result.values).max() < 4.5
    # 10 of 5000 at 4 sigma add 10 * 16/5000 to the variance.
    np.testing.assert_allclose(result.sigma**2, 1 + 10 * 16 / 5000, rtol=0.07)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        (np.zeros((2, 5000)), "does not change"),
        (np.full((2, 5000), np.nan), "0 epochs"),
        (np.random.default_rng(1).standard_normal((2, 999)), "999 epochs"),
    ],
)
def test_what_bears_no_correlation_is_refused(values: np.ndarray, word: str) -> None:
    result = clean(values.astype(np.float32), 1.0)
    assert isinstance(result, Refusal)
    assert word in result.reason


def test_longest_lag_is_a_fifth_of_the_record_or_12_hours() -> None:
    assert longest_lag(3600, 1.0) == 720
    assert longest_lag(300_000, 1.0) == 43_200
    assert longest_lag(300_000, 10.0) == 4320


def test_block_means_of_known_values_only() -> None:
    values = np.arange(20_000.0).reshape(2, -1)
    values[:, 0:2] = np.nan  # 2 of 4 known: a mean
    values[:, 4:7] = np.nan  # 1 of 4 known: missing
    clipped = np.zeros(10_000, bool)
    clipped[15] = True  # 3 of 4 are left
    part = Cleaned(values.astype(np.float32), clipped, 0, (), 0.0, np.ones(2))
    clipped[20:24] = True
    means, recorded = block_means(part, 4)
    assert means.shape == (2, 2500)
    np.testing.assert_array_equal(means[0, :4], [2.5, np.nan, 9.5, 13.0])
    assert np.isnan(means[0, 5])
    np.testing.assert_array_equal(np.flatnonzero(~recorded), [1])
    assert means[0, -1] == pytest.approx(9997.5)


def test_definitions_agree_on_a_gauss_markov_process_and_only_there() -> None:
    r = np.exp(-LAG / 360)
    named = other_definitions(Autocorrelation(1.0, r[None], np.ones(r.size, np.int64)))
    assert named["first_1_over_e_s"] == pytest.approx(360, abs=1e-2)
    assert named["crossing_0_05_third_s"] == pytest.approx(360 * np.log(20) / 3, abs=1e-2)
    assert named["ar1_lag1_s"] == pytest.approx(360)
    assert named["first_zero_s"] is None
    assert named["integrated_s"] is None
    # A falling straight line: integral half its base; 1/e at 1 - 1/e of it.
    line = 1 - np.arange(1200.0) / 1000
    named = other_definitions(Autocorrelation(0.5, line[None], np.ones(1200, np.int64)))
    assert named["first_zero_s"] == pytest.approx(500)
    assert named["integrated_s"] == pytest.approx(250)
    assert named["first_1_over_e_s"] == pytest.approx(500 * (1 - np.exp(-1)))
