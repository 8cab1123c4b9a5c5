"""Counts of epochs that add up, whichever epochs they are: the sizes behind an evaluation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.integrity.level_counts import LevelCounter
from sbas.integrity.stanford import REGIONS, stanford_regions
from sbas.recording import MODES
from sbas.recording_survey import GAP_STEPS, Survey
from sbas.streaming import DensityGrid, Distribution, ThinnedSeries

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

LEVEL_GRID_M = tuple(np.concatenate([np.arange(1, 201) / 2, np.arange(110, 610, 10)]).tolist())
"""Alert limits of the curve availability against alert limit [m]."""

STRIPS = ("hpl_m", "n_sv", "hdop", "hpe_m", "sigma_h_m")
STRIP_BINS = 1200
STANFORD_BINS = 200


@dataclass(frozen=True, eq=False)
class EpochErrors:
    """(n,) errors and the 1-sigma of their truth [m]; NaN where none was formed."""

    east_m: Floats
    north_m: Floats
    hpe_m: Floats
    vpe_m: Floats
    truth_sigma_h_m: Floats

    def at(self, rows: Ints) -> EpochErrors:
        return EpochErrors(*(values[rows] for values in vars(self).values()))


@dataclass(frozen=True, eq=False)
class EpochValues:
    """What an evaluation takes of (n,) epochs, NaN where a number is missing.

    `covers_ns` is the time that each epoch stands for, `fix` True where it has a position,
    `left_out` where it has a level that is none of the service; `hpl_m` and `vpl_m` are without
    those. `modes` are indices into `MODES`, -1 where unstated; `down` by alert limit where there
    is no service; `judged` where error and level are known; `errors` None without truth.
    """

    time_ns: Ints
    covers_ns: Ints
    fix: Bools
    left_out: Bools
    hpl_m: Floats
    vpl_m: Floats
    modes: NDArray[np.int8]
    n_sv: Floats
    hdop: Floats
    sigma_h_m: Floats
    down: Mapping[float, Bools]
    judged: Bools
    errors: EpochErrors | None

    @property
    def hpe_m(self) -> Floats:
        return np.full(self.time_ns.size, np.nan) if self.errors is None else self.errors.hpe_m

    def at(self, rows: Ints) -> EpochValues:
        """The values of some rows."""
        values = dict(vars(self))
        down, errors = values.pop("down"), values.pop("errors")
        return EpochValues(
            **{name: array[rows] for name, array in values.items()},
            down={limit: array[rows] for limit, array in down.items()},
            errors=None if errors is None else errors.at(rows),
        )


class PartTally:
    """Counts over the epochs of a record, or of a part of it such as one environment.

    Parameters
    ----------
    survey : of the whole record: its span and interval.
    alert_limits_m : horizontal alert limits [m].
    """

    RATIO_GRID = np.geomspace(1e-3, 1e2, 251)

    def __init__(self, survey: Survey, alert_limits_m: tuple[float, ...]) -> None:
        self.alert_limits_m = alert_limits_m
        # Levels alone, without any position, are judged as levels.
        self.level_alone = survey.positions == 0
        self.epochs = self.positions = self.judged = self.mi_epochs = self.levels_left_out = 0
        self.covered_ns = self.judged_ns = self.error_ns = self.level_ns = 0
        self.begin_ns: int | None = None
        self.end_ns: int | None = None
        self.down_ns = dict.fromkeys(alert_limits_m, 0)
        self.hpe, self.vpe, self.hpl, self.vpl = (Distribution() for _ in range(4))
        self.truth_sigma_h_m = 0.0
        self.modes = dict.fromkeys((*MODES, "unknown"), 0)
        self.regions = {al: np.zeros(len(REGIONS), np.int64) for al in alert_limits_m}
        self._level_counts = np.zeros(len(LEVEL_GRID_M) + 1, np.int64)
        self._ratio_counts = np.zeros(self.RATIO_GRID.size + 1, np.int64)
        self._sums = np.zeros(5)
        self.levels = LevelCounter(int(GAP_STEPS * survey.interval_ns))
        # Not more bins than epochs: empty ones would break the lines of a short record.
        span_ns = survey.end_ns - survey.begin_ns
        bins = min(STRIP_BINS, span_ns // max(survey.interval_ns, 1) + 1)
        self.strips = ThinnedSeries(survey.begin_ns, survey.end_ns, STRIPS, bins)
        self.scatter = DensityGrid()
        self.stanford_cell_m = 1.2 * max(alert_limits_m) / STANFORD_BINS
        self.stanford = np.zeros((STANFORD_BINS, STANFORD_BINS), np.int64)

    def update(self, values: EpochValues) -> None:
        """Count epochs that follow all earlier ones, at least one."""
        time_ns, covers, hpl = values.time_ns, values.covers_ns, values.hpl_m
        self.epochs += time_ns.size
        self.begin_ns = int(time_ns[0]) if self.begin_ns is None else self.begin_ns
        self.end_ns = int(time_ns[-1])
        self.covered_ns += int(covers.sum())
        self.levels_left_out += int(values.left_out.sum())
        self.hpl.update(hpl)
        self.vpl.update(values.vpl_m)
        # A missing mode has code -1, which the modulus turns into the last name, unknown.
        modes = np.bincount(values.modes % len(self.modes))
        for name, count in zip(self.modes, modes, strict=False):
            self.modes[name] += int(count)
        fix = values.fix | self.level_alone
        self.levels.update(time_ns, np.where(fix, hpl, np.nan), values.modes)
        self._level_counts += np.bincount(
            np.searchsorted(LEVEL_GRID_M, hpl[fix & np.isfinite(hpl)], side="right"),
            minlength=self._level_counts.size,
        )
        self.positions += int(values.fix.sum())
        for al in self.alert_limits_m:
            self.down_ns[al] += int(covers[values.down[al]].sum())
        self.level_ns += int(covers[np.isfinite(hpl)].sum())
        if values.errors is not None:
            self._update_errors(values, values.errors)
        self.strips.update(
            time_ns,
            {name: getattr(values, name) for name in STRIPS},
        )

    def _update_errors(self, values: EpochValues, errors: EpochErrors) -> None:
        hpe, hpl, covers = errors.hpe_m, values.hpl_m, values.covers_ns
        self.hpe.update(hpe)
        self.vpe.update(errors.vpe_m)
        formed = np.isfinite(hpe)
        if formed.any():
            sigma = errors.truth_sigma_h_m[formed]
            self.truth_sigma_h_m = max(self.truth_sigma_h_m, float(sigma.max()))
        e, n = errors.east_m[formed], errors.north_m[formed]
        self._sums += [e.sum(), n.sum(), e @ e, n @ n, e @ n]
        self.scatter.update(errors.east_m, errors.north_m)
        judged = values.judged
        self.judged += int(judged.sum())
        self.judged_ns += int(covers[judged].sum())
        self.error_ns += int(covers[formed].sum())
        self.mi_epochs += int(np.sum(hpe >= hpl))
        for al in self.alert_limits_m:
            codes = stanford_regions(hpe, hpl, al)
            self.regions[al] += np.bincount(codes, minlength=len(REGIONS))
        self._ratio_counts += np.bincount(
            np.searchsorted(self.RATIO_GRID, hpe[judged] / hpl[judged], side="right"),
            minlength=self._ratio_counts.size,
        )
        last = STANFORD_BINS - 1
        column = np.minimum(hpe[judged] / self.stanford_cell_m, last).astype(np.int64)
        row = np.minimum(hpl[judged] / self.stanford_cell_m, last).astype(np.int64)
        flat = row * STANFORD_BINS + column
        self.stanford += np.bincount(flat, minlength=STANFORD_BINS**2).reshape(
            STANFORD_BINS, STANFORD_BINS
        )

    def merge(self, other: PartTally) -> None:
        """Add the counts of epochs that follow."""
        for name in ("epochs", "positions", "judged", "mi_epochs", "levels_left_out", "covered_ns",
                     "judged_ns", "error_ns", "level_ns"):  # fmt: skip
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in ("hpe", "vpe", "hpl", "vpl", "strips", "scatter", "levels"):
            getattr(self, name).merge(getattr(other, name))
        self.begin_ns = other.begin_ns if self.begin_ns is None else self.begin_ns
        self.end_ns = self.end_ns if other.end_ns is None else other.end_ns
        self.truth_sigma_h_m = max(self.truth_sigma_h_m, other.truth_sigma_h_m)
        for mode, count in other.modes.items():
            self.modes[mode] += count
        for al in self.alert_limits_m:
            self.down_ns[al] += other.down_ns[al]
            self.regions[al] += other.regions[al]
        self._level_counts += other._level_counts
        self._ratio_counts += other._ratio_counts
        self._sums += other._sums
        self.stanford += other.stanford

    def levels_below(self) -> Ints:
        """(g,) epochs with a fix (`level_alone`: any) and HPL below each limit of LEVEL_GRID_M."""
        return np.cumsum(self._level_counts)[:-1]

    def ratio_exceeded(self) -> Floats:
        """(r,) share of judged epochs with HPE/HPL at or above each value of RATIO_GRID."""
        above = np.cumsum(self._ratio_counts[::-1])[::-1][1:]
        return above / max(self.judged, 1)

    def moments(self) -> tuple[float, float, float, float, float]:
        """Mean of east and north [m], their variances and covariance [m2]."""
        n = self.hpe.count
        e, north, ee, nn, en = (self._sums / n).tolist()
        return e, north, max(ee - e * e, 0.0), max(nn - north * north, 0.0), en - e * north
