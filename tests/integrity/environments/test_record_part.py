"""Parts of a record: rows and time by brute force, and their cells of the grid of errors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.estimate import Refusal
from sbas.integrity.correlation.error_grid import ErrorGrid
from sbas.integrity.environments.record_part import RecordPart, shared
from sbas.integrity.shares.time_spans import Spans


def part_of(labels: list[str], time: list[int], label: str, interval: int = 10) -> RecordPart:
    """The stretches of a label, found one epoch at a time."""
    stretches: list[list[int]] = []
    ends = [*time[1:], time[-1] + interval]
    for i, name in enumerate(labels):
        if name != label:
            continue
        if stretches and stretches[-1][1] == i:
            stretches[-1][1], stretches[-1][3] = i + 1, ends[i]
        else:
            stretches.append([i, i + 1, time[i], ends[i]])
    return RecordPart(*np.array(stretches, np.int64).reshape(-1, 4).T)


@st.composite
def labelled_times(draw: st.DrawFn) -> tuple[list[str], list[int]]:
    n = draw(st.integers(1, 30))
    steps = draw(st.lists(st.sampled_from([4, 10, 10, 13, 55]), min_size=n, max_size=n))
    labels = draw(st.lists(st.sampled_from("abc"), min_size=n, max_size=n))
    return labels, np.cumsum(steps).tolist()


@given(labelled_times(), st.data())
def test_rows_and_time_between_any_two_places(
    made: tuple[list[str], list[int]], data: st.DataObject
) -> None:
    labels, time = made
    n = len(labels)
    rows = data.draw(st.tuples(st.integers(0, n), st.integers(0, n)).map(sorted))
    span = data.draw(
        st.tuples(st.integers(time[0], time[-1] + 10), st.integers(time[0], time[-1] + 10)).map(
            sorted
        )
    )
    ends = [*time[1:], time[-1] + 10]
    for label in set(labels):
        part = part_of(labels, time, label)
        assert part.rows == labels.count(label)
        between = part.rows_between(*np.array(rows, np.int64)[:, None])
        assert between.tolist() == [labels[rows[0] : rows[1]].count(label)]
        assert part.holds(np.arange(n)).tolist() == [x == label for x in labels]
        owner = {t: x for x, a, b in zip(labels, time, ends, strict=True) for t in range(a, b)}
        held = sum(owner[t] == label for t in range(*span))
        assert part.ns_between(*np.array(span, np.int64)[:, None]).tolist() == [held]


@given(labelled_times())
def test_parts_share_the_cells_of_the_grid_without_overlap_or_rest(
    made: tuple[list[str], list[int]],
) -> None:
    labels, time = made
    cells = [(t - time[0] + 5) // 10 for t in time]
    values = np.full((2, cells[-1] + 1), np.nan, np.float32)
    owner = {}
    for label, cell, size in zip(labels, cells, range(1, len(cells) + 1), strict=True):
        values[:, cell] = size
        owner[cell] = label
    hpl = values[0] * 2
    modes = np.zeros(values.shape[1], np.int8)
    grid = ErrorGrid(values, 10, time[0], hpl, modes)
    for label in set(labels):
        found = part_of(labels, time, label).grid_of(grid)
        mine = {cell: values[0, cell] for cell, name in owner.items() if name == label}
        if isinstance(found, Refusal):
            assert not mine
            continue
        assert found.hpl_m is not None
        assert found.modes is not None
        first = (found.begin_ns - time[0]) // 10
        seen = np.flatnonzero(np.isfinite(found.values[0]))
        assert {int(i) + first: found.values[0, i] for i in seen} == mine
        np.testing.assert_array_equal(found.values[1], found.values[0])
        np.testing.assert_array_equal(found.hpl_m, 2 * found.values[0])
        assert found.modes.size == found.values.shape[1]


def test_an_epoch_without_a_cell_of_its_own_is_refused() -> None:
    grid = ErrorGrid(np.ones((2, 3), np.float32), 10, 0)
    two_in_one_cell = RecordPart(*np.array([[0], [1], [0], [3]]))
    refused = two_in_one_cell.grid_of(grid)
    assert isinstance(refused, Refusal)
    assert "regular grid" in refused.reason


@pytest.mark.parametrize(
    ("a", "b", "both"),
    [
        ([(0, 10)], [(5, 20)], [(5, 10)]),
        ([(0, 10), (20, 30)], [(5, 25)], [(5, 10), (20, 25)]),
        ([(0, 10)], [(10, 20)], []),
        ([(0, 10), (10, 20)], [(0, 20)], [(0, 20)]),
        ([(0, 10)], [], []),
        ([], [], []),
    ],
)
def test_the_time_that_lies_in_both(
    a: list[tuple[int, int]], b: list[tuple[int, int]], both: list[tuple[int, int]]
) -> None:
    def spans(pairs: list[tuple[int, int]]) -> Spans:
        return Spans(*np.array(pairs, np.int64).reshape(-1, 2).T)

    found = shared(spans(a), spans(b))
    assert list(zip(found.start_ns.tolist(), found.end_ns.tolist(), strict=True)) == both
