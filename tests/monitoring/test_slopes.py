from __future__ import annotations

import numpy as np
import pytest

from sbas.monitoring.detection_constants import detectable_shift
from sbas.monitoring.leave_one_out import leave_one_out
from sbas.monitoring.normal_equations import adjust, geometry, ranges, variance
from sbas.monitoring.slopes import (
    axis_slope,
    bias_per_shift_m,
    critical,
    horizontal_slope,
    largest,
    major_sigma_m,
    minimal_detectable_bias_m,
    track_axes,
)
from tests.monitoring.skies import random_sky, sky

SHIFT = detectable_shift(1e-3, 0.2)
UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("case", "biases"),
    [
        ("A", [8.26429593] * 4 + [np.inf]),
        ("B", [11.00895746] * 3 + [5.69865571] * 3),
        ("C", [6.93941206] * 4 + [5.69080437] * 3),
    ],
)
def test_minimal_detectable_biases_of_the_methods_page(case: str, biases: list[float]) -> None:
    found = minimal_detectable_bias_m(geometry(sky(case)), SHIFT)[:, 0]
    assert found == pytest.approx(biases, abs=5e-8)


def test_equal_measurements_of_one_unknown() -> None:
    """n equal measurements: r = 1 - 1/n and S = 1/n, whatever the geometry."""
    n = 5
    bias = SHIFT / np.sqrt(1 - 1 / n)
    assert bias == pytest.approx(4.619881871, abs=5e-9)
    assert bias / n == pytest.approx(0.923976374, abs=5e-9)
    # The same redundancy and bias appear in a sky with r = 0.8 for some range.
    g = geometry(sky("C"))
    scaled = bias_per_shift_m(g) * np.sqrt(g.redundancy)
    assert scaled == pytest.approx(1.0, rel=1e-12)


def test_a_harmless_range_has_slope_zero_and_a_critical_one_infinity() -> None:
    g = geometry(sky("A"))
    assert horizontal_slope(g)[4, 0] == 0
    assert np.isinf(axis_slope(g, UP)[4, 0])
    assert not critical(g)[0]
    assert critical(g, UP)[0]
    assert largest(horizontal_slope(g))[0] == pytest.approx(4.77139348 / SHIFT, abs=1e-8)


def test_slopes_are_the_sigmas_of_solution_separation() -> None:
    rng = np.random.default_rng(4)
    elevation, azimuth, sigma = random_sky(rng, 8, 200)
    g = geometry(ranges(elevation, azimuth, sigma))
    y = rng.normal(size=(8, 200)) * sigma
    a = adjust(g, y)
    out = leave_one_out(g, a)
    for axis in (*np.eye(3), np.array([0.6, 0.8, 0.0])):
        slope = axis_slope(g, axis)
        before = variance(g.covariance, axis)
        after = np.stack([variance(out.covariance[:, i], axis) for i in range(8)])
        assert after - before == pytest.approx(slope**2, rel=1e-6, abs=1e-9 * before.max())
        # The separation over its sigma is the w-test, on every axis.
        moved = np.einsum("q,qsn->sn", axis, out.step_m - a.step_m[:, None])
        w = a.residual_m * np.sqrt(g.weight / g.redundancy)
        assert np.abs(moved) == pytest.approx(np.abs(w) * slope, rel=1e-9, abs=1e-12)


def test_the_horizontal_slope_is_the_largest_along_any_heading() -> None:
    rng = np.random.default_rng(9)
    g = geometry(ranges(*random_sky(rng, 7, 30)))
    along = [largest(axis_slope(g, track_axes(h)[0])) for h in np.arange(0, 180, 0.05)]
    assert np.max(along, axis=0) == pytest.approx(largest(horizontal_slope(g)), rel=1e-6)
    assert (np.max(along, axis=0) <= largest(horizontal_slope(g)) * (1 + 1e-12)).all()


def test_track_axes_point_north_and_east() -> None:
    along, across = track_axes(0.0)
    assert along == pytest.approx([0, 1, 0])
    assert across == pytest.approx([1, 0, 0])
    along, across = track_axes(np.array([90.0, 180.0]))
    assert along == pytest.approx(np.array([[1, 0], [0, -1], [0, 0]]), abs=1e-15)
    assert across == pytest.approx(np.array([[0, -1], [-1, 0], [0, 0]]), abs=1e-15)


def test_the_major_axis_is_the_largest_eigenvalue() -> None:
    g = geometry(sky("B"))
    ee, en, nn = g.covariance[:3, 0]
    top = np.linalg.eigvalsh(np.array([[ee, en], [en, nn]])).max()
    assert major_sigma_m(g)[0] == pytest.approx(np.sqrt(top), rel=1e-12)
