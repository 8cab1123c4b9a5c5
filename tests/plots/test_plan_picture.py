"""Positions in plan, in metres."""

from __future__ import annotations

import numpy as np
import pymap3d
import pytest

from sbas.plots.plan_picture import MOST_POINTS, ground_plan
from sbas.recording import Recording
from tests.plots.synthetic import synthetic_recording


def at(east_m: np.ndarray, north_m: np.ndarray) -> Recording:
    lat, lon, height = pymap3d.enu2geodetic(east_m, north_m, 0 * east_m, 50.0, 15.0, 300.0)
    recording = synthetic_recording(east_m.size)
    return recording.replace(
        table=recording.table.assign(lat_deg=lat, lon_deg=lon, height_m=height)
    )


def test_metres_east_and_north_of_the_median() -> None:
    steps = np.array([-100.0, 0.0, 100.0])
    ax = ground_plan({"A": at(steps, 2 * steps)})
    points, median = ax.get_lines()
    np.testing.assert_allclose(points.get_xdata(), steps, atol=1e-3)
    np.testing.assert_allclose(points.get_ydata(), 2 * steps, atol=5e-3)
    np.testing.assert_allclose((median.get_xdata()[0], median.get_ydata()[0]), 0, atol=1e-3)


def test_two_recordings_keep_their_distance() -> None:
    zero = np.zeros(5)
    ax = ground_plan({"A": at(zero, zero), "B": at(zero + 3.0, zero)})
    medians = [line for line in ax.get_lines() if np.size(line.get_xdata()) == 1]
    assert medians[1].get_xdata()[0] - medians[0].get_xdata()[0] == pytest.approx(3, abs=1e-6)
    labels = [t.get_text() for t in ax.get_legend().get_texts()]
    assert labels == ["A, 5 positions", "B, 5 positions"]


def test_unknown_positions_are_left_out_and_many_are_thinned() -> None:
    n = 3 * MOST_POINTS
    east = np.arange(n, dtype=float) / 100
    recording = at(east, 0 * east)
    latitude = recording.table["lat_deg"].to_numpy().copy()
    latitude[:1000] = np.nan
    table = recording.table.assign(lat_deg=latitude)
    ax = ground_plan({"A": recording.replace(table=table)})
    assert np.size(ax.get_lines()[0].get_xdata()) <= MOST_POINTS
    assert ax.get_legend().get_texts()[0].get_text() == f"A, {n - 1000:,} positions"
