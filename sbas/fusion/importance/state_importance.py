"""Which sensor's degraded or unacceptable state matters to the output, under three laws.

Importance is of a truth table's top event: `notN`, the output is not nominal, or `isU`, it is
unacceptable. The laws: "independent", the table with independent sensors; "joint", the table
with the states as they came together; "simulated", the simulated output with the same states.
Under the first the Birnbaum figure is a derivative of the top's probability; under the others
all figures are associations: sensors share causes, and what is seen with a state is not what
the state does.

With x the states, s = DA or U, T the top and p = P(x_i = s):

- Birnbaum: P(T | x_i = s) - P(T | x_i = N);
- risk achievement worth: P(T | x_i = s)/P(T);
- risk reduction worth: P(T)/P', where P' counts the epochs of level s as if their share of the
  top were that of N: (P(x_i = N) + p) P(T | x_i = N) + P(x_i = s') P(T | x_i = s'), s' the third;
- Fussell-Vesely: P(T, and some minimal cut vector of the table with level s of sensor i holds)
  over P(T); not defined for a table in which a worse sensor can better the output.

References
----------
Birnbaum 1969 and Fussell 1975, with the levels of multi-state systems as in Natvig 1982.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sbas.exceptions import InputError
from sbas.fusion.critical.run_bootstrap import resampled
from sbas.fusion.fused_runs import Bools, Floats, FusedRuns, States
from sbas.fusion.importance.importance_results import (
    LAWS,
    LEAST_RUNS,
    MEASURES,
    TOPS,
    Bounded,
    Law,
    LevelImportance,
    StateImportances,
    TopProbability,
    law_differences,
)
from sbas.fusion.importance.top_shares import (
    RunCounts,
    Top,
    TopShares,
    checked_marginals,
    cut_levels,
    fixed_by_table,
    independent_shares,
    marked,
    run_counts,
)
from sbas.fusion.logic.boolean_form import WORST_FROM
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.states import DA, NO_DATA, WORDS, N, U, combination_codes

_LEAST_REPLICATES = 100
_BLOCK_CELLS = 1 << 22
"""Of the counts of drawn runs that become numbers of 8 bytes at a time."""


# --- questions --------------------------------------------------------------------------------


def independent_importance(table: TruthTable, marginals: Floats) -> StateImportances:
    """Importance of each level of each sensor when the sensors are independent; exact.

    Parameters
    ----------
    table : truth table of n sensors.
    marginals : (n, 3) probabilities of N, DA and U of each sensor [1].

    Returns
    -------
    StateImportances of the law "independent". DA and U of a sensor exclude each other.

    Raises
    ------
    InputError : marginals of another shape, negative, or not adding up to 1.

    References
    ----------
    Page causal-analysis, section 8: P(isU) = prod u_i and P(notN) = 1 - prod(1 - u_i) + prod d_i
    for the table of Figure 9 and its kin; here by summing the combinations of any table.
    """
    array = checked_marginals(marginals, tuple(table.names))
    tops, rows = [], []
    for top in TOPS:
        shares = independent_shares(marked(table, top), array)
        tops.append(TopProbability("independent", top, Bounded(float(shares.top))))
        rows += _rows("independent", top, table.names, shares, None)
    return StateImportances(tuple(tops), tuple(rows))


def importance_by_state(
    table: TruthTable,
    runs: FusedRuns,
    *,
    replicates: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> StateImportances:
    """Importance of each level of each sensor under all three laws, from runs.

    Parameters
    ----------
    table : of the sensors of the runs, in their order.
    runs : states of sensors and output; epochs with no data are left out and counted.
    replicates : of the cluster bootstrap, which draws whole runs.
    confidence : of the intervals, in (0, 1).
    seed : of the bootstrap.

    Returns
    -------
    StateImportances. A level that was never seen has no figure under the laws "joint" and
    "simulated"; an interval is given where `LEAST_RUNS` runs have the top at the level, and as
    many lack it, or where the table alone fixes the share.

    Raises
    ------
    InputError : other sensors than the table's, no epoch with all states, or an option out of
        range.
    """
    _check(table, runs, replicates, confidence)
    codes = combination_codes(runs.sensor_state)
    known: Bools = (codes >= 0) & (runs.output_state > NO_DATA)
    codes = np.where(known, codes, 0)
    epochs = int(known.sum())
    if epochs == 0:
        raise InputError("no epoch has a state of every sensor and of the output", where="runs")
    by_table = np.asarray(table.outcomes)[codes]
    outputs: dict[Law, States] = {"joint": by_table, "simulated": runs.output_state}
    tables = {top: marked(table, top) for top in TOPS}
    counted = {
        (law, top): run_counts(
            tables[top], output >= WORST_FROM[top], runs.sensor_state, codes, known
        )
        for law, output in outputs.items()
        for top in TOPS
    }
    bounds = _bootstrap(counted, replicates, seed, confidence)
    marginals = counted["joint", "isU"].level.sum(axis=0) / epochs
    tops, rows = [], []
    for law, top in itertools.product(LAWS, TOPS):
        if law == "independent":
            shares, seen = independent_shares(tables[top], marginals), None
        else:
            counts = counted[law, top]
            shares = counts.shares(np.ones((1, runs.runs))).first()
            seen = _Seen(counts, tables[top], bounds[law, top], by_table=law == "joint")
        tops.append(TopProbability(law, top, _top(shares, seen)))
        rows += _rows(law, top, table.names, shares, seen)
    result = StateImportances(
        tuple(tops), tuple(rows), runs.runs, epochs, known.size - epochs,
        float((by_table == runs.output_state)[known].mean()), confidence,
    )  # fmt: skip
    gaps = {top: bounds["simulated", top]["table gap"] for top in TOPS}
    return replace(result, warnings=tuple(law_differences(result, gaps)))


# --- figures and what they rest on ------------------------------------------------------------


def _measures(shares: TopShares) -> dict[str, Floats]:
    """(..., n, 2) of each measure, as the module defines them."""
    top = np.asarray(shares.top)[..., None, None]
    level, given = shares.level, shares.given
    with np.errstate(divide="ignore", invalid="ignore"):
        of_top = np.where(level > 0.0, level * given, 0.0)
        reduced = (level[..., :1] + level[..., 1:]) * given[..., :1] + of_top[..., :0:-1]
        return {
            "birnbaum": shares.change,
            "fussell_vesely": shares.by_cut / top,
            "raw": given[..., 1:] / top,
            "rrw": top / reduced,
        }


def _bootstrap(
    counted: Mapping[tuple[Law, Top], RunCounts], replicates: int, seed: int, confidence: float
) -> dict[tuple[Law, Top], dict[str, Floats]]:
    """(2, ...) bounds of every measure, of P(T) and of its difference to the table's."""
    found: dict[tuple[Law, Top], dict[str, list[Floats]]] = {key: {} for key in counted}
    runs = len(next(iter(counted.values())).epochs)
    drawn_runs = resampled(runs, replicates, np.random.default_rng(seed))
    block = max(1, _BLOCK_CELLS // runs)
    for first in range(0, replicates, block):
        weights = drawn_runs[first : first + block].astype(float)
        shares = {key: counts.shares(weights) for key, counts in counted.items()}
        for (law, top), drawn in shares.items():
            gap = drawn.top - shares["joint", top].top
            figures = {**_measures(drawn), "top": drawn.top, "table gap": gap}
            for name, values in figures.items():
                found[law, top].setdefault(name, []).append(values)
    return {
        key: {name: _interval(np.concatenate(parts), confidence) for name, parts in lists.items()}
        for key, lists in found.items()
    }


def _interval(replicated: Floats, confidence: float) -> Floats:
    """(2, ...) quantiles along the first axis, outward to a replicate, those not NaN."""
    ordered = np.sort(replicated, axis=0)
    there = (~np.isnan(ordered)).sum(axis=0)
    tail = (1.0 - confidence) / 2.0
    low = np.floor(tail * (there - 1)).astype(int)
    high = np.ceil((1.0 - tail) * (there - 1)).astype(int)
    ends = [np.take_along_axis(ordered, at.clip(0)[None], axis=0)[0] for at in (low, high)]
    return np.stack(ends)


class _Seen:
    """Bounds of the figures of a law and top from runs, NaN where too few runs carry them."""

    def __init__(
        self, counts: RunCounts, table: Bools, bounds: dict[str, Floats], *, by_table: bool
    ) -> None:
        n = table.ndim
        self.epochs = counts.level.sum(axis=0).astype(int)
        self.runs = (counts.level > 0).sum(axis=0)
        fixed = fixed_by_table(table) if by_table else np.zeros((n, 3), bool)
        share = fixed | _enough(counts.both, counts.level)
        often = self.runs >= LEAST_RUNS
        cuts = cut_levels(table)
        cut = _enough(counts.by_cut, counts.top[:, None, None])
        if cuts is not None:
            flat = cuts.reshape(n, 2, -1)
            cut |= ~flat.any(axis=2)
            if by_table:
                cut |= (flat == table.ravel()).all(axis=2)
        top = bool(_enough(counts.top, counts.epochs))
        self.top = bounds["top"] if top else np.full(2, np.nan)
        carried = {
            "birnbaum": share[:, 1:] & share[:, :1],
            "fussell_vesely": cut & top,
            "raw": share[:, 1:] & top,
            "rrw": (share & often).all(axis=1)[:, None] & np.array([top, top]),
        }
        self.bounds = {m: np.where(carried[m], bounds[m], np.nan) for m in MEASURES}


def _enough(some: Floats, all_: Floats) -> Bools:
    """(...) whether enough runs have epochs of the kind, and enough have others."""
    have, lack = (some > 0).sum(axis=0), (all_ - some > 0).sum(axis=0)
    return np.asarray(np.minimum(have, lack) >= LEAST_RUNS)


def _top(shares: TopShares, seen: _Seen | None) -> Bounded:
    return Bounded(float(shares.top), *(() if seen is None else map(float, seen.top)))


def _rows(
    law: Law, top: Top, names: Sequence[str], shares: TopShares, seen: _Seen | None
) -> list[LevelImportance]:
    measures = _measures(shares)
    rows = []
    for sensor, level in itertools.product(range(len(names)), (DA, U)):
        at = sensor, level - 1
        figures = {}
        for name, values in measures.items():
            ends = () if seen is None else map(float, seen.bounds[name][:, *at])
            figures[name] = Bounded(float(values[at]), *ends)
        row = LevelImportance(
            law=law, top=top, sensor=names[sensor], level=WORDS[level],
            probability=float(shares.level[sensor, level]),
            given_level=float(shares.given[sensor, level]),
            given_nominal=float(shares.given[sensor, N]),
            **figures,
            epochs=None if seen is None else int(seen.epochs[sensor, level]),
            runs=None if seen is None else int(seen.runs[sensor, level]),
            note=_note(figures, shares, sensor, level, counted=seen is not None),
        )  # fmt: skip
        rows.append(row)
    return rows


def _note(
    figures: Mapping[str, Bounded], shares: TopShares, sensor: int, level: int, *, counted: bool
) -> str:
    said = []
    for state in (level, N):
        if math.isnan(shares.given[sensor, state]):
            said.append(f"{WORDS[state]} never seen")
    if shares.top == 0.0:
        said.append("the top never happens")
    elif math.isnan(figures["fussell_vesely"].value):
        said.append("no minimal cuts: a worse sensor can better the table's output")
    bare = [m for m, f in figures.items() if not math.isnan(f.value) and math.isnan(f.lower)]
    if counted and bare:
        said.append(
            f"no interval of {', '.join(bare)}: fewer than {LEAST_RUNS} runs with, or without"
        )
    return "; ".join(said)


# --- what is asked ---------------------------------------------------------------------------


def _check(table: TruthTable, runs: FusedRuns, replicates: int, confidence: float) -> None:
    if tuple(table.names) != tuple(runs.names):
        raise InputError(
            "the table is of other sensors than the runs, or in another order",
            where="table", evidence=f"{', '.join(table.names)} and {', '.join(runs.names)}",
            cure="a table whose names are those of the runs, in their order",
        )  # fmt: skip
    if not 0.0 < confidence < 1.0:
        raise InputError(
            "a confidence lies in (0, 1)", where="confidence", evidence=str(confidence)
        )
    if replicates < _LEAST_REPLICATES:
        raise InputError(
            f"an interval needs {_LEAST_REPLICATES} replicates or more",
            where="replicates", evidence=str(replicates), cure="replicates=1000",
        )  # fmt: skip
