"""Directions in radians where degrees are due: what gives them away."""

from __future__ import annotations

import numpy as np

from sbas.monitoring.normal_equations import Floats, Ints

_STEEPEST_RAD = np.pi / 2 * (1 + 1e-9)
_TURN_RAD = 2 * np.pi * (1 + 1e-9)
_FIX, _MANY = 5, 20


def radians_in(elevation_deg: Floats, azimuth_deg: Floats, epoch: Ints) -> str:
    """Evidence that directions of used satellites are radians; "" where there is none.

    Parameters
    ----------
    elevation_deg, azimuth_deg : (r,) directions; NaN where unknown.
    epoch : (r,) index of the epoch of each, from 0.

    Notes
    -----
    No fix is made of five satellites or more of which none stands higher than pi/2 = 1.57
    degrees, so that a single epoch is proof; without such an epoch twenty ranges are. Elevations
    that are all 0 are no radians: their geometry is degenerate, and says so. Azimuths alone are
    proof only where all of twenty ranges or more lie within 2 pi = 6.28 degrees of north.
    """
    elevation, azimuth = np.abs(elevation_deg), np.abs(azimuth_deg)
    known = np.isfinite(elevation)
    if not known.any():
        return ""
    epochs = int(epoch.max()) + 1
    given = np.bincount(epoch[known], minlength=epochs)
    high = np.bincount(epoch[known & (elevation > _STEEPEST_RAD)], minlength=epochs)
    above = np.bincount(epoch[known & (elevation > 0)], minlength=epochs)
    flat = np.flatnonzero((given >= _FIX) & (high == 0) & (above > 0))
    if flat.size:
        top = elevation[known & (epoch == flat[0])].max()
        return f"{flat.size} epochs of {_FIX} satellites or more, none above {top:.3g}"
    if given.sum() >= _MANY and not high.any() and above.any():
        return f"{given.sum()} elevations, none above {elevation[known].max():.3g}"
    turned = azimuth[np.isfinite(azimuth)]
    if turned.size >= _MANY and 0 < turned.max() <= _TURN_RAD:
        return f"{turned.size} azimuths, none beyond {turned.max():.3g}"
    return ""
