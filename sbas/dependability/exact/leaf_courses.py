"""Courses of what is not taken apart: chains are built once, leaves share passes over them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.class_courses import ClassCourse
from sbas.dependability.exact.gate_memory import GateMemory, gate_memory, run_epochs
from sbas.dependability.exact.modules import Course
from sbas.dependability.exact.plan import Leaf, Tree
from sbas.dependability.exact.product_chain import product_chain
from sbas.dependability.exact.size_estimate import check_components
from sbas.dependability.exact.transient import check_mass, expectations, matrix_of
from sbas.dependability.exact.transitions import Chain, Floats, component_chain
from sbas.dependability.exact.windows import LookBack, Run, last_runs, look_back, pairs_of
from sbas.dependability.exact.within_epoch import hardware_within, instants
from sbas.dependability.tree.model import CausalAnd, Con, Dur, Gate, HybridFaultTree

_RunGate = Con | Dur | CausalAnd


@dataclass(frozen=True)
class Solved:
    """A leaf over the mission, how it was obtained, and the states that it took."""

    course: Course | ClassCourse
    method: str
    states: int


@dataclass
class Work:
    """What has been built on the way."""

    model: HybridFaultTree
    tree: Tree
    max_states: int
    chains: dict[frozenset[str], Chain] = field(default_factory=dict)
    leaves: dict[Leaf, Solved] = field(default_factory=dict)
    passages: dict[str, Floats] = field(default_factory=dict)
    times: tuple[Floats, Floats] | None = None

    def __post_init__(self) -> None:
        if self.model.options.mean_rule == "integral":
            self.times = instants(self.model)

    def chain(self, support: frozenset[str]) -> Chain:
        if support not in self.chains:
            check_components(self.model, support, max_states=self.max_states)
            self.chains[support] = component_chain(self.model, support, max_states=self.max_states)
        return self.chains[support]


def solve_leaves(work: Work, wanted: Iterable[Leaf]) -> None:
    """Fill `work.leaves`; leaves with the same support share one pass over the mission."""
    for chain, leaves in leaf_chains(work, [leaf for leaf in wanted if leaf not in work.leaves]):
        if len(chain.values) == 1:
            _by_look_back(work, chain, leaves)
        else:
            for leaf in leaves:
                work.leaves[leaf] = _over_the_mission(work, chain, leaf)


def leaf_chains(work: Work, wanted: Iterable[Leaf]) -> list[tuple[Chain, list[Leaf]]]:
    """Leaves with the chain that each can be looked back at from: unbounded memory is in it."""
    groups: dict[frozenset[str], dict[Leaf, frozenset[str]]] = {}
    for leaf in dict.fromkeys(wanted):
        support = frozenset[str]().union(*(work.tree.supports[n] for n in leaf))
        carried = frozenset[str]().union(*(work.tree.unforgetting(n) for n in leaf))
        groups.setdefault(support, {})[leaf] = carried
    found = []
    for support, carrying in groups.items():
        # Who carries less rides with one that carries all of it too, rather than alone.
        kinds: list[frozenset[str]] = []
        for kind in sorted(set(carrying.values()), key=len, reverse=True):
            if not any(kind <= other for other in kinds):
                kinds.append(kind)
        together: dict[frozenset[str], list[Leaf]] = {kind: [] for kind in kinds}
        for leaf, kind in carrying.items():
            together[next(k for k in kinds if kind <= k)].append(leaf)
        for kind, members in together.items():
            chain = work.chain(support)
            if kind:
                gates = [g for g in _below_all(work.tree, kind) if g.name in kind]
                memory = gate_memory(gates, work.model)
                chain = product_chain(
                    chain, memory, max_states=work.max_states, from_every_state=True, trim=True
                ).chain
            found.append((chain, members))
    return found


def _below_all(tree: Tree, names: Iterable[str]) -> list[Gate]:
    found = {gate.name: gate for name in sorted(set(names)) for gate in tree.below(name)}
    return list(found.values())


def _rest(work: Work, chain: Chain, names: Iterable[str]) -> GateMemory:
    """Memory of what is below and not known in the states of the chain."""
    gates = _below_all(work.tree, names)
    return gate_memory(gates, work.model, without=frozenset(chain.truth))


def _columns(work: Work, chain: Chain, leaf: Leaf) -> Floats:
    """(S, C or C + C * Q): true at the epoch; true at instants after it."""
    columns = [chain.truth[name].astype(float)[:, None] for name in leaf]
    if work.times is not None:
        columns += [hardware_within(work.tree, n, chain.truth, work.times[0]) for n in leaf]
    return np.hstack(columns)


def _with_truth(chain: Chain, memory: GateMemory) -> Chain:
    """The chain with gates that need no memory."""
    return replace(chain, truth=memory.step([], chain.truth)[1])


def look_backs(
    work: Work, chain: Chain, leaves: Sequence[Leaf]
) -> list[tuple[Leaf, str, int, LookBack]]:
    """Leaf, method, states and look-back; a leaf that looks back too far is left out."""
    found: list[tuple[Leaf, str, int, LookBack]] = []
    for leaf in leaves:
        memory = _rest(work, chain, leaf)
        lag = max(work.tree.horizon(name, chain.truth) for name in leaf)
        if not memory.sizes:
            columns = _columns(work, _with_truth(chain, memory), leaf)
            true = columns[:, : len(leaf)]
            rise = pairs_of(true, matrix_of(chain) @ true)
            found.append((leaf, "chain", chain.size, LookBack(0, columns, rise, columns[:0],
                                                              rise[:0])))  # fmt: skip
        elif runs := _plain_runs(work, chain, memory):
            found.append((leaf, "window", chain.size, _by_windows(work, chain, leaf, runs)))
        elif 2 * lag < work.model.epochs:
            product = product_chain(
                chain, memory, max_states=work.max_states, from_every_state=True
            )
            columns = _columns(work, product.chain, leaf)
            back = look_back(product, chain.start, columns, lag, len(leaf))
            found.append((leaf, "look-back", product.chain.size, back))
    return found


def _by_look_back(work: Work, chain: Chain, leaves: Sequence[Leaf]) -> None:
    """All by one pass of the chain, each from its own number of epochs back."""
    found = look_backs(work, chain, leaves)
    for leaf in set(leaves) - {leaf for leaf, *_ in found}:
        work.leaves[leaf] = _over_the_mission(work, chain, leaf)
    if not found:
        return
    parts = [part for *_, back in found for part in (back.on, back.rise)]
    mass = np.ones((chain.size, 1))
    values = expectations(chain.start, [matrix_of(chain)], chain.ends, [np.hstack([*parts, mass])])
    check_mass(float(values[-1, -1]))
    at = 0
    for leaf, method, states, back in found:
        middle, end = at + back.on.shape[1], at + back.on.shape[1] + back.rise.shape[1]
        on = np.concatenate([back.early_on, values[:, at:middle]])
        rise = np.concatenate([back.early_rise, values[:, middle:end]])
        work.leaves[leaf] = Solved(_read(work, leaf, on, rise), method, states)
        at = end


def _plain_runs(work: Work, chain: Chain, memory: GateMemory) -> list[_RunGate]:
    """The gates that count, longest run first; none if one of them counts what another says."""
    runs = [gate for gate in memory.gates if isinstance(gate, _RunGate)]
    runs.sort(key=lambda gate: -run_epochs(gate, work.model))
    nested = _rest(work, chain, [n for gate in runs for n in gate.inputs]).sizes
    too_many = chain.size * 3 ** len(runs) > work.max_states
    return [] if nested or too_many else runs


def _by_windows(work: Work, chain: Chain, leaf: Leaf, gates: Sequence[_RunGate]) -> LookBack:
    """A boolean function of runs: `last_runs`."""
    counting = frozenset(gate.name for gate in gates)
    lower = _rest(work, chain, [n for gate in gates for n in gate.inputs])
    truth = _with_truth(chain, lower).truth
    upper = gate_memory(
        _below_all(work.tree, leaf), work.model, without=frozenset(truth) | counting
    )
    runs = [
        Run(
            np.logical_and.reduce([truth[n] for n in gate.inputs]),
            run_epochs(gate, work.model),
        )
        for gate in gates
    ]

    def read(on: Sequence[NDArray[np.bool_]]) -> Floats:
        known = dict(truth)
        known.update({gate.name: true for gate, true in zip(gates, on, strict=True)})
        return _columns(work, replace(chain, truth=upper.step([], known)[1]), leaf)

    return last_runs(chain, runs, read, len(leaf))


def _read(work: Work, leaf: Leaf, on: Floats, rise: Floats) -> Course | ClassCourse:
    """Courses from what is expected at n = 0, 1, ... and of the pairs at n = 1, 2, ..."""
    epochs, count = work.model.epochs, len(leaf)
    on = on[: epochs + 1]
    rise = np.concatenate([np.zeros((1, rise.shape[1])), rise[:epochs]])
    inside = None if work.times is None else on[:, count:]
    if count == 1:
        return Course(on[:, 0], rise[:, 0], inside)
    return ClassCourse(
        on[:, :count],
        rise.reshape(-1, count, count),
        None if inside is None else inside.reshape(len(on), count, -1),
    )


def _over_the_mission(work: Work, chain: Chain, leaf: Leaf) -> Solved:
    """With the whole memory carried from epoch 0 on."""
    memory = _rest(work, chain, leaf)
    if memory.sizes:
        here = product_chain(chain, memory, max_states=work.max_states).chain
    else:
        here = _with_truth(chain, memory)
    columns = _columns(work, here, leaf)
    true, width = columns[:, : len(leaf)], columns.shape[1]
    matrices = [matrix_of(here, stage) for stage in range(len(here.values))]
    steady = [columns, np.ones((here.size, 1))]
    values = expectations(
        here.start,
        matrices,
        here.ends,
        [np.hstack([*steady, pairs_of(true, matrix @ true)]) for matrix in matrices],
    )
    check_mass(float(values[-1, width]))
    course = _read(work, leaf, values[:, :width], values[:, width + 1 :])
    return Solved(course, "product" if memory.sizes else "chain", here.size)
