"""Rows with the same keys."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sbas.augmentation.row_groups import row_groups


@given(st.lists(st.tuples(st.integers(-1, 3), st.integers(-1, 2)), max_size=30))
def test_every_row_is_in_the_group_of_its_keys(pairs: list[tuple[int, int]]) -> None:
    keys = np.array(pairs, np.int64).reshape(-1, 2).T
    found = list(row_groups(keys[0], keys[1]))
    assert sorted(row for _, rows in found for row in rows.tolist()) == list(range(len(pairs)))
    assert {values for values, _ in found} == set(pairs)
    assert len(found) == len(set(pairs))
    for values, rows in found:
        assert all(pairs[row] == values for row in rows)
