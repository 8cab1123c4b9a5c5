"""Rows of arrays that have the same keys."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def row_groups(*keys: Ints) -> Iterator[tuple[tuple[int, ...], Ints]]:
    """Each combination of (n,) small integers, from -1 up, and the rows that have it."""
    n = keys[0].size
    if not n:
        return
    code = np.zeros(n, np.int64)
    for key in keys:
        code = code * (int(key.max()) + 2) + key + 1
    if code.min() == code.max():
        yield tuple(int(key[0]) for key in keys), np.arange(n)
        return
    for value in np.unique(code):
        rows = np.flatnonzero(code == value)
        yield tuple(int(key[rows[0]]) for key in keys), rows
