"""Tropospheric delay and its residual, as SBAS receivers model it.

Source: RTCA DO-229D, A.4.2.4 (UNB3 with five latitudes and a yearly cycle).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_LATITUDE_DEG = np.array([15.0, 30.0, 45.0, 60.0, 75.0])
_MEAN = np.array(
    [
        [1013.25, 1017.25, 1015.75, 1011.75, 1013.00],
        [299.65, 294.15, 283.15, 272.15, 263.65],
        [26.31, 21.79, 11.66, 6.78, 4.11],
        [6.30e-3, 6.05e-3, 5.58e-3, 5.39e-3, 4.53e-3],
        [2.77, 3.15, 2.57, 1.81, 1.55],
    ]
)
"""Pressure [mbar], temperature [K], water vapour pressure [mbar], lapse rate [K/m], lambda."""
_SEASON = np.array(
    [
        [0.0, -3.75, -2.25, -1.75, -0.50],
        [0.0, 7.0, 11.0, 15.0, 14.5],
        [0.0, 8.85, 7.24, 5.36, 3.39],
        [0.0, 0.25e-3, 0.32e-3, 0.81e-3, 0.62e-3],
        [0.0, 0.33, 0.46, 0.74, 0.30],
    ]
)
_COLDEST_DAY_NORTH, _COLDEST_DAY_SOUTH = 28.0, 211.0
_K1, _K2, _RD, _GM, _G = 77.604, 382000.0, 287.054, 9.784, 9.80665
ZENITH_SIGMA_M = 0.12


def mapping(elevation_deg: Floats) -> Floats:
    """Slant over vertical delay, valid from 4 degrees of elevation."""
    sine = np.sin(np.deg2rad(elevation_deg))
    factor: Floats = 1.001 / np.sqrt(0.002001 + sine**2)
    return factor


def residual_sigma_m(elevation_deg: Floats) -> Floats:
    """1-sigma of what the model leaves [m]."""
    return ZENITH_SIGMA_M * mapping(elevation_deg)


def zenith_delay_m(lat_deg: Floats, height_m: Floats, day_of_year: Floats) -> Floats:
    """Vertical delay [m] at (n,) latitudes, heights [m] and days of the year (1 to 366)."""
    absolute = np.abs(lat_deg)
    coldest = np.where(np.asarray(lat_deg) >= 0, _COLDEST_DAY_NORTH, _COLDEST_DAY_SOUTH)
    season = np.cos(2 * np.pi * (day_of_year - coldest) / 365.25)
    pressure, temperature, vapour, lapse, lam = (
        np.interp(absolute, _LATITUDE_DEG, mean)
        - np.interp(absolute, _LATITUDE_DEG, cycle) * season
        for mean, cycle in zip(_MEAN, _SEASON, strict=True)
    )
    hydrostatic = 1e-6 * _K1 * _RD * pressure / _GM
    wet = 1e-6 * _K2 * _RD / (_GM * (lam + 1) - lapse * _RD) * vapour / temperature
    base = np.maximum(1 - lapse * height_m / temperature, 0.0)
    exponent = _G / (_RD * lapse)
    delay: Floats = hydrostatic * base**exponent + wet * base ** ((lam + 1) * exponent - 1)
    return delay
