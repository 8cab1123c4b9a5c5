"""DO-229 standard deviations of the pseudorange error of one satellite.

Source: RTCA DO-229D, Appendices A and J, as written in docs/methods/laboratory.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

EARTH_RADIUS_M = 6_378_136.3
IONOSPHERE_HEIGHT_M = 350_000.0
SIGMA_NOISE_M = 0.36
"""Upper bound of receiver noise and interference for a GPS satellite, class 2 (J.2.4)."""

# Indices 14 and 15 (UDRE) and 15 (GIVE) mean not monitored or do not use: no variance.
UDRE_VARIANCE_M2 = (
    0.0520, 0.0924, 0.1444, 0.2830, 0.4678, 0.8315, 1.2992, 1.8709, 2.5465, 3.3260, 5.1968,
    20.7870, 230.9661, 2078.695,
)  # fmt: skip
"""Variance by UDREI 0..13 (DO-229D, Table A-6)."""
GIVE_VARIANCE_M2 = (
    0.0084, 0.0333, 0.0749, 0.1331, 0.2079, 0.2994, 0.4075, 0.5322, 0.6735, 0.8315, 1.1974,
    1.8709, 3.3260, 20.7870, 187.0826,
)  # fmt: skip
"""Variance by GIVEI 0..14 (DO-229D, Table A-17)."""


def obliquity(elevation_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slant over vertical ionospheric delay at (...,) elevations; DO-229D, A.4.4.10.4."""
    ratio = EARTH_RADIUS_M / (EARTH_RADIUS_M + IONOSPHERE_HEIGHT_M)
    factor: NDArray[np.float64] = 1 / np.sqrt(1 - (ratio * np.cos(np.radians(elevation_deg))) ** 2)
    return factor


def sigma_tropo_m(elevation_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Residual tropospheric delay [m] at (...,) elevations from 4 deg; DO-229D, A.4.2.4."""
    sine = np.sin(np.radians(elevation_deg))
    sigma: NDArray[np.float64] = 0.12 * 1.001 / np.sqrt(0.002001 + sine**2)
    return sigma


def sigma_air_m(elevation_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Receiver noise and airborne multipath [m] at (...,) elevations, class 2; DO-229D, J.2.4.

    The multipath term is an airborne model: it does not bound multipath beside a railway.
    """
    multipath = 0.13 + 0.53 * np.exp(-np.asarray(elevation_deg) / 10)
    return np.hypot(SIGMA_NOISE_M, multipath)


def sigma_flt_m(
    elevation_deg: NDArray[np.float64],
    *,
    udrei_zenith: int,
    udrei_horizon: int,
    elevation_scale_deg: float,
) -> NDArray[np.float64]:
    """Fast and long-term correction residual [m] at (...,) elevations.

    sigma = sigma_z + (sigma_h - sigma_z) exp(-elevation / scale), sigma_z and sigma_h being the
    tabulated sigmas of the two UDREI. The table is DO-229's; the passage between the indices is
    this model's: a satellite near the horizon is seen by fewer monitor stations. Degradation
    terms and dUDRE are left out (0 and 1).
    """
    zenith = np.sqrt(UDRE_VARIANCE_M2[udrei_zenith])
    horizon = np.sqrt(UDRE_VARIANCE_M2[udrei_horizon])
    sigma: NDArray[np.float64] = zenith + (horizon - zenith) * np.exp(
        -np.asarray(elevation_deg) / elevation_scale_deg
    )
    return sigma


def uive_variance_m2(
    time: NDArray[np.datetime64], *, lon_deg: float, givei_night: int, givei_day: int
) -> NDArray[np.float64]:
    """Variance of the vertical ionospheric error [m2] at (n,) GPS times.

    Between the tabulated variances of two GIVEI, highest at 14 h local solar time (the phase of
    the Klobuchar model, IS-GPS-200, 20.3.3.5.2.5), lowest at 2 h, one cosine a day.
    """
    seconds = time.astype("M8[ns]").astype(np.int64) / 1e9 + lon_deg * 240
    day_share = (1 + np.cos(2 * np.pi * (seconds - 14 * 3600) / 86400)) / 2
    night, day = GIVE_VARIANCE_M2[givei_night], GIVE_VARIANCE_M2[givei_day]
    variance: NDArray[np.float64] = night + (day - night) * day_share
    return variance
