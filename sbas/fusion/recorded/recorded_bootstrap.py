"""Recorded error series as the sensor of a simulation: replayed, or put together of blocks.

Only series of errors are offered. Bare N/DA/U states, drawn from a Markov chain, lose how long an
error keeps its sign and size, which a Kalman filter lives on: there is no such source here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Estimate
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.fusion.recorded.recorded_errors import RecordedErrors
from sbas.fusion.recorded.recorded_grid import (
    RecordedGrid,
    epoch_cells,
    longest_stretch,
    recorded_grid,
    window_starts,
)
from sbas.integrity.correlation.correlation import decorrelation_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FEW_WINDOWS: Final = 20
"""With fewer windows or blocks side by side the runs tell about the same few minutes."""
_UNLABELLED: Final = "(unlabelled)"


@dataclass(frozen=True, eq=False)
class RecordedSource:
    """Errors of a recorded sensor, to be called with a generator and a number of runs.

    Parameters
    ----------
    kind : "replay" or "block_bootstrap".
    step_s : between epochs [s].
    values : (a, c) errors on the axes, a cell an interval of the recordings, NaN no data [m].
    offsets : (t,) cell of each epoch, counted from the start of the run; -1 between two fixes.
    block_cells : cells of a block; a replay's only block is its window.
    labels : environments that a run is drawn from; one entry, "", without distinction.
    shares : (s,) share of the runs in each environment.
    starts : by environment, cells at which a block may begin.
    recorded_u_share, drawn_u_share : share of U along the track among the fixes, in the
        recordings and expected in a block: cells near the ends of a stretch are drawn more seldom.
    findings : what the recordings do not bear.
    """

    kind: Literal["replay", "block_bootstrap"]
    step_s: float
    values: Floats
    offsets: Ints
    block_cells: int
    labels: tuple[str, ...]
    shares: tuple[float, ...]
    starts: tuple[Ints, ...]
    recorded_u_share: float
    drawn_u_share: float
    findings: tuple[Finding, ...]

    def __call__(self, rng: np.random.Generator, runs: int) -> Floats:
        """(t, r) errors at the epochs [m], (a, t, r) on several axes; NaN no data.

        Environments are shared out among the runs in proportion, by one draw (systematic
        sampling), so that a small number of runs has no bias; within a run the blocks follow
        each other independently.
        """
        place = (np.arange(runs) + rng.random()) / runs
        # The last bound is 1 but for rounding, and no place lies beyond it.
        stratum = np.searchsorted(np.cumsum(self.shares)[:-1], place, side="right")
        blocks = int(self.offsets.max()) // self.block_cells + 1
        first = np.empty((blocks, runs), np.int64)
        for number, starts in enumerate(self.starts):
            own = stratum == number
            first[:, own] = starts[rng.integers(starts.size, size=(blocks, int(own.sum())))]
        at = np.flatnonzero(self.offsets >= 0)
        block, inside = np.divmod(self.offsets[at], self.block_cells)
        drawn = np.full((len(self.values), self.offsets.size, runs), np.nan)
        drawn[:, at] = self.values[:, first[block] + inside[:, None]]
        return drawn if len(self.values) > 1 else drawn[0]

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the series."""
        return {
            "kind": self.kind,
            "step_s": self.step_s,
            "epochs": self.offsets.size,
            "block_cells": self.block_cells,
            "environments": dict(zip(self.labels, self.shares, strict=True)),
            "starts": [starts.size for starts in self.starts],
            "recorded_u_share": self.recorded_u_share,
            "drawn_u_share": self.drawn_u_share,
            "findings": [f.to_dict() for f in self.findings],
        }


def replayed(
    recordings: RecordedErrors | Sequence[RecordedErrors],
    *,
    step_s: float,
    duration_s: float,
    environment: str | None = None,
    longest_outage_s: float = 60.0,
    axes: Literal[1, 3] = 1,
) -> RecordedSource:
    """Runs that are windows of the recordings, their begins drawn evenly.

    Parameters
    ----------
    recordings : each one a record of its own: no window goes from one to the next.
    step_s, duration_s : of the simulation [s]. A step longer than the interval takes every k-th
        epoch; with a shorter one epochs between two fixes have no data, as of a real receiver:
        nothing is interpolated.
    environment : label that windows keep within; None pays no heed to labels.
    longest_outage_s : a gap of the record up to this long [s] is an outage, no data within the
        window; a longer one, or one of another cause (`RecordedErrors.unknown`, a direction that
        is not known), interrupts the record, and no window crosses it.
    axes : 1 along the track, or 3 along, across and up.

    Raises
    ------
    InputError : steps that do not fit, other intervals or alert limits than the first
        recording's, or no stretch as long as a run.
    """
    grid = recorded_grid(recordings, longest_outage_s, axes)
    offsets = epoch_cells(grid.interval_s, step_s, duration_s)
    window = int(offsets.max()) + 1
    starts = window_starts(grid, window, by_label=environment is not None)
    if environment is not None:
        starts = starts[grid.label[starts] == grid.code_of(environment)]
    if not starts.size:
        within = "" if environment is None else f" within {environment!r}"
        raise InputError(
            f"no stretch{within} is as long as a run",
            evidence=f"a run takes {window * grid.interval_s:g} s, the longest stretch "
            f"{longest_stretch(grid, environment) * grid.interval_s:g} s",
            cure="shorter runs, --resampling block_bootstrap, or a longer recording; where a "
            "stretch has 0 s, no epoch has a direction of travel: --direction-above, --azimuth",
        )
    return _source("replay", grid, step_s, offsets, window, (environment or "",), (starts,))


def block_bootstrapped(
    recordings: RecordedErrors | Sequence[RecordedErrors],
    *,
    step_s: float,
    duration_s: float,
    block_s: float | None = None,
    tau_s: float | None = None,
    environment: str | None = None,
    longest_outage_s: float = 60.0,
    axes: Literal[1, 3] = 1,
) -> RecordedSource:
    """Runs put together of blocks of the recordings, for more variety than a replay has.

    Parameters
    ----------
    recordings, step_s, duration_s, longest_outage_s, axes : as `replayed`; a block crosses no
        end of a record and no interruption.
    block_s : length of the blocks [s]; None takes the shortest that is allowed.
    tau_s : decorrelation time of the errors [s]; None estimates it as `sbas.decorrelation` does,
        and takes the longest of the recordings'.
    environment : label to draw from; None shares the runs out among the labels by their epochs.

    Returns
    -------
    RecordedSource whose runs belong to one environment each, and all of whose blocks too.

    Raises
    ------
    InputError : as `replayed`; blocks shorter than max(3 tau, 95 % quantile of the time for which
        U lasts along the track); no tau; or an environment without a stretch as long as a block.

    Notes
    -----
    A moving-block bootstrap: begins are drawn evenly among all cells from which a whole block
    lies ahead. Where two blocks meet the error jumps: what lasts longer than a block is lost.

    References
    ----------
    H. R. Kuensch, Annals of Statistics 17 (1989) 1217 (blocks); Railways 2014 for the states.
    """
    grid = recorded_grid(recordings, longest_outage_s, axes)
    offsets = epoch_cells(grid.interval_s, step_s, duration_s)
    needed = _block_cells(grid, block_s, _tau_s(grid) if tau_s is None else tau_s)
    # A run shorter than a block is a window of one: no more need lie ahead of it.
    block = min(needed, int(offsets.max()) + 1)
    starts = window_starts(grid, block, by_label=True)
    present = np.unique(grid.label[~grid.barred])
    wanted = present if environment is None else [grid.code_of(environment)]
    names = tuple(grid.labels[code] if code >= 0 else _UNLABELLED for code in wanted)
    pools = tuple(starts[grid.label[starts] == code] for code in wanted)
    for name, pool in zip(names, pools, strict=True):
        if not pool.size:
            seen = longest_stretch(grid, name if grid.labels else None)
            raise InputError(
                "no stretch of the record is as long as a block",
                where=name if grid.labels else "",
                evidence=f"a block takes {block * grid.interval_s:g} s, the longest stretch "
                f"{seen * grid.interval_s:g} s",
                cure="a longer recording; or join labels, or choose one with environment=",
            )
    labels = names if grid.labels else ("",)
    source = _source("block_bootstrap", grid, step_s, offsets, block, labels, pools)
    if block < needed or block == int(offsets.max()) + 1:
        same = Finding(
            "E28", "info", "a block is as long as a run: the blocks are windows of a replay",
            evidence=f"blocks of {needed * grid.interval_s:g} s are needed, a run takes "
            f"{duration_s:g} s",
            cure="replay, which needs no tau; or longer runs",
        )  # fmt: skip
        source = replace(source, findings=(*source.findings, same))
    return source


# --- how long a block must be -----------------------------------------------------------------


def _tau_s(grid: RecordedGrid) -> float:
    """The longest decorrelation time of the recordings [s]; 0 where all are mostly white."""
    found, reasons = [], []
    for part in np.split(np.arange(grid.barred.size), grid.begins[1:]):
        pair = np.stack([grid.values[0, part], grid.across_m[part]])
        pair[:, grid.barred[part] | ~np.isfinite(pair).all(axis=0)] = np.nan
        answer = decorrelation_of(pair, grid.interval_s)
        if isinstance(answer.tau_s, Estimate):
            found.append(answer.tau_s.value)
        elif answer.misfit == "mostly_white":
            found.append(0.0)
        else:
            reasons.append(answer.tau_s.reason)
    if found:
        return max(found)
    raise InputError(
        "the decorrelation time of the errors is not known: no block length follows",
        evidence=reasons[0],
        cure="--resampling replay, which needs none; or another recording",
    )


def _block_cells(grid: RecordedGrid, block_s: float | None, tau_s: float) -> int:
    if not 0 <= tau_s < math.inf:
        raise InputError("a decorrelation time is 0 s or more", evidence=f"{tau_s} s")
    bad = np.concatenate([[False], np.abs(grid.values[0]) >= grid.alert_limit_m, [False]])
    bad[1:-1] &= ~grid.barred
    edges = np.flatnonzero(bad[1:] != bad[:-1])
    lengths = edges[1::2] - edges[::2]
    # The quantile is a length that was seen, the longer one of two.
    burst = int(np.quantile(lengths, 0.95, method="higher")) if lengths.size else 0
    needed_s = max(3 * tau_s, burst * grid.interval_s, grid.interval_s)
    if block_s is None:
        block_s = needed_s
    if not needed_s * (1 - 1e-9) <= block_s < math.inf:
        raise InputError(
            "blocks too short: errors would lose how long they last",
            evidence=f"{block_s:g} s; 3 tau are {3 * tau_s:g} s, and 95 % of the times in U "
            f"last {burst * grid.interval_s:g} s or less",
            cure=f"block_s of {needed_s:g} s or more",
        )
    return math.ceil(block_s / grid.interval_s - 1e-9)


# --- the source -------------------------------------------------------------------------------


def _source(
    kind: Literal["replay", "block_bootstrap"],
    grid: RecordedGrid,
    step_s: float,
    offsets: Ints,
    block: int,
    labels: tuple[str, ...],
    pools: tuple[Ints, ...],
) -> RecordedSource:
    # A label weighs as its cells do, not as its begins: short stretches have few of these.
    if len(pools) > 1:
        cells = [int(np.sum(~grid.barred & (grid.label == grid.label[p[0]]))) for p in pools]
    else:
        cells = [1]
    shares = tuple(n / sum(cells) for n in cells)
    weight = np.zeros(grid.barred.size)
    for share, pool in zip(shares, pools, strict=True):
        edges = np.bincount(pool, minlength=weight.size + 1)
        edges -= np.bincount(pool + block, minlength=weight.size + 1)
        weight += share / pool.size * np.cumsum(edges[:-1])
    fix = np.isfinite(grid.values[0]) & ~grid.barred
    if labels != ("",):
        fix &= np.isin(grid.label, [grid.label[p[0]] for p in pools])
    bad = fix & (np.abs(grid.values[0]) >= grid.alert_limit_m)
    recorded = float(bad.sum() / fix.sum()) if fix.any() else 0.0
    drawn = float(weight[bad].sum() / weight[fix].sum()) if fix.any() else 0.0
    findings = []
    unacceptable = int(np.sum(bad & (weight == 0)))
    if lost := int(np.sum(fix & (weight == 0))):
        findings.append(
            Finding(
                "E15", "warning",
                f"{lost:,} of {int(fix.sum()):,} fixes lie in stretches shorter than "
                f"{block * grid.interval_s:g} s and are never drawn",
                evidence=f"{unacceptable:,} of them are unacceptable; share of U "
                f"{recorded:.3g} recorded, {drawn:.3g} drawn",
                cure="shorter runs or blocks, or a longer recording",
            )
        )  # fmt: skip
    for label, pool in zip(labels, pools, strict=True):
        apart = int(np.sum(np.diff(pool) > 1)) + 1
        side_by_side = (pool.size + apart * (block - 1)) // block
        if side_by_side < FEW_WINDOWS:
            findings.append(
                Finding(
                    "E15", "warning",
                    f"the runs are drawn from about {side_by_side} windows side by side",
                    where=label,
                    evidence=f"windows of {block * grid.interval_s:g} s; their overlap adds no "
                    "knowledge, and intervals between runs do not show it",
                    cure="a longer recording",
                )
            )  # fmt: skip
    return RecordedSource(
        kind, step_s, grid.values, offsets, block, labels, shares, pools, recorded, drawn,
        tuple(findings),
    )  # fmt: skip
