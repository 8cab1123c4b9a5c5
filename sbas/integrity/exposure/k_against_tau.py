"""K for a target risk over the decorrelation time, under each process model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BarycentricInterpolator

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure, require
from sbas.integrity.exposure.exposure_models import exposure_k
from sbas.integrity.exposure.smooth_process import second_order_omega0

Floats = NDArray[np.float64]

_TAUS = 25
_FIRST_TAU_S, _LAST_TAU_S = 30.0, 3600.0
# Exact quadrature takes up to 0.6 s for one K, and K is smooth in ln tau: a polynomial through
# so many exact ones serves for a curve.
_NODES = 7
# Beyond, samples miss upcrossings of the smooth error and Rice counts more than can be seen.
_DENSE = 0.5


@dataclass(frozen=True, eq=False)
class KAgainstTau:
    """K for a target risk over the decorrelation time; the answer of `k_against_tau`.

    Parameters
    ----------
    risk : target, probability per exposure [1].
    exposure_s, interval_s : length of the exposure and time between samples [s].
    dim : number of error components.
    nugget : share of the variance that is white.
    tau_s : (m,) 1/e times of one error component [s], rising.
    k : by model (`sbas.integrity.exposure.exposure_models.MODELS`): "naive", "rice", "ar1", and
        "nugget" where a share of white noise is given; (m,) each, NaN where the model has no K.
    """

    risk: float
    exposure_s: float
    interval_s: float
    dim: int
    nugget: float
    tau_s: Floats
    k: Mapping[str, Floats]


def k_against_tau(
    risk: float,
    *,
    exposure_s: float = 3600.0,
    interval_s: float = 1.0,
    taus_s: Sequence[float] | Floats | None = None,
    dim: int = 2,
    nugget: float = 0.0,
) -> KAgainstTau:
    """K for a target risk per exposure over the decorrelation time, under each process model.

    Parameters
    ----------
    risk : probability per exposure [1], from 1e-15 on.
    exposure_s : length of the exposure [s].
    interval_s : time between samples [s].
    taus_s : (m,) 1/e times of one error component [s], above the interval and up to the
        exposure; without them 25 from 30 s to an hour, as far as exposure and interval allow.
    dim : number of components, 1 (two-sided) to 3.
    nugget : share of the variance that is white, in [0, 0.99].

    Returns
    -------
    KAgainstTau. "naive" and "rice" are exact in their model at every tau, "ar1" and "nugget" up
    to seven; more of them are interpolated between seven exact ones, within 5e-5 relative over
    two decades of tau (2e-6 at the default tau for risks up to 0.01) and 2e-4 over three. NaN
    where a K of 1 reaches the risk already, where sampling is too sparse for a smooth error
    ("rice"; omega0 dt K > 0.5), and where more than 40000 samples fall in a tau ("ar1",
    "nugget").

    Raises
    ------
    InputError : an argument out of range, or an exposure too short for any tau.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 2.1.2, for "naive"; the others as in `exposure_k`.

    Examples
    --------
    >>> answer = k_against_tau(5e-8, taus_s=[360, 1500])
    >>> {name: k.round(3).tolist() for name, k in answer.k.items()}
    {'naive': [6.183, 5.948], 'rice': [6.456, 6.235], 'ar1': [6.724, 6.523]}
    """
    require("risk", risk, least=1e-15, below=1)
    require("nugget", nugget, least=0, most=0.99)
    taus = _taus(taus_s, exposure_s, interval_s)
    process = Exposure(exposure_s, float(taus[0]), interval_s, dim, nugget=nugget)
    curves = {
        "naive": _each(risk, process, taus, "naive"),
        "rice": _where_dense(_each(risk, process, taus, "rice"), taus, interval_s),
        "ar1": _between_nodes(risk, process, taus, "ar1"),
    }
    if nugget > 0:
        curves["nugget"] = _between_nodes(risk, process, taus, "nugget")
    return KAgainstTau(risk, exposure_s, interval_s, dim, nugget, taus, MappingProxyType(curves))


def _taus(given: Sequence[float] | Floats | None, exposure_s: float, interval_s: float) -> Floats:
    require("exposure_s", exposure_s, above=0)
    require("interval_s", interval_s, above=0)
    if given is None:
        last = min(_LAST_TAU_S, exposure_s)
        first = max(2 * interval_s, min(_FIRST_TAU_S, last / 10))
        if first >= last:
            raise InputError(
                "the exposure is not longer than two intervals: no curve over tau",
                where="exposure_s",
                evidence=f"exposure_s = {exposure_s:g}, interval_s = {interval_s:g}",
                cure="give taus_s between the interval and the exposure",
            )
        return np.geomspace(first, last, _TAUS)
    taus = np.unique(np.asarray(given, dtype=np.float64))
    if taus.size == 0:
        raise InputError(
            "no decorrelation time is given", where="taus_s", evidence=repr(given)[:80]
        )
    for tau in taus:
        require("taus_s", tau, above=interval_s, most=exposure_s)
    return taus


def _each(risk: float, process: Exposure, taus: Floats, model: str) -> Floats:
    """K at every tau; NaN where the model has none."""
    return np.array([_k(risk, replace(process, tau_s=float(tau)), model) for tau in taus])


def _k(risk: float, process: Exposure, model: str) -> float:
    try:
        return exposure_k(risk, process, model=model)
    except InputError:
        # The arguments have been checked: what is left is a K outside the range of the model.
        return math.nan


def _where_dense(k: Floats, taus: Floats, interval_s: float) -> Floats:
    omega0 = np.array([second_order_omega0(float(tau)) for tau in taus])
    return np.where(omega0 * interval_s * k <= _DENSE, k, np.nan)


def _between_nodes(risk: float, process: Exposure, taus: Floats, model: str) -> Floats:
    """K at every tau by the polynomial in ln tau through exact ones at Chebyshev points."""
    if taus.size > _NODES:
        low, high = math.log(taus[0]), math.log(taus[-1])
        cosines = np.cos(np.pi * np.arange(_NODES) / (_NODES - 1))
        nodes = (low + high) / 2 - (high - low) / 2 * cosines
        exact = _each(risk, process, np.clip(np.exp(nodes), taus[0], taus[-1]), model)
        if np.all(np.isfinite(exact)):
            curve: Floats = BarycentricInterpolator(nodes, exact)(np.log(taus))
            return curve
    return _each(risk, process, taus, model)
