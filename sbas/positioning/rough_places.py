"""Where the receiver roughly is: near enough for the model of the ranges to be linear.

Source: the textbook's unweighted point solution (IS-GPS-200, 20.3.3.4.3.4 for the Earth's
rotation during the flight).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sbas.positioning.corrected_ranges import CorrectedRanges
from sbas.positioning.measurements import Measurements
from sbas.positioning.normal_equations import design, fix_geometry, sums_by_epoch, times
from sbas.positioning.orbits import length, rotated_by_flight

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

MOST_STEPS = 12
NEAR_ENOUGH_M = 50.0
"""After so short a step what is left is far below a metre."""
EARTH_RADIUS_M = 6.371e6
FARTHEST_FROM_SURFACE_M = 1e6
TROPOSPHERE_M, IONOSPHERE_M, MOST_OBLIQUITY = 2.4, 4.0, 3.0
"""Usual vertical delays, and how slanted the ionosphere is at most."""
WIDEST_SPREAD_M = 1.2e7
"""GPS ranges at one place differ by half of this; one that lies farther off is none."""


def rough_places(
    measured: Measurements, corrected: CorrectedRanges, approximate_m: Floats | None
) -> Floats:
    """(n, 3) places from unweighted ranges and a usual atmosphere; NaN where no epoch has one.

    Epochs with fewer than four ranges take the place of the solved epoch before them, or after.

    Parameters
    ----------
    approximate_m : (3,) where to begin; None begins at the centre of the Earth.
    """
    n = measured.time_ns.size
    start = np.zeros(3) if approximate_m is None else approximate_m
    place = np.broadcast_to(start, (n, 3)).copy()
    clock = np.zeros(n)
    rows = np.flatnonzero(
        (measured.reason == 0)
        & np.isfinite(corrected.satellite_m).all(axis=1)
        & _like_the_others(measured)
    )
    epoch, satellite_m = measured.epoch[rows], corrected.satellite_m[rows]
    offset = corrected.clock_m + corrected.relativity_m - corrected.tgd_m
    pseudorange = (measured.code_m + offset)[rows]
    for _ in range(MOST_STEPS):
        here = place[epoch]
        line = rotated_by_flight(satellite_m, here) - here
        distance = length(line)
        unit = line.T / distance
        g = design(unit)
        residual = pseudorange - distance - clock[epoch] - _atmosphere_m(unit, here)
        geometry = fix_geometry(g, np.ones(rows.size), epoch, n)
        change = times(geometry.covariance_m2, sums_by_epoch(g * residual, epoch, n))
        change[:, ~geometry.solved] = 0.0
        place -= change[:3].T
        clock += change[3]
        if np.abs(change[:3]).max(initial=0.0) < NEAR_ENOUGH_M:
            break
    solved = geometry.solved & (np.abs(length(place) - EARTH_RADIUS_M) < FARTHEST_FROM_SURFACE_M)
    known = np.flatnonzero(solved)
    if not known.size:
        return np.full((n, 3), np.nan)
    before = np.searchsorted(known, np.arange(n), side="right") - 1
    return place[known[np.maximum(before, 0)]]


def _atmosphere_m(unit: Floats, place_m: Floats) -> Floats:
    """(k,) a usual delay of the atmosphere; none where the place is not on Earth yet."""
    radius = length(place_m)
    on_earth = np.abs(radius - EARTH_RADIUS_M) < FARTHEST_FROM_SURFACE_M
    sine = np.einsum("ik,ki->k", unit, place_m) / np.where(on_earth, radius, 1.0)
    slant = 1 / np.sqrt(0.002 + np.where(on_earth, np.maximum(sine, 0.0), 1.0) ** 2)
    delay = TROPOSPHERE_M * slant + IONOSPHERE_M * np.minimum(slant, MOST_OBLIQUITY)
    return np.where(on_earth, delay, 0.0)


def _like_the_others(measured: Measurements) -> Bools:
    """(k,) False for ranges so far from their epoch's median that they are no distances."""
    n = measured.time_ns.size
    order = np.lexsort((measured.raw_code_m, measured.epoch))
    count = np.bincount(measured.epoch, minlength=n)
    middle = np.cumsum(count) - count + count // 2
    if not order.size:
        return np.zeros(0, bool)
    median = measured.raw_code_m[order][np.minimum(middle, order.size - 1)]
    near: Bools = np.abs(measured.raw_code_m - median[measured.epoch]) < WIDEST_SPREAD_M
    return near
