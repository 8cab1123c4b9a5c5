"""What a sound model says that its author may not have meant."""

from __future__ import annotations

import math
from collections.abc import Iterable

from sbas.dependability.tree.durations import duration_epochs, whole_epochs
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
    MarkovSource,
    Not,
    Or,
    Pand,
    Undeveloped,
)
from sbas.findings import Finding

_WARNING = "E28"
_REPAIR = "E26"


def warnings_of(model: HybridFaultTree, ordered: tuple[Gate, ...]) -> tuple[Finding, ...]:
    """Findings of a model without errors; `ordered` are its gates, inputs first."""
    return (
        *_off_the_grid(model),
        *_without_effect(model, ordered),
        *_not_analysed(model),
        *_constant(model, ordered),
        *_misprint(model),
        *_held_in_vain(model),
        *_profile_length(model),
        *_completed(model),
    )


def _warning(message: str, where: str, evidence: str = "", cure: str = "") -> Finding:
    return Finding(_WARNING, "warning", message, where=where, evidence=evidence, cure=cure)


def _off_the_grid(model: HybridFaultTree) -> Iterable[Finding]:
    for gate in model.gates:
        if isinstance(gate, Dur | CausalAnd) and whole_epochs(gate.seconds, model.step_s) is None:
            rule = gate.rule or model.options.dur_rule
            epochs = duration_epochs(gate.seconds, model.step_s, rule)
            yield _warning(
                "a delay is not a multiple of the epoch",
                f"gates.{gate.name}.seconds",
                f"{gate.seconds:g} s at {model.step_s:g} s: {epochs} epochs by {rule!r}",
                "choose step_s so that it divides every delay",
            )


def _without_effect(model: HybridFaultTree, ordered: tuple[Gate, ...]) -> Iterable[Finding]:
    reached = {model.top}
    for gate in reversed(ordered):
        if gate.name in reached:
            reached.update(gate.inputs)
    for key, things in (("events", model.events), ("gates", model.gates)):
        for thing in things:
            if thing.name not in reached:
                yield _warning(
                    f"{thing.name} has no effect on the top",
                    f"{key}.{thing.name}",
                    f"the top is {model.top}",
                    "name it among the inputs of a gate, or take it out",
                )


def _not_analysed(model: HybridFaultTree) -> Iterable[Finding]:
    for event in model.events:
        if isinstance(event, Undeveloped):
            taken = (
                f"drawn once a mission with probability {event.probability:g}"
                if event.probability
                else "taken as never"
            )
            yield _warning(
                f"{event.name} is not analysed", f"events.{event.name}", taken,
                "every result is without its causes",
            )  # fmt: skip


# --- gates that never change ------------------------------------------------------------------


def _constant(model: HybridFaultTree, ordered: tuple[Gate, ...]) -> Iterable[Finding]:
    components = {c.name: c for c in model.components}
    sources = {s.name: s for s in model.sources}
    fixed = {e.name: _fixed_event(e, components, sources) for e in model.events}
    for gate in ordered:
        fixed[gate.name] = _fixed_gate(model, gate, [fixed[name] for name in gate.inputs])
        if fixed[gate.name] is not None:
            yield _warning(
                f"{gate.name} is {'always' if fixed[gate.name] else 'never'} true in the mission",
                f"gates.{gate.name}",
            )


def _fixed_event(
    event: Event, components: dict[str, Component], sources: dict[str, MarkovSource]
) -> bool | None:
    match event:
        case Failed():
            component = components[event.component]
            if component.initially_failed == 1.0 and component.repair_rate_per_h == 0.0:
                return True
            never = component.failure_rate_per_h == component.initially_failed == 0.0
            return False if never else None
        case InState():
            source = sources[event.source]
            possible = set(source.states)
            if source.guard:
                possible |= {source.down, source.waiting or source.down}
            if possible <= set(event.states):
                return True
            return None if possible & set(event.states) else False
        case House():
            return event.value
        case Undeveloped():
            return bool(event.probability) if event.probability in (0.0, 1.0) else None


def _fixed_gate(model: HybridFaultTree, gate: Gate, inputs: list[bool | None]) -> bool | None:
    match gate:
        case Or() | And() | AtLeast():
            n = len(inputs)
            k = gate.k if isinstance(gate, AtLeast) else 1 if isinstance(gate, Or) else n
            if inputs.count(True) >= k:
                return True
            return False if inputs.count(False) > n - k else None
        case Not():
            return None if inputs[0] is None else not inputs[0]
        case Con():
            return _fixed_run(model, gate.count, inputs)
        case Dur() | CausalAnd():
            rule = gate.rule or model.options.dur_rule
            return _fixed_run(model, duration_epochs(gate.seconds, model.step_s, rule), inputs)
        case Pand():
            exclusive = model.options.pand_exclusive if gate.exclusive is None else gate.exclusive
            if False in inputs or (exclusive and len(set(gate.inputs)) < len(gate.inputs)):
                return False
            if None in inputs:
                return None
            return not exclusive


def _fixed_run(model: HybridFaultTree, epochs: int, inputs: list[bool | None]) -> bool | None:
    """A run of so many epochs: never true if there are not so many, always from the first on."""
    if False in inputs or epochs > model.epochs + 1:
        return False
    return True if epochs == 1 and None not in inputs else None


# --- readings ---------------------------------------------------------------------------------


def _misprint(model: HybridFaultTree) -> Iterable[Finding]:
    """CON_k and a PAND or AND that ends in CON_l of the same event, l >= k: it adds nothing."""
    runs = {g.name: g for g in model.gates if isinstance(g, Con)}
    parents = [set(g.inputs) for g in model.gates if isinstance(g, Or)]
    for gate in model.gates:
        if not isinstance(gate, Pand | And):
            continue
        for long in (runs[name] for name in gate.inputs if name in runs):
            for short in runs.values():
                beside = any({gate.name, short.name} <= inputs for inputs in parents)
                if beside and short.input == long.input and long.count >= short.count:
                    yield _warning(
                        f"{gate.name} adds nothing to {short.name}: its run is not shorter",
                        f"gates.{long.name}.count",
                        f"l = {long.count}, k = {short.count}; Table I of Nguyen, Beugin, Marais "
                        "2013 prints k = 2 and l = 6 by mistake: its text demands k > l",
                        f"write a count below {short.count}, in the paper's system k = 6, l = 2",
                    )


def _held_in_vain(model: HybridFaultTree) -> Iterable[Finding]:
    if model.options.con_gap != "hold":
        return
    sources = {s.name: s for s in model.sources}
    held = {
        e.name
        for e in model.events
        if isinstance(e, InState)
        and {*sources[e.source].states, sources[e.source].down, sources[e.source].waiting}
        & set(model.options.hold_states)
    }
    for gate in model.gates:
        if isinstance(gate, Con) and gate.input not in held:
            yield _warning(
                f"{gate.name} skips no epoch: its input is no state of a source that is held",
                f"gates.{gate.name}.input",
                f"con_gap = 'hold', hold_states = {list(model.options.hold_states)}",
            )


def _profile_length(model: HybridFaultTree) -> Iterable[Finding]:
    for source in model.sources:
        total_s = math.fsum(stage.seconds for stage in source.stages)
        if source.stages and whole_epochs(total_s, model.step_s) != model.epochs:
            yield _warning(
                "the profile is not as long as the mission",
                f"sources.{source.name}.stages",
                f"{total_s:g} s, the mission {model.mission_s:g} s: "
                + ("its end is cut off" if total_s > model.mission_s else "its last stage goes on"),
            )


def _completed(model: HybridFaultTree) -> Iterable[Finding]:
    for source in model.sources:
        laws = [*source.rows, source.initial, *(r for s in source.stages for r in s.rows)]
        if not isinstance(source.restart, str):
            laws.append(source.restart)
        off = [abs(math.fsum(law) - 1.0) for law in laws]
        # Laws written with all digits still sum to 1 only within the rounding of their entries.
        repaired = [d for d in off if d > 1e-15]
        if repaired:
            yield Finding(
                _REPAIR,
                "info",
                "the largest entry of each law is taken as what the others leave",
                where=f"sources.{source.name}",
                evidence=f"{len(repaired)} of {len(laws)} laws, by up to {max(repaired):.1e}",
            )
