"""The batch filter against filterpy, run by run: odometer each sub-step, fixes at the epochs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    FilterTuning,
    Odometer,
    SatelliteReceiver,
)
from sbas.fusion.simulation.batch_filter import FilterHistory, filter_history
from sbas.fusion.simulation.sensor_errors import draw_sensors

kalman = pytest.importorskip("filterpy.kalman", reason="filterpy is the peer of this test")

Parts = tuple[np.ndarray, np.ndarray, np.ndarray]
RUNS, EPOCHS = 6, 100
TOLERANCE_M = 1e-12


@pytest.fixture(scope="module")
def errors() -> Parts:
    """Slips, multipath and outages of six runs of 100 s."""
    arch = Architecture("peer", (Odometer("odo"), Accelerometer("acc"), SatelliteReceiver("gps")))
    drawn = draw_sensors(arch, RUNS, np.random.SeedSequence(11))
    acceleration, speed = drawn["acc"].acceleration_error_mps2, drawn["odo"].speed_error_mps
    assert acceleration is not None
    assert speed is not None
    return acceleration, speed, drawn["gps"].error_m[0]


def peer(parts: Parts, tuning: FilterTuning, h: float, substeps: int) -> FilterHistory:
    """The same filter, one run after the other; the error of the acceleration is its input."""
    acceleration, speed, fix = parts
    t, r = fix.shape
    gate = np.inf if tuning.gate is None else tuning.gate
    history = FilterHistory(
        np.empty((t, r)), np.empty((t, r)), np.zeros((t, r), bool), np.zeros((t, 2, r)),
        np.empty((t, 3, r)),
    )  # fmt: skip
    odometer = np.array([[0.0, 1.0]])
    position = np.array([[1.0, 0.0]])
    for run in range(r):
        peer = kalman.KalmanFilter(dim_x=2, dim_z=1, dim_u=1)
        peer.x = np.zeros((2, 1))
        peer.P = np.diag([tuning.initial_position_m**2, tuning.initial_speed_mps**2])
        peer.F = np.array([[1.0, h], [0.0, 1.0]])
        peer.B = np.array([[h**2], [h]])
        peer.Q = tuning.acceleration_mps2_per_rthz**2 * np.array(
            [[h**3 / 3, h**2 / 2], [h**2 / 2, h]]
        )
        for k in range(t * substeps):
            peer.predict(u=np.array([[acceleration[k, run]]]))
            peer.update(speed[k, run], R=tuning.speed_mps**2 * 0.1 / h, H=odometer)
            if (k + 1) % substeps:
                continue
            epoch, measured = k // substeps, fix[k // substeps, run]
            variance = peer.P[0, 0] + tuning.position_m**2
            if (measured - peer.x[0, 0]) ** 2 / variance <= gate:
                peer.update(measured, R=tuning.position_m**2, H=position)
                history.used[epoch, run] = True
                history.gain[epoch, :, run] = peer.K[:, 0]
            history.error_m[epoch, run], history.speed_error_mps[epoch, run] = peer.x[:, 0]
            history.covariance[epoch, :, run] = peer.P[0, 0], peer.P[0, 1], peer.P[1, 1]
    return history


def same(parts: Parts, tuning: FilterTuning, h: float = 0.1, substeps: int = 10) -> FilterHistory:
    ours = filter_history(*parts, tuning=tuning, substep_s=h, substeps=substeps)
    theirs = peer(parts, tuning, h, substeps)
    np.testing.assert_array_equal(ours.used, theirs.used)
    for name in ("error_m", "speed_error_mps", "gain", "covariance"):
        np.testing.assert_allclose(
            getattr(ours, name), getattr(theirs, name), rtol=0, atol=TOLERANCE_M, err_msg=name
        )
    return ours


def test_with_outages_and_multipath(errors: Parts) -> None:
    missing = np.isnan(errors[2])
    assert missing.any()
    assert not missing.all(axis=1).any()
    used = same(errors, FilterTuning()).used
    np.testing.assert_array_equal(used, ~missing)


def test_without_outages(errors: Parts) -> None:
    acceleration, speed, fix = errors
    same((acceleration, speed, np.nan_to_num(fix, nan=0.3)), FilterTuning())


def test_with_a_gate(errors: Parts) -> None:
    used = same(errors, FilterTuning(gate=6.63)).used
    refused = ~used & ~np.isnan(errors[2])
    assert 5 < refused.sum() < 100


def test_other_steps_and_tuning(errors: Parts) -> None:
    """Sub-steps of 0.25 s, four an epoch; the first fix after 5 s, none from 40 s to 60 s."""
    acceleration, speed, fix = (part.copy() for part in errors)
    fix[:5] = fix[40:60] = np.nan
    tuning = FilterTuning(0.3, 0.5, 3.0, 5.0, 2.0, gate=9.0)
    parts = acceleration[: 4 * EPOCHS], speed[: 4 * EPOCHS], fix
    same(parts, tuning, h=0.25, substeps=4)
    same(parts, replace(tuning, gate=None), h=0.25, substeps=4)
