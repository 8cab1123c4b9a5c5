"""What was modelled: components, receiver, readings of open points, and which software answered."""

from __future__ import annotations

import platform
from dataclasses import fields
from importlib.metadata import version

from sbas.dependability.questions import Dependability
from sbas.dependability.tree.model import HybridFaultTree, MarkovSource, Options
from sbas.numerals import count, hours, number
from sbas.reporting.content import Cell, Section, Table, table

_SOFTWARE = ("sbas", "numpy", "scipy", "pandas", "matplotlib")
_OPTIONS = {
    "dur_rule": "when DUR and causal AND begin to be true; a gate's own rule goes first",
    "pand_latched": "a PAND stays true once it was",
    "pand_exclusive": "for a PAND simultaneous onsets are no order",
    "con_gap": "what a CON does at an epoch without a state",
    "hold_states": "states in which a CON holds its count",
    "mean_rule": "epochs over which a mean is taken",
}


def section(answer: Dependability) -> Section:
    """Tables of the model; what differs between environments stands once for each."""
    models = {name: s.model for name, s in answer.solutions.items()}
    first = next(iter(models.values()))
    several = len(models) > 1
    receivers = [
        (name if several else "", source) for name, m in models.items() for source in m.sources
    ]
    tables = [_missions(models), _components(models)] if first.components else [_missions(models)]
    tables += [_rows(where, source) for where, source in receivers]
    return Section(
        "model",
        "Model",
        paragraphs=(
            "Sources tell where each figure comes from; a figure without one is claimed by the "
            "model file.",
        ),
        tables=(*tables, _options(models), _software()),
    )


def _missions(models: dict[str, HybridFaultTree]) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (
            name, model.name, hours(model.mission_s / 3600), f"{model.step_s:g}",
            count(model.epochs), model.top, ", ".join(model.cases) or "none",
        )
        for name, model in models.items()
    ]  # fmt: skip
    return table("Mission", "Environment|Model|Mission|#Epoch [s]|#Epochs|Top|Cases", rows)


def _components(models: dict[str, HybridFaultTree]) -> Table:
    rows: dict[tuple[str, ...], list[str]] = {}
    for name, model in models.items():
        for c in model.components:
            repair = number(c.repair_rate_per_h) if c.repair_rate_per_h else "never repaired"
            cells = (c.name, number(c.failure_rate_per_h), repair, number(c.initially_failed),
                     c.source or "none given")  # fmt: skip
            rows.setdefault(cells, []).append(name)
    return table(
        "Components",
        "Component|#Failures [1/h]|#Repairs [1/h]|#Failed at the start [1]|Source|Environments",
        [(*cells, "all" if len(names) == len(models) else ", ".join(names))
         for cells, names in rows.items()],
    )  # fmt: skip


def _rows(environment: str, source: MarkovSource) -> Table:
    stages = [(stage.label, stage.rows) for stage in source.stages] or [("", source.rows)]
    named = len(set(source.states)) < len(source.states)
    heads = [f"{s} {i + 1}" if named else s for i, s in enumerate(source.states)]
    rows: list[tuple[Cell | str, ...]] = []
    shown = len(heads) <= _MOST_STATES
    for label, matrix in stages if shown else ():
        rows += [
            (f"{label} {head}".strip(), *(number(p, 6) for p in row))
            for head, row in zip(heads, matrix, strict=True)
        ]
    notes = [f"Source: {source.source or 'none given'}."]
    if not shown:
        notes.insert(0, f"{len(heads)} states (phases by age): too many to print.")
    if source.guard:
        restart = source.restart if isinstance(source.restart, str) else "a law of its own"
        notes.append(
            f"In state {source.down} unless {' and '.join(source.guard)} work; after that "
            f"{source.waiting or source.down} for {source.first_fix_s:g} s, then restart: "
            f"{restart}."
        )
    where = f", {environment}" if environment else ""
    return table(
        f"Source {source.name}{where}: probability of the next state, one epoch on",
        "|".join(["From", *(f"#{head}" for head in heads)] if shown else ["From"]),
        rows,
        *notes,
    )


_MOST_STATES = 8


def _options(models: dict[str, HybridFaultTree]) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    for field in fields(Options):
        readings: dict[str, list[str]] = {}
        for name, model in models.items():
            readings.setdefault(_reading(getattr(model.options, field.name)), []).append(name)
        words = [
            reading if len(readings) == 1 else f"{reading} ({', '.join(names)})"
            for reading, names in readings.items()
        ]
        rows.append((field.name, "; ".join(words), _OPTIONS[field.name]))
    return table("Options: how open points are read", "Option|Reading|Meaning", rows)


def _reading(value: bool | str | tuple[str, ...]) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return value if isinstance(value, str) else ", ".join(value) or "none"


def _software() -> Table:
    rows: list[tuple[Cell | str, ...]] = [("Python", platform.python_version())]
    rows += [(name, version(name)) for name in _SOFTWARE]
    return table("Software", "Program|Version", rows)
