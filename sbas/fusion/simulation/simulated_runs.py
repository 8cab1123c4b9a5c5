"""Runs of an architecture: sensors drawn, missing data treated, fused, and put into states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from sbas.exceptions import InputError
from sbas.fusion.architecture.architecture_check import check_architecture, refuse_unmodelled
from sbas.fusion.architecture.model import (
    Architecture,
    Missing,
    SatelliteReceiver,
    Unmodelled,
)
from sbas.fusion.fused_runs import Bools, Floats, FusedRuns, SensorRuns, States
from sbas.fusion.simulation.batch_filter import filtered_errors
from sbas.fusion.simulation.disagreement import (
    AS_PRINTED,
    Correlation,
    Disagreement,
    correlation_test,
    leave_one_out_test,
)
from sbas.fusion.simulation.missing_data import (
    UsedErrors,
    epoch_positions_m,
    used_errors,
)
from sbas.fusion.simulation.sensor_errors import NO_SOURCES, ErrorSource, draw_sensors
from sbas.fusion.simulation.weighted_fusion import fused_errors, over_axes
from sbas.fusion.simulation.weights import (
    error_variances,
    given_weights,
    inverse_variance_weights,
)
from sbas.fusion.states import states_of

Progress = Callable[[int, int], None]


def simulate_runs(
    architecture: Architecture,
    *,
    runs: int = 2000,
    seed: int = 0,
    chunk_runs: int = 1000,
    sources: Mapping[str, ErrorSource] = NO_SOURCES,
    correlation: Correlation = AS_PRINTED,
    progress: Progress | None = None,
) -> FusedRuns:
    """Draw runs of the sensors, fuse them, and give each sensor and the output its state.

    Parameters
    ----------
    architecture : sensors, fusion, thresholds, and the motion of the train.
    runs : number of runs.
    seed : the same seed and chunk size give the same digits.
    chunk_runs : runs drawn at a time; each chunk has its own stream, so that more runs leave
        those of the full chunks before as they are. It bounds the memory.
    sources : errors by sensor that replace its model, as of a recording.
    correlation : what the test leaves open, with fault_detection = "correlation".
    progress : called with (runs done, runs in all).

    Returns
    -------
    FusedRuns. A sensor's state is that of the value that the fusion takes, with
    missing_state_of = "own" that of its own data; on three axes that of its worst axis or of its
    norm. The output is usable where it has data and, with fault detection, where the sensors that
    are left agree.

    Raises
    ------
    InputError : runs, seed or chunk size out of range.
    ModelError : an architecture that cannot be simulated; `cure` says what to write.

    Notes
    -----
    The filter takes fixes only, and starts at a known position; the receiver's state beside it is
    that of the value that a weighted mean would take.

    References
    ----------
    Railways 2014, sections 3.1 and 3.2; docs/methods/multisensor.md.
    """
    _check_numbers(runs, seed, chunk_runs)
    check_architecture(architecture)
    refuse_unmodelled(architecture, supplied=sources)
    fusion = _prepared(architecture, sources, correlation)
    n, t = len(architecture.sensors), architecture.epochs
    sensor_state: States = np.empty((n, t, runs), dtype=np.int8)
    output_state: States = np.empty((t, runs), dtype=np.int8)
    output_error_m: Floats = np.empty((t, runs))
    usable: Bools = np.empty((t, runs), dtype=bool)
    starts = range(0, runs, chunk_runs)
    streams = np.random.SeedSequence(seed).spawn(len(starts))
    for first, stream in zip(starts, streams, strict=True):
        end = min(first + chunk_runs, runs)
        drawn = draw_sensors(architecture, end - first, stream, sources=sources)
        used = used_errors(drawn, fusion.missing, fusion.true_position_m)
        output, agreed = fusion.of(drawn, used)
        chunk = slice(first, end)
        for state, name in zip(sensor_state, architecture.names, strict=True):
            state[:, chunk] = _sensor_states(architecture, drawn[name], used[name])
        output_error_m[:, chunk] = output
        output_state[:, chunk] = _states(output, architecture)
        usable[:, chunk] = agreed & ~np.isnan(output)
        if progress is not None:
            progress(end, runs)
    return FusedRuns(
        names=architecture.names,
        step_s=architecture.step_s,
        sensor_state=sensor_state,
        output_state=output_state,
        output_error_m=output_error_m,
        declared_usable=usable,
        weights=fusion.weights,
    )


def _check_numbers(runs: int, seed: int, chunk_runs: int) -> None:
    for what, value, least in (("runs", runs, 1), ("seed", seed, 0), ("chunk_runs", chunk_runs, 1)):
        if value < least:
            raise InputError(
                f"{what} must be {least} or more",
                where=what,
                evidence=str(value),
                cure=f"write {what}={least} or more",
            )


def _states(error_m: Floats, architecture: Architecture) -> States:
    return states_of(error_m, architecture.thresholds, step_s=architecture.step_s)


def _sensor_states(architecture: Architecture, drawn: SensorRuns, used: UsedErrors) -> States:
    error = used.state_error_m(architecture.missing_state_of)[np.asarray(drawn.measures)]
    return _states(over_axes(error, architecture.axis_rule, every_axis=False), architecture)


# --- fusion -----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Fusion:
    """What is the same for all chunks; weights and variances are empty where none are used."""

    architecture: Architecture
    missing: Mapping[str, Missing]
    true_position_m: Floats
    weights: Floats
    variances: Floats
    correlation: Correlation

    def of(
        self, drawn: Mapping[str, SensorRuns], used: Mapping[str, UsedErrors]
    ) -> tuple[Floats, Bools]:
        """(t, r) error of the output, and whether the sensors agree."""
        if self.architecture.operator == "kalman":
            output = _filtered(self.architecture, drawn)
            return output, np.ones(output.shape, dtype=bool)
        sensors = [used[name] for name in self.architecture.names]
        verdict = self._verdict(sensors)
        excluded = None if verdict is None else verdict.excluded
        fused = fused_errors(sensors, self.weights, excluded=excluded)
        output = over_axes(fused, self.architecture.axis_rule, every_axis=True)
        if verdict is None:
            return output, np.ones(output.shape, dtype=bool)
        return output, np.asarray(verdict.usable.all(axis=0))

    def _verdict(self, sensors: list[UsedErrors]) -> Disagreement | None:
        if self.architecture.fault_detection == "leave_one_out":
            return leave_one_out_test(sensors, self.variances)
        if self.architecture.fault_detection == "correlation":
            return correlation_test(
                sensors,
                self.true_position_m,
                step_s=self.architecture.step_s,
                options=self.correlation,
            )
        return None


def _prepared(
    architecture: Architecture, sources: Mapping[str, ErrorSource], correlation: Correlation
) -> _Fusion:
    missing = {s.name: s.missing for s in architecture.sensors if not isinstance(s, Unmodelled)}
    weights = variances = np.empty(0)
    if architecture.operator != "kalman":
        tested = architecture.fault_detection == "leave_one_out"
        if tested or architecture.weights != "fixed":
            variances = error_variances(architecture, sources=sources)
        if architecture.weights == "fixed":
            weights = given_weights(architecture)
        else:
            weights = inverse_variance_weights(variances)
    true_position = epoch_positions_m(architecture)
    return _Fusion(architecture, missing, true_position, weights, variances, correlation)


def _filtered(architecture: Architecture, drawn: Mapping[str, SensorRuns]) -> Floats:
    """One odometer, one accelerometer, one receiver: `check_architecture` demands it."""
    accelerations = [s.acceleration_error_mps2 for s in drawn.values()]
    speeds = [s.speed_error_mps for s in drawn.values()]
    (acceleration,) = (a for a in accelerations if a is not None)
    (speed,) = (v for v in speeds if v is not None)
    (receiver,) = (s.name for s in architecture.sensors if isinstance(s, SatelliteReceiver))
    return filtered_errors(
        acceleration,
        speed,
        drawn[receiver].error_m[0],
        tuning=architecture.filter,
        substep_s=architecture.substep_s,
        substeps=architecture.substeps,
    )
