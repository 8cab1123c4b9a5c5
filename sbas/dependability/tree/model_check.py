"""What a hybrid fault tree must satisfy before anything computes with it."""

from __future__ import annotations

from collections.abc import Collection
from graphlib import CycleError, TopologicalSorter
from typing import Any, get_args

from sbas.dependability.tree.durations import MOST_EPOCHS, whole_epochs
from sbas.dependability.tree.model import (
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    DurationRule,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    MeanRule,
    Options,
    Pand,
    Stage,
    Undeveloped,
)
from sbas.dependability.tree.model_values import (
    a_choice,
    a_name,
    a_number,
    a_text,
    a_truth,
    a_whole_number,
    items,
    refuse,
)
from sbas.dependability.tree.model_warnings import warnings_of
from sbas.dependability.tree.stochastic_rows import check_law, check_rows, has_one_stationary_law
from sbas.exceptions import ModelError
from sbas.findings import Finding
from sbas.integrity.allocation_tree import nearest

_FASTEST_PER_H = 1e12
"""No hardware fails or is repaired faster; sums of such rates stay far from overflow."""


def check_model(model: HybridFaultTree) -> tuple[Finding, ...]:
    """Refuse a model that means nothing, and tell what in it has no effect.

    Parameters
    ----------
    model : any; values of wrong types are refused too.

    Returns
    -------
    Warnings: delays off the epoch grid, events without effect on the top, constant gates, events
    not analysed, rows completed to sum 1.

    Raises
    ------
    ModelError : with the key path and what to write there.

    Notes
    -----
    Hardware moves first in an epoch, then sources, then gates: a source may be guarded by
    components only, and gates by nothing.
    """
    _check_time(model)
    names = _check_names(model)
    for component in model.components:
        where = f"components.{component.name}"
        a_number(component.failure_rate_per_h, f"{where}.failure_rate_per_h", high=_FASTEST_PER_H)
        a_number(component.repair_rate_per_h, f"{where}.repair_rate_per_h", high=_FASTEST_PER_H)
        a_number(component.initially_failed, f"{where}.initially_failed", high=1.0)
        a_text(component.source, f"{where}.source")
    for source in model.sources:
        _check_source(model, source)
    for event in model.events:
        _check_event(model, event)
    for gate in model.gates:
        _check_gate(model, gate, names)
    _check_options(model)
    in_order(model)
    a_text(model.top, "top")
    for key, value in (("top", model.top), *(("cases", c) for c in items(model.cases, "cases"))):
        _known(value, names, key)
    if len(set(model.cases)) != len(model.cases):
        raise refuse("a case is listed twice", "cases", model.cases, "list each case once")
    for note in items(model.notes, "notes"):
        a_text(note, "notes")
    return warnings_of(model, in_order(model))


def in_order(model: HybridFaultTree) -> tuple[Gate, ...]:
    """The gates so that each comes after its inputs.

    Raises
    ------
    ModelError : a cycle, with its path; an unknown or a duplicate name.
    """
    events = {event.name for event in model.events}
    gates = {gate.name: gate for gate in model.gates}
    if len(gates) != len(model.gates) or events & gates.keys():
        _check_names(model)
    names = events | gates.keys()
    feeds: dict[str, list[str]] = {
        gate.name: [
            name for name in gate.inputs
            if _known(name, names, f"gates.{gate.name}.inputs") in gates
        ]
        for gate in model.gates
    }  # fmt: skip
    try:
        return tuple(gates[name] for name in TopologicalSorter(feeds).static_order())
    except CycleError as error:
        path = " -> ".join(reversed(error.args[1]))
        raise refuse(
            "gates feed each other in a cycle", f"gates.{error.args[1][0]}", path,
            "take one of these inputs away: a gate cannot depend on itself",
        ) from None  # fmt: skip


def supports(model: HybridFaultTree) -> dict[str, frozenset[str]]:
    """What every component, source, event and gate depends on by chance.

    Returns
    -------
    By name: the components and sources below it, components that guard such a source, and
    undeveloped events with a probability (two gates that share one are dependent).

    Raises
    ------
    ModelError : a cycle, an unknown or a duplicate name.
    """
    below = {c.name: frozenset((c.name,)) for c in model.components}
    below |= {s.name: frozenset((s.name, *s.guard)) for s in model.sources}
    for event in model.events:
        match event:
            case Failed():
                below[event.name] = below[event.component]
            case InState():
                below[event.name] = below[event.source]
            case Undeveloped() if event.probability > 0.0:
                below[event.name] = frozenset((event.name,))
            case _:
                below[event.name] = frozenset()
    for gate in in_order(model):
        below[gate.name] = frozenset().union(*(below[name] for name in gate.inputs))
    return below


_KINDS: dict[str, tuple[Any, ...]] = {
    "components": (Component,),
    "sources": (MarkovSource,),
    "events": get_args(Event),
    "gates": get_args(Gate),
}


# --- parts ------------------------------------------------------------------------------------


def _check_time(model: HybridFaultTree) -> None:
    a_name(model.name, "name")
    a_number(model.step_s, "time.step_s", positive=True)
    _check_on_grid(model, model.mission_s, "time.mission_s", positive=True)


def _check_on_grid(
    model: HybridFaultTree, seconds: float, where: str, *, positive: bool = False
) -> None:
    _check_countable(model, seconds, where, positive=positive)
    epochs = whole_epochs(seconds, model.step_s)
    if epochs is None or (positive and epochs < 1):
        near = max(int(positive), round(seconds / model.step_s)) * model.step_s
        raise refuse(
            "not a whole number of epochs", where, f"{seconds:g} s at step_s = {model.step_s:g}",
            f"write {near:.12g}",
        )  # fmt: skip


def _check_countable(
    model: HybridFaultTree, seconds: float, where: str, *, positive: bool = False
) -> None:
    a_number(seconds, where, positive=positive)
    if not float(seconds) / float(model.step_s) <= MOST_EPOCHS:
        raise refuse(
            "more epochs than can be counted", where, f"{seconds:g} s at {model.step_s:g} s",
            f"at most {MOST_EPOCHS:g} epochs",
        )  # fmt: skip


def _check_names(model: HybridFaultTree) -> frozenset[str]:
    """Names are unique over the model; returns those that a gate can read."""
    seen: dict[str, str] = {}
    for key, kinds in _KINDS.items():
        for i, thing in enumerate(items(getattr(model, key), key)):
            if not isinstance(thing, kinds):
                known = ", ".join(kind.__name__ for kind in kinds)
                raise refuse(
                    f"this is none of the {key}",
                    f"{key}[{i}]",
                    type(thing).__name__,
                    f"one of {known}",
                )
            name = a_name(thing.name, f"{key}[{i}].name")
            if name in seen:
                raise refuse(
                    f"two things have the name {name!r}", f"{key}.{name}", f"also in {seen[name]}",
                    "give each component, source, event and gate a name of its own",
                )  # fmt: skip
            seen[name] = key
    return frozenset(name for name, key in seen.items() if key in ("events", "gates"))


def _known(name: object, names: Collection[str], where: str, kind: str = "event or gate") -> str:
    if not isinstance(name, str) or name not in names:
        raise refuse(f"no {kind} of that name", where, name, nearest(str(name), sorted(names)))
    return name


def _check_source(model: HybridFaultTree, source: MarkovSource) -> None:
    where = f"sources.{source.name}"
    states = items(source.states, f"{where}.states")
    for state in states:
        a_name(state, f"{where}.states")
    if not states:
        raise refuse("a source without states", f"{where}.states", (), "name at least one state")
    check_rows(source.rows, len(states), f"{where}.rows")
    check_law(source.initial, len(states), f"{where}.initial")
    components = [c.name for c in model.components]
    for name in items(source.guard, f"{where}.guard"):
        _known(name, components, f"{where}.guard", "component")
    _check_state_names(source, where)
    _check_on_grid(model, source.first_fix_s, f"{where}.first_fix_s")
    stages = items(source.stages, f"{where}.stages")
    for i, stage in enumerate(stages):
        at = f"{where}.stages[{i}]"
        if not isinstance(stage, Stage):
            raise refuse("no stage", at, type(stage).__name__, "Stage(label, seconds, rows)")
        a_text(stage.label, f"{at}.label")
        _check_on_grid(model, stage.seconds, f"{at}.seconds", positive=True)
        check_rows(stage.rows, len(states), f"{at}.rows")
    if isinstance(source.restart, str):
        a_choice(source.restart, ("stationary", "first", "row1"), f"{where}.restart")
    else:
        check_law(source.restart, len(states), f"{where}.restart")
    a_text(source.source, f"{where}.source")
    if source.restart == "stationary" and source.guard:
        for at, rows in (
            [(f"stages[{i}].rows", s.rows) for i, s in enumerate(stages)]
            or [("rows", source.rows)]
        ):  # fmt: skip
            if not has_one_stationary_law(rows):
                raise refuse(
                    "a restart by the stationary law, but these rows have more than one",
                    f"{where}.{at}", rows, 'restart = "first", "row1" or a law',
                )  # fmt: skip


def _check_state_names(source: MarkovSource, where: str) -> None:
    a_name(source.down, f"{where}.down")
    if source.waiting is not None:
        a_name(source.waiting, f"{where}.waiting")
    for key in ("down", "waiting"):
        name = getattr(source, key)
        if name in source.states:
            raise refuse(
                f"{key} has the name of a state that the source moves among", f"{where}.{key}",
                name, f"give {key} a name of its own and list both in the events that mean both",
            )  # fmt: skip


def _check_event(model: HybridFaultTree, event: Event) -> None:
    where = f"events.{event.name}"
    match event:
        case Failed():
            known = [c.name for c in model.components]
            _known(event.component, known, f"{where}.component", "component")
        case InState():
            sources = {s.name: s for s in model.sources}
            source = sources[_known(event.source, sources, f"{where}.source", "source")]
            known = list(
                dict.fromkeys((*source.states, source.down, source.waiting or source.down))
            )
            for state in items(event.states, f"{where}.states"):
                _known(state, known, f"{where}.states", f"state of {source.name}")
            if not event.states:
                raise refuse("an event of no state", f"{where}.states", (), f"one of {known}")
        case House():
            a_truth(event.value, f"{where}.value")
        case Undeveloped():
            a_number(event.probability, f"{where}.probability", high=1.0)


def _check_gate(model: HybridFaultTree, gate: Gate, names: frozenset[str]) -> None:
    where = f"gates.{gate.name}"
    inputs = items(gate.inputs, f"{where}.inputs")
    for name in inputs:
        _known(name, names, f"{where}.inputs")
    if not inputs:
        raise refuse("a gate without inputs", f"{where}.inputs", (), "name its inputs")
    match gate:
        case AtLeast():
            k = a_whole_number(gate.k, f"{where}.k")
            if not 1 <= k <= len(inputs):
                raise refuse(
                    f"at least {k} of {len(inputs)} inputs", f"{where}.k", k,
                    f"write k from 1 to {len(inputs)}",
                )  # fmt: skip
        case Con():
            if a_whole_number(gate.count, f"{where}.count") < 1:
                raise refuse(
                    "a run has 1 epoch or more", f"{where}.count", gate.count, "count = 1 or more"
                )
        case Dur() | CausalAnd():
            _check_countable(model, gate.seconds, f"{where}.seconds")
            if gate.rule is not None:
                a_choice(gate.rule, get_args(DurationRule), f"{where}.rule")
        case Pand():
            if len(inputs) < 2:
                raise refuse(
                    "an order of one input", f"{where}.inputs", inputs, "name two inputs or more"
                )
            for key in ("latched", "exclusive"):
                if getattr(gate, key) is not None:
                    a_truth(getattr(gate, key), f"{where}.{key}")


def _check_options(model: HybridFaultTree) -> None:
    options = model.options
    if not isinstance(options, Options):
        raise refuse("no options", "options", options, "options = Options()")
    a_choice(options.dur_rule, get_args(DurationRule), "options.dur_rule")
    a_choice(options.mean_rule, get_args(MeanRule), "options.mean_rule")
    a_choice(options.con_gap, ("reset", "hold"), "options.con_gap")
    a_truth(options.pand_latched, "options.pand_latched")
    a_truth(options.pand_exclusive, "options.pand_exclusive")
    known = {n for s in model.sources for n in (*s.states, s.down, s.waiting) if n is not None}
    for state in items(options.hold_states, "options.hold_states"):
        _known(state, known, "options.hold_states", "state of a source")
    if options.con_gap == "hold" and not options.hold_states:
        raise ModelError(
            'con_gap "hold" without the states that it skips',
            where="options.hold_states",
            cure=f"hold_states = some of {', '.join(sorted(known))}",
        )
