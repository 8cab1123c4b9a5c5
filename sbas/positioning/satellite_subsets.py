"""Every subset of the satellites used: the Stanford-ESA diagram.

An epoch shows one error and one level; its subsets show what a receiver would have had that had
lost some of the satellites, and so bring errors to light that a good geometry hides. Source:
M. Tossaint et al., "The Stanford - ESA integrity diagram: focusing on SBAS integrity", ION GNSS
2006; positions and levels of the subsets by RTCA DO-229D, J.1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.positioning.normal_equations import (
    LEAST_SATELLITES,
    PAIRS,
    UNKNOWNS,
    inverse,
    times,
)
from sbas.positioning.protection_levels import major_axis_m
from sbas.positioning.used_satellites import UsedSatellites, used_satellites
from sbas.recording import Recording
from sbas.truth import FixedPoint, Trajectory, east_north_up_m

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

MOST_WITH_ALL_SUBSETS = 12
"""Up to so many satellites every subset is formed; with more, those that lack up to four."""
MOST_LACKING = 4
CELL_M = 0.5
LARGEST_M = 50.0
_BATCH = 1 << 15
"""Subsets at a time: their matrices stay in the processor's cache."""


@dataclass(frozen=True, eq=False)
class StanfordEsa:
    """Errors and levels of all subsets.

    Parameters
    ----------
    edges_m : (b + 1,) cells of error and level; the last one has no upper edge.
    counts : (b, b) subsets by cell of error (rows) and of level (columns). A value on an edge
        counts as the larger error and as the smaller level.
    worst : by time, the subset with the largest ratio of error to level: `ratio`, `hpe_m`,
        `hpl_m`, `n_sv`, `satellites`.
    subsets : formed; `degenerate` of them have no fix. `misleading` have an error that reaches
        the level.
    epochs : with subsets; `left_out` have satellites but none, or no truth.
    lacking_at_most : satellites left out of the largest sets; None where every subset was formed.
    """

    edges_m: Floats
    counts: Ints
    worst: pd.DataFrame
    subsets: int
    degenerate: int
    misleading: int
    epochs: int
    left_out: int
    lacking_at_most: int | None


def stanford_esa(
    recording: Recording,
    truth: FixedPoint | Trajectory,
    *,
    k_h: float | None = None,
    cell_m: float = CELL_M,
    largest_m: float = LARGEST_M,
) -> StanfordEsa:
    """Position error and HPL of every subset of at least four of the satellites used.

    Parameters
    ----------
    recording : of `protect`, or any whose side table `satellites` has `elevation_deg`,
        `azimuth_deg`, `sigma_m`, `residual_m` (after the fix) and `used`.
    truth : where the antenna was.
    k_h : horizontal factor; by default the recording's own.
    cell_m, largest_m : cells of the diagram [m].

    Returns
    -------
    StanfordEsa. With more than twelve satellites at an epoch only subsets that lack up to four
    are formed: all of twenty would be a million. The full set is always among them.

    Raises
    ------
    InputError : no satellites with residuals, no factor, or cells of no size.

    Notes
    -----
    The fix of a subset lies D G'W r from the recording's, with r the residuals of its satellites
    and D = (G'WG)^-1 over the subset; the step is far below what bends a range.

    References
    ----------
    Tossaint et al., ION GNSS 2006; RTCA DO-229D, J.1.
    """
    factor = recording.meta.pl.k_h if k_h is None else k_h
    if factor is None or not 0 < factor < math.inf:
        raise InputError("a horizontal K factor is needed", evidence=f"{factor}", cure="k_h=6.0")
    if not 0 < cell_m <= largest_m < math.inf:
        raise InputError("cells need a size", evidence=f"{cell_m} m up to {largest_m} m")
    used = used_satellites(recording, "residual_m")
    residual = used.table["residual_m"].to_numpy()
    error = _fix_errors(recording, truth, used.time)
    n = used.time.size
    count = np.bincount(used.epoch, minlength=n)
    broken = np.bincount(used.epoch[~np.isfinite(residual)], minlength=n) > 0
    sound = ~used.unsound & ~broken & np.isfinite(error).all(axis=0) & (count >= LEAST_SATELLITES)
    cells = max(math.ceil(largest_m / cell_m - 1e-9), 1)
    counts = np.zeros((cells, cells), np.int64)
    worst = _Worst.empty(n)
    formed = degenerate = misleading = 0
    start = np.cumsum(count) - count
    for m in np.unique(count[sound]).tolist():
        epochs = np.flatnonzero(sound & (count == m))
        members = subset_members(m)
        step = max(_BATCH // len(members), 1)
        for low in range(0, epochs.size, step):
            part = epochs[low : low + step]
            rows = start[part][:, None] + np.arange(m)
            hpe, hpl = _subset_levels(used, residual, rows, members, error[:, part], factor)
            formed += hpe.size
            solved = np.isfinite(hpl)
            degenerate += int(hpe.size - solved.sum())
            misleading += int((hpe >= hpl).sum())
            up, across = _cell(hpe[solved], hpl[solved], cell_m, cells)
            counts += np.bincount(up * cells + across, minlength=cells**2).reshape(cells, cells)
            worst.take(part, hpe, hpl, members)
    done = np.flatnonzero(sound & np.isfinite(worst.ratio))
    return StanfordEsa(
        np.append(np.arange(cells) * cell_m, np.inf),
        counts,
        worst.table(done, used, start),
        formed,
        degenerate,
        misleading,
        int(sound.sum()),
        int((~sound).sum()),
        MOST_LACKING if count[sound].max(initial=0) > MOST_WITH_ALL_SUBSETS else None,
    )


def subset_members(m: int) -> Bools:
    """(s, m) subsets of m satellites that have at least four; the full set is the first one."""
    most = m - LEAST_SATELLITES if m <= MOST_WITH_ALL_SUBSETS else MOST_LACKING
    rows = list(_lacking(m, min(most, m - LEAST_SATELLITES)))
    members = np.ones((len(rows), m), bool)
    for row, lacking in enumerate(rows):
        members[row, list(lacking)] = False
    return members


def _lacking(m: int, most: int) -> Iterator[tuple[int, ...]]:
    for size in range(most + 1):
        yield from combinations(range(m), size)


def _subset_levels(
    used: UsedSatellites,
    residual_m: Floats,
    rows: Ints,
    members: Bools,
    error_m: Floats,
    k_h: float,
) -> tuple[Floats, Floats]:
    """(e, s) error and level of (s, m) subsets of the (e, m) rows; NaN where there is no fix.

    The ten sums of G'WG and the four of G'Wr over each subset are one product of matrices.
    """
    g = used.g[:, rows]
    weight = 1 / used.sigma_m[rows] ** 2
    weighted = g * weight
    terms = np.stack([*(weighted[i] * g[j] for i, j in PAIRS), *(weighted * residual_m[rows])])
    e, s = len(rows), len(members)
    sums = (terms @ members.T.astype(float)).reshape(len(PAIRS) + UNKNOWNS, e * s)
    covariance, _ = inverse(sums[: len(PAIRS)], np.ones(e * s, bool))
    shift = times(covariance, sums[len(PAIRS) :])
    east, north = (np.repeat(error_m[axis], s) - shift[axis] for axis in range(2))
    level = k_h * major_axis_m(covariance[0], covariance[2], covariance[1])
    return np.hypot(east, north).reshape(e, s), level.reshape(e, s)


def _cell(hpe_m: Floats, hpl_m: Floats, cell_m: float, cells: int) -> tuple[Ints, Ints]:
    up = np.minimum(np.floor(hpe_m / cell_m), cells - 1).astype(np.int64)
    across = np.clip(np.ceil(hpl_m / cell_m) - 1, 0, cells - 1).astype(np.int64)
    return up, across


def _fix_errors(
    recording: Recording, truth: FixedPoint | Trajectory, time: NDArray[np.datetime64]
) -> Floats:
    """(2, n) east and north error of the recording's fixes at times; NaN where there is none."""
    table = recording.table
    order = np.argsort(recording.time, kind="stable")
    stamps = recording.time[order]
    if not stamps.size:
        return np.full((2, time.size), np.nan)
    at = np.minimum(np.searchsorted(stamps, time), stamps.size - 1)
    last = np.searchsorted(stamps, time, side="right") - 1
    # Of an epoch that the recording has twice nobody knows which fix the satellites made.
    found = (stamps[at] == time) & (last == at)
    lat, lon, height = (
        np.where(found, table[name].to_numpy()[order][at], np.nan)
        for name in ("lat_deg", "lon_deg", "height_m")
    )
    east, north, _ = east_north_up_m(lat, lon, height, truth.at(time))
    return np.stack([east, north])


@dataclass(eq=False)
class _Worst:
    """(n,) worst subsets so far."""

    ratio: Floats
    hpe_m: Floats
    hpl_m: Floats
    members: dict[int, Bools]

    @classmethod
    def empty(cls, n: int) -> _Worst:
        return cls(np.full(n, np.nan), np.full(n, np.nan), np.full(n, np.nan), {})

    def take(self, epochs: Ints, hpe_m: Floats, hpl_m: Floats, members: Bools) -> None:
        ratio = hpe_m / hpl_m
        at = np.argmax(np.where(np.isnan(ratio), -np.inf, ratio), axis=1)
        here = np.arange(epochs.size)
        self.ratio[epochs] = ratio[here, at]
        self.hpe_m[epochs], self.hpl_m[epochs] = hpe_m[here, at], hpl_m[here, at]
        self.members.update(zip(epochs.tolist(), members[at], strict=True))

    def table(self, epochs: Ints, used: UsedSatellites, start: Ints) -> pd.DataFrame:
        names = used.table["satellite"].astype(str).to_numpy()
        sets = [
            names[start[epoch] + np.flatnonzero(self.members[epoch])] for epoch in epochs.tolist()
        ]
        return pd.DataFrame(
            {
                "ratio": self.ratio[epochs],
                "hpe_m": self.hpe_m[epochs],
                "hpl_m": self.hpl_m[epochs],
                "n_sv": np.array([len(members) for members in sets], np.int64),
                "satellites": [" ".join(members) for members in sets],
            },
            index=pd.DatetimeIndex(used.time[epochs], name="time"),
        )
