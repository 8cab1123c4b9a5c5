"""East and north errors on a regular grid of time, missing where nothing was recorded."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from typing import Any

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.findings import Finding
from sbas.integrity.position_error import position_errors
from sbas.recording import EpochSource
from sbas.recording_survey import Survey
from sbas.timescales import NS_PER_S
from sbas.truth import Trajectory, Truth

IN_MEMORY_BYTES = 1 << 29
"""Larger arrays lie in a temporary file, so that memory stays bounded."""
MAX_CELLS = 1 << 30
OFF_GRID = 0.25
"""An epoch farther than this share of a step from its cell is counted."""


@dataclass(frozen=True, eq=False)
class ErrorGrid:
    """Signed errors on a regular grid.

    Parameters
    ----------
    values : (2, n) east and north [m], a constant apart; NaN in both where missing.
    step_ns, begin_ns : step of the grid and time of its first cell [ns].
    labels : (n,) index into `names`, -1 where unlabelled; None where nobody asked.
    names : environment labels.
    """

    values: NDArray[np.float32]
    step_ns: int
    begin_ns: int
    labels: NDArray[np.int8] | None = None
    names: tuple[str, ...] = ()

    @property
    def step_s(self) -> float:
        return self.step_ns / NS_PER_S


def room(shape: tuple[int, ...], dtype: Any = np.float32) -> NDArray[Any]:
    """An array to be filled: in memory, or in a temporary file when it is large."""
    if np.prod(shape) * np.dtype(dtype).itemsize <= IN_MEMORY_BYTES:
        return np.empty(shape, dtype)
    with tempfile.TemporaryFile() as file:
        return np.memmap(file, dtype, mode="w+", shape=shape)


def error_grid(
    source: EpochSource, facts: Survey, truth: Truth | None, *, labelled: bool = False
) -> tuple[ErrorGrid | Refusal, tuple[Finding, ...]]:
    """The east and north errors of a source on a regular grid, read batch by batch.

    Parameters
    ----------
    source : a Recording or another EpochSource, its times in order and none repeated.
    facts : survey of the source; its median step is the grid's.
    truth : a trajectory for a moving antenna. For a fixed point or None the offsets from the
        median position are taken: they differ from the errors by a constant, which has no part
        in a correlation, and by 1e-5 of their size, since the tangent plane is drawn once.
    labelled : keep the environment of each cell.

    Returns
    -------
    The grid, or why there is none; and findings on epochs that fitted the grid badly.
    """
    step, begin = facts.interval_ns, facts.begin_ns
    cells = (facts.end_ns - begin + step // 2) // step + 1
    if cells > MAX_CELLS:
        return Refusal(
            f"the record spans {cells:.3g} steps, more than {MAX_CELLS:.3g}",
            "analyse parts of it, or join fewer files",
        ), ()
    moving = isinstance(truth, Trajectory)
    position = ("lat_deg", "lon_deg", "height_m") if moving else ("lat_deg", "lon_deg")
    columns = (*position, "environment") if labelled else position
    values = room((2, cells))
    values[:] = np.nan
    labels = np.full(cells, -1, np.int8) if labelled else None
    names: list[str] = []
    off_grid = shared = 0
    last_cell = -1
    lat0, lon0, _ = facts.median_position
    north_m = float(pymap3d.rcurve.meridian(lat0)) * np.pi / 180 if facts.positions else np.nan
    east_m = float(pymap3d.rcurve.parallel(lat0)) * np.pi / 180 if facts.positions else np.nan
    origin = np.full((2, 1), np.nan)
    for batch in source.batches(columns):
        if len(batch) == 0:
            continue
        since = batch.index.to_numpy().astype(np.int64) - begin
        cell = (since + step // 2) // step
        off_grid += int(np.sum(np.abs(since - cell * step) > OFF_GRID * step))
        shared += int(np.sum(np.diff(cell, prepend=last_cell) == 0))
        last_cell = int(cell[-1])
        if moving:
            assert truth is not None
            errors = position_errors(batch, truth)
            offsets = np.stack([errors["east_m"].to_numpy(), errors["north_m"].to_numpy()])
            # Single precision has 7 digits: they are spent on changes, not on a constant.
            seen = np.isfinite(offsets).all(axis=0)
            if seen.any() and np.isnan(origin).any():
                origin = offsets[:, [int(np.argmax(seen))]]
            offsets = offsets - origin
        else:
            lon = (batch["lon_deg"].to_numpy() - lon0 + 180) % 360 - 180
            offsets = np.stack([lon * east_m, (batch["lat_deg"].to_numpy() - lat0) * north_m])
        offsets[:, ~np.isfinite(offsets).all(axis=0)] = np.nan
        values[:, cell] = offsets
        if labels is not None:
            labels[cell] = _codes(batch["environment"], names)
    findings = []
    if off_grid or shared:
        findings.append(
            Finding(
                "E26", "warning",
                f"{off_grid} epochs off the regular grid were moved to its nearest time; "
                f"{shared} took the place of the epoch before",
                evidence=f"step {step / NS_PER_S:.6g} s; off means by more than {OFF_GRID:g} of it",
            )
        )  # fmt: skip
    return ErrorGrid(values, step, begin, labels, tuple(names)), tuple(findings)


def _codes(environment: Any, names: list[str]) -> NDArray[np.int8]:
    """(n,) indices into `names`, which grows by the labels that are new; -1 if unlabelled."""
    own = [str(c) for c in environment.cat.categories]
    used = np.unique(environment.cat.codes.to_numpy())
    for i in used[used >= 0].tolist():
        if own[i] not in names:
            names.append(own[i])
    table = np.array([names.index(c) if c in names else -1 for c in own] + [-1], np.int8)
    codes: NDArray[np.int8] = table[environment.cat.codes.to_numpy()]
    return codes
