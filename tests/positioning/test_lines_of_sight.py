"""Directions against pymap3d."""

from __future__ import annotations

import numpy as np
import pymap3d
import pytest

from sbas.positioning.lines_of_sight import horizons, lines_of_sight


def test_directions_are_those_of_pymap3d() -> None:
    rng = np.random.default_rng(8)
    k = 500
    lat, lon, height = rng.uniform(-89, 89, k), rng.uniform(-180, 180, k), rng.uniform(0, 9e3, k)
    place = np.column_stack(pymap3d.geodetic2ecef(lat, lon, height))
    azimuth, elevation = rng.uniform(0, 360, k), rng.uniform(-30, 90, k)
    satellite = np.column_stack(pymap3d.aer2ecef(azimuth, elevation, 2.2e7, lat, lon, height))
    seen = lines_of_sight(satellite, horizons(place))
    assert seen.elevation_deg == pytest.approx(elevation, abs=1e-8)
    apart = (seen.azimuth_deg - azimuth + 180) % 360 - 180
    assert np.abs(apart * np.cos(np.radians(elevation))).max() < 1e-8
    assert seen.distance_m == pytest.approx(np.full(k, 2.2e7), abs=1e-6)
    assert np.linalg.norm(seen.enu, axis=0) == pytest.approx(np.ones(k))
    assert seen.unit == pytest.approx((satellite - place) / seen.distance_m[:, None])


def test_one_horizon_serves_all() -> None:
    rng = np.random.default_rng(9)
    place = np.array([[4.0e6, 1.0e6, 4.85e6]])
    satellite = rng.normal(size=(50, 3)) * 1.5e7
    one = lines_of_sight(satellite, horizons(place))
    many = lines_of_sight(satellite, horizons(np.repeat(place, 50, axis=0)))
    for name, values in vars(one).items():
        assert values == pytest.approx(vars(many)[name]), name


def test_azimuth_lies_in_0_to_360() -> None:
    place = np.column_stack(pymap3d.geodetic2ecef([0.0], [0.0], [0.0]))
    for east, azimuth in ((0.0, 0.0), (-1e-30, 0.0), (-1.0, 315.0), (1.0, 45.0)):
        north = 1.0
        satellite = place + 1e6 * np.array([[0.5, east, north]])
        assert lines_of_sight(satellite, horizons(place)).azimuth_deg[0] == pytest.approx(
            azimuth, abs=1e-6
        )


def test_steps_come_back() -> None:
    rng = np.random.default_rng(10)
    lat, lon = rng.uniform(-89, 89, 40), rng.uniform(-180, 180, 40)
    place = np.column_stack(pymap3d.geodetic2ecef(lat, lon, 100.0))
    enu = rng.normal(0, 50, (40, 3))
    moved = horizons(place).moved(enu)
    back = np.column_stack(pymap3d.ecef2enu(*moved.T, lat, lon, 100.0))
    assert back == pytest.approx(enu, abs=1e-7)


def test_a_place_that_is_not_known_has_no_horizon() -> None:
    place = np.array([[np.nan] * 3, [0.0, 0.0, 6.4e6]])
    seen = horizons(place)
    assert np.isnan(seen.lat_deg[0])
    assert seen.lat_deg[1] == pytest.approx(90.0)
    line = lines_of_sight(np.full((2, 3), 2e7), seen)
    assert np.isnan(line.elevation_deg[0])
    assert np.isfinite(line.elevation_deg[1])
