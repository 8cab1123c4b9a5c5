"""The ranges of a recording's fixes as arrays, satellites first."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import Any, TypeGuard

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.monitoring.direction_units import radians_in
from sbas.monitoring.normal_equations import Bools, Floats, Ints
from sbas.monitoring.verdicts import MonitorReason
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE

SYSTEMS = "GRECJI"
"""RINEX letters of constellations with a clock of their own; SBAS satellites (S) keep GPS time."""
USUAL_SIGMA_M = 0.05, 50.0
NEEDED = ("satellite", "elevation_deg", "azimuth_deg", "used")

Sigma = float | tuple[float, float] | None


@dataclass(frozen=True, eq=False)
class RecordedRanges:
    """Ranges of (n,) epochs of a recording in (s, n) slots.

    `used` False where a slot is empty; `clock` constellation of each; `satellite` index into
    `names`, -1 where empty; `reason` (n,) of MonitorReason where an epoch's ranges do not make up
    its fix, 0 elsewhere. `masked` ranges lie below the elevation mask.
    """

    elevation_deg: Floats
    azimuth_deg: Floats
    sigma_m: Floats
    residual_m: Floats
    clock: Ints
    used: Bools
    satellite: Ints
    names: tuple[str, ...]
    reason: Ints
    has_residuals: bool
    masked: int
    findings: tuple[Finding, ...]


def has_ranges(recording: Recording) -> bool:
    """True where the recording says which satellites were used, and in which direction."""
    side = recording.side_tables.get(SIDE_TABLE)
    return side is not None and all(name in side.columns for name in NEEDED)


def recorded_ranges(
    recording: Recording, *, sigma: Sigma = None, elevation_mask_deg: float | None = None
) -> RecordedRanges:
    """Ranges used in a recording's fixes.

    Parameters
    ----------
    sigma : None takes `sigma_m` of the satellite table; a number is the 1-sigma of every range
        [m]; two numbers a, b [m] mean the root of a^2 + (b / sin elevation)^2.
    elevation_mask_deg : ranges below take no part, as if the fix had not used them; 0 to 90.

    Raises
    ------
    InputError : no such table, columns of another type, angles in radians, elevations beyond 90
        degrees, sigmas of used ranges that are 0 or less, satellites of no known constellation,
        or a sigma or mask that is none.
    """
    low_deg = _mask(elevation_mask_deg)
    model = None if sigma is None else _sigma_model(sigma)
    side = recording.side_tables.get(SIDE_TABLE)
    needed = NEEDED if sigma is not None else (*NEEDED, "sigma_m")
    lacking = needed if side is None else [name for name in needed if name not in side.columns]
    if side is None or lacking:
        raise InputError(
            "the recording does not say which satellites were used, and how",
            evidence=f"side table {SIDE_TABLE!r}: no {', '.join(lacking)}",
            cure="sbas protect makes such a recording; with ranges of unknown sigma give sigma= "
            "(sbas raim --sigma) in metres",
        )
    rows = np.flatnonzero(_used(side["used"]))
    stamps = _times(side["time"])[rows]
    order = np.argsort(stamps, kind="stable")
    rows, stamps = rows[order], stamps[order]
    elevation, azimuth = (_numbers(side[name])[rows] for name in ("elevation_deg", "azimuth_deg"))
    _check_angles(elevation, azimuth, stamps)
    code, names, clock_of = _satellites(side["satellite"])
    code = code[rows]
    clock = clock_of[code]
    low = elevation < low_deg
    if model is None:
        spread = _numbers(side["sigma_m"])[rows]
        _check_sigmas(spread[~low])
    else:
        spread = _modelled(model, elevation)
    has_residuals = "residual_m" in side.columns
    residual = _numbers(side["residual_m"])[rows] if has_residuals else np.zeros(rows.size)
    findings = list(_sigma_findings(spread))
    epoch, slot, reason, lost = _places(recording, stamps)
    if lost:
        findings.append(
            Finding(
                "E25", "warning", "satellites at times at which the recording has no epoch",
                where=f"side table {SIDE_TABLE!r}", evidence=f"{lost} rows of {rows.size}",
                cure="they are left out; give the table and the epochs the same times",
            )
        )  # fmt: skip
    n = len(recording)
    known = epoch >= 0
    with np.errstate(divide="ignore", over="ignore"):
        weight = 1 / (spread * spread)
    # A sigma whose weight is 0 or infinite is none: its range would drop out of the fix.
    sound = np.isfinite(elevation + azimuth) & (spread > 0) & (weight > 0) & (weight < np.inf)
    sound &= (np.isfinite(residual) & (code >= 0)) | low
    faulty = epoch[known & ~sound & ~low]
    reason[faulty[reason[faulty] == 0]] = MonitorReason.INCOMPLETE
    key = epoch * (len(names) + 1) + code + 1
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    twice = epoch[first[count > 1]]
    reason[twice[twice >= 0]] = MonitorReason.TWICE
    keep = known & ~low
    at = (slot[keep], epoch[keep])
    shape = (int(slot[keep].max(initial=-1)) + 1, n)

    def slots(values: NDArray[Any], empty: float) -> NDArray[Any]:
        array = np.full(shape, empty, values.dtype)
        array[at] = values[keep]
        return array

    return RecordedRanges(
        slots(elevation, np.nan), slots(azimuth, np.nan), slots(spread, np.nan),
        slots(residual, np.nan), slots(clock, 0), slots(np.ones(rows.size, bool), False),
        slots(code, -1), names, reason, has_residuals, int((low & known).sum()), tuple(findings),
    )  # fmt: skip


def _satellites(column: pd.Series) -> tuple[Ints, tuple[str, ...], Ints]:
    """Codes of the rows, names by code, and constellations by code (the last for none)."""
    if not isinstance(column.dtype, pd.CategoricalDtype):
        column = column.astype("category")
    names = tuple(str(name) for name in column.cat.categories)
    code = column.cat.codes.to_numpy().astype(np.int64)
    letters = ["G" if name[:1] == "S" else name[:1] for name in names]
    present = {letters[number] for number in np.unique(code[code >= 0]).tolist()}
    unknown = sorted(letter for letter in present if not letter or letter not in SYSTEMS)
    if unknown:
        raise InputError(
            "satellites of no known constellation", where=f"side table {SIDE_TABLE!r}",
            evidence=f"first letters {', '.join(map(repr, unknown))}",
            cure="RINEX 3 names such as G05, R12, E01, C30, S36",
        )  # fmt: skip
    clocks = sorted(present)
    numbers = [clocks.index(letter) if letter in present else 0 for letter in letters]
    return code, names, np.array([*numbers, 0], np.int64)


def _used(column: pd.Series) -> Bools:
    """Which rows are used: a range of which that is not known is not the fix's, nor is it none."""
    kind = column.dtype
    if isinstance(kind, pd.CategoricalDtype) or not pd.api.types.is_bool_dtype(kind):
        raise InputError(
            "which satellites were used is said by booleans", where=_column("used"),
            evidence=f"values of type {kind}", cure="True or False in every row",
        )  # fmt: skip
    unknown = int(column.isna().sum())
    if unknown:
        raise InputError(
            "of some satellites it is not said whether they were used", where=_column("used"),
            evidence=f"{unknown} rows of {len(column)}", cure="True or False in every row",
        )  # fmt: skip
    known: Bools = column.to_numpy(np.bool_)
    return known


def _times(column: pd.Series) -> Ints:
    """Nanoseconds of GPS time."""
    if not isinstance(column.dtype, np.dtype) or column.dtype.kind != "M":
        raise InputError(
            "times of satellites must be dates without a time zone", where=_column("time"),
            evidence=f"values of type {column.dtype}", cure="GPS time as datetime64[ns]",
        )  # fmt: skip
    stamps: Ints = column.to_numpy().astype("M8[ns]").astype(np.int64)
    return stamps


def _numbers(column: pd.Series) -> Floats:
    """Values with NaN where there is none."""
    if pd.api.types.is_bool_dtype(column.dtype) or not pd.api.types.is_numeric_dtype(column.dtype):
        raise InputError(
            "values of satellites must be numbers", where=_column(str(column.name)),
            evidence=f"values of type {column.dtype}", cure="NaN where unknown",
        )  # fmt: skip
    values: Floats = column.to_numpy(np.float64, na_value=np.nan)
    return values


def _column(name: str) -> str:
    return f"side table {SIDE_TABLE!r}, column {name!r}"


def _check_angles(elevation_deg: Floats, azimuth_deg: Floats, stamps: Ints) -> None:
    """Refuse directions that are none; rows are in the order of their times."""
    steepest = np.abs(elevation_deg[np.isfinite(elevation_deg)]).max(initial=0.0)
    if steepest > 90:
        raise InputError(
            "elevations beyond 90 degrees", code="E08", where="elevation_deg",
            evidence=f"up to {steepest:g}", cure="degrees above the horizon",
        )  # fmt: skip
    epoch = np.cumsum(np.diff(stamps, prepend=stamps[:1]) != 0)
    evidence = radians_in(elevation_deg, azimuth_deg, epoch)
    if evidence:
        raise InputError(
            "directions of satellites look like radians", code="E08",
            where=f"side table {SIDE_TABLE!r}", evidence=evidence, cure="give degrees",
        )  # fmt: skip


def _mask(elevation_mask_deg: float | None) -> float:
    """The elevation [deg] below which ranges take no part."""
    if elevation_mask_deg is None:
        return -np.inf
    if not _real(elevation_mask_deg) or not 0 <= elevation_mask_deg <= 90:
        raise InputError(
            "the elevation mask lies between 0 and 90 degrees", where="elevation_mask_deg",
            evidence=f"{elevation_mask_deg!r}", cure="None for no mask",
        )  # fmt: skip
    return float(elevation_mask_deg)


def _sigma_model(sigma: object) -> tuple[float, float]:
    """The two numbers of a model of the elevation."""
    parts = sigma if isinstance(sigma, tuple) else (sigma, 0.0)
    if (
        len(parts) != 2
        or not all(_real(part) and 0 <= part < np.inf for part in parts)
        or not sum(parts) > 0
    ):
        raise InputError(
            "sigma needs a number, or two in a tuple, of 0 or more, one above 0 [m]",
            where="sigma", evidence=f"{sigma!r}",
            cure="sigma=3.0, or sigma=(0.3, 0.3) for the root of a^2 + (b / sin elevation)^2",
        )  # fmt: skip
    return float(parts[0]), float(parts[1])


def _real(value: object) -> TypeGuard[float]:
    return isinstance(value, Real) and not isinstance(value, bool)


def _modelled(model: tuple[float, float], elevation_deg: Floats) -> Floats:
    a, b = model
    with np.errstate(divide="ignore", invalid="ignore"):
        slant = np.where(b > 0, b / np.sin(np.deg2rad(np.maximum(elevation_deg, 0.0))), 0.0)
    spread: Floats = np.hypot(a, slant)
    return spread


def _check_sigmas(sigma_m: Floats) -> None:
    none = sigma_m <= 0
    if none.any():
        raise InputError(
            "sigmas of used ranges are 0 or less", code="E08", where=_column("sigma_m"),
            evidence=f"{int(none.sum())} of {sigma_m.size} ranges, down to {sigma_m[none].min():g}",
            cure="NaN where the sigma is not known; sigma= (--sigma) gives one to all",
        )  # fmt: skip


def _sigma_findings(sigma_m: Floats) -> tuple[Finding, ...]:
    known = sigma_m[np.isfinite(sigma_m) & (sigma_m > 0)]
    middle = float(np.median(known)) if known.size else 1.0
    if USUAL_SIGMA_M[0] <= middle <= USUAL_SIGMA_M[1]:
        return ()
    return (
        Finding(
            "E08", "warning", "the ranges' sigmas are unusual: variances, or another unit?",
            where="sigma_m", evidence=f"median {middle:g} m",
            cure="give 1-sigma in metres; sigma= (--sigma) sets it",
        ),
    )  # fmt: skip


def _places(recording: Recording, stamps: Ints) -> tuple[Ints, Ints, Ints, int]:
    """Epoch (-1 where the recording has none) and slot of sorted rows, (n,) reasons of epochs,
    and the number of rows without one."""
    time = recording.time.astype("M8[ns]").astype(np.int64)
    order = np.argsort(time, kind="stable")
    ordered = time[order]
    n = time.size
    reason = np.full(n, MonitorReason.NO_SATELLITES, np.int8)
    at = np.minimum(np.searchsorted(ordered, stamps), max(n - 1, 0))
    found = (ordered[at] == stamps) if n else np.zeros(stamps.size, bool)
    epoch = np.where(found, order[at] if n else -1, -1)
    reason[epoch[found]] = MonitorReason.NONE
    again = np.flatnonzero(ordered[1:] == ordered[:-1])
    for one in (again, again + 1):
        reason[order[one]] = MonitorReason.TIME_TWICE
    first = np.flatnonzero(np.diff(stamps, prepend=stamps[:1] - 1)) if stamps.size else stamps
    start = np.repeat(first, np.diff(first, append=stamps.size))
    return epoch, np.arange(stamps.size) - start, reason, int((~found).sum())
