"""Speed, position and acceleration of the train on the grid of the simulation.

Source: docs/methods/multisensor.md; Railways 2014 gives no speed profile.
"""

from __future__ import annotations

import math

import numpy as np

from sbas.fusion.architecture.model import SpeedProfile
from sbas.fusion.fused_runs import Floats

ROUNDING_S = 1e-9
"""A sub-step that ends so close to the end of a phase still belongs to it."""


def _phase_ends(profile: SpeedProfile) -> Floats:
    """Ends of the phases [s]; the last one goes on for ever."""
    ends = np.array([phase.until_s for phase in profile.phases], dtype=np.float64)
    ends[-1] = math.inf
    return ends


def _times_s(substep_s: float, count: int) -> Floats:
    times: Floats = np.arange(1, count + 1, dtype=np.float64) * np.float64(substep_s)
    return times


def accelerations_mps2(profile: SpeedProfile, substep_s: float, count: int) -> Floats:
    """Acceleration in each sub-step; a phase holds up to and including `until_s`.

    Parameters
    ----------
    profile : phases of constant acceleration, sound by `check_profile`.
    substep_s : length of a sub-step [s].
    count : number of sub-steps.

    Returns
    -------
    (count,) acceleration of the phase in which the sub-step ends [m/s2].
    """
    phase = np.searchsorted(_phase_ends(profile), _times_s(substep_s, count) - ROUNDING_S)
    values = np.array([phase.acceleration_mps2 for phase in profile.phases], dtype=np.float64)
    accelerations: Floats = values[phase]
    return accelerations


def speeds_mps(profile: SpeedProfile, substep_s: float, count: int) -> Floats:
    """Speed at the end of each sub-step: start speed plus the phases' accelerations so far.

    Parameters
    ----------
    profile : phases of constant acceleration, sound by `check_profile`.
    substep_s : length of a sub-step [s].
    count : number of sub-steps.

    Returns
    -------
    (count,) speed [m/s].
    """
    ends, times = _phase_ends(profile), _times_s(substep_s, count)
    speed = np.full(count, float(profile.start_speed_mps))
    begin = 0.0
    for phase, end in zip(profile.phases, ends, strict=True):
        speed += phase.acceleration_mps2 * np.clip(times - begin, 0.0, end - begin)
        begin = end
    # A stand is met up to rounding.
    speed[speed < 0.0] = 0.0
    return speed


def positions_m(profile: SpeedProfile, substep_s: float, count: int) -> Floats:
    """Distance from the start at the end of each sub-step, as the sum of speed times sub-step.

    Parameters
    ----------
    profile : phases of constant acceleration, sound by `check_profile`.
    substep_s : length of a sub-step [s].
    count : number of sub-steps.

    Returns
    -------
    (count,) position [m]; right rectangles, the rule by which odometers sum their speed.
    """
    positions: Floats = np.cumsum(speeds_mps(profile, substep_s, count)) * substep_s
    return positions
