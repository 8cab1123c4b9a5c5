"""How large a chain must become, from its independent parts, before it is built."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.gate_memory import gate_memory
from sbas.dependability.exact.plan import Leaf, Part, Tree, negated
from sbas.dependability.exact.product_chain import product_chain
from sbas.dependability.exact.state_space import MOVES_PER_STATE
from sbas.dependability.exact.transient import matrix_of
from sbas.dependability.exact.transitions import Chain, component_chain
from sbas.dependability.tree.model import HybridFaultTree
from sbas.exceptions import InputError

Bools = NDArray[np.bool_]

_LOOK_FROM = 100_000
"""Combinations below which building is quicker than estimating."""
_LONGEST_LOOK = 3600
_CURE = (
    "ask for other names only; a longer step_s or shorter delays, counts and first-fix wait; "
    "parts that share nothing (share_sources=False); or simulation (simulate_model)"
)


def check_components(model: HybridFaultTree, support: Collection[str], *, max_states: int) -> None:
    """Refuse components and sources whose chain has too many states or moves.

    Parameters
    ----------
    model : checked.
    support : names; with a source, its guards too.
    max_states : largest number of states.

    Raises
    ------
    InputError : at one epoch more than `max_states` states, or 10 times as many moves from them,
        can be reached; found without building the chain.
    """
    phases = [2 for c in model.components if c.name in support]
    phases += [
        len(s.states) + 1 + round(s.first_fix_s / model.step_s)
        for s in model.sources
        if s.name in support
    ]
    if math.prod(phases) <= _LOOK_FROM:
        return
    groups = _linked(model, support)
    if len(groups) < 2:
        return
    chains = [component_chain(model, group, max_states=max_states) for group in groups]
    everywhere = [np.ones(chain.size, dtype=bool) for chain in chains]
    held = _held(chains, everywhere)
    states = math.prod(int(h.sum()) for h in held)
    moves = math.prod(int(np.diff(c.indptr)[h].sum()) for c, h in zip(chains, held, strict=True))
    if states > max_states or moves > MOVES_PER_STATE * max_states:
        parts = "; ".join(
            f"{', '.join(sorted(g))} ({c.size} states)" for g, c in zip(groups, chains, strict=True)
        )
        raise InputError(
            "the exact solution of what depends on all of these together is too large",
            where=parts,
            evidence=f"{states} states and {moves} moves in one chain",
            cure=_CURE,
        )


def check_passage(
    part: Part, tree: Tree, chain_of: Callable[[frozenset[str]], Chain], *, max_states: int
) -> None:
    """Refuse a first passage whose joint chain of independent parts has too many states.

    Parameters
    ----------
    part : with parts or blocks; its passage is no sum over them.
    tree : of the model.
    chain_of : components and sources to their chain.
    max_states : largest number of states.

    Raises
    ------
    InputError : at one epoch more than `max_states` states can be reached before the passage; the
        number is a lower bound, so that nothing is refused that could be built.
    """
    blocks: tuple[Leaf, ...] = part.blocks
    table = part.table
    if table is None:
        blocks = tuple((negated(inner.name, tree), inner.name) for inner in part.parts)
        table = np.indices([2] * len(blocks)).sum(axis=0) >= part.k
    chains = []
    for block in blocks:
        gates = {g.name: g for name in block for g in tree.below(name)}
        support = frozenset[str]().union(*(tree.supports[name] for name in block))
        memory = gate_memory(list(gates.values()), tree.model)
        chains.append(product_chain(chain_of(support), memory, max_states=max_states).chain)
    if math.prod(chain.size for chain in chains) <= max_states:
        return
    truths = [np.array([c.truth[n] for n in b]) for c, b in zip(chains, blocks, strict=True)]
    quiet = _quiet(table, [int(t[:, np.argmax(c.start)].argmax())
                           for c, t in zip(chains, truths, strict=True)])  # fmt: skip
    if quiet is None:
        return
    inside = [np.any(t[np.array(sorted(q))], axis=0) for t, q in zip(truths, quiet, strict=True)]
    states = math.prod(int(h.sum()) for h in _held(chains, inside))
    if states > max_states:
        sizes = [f"{c.size} for {b[-1]}" for c, b in zip(chains, blocks, strict=True)]
        raise InputError(
            f'"at least once" of {part.name!r} needs more than {max_states} states',
            where=part.name,
            evidence=f"{states} or more: {', '.join(sizes)}, all combinations",
            cure="leave first_passage out (mean, points and occurrences need no joint chain, and "
            f"occurrences are an upper bound of it); {_CURE}",
        )


def _linked(model: HybridFaultTree, support: Collection[str]) -> list[set[str]]:
    """Names in groups: a source with its guards, all else alone."""
    groups = [{name} for name in sorted(support)]
    for source in model.sources:
        if source.name in support:
            joined = {source.name, *source.guard}
            apart = [g for g in groups if not g & joined]
            groups = [*apart, joined.union(*(g for g in groups if g & joined))]
    return groups


def _quiet(table: Bools, first: Sequence[int]) -> list[set[int]] | None:
    """Classes of each block, the first ones among them, with the function false on all
    combinations; None where it is true at the first ones."""
    kept = [{c} for c in first]
    if table[tuple(first)]:
        return None
    for axis, size in enumerate(table.shape):
        for c in range(size):
            larger = [*kept[:axis], kept[axis] | {c}, *kept[axis + 1 :]]
            if not table[np.ix_(*(sorted(k) for k in larger))].any():
                kept = larger
    return kept


def _held(chains: Sequence[Chain], inside: Sequence[Bools]) -> list[Bools]:
    """States of independent chains at one epoch, after a way inside some states only."""
    matrices = [matrix_of(chain).T.tocsr() for chain in chains]
    held = [(chain.start > 0.0) & true for chain, true in zip(chains, inside, strict=True)]
    for _ in range(min(chains[0].ends[-1], _LONGEST_LOOK)):
        moved = [
            (matrix @ h.astype(float) > 0.0) & true
            for matrix, h, true in zip(matrices, held, inside, strict=True)
        ]
        if all(np.array_equal(a, b) for a, b in zip(moved, held, strict=True)):
            break
        held = moved
    return held
