from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.monitoring.normal_equations import (
    GeometryReason,
    RangeReason,
    adjust,
    geometry,
    ranges,
    variance,
)
from tests.monitoring.skies import design_of, random_sky, refit, sky

PAGE = {
    "A": ([0.25] * 4 + [0.0], 1.15470054, 2.23606798),
    "B": ([0.14088324] * 3 + [0.52578342] * 3, 1.06163362, 1.34467726),
    "C": ([0.35457358] * 4 + [0.52723522] * 3, 0.92067014, 1.36305129),
}


@pytest.mark.parametrize("case", PAGE)
def test_redundancies_and_dilutions_of_the_methods_page(case: str) -> None:
    redundancy, hdop, vdop = PAGE[case]
    g = geometry(sky(case))
    assert g.redundancy[:, 0] == pytest.approx(redundancy, abs=5e-9)
    assert np.sqrt(g.covariance[0] + g.covariance[2]) == pytest.approx(hdop, abs=5e-9)
    assert np.sqrt(g.covariance[5]) == pytest.approx(vdop, abs=5e-9)


@given(st.integers(0, 2**32 - 1), st.integers(6, 12), st.integers(1, 3))
def test_a_fix_is_that_of_a_decomposition_with_all_clocks(seed: int, s: int, clocks: int) -> None:
    rng = np.random.default_rng(seed)
    elevation, azimuth, sigma = random_sky(rng, s, 4)
    clock = rng.integers(0, clocks, (s, 4))
    y = rng.normal(size=(s, 4)) * 5
    g = geometry(ranges(elevation, azimuth, sigma, clock=clock))
    a = adjust(g, y)
    for t in range(4):
        rows = design_of(elevation[:, t], azimuth[:, t], clock[:, t])
        if np.linalg.cond(rows / sigma[:, [t]]) > 1e3:
            continue
        if s < rows.shape[1]:
            assert not g.solved[t]
            continue
        x, statistic, covariance = refit(rows, sigma[:, t], y[:, t])
        assert g.solved[t]
        # A range alone in its constellation is dropped with its clock.
        assert g.dof[t] == s - rows.shape[1]
        assert a.step_m[:, t] == pytest.approx(x, rel=1e-9, abs=1e-9)
        assert a.statistic[t] == pytest.approx(statistic, rel=1e-9, abs=1e-9)
        lower = covariance[np.tril_indices(3)]
        assert g.covariance[:, t] == pytest.approx(lower, rel=1e-8, abs=1e-9)
        assert np.nansum(g.redundancy[:, t]) == pytest.approx(g.dof[t], abs=1e-8)


def test_empty_slots_order_and_lone_constellations_change_nothing() -> None:
    rng = np.random.default_rng(5)
    elevation, azimuth, sigma = random_sky(rng, 8, 50)
    y = rng.normal(size=(8, 50))
    plain = geometry(ranges(elevation, azimuth, sigma))
    order = rng.permutation(10)
    padded = [np.concatenate([v, np.full((2, 50), np.nan)])[order] for v in (elevation, azimuth)]
    lone = order == 8
    padded[0][lone], padded[1][lone] = 45.0, 10.0
    spread = np.concatenate([sigma, np.full((2, 50), 1.0)])[order]
    more = np.concatenate([y, np.full((2, 50), 3.0)])[order]
    given_ = ranges(*padded, spread, clock=np.where(lone, 1, 0)[:, None], residual_m=more)
    g = geometry(given_)
    assert (given_.reason[lone] == RangeReason.ALONE).all()
    assert np.array_equal(g.dof, plain.dof)
    assert g.covariance == pytest.approx(plain.covariance, rel=1e-10, abs=1e-12)
    assert adjust(g, more).statistic == pytest.approx(adjust(plain, y).statistic, rel=1e-9)


def test_what_is_no_range_takes_no_part_with_a_reason() -> None:
    rng = np.random.default_rng(1)
    elevation, azimuth, sigma = random_sky(rng, 10, 1)
    y = np.zeros((10, 1))
    elevation[0], azimuth[1], sigma[2], sigma[3], y[4] = np.nan, np.inf, 0.0, np.inf, np.nan
    elevation[5] = 91.0
    used = np.ones((10, 1), bool)
    used[6] = False
    found = ranges(elevation, azimuth, sigma, used=used, residual_m=y)
    assert found.reason[:, 0].tolist() == [
        RangeReason.NO_DIRECTION, RangeReason.NO_DIRECTION, RangeReason.NO_SIGMA,
        RangeReason.NO_SIGMA, RangeReason.NO_RESIDUAL, RangeReason.NO_DIRECTION,
        RangeReason.NOT_GIVEN, 0, 0, 0,
    ]  # fmt: skip
    assert all(RangeReason(code).words for code in found.reason[:7, 0])
    g = geometry(found)
    assert not g.solved[0]
    assert g.reason[0] == GeometryReason.TOO_FEW
    assert np.isnan(g.covariance).all()
    assert np.isnan(adjust(g, y).statistic).all()


def epoch(elevation: list[float], azimuth: list[float]) -> GeometryReason:
    column = [np.array(v, float)[:, None] for v in (elevation, azimuth)]
    g = geometry(ranges(*column, np.ones((len(elevation), 1))))
    assert g.solved[0] == (g.reason[0] in (GeometryReason.SOUND, GeometryReason.NO_REDUNDANCY))
    return GeometryReason(g.reason[0])


def test_epochs_without_a_test_say_why() -> None:
    assert epoch([30, 40, 50], [0, 90, 180]) is GeometryReason.TOO_FEW
    assert epoch([], []) is GeometryReason.TOO_FEW
    assert epoch([30, 40, 50, 60], [0, 90, 180, 270]) is GeometryReason.NO_REDUNDANCY
    cone = [float(az) for az in range(0, 360, 60)]
    assert epoch([40.0] * 6, cone) is GeometryReason.DEGENERATE
    assert epoch([10, 30, 50, 70, 80, 20], [0, 0, 180, 180, 0, 180]) is GeometryReason.DEGENERATE
    assert epoch([30, 40, 50, 60, 60, 20], [0, 90, 180, 270, 270, 45]) is GeometryReason.TWICE
    assert epoch([30, 40, 50, 60, 65, 20], [0, 90, 180, 270, 270, 45]) is GeometryReason.SOUND


def test_variants_of_an_epoch_are_the_epochs_with_those_weights() -> None:
    rng = np.random.default_rng(3)
    elevation, azimuth, sigma = random_sky(rng, 9, 20)
    clock = np.repeat([0, 1], [5, 4])[:, None]
    whole = ranges(elevation, azimuth, sigma, clock=clock)
    keep = np.ones((9, 3), bool)
    keep[2, 1] = False
    keep[:5, 2] = False
    g = geometry(whole, whole.weight[:, None] * keep[:, :, None])
    for k in range(3):
        one = geometry(ranges(elevation, azimuth, sigma, clock=clock, used=keep[:, [k]]))
        assert np.array_equal(g.dof[k], one.dof)
        assert np.array_equal(g.solved[k], one.solved)
        assert g.covariance[:, k] == pytest.approx(one.covariance, rel=1e-12, nan_ok=True)
        assert g.gain[:, :, k] == pytest.approx(one.gain, rel=1e-9, abs=1e-12, nan_ok=True)
    # Without the first constellation four ranges of one clock remain: a fix without spare.
    assert (g.dof[2] == 0).all()


def test_a_variance_along_an_axis_is_that_of_the_rotated_matrix() -> None:
    covariance = np.array([4.0, 1.0, 9.0, 0.5, -0.3, 16.0])[:, None]
    whole = np.array([[4, 1, 0.5], [1, 9, -0.3], [0.5, -0.3, 16]])
    axis = np.array([0.6, 0.8, 0.0])
    assert variance(covariance, axis)[0] == pytest.approx(axis @ whole @ axis, rel=1e-14)


def exact_redundancies(elevation: Any, azimuth: Any, sigma: Any, clock: Any) -> list[float]:
    """1 - w_i g_i' P g_i at 40 digits."""
    with mp.workdps(40):
        design = mp.matrix(design_of(elevation, azimuth, clock).tolist())
        weight = mp.diag([1 / mp.mpf(float(s)) ** 2 for s in sigma])
        hat = design * (design.T * weight * design) ** -1 * design.T * weight
        return [float(1 - hat[i, i]) for i in range(len(sigma))]


def test_small_redundancies_keep_their_digits() -> None:
    # Four ranges far better than the others: 1 - leverage would lose up to nine digits.
    rng = np.random.default_rng(11)
    least = 1.0
    for clocks in (1, 2) * 6:
        elevation, azimuth, sigma = random_sky(rng, 9, 1)
        sigma[:4] *= 0.002
        clock = np.arange(9)[:, None] % clocks
        g = geometry(ranges(elevation, azimuth, sigma, clock=clock))
        exact = exact_redundancies(elevation[:, 0], azimuth[:, 0], sigma[:, 0], clock[:, 0])
        assert g.redundancy[:, 0] == pytest.approx(exact, rel=1e-9, abs=0)
        least = min(least, *exact)
    assert least < 1e-6


def test_ranges_beyond_all_sense_have_no_finite_statistic() -> None:
    elevation, azimuth, sigma = random_sky(np.random.default_rng(2), 8, 2)
    y = np.zeros((8, 2))
    y[3] = 1e200, 1.7e308
    y[4, 1] = -1.7e308
    found = adjust(geometry(ranges(elevation, azimuth, sigma, residual_m=y)), y)
    assert not np.isfinite(found.statistic).any()


def test_a_badly_conditioned_fix_trusts_no_redundancy_that_is_rounding() -> None:
    elevation = np.array([30, 30.001, 30.002, 30.001, 89.9])[:, None]
    azimuth = np.array([0, 0.001, 90, 180, 10.0])[:, None]
    g = geometry(ranges(elevation, azimuth, np.ones((5, 1))))
    assert g.least_redundancy[0] >= 1e-8
    assert (g.redundancy >= 0).all()
    assert (g.redundancy <= 1).all()
