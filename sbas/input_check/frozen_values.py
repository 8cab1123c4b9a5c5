"""Values that stay the same to the last digit while the geometry behind them changes (E13).

A level that is repeated over a minute in which satellites come and go was not computed anew. What
a change of geometry must do to it hangs on the digits that are written: a level in whole metres
stays the same for long. Hence two signs, either of which will do: the geometry changes by far
more than the last digit; or the value changes at nearly every other epoch of the recording.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.input_check.judgement import Judged, counted, judged, place
from sbas.recording_survey import Rows

LEAST_EPOCHS = 60
GEOMETRY_RATIO = 1.05
"""HDOP's largest over smallest value within a run, from which the geometry has changed."""
USUAL_CHANGES = 0.9
"""Share of the other epochs at which the value changes, from which any standstill is odd."""
LARGEST_LEVEL_M = 556.0
"""Alert limit of non-precision approach (0.3 nautical miles), the largest there is: a level beyond
it says "not available" and may well stand still."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FrozenRun:
    """Epochs `row` up to, not with, `end` have one value; how the geometry changed in them."""

    row: int
    end: int
    begin_ns: int
    value: float
    hdop_min: float
    hdop_max: float
    n_sv_min: float
    n_sv_max: float

    def with_more(self, other: FrozenRun) -> FrozenRun:
        """This run, going on as another."""
        return FrozenRun(
            self.row, other.end, self.begin_ns, self.value,
            float(np.fmin(self.hdop_min, other.hdop_min)),
            float(np.fmax(self.hdop_max, other.hdop_max)),
            float(np.fmin(self.n_sv_min, other.n_sv_min)),
            float(np.fmax(self.n_sv_max, other.n_sv_max)),
        )  # fmt: skip

    @property
    def hdop_ratio(self) -> float:
        return self.hdop_max / self.hdop_min if self.hdop_min > 0 else 1.0

    @property
    def satellites(self) -> float:
        """How many satellites more at most than at least; 0 where unknown."""
        return float(np.nan_to_num(self.n_sv_max - self.n_sv_min))


class FrozenRuns:
    """Runs of at least `LEAST_EPOCHS` epochs in which columns keep their values.

    Parameters
    ----------
    columns : which have to stay the same, all of them; the first is shown and its digits count.
    """

    def __init__(self, columns: tuple[str, ...]) -> None:
        self.columns = columns
        self.COLUMNS = (*columns, "hdop", "n_sv")
        self.runs: list[FrozenRun] = []
        self.changes = self.rows = 0
        self.smallest_change = np.inf
        self._open: FrozenRun | None = None
        self._values: tuple[float, ...] = ()

    def update(self, rows: Rows) -> None:
        values = [rows.values[name] for name in self.columns]
        n = len(rows)
        begins = np.zeros(n, bool)
        begins[0] = True
        for column in values:
            # A missing value equals nothing: each is a run of its own.
            begins[1:] |= column[1:] != column[:-1]
        first = tuple(float(column[0]) for column in values)
        goes_on = self._open is not None and first == self._values
        first_change = abs(first[0] - self._values[0]) if self._open is not None else 0.0
        change = np.abs(np.diff(values[0]))
        change = np.append(change[change > 0], first_change if first_change > 0 else [])
        if change.size:
            self.smallest_change = min(self.smallest_change, float(change.min()))
        self.rows += n
        self.changes += int(begins.sum()) - goes_on
        starts = np.flatnonzero(begins)
        ends = np.append(starts[1:], n)
        long = np.flatnonzero(ends - starts >= LEAST_EPOCHS).tolist()
        for i in dict.fromkeys((0, *long, starts.size - 1)):
            run = self._run(rows, int(starts[i]), int(ends[i]))
            if i == 0 and goes_on and self._open is not None:
                run = self._open.with_more(run)
            elif i == 0:
                self._close()
            if i == starts.size - 1:
                self._open = run
            else:
                self._keep(run)
        self._values = tuple(float(column[-1]) for column in values)

    def _run(self, rows: Rows, begin: int, end: int) -> FrozenRun:
        part = rows.part(begin, end)
        hdop = part.values["hdop"]
        n_sv = np.where(part.values["n_sv"] < 0, np.nan, part.values["n_sv"])
        return FrozenRun(
            part.first, part.first + len(part), int(part.time_ns[0]),
            float(part.values[self.columns[0]][0]),
            *(float(f.reduce(v)) for v in (hdop, n_sv) for f in (np.fmin, np.fmax)),
        )  # fmt: skip

    def _keep(self, run: FrozenRun) -> None:
        if run.end - run.row >= LEAST_EPOCHS:
            self.runs.append(run)

    def _close(self) -> None:
        if self._open is not None:
            self._keep(self._open)
            self._open = None

    def frozen(self) -> tuple[FrozenRun, ...]:
        """The runs that a change of geometry should have ended. Call it behind the last row."""
        self._close()
        inside = sum(run.end - run.row for run in self.runs)
        others = self.rows - inside
        lively = (self.changes - len(self.runs)) >= USUAL_CHANGES * others and others > 0
        digit = min(self.smallest_change, _last_digit(self.runs[0].value) if self.runs else 0.0)
        return tuple(run for run in self.runs if self._is_frozen(run, lively, digit))

    @staticmethod
    def _is_frozen(run: FrozenRun, lively: bool, digit: float) -> bool:
        if lively:
            return run.hdop_ratio > 1 or run.satellites >= 1
        ratio = max(run.hdop_ratio, GEOMETRY_RATIO if run.satellites >= 2 else 1.0)
        return ratio >= GEOMETRY_RATIO and abs(run.value) * (ratio - 1) >= 3 * digit


def _last_digit(value: float) -> float:
    """Value of the last decimal that a number is written with: 0.01 of 11.37."""
    for decimals in range(10):
        if abs(value * 10.0**decimals - round(value * 10.0**decimals)) < 1e-6:
            return float(10.0**-decimals)
    return 0.0


def frozen_levels(watch: FrozenRuns) -> Iterator[Judged]:
    """E13: horizontal levels that stand still."""
    runs = [run for run in watch.frozen() if run.value < LARGEST_LEVEL_M]
    if not runs:
        return
    epochs = sum(run.end - run.row for run in runs)
    yield judged(
        "E13", "error",
        f"the protection level stands still over {epochs:,} epochs while the geometry changes",
        where=f"first from {place(runs[0].row, runs[0].begin_ns)}",
        evidence=_shown(runs),
        cure="--pl-frozen missing",
        repair={"pl_frozen": "missing"},
    )  # fmt: skip


def frozen_positions(watch: FrozenRuns) -> Iterator[Judged]:
    """E13: positions that stand still to the last digit."""
    runs = watch.frozen()
    if not runs or watch.smallest_change > FINE_DEG:
        return
    epochs = sum(run.end - run.row for run in runs)
    yield judged(
        "E13", "warning",
        f"the position stands still to the last digit over {epochs:,} epochs while the geometry "
        "changes",
        where=f"first from {place(runs[0].row, runs[0].begin_ns)}",
        evidence=_shown(runs),
        cure="switch off the receiver's static hold; these epochs show no error of a fix",
    )  # fmt: skip


FINE_DEG = 2e-8
"""Positions written more coarsely than to 2 mm may repeat of themselves."""


def _shown(runs: list[FrozenRun] | tuple[FrozenRun, ...]) -> str:
    shown = "; ".join(
        f"{run.end - run.row:,} epochs at {run.value:.10g}, HDOP {run.hdop_min:.3g}.."
        f"{run.hdop_max:.3g}, satellites {run.n_sv_min:.0f}..{run.n_sv_max:.0f}"
        for run in sorted(runs, key=lambda run: run.row - run.end)[:3]
    )
    return f"{counted(len(runs), 'run')}: {shown}"
