"""Tails that fit are fitted, all others are refused in words."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import signal

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.tails.tail_fit import TailFit, fit_tail

TAU, N = 25.0, 20_000


def gauss_markov(seed: int, *, parts: int = 2, tau: float = TAU, n: int = N) -> np.ndarray:
    r = math.exp(-1 / tau)
    drawn = np.random.default_rng(seed).standard_normal((parts, n))
    drawn[:, 1:] *= math.sqrt(1 - r * r)
    return np.asarray(signal.lfilter([1.0], [1.0, -r], drawn, axis=1))


def fitted(error: np.ndarray, sigma: Any = 1.0, **options: Any) -> TailFit:
    settings: dict[str, Any] = {"time_s": np.arange(error.shape[-1]), "interval_s": 1.0,
                                "tau_s": TAU} | options  # fmt: skip
    fit = fit_tail(error, sigma, **settings)
    assert isinstance(fit, TailFit)
    return fit


def refused_share(make: Any, records: int = 20) -> float:
    return float(np.mean([fitted(make(seed)).refusal is not None for seed in range(records)]))


def test_a_gaussian_record_gives_its_sigma() -> None:
    fits = [fitted(gauss_markov(seed)) for seed in range(40)]
    scale = np.array([f.scale for f in fits])
    # One record of 800 tau has a deviation of 9 %; 40 have 1.4 %.
    assert scale.mean() == pytest.approx(1.0, abs=0.05)
    assert np.mean([f.refusal is None for f in fits]) >= 0.8
    assert all(f.axis_ratio >= 0.85 for f in fits)


def test_the_scale_follows_sigma() -> None:
    error = gauss_markov(1)
    one, two = fitted(error), fitted(error, 0.5)
    assert two.scale == pytest.approx(4 * one.scale)
    assert two.fit_p == one.fit_p


def test_a_sigma_for_each_epoch() -> None:
    error = gauss_markov(2)
    sigma = 1 + 0.5 * np.sin(np.arange(N) / 3000)
    assert fitted(error * sigma, sigma).scale == pytest.approx(fitted(error).scale)


def test_sizes_give_what_signed_errors_give() -> None:
    error = gauss_markov(3)
    signed, sizes = fitted(error), fitted(np.hypot(*error))
    assert sizes.threshold == pytest.approx(signed.threshold)
    assert sizes.excess == pytest.approx(signed.excess)
    assert sizes.bias is None
    assert signed.bias is not None


def amplitude(seed: int, tau: float) -> np.ndarray:
    return np.where(gauss_markov(1000 + seed, parts=1, tau=tau)[0] > 1.645, 3.0, 1.0)


def chi_scale(seed: int) -> np.ndarray:
    return np.asarray(1 / np.sqrt((gauss_markov(2000 + seed, parts=5) ** 2).mean(axis=0)))


def clipped(seed: int, limit: float) -> np.ndarray:
    error = gauss_markov(seed)
    return np.asarray(error * np.minimum(1, limit / np.hypot(*error)))


def bounded(seed: int) -> np.ndarray:
    error = gauss_markov(seed)
    size = np.hypot(*error)
    return np.asarray(error * 3 * np.tanh(size / 3) / size)


@pytest.mark.parametrize(
    "make",
    [
        lambda s: gauss_markov(s) * amplitude(s, TAU),
        lambda s: gauss_markov(s) * amplitude(s, 3.0),
        lambda s: gauss_markov(s) * chi_scale(s),
        lambda s: clipped(s, 3.0),
        bounded,
        lambda s: gauss_markov(s) + np.array([[0.8], [0.0]]),
    ],
    ids=["mixture", "fast mixture", "t5", "clipped", "bounded", "bias"],
)
def test_misfits_are_refused(make: Any) -> None:
    assert refused_share(make) >= 0.95


def test_a_clock_too_slow_is_refused() -> None:
    error = gauss_markov(4)
    noisy = math.sqrt(0.9) * error + math.sqrt(0.1) * np.random.default_rng(1).standard_normal(
        error.shape
    )
    told, untold = fitted(noisy, nugget=0.1), fitted(noisy)
    assert told.refusal is None
    assert told.crossings == pytest.approx(1.0, abs=0.25)
    assert untold.refusal is not None
    assert "clock is too slow" in untold.refusal.reason


def test_each_refusal_says_what_was_seen() -> None:
    reasons = {
        "clipped": fitted(clipped(5, 3.0)),
        "bias of": fitted(gauss_markov(5) + np.array([[1.0], [0.0]])),
        "misfits": fitted(gauss_markov(5) * amplitude(5, TAU)),
    }
    for words, fit in reasons.items():
        assert fit.refusal is not None
        assert words in fit.refusal.reason


def test_few_clusters_are_not_extrapolated() -> None:
    fit = fitted(gauss_markov(6, tau=100.0, n=2100), tau_s=100.0)
    assert fit.refusal is not None
    assert "no extrapolation under 10" in fit.refusal.reason


@pytest.mark.parametrize("n", [999, 10, 0])
def test_short_records_are_not_fitted(n: int) -> None:
    error = gauss_markov(7)[:, :n]
    found = fit_tail(error, 1.0, time_s=np.arange(n), interval_s=1.0, tau_s=TAU)
    assert isinstance(found, Refusal)
    assert "too few" in found.reason


def test_a_constant_is_not_fitted() -> None:
    found = fit_tail(np.full(N, 2.0), 1.0, time_s=np.arange(N), interval_s=1.0, tau_s=TAU)
    assert isinstance(found, Refusal)
    signed = fit_tail(np.full((2, N), 2.0), 1.0, time_s=np.arange(N), interval_s=1.0, tau_s=TAU)
    assert isinstance(signed, Refusal)


def test_missing_samples_are_left_out_and_gaps_are_no_crossings() -> None:
    error = gauss_markov(8)
    holed = error.copy()
    holed[:, 5000:7000] = np.nan
    kept = np.r_[0:5000, 7000:N]
    whole = fit_tail(error[:, kept], 1.0, time_s=kept, interval_s=1.0, tau_s=TAU)
    missing = fitted(holed)
    assert isinstance(whole, TailFit)
    assert missing.samples == N - 2000
    assert missing.scale == whole.scale
    assert missing.crossings == whole.crossings


def same_fit(a: TailFit, b: TailFit, rel: float) -> None:
    for name in ("threshold", "excess", "scale", "fit_p", "crossings", "bias", "axis_ratio"):
        assert getattr(a, name) == pytest.approx(getattr(b, name), rel=rel), name
    assert (a.samples, a.clusters, a.refusal) == (b.samples, b.clusters, b.refusal)
    np.testing.assert_allclose(a.block_count, b.block_count, atol=1)
    np.testing.assert_allclose(a.block_sum, b.block_sum, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(a.tail_y, b.tail_y, rtol=rel)


def test_a_grid_with_missing_cells_is_a_record_with_times() -> None:
    error, sigma = gauss_markov(10), 1 + 0.3 * np.cos(np.arange(N) / 2000)
    error = error * sigma
    error[:, 300:900] = np.nan
    error[0, 5000] = np.nan
    sigma[7000:7100] = np.nan
    kept = np.isfinite(error).all(axis=0) & np.isfinite(sigma)
    times = 1e9 + np.arange(N)
    whole = fitted(error[:, kept], sigma[kept], time_s=times[kept])
    grid = fitted(error, sigma, time_s=None)
    assert grid.samples == N - 701
    same_fit(grid, whole, 1e-12)
    np.testing.assert_allclose(grid.block_sum, whole.block_sum, rtol=1e-9)


def test_single_precision_is_enough() -> None:
    error, sigma = gauss_markov(11), np.full(N, 1.5)
    double = fitted(error, sigma, time_s=None)
    same_fit(fitted(error.astype(np.float32), sigma.astype(np.float32), time_s=None), double, 1e-5)
    same_fit(fitted(error.astype(np.float32), 1.5, time_s=None), double, 1e-5)


def test_bias_and_axes_by_the_definition() -> None:
    """Sample mean over sample deviation, root of the ratio of the covariance's eigenvalues."""
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    error = turn @ (np.array([[1.0], [0.6]]) * gauss_markov(12, n=400_000)) + 0.05
    fit = fitted(error, time_s=None)
    assert fit.bias == pytest.approx(float(np.hypot(*(error.mean(axis=1) / error.std(axis=1)))))
    minor, major = np.linalg.eigvalsh(np.cov(error))
    assert fit.axis_ratio == pytest.approx(math.sqrt(minor / major), abs=0.026)


def test_an_infinite_sigma_is_missing_not_a_small_error() -> None:
    error, sigma, holes = gauss_markov(13), np.ones(N), np.ones(N)
    sigma[100:4000], holes[100:4000] = np.inf, np.nan
    same_fit(fitted(error, sigma, time_s=None), fitted(error, holes, time_s=None), 1e-12)


def test_lengths_without_times_are_compared() -> None:
    with pytest.raises(InputError, match="errors and sigmas differ in length"):
        fitted(gauss_markov(9), np.ones(5), time_s=None)
    with pytest.raises(InputError, match="infinite"):
        fitted(np.full((2, N), np.inf), time_s=None)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tau_s": 0.5}, "tau_s"),
        ({"tau_low_s": 30.0}, "tau_low_s"),
        ({"tau_high_s": 20.0}, "tau_high_s"),
        ({"nugget": 1.0}, "nugget"),
        ({"time_s": np.zeros(N)}, "times do not increase"),
        ({"time_s": np.arange(5)}, "differ in length"),
    ],
)
def test_bad_arguments_are_named(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        fitted(gauss_markov(9), **change)


def test_bad_errors_are_named() -> None:
    with pytest.raises(InputError, match="not negative"):
        fitted(gauss_markov(9)[0])
    with pytest.raises(InputError, match="sigma"):
        fitted(gauss_markov(9), 0.0)
