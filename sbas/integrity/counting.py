"""Rates of counted events with exact Poisson bounds (Garwood 1936)."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from sbas.estimate import Counted, Estimate
from sbas.exceptions import InputError

Sided = Literal["upper", "lower", "two"]
Floats = NDArray[np.float64]

# scipy's incomplete gamma functions lose digits beyond 4.5 sigma from here on; the series of
# `_large_gamma_quantile` is exact to rounding there.
_MANY_EVENTS = 1e5


def poisson_bounds(
    events: float, hours: float, confidence: float, *, sided: Sided = "upper", of: str = "events"
) -> Estimate:
    """Rate per hour of counted events, with exact Poisson bounds: `demonstrated` evidence.

    Parameters
    ----------
    events : count, 0 or more; not whole where clusters were scaled.
    hours : exposure [h], above 0.
    confidence : probability in [0.5, 1) that the stated interval holds the true rate.
    sided : "upper" (the safe side of a failure rate), "lower" or "two".
    of : what was counted, for people.

    Returns
    -------
    Estimate in "per_h" with basis Counted; a bound that `sided` does not ask for is None. No
    event gives the value 0, and the upper bound -ln(1 - confidence)/hours.

    Raises
    ------
    InputError : an argument out of range or NaN.

    References
    ----------
    Garwood 1936, Biometrika 28, 437: chi-square limits of a Poisson mean.

    Examples
    --------
    >>> print(poisson_bounds(0, 1000.0, 0.95))
    0/h (upper bound 0.002996/h) at 95 %, demonstrated: 0 events in 1000 h
    """
    lower, upper = garwood_limits(events, confidence, sided=sided)
    if np.ndim(lower):
        raise InputError("one rate has one count", where="events", evidence=repr(events)[:80])
    if not is_number(hours) or not 0 < hours < math.inf:
        raise InputError(
            "the exposure is no number of hours above 0", where="hours", evidence=repr(hours)
        )
    events, hours = float(events), float(hours)
    if not math.isfinite(float(upper if sided != "lower" else events) / hours):
        raise InputError("the exposure is too short for a rate", where="hours", evidence=f"{hours}")
    caveats = [f"exact if the {of} are independent: count clusters, never epochs"]
    if events == 0:
        caveats.append(f"no {of} seen: the value 0 is no rate, only the bound says something")
    return Estimate(
        value=events / hours,
        lower=float(lower) / hours if sided != "upper" else None,
        upper=float(upper) / hours if sided != "lower" else None,
        confidence=float(confidence),
        unit="per_h",
        basis=Counted(events=events, hours=hours, of=of),
        sided=sided,
        caveats=tuple(caveats),
    )


def garwood_limits(
    events: ArrayLike, confidence: float, *, sided: Sided = "upper"
) -> tuple[Floats, Floats]:
    """Exact limits of a Poisson mean, given the count.

    Parameters
    ----------
    events : scalar or array [1], counts of 0 or more, not necessarily whole.
    confidence : in [0.5, 1).
    sided : "upper", "lower" or "two".

    Returns
    -------
    lower, upper : arrays of the shape of `events`, expected counts [1]; 0 and infinity on a side
        that is not bounded.

    Raises
    ------
    InputError : a count below 0, NaN or infinite; a confidence outside [0.5, 1); another `sided`.

    Notes
    -----
    With a = 1 - confidence, halved if two-sided: lower = chi2.ppf(a, 2k)/2, upper =
    chi2.isf(a, 2k + 2)/2, through the gamma distribution.
    """
    if sided not in ("upper", "lower", "two"):
        raise InputError(
            f"unknown side {sided!r}", where="sided", cure="allowed are upper, lower, two"
        )
    alpha = checked_alpha(confidence) / (2 if sided == "two" else 1)
    k = np.asarray(events)
    if k.dtype.kind not in "iuf" or not np.all((k >= 0) & (k < np.inf)):
        raise InputError(
            "a count is a number of 0 or more", where="events", evidence=repr(events)[:80]
        )
    k = k.astype(np.float64)
    lower, upper = np.zeros(k.shape), np.full(k.shape, np.inf)
    many = k > _MANY_EVENTS
    if sided != "upper":
        exact = special.gammaincinv(np.where(k > 0, k, 1.0), alpha)
        quick = _large_gamma_quantile(np.maximum(k, _MANY_EVENTS), special.ndtri(alpha))
        lower = np.where(many, quick, np.where(k > 0, exact, 0.0))
    if sided != "lower":
        exact = special.gammainccinv(k + 1, alpha)
        quick = _large_gamma_quantile(np.maximum(k, _MANY_EVENTS) + 1, -special.ndtri(alpha))
        upper = np.where(many, quick, exact)
    return lower, upper


def checked_alpha(confidence: float) -> float:
    """1 - confidence, refused outside the range in which a bound lies beyond the count.

    The subtraction is exact: confidence is at least one half.
    """
    if not is_number(confidence) or not 0.5 <= confidence < 1:
        raise InputError(
            "the confidence is out of range",
            where="confidence",
            evidence=repr(confidence),
            cure="give a probability in [0.5, 1), such as 0.95",
        )
    return 1 - float(confidence)


def is_number(value: Any) -> bool:
    """Whether an argument is a real number, which True and False are not."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def _large_gamma_quantile(shape: Floats, z: float) -> Floats:
    """Quantile of a gamma distribution with a large shape, at the normal quantile z.

    Cornish-Fisher series of the standardised gamma distribution; its rest is below 2e-14
    relative from a shape of 1e5 on, for |z| < 8.3. Source: Abramowitz and Stegun 26.2.49 with the
    cumulants (r - 1)! shape.
    """
    root = np.sqrt(shape)
    return np.asarray(
        shape
        + z * root
        + (z**2 - 1) / 3
        + (z**3 - 7 * z) / (36 * root)
        - (3 * z**4 + 7 * z**2 - 16) / (810 * shape)
        + (9 * z**5 + 256 * z**3 - 433 * z) / (38880 * shape * root)
    )
