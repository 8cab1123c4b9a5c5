"""What an evaluation counts while a recording streams by: one object, batch after batch."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.integrity.correlation.error_grid import GridFiller, grid_cells
from sbas.integrity.environments.label_tallies import LabelTallies
from sbas.integrity.epoch_levels import mode_codes
from sbas.integrity.events import Runs, Stretch, find_runs, join_runs
from sbas.integrity.part_tally import EpochErrors, EpochValues, PartTally
from sbas.integrity.position_error import position_errors
from sbas.integrity.rate_evidence import EventKind
from sbas.recording import left_out_levels, major_semi_axis_m
from sbas.recording_survey import GAP_STEPS, Survey
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
    labelled : count by environment label as well.
    """

    def __init__(
        self,
        survey: Survey,
        truth: Truth | None,
        alert_limits_m: tuple[float, ...],
        *,
        labelled: bool = False,
    ) -> None:
        self.truth = truth
        self.alert_limits_m = alert_limits_m
        self.interval_ns = survey.interval_ns
        self.max_step_ns = int(GAP_STEPS * survey.interval_ns)
        self._last_ns: int | None = None
        self.all = PartTally(survey, alert_limits_m)
        self.labels = LabelTallies(lambda: PartTally(survey, alert_limits_m)) if labelled else None
        self.down = {al: RunCollector() for al in alert_limits_m}
        self.mi = RunCollector()
        self._limits = tuple(sorted({*alert_limits_m, *CURVE_LIMITS_M}))
        self._over = {(kind, al): RunCollector() for kind in LIMIT_KINDS for al in self._limits}
        self.grid = self._grid(survey)

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that a batch must have."""
        return _COLUMNS if self.labels is None else (*_COLUMNS, "environment")

    def _grid(self, survey: Survey) -> GridFiller | Refusal:
        if self.truth is None:
            return Refusal("without truth no error is formed", "--truth LAT,LON,HEIGHT")
        if survey.repeated or survey.backward:
            return Refusal("times are repeated or run backward", "sort, or drop what is repeated")
        cells = grid_cells(survey)
        return cells if isinstance(cells, Refusal) else GridFiller(survey, cells, levels=True)

    def update(self, batch: pd.DataFrame) -> None:
        """Count a batch with `columns`, whose times follow all earlier ones."""
        if len(batch) == 0:
            return
        values = self._values(batch)
        stretch = Stretch(values.time_ns, self.max_step_ns)
        self.all.update(values)
        if self.labels is not None:
            self.labels.update(batch["environment"], values)
        for al in self.alert_limits_m:
            self.down[al].add(np.flatnonzero(values.down[al]), stretch)
        if values.errors is not None:
            self._add_runs(values, values.errors.hpe_m, stretch)
            if isinstance(self.grid, GridFiller):
                offsets = np.stack([values.errors.east_m, values.errors.north_m])
                self.grid.fill(values.time_ns, offsets, hpl_m=values.hpl_m, modes=values.modes)

    def _values(self, batch: pd.DataFrame) -> EpochValues:
        time_ns = batch.index.to_numpy().astype(np.int64)
        hpl, vpl = batch["hpl_m"].to_numpy(), batch["vpl_m"].to_numpy()
        # A level without bound is none.
        left_out = left_out_levels(batch) | np.isinf(hpl)
        n_sv = batch["n_sv"].to_numpy().astype(float)
        sigmas = (batch[name].to_numpy() for name in ("sigma_e_m", "sigma_n_m", "cov_en_m2"))
        usable = np.where(left_out, np.nan, hpl)
        known = np.isfinite(usable)
        fix = np.isfinite(batch["lat_deg"].to_numpy()) & np.isfinite(batch["lon_deg"].to_numpy())
        errors = self._errors(batch)
        return EpochValues(
            time_ns=time_ns,
            covers_ns=self._covered(time_ns),
            fix=fix,
            left_out=left_out & ~np.isnan(hpl),
            hpl_m=usable,
            vpl_m=np.where(left_out | np.isinf(vpl), np.nan, vpl),
            modes=mode_codes(batch),
            n_sv=np.where(n_sv < 0, np.nan, n_sv),
            hdop=batch["hdop"].to_numpy(),
            sigma_h_m=major_semi_axis_m(*sigmas),
            # Written so that a missing level or fix is down.
            down={
                al: ~((fix | self.all.level_alone) & (usable < al)) for al in self.alert_limits_m
            },
            judged=known if errors is None else known & np.isfinite(errors.hpe_m),
            errors=errors,
        )

    def _errors(self, batch: pd.DataFrame) -> EpochErrors | None:
        if self.truth is None:
            return None
        errors = position_errors(batch, self.truth)
        names = ("east_m", "north_m", "hpe_m", "vpe_m", "truth_sigma_h_m")
        return EpochErrors(*(errors[name].to_numpy() for name in names))

    def _covered(self, time_ns: Ints) -> Ints:
        """(n,) time that each epoch stands for: the step before it, at most the interval, so
        that no rate of recording makes more hours than have passed."""
        first = time_ns[0] - self.interval_ns if self._last_ns is None else self._last_ns
        self._last_ns = int(time_ns[-1])
        return np.minimum(np.diff(time_ns, prepend=first), self.interval_ns)

    def _add_runs(self, values: EpochValues, hpe: Floats, stretch: Stretch) -> None:
        hpl, judged, formed = values.hpl_m, values.judged, np.isfinite(hpe)
        self.mi.add(np.flatnonzero(hpe >= hpl), stretch, judged)
        # Sets over rising limits are nested: each is searched in the one before.
        over = np.flatnonzero(hpe >= self._limits[0])
        for al in self._limits:
            over = over[hpe[over] >= al]
            self._over["exceeds_al", al].add(over, stretch, formed)
            self._over["hmi", al].add(over[hpl[over] < al], stretch, judged)

    def merge(self, other: RecordTally) -> None:
        """Add the tally of the part of the record that follows."""
        self.all.merge(other.all)
        self.mi.merge(other.mi)
        if self.labels is not None and other.labels is not None:
            self.labels.merge(other.labels)
        if isinstance(self.grid, GridFiller) and isinstance(other.grid, GridFiller):
            self.grid.merge(other.grid)
        for al in self.alert_limits_m:
            self.down[al].merge(other.down[al])
        for key, runs in self._over.items():
            runs.merge(other._over[key])

    def bad_runs(self, kind: EventKind, alert_limit_m: float) -> Runs:
        """Runs of misleading information, of HMI, or of errors at or above an alert limit."""
        return self.mi.whole() if kind == "mi" else self._over[kind, alert_limit_m].whole()


_COLUMNS = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "n_sv", "mode", "flags",
    "sigma_e_m", "sigma_n_m", "cov_en_m2",
)  # fmt: skip
