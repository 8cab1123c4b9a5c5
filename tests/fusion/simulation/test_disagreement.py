"""Sensors against each other: normalised differences and correlations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from sbas.exceptions import ModelError
from sbas.fusion.architecture.model import Accelerometer, Architecture, Missing, Odometer
from sbas.fusion.architecture.model import SatelliteReceiver as Receiver
from sbas.fusion.fused_runs import Floats
from sbas.fusion.simulation.disagreement import (
    Correlation,
    Signal,
    correlation_test,
    leave_one_out_test,
)
from sbas.fusion.simulation.missing_data import (
    UsedErrors,
    epoch_positions_m,
    used_errors,
)
from sbas.fusion.simulation.sensor_errors import draw_sensors

NAN = np.nan


def _sensors(errors: list[list[float]] | Floats) -> list[UsedErrors]:
    """One epoch on one axis; a row a sensor, a column a run."""
    rows = [np.asarray(row, dtype=float).reshape(1, 1, -1) for row in errors]
    return [UsedErrors(row, row, np.zeros(row.shape, dtype=bool)) for row in rows]


def _excluded(
    errors: list[list[float]], variances: list[float]
) -> tuple[list[list[bool]], list[bool]]:
    verdict = leave_one_out_test(_sensors(errors), np.array([variances]))
    return verdict.excluded[:, 0, 0].tolist(), verdict.usable[0, 0].tolist()


def test_limit_is_the_two_sided_normal_quantile_of_one_in_a_thousand() -> None:
    # Three alike of variance 1: t_1 = e/sqrt(1 + 1/2), so the limit is at e = 3.2905 sqrt(1.5).
    limit = stats.norm.isf(5e-4) * np.sqrt(1.5)
    assert limit == pytest.approx(3.291 * np.sqrt(1.5), abs=1e-3)  # page, section 5
    excluded, usable = _excluded([[limit - 1e-9, limit + 1e-9], [0, 0], [0, 0]], [1, 1, 1])
    assert excluded == [[False, True], [False, False], [False, False]]
    assert usable == [True, True]


def test_two_that_contradict_each_other_stay_and_the_position_is_unusable() -> None:
    limit = stats.norm.isf(5e-4) * np.sqrt(1.0 + 4.0)
    excluded, usable = _excluded([[limit - 1e-9, limit + 1e-9], [0, 0]], [1, 4])
    assert excluded == [[False, False], [False, False]]
    assert usable == [True, False]


def test_the_worst_goes_first_and_the_rest_is_tested_again() -> None:
    # Alike: 100 goes first; then 20 against mean 0; the other two agree.
    excluded, usable = _excluded([[0.1], [20.0], [-0.1], [100.0]], [1, 1, 1, 1])
    assert excluded == [[False], [True], [False], [True]]
    assert usable == [True]
    # Of four that all contradict each other two are left, which do not agree either.
    _, usable = _excluded([[0.0], [100.0], [50.0], [-40.0]], [1, 1, 1, 1])
    assert usable == [False]


def test_sensors_without_data_are_not_compared() -> None:
    excluded, usable = _excluded([[50.0, 50.0], [NAN, 0.0], [NAN, NAN]], [1, 1, 1])
    assert excluded == [[False, False], [False, False], [False, False]]
    assert usable == [True, False]  # one alone; two apart
    _, none = _excluded([[NAN], [NAN], [NAN]], [1, 1, 1])
    assert none == [True]


def test_infinite_errors_are_dropped() -> None:
    excluded, usable = _excluded([[np.inf], [0.1], [0.2]], [4, 1, 1])
    assert excluded == [[True], [False], [False]]
    assert usable == [True]


def test_t_equals_its_definition_at_each_epoch_and_axis() -> None:
    """Against the formula written out, cell by cell, on the first pass."""
    rng = np.random.default_rng(3)
    errors = 4.0 * rng.standard_normal((3, 2, 4, 50))
    errors[rng.random(errors.shape) < 0.1] = NAN
    variances = rng.uniform(0.5, 4.0, (2, 4, 3))
    variances[1, :, 0] = np.inf
    errors[0, 1] = NAN
    sensors = [UsedErrors(e, e, np.zeros(e.shape, bool)) for e in errors]
    verdict = leave_one_out_test(sensors, variances)
    for axis, epoch, run in np.ndindex(2, 4, 50):
        there = [i for i in range(3) if not np.isnan(errors[i, axis, epoch, run])]
        gone = []
        agree = True
        while len(there) > 1:
            t = []
            for i in there:
                rest = [j for j in there if j != i]
                w = 1 / variances[axis, epoch, rest]
                mean = np.sum(w * errors[rest, axis, epoch, run]) / w.sum()
                difference = errors[i, axis, epoch, run] - mean
                t.append(abs(difference) / np.sqrt(variances[axis, epoch, i] + 1 / w.sum()))
            if max(t) <= stats.norm.isf(5e-4):
                break
            if len(there) == 2:
                agree = False
                break
            gone.append(there.pop(int(np.argmax(t))))
        cell = (axis, epoch, run)
        assert np.nonzero(verdict.excluded[:, *cell])[0].tolist() == sorted(gone)
        assert bool(verdict.usable[cell]) == agree


def test_healthy_sensors_fail_as_often_as_the_level_says() -> None:
    rng = np.random.default_rng(5)
    sd = np.array([0.5, 1.0, 2.0])
    errors = sd[:, np.newaxis] * rng.standard_normal((3, 200_000))
    verdict = leave_one_out_test(_sensors(errors), np.array([sd**2]))
    failed = verdict.excluded.any(axis=0).mean() + (~verdict.usable).mean()
    # Three tests, at most 3e-3 together, at least that of one; 200000 cells: 4 sd = 5e-4.
    assert 1e-3 - 3e-4 < failed < 3e-3 + 5e-4


# --- correlation ------------------------------------------------------------------------------


def _track(values: Floats) -> list[UsedErrors]:
    """(n, t, r) errors on one axis."""
    return [UsedErrors(v[None], v[None], np.zeros(v[None].shape, dtype=bool)) for v in values]


@pytest.mark.parametrize("mixed", [False, True])
def test_correlations_equal_numpys(mixed: bool) -> None:
    rng = np.random.default_rng(1)
    errors = rng.standard_normal((3, 30, 20))
    options = Correlation("positions", 8.0, mixed)
    verdict = correlation_test(_track(errors), np.zeros(30), step_s=1.0, options=options)
    seen = 0
    for run in range(20):
        for end in range(8, 31):
            r = np.atleast_2d(np.corrcoef(errors[:, end - 8 : end, run]))
            off = [np.delete(r[i], i) for i in range(3)]
            up = [bool(np.all((x > 0) & (x < 0.5))) for x in off]
            down = [bool(np.all((x < 0) & (x > -0.5))) for x in off]
            weak = [bool(np.all(np.abs(x) < 0.5)) for x in off]
            flags = weak if mixed else [a or b for a, b in zip(up, down, strict=True)]
            usable = not all(flags)
            seen += any(flags) and usable
            assert verdict.usable[0, end - 1, run] == usable
            assert verdict.excluded[:, 0, end - 1, run].tolist() == [f and usable for f in flags]
    assert seen > 20
    assert not verdict.excluded[:, :, :7].any()
    assert verdict.usable[:, :7].all()


def test_silent_sensors_and_flat_signals_are_passed_over() -> None:
    rng = np.random.default_rng(2)
    common = np.cumsum(rng.standard_normal((12, 4)), axis=0)
    errors = np.stack([common, common + 0.01 * rng.standard_normal((12, 4)), common, common])
    errors[2] = 0.0  # never moves: no correlation
    errors[3, 5:] = NAN
    verdict = correlation_test(_track(errors), np.zeros(12), step_s=1.0)
    assert not verdict.excluded.any()
    assert verdict.usable.all()
    short = correlation_test(_track(errors[:, :9]), np.zeros(9), step_s=1.0)
    assert not short.excluded.any()
    assert short.usable.all()


def test_a_window_of_two_epochs_is_refused() -> None:
    with pytest.raises(ModelError, match="window of 3 s or more"):
        correlation_test(
            _track(np.zeros((2, 5, 1))), np.zeros(5), step_s=1.0, options=Correlation(window_s=2.0)
        )


@pytest.mark.parametrize(
    ("signal", "nominal", "unacceptable"),
    [
        ("positions", (0.0, 0.0), (0.0, 0.0)),
        ("increments", (0.19, 0.30), (0.12, 0.38)),
        ("residuals", (0.002, 0.013), (0.0006, 0.028)),
    ],
)
def test_flag_rates_of_the_page(
    signal: Signal, nominal: tuple[float, float], unacceptable: tuple[float, float]
) -> None:
    """Page, section 5: |r| < 0.5, 10 s, range over the sensors; there 10000 runs, here 1500."""
    receiver = Receiver("gnss", missing=Missing("extrapolate", "odo"))
    architecture = Architecture("arch1", (Odometer("odo"), Accelerometer("acc"), receiver))
    drawn = draw_sensors(architecture, 1500, np.random.SeedSequence(1))
    x = epoch_positions_m(architecture)
    sensors = list(used_errors(drawn, {"gnss": receiver.missing}, x).values())
    options = Correlation(signal, 10.0, mixed_signs=True)
    verdict = correlation_test(sensors, x, step_s=1.0, options=options)
    flagged = verdict.excluded | ~verdict.usable
    for state, expected in (("N", nominal), ("U", unacceptable)):
        rates = []
        for sensor, flags in zip(sensors, flagged, strict=True):
            size = np.abs(sensor.error_m)
            rates.append(flags[size < 1.0 if state == "N" else size >= 2.5].mean())
        low, high = expected
        assert min(rates) == pytest.approx(low, abs=0.2 * low + 0.001), state
        assert max(rates) == pytest.approx(high, abs=0.2 * high + 0.001), state


def test_a_held_position_has_no_correlation() -> None:
    rng = np.random.default_rng(4)
    t, runs = np.arange(40.0), 30
    truth = 5.0 * t
    moving = rng.normal(size=(2, t.size, runs)).cumsum(axis=1)
    # Held from the tenth epoch on its position is one number: what varies of it is rounding.
    held = np.where(t < 10, 0.0, 45.1 - truth)[:, None] + np.zeros((t.size, runs))
    together = correlation_test(_track(np.stack([*moving, held])), truth, step_s=1.0)
    alone = correlation_test(_track(moving), truth, step_s=1.0)
    late = slice(20, None)
    assert not together.excluded[2, :, late].any()
    assert (together.excluded[:2, :, late] == alone.excluded[:, :, late]).all()
