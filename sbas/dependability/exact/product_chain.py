"""Product of a chain and the memory of gates: again a chain, in which every gate is read off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.gate_memory import GateMemory
from sbas.dependability.exact.state_space import (
    Columns,
    Ints,
    check_moves,
    reachable,
    repeat_rows,
)
from sbas.dependability.exact.transitions import Chain, trimmed


@dataclass(frozen=True)
class ProductChain:
    """A chain with the memory of gates.

    Parameters
    ----------
    chain : its states are (state, memory); its truth holds the gates too.
    entries : for each first state of the smaller chain, the state with the memory that one
        epoch leaves behind.
    parents : for each entry, the state of the smaller chain.
    """

    chain: Chain
    entries: Ints
    parents: Ints


def product_chain(
    chain: Chain,
    memory: GateMemory,
    *,
    max_states: int,
    from_every_state: bool = False,
    trim: bool = False,
    absorbing: str | None = None,
) -> ProductChain:
    """Reachable states of a chain together with the memory of gates that read it.

    Parameters
    ----------
    chain : has the truth of everything that the gates read.
    memory : of the gates.
    max_states : largest number of states.
    from_every_state : begin with an empty memory before each state, not only before those of
        the law at epoch 0.
    trim : with `from_every_state`, keep only what the law at epoch 0 leads to; the way is shorter
        where states follow each other in a long row, such as a first-fix wait.
    absorbing : event or gate whose true states are not left, except at epoch 0.

    Raises
    ------
    InputError : more than `max_states` states; names the gates.

    Notes
    -----
    A move of the product is a move of the chain: the memory follows from it. Parallel moves do
    not arise.
    """
    reads = [name for name in chain.truth if name in memory.reads]
    parents = np.arange(chain.size) if from_every_state else np.flatnonzero(chain.start > 0.0)
    empty = [np.zeros(len(parents), dtype=np.int64) for _ in memory.sizes]
    entered, _ = memory.step(empty, {name: chain.truth[name][parents] for name in reads})

    def truth_of(columns: Columns) -> dict[str, NDArray[np.bool_]]:
        state, *cells = columns
        known = {name: chain.truth[name][state] for name in chain.truth}
        return memory.step(cells, known, moves=False)[1]

    def expand(layer: Columns, first: bool) -> tuple[Ints, Columns, list[NDArray[np.generic]]]:
        state, *cells = layer
        begin = chain.indptr[state]
        counts = chain.indptr[state + 1] - begin
        if absorbing is not None and not first:
            counts = np.where(truth_of(layer)[absorbing], 0, counts)
        check_moves(int(counts.sum()), max_states=max_states, growth=growth)
        row, edge = repeat_rows(counts, begin)
        to = chain.targets[edge]
        known = {name: chain.truth[name][to] for name in reads}
        moved, _ = memory.step([cell[row] for cell in cells], known)
        return row, [to, *moved], [edge]

    growth = memory.growth() or "components and sources"
    space = reachable(
        [parents, *entered],
        [chain.size, *memory.sizes.values()],
        expand,
        depth=chain.ends[-1],
        max_states=max_states,
        growth=growth,
    )
    (edge,) = space.payload
    start = np.zeros(len(space.columns[0]))
    start[: len(parents)] = chain.start[parents]
    product = Chain(
        start,
        space.indptr,
        space.targets,
        tuple(values[edge.astype(np.int64)] for values in chain.values),
        chain.ends,
        truth_of(space.columns),
    )
    if trim:
        product = trimmed(product)
    return ProductChain(product, np.arange(len(parents)), parents)
