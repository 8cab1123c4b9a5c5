"""External reliability, slope levels and solution separation of monitored epochs.

HERL and VERL are the effect on the position of the smallest fault that the w-test finds with
the stated probability: they bound neither noise nor a fault that stays hidden. Source: the
receiver's definition in the Septentrio PolaRx5TR reference guide, DIA chapter; Filip, Bazant,
Mocek 2010, section 4.
"""

from __future__ import annotations

import numpy as np

from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.normal_equations import Floats, Geometry, variance
from sbas.monitoring.separation import SeparationBudget, separation_level_m
from sbas.monitoring.slopes import (
    axis_slope,
    horizontal_slope,
    largest,
    major_sigma_m,
    track_axes,
)

EAST, NORTH, UP = np.eye(3)


def external_levels_m(g: Geometry, shift: float) -> tuple[Floats, Floats]:
    """(n,) HERL and VERL [m]: delta0 times the largest slopes.

    Infinite where a fault would not show; NaN where nothing is tested (dof < 1).
    """
    tested = g.solved & (g.dof >= 1)
    herl = np.where(tested, shift * largest(horizontal_slope(g)), np.nan)
    return herl, np.where(tested, shift * largest(axis_slope(g, UP)), np.nan)


def level_columns(
    g: Geometry,
    design: MonitorDesign,
    budget: SeparationBudget,
    track_azimuth_deg: Floats | float | None = None,
) -> dict[str, Floats]:
    """Levels by column name, (n,) each [m].

    Horizontal and vertical, and along and across the track where its azimuth is given. `erl_...`
    are external reliability levels, `..._slope_m` the largest slope times the bias that the
    overall test misses with the stated probability, `..._separation_m` solution separation,
    `sigma_...` 1-sigma of the fix. NaN without a test, infinite where a fault would not show.
    """
    tested = g.solved & (g.dof >= 1)
    bias = np.where(tested, design.bias(g.dof), np.nan)
    shift = np.where(tested, design.shift, np.nan)
    directions: dict[str, tuple[Floats, Floats]] = {
        "h": (largest(horizontal_slope(g)), major_sigma_m(g)),
        "v": (largest(axis_slope(g, UP)), np.sqrt(variance(g.covariance, UP))),
    }
    separation = {
        "h": np.hypot(
            separation_level_m(g, EAST, budget, 2), separation_level_m(g, NORTH, budget, 2)
        ),
        "v": separation_level_m(g, UP, budget, 1),
    }
    names = {"h": ("herl_m", "hpl", "major"), "v": ("verl_m", "vpl", "up")}
    if track_azimuth_deg is not None:
        for side, axis in zip(("along", "across"), track_axes(track_azimuth_deg), strict=True):
            directions[side] = (
                largest(axis_slope(g, axis)),
                np.sqrt(variance(g.covariance, axis)),
            )
            separation[side] = separation_level_m(g, axis, budget, 1)
            names[side] = (f"erl_{side}_m", f"pl_{side}", side)
    columns: dict[str, Floats] = {}
    for side, (slope, sigma) in directions.items():
        external, level, spread = names[side]
        columns[external] = shift * slope
        columns[f"{level}_slope_m"] = bias * slope
        columns[f"{level}_separation_m"] = separation[side]
        columns[f"sigma_{spread}_m"] = sigma
    return columns
