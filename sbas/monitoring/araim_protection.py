"""Protection levels of ARAIM: multiple-hypothesis solution separation over epochs x satellites.

Source: EU-US Working Group C, ARAIM Technical Subgroup, "ARAIM Airborne Algorithm Algorithm
Description Document", version 3.0, 15 November 2017. The priors are those of the constellations:
reflections and interference near a train are no events of this algorithm.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.monitoring.araim_faults import fault_sets, most_faults, number_of_sets
from sbas.monitoring.araim_geometry import AraimGeometry, numbers_of
from sbas.monitoring.araim_modes import (
    ENU,
    TRACK,
    Axes,
    FaultModes,
    Fixes,
    Slots,
    alarm_ratio,
    fault_modes,
    fixes,
    vertical_threshold,
)
from sbas.monitoring.araim_result import UNMONITORED, AraimResult
from sbas.monitoring.araim_roots import level_of_risk
from sbas.monitoring.araim_settings import AraimSettings, by_constellation
from sbas.monitoring.normal_equations import RangeReason

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Bools = NDArray[np.bool_]

_ELEMENTS = 1 << 19
"""Of the largest array at a time: enough to keep numpy busy, a few megabytes each."""


def araim_levels(
    geometry: AraimGeometry,
    *,
    heading_deg: ArrayLike | None = None,
    residual_m: ArrayLike | None = None,
    settings: AraimSettings | None = None,
) -> AraimResult:
    """Protection levels, effective monitor threshold and accuracy of ARAIM for all epochs.

    Parameters
    ----------
    geometry : ranges of n epochs x m satellites.
    heading_deg : (n,), or one for all: direction of the track from north by east [deg], for
        levels along and across it with one-dimensional probabilities; NaN where unknown, which
        makes these two levels NaN.
    residual_m : (n, m) observed less computed ranges [m], for the solution separation test on
        every axis; a range without takes no part. None gives the levels of the geometry alone:
        nothing is then tested, and no epoch is `available`.
    settings : priors and budgets; None: those of LPV-200.

    Returns
    -------
    AraimResult: levels [m], whether they were tested, and why an epoch has none. Each exceeds
        the root of its equation by at most `araim_roots.TOLERANCE_M` and is never below it.

    Raises
    ------
    InputError : constellations without priors, shapes that do not fit, too many fault modes.

    Notes
    -----
    2 Q((L - b_0)/sigma_0) + sum_k p_k Qm((L - T_k - b_k)/sigma_k) = PHMI_q (1 - P_nm/PHMI), with
    PHMI_H / 2 for each of east and north; P_nm is the probability of all faults that are not
    monitored. HPL = hypot(L_east, L_north).

    References
    ----------
    WG-C ARAIM Airborne Algorithm Description Document 3.0 (2017), protection levels.
    """
    settings = settings or AraimSettings()
    problem = _problem(geometry, heading_deg, residual_m, settings)
    n = geometry.shape[0]
    collected: list[tuple[NDArray[Any], ...]] = []
    left_out: dict[str, int] = {}
    size = problem.epochs_at_a_time()
    for start in range(0, n, size):
        part = slice(start, start + size)
        fix = fixes(problem.slots.epochs(part))
        for code, count in zip(*np.unique(fix.reason, return_counts=True), strict=True):
            if code not in (RangeReason.USED, RangeReason.NOT_GIVEN):
                words = RangeReason(int(code)).words
                left_out[words] = left_out.get(words, 0) + int(count)
        modes = problem.modes(fix, part)
        collected.append(_levels(modes, problem.names, problem.axis_known[:, part], settings))
    if not collected:
        return _nothing(problem.names, settings)
    joined = [np.concatenate(parts) for parts in zip(*collected, strict=True)]
    level, sigma, k_alarm, emt, ratio, p_nm, satellites, faults, monitored, lost, reason = joined
    level[~problem.axis_known.T] = np.nan
    return AraimResult(
        problem.names, level, sigma, k_alarm, emt, ratio, p_nm, satellites, faults, monitored,
        lost, reason, MappingProxyType(left_out), settings,
    )  # fmt: skip


def araim_modes(
    geometry: AraimGeometry,
    epoch: int = 0,
    *,
    heading_deg: ArrayLike | None = None,
    residual_m: ArrayLike | None = None,
    settings: AraimSettings | None = None,
) -> pd.DataFrame:
    """Every fault mode of one epoch: its prior, and sigma, bias and threshold on every axis.

    Parameters
    ----------
    geometry, heading_deg, residual_m, settings : as in `araim_levels`.
    epoch : index of the epoch.

    Returns
    -------
    DataFrame: first the fix without a fault, then a row a mode: `satellites` (slots) and
        `constellations` that fail, `prior`, `monitored`, and for each axis `sigma_..._m`,
        `bias_..._m`, `sigma_separation_..._m`, `threshold_..._m` (NaN where not monitored) and,
        with residuals, `separation_..._m`.

    Raises
    ------
    InputError : no such epoch, or as `araim_levels`.
    """
    settings = settings or AraimSettings()
    problem = _problem(geometry, heading_deg, residual_m, settings)
    n = geometry.shape[0]
    if isinstance(epoch, bool) or not isinstance(epoch, Integral) or not -n <= epoch < n:
        raise InputError(
            f"no epoch {epoch!r}", where="epoch", evidence=f"{n} epochs",
            cure="a whole number from 0, or from -1 downward counted from the end",
        )  # fmt: skip
    epoch = int(epoch) % n
    part = slice(epoch, epoch + 1)
    fix = fixes(problem.slots.epochs(part))
    modes = problem.modes(fix, part)
    table: dict[str, list[Any]] = {
        "satellites": [()], "constellations": [""], "prior": [np.nan], "monitored": [False],
    }  # fmt: skip
    slot = fix.slot[:, 0]
    for one in fault_sets(len(fix.serves), fix.given.clocks, int(modes.faults.max())):
        table["satellites"] += [tuple(sorted(slot[row].tolist())) for row in one.slots]
        table["constellations"] += ["".join(problem.letters[c] for c in one.clocks)] * len(
            one.slots
        )
    table["prior"] += modes.prior[:, 0].tolist()
    table["monitored"] += modes.monitored[:, 0].tolist()
    for q, axis in enumerate(problem.names):
        subsets = modes.subsets
        columns = {
            "sigma": (modes.sigma_m[q, 0], subsets.sigma_m[q, :, 0]),
            "bias": (modes.bias_m[q, 0], subsets.bias_m[q, :, 0]),
            "sigma_separation": (np.nan, subsets.sigma_separation_m[q, :, 0]),
            "threshold": (np.nan, modes.threshold_m[q, :, 0]),
        }
        if subsets.separation_m is not None:
            columns["separation"] = np.nan, subsets.separation_m[q, :, 0]
        for name, (first, rest) in columns.items():
            shown = np.where(modes.monitored[:, 0], rest, np.nan)
            table[f"{name}_{axis}_m"] = [float(first), *shown.tolist()]
    frame = pd.DataFrame(table)
    return frame[(frame["prior"] > 0) | (frame.index == 0)].reset_index(drop=True)


@dataclass(frozen=True, eq=False)
class _Problem:
    """Input as the sums want it: satellites first."""

    names: Axes
    axes: Floats
    axis_known: Bools
    slots: Slots
    letters: tuple[str, ...]
    p_satellite: Floats
    p_clock: Floats
    settings: AraimSettings

    def epochs_at_a_time(self) -> int:
        """Epochs whose modes, satellites and axes make about `_ELEMENTS` together at most."""
        used = self.slots.used
        most_used = max(int(used.sum(axis=0).max(initial=0)), 1)
        total = np.where(used, self.p_satellite[self.slots.clock], 0.0).sum(axis=0)
        total += self.p_clock.sum()
        events = np.full(total.shape, most_used + self.p_clock.size)
        faults = most_faults(
            total, events, threshold=self.settings.p_thres, cap=self.settings.most_faults
        )
        sets = number_of_sets(most_used, self.p_clock.size, int(faults.max(initial=1)))
        return max(1, _ELEMENTS // (sets * most_used * len(self.names)))

    def modes(self, fix: Fixes, part: slice) -> FaultModes:
        return fault_modes(
            fix, names=self.names, axes=self.axes[:, :, part],
            p_satellite=self.p_satellite, p_clock=self.p_clock, settings=self.settings,
        )  # fmt: skip


def _problem(
    geometry: AraimGeometry,
    heading_deg: ArrayLike | None,
    residual_m: ArrayLike | None,
    settings: AraimSettings,
) -> _Problem:
    n, m = geometry.shape
    letters, clock, known = geometry.clocks()
    accuracy, bias = np.asarray(geometry.sigma_acc_m), np.asarray(geometry.b_nom_m)
    with np.errstate(over="ignore"):
        accuracy_m2 = accuracy * accuracy
    sound = (accuracy > 0) & np.isfinite(accuracy_m2)
    slots = Slots(
        elevation_deg=np.asarray(geometry.elevation_deg).T,
        azimuth_deg=np.asarray(geometry.azimuth_deg).T,
        sigma_m=np.where(sound, geometry.sigma_int_m, np.nan).T,
        accuracy_m2=accuracy_m2.T,
        bias_m=bias.T,
        clock=clock.T,
        used=(np.asarray(geometry.used) & known).T,
        residual_m=None if residual_m is None else _shaped("residual_m", residual_m, (n, m)).T,
    )
    names: Axes = ENU if heading_deg is None else ENU + TRACK
    axes = np.zeros((len(names), 3, n))
    axes[[0, 1, 2], [0, 1, 2]] = 1.0
    axis_known = np.ones((len(names), n), np.bool_)
    if heading_deg is not None:
        given = _shaped("heading_deg", heading_deg, (n,))
        axis_known[len(ENU) :] = np.isfinite(given)
        heading = np.deg2rad(np.where(np.isfinite(given), given, 0.0))
        axes[3, 0], axes[3, 1] = np.sin(heading), np.cos(heading)
        axes[4, 0], axes[4, 1] = np.cos(heading), -np.sin(heading)
    # Without any satellite there is one constellation all the same: nobody's.
    named = letters or ("",)
    priors = AraimSettings(p_satellite=0.0, p_constellation=0.0) if not letters else settings
    return _Problem(
        names, axes, axis_known, slots, letters,
        by_constellation("p_satellite", priors.p_satellite, named),
        by_constellation("p_constellation", priors.p_constellation, named),
        settings,
    )  # fmt: skip


def _shaped(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    array = numbers_of(name, value)
    try:
        return np.broadcast_to(array, shape)
    except ValueError:
        raise InputError(
            f"{name} does not fit the geometry",
            where=name,
            evidence=f"shape {array.shape}, expected {shape}",
        ) from None


def _levels(
    modes: FaultModes, names: Axes, axis_known: Bools, settings: AraimSettings
) -> tuple[NDArray[Any], ...]:
    """Columns of an AraimResult for some epochs, epochs first."""
    q, n = modes.sigma_m.shape
    solved = modes.solved
    left = 1.0 - modes.p_not_monitored / (settings.phmi_v + settings.phmi_h)
    usable = solved & (left > 0)
    budget = settings.risk_shares(names)[:, None] * np.where(usable, left, 0.0)
    monitored = modes.monitored & usable
    shape = (len(modes.prior), q * n)

    def by_row(values: Floats, absent: float) -> Floats:
        rows = np.where(monitored[:, None], values, absent)
        return rows.reshape(shape)

    level = level_of_risk(
        budget.ravel(),
        modes.sigma_m.ravel(),
        modes.bias_m.ravel(),
        by_row(np.broadcast_to(modes.prior[:, None], (len(modes.prior), q, n)), 0.0),
        by_row((modes.threshold_m + modes.subsets.bias_m).swapaxes(0, 1), 0.0),
        by_row(modes.subsets.sigma_m.swapaxes(0, 1), 1.0),
    ).reshape(q, n)
    # Without redundancy nothing can be monitored: the geometry is the better word for it.
    exhausted = np.where(modes.reason > 0, modes.reason, UNMONITORED)
    reason = np.where(usable, 0, exhausted).astype(np.int8)
    counted = modes.monitored & solved
    return (
        level.T,
        np.where(solved, modes.sigma_acc_m, np.nan).T,
        np.where(solved, modes.k_alarm, np.nan).T,
        np.where(solved, vertical_threshold(modes, settings.p_emt), np.nan),
        alarm_ratio(modes, axis_known),
        np.where(solved, modes.p_not_monitored, np.nan),
        modes.satellites,
        modes.faults,
        counted.sum(axis=0),
        ((modes.prior > 0) & solved & ~modes.monitored).sum(axis=0),
        reason,
    )


def _nothing(names: Axes, settings: AraimSettings) -> AraimResult:
    """The result of no epochs."""
    wide, plain, whole = np.empty((0, len(names))), np.empty(0), np.empty(0, np.int64)
    return AraimResult(
        names, wide, wide, wide, plain, plain, plain, whole, whole, whole, whole, whole,
        MappingProxyType({}), settings,
    )  # fmt: skip
