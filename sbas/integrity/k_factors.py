"""K factors: how many sigmas a protection level must hold for a given integrity risk.

Every distribution is handled by its cumulative hazard -ln p, never by 1 - p, so that risks of
1e-300 are as exact as risks of 0.5.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from sbas.exceptions import InputError

Distribution = Literal["rayleigh", "gaussian", "chi", "ellipse"]
Floats = NDArray[np.float64]

_OPTION_OF = {"one_sided": "gaussian", "dim": "chi", "axis_ratio": "ellipse"}
_MAX_DIM = 1000
_MAX_K = 1e8
_CHUNK_ROWS = 512
# Below this risk, halving underflows and scipy's inverse of the incomplete gamma loses digits.
_DIRECT_RISK = 1e-300
_NEWTON_STEPS = 60

# Nodes of the trapezoidal rule of `_hoyt`; the step is a power of two so that they are exact.
_STEP = 0.125
_S = np.arange(-80.0, 48.0 + _STEP, _STEP)
_COT2 = np.exp(2 * _S)
_WEIGHT = _STEP / np.pi / np.cosh(_S)


@overload
def k_factor(
    risk: float,
    *,
    distribution: Distribution = ...,
    one_sided: bool = ...,
    dim: int | None = ...,
    axis_ratio: float | None = ...,
) -> float: ...
@overload
def k_factor(
    risk: ArrayLike,
    *,
    distribution: Distribution = ...,
    one_sided: bool = ...,
    dim: int | None = ...,
    axis_ratio: ArrayLike | None = ...,
) -> Floats: ...
def k_factor(
    risk: ArrayLike,
    *,
    distribution: Distribution = "rayleigh",
    one_sided: bool = False,
    dim: int | None = None,
    axis_ratio: ArrayLike | None = None,
) -> float | Floats:
    """K whose exceedance has the given probability per sample.

    Parameters
    ----------
    risk : scalar or array [1], probability per sample that the error exceeds K sigma, in (0, 1).
    distribution : of the error in units of sigma: "rayleigh" (horizontal, circular), "gaussian"
        (one axis, two-sided), "chi" (norm of `dim` equal axes) or "ellipse" (horizontal, unequal
        axes; K multiplies the major semi-axis d_major).
    one_sided : "gaussian" only: count errors of one sign.
    dim : "chi" only: number of axes, 1 to 1000.
    axis_ratio : "ellipse" only: minor over major semi-axis in [0, 1], broadcast against `risk`.

    Returns
    -------
    float for scalars, else an array of the broadcast shape.

    Raises
    ------
    InputError : a risk or axis ratio outside its range, NaN, or an option of another distribution.

    Notes
    -----
    gaussian -ndtri(p/2) or, one-sided, -ndtri(p); rayleigh sqrt(-2 ln p); chi the root of
    Gammaincc(dim/2, K^2/2) = p; ellipse the root of the Hoyt tail, between the Gaussian and the
    Rayleigh K. Relative error below 1e-12 for every risk that a double can hold.

    References
    ----------
    Filip, Bazant, Mocek 2010, eq. 2 (Rayleigh); Hoyt 1947, Proc. IRE 35, 486 (ellipse).

    Examples
    --------
    >>> round(k_factor(5e-9), 2)
    6.18
    """
    shape = _shape(distribution, one_sided=one_sided, dim=dim, axis_ratio=axis_ratio)
    p = _numbers("risk", risk)
    _refuse_outside("risk", p, (p > 0) & (p < 1), "a probability in (0, 1), both ends excluded")
    if distribution == "rayleigh":
        k = _rayleigh_k(p)
    elif distribution == "gaussian":
        k = _gaussian_k(p, one_sided=shape.one_sided)
    elif distribution == "chi":
        k = _chi_k(p, shape.dim)
    else:
        k = _over_chunks(_ellipse_k, p, shape.axis_ratio)
    return float(k) if np.ndim(k) == 0 else k


@overload
def exceedance(
    k: float,
    *,
    distribution: Distribution = ...,
    one_sided: bool = ...,
    dim: int | None = ...,
    axis_ratio: float | None = ...,
) -> float: ...
@overload
def exceedance(
    k: ArrayLike,
    *,
    distribution: Distribution = ...,
    one_sided: bool = ...,
    dim: int | None = ...,
    axis_ratio: ArrayLike | None = ...,
) -> Floats: ...
def exceedance(
    k: ArrayLike,
    *,
    distribution: Distribution = "rayleigh",
    one_sided: bool = False,
    dim: int | None = None,
    axis_ratio: ArrayLike | None = None,
) -> float | Floats:
    """Probability per sample that the error exceeds K sigma; the inverse of `k_factor`.

    Parameters
    ----------
    k : scalar or array [1], 0 to 1e8 (negative too for the one-sided Gaussian).
    distribution, one_sided, dim, axis_ratio : as in `k_factor`.

    Returns
    -------
    float for scalars, else an array of the broadcast shape.

    Raises
    ------
    InputError : as `k_factor`; also where the probability is below the smallest normal double
        (2.2e-308), because 0 would be a wrong answer: `log_exceedance` serves there.
    """
    log_p = np.asarray(
        log_exceedance(
            k, distribution=distribution, one_sided=one_sided, dim=dim, axis_ratio=axis_ratio
        )
    )
    if np.any(log_p < math.log(np.finfo(np.float64).tiny)):
        raise InputError(
            "the exceedance probability is too small for a double",
            where="k",
            evidence=f"ln p = {float(log_p.min()):.6g}",
            cure="sbas.integrity.k_factors.log_exceedance gives its logarithm",
        )
    p = np.exp(log_p)
    return float(p) if np.ndim(p) == 0 else p


@overload
def log_exceedance(
    k: float,
    *,
    distribution: Distribution = ...,
    one_sided: bool = ...,
    dim: int | None = ...,
    axis_ratio: float | None = ...,
) -> float: ...
@overload
def log_exceedance(
    k: ArrayLike,
    *,
    distribution: Distribution = ...,
    one_sided: bool = ...,
    dim: int | None = ...,
    axis_ratio: ArrayLike | None = ...,
) -> Floats: ...
def log_exceedance(
    k: ArrayLike,
    *,
    distribution: Distribution = "rayleigh",
    one_sided: bool = False,
    dim: int | None = None,
    axis_ratio: ArrayLike | None = None,
) -> float | Floats:
    """Natural logarithm of `exceedance`, which does not underflow.

    Parameters, errors and source as in `exceedance` and `k_factor`.
    """
    shape = _shape(distribution, one_sided=one_sided, dim=dim, axis_ratio=axis_ratio)
    k = _numbers("k", k)
    lowest = -_MAX_K if shape.one_sided else 0.0
    _refuse_outside("k", k, (k >= lowest) & (k <= _MAX_K), f"a number in [{lowest:g}, {_MAX_K:g}]")
    if distribution == "rayleigh":
        log_p = 0.0 - k * k / 2
    elif distribution == "gaussian":
        log_p = special.log_ndtr(-k) + (0.0 if shape.one_sided else math.log(2))
    elif distribution == "chi":
        log_p = _chi_log_tail(k, shape.dim)
    else:
        log_p = _over_chunks(lambda k, q: -_hoyt(k, q)[0], k, shape.axis_ratio)
    return float(log_p) if np.ndim(log_p) == 0 else log_p


# --- validation -------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Shape:
    one_sided: bool
    dim: int
    axis_ratio: Floats


def _shape(distribution: str, *, one_sided: Any, dim: Any, axis_ratio: Any) -> _Shape:
    """The checked options of a distribution."""
    if distribution not in get_args(Distribution):
        raise InputError(
            f"unknown distribution {distribution!r}",
            where="distribution",
            cure=f"allowed are {', '.join(get_args(Distribution))}",
        )
    given = {"one_sided": one_sided is not False, "dim": dim is not None}
    given["axis_ratio"] = axis_ratio is not None
    for option, owner in _OPTION_OF.items():
        if given[option] and distribution != owner:
            raise InputError(
                f"{option} belongs to the distribution {owner!r}, not to {distribution!r}",
                where=option,
                cure=f"leave {option} out, or use distribution={owner!r}",
            )
    if not isinstance(one_sided, bool | np.bool_):
        raise InputError("one_sided is True or False", where="one_sided", evidence=repr(one_sided))
    if distribution == "chi":
        whole = isinstance(dim, int | np.integer) and not isinstance(dim, bool)
        if not whole or not 1 <= dim <= _MAX_DIM:
            raise InputError(
                "the distribution 'chi' needs dim, the number of axes",
                where="dim",
                evidence=repr(dim),
                cure=f"allowed is a whole number from 1 to {_MAX_DIM}",
            )
    if distribution == "ellipse" and axis_ratio is None:
        raise InputError(
            "the distribution 'ellipse' needs axis_ratio, minor over major semi-axis",
            where="axis_ratio",
            cure="allowed is a number in [0, 1]",
        )
    q = _numbers("axis_ratio", 1.0 if axis_ratio is None else axis_ratio)
    _refuse_outside("axis_ratio", q, (q >= 0) & (q <= 1), "a number in [0, 1]")
    return _Shape(bool(one_sided), 1 if dim is None else int(dim), q)


def _numbers(name: str, values: Any) -> Floats:
    try:
        array = np.asarray(values)
    except ValueError:  # rows of unequal length
        array = np.asarray(None)
    if array.dtype.kind not in "iuf" or np.ma.isMaskedArray(values):
        raise InputError(f"{name} is not a number", where=name, evidence=repr(values)[:80])
    return array.astype(np.float64)


def _refuse_outside(name: str, values: Floats, inside: NDArray[np.bool_], allowed: str) -> None:
    if np.all(inside):
        return
    outside = np.atleast_1d(values)[~np.atleast_1d(inside)]
    where = name if values.ndim == 0 else f"{name}[{int(np.flatnonzero(~inside)[0])}]"
    raise InputError(
        f"{name} is out of range",
        where=where,
        evidence=f"{float(outside[0])!r}",
        cure=f"give {allowed}",
    )


# --- the distributions ------------------------------------------------------------------------


def _rayleigh_k(p: Floats) -> Floats:
    k: Floats = np.sqrt(-2 * np.log(p))
    return k


def _gaussian_k(p: Floats, *, one_sided: bool) -> Floats:
    """K of a Gaussian axis; ndtri of the small number, its logarithm where halving underflows."""
    sides = 1 if one_sided else 2
    # Subtracted from 0.0, so that K of one half is 0 and not -0.
    direct = 0.0 - special.ndtri(np.maximum(p, _DIRECT_RISK) / sides)
    deep = -special.ndtri_exp(np.log(p) - math.log(sides))
    k: Floats = np.where(p < _DIRECT_RISK, deep, direct)
    return k


def _chi_k(p: Floats, dim: int) -> Floats:
    k = np.array(np.sqrt(2 * special.gammainccinv(dim / 2, np.maximum(p, _DIRECT_RISK))))
    deep = p < _DIRECT_RISK
    if np.any(deep):
        k[deep] = _root(-np.log(p[deep]), k[deep], lambda k: _chi_hazard(k, dim))
    return k


def _chi_log_tail(k: Floats, dim: int) -> Floats:
    """ln Gammaincc(dim/2, k^2/2), by its finite sum of positive terms where it underflows.

    Source: Abramowitz and Stegun 26.4.4 and 26.4.5 (odd and even degrees of freedom).
    """
    x = k * k / 2
    tail = special.gammaincc(dim / 2, x)
    deep = tail < _DIRECT_RISK
    log_tail = np.array(np.log(np.where(deep, 1.0, tail)))
    if np.any(deep):
        x = x[deep]
        power = np.arange(dim / 2 - 1, -0.75, -1)[:, None]
        terms = power * np.log(x) - special.gammaln(power + 1)
        if dim % 2:
            erfc = special.log_ndtr(-np.sqrt(2 * x)) + math.log(2) + x
            terms = np.vstack([terms[:-1], erfc[None]])
        log_tail[deep] = special.logsumexp(terms, axis=0) - x
    return log_tail


def _chi_hazard(k: Floats, dim: int) -> tuple[Floats, Floats]:
    """Cumulative hazard -ln p of the chi distribution at k, and its derivative."""
    log_tail = _chi_log_tail(k, dim)
    log_density = (
        (dim - 1) * np.log(k) - k * k / 2 - (dim / 2 - 1) * math.log(2) - special.gammaln(dim / 2)
    )
    return -log_tail, np.exp(log_density - log_tail)


def _ellipse_k(p: Floats, q: Floats) -> Floats:
    """K of the Hoyt distribution; (n,) risks and axis ratios."""
    low, high = _gaussian_k(p, one_sided=False), _rayleigh_k(p)
    k = np.empty_like(p)
    for near_one in (False, True):
        rows = (p > 0.5) == near_one
        if np.any(rows):
            ratio = q[rows]
            k[rows] = _root(
                -np.log(p[rows]),
                low[rows] + (high[rows] - low[rows]) * ratio**4,
                lambda k, q=ratio, near_one=near_one: _hoyt(k, q, near_one=near_one),  # type: ignore[misc]
            )
    # The K of the two limits bounds every ellipse; rounding must not break that order.
    return np.clip(k, low, high)


def _hoyt(k: Floats, q: Floats, *, near_one: bool = False) -> tuple[Floats, Floats]:
    """Cumulative hazard -ln p(k, q) of the Hoyt distribution and its derivative; (n,) each.

    With the polar angle t of the whitened error and s = ln cot t,

        p = 1/pi * integral over all s of exp(-(k^2/2) g(s)) / cosh(s),
        g = (1 + e^2s) / (e^2s + q^2).

    The integrand is analytic for |Im s| < pi/2 and bounded for |Im s| <= pi/4 whatever k and q
    are, so that the trapezoidal rule errs by about exp(-pi^2/(2 step)) = 7e-18, and its tails
    fall as exp(-|s|). A rule in t itself fails at small q and k (1e-5 at q = 0, k = 0.05).
    All terms are positive: exp(-k^2/2) is taken out of p, and where p is `near_one` 1 - p is
    summed instead.
    """
    k, q = k[:, None], q[:, None]
    half = k * k / 2
    above_one = (1 - q) * (1 + q) / (_COT2 + q * q)
    g = 1 + above_one
    scaled = np.exp(-half * above_one) * _WEIGHT
    scaled_p = scaled.sum(axis=1)
    slope = (k * g * scaled).sum(axis=1) / scaled_p
    if near_one:
        complement = (-np.expm1(-half * g) * _WEIGHT).sum(axis=1)
        return -np.log1p(-complement), slope
    return half[:, 0] - np.log(scaled_p), slope


def _root(
    target: Floats, start: Floats, hazard: Callable[[Floats], tuple[Floats, Floats]]
) -> Floats:
    """K where the cumulative hazard has the target value, by Newton's method on logarithms.

    ln(-ln p) is nearly a straight line in ln K (slope 1 to 2 for the error distributions here),
    hence a handful of steps from any start; they converge quadratically, so that a last step
    of 1e-10 leaves nothing but rounding.
    """
    log_k = np.log(start)
    log_target = np.log(target)
    for _ in range(_NEWTON_STEPS):
        k = np.exp(log_k)
        value, slope = hazard(k)
        step = (np.log(value) - log_target) * value / (slope * k)
        log_k = log_k - step
        if np.all(np.abs(step) < 1e-10):
            return np.asarray(np.exp(log_k))
    raise ArithmeticError("the K factor did not converge; please report the arguments")


def _over_chunks(
    function: Callable[[Floats, Floats], Floats], first: Floats, second: Floats
) -> Floats:
    """function(first, second) for any broadcast shape, in chunks that bound the memory."""
    try:
        first, second = np.broadcast_arrays(first, second)
    except ValueError as error:
        raise InputError(
            "axis_ratio does not fit the shape of the other argument",
            where="axis_ratio",
            evidence=f"shapes {first.shape} and {second.shape}",
        ) from error
    result = np.empty(first.size)
    a, b = first.ravel(), second.ravel()
    for start in range(0, first.size, _CHUNK_ROWS):
        rows = slice(start, start + _CHUNK_ROWS)
        result[rows] = function(a[rows], b[rows])
    return result.reshape(first.shape)
