"""Smooth (twice differentiable) errors: exceedances by Rice's formula.

A smooth error crosses a level once where a Gauss-Markov error crosses it many times, so that its
risk is the lower of the two at the same 1/e time. All of its motion is in one figure, omega0.
"""

from __future__ import annotations

import math

import numpy as np

from sbas.integrity.exposure.exposure import (
    MAX_K,
    Exposure,
    per_sample_risk,
    require,
    require_dim,
    risk_from_hazard,
)

SECOND_ORDER_TAU = 2.146193220620583
"""1/e time of (1 + x) exp(-x): the tau of a second-order Gauss-Markov process, in its a."""

# Trapezoidal rule in s = ln cot t, as in `k_factors`: exact to rounding for every axis ratio.
_S = np.arange(-40.0, 40.125, 0.125)
_COT2 = np.exp(2 * _S)
_WEIGHT = 0.125 / np.pi / np.cosh(_S)


def second_order_omega0(tau_s: float) -> float:
    """omega0 of a second-order Gauss-Markov error, r(t) = (1 + t/a) exp(-t/a).

    Parameters
    ----------
    tau_s : 1/e time of r [s].

    Returns
    -------
    float [rad/s]: sqrt(-r''(0)) = 1/a with a = tau/2.146193.

    Raises
    ------
    InputError : tau out of range.
    """
    require("tau_s", tau_s, above=0)
    return SECOND_ORDER_TAU / tau_s


def gaussian_acf_omega0(tau_s: float) -> float:
    """omega0 of an error with r(t) = exp(-(t/tau)^2).

    Parameters
    ----------
    tau_s : 1/e time of r [s].

    Returns
    -------
    float [rad/s]: sqrt(-r''(0)) = sqrt(2)/tau.

    Raises
    ------
    InputError : tau out of range.
    """
    require("tau_s", tau_s, above=0)
    return math.sqrt(2) / tau_s


def filtered_omega0(tau_s: float, *, filter_tau_s: float) -> float:
    """omega0 of a Gauss-Markov error after a first-order low-pass, such as carrier smoothing.

    Parameters
    ----------
    tau_s : 1/e time before the filter [s].
    filter_tau_s : time constant of the filter [s].

    Returns
    -------
    float [rad/s]: 1/sqrt(tau tau_f), from the spectrum 1/((1 + (w tau)^2)(1 + (w tau_f)^2)).

    Raises
    ------
    InputError : an argument out of range.
    """
    require("tau_s", tau_s, above=0)
    require("filter_tau_s", filter_tau_s, above=0)
    return 1 / math.sqrt(tau_s * filter_tau_s)


def rice_hazard(k: float, *, omega0: float, dim: int = 2, axis_ratio: float = 1.0) -> float:
    """Rate of upcrossings of K sigma by the norm of a smooth Gaussian error.

    Parameters
    ----------
    k : K factor, 1 to 35: below 1 upcrossings of a norm are no measure of its exceedances.
    omega0 : sqrt(-r''(0)) of each component [rad/s].
    dim : number of components, 1 (two-sided) to 3.
    axis_ratio : minor over major axis, in [0, 1], for dim = 2; K multiplies the major axis.

    Returns
    -------
    float [1/s].

    Raises
    ------
    InputError : an argument out of range.

    Notes
    -----
    h = omega0/sqrt(2 pi) times the chi density at K: (omega0/pi) exp(-K^2/2) for dim = 1,
    K omega0/sqrt(2 pi) exp(-K^2/2) for dim = 2. Ellipse: the outward flux through the circle,
    omega0 K/sqrt(2 pi) * mean over t of exp(-K^2 g/2) g sqrt((cos^2 t + q^4 sin^2 t) g),
    1/g = cos^2 t + q^2 sin^2 t.

    References
    ----------
    Rice 1944-45, Bell Syst. Tech. J. 23 and 24, eq. 3.3-5; Belyaev 1968, Theory Probab. Appl.
    13, 320 (exits of a vector process from a region).
    """
    require("k", k, least=1, most=MAX_K)
    require("omega0", omega0, above=0)
    require_dim(dim)
    require("axis_ratio", axis_ratio, least=0, most=1 if dim == 2 else math.inf)
    if dim == 2:
        q2 = axis_ratio**2
        g = (1 + _COT2) / (_COT2 + q2)
        speed = np.sqrt((_COT2 + q2 * q2) / (_COT2 + q2))
        # g = 1 + above_one, so that exp(-K^2/2) stands before a sum of terms up to 1.
        above_one = (1 - axis_ratio) * (1 + axis_ratio) / (_COT2 + q2)
        density = k * float(np.sum(_WEIGHT * g * speed * np.exp(-k * k / 2 * above_one)))
    else:
        density = math.sqrt(2 / math.pi) * k ** (dim - 1)
    return omega0 / math.sqrt(2 * math.pi) * density * math.exp(-k * k / 2)


def smooth_risk(k: float, exposure: Exposure) -> float:
    """Risk of an exposure of a second-order Gauss-Markov error with the exposure's 1/e time.

    Parameters
    ----------
    k : K factor, 1 to 35.
    exposure : length, tau, dimension and axis ratio. It should be sampled densely,
        omega0 dt K << 1, or else the risk is overestimated.

    Returns
    -------
    float [1]: 1 - (1 - p) exp(-h T), h the upcrossing rate.

    Raises
    ------
    InputError : K out of range.

    References
    ----------
    Cramer and Leadbetter 1967, Stationary and Related Stochastic Processes, chapter 12: upcrossings
    of a high level tend to a Poisson process.
    """
    hazard = rice_hazard(
        k,
        omega0=second_order_omega0(exposure.tau_s),
        dim=exposure.dim,
        axis_ratio=exposure.axis_ratio,
    )
    return risk_from_hazard(
        per_sample_risk(k, exposure), hazard_per_s=hazard, exposure_s=exposure.exposure_s
    )
