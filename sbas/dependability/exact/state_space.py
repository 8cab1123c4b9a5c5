"""States that can be reached, found breadth first, many at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError

Ints = NDArray[np.int64]
Columns = list[Ints]
"""A state is a row over columns of small whole numbers."""

Expand = Callable[[Columns, bool], tuple[Ints, Columns, list[NDArray[np.generic]]]]
"""(states of a layer, whether it is the first) -> (index of the state in its layer, ascending;
columns of the next state; what else belongs to the move), all over moves."""

_CODES = 1 << 62
_INTERNED = 1 << 40

MAX_STATES = 2_000_000
"""Beyond, a solution takes gigabytes and hours: other means are better."""
MOVES_PER_STATE = 10
"""Of the largest chain: each move takes some 40 bytes."""


@dataclass(frozen=True)
class StateSpace:
    """Reachable states and the moves among them, as rows of a sparse matrix.

    Parameters
    ----------
    columns : of the states, in the order of discovery; the first ones are those asked for.
    indptr, targets : compressed rows: moves of state i are indptr[i] to indptr[i + 1].
    payload : what `expand` gave for each move.
    """

    columns: Columns
    indptr: Ints
    targets: Ints
    payload: list[NDArray[np.generic]]


def reachable(
    first: Columns,
    sizes: Sequence[int],
    expand: Expand,
    *,
    depth: int,
    max_states: int,
    growth: str,
) -> StateSpace:
    """All states that `expand` leads to from the first ones.

    Parameters
    ----------
    first : columns of the first states, all different.
    sizes : number of values of each column.
    expand : moves out of states; called once for each layer.
    depth : number of moves that are of interest; states first seen after so many are not left.
    max_states : largest number of states.
    growth : what makes states, said in the refusal.

    Raises
    ------
    InputError : more than `max_states` states, or 10 times as many moves.

    Notes
    -----
    A layer costs a few array operations and one look-up, by mixed-radix code, for each different
    state that it leads to.
    """
    encode = _Coder(sizes)
    number = {code: i for i, code in enumerate(encode(first).tolist())}
    layers, counts, targets, payloads = [first], [], [], []
    layer, deep, moves = first, 0, 0
    while len(layer[0]):
        if len(number) > max_states:
            raise _too_many(len(number), max_states, growth)
        if deep == depth:
            counts.append(np.zeros(len(layer[0]), dtype=np.int64))
            break
        origin, moved, payload = expand(layer, deep == 0)
        counts.append(np.bincount(origin, minlength=len(layer[0])))
        moves += len(origin)
        check_moves(moves, max_states=max_states, growth=growth)
        found, at, back = np.unique(encode(moved), return_index=True, return_inverse=True)
        before = len(number)
        ids = np.array([number.setdefault(code, len(number)) for code in found.tolist()], int)
        targets.append(ids[back.reshape(-1)])
        payloads.append(payload)
        layer = [column[at[ids >= before]] for column in moved]
        layers.append(layer)
        deep += 1
    return StateSpace(
        columns=[np.concatenate(parts) for parts in zip(*layers, strict=True)],
        indptr=np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(np.int64),
        targets=np.concatenate(targets),
        payload=[np.concatenate(parts) for parts in zip(*payloads, strict=True)],
    )


def repeat_rows(counts: Ints, begin: Ints) -> tuple[Ints, Ints]:
    """Row and entry of each entry of compressed rows that hold `counts` from `begin` on."""
    row = np.repeat(np.arange(len(counts)), counts)
    offset = np.cumsum(counts) - counts
    return row, np.arange(len(row)) - (offset - begin)[row]


class _Coder:
    """Columns to one whole number a row; equal numbers exactly for equal rows."""

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = [int(size) for size in sizes]
        self.tables: dict[int, dict[int, int]] = {}

    def __call__(self, columns: Columns) -> Ints:
        code = columns[0].astype(np.int64)
        bound = self.sizes[0]
        for i, (column, size) in enumerate(zip(columns[1:], self.sizes[1:], strict=True), start=1):
            if bound * size >= _CODES:
                # Numbered as they come, since a mixed radix of all columns would overflow.
                table = self.tables.setdefault(i, {})
                code = np.array(
                    [table.setdefault(c, len(table)) for c in code.tolist()], dtype=np.int64
                )
                bound = _INTERNED
            code = code * size + column
            bound *= size
        return code


def _too_many(count: int, max_states: int, growth: str) -> InputError:
    return InputError(
        f"the exact solution needs more than {max_states} states",
        where=growth,
        evidence=f"{count} found before the end",
        cure="a longer step_s or shorter delays and counts; a structure whose parts share "
        "nothing (solved one by one); simulation; or a larger max_states",
    )


def check_moves(moves: int, *, max_states: int, growth: str) -> None:
    """Refuse what has few states but too many moves among them.

    Raises
    ------
    InputError : more than 10 * `max_states` moves.
    """
    if moves > MOVES_PER_STATE * max_states:
        raise InputError(
            f"the exact solution needs more than {MOVES_PER_STATE * max_states} moves among states",
            where=growth,
            evidence=f"{moves} found before the end",
            cure="fewer components that move at once in one part; simulation (simulate_model); or "
            "a larger max_states",
        )


def check_bound(sizes: Sequence[int], *, max_states: int, growth: str) -> None:
    """Refuse before anything is built where nearly all combinations are reached.

    Raises
    ------
    InputError : more than `max_states` combinations.
    """
    bound = prod(int(size) for size in sizes)
    if bound > max_states:
        raise _too_many(bound, max_states, growth)
