"""Where the line of sight crosses the ionosphere, and how slanted.

Source: RTCA DO-229D, A.4.4.10.1 (pierce point) and A.4.4.10.4 (obliquity factor).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

EARTH_RADIUS_KM = 6378.1363
SHELL_HEIGHT_KM = 350.0
HIGH_LATITUDE_DEG = 70.0


class PiercePoints(NamedTuple):
    """Latitude and longitude [deg], longitude in -180..180, and the obliquity factor."""

    lat_deg: Floats
    lon_deg: Floats
    obliquity: Floats


def pierce_points(
    lat_deg: Floats,
    lon_deg: Floats,
    elevation_deg: Floats,
    azimuth_deg: Floats,
    *,
    earth_radius_km: float = EARTH_RADIUS_KM,
) -> PiercePoints:
    """Pierce points of lines of sight from receivers; all arrays broadcast [deg]."""
    lat, lon = np.deg2rad(lat_deg), np.deg2rad(lon_deg)
    elevation, azimuth = np.deg2rad(elevation_deg), np.deg2rad(azimuth_deg)
    ratio = earth_radius_km * np.cos(elevation) / (earth_radius_km + SHELL_HEIGHT_KM)
    psi = np.pi / 2 - elevation - np.arcsin(ratio)
    sine = np.sin(lat) * np.cos(psi) + np.cos(lat) * np.sin(psi) * np.cos(azimuth)
    lat_pp = np.arcsin(np.clip(sine, -1, 1))
    # Near the poles the argument may exceed 1 by rounding.
    step = np.arcsin(np.clip(np.sin(psi) * np.sin(azimuth) / np.cos(lat_pp), -1, 1))
    towards_pole = np.tan(psi) * np.cos(azimuth)
    limit = np.deg2rad(HIGH_LATITUDE_DEG)
    over_north = (lat > limit) & (towards_pole > np.tan(np.pi / 2 - lat))
    over_south = (lat < -limit) & (-towards_pole > np.tan(np.pi / 2 + lat))
    lon_pp = np.where(over_north | over_south, lon + np.pi - step, lon + step)
    wrapped = (np.rad2deg(lon_pp) + 180) % 360 - 180
    return PiercePoints(np.rad2deg(lat_pp), wrapped, 1 / np.sqrt(1 - ratio**2))
