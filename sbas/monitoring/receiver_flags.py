"""RAIM as flags and columns of a recording: read as they stand there, or a result written."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.normal_equations import Floats
from sbas.monitoring.raim_result import RaimResult, alarm_runs, worded_table
from sbas.monitoring.separation import SeparationBudget
from sbas.monitoring.verdicts import MonitorReason, Verdict
from sbas.recording import Flag, Recording, with_columns

NO_LEVEL_M = -1e10
"""At or below, a receiver's level is its mark for none."""
MARK = "raim"
"""Key of `RecordingMeta.options` under which flags and levels of `with_raim_flags` say, as JSON,
that no receiver made them, and how they were made."""
_RAIM_BITS = np.uint32(Flag.RAIM_PASSED | Flag.RAIM_FAILED | Flag.RAIM_NOT_AVAILABLE)


def receiver_raim(recording: Recording) -> RaimResult:
    """RAIM as the recording has it: flags and external reliability levels.

    A level stands only where the flags say that the test passed or failed. Without a flag an
    epoch is not available; of contradicting flags the worst counts. Vertically it is available
    only with a VERL: where a fault would not show there is none.

    Returns
    -------
    RaimResult of source "written" with its settings where `with_raim_flags` left its mark, else
    "receiver".
    """
    names = ("flags", "herl_m", "verl_m", "n_sv")
    if "herl_m" not in recording.columns and "flags" not in recording.columns:
        raise InputError(
            "the recording has neither ranges nor the receiver's own RAIM",
            evidence=f"columns {', '.join(recording.columns)}",
            cure="SBF with RAIMStatistics; or ranges: sbas protect",
        )
    table = with_columns(recording.table, names)
    flags = table["flags"].to_numpy()
    passed, failed, none = (
        (flags & bit) != 0 for bit in (Flag.RAIM_PASSED, Flag.RAIM_FAILED, Flag.RAIM_NOT_AVAILABLE)
    )
    verdict = np.where(passed & ~none, Verdict.PASSED, Verdict.NOT_AVAILABLE)
    verdict = np.where(failed, Verdict.FAILED, verdict)
    reason = np.where(none | failed, MonitorReason.RECEIVER, MonitorReason.NOT_STATED)
    reason = np.where(verdict == Verdict.PASSED, MonitorReason.NONE, reason)
    stated = verdict != Verdict.NOT_AVAILABLE
    columns: dict[str, NDArray[Any]] = {
        "verdict": verdict,
        "reason": reason,
        "available": verdict == Verdict.PASSED,
        "available_vertical": verdict == Verdict.PASSED,
        "detected": verdict == Verdict.FAILED,
        "n_sv": table["n_sv"].to_numpy(),
        "excluded0": np.full(len(table), -1),
    }
    for name in ("herl_m", "verl_m"):
        values = table[name].to_numpy()
        columns[name] = np.where(stated & (values > NO_LEVEL_M), values, np.nan)
    columns["available_vertical"] &= np.isfinite(columns["verl_m"])
    worded = worded_table(columns, ())
    worded.index = pd.DatetimeIndex(recording.time, name="time")
    found = RaimResult(
        worded, "receiver", None, None, None, alarm_runs(verdict == Verdict.FAILED, recording.time),
        None, 0, (),
    )  # fmt: skip
    mark = recording.meta.options.get(MARK)
    return found if mark is None else replace(found, source="written", **_settings(mark))


def with_raim_flags(recording: Recording, result: RaimResult) -> Recording:
    """The recording with RAIM's verdicts as flags and its levels as columns.

    `RAIM_FAILED` stands wherever a fault was detected, also where the epoch passed after an
    exclusion: the recorded position was made with the faulty range. `herl_m` and `verl_m` are
    missing where nothing is tested or a fault would not show.

    Flags and levels that were computed leave the mark `MARK` in the metadata, with their
    settings: Parquet keeps it, so that they are never taken for a receiver's. Where they replace
    RAIM that the recording had from elsewhere, a finding E26 counts its epochs.

    Raises
    ------
    InputError : a result of another recording.
    """
    if not np.array_equal(result.epochs.index.to_numpy(), recording.time):
        raise InputError(
            "the result is of another recording",
            evidence=f"{len(result.epochs)} epochs, and {len(recording)}",
        )
    verdict = result.epochs["verdict"].cat.codes.to_numpy()
    bits = np.full(verdict.size, Flag.RAIM_FAILED, np.uint32)
    bits[verdict == Verdict.PASSED] = Flag.RAIM_PASSED
    bits[verdict == Verdict.NOT_AVAILABLE] = Flag.RAIM_NOT_AVAILABLE
    given = with_columns(recording.table, ("flags", "herl_m", "verl_m"))
    flags = given["flags"].to_numpy()
    levels: dict[str, Floats] = {}
    for name in ("herl_m", "verl_m"):
        values = result.epochs[name].to_numpy()
        tested = np.isfinite(values) & (verdict != Verdict.NOT_AVAILABLE)
        levels[name] = np.where(tested, values, np.nan)
    table = recording.table.assign(flags=(flags & ~_RAIM_BITS) | bits, **levels)
    if result.source == "receiver":
        return recording.replace(table=table)
    options = {**recording.meta.options, MARK: _mark(result)}
    marked = recording.replace(table=table, meta=replace(recording.meta, options=options))
    had = (flags & _RAIM_BITS) != 0
    had |= np.isfinite(given[["herl_m", "verl_m"]].to_numpy()).any(axis=1)
    if MARK in recording.meta.options or not had.any():
        return marked
    return marked.with_findings(
        Finding(
            "E26", "info",
            "RAIM flags and levels that the recording had are replaced by computed ones",
            where="flags, herl_m, verl_m", evidence=f"{int(had.sum()):,} epochs of {had.size:,}",
            cure="the recording as it was read still has its receiver's own",
        )
    )  # fmt: skip


def _mark(result: RaimResult) -> str:
    return json.dumps(
        {
            "by": "sbas",
            "design": None if result.design is None else vars(result.design),
            "budget": None if result.budget is None else vars(result.budget),
            "track_azimuth_deg": result.track_azimuth_deg,
            "sigma": result.sigma,
            "elevation_mask_deg": result.elevation_mask_deg,
        },
        sort_keys=True,
    )


def _settings(mark: str) -> dict[str, Any]:
    """Settings of a mark; none where it cannot be read, for who wrote it stays true."""
    try:
        plain = json.loads(mark)
        sigma = plain["sigma"]
        return {
            "design": None if plain["design"] is None else MonitorDesign(**plain["design"]),
            "budget": None if plain["budget"] is None else SeparationBudget(**plain["budget"]),
            "track_azimuth_deg": plain["track_azimuth_deg"],
            "sigma": tuple(sigma) if isinstance(sigma, list) else sigma,
            "elevation_mask_deg": plain["elevation_mask_deg"],
        }
    except (KeyError, TypeError, ValueError, RecursionError):
        return {}
