"""Rows of transition probabilities: that they are laws, and that they have one stationary law."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sbas.dependability.tree.model_values import a_number, items, refuse

SUM_TOLERANCE = 1e-9
"""Rows are printed with about ten digits; anything further off is another chain."""

Rows = tuple[tuple[float, ...], ...]


def check_law(law: Any, size: int, where: str) -> None:
    """Raise ModelError unless these are `size` probabilities with sum 1 within 1e-9."""
    values = items(law, where)
    if len(values) != size:
        raise refuse(
            f"{len(values)} probabilities for {size} states", where, values, "one for each state"
        )
    for i, value in enumerate(values):
        a_number(value, f"{where}[{i}]", high=1.0)
    total = math.fsum(values)
    if abs(total - 1.0) > SUM_TOLERANCE:
        raise refuse(
            "probabilities that do not sum to 1", where, f"{values}: sum {total!r}",
            "write them with all digits; beyond 1e-9 nothing is normalised",
        )  # fmt: skip


def check_rows(rows: Any, size: int, where: str) -> None:
    """Raise ModelError unless this is a square matrix of laws, one row a state."""
    if len(items(rows, where)) != size:
        raise refuse(f"{len(rows)} rows for {size} states", where, rows, "one row for each state")
    for i, row in enumerate(rows):
        check_law(row, size, f"{where}[{i}]")


def normalised_rows(rows: Rows) -> Rows:
    """Rows that sum to 1: the largest entry is what the others leave.

    Parameters
    ----------
    rows : laws with sum 1 within 1e-9, as `check_model` demands; a single law as one row.

    Returns
    -------
    The same with the largest entry (the first of equals) replaced by 1 - sum of the others, so
    that small entries keep their digits.
    """
    return tuple(_normalised(row) for row in rows)


def _normalised(row: tuple[float, ...]) -> tuple[float, ...]:
    largest = row.index(max(row))
    rest = math.fsum(p for i, p in enumerate(row) if i != largest)
    return (*row[:largest], 1.0 - rest, *row[largest + 1 :])


def has_one_stationary_law(rows: Rows) -> bool:
    """Whether the chain has exactly one closed class of states, hence one stationary law."""
    from scipy.sparse.csgraph import connected_components

    moves = np.array(rows, dtype=float) > 0.0
    count, label = connected_components(moves, directed=True, connection="strong")
    leaves = moves & (label[:, None] != label[None, :])
    return bool(count - len(set(label[leaves.any(axis=1)].tolist())) == 1)
