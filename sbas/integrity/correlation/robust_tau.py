"""The robust decorrelation time: clip, take out drift and daily terms, correlate, fit.

Works on arrays; `sbas.integrity.correlation.correlation` asks the questions and words the answers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.integrity.correlation.autocorrelation import Autocorrelation, Bools, Floats
from sbas.integrity.correlation.error_grid import room

LEAST_SAMPLES = 1000
CLIP = 4 * 1.4826
"""Clipping in median absolute deviations: 4 standard deviations of a Gauss distribution."""
PERIODS_S = (86400.0, 43200.0)
"""Daily and half-daily terms (multipath repeats with the sidereal day, ionosphere with the Sun)."""
LONGEST_LAG_S = 43200.0
FIT_HIGH, FIT_LOW, FIT_LEAST = 0.9, 0.3, 5
_ORDER_SAMPLES = 1 << 20
"""Medians of longer series are taken from evenly spaced samples."""
_STRETCH = 1 << 15


@dataclass(frozen=True, eq=False)
class Cleaned:
    """Errors that are ready to be correlated.

    Parameters
    ----------
    values : (k, n) clipped, without mean, drift and daily terms; NaN where missing.
    clipped : (n,) True where any component was clipped.
    samples : cells with a value.
    periods_s : periods that were taken out [s].
    cross : correlation of the two components at lag 0; 0 for one.
    sigma : (k,) standard deviation of the cleaned components.
    """

    values: NDArray[np.float32]
    clipped: Bools
    samples: int
    periods_s: tuple[float, ...]
    cross: float
    sigma: Floats


def fitting_periods(span_s: float) -> tuple[float, ...]:
    """Periods of which the record holds at least two [s]."""
    return tuple(p for p in PERIODS_S if span_s >= 2 * p)


def longest_lag(cells: int, step_s: float) -> int:
    """Largest lag that is looked at [cells]: a fifth of the record, at most 12 h."""
    return max(int(min(cells / 5, LONGEST_LAG_S / step_s)), FIT_LEAST + 1)


def regressors(
    index: NDArray[np.integer[Any]], *, cells: int, step_s: float, periods_s: tuple[float, ...]
) -> NDArray[np.float32]:
    """(2 + 2 periods, i) constant, drift, cosine and sine of each period at (i,) of the cells."""
    rows = [np.ones(len(index)), 2 * index / max(cells - 1, 1) - 1]
    for period in periods_s:
        # Whole turns are taken off in double precision, so that single precision is enough.
        turns = index * (step_s / period)
        phase = (2 * np.pi * (turns - np.floor(turns))).astype(np.float32)
        rows += [np.cos(phase), np.sin(phase)]
    return np.array(rows, np.float32)


def clean(values: NDArray[np.float32], step_s: float) -> Cleaned | Refusal:
    """Clip, take out mean, drift and daily terms, clip again.

    Parameters
    ----------
    values : (k, n) errors on a regular grid, NaN (in all components) where missing.
    step_s : step of the grid [s].

    Returns
    -------
    Cleaned; or a Refusal when samples are too few or a component does not change.

    Notes
    -----
    Clipping at median +- 4 * 1.4826 * MAD, before and after the least-squares fit of the known
    samples. Source: Huber, "Robust Statistics", 1981, 5.1 (MAD); method page 3.1, steps 1 to 4.
    """
    k, n = values.shape
    samples = int(np.isfinite(values[0]).sum())
    if samples < LEAST_SAMPLES:
        return Refusal(
            f"{samples} epochs with a position error, and {LEAST_SAMPLES} are the least",
            "record longer",
        )
    periods = fitting_periods(n * step_s)

    def basis(index: NDArray[np.integer[Any]]) -> NDArray[np.float32]:
        return regressors(index, cells=n, step_s=step_s, periods_s=periods)

    chosen = np.arange(0, n, -(-n // _ORDER_SAMPLES))
    chosen = chosen[np.isfinite(values[0, chosen])]
    few = values[:, chosen].astype(float)
    limits = _clip_limits(few)
    if not (limits[:, 1] > limits[:, 0]).all():
        return Refusal(
            "the position error does not change: half of its values or more are equal",
            "check that the receiver computes its positions, and how they are rounded",
        )
    size = 2 + 2 * len(periods)
    gram, moments = np.zeros((size, size)), np.zeros((size, k))
    for first in range(0, n, _STRETCH):
        piece = values[:, first : first + _STRETCH]
        known = np.isfinite(piece[0])
        rows = basis(first + np.flatnonzero(known)).astype(float)
        gram += rows @ rows.T
        moments += rows @ np.clip(piece[:, known], limits[:, :1], limits[:, 1:]).T
    coefficients = np.linalg.lstsq(gram, moments, rcond=1e-10)[0].T
    few = np.clip(few, limits[:, :1], limits[:, 1:])
    few -= coefficients @ basis(chosen)
    limits_after = _clip_limits(few)

    cleaned, clipped = room((k, n)), np.zeros(n, bool)
    total, products = np.zeros(k), np.zeros((k, k))
    for first in range(0, n, _STRETCH):
        piece = np.array(values[:, first : first + _STRETCH], dtype=float)
        inside = np.clip(piece, limits[:, :1], limits[:, 1:])
        fitted = inside - coefficients @ basis(np.arange(first, first + piece.shape[1]))
        out = np.clip(fitted, limits_after[:, :1], limits_after[:, 1:])
        changed = (inside != piece) | (out != fitted)
        known = np.isfinite(piece[0])
        clipped[first : first + known.size] = changed.any(axis=0) & known
        cleaned[:, first : first + known.size] = out
        total += out[:, known].sum(axis=1)
        products += out[:, known] @ out[:, known].T
    mean = total / samples
    covariance = products / samples - np.outer(mean, mean)
    for first in range(0, n, _STRETCH):
        cleaned[:, first : first + _STRETCH] -= mean[:, None].astype(np.float32)
    sigma = np.sqrt(np.diag(covariance))
    cross = float(covariance[0, 1] / (sigma[0] * sigma[1])) if k == 2 else 0.0
    return Cleaned(cleaned, clipped, samples, periods, cross, sigma)


def _clip_limits(values: Floats) -> Floats:
    """(k, 2) bounds of what is kept."""
    middle = np.median(values, axis=1, keepdims=True)
    mad = np.median(np.abs(values - middle), axis=1, keepdims=True)
    return np.hstack([middle - CLIP * mad, middle + CLIP * mad])


def block_means(cleaned: Cleaned, every: int) -> tuple[NDArray[np.float32], Bools]:
    """(k, n // every) means of successive blocks without clipped epochs, and what was recorded.

    NaN where fewer than half of a block are left; the (n // every,) second result is True where
    half of a block were recorded, clipped or not. A burst of outliers, though clipped, would
    leave a mark of its own in the means.
    """
    k, n = cleaned.values.shape
    blocks = n // every
    means, recorded = np.empty((k, blocks), np.float32), np.empty(blocks, bool)
    at_once = max(_STRETCH // every, 1)
    for first in range(0, blocks, at_once):
        stop = min(first + at_once, blocks)
        piece = cleaned.values[:, first * every : stop * every].reshape(k, stop - first, every)
        out = cleaned.clipped[first * every : stop * every].reshape(stop - first, every)
        seen = np.isfinite(piece[0])
        recorded[first:stop] = 2 * seen.sum(axis=1) >= every
        known = seen & ~out
        count = known.sum(axis=1)
        sums = np.where(known, piece, 0).sum(axis=2, dtype=float)
        means[:, first:stop] = np.where(2 * count >= every, sums / np.maximum(count, 1), np.nan)
    return means, recorded


@dataclass(frozen=True, eq=False)
class ExponentialFits:
    """Fits of ln r = ln A - lag/tau, one a row of r; tau is inf where r never falls to the floor.

    `tau_s` and `amplitude` (b,); `first`, `stop` (b,) the lags used, `stop` exclusive.
    """

    tau_s: Floats
    amplitude: Floats
    first: NDArray[np.int64]
    stop: NDArray[np.int64]


def fit_exponentials(
    r: NDArray[np.floating[Any]],
    step_s: float,
    *,
    high: float = FIT_HIGH,
    low: float = FIT_LOW,
    least: int = FIT_LEAST,
) -> ExponentialFits:
    """Exponentials through autocorrelations where they fall from `high` to `low`.

    Parameters
    ----------
    r : (b, m) autocorrelations from lag 0 on, r(0) = 1 (or their part that has no nugget).
    step_s : step of the lags [s].
    high, low : the fit runs from the first lag with r < high to the one before the first with
        r < low.
    least : fewest lags of the fit.

    Notes
    -----
    Residuals of ln r are weighted by r, which is what an error of r amounts to. A white part
    lowers A and leaves tau. Source: method page 3.1, steps 6 and 7.
    """
    m = r.shape[1]
    below_high, below_low = r < high, r < low
    below_high[:, 0] = below_low[:, 0] = False
    first = np.argmax(below_high, axis=1)
    low_at = np.argmax(below_low, axis=1)
    found = low_at > 0
    stop = np.minimum(np.maximum(low_at, first + least), m)
    used = int(stop.max()) if found.any() else 1
    lag = np.arange(used)
    part = r[:, :used]
    inside = (lag >= first[:, None]) & (lag < stop[:, None]) & (part > 0)
    safe = np.where(inside, part, 1.0).astype(float)
    weight, y = np.where(inside, safe**2, 0.0), np.log(safe)
    s0, s1, s2 = weight.sum(1), weight @ lag, weight @ lag**2
    sy, sly = (weight * y).sum(1), (weight * y) @ lag
    determinant = s0 * s2 - s1**2
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (s0 * sly - s1 * sy) / determinant
        amplitude = np.exp((sy - slope * s1) / s0)
        tau = np.where(found & (slope < 0), -step_s / slope, np.inf)
    return ExponentialFits(tau, np.where(np.isfinite(tau), amplitude, np.nan), first, stop)


def other_definitions(acf: Autocorrelation) -> dict[str, float | None]:
    """Further times that are called decorrelation time, by name [s]; None where not reached.

    Parameters
    ----------
    acf : of the cleaned errors; components are averaged.

    Returns
    -------
    `first_1_over_e_s` and `first_zero_s`: first crossings, linear between lags;
    `crossing_0_05_third_s`: a third of the crossing of 0.05; `integrated_s`: integral of r to
    its first zero (trapezoids); `ar1_lag1_s`: -step/ln r(step).
    """
    seen = np.isfinite(acf.mean)
    lag, r = acf.lag_s[seen], acf.mean[seen]

    def crossing(level: float) -> float | None:
        below = np.flatnonzero(r < level)
        if below.size == 0:
            return None
        j = int(below[0])
        return float(lag[j] - (level - r[j]) / (r[j - 1] - r[j]) * (lag[j] - lag[j - 1]))

    zero, twentieth = crossing(0.0), crossing(0.05)
    integrated = None
    if zero is not None:
        inside = lag < zero
        integrated = float(np.trapezoid(np.append(r[inside], 0.0), np.append(lag[inside], zero)))
    first = float(acf.mean[1])
    return {
        "first_1_over_e_s": crossing(math.exp(-1)),
        "crossing_0_05_third_s": None if twentieth is None else twentieth / 3,
        "integrated_s": integrated,
        "ar1_lag1_s": -acf.step_s / math.log(first) if 0 < first < 1 else None,
        "first_zero_s": zero,
    }
