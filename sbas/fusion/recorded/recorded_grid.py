"""Recordings on a grid of cells, an interval each, and where a window fits into them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.fusion.recorded.recorded_errors import RecordedErrors
from sbas.recording_survey import GAP_STEPS
from sbas.timescales import NS_PER_S

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_STEP_TOLERANCE: Final = 1e-3
"""Receivers' clocks make the median step differ from the nominal one."""


@dataclass(frozen=True, eq=False)
class RecordedGrid:
    """All recordings one after the other, barred cells between them.

    Parameters
    ----------
    interval_s : of a cell [s].
    alert_limit_m : of the recordings' thresholds.
    values : (a, c) errors on the axes that the simulation takes, NaN no data [m].
    across_m : (c,) error across the track [m].
    barred : (c,) True where a window must not go.
    label : (c,) index into `labels`, -1 where unlabelled.
    labels : environments.
    begins : (k,) first cell of each recording.
    """

    interval_s: float
    alert_limit_m: float
    values: Floats
    across_m: Floats
    barred: Bools
    label: Ints
    labels: tuple[str, ...]
    begins: Ints

    def code_of(self, environment: str) -> int:
        """Index of a label; raises InputError where there is no such."""
        if environment in self.labels:
            return self.labels.index(environment)
        raise InputError(
            f"no environment {environment!r} in these recordings",
            cure="one of " + (", ".join(self.labels) or "none: no labels"),
        )


def recorded_grid(
    recordings: RecordedErrors | Sequence[RecordedErrors], longest_outage_s: float, axes: int
) -> RecordedGrid:
    """Recordings one after the other on one grid.

    Parameters
    ----------
    recordings : each one a record of its own.
    longest_outage_s : gaps up to this long become cells without data, longer ones are barred [s].
    axes : 1 along the track, or 3 along, across and up.

    Raises
    ------
    InputError : none, several intervals or alert limits, or an argument out of range.
    """
    records = (recordings,) if isinstance(recordings, RecordedErrors) else tuple(recordings)
    if not records:
        raise InputError("no recording to draw from")
    if axes not in (1, 3):
        raise InputError("errors have 1 axis or 3", evidence=f"axes = {axes!r}")
    if not 0 <= longest_outage_s < math.inf:
        raise InputError("the longest outage is 0 s or more", evidence=f"{longest_outage_s} s")
    interval, limit = records[0].interval_s, records[0].thresholds.alert_limit_m
    labels: list[str] = []
    parts = []
    for number, record in enumerate(records):
        same = abs(record.interval_s - interval) <= _STEP_TOLERANCE * interval
        if not same or record.thresholds.alert_limit_m != limit:
            raise InputError(
                "recordings of another interval or alert limit", where=f"recording {number + 1}",
                evidence=f"{record.interval_s:g} s and {record.thresholds.alert_limit_m:g} m, the "
                f"first one {interval:g} s and {limit:g} m",
                cure="a source for each",
            )  # fmt: skip
        parts.append(_one(record, longest_outage_s, axes, labels))
    values, across, barred, label = (
        np.concatenate(column, axis=-1) for column in zip(*parts, strict=True)
    )
    lengths = [part[2].size for part in parts]
    begins = np.cumsum([0, *lengths[:-1]])
    return RecordedGrid(interval, limit, values, across, barred, label, tuple(labels), begins)


def _one(
    record: RecordedErrors, longest_outage_s: float, axes: int, labels: list[str]
) -> tuple[Floats, Floats, Bools, Ints]:
    """Values, across, barred, label by cell; the last cell is barred. `labels` grows."""
    if not record.interval_s > 0:
        raise InputError("one epoch has no step", cure="a longer recording")
    time_ns: Ints = record.time.astype("M8[ns]").astype(np.int64)
    steps = (time_ns[1:] - time_ns[:-1]) / (record.interval_s * NS_PER_S)
    whole = np.maximum(np.rint(steps), 1).astype(np.int64)
    whole[steps <= GAP_STEPS] = 1
    # Half an interval is the least step that counts as one; see `sbas.receiver_states`.
    cut = (steps < 0.5) | (
        (steps > GAP_STEPS) & ((steps - 1) * record.interval_s > longest_outage_s)
    )
    cell = np.concatenate([[0], np.cumsum(np.where(cut, 2, whole))]).astype(np.int64)
    cells = int(cell[-1]) + 2
    errors = np.stack([record.along_m, record.across_m, record.up_m])
    values = np.full((3, cells), np.nan)
    values[:, cell] = errors
    barred = np.zeros(cells, bool)
    barred[cell[1:][cut] - 1] = True
    barred[-1] = True
    # A fix whose error is not known on every axis is no outage: no window may hold it.
    untold = (record.state >= 0) & ~np.isfinite(errors[:axes]).all(axis=0)
    barred[cell[record.unknown | untold]] = True
    codes = [_appended(labels, name) for name in record.labels]
    label = np.full(cells, -1, np.int64)
    label[cell] = np.array([*codes, -1], np.int64)[record.environment]
    # A cell that nobody recorded is where the epoch before it was, and as doubtful.
    seen = np.zeros(cells, np.int64)
    seen[cell] = cell
    before = np.maximum.accumulate(seen)
    return values[:axes], values[1], barred | barred[before], label[before]


def _appended(labels: list[str], name: str) -> int:
    if name not in labels:
        labels.append(name)
    return labels.index(name)


def free_stretches(grid: RecordedGrid, *, by_label: bool) -> tuple[Ints, Ints]:
    """First cell and length of the stretches that no barred cell, or label, interrupts."""
    new = np.zeros(grid.barred.size, bool)
    new[0] = True
    new[1:] = grid.barred[:-1] != grid.barred[1:]
    if by_label:
        new[1:] |= grid.label[:-1] != grid.label[1:]
    first = np.flatnonzero(new)
    length = np.diff(first, append=grid.barred.size)
    free = ~grid.barred[first]
    return first[free], length[free]


def window_starts(grid: RecordedGrid, window: int, *, by_label: bool) -> Ints:
    """Cells from which `window` cells lie ahead in one stretch."""
    first, length = free_stretches(grid, by_label=by_label)
    room = np.maximum(length - window + 1, 0)
    begun = np.cumsum(room) - room
    return np.repeat(first - begun, room) + np.arange(int(room.sum()))


def longest_stretch(grid: RecordedGrid, name: str | None) -> int:
    """Cells of the longest stretch, within a label where one is named."""
    first, length = free_stretches(grid, by_label=name is not None)
    if name is not None:
        code = grid.labels.index(name) if name in grid.labels else -1
        length = length[grid.label[first] == code]
    return int(length.max(initial=0))


def epoch_cells(interval_s: float, step_s: float, duration_s: float) -> Ints:
    """(t,) cell of each epoch at step, 2 step, ..., duration; -1 between two fixes.

    Raises
    ------
    InputError : times that are no multiples of each other.
    """
    epochs = duration_s / step_s if step_s > 0 else math.nan
    if not (epochs >= 1 and abs(epochs - round(epochs)) <= 1e-9 * epochs):
        raise InputError(
            "a run is a whole number of steps", evidence=f"{duration_s:g} s in steps of {step_s:g}"
        )
    numbers = np.arange(round(epochs))
    ratio = step_s / interval_s
    long, short = round(ratio), round(1 / ratio)
    if long and abs(ratio - long) <= _STEP_TOLERANCE * long:
        return numbers * long
    if short and abs(1 / ratio - short) <= _STEP_TOLERANCE * short and round(epochs) >= short:
        fixes = (numbers + 1) % short == 0
        return np.where(fixes, (numbers + 1) // short - 1, -1)
    raise InputError(
        "the step and the interval of the recording do not fit into each other",
        evidence=f"step {step_s:g} s, interval {interval_s:g} s, run {duration_s:g} s",
        cure="a step that is a multiple of the interval, or divides it; nothing is interpolated",
    )
