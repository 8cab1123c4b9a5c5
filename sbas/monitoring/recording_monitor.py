"""RAIM of a recording: from the ranges of its fixes, or as its flags and levels have it."""

from __future__ import annotations

import inspect
from numbers import Real
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.monitoring.detection_constants import MonitorDesign, OverallAlarm, chi_square_threshold
from sbas.monitoring.fault_detection import detect
from sbas.monitoring.levels import level_columns
from sbas.monitoring.normal_equations import Floats, Geometry, Ints, geometry, ranges
from sbas.monitoring.raim_result import LevelSource, RaimResult, alarm_runs, worded_table
from sbas.monitoring.receiver_flags import receiver_raim
from sbas.monitoring.recorded_ranges import RecordedRanges, Sigma, has_ranges, recorded_ranges
from sbas.monitoring.separation import SeparationBudget
from sbas.monitoring.verdicts import MonitorReason, Verdict
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE

CHUNK_EPOCHS = 2048
"""Epochs at a time: their arrays stay in the processor's cache."""
_OF_RANGES = ("elevation_deg", "azimuth_deg", "sigma_m", "clock", "residual_m")
NOT_LEAST_SQUARES_M = 0.01
"""A step to the least-squares fix beyond which the residuals are of another one."""


def raim(
    recording: Recording,
    *,
    false_alarm: float = 1e-3,
    missed_detection: float = 1e-4,
    outlier_alarm: float = 1e-4,
    overall: OverallAlarm = "fixed",
    exclusions: int = 1,
    risk: float = 1e-7,
    prior: float = 1e-5,
    track_azimuth_deg: float | None = None,
    sigma: Sigma = None,
    elevation_mask_deg: float | None = None,
    source: LevelSource | None = None,
) -> RaimResult:
    """Fault detection, exclusion and reliability levels of every epoch of a recording.

    Parameters
    ----------
    recording : with a side table `satellites` (elevation, azimuth, sigma, residual, used), or of
        a receiver that logged HERL and VERL.
    false_alarm, missed_detection, outlier_alarm, overall, exclusions : see MonitorDesign.
    risk, prior : of the levels of solution separation, see SeparationBudget.
    track_azimuth_deg : levels along and across a track of this azimuth as well [deg], from -360
        to 360.
    sigma : None takes the table's `sigma_m`; a number [m], or two numbers a, b for the root of
        a^2 + (b / sin elevation)^2, stand for it.
    elevation_mask_deg : ranges below take no part, 0 up to 90.
    source : "ranges", or "receiver" for flags and levels that the recording has; by default
        ranges where it has them with a sigma. All other settings belong to ranges.

    Returns
    -------
    RaimResult. An epoch with fewer than five ranges (one constellation), with a degenerate
    geometry, or with a range of its fix that lacks direction, sigma or residual is not available:
    never passed. Levels of an epoch that passed after an exclusion are those of what is left.

    Raises
    ------
    InputError : neither ranges nor the receiver's levels, probabilities that make no test, or
        settings for levels that were not computed here.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 4.
    """
    if source not in (None, "ranges", "receiver"):
        raise InputError(f"source cannot be {source!r}", cure="ranges or receiver")
    settings: dict[str, object] = {
        "false_alarm": false_alarm, "missed_detection": missed_detection,
        "outlier_alarm": outlier_alarm, "overall": overall, "exclusions": exclusions,
        "risk": risk, "prior": prior, "track_azimuth_deg": track_azimuth_deg, "sigma": sigma,
        "elevation_mask_deg": elevation_mask_deg,
    }  # fmt: skip
    _check(settings)
    design = MonitorDesign(false_alarm, missed_detection, outlier_alarm, overall, exclusions)
    budget = SeparationBudget(risk, false_alarm, prior)
    own = "herl_m" in recording.columns
    if source == "receiver" or (source is None and own and not takes_ranges(recording, sigma)):
        _refuse_settings(settings)
        return receiver_raim(recording)
    given = recorded_ranges(recording, sigma=sigma, elevation_mask_deg=elevation_mask_deg)
    table, steps = _monitored(given, design, budget, track_azimuth_deg)
    table.index = pd.DatetimeIndex(recording.time, name="time")
    findings = list(given.findings)
    if sigma is None and elevation_mask_deg is None and given.has_residuals:
        findings += _other_fixes(steps)
    findings += _two_faults(table, budget)
    return RaimResult(
        table, "ranges", design, budget, track_azimuth_deg,
        alarm_runs(table["detected"].to_numpy(), recording.time), _variance_factor(table),
        given.masked, tuple(findings), sigma, elevation_mask_deg,
    )  # fmt: skip


def takes_ranges(recording: Recording, sigma: Sigma = None) -> bool:
    """True where `raim` computes from a recording's ranges by default: they have a sigma."""
    if not has_ranges(recording):
        return False
    return sigma is not None or "sigma_m" in recording.side_tables[SIDE_TABLE].columns


def _check(settings: dict[str, Any]) -> None:
    """Raise InputError for settings of the wrong kind or range that no part itself refuses."""
    for name in ("false_alarm", "missed_detection", "outlier_alarm", "risk", "prior"):
        if not _is_number(settings[name]):
            raise InputError(f"{name} is a probability", evidence=repr(settings[name]))
    exclusions = settings["exclusions"]
    if isinstance(exclusions, bool) or not isinstance(exclusions, (int, np.integer)):
        raise InputError("exclusions is a whole number", evidence=repr(exclusions), cure="0, 1, 2")
    azimuth, mask = settings["track_azimuth_deg"], settings["elevation_mask_deg"]
    # NaN compares as False: it is refused as well.
    if azimuth is not None and not (_is_number(azimuth) and -360 <= azimuth <= 360):
        raise InputError(
            "the track's azimuth is a number from -360 to 360 [deg]", evidence=repr(azimuth)
        )
    if mask is not None and not (_is_number(mask) and 0 <= mask < 90):
        raise InputError(
            "the elevation mask is a number from 0 up to 90 [deg]", evidence=repr(mask)
        )


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, (bool, np.bool_))


def _refuse_settings(settings: dict[str, Any]) -> None:
    """Raise InputError for settings that levels which were not computed here would ignore."""
    usual = {name: p.default for name, p in inspect.signature(raim).parameters.items()}
    given = [name for name, value in settings.items() if value != usual[name]]
    if given:
        raise InputError(
            "settings of levels from ranges change nothing where the recording's own are taken",
            where=", ".join(given),
            cure="leave them out, or give a recording with ranges: sbas protect",
        )


def _monitored(
    given: RecordedRanges,
    design: MonitorDesign,
    budget: SeparationBudget,
    track_azimuth_deg: float | None,
) -> tuple[pd.DataFrame, Floats]:
    """Table of all epochs, and (n,) how far the recorded fix lies from the one tested here."""
    n = given.reason.size
    parts: list[dict[str, NDArray[Any]]] = []
    steps = [np.empty(0)]
    for low in range(0, max(n, 1), CHUNK_EPOCHS):
        columns, step = _chunk(
            given, slice(low, low + CHUNK_EPOCHS), design, budget, track_azimuth_deg
        )
        parts.append(columns)
        steps.append(step)
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return worded_table(whole, given.names), np.concatenate(steps)


def _chunk(
    given: RecordedRanges,
    rows: slice,
    design: MonitorDesign,
    budget: SeparationBudget,
    track_azimuth_deg: float | None,
) -> tuple[dict[str, NDArray[Any]], Floats]:
    reason = given.reason[rows].copy()
    used = given.used[:, rows] & (reason == 0)
    y = given.residual_m[:, rows]
    some = ranges(
        given.elevation_deg[:, rows], given.azimuth_deg[:, rows], given.sigma_m[:, rows],
        clock=given.clock[:, rows], used=used, residual_m=y,
    )  # fmt: skip
    found = detect(some, y, design)
    g = found.geometry
    satellites, dof = _before_exclusion(given, rows, used, found.excluded, g)
    # What takes part is not the fix, and its number would be that of another one.
    unknown = (reason > 0) & (reason != MonitorReason.NO_SATELLITES)
    left = np.where(unknown, -1, g.satellites)
    verdict, why = found.verdict, found.reason
    if not given.has_residuals:
        tested = g.solved & (g.dof >= 1)
        verdict = np.zeros_like(verdict)
        why = np.where(tested, MonitorReason.NO_RESIDUALS, why).astype(why.dtype)
    why = np.where(reason > 0, reason, why)
    none = np.full(reason.size, np.nan)
    columns: dict[str, NDArray[Any]] = {
        "verdict": verdict,
        "reason": why,
        "available": np.isin(verdict, (Verdict.PASSED, Verdict.PASSED_AFTER_EXCLUSION)),
        "available_vertical": found.available_up & given.has_residuals,
        "detected": found.detected & given.has_residuals,
        "n_sv": np.where(unknown, -1, satellites).astype(np.int16),
        "n_sv_left": left.astype(np.int16),
        "dof": dof.astype(np.int16),
        "statistic": found.statistic if given.has_residuals else none,
        "threshold": found.threshold,
        **level_columns(g, design, budget, track_azimuth_deg),
    }
    here = np.arange(reason.size)
    for number, slot in enumerate(found.excluded):
        satellite = given.satellite[:, rows][slot, here] if len(given.used) else slot
        columns[f"excluded{number}"] = np.where(slot >= 0, satellite, -1)
    step = np.linalg.norm(found.adjustment.step_m, axis=0)
    step[~np.isin(verdict, (Verdict.PASSED, Verdict.DETECTED, Verdict.FAILED))] = np.nan
    return columns, step


def _before_exclusion(
    given: RecordedRanges, rows: slice, used: NDArray[np.bool_], excluded: Ints, g: Geometry
) -> tuple[Ints, Ints]:
    """(n,) ranges and degrees of freedom of the test of all ranges, to which the statistic and
    the threshold belong; the geometry after an exclusion has fewer."""
    satellites, dof = g.satellites.copy(), g.dof.copy()
    at = np.flatnonzero(excluded[0] >= 0)
    if at.size:
        part = [getattr(given, name)[:, rows][:, at] for name in _OF_RANGES]
        whole = geometry(ranges(*part[:3], clock=part[3], used=used[:, at], residual_m=part[4]))
        satellites[at], dof[at] = whole.satellites, whole.dof
    return satellites, dof


def _variance_factor(table: pd.DataFrame) -> float | None:
    dof = table["dof"].to_numpy()
    statistic = table["statistic"].to_numpy()
    rows = np.isfinite(statistic) & (dof >= 1)
    if not rows.any():
        return None
    return float(np.median(statistic[rows] / chi_square_threshold(0.5, dof[rows])))


def _other_fixes(steps: Floats) -> list[Finding]:
    other = int((steps > NOT_LEAST_SQUARES_M).sum())
    if not other:
        return []
    return [
        Finding(
            "E25", "warning",
            "residuals are not those of a least-squares fix with these sigmas",
            where="residual_m", evidence=f"{other} epochs of {int(np.isfinite(steps).sum())}",
            cure="the least-squares fix of these residuals was tested instead of the recorded "
            "one; sigma= (--sigma) gives the weights that the fix had",
        )
    ]  # fmt: skip


def _two_faults(table: pd.DataFrame, budget: SeparationBudget) -> list[Finding]:
    most = int(table["n_sv"].to_numpy().max(initial=0))
    if not budget.two_faults(most) > budget.risk:
        return []
    return [
        Finding(
            "E28", "warning",
            "levels of solution separation leave out a risk above their own: two faults",
            evidence=f"up to {budget.two_faults(most):.3g} per epoch with {most} satellites "
            f"of prior {budget.prior:g}, risk {budget.risk:g}",
            cure="ARAIM covers several faults",
        )
    ]  # fmt: skip
