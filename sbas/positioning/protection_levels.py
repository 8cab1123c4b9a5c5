"""Protection levels from the covariance of a fix.

Source: RTCA DO-229D, J.1 (d_major, HPL, VPL); the along-track level is the one-dimensional
projection of the same covariance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.tables import Mode

Floats = NDArray[np.float64]

K_H_PA, K_H_NPA, K_V = 6.0, 6.18, 5.33
"""Published factors; sbas.integrity.allocation derives others from a risk allocation."""


def major_axis_m(ee_m2: Floats, nn_m2: Floats, en_m2: Floats) -> Floats:
    """1-sigma semi-major axis of the horizontal error ellipse [m], by its variances."""
    axis: Floats = np.sqrt((ee_m2 + nn_m2) / 2 + np.hypot((ee_m2 - nn_m2) / 2, en_m2))
    return axis


def horizontal_level_m(covariance_m2: Floats, k_h: float) -> Floats:
    """(n,) HPL = K_H d_major [m] of (n, 4, 4) covariances of east, north, up and clock."""
    d = covariance_m2
    return k_h * major_axis_m(d[:, 0, 0], d[:, 1, 1], d[:, 0, 1])


def vertical_level_m(covariance_m2: Floats, k_v: float) -> Floats:
    """(n,) VPL = K_V sqrt(D_UU) [m]."""
    level: Floats = k_v * np.sqrt(covariance_m2[:, 2, 2])
    return level


def level_along_m(covariance_m2: Floats, azimuth_deg: Floats | float, k: float) -> Floats:
    """(n,) level along a direction of (n,) azimuths [m], such as that of a track.

    `k` is a one-dimensional factor, such as `k_along`.
    """
    a = np.deg2rad(azimuth_deg)
    ee, nn, en = covariance_m2[:, 0, 0], covariance_m2[:, 1, 1], covariance_m2[:, 0, 1]
    variance = ee * np.sin(a) ** 2 + nn * np.cos(a) ** 2 + 2 * en * np.sin(a) * np.cos(a)
    level: Floats = k * np.sqrt(np.maximum(variance, 0.0))
    return level


def k_along(k_h: float, mode: Mode) -> float:
    """One-dimensional factor with the risk that a horizontal one stands for.

    The factor of precision approach is one-dimensional already (6.0 leaves 2e-9 in both tails of
    a Gaussian error); that of non-precision approach is of a circular error, whose risk
    exp(-K^2 / 2) both tails of the Gaussian share. Source: Filip, Bazant, Mocek 2010, section 2.1.
    """
    if mode == "pa":
        return k_h
    from scipy.special import ndtri_exp

    return -float(ndtri_exp(-(k_h**2) / 2 - np.log(2)))
