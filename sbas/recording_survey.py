"""Facts of a recording, found in one look, batch by batch: interval, gaps, order, positions.

Whoever wants to look at the same epochs joins the look as a `Watch`: it gets every batch once, as
plain arrays, and must say the same however the recording was cut.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import NDArray

from sbas.recording import COLUMNS, EpochSource
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
Floats = NDArray[np.float64]


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
class Rows:
    """Consecutive epochs as plain arrays; `first` is the number of the first in the recording.

    Numbers as in the table, categories as their codes (-1 is missing), times in ns of GPS time.
    """

    first: int
    time_ns: Ints
    values: Mapping[str, NDArray[Any]]

    def __len__(self) -> int:
        return self.time_ns.size

    def part(self, begin: int, end: int) -> Rows:
        """Rows `begin` up to, not with, `end` of these."""
        cut = {name: values[begin:end] for name, values in self.values.items()}
        return Rows(self.first + begin, self.time_ns[begin:end], cut)


class Watch(Protocol):
    """Somebody who looks at every epoch, in order, along with the survey."""

    @property
    def COLUMNS(self) -> tuple[str, ...]: ...

    def update(self, rows: Rows) -> None: ...


class Tail:
    """The last rows of a stream, put in front of those that follow.

    Parameters
    ----------
    keep : number of rows that are handed on.
    columns : those that are kept.
    """

    def __init__(self, keep: int, columns: Sequence[str]) -> None:
        self.keep, self.columns = keep, tuple(columns)
        self.rows: Rows | None = None

    def before(self, rows: Rows) -> tuple[Rows, int]:
        """The rows with up to `keep` earlier ones in front, and how many those are."""
        old = self.rows
        if old is None:
            joined = Rows(rows.first, rows.time_ns, {n: rows.values[n] for n in self.columns})
        else:
            joined = Rows(
                old.first,
                np.concatenate([old.time_ns, rows.time_ns]),
                {n: np.concatenate([old.values[n], rows.values[n]]) for n in self.columns},
            )
        count = len(joined)
        self.rows = joined.part(max(count - self.keep, 0), count)
        return joined, count - len(rows)


def epoch_rows(source: EpochSource, columns: Sequence[str]) -> Iterator[Rows]:
    """The epochs of a source as plain arrays; batches without any are left out."""
    first = 0
    for batch in source.batches(tuple(columns)):
        if len(batch) == 0:
            continue
        time_ns = batch.index.to_numpy().astype(np.int64)
        yield Rows(first, time_ns, {name: _plain(batch[name], name) for name in columns})
        first += len(batch)


def _plain(column: pd.Series[Any], name: str) -> NDArray[Any]:
    categorical = COLUMNS[name].dtype == "category"
    values: NDArray[Any] = column.cat.codes.to_numpy() if categorical else column.to_numpy()
    return values


@dataclass(frozen=True, eq=False)
class Survey:
    """Facts of a recording, found in one look.

    Times in ns of GPS time; `interval_ns` is the median step. `repeated_differing` of the
    repeated epochs have any other value, `repeated_contradicting` one that both know.
    `median_position` is (lat_deg, lon_deg, height_m), each the median of its own; `extent_m` the
    larger range, east or north, of the medians of 60 s, or of all positions where there are fewer
    than two full blocks; `covered_ns` the time that epochs cover: each its step to the next, at
    most the interval.
    """

    epochs: int
    begin_ns: int
    end_ns: int
    interval_ns: int
    gaps: Gaps
    repeated: int
    repeated_differing: int
    repeated_contradicting: int
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


def survey(
    source: EpochSource, *, interval_ns: int | None = None, watches: Sequence[Watch] = ()
) -> Survey:
    """Look at every epoch of a source once.

    Parameters
    ----------
    source : a Recording or another EpochSource.
    interval_ns : its median step, if known; else the times are looked at once before.
    watches : who else looks at the same epochs.
    """
    if interval_ns is None:
        interval_ns = sampling_interval_ns(source)
    order, levels = _Order(interval_ns), _Levels()
    positions = _Positions()
    looking: tuple[Watch, ...] = (order, levels, positions, *watches)
    columns = tuple(dict.fromkeys(name for watch in looking for name in watch.COLUMNS))
    for rows in epoch_rows(source, columns):
        for watch in looking:
            watch.update(rows)
    return Survey(interval_ns=interval_ns, **order.facts(), **levels.facts(), **positions.facts())


class _Order:
    """Times: span, gaps, repeated and backward steps."""

    COLUMNS = (
        "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "speed_mps", "n_sv", "mode",
    )  # fmt: skip

    def __init__(self, interval_ns: int) -> None:
        self.interval_ns = interval_ns
        self.epochs = self.repeated = self.differing = self.contradicting = self.backward = 0
        self.first_repeated = self.first_backward = -1
        self.begin_ns = self.end_ns = self.covered_ns = 0
        self.gaps: list[NDArray[np.int64]] = []
        self._tail = Tail(1, self.COLUMNS)

    def update(self, rows: Rows) -> None:
        joined, old = self._tail.before(rows)
        time = joined.time_ns
        step = np.diff(time)
        same, back = step == 0, step < 0
        if same.any():
            at = np.flatnonzero(same)
            if self.first_repeated < 0:
                self.first_repeated = joined.first + int(at[0]) + 1
            self.repeated += at.size
            self._compare(joined, at)
        if back.any():
            if self.first_backward < 0:
                self.first_backward = joined.first + int(np.argmax(back)) + 1
            self.backward += int(back.sum())
        at = np.flatnonzero(step > int(GAP_STEPS * self.interval_ns))
        if at.size:
            self.gaps.append(np.stack([at + 1 + joined.first, time[at], time[at + 1]]))
        self.covered_ns += int(np.clip(step, 0, self.interval_ns).sum())
        if old == 0:
            self.begin_ns = int(time[0])
        self.end_ns = int(time[-1])
        self.epochs += len(rows)

    def _compare(self, joined: Rows, at: Ints) -> None:
        differing, contradicting = np.zeros(at.size, bool), np.zeros(at.size, bool)
        for name, values in joined.values.items():
            missing = -1 if COLUMNS[name].dtype != "f8" else np.nan
            a, b = values[at], values[at + 1]
            a_known, b_known = ((v != missing) & (v == v) for v in (a, b))
            contradicting |= a_known & b_known & (a != b)
            differing |= (a_known != b_known) | (a_known & b_known & (a != b))
        self.differing += int(differing.sum())
        self.contradicting += int(contradicting.sum())

    def facts(self) -> dict[str, Any]:
        gaps = np.concatenate(self.gaps, axis=1) if self.gaps else np.empty((3, 0), np.int64)
        return {
            "epochs": self.epochs,
            "begin_ns": self.begin_ns,
            "end_ns": self.end_ns,
            "gaps": Gaps(*gaps),
            "repeated": self.repeated,
            "repeated_differing": self.differing,
            "repeated_contradicting": self.contradicting,
            "first_repeated_row": self.first_repeated,
            "backward": self.backward,
            "first_backward_row": self.first_backward,
            "covered_ns": self.covered_ns + (self.interval_ns if self.epochs else 0),
        }


class _Levels:
    """Protection levels and speed."""

    COLUMNS = ("hpl_m", "vpl_m", "speed_mps")

    def __init__(self) -> None:
        self.level, self.speed = Distribution(), Distribution()
        self.not_positive = 0

    def update(self, rows: Rows) -> None:
        hpl, vpl = rows.values["hpl_m"], rows.values["vpl_m"]
        self.level.update(hpl)
        self.speed.update(rows.values["speed_mps"])
        self.not_positive += int(np.sum(hpl <= 0)) + int(np.sum(vpl <= 0))

    def facts(self) -> dict[str, Any]:
        return {
            "median_speed_mps": self.speed.quantile(0.5),
            "levels": self.level.count,
            "median_hpl_m": self.level.quantile(0.5),
            "levels_not_positive": self.not_positive,
        }


class _Positions:
    """Positions: range, medians, and how far they spread."""

    COLUMNS = ("lat_deg", "lon_deg", "height_m")

    def __init__(self) -> None:
        self.count = self.out_of_range = 0
        self.ranges = np.array([[np.inf, -np.inf], [np.inf, -np.inf]])
        self.offsets = (Distribution(), Distribution(), Distribution())
        self.blocks = _BlockMedians()
        self.reference: tuple[float, float, float] | None = None

    def update(self, rows: Rows) -> None:
        lat, lon, height = (rows.values[name] for name in self.COLUMNS)
        known = np.isfinite(lat) & np.isfinite(lon)
        wrong = known & ((np.abs(lat) > 90) | (np.abs(lon) > 180))
        self.out_of_range += int(wrong.sum())
        known &= ~wrong
        if not known.any():
            return
        lat, lon, height = lat[known], lon[known], height[known]
        self.count += lat.size
        for i, axis in enumerate((lat, lon)):
            low, high = self.ranges[i]
            self.ranges[i] = min(low, axis.min()), max(high, axis.max())
        if self.reference is None:
            first = float(height[0]) if np.isfinite(height[0]) else 0.0
            self.reference = (float(lat[0]), float(lon[0]), first)
        tall = np.where(np.isfinite(height), height, self.reference[2])
        east, north, up = pymap3d.geodetic2enu(lat, lon, tall, *self.reference)
        up = np.where(np.isfinite(height), up, np.nan)
        for seen, values in zip(self.offsets, (east, north, up), strict=True):
            seen.update(values)
        self.blocks.update(rows.time_ns[known], east, north)

    def facts(self) -> dict[str, Any]:
        median = (np.nan, np.nan, np.nan)
        east_m, north_m = self.offsets[0], self.offsets[1]
        if self.reference is not None:
            east, north, up = (d.quantile(0.5) for d in self.offsets)
            lat, lon, height = pymap3d.enu2geodetic(east, north, np.nan_to_num(up), *self.reference)
            median = (float(lat), float(lon), float(height) if np.isfinite(up) else np.nan)
        return {
            "positions": self.count,
            "median_position": median,
            "extent_m": self.blocks.extent_m(
                max(east_m.max - east_m.min, north_m.max - north_m.min)
            ),
            "lat_range_deg": (float(self.ranges[0, 0]), float(self.ranges[0, 1])),
            "lon_range_deg": (float(self.ranges[1, 0]), float(self.ranges[1, 1])),
            "out_of_range": self.out_of_range,
        }


class _BlockMedians:
    """Medians of east and north in blocks of `STATIC_BLOCK_S`, joined over batches."""

    def __init__(self) -> None:
        self._open = np.empty((0, 3))
        self._found: list[NDArray[np.float64]] = []

    def update(self, time_ns: Ints, east_m: Floats, north_m: Floats) -> None:
        """Add (n,) epochs in their order; the last block stays open for what follows."""
        block = (time_ns // (STATIC_BLOCK_S * NS_PER_S)).astype(float)
        rows = np.concatenate([self._open, np.column_stack([block, east_m, north_m])])
        last = rows[-1, 0]
        self._open = rows[rows[:, 0] == last]
        self._close(rows[rows[:, 0] != last])

    def _close(self, rows: Floats) -> None:
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
