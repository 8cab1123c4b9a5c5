"""Combinations of sensor states: which are critical, how often and how fast."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from sbas.fusion.causal_analysis import CausalAnalysis
from sbas.fusion.states import U
from sbas.numerals import count, downward, number, upward
from sbas.plots import combination_picture, incidence_picture
from sbas.reporting.content import Cell, Section, Table, Tone, table
from sbas.reporting.drawn import drawn

SHOWN = 40
"""Combinations listed; critical ones are listed beside them."""

_TONES: dict[str, Tone] = {"critical": "bad", "always there": "bad", "not critical": "good",
                           "impossible": "good"}  # fmt: skip


def section(found: CausalAnalysis) -> Section:
    """The table, curves of incidence, and one run that went wrong."""
    run = int(np.argmax((found.runs.output_state == U).any(axis=0)))
    names = ", ".join(found.critical.names)
    return Section(
        "combinations",
        "Combinations and critical times",
        paragraphs=(
            f"A combination has a letter a sensor, in the order {names}: N nominal, D degraded "
            "but acceptable, U unacceptable, - no data. An episode is a stretch of one combination "
            "in one run; leaving it ends the risk, which is why the curves are of competing risks "
            "(Aalen-Johansen). Intervals draw whole runs again.",
        ),
        tables=(_table(found),),
        pictures=(
            drawn(
                "incidence", "How fast combinations spoil the output", incidence_picture.SHEET,
                lambda axes: incidence_picture.incidence_curve(found.critical, ax=axes[0]),
                "Cumulative incidence of the target state against time in a combination.",
                "Episodes that were in the target state at entry stand in the legend, not in the "
                "curve: no alert, however fast, comes before them.",
            ),
            drawn(
                "ribbon", f"States over run {run}", combination_picture.SHEET,
                lambda axes: combination_picture.combination_ribbon(found.runs, run, ax=axes[0]),
                "States of each sensor and of the output over one run.",
                "The first run whose output becomes unacceptable, or the first of all where none "
                "does. One run meets "
                f"{number(found.critical.visited_per_run, 3)} combinations on average: a table of "
                "one run is no census.",
                wide=True,
            ),
        ),
    )  # fmt: skip


def _table(found: CausalAnalysis) -> Table:
    critical = found.critical
    there = f"p_{critical.target.lower()}_at_entry"
    rows: list[tuple[Cell | str, ...]] = []
    ordered = critical.table.sort_values("epochs", ascending=False, kind="stable")
    # However rare, a critical combination is not left out.
    kept = (np.arange(len(ordered)) < SHOWN) | ordered["verdict"].eq("critical").to_numpy()
    for name, row in ordered[kept].iterrows():
        verdict = str(row["verdict"])
        rows.append(
            (
                str(name), Cell(verdict, _TONES.get(verdict, "")), count(int(row["epochs"])),
                count(int(row["episodes"])), _bounded(row, there), count(int(row["events"])),
                _bounded(row, "incidence"), _time(row["event_median_s"]),
                _time(row["reach_q05_s"]),
            )
        )  # fmt: skip
    rest = int((~kept).sum())
    target = critical.target
    return table(
        "Combinations that occurred, the most frequent first",
        f"Combination|Verdict|#Epochs|#Episodes|#{target} at entry|#Events|#Incidence|#Median "
        "time [s]|#5 % by [s]",
        rows,
        "Critical: at least 5 events and a lower bound of the incidence above 1 %. Median time: of "
        f"the event, given that it comes; 5 % by: when 5 % of all episodes are {target}, entry "
        "included, 0 where they begin so. A dash: not estimable, with fewer than 5 events.",
        *([f"{count(rest)} rarer combinations, none critical, are left out."] if rest else []),
    )


def _bounded(row: pd.Series, key: str) -> str:
    value, lower, upper = (float(row[name]) for name in (key, f"{key}_lower", f"{key}_upper"))
    if math.isnan(value):
        return "none"
    if math.isnan(lower):
        return number(value, 3)
    return f"{number(value, 3)} [{downward(lower, 2)}, {upward(upper, 2)}]"


def _time(seconds: float) -> str:
    if math.isnan(seconds):
        return "–"
    return "never" if math.isinf(seconds) else f"{seconds:.4g}"
