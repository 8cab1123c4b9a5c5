"""Galileo dynamic fault trees out: rates, and, or, KofN and priority-and."""

from __future__ import annotations

from typing import Literal, get_args

from sbas.dependability.exchange.flattening import plan_export, unwatched
from sbas.dependability.exchange.galileo import HOURS, TimeUnit
from sbas.dependability.exchange.losses import Exported, Loss, LossReport, OnLoss, loss_of
from sbas.dependability.exchange.open_psa_export import CONSTRUCT, construct_of
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    Options,
    Or,
    Pand,
    Undeveloped,
)
from sbas.dependability.tree.model_check import in_order
from sbas.exceptions import ModelError

Dialect = Literal["storm", "dftcalc"]


def galileo_text(
    model: HybridFaultTree,
    *,
    time_unit: TimeUnit,
    dialect: Dialect = "storm",
    on_loss: OnLoss = "refuse",
) -> Exported:
    """A hybrid fault tree as a Galileo file.

    Parameters
    ----------
    model : with components, gates or, and, k-of-n, and priority-and above what is not repaired.
    time_unit : in which the rates are written: "s", "min", "h", "d" or "y" (of 365 days).
    dialect : "storm" knows no repair; "dftcalc" writes repair=.
    on_loss : what to do with the rest: "refuse", or "flatten" to prob= with the exact
        probability at the end of the mission.

    Returns
    -------
    Exported: a statement a line, numbers to 17 digits, and the loss report.

    Raises
    ------
    ModelError : elements that the format cannot hold, all named; a name with a quotation mark.

    References
    ----------
    Sullivan, Dugan, Coppit 1999; dialect of Storm (DFTGalileoParser) and DFTCalc (repair=).
    """
    for key, value, known in (
        ("time_unit", time_unit, get_args(TimeUnit)),
        ("dialect", dialect, get_args(Dialect)),
    ):
        if value not in known:
            raise ModelError(f"{key} = {value!r} is unknown", cure=f"known are {', '.join(known)}")
    plan = plan_export(model, _obstacles(model, dialect), into="Galileo", on_loss=on_loss)
    hours = HOURS[time_unit]
    components = {component.name: component for component in model.components}
    first: dict[str, str] = {}
    lines = [f"toplevel {_quoted(model.top)};"]
    losses: list[Loss] = []
    for event in model.events:
        if event.name not in plan.written:
            continue
        own = _quoted(event.name)
        if event.name in plan.flattened:
            lines.append(f"{own} prob={plan.flattened[event.name]:.17g};")
        elif isinstance(event, House):
            lines.append(f"{own} prob={int(event.value)};")
            losses.append(loss_of(event.name, "house event", "Galileo"))
        elif isinstance(event, Undeveloped):
            lines.append(f"{own} prob={event.probability:.17g};")
            losses.append(loss_of(event.name, "undeveloped event", "Galileo"))
        elif isinstance(event, Failed) and event.component in first:
            lines.append(f"{own} or {_quoted(first[event.component])};")
            losses.append(loss_of(event.name, "second event on a component", "Galileo"))
        elif isinstance(event, Failed):
            component = components[event.component]
            first[event.component] = event.name
            rates = f"lambda={component.failure_rate_per_h * hours:.17g} dorm=1"
            if component.repair_rate_per_h > 0:
                rates += f" repair={component.repair_rate_per_h * hours:.17g}"
            lines.append(f"{own} {rates};")
            losses.append(loss_of(event.name, construct_of(component), "Galileo"))
            if component.name != f"{event.name}-hardware":
                losses.append(loss_of(component.name, "names of components", "Galileo"))
    for gate in model.gates:
        if gate.name not in plan.written:
            continue
        own = _quoted(gate.name)
        if gate.name in plan.flattened:
            lines.append(f"{own} prob={plan.flattened[gate.name]:.17g};")
            continue
        inputs = " ".join(_quoted(name) for name in gate.inputs)
        lines.append(f"{own} {_kind(gate, model.options)} {inputs};")
        losses.append(loss_of(gate.name, CONSTRUCT[type(gate)], "Galileo"))
    losses += plan.losses
    losses += [loss_of(name, "component without an event", "Galileo") for name in unwatched(model)]
    losses += [loss_of(case, "cases", "Galileo") for case in model.cases]
    losses.append(loss_of(model.name, "epoch and mission", "Galileo"))
    if model.notes or model.options != Options() or any(c.source for c in model.components):
        losses.append(loss_of(model.name, "options, notes and sources of figures", "Galileo"))
    return Exported("\n".join(lines) + "\n", LossReport("Galileo", tuple(losses)))


def _obstacles(model: HybridFaultTree, dialect: Dialect) -> dict[str, str]:
    components = {component.name: component for component in model.components}
    found: dict[str, str] = {}
    never_ends: dict[str, bool] = {}
    for event in model.events:
        never_ends[event.name] = isinstance(event, House | Undeveloped)
        if isinstance(event, Failed):
            component = components[event.component]
            never_ends[event.name] = component.repair_rate_per_h == 0
            if component.initially_failed > 0:
                found[event.name] = "component failed at the start"
            elif component.repair_rate_per_h > 0 and dialect == "storm":
                found[event.name] = "repairable component"
        elif not isinstance(event, House | Undeveloped):
            found[event.name] = CONSTRUCT[type(event)]
    for gate in in_order(model):
        never_ends[gate.name] = all(never_ends[name] for name in gate.inputs)
        if isinstance(gate, Or | And | AtLeast):
            continue
        # What never ends keeps its order: latched and current are one there.
        if not (isinstance(gate, Pand) and never_ends[gate.name]):
            found[gate.name] = CONSTRUCT[type(gate)]
            never_ends[gate.name] = False
    return found


def _kind(gate: Gate, options: Options) -> str:
    if isinstance(gate, Pand):
        exclusive = options.pand_exclusive if gate.exclusive is None else gate.exclusive
        return "pand-excl" if exclusive else "pand-incl"
    if isinstance(gate, AtLeast):
        return f"{gate.k}of{len(gate.inputs)}"
    return "or" if isinstance(gate, Or) else "and"


def _quoted(name: str) -> str:
    if not name or not name.isprintable() or any(mark in name for mark in '";') or "//" in name:
        raise ModelError(f"the name {name!r} cannot stand in a Galileo file", where="Galileo")
    return f'"{name}"'
