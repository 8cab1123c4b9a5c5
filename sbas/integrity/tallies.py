"""What an evaluation counts while a recording streams by: one object, batch after batch."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.integrity.correlation.error_grid import GridFiller, grid_cells
from sbas.integrity.epoch_levels import mode_codes
from sbas.integrity.events import Runs, Stretch, find_runs, join_runs
from sbas.integrity.level_counts import LevelCounter
from sbas.integrity.position_error import position_errors
from sbas.integrity.rate_evidence import EventKind
from sbas.integrity.stanford import REGIONS, stanford_regions
from sbas.recording import MODES, left_out_levels, major_semi_axis_m
from sbas.recording_survey import GAP_STEPS, Survey
from sbas.streaming import DensityGrid, Distribution, ThinnedSeries
from sbas.truth import Truth

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

CURVE_LIMITS_M = (
    1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 75.0,
    100.0, 150.0, 200.0, 300.0, 556.0,
)  # fmt: skip
"""Alert limits of the curve rate against alert limit [m]; 556 m is aviation's NPA limit."""

LIMIT_KINDS: tuple[EventKind, ...] = ("hmi", "exceeds_al")
"""Kinds of events that depend on the alert limit."""

LEVEL_GRID_M = tuple(np.concatenate([np.arange(1, 201) / 2, np.arange(110, 610, 10)]).tolist())
"""Alert limits of the curve availability against alert limit [m]."""

STRIPS = ("hpl_m", "n_sv", "hdop", "hpe_m", "sigma_h_m")
STRIP_BINS = 1200
STANFORD_BINS = 200


class RunCollector:
    """Runs of the batches so far, joined when asked."""

    def __init__(self) -> None:
        self._parts: list[Runs] = []

    def add(self, index: Ints, stretch: Stretch, judged: Bools | None = None) -> None:
        self._parts.append(find_runs(index, stretch, judged))

    def merge(self, other: RunCollector) -> None:
        """Add the runs of the stretch that follows."""
        self._parts += other._parts

    def whole(self) -> Runs:
        return reduce(join_runs, self._parts)


class RecordTally:
    """All counts of one evaluation; `update` with batches in order, `merge` with what follows.

    Parameters
    ----------
    survey : of the whole record: its span, interval and gaps.
    truth : None for levels and availability only.
    alert_limits_m : horizontal alert limits [m].
    """

    COLUMNS = (
        "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "n_sv", "mode", "flags",
        "sigma_e_m", "sigma_n_m", "cov_en_m2",
    )  # fmt: skip
    RATIO_GRID = np.geomspace(1e-3, 1e2, 251)

    def __init__(
        self, survey: Survey, truth: Truth | None, alert_limits_m: tuple[float, ...]
    ) -> None:
        self.truth = truth
        self.alert_limits_m = alert_limits_m
        self.interval_ns = survey.interval_ns
        self.max_step_ns = int(GAP_STEPS * survey.interval_ns)
        self.epochs = self.positions = self.judged = self.mi_epochs = self.levels_left_out = 0
        self.covered_ns = self.judged_ns = self.error_ns = self.level_ns = 0
        self.down_ns = dict.fromkeys(alert_limits_m, 0)
        self._last_ns: int | None = None
        self.hpe, self.vpe, self.hpl, self.vpl = (Distribution() for _ in range(4))
        self.truth_sigma_h_m = 0.0
        self.modes = dict.fromkeys((*MODES, "unknown"), 0)
        self.regions = {al: np.zeros(len(REGIONS), np.int64) for al in alert_limits_m}
        self.down = {al: RunCollector() for al in alert_limits_m}
        self.mi = RunCollector()
        self._limits = tuple(sorted({*alert_limits_m, *CURVE_LIMITS_M}))
        self._over = {(kind, al): RunCollector() for kind in LIMIT_KINDS for al in self._limits}
        self._level_counts = np.zeros(len(LEVEL_GRID_M) + 1, np.int64)
        self._ratio_counts = np.zeros(self.RATIO_GRID.size + 1, np.int64)
        self._sums = np.zeros(5)
        self.levels = LevelCounter(self.max_step_ns)
        self.grid = self._grid(survey)
        self.strips = ThinnedSeries(survey.begin_ns, survey.end_ns, STRIPS, STRIP_BINS)
        self.scatter = DensityGrid()
        self.stanford_cell_m = 1.2 * max(alert_limits_m) / STANFORD_BINS
        self.stanford = np.zeros((STANFORD_BINS, STANFORD_BINS), np.int64)

    def _grid(self, survey: Survey) -> GridFiller | Refusal:
        if self.truth is None:
            return Refusal("without truth no error is formed", "--truth LAT,LON,HEIGHT")
        if survey.repeated or survey.backward:
            return Refusal("times are repeated or run backward", "sort, or drop what is repeated")
        cells = grid_cells(survey)
        return cells if isinstance(cells, Refusal) else GridFiller(survey, cells, levels=True)

    def update(self, batch: pd.DataFrame) -> None:
        """Count a batch with `COLUMNS`, whose times follow all earlier ones."""
        n = len(batch)
        if n == 0:
            return
        self.epochs += n
        stretch = Stretch(batch.index.to_numpy().astype(np.int64), self.max_step_ns)
        covers = self._covered(stretch.time_ns)
        self.covered_ns += int(covers.sum())
        # A level without bound is none.
        left_out = left_out_levels(batch) | np.isinf(batch["hpl_m"].to_numpy())
        hpl = np.where(left_out, np.nan, batch["hpl_m"].to_numpy())
        vpl = batch["vpl_m"].to_numpy()
        vpl = np.where(left_out | np.isinf(vpl), np.nan, vpl)
        self.levels_left_out += int(np.sum(left_out & ~np.isnan(batch["hpl_m"].to_numpy())))
        self.hpl.update(hpl)
        self.vpl.update(vpl)
        codes = mode_codes(batch)
        # A missing mode has code -1, which the modulus turns into the last name, unknown.
        for name, count in zip(self.modes, np.bincount(codes % len(self.modes)), strict=False):
            self.modes[name] += int(count)
        fix = np.isfinite(batch["lat_deg"].to_numpy()) & np.isfinite(batch["lon_deg"].to_numpy())
        self.levels.update(stretch.time_ns, np.where(fix, hpl, np.nan), codes)
        self._level_counts += np.bincount(
            np.searchsorted(LEVEL_GRID_M, hpl[fix & np.isfinite(hpl)], side="right"),
            minlength=self._level_counts.size,
        )
        self.positions += int(fix.sum())
        for al in self.alert_limits_m:
            # Written so that a missing level or fix is down.
            down = ~(fix & (hpl < al))
            self.down[al].add(np.flatnonzero(down), stretch)
            self.down_ns[al] += int(covers[down].sum())
        self.level_ns += int(covers[np.isfinite(hpl)].sum())
        hpe = np.full(n, np.nan)
        if self.truth is not None:
            hpe = self._update_errors(batch, hpl, codes, stretch, covers)
        n_sv = batch["n_sv"].to_numpy().astype(float)
        sigmas = (batch[name].to_numpy() for name in ("sigma_e_m", "sigma_n_m", "cov_en_m2"))
        self.strips.update(
            stretch.time_ns,
            {
                "hpl_m": hpl,
                "n_sv": np.where(n_sv < 0, np.nan, n_sv),
                "hdop": batch["hdop"].to_numpy(),
                "hpe_m": hpe,
                "sigma_h_m": major_semi_axis_m(*sigmas),
            },
        )

    def _covered(self, time_ns: Ints) -> Ints:
        """(n,) time that each epoch stands for: the step before it, at most the interval, so
        that no rate of recording makes more hours than have passed."""
        first = time_ns[0] - self.interval_ns if self._last_ns is None else self._last_ns
        self._last_ns = int(time_ns[-1])
        return np.minimum(np.diff(time_ns, prepend=first), self.interval_ns)

    def _update_errors(
        self,
        batch: pd.DataFrame,
        hpl: Floats,
        codes: NDArray[np.int8],
        stretch: Stretch,
        covers: Ints,
    ) -> Floats:
        assert self.truth is not None
        errors = position_errors(batch, self.truth)
        east, north = errors["east_m"].to_numpy(), errors["north_m"].to_numpy()
        hpe: Floats = errors["hpe_m"].to_numpy()
        self.hpe.update(hpe)
        self.vpe.update(errors["vpe_m"].to_numpy())
        formed = np.isfinite(hpe)
        if formed.any():
            sigma = errors["truth_sigma_h_m"].to_numpy()[formed]
            self.truth_sigma_h_m = max(self.truth_sigma_h_m, float(sigma.max()))
        e, n = east[formed], north[formed]
        self._sums += [e.sum(), n.sum(), e @ e, n @ n, e @ n]
        self.scatter.update(east, north)
        if isinstance(self.grid, GridFiller):
            self.grid.fill(stretch.time_ns, np.stack([east, north]), hpl_m=hpl, modes=codes)
        judged = formed & np.isfinite(hpl)
        self.judged += int(judged.sum())
        self.judged_ns += int(covers[judged].sum())
        self.error_ns += int(covers[formed].sum())
        misled = np.flatnonzero(hpe >= hpl)
        self.mi_epochs += misled.size
        self.mi.add(misled, stretch, judged)
        for al in self.alert_limits_m:
            codes = stanford_regions(hpe, hpl, al)
            self.regions[al] += np.bincount(codes, minlength=len(REGIONS))
        # Sets over rising limits are nested: each is searched in the one before.
        over = np.flatnonzero(hpe >= self._limits[0])
        for al in self._limits:
            over = over[hpe[over] >= al]
            self._over["exceeds_al", al].add(over, stretch, formed)
            self._over["hmi", al].add(over[hpl[over] < al], stretch, judged)
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
        return hpe

    def merge(self, other: RecordTally) -> None:
        """Add the tally of the part of the record that follows."""
        for name in ("epochs", "positions", "judged", "mi_epochs", "levels_left_out", "covered_ns",
                     "judged_ns", "error_ns", "level_ns"):  # fmt: skip
            setattr(self, name, getattr(self, name) + getattr(other, name))
        for name in ("hpe", "vpe", "hpl", "vpl", "mi", "strips", "scatter", "levels"):
            getattr(self, name).merge(getattr(other, name))
        if isinstance(self.grid, GridFiller) and isinstance(other.grid, GridFiller):
            self.grid.merge(other.grid)
        self.truth_sigma_h_m = max(self.truth_sigma_h_m, other.truth_sigma_h_m)
        for mode, count in other.modes.items():
            self.modes[mode] += count
        for al in self.alert_limits_m:
            self.down_ns[al] += other.down_ns[al]
            self.regions[al] += other.regions[al]
            self.down[al].merge(other.down[al])
        for key, runs in self._over.items():
            runs.merge(other._over[key])
        self._level_counts += other._level_counts
        self._ratio_counts += other._ratio_counts
        self._sums += other._sums
        self.stanford += other.stanford

    def at_limit(self, kind: EventKind, alert_limit_m: float) -> Runs:
        """Runs of HMI, or of errors at or above an alert limit."""
        return self._over[kind, alert_limit_m].whole()

    def levels_below(self) -> Ints:
        """(g,) epochs with a fix and HPL below each limit of LEVEL_GRID_M."""
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
