"""The clock of modelled rates: how often a Gauss-Markov error reaches a level anew."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.gauss_markov import SIEGMUND, continuous_hazard
from sbas.integrity.exposure.gauss_markov_sampled import (
    MAX_QUADRATURE_K,
    extremal_index,
    sampled_risk,
)
from sbas.integrity.k_factors import log_exceedance

Floats = NDArray[np.float64]

# From here on the asymptotic form is within 0.5 % of the exact one for K up to 15.
_ASYMPTOTIC_PER_TAU = 100.0
_LEAST_K = 0.05
_THRESHOLD_RISK = 0.05
# Steps of ln K between tabulated hazards: the exact ones are smooth and take milliseconds each,
# the asymptotic ones have corners (where bounds take over) and are cheap.
_EXACT_STEP, _ASYMPTOTIC_STEP = 0.1, 0.01
_STENCIL = 4


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
    if k < _LEAST_K:
        return 1 / interval_s
    p = math.exp(float(log_exceedance(k, distribution="ellipse", axis_ratio=axis_ratio)))
    if _is_asymptotic(tau_s, interval_s, nugget):
        exposure = Exposure(
            exposure_s=tau_s, tau_s=tau_s, interval_s=interval_s, axis_ratio=axis_ratio
        )
        shift = SIEGMUND * math.sqrt(2 * interval_s / tau_s)
        return min(continuous_hazard(k + shift, exposure), p / interval_s)
    return p * _theta(k, math.exp(-interval_s / tau_s), nugget) / interval_s


def log_hazards(
    k: Floats,
    *,
    tau_s: float,
    interval_s: float,
    axis_ratio: float = 1.0,
    nugget: float = 0.0,
) -> Floats:
    """Logarithms of `hazard_per_s` at many levels, from a table that grows as it is used.

    Parameters
    ----------
    k : (m,) K factors, at least one.
    tau_s, interval_s, axis_ratio, nugget : as for `hazard_per_s`.

    Returns
    -------
    (m,) ln of the hazard [1/s], -inf where it is 0; within 1e-3 of `hazard_per_s`, from K = 0.3
    on within 3e-4.

    Notes
    -----
    ln h + K^2/2 bends little over ln K: Lagrange polynomials through the four nearest nodes.
    """
    step = _ASYMPTOTIC_STEP if _is_asymptotic(tau_s, interval_s, nugget) else _EXACT_STEP
    # Nodes are counted downwards from the largest K, where the hazard ends.
    at = np.log(MAX_QUADRATURE_K / np.clip(k, _LEAST_K, MAX_QUADRATURE_K)) / step
    last = math.ceil(math.log(MAX_QUADRATURE_K / _LEAST_K) / step)
    first = np.clip(np.floor(at).astype(int) - (_STENCIL // 2 - 1), 0, last - _STENCIL + 1)
    lowest, nodes = int(first.min()), range(int(first.min()), int(first.max()) + _STENCIL)
    table = np.array([_node(i, step, tau_s, interval_s, axis_ratio, nugget) for i in nodes])
    offset, found = at - first, np.zeros(k.shape)
    for j in range(_STENCIL):
        others = [m for m in range(_STENCIL) if m != j]
        weight = math.prod((offset - m) / (j - m) for m in others)
        found += weight * table[first - lowest + j]
    found -= k * k / 2
    found[k < _LEAST_K] = -math.log(interval_s)
    found[k > MAX_QUADRATURE_K] = -math.inf
    return found


def _is_asymptotic(tau_s: float, interval_s: float, nugget: float) -> bool:
    return nugget == 0 and tau_s >= _ASYMPTOTIC_PER_TAU * interval_s


@lru_cache(maxsize=4096)
def _node(
    i: int, step: float, tau_s: float, interval_s: float, axis_ratio: float, nugget: float
) -> float:
    """ln h + K^2/2 at the node i of `log_hazards`."""
    k = max(MAX_QUADRATURE_K * math.exp(-i * step), _LEAST_K)
    hazard = hazard_per_s(
        k, tau_s=tau_s, interval_s=interval_s, axis_ratio=axis_ratio, nugget=nugget
    )
    return math.log(hazard) + k * k / 2


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
