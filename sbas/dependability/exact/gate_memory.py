"""Each gate as a finite automaton: what it must remember of its inputs, and when it is true."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.state_space import Columns
from sbas.dependability.exact.transitions import Truth, held_key
from sbas.dependability.tree.durations import duration_epochs
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Con,
    Dur,
    Gate,
    HybridFaultTree,
    InState,
    Not,
    Options,
    Or,
    Pand,
)

Bools = NDArray[np.bool_]

_NONE, _FIRST, _LATE, _ORDER = range(4)
"""Memory of a pair: nothing; first on alone; second was first; in order."""


def run_epochs(gate: Con | Dur | CausalAnd, model: HybridFaultTree) -> int:
    """Number of consecutive true epochs from which on the gate is true."""
    if isinstance(gate, Con):
        return gate.count
    return duration_epochs(gate.seconds, model.step_s, gate.rule or model.options.dur_rule)


def skips(gate: Gate, model: HybridFaultTree) -> bool:
    """Whether a CON counts on over epochs that it skips (`con_gap` "hold")."""
    return (
        isinstance(gate, Con)
        and model.options.con_gap == "hold"
        and any(isinstance(e, InState) and e.name == gate.input for e in model.events)
    )


def forgets(gate: Gate, model: HybridFaultTree) -> bool:
    """Whether the gate is a function of its inputs at a bounded number of epochs back."""
    return not isinstance(gate, Pand) and not skips(gate, model)


@dataclass(frozen=True)
class _Run:
    """Counter of consecutive true epochs of the AND of inputs, saturated."""

    inputs: frozenset[str]
    held: str | None


@dataclass(frozen=True)
class _Pair:
    """Order of two inputs: 4 values."""

    first: str | _Pair
    second: str
    exclusive: bool


@dataclass(frozen=True)
class _Latch:
    """Whether a PAND has ever been true."""

    gate: str


_Cell = _Run | _Pair | _Latch


@dataclass(frozen=True)
class GateMemory:
    """The memory that some gates need together, and how it moves.

    Parameters
    ----------
    gates : each after its inputs.
    lengths : of gates that count, the run from which on they are true.
    skipping : those of them that skip epochs.
    options : readings of open points.
    sizes : number of values of each cell; one counter for each input is shared by all gates.
    """

    gates: tuple[Gate, ...]
    lengths: Mapping[str, int]
    skipping: frozenset[str]
    options: Options
    sizes: Mapping[_Cell, int]

    @property
    def reads(self) -> frozenset[str]:
        """What the gates read: inputs, and marks of epochs that a CON skips."""
        held = {held_key(gate.inputs[0]) for gate in self.gates if gate.name in self.skipping}
        return frozenset().union(held, *(gate.inputs for gate in self.gates))

    def growth(self) -> str:
        """The gates that remember, with the number of values of their memory."""
        users: dict[_Cell, list[str]] = {}
        for gate in self.gates:
            for cell in _cells(gate, self.options, self.skipping):
                users.setdefault(cell, []).append(gate.name)
        parts = sorted(((self.sizes[cell], names) for cell, names in users.items()), reverse=True)
        return ", ".join(f"{' and '.join(names)} ({size} values)" for size, names in parts)

    def step(
        self, memory: Sequence[NDArray[np.int64]], truth: Truth, *, moves: bool = True
    ) -> tuple[Columns, dict[str, Bools]]:
        """One epoch on: new memory, and truth of the gates.

        Parameters
        ----------
        memory : for each cell, values at the epoch before (all 0 before epoch 0).
        truth : of the inputs at the new epoch, arrays of one shape.
        moves : False reads the gates off the memory that the epoch has left behind.

        Returns
        -------
        Memory at the new epoch; truth of inputs and gates.
        """
        old = dict(zip(self.sizes, memory, strict=True))
        new: dict[_Cell, NDArray[np.int64]] = {}
        known = dict(truth)
        for gate in self.gates:
            for cell in _cells(gate, self.options, self.skipping):
                if cell not in new and not isinstance(cell, _Latch):
                    new[cell] = self._moved(cell, old[cell], known, new) if moves else old[cell]
            known[gate.name] = self._output(gate, known, new, old, moves=moves)
        return [new[cell] for cell in self.sizes], known

    def _moved(
        self,
        cell: _Run | _Pair,
        value: NDArray[np.int64],
        known: Mapping[str, Bools],
        new: Mapping[_Cell, NDArray[np.int64]],
    ) -> NDArray[np.int64]:
        if isinstance(cell, _Run):
            on = _all(known[name] for name in cell.inputs)
            run = np.where(on, np.minimum(value + 1, self.sizes[cell] - 1), 0)
            return run if cell.held is None else np.where(known[cell.held], value, run)
        x = known[cell.first] if isinstance(cell.first, str) else new[cell.first] == _ORDER
        y = known[cell.second]
        both = np.where(
            value == _NONE,
            _LATE if cell.exclusive else _ORDER,
            np.where(value == _LATE, _LATE, _ORDER),
        )
        alone = np.where(y, _LATE, np.where(x, _FIRST, _NONE))
        return np.where(x & y, both, alone)

    def _output(
        self,
        gate: Gate,
        known: Mapping[str, Bools],
        new: dict[_Cell, NDArray[np.int64]],
        old: Mapping[_Cell, NDArray[np.int64]],
        *,
        moves: bool,
    ) -> Bools:
        inputs = [known[name] for name in gate.inputs]
        match gate:
            case Or():
                return np.asarray(np.logical_or.reduce(inputs))
            case And():
                return _all(inputs)
            case Not():
                return ~inputs[0]
            case AtLeast():
                return np.asarray(np.sum(np.array(inputs), axis=0) >= gate.k)
            case Con() | Dur() | CausalAnd():
                (run,) = _cells(gate, self.options, self.skipping)
                true = np.asarray(new[run] >= self.lengths[gate.name])
                held = run.held if isinstance(run, _Run) else None
                return true if held is None else true & ~known[held]
            case Pand():
                *pairs, last = _cells(gate, self.options, self.skipping)
                if not isinstance(last, _Latch):
                    return np.asarray(new[last] == _ORDER)
                ever = old[last]
                if moves:
                    ever = np.where(new[pairs[-1]] == _ORDER, 1, ever)
                new[last] = ever
                return np.asarray(ever == 1)


def gate_memory(
    gates: Sequence[Gate], model: HybridFaultTree, *, without: frozenset[str] = frozenset()
) -> GateMemory:
    """Memory of some gates.

    Parameters
    ----------
    gates : each after its inputs.
    model : for its step and options.
    without : gates whose truth is known otherwise; left out.
    """
    gates = tuple(gate for gate in gates if gate.name not in without)
    skipping = frozenset(gate.name for gate in gates if skips(gate, model))
    lengths = {
        gate.name: run_epochs(gate, model)
        for gate in gates
        if isinstance(gate, Con | Dur | CausalAnd)
    }
    sizes: dict[_Cell, int] = {}
    for gate in gates:
        for cell in _cells(gate, model.options, skipping):
            size = 4 if isinstance(cell, _Pair) else 2
            if isinstance(cell, _Run):
                size = lengths[gate.name] + 1
            sizes[cell] = max(size, sizes.get(cell, 0))
    return GateMemory(gates, lengths, skipping, model.options, sizes)


def _cells(gate: Gate, options: Options, skipping: frozenset[str]) -> list[_Cell]:
    match gate:
        case Con() | Dur() | CausalAnd():
            held = held_key(gate.inputs[0]) if gate.name in skipping else None
            return [_Run(frozenset(gate.inputs), held)]
        case Pand():
            exclusive = options.pand_exclusive if gate.exclusive is None else gate.exclusive
            latched = options.pand_latched if gate.latched is None else gate.latched
            pairs: list[_Cell] = []
            first: str | _Pair = gate.inputs[0]
            for second in gate.inputs[1:]:
                first = _Pair(first, second, exclusive)
                pairs.append(first)
            return [*pairs, _Latch(gate.name)] if latched else pairs
    return []


def _all(arrays: Iterable[Bools]) -> Bools:
    return np.asarray(np.logical_and.reduce(list(arrays)))
