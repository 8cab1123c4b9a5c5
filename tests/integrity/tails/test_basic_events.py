"""Rates as fault trees want them."""

from __future__ import annotations

import math

import pytest

from sbas.estimate import Estimate, Quoted
from sbas.exceptions import InputError
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.tails.basic_events import (
    hours_between_events,
    lognormal_error_factor,
    mission_probability,
)


def test_a_mission_keeps_bounds_and_evidence() -> None:
    rate = poisson_bounds(3, 100.0, 0.9, sided="two")
    mission = mission_probability(rate, 10.0)
    assert mission.value == pytest.approx(1 - math.exp(-0.3), rel=1e-12)
    assert rate.lower is not None
    assert rate.upper is not None
    assert mission.lower == pytest.approx(1 - math.exp(-10 * rate.lower), rel=1e-12)
    assert mission.upper == pytest.approx(1 - math.exp(-10 * rate.upper), rel=1e-12)
    assert mission.unit == "1"
    assert mission.evidence == "demonstrated"


def test_tiny_rates_keep_their_digits() -> None:
    claim = Estimate(1e-18, None, None, None, "per_h", Quoted("a document", "1"))
    mission = mission_probability(claim, 1.0)
    assert mission.value == 1e-18
    assert mission.upper is None
    assert mission.evidence == "claimed"


def test_hours_between_events_swap_the_bounds() -> None:
    rate = poisson_bounds(3, 100.0, 0.9, sided="two")
    assert rate.lower is not None
    assert rate.upper is not None
    assert hours_between_events(rate) == (1 / rate.upper, 1 / rate.lower)
    # No event in 3 h: 1/(2.995732/3) h at least, no upper limit.
    shortest, longest = hours_between_events(poisson_bounds(0, 3.0, 0.95))
    assert shortest == pytest.approx(3 / 2.995732, rel=1e-6)
    assert longest == math.inf


@pytest.mark.parametrize("confidence", [0.9, 0.99])
def test_error_factor_of_a_lognormal_rate(confidence: float) -> None:
    """Bounds made from median 1e-5 and error factor 3 give these back."""
    from scipy.special import ndtri

    sigma = math.log(3) / ndtri(0.95)
    z = -ndtri((1 - confidence) / 2)
    low, high = (1e-5 * math.exp(s * z * sigma) for s in (-1, 1))
    rate = Estimate(1e-5, low, high, confidence, "per_h", Quoted("a", "b"), sided="two")
    assert lognormal_error_factor(rate) == (pytest.approx(1e-5), pytest.approx(3.0))


def test_what_is_no_rate_is_refused() -> None:
    length = Estimate(1.0, None, None, None, "m", Quoted("a", "b"))
    for of in (hours_between_events, lognormal_error_factor):
        with pytest.raises(InputError, match="not a rate"):
            of(length)
    with pytest.raises(InputError, match="two bounds"):
        lognormal_error_factor(poisson_bounds(0, 10.0, 0.9, sided="two"))
    with pytest.raises(InputError, match="mission_h"):
        mission_probability(poisson_bounds(0, 10.0, 0.9), 0.0)
