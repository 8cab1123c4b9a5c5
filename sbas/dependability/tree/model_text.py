"""A model as people read it: an indented tree in plain text, tables and a tree in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields

from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Con,
    Dur,
    Event,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    Not,
    Or,
    Pand,
    Undeveloped,
)
from sbas.dependability.tree.model_check import in_order


def model_text(model: HybridFaultTree) -> str:
    """Name, mission, options, the tree below the top with delays and rates, sources, notes.

    Parameters
    ----------
    model : sound by `check_model`.

    Returns
    -------
    Lines of text. A gate that occurs more than once is written out at its first place; gates and
    events without effect on the top follow it.
    """
    lines = [
        model.name,
        f"mission {model.mission_s:.12g} s, {model.epochs} epochs of {model.step_s:.12g} s",
        "options: " + ", ".join(f"{key} = {value}" for key, value in _options(model)),
        f"cases: {', '.join(model.cases) or 'none'}",
        "",
        *("  " * depth + line for depth, line in _tree(model)),
    ]
    for source in model.sources:
        lines += ["", _source_line(model, source.name)]
        for label, rows in _matrices(model, source.name):
            lines += ["  " + label, *("    " + " ".join(f"{p:.10g}" for p in row) for row in rows)]
    if model.notes:
        lines += ["", "notes", *(f"  {note}" for note in model.notes)]
    return "\n".join(lines) + "\n"


def model_markdown(model: HybridFaultTree) -> str:
    """The same as Markdown: tables of components and options, the tree as a list, matrices.

    Parameters
    ----------
    model : sound by `check_model`.
    """
    lines = [
        f"# {_md(model.name)}",
        "",
        f"Mission {model.mission_s:.12g} s, {model.epochs} epochs of {model.step_s:.12g} s. "
        f"Cases: {', '.join(_md(case) for case in model.cases) or 'none'}.",
        "",
        "## Tree",
        "",
        *("  " * depth + "- " + _md(line) for depth, line in _tree(model)),
    ]
    if model.components:
        lines += ["", "## Components", ""]
        lines += _table(
            ("component", "failure rate, 1/h", "repair rate, 1/h", "failed at start", "source"),
            (
                (c.name, f"{c.failure_rate_per_h:.6g}", f"{c.repair_rate_per_h:.6g}",
                 f"{c.initially_failed:.6g}", c.source)
                for c in model.components
            ),
        )  # fmt: skip
    for source in model.sources:
        lines += ["", f"## Source {_md(source.name)}", "", _md(_source_line(model, source.name))]
        for label, rows in _matrices(model, source.name):
            body = [
                (name, *(f"{p:.10g}" for p in row))
                for name, row in zip(source.states, rows, strict=True)
            ]
            lines += ["", *_table((label, *source.states), body)]
    lines += ["", "## Options", "", *_table(("option", "reading"), _options(model))]
    if model.notes:
        lines += ["", "## Notes", "", *(f"- {_md(note)}" for note in model.notes)]
    return "\n".join(lines) + "\n"


# --- tree -------------------------------------------------------------------------------------


def _tree(model: HybridFaultTree) -> Iterable[tuple[int, str]]:
    """Depth and words of each line, from the top down, then what has no effect on it."""
    gates = {gate.name: gate for gate in reversed(in_order(model))}
    events = {event.name: event for event in model.events}
    written: set[str] = set()
    for start in (model.top, *gates, *events):
        if start in written:
            continue
        depth = 0
        if start != model.top:
            yield 0, "without effect on the top:"
            depth = 1
        stack = [(depth, start)]
        while stack:
            depth, name = stack.pop()
            if name in events:
                yield depth, f"{name}: {_event_words(model, events[name])}"
            elif name in written:
                yield depth, f"{name}: see above"
            else:
                yield depth, f"{name}: {_gate_words(model, gates[name])}"
                stack += [(depth + 1, below) for below in reversed(gates[name].inputs)]
            written.add(name)


def _event_words(model: HybridFaultTree, event: Event) -> str:
    match event:
        case Failed():
            part = next(c for c in model.components if c.name == event.component)
            repair = f"repair {part.repair_rate_per_h:.6g}/h"
            repaired = repair if part.repair_rate_per_h else "not repaired"
            return f"{part.name} failed ({part.failure_rate_per_h:.6g}/h, {repaired})"
        case InState():
            return f"{event.source} {' or '.join(event.states)}"
        case House():
            return "always" if event.value else "never"
        case Undeveloped():
            p = event.probability
            return "not analysed" + (f", {p:.6g} a mission" if p else ", taken as never")


def _gate_words(model: HybridFaultTree, gate: Gate) -> str:
    match gate:
        case Or():
            return "OR"
        case And():
            return "AND"
        case Not():
            return "NOT"
        case AtLeast():
            return f"{gate.k} of {len(gate.inputs)}"
        case Con():
            return f"CON, {gate.count} consecutive epochs"
        case Dur() | CausalAnd():
            kind = "DUR" if isinstance(gate, Dur) else "causal AND"
            return f"{kind}, {gate.seconds:.12g} s by {gate.rule or model.options.dur_rule!r}"
        case Pand():
            latched = model.options.pand_latched if gate.latched is None else gate.latched
            exclusive = model.options.pand_exclusive if gate.exclusive is None else gate.exclusive
            words = ("latched" if latched else "current", "exclusive" if exclusive else "inclusive")
            return f"PAND, {', '.join(words)}"


# --- tables -----------------------------------------------------------------------------------


def _options(model: HybridFaultTree) -> list[tuple[str, str]]:
    found = []
    for field in fields(model.options):
        value = getattr(model.options, field.name)
        found.append((field.name, " ".join(value) or "none" if value == () else str(value)))
    return found


def _source_line(model: HybridFaultTree, name: str) -> str:
    source = next(s for s in model.sources if s.name == name)
    start = ", ".join(
        f"{state} {p:.6g}" for state, p in zip(source.states, source.initial, strict=True) if p
    )
    words = [f"source {name}: starts {start}"]
    if source.guard:
        restart = source.restart if isinstance(source.restart, str) else list(source.restart)
        words.append(
            f"{source.down} unless {' and '.join(source.guard)} work, then "
            f"{source.waiting or source.down} for {source.first_fix_s:.12g} s, restart {restart}"
        )
    return "; ".join((*words, *((source.source,) if source.source else ())))


def _matrices(
    model: HybridFaultTree, name: str
) -> Iterable[tuple[str, tuple[tuple[float, ...], ...]]]:
    source = next(s for s in model.sources if s.name == name)
    if not source.stages:
        yield f"from {' '.join(source.states)}, a row each, in one epoch", source.rows
    for stage in source.stages:
        yield f"{stage.label}, {stage.seconds:.12g} s", stage.rows


def _md(text: str) -> str:
    """Text in which Markdown finds no markup of its own."""
    for mark in "\\`*_{}[]<>#|":
        text = text.replace(mark, "\\" + mark)
    return text.replace("\n", " ")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    return [
        "| " + " | ".join(_md(cell) for cell in row) + " |"
        for row in (head, ["---"] * len(head), *rows)
    ]
