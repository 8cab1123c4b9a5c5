"""Whole runs: shares against the page, digits, states, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sbas.exceptions import InputError, ModelError
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    FilterTuning,
    InertialUnit,
    Missing,
    Odometer,
    Phase,
    SatelliteReceiver,
    SpeedProfile,
    Thresholds,
    Unmodelled,
)
from sbas.fusion.fused_runs import Floats, FusedRuns
from sbas.fusion.simulation.disagreement import Correlation
from sbas.fusion.simulation.sensor_errors import ErrorSource
from sbas.fusion.simulation.simulated_runs import simulate_runs
from sbas.fusion.states import DA, NO_DATA, N, U

ARCH1 = Architecture(
    "arch1",
    (
        Odometer("odo"),
        Accelerometer("acc"),
        SatelliteReceiver("gnss", missing=Missing("extrapolate", "odo")),
    ),
)
ARCH1BIS = replace(ARCH1, name="arch1bis", operator="kalman")
ARCH2 = Architecture(
    "arch2",
    (
        Odometer("odo"),
        InertialUnit("imu"),
        SatelliteReceiver("gnss", missing=Missing("extrapolate", "imu")),
    ),
    operator="per_axis",
)
RUNS = 6000


@pytest.fixture(scope="module")
def arch1() -> FusedRuns:
    return simulate_runs(ARCH1, runs=RUNS, seed=1)


def _agrees(indicator: Floats, low: float, high: float) -> bool:
    """Whether a share (t, r) is within 4 of its own standard errors, by runs, of a range."""
    by_run = indicator.mean(axis=0)
    error = 4 * by_run.std() / np.sqrt(by_run.size)
    return bool(low - error <= by_run.mean() <= high + error)


def test_shares_of_architecture_1(arch1: FusedRuns) -> None:
    # Page, section 11: ranges over 3 or 4 seeds of 20000 runs.
    output = arch1.output_state
    assert _agrees(output == N, 0.817, 0.820)
    assert _agrees(output == DA, 0.135, 0.139)
    assert _agrees(output == U, 0.043, 0.046)
    ranges = ((0.097, 0.100), (0.071, 0.072), (0.068, 0.069))
    for state, (low, high) in zip(arch1.sensor_state, ranges, strict=True):
        assert _agrees(state == U, low, high)


def test_output_is_below_the_limit_while_no_sensor_is_unacceptable(arch1: FusedRuns) -> None:
    safe = (arch1.sensor_state < U).all(axis=0)
    largest = np.abs(arch1.output_error_m[safe]).max()
    assert 2.2 < largest < 2.5  # page, section 11: 2.27 to 2.44 seen
    assert arch1.declared_usable.all()


def test_the_filter_and_its_gate() -> None:
    # Page: U .027-.028 (5000 runs, 4 seeds), with the gate .060 (5000 runs).
    plain = simulate_runs(ARCH1BIS, runs=2500, seed=2)
    gated = simulate_runs(replace(ARCH1BIS, filter=FilterTuning(gate=6.63)), runs=2500, seed=2)
    assert _agrees(plain.output_state == U, 0.027, 0.028)
    assert _agrees(gated.output_state == U, 0.060, 0.060)
    assert_array_equal(plain.sensor_state, simulate_runs(ARCH1, runs=2500, seed=2).sensor_state)


def test_chunks_give_the_same_digits() -> None:
    told: list[tuple[int, int]] = []
    whole = simulate_runs(
        ARCH1, runs=250, seed=3, chunk_runs=100, progress=lambda done, of: told.append((done, of))
    )
    assert told == [(100, 250), (200, 250), (250, 250)]
    again = simulate_runs(ARCH1, runs=250, seed=3, chunk_runs=100)
    assert_array_equal(whole.output_error_m, again.output_error_m)
    longer = simulate_runs(ARCH1, runs=320, seed=3, chunk_runs=100)
    assert_array_equal(whole.output_error_m[:, :200], longer.output_error_m[:, :200])
    assert_array_equal(whole.sensor_state[:, :, :200], longer.sensor_state[:, :, :200])
    other = simulate_runs(ARCH1, runs=250, seed=4, chunk_runs=100)
    assert not np.any(whole.output_error_m == other.output_error_m)
    chunks = np.split(whole.output_error_m[:, :200], 2, axis=1)
    assert not np.any(chunks[0] == chunks[1])


@pytest.mark.parametrize("architecture", [ARCH1, ARCH1BIS, ARCH2])
def test_states_follow_from_errors(architecture: Architecture) -> None:
    runs = simulate_runs(architecture, runs=60, chunk_runs=25)
    size = np.abs(runs.output_error_m)
    assert runs.sensor_state.shape == (3, 100, 60)
    assert runs.sensor_state.dtype == runs.output_state.dtype == np.int8
    assert_array_equal(runs.output_state, np.where(size >= 2.5, U, np.where(size >= 1.0, DA, N)))
    assert (runs.names, runs.step_s, runs.runs, runs.epochs) == (
        architecture.names, 1.0, 60, 100,
    )  # fmt: skip


def _given(values: list[float]) -> ErrorSource:
    """The same errors in all runs."""
    return lambda _, runs: np.repeat(np.asarray(values, dtype=float)[:, np.newaxis], runs, axis=1)


def _three(
    gnss: list[float], missing: Missing, *, odo: tuple[float, ...] = (0.5,) * 4, **settings: object
) -> FusedRuns:
    """Two equal runs of 4 s with errors as given; equal weights unless told otherwise."""
    architecture = replace(
        ARCH1,
        sensors=(*ARCH1.sensors[:2], SatelliteReceiver("gnss", missing=missing)),
        weights="fixed",
        fixed_weights=(0.25, 0.25, 0.5),
        duration_s=4.0,
    )
    given = {"odo": list(odo), "acc": [-0.5] * 4, "gnss": gnss}
    sources = {name: _given(errors) for name, errors in given.items()}
    return simulate_runs(replace(architecture, **settings), runs=2, sources=sources)  # type: ignore[arg-type]


def test_states_of_supplied_values_used_or_own() -> None:
    gnss = [np.nan, 1.2, np.nan, 6.0]
    held = Missing("extrapolate", "odo")
    used = _three(gnss, held, odo=(0.5, 0.5, 2.0, 0.5))
    assert used.sensor_state[2, :, 0].tolist() == [NO_DATA, DA, U, U]
    assert used.output_error_m[:, 0] == pytest.approx([0.0, 0.6, 0.375 + 1.35, 3.0])
    assert used.output_state[:, 0].tolist() == [N, N, DA, U]
    own = _three(gnss, held, odo=(0.5, 0.5, 2.0, 0.5), missing_state_of="own")
    assert own.sensor_state[2, :, 0].tolist() == [NO_DATA, DA, NO_DATA, U]
    assert_array_equal(own.output_error_m, used.output_error_m)


def test_an_output_without_sensors_is_no_data_and_not_usable() -> None:
    only = replace(ARCH1, sensors=(SatelliteReceiver("gnss"),), duration_s=4.0)
    only = replace(only, weights="fixed", fixed_weights=(1.0,))
    runs = simulate_runs(only, runs=2, sources={"gnss": _given([np.nan, 0.1, np.inf, np.nan])})
    assert runs.output_state[:, 0].tolist() == [NO_DATA, N, U, NO_DATA]
    assert runs.declared_usable[:, 0].tolist() == [False, True, True, False]
    assert np.isnan(runs.output_error_m[[0, 3]]).all()


def test_leave_one_out_drops_a_receiver_far_off() -> None:
    gnss = [0.1, 40.0, 0.1, 0.1]
    loose = _three(gnss, Missing())
    assert loose.output_state[:, 0].tolist() == [N, U, N, N]
    # The recorded errors themselves set the variance, (40^2 + 3*0.1^2)/4: 40 m is 2 sd of it.
    apart = _three(gnss, Missing(), fault_detection="leave_one_out")
    assert_array_equal(apart.output_error_m, loose.output_error_m)
    architecture = replace(
        ARCH1, fault_detection="leave_one_out", weights="fixed", fixed_weights=(0.3, 0.3, 0.4)
    )
    rare = _given([0.5] * 50 + [40.0] + [0.5] * 49)
    runs = simulate_runs(architecture, runs=50, sources={"gnss": rare})
    assert (runs.sensor_state[2, 50] == U).all()
    assert (np.abs(runs.output_error_m[50]) < 10.0).all()  # 0.4 * 40 m = 16 m with the receiver
    assert runs.declared_usable[50].mean() > 0.5


def test_detection_lowers_the_share_of_unacceptable_output(arch1: FusedRuns) -> None:
    tested = simulate_runs(replace(ARCH1, fault_detection="leave_one_out"), runs=2000, seed=1)
    assert_array_equal(tested.sensor_state, arch1.sensor_state[:, :, :2000])
    u = (tested.output_state == U).mean()
    assert u < 0.5 * (arch1.output_state[:, :2000] == U).mean()
    assert 0 < (~tested.declared_usable).mean() < 0.01


def test_correlation_of_positions_never_flags_and_of_increments_does() -> None:
    architecture = replace(ARCH1, fault_detection="correlation")
    runs = simulate_runs(architecture, runs=100)
    assert_array_equal(runs.output_error_m, simulate_runs(ARCH1, runs=100).output_error_m)
    increments = simulate_runs(architecture, runs=100, correlation=Correlation("increments"))
    assert 0.01 < (~increments.declared_usable).mean() < 0.1


def test_on_three_axes_the_worst_one_decides_or_the_norm() -> None:
    def three(axis: int, size: float) -> Floats:
        errors = np.zeros((3, 2, 2))
        errors[axis] = size
        return errors

    architecture = replace(
        ARCH2, weights="fixed", fixed_weights=(0.2, 0.4, 0.4), duration_s=2.0,
        sensors=(*ARCH2.sensors[:2], SatelliteReceiver("gnss")),
    )  # fmt: skip
    sources = {
        "odo": lambda _, __: np.full((2, 2), 0.2),
        "imu": lambda _, __: three(1, -2.4),
        "gnss": lambda _, __: three(2, 2.4),
    }
    worst = simulate_runs(architecture, runs=2, sources=sources)
    assert worst.sensor_state[:, 0, 0].tolist() == [N, DA, DA]
    assert worst.output_error_m[0, 0] == pytest.approx(-1.2)
    norm = simulate_runs(replace(architecture, axis_rule="norm"), runs=2, sources=sources)
    assert norm.output_error_m[0, 0] == pytest.approx((0.04**2 + 2 * 1.2**2) ** 0.5)


def test_a_coordinate_that_nothing_gives_leaves_no_position() -> None:
    architecture = replace(
        ARCH2, weights="fixed", fixed_weights=(0.5, 0.0, 0.5), duration_s=2.0,
        sensors=(*ARCH2.sensors[:2], SatelliteReceiver("gnss", missing=Missing("hold"))),
    )  # fmt: skip
    sources = {"gnss": lambda _, runs: np.full((3, 2, runs), np.nan)}
    runs = simulate_runs(architecture, runs=3, sources=sources)
    assert (runs.output_state == NO_DATA).all()
    assert (runs.sensor_state[0] != NO_DATA).all()


def test_hysteresis_and_shorter_steps() -> None:
    fine = replace(ARCH1, duration_s=5.0, step_s=0.1, substep_s=0.05)
    runs = simulate_runs(fine, runs=20)
    assert runs.output_state.shape == (50, 20)
    # The receiver gives a fix a second: nothing before the first one.
    assert (runs.sensor_state[2, :9] == NO_DATA).all()
    slow = replace(ARCH1, thresholds=Thresholds(hysteresis_m=0.5))
    assert np.mean(simulate_runs(slow, runs=200).output_state > N) > np.mean(
        simulate_runs(ARCH1, runs=200).output_state > N
    )


@pytest.mark.parametrize("wrong", [{"runs": 0}, {"seed": -1}, {"chunk_runs": 0}])
def test_numbers_out_of_range_are_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        simulate_runs(ARCH1, **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"step_s": 0.3}, "step_s"),
        ({"profile": SpeedProfile((Phase(1.0, -1.0),))}, "profile.phases"),
        ({"sensors": (*ARCH1.sensors[:2], SatelliteReceiver("gps", tau_s=0.0))}, "gps.tau_s"),
        ({"weights": "fixed", "fixed_weights": (0.2, 0.3, 0.6)}, "fixed_weights"),
    ],
)
def test_an_unsound_architecture_is_refused(change: dict[str, Any], where: str) -> None:
    with pytest.raises(ModelError) as caught:
        simulate_runs(replace(ARCH1, **change), runs=2)
    assert where in caught.value.where


def test_sensors_without_a_model_are_named_unless_their_errors_are_given() -> None:
    sensors = (*ARCH1.sensors[:2], Unmodelled("radar", "doppler_radar"))
    architecture = replace(ARCH1, sensors=sensors)
    with pytest.raises(ModelError, match="radar"):
        simulate_runs(architecture, runs=10)
    drawn = {"radar": lambda rng, runs: rng.standard_normal((100, runs))}
    runs = simulate_runs(architecture, runs=10, sources=drawn)
    assert (runs.sensor_state[2] != NO_DATA).all()
