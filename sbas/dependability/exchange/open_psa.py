"""Open-PSA Model Exchange Format in: to a static tree, or to components with their rates."""

from __future__ import annotations

import re
from pathlib import Path
from typing import cast, get_args
from xml.etree.ElementTree import Element

from sbas.dependability.exchange.identifiers import TakenNames
from sbas.dependability.exchange.losses import ImportedModel, ImportedTree, Loss, LossReport
from sbas.dependability.exchange.open_psa_expressions import (
    Expression,
    Law,
    MissionTime,
    Number,
    attribute,
    boolean,
    evaluated,
    read_expression,
)
from sbas.dependability.exchange.open_psa_names import (
    Definition,
    Definitions,
    Kind,
    read_definitions,
    remarks_of,
)
from sbas.dependability.exchange.safe_xml import parse_xml
from sbas.dependability.static.static_tree import BasicEvent, GateKind, StaticGate, StaticTree
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    Not,
    Or,
    Undeveloped,
)
from sbas.dependability.tree.model_check import check_model
from sbas.exceptions import ModelError

_REFERENCES: dict[str, tuple[Kind, ...]] = {
    "gate": ("gate",),
    "basic-event": ("basic-event",),
    "house-event": ("house-event",),
    "event": ("gate", "basic-event", "house-event"),
}


def read_open_psa(
    source: Path | str | bytes, *, mission_s: float | None = None, top: str | None = None
) -> ImportedTree:
    """The static fault tree of an Open-PSA file.

    Parameters
    ----------
    source : path of a file, or its content as bytes.
    mission_s : system mission time [s], for laws that ask for it; None takes that of a file
        which this package wrote.
    top : name of the top gate; needed where several gates are used by no other.

    Returns
    -------
    ImportedTree: nested formulas as gates of their own; laws at the mission time, which the
    report calls flattened.

    Raises
    ------
    InputError : no safe well-formed XML.
    ModelError : what the file says is impossible, ambiguous or not supported; names the element.

    References
    ----------
    Epstein, Rauzy, Open-PSA Model Exchange Format 2.0d.
    """
    file = _File(source)
    mission = _seconds(mission_s, file.names.remarks, "sbas-mission-s", file.where)
    mission_h = None if mission is None else mission / 3600
    events, losses = [], []
    gates = list(file.gates)
    for name, law in file.laws.items():
        where = f"{file.where}: basic event {name!r}"
        events.append(BasicEvent(name, evaluated(law, mission_h, where)))
        if isinstance(law, Law):
            losses.append(
                Loss(
                    name,
                    law.kind,
                    "flattened",
                    f"probability at {mission_h} h; read_open_psa_model keeps rates",
                )
            )
    for group in file.groups:
        where = f"{file.where}: common-cause group {group.name!r}"
        whole = evaluated(group.law, mission_h, where)
        events.append(BasicEvent(group.common, group.beta * whole))
        for member, alone in group.members.items():
            events.append(BasicEvent(alone, (1.0 - group.beta) * whole))
            gates.append(StaticGate(member, "or", (alone, group.common)))
        losses.append(
            Loss(group.name, "beta-factor group", "kept", "member = alone or common cause")
        )
    tree = StaticTree(
        file.name, tuple(events), tuple(gates), file.top(gates, top), tuple(file.houses)
    )
    return ImportedTree(tree, LossReport("Open-PSA", tuple(losses)))


def read_open_psa_model(
    source: Path | str | bytes,
    *,
    step_s: float | None = None,
    mission_s: float | None = None,
    top: str | None = None,
) -> ImportedModel:
    """The hybrid fault tree of an Open-PSA file: its rates become components.

    Parameters
    ----------
    source : path of a file, or its content as bytes.
    step_s, mission_s : epoch and mission [s]; None takes those of a file which this package
        wrote.
    top : name of the top gate; needed where several gates are used by no other.

    Returns
    -------
    ImportedModel: exponential and GLM laws over the mission time as components, float
    probabilities as undeveloped events.

    Raises
    ------
    InputError : no safe well-formed XML.
    ModelError : a law without constant rates, a gate that a hybrid tree does not have, or what
        `read_open_psa` refuses.

    References
    ----------
    Epstein, Rauzy, Open-PSA Model Exchange Format 2.0d.
    """
    file = _File(source)
    step = _seconds(step_s, file.names.remarks, "sbas-step-s", file.where)
    mission = _seconds(mission_s, file.names.remarks, "sbas-mission-s", file.where)
    if step is None or mission is None:
        raise ModelError(
            "the file holds neither epoch nor mission",
            where=file.where,
            cure="say them: step_s=1, mission_s=3600",
        )
    if file.groups:
        raise ModelError(
            f"common-cause group {file.groups[0].name!r} splits a probability, not a rate",
            where=file.where,
            cure="read it with read_open_psa, or write the channels out with rates of their own",
        )
    houses = {house.name: house for house in file.houses}
    components: list[Component] = []
    events: list[Event] = []
    for definition in file.names.events:
        name = definition.identity
        if definition.kind == "house-event":
            events.append(houses[name])
        elif definition.kind == "basic-event":
            law = file.laws[name]
            if isinstance(law, Number):
                events.append(Undeveloped(name, law.value))
                continue
            where = f"{file.where}: basic event {name!r}"
            given = remarks_of(definition.element).get("sbas-component")
            component = given or file.new_name(f"{name}-hardware")
            components.append(_component(component, law, where))
            events.append(Failed(name, component))
    events += [houses[name] for name in file.constants]
    gates = [_model_gate(gate, file.where) for gate in file.gates]
    cases = file.names.remarks.get("sbas-cases", "")
    model = HybridFaultTree(
        name=file.name,
        step_s=step,
        mission_s=mission,
        components=tuple(components),
        sources=(),
        events=tuple(events),
        gates=tuple(gates),
        top=file.top(file.gates, top),
        cases=tuple(file.identity(case) for case in cases.split()),
    )
    check_model(model)
    return ImportedModel(model, LossReport("Open-PSA", ()))


def _component(name: str, law: Expression, where: str) -> Component:
    arguments = law.arguments if isinstance(law, Law) else ()
    rates = [a.value for a in arguments if isinstance(a, Number)]
    timed = bool(arguments) and isinstance(arguments[-1], MissionTime)
    if isinstance(law, Law) and timed and law.kind == "exponential" and len(rates) == 1:
        return Component(name, rates[0])
    if isinstance(law, Law) and timed and law.kind == "GLM" and len(rates) == 3:
        return Component(name, rates[1], rates[2], rates[0])
    raise ModelError(
        "the law is not one of constant rates over the mission time",
        where=where,
        evidence=law.kind if isinstance(law, Law) else "the mission time itself",
        cure="read it with read_open_psa, which takes its probability at one instant",
    )


def _model_gate(gate: StaticGate, where: str) -> Gate:
    if gate.kind == "or":
        return Or(gate.name, gate.inputs)
    if gate.kind == "and":
        return And(gate.name, gate.inputs)
    if gate.kind == "not" and len(gate.inputs) == 1:
        return Not(gate.name, gate.inputs[0])
    if gate.kind == "atleast" and gate.least is not None:
        return AtLeast(gate.name, gate.least, gate.inputs)
    raise ModelError(
        f"gate {gate.name!r} is of the kind {gate.kind!r}, which a hybrid tree does not have",
        where=where,
        cure="read it with read_open_psa, or write it with and, or, not",
    )


def _seconds(given: float | None, remarks: dict[str, str], key: str, where: str) -> float | None:
    if given is None and key in remarks:
        try:
            given = float(remarks[key])
        except ValueError:
            raise ModelError(f"{key} = {remarks[key]!r} is no number", where=where) from None
    if given is not None and not 0 < given < float("inf"):
        raise ModelError(f"{key} is not a time above 0", where=where, evidence=repr(given))
    return given


class _Group:
    """A beta-factor group: a law shared by members, of which a share fails together."""

    def __init__(self, file: _File, element: Element, path: tuple[str, ...]) -> None:
        self.name = attribute(element, "name", file.where)
        where = f"{file.where}: common-cause group {self.name!r}"
        model = attribute(element, "model", where)
        if model != "beta-factor":
            raise ModelError(
                f"the common-cause model {model!r} is not supported",
                where=where,
                cure="supported is beta-factor",
            )
        members = element.findall("members/basic-event")
        lookup = file.names.parameters_from(path, where)
        laws = element.findall("distribution/*")
        factors = [*element.findall("factor"), *element.findall("factors/factor")]
        if not members or len(laws) != 1 or len(factors) != 1 or len(factors[0]) != 1:
            raise ModelError(
                "a beta-factor group needs members, one distribution and one factor", where=where
            )
        if factors[0].get("level", str(len(members))) != str(len(members)):
            raise ModelError("the factor's level is not the number of members", where=where)
        self.law = read_expression(laws[0], lookup, where)
        self.beta = evaluated(read_expression(factors[0][0], lookup, where), None, where)
        if not 0 <= self.beta <= 1:
            raise ModelError("beta is not between 0 and 1", where=where, evidence=str(self.beta))
        self.common = file.new_name(f"{self.name}-common")
        self.members: dict[str, str] = {}
        for member in members:
            reference = attribute(member, "name", where)
            found = file.names.find(reference, path, where, kinds=("basic-event",))
            if found.content or found.identity in file.members:
                raise ModelError(
                    f"{reference!r} has a law of its own, or is a member twice", where=where
                )
            file.members.add(found.identity)
            self.members[found.identity] = file.new_name(f"{found.identity}-alone")


class _File:
    """What a file says, references resolved and nested formulas given names."""

    def __init__(self, source: Path | str | bytes) -> None:
        root, self.where = parse_xml(source)
        self.names: Definitions = read_definitions(root, self.where)
        self.name = self.names.tree_name
        self.gates: list[StaticGate] = []
        self.houses: list[House] = []
        self.constants: list[str] = []
        self.laws: dict[str, Expression] = {}
        self.members: set[str] = set()
        self._taken = TakenNames(definition.identity for definition in self.names.events)
        self.groups = [_Group(self, element, path) for element, path in self.names.groups]
        for definition in self.names.events:
            self._take(definition)

    def new_name(self, wish: str) -> str:
        """A name that no element has yet."""
        return self._taken.new(wish, "-")

    def identity(self, reference: str) -> str:
        """The name of what a remark of the fault tree refers to."""
        kinds = _REFERENCES["event"]
        return self.names.find(reference, (), self.where, kinds=kinds).identity

    def top(self, gates: list[StaticGate], asked: str | None) -> str:
        """The top: asked for, said by the file, or the one gate that no other uses."""
        if asked is not None:
            return asked
        if "sbas-top" in self.names.remarks:
            return self.identity(self.names.remarks["sbas-top"])
        used = {name for gate in gates for name in gate.inputs}
        own = {found.identity for found in self.names.events if found.kind == "gate"}
        free = [g.name for g in gates if g.name not in used and g.name in own]
        if len(free) == 1:
            return free[0]
        if not free:
            raise ModelError(
                "no gate is the top: each is used by another, so they form a cycle"
                if gates
                else "the file defines no gate",
                where=self.where,
            )
        raise ModelError(
            f"{len(free)} gates are used by no other: {', '.join(free[:12])}",
            where=self.where,
            cure=f"name the top: top={free[0]!r}",
        )

    def _take(self, definition: Definition) -> None:
        name = definition.identity
        where = f"{self.where}: {definition.kind} {name!r}"
        content = definition.content
        if definition.kind == "house-event":
            self.houses.append(House(name, boolean(content[0], where) if content else False))
        elif definition.kind == "basic-event":
            if name in self.members:
                return
            if len(content) != 1:
                raise ModelError("a basic event needs one expression", where=where)
            lookup = self.names.parameters_from(definition.path, where)
            self.laws[name] = read_expression(content[0], lookup, where)
        else:
            if len(content) != 1:
                raise ModelError("a gate needs one formula", where=where)
            if content[0].tag in _REFERENCES or content[0].tag == "constant":
                only = self._input(content[0], definition, where)
                self.gates.append(StaticGate(name, "or", (only,)))
            else:
                self._formula(content[0], name, definition, where)

    def _formula(self, element: Element, name: str, definition: Definition, where: str) -> None:
        kind = str(element.tag)
        if kind not in get_args(GateKind):
            raise ModelError(
                f"the formula {kind!r} is not supported",
                where=where,
                cure=f"supported are {', '.join(get_args(GateKind))}",
            )
        inputs = tuple(self._input(child, definition, where) for child in element)
        least = most = None
        if kind in ("atleast", "cardinality"):
            least = _whole(element, "min", where)
        if kind == "cardinality":
            most = _whole(element, "max", where)
        self.gates.append(StaticGate(name, cast(GateKind, kind), inputs, least, most))

    def _input(self, element: Element, definition: Definition, where: str) -> str:
        if element.tag in _REFERENCES:
            kinds = _REFERENCES[str(element.tag)]
            said = element.get("type")
            if said is not None and element.tag == "event":
                if said not in _REFERENCES or said == "event":
                    raise ModelError(f"the event type {said!r} is not known", where=where)
                kinds = _REFERENCES[said]
            reference = attribute(element, "name", where)
            return self.names.find(reference, definition.path, where, kinds=kinds).identity
        if element.tag == "constant":
            value = boolean(element, where)
            name = self.new_name(f"constant-{'true' if value else 'false'}")
            self.constants.append(name)
            self.houses.append(House(name, value))
            return name
        name = self.new_name(f"{definition.identity}-part")
        self._formula(element, name, definition, where)
        return name


def _whole(element: Element, key: str, where: str) -> int:
    text = attribute(element, key, where)
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise ModelError(f"{key} = {text[:40]!r} is no whole number", where=where)
    return int(text)
