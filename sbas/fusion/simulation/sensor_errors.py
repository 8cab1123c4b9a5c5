"""Errors of the sensors over a batch of runs: only errors, since the truth cancels in a fusion.

Every sensor has two streams of its own, one for its noise and one for its faults, made from its
name: another sensor, another order or other faults leave its noise as it is. Failures of the
hardware are not drawn: 1e-6 per hour is never seen in samples of 100 s.

Source: docs/methods/multisensor.md; all parameters are defaults chosen there.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Bursts,
    InertialUnit,
    Odometer,
    Redundancy,
    SatelliteReceiver,
    Sensor,
    Unmodelled,
)
from sbas.fusion.fused_runs import Floats, SensorRuns
from sbas.fusion.simulation.batch_filter import NOISE_INTERVAL_S
from sbas.fusion.simulation.bursts import BurstRuns, draw_amplitudes, draw_shared_bursts
from sbas.fusion.simulation.speed_profile import accelerations_mps2, speeds_mps

ErrorSource = Callable[[np.random.Generator, int], Floats]
"""Errors of a sensor instead of its model: (t, r) along the track or (a, t, r) [m], for r runs."""

NO_SOURCES: Final[Mapping[str, ErrorSource]] = MappingProxyType({})

_NOISE, _FAULTS, _GROUP, _COIN = 1, 2, 3, 4


def draw_sensors(
    architecture: Architecture,
    runs: int,
    rng: np.random.SeedSequence,
    *,
    sources: Mapping[str, ErrorSource] = NO_SOURCES,
) -> dict[str, SensorRuns]:
    """Errors of all sensors of an architecture.

    Parameters
    ----------
    architecture : sensors, motion and grid of time.
    runs : number of runs, 1 or more.
    rng : seed of the batch; it is not changed, the same one gives the same errors again.
    sources : by name of a sensor: errors that replace its model. NaN is no data.

    Returns
    -------
    By name: errors of positions at the epochs, of speed and acceleration at the sub-steps.

    Raises
    ------
    InputError : a sensor without a model, steps that are no multiples of each other, sources or
        common causes that do not fit the sensors.
    """
    _check(architecture, runs, sources)
    drawn = {}
    for sensor in architecture.sensors:
        streams = _Streams(architecture, runs, sensor.name, rng)
        if sensor.name in sources:
            drawn[sensor.name] = _replaced(
                architecture, runs, sensor.name, sources[sensor.name], streams.noise
            )
        elif isinstance(sensor, Odometer):
            drawn[sensor.name] = _odometer(architecture, runs, sensor, streams)
        elif isinstance(sensor, SatelliteReceiver):
            drawn[sensor.name] = _satellite_receiver(architecture, runs, sensor, streams)
        elif isinstance(sensor, Accelerometer | InertialUnit):
            drawn[sensor.name] = _accelerometers(architecture, runs, sensor, streams)
    return drawn


# --- streams ----------------------------------------------------------------------------------


class _Streams:
    """Streams of one sensor: noise, faults, and the faults of its group."""

    def __init__(
        self, architecture: Architecture, runs: int, name: str, seed: np.random.SeedSequence
    ) -> None:
        def stream(purpose: int, of: str) -> np.random.Generator:
            key = (*seed.spawn_key, purpose, *of.encode())
            return np.random.default_rng(np.random.SeedSequence(seed.entropy, spawn_key=key))

        self.group = _group_of(architecture, name)
        self.noise = stream(_NOISE, name)
        self.faults = stream(_FAULTS, name)
        # The first sensor names the group's stream: it is the same for all of them.
        first = self.group.sensors[0] if self.group.sensors else name
        self.common = stream(_GROUP, first)
        self.coin = stream(_COIN, first).random(runs)

    def bursts(self, bursts: Bursts, step_s: float, steps: int) -> BurstRuns:
        return draw_shared_bursts(
            bursts,
            common_cause=self.group.common_cause,
            share=self.group.share,
            step_s=step_s,
            steps=steps,
            runs=self.coin.size,
            own=self.faults,
            common=self.common,
            coin=self.coin,
        )


def _group_of(architecture: Architecture, name: str) -> Redundancy:
    groups = [group for group in architecture.redundancy if name in group.sensors]
    return groups[0] if groups else Redundancy(sensors=())


# --- models -----------------------------------------------------------------------------------


def _odometer(
    architecture: Architecture, runs: int, sensor: Odometer, streams: _Streams
) -> SensorRuns:
    """Speed times (scale error + slip) + noise, summed to a position."""
    h, count = architecture.substep_s, architecture.epochs * architecture.substeps
    speed = speeds_mps(architecture.profile, h, count)
    direction = np.sign(accelerations_mps2(architecture.profile, h, count))
    scale = sensor.scale_sd * streams.noise.standard_normal(runs)
    error = streams.noise.standard_normal((count, runs))
    error *= sensor.noise_mps * math.sqrt(NOISE_INTERVAL_S / h)
    slips = streams.bursts(sensor.slip, h, count)
    slip = slips.grid(draw_amplitudes(sensor.slip, slips.run.size, streams.faults))
    slip *= direction[:, None]
    slip += scale
    slip *= speed[:, None]
    error += slip
    return SensorRuns(
        error_m=_on_axes(architecture, [_summed(architecture, error)]),
        measures=_first_axes(architecture, 1),
        speed_error_mps=error,
    )


def _accelerometers(
    architecture: Architecture,
    runs: int,
    sensor: Accelerometer | InertialUnit,
    streams: _Streams,
) -> SensorRuns:
    """Bias + random walk + noise, summed twice to a position; one or three independent ones."""
    h, count = architecture.substep_s, architecture.epochs * architecture.substeps
    axes = architecture.axes if isinstance(sensor, InertialUnit) else 1

    def acceleration() -> Floats:
        bias = sensor.bias_mps2 * streams.noise.standard_normal(runs)
        error = streams.noise.standard_normal((count, runs))
        error *= sensor.walk_mps2_per_rts * math.sqrt(h)
        error[0] += bias
        np.cumsum(error, axis=0, out=error)
        noise = streams.noise.standard_normal((count, runs))
        noise *= sensor.noise_mps2_per_rthz / math.sqrt(h)
        error += noise
        return error

    def position(acceleration: Floats) -> Floats:
        speed = np.cumsum(acceleration, axis=0)
        speed *= h
        return _summed(architecture, speed)

    along = acceleration()
    others = [position(acceleration()) for _ in range(axes - 1)]
    return SensorRuns(
        error_m=_on_axes(architecture, [position(along), *others]),
        measures=_first_axes(architecture, axes),
        acceleration_error_mps2=along,
    )


def _satellite_receiver(
    architecture: Architecture, runs: int, sensor: SatelliteReceiver, streams: _Streams
) -> SensorRuns:
    """White noise + Gauss-Markov + multipath at each fix; none in outages and between fixes.

    Multipath comes and goes on all axes at once, with an amplitude and a sign on each.
    """
    every = _epochs_a_fix(architecture, sensor)
    fixes = architecture.epochs // every
    outage = streams.bursts(sensor.outage, sensor.interval_s, fixes).on()
    multipath = streams.bursts(sensor.multipath, sensor.interval_s, fixes)

    def along_one_axis() -> Floats:
        error = sensor.white_m * streams.noise.standard_normal((fixes, runs))
        error += _gauss_markov(sensor, fixes, runs, streams.noise)
        amplitude = draw_amplitudes(
            sensor.multipath, multipath.run.size, streams.faults, either_sign=True
        )
        error += multipath.grid(amplitude)
        at_epochs = np.full((architecture.epochs, runs), np.nan)
        at_epochs[every - 1 :: every] = np.where(outage, np.nan, error)
        return at_epochs

    return SensorRuns(
        error_m=_on_axes(architecture, [along_one_axis() for _ in range(architecture.axes)]),
        measures=_first_axes(architecture, architecture.axes),
    )


def _gauss_markov(
    sensor: SatelliteReceiver, fixes: int, runs: int, rng: np.random.Generator
) -> Floats:
    """Stationary from the first fix on: g_k = f g_(k-1) + s sqrt(1 - f^2) z, f = exp(-dt/tau)."""
    f = math.exp(-sensor.interval_s / sensor.tau_s)
    values: Floats = sensor.correlated_m * rng.standard_normal((fixes, runs))
    values[1:] *= math.sqrt(-math.expm1(-2 * sensor.interval_s / sensor.tau_s))
    for k in range(1, fixes):
        values[k] += f * values[k - 1]
    return values


def _replaced(
    architecture: Architecture,
    runs: int,
    name: str,
    source: ErrorSource,
    rng: np.random.Generator,
) -> SensorRuns:
    errors = np.asarray(source(rng, runs), dtype=np.float64)
    shape = (architecture.epochs, runs)
    if errors.shape == shape:
        return SensorRuns(
            error_m=_on_axes(architecture, [errors]), measures=_first_axes(architecture, 1)
        )
    if errors.shape == (architecture.axes, *shape):
        return SensorRuns(error_m=errors, measures=_first_axes(architecture, architecture.axes))
    raise InputError(
        f"the source of {name!r} gives errors of the wrong shape",
        where=f"sources[{name!r}]",
        evidence=f"shape {errors.shape}",
        cure=f"return {shape} errors along the track, or {(architecture.axes, *shape)}",
    )


# --- axes and sums ----------------------------------------------------------------------------


def _summed(architecture: Architecture, speed: Floats) -> Floats:
    """Position (t, r) at the epochs from the speed (t * substeps, r) at the sub-steps."""
    epochs, substeps = architecture.epochs, architecture.substeps
    moved: Floats = speed.reshape(epochs, substeps, -1).sum(axis=1)
    np.cumsum(moved, axis=0, out=moved)
    moved *= architecture.substep_s
    return moved


def _on_axes(architecture: Architecture, errors: list[Floats]) -> Floats:
    if len(errors) == architecture.axes == 1:
        return errors[0][None]
    values = np.full((architecture.axes, *errors[0].shape), np.nan)
    for axis, error in enumerate(errors):
        values[axis] = error
    return values


def _first_axes(architecture: Architecture, count: int) -> tuple[bool, ...]:
    return tuple(axis < count for axis in range(architecture.axes))


# --- what cannot be simulated -----------------------------------------------------------------


def _whole(longer_s: float, shorter_s: float, words: str) -> int:
    """How often a step fits into another one."""
    possible = 0 < shorter_s < math.inf and longer_s < math.inf
    count = round(longer_s / shorter_s) if possible else 0
    if count < 1 or not math.isclose(count * shorter_s, longer_s, rel_tol=1e-9):
        raise InputError(
            f"{words} is no multiple",
            where="step_s, substep_s, duration_s, interval_s",
            evidence=f"{longer_s} s and {shorter_s} s",
            cure="choose steps that fit into each other, as 0.1 s, 1 s and 100 s do",
        )
    return count


def _epochs_a_fix(architecture: Architecture, sensor: SatelliteReceiver) -> int:
    words = f"the interval of the fixes of {sensor.name!r} against step_s"
    return _whole(sensor.interval_s, architecture.step_s, words)


def _check(architecture: Architecture, runs: int, sources: Mapping[str, ErrorSource]) -> None:
    where = f"architecture {architecture.name!r}"
    if runs < 1:
        raise InputError("a simulation has one run or more", where="runs", evidence=str(runs))
    _whole(architecture.duration_s, architecture.step_s, "duration_s against step_s")
    _whole(architecture.step_s, architecture.substep_s, "step_s against substep_s")
    unknown = sorted(set(sources) - set(architecture.names))
    if unknown:
        raise InputError(
            f"no sensor is called {', '.join(map(repr, unknown))}",
            where="sources",
            cure=f"sensors of {where}: {', '.join(architecture.names)}",
        )
    missing = [
        f"{sensor.name!r} ({sensor.kind})"
        for sensor in architecture.sensors
        if isinstance(sensor, Unmodelled) and sensor.name not in sources
    ]
    if missing:
        raise InputError(
            f"there is no error model of {', '.join(missing)}",
            where=where,
            cure="give its errors in `sources`, or leave the sensor out",
        )
    for problem in _unfit(architecture, sources):
        raise InputError(problem, where=where)


def _unfit(architecture: Architecture, sources: Mapping[str, ErrorSource]) -> Iterator[str]:
    """What in names, sources and redundancy does not fit."""
    names = architecture.names
    if len(set(names)) < len(names):
        yield f"two sensors have one name: {', '.join(names)}"
    for sensor in architecture.sensors:
        moves = isinstance(sensor, Odometer | Accelerometer | InertialUnit)
        if architecture.operator == "kalman" and moves and sensor.name in sources:
            yield (
                f"a Kalman filter needs speed and acceleration at every sub-step: the errors of "
                f"{sensor.name!r} cannot be replaced"
            )
        for name, value in vars(sensor).items():
            if isinstance(value, int | float) and not 0 <= value < math.inf:
                yield f"{name} of {sensor.name!r} is no number of 0 or more: {value}"
        if isinstance(sensor, SatelliteReceiver) and sensor.tau_s == 0:
            yield f"the correlation time of {sensor.name!r} is 0: set correlated_m = 0 instead"
    grouped = [name for group in architecture.redundancy for name in group.sensors]
    if len(set(grouped)) < len(grouped):
        yield f"a sensor belongs to one redundant group, once: {', '.join(grouped)}"
    for group in architecture.redundancy:
        yield from _unfit_group(architecture, group, sources)


def _unfit_group(
    architecture: Architecture, group: Redundancy, sources: Mapping[str, ErrorSource]
) -> Iterator[str]:
    text = ", ".join(group.sensors)
    members = [sensor for sensor in architecture.sensors if sensor.name in group.sensors]
    if len(members) < len(group.sensors):
        yield f"the redundant group ({text}) names a sensor that is not there"
    if group.common_cause == "independent":
        return
    if any(sensor.name in sources for sensor in members):
        yield f"a replaced sensor has no common cause with others: ({text})"
    if not all(isinstance(sensor, Odometer | SatelliteReceiver) for sensor in members):
        yield f"only odometers and satellite receivers have bursts to share: ({text})"
    if len({_model(sensor) for sensor in members}) > 1:
        yield f"sensors with common causes are alike but for their names: ({text})"


def _model(sensor: Sensor) -> tuple[str, str]:
    """Kind and parameters of a sensor, without its name, source and treatment when missing."""
    values = dataclasses.asdict(sensor)
    for name in ("name", "source", "missing", "failure_rate_per_h"):
        values.pop(name, None)
    return type(sensor).__name__, repr(values)
