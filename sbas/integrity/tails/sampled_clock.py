"""The clock of modelled rates: how often a Gauss-Markov error reaches a level anew."""

from __future__ import annotations

import math
from functools import lru_cache

from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.gauss_markov import SIEGMUND, continuous_hazard
from sbas.integrity.exposure.gauss_markov_sampled import (
    MAX_QUADRATURE_K,
    extremal_index,
    sampled_risk,
)
from sbas.integrity.k_factors import log_exceedance

# From here on the asymptotic form is within 0.5 % of the exact one for K up to 15.
_ASYMPTOTIC_PER_TAU = 100.0
_THRESHOLD_RISK = 0.05


def hazard_per_s(
    k: float,
    *,
    tau_s: float,
    interval_s: float,
    axis_ratio: float = 1.0,
    nugget: float = 0.0,
) -> float:
    """Hazard of a sampled Gauss-Markov error reaching K sigma, sigma of the major axis.

    Parameters
    ----------
    k : K factor; below 0.05 the hazard is one exceedance a sample, above 20 it is 0 (the risk
        of a sample is below 1e-86).
    tau_s, interval_s, axis_ratio, nugget : as in `sbas.integrity.exposure.exposure.Exposure`.

    Returns
    -------
    float [1/s], at most p/dt. From 100 samples per tau on without white noise: the continuous
    form at K + 0.5826 sqrt(2 dt/tau). Else p theta/dt with the exact extremal index of equal
    axes, which is at most a few per cent off for an ellipse.

    References
    ----------
    Siegmund 1985, chapter X; Leadbetter 1983, Z. Wahrscheinlichkeitstheorie verw. Gebiete 65,
    291 (extremal index).
    """
    if k > MAX_QUADRATURE_K:
        return 0.0
    if k < 0.05:
        return 1 / interval_s
    p = math.exp(float(log_exceedance(k, distribution="ellipse", axis_ratio=axis_ratio)))
    if nugget == 0 and tau_s >= _ASYMPTOTIC_PER_TAU * interval_s:
        exposure = Exposure(
            exposure_s=tau_s, tau_s=tau_s, interval_s=interval_s, axis_ratio=axis_ratio
        )
        shift = SIEGMUND * math.sqrt(2 * interval_s / tau_s)
        return min(continuous_hazard(k + shift, exposure), p / interval_s)
    return p * _theta(k, math.exp(-interval_s / tau_s), nugget) / interval_s


@lru_cache(maxsize=512)
def _theta(k: float, correlation: float, nugget: float) -> float:
    return extremal_index(k, correlation=correlation, nugget=nugget)


@lru_cache(maxsize=512)
def crossings_per_exceedance(tau_s: float, *, interval_s: float, nugget: float = 0.0) -> float:
    """Upcrossings of the 95 % quantile per sample beyond it, for equal axes, exact.

    Parameters
    ----------
    tau_s, interval_s, nugget : as in `sbas.integrity.exposure.exposure.Exposure`.

    Returns
    -------
    float [1]: (P(one of two successive samples exceeds) - p)/p at p = 0.05.
    """
    k = math.sqrt(-2 * math.log(_THRESHOLD_RISK))
    either = sampled_risk(k, correlation=math.exp(-interval_s / tau_s), samples=2, nugget=nugget)
    return (either - _THRESHOLD_RISK) / _THRESHOLD_RISK
