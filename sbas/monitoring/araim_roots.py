"""The level at which the integrity risk of all fault modes just fits its budget.

Source: WG-C ARAIM Airborne Algorithm Description Document 3.0 (2017), protection levels. There
the equation is halved down to 0.05 m; here a bracket that is known beforehand is closed by the
rule of false position (Illinois variant, M. Dowell and P. Jarratt 1971).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

Floats = NDArray[np.float64]

TOLERANCE_M = 1e-8
"""A level exceeds the root by at most this, or by 1e-14 of itself, and is never below it."""
_GUARD = 1e-9
"""Widens the bracket [m, and share of it] beyond rounding and beyond a jump of the equation."""
_TIE = 1e-13
"""A risk this close to its budget [share of it] may exceed it but for rounding: it does not fit."""
_MOST_STEPS = 400
LARGEST_M = 1e12
"""A level beyond it, which no number resolves to a millimetre, counts as infinite."""


def risk_of_level(
    level_m: Floats, sigma_0_m: Floats, bias_0_m: Floats,
    prior: Floats, offset_m: Floats, sigma_m: Floats,
) -> Floats:  # fmt: skip
    """Integrity risk of a level on one axis: what the level equation sets equal to the budget.

    2 Q((L - b_0) / sigma_0) + sum_k p_k Qm((L - T_k - b_k) / sigma_k), where Qm is Q above 0 and
    1 from there down.

    Parameters
    ----------
    level_m, sigma_0_m, bias_0_m : (r,) levels, and sigma and bias of the fix without a fault [m].
    prior, offset_m, sigma_m : (k, r) prior of each mode, threshold plus bias, and sigma [m]; an
        absent mode has the prior 0.
    """
    u = (level_m - offset_m) / sigma_m
    tail = np.where(u > 0, ndtr(-u), 1.0)
    tail *= prior
    risk: Floats = 2.0 * ndtr((bias_0_m - level_m) / sigma_0_m) + tail.sum(axis=0)
    return risk


def level_of_risk(
    budget: Floats, sigma_0_m: Floats, bias_0_m: Floats,
    prior: Floats, offset_m: Floats, sigma_m: Floats,
) -> Floats:  # fmt: skip
    """(r,) least level whose risk does not exceed its budget, rounded up by `TOLERANCE_M`.

    Infinite where it would exceed `LARGEST_M`.

    Parameters
    ----------
    budget : (r,) risks; where not above 0 the level is infinite.
    sigma_0_m, bias_0_m, prior, offset_m, sigma_m : as in `risk_of_level`.

    Notes
    -----
    With M modes the risk at the lower end is at least the budget, since one term alone reaches
    it, and at most (M + 1) times as large; at the upper end no term exceeds budget / (M + 1), so
    that the sum does not exceed the budget. Sums of tails are therefore never 0 or near it. The
    risk may jump from above the budget to below it, where a prior alone is about the budget: the
    level is then the upper side of the jump.
    """
    level = np.full(budget.shape, np.inf)
    possible = budget > 0
    modes = np.count_nonzero(prior > 0, axis=0)
    plain = possible & (modes == 0)
    level[plain] = bias_0_m[plain] - sigma_0_m[plain] * ndtri(budget[plain] / 2)
    level[~(level <= LARGEST_M)] = np.inf
    rows = np.flatnonzero(possible & (modes > 0))
    if rows.size == 0:
        return level
    rho = budget[rows]
    fix = sigma_0_m[rows], bias_0_m[rows]
    faults = prior[:, rows], offset_m[:, rows], sigma_m[:, rows]
    low, high = _bracket(rho, modes[rows], *fix, *faults)
    near = high <= LARGEST_M
    if not near.all():
        rows, low, high, rho = rows[near], low[near], high[near], rho[near]
        fix = fix[0][near], fix[1][near]
        faults = faults[0][:, near], faults[1][:, near], faults[2][:, near]
    if rows.size:
        level[rows] = _closed(low, high, rho, fix, faults)
    return level


def _bracket(
    rho: Floats, modes: NDArray[np.int64], sigma_0_m: Floats, bias_0_m: Floats,
    prior: Floats, offset_m: Floats, sigma_m: Floats,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Levels between which the risk falls to the budget."""
    share = rho / (modes + 1)
    least = bias_0_m - sigma_0_m * ndtri(rho / 2)
    most = bias_0_m - sigma_0_m * ndtri(share / 2)
    # Where a prior does not reach the budget the quantile is -inf or NaN and takes no part;
    # infinite biases make an infinite upper end.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        alone = np.where(prior > rho, offset_m - sigma_m * ndtri(rho / prior), -np.inf)
        part = np.minimum(ndtri(share / prior), 0.0)
        together = np.where(prior > share, offset_m - sigma_m * part, -np.inf)
        low = np.maximum(least, alone.max(axis=0))
        high = np.maximum(np.maximum(most, together.max(axis=0)), low)
        return low - _GUARD * (1 + np.abs(low)), high + _GUARD * (1 + np.abs(high))


def _log_ratio(
    level: Floats, rho: Floats, fix: tuple[Floats, ...], faults: tuple[Floats, ...]
) -> Floats:
    """Logarithm of risk over budget; -inf where the risk is too small for a number."""
    with np.errstate(divide="ignore"):
        ratio: Floats = np.log(risk_of_level(level, *fix, *faults) / rho)
    return ratio


def _closed(
    low: Floats, high: Floats, rho: Floats, fix: tuple[Floats, ...], faults: tuple[Floats, ...]
) -> Floats:
    """Upper ends of brackets, closed until they are `TOLERANCE_M` wide."""
    result = high.copy()
    rows: NDArray[np.intp] = np.arange(low.size)
    g_low = _log_ratio(low, rho, fix, faults)
    g_high = _log_ratio(high, rho, fix, faults)
    tolerance = np.maximum(TOLERANCE_M, 1e-14 * np.abs(high))
    kept = np.zeros(low.size)
    for step in range(_MOST_STEPS):
        width = high - low
        busy = width > tolerance
        if not busy.any():
            break
        if np.count_nonzero(busy) < 0.7 * busy.size:
            result[rows] = high
            rows = rows[busy]
            low, high, rho, g_low, g_high, tolerance, kept, width = (
                a[busy] for a in (low, high, rho, g_low, g_high, tolerance, kept, width)
            )
            fix = tuple(a[busy] for a in fix)
            faults = tuple(np.compress(busy, a, axis=1) for a in faults)
        if step % 4 == 3:
            # A halving now and then bounds the number of steps, also at a jump.
            x = low + 0.5 * width
        else:
            fall = np.where(g_low > g_high, g_low - g_high, 1.0)
            x = low + width * np.clip(g_low / fall, 0.0, 1.0)
            # Never on an end: near the root the next step then lands on its other side.
            near = np.minimum(0.4 * tolerance, 0.5 * width)
            x = np.clip(x, low + near, high - near)
        g = _log_ratio(x, rho, fix, faults)
        fits = g < -_TIE
        high, low = np.where(fits, x, high), np.where(fits, low, x)
        # Illinois: an end that is kept twice running counts half.
        g_low = np.where(fits, np.where(kept == -1, 0.5 * g_low, g_low), g)
        g_high = np.where(fits, g, np.where(kept == 1, 0.5 * g_high, g_high))
        kept = np.where(fits, -1.0, 1.0)
    result[rows] = high
    return result
