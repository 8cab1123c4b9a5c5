"""Facts of a recording, found in one look, batch by batch: interval, gaps, order, positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.recording import EpochSource
from sbas.streaming import Distribution
from sbas.timescales import NS_PER_S

GAP_STEPS = 1.5
"""A step longer than this many median steps is a gap."""
STATIC_EXTENT_M = 20.0
"""Medians of 60 s that stay within this range, east and north, make a recording static."""
STATIC_BLOCK_S = 60
STATIC_SPEED_MPS = 1.0
"""A median reported speed above this is motion, whatever the positions say."""
MAX_STEPS = 1 << 16

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Gaps:
    """(g,) gaps: the row that follows each, the last epoch before it and the first one after."""

    row: Ints
    before_ns: Ints
    after_ns: Ints

    def __len__(self) -> int:
        return self.row.size

    def missing_ns(self, interval_ns: int) -> Ints:
        """(g,) time that no epoch covers [ns]."""
        return self.after_ns - self.before_ns - interval_ns


@dataclass(frozen=True, eq=False)
class Survey:
    """Facts of a recording, found in one look.

    Times in ns of GPS time; `interval_ns` is the median step. `median_position` is (lat_deg,
    lon_deg, height_m), each the median of its own; `extent_m` the larger range, east or north,
    of the medians of 60 s, or of all positions where there are fewer than two full blocks;
    `covered_ns` the time that epochs cover: each its step to the next, at most the interval.
    """

    epochs: int
    begin_ns: int
    end_ns: int
    interval_ns: int
    gaps: Gaps
    repeated: int
    repeated_differing: int
    first_repeated_row: int
    backward: int
    first_backward_row: int
    positions: int
    median_position: tuple[float, float, float]
    extent_m: float
    median_speed_mps: float
    covered_ns: int
    lat_range_deg: tuple[float, float]
    lon_range_deg: tuple[float, float]
    out_of_range: int
    levels: int
    median_hpl_m: float
    levels_not_positive: int

    @property
    def static(self) -> bool:
        moving = self.median_speed_mps > STATIC_SPEED_MPS
        return self.positions > 0 and self.extent_m < STATIC_EXTENT_M and not moving

    @property
    def hours(self) -> float:
        """Hours that epochs cover, gaps not included."""
        return self.covered_ns / (3600 * NS_PER_S)


def sampling_interval_ns(source: EpochSource) -> int:
    """Median of the steps forward between successive epochs [ns]; 0 when there is none."""
    steps, counts = np.empty(0, np.int64), np.empty(0, np.int64)
    unit_ns = 1
    previous = np.empty(0, np.int64)
    for batch in source.batches(()):
        time = np.concatenate([previous, batch.index.to_numpy().astype(np.int64)])
        forward = np.diff(time)
        found, times = np.unique(forward[forward > 0], return_counts=True)
        steps, counts = _added(steps, counts, found // unit_ns * unit_ns, times)
        while steps.size > MAX_STEPS:
            # Jittered stamps: steps are told apart less finely, round ones stay as they are.
            unit_ns *= 10
            steps, counts = _added(steps[:0], counts[:0], steps // unit_ns * unit_ns, counts)
        previous = time[-1:]
    if steps.size == 0:
        return 0
    ends = np.cumsum(counts)
    return max(int(steps[np.searchsorted(ends, (ends[-1] + 1) // 2)]), 1)


def _added(steps: Ints, counts: Ints, more: Ints, times: Ints) -> tuple[Ints, Ints]:
    merged, where = np.unique(np.concatenate([steps, more]), return_inverse=True)
    sums = np.bincount(where, weights=np.concatenate([counts, times]), minlength=merged.size)
    return merged, sums.astype(np.int64)


def survey(source: EpochSource) -> Survey:
    """Look at every epoch of a source once, after one look at its times."""
    interval_ns = sampling_interval_ns(source)
    max_step_ns = int(GAP_STEPS * interval_ns)
    rows = repeated = differing = backward = positions = out_of_range = not_positive = 0
    first_repeated = first_backward = -1
    begin_ns = end_ns = 0
    gap_rows: list[Ints] = []
    gap_before: list[Ints] = []
    gap_after: list[Ints] = []
    level = Distribution()
    offsets = [Distribution(), Distribution(), Distribution()]
    reference: tuple[float, float, float] | None = None
    blocks = _BlockMedians()
    speed = Distribution()
    covered_ns = 0
    ranges = np.array([[np.inf, -np.inf], [np.inf, -np.inf]])
    tail: pd.DataFrame | None = None
    for batch in source.batches(_SURVEYED):
        if len(batch) == 0:
            continue
        joined = batch if tail is None else pd.concat([tail, batch])
        time = joined.index.to_numpy().astype(np.int64)
        offset = rows - (0 if tail is None else 1)
        step = np.diff(time)
        same, back, gap = step == 0, step < 0, step > max_step_ns
        if same.any():
            if first_repeated < 0:
                first_repeated = offset + int(np.argmax(same)) + 1
            repeated += int(same.sum())
            values = joined.to_numpy()
            a, b = values[:-1][same], values[1:][same]
            differing += int(np.sum(np.any((a != b) & ~(np.isnan(a) & np.isnan(b)), axis=1)))
        if back.any():
            if first_backward < 0:
                first_backward = offset + int(np.argmax(back)) + 1
            backward += int(back.sum())
        if gap.any():
            at = np.flatnonzero(gap)
            gap_rows.append(at + 1 + offset)
            gap_before.append(time[at])
            gap_after.append(time[at + 1])
        covered_ns += int(np.clip(step, 0, interval_ns).sum())
        begin_ns = int(time[0]) if rows == 0 else begin_ns
        end_ns = int(time[-1])
        rows += len(batch)
        tail = batch.iloc[-1:]

        speed.update(batch["speed_mps"].to_numpy())
        hpl = batch["hpl_m"].to_numpy()
        level.update(hpl)
        not_positive += int(np.sum(hpl <= 0)) + int(np.sum(batch["vpl_m"].to_numpy() <= 0))
        position = batch[list(_POSITION)].to_numpy()
        known = np.isfinite(position[:, :2]).all(axis=1)
        lat, lon = position[:, 0], position[:, 1]
        wrong = known & ((np.abs(lat) > 90) | (np.abs(lon) > 180))
        out_of_range += int(wrong.sum())
        known &= ~wrong
        if not known.any():
            continue
        positions += int(known.sum())
        for i, axis in enumerate((lat[known], lon[known])):
            ranges[i] = min(ranges[i, 0], axis.min()), max(ranges[i, 1], axis.max())
        if reference is None:
            lat0, lon0, height0 = position[known][0]
            reference = (lat0, lon0, height0 if np.isfinite(height0) else 0.0)
        height = np.where(np.isfinite(position[:, 2]), position[:, 2], reference[2])
        east, north, up = pymap3d.geodetic2enu(lat[known], lon[known], height[known], *reference)
        up = np.where(np.isfinite(position[known, 2]), up, np.nan)
        for seen, values in zip(offsets, (east, north, up), strict=True):
            seen.update(values)
        blocks.update(batch.index.to_numpy().astype(np.int64)[known], east, north)

    median = (np.nan, np.nan, np.nan)
    if reference is not None:
        east, north, up = (d.quantile(0.5) for d in offsets)
        lat, lon, height = pymap3d.enu2geodetic(east, north, np.nan_to_num(up), *reference)
        median = (float(lat), float(lon), float(height) if np.isfinite(up) else np.nan)
    return Survey(
        epochs=rows,
        begin_ns=begin_ns,
        end_ns=end_ns,
        interval_ns=interval_ns,
        gaps=Gaps(*(_joined(parts) for parts in (gap_rows, gap_before, gap_after))),
        repeated=repeated,
        repeated_differing=differing,
        first_repeated_row=first_repeated,
        backward=backward,
        first_backward_row=first_backward,
        positions=positions,
        median_position=median,
        extent_m=blocks.extent_m(
            max(offsets[0].max - offsets[0].min, offsets[1].max - offsets[1].min)
        ),
        median_speed_mps=speed.quantile(0.5),
        covered_ns=covered_ns + (interval_ns if rows else 0),
        lat_range_deg=(float(ranges[0, 0]), float(ranges[0, 1])),
        lon_range_deg=(float(ranges[1, 0]), float(ranges[1, 1])),
        out_of_range=out_of_range,
        levels=level.count,
        median_hpl_m=level.quantile(0.5),
        levels_not_positive=not_positive,
    )


_POSITION = ("lat_deg", "lon_deg", "height_m")
_SURVEYED = (*_POSITION, "hpl_m", "vpl_m", "speed_mps")


def _joined(parts: Sequence[Ints]) -> Ints:
    return np.concatenate(parts) if parts else np.empty(0, np.int64)


class _BlockMedians:
    """Medians of east and north in blocks of `STATIC_BLOCK_S`, joined over batches."""

    def __init__(self) -> None:
        self._open = np.empty((0, 3))
        self._found: list[NDArray[np.float64]] = []

    def update(
        self, time_ns: Ints, east_m: NDArray[np.float64], north_m: NDArray[np.float64]
    ) -> None:
        """Add (n,) epochs in their order; the last block stays open for what follows."""
        block = (time_ns // (STATIC_BLOCK_S * NS_PER_S)).astype(float)
        rows = np.concatenate([self._open, np.column_stack([block, east_m, north_m])])
        last = rows[-1, 0]
        self._open = rows[rows[:, 0] == last]
        self._close(rows[rows[:, 0] != last])

    def _close(self, rows: NDArray[np.float64]) -> None:
        if len(rows) == 0:
            return
        grouped = pd.DataFrame(rows, columns=["block", "east", "north"]).groupby("block")
        medians = grouped.median()
        self._found.append(np.column_stack([medians.to_numpy(), grouped.size().to_numpy()]))

    def extent_m(self, whole_range_m: float) -> float:
        """Larger range of the medians of blocks that are at least half full; of a record with
        fewer than two of them the range of all positions."""
        self._close(self._open)
        self._open = self._open[:0]
        if not self._found:
            return float("nan")
        found = np.concatenate(self._found)
        full = found[found[:, 2] >= found[:, 2].max() / 2]
        if len(full) < 2:
            return whole_range_m
        return float(np.ptp(full[:, :2], axis=0).max())
