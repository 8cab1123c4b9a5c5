"""Mergeable summaries give what the whole array gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas import streaming
from sbas.streaming import DensityGrid, Distribution, ThinnedSeries


def test_a_distribution_is_exact_while_it_keeps_its_values() -> None:
    values = np.random.default_rng(1).normal(10, 3, 5000)
    seen = Distribution()
    for part in np.array_split(values, 7):
        seen.update(np.append(part, np.nan))
    assert seen.count == 5000
    assert seen.error == 0
    for q in (0.0, 0.5, 0.95, 1.0):
        assert seen.quantile(q) == pytest.approx(np.quantile(values, q), rel=1e-15)
    assert seen.mean == pytest.approx(values.mean(), rel=1e-13)


@pytest.mark.parametrize("scale", [1.0, 1e5])
def test_a_long_stream_is_right_to_its_stated_error(
    monkeypatch: pytest.MonkeyPatch, scale: float
) -> None:
    monkeypatch.setattr(streaming, "EXACT_VALUES", 1000)
    monkeypatch.setattr(streaming, "MAX_CELLS", 5000)
    values = np.random.default_rng(2).normal(0, scale, 40_000)
    parts = np.array_split(values, 6)
    left, right = Distribution(), Distribution()
    for part in parts[:2]:
        left.update(part)
    for part in parts[2:]:
        right.update(part)
    left.merge(right)
    assert left.count == values.size
    assert left._cells is not None
    assert left._cells.size <= 5000
    for q in (0.01, 0.5, 0.95):
        inverse = np.quantile(values, q, method="inverted_cdf")
        neighbours = np.ptp(np.sort(values)[int(q * values.size) - 2 : int(q * values.size) + 3])
        assert abs(left.quantile(q) - inverse) <= left.error + neighbours
    assert (left.min, left.max) == (values.min(), values.max())


def test_a_merge_of_a_kept_and_a_gridded_part_loses_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(streaming, "EXACT_VALUES", 100)
    big, small = Distribution(), Distribution()
    big.update(np.arange(500.0))
    small.update(np.arange(50.0))
    for a, b in ((big, small),):
        b.merge(a)
        assert b.count == 550
        assert b._counts.sum() == 550


@given(st.lists(st.integers(0, 10_000), min_size=2, max_size=300), st.integers(1, 50))
def test_no_spike_is_lost_by_thinning(steps: list[int], bins: int) -> None:
    time = np.unique(np.array(steps)).astype(np.int64)
    values = np.sin(time.astype(float))
    whole = ThinnedSeries(int(time[0]), int(time[-1]), ("x",), bins)
    for t, v in zip(np.array_split(time, 3), np.array_split(values, 3), strict=True):
        whole.update(t, {"x": v})
    low, high = whole.band("x")
    assert np.nanmax(high) == values.max()
    assert np.nanmin(low) == values.min()


@given(
    st.lists(st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=1, max_size=100),
    st.integers(0, 100),
)
def test_a_density_grid_counts_every_point_however_it_grew(
    points: list[tuple[float, float]], cut: int
) -> None:
    x, y = np.array(points).T
    parts = [DensityGrid(), DensityGrid()]
    parts[0].update(x[:cut], y[:cut])
    parts[1].update(x[cut:], y[cut:])
    parts[0].merge(parts[1])
    grid = parts[0]
    assert grid.counts.sum() + grid.outside == len(points)
    assert grid.outside == 0
    once = DensityGrid(grid.cell)
    once.update(x, y)
    assert once.counts.tolist() == grid.counts.tolist()


def test_points_beyond_the_largest_grid_are_counted_outside() -> None:
    grid = DensityGrid()
    grid.update(np.array([0.0, 1e9]), np.array([0.0, 0.0]))
    assert (grid.counts.sum(), grid.outside) == (1, 1)
