"""How long to record before counting can demonstrate a rate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from sbas.exceptions import InputError
from sbas.integrity.counting import checked_alpha, garwood_limits, is_number
from sbas.numerals import percent, upward

HOURS_PER_YEAR = 8766.0


@dataclass(frozen=True)
class Plan:
    """Exposure after which a count demonstrates a rate, and the chance that it will.

    Parameters
    ----------
    hours : exposure [h] from which on the upper bound lies below the rate.
    rate_per_h : the rate to be demonstrated [1/h].
    confidence : of the one-sided upper bound.
    events : most events with which the trial still passes.
    assumed_rate_per_h : the true rate that somebody assumes [1/h], or None.
    pass_probability : that at most `events` happen in `hours` at the assumed rate, or None.
    """

    hours: float
    rate_per_h: float
    confidence: float
    events: int
    assumed_rate_per_h: float | None
    pass_probability: float | None

    @property
    def years(self) -> float:
        """The exposure in years of 8766 h."""
        return self.hours / HOURS_PER_YEAR

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "hours": self.hours,
            "years": self.years,
            "rate_per_h": self.rate_per_h,
            "confidence": self.confidence,
            "events": self.events,
            "assumed_rate_per_h": self.assumed_rate_per_h,
            "pass_probability": self.pass_probability,
        }

    def __str__(self) -> str:
        seen = {0: "without an event", 1: "with at most 1 event"}.get(
            self.events, f"with at most {self.events} events"
        )
        assumed, chance = self.assumed_rate_per_h, self.pass_probability
        if assumed is None or chance is None:
            assumed = self.rate_per_h / 10
            chance = pass_probability(self.events, assumed, self.hours)
        return (
            f"{upward(self.hours)} h ({upward(self.years)} years) {seen} show a rate below "
            f"{self.rate_per_h:g}/h at {percent(self.confidence)} confidence.\n"
            f"If the true rate is {assumed:g}/h, the trial passes with probability {chance:.3g}."
        )


def plan_hours(
    rate_per_h: float,
    *,
    confidence: float = 0.95,
    events: int = 0,
    assumed_rate_per_h: float | None = None,
) -> Plan:
    """Hours to record until at most `events` events demonstrate a rate.

    Parameters
    ----------
    rate_per_h : rate to be demonstrated [1/h], above 0.
    confidence : of the one-sided upper bound, in [0.5, 1).
    events : events that the trial may show and still pass, a whole number.
    assumed_rate_per_h : true rate [1/h], 0 or more, for which to give the pass probability.

    Returns
    -------
    Plan; `poisson_bounds(events, plan.hours, confidence).upper` lies below `rate_per_h`.

    Raises
    ------
    InputError : an argument out of range or NaN.

    Notes
    -----
    chi2.isf(1 - confidence, 2 events + 2) / (2 rate); pass probability: Poisson distribution
    function of `events` at the mean assumed rate x hours.

    References
    ----------
    Garwood 1936, Biometrika 28, 437.

    Examples
    --------
    >>> print(plan_hours(1e-7))
    2.996×10⁷ h (3,418 years) without an event show a rate below 1e-07/h at 95 % confidence.
    If the true rate is 1e-08/h, the trial passes with probability 0.741.
    """
    checked_alpha(confidence)
    if not is_number(rate_per_h) or not 0 < rate_per_h < math.inf:
        raise InputError(
            "the rate to demonstrate is no number above 0",
            where="rate_per_h",
            evidence=repr(rate_per_h),
        )
    if not isinstance(events, int | np.integer) or isinstance(events, bool) or events < 0:
        raise InputError(
            "the events that a trial may show are a whole number of 0 or more",
            where="events",
            evidence=repr(events),
        )
    rate = float(rate_per_h)
    mean = float(garwood_limits(events, confidence)[1])
    hours = mean / rate
    if not 0 < hours < math.inf:
        raise InputError("no double holds these hours", where="rate_per_h", evidence=f"{rate!r}")
    # Rounding may leave the bound on the rate itself, which demonstrates nothing (see meets).
    while mean / hours >= rate:
        hours = math.nextafter(hours, math.inf)
    chance = None
    if assumed_rate_per_h is not None:
        chance = pass_probability(int(events), assumed_rate_per_h, hours)
        assumed_rate_per_h = float(assumed_rate_per_h)
    return Plan(
        hours=hours,
        rate_per_h=rate,
        confidence=float(confidence),
        events=int(events),
        assumed_rate_per_h=assumed_rate_per_h,
        pass_probability=chance,
    )


def pass_probability(events: int, assumed_rate_per_h: float, hours: float) -> float:
    """Probability of at most `events` events [1] in `hours` [h] at a true rate [1/h].

    Raises
    ------
    InputError : the assumed rate is below 0, NaN or infinite.
    """
    if not is_number(assumed_rate_per_h) or not 0 <= assumed_rate_per_h < math.inf:
        raise InputError(
            "the assumed rate is no number of 0 or more",
            where="assumed_rate_per_h",
            evidence=repr(assumed_rate_per_h),
        )
    return float(special.pdtr(events, float(assumed_rate_per_h) * hours))
