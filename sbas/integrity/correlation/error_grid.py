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
from sbas.truth import FixedPoint, Truth

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
    values : (2, n) east and north [m], NaN in both where missing.
    step_ns, begin_ns : step of the grid and time of its first cell [ns].
    hpl_m, modes : (n,) protection level [m] and index of its mode (-1 where unstated), of the
        epochs with an error; None where nobody asked.
    labels : (n,) index into `names`, -1 where unlabelled; None where nobody asked.
    names : environment labels.
    """

    values: NDArray[np.float32]
    step_ns: int
    begin_ns: int
    hpl_m: NDArray[np.float32] | None = None
    modes: NDArray[np.int8] | None = None
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


def grid_cells(facts: Survey) -> int | Refusal:
    """Cells that a grid of the record's median step needs, or why it has none."""
    if facts.interval_ns == 0:
        return Refusal("one epoch has no step", "record longer")
    step = facts.interval_ns
    cells = (facts.end_ns - facts.begin_ns + step // 2) // step + 1
    if cells > MAX_CELLS:
        return Refusal(
            f"the record spans {cells:.3g} steps, more than {MAX_CELLS:.3g}",
            "analyse parts of it, or join fewer files",
        )
    return int(cells)


class GridFiller:
    """Puts errors on the regular grid of a record, batch by batch.

    Parameters
    ----------
    facts : survey of the record; its median step is the grid's.
    cells : of `grid_cells`.
    levels : keep protection level and mode of each cell.
    labelled : keep the environment of each cell.
    """

    def __init__(
        self, facts: Survey, cells: int, *, levels: bool = False, labelled: bool = False
    ) -> None:
        self._facts = facts
        self._values = room((2, cells))
        self._values[:] = np.nan
        self._hpl = room((cells,)) if levels else None
        if self._hpl is not None:
            self._hpl[:] = np.nan
        self._modes = np.full(cells, -1, np.int8) if levels else None
        self._labels = np.full(cells, -1, np.int8) if labelled else None
        self._names: list[str] = []
        self._off_grid = self._shared = 0
        self._last_cell = -1

    def fill(
        self,
        time_ns: NDArray[np.int64],
        offsets_m: NDArray[np.floating[Any]],
        *,
        hpl_m: NDArray[np.float64] | None = None,
        modes: NDArray[np.int8] | None = None,
        environment: Any = None,
    ) -> None:
        """Add (n,) epochs that follow all earlier ones; (2, n) east and north, NaN if missing."""
        if time_ns.size == 0:
            return
        step = self._facts.interval_ns
        since = time_ns - self._facts.begin_ns
        cell = (since + step // 2) // step
        self._off_grid += int(np.sum(np.abs(since - cell * step) > OFF_GRID * step))
        self._shared += int(np.sum(np.diff(cell, prepend=self._last_cell) == 0))
        self._last_cell = int(cell[-1])
        missing = ~np.isfinite(offsets_m).all(axis=0)
        self._values[:, cell] = np.where(missing, np.nan, offsets_m)
        if self._hpl is not None and self._modes is not None:
            assert hpl_m is not None
            assert modes is not None
            self._hpl[cell] = hpl_m
            self._modes[cell] = modes
        if self._labels is not None:
            self._labels[cell] = _codes(environment, self._names)

    def merge(self, other: GridFiller) -> None:
        """Add the epochs of another part of the same record."""
        seen = np.isfinite(other._values[0])
        self._values[:, seen] = other._values[:, seen]
        if self._hpl is not None and self._modes is not None:
            assert other._hpl is not None
            assert other._modes is not None
            self._hpl[seen] = other._hpl[seen]
            self._modes[seen] = other._modes[seen]
        self._off_grid += other._off_grid
        self._shared += other._shared

    def result(self) -> tuple[ErrorGrid, tuple[Finding, ...]]:
        """The grid, and a finding on epochs that fitted it badly."""
        facts = self._facts
        grid = ErrorGrid(
            self._values, facts.interval_ns, facts.begin_ns, self._hpl, self._modes,
            self._labels, tuple(self._names),
        )  # fmt: skip
        if not (self._off_grid or self._shared):
            return grid, ()
        return grid, (
            Finding(
                "E26", "warning",
                f"{self._off_grid} epochs off the regular grid were moved to its nearest time; "
                f"{self._shared} took the place of the epoch before",
                evidence=f"step {grid.step_s:.6g} s; off means by more than {OFF_GRID:g} of it",
            ),
        )  # fmt: skip


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
    The grid, a constant apart, or why there is none; and findings on epochs that fitted the grid
    badly.
    """
    cells = grid_cells(facts)
    if isinstance(cells, Refusal):
        return cells, ()
    moving = truth is not None and not isinstance(truth, FixedPoint)
    position = ("lat_deg", "lon_deg", "height_m") if moving else ("lat_deg", "lon_deg")
    columns = (*position, "environment") if labelled else position
    filler = GridFiller(facts, cells, labelled=labelled)
    lat0, lon0, _ = facts.median_position
    north_m = float(pymap3d.rcurve.meridian(lat0)) * np.pi / 180 if facts.positions else np.nan
    east_m = float(pymap3d.rcurve.parallel(lat0)) * np.pi / 180 if facts.positions else np.nan
    origin = np.full((2, 1), np.nan)
    for batch in source.batches(columns):
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
        time = batch.index.to_numpy().astype(np.int64)
        filler.fill(time, offsets, environment=batch["environment"] if labelled else None)
    return filler.result()


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
