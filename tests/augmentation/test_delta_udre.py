"""The factor on the UDRE by clock-ephemeris covariance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.augmentation.delta_udre import covariance_factor
from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from tests.augmentation import encoding as enc

A, B = (3, 5, 9), (1, 3, 7)


def message(position: int, e11: int, iodp: int = 0) -> bytes:
    return enc.covariances(iodp, (position, 5, [e11, 0, 0, 0], [0] * 6))


def timeline(messages: dict[int, bytes]) -> CorrectionTimeline:
    return correction_timeline(enc.hourly({0: enc.mask(0, A), **messages}, 600))


def test_the_factor_of_a_covariance_off_the_air() -> None:
    """MSAS 2025, position 22: I = (0.6, 0, 0.8, 1) gives the root of 20.176875."""
    frame = bytes.fromhex("C673590502A1504007FF80605FF60780000000000000000000000000143275C0")
    found = correction_timeline(enc.heard((0, frame))).decoded.covariances
    line = np.array([[0.6, 0.0, 0.8]] * 3)
    row = np.array([0, 0, -1])
    factor = covariance_factor(found, row, line, np.array([0.0, 2.0, 2.0]))
    np.testing.assert_allclose(factor, [4.491867, 4.491867 + 2 * 0.125, 1.0], atol=5e-7)


@given(
    st.integers(0, 7), st.lists(st.integers(0, 511), min_size=4, max_size=4),
    st.lists(st.integers(-512, 511), min_size=6, max_size=6),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3),
)  # fmt: skip
def test_the_factor_is_the_root_of_the_quadratic_form(
    exponent: int, diagonal: list[int], beside: list[int], sight: list[float]
) -> None:
    frame = enc.covariances(0, (1, exponent, diagonal, beside))
    found = correction_timeline(enc.heard((0, frame))).decoded.covariances
    e12, e13, e14, e23, e24, e34 = beside
    rows = [[diagonal[0], e12, e13, e14], [0, diagonal[1], e23, e24]]
    rows += [[0, 0, diagonal[2], e34], [0, 0, 0, diagonal[3]]]
    upper = np.array(rows) * 2.0 ** (exponent - 5)
    i = np.array([*sight, 1.0])
    want = np.sqrt(i @ upper.T @ upper @ i)
    factor = covariance_factor(found, np.array([0]), np.array([sight]), np.zeros(1))
    np.testing.assert_allclose(factor, [want], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("mode", "limit"), [("pa", 240), ("npa", 360)])
def test_a_covariance_times_out_at_its_exact_second(mode: Mode, limit: int) -> None:
    line = timeline({10: message(1, 5)})
    instants = line.reception.instants(enc.epochs_ns(10, 11, 10.12 + limit, 10.13 + limit))
    found = line.covariance(3, instants, mode=mode)
    assert found.row.tolist() == [-1, 0, 0, 0]
    assert found.expired.tolist() == [True, False, False, True]
    assert found.expired_pa.tolist() == [False, False, mode == "npa", True]


def test_the_covariance_of_the_old_mask_serves_until_that_of_the_new_comes() -> None:
    line = timeline({10: message(1, 5), 20: enc.mask(1, B), 30: message(2, 9, iodp=1)})
    instants = line.reception.instants(enc.epochs_ns(19, 21, 31))
    assert line.covariance(3, instants, mode="pa").row.tolist() == [0, 0, 1]
    assert line.covariance(1, instants, mode="pa").row.tolist() == [-1, -1, -1]


def test_without_type_28_there_is_no_covariance() -> None:
    line = timeline({})
    found = line.covariance(3, line.reception.instants(enc.epochs_ns(5)), mode="pa")
    assert found.row.tolist() == [-1]
    assert found.expired.tolist() == [True]
