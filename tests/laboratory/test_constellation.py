"""The nominal constellation against orbital mechanics written another way."""

from __future__ import annotations

import numpy as np
import pymap3d
import pytest

from sbas.laboratory.constellation import (
    EARTH_RATE_RAD_PER_S,
    GREENWICH_HOUR_ANGLE_DEG,
    INCLINATION_DEG,
    SEMI_MAJOR_AXIS_M,
    SIDEREAL_DAY_S,
    SLOT_EPOCH,
    SLOTS_24,
    SLOTS_27,
    earth_angle_rad,
    satellite_enu_m,
    slot_harmonics,
)

PARDUBICE = {"lat_deg": 50.03, "lon_deg": 15.77, "height_m": 289.4}
START = np.datetime64("2009-09-19T00:00:00", "ns")


def epochs(seconds):
    return START + np.asarray(np.round(np.asarray(seconds) * 1e9), "i8").astype("m8[ns]")


def ecef_by_rotations(slot, time):
    """Position by three rotation matrices: argument of latitude, inclination, node."""
    node_deg, latitude_deg = slot
    turned = EARTH_RATE_RAD_PER_S * ((time - SLOT_EPOCH) / np.timedelta64(1, "ns")) * 1e-9

    def about_z(angle):
        c, s = np.cos(angle), np.sin(angle)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    c, s = np.cos(np.radians(INCLINATION_DEG)), np.sin(np.radians(INCLINATION_DEG))
    tilt = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    latitude = np.radians(latitude_deg) + 2 * turned
    in_orbit = SEMI_MAJOR_AXIS_M * np.array([np.cos(latitude), np.sin(latitude), 0])
    inertial = about_z(np.radians(node_deg)) @ tilt @ in_orbit
    return about_z(-np.radians(GREENWICH_HOUR_ANGLE_DEG) - turned) @ inertial


def test_positions_equal_three_rotations():
    times = epochs([0, 1, 5000, 86400, 299_999.5])
    enu = satellite_enu_m(slot_harmonics(SLOTS_27, **PARDUBICE), times)
    for column, time in enumerate(times):
        for row, slot in enumerate(SLOTS_27.values()):
            x, y, z = ecef_by_rotations(slot, time)
            expected = pymap3d.ecef2enu(x, y, z, 50.03, 15.77, 289.4)
            assert enu[:, row, column] == pytest.approx(expected, abs=0.01)


def test_the_mean_motion_is_keplers_to_the_share_that_oblateness_takes():
    # Kepler's third law with the WGS 84 gravitational constant; the nominal 26 559.7 km orbit is
    # half a sidereal day long only with the Earth's oblateness (about 1 part in 10 000).
    period_s = 2 * np.pi * np.sqrt(SEMI_MAJOR_AXIS_M**3 / 3.986004418e14)
    assert period_s == pytest.approx(SIDEREAL_DAY_S / 2, rel=2e-4)
    # One turn against the stars (IERS: 86 164.0989 s), 8.4 ms longer than against the equinox.
    assert pytest.approx(86164.0989, abs=1e-4) == SIDEREAL_DAY_S


def test_orbits_are_circles_of_half_a_sidereal_day():
    harmonics = slot_harmonics(SLOTS_24, **PARDUBICE)
    times = epochs(np.linspace(0, SIDEREAL_DAY_S, 500))
    x, y, z = pymap3d.enu2ecef(*satellite_enu_m(harmonics, times), 50.03, 15.77, 289.4)
    assert np.hypot(np.hypot(x, y), z) == pytest.approx(SEMI_MAJOR_AXIS_M, rel=1e-11)
    highest = SEMI_MAJOR_AXIS_M * np.sin(np.radians(INCLINATION_DEG))
    assert z.max() == pytest.approx(highest, rel=1e-4)
    half = satellite_enu_m(harmonics, times + np.timedelta64(round(SIDEREAL_DAY_S / 2 * 1e9), "ns"))
    assert pymap3d.enu2ecef(*half, 50.03, 15.77, 289.4)[2] == pytest.approx(z, abs=1)


def test_ground_track_repeats_after_a_sidereal_day_and_not_after_a_solar_one():
    harmonics = slot_harmonics(SLOTS_27, **PARDUBICE)
    now = satellite_enu_m(harmonics, epochs(np.arange(0, 7200, 60)))
    day = satellite_enu_m(harmonics, epochs(np.arange(0, 7200, 60) + SIDEREAL_DAY_S))
    assert day == pytest.approx(now, abs=0.02)
    solar = satellite_enu_m(harmonics, epochs(np.arange(0, 7200, 60) + 86400))
    assert np.abs(solar - now).max() > 1e5


def test_slots_are_six_planes_sixty_degrees_apart():
    assert (len(SLOTS_24), len(SLOTS_27)) == (24, 27)
    planes = sorted({node for node, _ in SLOTS_24.values()})
    assert np.diff(planes) == pytest.approx(60, abs=1e-9)
    for name, (node, latitude) in SLOTS_27.items():
        if name in SLOTS_24:
            assert SLOTS_24[name] == (node, latitude)
            continue
        # Fore and aft lie on both sides of the baseline slot they replace, within 20 degrees.
        away = (latitude - SLOTS_24[name[:2]][1] + 180) % 360 - 180
        assert 5 < (away if name[2] == "F" else -away) < 20


@pytest.mark.parametrize(("slots", "fewest", "most"), [(SLOTS_24, 5, 11), (SLOTS_27, 6, 12)])
def test_satellites_in_view_above_five_degrees(slots, fewest, most):
    enu = satellite_enu_m(slot_harmonics(slots, **PARDUBICE), epochs(np.arange(0, 86164, 30)))
    distance = np.sqrt((enu**2).sum(axis=0))
    elevation = np.degrees(np.arcsin(enu[2] / distance))
    assert -90 <= elevation.min() < elevation.max() <= 90
    in_view = (elevation > 5).sum(axis=0)
    assert fewest <= in_view.min() <= in_view.max() <= most
    # 20 193 km straight overhead; on the horizon 25 785 km by Pythagoras, to the 21 km by which
    # the ellipsoid's normal (0.19 degrees off the radius) tilts the horizon.
    above = distance[elevation > 0]
    assert 20.193e6 < above.min() < above.max() < 25.785e6 + 22e3


def test_no_satellite_stands_in_the_northern_hole():
    # Ground tracks end at 55 degrees of latitude, so at 50 degrees none is seen low in the north.
    enu = satellite_enu_m(slot_harmonics(SLOTS_27, **PARDUBICE), epochs(np.arange(0, 86164, 30)))
    elevation = np.degrees(np.arcsin(enu[2] / np.sqrt((enu**2).sum(axis=0))))
    azimuth = np.degrees(np.arctan2(enu[0], enu[1]))
    assert not np.any((np.abs(azimuth) < 10) & (elevation > 12) & (elevation < 60))


def test_earth_angle_turns_once_a_sidereal_day():
    angle = earth_angle_rad(epochs([0.0, SIDEREAL_DAY_S]))
    assert np.diff(angle) == pytest.approx(2 * np.pi, abs=1e-9)
