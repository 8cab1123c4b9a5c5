"""Variances of the sensors' errors and the weights of Eq. 4."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sbas.exceptions import ModelError
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Bursts,
    InertialUnit,
    Missing,
    Odometer,
    Phase,
    SatelliteReceiver,
    SpeedProfile,
    Unmodelled,
)
from sbas.fusion.fused_runs import Floats
from sbas.fusion.simulation.weights import (
    error_variances,
    given_weights,
    inverse_variance_weights,
)

ARCH1 = Architecture(
    "arch1",
    (
        Odometer("odo"),
        Accelerometer("acc"),
        SatelliteReceiver("gnss", missing=Missing("extrapolate", "odo")),
    ),
)
IN_SPACE = replace(
    ARCH1,
    operator="per_axis",
    sensors=(Odometer("odo"), InertialUnit("imu"), SatelliteReceiver("gnss")),
)


def eq_4_weights(architecture: Architecture) -> Floats:
    return inverse_variance_weights(error_variances(architecture))


def test_pooled_variances_and_weights_of_the_page() -> None:
    # Page, section 11: exact, no outage.
    sd = np.sqrt(error_variances(ARCH1))
    assert sd[0] == pytest.approx([0.8288, 1.2741, 0.7071], abs=5e-5)
    weights = eq_4_weights(ARCH1)
    assert weights.shape == (1, 3)
    assert weights[0] == pytest.approx([0.3575, 0.1513, 0.4912], abs=5e-5)


def test_weights_at_each_epoch_of_the_page() -> None:
    per_epoch = replace(ARCH1, weights="per_epoch")
    weights = eq_4_weights(per_epoch)
    assert weights.shape == (1, 100, 3)
    assert weights[0, [0, 19, 99]] == pytest.approx(
        np.array([[0.004, 0.996, 0.000], [0.490, 0.480, 0.030], [0.196, 0.052, 0.752]]), abs=5e-4
    )
    sd = np.sqrt(error_variances(per_epoch))[0, 99]
    assert sd[:2] == pytest.approx([1.3865, 2.6858], abs=5e-5)  # page, section 11, at 100 s


def test_dead_reckoning_variances_equal_sums_of_squares() -> None:
    """Each position is a linear map of independent normals: the variance is a sum of squares."""
    h, substeps, epochs = 0.05, 10, 6
    count = substeps * epochs
    sums = np.tril(np.ones((count, count)))
    speed = np.cumsum(np.full(count, 0.3 * h)) + 5.0
    odometer = Odometer("odo", scale_sd=4e-3, noise_mps=0.2)
    inertial = InertialUnit("imu", bias_mps2=3e-3, walk_mps2_per_rts=1e-2, noise_mps2_per_rthz=2e-2)
    architecture = Architecture(
        "short",
        (odometer, inertial, SatelliteReceiver("gnss", white_m=0.3, correlated_m=0.4)),
        operator="per_axis",
        weights="per_epoch",
        profile=SpeedProfile((Phase(10.0, 0.3),), start_speed_mps=5.0),
        duration_s=3.0,
        step_s=0.5,
        substep_s=h,
    )
    white_speed = 0.2 * np.sqrt(0.1 / h) * h * sums
    scale = 4e-3 * h * np.cumsum(speed)
    twice = h**2 * sums @ sums
    bias = 3e-3 * twice.sum(axis=1)
    walk = 1e-2 * np.sqrt(h) * twice @ sums
    white = 2e-2 / np.sqrt(h) * twice
    along = [
        scale**2 + (white_speed**2).sum(axis=1),
        bias**2 + (walk**2).sum(axis=1) + (white**2).sum(axis=1),
    ]
    variances = error_variances(architecture)
    assert variances.shape == (3, 6, 3)
    assert variances[0, :, 0] == pytest.approx(along[0][substeps - 1 :: substeps], rel=1e-10)
    assert np.isinf(variances[1:, :, 0]).all()
    for axis in range(3):
        assert variances[axis, :, 1] == pytest.approx(along[1][substeps - 1 :: substeps], rel=1e-10)
        assert variances[axis, :, 2] == pytest.approx(np.full(6, 0.25))


def test_weights_on_each_axis_are_shared_by_the_sensors_that_measure_it() -> None:
    weights = eq_4_weights(IN_SPACE)
    assert weights[0] == pytest.approx([0.3575, 0.1513, 0.4912], abs=5e-5)
    # 0.1513/(0.1513 + 0.4912), since sensors keep their proportions
    assert weights[1] == pytest.approx([0, 0.2355, 0.7645], abs=1e-4)
    assert weights[2] == pytest.approx(weights[1])
    fixed = given_weights(replace(IN_SPACE, weights="fixed", fixed_weights=(0.5, 0.2, 0.3)))
    assert fixed == pytest.approx(np.array([[0.5, 0.2, 0.3], [0, 0.4, 0.6], [0, 0.4, 0.6]]))


def test_weights_with_faults_come_from_a_pilot_that_always_gives_the_same() -> None:
    with_faults = replace(ARCH1, weights="with_faults")
    weights = eq_4_weights(with_faults)
    # Page: .280/.452/.268 from 2000 runs, whose weights scatter by .009 (20 samples of 2000).
    assert weights[0] == pytest.approx([0.280, 0.452, 0.268], abs=0.027)
    assert np.array_equal(weights, eq_4_weights(with_faults))


def test_without_faults_the_pilot_finds_the_exact_variances() -> None:
    never = Bursts(0.0, 1.0)
    quiet = replace(
        ARCH1,
        weights="with_faults",
        sensors=(
            Odometer("odo", slip=never),
            Accelerometer("acc"),
            SatelliteReceiver("gnss", multipath=never),
        ),
    )
    # 8000 runs, each about one degree of freedom for dead reckoning: 4 sd are 4*sqrt(2/8000).
    assert error_variances(quiet) == pytest.approx(error_variances(ARCH1), rel=0.064)


def _alternating(_: np.random.Generator, runs: int) -> Floats:
    errors = np.full((100, runs), 3.0)
    errors[::2] = -3.0
    errors[40:60] = np.nan
    return errors


def test_variance_of_recorded_errors_comes_from_their_source() -> None:
    variances = error_variances(ARCH1, sources={"gnss": _alternating})
    assert variances[0, 2] == pytest.approx(9.0)
    assert variances[0, :2] == pytest.approx(error_variances(ARCH1)[0, :2])


def test_errors_that_cannot_be_weighted_are_refused_with_a_cure() -> None:
    perfect = replace(
        ARCH1, sensors=(*ARCH1.sensors[:2], SatelliteReceiver("gnss", white_m=0, correlated_m=0))
    )
    with pytest.raises(ModelError, match="fixed_weights"):
        error_variances(perfect)
    silent = {"gnss": lambda _, runs: np.full((100, runs), np.nan)}
    with pytest.raises(ModelError, match="gave no data"):
        error_variances(ARCH1, sources=silent)
    with pytest.raises(ModelError, match="inf"):
        error_variances(ARCH1, sources={"gnss": lambda _, runs: np.full((100, runs), np.inf)})
    with pytest.raises(ModelError, match="gave no data"):
        error_variances(replace(ARCH1, weights="per_epoch"), sources={"gnss": _alternating})
    with pytest.raises(ModelError, match="gyroscope"):
        error_variances(replace(ARCH1, sensors=(*ARCH1.sensors, Unmodelled("gyro", "gyroscope"))))
    along_only = {
        "gnss": lambda _, runs: np.ones((100, runs)),
        "imu": lambda _, runs: np.ones((100, runs)),
    }
    with pytest.raises(ModelError, match="no sensor measures axis y"):
        error_variances(IN_SPACE, sources=along_only)


def test_an_infinite_variance_takes_no_part() -> None:
    weights = inverse_variance_weights(np.array([[1.0, 0.25, np.inf]]))
    assert weights == pytest.approx(np.array([[0.2, 0.8, 0.0]]))
