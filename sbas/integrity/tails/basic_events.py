"""Rates as the basic events of a fault tree want them: probability over a mission, mean time."""

from __future__ import annotations

import math
from dataclasses import replace

from scipy import special

from sbas.estimate import Estimate
from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import require


def mission_probability(rate: Estimate, mission_h: float) -> Estimate:
    """Probability of at least one event in a mission, from a constant rate.

    Parameters
    ----------
    rate : Estimate in "per_h".
    mission_h : length of the mission, or the proof-test interval [h].

    Returns
    -------
    Estimate in "1" with bounds, confidence, side and evidence of the rate: 1 - exp(-rate T) is
    monotonic, so that each bound carries over exactly.

    Raises
    ------
    InputError : an estimate in another unit, or a length that is not above 0.

    References
    ----------
    IEC 61025:2006 (fault tree analysis), 7.5: constant failure rates.
    """
    _require_rate(rate)
    require("mission_h", mission_h, above=0)

    def over_mission(per_h: float) -> float:
        return -math.expm1(-per_h * mission_h)

    return replace(
        rate,
        value=over_mission(rate.value),
        lower=None if rate.lower is None else over_mission(rate.lower),
        upper=None if rate.upper is None else over_mission(rate.upper),
        unit="1",
        caveats=(*rate.caveats, f"over {mission_h:g} h, supposing a constant rate"),
    )


def hours_between_events(rate: Estimate) -> tuple[float, float]:
    """Shortest and longest mean time between events that a rate's bounds allow.

    Parameters
    ----------
    rate : Estimate in "per_h".

    Returns
    -------
    shortest, longest [h]: 1/upper and 1/lower; 0 without an upper bound, infinite without a
    lower one. The shortest is what a safety case may use.

    Raises
    ------
    InputError : an estimate in another unit.
    """
    _require_rate(rate)
    shortest = 1 / rate.upper if rate.upper else 0.0
    return shortest, 1 / rate.lower if rate.lower else math.inf


def lognormal_error_factor(rate: Estimate) -> tuple[float, float]:
    """Median and error factor of the lognormal distribution with a rate's two bounds.

    Parameters
    ----------
    rate : Estimate in "per_h" with two bounds above 0 (sided "two").

    Returns
    -------
    median [1/h], error factor [1]: the geometric mean of the bounds, and the ratio of the 95 %
    quantile to the median. Exact for a two-sided confidence of 0.9; for others the bounds are
    taken as that pair of quantiles and the factor is scaled to 95 %.

    Raises
    ------
    InputError : another unit, or a bound missing or 0 (no event: use the Jeffreys gamma rate).

    References
    ----------
    NUREG/CR-6823, 6.2 and appendix A.7.3: error factor of basic events.
    """
    _require_rate(rate)
    if not (rate.lower and rate.upper and rate.confidence):
        raise InputError(
            "a lognormal rate needs two bounds above 0",
            where="rate",
            evidence=str(rate),
            cure="sided='two', or sbas.integrity.tails.jeffreys.jeffreys_posterior without events",
        )
    z = -float(special.ndtri((1 - rate.confidence) / 2))
    sigma = math.log(rate.upper / rate.lower) / (2 * z)
    factor = math.exp(sigma * -float(special.ndtri(0.05)))
    return math.sqrt(rate.lower * rate.upper), factor


def _require_rate(rate: Estimate) -> None:
    if rate.unit != "per_h":
        raise InputError("not a rate per hour", where="rate", evidence=f"unit {rate.unit!r}")
