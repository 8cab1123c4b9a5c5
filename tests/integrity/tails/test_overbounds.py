"""Overbounds against exact distributions and by brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal, special, stats

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.tails.overbounds import (
    Overbound,
    cdf_overbound,
    paired_overbound,
    tail_sigma,
    two_step_overbound,
)

N = 20_000
P = (np.arange(N) + 0.5) / N
NORMAL = special.ndtri(P)


def bound(found: Overbound | Refusal) -> Overbound:
    assert isinstance(found, Overbound), found
    return found


def test_exact_normal_quantiles_give_their_sigma() -> None:
    for of in (cdf_overbound, paired_overbound, two_step_overbound):
        found = bound(of(3 * NORMAL, n_eff=N))
        # The empirical distribution steps ahead of its quantiles by half a sample.
        assert found.sigma_m == pytest.approx(3.0, rel=0.02)
    assert bound(cdf_overbound(3 * NORMAL, n_eff=N)).sigma_m >= 3.0


def test_a_mixture_needs_the_sigma_that_its_tail_quantile_says() -> None:
    """Largest -x/Phi^-1(F(x)) of 0.95 N(0,1) + 0.05 N(0,9), by the exact distribution."""
    x = np.linspace(-8, 0, 4001)
    cdf = 0.95 * stats.norm.cdf(x) + 0.05 * stats.norm.cdf(x / 3)
    low = 10 / N
    inside = (cdf >= low) & (cdf <= 0.45)
    sigma = np.max(x[inside] / special.ndtri(cdf[inside]))
    quantiles = np.interp(P, cdf, x)
    sample = np.where(P <= 0.5, quantiles, -np.interp(1 - P, cdf, x))
    assert tail_sigma(sample, tail_probability=low) == pytest.approx(sigma, rel=0.01)


def test_the_method_page_record_with_few_effective_samples() -> None:
    """Page 6: a clean Gauss-Markov record taken as 3e5 samples gives 1.46; as T/tau far less."""
    generator = np.random.default_rng(5)
    r = np.exp(-1 / 360)
    drawn = generator.standard_normal(300_000)
    drawn[1:] *= np.sqrt(1 - r * r)
    error = signal.lfilter([1.0], [1.0, -r], drawn)
    naive = max(tail_sigma(s * error, tail_probability=1e-5) for s in (1, -1))
    honest = bound(paired_overbound(error, n_eff=300_000 / 360))
    assert honest.tail_probability == pytest.approx(10 * 360 / 300_000)
    assert honest.sigma_m < max(naive, 1.2)


def lies_between(error: np.ndarray, found: Overbound) -> bool:
    """Whether the empirical distribution lies between the pair at the bounded quantiles."""
    x = np.sort(error)
    after = np.arange(1, x.size + 1) / x.size
    before = after - 1 / x.size
    left = special.ndtr((x + found.bias_m) / found.sigma_m)
    right = special.ndtr((x - found.bias_m) / found.sigma_m)
    p = found.tail_probability
    on_left = (after >= p) & (after <= 1 - p)
    on_right = (before >= p) & (before <= 1 - p)
    return bool(np.all(left[on_left] >= after[on_left] - 1e-9)) and bool(
        np.all(right[on_right] <= before[on_right] + 1e-9)
    )


@given(
    seed=st.integers(0, 10_000),
    shift=st.floats(-0.5, 0.5),
    kind=st.sampled_from(["normal", "t", "uniform", "exponential"]),
)
def test_the_pair_bounds_by_brute_force(seed: int, shift: float, kind: str) -> None:
    generator = np.random.default_rng(seed)
    error = (
        shift
        + {
            "normal": generator.standard_normal(500),
            "t": generator.standard_t(5, 500),
            "uniform": generator.uniform(-1, 1, 500),
            "exponential": generator.exponential(size=500) - 1,
        }[kind]
    )
    assert lies_between(error, bound(paired_overbound(error, n_eff=500)))


@given(seed=st.integers(0, 10_000))
def test_the_cdf_overbound_bounds_both_tails(seed: int) -> None:
    error = np.random.default_rng(seed).standard_normal(500)
    found = cdf_overbound(error, n_eff=500)
    if isinstance(found, Refusal):
        return
    for x in (np.sort(error), np.sort(-error)):
        p = np.arange(1, 501) / 500
        inside = (p >= found.tail_probability) & (p <= 0.45)
        assert np.all(special.ndtr(x[inside] / found.sigma_m) >= p[inside] - 1e-12)


def test_a_bias_goes_to_b_and_not_into_sigma() -> None:
    error = NORMAL + 0.3
    refused = cdf_overbound(error, n_eff=N)
    assert isinstance(refused, Refusal)
    assert "paired" in refused.cure
    for of in (paired_overbound, two_step_overbound):
        found = bound(of(error, n_eff=N))
        assert found.bias_m == pytest.approx(0.3, abs=0.03)
        assert found.sigma_m == pytest.approx(1.0, rel=0.02)


def test_two_steps_need_less_bias_for_a_flat_body() -> None:
    """A uniform error is symmetric and unimodal itself: no bias is needed in two steps."""
    error = 2 * P - 1
    direct, stepped = (
        bound(paired_overbound(error, n_eff=N)),
        bound(two_step_overbound(error, n_eff=N)),
    )
    assert stepped.bias_m < 0.05 < direct.bias_m
    # Without any bias the densities at zero decide: 1/(sigma sqrt(2 pi)) = 1/2.
    assert 0.9 * np.sqrt(2 / np.pi) < stepped.sigma_m < np.sqrt(2 / np.pi)
    t = np.linspace(0, 1 - stepped.bias_m, 200)
    assert np.all(special.ndtr(-t / stepped.sigma_m) >= (1 - stepped.bias_m - t) / 2 - 1e-3)


def test_a_given_bias_is_kept_where_it_serves() -> None:
    found = bound(paired_overbound(NORMAL, n_eff=N, bias_m=0.5))
    assert found.bias_m == 0.5
    assert found.sigma_m < 1.0


def test_too_few_effective_samples_show_no_tail() -> None:
    for of in (cdf_overbound, paired_overbound, two_step_overbound):
        refused = of(NORMAL, n_eff=20)
        assert isinstance(refused, Refusal)
        assert "effective samples" in refused.reason


@pytest.mark.parametrize("error", [np.zeros(50), np.append(NORMAL, np.nan)])
def test_bad_errors_are_refused(error: np.ndarray) -> None:
    with pytest.raises(InputError, match="100 errors"):
        cdf_overbound(error, n_eff=1000)
