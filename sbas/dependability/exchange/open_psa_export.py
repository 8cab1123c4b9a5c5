"""Open-PSA Model Exchange Format out: a static tree, or a hybrid one as far as it is static."""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

from sbas.dependability.exchange.flattening import ExportPlan, plan_export, unwatched
from sbas.dependability.exchange.identifiers import identifiers, is_identifier
from sbas.dependability.exchange.losses import (
    Exported,
    Loss,
    LossReport,
    OnLoss,
    check_on_loss,
    loss_of,
)
from sbas.dependability.static.static_tree import GateKind, StaticGate, StaticTree
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    Not,
    Options,
    Or,
    Pand,
    Undeveloped,
)
from sbas.exceptions import ModelError

CONSTRUCT: dict[type[Event] | type[Gate], str] = {
    InState: "Markov source",
    Pand: "priority and",
    Dur: "duration or causal and",
    CausalAnd: "duration or causal and",
    Con: "consecutive epochs",
    Not: "not",
    Or: "or, and, k-of-n",
    And: "or, and, k-of-n",
    AtLeast: "or, and, k-of-n",
    House: "house event",
    Undeveloped: "undeveloped event",
}
"""Key of `CAPABILITIES` of each type but `Failed`, where the component decides."""

_STATIC = (Or, And, Not, AtLeast, Failed, House, Undeveloped)


def open_psa_text(model: StaticTree | HybridFaultTree, *, on_loss: OnLoss = "refuse") -> Exported:
    """A fault tree as an Open-PSA document.

    Parameters
    ----------
    model : a static tree, or a hybrid one: components become exponential or GLM laws over the
        mission time, epoch, mission and cases attributes that other programs pass over.
    on_loss : what to do with gates with memory and events of Markov sources: "refuse", or
        "flatten" to basic events with their exact probability at the end of the mission.

    Returns
    -------
    Exported: the document, numbers to 17 digits, and the loss report.

    Raises
    ------
    ModelError : elements that the format cannot hold, all named; a name that cannot be printed.

    References
    ----------
    Epstein, Rauzy, Open-PSA Model Exchange Format 2.0d.
    """
    check_on_loss(on_loss)
    if isinstance(model, StaticTree):
        return Exported(_tree_text(model), LossReport("Open-PSA", ()))
    obstacles = {
        element.name: CONSTRUCT[type(element)]
        for element in (*model.events, *model.gates)
        if not isinstance(element, _STATIC)
    }
    plan = plan_export(model, obstacles, into="Open-PSA", on_loss=on_loss)
    remarks = {"sbas-step-s": _number(model.step_s), "sbas-mission-s": _number(model.mission_s)}
    names = identifiers(x.name for x in (*model.events, *model.gates) if x.name in plan.written)
    cases = [names[case] for case in model.cases if case in plan.written]
    if cases:
        remarks["sbas-cases"] = " ".join(cases)
    body, losses = _model_body(model, plan, names)
    losses += plan.losses
    losses += [
        Loss(case, "cases", "refused", "left out: no longer in the tree")
        for case in model.cases
        if case not in plan.written
    ]
    report = LossReport("Open-PSA", tuple(losses))
    inputs = {name for gate in model.gates for name in gate.inputs}
    ends = [g.name for g in model.gates if g.name in plan.written and g.name not in inputs]
    text = _document(model.name, names[model.top], remarks, body, only_end=ends == [model.top])
    return Exported(text, report)


def _model_body(
    model: HybridFaultTree, plan: ExportPlan, names: Mapping[str, str]
) -> tuple[list[str], list[Loss]]:
    components = {component.name: component for component in model.components}
    first: dict[str, str] = {}
    lines: list[str] = []
    losses: list[Loss] = []
    for event in model.events:
        if event.name not in plan.written:
            continue
        construct = CONSTRUCT.get(type(event), "")
        if event.name in plan.flattened:
            lines.append(_event(names, event.name, _float(plan.flattened[event.name])))
            continue
        if isinstance(event, House):
            lines.append(_house(names, event))
        elif isinstance(event, Undeveloped):
            lines.append(_event(names, event.name, _float(event.probability)))
        elif isinstance(event, Failed):
            component = components[event.component]
            if event.component in first:
                lines.append(_gate(names, StaticGate(event.name, "or", (first[event.component],))))
                construct = "second event on a component"
            else:
                first[event.component] = event.name
                remark = {"sbas-component": component.name}
                lines.append(_event(names, event.name, _law(component), remark))
                construct = construct_of(component)
                if component.source:
                    losses.append(
                        loss_of(component.name, "options, notes and sources of figures", "Open-PSA")
                    )
        losses.append(loss_of(event.name, construct, "Open-PSA"))
    for gate in model.gates:
        if gate.name not in plan.written:
            continue
        if gate.name in plan.flattened:
            lines.append(_event(names, gate.name, _float(plan.flattened[gate.name])))
            continue
        least = gate.k if isinstance(gate, AtLeast) else None
        kind = _KINDS[type(gate)]
        lines.append(_gate(names, StaticGate(gate.name, kind, gate.inputs, least)))
        losses.append(loss_of(gate.name, CONSTRUCT[type(gate)], "Open-PSA"))
    losses += [loss_of(name, "component without an event", "Open-PSA") for name in unwatched(model)]
    if model.notes or model.options != Options():
        losses.append(loss_of(model.name, "options, notes and sources of figures", "Open-PSA"))
    return lines, losses


_KINDS: dict[type[Gate], GateKind] = {Or: "or", And: "and", Not: "not", AtLeast: "atleast"}


def construct_of(component: Component) -> str:
    """Key of `CAPABILITIES` for the hardest thing about a component."""
    if component.initially_failed > 0:
        return "component failed at the start"
    return "repairable component" if component.repair_rate_per_h > 0 else "constant failure rate"


def _law(component: Component) -> str:
    failure = _float(component.failure_rate_per_h)
    if component.repair_rate_per_h == 0 and component.initially_failed == 0:
        return f"<exponential>{failure}<system-mission-time/></exponential>"
    start, repair = _float(component.initially_failed), _float(component.repair_rate_per_h)
    return f"<GLM>{start}{failure}{repair}<system-mission-time/></GLM>"


# --- the document -----------------------------------------------------------------------------


def _tree_text(tree: StaticTree) -> str:
    names = identifiers(
        [
            *(e.name for e in tree.events),
            *(h.name for h in tree.houses),
            *(g.name for g in tree.gates),
        ]
    )
    body = [_event(names, event.name, _float(event.probability)) for event in tree.events]
    body += [_house(names, house) for house in tree.houses]
    body += [_gate(names, gate) for gate in tree.gates]
    inputs = {name for gate in tree.gates for name in gate.inputs}
    ends = [gate.name for gate in tree.gates if gate.name not in inputs]
    return _document(tree.name, names[tree.top], {}, body, only_end=ends == [tree.top])


def _document(
    name: str, top: str, remarks: Mapping[str, str], body: list[str], *, only_end: bool
) -> str:
    told = dict(remarks) if only_end else {**remarks, "sbas-top": top}
    label = ""
    if not is_identifier(name):
        if not name or name != " ".join(name.split()) or not name.isprintable():
            raise ModelError(f"the model's name {name!r} cannot be a label", where="name")
        label, name = f"<label>{escape(name)}</label>", "fault-tree"
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        "<opsa-mef>",
        f"<define-fault-tree name={quoteattr(name)}>{label}{_attributes(told)}",
        *body,
        "</define-fault-tree>",
        "</opsa-mef>",
    ]
    return "\n".join(lines) + "\n"


def _attributes(remarks: Mapping[str, str]) -> str:
    if not remarks:
        return ""
    held = (f"<attribute name={quoteattr(k)} value={quoteattr(v)}/>" for k, v in remarks.items())
    return f"<attributes>{''.join(held)}</attributes>"


def _named(names: Mapping[str, str], name: str, remarks: Mapping[str, str]) -> str:
    """The name attribute, and the real name as a remark where the two differ."""
    own = names[name]
    told = dict(remarks) if own == name else {"sbas-name": name, **remarks}
    return f"name={quoteattr(own)}>{_attributes(told)}"


def _event(
    names: Mapping[str, str], name: str, law: str, remarks: Mapping[str, str] | None = None
) -> str:
    return f"<define-basic-event {_named(names, name, remarks or {})}{law}</define-basic-event>"


def _house(names: Mapping[str, str], house: House) -> str:
    constant = f'<constant value="{"true" if house.value else "false"}"/>'
    return f"<define-house-event {_named(names, house.name, {})}{constant}</define-house-event>"


def _gate(names: Mapping[str, str], gate: StaticGate) -> str:
    inputs = "".join(f"<event name={quoteattr(names[name])}/>" for name in gate.inputs)
    numbers = "" if gate.least is None else f' min="{gate.least}"'
    numbers += "" if gate.most is None else f' max="{gate.most}"'
    formula = f"<{gate.kind}{numbers}>{inputs}</{gate.kind}>"
    return f"<define-gate {_named(names, gate.name, {})}{formula}</define-gate>"


def _float(value: float) -> str:
    return f'<float value="{_number(value)}"/>'


def _number(value: float) -> str:
    return f"{value:.17g}"
