"""Errors of the sensors over a batch of runs: only errors, since the truth cancels in a fusion.

Every sensor has two streams of its own, one for its noise and one for its faults, made from its
name: another sensor, another order or other faults leave its noise as it is. Failures of the
hardware are not drawn: 1e-6 per hour is never seen in samples of 100 s.

Source: docs/methods/multisensor.md; all parameters are defaults chosen there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
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
    architecture : sound by `check_architecture`, with a source for each sensor without model.
    runs : number of runs, 1 or more.
    rng : seed of the batch; it is not changed, the same one gives the same errors again.
    sources : by name of a sensor: errors that replace its model. NaN is no data.

    Returns
    -------
    By name: errors of positions at the epochs, of speed and acceleration at the sub-steps.

    Raises
    ------
    InputError : sources that do not fit the sensors.
    """
    _check_sources(architecture, sources)
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
    every = round(sensor.interval_s / architecture.step_s)
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


# --- sources that do not fit ------------------------------------------------------------------


def _check_sources(architecture: Architecture, sources: Mapping[str, ErrorSource]) -> None:
    unknown = sorted(set(sources) - set(architecture.names))
    if unknown:
        raise InputError(
            f"no sensor is called {', '.join(map(repr, unknown))}",
            where="sources",
            cure=f"sensors of {architecture.name}: {', '.join(architecture.names)}",
        )
    for sensor in architecture.sensors:
        if sensor.name not in sources:
            continue
        if architecture.operator == "kalman" and not isinstance(
            sensor, SatelliteReceiver | Unmodelled
        ):
            raise InputError(
                f"the errors of {sensor.name!r} cannot be replaced: a Kalman filter needs speed "
                "and acceleration at every sub-step",
                where="sources",
            )
        if _group_of(architecture, sensor.name).common_cause != "independent":
            raise InputError(
                f"{sensor.name!r} is replaced: it has no common cause with others",
                where="sources",
                cure='common_cause = "independent", share = 0.0',
            )
