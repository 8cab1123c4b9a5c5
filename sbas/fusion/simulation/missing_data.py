"""What a silent sensor is worth in the fusion: extrapolated, removed, held or substituted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sbas.fusion.architecture.model import Architecture, Missing, StateOf
from sbas.fusion.fused_runs import Bools, Floats, SensorRuns
from sbas.fusion.simulation.speed_profile import positions_m


@dataclass(frozen=True, eq=False)
class UsedErrors:
    """One sensor as the fusion takes it.

    Parameters
    ----------
    error_m : (a, t, r) error of the value that the fusion takes [m]; NaN where it takes none.
    own_m : (a, t, r) error of what the sensor itself gave [m]; NaN where it gave nothing.
    supplied : (a, t, r) a policy supplied the value.
    zeroed : (a, t, r) the sensor is removed but keeps its weight: the sum lacks its share, as if
        its position were zero. None where that cannot happen.
    """

    error_m: Floats
    own_m: Floats
    supplied: Bools
    zeroed: Bools | None = None

    @property
    def out(self) -> Bools:
        """(a, t, r) the sensor is out of the fusion; the others take over its weight."""
        return np.isnan(self.error_m)

    @property
    def informed(self) -> Bools:
        """(a, t, r) the fusion has a value of the sensor, its own or a supplied one."""
        return ~self.out if self.zeroed is None else ~(self.out | self.zeroed)

    def state_error_m(self, state_of: StateOf) -> Floats:
        """Error that gives the sensor its state, (a, t, r) [m].

        Parameters
        ----------
        state_of : "used" takes supplied values too; "own" leaves NaN where the sensor is silent.
        """
        if state_of == "own":
            return self.own_m
        return self.error_m if self.zeroed is None else np.where(self.zeroed, np.nan, self.error_m)


def epoch_positions_m(architecture: Architecture) -> Floats:
    """True position along the track at the epochs, from the origin, (t,) [m]."""
    every = architecture.substeps
    count = architecture.epochs * every
    positions: Floats = positions_m(architecture.profile, architecture.substep_s, count)
    return positions[every - 1 :: every]


def used_errors(
    runs: Mapping[str, SensorRuns], missing: Mapping[str, Missing], true_position_m: Floats
) -> dict[str, UsedErrors]:
    """Errors of the values that the fusion takes, with each sensor's policy where it is silent.

    Parameters
    ----------
    runs : sensors by name.
    missing : policy by sensor, sound by `check_architecture`; a sensor not named is removed.
    true_position_m : (t,) along the track at the epochs, from the origin [m].

    Notes
    -----
    With tf the last epoch at which the sensor m gave data, x the true position on the axis (it
    stands still across the track) and e_j the other sensor's own error:

    extrapolate : e_m(tf) + e_j(t) - e_j(tf)
    substitute : e_j(t)
    hold : e_m(tf) - (x(t) - x(tf))
    remove : no part, the others' weights add up to 1; or, not renormalised, -x(t)

    Before the first datum, and where j itself is silent, nothing is supplied: a later value is
    never used. A removed sensor that keeps its weight is no datum either.

    References
    ----------
    Railways 2014, section 3.1 step 2 and Table 1.
    """
    return {name: _used(name, runs, missing.get(name, Missing()), true_position_m) for name in runs}


def _used(
    name: str, runs: Mapping[str, SensorRuns], policy: Missing, true_position_m: Floats
) -> UsedErrors:
    sensor = runs[name]
    own = sensor.error_m
    silent = np.isnan(own)
    silent[~np.asarray(sensor.measures)] = False
    where = np.nonzero(silent)
    supplied = np.zeros(own.shape, dtype=bool)
    if (policy.policy == "remove" and policy.renormalise) or not len(where[0]):
        return UsedErrors(own, own, supplied)
    axis, epoch, run = where
    true = np.zeros((own.shape[0], own.shape[1]))
    true[0] = true_position_m
    if policy.policy == "remove":
        error = own.copy()
        error[where] = -true[axis, epoch]
        return UsedErrors(error, own, supplied, zeroed=silent)
    if policy.policy == "substitute":
        values = runs[policy.by].error_m[where]
    else:
        last = _last_epoch_with_data(silent)[where]
        seen = last >= 0
        values = np.where(seen, own[axis, last, run], np.nan)
        if policy.policy == "hold":
            values -= true[axis, epoch] - true[axis, last]
        else:
            other = runs[policy.by].error_m
            with np.errstate(invalid="ignore"):  # infinite errors of a recording
                values += other[where] - other[axis, last, run]
    error = own.copy()
    error[where] = values
    supplied[where] = ~np.isnan(values)
    return UsedErrors(error, own, supplied)


def _last_epoch_with_data(silent: Bools) -> np.ndarray[tuple[int, ...], np.dtype[np.int32]]:
    """(a, t, r) the epoch itself or the latest one before that is not silent; -1 before any."""
    epochs = np.arange(silent.shape[1], dtype=np.int32)[:, np.newaxis]
    return np.maximum.accumulate(np.where(silent, np.int32(-1), epochs), axis=1)
