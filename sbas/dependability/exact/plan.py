"""How a tree is taken apart: which gates are OR, AND or k-of-n of parts that share nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.gate_memory import forgets, gate_memory, run_epochs, skips
from sbas.dependability.exact.modules import independent_groups
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    CausalAnd,
    Con,
    Dur,
    Gate,
    HybridFaultTree,
    Not,
    Or,
)
from sbas.dependability.tree.model_check import in_order, supports

Leaf = tuple[str, ...]
"""What is solved as it is: one event or gate, or gates of which exactly one is true (classes)."""


@dataclass(frozen=True)
class Part:
    """An event or gate; with parts, it is "at least k of them" and they are independent.

    With `blocks`, it is the function `table` (K_1, ..., K_m) of the classes of m independent
    blocks.
    """

    name: str
    k: int = 0
    parts: tuple[Part, ...] = ()
    blocks: tuple[Leaf, ...] = ()
    table: NDArray[np.bool_] | None = field(default=None, compare=False)

    def leaves(self) -> tuple[Leaf, ...]:
        """What is solved as it is."""
        if self.blocks:
            return self.blocks
        if not self.parts:
            return ((self.name,),)
        return tuple(dict.fromkeys(n for part in self.parts for n in part.leaves()))


@dataclass(frozen=True)
class Tree:
    """A model's gates by name, those made on the way included, with what each depends on."""

    model: HybridFaultTree
    gates: dict[str, Gate]
    supports: dict[str, frozenset[str]]

    def below(self, name: str) -> list[Gate]:
        """The gate and all gates below it, each after its inputs."""
        found: dict[str, Gate] = {}
        waiting = [(name, False)]
        while waiting:
            at, done = waiting.pop()
            if at not in self.gates or at in found:
                continue
            if done:
                found[at] = self.gates[at]
            else:
                waiting += [(at, True), *((n, False) for n in reversed(self.gates[at].inputs))]
        return list(found.values())

    def unforgetting(self, name: str) -> frozenset[str]:
        """Gates below, it included, whose memory has no bounded length, with all below them."""
        return frozenset(
            lower.name
            for gate in self.below(name)
            if not forgets(gate, self.model)
            for lower in self.below(gate.name)
        )

    def horizon(self, name: str, known: Iterable[str]) -> int:
        """Epochs back that decide a gate, where some gates' truth is known.

        Parameters
        ----------
        name : of an event or gate.
        known : gates whose truth needs no look back.
        """
        back = dict.fromkeys(known, 0)
        for gate in self.below(name):
            if gate.name in back:
                continue
            own = run_epochs(gate, self.model) - 1 if isinstance(gate, _RUNS) else 0
            back[gate.name] = own + max(back.get(lower, 0) for lower in gate.inputs)
        return back.get(name, 0)

    def add(self, gate: Gate) -> str:
        """Take in a gate that the model does not have by itself."""
        self.gates.setdefault(gate.name, gate)
        below = frozenset[str]().union(*(self.supports[name] for name in gate.inputs))
        self.supports.setdefault(gate.name, below)
        return gate.name


_RUNS = (Con, Dur, CausalAnd)
_BOOLEAN = (Or, And, Not, AtLeast)
_MOST_INPUTS = 12
"""Of a boolean function that is written out: 4096 rows."""


def tree_of(model: HybridFaultTree) -> Tree:
    """The gates and supports of a checked model."""
    return Tree(model, {gate.name: gate for gate in in_order(model)}, supports(model))


def split(name: str, tree: Tree) -> Part:
    """Take an event or gate apart where its inputs share nothing.

    Parameters
    ----------
    name : of an event or gate.
    tree : takes in the gates that join inputs which do share something.

    Returns
    -------
    Part: without parts where the gate must be solved whole.

    Notes
    -----
    A run of an AND is as long as the shortest run of its inputs, so that a causal AND of
    independent inputs is the AND of their DURs. NOT moves inwards: not "k of n" is "n - k + 1
    of n not".
    """
    gate = tree.gates.get(name)
    if isinstance(gate, Or | And):
        groups = independent_groups(_flat(gate.inputs, type(gate), tree.gates), tree.supports)
        if len(groups) == 1 and len(groups[0]) > 1:
            return _by_function(name, tree)
        parts = tuple(split(_joined(type(gate), group, tree), tree) for group in groups)
        return Part(name, 1 if isinstance(gate, Or) else len(parts), parts)
    if isinstance(gate, AtLeast):
        groups = independent_groups(list(dict.fromkeys(gate.inputs)), tree.supports)
        if len(groups) == len(gate.inputs):
            return Part(name, gate.k, tuple(split(n, tree) for n in gate.inputs))
    if isinstance(gate, Con | Dur | CausalAnd) and not skips(gate, tree.model):
        groups = independent_groups(_flat(gate.inputs, And, tree.gates), tree.supports)
        if len(groups) > 1:
            runs = tuple(Part(_run_of(gate, group, tree)) for group in groups)
            return Part(name, len(runs), runs)
    if isinstance(gate, Not):
        inner = split(gate.input, tree)
        if inner.parts:
            parts = tuple(split(negated(part.name, tree), tree) for part in inner.parts)
            return Part(name, len(parts) - inner.k + 1, parts)
    return _by_function(name, tree)


def negated(name: str, tree: Tree) -> str:
    """Name of the gate that is true where this one is not; taken into the tree if need be."""
    gate = tree.gates.get(name)
    return gate.input if isinstance(gate, Not) else tree.add(Not(f"Not({name})", name))


def _flat(inputs: Sequence[str], kind: type[Gate], gates: Mapping[str, Gate]) -> list[str]:
    """Inputs, with those of the same kind replaced by theirs; each once."""
    flat: dict[str, None] = {}
    for name in inputs:
        gate = gates.get(name)
        names = _flat(gate.inputs, kind, gates) if isinstance(gate, kind) else [name]
        flat.update(dict.fromkeys(names))
    return list(flat)


def _joined(kind: type[Or] | type[And], group: list[str], tree: Tree) -> str:
    if len(group) == 1:
        return group[0]
    return tree.add(kind(f"{kind.__name__}({', '.join(group)})", tuple(group)))


def _run_of(gate: Con | Dur | CausalAnd, group: list[str], tree: Tree) -> str:
    """The same run of some of the inputs."""
    run = run_epochs(gate, tree.model)
    name = f"Run({run}; {', '.join(group)})"
    return tree.add(CausalAnd(name, run * tree.model.step_s, tuple(group), "count"))


# --- votes and other functions whose inputs share something, but not all -----------------------


def _by_function(name: str, tree: Tree) -> Part:
    """A boolean function of blocks that share nothing, where one is found; else the whole."""
    groups = _cut(name, tree)
    if len(groups) < 2 or sum(map(len, groups)) > _MOST_INPUTS:
        return Part(name)
    names = [n for group in groups for n in group]
    cells = np.indices([2] * len(names)).reshape(len(names), -1) == 1
    known = dict(zip(names, cells, strict=True))
    above = gate_memory(_above(name, set(names), tree), tree.model)
    table = above.step([], known)[1][name].reshape([2 ** len(group) for group in groups])
    blocks: list[Leaf] = []
    for group in groups:
        axis = len(blocks)
        rows = np.moveaxis(table, axis, 0).reshape(table.shape[axis], -1)
        _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
        table = table.take(first, axis=axis)
        if len(first) == 1:
            table = table.take(0, axis=axis)
            continue
        inverse = inverse.reshape(-1)
        blocks.append(tuple(
            _class_of(group, np.flatnonzero(inverse == c).tolist(), tree)
            for c in range(len(first))
        ))  # fmt: skip
    return Part(name, blocks=tuple(blocks), table=table) if len(blocks) > 1 else Part(name)


def _cut(name: str, tree: Tree) -> list[list[str]]:
    """Events and gates that decide a boolean gate, in groups that share nothing."""
    if not isinstance(tree.gates.get(name), _BOOLEAN):
        return []
    front = list(dict.fromkeys(tree.gates[name].inputs))
    while len(front) <= _MOST_INPUTS:
        boolean = [n for n in front if isinstance(tree.gates.get(n), _BOOLEAN)]
        opened = {
            n for n in boolean if len({g for gate in tree.below(n) for g in gate.inputs} & {*front})
        }
        if not opened:
            groups = independent_groups(front, tree.supports)
            if sum(any(tree.supports[n] for n in group) for group in groups) > 1:
                return groups
            if not boolean:
                return []
            largest = max(len(tree.supports[n]) for n in boolean)
            opened = {n for n in boolean if len(tree.supports[n]) == largest}
        front = list(dict.fromkeys(
            lower for n in front for lower in (tree.gates[n].inputs if n in opened else (n,))
        ))  # fmt: skip
    return []


def _above(name: str, cut: set[str], tree: Tree) -> list[Gate]:
    """Gates from here down to the cut, each after its inputs."""
    if name in cut:
        return []
    found = {g.name: g for n in tree.gates[name].inputs for g in _above(n, cut, tree)}
    return [*found.values(), tree.gates[name]]


def _class_of(group: list[str], rows: list[int], tree: Tree) -> str:
    """Gate that is true in some rows of the truth table of a group's names, first name first."""
    if len(group) == 1:
        return group[0] if rows == [1] else negated(group[0], tree)
    minterms = []
    for row in rows:
        bits = f"{row:0{len(group)}b}"
        literals = tuple(
            n if bit == "1" else negated(n, tree) for n, bit in zip(group, bits, strict=True)
        )
        minterms.append(tree.add(And(f"Row({bits}; {', '.join(group)})", literals)))
    listed = "|".join(f"{row:0{len(group)}b}" for row in rows)
    return tree.add(Or(f"Class({listed}; {', '.join(group)})", tuple(minterms)))
