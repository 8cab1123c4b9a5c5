"""Slopes: how many metres of position error a fault costs per unit of its visibility.

slope_q,i = |S_q,i| sigma_i / sqrt(r_i). With weights that are the ranges' own variances it is
also the sigma of the difference between the fix with and without range i (solution separation),
so that one routine serves external reliability, the slope level and solution separation.
Source: R. G. Brown, "A baseline GPS RAIM scheme", Navigation 39(3), 1992 (slope); W. Baarda,
"A testing procedure for use in geodetic networks", 1968 (reliability).
"""

from __future__ import annotations

import numpy as np

from sbas.monitoring.normal_equations import (
    NEGLIGIBLE_INFLUENCE,
    Bools,
    Floats,
    Geometry,
    variance,
)


def bias_per_shift_m(g: Geometry) -> Floats:
    """(s, n) sigma_i / sqrt(r_i) [m]: the bias that shifts the w-test of its range by 1; infinite
    without redundancy, NaN where a range takes no part."""
    with np.errstate(divide="ignore", invalid="ignore"):
        bias = 1 / np.sqrt(g.weight * g.redundancy)
    return np.where(
        g.redundancy >= g.least_redundancy, bias, np.where(g.takes_part, np.inf, np.nan)
    )


def minimal_detectable_bias_m(g: Geometry, shift: float) -> Floats:
    """(s, n) minimal detectable biases [m] = delta0 sigma_i / sqrt(r_i)."""
    return shift * bias_per_shift_m(g)


def track_axes(azimuth_deg: Floats | float) -> tuple[Floats, Floats]:
    """(3, ...) axes along a track of azimuth [deg] from north by east, and across it, rightward."""
    a = np.deg2rad(np.asarray(azimuth_deg, np.float64))
    zero = np.zeros_like(a)
    return np.stack([np.sin(a), np.cos(a), zero]), np.stack([np.cos(a), -np.sin(a), zero])


def horizontal_slope(g: Geometry) -> Floats:
    """(s, n) slopes of the horizontal error; 0 or infinite for a range without redundancy."""
    return _slope(g, np.hypot(g.gain[0], g.gain[1]), major_sigma_m(g))


def axis_slope(g: Geometry, axis: Floats) -> Floats:
    """(s, n) slopes along an axis, (3,) or (3, n) in east, north, up."""
    gain = np.abs(sum(part * own for part, own in zip(axis, g.gain, strict=True)))
    return _slope(g, gain, np.sqrt(variance(g.covariance, axis)))


def major_sigma_m(g: Geometry) -> Floats:
    """(n,) semi-major axis of the horizontal error ellipse [m]."""
    ee, en, nn = g.covariance[0], g.covariance[1], g.covariance[2]
    major: Floats = np.sqrt((ee + nn) / 2 + np.hypot((ee - nn) / 2, en))
    return major


def largest(slope: Floats) -> Floats:
    """(n,) largest slopes; NaN where no range takes part."""
    top = np.where(np.isnan(slope), -1.0, slope).max(axis=0, initial=-1.0)
    return np.where(top < 0, np.nan, top)


def critical(g: Geometry, axis: Floats | None = None) -> Bools:
    """(n,) True where a range moves the fix, horizontally or along an axis, and its fault would
    not show."""
    blind = g.takes_part & ~(g.redundancy >= g.least_redundancy)
    found = np.zeros(g.dof.size, bool)
    at = np.flatnonzero(blind.any(axis=0) & g.solved)
    if at.size:
        slope = horizontal_slope(g) if axis is None else axis_slope(g, axis)
        found[at] = np.isinf(slope[:, at]).any(axis=0)
    return found


def _slope(g: Geometry, gain: Floats, sigma_m: Floats) -> Floats:
    slope = gain * bias_per_shift_m(g)
    blind = g.takes_part & ~(g.redundancy >= g.least_redundancy)
    if blind.any():
        with np.errstate(invalid="ignore"):
            harmless = gain * g.sigma <= NEGLIGIBLE_INFLUENCE * sigma_m
        slope = np.where(blind, np.where(harmless, 0.0, np.inf), slope)
    return slope
