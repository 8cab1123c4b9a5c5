"""Motion and time grid of an architecture: what fits together, and how long a run may be."""

from __future__ import annotations

import math
from itertools import pairwise

from sbas.dependability.tree.model_values import refuse
from sbas.fusion.architecture.model import Architecture, SatelliteReceiver, SpeedProfile

MOST_SUBSTEPS = 1_000_000
"""Sub-steps of a run; 100 s at 0.1 s are a thousand."""

_STEP_TOLERANCE = 1e-9
_AT_REST_MPS = 1e-9
"""Speeds nearer to 0 are rounding."""


def check_profile(profile: SpeedProfile, duration_s: float) -> None:
    """Raise ModelError unless phases follow each other and the train never runs backward."""
    if not profile.phases:
        raise refuse(
            "a speed profile without phases", "profile.phases", "none",
            "phases = [{ until_s = 100.0, acceleration_mps2 = 0.0 }]",
        )  # fmt: skip
    ends = [phase.until_s for phase in profile.phases]
    for i, (before, after) in enumerate(pairwise(ends), start=1):
        if after <= before:
            raise refuse(
                "the phases are not in order of time", f"profile.phases[{i}].until_s",
                f"{after:g} s after {before:g} s", "write phases with growing until_s",
            )  # fmt: skip
    speed, start = profile.start_speed_mps, 0.0
    for i, phase in enumerate(profile.phases):
        # The last phase goes on; none matters after the end of the run.
        until = phase.until_s if i + 1 < len(ends) else duration_s
        end = max(min(until, duration_s), start)
        speed += phase.acceleration_mps2 * (end - start)
        start = end
        if speed < -_AT_REST_MPS:
            raise refuse(
                "the train would run backward", f"profile.phases[{i}].acceleration_mps2",
                f"{speed:.6g} m/s at {end:g} s",
                "add a phase without acceleration where it stands, or shorten duration_s",
            )  # fmt: skip


def check_times(architecture: Architecture) -> None:
    """Raise ModelError unless sub-steps, steps, fixes, seconds and the run fit into each other."""
    step, substep = architecture.step_s, architecture.substep_s
    if not is_multiple(step, substep):
        fit = step / max(round(step / substep), 1)
        raise refuse(
            "the step is not a multiple of the sub-step", "step_s",
            f"{step:g} s, sub-step {substep:g} s", f"substep_s = {fit:.12g}",
        )  # fmt: skip
    if not is_multiple(1.0, step):
        raise refuse(
            "a second is not a multiple of the step", "step_s", f"{step:g} s",
            f"step_s = {1 / max(round(1 / step), 1):.12g}",
        )  # fmt: skip
    for sensor in architecture.sensors:
        if isinstance(sensor, SatelliteReceiver) and not is_multiple(sensor.interval_s, step):
            fit = step * max(round(sensor.interval_s / step), 1)
            raise refuse(
                "the interval of the fixes is not a multiple of the step",
                f"sensors.{sensor.name}.interval_s",
                f"{sensor.interval_s:g} s, step {step:g} s", f"interval_s = {fit:.12g}",
            )  # fmt: skip
    duration = architecture.duration_s
    if not is_multiple(duration, step):
        raise refuse(
            "the duration is not a multiple of the step", "duration_s",
            f"{duration:g} s, step {step:g} s",
            f"duration_s = {step * max(round(duration / step), 1):.12g}",
        )  # fmt: skip
    if duration / substep > MOST_SUBSTEPS * (1 + _STEP_TOLERANCE):
        # A sub-step is no longer than a step: where that is too short, the run is too long.
        longest = step * math.floor(MOST_SUBSTEPS * substep / step)
        raise refuse(
            "too long a run for its sub-step", "duration_s" if longest > 0 else "substep_s",
            f"{duration / substep:.6g} sub-steps, at most {MOST_SUBSTEPS}",
            f"duration_s = {longest:.12g} or less"
            if longest > 0
            else f"substep_s of {duration / MOST_SUBSTEPS:.3g} or more",
        )  # fmt: skip


def is_multiple(longer_s: float, shorter_s: float) -> bool:
    """Whether a time is 1, 2, 3, ... of another, within rounding."""
    ratio = longer_s / shorter_s
    return round(ratio) >= 1 and abs(ratio - round(ratio)) <= _STEP_TOLERANCE * ratio
