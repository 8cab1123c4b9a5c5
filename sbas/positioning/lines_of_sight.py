"""Horizons of receivers, and satellites seen from them.

Source: the rotation from earth-fixed axes to east, north and up is the textbook's (IS-GPS-200
has no other); geodetic coordinates on WGS 84.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.positioning.orbits import length

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Horizons:
    """East, north and up at (n,) places.

    `axes` (n, 3, 3): rows east, north, up, earth-fixed.
    """

    place_m: Floats
    lat_deg: Floats
    lon_deg: Floats
    height_m: Floats
    axes: Floats

    def at(self, index: Ints) -> Horizons:
        """(k,) horizons by index; a single one serves all without being copied."""
        if self.lat_deg.size == 1:
            return self
        return Horizons(
            self.place_m[index], self.lat_deg[index], self.lon_deg[index], self.height_m[index],
            self.axes[index],
        )  # fmt: skip

    def moved(self, enu_m: Floats) -> Floats:
        """(n, 3) earth-fixed places after steps of (n, 3) east, north, up [m]."""
        steps = np.einsum("nij,ni->nj", np.broadcast_to(self.axes, (len(enu_m), 3, 3)), enu_m)
        place: Floats = self.place_m + steps
        return place


def horizons(place_m: Floats) -> Horizons:
    """Horizons at (n, 3) earth-fixed places; NaN where a place is not known."""
    known = np.asarray(np.isfinite(place_m).all(axis=1))
    safe = np.where(known[:, None], place_m, [[6378137.0, 0.0, 0.0]])
    lat_deg, lon_deg, height_m = (
        np.where(known, value, np.nan) for value in pymap3d.ecef2geodetic(*safe.T)
    )
    lat, lon = np.deg2rad(lat_deg), np.deg2rad(lon_deg)
    sin_lat, cos_lat, sin_lon, cos_lon = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    axes = np.stack(
        [
            np.stack([-sin_lon, cos_lon, np.zeros_like(lat)], axis=-1),
            np.stack([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat], axis=-1),
            np.stack([cos_lat * cos_lon, cos_lat * sin_lon, sin_lat], axis=-1),
        ],
        axis=1,
    )
    return Horizons(place_m, lat_deg, lon_deg, height_m, axes)


@dataclass(frozen=True, eq=False)
class LinesOfSight:
    """(k,) satellites seen from receivers: distance [m], directions [deg], and the same line as
    unit vectors: `unit` (k, 3) earth-fixed, `enu` (3, k) east, north, up."""

    distance_m: Floats
    elevation_deg: Floats
    azimuth_deg: Floats
    unit: Floats
    enu: Floats


def lines_of_sight(satellite_m: Floats, horizon: Horizons) -> LinesOfSight:
    """Lines to (k, 3) satellites from (k,) horizons, or from one."""
    line = satellite_m - horizon.place_m
    distance = length(line)
    unit = line / distance[:, None]
    if horizon.lat_deg.size == 1:
        enu = horizon.axes[0] @ unit.T
    else:
        enu = np.einsum("kij,kj->ik", horizon.axes, unit)
    east, north, up = enu
    azimuth = np.rad2deg(np.arctan2(east, north))
    # Adding 360 to a tiny negative azimuth rounds to 360 itself, which is north again.
    azimuth = np.where(azimuth < 0, azimuth + 360.0, azimuth)
    azimuth[azimuth >= 360.0] = 0.0
    elevation = np.rad2deg(np.arctan2(up, np.hypot(east, north)))
    return LinesOfSight(distance, elevation, azimuth, unit, enu)
