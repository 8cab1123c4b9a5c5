"""Poisson bounds against high precision, tables and their own definition."""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.counting import garwood_limits, poisson_bounds

CONFIDENCES = [0.5, 0.683, 0.9, 0.95, 0.975, 0.999, 1 - 1e-6, 1 - 1e-9, 1 - 1e-12]


def lower_tail(shape: Any, x: Any) -> Any:
    """P(gamma(shape) <= x), by its series of positive terms (Abramowitz and Stegun 6.5.29)."""
    term = total = 1 / shape
    n = 0
    while term > total * mp.mpf(10) ** -35:
        n += 1
        term *= x / (shape + n)
        total += term
    return total * mp.exp(shape * mp.log(x) - x - mp.loggamma(shape))


def upper_tail(shape: Any, x: Any) -> Any:
    """P(gamma(shape) > x): the quadrature of mpmath, or positive terms for large whole shapes."""
    if shape < 1000:
        return mp.gammainc(shape, x, mp.inf, regularized=True)
    term = total = mp.mpf(1)
    j = shape - 1
    while j > 0 and term > total * mp.mpf(10) ** -35:
        term *= j / x
        j -= 1
        total += term
    return total * mp.exp((shape - 1) * mp.log(x) - x - mp.loggamma(shape))


def relative_error(x: float, shape: Any, tail: Any, alpha: float) -> float:
    """Relative error of a limit: one Newton step in 40 digits from it to the exact limit."""
    shape, exact = mp.mpf(shape), mp.mpf(x)
    density = mp.exp((shape - 1) * mp.log(exact) - exact - mp.loggamma(shape))
    return float(abs((tail(shape, exact) - mp.mpf(alpha)) / density / exact))


@pytest.mark.parametrize("events", [0, 0.5, 1, 2, 7.25, 100, 1e5, 100001, 1e6])
def test_limits_against_mpmath(events: float) -> None:
    with mp.workdps(40):
        for confidence in CONFIDENCES if events < 1000 else CONFIDENCES[::4]:
            alpha = 1 - confidence
            _, upper = garwood_limits(events, confidence)
            assert relative_error(float(upper), events + 1, upper_tail, alpha) < 2e-14
            lower, _ = garwood_limits(events, confidence, sided="lower")
            if events:
                assert relative_error(float(lower), events, lower_tail, alpha) < 2e-14
            else:
                assert lower == 0


def test_tabled_limits() -> None:
    # Garwood 1936, table; digits as in methods page "Integrity statistics", section 9.
    assert poisson_bounds(0, 1, 0.95).upper == pytest.approx(2.995732, abs=5e-7)
    assert poisson_bounds(1, 1, 0.95).upper == pytest.approx(4.743865, abs=5e-7)
    none, one = (poisson_bounds(k, 1, 0.95, sided="two") for k in (0, 1))
    assert none.lower == 0
    assert none.upper == pytest.approx(3.688879, abs=5e-7)
    assert one.lower == pytest.approx(0.02531781, abs=5e-9)
    assert one.upper == pytest.approx(5.571643, abs=5e-7)


@pytest.mark.parametrize(
    ("hours", "upper"), [(3e5 / 3600, 3.595e-2), (8766.0, 3.42e-4), (40 * 15 * 8766.0, 5.70e-7)]
)
def test_zero_events_of_real_campaigns(hours: float, upper: float) -> None:
    estimate = poisson_bounds(0, hours, 0.95)
    assert estimate.upper == pytest.approx(upper, rel=2e-3)
    assert estimate.upper == pytest.approx(-math.log(0.05) / hours, rel=1e-14)


def test_estimate_is_demonstrated_and_keeps_count_and_hours() -> None:
    estimate = poisson_bounds(3, 500, 0.9, of="HMI events")
    assert estimate.evidence == "demonstrated"
    assert (estimate.value, estimate.lower, estimate.sided) == (3 / 500, None, "upper")
    basis = estimate.to_dict()["basis"]
    assert basis == {"events": 3.0, "hours": 500.0, "of": "HMI events"}
    assert poisson_bounds(3, 500, 0.9, sided="lower").upper is None


@given(
    mean=st.floats(0.01, 60),
    confidence=st.sampled_from([0.5, 0.9, 0.95, 0.999]),
    sided=st.sampled_from(["upper", "lower", "two"]),
)
def test_coverage_is_never_below_the_confidence(mean: float, confidence: float, sided: Any) -> None:
    # Exact coverage: Poisson probabilities of all counts whose interval holds the mean.
    events = np.arange(400)
    lower, upper = garwood_limits(events, confidence, sided=sided)
    with mp.workdps(20):
        covered = sum(
            mp.exp(int(k) * mp.log(mean) - mean) / mp.factorial(int(k))
            for k in events[(lower <= mean) & (mean <= upper)]
        )
    assert covered >= confidence - 1e-12


@given(
    events=st.floats(0, 1e9),
    confidence=st.floats(0.5, 1 - 1e-15),
    sided=st.sampled_from(["upper", "lower", "two"]),
)
def test_bounds_hold_the_value(events: float, confidence: float, sided: Any) -> None:
    estimate = poisson_bounds(events, 7.5, confidence, sided=sided)
    assert (estimate.lower is None) == (sided == "upper")
    assert (estimate.upper is None) == (sided == "lower")


@given(events=st.floats(0, 1e7), more=st.floats(0.01, 10), confidence=st.floats(0.5, 0.999999))
def test_more_events_raise_both_limits(events: float, more: float, confidence: float) -> None:
    lower, upper = garwood_limits([events, events + more], confidence, sided="two")
    assert lower[0] <= lower[1]
    assert upper[0] < upper[1]


def test_the_series_for_many_events_joins_the_exact_limits() -> None:
    lower, upper = garwood_limits(np.array([1e5, np.nextafter(1e5, 2e5)]), 0.999, sided="two")
    assert lower[1] == pytest.approx(lower[0], rel=1e-14)
    assert upper[1] == pytest.approx(upper[0], rel=1e-14)


@pytest.mark.parametrize("events", [-1, math.nan, math.inf, "3", None, True, [0, -1]])
def test_counts_that_are_none(events: Any) -> None:
    with pytest.raises(InputError, match="count is a number of 0 or more"):
        poisson_bounds(events, 10, 0.95)


@pytest.mark.parametrize("hours", [0, -1, math.nan, math.inf, "10", None, True])
def test_exposures_that_are_none(hours: Any) -> None:
    with pytest.raises(InputError, match="hours above 0"):
        poisson_bounds(0, hours, 0.95)


@pytest.mark.parametrize("confidence", [0, 0.49, 1, 95, math.nan, "0.95", None])
def test_confidences_out_of_range(confidence: Any) -> None:
    with pytest.raises(InputError, match=r"(?s)confidence.*\[0\.5, 1\)"):
        poisson_bounds(0, 10, confidence)


def test_other_refusals() -> None:
    with pytest.raises(InputError, match="upper, lower, two"):
        poisson_bounds(0, 10, 0.95, sided="both")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="one rate has one count"):
        poisson_bounds([1, 2], 10, 0.95)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="too short"):
        poisson_bounds(5, 5e-324, 0.95)
