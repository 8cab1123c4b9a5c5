"""Every fault mode of a few epochs: the step of ARAIM between ranges and levels.

Source: WG-C ARAIM Airborne Algorithm Description Document 3.0 (2017): fault modes, unmonitored
risk, test thresholds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from sbas.monitoring.araim_faults import (
    FaultSets,
    fault_sets,
    more_faults_than,
    most_faults,
    priors_of,
)
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.araim_subsets import Errors, Subsets, complete_fix, subsets
from sbas.monitoring.normal_equations import (
    NEGLIGIBLE_INFLUENCE,
    Floats,
    Ints,
    RangeReason,
    Ranges,
    geometry,
    ranges,
)

Bools = NDArray[np.bool_]
Axes = tuple[str, ...]
ENU: Axes = ("east", "north", "up")
TRACK: Axes = ("along", "across")
_UP = 2


@dataclass(frozen=True, eq=False)
class Slots:
    """What is given of n epochs x s satellites, satellites first."""

    elevation_deg: Floats
    azimuth_deg: Floats
    sigma_m: Floats
    accuracy_m2: Floats
    bias_m: Floats
    clock: Ints
    used: Bools
    residual_m: Floats | None

    def epochs(self, part: slice) -> Slots:
        names = (
            "elevation_deg",
            "azimuth_deg",
            "sigma_m",
            "accuracy_m2",
            "bias_m",
            "clock",
            "used",
        )
        residual = None if self.residual_m is None else self.residual_m[:, part]
        return replace(self, **{n: getattr(self, n)[:, part] for n in names}, residual_m=residual)


@dataclass(frozen=True, eq=False)
class Fixes:
    """Ranges of n epochs pushed together, so that empty slots cost nothing.

    `slot` (s, n): where each range came from; `reason` (m, n) of every slot that was given;
    `serves` (s, n).
    """

    given: Ranges
    errors: Errors
    slot: Ints
    reason: Ints
    serves: Bools


def fixes(slots: Slots) -> Fixes:
    """Ranges that take part, in front; the rest is cut off where no epoch needs it."""
    bounded = np.isfinite(slots.bias_m)
    given = ranges(
        slots.elevation_deg, slots.azimuth_deg, slots.sigma_m,
        clock=slots.clock, used=slots.used & bounded, residual_m=slots.residual_m,
    )  # fmt: skip
    given.reason[slots.used & ~bounded] = RangeReason.NO_BIAS
    serves = given.reason == 0
    most = max(int(serves.sum(axis=0).max(initial=0)), 1)
    slot = np.argsort(~serves, axis=0, kind="stable")[:most]

    def front(values: Floats) -> Floats:
        taken: Floats = np.where(
            np.take_along_axis(serves, slot, 0), np.take_along_axis(values, slot, 0), 0.0
        )
        return taken

    packed = Ranges(
        np.stack([front(row) for row in given.rows]),
        front(given.weight),
        np.take_along_axis(given.clock, slot, 0),
        given.clocks,
        np.take_along_axis(given.reason, slot, 0),
        given.twice,
    )
    errors = Errors(
        front(slots.accuracy_m2),
        front(slots.bias_m),
        None if slots.residual_m is None else front(slots.residual_m),
    )
    return Fixes(packed, errors, slot, given.reason, packed.weight > 0)


@dataclass(frozen=True, eq=False)
class FaultModes:
    """All fault modes of n epochs on q axes, with what the level equation needs.

    Parameters
    ----------
    sets : the modes, one after the other: k in all.
    prior : (k, n), 0 where a mode does not exist at an epoch.
    monitored : (k, n) modes that exist and leave a fix.
    subsets : reduced fixes.
    solved : (n,) there is a fix with every satellite; figures of other epochs mean nothing.
    reason : (n,) of GeometryReason.
    satellites : (n,) ranges in the fix.
    faults : (n,) most faults at a time that are looked at, N_fault,max.
    p_not_monitored : (n,) probability of all faults that are not looked at or leave no fix.
    k_alarm : (q, n) factor K_fa of the test thresholds; NaN where nothing is monitored.
    threshold_m : (q, k, n) thresholds of the solution separations.
    sigma_m, bias_m, sigma_acc_m : (q, n) of the fix with every satellite.
    """

    sets: Sequence[FaultSets]
    prior: Floats
    monitored: Bools
    subsets: Subsets
    solved: Bools
    reason: Ints
    satellites: Ints
    faults: Ints
    p_not_monitored: Floats
    k_alarm: Floats
    threshold_m: Floats
    sigma_m: Floats
    bias_m: Floats
    sigma_acc_m: Floats


def fault_modes(
    fix: Fixes, *, names: Axes, axes: Floats, p_satellite: Floats, p_clock: Floats,
    settings: AraimSettings,
) -> FaultModes:  # fmt: skip
    """Fault modes of epochs.

    Parameters
    ----------
    names, axes : names of the axes, and (q, 3, n) unit vectors in east, north, up.
    p_satellite, p_clock : (c,) priors of a satellite of each constellation, and of each
        constellation.
    """
    given, serves = fix.given, fix.serves
    whole = geometry(given)
    present = np.stack([(serves & (given.clock == c)).any(axis=0) for c in range(given.clocks)])
    p_sat = np.where(serves, p_satellite[given.clock], 0.0)
    p_con = np.where(present, p_clock[: given.clocks, None], 0.0)
    events = np.concatenate([p_sat, p_con])
    faults = most_faults(
        events.sum(axis=0), np.count_nonzero(events, axis=0),
        threshold=settings.p_thres, cap=settings.most_faults,
    )  # fmt: skip
    sets = fault_sets(len(serves), given.clocks, int(faults.max(initial=1)))
    prior = np.concatenate(
        [
            priors_of(s, p_satellite=p_sat, p_clock=p_con, clock=given.clock, most=faults)
            for s in sets
        ]
    )
    reduced = subsets(given, whole, sets, axes, fix.errors)
    monitored = (prior > 0) & reduced.full
    p_not_monitored = more_faults_than(events, faults)
    p_not_monitored += np.where(monitored, 0.0, prior).sum(axis=0)
    count = monitored.sum(axis=0)
    tail = settings.alarm_tails(names)[:, None] / np.maximum(count, 1)
    k_alarm = np.where(count > 0, -ndtri(tail), np.nan)
    sigma, bias, accuracy = complete_fix(whole, axes, fix.errors)
    return FaultModes(
        sets, prior, monitored, reduced, whole.solved, whole.reason, whole.satellites, faults,
        p_not_monitored, k_alarm, k_alarm[:, None] * reduced.sigma_separation_m,
        sigma, bias, accuracy,
    )  # fmt: skip


def vertical_threshold(modes: FaultModes, p_emt: float) -> Floats:
    """(n,) largest vertical threshold [m] of the monitored modes with a prior of at least p_emt.

    NaN where there is no such mode. Priors that equal `p_emt` but for rounding count.
    """
    counts = modes.monitored & (modes.prior >= p_emt * (1 - 1e-3))
    largest = np.where(counts, modes.threshold_m[_UP], -np.inf).max(axis=0)
    return np.where(np.isfinite(largest), largest, np.nan)


def alarm_ratio(modes: FaultModes, axis_known: Bools) -> Floats:
    """(n,) largest solution separation over its threshold: from 1 a fault is detected.

    Every axis is tested, those of a track as well: the level of each contains the threshold of
    its own test. NaN without residuals, or where nothing is monitored.

    Parameters
    ----------
    axis_known : (q, n) False where an axis has no direction, and so no test.
    """
    separation = modes.subsets.separation_m
    if separation is None:
        return np.full(modes.solved.shape, np.nan)
    # A satellite that does not move an axis has nothing but rounding to test there.
    moves = modes.subsets.sigma_separation_m > NEGLIGIBLE_INFLUENCE * modes.sigma_m[:, None]
    tested = moves & modes.monitored & axis_known[:, None]
    threshold = np.where(tested, modes.threshold_m, 1.0)
    with np.errstate(over="ignore"):
        ratio = np.where(tested, np.abs(separation) / threshold, -np.inf).max(axis=(0, 1))
    return np.where(modes.solved & (ratio > -np.inf), ratio, np.nan)
