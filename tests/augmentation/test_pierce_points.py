"""Pierce points and the obliquity factor."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sbas.augmentation.pierce_points import EARTH_RADIUS_KM, SHELL_HEIGHT_KM, pierce_points

RATIO = (EARTH_RADIUS_KM + SHELL_HEIGHT_KM) / EARTH_RADIUS_KM


@pytest.mark.parametrize(
    ("elevation", "factor"),
    [(5, 3.040638169510), (10, 2.790373003995), (30, 1.751421095157), (90, 1.0)],
)
def test_the_obliquity_factor(elevation: float, factor: float) -> None:
    found = pierce_points(np.zeros(1), np.zeros(1), np.array([elevation]), np.zeros(1))
    assert found.obliquity[0] == pytest.approx(factor, abs=1e-12)


@pytest.mark.parametrize(("elevation", "angle"), [(5, 14.200708764), (10, 11.000434345), (90, 0)])
def test_the_angle_at_the_earths_centre(elevation: float, angle: float) -> None:
    """Due north of the equator it is the latitude."""
    found = pierce_points(np.zeros(1), np.zeros(1), np.array([elevation]), np.zeros(1))
    assert found.lat_deg[0] == pytest.approx(angle, abs=1e-9)


@pytest.mark.parametrize(
    ("lat", "lon", "elevation", "azimuth", "lat_pp", "lon_pp"),
    [
        (47.5, 19.0, 10.0, 60.0, 52.016430033, 34.575748095),
        (35.33925, 139.52135, 30.0, 200.0, 30.796898579, 137.605068903),
    ],
)
def test_pierce_points(
    lat: float, lon: float, elevation: float, azimuth: float, lat_pp: float, lon_pp: float
) -> None:
    found = pierce_points(*(np.array([v]) for v in (lat, lon, elevation, azimuth)))
    assert found.lat_deg[0] == pytest.approx(lat_pp, abs=1e-9)
    assert found.lon_deg[0] == pytest.approx(lon_pp, abs=1e-9)


@given(st.floats(-89.9, 89.9), st.floats(-180, 180), st.floats(0.5, 90), st.floats(0, 360))
def test_the_line_of_sight_goes_through_the_shell_there(
    lat: float, lon: float, elevation: float, azimuth: float
) -> None:
    """In three dimensions, near the poles too: the way to the pierce point has the elevation and
    the azimuth of the line of sight."""
    found = pierce_points(*(np.array([v]) for v in (lat, lon, elevation, azimuth)))
    assert abs(found.lon_deg[0]) <= 180
    phi, lam = np.deg2rad([lat, found.lat_deg[0]]), np.deg2rad([lon, found.lon_deg[0]])
    places = np.stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)], axis=-1)
    way = RATIO * places[1] - places[0]
    east = np.array([-np.sin(lam[0]), np.cos(lam[0]), 0])
    north = np.cross(places[0], east)
    e, n, u = way @ east, way @ north, way @ places[0]
    assert np.rad2deg(np.arctan2(u, np.hypot(e, n))) == pytest.approx(elevation, abs=1e-5)
    assume(elevation < 89)
    turn = (np.rad2deg(np.arctan2(e, n)) - azimuth + 180) % 360 - 180
    assert turn * np.cos(np.deg2rad(elevation)) == pytest.approx(0, abs=1e-4)
