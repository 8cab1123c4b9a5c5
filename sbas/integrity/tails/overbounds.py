"""Gaussian distributions that bound an empirical one: CDF, paired and two-step overbounds.

A range error enters a protection level through its overbound. What few effective samples can
show of a tail is limited: the part of the distribution that is bounded empirically ends where
ten effective samples are left.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import require

Floats = NDArray[np.float64]

LEAST_SAMPLES = 100
NEAREST_QUANTILE = 0.45
"""The sigma is taken over quantiles up to this; at the median any sigma fits."""


@dataclass(frozen=True)
class Overbound:
    """N(-bias, sigma) and N(bias, sigma) that bound an error from both sides.

    Parameters
    ----------
    bias_m, sigma_m : of the bound; bias 0 for a CDF overbound. Used as
        K sigma + sum |S| bias in a protection level.
    left_sigma_m, right_sigma_m : what each tail alone needs.
    tail_probability : smallest empirical quantile that was bounded.
    caveats : sentences that must travel with the figure.
    """

    method: str
    bias_m: float
    sigma_m: float
    left_sigma_m: float
    right_sigma_m: float
    tail_probability: float
    caveats: tuple[str, ...] = ()


def tail_sigma(error_m: ArrayLike, *, tail_probability: float) -> float:
    """Smallest sigma whose Gaussian bounds the lower tail of an error.

    Parameters
    ----------
    error_m : (n,) errors [m]; their upper tail is that of the negated error.
    tail_probability : smallest quantile that is bounded, in (0, 0.45).

    Returns
    -------
    float [m]: the largest of x_i/Phi^-1(i/n) over the sorted negative x_i with i/n from
    `tail_probability` to 0.45; 0 where no error is negative there.

    Raises
    ------
    InputError : fewer than 100 errors, NaN among them, or a probability out of range.

    References
    ----------
    DeCleene 2000, ION GPS, 2679 (CDF overbounding).

    Examples
    --------
    >>> from scipy.special import ndtri
    >>> errors = 2 * ndtri((np.arange(1000) + 1) / 1001)
    >>> round(tail_sigma(errors, tail_probability=0.01), 2)
    2.0
    """
    x = _sorted_errors(error_m)
    return _left_sigma(x, tail_probability)


def cdf_overbound(error_m: ArrayLike, *, n_eff: float) -> Overbound | Refusal:
    """Zero-mean Gaussian that bounds both tails of an error.

    Parameters
    ----------
    error_m : (n,) errors [m].
    n_eff : effective samples, `sbas.integrity.exposure.exposure.n_eff_variance` at the upper
        limit of tau.

    Returns
    -------
    Overbound with bias 0, or a Refusal: too few effective samples, or a median off zero by more
    than three of its standard deviations (a bias belongs into the paired overbound, never into
    sigma).

    Raises
    ------
    InputError : bad errors, or an effective number that is not positive.

    Notes
    -----
    F_ob(x) >= F(x) for x < 0 and <= for x > 0. It carries over to sums of errors only where
    each error is symmetric, unimodal and of zero mean. Quantiles below 10/n_eff are not bounded.

    References
    ----------
    DeCleene 2000, ION GPS, 2679.
    """
    x = _sorted_errors(error_m)
    p = _tail_probability(n_eff, x.size)
    if isinstance(p, Refusal):
        return p
    left, right = _left_sigma(x, p), _left_sigma(-x[::-1], p)
    median = float(np.median(x))
    spread = (float(np.quantile(x, special.ndtr(1))) - float(np.quantile(x, special.ndtr(-1)))) / 2
    # Standard deviation of the median of n_eff Gaussian samples: sqrt(pi/2/n) sigma.
    if abs(median) > 3 * spread * math.sqrt(math.pi / 2 / n_eff):
        return Refusal(
            f"the median error is {median:.3g} m off zero: no zero-mean Gaussian bounds it",
            "use the paired overbound",
        )
    return Overbound("cdf", 0.0, max(left, right), left, right, p, _caveats(n_eff, p))


def paired_overbound(
    error_m: ArrayLike, *, n_eff: float, bias_m: float | None = None
) -> Overbound | Refusal:
    """Pair of Gaussians N(-b, s) and N(b, s) between which the distribution of an error lies.

    Parameters
    ----------
    error_m : (n,) errors [m]; neither symmetry, one mode nor a zero mean is needed.
    n_eff : as in `cdf_overbound`.
    bias_m : b [m], not negative; None takes the median's distance from zero plus 1.645 of its
        standard deviations.

    Returns
    -------
    Overbound with the smallest s for that b over the quantiles of 10/n_eff and more, or a
    Refusal with too few effective samples, or where no s serves: the median lies beyond b.

    Raises
    ------
    InputError : bad errors, or an argument out of range.

    Notes
    -----
    Left bound: Phi((x + b)/s) >= F(x) for all bounded x, the right one likewise: for each
    quantile p < 1/2, s >= (-x_p - b)/(-Phi^-1(p)), and for p > 1/2, where the left bound must
    still lie above F, s <= (x_p + b)/Phi^-1(p). Where both cannot hold b is raised to the
    smallest multiple (by 5 %) that serves.

    References
    ----------
    Rife, Pullen, Enge, Pervan 2006, IEEE Trans. Aerosp. Electron. Syst. 42, 386 (paired
    overbounding).
    """
    x = _sorted_errors(error_m)
    p = _tail_probability(n_eff, x.size)
    if isinstance(p, Refusal):
        return p
    if bias_m is None:
        bias_m = _default_bias(x, n_eff)
    require("bias_m", bias_m, least=0)
    raised = 0
    bias = bias_m
    while raised < 200:
        left, right = _one_side(x, bias, p), _one_side(-x[::-1], bias, p)
        sigma = max(left[0], right[0])
        if sigma <= min(left[1], right[1]):
            caveats = _caveats(n_eff, p)
            if raised:
                caveats += (f"the bias was raised from {bias_m:.4g} to {bias:.4g} m to bound "
                            "the body",)  # fmt: skip
            return Overbound("paired", bias, sigma, left[0], right[0], p, caveats)
        # From zero there is no multiple: start at a thousandth of the spread.
        bias = max(bias * 1.05, float(x[-1] - x[0]) * 1e-3)
        raised += 1
    return Refusal("no pair of Gaussians bounds these errors", "look for outliers or two modes")


def two_step_overbound(error_m: ArrayLike, *, n_eff: float) -> Overbound | Refusal:
    """Gaussians over symmetric, unimodal distributions that bound an error from both sides.

    Parameters
    ----------
    error_m : (n,) errors [m].
    n_eff : as in `cdf_overbound`.

    Returns
    -------
    Overbound: the pair of `paired_overbound`, but its sigma has to bound an intermediate
    distribution only, which may follow the body of the error closely; a Refusal as there.

    Raises
    ------
    InputError : bad errors, or an effective number that is not positive.

    Notes
    -----
    Left side: wanted is a distribution symmetric about -b, unimodal, with tail S(t) beyond
    distance t. It lies above F if F(-b - t) <= S(t) <= 1 - F(-b + t); unimodal means that S is
    convex; the Gaussian bounds it if S(t) <= Phi(-t/s). Such an S exists where the convex
    minorant of the smaller upper limit is nowhere below the lower one. The smallest b for which
    it exists without the Gaussian, then the smallest s, by bisection; on 2000 distances, rounded
    to the unsafe side of each cell so that the answer is safe.

    References
    ----------
    Blanch, Walter, Enge 2019, IEEE Trans. Aerosp. Electron. Syst. 55, 1990 (two-step Gaussian
    bounding); the condition by convex minorants is derived here.
    """
    x = _sorted_errors(error_m)
    p = _tail_probability(n_eff, x.size)
    if isinstance(p, Refusal):
        return p
    sides = (x, -x[::-1])
    reach = float(max(-x[0], x[-1], x[-1] - x[0]))
    if not reach > 0:
        return Refusal("the errors do not vary", "check the errors")
    bias = _smallest(
        lambda b: all(_bounded_between(side, b, p, math.inf) for side in sides),
        _default_bias(x, n_eff), reach,
    )  # fmt: skip
    if bias is None:
        return Refusal("no symmetric, unimodal pair bounds these errors", "look for outliers")
    sigmas = []
    for side in sides:
        sigma = _smallest(partial(_bounded_between, side, bias, p), 0.0, 20 * reach)
        if sigma is None:
            return Refusal("no pair of Gaussians bounds these errors", "look for outliers")
        sigmas.append(sigma)
    left, right = sigmas
    return Overbound("two-step", bias, max(sigmas), left, right, p, _caveats(n_eff, p))


# --- shared -----------------------------------------------------------------------------------


def _sorted_errors(error_m: ArrayLike) -> Floats:
    x = np.sort(np.asarray(error_m, dtype=np.float64).ravel())
    if x.size < LEAST_SAMPLES or not np.isfinite(x).all():
        raise InputError(
            f"an overbound needs {LEAST_SAMPLES} errors or more, all finite",
            where="error_m",
            evidence=f"{x.size} errors, {int(np.count_nonzero(~np.isfinite(x)))} not finite",
        )
    return x


def _tail_probability(n_eff: float, n: int) -> float | Refusal:
    """Smallest quantile that ten effective samples show."""
    require("n_eff", n_eff, above=0)
    p = 10 / min(n_eff, n)
    if p < NEAREST_QUANTILE / 2:
        return p
    return Refusal(
        f"{n_eff:.3g} effective samples show no tail: 10 of them would be {100 * p:.3g} %",
        "record longer",
    )


def _caveats(n_eff: float, p: float) -> tuple[str, ...]:
    return (
        f"bounded by data down to a probability of {p:.3g} ({n_eff:.4g} effective samples); "
        "beyond, the Gaussian is an assumption",
    )


def _left_sigma(x: Floats, tail_probability: float) -> float:
    require("tail_probability", tail_probability, above=0, below=NEAREST_QUANTILE)
    p, values = _quantiles(x, tail_probability, NEAREST_QUANTILE)
    # A negative error of zero probability counts nothing; positive ones are bounded by any sigma.
    return float(np.max(values / special.ndtri(p), initial=0.0))


def _quantiles(x: Floats, low: float, high: float) -> tuple[Floats, Floats]:
    """i/n and x_i of the sorted values with i/n in [low, high]."""
    n = x.size
    first, last = math.ceil(low * n - 1e-9), math.floor(high * n + 1e-9)
    rank = np.arange(max(first, 1), min(last, n - 1) + 1)
    return rank / n, x[rank - 1]


def _default_bias(x: Floats, n_eff: float) -> float:
    """Distance of the median from zero, plus 1.645 standard deviations of n_eff samples'."""
    spread = float(np.quantile(x, special.ndtr(1)) - np.quantile(x, special.ndtr(-1))) / 2
    return abs(float(np.median(x))) + 1.645 * spread * math.sqrt(math.pi / 2 / n_eff)


def _one_side(x: Floats, bias_m: float, tail_probability: float) -> tuple[float, float]:
    """Smallest and largest sigma with which N(-bias, sigma) lies left of the sorted errors."""
    p, values = _quantiles(x, tail_probability, 1 - tail_probability)
    z, moved = special.ndtri(p), values + bias_m
    least = float(np.max(moved[z < 0] / z[z < 0], initial=0.0))
    if np.any(moved[z >= 0] < 0):
        return least, -math.inf
    return least, float(np.min(moved[z > 0] / z[z > 0], initial=math.inf))


def _smallest(holds: Callable[[float], bool], low: float, high: float) -> float | None:
    """Smallest value in [low, high] for which a condition that stays true once true holds."""
    if holds(low):
        return low
    if not holds(high):
        return None
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def _bounded_between(x: Floats, bias_m: float, tail_probability: float, sigma_m: float) -> bool:
    """Whether a convex tail lies between those of the sorted errors and N(0, sigma)."""
    first = x[max(0, math.ceil(tail_probability * x.size - 1e-9) - 1)]
    furthest = max(-bias_m - float(first), 0.0)
    if furthest == 0:
        return True
    ends = np.linspace(0, furthest * 1.001, 2001)
    t = ends[:-1]
    lower = np.searchsorted(x, -bias_m - t, side="right") / x.size
    lower[lower < tail_probability] = 0.0
    # The far end of each cell is the safe one; below the stated probability nothing is shown.
    upper = 1 - np.searchsorted(x, -bias_m + ends[1:], side="right") / x.size
    upper = np.minimum(np.maximum(upper, tail_probability), 0.5)
    if math.isfinite(sigma_m):
        upper = np.minimum(upper, special.ndtr(-t / sigma_m) if sigma_m > 0 else 0.0)
    minorant = _convex_minorant(t, upper)
    return bool(np.all(minorant[1:] >= lower[:-1]))


def _convex_minorant(t: Floats, value: Floats) -> Floats:
    """Largest convex function nowhere above the values, at the same points."""
    kept: list[int] = []
    for i in range(t.size):
        while len(kept) > 1:
            a, b = kept[-2], kept[-1]
            if (value[b] - value[a]) * (t[i] - t[a]) < (value[i] - value[a]) * (t[b] - t[a]):
                break
            kept.pop()
        kept.append(i)
    return np.asarray(np.interp(t, t[kept], value[kept]))
