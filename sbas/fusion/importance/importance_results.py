"""Importance of the levels of sensors as a result: figures, text, tables, where laws differ."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import pandas as pd

from sbas.fusion.fused_runs import Floats
from sbas.fusion.importance.top_shares import Top
from sbas.numerals import downward, number, percent, upward

Law = Literal["independent", "joint", "simulated"]
LAWS: Final[tuple[Law, ...]] = ("independent", "joint", "simulated")
TOPS: Final[tuple[Top, ...]] = ("notN", "isU")
MEASURES: Final = ("birnbaum", "fussell_vesely", "raw", "rrw")

LEAST_RUNS = 20
"""An interval needs so many runs with, and without, the top at a level.

Resampled runs with correlated epochs covered the truth in 84 % of cases instead of 95 % with 5
such runs expected, in 91 % with 20 (choice of this package).
"""


@dataclass(frozen=True)
class Bounded:
    """A figure and its two-sided interval; NaN where not estimable, or where none is given."""

    value: float
    lower: float = math.nan
    upper: float = math.nan

    @property
    def bounded(self) -> bool:
        """Whether an interval is given."""
        return not (math.isnan(self.lower) or math.isnan(self.upper))

    def __str__(self) -> str:
        if math.isnan(self.value):
            return "not estimable"
        text = _number(self.value)
        if not self.bounded:
            return text
        return f"{text} [{_number(self.lower, downward)}, {_number(self.upper, upward)}]"


@dataclass(frozen=True)
class TopProbability:
    """Share of epochs with a top event under a law [1]."""

    law: Law
    top: Top
    probability: Bounded


@dataclass(frozen=True)
class LevelImportance:
    """Importance of one level of one sensor for one top under one law.

    Parameters
    ----------
    level : "DA" or "U".
    probability : of the level [1].
    given_level, given_nominal : share of the top at the level, and where the sensor is N [1].
    birnbaum, fussell_vesely, raw, rrw : see the module; `rrw` may be infinite.
    epochs, runs : in which the level was seen; None where no run was counted.
    note : why a figure, or its interval, is not given.
    """

    law: Law
    top: Top
    sensor: str
    level: str
    probability: float
    given_level: float
    given_nominal: float
    birnbaum: Bounded
    fussell_vesely: Bounded
    raw: Bounded
    rrw: Bounded
    epochs: int | None
    runs: int | None
    note: str


@dataclass(frozen=True)
class StateImportances:
    """Importance by sensor and level, of both tops, under the laws asked for.

    Parameters
    ----------
    tops : P(T) under each law.
    rows : by law, top, sensor, level.
    runs, epochs : counted; None without runs.
    epochs_left_out : with a sensor or the output without data: no combination of the table.
    agreement : share of the counted epochs in which table and output have the same state [1].
    confidence : of each interval, from resampled runs.
    warnings : where the laws differ.
    """

    tops: tuple[TopProbability, ...]
    rows: tuple[LevelImportance, ...]
    runs: int | None = None
    epochs: int | None = None
    epochs_left_out: int | None = None
    agreement: float | None = None
    confidence: float = 0.95
    warnings: tuple[str, ...] = ()

    def top(self, law: Law, top: Top) -> Bounded:
        """P(T) under a law [1]."""
        return next(t.probability for t in self.tops if (t.law, t.top) == (law, top))

    def of(self, law: Law, top: Top, sensor: str, level: str) -> LevelImportance:
        """The row of one level of one sensor."""
        key = (law, top, sensor, level)
        return next(r for r in self.rows if (r.law, r.top, r.sensor, r.level) == key)

    def summary(self) -> pd.DataFrame:
        """A row for each law, top, sensor and level; NaN where not estimable."""
        frame = pd.DataFrame([_flat(row) for row in self.rows])
        frame = frame.astype({"epochs": "Int64", "runs": "Int64"})
        return frame.set_index(["law", "top", "sensor", "level"])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; what is not estimable, or infinite, is None."""
        tops = [
            {"law": t.law, "top": t.top, **_bounds("probability", t.probability)}
            for t in self.tops
        ]  # fmt: skip
        return {
            "tops": [_finite(top) for top in tops],
            "rows": [_finite(_flat(row)) for row in self.rows],
            "runs": self.runs,
            "epochs": self.epochs,
            "epochs_left_out": self.epochs_left_out,
            "agreement": self.agreement,
            "confidence": self.confidence,
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        lines = []
        if self.runs is not None:
            left = f", {self.epochs_left_out} without data left out" if self.epochs_left_out else ""
            lines.append(f"{self.epochs} epochs in {self.runs} runs{left}")
            if self.agreement is not None:
                lines.append(f"table and output agree in {100 * self.agreement:.1f} % of epochs")
            lines.append(f"intervals at {percent(self.confidence)}, by resampling runs")
        for t in self.tops:
            lines.append(f"P({t.top}), {t.law}: {t.probability}")
            for row in self.rows:
                if (row.law, row.top) == (t.law, t.top):
                    note = f" ({row.note})" if row.note else ""
                    lines.append(f"  Birnbaum {row.sensor} {row.level}: {row.birnbaum}{note}")
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])


# --- where the laws differ --------------------------------------------------------------------


def law_differences(result: StateImportances, table_gaps: Mapping[Top, Floats]) -> Iterator[str]:
    """Sentences where one law says another thing than the next, beyond the intervals.

    Parameters
    ----------
    result : of all three laws.
    table_gaps : (2,) bounds of P(T) simulated less P(T) of the table, by top.
    """
    for top in TOPS:
        alone, joint, simulated = (result.top(law, top) for law in LAWS)
        if joint.bounded and not joint.lower <= alone.value <= joint.upper:
            yield (
                f"P({top}) is {_number(alone.value)} with independent sensors, {joint} with their "
                "states as they came together: they are not independent"
            )
        if not (joint.bounded or simulated.bounded):
            yield f"fewer than {LEAST_RUNS} runs with, or without, {top}: laws cannot be compared"
            continue
        lower, upper = table_gaps[top]
        if lower > 0.0 or upper < 0.0:
            word = "understates" if lower > 0.0 else "overstates"
            yield (
                f"P({top}) is {joint} by the table, {simulated} simulated: the table {word} it"
                f"{_factor(joint.value, simulated.value)}"
            )
        for law in ("joint", "simulated"):
            yield from _other_figures(result, top, law)
        for level in ("DA", "U"):
            yield from _other_first(result, top, level)


def _factor(table: float, simulated: float) -> str:
    small, large = sorted((table, simulated))
    return f" by a factor of {number(large / small, 2)}" if small > 0.0 else ""


def _other_figures(result: StateImportances, top: Top, law: Law) -> Iterator[str]:
    """Levels whose Birnbaum figure of independence lies outside the interval of the law."""
    outside = []
    for row in result.rows:
        if (row.law, row.top) == (law, top) and row.birnbaum.bounded:
            alone = result.of("independent", top, row.sensor, row.level).birnbaum.value
            if not row.birnbaum.lower <= alone <= row.birnbaum.upper:
                outside.append(f"{row.sensor} {row.level}")
    if outside:
        yield (
            f"Birnbaum for {top}, {law}: the figure with independent sensors lies outside the "
            f"interval for {', '.join(outside)}"
        )


def _other_first(result: StateImportances, top: Top, level: str) -> Iterator[str]:
    """Says so if simulation puts another sensor first than independence does, surely."""
    first: dict[str, LevelImportance] = {}
    for law in LAWS:
        rows = [r for r in result.rows if (r.law, r.top, r.level) == (law, top, level)]
        known = [r for r in rows if not math.isnan(r.birnbaum.value)]
        if known:
            first[law] = max(known, key=lambda r: r.birnbaum.value)
    if {"independent", "simulated"} - set(first):
        return
    alone, simulated = first["independent"].sensor, first["simulated"]
    other = result.of("simulated", top, alone, level).birnbaum
    if simulated.sensor != alone and simulated.birnbaum.lower > other.upper:
        yield (
            f"Birnbaum of {level} for {top}: {alone} comes first with independent sensors, "
            f"{simulated.sensor} in the simulation"
        )


# --- text and tables --------------------------------------------------------------------------


def _number(value: float, rounded: Callable[[float, int], str] = number) -> str:
    return "infinite" if math.isinf(value) else rounded(value, 3)


def _bounds(name: str, figure: Bounded) -> dict[str, float]:
    return {name: figure.value, f"{name}_lower": figure.lower, f"{name}_upper": figure.upper}


def _flat(row: LevelImportance) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in vars(row).items():
        flat |= _bounds(name, value) if isinstance(value, Bounded) else {name: value}
    return flat


def _finite(row: dict[str, Any]) -> dict[str, Any]:
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in row.items()}
