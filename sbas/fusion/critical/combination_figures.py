"""Figures of one combination of sensor states from its episodes, with their intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sbas.fusion.critical.competing_risks import (
    event_time_quantile,
    incidence_of_counts,
    reach_time,
)
from sbas.fusion.critical.episodes import OUTPUTS, REACHED, Episodes
from sbas.fusion.critical.run_bootstrap import (
    ENOUGH_RUNS,
    FEW_RUNS,
    Counts,
    RunSums,
    percentile_bounds,
    share_bounds,
    sums_over_runs,
)
from sbas.fusion.states import DA, NO_DATA, N, U

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FEW_EVENTS: Final = 5
"""With fewer events no time is estimated."""
HORIZONS_S: Final = (1.0, 2.0, 5.0, 20.0)
LOW: Final = 0.05
_SHARES: Final = {N: "share_n", DA: "share_da", U: "share_u", NO_DATA: "share_no_data"}
_COUNTED, _THERE, _FIRST_TIME = 4, 5, 6
"""Places among the quantities added up over runs; the outputs' epochs come before."""


@dataclass(frozen=True, eq=False)
class IncidenceCurve:
    """Cumulative incidence of the target state in a combination, with bounds at 95 %.

    Parameters
    ----------
    time_s : (m,) time in the combination [s].
    incidence, lower, upper : (m,) probability that the event has come by then [1].
    at_entry : probability to be there at entry, which the curve leaves out [1].
    """

    time_s: Floats
    incidence: Floats
    lower: Floats
    upper: Floats
    at_entry: float


def figures_of(
    found: Episodes, of_it: Ints, weights: Counts
) -> tuple[dict[str, Any], IncidenceCurve | None]:
    """All figures of one combination.

    Parameters
    ----------
    found : episodes of all runs.
    of_it : indices of those of the combination, at least one.
    weights : result of `sbas.fusion.critical.run_bootstrap.drawn_runs`.

    Returns
    -------
    The row of the table of `critical_times` but its verdict, and the curve where there are at
    least 5 events.
    """
    at_risk = of_it[found.at_risk[of_it]]
    steps, place = np.unique(found.steps[at_risk], return_inverse=True)
    m, time_s = steps.size, np.asarray(steps * found.step_s, np.float64)
    sums = _sums(found, of_it, at_risk, place, m, weights)
    counts = sums.drawn[_FIRST_TIME:].reshape(3, m, weights.shape[1])
    incidence, free = incidence_of_counts(counts)
    events = [_FIRST_TIME + REACHED * m + i for i in range(m)]
    outcomes = list(range(_FIRST_TIME, _FIRST_TIME + 3 * m))

    outputs = list(range(len(OUTPUTS)))
    row: dict[str, Any] = {"epochs": int(sums.drawn[outputs, 0].sum())}
    for place_of, state in enumerate(OUTPUTS):
        row |= _share(_SHARES[state], sums, [place_of], outputs, few=ENOUGH_RUNS)
    row["episodes"] = int(sums.drawn[_COUNTED, 0])
    at_entry = f"p_{found.target.lower()}_at_entry"
    row |= _share(at_entry, sums, [_THERE], [_COUNTED], few=ENOUGH_RUNS)
    row["at_risk"], row["events"] = at_risk.size, int(sums.drawn[events, 0].sum())
    row |= _share("incidence", sums, events, outcomes)
    for horizon_s in HORIZONS_S:
        by_then = int(np.searchsorted(time_s, horizon_s * (1 + 1e-9)))
        reached = incidence[by_then - 1] if by_then else np.zeros(sums.drawn.shape[1])
        observed = at_risk.size and (by_then < m or free[-1, 0] < 1e-12 or horizon_s <= time_s[-1])
        key = f"f_{horizon_s:g}s"
        row |= _bounded(
            key,
            reached if observed and horizon_s >= found.step_s * (1 - 1e-9) else None,
            sums.part_and_whole(events[:by_then], outcomes),
        )
    row |= _times(found, sums, time_s, incidence, events)
    if row["events"] < FEW_EVENTS:
        return row, None
    lower, upper = percentile_bounds(incidence[:, 1:])
    return row, IncidenceCurve(time_s, incidence[:, 0], lower, upper, row[at_entry])


def _times(
    found: Episodes, sums: RunSums, time_s: Floats, incidence: Floats, events: list[int]
) -> dict[str, float]:
    """Times given the event, and the time by which 5 % of all episodes are there."""
    by_time = sums.drawn[events]
    total = by_time.sum(axis=0)
    estimable = bool(total[0] >= FEW_EVENTS)
    mean = np.divide(time_s @ by_time, total, out=np.full(total.shape, np.nan), where=total > 0)
    of_event = {
        "event_q05_s": event_time_quantile(time_s, by_time, LOW) if events else mean,
        "event_median_s": event_time_quantile(time_s, by_time, 0.5) if events else mean,
        "event_mean_s": mean,
    }
    runs_with_event = np.count_nonzero(sums.part_and_whole(events, [_COUNTED])[0])
    row: dict[str, float] = {}
    for key, replicates in of_event.items():
        few = ENOUGH_RUNS if key == "event_mean_s" else FEW_RUNS
        row |= _timed(key, replicates, value=estimable, bounds=bool(runs_with_event >= few))

    counted = sums.drawn[_COUNTED]
    at_entry = np.divide(
        sums.drawn[_THERE], counted, out=np.full(counted.shape, np.nan), where=counted > 0
    )
    there, whole = sums.part_and_whole([_THERE, *events], [_COUNTED])
    # That 5 % are never there is known only from enough episodes.
    known = there.sum() >= FEW_EVENTS or share_bounds(there, whole, at_entry[1:])[1] < LOW
    return row | _timed(
        "reach_q05_s", reach_time(time_s, incidence, at_entry, LOW),
        value=bool(known), bounds=bool(np.count_nonzero(there) >= FEW_RUNS),
    )  # fmt: skip


def _timed(key: str, replicates: Floats, *, value: bool, bounds: bool) -> dict[str, float]:
    lower, upper = percentile_bounds(replicates[1:]) if value and bounds else (np.nan, np.nan)
    return {
        key: float(replicates[0]) if value else np.nan,
        f"{key}_lower": float(lower),
        f"{key}_upper": float(upper),
    }


def _share(
    key: str, sums: RunSums, part: list[int], whole: list[int], *, few: int = FEW_RUNS
) -> dict[str, float]:
    """One sum over another, NaN where there is nothing to be a part of."""
    of, total = sums.drawn[part].sum(axis=0), sums.drawn[whole].sum(axis=0)
    share = np.divide(of, total, out=np.full(total.shape, np.nan), where=total > 0)
    return _bounded(key, share, sums.part_and_whole(part, whole), few=few)


def _bounded(
    key: str,
    replicates: Floats | None,
    part_and_whole: tuple[Ints, Ints],
    *,
    few: int = FEW_RUNS,
) -> dict[str, float]:
    if replicates is None:
        return dict.fromkeys((key, f"{key}_lower", f"{key}_upper"), np.nan)
    lower, upper = share_bounds(*part_and_whole, replicates[1:], few=few)
    value = float(replicates[0])
    # Exact bounds do not know of records that ended: the value may lie beyond them.
    return {key: value, f"{key}_lower": min(lower, value), f"{key}_upper": max(upper, value)}


def _sums(
    found: Episodes, of_it: Ints, at_risk: Ints, place: Ints, m: int, weights: Counts
) -> RunSums:
    """Epochs by output, episodes, those there at entry, and outcomes by time, of each run."""
    outputs, e = len(OUTPUTS), of_it.size
    quantity = [
        np.repeat(np.arange(outputs), e), np.full(e, _COUNTED), np.full(e, _THERE),
        _FIRST_TIME + found.outcome[at_risk].astype(np.int64) * m + place,
    ]  # fmt: skip
    value = [
        found.output_epochs[:, of_it].ravel(), found.counted[of_it], found.there_at_entry[of_it],
        np.ones(at_risk.size, np.int64),
    ]  # fmt: skip
    run = [*[found.run[of_it]] * (outputs + 2), found.run[at_risk]]
    return sums_over_runs(
        np.concatenate(quantity), np.concatenate(run), np.concatenate(value),
        quantities=_FIRST_TIME + 3 * m, weights=weights,
    )  # fmt: skip
