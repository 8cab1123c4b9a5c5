"""A sensor architecture: which sensors, how they are fused, what happens when one is silent.

Plain data; errors of positions are along the track, in metres, signed. Defaults are those of the
laboratory model documented in docs/methods/multisensor.md: Railways 2014 gives no parameters.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal

Operator = Literal["weighted_mean", "kalman", "per_axis"]
WeightRule = Literal["fault_free", "with_faults", "per_epoch", "fixed"]
MissingPolicy = Literal["extrapolate", "remove", "hold", "substitute"]
AxisRule = Literal["worst_axis", "norm"]
CommonCause = Literal["independent", "per_run", "beta_factor"]
FaultDetection = Literal["none", "leave_one_out", "correlation"]
StateOf = Literal["used", "own"]

MOST_SENSORS: Final = 39
"""The largest n with 3^n below 2^63, by which combinations of states are numbered."""


# --- what moves and what measures -------------------------------------------------------------


@dataclass(frozen=True)
class Phase:
    """A stretch of constant acceleration, to `until_s`."""

    until_s: float
    acceleration_mps2: float


@dataclass(frozen=True)
class SpeedProfile:
    """Motion of the train: phases one after the other from `start_speed_mps`; the last one goes on.

    The default speeds up to 20 m/s in 40 s, runs on to 75 s and brakes to a stand at 100 s.
    """

    phases: tuple[Phase, ...] = (Phase(40.0, 0.5), Phase(75.0, 0.0), Phase(100.0, -0.8))
    start_speed_mps: float = 0.0


@dataclass(frozen=True)
class Missing:
    """What the fusion does where a sensor gives no data.

    Parameters
    ----------
    policy : "extrapolate" its last value by the motion that sensor `by` saw since; "remove" it
        from the fusion; "hold" its last value; "substitute" the value of sensor `by`.
    by : name of the other sensor; empty with "remove" and "hold".
    renormalise : with "remove": weights of the others add up to 1 again.
    """

    policy: MissingPolicy = "remove"
    by: str = ""
    renormalise: bool = True


@dataclass(frozen=True)
class Bursts:
    """Faults that come and go: a two-state process that starts off."""

    rate_per_s: float
    mean_duration_s: float
    smallest: float = 0.0
    largest: float = 0.0
    """Amplitude, uniform between both, in the unit of what it disturbs; an outage has none."""


@dataclass(frozen=True)
class Odometer:
    """Wheel sensor: speed with a scale error, noise and slips, summed to a position."""

    name: str
    scale_sd: float = 1e-3
    noise_mps: float = 0.10
    """Standard deviation of the speed over 0.1 s."""
    slip: Bursts = Bursts(0.02, 3.0, 0.01, 0.06)
    """Share of the speed; over-reads in traction, under-reads in braking, else none."""
    missing: Missing = Missing()
    failure_rate_per_h: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class Accelerometer:
    """Accelerometer along the track, summed twice to a position."""

    name: str
    bias_mps2: float = 4e-4
    walk_mps2_per_rts: float = 2e-5
    noise_mps2_per_rthz: float = 3e-3
    missing: Missing = Missing()
    failure_rate_per_h: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class InertialUnit:
    """Three accelerometers, one an axis, alike and independent."""

    name: str
    bias_mps2: float = 4e-4
    walk_mps2_per_rts: float = 2e-5
    noise_mps2_per_rthz: float = 3e-3
    missing: Missing = Missing()
    failure_rate_per_h: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class SatelliteReceiver:
    """GNSS receiver: white noise, a Gauss-Markov part, multipath bursts and outages."""

    name: str
    interval_s: float = 1.0
    white_m: float = 0.5
    correlated_m: float = 0.5
    tau_s: float = 30.0
    multipath: Bursts = Bursts(1 / 60, 5.0, 1.5, 8.0)
    """Metres, of either sign."""
    outage: Bursts = Bursts(1 / 150, 6.0)
    missing: Missing = Missing()
    failure_rate_per_h: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class Unmodelled:
    """A sensor that is named but has no error model: nothing can be simulated with it."""

    name: str
    kind: str
    source: str = ""


Sensor = Odometer | Accelerometer | InertialUnit | SatelliteReceiver | Unmodelled


@dataclass(frozen=True)
class Redundancy:
    """Identical sensors and what their faults share.

    Parameters
    ----------
    sensors : names of sensors of one kind.
    common_cause : "independent"; "per_run": with probability `share` a run's bursts are switched
        by one process for all of them, amplitudes their own; "beta_factor": bursts at `share`
        of the rate are common to all, the rest each sensor's own.
    share : probability or beta factor [1].
    """

    sensors: tuple[str, ...]
    common_cause: CommonCause = "independent"
    share: float = 0.0


# --- how it is fused --------------------------------------------------------------------------


@dataclass(frozen=True)
class FilterTuning:
    """Noise that the Kalman filter assumes; the filter runs on position and speed."""

    acceleration_mps2_per_rthz: float = 0.03
    speed_mps: float = 0.12
    """Standard deviation of an odometer's speed over 0.1 s."""
    position_m: float = 0.75
    """Standard deviation of a satellite fix."""
    initial_position_m: float = 0.1
    initial_speed_mps: float = 0.01
    gate: float | None = None
    """Largest normalised innovation squared of a fix that is used; None uses all."""


@dataclass(frozen=True)
class Thresholds:
    """Bounds of the states, on the error's size: N below `nominal_m`, U from `alert_limit_m` on."""

    nominal_m: float = 1.0
    alert_limit_m: float = 2.5
    hysteresis_m: float = 0.0
    """A state gets better only once the error is so far below the bound."""
    min_dwell_s: float = 0.0
    """A better state is taken only once it has lasted so long."""


@dataclass(frozen=True)
class Architecture:
    """Sensors, their fusion and the conditions of the simulation.

    Parameters
    ----------
    sensors : in the order of the combinations' codes.
    operator : "weighted_mean" of positions; "kalman" filter readjusted by the satellite fixes;
        "per_axis": a weighted mean on each of three axes, x along the track.
    weights : rule of the weights; "fixed" takes `fixed_weights`.
    missing_state_of : where a policy supplies a missing sensor's value: its state is that of the
        value "used", or no data ("own").
    reported : what documents say of it, with their place, where it is a known system.
    """

    name: str
    sensors: tuple[Sensor, ...]
    operator: Operator = "weighted_mean"
    weights: WeightRule = "fault_free"
    fixed_weights: tuple[float, ...] = ()
    redundancy: tuple[Redundancy, ...] = ()
    axis_rule: AxisRule = "worst_axis"
    fault_detection: FaultDetection = "none"
    missing_state_of: StateOf = "used"
    filter: FilterTuning = FilterTuning()
    thresholds: Thresholds = Thresholds()
    profile: SpeedProfile = SpeedProfile()
    duration_s: float = 100.0
    step_s: float = 1.0
    substep_s: float = 0.1
    source: str = ""
    reported: tuple[str, ...] = field(default=())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sensors, in their order."""
        return tuple(sensor.name for sensor in self.sensors)

    @property
    def axes(self) -> int:
        """Coordinates that are fused: 3 with "per_axis", else 1."""
        return 3 if self.operator == "per_axis" else 1

    @property
    def epochs(self) -> int:
        """Epochs of a run, at `step_s`, 2 `step_s`, ... `duration_s`."""
        return round(self.duration_s / self.step_s)

    @property
    def substeps(self) -> int:
        """Steps of propagation between two epochs."""
        return round(self.step_s / self.substep_s)
