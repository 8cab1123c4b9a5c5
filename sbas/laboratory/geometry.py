"""From lines of sight and weights to position covariance, DOP and external reliability.

Arrays are (satellites, epochs); a satellite that is not used has weight 0. The receiver clock is
eliminated by subtracting the weighted mean line of sight, which leaves sums of positive terms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SINGULAR = 1e-12
"""Determinant over (trace/3)^3 of the normal matrix below which a geometry has no solution."""
_UNCHECKED = 1e-6
"""Redundancy of a satellite below which RAIM cannot see its error."""


@dataclass(frozen=True)
class Covariance:
    """Covariance of a weighted least-squares position, each (epochs,); NaN without a solution."""

    ee: Floats
    nn: Floats
    uu: Floats
    en: Floats
    eu: Floats
    nu: Floats


def centred(line_of_sight: Floats, weight: Floats) -> Floats:
    """Lines of sight less their weighted mean over the satellites, (3, satellites, epochs).

    Parameters
    ----------
    line_of_sight : (3, satellites, epochs) unit vectors east, north, up.
    weight : (satellites, epochs), 0 for a satellite that is not used.
    """
    total = weight.sum(axis=0)
    mean = np.einsum("kst,st->kt", line_of_sight, weight) / np.where(total > 0, total, 1.0)
    difference: Floats = line_of_sight - mean[:, None, :]
    return difference


def position_covariance(rows: Floats, weight: Floats) -> Covariance:
    """Position block of (G'WG)^-1, G having rows [east, north, up, 1].

    Parameters
    ----------
    rows : (3, satellites, epochs) from `centred` with the same weights.
    weight : (satellites, epochs) 1/sigma^2, or 1 for DOP; 0 for a satellite that is not used.

    Returns
    -------
    Covariance, NaN where fewer than 4 satellites are used or the geometry is singular.

    Notes
    -----
    Eliminating the clock from G'WG leaves the 3x3 matrix sum w r r' (Schur complement), here
    inverted by cofactors. Source: RTCA DO-229D, J.1.
    """
    weighted = rows * weight
    e, n, u = rows
    ee, en, eu = (np.einsum("st,st->t", weighted[0], x) for x in (e, n, u))
    nn, nu = (np.einsum("st,st->t", weighted[1], x) for x in (n, u))
    uu = np.einsum("st,st->t", weighted[2], u)
    cee, cen, ceu = nn * uu - nu * nu, eu * nu - en * uu, en * nu - eu * nn
    determinant = ee * cee + en * cen + eu * ceu
    scale = ((ee + nn + uu) / 3) ** 3
    solved = ((weight > 0).sum(axis=0) >= 4) & (determinant > _SINGULAR * scale)
    inverse = np.where(solved, 1.0, np.nan) / np.where(solved, determinant, 1.0)
    return Covariance(
        ee=cee * inverse,
        nn=(ee * uu - eu * eu) * inverse,
        uu=(ee * nn - en * en) * inverse,
        en=cen * inverse,
        eu=ceu * inverse,
        nu=(en * eu - ee * nu) * inverse,
    )


def external_reliability_m(
    rows: Floats, weight: Floats, covariance: Covariance, *, noncentrality: float
) -> tuple[Floats, Floats]:
    """Largest horizontal and vertical position error that an undetected error of one satellite
    can cause [m], each (epochs,).

    Parameters
    ----------
    rows, weight, covariance : as in `position_covariance`, weight = 1/sigma^2.
    noncentrality : shift of the test statistic that is missed with the stated probability, in
        standard deviations.

    Returns
    -------
    HERL and VERL; NaN (RAIM not available) with fewer than 5 satellites, or where some used
    satellite has no redundancy.

    Notes
    -----
    Redundancy r_i = 1 - w_i g_i' (G'WG)^-1 g_i; the smallest detectable error
    noncentrality sigma_i / sqrt(r_i) shifts the position by w_i (G'WG)^-1 g_i times itself.
    Source: Baarda 1968, A testing procedure for use in geodetic networks (data snooping).
    """
    e, n, u = rows
    c = covariance
    shift_e = c.ee * e + c.en * n + c.eu * u
    shift_n = c.en * e + c.nn * n + c.nu * u
    shift_u = c.eu * e + c.nu * n + c.uu * u
    total = weight.sum(axis=0)
    clock = 1 / np.where(total > 0, total, 1.0)
    redundancy = 1 - weight * (clock + e * shift_e + n * shift_n + u * shift_u)
    used = weight > 0
    available = (used.sum(axis=0) >= 5) & ~np.any(used & ~(redundancy > _UNCHECKED), axis=0)
    checked = np.where(used & available, redundancy, 1.0)
    root = noncentrality * np.sqrt(np.where(available, weight, 0.0) / checked)
    horizontal = np.max(root * np.hypot(shift_e, shift_n), axis=0)
    vertical = np.max(root * np.abs(shift_u), axis=0)
    missing = np.where(available, 0.0, np.nan)
    return horizontal + missing, vertical + missing
