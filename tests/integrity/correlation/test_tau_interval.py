"""The interval by inversion: quantiles, crossings, coverage on simulated records."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from sbas.integrity.correlation import tau_interval as tau_module
from sbas.integrity.correlation.autocorrelation import autocorrelation
from sbas.integrity.correlation.robust_tau import (
    Cleaned,
    ExponentialFits,
    clean,
    fit_exponentials,
    longest_lag,
)
from sbas.integrity.correlation.tau_interval import (
    Design,
    TauInterval,
    _crossing,
    _mean_correlation,
    averaging,
    simulated_estimates,
    tau_interval,
)


def gauss_markov(seed: int, n: int, tau: float) -> np.ndarray:
    rho = math.exp(-1 / tau)
    noise = np.random.default_rng(seed).standard_normal((2, n))
    noise[:, 1:] *= math.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], noise).astype(np.float32)


def interval_of(values: np.ndarray) -> tuple[TauInterval, float]:
    cleaned = clean(values, 1.0)
    assert isinstance(cleaned, Cleaned)
    lag = longest_lag(values.shape[1], 1.0)
    acf = autocorrelation(cleaned.values, step_s=1.0, max_lag=lag)
    pilot = float(fit_exponentials(acf.mean[None], 1.0).tau_s[0])
    return tau_interval(cleaned, 1.0, pilot_s=min(pilot, lag)), pilot


def design(cells: int, **changes: object) -> Design:
    known = np.packbits(np.ones(cells, bool)).tobytes()
    settings = {
        "step_s": 1.0, "cells": cells, "masks": (known,), "periods_s": (), "nugget": 0.0,
        "cross": 0.0, "draws": 2000,
    }  # fmt: skip
    return Design(**(settings | changes))  # type: ignore[arg-type]


def test_averaging_leaves_about_25_steps_a_tau() -> None:
    assert [averaging(tau, 1.0) for tau in (5, 60, 360, 1500, 9000)] == [1, 2, 12, 48, 256]
    assert averaging(360, 10.0) == 1
    for tau in np.geomspace(60, 1e5, 50):
        assert 25 <= tau / averaging(tau, 1.0) <= 50


def test_averaged_correlation_equals_that_of_the_blocks() -> None:
    x = gauss_markov(1, 4000, 30.0)
    x[:, 500:700] = np.nan
    known = np.isfinite(x[0])
    x -= x[:, known].mean(axis=1, keepdims=True)
    acf = autocorrelation(x, step_s=1.0, max_lag=200)
    zeroed = np.where(known, x, 0)[:, None]
    np.testing.assert_allclose(_mean_correlation(zeroed, acf.pairs)[0], acf.mean, atol=2e-6)


def test_crossings_of_a_rising_curve() -> None:
    at = np.log([1.0, 2.0, 4.0, 8.0])
    assert _crossing(at, 2.5, np.array([1.0, 2, 3, 4]), from_above=False) == pytest.approx(2**1.5)
    assert _crossing(at, 0.5, np.array([1.0, 2, 3, 4]), from_above=False) is None
    assert _crossing(at, 5.0, np.array([1.0, 2, 3, 4]), from_above=True) is None
    # Beside infinity the node on the outer side: the interval grows.
    beside = np.array([1.0, 2.0, np.inf, np.inf])
    assert _crossing(at, 2.5, beside, from_above=False) == pytest.approx(2.0)
    assert _crossing(at, 2.5, beside, from_above=True) == pytest.approx(4.0)


@pytest.mark.parametrize(("white", "cross"), [(0.0, 0.0), (0.35, 0.0), (0.0, 0.8)])
def test_simulated_estimates_are_the_estimators_own(white: float, cross: float) -> None:
    tau, cells = 25.0, 2000
    settings = design(cells, nugget=white, cross=cross)
    drawn = simulated_estimates(settings, math.log(tau))
    assert np.array_equal(drawn, simulated_estimates(settings, math.log(tau)))
    own = []
    for seed in range(200):
        x = gauss_markov(seed, cells, tau)
        x[1] = cross * x[0] + math.sqrt(1 - cross**2) * x[1]
        rng = np.random.default_rng(seed + 999)
        x = math.sqrt(1 - white) * x + math.sqrt(white) * rng.standard_normal(x.shape)
        cleaned = clean(x.astype(np.float32), 1.0)
        assert isinstance(cleaned, Cleaned)
        acf = autocorrelation(cleaned.values, step_s=1.0, max_lag=longest_lag(cells, 1.0))
        own.append(math.log(fit_exponentials(acf.mean[None], 1.0).tau_s[0]))
    # 200 records: the median is known to 0.09 of a standard deviation, which is known to 5 %.
    spread = float(np.std(drawn))
    assert np.median(own) == pytest.approx(np.median(drawn), abs=0.3 * spread)
    assert np.std(own) == pytest.approx(spread, rel=0.2)


def test_gaps_and_likeness_of_components_widen_the_distribution() -> None:
    plain = np.std(simulated_estimates(design(3000), math.log(25.0)))
    kept = np.arange(3000) % 1000 < 500
    masks = (np.packbits(kept).tobytes(),)
    assert np.std(simulated_estimates(design(3000, masks=masks), math.log(25.0))) > 1.2 * plain
    alike = simulated_estimates(design(3000, cross=0.8), math.log(25.0))
    # Two averaged autocorrelations whose errors have the correlation cross^2.
    assert np.std(alike) == pytest.approx(plain * math.sqrt(1 + 0.8**2), rel=0.15)


def test_intervals_cover_and_values_are_median_unbiased(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tau_module, "MOST", 600)
    tau, held, values = 20.0, 0, []
    for seed in range(60):
        interval, _ = interval_of(gauss_markov(1000 + seed, 3000, tau))
        assert interval.low_s is not None
        assert interval.value_s is not None
        assert interval.low_s < interval.value_s < (interval.high_s or math.inf)
        held += interval.low_s <= tau <= (interval.high_s or math.inf)
        values.append(interval.value_s)
        # Never narrower than the Gauss-Markov bound.
        least = 1.959964 * math.sqrt(2 * interval.value_s / 3000)
        assert interval.low_s <= interval.value_s * math.exp(-least) * (1 + 1e-12)
    # Binomial: 57 of 60 with standard deviation 1.7; a median known to 1.25 * 0.13/sqrt(60).
    assert held >= 52
    assert np.median(values) == pytest.approx(tau, rel=0.06)


@pytest.mark.parametrize(("cells", "tau"), [(3000, 20.0), (1500, 400.0)])
def test_threads_change_no_digit(monkeypatch: pytest.MonkeyPatch, cells: int, tau: float) -> None:
    monkeypatch.setattr(tau_module, "MOST", 500)
    found = []
    for threads in (1, 4):
        simulated_estimates.cache_clear()
        monkeypatch.setattr(tau_module, "MOST_THREADS", threads)
        monkeypatch.setattr(os, "cpu_count", lambda: 8)
        found.append(interval_of(gauss_markov(8, cells, tau))[0])
    assert found[0] == found[1]


def test_a_record_of_a_few_tau_has_no_upper_limit() -> None:
    interval, _ = interval_of(gauss_markov(3, 1500, 400.0))
    assert interval.high_s is None
    assert interval.low_s is not None
    assert interval.low_s < 400


def test_a_longer_record_is_simulated_in_stretches_and_its_spread_scaled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    x = gauss_markov(5, 64_000, 20.0)
    part, _ = interval_of(x[:, :8000])
    monkeypatch.setattr(tau_module, "MOST_CELLS", 8000)
    whole, _ = interval_of(x)
    assert whole.low_s is not None
    assert whole.high_s is not None
    assert part.low_s is not None
    assert part.high_s is not None
    ratio = math.log(part.high_s / part.low_s) / math.log(whole.high_s / whole.low_s)
    assert ratio == pytest.approx(math.sqrt(8), rel=0.2)
    assert whole.low_s < 20 < whole.high_s


def test_a_sparse_record_and_one_with_empty_stretches_have_intervals(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tau_module, "MOST_CELLS", 6000)
    monkeypatch.setattr(tau_module, "MOST", 500)
    sparse = gauss_markov(6, 30_000, 60.0)
    sparse[:, np.random.default_rng(6).random(30_000) < 0.8] = np.nan
    ends = gauss_markov(7, 60_000, 30.0)
    ends[:, 3000:-3000] = np.nan
    for x, tau in ((sparse, 60), (ends, 30)):
        interval, _ = interval_of(x)
        assert interval.low_s is not None
        assert interval.low_s < tau < (interval.high_s or math.inf)


def test_estimates_of_zero_are_below_all_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fall within one lag can be fitted by 0 s: no warning, and bounds that are numbers."""
    design = Design(1.0, 200, (np.packbits(np.ones(200, bool)).tobytes(),), (), 0.0, 0.0, 0.8, 340)

    def fits(r: NDArray[np.floating[Any]], step_s: float) -> ExponentialFits:
        found = fit_exponentials(r, step_s)
        return replace(found, tau_s=np.where(np.arange(len(r)) % 50, found.tau_s, 0.0))

    monkeypatch.setattr(tau_module, "fit_exponentials", fits)
    drawn = simulated_estimates.__wrapped__(design, math.log(5.0))
    zeros = int(np.sum(np.isneginf(drawn)))
    assert zeros == 7
    assert np.isfinite(drawn[zeros:]).all()
    assert (np.diff(drawn[zeros:]) >= 0).all()
    simulated_estimates.cache_clear()
    monkeypatch.setattr(tau_module, "fit_exponentials", fits)
    value, low, high, _ = tau_module._invert(0.0, design, 0.5, 0.95, 200.0)
    assert value is None or value < 5.0
    assert high is None or high < 20.0
    assert low is None
    simulated_estimates.cache_clear()
