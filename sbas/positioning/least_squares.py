"""Weighted least-squares steps of all epochs at once.

Source: RTCA DO-229D, J.1 (weights); the linearised step is the textbook's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.positioning.normal_equations import (
    Geometry,
    fix_geometry,
    full_matrices,
    inverse,
    normal_sums,
    sums_by_epoch,
    times,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Step:
    """A linear step of (n,) positions, NaN where there is no fix.

    `enu_m` (n, 3); `clock_m` (n,); `residual_m` (k,) of the ranges after the step, of those left
    out as well.
    """

    enu_m: Floats
    clock_m: Floats
    residual_m: Floats
    geometry: Geometry

    @property
    def covariance_m2(self) -> Floats:
        """(n, 4, 4) of east, north, up and clock."""
        return full_matrices(self.geometry.covariance_m2)


def step(g: Floats, sigma_m: Floats, prefit_m: Floats, epoch: Ints, n: int) -> Step:
    """One weighted step.

    Parameters
    ----------
    g : (4, k) designs, see `normal_equations.design`.
    sigma_m : (k,) 1-sigma of the ranges; those where it is not a number above 0 do not serve.
    prefit_m : (k,) measured less modelled ranges; those that are no number do not serve.
    epoch : (k,) indices below n that never fall.
    """
    known = np.isfinite(prefit_m)
    geometry = fix_geometry(g, np.where(known, sigma_m, np.nan), epoch, n)
    weighted = geometry.weight * np.where(known, prefit_m, 0.0)
    right = sums_by_epoch(np.nan_to_num(g) * weighted, epoch, n)
    solution = times(geometry.covariance_m2, right)
    residual = prefit_m - (g * solution[:, epoch]).sum(axis=0)
    # Moving towards a satellite shortens its range.
    return Step(-solution[:3].T, solution[3], residual, geometry)


def dilution(g: Floats, used: Bools, epoch: Ints, n: int, solved: Bools) -> Floats:
    """(n, 4, 4) covariances of fixes whose ranges `used` all have the weight 1."""
    sums = normal_sums(np.where(used, g, 0.0), used.astype(float), epoch, n)
    return full_matrices(inverse(sums, solved).covariance)
