"""Breadth first, with codes that fit a word and codes that do not."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.dependability.exact.state_space import Columns, Ints, reachable, repeat_rows
from sbas.exceptions import InputError


def ring(columns: int, length: int, size: int, **limits: int):  # type: ignore[no-untyped-def]
    """All columns count together around a ring."""

    def expand(layer: Columns, _first: bool) -> tuple[Ints, Columns, list[Ints]]:
        moved = [(column + 1) % length for column in layer]
        return np.arange(len(layer[0])), moved, [layer[0]]

    first = [np.zeros(1, dtype=np.int64)] * columns
    limits = {"depth": 1000, "max_states": 1000, **limits}
    return reachable(first, [size] * columns, expand, growth="ring", **limits)  # type: ignore[arg-type]


@pytest.mark.parametrize(("columns", "size"), [(2, 7), (12, 10**9)])
def test_a_ring(columns: int, size: int) -> None:
    space = ring(columns, 7, size)
    assert [column.tolist() for column in space.columns] == [list(range(7))] * columns
    assert space.targets.tolist() == [1, 2, 3, 4, 5, 6, 0]
    assert space.indptr.tolist() == list(range(8))


def test_depth_and_number_of_states() -> None:
    cut = ring(1, 100, 100, depth=4)
    assert cut.indptr.tolist() == [0, 1, 2, 3, 4, 4]
    with pytest.raises(InputError, match="more than 50 states"):
        ring(1, 100, 100, max_states=50)


def test_rows_of_several_lengths() -> None:
    row, entry = repeat_rows(np.array([2, 0, 3]), np.array([5, 9, 1]))
    assert row.tolist() == [0, 0, 2, 2, 2]
    assert entry.tolist() == [5, 6, 1, 2, 3]
