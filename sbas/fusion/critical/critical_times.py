"""Which combinations of sensor states are critical, and how long they may last.

Every figure comes with an interval that draws whole runs again. Of simulated runs all of them
are of the evidence class `modelled`: they say what the error models imply, not what was seen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.fusion.architecture.model import Architecture
from sbas.fusion.critical.combination_figures import FEW_EVENTS, IncidenceCurve, figures_of
from sbas.fusion.critical.episodes import (
    OUTPUTS,
    Episodes,
    Target,
    extract_episodes,
    states_of_key,
)
from sbas.fusion.critical.run_bootstrap import drawn_runs
from sbas.fusion.fused_runs import States
from sbas.fusion.states import NO_DATA, U, combination_name

Ints = NDArray[np.int64]

CRITICAL_INCIDENCE: Final = 0.01
"""A combination is critical where the lower bound of its incidence is above this."""
_TIMES: Final = ("event_q05_s", "event_median_s", "event_mean_s", "reach_q05_s")


@dataclass(frozen=True, eq=False)
class CriticalTimes:
    """Figures of all combinations that occurred.

    Parameters
    ----------
    names : (n,) sensors, in the order of the letters of a combination.
    step_s : between epochs [s]; no time below it can be told.
    runs, epochs : size of the record.
    target : state of the output whose reaching is the event, "U" or "DA".
    replicates, seed : of the intervals.
    table : a row a combination, N, D for DA, U and "-" for no data; see `critical_times`.
    curves : cumulative incidence of the combinations with at least 5 events.
    visited_per_run : combinations that one run meets, on average.
    findings : what the reader of the figures must know.
    """

    names: tuple[str, ...]
    step_s: float
    runs: int
    epochs: int
    target: Target
    replicates: int
    seed: int
    table: pd.DataFrame
    curves: Mapping[str, IncidenceCurve]
    visited_per_run: float
    findings: tuple[Finding, ...]

    @property
    def critical(self) -> tuple[str, ...]:
        """Combinations that are critical."""
        return tuple(self.table.index[self.table["verdict"] == "critical"])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; what is not estimable is None, and so is `reach_q05_s` where it
        is never reached: `reach_q05_never` says so."""
        rows = [
            {
                "combination": name,
                **{key: _plain(value) for key, value in row.items()},
                "reach_q05_never": math.isinf(row["reach_q05_s"]),
            }
            for name, row in self.table.to_dict(orient="index").items()
        ]
        return {
            "sensors": list(self.names),
            "step_s": self.step_s,
            "runs": self.runs,
            "epochs": self.epochs,
            "target": self.target,
            "evidence": "modelled",
            "confidence": 0.95,
            "replicates": self.replicates,
            "seed": self.seed,
            "combinations_possible": 3 ** len(self.names),
            "visited_per_run": self.visited_per_run,
            "combinations": rows,
            "critical": list(self.critical),
            "critical_time_s": {
                row["combination"]: {
                    key: row[key] for t in _TIMES for key in (t, f"{t}_lower", f"{t}_upper")
                }
                for row in rows
                if row["verdict"] == "critical"
            },
            "findings": [finding.to_dict() for finding in self.findings],
        }


def critical_times(
    sensor_state: States,
    output_state: States,
    *,
    names: Sequence[str],
    step_s: float,
    target: Target = "U",
    starts_fresh: bool = True,
    convex: bool = False,
    replicates: int = 1000,
    seed: int = 0,
) -> CriticalTimes:
    """How often, and how fast, does each combination of sensor states spoil the output?

    Parameters
    ----------
    sensor_state : (n, t, r) codes of `sbas.fusion.states` of n sensors at t epochs in r runs.
    output_state : (t, r) codes of the fused position.
    names : (n,) of the sensors.
    step_s : between epochs [s].
    target : state of the output whose reaching is the event: "U", or "DA" for DA and worse.
    starts_fresh : False for recordings, whose first episode has an entry that was not seen.
    convex : the fusion is one for which `convexity_holds`; checked in every epoch.
    replicates : samples of runs drawn for the intervals.
    seed : of these draws.

    Returns
    -------
    CriticalTimes. Its table has for each combination the columns, each share and time with
    `_lower` and `_upper` at 95 %:

    - `epochs`, `share_n`, `share_da`, `share_u`, `share_no_data`: output while it lasts;
    - `episodes` whose entry was seen with an output; `p_u_at_entry` (`p_da_at_entry`): share of
      them whose output is in the target state at once;
    - `at_risk`: the others; `events` of them; `incidence`, events over at risk as counted;
    - `f_1s`, `f_2s`, `f_5s`, `f_20s`: probability that the event has come by then, for those at
      risk; NaN where a step is longer, or nothing was observed for so long;
    - `event_q05_s`, `event_median_s`, `event_mean_s`: time of the event given that it comes; NaN
      (not estimable) with fewer than 5 events;
    - `reach_q05_s`: time by which 5 % of all episodes are in the target state, entry included:
      the safe figure; infinite where that is never reached;
    - `verdict`: "critical" with at least 5 events and a lower bound of the incidence above 1 %;
      "not critical" with an upper bound of at most 1 %; "impossible" where a weighted mean
      cannot get there; "always there" where the output was never better; else "undecided".

    Raises
    ------
    InputError : arrays that do not fit together; with `convex`, an unacceptable output while
        all sensors are acceptable.

    Notes
    -----
    All times have the resolution of a step at both ends.

    References
    ----------
    Railways 2014, section 3.1, step 5, and section 3.3. The limits of "critical" are this
    package's; the paper gives none.
    """
    if len(names) != len(sensor_state):
        raise InputError(
            f"{len(names)} names of {len(sensor_state)} sensors", where="names, sensor_state"
        )
    found = extract_episodes(
        sensor_state, output_state, step_s=step_s, target=target, starts_fresh=starts_fresh
    )
    order = np.argsort(found.key, kind="stable")
    keys, begins = np.unique(found.key[order], return_index=True)
    members = zip(keys.tolist(), np.split(order, begins[1:]), strict=True)
    groups = [(states_of_key(key, found.sensors), of_it) for key, of_it in members]
    groups.sort(key=lambda group: (NO_DATA in group[0], group[0]))
    weights = drawn_runs(found.runs, replicates=replicates, seed=seed)
    rows: dict[str, dict[str, Any]] = {}
    curves: dict[str, IncidenceCurve] = {}
    visits = 0
    for states, of_it in groups:
        name = combination_name(states)
        if convex:
            _refuse_impossible(name, states, found, of_it)
        figures, curve = figures_of(found, of_it, weights)
        impossible = convex and target == "U" and not {U, NO_DATA} & set(states)
        rows[name] = {**figures, "verdict": _verdict(figures, target, impossible=impossible)}
        if curve is not None:
            curves[name] = curve
        visits += np.unique(found.run[of_it]).size
    table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("combination")
    return CriticalTimes(
        names=tuple(names), step_s=step_s, runs=found.runs, epochs=found.epochs, target=target,
        replicates=replicates, seed=seed, table=table, curves=MappingProxyType(curves),
        visited_per_run=visits / found.runs, findings=_step_findings(table, step_s),
    )  # fmt: skip


def convexity_holds(architecture: Architecture) -> bool:
    """Can the output of this architecture not be unacceptable while all sensors are acceptable?

    Notes
    -----
    With weights of 0 or more that add up to 1, an error is at most the largest of those it is
    made of: errors below the alert limit give one below it. So it is with a weighted mean, on
    each axis, and with the worst of the axes; not with their norm, nor with a Kalman filter. A
    hysteresis or dwell time holds states of output and sensors back by different times.
    """
    limits = architecture.thresholds
    return (
        (architecture.operator == "weighted_mean"
         or (architecture.operator == "per_axis" and architecture.axis_rule == "worst_axis"))
        and limits.hysteresis_m == 0
        and limits.min_dwell_s == 0
    )  # fmt: skip


def overlap_probability(*, found: int, critical: int, rows: int, combinations: int) -> float:
    """Probability that so many rows of a published table are critical by chance alone.

    Parameters
    ----------
    found : rows of the table that the simulation calls critical.
    critical : combinations that it calls critical in all.
    rows : rows of the table.
    combinations : that there are, 3^n of n sensors.

    Returns
    -------
    P(hits >= found), where `rows` different combinations are picked blindly.

    Raises
    ------
    InputError : more rows or critical combinations than there are combinations.

    References
    ----------
    Hypergeometric law, summed in whole numbers.
    """
    if not (0 <= rows <= combinations and 0 <= critical <= combinations):
        raise InputError(
            "more rows or critical combinations than there are combinations",
            evidence=f"{rows} rows, {critical} critical, {combinations} combinations",
        )
    hits = range(max(found, 0), min(rows, critical) + 1)
    ways = sum(math.comb(critical, k) * math.comb(combinations - critical, rows - k) for k in hits)
    return ways / math.comb(combinations, rows)


# --- what the figures say ---------------------------------------------------------------------


def _verdict(figures: Mapping[str, Any], target: Target, *, impossible: bool) -> str:
    better = ("share_n",) if target == "DA" else ("share_n", "share_da")
    if impossible:
        return "impossible"
    if figures["events"] >= FEW_EVENTS and figures["incidence_lower"] > CRITICAL_INCIDENCE:
        return "critical"
    if figures["at_risk"] and figures["incidence_upper"] <= CRITICAL_INCIDENCE:
        return "not critical"
    if all(figures[share] == 0 for share in (*better, "share_no_data")):
        return "always there"
    return "undecided"


def _refuse_impossible(name: str, states: Sequence[int], found: Episodes, of_it: Ints) -> None:
    if {U, NO_DATA} & set(states):
        return
    worst = found.output_epochs[OUTPUTS.index(U), of_it]
    if not worst.any():
        return
    first = int(of_it[np.argmax(worst > 0)])
    raise InputError(
        "a weighted mean of acceptable positions is unacceptable, which cannot be",
        where=f"combination {name}, run {found.run[first]}, from epoch {found.entry_epoch[first]}",
        evidence=f"{int(worst.sum())} epochs",
        cure="give the states of the values that were fused, by the thresholds of the output",
    )


def _step_findings(table: pd.DataFrame, step_s: float) -> tuple[Finding, ...]:
    critical = table[table["verdict"] == "critical"]
    # Equal within rounding: the times are whole numbers of steps.
    half, low = (
        critical.index[critical[time] <= step_s * (1 + 1e-9)]
        for time in ("event_median_s", "event_q05_s")
    )
    if not low.size:
        return ()
    texts = [f"5 % of the events have come within one step: {', '.join(low)}"]
    if half.size:
        texts.append(f"half of them or more: {', '.join(half)}")
    return (
        Finding(
            "E28",
            "warning",
            f"the step of {step_s:g} s is not shorter than the critical times found",
            where="step_s",
            evidence="; ".join(texts),
            cure="a shorter step: these times are upper bounds, and part of what is there at entry "
            "would come after it",
        ),
    )


def _plain(value: Any) -> Any:
    if isinstance(value, str):
        return value
    number = float(value)
    if not math.isfinite(number):
        return None
    return int(value) if isinstance(value, (int, np.integer)) else number
