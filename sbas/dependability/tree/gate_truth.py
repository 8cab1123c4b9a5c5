"""Truth of every event and gate along given histories, read straight from the definitions.

The oracle of the solver and the simulation: it looks at whole signals, keeps no counter and no
gate memory, and shares nothing with either.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.tree.durations import duration_epochs
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
from sbas.exceptions import InputError

Signal = NDArray[np.bool_]
Numbers = NDArray[np.intp]


def state_names(source: MarkovSource) -> tuple[str, ...]:
    """Names of a source's states by number: its states, then `down`, then `waiting`.

    `waiting` has a number of its own only where it is another state than `down`.
    """
    waits = source.waiting is not None and source.waiting != source.down
    return (*source.states, source.down, *((str(source.waiting),) if waits else ()))


def gate_truth(
    model: HybridFaultTree, states: Mapping[str, NDArray[np.generic]]
) -> dict[str, Signal]:
    """Truth of all events and gates of a model, given what its components and sources did.

    Parameters
    ----------
    model : checked by `check_model`.
    states : (M, N + 1) histories over the epochs 0..N, any M and N: of a component 1 (or True)
        where failed, of a source the number of its state in `state_names`. An undeveloped event
        that is not here is false, one that is here (1 where true) needs (M, N + 1) too.

    Returns
    -------
    (M, N + 1) truth by name of event and gate.

    Raises
    ------
    InputError : a component or source without history, histories of several shapes, a number of
        no state.
    ModelError : a cycle or an unknown name.

    Notes
    -----
    run_x(n) is the number of consecutive true epochs that ends at n, onset_x(n) = n - run_x(n)
    + 1; nothing is true before epoch 0. CON: run >= N. DUR and causal AND: run of the input (of
    all inputs together) >= d. PAND: all true and onset_1 <= onset_2 <= ... (exclusive: <), which
    is the left cascade of pairs; latched: that at any epoch up to n, all inputs together. With
    `con_gap` "hold" the run of a CON is counted over the epochs that are not held.
    """
    shape = _common_shape(states)
    truth = {event.name: _event(model, event, states, shape) for event in model.events}
    held = _held(model, states)
    for gate in in_order(model):
        inputs = [truth[name] for name in gate.inputs]
        truth[gate.name] = _gate(model, gate, inputs, held.get(gate.inputs[0]))
    return truth


def run_lengths(signal: Signal, skipped: Signal | None = None) -> Numbers:
    """Number of consecutive true epochs that ends at each epoch; `skipped` ones do not exist.

    Parameters
    ----------
    signal, skipped : (M, N + 1).
    """
    counts = np.ones(signal.shape, dtype=np.intp) if skipped is None else (~skipped).astype(np.intp)
    elapsed = np.cumsum(counts, axis=-1)
    false_here = ~signal if skipped is None else ~signal & ~skipped
    return elapsed - np.maximum.accumulate(np.where(false_here, elapsed, 0), axis=-1)


def onsets(signal: Signal) -> Numbers:
    """First epoch of the run that each epoch belongs to; one later than now where false."""
    return np.arange(signal.shape[-1]) - run_lengths(signal) + 1


# --- events -----------------------------------------------------------------------------------


def _common_shape(states: Mapping[str, NDArray[np.generic]]) -> tuple[int, ...]:
    shapes = {name: np.shape(values) for name, values in states.items()}
    first = next(iter(shapes.values()), ())
    if len(first) != 2 or len(set(shapes.values())) != 1:
        raise InputError(
            "histories are tables of one shape, a row each, a column an epoch",
            where="states",
            evidence=", ".join(f"{name} {shape}" for name, shape in shapes.items()) or "none",
        )
    return first


def _history(
    states: Mapping[str, NDArray[np.generic]], name: str, count: int
) -> NDArray[np.generic]:
    if name not in states:
        raise InputError(f"no history of {name!r}", where="states", evidence=", ".join(states))
    values = np.asarray(states[name])
    if not np.isin(values, np.arange(count)).all():
        raise InputError(
            f"a state of {name!r} that has no name",
            where=f"states[{name!r}]",
            evidence=f"{values.min()} to {values.max()}",
            cure=f"numbers 0 to {count - 1}",
        )
    return values


def _event(
    model: HybridFaultTree,
    event: Event,
    states: Mapping[str, NDArray[np.generic]],
    shape: tuple[int, ...],
) -> Signal:
    match event:
        case Failed():
            return _history(states, event.component, 2).astype(bool)
        case InState():
            source = next(s for s in model.sources if s.name == event.source)
            return _in_states(source, event.states, states)
        case House():
            return np.full(shape, event.value)
        case Undeveloped():
            if event.name not in states:
                return np.zeros(shape, dtype=bool)
            return _history(states, event.name, 2).astype(bool)


def _in_states(
    source: MarkovSource, wanted: tuple[str, ...], states: Mapping[str, NDArray[np.generic]]
) -> Signal:
    names = state_names(source)
    values = _history(states, source.name, len(names))
    return np.isin(values, [i for i, name in enumerate(names) if name in wanted])


def _held(model: HybridFaultTree, states: Mapping[str, NDArray[np.generic]]) -> dict[str, Signal]:
    """By event: epochs that a CON on it skips."""
    if model.options.con_gap == "reset":
        return {}
    sources = {source.name: source for source in model.sources}
    return {
        event.name: _in_states(sources[event.source], model.options.hold_states, states)
        for event in model.events
        if isinstance(event, InState)
    }


# --- gates ------------------------------------------------------------------------------------


def _gate(model: HybridFaultTree, gate: Gate, inputs: list[Signal], held: Signal | None) -> Signal:
    match gate:
        case Or():
            return np.asarray(np.any(inputs, axis=0))
        case And():
            return np.asarray(np.all(inputs, axis=0))
        case Not():
            return ~inputs[0]
        case AtLeast():
            return np.asarray(np.sum(inputs, axis=0) >= gate.k)
        case Con():
            long = run_lengths(inputs[0], held) >= gate.count
            return long if held is None else long & ~held
        case Dur() | CausalAnd():
            rule = gate.rule or model.options.dur_rule
            together = np.all(inputs, axis=0)
            return run_lengths(together) >= duration_epochs(gate.seconds, model.step_s, rule)
        case Pand():
            options = model.options
            latched = options.pand_latched if gate.latched is None else gate.latched
            exclusive = options.pand_exclusive if gate.exclusive is None else gate.exclusive
            compare = np.less if exclusive else np.less_equal
            starts = [onsets(signal) for signal in inputs]
            pairs = itertools.pairwise(starts)
            ordered = np.all([*inputs, *(compare(a, b) for a, b in pairs)], axis=0)
            return np.asarray(np.logical_or.accumulate(ordered, axis=-1) if latched else ordered)
