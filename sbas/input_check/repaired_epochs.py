"""Repairs of values: units, coordinates, heights, levels, and epochs that are there twice."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.input_check.coordinates import UNITS_M, to_degrees
from sbas.input_check.frozen_values import LARGEST_LEVEL_M, FrozenRuns
from sbas.input_check.judgement import counted
from sbas.recording import COLUMNS, Flag, Recording, mode_categories, with_columns
from sbas.recording_survey import epoch_rows

Repaired = tuple[Recording, list[Finding]]


def _changed(recording: Recording, columns: Mapping[str, Any], text: str) -> Repaired:
    table = recording.table.assign(**columns)
    return recording.replace(table=table), [Finding("E26", "info", text)]


def _column(recording: Recording, name: str) -> NDArray[np.float64]:
    if name not in recording.table:
        raise InputError(
            f"there is no column {name!r} to repair",
            cure=f"the recording has {', '.join(recording.columns)}",
        )
    values: NDArray[np.float64] = recording.table[name].to_numpy()
    return values


def in_units(recording: Recording, units: Mapping[str, str]) -> Repaired:
    """Columns whose values are in another unit than their name says."""
    remarks = []
    for name, unit in units.items():
        values = _column(recording, name)
        new = values * UNITS_M[unit] if unit in UNITS_M else to_degrees(values, unit)
        text = f"{int(np.isfinite(values).sum()):,} values of {name} were in {unit} (--unit)"
        recording, remark = _changed(recording, {name: new}, text)
        remarks += remark
    return recording, remarks


def from_radians(recording: Recording, _: str) -> Repaired:
    """Latitude and longitude that are radians, in degrees."""
    new = {name: np.degrees(_column(recording, name)) for name in ("lat_deg", "lon_deg")}
    number = int(np.isfinite(new["lat_deg"]).sum())
    return _changed(recording, new, f"{number:,} positions were in radians (--angles rad)")


def swapped(recording: Recording, _: bool) -> Repaired:
    """Latitude and longitude exchanged."""
    lat, lon = _column(recording, "lat_deg"), _column(recording, "lon_deg")
    number = int(np.isfinite(lat).sum())
    text = f"{number:,} positions: latitude and longitude exchanged (--swap-latlon)"
    return _changed(recording, {"lat_deg": lon, "lon_deg": lat}, text)


def with_sign(recording: Recording, which: str) -> Repaired:
    """Latitude, longitude or both with the other sign."""
    names = {"lat": ("lat_deg",), "lon": ("lon_deg",), "both": ("lat_deg", "lon_deg")}[which]
    new = {name: -_column(recording, name) for name in names}
    number = int(np.isfinite(new[names[0]]).sum())
    text = f"{number:,} values of {' and '.join(names)} negated (--sign)"
    return _changed(recording, new, text)


def raised(recording: Recording, offset_m: float) -> Repaired:
    """Every height raised by a constant."""
    height = _column(recording, "height_m")
    number = int(np.isfinite(height).sum())
    text = f"{number:,} heights raised by {offset_m:+.9g} m (--height-offset)"
    return _changed(recording, {"height_m": height + offset_m}, text)


def without_zero_levels(recording: Recording, _: str) -> Repaired:
    """Protection levels that are zero or negative made missing."""
    remarks = []
    for name in ("hpl_m", "vpl_m"):
        if name in recording.table and (wrong := recording.table[name].to_numpy() <= 0).any():
            new = np.where(wrong, np.nan, recording.table[name].to_numpy())
            text = f"{int(wrong.sum()):,} {name} <= 0 made missing (--pl-zero)"
            recording, remark = _changed(recording, {name: new}, text)
            remarks += remark
    return recording, remarks


def without_stand_ins(recording: Recording, value: float) -> Repaired:
    """Protection levels of a value that stands for none made missing, and flagged so."""
    remarks = []
    for name in ("hpl_m", "vpl_m"):
        if name not in recording.table:
            continue
        wrong = recording.table[name].to_numpy() == value
        if not wrong.any():
            continue
        flags = with_columns(recording.table, ["flags"])["flags"].to_numpy().copy()
        flags[wrong] |= np.uint32(Flag.PL_SENTINEL)
        new = {name: np.where(wrong, np.nan, recording.table[name].to_numpy()), "flags": flags}
        text = f"{int(wrong.sum()):,} {name} of {value:g} made missing (--pl-sentinel)"
        recording, remark = _changed(recording, new, text)
        remarks += remark
    return recording, remarks


def without_frozen_levels(recording: Recording, _: str) -> Repaired:
    """Both levels made missing where the horizontal one stands still (E13)."""
    watch = FrozenRuns(("hpl_m",))
    for rows in epoch_rows(recording, watch.COLUMNS):
        watch.update(rows)
    frozen = np.zeros(len(recording), bool)
    for run in watch.frozen():
        if run.value < LARGEST_LEVEL_M:
            frozen[run.row : run.end] = True
    if not frozen.any():
        return recording, []
    new = {
        name: np.where(frozen, np.nan, recording.table[name].to_numpy())
        for name in ("hpl_m", "vpl_m") if name in recording.table
    }  # fmt: skip
    text = f"{counted(int(frozen.sum()), 'epoch')} whose level stood still: made missing"
    return _changed(recording, new, text + " (--pl-frozen)")


def without_repeated(recording: Recording, keep: str) -> Repaired:
    """One epoch a time, completed from dropped ones of that time that nowhere differ."""
    table = recording.table
    drop = table.index.duplicated(keep=keep)
    if not drop.any():
        return recording, []
    table, filled = _completed(table, drop)
    text = f"{int(drop.sum())} epochs with a repeated time left out (--duplicates)"
    evidence = f"kept the {keep}; {filled} values of the others that agree used"
    return recording.replace(table=table), [Finding("E26", "info", text, evidence=evidence)]


def _completed(table: pd.DataFrame, drop: NDArray[np.bool_]) -> tuple[pd.DataFrame, int]:
    """The rows that stay, completed from dropped ones of the same time that nowhere differ.

    An epoch whose blocks came twice, or in two files, is then whole again.
    """
    kept, dropped = table[~drop], table[drop]
    target = kept.index.get_indexer(dropped.index)
    numbers = [n for n in table.columns if n in COLUMNS and COLUMNS[n].dtype in ("f8", "i2")]
    values = {n: _known_numbers(kept, n) for n in numbers}
    others = {n: _known_numbers(dropped, n) for n in numbers}
    differing = np.zeros(len(dropped), bool)
    for n in numbers:
        mine = values[n][target]
        differing |= (mine != others[n]) & ~np.isnan(mine) & ~np.isnan(others[n])
    filled, changes = 0, {}
    for n in numbers:
        usable = ~differing & ~np.isnan(others[n]) & np.isnan(values[n][target])
        if usable.any():
            column = kept[n].to_numpy().copy()
            column[target[usable]] = dropped[n].to_numpy()[usable]
            changes[n] = column
            filled += int(usable.sum())
    if "mode" in table:
        codes = kept["mode"].cat.codes.to_numpy().copy()
        other = dropped["mode"].cat.codes.to_numpy()
        usable = ~differing & (codes[target] < 0) & (other >= 0)
        codes[target[usable]] = other[usable]
        changes["mode"] = mode_categories(codes)
        filled += int(usable.sum())
    return kept.assign(**changes), filled


def _known_numbers(table: pd.DataFrame, name: str) -> NDArray[np.float64]:
    values: NDArray[np.float64] = table[name].to_numpy().astype(float)
    return np.where(values == COLUMNS[name].missing, np.nan, values)
