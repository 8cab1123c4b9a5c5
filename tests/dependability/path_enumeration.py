"""Every history of a small model with its probability, by the words of the definitions.

No kernel, counter or chain of the package: hardware by the exponential formula, a source by
walking it along. Truth of gates on each history comes from `gate_truth`.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import numpy as np

from sbas.dependability.tree.gate_truth import gate_truth, state_names
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
    Options,
    Or,
    Pand,
    Stage,
    Undeveloped,
)


@dataclass(frozen=True)
class Measured:
    """Measures of one row over all histories."""

    on: np.ndarray
    once: float
    occurrences: float


def by_paths(model: HybridFaultTree) -> dict[str, Measured]:
    """Measures of all events and gates, summed over every history."""
    histories, weights = _histories(model)
    truth = gate_truth(model, histories)
    result = {}
    for name, on in truth.items():
        once = on[:, 1:].any(axis=1)
        rises = (on[:, 1:] & ~on[:, :-1]).sum(axis=1)
        result[name] = Measured(weights @ on, float(weights @ once), float(weights @ rises))
    return result


def _histories(model: HybridFaultTree) -> tuple[dict[str, np.ndarray], np.ndarray]:
    hours = model.step_s / 3600.0
    drawn = [e for e in model.events if isinstance(e, Undeveloped) and e.probability > 0]
    names = [c.name for c in model.components] + [s.name for s in model.sources]
    paths = [((), {}, 1.0)]  # rows of states, waits left, probability
    for n in range(model.epochs + 1):
        grown = []
        for rows, waits, weight in paths:
            last = rows[-1] if rows else None
            for state, wait, p in _next(model, last, waits, n, hours):
                grown.append(((*rows, state), wait, weight * p))
        paths = grown
    table = np.array([rows for rows, _, _ in paths])
    weights = np.array([w for _, _, w in paths])
    histories = {name: table[:, :, i] for i, name in enumerate(names)}
    for event in drawn:
        count = len(weights)
        histories = {name: np.concatenate([h, h]) for name, h in histories.items()}
        held = np.repeat([[0], [1]], count, axis=0) * np.ones((1, model.epochs + 1), dtype=int)
        weights = np.concatenate([weights * (1 - event.probability), weights * event.probability])
        histories[event.name] = held
    return histories, weights


def _next(model, last, waits, n, hours):  # type: ignore[no-untyped-def]
    options = [((), {}, 1.0)]
    for i, c in enumerate(model.components):
        s = c.failure_rate_per_h + c.repair_rate_per_h
        if last is None:
            failed = c.initially_failed
        elif last[i] == 0:
            failed = c.failure_rate_per_h / s * (1 - math.exp(-s * hours)) if s else 0.0
        else:
            failed = 1 - (c.repair_rate_per_h / s * (1 - math.exp(-s * hours)) if s else 0.0)
        options = [
            ((*st, v), w, p * q)
            for st, w, p in options
            for v, q in ((0, 1 - failed), (1, failed))
            if q > 0
        ]
    index = {c.name: i for i, c in enumerate(model.components)}
    for j, source in enumerate(model.sources):
        at = len(model.components) + j
        grown = []
        for st, w, p in options:
            works = all(st[index[name]] == 0 for name in source.guard)
            before = None if last is None else last[at]
            for value, left, q in _moves(model, source, works, before, waits.get(source.name), n):
                grown.append(((*st, value), {**w, source.name: left}, p * q))
        options = grown
    return options


def _moves(model, source, works, before, left, n):  # type: ignore[no-untyped-def]
    names = state_names(source)
    size = len(source.states)
    down, waiting = size, len(names) - 1
    rows = source.rows
    end = 0
    for stage in source.stages:
        rows = stage.rows
        end += round(stage.seconds / model.step_s)
        if n <= end:
            break
    if not works:
        return [(down, None, 1.0)]
    if before is None:
        law = source.initial
    elif before < size:
        law = rows[before]
    else:
        total = round(source.first_fix_s / model.step_s)
        left = total if left is None else left
        if left > 0:
            return [(waiting, left - 1, 1.0)]
        if source.restart == "first":
            law = np.eye(size)[0]
        elif source.restart == "row1":
            law = rows[0]
        elif source.restart == "stationary":
            p = np.array(rows)
            law = np.linalg.lstsq(
                np.vstack([p.T - np.eye(size), np.ones(size)]), np.eye(size + 1)[-1], rcond=None
            )[0]
        else:
            law = source.restart
    return [(i, None, float(q)) for i, q in enumerate(law) if q > 0]


# --- random models ----------------------------------------------------------------------------


def random_model(seed: int) -> HybridFaultTree:
    """A small model with nested gates of all kinds and any options."""
    r = random.Random(seed)
    kind = seed % 5
    components = tuple(
        Component(
            f"c{i}", r.uniform(0.2, 1.0), r.choice((0.0, r.uniform(0.2, 1.5))),
            r.choice((0.0, 0.0, r.uniform(0.1, 0.9))),
        )
        for i in range((2, 3, 1, 0, 2)[kind])
    )  # fmt: skip
    sources = (_random_source(r, components, 2 if kind == 4 else r.choice((2, 3))),)
    sources = sources if kind >= 2 else ()
    events: list[Event] = [Failed(f"e{c.name}", c.name) for c in components]
    for s in sources:
        events += [InState("s0", "s", (s.states[-1],)), InState("s1", "s", ("b", "down"))]
    if r.random() < 0.3:
        events.append(r.choice((House("h", r.random() < 0.5), Undeveloped("u", 0.3))))
    names = [e.name for e in events]
    gates: list[Gate] = []
    for i in range(r.randint(3, 6)):
        gates.append(_random_gate(r, f"g{i}", names))
        names.append(f"g{i}")
    epochs = {0: 6, 1: 4, 2: 6, 3: 8, 4: 4}[kind]
    hold = bool(sources) and r.random() < 0.3
    options = Options(
        r.choice(("age", "count", "strict")), r.random() < 0.3, r.random() < 0.4,
        "hold" if hold else "reset", ("down", "b") if hold else (),
    )  # fmt: skip
    return HybridFaultTree(
        f"random {seed}", 3600.0, 3600.0 * epochs, components, sources, tuple(events),
        tuple(gates), names[-1], (), options,
    )  # fmt: skip


def _random_rows(r: random.Random, size: int) -> tuple[tuple[float, ...], ...]:
    rows = []
    for i in range(size):
        w = [r.random() if r.random() < 0.8 or j == (i + 1) % size else 0.0 for j in range(size)]
        rows.append(tuple(v / sum(w) for v in w))
    return tuple(rows)


def _random_source(r: random.Random, components: tuple[Component, ...], size: int) -> MarkovSource:
    rows, later = _random_rows(r, size), _random_rows(r, size)
    staged = (Stage("x", 7200.0, rows), Stage("y", 7200.0, later))
    return MarkovSource(
        "s", ("a", "b", "c")[:size], rows, r.choice((rows[0], (1.0, *([0.0] * (size - 1))))),
        tuple(c.name for c in components if r.random() < 0.8), "down",
        3600.0 * r.choice((0, 1, 2)),
        r.choice(("stationary", "first", "row1", rows[-1])),
        r.choice((None, "waiting")), staged if r.random() < 0.3 else (),
    )  # fmt: skip


def _random_gate(r: random.Random, name: str, names: list[str]) -> Gate:
    def some(low: int, high: int) -> tuple[str, ...]:
        return tuple(r.sample(names, min(len(names), r.randint(low, high))))

    seconds = 3600.0 * r.choice((0.0, 0.5, 1.0, 2.0))
    match r.choice(("or", "and", "not", "k", "con", "dur", "cand", "pand", "pand")):
        case "or":
            return Or(name, some(1, 3))
        case "and":
            return And(name, some(1, 3))
        case "not":
            return Not(name, r.choice(names))
        case "k":
            inputs = some(2, 4)
            return AtLeast(name, r.randint(1, len(inputs)), inputs)
        case "con":
            return Con(name, r.randint(1, 4), r.choice(names))
        case "dur":
            return Dur(name, seconds, r.choice(names), r.choice((None, "count", "strict")))
        case "cand":
            return CausalAnd(name, seconds, some(1, 3))
    inputs = tuple(r.choice(names) for _ in range(r.choice((2, 2, 3))))
    return Pand(name, inputs, r.choice((None, True, False)), r.choice((None, True, False)))
