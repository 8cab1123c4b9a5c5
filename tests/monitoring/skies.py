"""Geometries for the tests of monitoring, and least squares done the slow way."""

from __future__ import annotations

from typing import Any

import numpy as np

from sbas.monitoring.normal_equations import Ranges, ranges

CASES = {
    "A": ([0, 90, 180, 270, 0], [30, 30, 30, 30, 90]),
    "B": ([0, 120, 240, 60, 180, 300], [15, 15, 15, 60, 60, 60]),
    "C": ([0, 90, 180, 270, 45, 165, 285], [15] * 4 + [55] * 3),
}
"""Azimuths and elevations [deg] of the geometries of the methods page."""


def sky(case: str, residual_m: Any = None) -> Ranges:
    """One epoch of a case, sigma 1 m, one clock."""
    azimuth, elevation = CASES[case]
    column = [np.array(v, float)[:, None] for v in (elevation, azimuth)]
    y = None if residual_m is None else np.array(residual_m, float)[:, None]
    return ranges(*column, np.ones((len(azimuth), 1)), residual_m=y)


def random_sky(
    rng: np.random.Generator, satellites: int, epochs: int
) -> tuple[np.ndarray[Any, Any], ...]:
    """(s, n) elevations, azimuths [deg] and sigmas [m], spread over the sky."""
    shape = (satellites, epochs)
    elevation = np.rad2deg(np.arcsin(rng.uniform(0.1, 1, shape)))
    return elevation, rng.uniform(0, 360, shape), rng.uniform(0.5, 4, shape)


def design_of(elevation_deg: Any, azimuth_deg: Any, clock: Any) -> np.ndarray[Any, Any]:
    """(s, 3 + c) rows by east, north, up and a clock for every constellation present."""
    e, a = np.deg2rad(elevation_deg), np.deg2rad(azimuth_deg)
    clocks = [np.asarray(clock) == c for c in np.unique(clock)]
    return np.stack(
        [-np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), -np.sin(e), *clocks], axis=1
    ).astype(float)


def refit(g: Any, sigma_m: Any, y: Any) -> tuple[np.ndarray[Any, Any], float, Any]:
    """Position step, weighted sum of squares and covariance of one epoch, by decomposition."""
    root = 1 / np.asarray(sigma_m)
    x, *_ = np.linalg.lstsq(g * root[:, None], y * root, rcond=None)
    e = (y - g @ x) * root
    _q, r = np.linalg.qr(g * root[:, None])
    inverse = np.linalg.inv(r)
    return x[:3], float(e @ e), (inverse @ inverse.T)[:3, :3]
