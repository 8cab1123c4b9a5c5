"""Which event or component matters: importance measures, in static and in dynamic trees."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
import pandas as pd

from sbas.dependability.analysis.asked_measure import measured, part_below, with_house
from sbas.dependability.exact.exact import solve
from sbas.dependability.exact.plan import Tree, tree_of
from sbas.dependability.exact.transitions import Floats
from sbas.dependability.exact.within_epoch import instants
from sbas.dependability.static.cut_sets import cut_sets_of, is_coherent
from sbas.dependability.static.decision_diagram import TreeFunctions
from sbas.dependability.static.static_tree import (
    StaticGate,
    StaticTree,
    failed_probability,
    not_static,
    static_tree_of,
    top_probability,
)
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Event,
    Failed,
    House,
    HybridFaultTree,
    Not,
    Or,
    Undeveloped,
)
from sbas.exceptions import InputError, ModelError

ImportanceMeasure = Literal["mean", "at_end"]

_RESOLUTION = 1e-10
"""Relative difference of two figures below which rounding of either (1e-12) shows."""
_MOST_CUT_SETS = 10_000


@dataclass(frozen=True)
class Importance:
    """Importance of one basic event or component; P is the chosen measure of the top.

    Parameters
    ----------
    name : of the event or component.
    kind : an "event" is forced where gates read it; a "component" is failed, or works,
        throughout, with all its events and the sources that it guards.
    probability : the same measure of the event itself, p [1].
    given_true, given_false : P with it forced true, forced false, at all epochs [1].
    birnbaum : given_true - given_false; None where the two agree to ten digits: what is left is
        rounding.
    criticality : p birnbaum/P; None with `birnbaum`.
    diagnostic : P(it and the top)/P; None where the joint chain is too large.
    raw : given_true/P, risk achievement worth.
    rrw : P/given_false, risk reduction worth; may be infinite.
    fussell_vesely : P(some minimal cut set with it holds)/P; None for a component, and for a
        tree with memory, sources or non-coherent gates.
    """

    name: str
    kind: Literal["event", "component"]
    probability: float
    given_true: float
    given_false: float
    birnbaum: float | None
    criticality: float | None
    diagnostic: float | None
    raw: float
    rrw: float
    fussell_vesely: float | None


@dataclass(frozen=True)
class Importances:
    """Importance of every basic event and component below an event or gate.

    Parameters
    ----------
    of : the event or gate.
    measure : what P is.
    probability : P [1].
    rows : events and components, the largest criticality first in each kind.
    """

    of: str
    measure: ImportanceMeasure
    probability: float
    rows: tuple[Importance, ...]

    def __getitem__(self, name: str) -> Importance:
        return next(row for row in self.rows if row.name == name)

    def summary(self) -> pd.DataFrame:
        """A row for each event and component."""
        columns = list(Importance.__dataclass_fields__)
        frame = pd.DataFrame([asdict(row) for row in self.rows], columns=columns)
        return frame.set_index("name")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; an infinite risk reduction worth is None."""
        rows = [asdict(row) for row in self.rows]
        return {
            "of": self.of,
            "measure": self.measure,
            "probability": self.probability,
            "rows": [r | {"rrw": r["rrw"] if math.isfinite(r["rrw"]) else None} for r in rows],
        }


def importance(
    model: HybridFaultTree, *, measure: ImportanceMeasure = "mean", of: str | None = None
) -> Importances:
    """Birnbaum, criticality, diagnostic, RAW, RRW and Fussell-Vesely of events and components.

    Parameters
    ----------
    model : any gates.
    measure : P is the mean unavailability ("mean") or the probability at the end ("at_end").
    of : event or gate; None is the top.

    Returns
    -------
    Importances.

    Raises
    ------
    ModelError : P is zero, importance is a share of it.
    InputError : unknown name or measure; a chain too large.

    Notes
    -----
    An event is forced for all epochs: P(TOP|e) is no conditional probability where e has memory
    above it or shares its component or source with other events; and the order that a PAND asks
    for is hidden: `sensitivities` tells what forcing cannot. Criticality is then no share and
    may exceed 1 (a signal that is wrong throughout is another thing than one wrong now and then).
    With "mean" it is the product of two means over a mean; 1 - 1/rrw is the share of P that goes
    with e, epoch by epoch. At the end, of a static tree, the two are the same.

    References
    ----------
    Birnbaum 1969; Fussell 1975; Dutuit and Rauzy 2001. The dynamic reading: page
    dependability, section 8.
    """
    if measure not in ("mean", "at_end"):
        raise InputError(
            "importance is of a mean or of the end", where="measure", evidence=repr(measure),
            cure='measure="mean" or measure="at_end"',
        )  # fmt: skip
    part = part_below(model, of)
    p_top = measured(part, [part.top], measure)[part.top]
    if p_top == 0.0:
        raise ModelError(
            "the top has probability zero: importance is a share of it",
            where=f"{measure} of {part.top}",
        )
    tree = tree_of(part)
    shares = _fussell_vesely(part, measure)
    rows = [
        _row(part, tree, event, measure, p_top, shares.get(event.name))
        for event in part.events
        if not isinstance(event, House)
    ]
    rows += [
        _component_row(part, component, measure, p_top)
        for component in part.components
        if component.name in tree.supports[part.top]
    ]
    rows.sort(key=lambda row: (row.kind == "component", -(row.criticality or 0.0)))
    return Importances(part.top, measure, p_top, tuple(rows))


def _row(
    part: HybridFaultTree,
    tree: Tree,
    event: Event,
    measure: ImportanceMeasure,
    p_top: float,
    share: float | None,
) -> Importance:
    on = with_house(part, event.name, True)
    off = with_house(part, event.name, False)
    if _acts_alone(part, tree, event.name) and part.options.mean_rule != "integral":
        itself, given = (
            solve(m, names=[n], curve=True).curves[n]
            for m, n in ((replace(part, top=event.name), event.name), (on, part.top))
        )
        both: float | None = float(_weights(part, measure) @ (itself * given))
    else:
        both = _joint(part, event.name, measure)
    return _measures(
        event.name,
        "event",
        measured(part, [event.name], measure)[event.name],
        measured(on, [part.top], measure)[part.top],
        measured(off, [part.top], measure)[part.top],
        both,
        p_top,
        None if share is None else share / p_top,
    )


def _component_row(
    part: HybridFaultTree, component: Component, measure: ImportanceMeasure, p_top: float
) -> Importance:
    event = _free_name(part, f"{component.name} failed")
    seen = replace(part, events=(*part.events, Failed(event, component.name)))
    given = []
    for failed in (1.0, 0.0):
        held = Component(component.name, 0.0, 0.0, failed)
        forced = tuple(held if c.name == component.name else c for c in part.components)
        changed = replace(part, components=forced)
        given.append(measured(changed, [part.top], measure)[part.top])
    return _measures(
        component.name,
        "component",
        measured(seen, [event], measure)[event],
        given[0],
        given[1],
        _joint(seen, event, measure),
        p_top,
        None,
    )


def _measures(
    name: str,
    kind: Literal["event", "component"],
    p: float,
    on: float,
    off: float,
    both: float | None,
    p_top: float,
    share: float | None,
) -> Importance:
    resolved = abs(on - off) > _RESOLUTION * max(on, off)
    birnbaum = on - off if resolved else None
    return Importance(
        name=name,
        kind=kind,
        probability=p,
        given_true=on,
        given_false=off,
        birnbaum=birnbaum,
        criticality=None if birnbaum is None else p * birnbaum / p_top,
        diagnostic=None if both is None else both / p_top,
        raw=on / p_top,
        rrw=p_top / off if off > 0.0 else math.inf,
        fussell_vesely=share,
    )


# --- the event and the top --------------------------------------------------------------------


def _acts_alone(part: HybridFaultTree, tree: Tree, event: str) -> bool:
    """Whether forcing the event conditions on it: no memory above it, nothing shares its cause."""
    own = tree.supports[event]
    if any(own & tree.supports[e.name] for e in part.events if e.name != event):
        return False
    above = {event}
    for gate in tree.below(part.top):
        if above & set(gate.inputs):
            above.add(gate.name)
            if not isinstance(gate, Or | And | Not | AtLeast):
                return False
    return True


def _joint(part: HybridFaultTree, event: str, measure: ImportanceMeasure) -> float | None:
    """P(event and top) by a gate over both; None where that needs too many states."""
    name = _free_name(part, f"{event} and {part.top}")
    joined = replace(part, gates=(*part.gates, And(name, (event, part.top))))
    try:
        return measured(joined, [name], measure)[name]
    except InputError:
        return None


def _free_name(part: HybridFaultTree, name: str) -> str:
    things = (part.components, part.sources, part.events, part.gates)
    taken = {thing.name for kind in things for thing in kind}
    while name in taken:
        name += "'"
    return name


def _weights(part: HybridFaultTree, measure: ImportanceMeasure) -> Floats:
    """(N + 1,) weights of the epochs 0..N in the measure."""
    n = part.epochs
    weights = np.zeros(n + 1)
    if measure == "at_end":
        weights[n] = 1.0
    elif part.options.mean_rule == "left":
        weights[:n] = 1.0 / n
    elif part.options.mean_rule == "trapezoid":
        weights[:] = 1.0 / n
        weights[[0, n]] /= 2.0
    else:
        weights[1:] = 1.0 / n
    return weights


# --- minimal cut sets -------------------------------------------------------------------------


def _fussell_vesely(part: HybridFaultTree, measure: ImportanceMeasure) -> Mapping[str, float]:
    """P(some minimal cut set with e holds) by event; empty where it is not defined."""
    if not_static(part):
        return {}
    tree = static_tree_of(part)
    functions = TreeFunctions(tree)
    if not is_coherent(functions, tree):
        return {}
    cuts = cut_sets_of(functions, tree)
    if sum(cuts.counts().values()) > _MOST_CUT_SETS:
        return {}
    sets = [sorted(members) for members in cuts.sets()]
    hours, weights = _moments(part, measure)
    probabilities = _event_probabilities(part, tree, hours)
    found = {}
    for event in functions.order:
        holding = _any_of(tree, [members for members in sets if event in members])
        values = 0.0 if holding is None else top_probability(holding, probabilities=probabilities)
        found[event] = float(np.sum(weights * values))
    return found


def _any_of(tree: StaticTree, sets: Iterable[list[str]]) -> StaticTree | None:
    gates = [StaticGate(f"cut set {i}", "and", tuple(s)) for i, s in enumerate(sets)]
    if not gates:
        return None
    top = StaticGate("some cut set", "or", tuple(gate.name for gate in gates))
    return StaticTree(tree.name, tree.events, (*gates, top), top.name)


def _moments(part: HybridFaultTree, measure: ImportanceMeasure) -> tuple[Floats, Floats]:
    """Times [h] and weights over which the measure is the mean."""
    epochs: Floats = np.arange(part.epochs + 1, dtype=float) * (part.step_s / 3600.0)
    if measure == "at_end" or part.options.mean_rule != "integral":
        return epochs, _weights(part, measure)
    at, weight = instants(part)
    hours = epochs[:-1, None] + at / 3600.0
    return hours.ravel(), np.tile(weight / part.epochs, part.epochs)


def _event_probabilities(
    part: HybridFaultTree, tree: StaticTree, hours: Floats
) -> dict[str, Floats]:
    components = {c.name: c for c in part.components}
    basic = {event.name for event in tree.events}
    found = {}
    for event in part.events:
        if event.name not in basic:
            continue
        if isinstance(event, Failed):
            component = components[event.component]
            found[event.name] = np.array([failed_probability(component, t) for t in hours.tolist()])
        elif isinstance(event, Undeveloped):
            found[event.name] = np.full(len(hours), event.probability)
    return found
