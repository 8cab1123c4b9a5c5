"""Which components are made to fail, so that a simulation sees what is rare.

Histories are divided by the set of components that fail at least once. A set has an exact
probability, its weight; within it the first failures are drawn given that they happen.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.simulation.simulation_result import Stratum
from sbas.dependability.simulation.slot_program import restart_law
from sbas.dependability.tree.durations import duration_epochs
from sbas.dependability.tree.model import (
    AtLeast,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    Gate,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
    Undeveloped,
)
from sbas.dependability.tree.model_check import in_order
from sbas.exceptions import InputError

RARE = 0.1
"""A component that fails with more than this probability is seen often enough without force."""

MOST_STRATA = 64
LEAST_HISTORIES = 50
"""In a stratum that is chosen automatically, on average."""

NEGLIGIBLE = 1e-6
"""Weight that the automatic choice may leave undrawn; it is reported in `unsampled`."""

MOST_NAMED = 10
"""Components in a `force`: all their subsets are looked at."""


def failure_probability(component: Component, mission_s: float) -> float:
    """Probability of at least one failure of a component that works at the start [1].

    Parameters
    ----------
    component : with a failure rate alpha [1/h].
    mission_s : T [s].

    Notes
    -----
    1 - exp(-alpha T): exact in continuous time.
    """
    return -math.expm1(-component.failure_rate_per_h * mission_s / 3600.0)


def choose_strata(
    model: HybridFaultTree, histories: int, force: Iterable[Collection[str]] | None
) -> tuple[tuple[Stratum, ...], NDArray[np.bool_], NDArray[np.float64]]:
    """Divide histories by the components that fail.

    Parameters
    ----------
    model : checked.
    histories : to be drawn in all, about: half go by weight, half in equal parts.
    force : sets of components; None chooses them.

    Returns
    -------
    Strata; (strata, rows) whether a row can be true there; (rows,) weight not drawn of sets in
    which the row can be true. Rows are events and gates, inputs first. A set in which no row can
    be true is left out: all its means are 0.

    Raises
    ------
    InputError : a set names no component, one twice, or one that may be failed at the start.
    """
    chances = {c.name: failure_probability(c, model.mission_s) for c in model.components}
    if force is None:
        named, sets, unsampled = _automatic(model, chances, histories)
    else:
        named, sets = _checked(model, [tuple(part) for part in force])
        unsampled = 0.0
    drawn = {frozenset(part) for part in sets}
    missed = np.full(len(model.events) + len(model.gates), unsampled)
    if force is not None:
        for part in _subsets(named, len(named)):
            if frozenset(part) not in drawn:
                missed += _weight(part, named, chances) * _can_be_true(model, part, named)
    found, possible = [], []
    for part in sets:
        rows = _can_be_true(model, part, named)
        weight = _weight(part, named, chances)
        if rows.any() and weight > 0.0:
            never = tuple(name for name in named if name not in part)
            found.append(Stratum(tuple(part), never, weight, 0))
            possible.append(rows)
    if not found:
        return (), np.zeros((0, len(missed)), np.bool_), missed
    return _allocated(found, histories), np.array(possible), missed


def _automatic(
    model: HybridFaultTree, chances: dict[str, float], histories: int
) -> tuple[list[str], list[tuple[str, ...]], float]:
    """Rare components, all their sets up to a size, and the probability of larger sets."""
    named = sorted(
        (c.name for c in model.components
         if c.initially_failed == 0.0 and 0.0 < chances[c.name] <= RARE),
        key=lambda name: chances[name],
    )  # fmt: skip
    limit = min(MOST_STRATA, max(1, histories // LEAST_HISTORIES))
    while named:
        size = len(named)
        while size and sum(math.comb(len(named), i) for i in range(size + 1)) > limit:
            size -= 1
        rest = _more_than(size, [chances[name] for name in named])
        if size and rest <= NEGLIGIBLE:
            return named, list(_subsets(named, size)), rest
        named.pop()
    return [], [()], 0.0


def _checked(
    model: HybridFaultTree, sets: list[tuple[str, ...]]
) -> tuple[list[str], list[tuple[str, ...]]]:
    """Named components in the order of the model, and the sets (the empty one for none)."""
    known = {c.name: c for c in model.components}
    for part in sets:
        for name in part:
            if name not in known or part.count(name) > 1:
                raise InputError(
                    "a set of forced failures names components, each once", where="force",
                    evidence=repr(part), cure=f"some of {', '.join(known)}",
                )  # fmt: skip
            component = known[name]
            if component.initially_failed or not component.failure_rate_per_h:
                raise InputError(
                    "only a component that works at the start and can fail is forced to fail",
                    where="force", evidence=name,
                )  # fmt: skip
    if len({frozenset(part) for part in sets}) != len(sets):
        raise InputError("a set of forced failures stands twice", where="force")
    used = {name for part in sets for name in part}
    if len(used) > MOST_NAMED:
        raise InputError(
            f"forced failures of more than {MOST_NAMED} components", where="force",
            evidence=f"{len(used)} components", cure="leave the likely ones free",
        )  # fmt: skip
    return [name for name in known if name in used], sets or [()]


def _subsets(names: Sequence[str], size: int) -> Iterator[tuple[str, ...]]:
    for i in range(size + 1):
        yield from itertools.combinations(names, i)


def _weight(part: Collection[str], named: Sequence[str], chances: dict[str, float]) -> float:
    fails = math.prod(chances[name] for name in named if name in part)
    return fails * math.exp(math.fsum(math.log1p(-chances[n]) for n in named if n not in part))


def _more_than(size: int, chances: Sequence[float]) -> float:
    """Probability that more than `size` of independent events happen, without subtraction."""
    counts = np.zeros(len(chances) + 1)
    counts[0] = 1.0
    for p in chances:
        counts[1:] = counts[1:] * (1.0 - p) + counts[:-1] * p
        counts[0] *= 1.0 - p
    return float(counts[size + 1 :].sum())


def _allocated(strata: list[Stratum], histories: int) -> tuple[Stratum, ...]:
    total = math.fsum(stratum.weight for stratum in strata)
    return tuple(
        Stratum(
            s.failing, s.never, s.weight,
            max(2, round(histories * (0.5 * s.weight / total + 0.5 / len(strata)))),
        )
        for s in strata
    )  # fmt: skip


# --- what can be true where -------------------------------------------------------------------


def _can_be_true(
    model: HybridFaultTree, failing: Collection[str], named: Collection[str]
) -> NDArray[np.bool_]:
    """(rows,) False only where a row is impossible while the others of `named` do not fail."""
    breakable = {
        c.name
        for c in model.components
        if c.name in failing
        or c.initially_failed > 0.0
        or (c.name not in named and c.failure_rate_per_h > 0.0)
    }
    seen = {s.name: _reachable(s, breakable) for s in model.sources}
    true, false = dict[str, bool](), dict[str, bool]()
    for event in model.events:
        true[event.name] = false[event.name] = True
        match event:
            case Failed():
                true[event.name] = event.component in breakable
            case InState():
                true[event.name] = not seen[event.source].isdisjoint(event.states)
                false[event.name] = not seen[event.source] <= set(event.states)
            case House():
                true[event.name], false[event.name] = event.value, not event.value
            case Undeveloped():
                true[event.name] = event.probability > 0.0
                false[event.name] = event.probability < 1.0
    for gate in in_order(model):
        true[gate.name], false[gate.name] = _gate_values(
            model, gate, [true[n] for n in gate.inputs], [false[n] for n in gate.inputs]
        )
    return np.array(list(true.values()), np.bool_)


def _reachable(source: MarkovSource, breakable: Collection[str]) -> set[str]:
    profile = [stage.rows for stage in source.stages] or [source.rows]
    found = np.asarray(source.initial) > 0.0
    stops = any(name in breakable for name in source.guard)
    if stops:
        for rows in profile:
            found |= restart_law(source, rows) > 0.0
    moves = np.any(np.asarray(profile) > 0.0, axis=0)
    for _ in source.states:
        found |= found @ moves
    names = {name for name, is_found in zip(source.states, found, strict=True) if is_found}
    return names | ({source.down, source.waiting or source.down} if stops else set())


def _gate_values(
    model: HybridFaultTree, gate: Gate, true: list[bool], false: list[bool]
) -> tuple[bool, bool]:
    """Whether a gate can be true and can be false, given that of its inputs."""
    match gate:
        case Or():
            return any(true), all(false)
        case Not():
            return false[0], true[0]
        case AtLeast():
            return sum(true) >= gate.k, sum(false) > len(false) - gate.k
        case Con():
            return all(true) and gate.count <= model.epochs + 1, True
        case Dur() | CausalAnd():
            rule = gate.rule or model.options.dur_rule
            epochs = duration_epochs(gate.seconds, model.step_s, rule)
            return all(true) and epochs <= model.epochs + 1, True
        case _:
            return all(true), True
