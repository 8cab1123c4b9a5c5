"""The batch filter against the check values of the page and against the filter in matrices."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import FilterTuning
from sbas.fusion.simulation.batch_filter import (
    Covariance,
    filter_history,
    filtered_errors,
    predicted,
    updated_by_fix,
    updated_by_speed,
)

TUNING = FilterTuning()
START = Covariance(1e-2, 0.0, 1e-4)


def zeros(t: int, r: int, substeps: int = 10) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.zeros((t * substeps, r)), np.zeros((t * substeps, r)), np.zeros((t, r))


def noise(t: int, r: int, substeps: int = 10) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    return (
        0.02 * rng.standard_normal((t * substeps, r)),
        0.12 * rng.standard_normal((t * substeps, r)),
        0.75 * rng.standard_normal((t, r)),
    )


def options(tuning: FilterTuning = TUNING, substeps: int = 10) -> dict[str, Any]:
    return {"tuning": tuning, "substep_s": 0.1, "substeps": substeps}


# --- covariances ------------------------------------------------------------------------------


def test_first_prediction_and_odometer() -> None:
    """Page causal-analysis, section 11."""
    first = predicted(START, TUNING, 0.1)
    assert first == pytest.approx((0.0100013, 1.45e-5, 1.9e-4), rel=1e-12)
    on_position, on_speed, after = updated_by_speed(first, TUNING, 0.1)
    assert (on_position, on_speed) == pytest.approx((9.93831e-4, 0.01302262), rel=5e-7)
    assert after == pytest.approx((0.01000128559, 1.431117e-5, 1.875257e-4), rel=5e-7)


def test_gains_of_the_fixes() -> None:
    """Page, section 11: gains at 10 s and 100 s without outages."""
    history = filter_history(*zeros(100, 2), **options())
    assert history.used.all()
    for second, expected in ((10, (0.03312175, 0.002320838)), (100, (0.04914931, 0.002249508))):
        for run in range(2):
            assert history.gain[second - 1, :, run] == pytest.approx(expected, rel=5e-7)


def test_updates_against_matrices() -> None:
    """F P F' + Q, and (I - K H) P with K = P H' / (H P H' + R), at another step and tuning."""
    tuning = FilterTuning(0.4, 0.3, 2.0)
    h, q = 0.25, 0.4**2
    p = np.array([[0.7, 0.11], [0.11, 0.3]])
    f = np.array([[1.0, h], [0.0, 1.0]])
    noise = q * np.array([[h**3 / 3, h**2 / 2], [h**2 / 2, h]])

    def entries(matrix: np.ndarray) -> list[float]:
        return [matrix[0, 0], matrix[0, 1], matrix[1, 1]]

    covariance = Covariance(*entries(p))
    assert predicted(covariance, tuning, h) == pytest.approx(entries(f @ p @ f.T + noise))
    for axis, variance in ((1, 0.3**2 * 0.1 / h), (0, 2.0**2)):
        gain = p[:, axis] / (p[axis, axis] + variance)
        after = p - np.outer(gain, p[axis])
        if axis == 1:
            *gains, result = updated_by_speed(covariance, tuning, h)
        else:
            *gains, result = updated_by_fix(covariance, tuning, np.array([True]))
        assert gains == pytest.approx(gain)
        assert result == pytest.approx(entries(after))


def test_fixes_that_only_some_runs_have() -> None:
    some = np.array([True, False])
    on_position, on_speed, after = updated_by_fix(START, TUNING, some)
    all_of_them = updated_by_fix(START, TUNING, np.array([True, True]))
    none = updated_by_fix(START, TUNING, ~some & False)
    assert none == (0.0, 0.0, START)
    np.testing.assert_array_equal(on_position, [all_of_them[0], 0.0])
    np.testing.assert_array_equal(on_speed, [all_of_them[1], 0.0])
    for values, updated, before in zip(after, all_of_them[2], START, strict=True):
        np.testing.assert_array_equal(values, [updated, before])


# --- errors -----------------------------------------------------------------------------------


def test_one_run_does_not_depend_on_the_others() -> None:
    """A covariance for all and one a run give the same digits, with and without a gate."""
    acceleration, speed, fix = noise(40, 6)
    fix[:, 3:][np.random.default_rng(4).random((40, 3)) < 0.3] = np.nan
    fix[20, 2] = 9.0
    for tuning in (TUNING, replace(TUNING, gate=3.0)):
        together = filtered_errors(acceleration, speed, fix, **options(tuning))
        for run in range(6):
            one = [part[:, [run]] for part in (acceleration, speed, fix)]
            alone = filtered_errors(one[0], one[1], one[2], **options(tuning))
            np.testing.assert_allclose(together[:, [run]], alone, rtol=0, atol=1e-15)


def test_history_is_that_of_the_errors() -> None:
    acceleration, speed, fix = noise(30, 4)
    fix[5:9, 1] = np.nan
    fix[11] = np.nan
    history = filter_history(acceleration, speed, fix, **options())
    np.testing.assert_array_equal(
        history.error_m, filtered_errors(acceleration, speed, fix, **options())
    )
    np.testing.assert_array_equal(history.used, ~np.isnan(fix))
    assert ((history.gain == 0).all(axis=1) == np.isnan(fix)).all()
    assert (history.covariance[8, 0, 1] > history.covariance[8, 0, 0]).all()


def test_errors_have_the_covariance_that_the_filter_believes() -> None:
    """Noise just as assumed: 4000 runs, relative standard error of a variance sqrt(2 / runs)."""
    runs, t, h = 4000, 20, 0.1
    rng = np.random.default_rng(5)
    q = TUNING.acceleration_mps2_per_rthz**2 * h * np.array([[h**2 / 3, h / 2], [h / 2, 1.0]])
    shock = np.linalg.cholesky(q) @ rng.standard_normal((t * 10, 2, runs))
    # The filter's own sum gives h^2 a and h a; the rest of the position's noise moves the truth,
    # hence the fixes and the errors at the epochs, by -rest.
    acceleration = shock[:, 1] / h
    rest = np.cumsum(shock[:, 0] - h * shock[:, 1], axis=0)[9::10]
    start_p, start_v = 0.1 * rng.standard_normal(runs), 0.01 * rng.standard_normal(runs)
    seconds = np.arange(1, t + 1)[:, None]
    speed = 0.12 * rng.standard_normal((t * 10, runs)) - start_v
    moved = -rest + start_p + start_v * seconds
    fix = 0.75 * rng.standard_normal((t, runs)) - moved
    history = filter_history(acceleration, speed, fix, **options())
    # Started at the truth's mean: errors of the start are those of the truth.
    p, v = history.error_m + moved, history.speed_error_mps + start_v
    for seen, column in ((p * p, 0), (v * v, 2)):
        ratio = seen.mean(axis=1) / history.covariance[:, column, 0]
        assert (np.abs(ratio - 1) < 4.5 * math.sqrt(2 / runs)).all()


def test_gate_refuses_what_is_beyond_it() -> None:
    """Normalised innovation squared on both sides of the gate, and an infinite fix."""
    acceleration, speed, fix = zeros(1, 4)
    before = filter_history(acceleration, speed, fix * np.nan, **options())
    sd = math.sqrt(before.covariance[0, 0, 0] + TUNING.position_m**2)
    fix[0] = [sd * math.sqrt(6.62), sd * math.sqrt(6.64), -math.inf, np.nan]
    history = filter_history(acceleration, speed, fix, **options(replace(TUNING, gate=6.63)))
    np.testing.assert_array_equal(history.used, [[True, False, False, False]])
    assert history.error_m[0, 0] == pytest.approx(history.gain[0, 0, 0] * fix[0, 0])
    assert (history.error_m[0, 1:] == 0).all()
    np.testing.assert_array_equal(history.covariance[0, :, 1:], before.covariance[0, :, 1:])


# --- what cannot be filtered ------------------------------------------------------------------


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_refused_errors(value: float) -> None:
    for part in range(2):
        errors = zeros(2, 2)
        errors[part][3, 1] = value
        with pytest.raises(InputError, match="not finite"):
            filtered_errors(*errors, **options())


def test_refused_infinite_fix_and_shapes() -> None:
    acceleration, speed, fix = zeros(2, 2)
    fix[1, 1] = math.inf
    with pytest.raises(InputError, match="infinite fix"):
        filtered_errors(acceleration, speed, fix, **options())
    with pytest.raises(InputError, match="at 20 sub-steps of 2 runs"):
        filtered_errors(acceleration[:-1], speed, fix, **options())
    with pytest.raises(InputError, match="at 10 sub-steps of 2 runs"):
        filtered_errors(acceleration, speed, fix, **options(substeps=5))
