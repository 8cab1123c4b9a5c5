"""The software SBAS receiver: fixes of all epochs from ranges and corrections.

The flow: ranges (`measurements`), what SBAS says of them (`corrected_ranges`), their budget seen
from a place (`range_budget`), the fix and its levels (`least_squares`, `protection_levels`).
Source: RTCA DO-229D, J.1 and J.2; Filip, Bazant, Mocek 2010, section 2.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.reasons import Reason
from sbas.augmentation.timeline import CorrectionTimeline
from sbas.positioning.corrected_ranges import CorrectedRanges, corrected_ranges
from sbas.positioning.least_squares import dilution, step
from sbas.positioning.lines_of_sight import Horizons, horizons
from sbas.positioning.measurements import Measurements
from sbas.positioning.normal_equations import LEAST_SATELLITES, design
from sbas.positioning.orbits import length
from sbas.positioning.range_budget import BudgetRules, RangeBudget, RangesAt, range_budget
from sbas.positioning.rough_places import rough_places
from sbas.positioning.satellite_corrections import DataRules
from sbas.rinex.ephemerides import KeplerEphemerides

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

OUTLIER_M = 40.0
CLOSE_ENOUGH_M = 1e-3
NEAR_BY_M = 100.0
"""After longer steps the whole budget is formed anew."""
MOST_STEPS = 12
LOWEST_M, HIGHEST_M = -1e3, 1e5
"""Heights between which a receiver of this package is: a place elsewhere fits by chance."""


@dataclass(frozen=True, eq=False)
class Fixes:
    """Solutions of (n,) epochs, and the budget of their ranges.

    `receiver_m` (n, 3) earth-fixed, NaN without a fix; `covariance_m2` (n, 4, 4) of east, north,
    up and clock; `dop` with weights 1; `used` (k,) ranges in the solution; `full` (n,) True where
    every range used has all corrections; `contradicting` (n,) True where ranges lay so far from
    the others that nobody knows which are right, `unsettled` where no place was found that stays
    and is near the Earth's surface: neither is given as a fix.
    """

    measured: Measurements
    corrected: CorrectedRanges
    budget: RangeBudget
    reason: Ints
    used: Bools
    residual_m: Floats
    receiver_m: Floats
    clock_m: Floats
    covariance_m2: Floats
    dop: Floats
    solved: Bools
    full: Bools
    contradicting: Bools
    unsettled: Bools


def solve_fixes(
    measured: Measurements,
    timeline: CorrectionTimeline,
    ephemerides: KeplerEphemerides,
    rules: BudgetRules,
    *,
    place_m: Floats | None,
    approximate_m: Floats | None,
    causal: bool,
) -> Fixes:
    """Fixes of all epochs in one mode.

    Parameters
    ----------
    place_m : (3,) known place of the receiver, from which geometry and model are taken; None
        solves for it until a step is below 1 mm.
    approximate_m : (3,) where to start; None starts at the centre of the Earth.
    """
    instants = timeline.reception.instants(measured.time_ns)
    degradation = timeline.degradation(instants, mode=rules.mode).some(measured.epoch)
    instants = instants.some(measured.epoch)
    corrected = corrected_ranges(
        measured, timeline, ephemerides, instants, degradation,
        DataRules(rules.mode, rules.profile, causal),
    )  # fmt: skip
    ranges = RangesAt(measured, corrected, timeline, instants, degradation)
    n = measured.time_ns.size
    if place_m is not None:
        horizon = horizons(place_m[None, :])
        budget = range_budget(ranges, horizon, rules)
        unsettled = np.zeros(n, bool)
    else:
        places = rough_places(measured, corrected, approximate_m)
        horizon, budget, unsettled = _settled(ranges, places, rules)
        unsettled |= (horizon.height_m < LOWEST_M) | (horizon.height_m > HIGHEST_M)
    least = LEAST_SATELLITES if place_m is not None else LEAST_SATELLITES + 1
    sigma, reason, contradicting = _without_outliers(measured, budget, least)
    sigma[(contradicting | unsettled)[measured.epoch]] = np.nan
    g = design(budget.enu.T)
    fix = step(g, sigma, budget.prefit_m, measured.epoch, n)
    solved = fix.geometry.solved & np.isfinite(fix.enu_m).all(axis=1)
    used = (fix.geometry.weight > 0) & solved[measured.epoch]
    full = solved & (np.bincount(measured.epoch[used & ~corrected.full], minlength=n) == 0)
    place = horizon.moved(fix.enu_m)
    place[~solved] = np.nan
    return Fixes(
        measured, corrected, budget,
        np.where((reason == 0) & ~used, Reason.NO_SOLUTION, reason), used,
        fix.residual_m, place, np.where(solved, fix.clock_m, np.nan), fix.covariance_m2,
        dilution(g, used, measured.epoch, n, solved), solved, full, contradicting, unsettled,
    )  # fmt: skip


def _settled(
    ranges: RangesAt, place_m: Floats, rules: BudgetRules
) -> tuple[Horizons, RangeBudget, Bools]:
    """Horizons at (n,) places from which the next step is below 1 mm, the budget seen from there,
    and (n,) True where no such place was found."""
    measured = ranges.measured
    n = place_m.shape[0]
    horizon = horizons(place_m)
    budget = range_budget(ranges, horizon, rules)
    for _ in range(MOST_STEPS):
        sigma, _, _ = _without_outliers(measured, budget, LEAST_SATELLITES)
        enu = step(design(budget.enu.T), sigma, budget.prefit_m, measured.epoch, n).enu_m
        enu = np.nan_to_num(enu)
        moved = length(enu)
        moving = moved >= CLOSE_ENOUGH_M
        if not moving.any():
            break
        horizon = horizons(np.where(moving[:, None], horizon.moved(enu), horizon.place_m))
        far = np.flatnonzero((moved > NEAR_BY_M)[measured.epoch])
        if far.size == len(measured):
            budget = range_budget(ranges, horizon, rules)
            continue
        budget = budget.seen_from(ranges, horizon)
        if far.size:
            budget = budget.with_rows(far, range_budget(ranges.some(far), horizon, rules))
    return horizon, budget, moving


def _without_outliers(
    measured: Measurements, budget: RangeBudget, least: int
) -> tuple[Floats, Ints, Bools]:
    """(k,) sigma and reason with ranges left out that lie more than 40 m from the median of their
    epoch, and (n,) True where they contradict each other: half of them lie that far off, or fewer
    than `least` would be left. Then none is left out, for nobody knows which.

    Parameters
    ----------
    least : a place that the ranges themselves gave needs one more than a fix does, or those left
        would agree whatever they say.
    """
    n, k = measured.time_ns.size, len(measured)
    serving = np.flatnonzero(np.isfinite(budget.sigma_m) & np.isfinite(budget.prefit_m))
    epoch, prefit = measured.epoch[serving], budget.prefit_m[serving]
    count = np.bincount(epoch, minlength=n)
    ordered = np.full((n, max(count.max(initial=0), 1)), np.inf)
    ordered[epoch, np.arange(epoch.size) - (np.cumsum(count) - count)[epoch]] = prefit
    ordered.sort(axis=1)
    rows, last = np.arange(n), ordered.shape[1] - 1
    low, high = np.maximum(count - 1, 0) // 2, np.minimum(count // 2, last)
    median = (ordered[rows, low] + ordered[rows, high]) / 2
    far = np.abs(prefit - median[epoch]) > OUTLIER_M
    many = np.bincount(epoch[far], minlength=n)
    contradicting = (many > 0) & ((2 * many >= count) | (count - many < least))
    far &= ~contradicting[epoch]
    dropped = np.zeros(k, bool)
    dropped[serving[far]] = True
    return (
        np.where(dropped, np.nan, budget.sigma_m),
        np.where(dropped, Reason.OUTLIER, budget.reason),
        contradicting,
    )
