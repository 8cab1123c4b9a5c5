"""Kalman filter of position and speed along the track, over a batch of runs at once.

Errors instead of states run through the filter: it is linear, so the truth cancels. The
covariance [[a, b], [b, c]] is written out. It is one for all runs as long as they all had the
same fixes, and one a run from the first fix on that only some had or that a gate may refuse.

Source: docs/methods/multisensor.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import FilterTuning
from sbas.fusion.fused_runs import Bools, Floats

NOISE_INTERVAL_S = 0.1
"""Interval for which the noise of an odometer's speed is stated."""

Number = Floats | float
"""One value for all runs, or (r,) one a run."""


class Covariance(NamedTuple):
    """What the filter believes of its errors: variances of position and speed, and between."""

    position_m2: Number
    mixed_m2ps: Number
    speed_m2ps2: Number


@dataclass(frozen=True, eq=False)
class FilterHistory:
    """The course of a filter, at the epochs.

    Parameters
    ----------
    error_m, speed_error_mps : (t, r) errors after the update [m], [m/s].
    used : (t, r) a fix was there and taken.
    gain : (t, 2, r) gain of the fix on position [1] and on speed [1/s]; 0 where none was used.
    covariance : (t, 3, r) after the update: position [m2], mixed [m2/s], speed [m2/s2].
    """

    error_m: Floats
    speed_error_mps: Floats
    used: Bools
    gain: Floats
    covariance: Floats


def predicted(covariance: Covariance, tuning: FilterTuning, substep_s: float) -> Covariance:
    """Covariance one sub-step later, with white noise of the acceleration.

    Parameters
    ----------
    covariance : before.
    tuning : noise of the acceleration.
    substep_s : sub-step [s].

    Returns
    -------
    F P F' + Q with F = [[1, h], [0, 1]] and Q = q [[h^3/3, h^2/2], [h^2/2, h]].
    """
    a, b, c = covariance
    h, q = substep_s, tuning.acceleration_mps2_per_rthz**2
    return Covariance(
        a + (2 * h) * b + h**2 * c + q * h**3 / 3, b + h * c + q * h**2 / 2, c + q * h
    )


def updated_by_speed(
    covariance: Covariance, tuning: FilterTuning, substep_s: float
) -> tuple[Number, Number, Covariance]:
    """Gains on position [s] and speed [1] of one speed of the odometer, and the covariance after.

    Parameters
    ----------
    covariance : before.
    tuning : noise of the odometer.
    substep_s : sub-step over which its speed is averaged [s].

    Returns
    -------
    (gain on position, gain on speed, covariance).
    """
    a, b, c = covariance
    innovation = c + tuning.speed_mps**2 * (NOISE_INTERVAL_S / substep_s)
    on_position, on_speed = b / innovation, c / innovation
    return (
        on_position,
        on_speed,
        Covariance(a - on_position * b, b - on_position * c, c - on_speed * c),
    )


def updated_by_fix(
    covariance: Covariance, tuning: FilterTuning, used: Bools
) -> tuple[Number, Number, Covariance]:
    """Gains on position [1] and speed [1/s] of one satellite fix, and the covariance after.

    Parameters
    ----------
    covariance : before.
    tuning : noise of the fix.
    used : (r,) runs that have a fix and take it; the gains are 0 in the others.

    Returns
    -------
    (gain on position, gain on speed, covariance): one for all runs if all or none use theirs.
    """
    a, b, c = covariance
    everywhere = bool(used.all())
    if not everywhere and not used.any():
        return 0.0, 0.0, covariance
    innovation = a + tuning.position_m**2
    taken: Number = 1.0 if everywhere else used.astype(np.float64)
    on_position, on_speed = taken * a / innovation, taken * b / innovation
    return (
        on_position,
        on_speed,
        Covariance(a - on_position * a, b - on_position * b, c - on_speed * b),
    )


class _Epoch(NamedTuple):
    position_error: Floats
    speed_error: Floats
    used: Bools
    gain: tuple[Number, Number]
    covariance: Covariance


def _check(
    acceleration: Floats, speed: Floats, fix: Floats, tuning: FilterTuning, substeps: int
) -> None:
    rows = (fix.shape[0] * substeps, fix.shape[1])
    if not acceleration.shape == speed.shape == rows:
        raise InputError(
            f"the filter wants errors of acceleration and speed at {rows[0]} sub-steps of "
            f"{rows[1]} runs",
            where="acceleration_error, speed_error",
            evidence=f"shapes {acceleration.shape} and {speed.shape}",
        )
    if not (np.isfinite(acceleration).all() and np.isfinite(speed).all()):
        raise InputError(
            "errors of acceleration or speed are not finite",
            where="acceleration_error, speed_error",
            cure="a filter needs both at every sub-step",
        )
    if tuning.gate is None and np.isinf(fix).any():
        raise InputError(
            "an infinite fix leaves nothing of a filter without a gate",
            where="fix_error",
            evidence=f"{int(np.isinf(fix).sum())} infinite errors",
            cure="set filter.gate (6.63 refuses 1 % of good fixes), or NaN where there is no fix",
        )


def _epochs(
    acceleration: Floats,
    speed: Floats,
    fix: Floats,
    tuning: FilterTuning,
    substep_s: float,
    substeps: int,
) -> Iterator[_Epoch]:
    """The filter epoch by epoch; what it yields changes with the next epoch."""
    _check(acceleration, speed, fix, tuning, substeps)
    p, v = np.zeros(fix.shape[1]), np.zeros(fix.shape[1])
    covariance = Covariance(tuning.initial_position_m**2, 0.0, tuning.initial_speed_mps**2)
    for epoch, measured in enumerate(fix):
        for k in range(epoch * substeps, (epoch + 1) * substeps):
            v += acceleration[k] * substep_s
            p += v * substep_s
            covariance = predicted(covariance, tuning, substep_s)
            on_position, on_speed, covariance = updated_by_speed(covariance, tuning, substep_s)
            innovation = speed[k] - v
            p += on_position * innovation
            v += on_speed * innovation
        used = ~np.isnan(measured)
        innovation = np.where(used, measured - p, 0.0)
        if tuning.gate is not None:
            variance = covariance.position_m2 + tuning.position_m**2
            used &= innovation**2 <= tuning.gate * variance
            innovation[~used] = 0.0
        *gain, covariance = updated_by_fix(covariance, tuning, used)
        p += gain[0] * innovation
        v += gain[1] * innovation
        yield _Epoch(p, v, used, (gain[0], gain[1]), covariance)


def filtered_errors(
    acceleration_error: Floats,
    speed_error: Floats,
    fix_error: Floats,
    *,
    tuning: FilterTuning,
    substep_s: float,
    substeps: int,
) -> Floats:
    """Errors of the filter's position: accelerometer, odometer at each sub-step, fixes at epochs.

    Parameters
    ----------
    acceleration_error : (t * substeps, r) errors of the accelerometer [m/s2].
    speed_error : (t * substeps, r) errors of the odometer [m/s].
    fix_error : (t, r) errors of the satellite fixes [m]; NaN where there is none.
    tuning : noise that the filter assumes, its start and its gate; sound by `check_fields`.
    substep_s : sub-step [s].
    substeps : sub-steps in an epoch.

    Returns
    -------
    (t, r) error of the position after the update at each epoch [m].

    Raises
    ------
    InputError : shapes that do not fit, errors that are not finite.
    """
    errors = np.empty(fix_error.shape)
    course = _epochs(acceleration_error, speed_error, fix_error, tuning, substep_s, substeps)
    for row, epoch in zip(errors, course, strict=True):
        row[:] = epoch.position_error
    return errors


def filter_history(
    acceleration_error: Floats,
    speed_error: Floats,
    fix_error: Floats,
    *,
    tuning: FilterTuning,
    substep_s: float,
    substeps: int,
) -> FilterHistory:
    """As `filtered_errors`, with the gains, the covariances and the fixes that were used.

    Parameters
    ----------
    acceleration_error, speed_error, fix_error, tuning, substep_s, substeps : as there.

    Returns
    -------
    The course of the filter; seven numbers an epoch and run.

    Raises
    ------
    InputError : as `filtered_errors`.
    """
    t, r = fix_error.shape
    history = FilterHistory(
        error_m=np.empty((t, r)),
        speed_error_mps=np.empty((t, r)),
        used=np.empty((t, r), dtype=np.bool_),
        gain=np.empty((t, 2, r)),
        covariance=np.empty((t, 3, r)),
    )
    course = _epochs(acceleration_error, speed_error, fix_error, tuning, substep_s, substeps)
    for k, epoch in enumerate(course):
        history.error_m[k] = epoch.position_error
        history.speed_error_mps[k] = epoch.speed_error
        history.used[k] = epoch.used
        for row, value in zip(history.gain[k], epoch.gain, strict=True):
            row[:] = value
        for row, value in zip(history.covariance[k], epoch.covariance, strict=True):
            row[:] = value
    return history
