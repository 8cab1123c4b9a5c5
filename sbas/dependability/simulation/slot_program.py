"""A hybrid fault tree as the flat arrays that the compiled simulation kernel interprets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.dependability.tree.durations import duration_epochs, whole_epochs
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
    MarkovSource,
    Not,
    Or,
    Pand,
    Undeveloped,
)
from sbas.dependability.tree.model_check import in_order

if TYPE_CHECKING:
    from sbas.dependability.simulation.slot_kernel import SlotProgram


def stationary_law(rows: ArrayLike) -> NDArray[np.float64]:
    """Law that one step leaves unchanged.

    Parameters
    ----------
    rows : (s, s) with one stationary law.

    Notes
    -----
    Elimination of states without subtraction keeps the digits of rare states.

    References
    ----------
    Grassmann, Taksar, Heyman 1985; transient states (no way out of the rest) get 0.
    """
    p = np.array(rows, dtype=np.float64)
    size = len(p)
    kept = _recurrent(p)
    q = p[np.ix_(kept, kept)]
    for k in range(len(kept) - 1, 0, -1):
        q[:k, k] /= q[k, :k].sum()
        q[:k, :k] += np.outer(q[:k, k], q[k, :k])
    weights = np.ones(len(kept))
    for k in range(1, len(kept)):
        weights[k] = weights[:k] @ q[:k, k]
    law: NDArray[np.float64] = np.zeros(size)
    law[kept] = weights / weights.sum()
    return law


def _recurrent(p: NDArray[np.float64]) -> NDArray[np.intp]:
    """States that every state they lead to leads back to."""
    reach: NDArray[np.bool_] = (p > 0.0) | np.eye(len(p), dtype=bool)
    for _ in range(len(p).bit_length()):
        reach = reach @ reach
    back: NDArray[np.bool_] = ~reach | reach.T
    return np.flatnonzero(back.all(axis=1))


def restart_law(source: MarkovSource, rows: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """Law of the state after the first-fix wait while the source moves by `rows`.

    A source without guard never waits, so its rows may have more than one stationary law.
    """
    first: NDArray[np.float64] = np.zeros(len(rows))
    first[0] = 1.0
    match source.restart:
        case "stationary":
            return stationary_law(rows) if source.guard else first
        case "first":
            return first
        case "row1":
            return np.asarray(rows[0], dtype=np.float64)
        case law:
            return np.asarray(law, dtype=np.float64)


class _Laws:
    def __init__(self) -> None:
        self.start, self.state, self.cut = [0], list[int](), list[float]()

    def add(self, law: ArrayLike) -> int:
        """Number of a law: its likeliest state gets what the others leave of 1."""
        p = np.asarray(law, dtype=np.float64)
        order = [int(i) for i in np.argsort(-p, kind="stable") if p[i] > 0.0]
        rest = np.cumsum(p[order][::-1])[::-1]
        self.state += order
        self.cut += [*rest[1:].tolist(), 0.0]
        self.start.append(len(self.state))
        return len(self.start) - 2


def _csr(lists: Sequence[Sequence[int]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    start = np.cumsum([0, *map(len, lists)], dtype=np.int64)
    return start, np.array([x for part in lists for x in part], dtype=np.int64)


def hold_of(model: HybridFaultTree, gate: Con) -> InState | None:
    """Event that suspends the run of a CON under `con_gap` "hold", None where nothing does."""
    if model.options.con_gap != "hold":
        return None
    for event in model.events:
        if event.name == gate.input and isinstance(event, InState):
            source = next(s for s in model.sources if s.name == event.source)
            known = {*source.states, source.down, source.waiting}
            states = tuple(s for s in model.options.hold_states if s in known)
            return InState(f"{gate.name}\0held", event.source, states) if states else None
    return None


def compile_model(model: HybridFaultTree) -> tuple[SlotProgram, dict[str, int]]:
    """Flatten a checked model.

    Returns
    -------
    The program, and the node of each event and gate, inputs first.
    """
    from sbas.dependability.simulation.slot_kernel import SlotProgram

    component_of = {c.name: i for i, c in enumerate(model.components)}
    per_epoch = model.step_s / 3600.0
    laws = _Laws()
    stages = [_stages(model, source, laws) for source in model.sources]
    initial = [laws.add(source.initial) for source in model.sources]
    waits = [whole_epochs(source.first_fix_s, model.step_s) for source in model.sources]
    guard_start, guard = _csr([[component_of[c] for c in s.guard] for s in model.sources])
    nodes, rows = _nodes(model, component_of)
    program = SlotProgram(
        epochs=model.epochs,
        failure_rate=np.array([c.failure_rate_per_h * per_epoch for c in model.components]),
        repair_rate=np.array([c.repair_rate_per_h * per_epoch for c in model.components]),
        failed_at_start=np.array([c.initially_failed for c in model.components], np.float64),
        guard_start=guard_start,
        guard=guard,
        states=np.array([len(s.states) for s in model.sources], np.int64),
        wait_epochs=np.array(waits, np.int64),
        initial_law=np.array(initial, np.int64),
        stage_start=np.cumsum([0, *map(len, stages)], dtype=np.int64),
        stage_end=np.array([stage[0] for part in stages for stage in part], np.int64),
        stage_rows=np.array([stage[1] for part in stages for stage in part], np.int64),
        stage_restart=np.array([stage[2] for part in stages for stage in part], np.int64),
        law_start=np.array(laws.start, np.int64),
        law_state=np.array(laws.state, np.int64),
        law_cut=np.array(laws.cut, np.float64),
        **nodes,
    )
    return program, rows


def _stages(
    model: HybridFaultTree, source: MarkovSource, laws: _Laws
) -> list[tuple[int, int, int]]:
    """Of each stage: last epoch that it moves, its first row law, its restart law."""
    from sbas.dependability.simulation.slot_kernel import FAR

    profile = [(s.seconds, s.rows) for s in source.stages] or [(0.0, source.rows)]
    found, end = [], 0
    for seconds, rows in profile:
        end += whole_epochs(seconds, model.step_s) or 0
        first, *_ = [laws.add(row) for row in rows]
        found.append((end, first, laws.add(restart_law(source, rows))))
    found[-1] = (FAR, *found[-1][1:])
    return found


def _with_hidden(model: HybridFaultTree) -> list[Event | Gate]:
    """Events and gates, inputs first; before a gate what only it reads.

    A PAND of more inputs is a cascade of pairs, a CON under "hold" reads the event that holds it.
    """
    things: list[Event | Gate] = list(model.events)
    for gate in in_order(model):
        if isinstance(gate, Pand):
            left = gate.inputs[0]
            for i, right in enumerate(gate.inputs[1:-1]):
                pair = replace(gate, name=f"{gate.name}\0{i}", inputs=(left, right), latched=False)
                things.append(pair)
                left = pair.name
            gate = replace(gate, inputs=(left, gate.inputs[-1]))
        elif isinstance(gate, Con) and (hold := hold_of(model, gate)):
            things.append(hold)
        things.append(gate)
    return things


def _nodes(
    model: HybridFaultTree, component_of: dict[str, int]
) -> tuple[dict[str, Any], dict[str, int]]:
    """Node arrays of the program, and the node of each event and gate."""
    from sbas.dependability.simulation.slot_kernel import DRAWN, FAILED, FIXED, IN_STATE

    source_of = {s.name: i for i, s in enumerate(model.sources)}
    things = _with_hidden(model)
    index = {thing.name: i for i, thing in enumerate(things)}
    kind, of, value, flags, hold = np.zeros((5, len(things)), np.int64)
    hold -= 1
    probability = np.zeros(len(things))
    inputs: list[list[int]] = [[] for _ in things]
    masks: list[list[int]] = [[] for _ in things]
    for i, thing in enumerate(things):
        match thing:
            case Failed():
                kind[i], of[i] = FAILED, component_of[thing.component]
            case InState():
                kind[i], of[i] = IN_STATE, source_of[thing.source]
                source = model.sources[of[i]]
                names = (*source.states, source.down, source.waiting or source.down)
                masks[i] = [int(name in thing.states) for name in names]
            case House():
                kind[i], value[i] = FIXED, thing.value
            case Undeveloped():
                kind[i], probability[i] = DRAWN, thing.probability
            case _:
                inputs[i] = [index[name] for name in thing.inputs]
                kind[i], value[i], flags[i] = _gate(model, thing)
                if isinstance(thing, Con) and hold_of(model, thing):
                    hold[i] = i - 1
    input_start, flat_inputs = _csr(inputs)
    mask_start, mask = _csr(masks)
    nodes = {
        "node_kind": kind,
        "node_of": of,
        "node_value": value,
        "node_flags": flags,
        "node_hold": hold,
        "node_probability": probability,
        "input_start": input_start,
        "inputs": flat_inputs,
        "mask_start": mask_start,
        "mask": mask.astype(np.bool_),
    }
    return nodes, {node.name: index[node.name] for node in (*model.events, *in_order(model))}


def _gate(model: HybridFaultTree, gate: Gate) -> tuple[int, int, int]:
    """Kind, count or epochs, and flags of a gate."""
    from sbas.dependability.simulation.slot_kernel import COUNT, EXCLUSIVE, LATCHED, NOT, PAND, RUN

    options = model.options
    match gate:
        case Or():
            return COUNT, 1, 0
        case And():
            return COUNT, len(gate.inputs), 0
        case AtLeast():
            return COUNT, gate.k, 0
        case Not():
            return NOT, 0, 0
        case Con():
            return RUN, gate.count, 0
        case Dur() | CausalAnd():
            rule = gate.rule or options.dur_rule
            return RUN, duration_epochs(gate.seconds, model.step_s, rule), 0
        case _:
            latched = options.pand_latched if gate.latched is None else gate.latched
            exclusive = options.pand_exclusive if gate.exclusive is None else gate.exclusive
            return PAND, 0, LATCHED * latched + EXCLUSIVE * exclusive
