"""Where the satellites of the nominal GPS constellation stand, seen from a fixed point.

Circular orbits whose ground track repeats every sidereal day: the argument of latitude turns
twice as fast as the Earth, so every coordinate is a sum of three harmonics of the Earth's
rotation angle and a whole block of epochs is one product of arrays.
"""

from __future__ import annotations

import numpy as np
import pymap3d
from numpy.typing import NDArray

EARTH_RATE_RAD_PER_S = 7.2921151467e-5
"""WGS 84 rotation rate of the Earth (IS-GPS-200)."""
SIDEREAL_DAY_S = 2 * np.pi / EARTH_RATE_RAD_PER_S
SEMI_MAJOR_AXIS_M = 26_559_700.0
INCLINATION_DEG = 55.0
SLOT_EPOCH = np.datetime64("1993-07-01T00:00:00", "ns")
GREENWICH_HOUR_ANGLE_DEG = 15 * (18 + 36 / 60 + 14.4 / 3600)
"""Greenwich hour angle at `SLOT_EPOCH` (GPS SPS Performance Standard 2001, Table 3-1)."""

_PLANE_RAAN_DEG = {
    "A": 272.847, "B": 332.847, "C": 32.847, "D": 92.847, "E": 152.847, "F": 212.847,
}  # fmt: skip

# Argument of latitude [deg] at SLOT_EPOCH. GPS SPS Performance Standard 2001, Table 3-1.
_BASELINE_DEG = {
    "A1": 268.126, "A2": 161.786, "A3": 11.676, "A4": 41.806,
    "B1": 80.956, "B2": 173.336, "B3": 309.976, "B4": 204.376,
    "C1": 111.876, "C2": 11.796, "C3": 339.666, "C4": 241.556,
    "D1": 135.226, "D2": 265.446, "D3": 35.156, "D4": 167.356,
    "E1": 197.046, "E2": 302.596, "E3": 66.066, "E4": 333.686,
    "F1": 238.886, "F2": 345.226, "F3": 105.206, "F4": 135.346,
}  # fmt: skip

# The three expandable slots, each taken by a fore and an aft satellite.
# GPS SPS Performance Standard 2008, Table 3.2-2.
_EXPANDED_DEG = {
    "B1": {"B1F": 94.916, "B1A": 66.356},
    "D2": {"D2F": 282.676, "D2A": 257.976},
    "F2": {"F2F": 0.456, "F2A": 334.016},
}

SLOTS_24: dict[str, tuple[float, float]] = {
    slot: (_PLANE_RAAN_DEG[slot[0]], latitude) for slot, latitude in _BASELINE_DEG.items()
}
"""Right ascension of the ascending node and argument of latitude [deg] of the 24 slots."""

SLOTS_27: dict[str, tuple[float, float]] = {
    name: (_PLANE_RAAN_DEG[name[0]], latitude)
    for slot, baseline in _BASELINE_DEG.items()
    for name, latitude in _EXPANDED_DEG.get(slot, {slot: baseline}).items()
}
"""The same with all three expandable slots occupied twice."""


def earth_angle_rad(time: NDArray[np.datetime64]) -> NDArray[np.float64]:
    """Rotation of the Earth since the slots' epoch [rad], shape (n,), not reduced to a turn."""
    seconds = (time.astype("M8[ns]") - SLOT_EPOCH).astype(np.int64) / 1e9
    angle: NDArray[np.float64] = EARTH_RATE_RAD_PER_S * seconds
    return angle


def slot_harmonics(
    slots: dict[str, tuple[float, float]], *, lat_deg: float, lon_deg: float, height_m: float
) -> NDArray[np.float64]:
    """Coefficients of all satellites' east, north and up coordinates seen from one point.

    Parameters
    ----------
    slots : name -> (right ascension of the ascending node, argument of latitude) [deg].
    lat_deg, lon_deg, height_m : the point, geodetic, WGS 84.

    Returns
    -------
    (3, satellites, 7) [m]: the coefficients of 1, cos f, sin f, cos 2f, sin 2f, cos 3f, sin 3f,
    f being the Earth's rotation angle since the slots' epoch.

    Notes
    -----
    With node longitude L - f, argument of latitude U + 2f and c = cos(inclination) the rotation
    into the Earth-fixed frame gives
    x + iy = a ((1+c)/2 exp(i(L+U+f)) + (1-c)/2 exp(i(L-U-3f))), z = a sin(inclination) sin(U+2f).
    """
    node, latitude = np.radians(np.array(list(slots.values()))).T
    node = node - np.radians(GREENWICH_HOUR_ANGLE_DEG)
    c, s = np.cos(np.radians(INCLINATION_DEG)), np.sin(np.radians(INCLINATION_DEG))
    slow, fast = node + latitude, node - latitude
    ecef = np.zeros((3, len(slots), 7))
    ecef[0, :, 1], ecef[0, :, 2] = (1 + c) / 2 * np.cos(slow), -(1 + c) / 2 * np.sin(slow)
    ecef[1, :, 1], ecef[1, :, 2] = (1 + c) / 2 * np.sin(slow), (1 + c) / 2 * np.cos(slow)
    ecef[0, :, 5], ecef[0, :, 6] = (1 - c) / 2 * np.cos(fast), (1 - c) / 2 * np.sin(fast)
    ecef[1, :, 5], ecef[1, :, 6] = (1 - c) / 2 * np.sin(fast), -(1 - c) / 2 * np.cos(fast)
    ecef[2, :, 3], ecef[2, :, 4] = s * np.sin(latitude), s * np.cos(latitude)
    ecef *= SEMI_MAJOR_AXIS_M
    point = pymap3d.geodetic2ecef(lat_deg, lon_deg, height_m)
    ecef[:, :, 0] -= np.array(point)[:, None]
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    enu_from_ecef = np.array(
        [
            [-np.sin(lon), np.cos(lon), 0.0],
            [-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)],
            [np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)],
        ]
    )
    harmonics: NDArray[np.float64] = np.einsum("ij,jsk->isk", enu_from_ecef, ecef)
    return harmonics


def satellite_enu_m(
    harmonics: NDArray[np.float64], time: NDArray[np.datetime64]
) -> NDArray[np.float64]:
    """East, north and up of every satellite at every epoch, from the point of the harmonics.

    Parameters
    ----------
    harmonics : (3, satellites, 7), from `slot_harmonics`.
    time : (n,) GPS times.

    Returns
    -------
    (3, satellites, n) [m], at reception time (the 0.08 s of travel turn a line of sight by less
    than 2e-5 rad).
    """
    angle = earth_angle_rad(time)
    basis = np.ones((7, len(angle)))
    for k in (1, 2, 3):
        basis[2 * k - 1], basis[2 * k] = np.cos(k * angle), np.sin(k * angle)
    # Not `@`: for so small a product the threads of a BLAS cost more than they save.
    enu: NDArray[np.float64] = np.einsum("isk,kt->ist", harmonics, basis)
    return enu
