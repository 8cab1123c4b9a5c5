"""First-order Gauss-Markov errors in continuous time, and their asymptotic form when sampled.

The hazard of leaving a ball is the smallest root of a Kummer function; sampling every dt acts
like a slightly larger K. The exact sampled risk is in `gauss_markov_sampled`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import special

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import (
    MAX_K,
    MIN_K,
    Exposure,
    per_sample_risk,
    require,
    require_dim,
    risk_from_hazard,
)

SIEGMUND = float(-special.zeta(0.5)) / math.sqrt(2 * math.pi)
"""Mean overshoot of a Gaussian random walk over a far wall, in steps: 0.5826."""


def kummer_root(k: float, *, dim: int = 2) -> float:
    """Decay rate, per tau, with which a continuous Gauss-Markov error leaves the ball of K sigma.

    Parameters
    ----------
    k : radius in sigma, 1e-3 to 35.
    dim : number of components, 1 to 3.

    Returns
    -------
    float [1]: nu; the hazard is nu/tau.

    Raises
    ------
    InputError : an argument out of range.

    Notes
    -----
    nu = 2a with a the smallest positive root of M(-a, dim/2, z) = 0, z = K^2/2. Written as

        1/a = sum over n >= 1 of z^n / ((dim/2)_n n) * prod over j < n of (1 - a/j),

    every term is positive for a <= 1, that is for K >= sqrt(dim): no cancellation however small
    nu is. Below, z is small and M well conditioned. The root lies between a0 = 1/sum(a = 0)
    and 2 a0 (their ratio is greatest at K -> 0: pi^2/6 for dim = 3).

    References
    ----------
    Kummer equation as the eigenvalue problem of the Ornstein-Uhlenbeck generator in a ball:
    Abramowitz and Stegun 13.1.1, 13.1.2.
    """
    require("k", k, least=MIN_K, most=MAX_K)
    require_dim(dim)
    from scipy.optimize import brentq  # 0.1 s to load: only where a hazard is asked for

    z = k * k / 2
    n = np.arange(1, int(z + 20 * math.sqrt(z) + 60) + 1)

    def series(a: float) -> float:
        # Successive quotients: neither z^n, n! nor the product is formed, which could overflow.
        quotients = z * (n - a) / ((dim / 2 + n) * (n + 1))
        terms = np.cumprod(np.concatenate(([2 * z / dim], quotients[:-1])))
        return float(terms.sum())

    lowest = 1 / series(0.0)
    ratio = brentq(
        lambda ratio: ratio * lowest * series(ratio * lowest) - 1, 1 - 1e-9, 2, xtol=1e-15
    )
    return float(2 * ratio * lowest)


def continuous_hazard(k: float, exposure: Exposure) -> float:
    """Hazard of a continuous Gauss-Markov error leaving K sigma.

    Parameters
    ----------
    k : K factor, 1e-3 to 35.
    exposure : its `tau_s`, `dim` and `axis_ratio` count.

    Returns
    -------
    float [1/s].

    Raises
    ------
    InputError : K out of range.

    Notes
    -----
    Equal axes: `kummer_root`/tau. Ellipse: nu(q) = c K f(K, q), f the Hoyt density and
    c = nu_1(K)/(2 K phi(K)), kept between the roots of one and of two equal axes, which bound
    it (Anderson 1955). For K >= 3; measured against a two-dimensional grid in
    docs/methods/exposure.md.
    """
    if exposure.axis_ratio == 1:
        return kummer_root(k, dim=exposure.dim) / exposure.tau_s
    line, circle = kummer_root(k, dim=1), kummer_root(k, dim=2)
    # 2 phi(K) is the Hoyt density at q = 0.
    log_ratio = _log_hoyt_density(k, exposure.axis_ratio) - _log_hoyt_density(k, 0.0)
    nu = line * math.exp(log_ratio)
    return min(max(nu, line), circle) / exposure.tau_s


def _log_hoyt_density(k: float, axis_ratio: float) -> float:
    """ln of the density of the horizontal error at K, in units of the major axis.

    f = (K/q) exp(-K^2/2) i0e(K^2 (1 - q^2)/(4 q^2)); Hoyt 1947, Proc. IRE 35, 486.
    """
    # Below, i0e's argument overflows; the density differs from that of q = 0 by q^2/2.
    if axis_ratio < 1e-9:
        return -k * k / 2 + 0.5 * math.log(2 / math.pi)
    z = k * k * (1 - axis_ratio) * (1 + axis_ratio) / (4 * axis_ratio**2)
    return -k * k / 2 + math.log(k / axis_ratio) + math.log(float(special.i0e(z)))


def continuous_risk(k: float, exposure: Exposure) -> float:
    """Risk of an exposure if the Gauss-Markov error were watched in continuous time.

    Parameters
    ----------
    k : K factor, 1e-3 to 35.
    exposure : length, tau, dimension and axis ratio.

    Returns
    -------
    float [1]: 1 - (1 - p) exp(-h T).

    Raises
    ------
    InputError : K out of range.

    Notes
    -----
    Not exact: the error starts stationary, not in its slowest mode, so that this is low by
    about one per-sample risk (at K = 6.18: 0.3 % of the risk in 10 tau, 1.3 % in 2.4 tau, more
    in shorter exposures). `sampled_risk` has no such error.
    """
    return risk_from_hazard(
        per_sample_risk(k, exposure),
        hazard_per_s=continuous_hazard(k, exposure),
        exposure_s=exposure.exposure_s,
    )


def siegmund_risk(k: float, exposure: Exposure) -> float:
    """Risk of an exposure of a sampled Gauss-Markov error, asymptotically for dt << tau.

    Parameters
    ----------
    k : K factor, 1e-3 to 30.
    exposure : all but `nugget` count.

    Returns
    -------
    float [1]: the continuous form with the hazard at K + 0.5826 sqrt(2 dt/tau). Low by 0.6 to
    0.9 per-sample risks (at K = 6.18, 1 Hz: 0.24 % in an hour at tau = 360 s, 1.1 % at 1500 s,
    but 4.5 and 15 % in 150 s), and by more where tau < 30 dt.

    Raises
    ------
    InputError : K out of range.

    References
    ----------
    Siegmund 1985, Sequential Analysis, chapter X: the wall of a random walk is effectively
    further away by the mean overshoot, -zeta(1/2)/sqrt(2 pi) steps.
    """
    require("k", k, least=MIN_K, most=30)
    shift = SIEGMUND * math.sqrt(2 * exposure.interval_s / exposure.tau_s)
    return risk_from_hazard(
        per_sample_risk(k, exposure),
        hazard_per_s=continuous_hazard(k + shift, exposure),
        exposure_s=exposure.exposure_s,
    )


# --- one tau for other processes --------------------------------------------------------------


def mixture_short_tau_s(weights: Sequence[float], taus_s: Sequence[float]) -> float:
    """tau that sets the exceedances of a sum of independent Gauss-Markov parts.

    Parameters
    ----------
    weights : shares of the variance, each above 0, summing to 1 within 1e-9.
    taus_s : 1/e times of the parts [s].

    Returns
    -------
    float [s]: 1/sum(w/tau) = -1/r'(0+). Exact for high levels, else it overestimates the risk;
    the tau fitted to the whole autocorrelation is far too long.

    Raises
    ------
    InputError : lengths that differ, or a share or tau out of range.

    References
    ----------
    Pickands 1969, Trans. Am. Math. Soc. 145, 51: the hazard of a high level depends on the
    autocorrelation through its slope at 0 only.
    """
    w, tau = _positive("weights", weights), _positive("taus_s", taus_s)
    if w.size != tau.size or abs(float(w.sum()) - 1) > 1e-9:
        raise InputError(
            "a mixture needs one share of the variance for each tau, with sum 1",
            where="weights",
            evidence=f"{w.size} weights with sum {float(w.sum()):.9g}, {tau.size} taus",
        )
    return 1 / float(np.sum(w / tau))


def lag_one_tau_s(correlation: float, *, interval_s: float) -> float:
    """tau of the sampled Gauss-Markov process with the given correlation at one interval.

    Parameters
    ----------
    correlation : of successive samples [1], in (0, 1).
    interval_s : time between samples [s].

    Returns
    -------
    float [s]: -dt/ln r(dt). White noise in the record shortens it, so that the risk computed
    from it is too high rather than too low (Slepian's inequality for one one-sided component;
    otherwise an estimate).

    Raises
    ------
    InputError : an argument out of range.
    """
    require("correlation", correlation, above=0, below=1)
    require("interval_s", interval_s, above=0)
    return -interval_s / math.log(correlation)


def _positive(name: str, values: Sequence[float]) -> NDArray[np.float64]:
    if len(values) == 0:
        raise InputError(f"{name} is empty", where=name)
    for i, value in enumerate(values):
        require(f"{name}[{i}]", value, above=0)
    return np.asarray(values, dtype=np.float64)
