"""Which basic event matters: importance measures on a static fault tree."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import pandas as pd

from sbas.dependability.static.cut_sets import CutSets, cut_sets_of, is_coherent
from sbas.dependability.static.decision_diagram import TreeFunctions
from sbas.dependability.static.static_tree import StaticTree
from sbas.exceptions import ModelError


@dataclass(frozen=True)
class StaticImportance:
    """Importance of one basic event at the tree's probabilities.

    Parameters
    ----------
    event : basic event, with its `probability` p [1].
    birnbaum : P(TOP given e) - P(TOP given not e).
    criticality : p birnbaum/P(TOP).
    fussell_vesely : P(some minimal cut set with e holds)/P(TOP); None for a non-coherent tree.
        Programs that print 1 - P(TOP given not e)/P(TOP) by this name mean `criticality`.
    diagnostic : P(e and TOP)/P(TOP), the probability of e given the top.
    raw : P(TOP given e)/P(TOP), risk achievement worth.
    rrw : P(TOP)/P(TOP given not e), risk reduction worth; may be infinite.
    """

    event: str
    probability: float
    birnbaum: float
    criticality: float
    fussell_vesely: float | None
    diagnostic: float
    raw: float
    rrw: float


@dataclass(frozen=True)
class StaticImportances:
    """Importance of every basic event below the top, the largest criticality first."""

    top_probability: float
    events: tuple[StaticImportance, ...]

    def summary(self) -> pd.DataFrame:
        """A row for each basic event."""
        return pd.DataFrame([asdict(row) for row in self.events]).set_index("event")


def static_importance(tree: StaticTree) -> StaticImportances:
    """Birnbaum, criticality, Fussell-Vesely, diagnostic, RAW and RRW of every basic event.

    Parameters
    ----------
    tree : static fault tree; coherent or not.

    Returns
    -------
    StaticImportances: of each basic event below the top.

    Raises
    ------
    ModelError : a top of probability zero, or a tree too large.

    Notes
    -----
    With f1, f0 the top with e true and false: P(f1) - P(f0) is taken as P(f1 and not f0) -
    P(f0 and not f1), so that a small difference of two large figures keeps its digits.

    References
    ----------
    Birnbaum 1969; Fussell 1975; Open-PSA, importance factors; formulas as in
    Dutuit and Rauzy 2001, Efficient algorithms to assess importance.
    """
    functions = TreeFunctions(tree)
    cuts = cut_sets_of(functions, tree) if is_coherent(functions, tree) else None
    shares = None if cuts is None else _unions_with_each(functions, cuts)
    probabilities = tree.probabilities()
    roots = [functions.top]
    for i, name in enumerate(functions.order):
        on, off = functions.cofactors(name)
        union = functions.bdd.false if shares is None else shares[i]
        roots += [on, off, functions.both(on, ~off), functions.both(off, ~on), union]
    diagram = functions.diagram(roots)
    values = diagram.node_probabilities(probabilities)
    p_top, *rest = (float(values[root]) for root in diagram.roots)
    if p_top == 0:
        raise ModelError(
            "the top has probability zero: importance is a share of it",
            where=f"fault tree {tree.name!r}",
        )
    rows = []
    for i, name in enumerate(functions.order):
        p = probabilities[name]
        with_e, without_e, gained, lost, union = rest[5 * i : 5 * i + 5]
        birnbaum = gained - lost
        rows.append(
            StaticImportance(
                event=name,
                probability=p,
                birnbaum=birnbaum,
                criticality=p * birnbaum / p_top,
                fussell_vesely=None if shares is None else p * union / p_top,
                diagnostic=p * with_e / p_top,
                raw=with_e / p_top,
                rrw=p_top / without_e if without_e > 0 else math.inf,
            )
        )
    rows.sort(key=lambda row: -row.criticality)
    return StaticImportances(p_top, tuple(rows))


def _unions_with_each(functions: TreeFunctions, cuts: CutSets) -> list[Any]:
    """For each event, the union of the minimal cut sets that hold it, less that event."""
    used = cuts.used_nodes()
    variables = [functions.bdd.var(name) for name in cuts.order]
    false = functions.bdd.false
    whole = {0: false, 1: functions.bdd.true}
    for i in used:
        held = functions.both(variables[cuts.level[i]], whole[cuts.with_event[i]])
        whole[i] = functions.either(held, whole[cuts.without[i]])
    unions = []
    for event in range(len(cuts.order)):
        part: dict[int, Any] = {}
        for i in used:
            at, on, off = cuts.level[i], cuts.with_event[i], cuts.without[i]
            if at == event:
                part[i] = whole[on]
            elif at < event:
                held = functions.both(variables[at], part.get(on, false))
                part[i] = functions.either(held, part.get(off, false))
        unions.append(part.get(cuts.root, false))
    return unions
