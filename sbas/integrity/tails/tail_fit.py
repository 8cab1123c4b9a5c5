"""The tail of all exceedances of the 95 % quantile: fitted, and judged.

A fit is trusted only where the record looks like those simulated under its model: a Gaussian,
Gauss-Markov error of the same length. What it misfits is refused in words.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import require
from sbas.integrity.exposure.extremal_clusters import run_clusters
from sbas.integrity.tails.sampled_clock import crossings_per_exceedance
from sbas.integrity.tails.tail_family import TailFamily, tail_family
from sbas.integrity.tails.tail_reference import (
    PER_TAU,
    QUANTILES,
    RECORDS,
    STATISTICS,
    THRESHOLD,
    TailReference,
    summarise_ordered_tail,
    summarise_tail,
    tail_reference,
)

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

LEAST_SAMPLES, LEAST_TAUS, LEAST_CLUSTERS = 1000, 20, 10
SIGNIFICANCE = 0.05
"""Share of Gaussian records that the goodness of fit refuses."""
MOST_CROSSINGS = 1.5
"""Times the crossings of the Gauss-Markov process beyond which its clock is too slow."""
LARGEST_BIAS, BIAS_CHI2 = 0.2, 9.21
"""Bias over the spread, and its chi-square of two components at 1 %, that refuse together."""
_REPEATED = 5
_CELLS_AT_ONCE = 1 << 18


@dataclass(frozen=True, eq=False)
class TailFit:
    """Fitted tail of y = (error/sigma)^2/2, whether or not anything may be made of it.

    Parameters
    ----------
    refusal : why no rate may be modelled, or None.
    threshold, excess, scale : 95 % quantile u of y, mean excess b over it, and the factor of
        sigma^2 that a Gaussian error with this tail has (b itself for equal axes).
    shape : generalised Pareto shape by moments, for information: never used.
    clusters : clusters over the threshold, runs merged at tau/2.
    samples, hours : judged samples, and their time.
    taus : length in decorrelation times.
    fit_p : share of Gaussian records of this length that fit worse.
    crossings : crossings of the threshold over those of the Gauss-Markov process.
    bias : mean error over its spread; None from sizes alone.
    axis_ratio : of the error, to 0.05; 1 from sizes alone.
    stability : (5, 4) for 50, 90, 95, 98, 99 %: quantile probability, threshold, scale, and the
        relative standard deviation of the scale.
    tail_y, tail_share : points of the empirical tail for a picture.
    """

    refusal: Refusal | None
    threshold: float
    excess: float
    scale: float
    shape: float
    clusters: int
    samples: int
    hours: float
    taus: float
    fit_p: float
    crossings: float
    bias: float | None
    axis_ratio: float
    interval_s: float
    tau_s: float
    tau_low_s: float
    tau_high_s: float
    nugget: float
    stability: Floats
    tail_y: Floats
    tail_share: Floats
    block_count: Floats
    block_sum: Floats


def fit_tail(
    error_m: ArrayLike,
    sigma_m: ArrayLike,
    *,
    time_s: ArrayLike | None = None,
    interval_s: float,
    tau_s: float,
    tau_low_s: float | None = None,
    tau_high_s: float | None = None,
    nugget: float = 0.0,
) -> TailFit | Refusal:
    """Fit the tail of a record and judge it.

    Parameters
    ----------
    error_m : (2, n) signed east and north errors [m], or (n,) their size. Signed errors show a
        bias and the ellipse; from the size alone equal axes are supposed, and a bias below
        1.5 sigma goes unseen. Single precision is taken as it is.
    sigma_m : (n,) or scalar, standard deviation along the major axis that each error should
        have [m]; samples without an error or a finite sigma (NaN) are left out.
    time_s : (n,) increasing [s]; None: a regular grid of `interval_s`, NaN where missing.
    interval_s : step of the record [s]; a longer step than 1.5 times it is a gap.
    tau_s, tau_low_s, tau_high_s : decorrelation time of an error component with its interval
        [s]; without an interval it counts as known.
    nugget : share of a component's variance that is white.

    Returns
    -------
    TailFit, whose `refusal` says whether rates may be modelled; a Refusal where nothing can be
    fitted at all.

    Raises
    ------
    InputError : shapes that differ, times that do not increase, an argument out of range.

    Notes
    -----
    b is the mean of y - u over all samples beyond the 95 % quantile u. Refused: fewer than ten
    clusters over u; a statistic of the tail (`STATISTICS`) outside what Gaussian records of the
    same correlation show in 95 %; crossings of u 1.5 times as often as the clock supposes; a
    largest value that repeats (clipped); a bias.

    References
    ----------
    Exponential tail of the squared size of a Gaussian error: Hoyt 1947; excesses over a
    threshold: Davison and Smith 1990, J. R. Stat. Soc. B 52, 393.
    """
    require("interval_s", interval_s, above=0)
    require("tau_s", tau_s, above=interval_s)
    low = tau_s if tau_low_s is None else tau_low_s
    high = tau_s if tau_high_s is None else tau_high_s
    require("tau_low_s", low, above=interval_s, most=tau_s)
    require("tau_high_s", high, least=tau_s)
    require("nugget", nugget, least=0, most=0.99)
    time = None if time_s is None else np.asarray(time_s, dtype=np.float64)
    scaled = _scaled(error_m, sigma_m, time)
    n, y = scaled.samples, scaled.y
    taus = n * interval_s / tau_s
    if n < LEAST_SAMPLES or taus < LEAST_TAUS:
        return Refusal(
            f"{n} epochs, {taus:.3g} decorrelation times, are too few for a tail",
            f"record at least {LEAST_SAMPLES} epochs and {LEAST_TAUS} decorrelation times",
        )
    bias, bias_refusal, axis_ratio = _bias_and_axes(scaled, taus)
    ordered = np.sort(y)[:n]  # what is missing comes last
    summary = summarise_ordered_tail(ordered)
    u, b = float(summary.threshold[THRESHOLD]), float(summary.excess[THRESHOLD])
    if not (u > 0 and b > 0):
        return Refusal("the errors beyond their 95 % quantile are all alike", "check the errors")
    clipped, empirical = _clipped(ordered), _empirical_tail(ordered)
    del ordered
    family = tail_family(axis_ratio)
    reference = tail_reference(
        taus, per_tau=tau_s / interval_s, axis_ratio=axis_ratio, nugget=nugget
    )
    # The reference has PER_TAU samples per tau: the same thinning, or its largest is smaller.
    thin = max(1, round(tau_s / interval_s / PER_TAU))
    known = y if n == y.size else y[~np.isnan(y)]
    z, fit_p = reference.misfit(summarise_tail(known[::thin]).statistic)
    del known
    above = np.flatnonzero(y >= u)
    expected = crossings_per_exceedance(tau_s, interval_s=interval_s, nugget=nugget)
    crossings = _rises(y, above, u, time, 1.5 * interval_s) / above.size / expected
    grid = above
    if time is not None:
        grid = np.unique(np.rint((time[above] - time[0]) / interval_s).astype(np.int64))
    clusters = run_clusters(grid, merge_samples=tau_s / 2 / interval_s).count
    refusal = _few(clusters) or clipped or bias_refusal
    refusal = refusal or _misfit(z, fit_p) or _too_rough(crossings)
    excess_of = y[above].astype(np.float64) - u
    block = max(1, min(round(10 * tau_s / interval_s), n // 5))
    # Blocks hold known samples only; the last one takes the rest.
    rank = above if n == y.size else above - np.searchsorted(np.flatnonzero(np.isnan(y)), above)
    blocks = n // block
    of_block = np.minimum(rank // block, blocks - 1)
    return TailFit(
        refusal=refusal,
        threshold=u,
        excess=b,
        scale=float(family.scale(u, b)),
        shape=float(summary.statistic[STATISTICS.index("shape of the excesses over 95 %")]),
        clusters=clusters,
        samples=n,
        hours=n * interval_s / 3600,
        taus=taus,
        fit_p=fit_p,
        crossings=crossings,
        bias=bias,
        axis_ratio=axis_ratio,
        interval_s=interval_s,
        tau_s=tau_s,
        tau_low_s=low,
        tau_high_s=high,
        nugget=nugget,
        stability=_stability(family, summary.threshold, summary.excess, reference),
        **empirical,
        block_count=np.bincount(of_block, minlength=blocks).astype(np.float64),
        block_sum=np.bincount(of_block, excess_of, blocks).astype(np.float64),
    )


# --- fitting ----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Scaled:
    """Squared sizes of errors over sigma, halved, (n,) with NaN where missing; and moments.

    `mean` (c,) and `products` (c, c) about it are of the c components of the known samples.
    """

    y: NDArray[np.floating[Any]]
    samples: int
    mean: Floats
    products: Floats


def _scaled(error_m: ArrayLike, sigma_m: ArrayLike, time: Floats | None) -> _Scaled:
    error, sigma = np.atleast_2d(_floating(error_m)), _floating(sigma_m)
    shape = error.shape[1:] if time is None else time.shape
    if error.shape[0] > 2 or error.shape[1:] != shape or sigma.shape not in ((), shape):
        lengths = "errors and sigmas" if time is None else "errors, sigmas and times"
        raise InputError(
            f"{lengths} differ in length",
            where="error_m, sigma_m, time_s",
            evidence=f"shapes {error.shape}, {sigma.shape}, {shape}",
        )
    if time is not None and not np.all(time[1:] > time[:-1]):
        raise InputError("times do not increase", where="time_s", cure="sort the record")
    precision = error.dtype if sigma.ndim == 0 else np.result_type(error, sigma)
    y = np.empty(shape, precision)
    samples, origin = 0, None
    total, squares = np.zeros(error.shape[0]), np.zeros((error.shape[0], error.shape[0]))
    for first in range(0, y.size, _CELLS_AT_ONCE):
        part = slice(first, first + _CELLS_AT_ONCE)
        size = error[:, part]
        of_part = sigma if sigma.ndim == 0 else sigma[part]
        if np.any(of_part <= 0) or np.any(np.isinf(size)):
            raise InputError(
                "a sigma is not above 0, or an error is infinite", where="sigma_m, error_m"
            )
        if error.shape[0] == 1 and np.any(size < 0):
            raise InputError(
                "sizes of errors are not negative",
                where="error_m",
                cure="give signed errors as (2, n): east and north",
            )
        scaled = (size / np.where(np.isfinite(of_part), of_part, np.nan)).astype(precision)
        y[part] = (scaled**2).sum(axis=0) / 2
        known = scaled[:, ~np.isnan(y[part])].astype(np.float64)
        if known.shape[1] == 0:
            continue
        # About a value of theirs, constants have moments of exactly 0.
        origin = known[:, :1].copy() if origin is None else origin
        known -= origin
        samples += known.shape[1]
        total += known.sum(axis=1)
        squares += known @ known.T
    if origin is None:
        return _Scaled(y, 0, total, squares)
    mean = total / samples
    return _Scaled(y, samples, origin[:, 0] + mean, squares - samples * np.outer(mean, mean))


def _floating(values: ArrayLike) -> NDArray[np.floating[Any]]:
    array = np.asarray(values)
    return array if array.dtype == np.float32 else array.astype(np.float64, copy=False)


def _rises(
    y: NDArray[np.floating[Any]], above: Indices, u: float, time: Floats | None, gap_s: float
) -> int:
    """Upcrossings of u between successive samples without a gap."""
    after = above[above > 0]
    rise = y[after - 1] < u
    if time is not None:
        rise &= time[after] - time[after - 1] <= gap_s
    return int(np.count_nonzero(rise))


def _bias_and_axes(scaled: _Scaled, taus: float) -> tuple[float | None, Refusal | None, float]:
    if scaled.mean.size == 1:
        return None, None, 1.0
    minor, major = np.linalg.eigvalsh(scaled.products / (scaled.samples - 1))
    if not major > 0:
        return None, Refusal("the errors do not vary"), 1.0
    axis_ratio = round(20 * math.sqrt(max(minor, 0.0) / major)) / 20
    spread = np.sqrt(np.maximum(np.diag(scaled.products), 0.0) / scaled.samples)
    ratio = scaled.mean / np.where(spread > 0, spread, math.inf)
    bias = float(np.hypot(*ratio))
    # T/(2 tau) samples for a mean.
    if bias > LARGEST_BIAS and bias**2 * taus / 2 > BIAS_CHI2:
        refusal = Refusal(
            f"the errors have a bias of {bias:.2g} sigma: their tail is not that of a zero mean",
            "check the truth and the antenna; a bias belongs into the paired overbound",
        )
        return bias, refusal, axis_ratio
    return bias, None, axis_ratio


def _few(clusters: int) -> Refusal | None:
    if clusters >= LEAST_CLUSTERS:
        return None
    return Refusal(
        f"{clusters} clusters beyond the 95 % quantile: no extrapolation under {LEAST_CLUSTERS}",
        "record longer",
    )


def _clipped(ordered: NDArray[np.floating[Any]]) -> Refusal | None:
    least = float(ordered[-1]) * (1 - 1e-9)
    repeated = ordered.size - int(np.searchsorted(ordered, ordered.dtype.type(least)))
    if repeated < _REPEATED:
        return None
    return Refusal(
        f"the largest error occurs {repeated} times: clipped, a bounded tail",
        "look for a limit in the receiver's output or in the file's format",
    )


def _misfit(z: Floats, fit_p: float) -> Refusal | None:
    if fit_p >= SIGNIFICANCE:
        return None
    worst = int(np.argmax(np.where(np.isfinite(z), np.abs(z), math.inf)))
    return Refusal(
        f"the tail misfits: {STATISTICS[worst]} is {z[worst]:+.2g} standard deviations from "
        f"that of Gaussian records of this length (p {_p_words(fit_p)})",
        "use the demonstrated bound; look for mixed conditions, or errors not scaled by sigma",
    )


def _p_words(p: float) -> str:
    return f"= {p:.3g}" if p > 0 else f"< {1 / RECORDS:.1g}"


def _too_rough(crossings: float) -> Refusal | None:
    if crossings <= MOST_CROSSINGS:
        return None
    return Refusal(
        f"the errors cross their 95 % quantile {crossings:.3g} times as often as a Gauss-Markov "
        "process with this decorrelation time: its clock is too slow",
        "give the share of white noise, or the short time of a mixture",
    )


def _stability(
    family: TailFamily, threshold: Floats, excess: Floats, reference: TailReference
) -> Floats:
    scale = np.full(len(QUANTILES), np.nan)
    usable = (threshold > 0) & (excess > 0)
    scale[usable] = family.scale(threshold[usable], excess[usable])
    return np.column_stack([QUANTILES, threshold, scale, reference.stability])


def _empirical_tail(ordered: NDArray[np.floating[Any]]) -> dict[str, Any]:
    """At most 300 points of the upper half, evenly spaced in the logarithm of the share."""
    rank = np.unique(np.geomspace(1, ordered.size / 2, 300).astype(np.int64))
    return {"tail_y": ordered[-rank].astype(np.float64), "tail_share": rank / ordered.size}
