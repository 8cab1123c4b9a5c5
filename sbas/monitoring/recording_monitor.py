"""RAIM of a recording: from the ranges of its fixes, or as its receiver reported it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.monitoring.detection_constants import MonitorDesign, OverallAlarm, chi_square_threshold
from sbas.monitoring.fault_detection import detect
from sbas.monitoring.levels import level_columns
from sbas.monitoring.normal_equations import Floats, ranges
from sbas.monitoring.raim_result import LevelSource, RaimResult, alarm_runs, worded_table
from sbas.monitoring.receiver_flags import receiver_raim
from sbas.monitoring.recorded_ranges import RecordedRanges, Sigma, has_ranges, recorded_ranges
from sbas.monitoring.separation import SeparationBudget
from sbas.monitoring.verdicts import MonitorReason, Verdict
from sbas.recording import Recording

CHUNK_EPOCHS = 2048
"""Epochs at a time: their arrays stay in the processor's cache."""
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
    track_azimuth_deg : levels along and across a track of this azimuth as well [deg].
    sigma : None takes the table's `sigma_m`; a number [m], or two numbers a, b for the root of
        a^2 + (b / sin elevation)^2, stand for it.
    elevation_mask_deg : ranges below take no part.
    source : "ranges" or "receiver"; by default ranges where the recording has them.

    Returns
    -------
    RaimResult. An epoch with fewer than five ranges (one constellation), with a degenerate
    geometry, or with a range of its fix that lacks direction, sigma or residual is not available:
    never passed.

    Raises
    ------
    InputError : neither ranges nor the receiver's levels, or probabilities that make no test.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 4.
    """
    if source not in (None, "ranges", "receiver"):
        raise InputError(f"source cannot be {source!r}", cure="ranges or receiver")
    if track_azimuth_deg is not None and not np.isfinite(track_azimuth_deg):
        raise InputError("the track's azimuth must be a number [deg]")
    design = MonitorDesign(false_alarm, missed_detection, outlier_alarm, overall, exclusions)
    budget = SeparationBudget(risk, false_alarm, prior)
    own = "herl_m" in recording.columns
    if source == "receiver" or (source is None and not has_ranges(recording) and own):
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
        given.masked, tuple(findings),
    )  # fmt: skip


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
        "n_sv": g.satellites.astype(np.int16),
        "dof": g.dof.astype(np.int16),
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
            "one; --sigma gives the weights that the fix had",
        )
    ]  # fmt: skip


def _two_faults(table: pd.DataFrame, budget: SeparationBudget) -> list[Finding]:
    most = int(table["n_sv"].max()) if len(table) else 0
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
