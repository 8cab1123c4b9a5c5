"""A static fault tree: basic events with a probability, Boolean gates, and the exact top."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, cast, get_args

import numpy as np
import numpy.typing as npt

from sbas.dependability.static.decision_diagram import build_diagram
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Failed,
    House,
    HybridFaultTree,
    Not,
    Or,
    Undeveloped,
)
from sbas.exceptions import InputError, ModelError

GateKind = Literal[
    "and", "or", "not", "xor", "nand", "nor", "iff", "imply", "atleast", "cardinality"
]
_INPUTS = {"not": 1, "xor": 2, "iff": 2, "imply": 2}
"""Kinds with a fixed number of inputs; programs differ on an exclusive or of three."""


@dataclass(frozen=True)
class BasicEvent:
    """An event that occurs with a probability, independently of all others."""

    name: str
    probability: float


@dataclass(frozen=True)
class StaticGate:
    """A Boolean gate.

    Parameters
    ----------
    name : unique in the tree.
    kind : one of `GateKind`; "imply" is false only where the first input holds and the second
        does not.
    inputs : names of basic events, house events or gates.
    least : "atleast" and "cardinality": fewest inputs that make it true.
    most : "cardinality": most inputs that do.
    """

    name: str
    kind: GateKind
    inputs: tuple[str, ...]
    least: int | None = None
    most: int | None = None


@dataclass(frozen=True)
class StaticTree:
    """A static fault tree, valid from birth.

    Parameters
    ----------
    name : of the tree.
    events, houses, gates : in any order of mention; names are unique over all three.
    top : name of the event or gate that is the failure.

    Raises
    ------
    ModelError : a duplicate or unknown name, a wrong number of inputs, a probability outside
        0..1, or a cycle, named.
    """

    name: str
    events: tuple[BasicEvent, ...]
    gates: tuple[StaticGate, ...]
    top: str
    houses: tuple[House, ...] = ()

    def __post_init__(self) -> None:
        _check_names(self)
        for event in self.events:
            if not 0 <= event.probability <= 1:
                raise ModelError(
                    f"the probability of basic event {event.name!r} is not between 0 and 1",
                    where=f"events.{event.name}",
                    evidence=f"probability = {event.probability!r}",
                )
        for gate in self.gates:
            _check_gate(gate)
        gates_from(self, tuple(gate.name for gate in self.gates))

    def ordered_gates(self) -> tuple[StaticGate, ...]:
        """Gates below the top, inputs before the gates that use them."""
        return gates_from(self, (self.top,))

    def variable_order(self) -> tuple[str, ...]:
        """Basic events below the top, depth first from left to right."""
        gates = {gate.name: gate for gate in self.gates}
        houses = {house.name for house in self.houses}
        order: dict[str, None] = {}
        seen: set[str] = set()
        stack = [self.top]
        while stack:
            name = stack.pop()
            if name in seen:
                continue
            seen.add(name)
            if name in gates:
                stack.extend(reversed(gates[name].inputs))
            elif name not in houses:
                order[name] = None
        return tuple(order)

    def probabilities(self) -> dict[str, float]:
        """Probability of each basic event [1]."""
        return {event.name: event.probability for event in self.events}


def _check_names(tree: StaticTree) -> None:
    named: list[BasicEvent | House | StaticGate] = [*tree.events, *tree.houses, *tree.gates]
    counted = Counter(element.name for element in named)
    twice = sorted(name for name, times in counted.items() if times > 1)
    if twice:
        raise ModelError(
            f"the name {twice[0]!r} is defined {counted[twice[0]]} times",
            where=f"fault tree {tree.name!r}",
            cure="give every event and gate a name of its own",
        )
    if tree.top not in counted:
        raise ModelError(f"the top {tree.top!r} is not defined", where=f"fault tree {tree.name!r}")
    for gate in tree.gates:
        for name in gate.inputs:
            if name not in counted:
                raise ModelError(
                    f"gate {gate.name!r} uses {name!r}, which is not defined",
                    where=f"gates.{gate.name}",
                )


def _check_gate(gate: StaticGate) -> None:
    n = len(gate.inputs)
    where = f"gates.{gate.name}"
    if gate.kind not in get_args(GateKind):
        raise ModelError(
            f"gate {gate.name!r} is of the unknown kind {gate.kind!r}",
            where=where,
            cure=f"known are {', '.join(get_args(GateKind))}",
        )
    if n == 0:
        raise ModelError(f"gate {gate.name!r} has no input", where=where)
    demanded = _INPUTS.get(gate.kind)
    if demanded is not None and n != demanded:
        raise ModelError(
            f"gate {gate.name!r}: {gate.kind!r} takes {demanded} "
            f"input{'s' if demanded > 1 else ''}, not {n}",
            where=where,
            cure="nest gates of two inputs: programs differ on more" if n > 2 else "",
        )
    counts = (gate.least, gate.most)
    if gate.kind == "atleast":
        if gate.most is not None or gate.least is None or not 1 <= gate.least <= n:
            raise ModelError(
                f"gate {gate.name!r}: 'least' must be between 1 and its {n} inputs",
                where=where,
                evidence=f"least = {gate.least!r}, most = {gate.most!r}",
            )
    elif gate.kind == "cardinality":
        least, most = counts
        if least is None or most is None or not 0 <= least <= most <= n:
            raise ModelError(
                f"gate {gate.name!r}: 0 <= least <= most <= {n} does not hold",
                where=where,
                evidence=f"least = {least!r}, most = {most!r}",
            )
    elif counts != (None, None):
        raise ModelError(f"gate {gate.name!r}: {gate.kind!r} has no 'least' or 'most'", where=where)


def gates_from(tree: StaticTree, starts: Sequence[str]) -> tuple[StaticGate, ...]:
    """Gates below the starts, inputs before the gates that use them; a cycle is an error.

    Parameters
    ----------
    tree : whose gates are looked up; it need not be valid otherwise.
    starts : names to start from.

    Raises
    ------
    ModelError : a cycle, with the names along it.
    """
    gates = {gate.name: gate for gate in tree.gates}
    done: dict[str, StaticGate] = {}
    on_path: dict[str, None] = {}
    for start in starts:
        stack = [start]
        while stack:
            name = stack[-1]
            if name in done or name not in gates:
                stack.pop()
            elif name in on_path:
                del on_path[name]
                done[name] = gates[name]
                stack.pop()
            else:
                on_path[name] = None
                for below in gates[name].inputs:
                    if below in on_path:
                        raise _cycle(tree.name, list(on_path), below)
                    if below in gates and below not in done:
                        stack.append(below)
    return tuple(done.values())


def _cycle(tree: str, path: list[str], again: str) -> ModelError:
    # The path holds each gate once, but its siblings' subtrees are finished and gone from it.
    loop = [*path[path.index(again) :], again]
    shown = loop if len(loop) <= 12 else [*loop[:6], "...", *loop[-5:]]
    return ModelError(
        f"gates form a cycle: {' -> '.join(shown)}",
        where=f"fault tree {tree!r}",
        cure="break the loop: a gate cannot depend on itself",
    )


def top_probability(
    tree: StaticTree, *, probabilities: Mapping[str, npt.ArrayLike] | None = None
) -> npt.NDArray[np.float64]:
    """Exact probability of the top event, by a binary decision diagram.

    Parameters
    ----------
    tree : static fault tree; shared events and non-coherent gates are treated exactly.
    probabilities : in place of the tree's own, for some basic events: numbers or arrays that
        broadcast against each other, such as a column per sample [1].

    Returns
    -------
    ndarray of the broadcast shape (0-d without arrays) [1].

    Raises
    ------
    ModelError : a diagram too large.
    InputError : a name that is no basic event of the tree, or a probability outside 0..1.

    Notes
    -----
    P(node) = p P(high) + (1 - p) P(low), complements pushed to the leaves: only sums of
    non-negative products, so that small results keep all their digits.

    References
    ----------
    Rauzy 1993, New algorithms for fault trees analysis, section 3.
    """
    diagram = build_diagram(tree)
    values = diagram.node_probabilities(overridden(tree, probabilities))
    return np.asarray(values[diagram.roots[0]], dtype=np.float64)


def overridden(
    tree: StaticTree, probabilities: Mapping[str, npt.ArrayLike] | None
) -> dict[str, npt.NDArray[np.float64] | float]:
    """The tree's probabilities with some replaced, each checked to lie in 0..1."""
    merged: dict[str, npt.NDArray[np.float64] | float] = dict(tree.probabilities())
    for name, given in (probabilities or {}).items():
        if name not in merged:
            raise InputError(
                f"{name!r} is no basic event of the tree {tree.name!r}", where="probabilities"
            )
        values = np.asarray(given, dtype=np.float64)
        if not np.all((values >= 0) & (values <= 1)):
            raise InputError(
                f"a probability of {name!r} is not between 0 and 1", where="probabilities"
            )
        merged[name] = values
    return merged


# --- from a hybrid fault tree -----------------------------------------------------------------


def failed_probability(component: Component, hours: float) -> float:
    """Probability that hardware is failed at a time.

    Parameters
    ----------
    component : rates [1/h] and the probability to be failed at the start.
    hours : time since the start [h].

    Notes
    -----
    alpha/s (1 - exp(-s t)) + p0 exp(-s t), s = alpha + mu: the Open-PSA GLM law.

    References
    ----------
    Two-state Markov chain; Open-PSA Model Exchange Format 2.0d, GLM distribution.
    """
    rate = component.failure_rate_per_h + component.repair_rate_per_h
    if rate == 0:
        return component.initially_failed
    failed = component.failure_rate_per_h / rate * -math.expm1(-rate * hours)
    return failed + component.initially_failed * math.exp(-rate * hours)


def static_tree_of(
    model: HybridFaultTree,
    *,
    hours: float | None = None,
    flattened: Mapping[str, float] | None = None,
) -> StaticTree:
    """The static tree of a hybrid fault tree at one instant.

    Parameters
    ----------
    model : with gates without memory and events of hardware only, but for those in `flattened`.
    hours : the instant [h]; None is the end of the mission.
    flattened : events or gates to replace by a basic event of this probability.

    Returns
    -------
    StaticTree. A basic event bears the name of the first event on its component; a second event
    on the same component is an "or" of that one input.

    Raises
    ------
    ModelError : a gate with memory or an event of a Markov source that is not in `flattened`;
        all are named.
    """
    given = dict(flattened or {})
    time_h = model.mission_s / 3600 if hours is None else hours
    held = not_static(model, set(given))
    if held:
        raise ModelError(
            f"{len(held)} elements have no place in a static tree: {', '.join(held[:8])}",
            where=f"model {model.name!r}",
            cure="give their probabilities in flattened={...}, or use the hybrid solver",
        )
    components = {component.name: component for component in model.components}
    first: dict[str, str] = {}
    events = [BasicEvent(name, probability) for name, probability in given.items()]
    houses: list[House] = []
    gates: list[StaticGate] = []
    for event in model.events:
        if event.name in given:
            continue
        if isinstance(event, House):
            houses.append(event)
        elif isinstance(event, Undeveloped):
            events.append(BasicEvent(event.name, event.probability))
        elif isinstance(event, Failed):
            if event.component in first:
                gates.append(StaticGate(event.name, "or", (first[event.component],)))
                continue
            if event.component not in components:
                raise ModelError(
                    f"event {event.name!r} watches {event.component!r}, which is no component",
                    where=f"events.{event.name}",
                )
            first[event.component] = event.name
            probability = failed_probability(components[event.component], time_h)
            events.append(BasicEvent(event.name, probability))
    for gate in model.gates:
        if gate.name in given:
            continue
        kind = cast(GateKind, type(gate).__name__.lower())
        least = gate.k if isinstance(gate, AtLeast) else None
        gates.append(StaticGate(gate.name, kind, gate.inputs, least))
    return StaticTree(model.name, tuple(events), tuple(gates), model.top, tuple(houses))


def not_static(model: HybridFaultTree, besides: Iterable[str] = ()) -> list[str]:
    """Names of gates with memory and of events of Markov sources, but for some."""
    known = set(besides)
    found = [e.name for e in model.events if not isinstance(e, Failed | House | Undeveloped)] + [
        g.name for g in model.gates if not isinstance(g, Or | And | Not | AtLeast)
    ]
    return [name for name in found if name not in known]
