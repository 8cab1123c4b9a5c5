"""Weighted mean of what is there, and one error for all axes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_array_equal
from numpy.typing import ArrayLike

from sbas.fusion.architecture.model import Thresholds
from sbas.fusion.fused_runs import Floats
from sbas.fusion.simulation.missing_data import UsedErrors
from sbas.fusion.simulation.weighted_fusion import fused_errors, over_axes
from sbas.fusion.states import U, states_of

NAN = np.nan


def _used(error: ArrayLike, zeroed: ArrayLike | None = None) -> UsedErrors:
    errors = np.asarray(error, dtype=float)
    supplied = np.zeros(errors.shape, dtype=bool)
    return UsedErrors(
        errors, errors, supplied, None if zeroed is None else np.asarray(zeroed, bool)
    )


def test_mean_of_the_sensors_that_are_there() -> None:
    sensors = [_used([[[1.0, 1.0, NAN]]]), _used([[[2.0, NAN, NAN]]]), _used([[[4.0, 4.0, NAN]]])]
    fused = fused_errors(sensors, np.array([[0.2, 0.3, 0.5]]))
    # (.2 + .6 + 2)/1; (.2 + 2)/.7
    assert fused[0, 0] == pytest.approx([2.8, 2.2 / 0.7, NAN], nan_ok=True)


def test_weights_by_epoch_and_axis() -> None:
    sensors = [_used(np.full((2, 2, 1), 1.0)), _used(np.full((2, 2, 1), 3.0))]
    weights = np.array([[[1.0, 0.0], [0.5, 0.5]], [[0.25, 0.75], [0.0, 1.0]]])
    assert_array_equal(fused_errors(sensors, weights)[:, :, 0], [[1.0, 2.0], [2.5, 3.0]])


def test_a_sensor_without_weight_is_no_data() -> None:
    sensors = [_used([[[NAN, 5.0]]]), _used([[[7.0, 7.0]]])]
    assert_array_equal(fused_errors(sensors, np.array([[1.0, 0.0]]))[0, 0], [NAN, 5.0])


def test_excluded_sensors_leave_their_weight_to_the_others() -> None:
    sensors = [_used([[[1.0, 1.0]]]), _used([[[9.0, 9.0]]])]
    excluded = np.array([[[[False, True]]], [[[True, True]]]])
    fused = fused_errors(sensors, np.array([[0.5, 0.5]]), excluded=excluded)
    assert_array_equal(fused[0, 0], [1.0, NAN])


def test_only_zeroed_sensors_give_no_position() -> None:
    removed = _used([[[-100.0, -100.0]]], [[[True, True]]])
    fused = fused_errors([removed, _used([[[2.0, NAN]]])], np.array([[0.5, 0.5]]))
    assert_array_equal(fused[0, 0], [-49.0, NAN])


def test_infinite_errors_make_the_mean_infinite_where_they_have_weight() -> None:
    sensors = [_used([[[np.inf, -np.inf, np.inf]]]), _used([[[1.0, 1.0, -np.inf]]])]
    fused = fused_errors(sensors, np.array([[0.5, 0.5]]))
    assert_array_equal(np.abs(fused), np.full((1, 1, 3), np.inf))
    assert_array_equal(fused[0, 0, :2], [np.inf, -np.inf])
    ignored = fused_errors([sensors[0], _used([[[1.0, 1.0, 2.0]]])], np.array([[0.0, 1.0]]))
    assert_array_equal(ignored[0, 0], [1.0, 1.0, 2.0])


ERRORS = st.one_of(
    st.floats(-2.5, 2.5, exclude_min=True, exclude_max=True),
    st.sampled_from([NAN, np.nextafter(2.5, 0), -np.nextafter(2.5, 0)]),
)


@given(
    errors=arrays(float, (4, 2, 3, 5), elements=ERRORS),
    weights=arrays(float, (2, 4), elements=st.floats(0, 1)),
)
def test_mean_of_errors_below_the_alert_limit_never_reaches_it(
    errors: Floats, weights: Floats
) -> None:
    """Convexity: whatever the weights and whoever is missing."""
    fused = fused_errors([_used(error) for error in errors], weights)
    assert not np.any(np.abs(fused) >= 2.5)
    assert not np.any(states_of(fused[0], Thresholds()) == U)


@given(
    errors=arrays(float, (3, 1, 2, 4), elements=st.floats(-50, 50)),
    weights=arrays(float, (1, 3), elements=st.floats(0.01, 1)),
)
def test_mean_equals_numpys_weighted_average(errors: Floats, weights: Floats) -> None:
    fused = fused_errors([_used(error) for error in errors], weights)
    assert fused == pytest.approx(np.average(errors, axis=0, weights=weights[0]), abs=1e-12)


def test_the_norm_may_exceed_the_limit_where_no_axis_does() -> None:
    # Page, section 7: weight 1 on acc in y and on GPS in z, norm 3.39.
    acc, gnss = np.array([0.0, 2.4, 0.0]), np.array([0.0, 0.0, 2.4])
    sensors = [_used(acc.reshape(3, 1, 1)), _used(gnss.reshape(3, 1, 1))]
    weights = np.array([[0.5, 0.5], [1.0, 0.0], [0.0, 1.0]])
    fused = fused_errors(sensors, weights)
    assert over_axes(fused, "norm", every_axis=True) == pytest.approx(3.39, abs=0.005)
    assert over_axes(fused, "worst_axis", every_axis=True) == pytest.approx(2.4)


def test_one_error_over_three_axes() -> None:
    error = np.array([[[1.0, NAN, NAN]], [[-3.0, 2.0, NAN]], [[2.0, -1.0, NAN]]])
    worst = over_axes(error, "worst_axis", every_axis=False)
    assert_array_equal(worst, [[-3.0, 2.0, NAN]])
    assert_array_equal(over_axes(error, "worst_axis", every_axis=True), [[-3.0, NAN, NAN]])
    norm = over_axes(error, "norm", every_axis=False)
    assert norm[0] == pytest.approx([14**0.5, 5**0.5, NAN], nan_ok=True)
    assert over_axes(error, "norm", every_axis=True)[0] == pytest.approx(
        [14**0.5, NAN, NAN], nan_ok=True
    )
    assert_array_equal(over_axes(error[1:2], "norm", every_axis=True), [[3.0, 2.0, NAN]])
    assert_array_equal(over_axes(error[1:2], "worst_axis", every_axis=True), error[1])
