"""Modelled rates: value and bounds against the exact hazard of what was simulated."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.integrity.exposure.gauss_markov_sampled import extremal_index
from sbas.integrity.tails.tail_model import modelled_rate, tail_probability
from tests.integrity.tails.test_tail_fit import TAU, N, fitted, gauss_markov


def given(fit: object, level: object, **options: object) -> Estimate:
    rate = modelled_rate(fit, level, **options)  # type: ignore[arg-type]
    assert isinstance(rate, Estimate), rate
    return rate


@pytest.fixture(scope="module")
def fit() -> object:
    found = fitted(gauss_markov(21))
    assert found.refusal is None
    return found


def test_the_bound_holds_the_exact_rate_where_printed() -> None:
    k = 6.18
    theta = extremal_index(k, correlation=math.exp(-1 / TAU))
    truth = 3600 * theta * math.exp(-k * k / 2)
    ratios = []
    for seed in range(100, 200):
        rate = modelled_rate(fitted(gauss_markov(seed)), k)
        if isinstance(rate, Estimate):
            assert rate.upper is not None
            ratios.append((rate.value / truth, rate.upper / truth))
    value, upper = np.array(ratios).T
    assert upper.size >= 80
    # 0.95 has a standard error of 0.022 here.
    assert np.mean(upper >= 1) >= 0.9
    assert 0.5 < np.median(value) < 2.0
    # A bound that covers by being endless would be worthless.
    assert np.median(upper) < 50


def test_what_travels_with_the_figure(fit: object) -> None:
    rate = given(fit, 6.18)
    assert rate.evidence == "modelled"
    assert rate.unit == "per_h"
    assert rate.basis.parameters["clusters"] >= 10  # type: ignore[union-attr]
    # log10 of (1/hours)/rate, method page 5.1.
    decades = math.log10(1 / (N / 3600) / rate.value)
    assert rate.basis.extrapolation_factor == pytest.approx(decades)  # type: ignore[union-attr]
    assert "modelled, not demonstrated" in rate.caveats[0]
    assert any("taken as known" in c for c in rate.caveats)


def test_sides(fit: object) -> None:
    upper, lower, two = (given(fit, 5.0, sided=s) for s in ("upper", "lower", "two"))
    assert upper.lower is None
    assert lower.upper is None
    assert lower.lower is not None
    assert two.lower is not None
    assert two.upper is not None
    assert upper.upper is not None
    assert two.lower <= lower.lower <= upper.value <= upper.upper <= two.upper


def test_rates_fall_with_the_level(fit: object) -> None:
    rates = [given(fit, k) for k in (3.0, 4.0, 5.0, 6.0, 7.0)]
    assert all(a.value > b.value for a, b in itertools.pairwise(rates))
    assert all((a.upper or 0) > (b.upper or 0) for a, b in itertools.pairwise(rates))


def test_levels_of_epochs_are_averaged(fit: object) -> None:
    level = np.full(1000, 4.0)
    level[500:] = np.inf
    whole, half = given(fit, 4.0), given(fit, level)
    assert half.value == pytest.approx(whole.value / 2)
    assert any("50 % of the epochs" in c for c in half.caveats)
    mixed = np.where(np.arange(1000) % 2, 4.0, 5.0)
    mean = (whole.value + given(fit, 5.0).value) / 2
    assert given(fit, mixed).value == pytest.approx(mean)


def test_many_levels_are_interpolated(fit: object) -> None:
    level = np.linspace(4.0, 5.0, 5000)
    exact = np.mean([given(fit, k).value for k in np.linspace(4.01, 4.99, 50)])
    assert given(fit, level).value == pytest.approx(exact, rel=5e-3)


def test_many_levels_are_the_mean_of_each() -> None:
    """A histogram of levels 4 to 60, of which the lowest decide; white noise in the clock."""
    fit = fitted(gauss_markov(21), tau_low_s=18.0, tau_high_s=36.0)
    level = np.geomspace(4.0, 60.0, 200)
    epochs = np.random.default_rng(1).integers(1, 5000, level.size)
    found = given(fit, level, counts=epochs, sided="two")
    each = [given(fit, k, sided="two") for k in level[level < 6.5]]
    for name in ("value", "lower", "upper"):
        mean = np.dot(epochs[: len(each)], [getattr(e, name) for e in each]) / epochs.sum()
        assert getattr(found, name) == pytest.approx(mean, rel=1e-3), name


def test_counts_are_epochs(fit: object) -> None:
    level, counts = [4.0, 5.0, 3.0, np.inf], [3, 2, 0, 5]
    found = given(fit, level, counts=counts, sided="two")
    again = given(fit, np.repeat(level, counts), sided="two")
    for name in ("value", "lower", "upper"):
        assert getattr(found, name) == pytest.approx(getattr(again, name), rel=1e-12)
    assert any("50 % of the epochs" in c for c in found.caveats)
    impossible = modelled_rate(fit, [4.0, np.inf], counts=[0, 7])  # type: ignore[arg-type]
    assert isinstance(impossible, Refusal)
    assert "impossible" in impossible.reason


@pytest.mark.parametrize("counts", [[1], [1, -1], [0, 0], [1, math.nan], [1, math.inf]])
def test_bad_counts_are_named(fit: object, counts: list[float]) -> None:
    with pytest.raises(InputError, match="counts"):
        modelled_rate(fit, [4.0, 5.0], counts=counts)  # type: ignore[arg-type]


def test_a_shorter_tau_raises_the_bound_only() -> None:
    error = gauss_markov(21)
    known, unsure = fitted(error), fitted(error, tau_low_s=18.0, tau_high_s=36.0)
    a, b = given(known, 6.18), given(unsure, 6.18)
    assert a.value == b.value
    assert a.upper is not None
    assert b.upper is not None
    assert b.upper > a.upper
    assert not any("taken as known" in c for c in b.caveats)


def test_larger_errors_than_sigma_are_flagged() -> None:
    rate = given(fitted(gauss_markov(21), 0.7), 6.18)
    assert any("larger than their sigma" in c for c in rate.caveats)


def test_refusals_pass_through(fit: object) -> None:
    assert modelled_rate(Refusal("no tail"), 6.0) == Refusal("no tail")
    refused = replace(fit, refusal=Refusal("misfit"))  # type: ignore[type-var]
    assert modelled_rate(refused, 6.0) == Refusal("misfit")  # type: ignore[arg-type]


def test_what_lies_too_far_or_cannot_happen_is_no_rate(fit: object) -> None:
    for level, words in ((12.0, "12 decades"), (60.0, "12 decades"), (math.inf, "impossible")):
        found = modelled_rate(fit, level)  # type: ignore[arg-type]
        assert isinstance(found, Refusal)
        assert words in found.reason


@pytest.mark.parametrize("level", [-1.0, math.nan, []])
def test_bad_levels_are_named(fit: object, level: object) -> None:
    with pytest.raises(InputError, match="levels"):
        modelled_rate(fit, level)  # type: ignore[arg-type]


def test_the_same_record_gives_the_same_digits() -> None:
    first, second = (given(fitted(gauss_markov(21)), 6.18) for _ in range(2))
    assert first == second


def test_probability_curve_starts_at_five_per_cent(fit: object) -> None:
    threshold = math.sqrt(2 * fit.threshold)  # type: ignore[attr-defined]
    value, lower, upper = tail_probability(fit, [threshold, 4.0, 6.0])  # type: ignore[arg-type]
    assert value[0] == pytest.approx(0.05, rel=0.1)
    assert np.all(lower <= value)
    assert np.all(value <= upper)
