"""RAIM as flags and columns of a recording: a receiver's own read, or a result written."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.monitoring.normal_equations import Floats
from sbas.monitoring.raim_result import RaimResult, alarm_runs, worded_table
from sbas.monitoring.verdicts import MonitorReason, Verdict
from sbas.recording import Flag, Recording, with_columns

NO_LEVEL_M = -1e10
"""At or below, a receiver's level is its mark for none."""


def receiver_raim(recording: Recording) -> RaimResult:
    """The receiver's own RAIM: flags and external reliability levels, as it logged them.

    A level stands only where the receiver says that its test passed or failed. Without a flag an
    epoch is not available; of contradicting flags the worst counts.
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
    worded = worded_table(columns, ())
    worded.index = pd.DatetimeIndex(recording.time, name="time")
    return RaimResult(
        worded, "receiver", None, None, None, alarm_runs(verdict == Verdict.FAILED, recording.time),
        None, 0, (),
    )  # fmt: skip


def with_raim_flags(recording: Recording, result: RaimResult) -> Recording:
    """The recording with RAIM's verdicts as flags and its levels as columns.

    `RAIM_FAILED` stands wherever a fault was detected, also where the epoch passed after an
    exclusion: the recorded position was made with the faulty range. `herl_m` and `verl_m` are
    missing where nothing is tested or a fault would not show.

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
    own = np.uint32(Flag.RAIM_PASSED | Flag.RAIM_FAILED | Flag.RAIM_NOT_AVAILABLE)
    flags = with_columns(recording.table, ("flags",))["flags"].to_numpy()
    levels: dict[str, Floats] = {}
    for name in ("herl_m", "verl_m"):
        values = result.epochs[name].to_numpy()
        levels[name] = np.where(np.isfinite(values), values, np.nan)
    table = recording.table.assign(flags=(flags & ~own) | bits, **levels)
    return recording.replace(table=table)
