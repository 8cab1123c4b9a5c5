"""Joining messages by time: against a plain loop, file order, repeated times."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sbas.logs.programs.epoch_join import distinct, joined_epochs, occurrence

kinds = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 6)), max_size=30)


@given(kinds)
def test_against_a_plain_loop(messages: list[tuple[int, int]]) -> None:
    # Times near 2**60 ns: a float would merge them.
    base = 1_740_000_000_000_000_000
    times = [[base + t for kind, t in messages if kind == k] for k in range(3)]
    lines = [[i for i, (kind, _) in enumerate(messages) if kind == k] for k in range(3)]
    epochs: dict[tuple[int, int], list[int]] = {}
    seen = [0, 0, 0]
    count: dict[tuple[int, int], int] = {}
    for kind, t in messages:
        nth = count[kind, t] = count.get((kind, t), -1) + 1
        epochs.setdefault((base + t, nth), [-1, -1, -1])[kind] = seen[kind]
        seen[kind] += 1
    found, rows = joined_epochs(
        [np.array(t, np.int64) for t in times], [np.array(x, np.int64) for x in lines]
    )
    assert found.tolist() == [t for t, _ in epochs]
    assert [list(row) for row in zip(*(r.tolist() for r in rows), strict=True)] == list(
        epochs.values()
    )


def test_nothing_to_join() -> None:
    none = np.zeros(0, np.int64)
    found, rows = joined_epochs([none, none], [none, none])
    assert len(found) == 0
    assert [len(row) for row in rows] == [0, 0]


def test_occurrence() -> None:
    assert occurrence(np.array([5, 3, 5, 5, 3])).tolist() == [0, 0, 1, 2, 1]


def test_distinct() -> None:
    assert distinct(np.array([5, 3, 5, 7, 3])).tolist() == [3, 5, 7]
    assert len(distinct(np.zeros(0, np.int64))) == 0
