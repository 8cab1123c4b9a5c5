"""The broadcast (Klobuchar) ionosphere, which a non-precision approach falls back on.

Source: IS-GPS-200, 20.3.3.5.2.5, with the geomagnetic latitude of DO-229D as gLAB 6.0.0 takes
it; the least sigma of RTCA DO-229D, J.2.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.pierce_points import pierce_points

Floats = NDArray[np.float64]

LIGHT_MPS = 299792458.0
BROADCAST_EARTH_RADIUS_KM = 6378.137
_POLE_LAT_DEG, _POLE_LON_DEG = 78.3, 291.0
_NIGHT_S = 5e-9
_LEAST_PERIOD_S = 72000.0
_PEAK_S = 50400.0


class KlobucharDelay(NamedTuple):
    """Slant delay [m] and its 1-sigma [m]."""

    delay_m: Floats
    sigma_m: Floats


def klobuchar(
    alpha: tuple[float, ...],
    beta: tuple[float, ...],
    second_of_day: Floats,
    lat_deg: Floats,
    lon_deg: Floats,
    elevation_deg: Floats,
    azimuth_deg: Floats,
) -> KlobucharDelay:
    """Slant L1 delay of the broadcast model; arrays broadcast.

    Parameters
    ----------
    alpha, beta : four broadcast coefficients each [s, s per semicircle, ...].
    second_of_day : GPS second of the day at the receiver.
    lat_deg, lon_deg : receiver; elevation_deg, azimuth_deg : line of sight.
    """
    point = pierce_points(
        lat_deg, lon_deg, elevation_deg, azimuth_deg, earth_radius_km=BROADCAST_EARTH_RADIUS_KM
    )
    lat, pole = np.deg2rad(point.lat_deg), np.deg2rad(_POLE_LAT_DEG)
    sine = np.sin(lat) * np.sin(pole) + np.cos(lat) * np.cos(pole) * np.cos(
        np.deg2rad(point.lon_deg - _POLE_LON_DEG)
    )
    phi = np.arcsin(np.clip(sine, -1, 1))
    semicircles = phi / np.pi
    powers = [semicircles**n for n in range(4)]
    amplitude = sum(a * p for a, p in zip(alpha, powers, strict=True))
    period = np.maximum(sum(b * p for b, p in zip(beta, powers, strict=True)), _LEAST_PERIOD_S)
    local = (second_of_day + 43200 * np.deg2rad(point.lon_deg) / np.pi) % 86400
    x = 2 * np.pi * (local - _PEAK_S) / period
    day = np.where((np.abs(x) <= 1.57) & (amplitude > 0), amplitude * np.cos(x), 0.0)
    delay = point.obliquity * LIGHT_MPS * (_NIGHT_S + day)
    # Least vertical sigma by geomagnetic latitude: equatorial, middle and polar zone.
    zone = np.abs(np.rad2deg(phi))
    vertical = np.where(zone <= 20, 9.0, np.where(zone <= 55, 4.5, 6.0))
    return KlobucharDelay(delay, np.maximum(delay / 5, point.obliquity * vertical))
