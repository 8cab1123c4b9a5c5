"""Weights of the fused sensors: by the variance of their errors (Eq. 4), or as given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from sbas.exceptions import ModelError
from sbas.fusion.architecture.architecture_check import in_space
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    InertialUnit,
    Odometer,
    SatelliteReceiver,
    Sensor,
    Unmodelled,
)
from sbas.fusion.fused_runs import Bools, Floats
from sbas.fusion.simulation.batch_filter import NOISE_INTERVAL_S
from sbas.fusion.simulation.missing_data import epoch_positions_m
from sbas.fusion.simulation.sensor_errors import NO_SOURCES, ErrorSource, draw_sensors

PILOT_RUNS: Final = 8000
PILOT_SEED: Final = 4
"""Entropy of the pilot's own stream: weights belong to the architecture, not to a run's seed."""

_PILOT_BATCH: Final = 1000
_AXES: Final = "xyz"
_FIXED: Final = 'write weights = "fixed" and fixed_weights = [...], one number a sensor, in order'


def error_variances(
    architecture: Architecture, *, sources: Mapping[str, ErrorSource] = NO_SOURCES
) -> Floats:
    """Mean squared position error of each sensor, as the rule of the weights asks for.

    Parameters
    ----------
    architecture : its `weights` say what is taken: "fault_free" (and "fixed", whose detection
        needs it) the mean over the epochs without slips, multipath and outages; "per_epoch" the
        same at each epoch; "with_faults" the mean over all fixes with them.
    sources : of sensors whose errors replace their model.

    Returns
    -------
    (a, n) or, with "per_epoch", (a, t, n) variances [m^2]; inf on axes not measured.

    Raises
    ------
    ModelError : a variance of zero, or one that no data show.

    Notes
    -----
    Fault-free variances of the models are exact; a fix extrapolated between fixes counts as a
    fix. "with_faults" and replaced sensors are estimated from `PILOT_RUNS` runs of a stream of
    their own, about zero: a systematic error is an error. Recorded errors are taken as they are:
    no rule can tell their faults.

    References
    ----------
    Railways 2014, Eq. 4; models of docs/methods/multisensor.md.
    """
    with_faults = architecture.weights == "with_faults"
    piloted = [s for s in architecture.sensors if with_faults or s.name in sources]
    pilot = _pilot_squares(architecture, piloted, sources)
    shape = (architecture.axes, architecture.epochs, len(architecture.sensors))
    squares, counts = np.zeros(shape), np.ones(shape)
    measured = _measured(architecture)
    for i, sensor in enumerate(architecture.sensors):
        if sensor.name in pilot:
            squares[:, :, i], counts[:, :, i], measured[:, i] = pilot[sensor.name]
        else:
            squares[:, :, i] = _fault_free(architecture, sensor)
    if architecture.weights != "per_epoch":
        squares, counts = squares.sum(axis=1, keepdims=True), counts.sum(axis=1, keepdims=True)
    variances = np.where(counts > 0, squares / np.maximum(counts, 1), np.nan)
    _demand_spread(architecture, variances, measured)
    variances = np.where(measured[:, np.newaxis], variances, np.inf)
    return variances if architecture.weights == "per_epoch" else variances[:, 0]


def inverse_variance_weights(variances: Floats) -> Floats:
    """Weights that add up to 1 over the last axis, inverse to the variances: Eq. 4.

    Parameters
    ----------
    variances : (..., n) [m^2], positive; inf takes no part.
    """
    inverse = 1.0 / variances
    weights: Floats = inverse / inverse.sum(axis=-1, keepdims=True)
    return weights


def given_weights(architecture: Architecture) -> Floats:
    """Fixed weights that add up to 1 on each axis, among the sensors that measure it.

    Parameters
    ----------
    architecture : sound by `check_architecture`, with weights = "fixed".

    Returns
    -------
    (a, n) weights [1].
    """
    shares = np.where(_measured(architecture), architecture.fixed_weights, 0.0)
    return np.asarray(shares / shares.sum(axis=-1, keepdims=True))


# --- variances --------------------------------------------------------------------------------


def _measured(architecture: Architecture) -> Bools:
    """(a, n): odometers and accelerometers measure along the track, x."""
    measured = np.ones((architecture.axes, len(architecture.sensors)), dtype=bool)
    measured[1:, [not in_space(sensor) for sensor in architecture.sensors]] = False
    return measured


def _fault_free(architecture: Architecture, sensor: Sensor) -> Floats:
    """Variances at the epochs, (t,), of sums over n sub-steps of h; sums of squares in closed form.

    Odometer: (s x)^2 + nv^2 0.1 t. Accelerometer, twice summed: bias b h^2 n(n+1)/2; white noise
    h^3 sum m^2; random walk h^5 sum (m(m+1)/2)^2, m = 1..n.
    """
    h = architecture.substep_s
    n = np.arange(1, architecture.epochs + 1, dtype=float) * architecture.substeps
    match sensor:
        case Odometer():
            x = epoch_positions_m(architecture)
            return np.asarray(
                (sensor.scale_sd * x) ** 2 + sensor.noise_mps**2 * NOISE_INTERVAL_S * h * n
            )
        case Accelerometer() | InertialUnit():
            bias = (sensor.bias_mps2 * h**2 * n * (n + 1) / 2) ** 2
            white = sensor.noise_mps2_per_rthz**2 * h**3 * n * (n + 1) * (2 * n + 1) / 6
            ramps = n * (n + 1) * (n + 2) * (3 * n**2 + 6 * n + 1) / 60
            return np.asarray(bias + white + sensor.walk_mps2_per_rts**2 * h**5 * ramps)
        case SatelliteReceiver():
            return np.full(architecture.epochs, sensor.white_m**2 + sensor.correlated_m**2)
        case Unmodelled():
            raise ModelError(
                f"sensor {sensor.name!r} of kind {sensor.kind!r} has no error model",
                where=f"sensors.{sensor.name}",
                cure="replace it by a sensor with a model, or supply its errors as a source",
            )


def _pilot_squares(
    architecture: Architecture, sensors: list[Sensor], sources: Mapping[str, ErrorSource]
) -> dict[str, tuple[Floats, Floats, Bools]]:
    """Per sensor the sums of squared errors and their counts, (a, t), and the axes it measures."""
    if not sensors:
        return {}
    names = {sensor.name for sensor in sensors}
    drawn = architecture
    if len(sensors) < len(architecture.sensors):
        drawn = replace(architecture, sensors=tuple(sensors), redundancy=())
    shape = (architecture.axes, architecture.epochs)
    sums = {name: (np.zeros(shape), np.zeros(shape), np.zeros(shape[0], bool)) for name in names}
    for stream in np.random.SeedSequence(PILOT_SEED).spawn(PILOT_RUNS // _PILOT_BATCH):
        for name, runs in draw_sensors(drawn, _PILOT_BATCH, stream, sources=sources).items():
            seen = ~np.isnan(runs.error_m)
            squares, counts, measured = sums[name]
            squares += np.sum(runs.error_m**2, axis=-1, where=seen)
            counts += seen.sum(axis=-1)
            measured[:] = runs.measures
    return sums


def _demand_spread(architecture: Architecture, variances: Floats, measured: Bools) -> None:
    usable = (variances > 0) & np.isfinite(variances)
    for i, name in enumerate(architecture.names):
        bad = variances[..., i][~usable[..., i] & measured[:, i, np.newaxis]]
        if bad.size:
            raise ModelError(
                f"the errors of sensor {name!r} have no variance that Eq. 4 can divide by",
                where=f"sensors.{name}",
                evidence=f'with weights = "{architecture.weights}" the variance is '
                f"{bad[0]:.6g} m^2" + (", as it gave no data" if np.isnan(bad[0]) else ""),
                cure=f"give the sensor's noise a positive value, or {_FIXED}",
            )
    if not measured.any(axis=1).all():
        raise ModelError(
            f"no sensor measures axis {_AXES[int(np.argmin(measured.any(axis=1)))]}",
            where="sensors",
            cure='add a receiver or an inertial unit, or write operator = "weighted_mean"',
        )
