from __future__ import annotations

import numpy as np
import pytest

from sbas.monitoring.leave_one_out import correlation, leave_one_out
from sbas.monitoring.normal_equations import adjust, geometry, ranges
from tests.monitoring.skies import design_of, random_sky, refit, sky


@pytest.mark.parametrize("clocks", [1, 2])
def test_rank_one_updates_equal_refitting(clocks: int) -> None:
    rng = np.random.default_rng(clocks)
    s, n = 9, 40
    elevation, azimuth, sigma = random_sky(rng, s, n)
    clock = np.arange(s) % clocks
    y = rng.normal(size=(s, n)) * 4
    g = geometry(ranges(elevation, azimuth, sigma, clock=clock[:, None]))
    found = leave_one_out(g, adjust(g, y))
    checked = 0
    for t in range(n):
        for i in range(s):
            keep = np.arange(s) != i
            rows = design_of(elevation[keep, t], azimuth[keep, t], clock[keep])
            if np.linalg.cond(rows / sigma[keep, t][:, None]) > 100:
                continue
            x, statistic, covariance = refit(rows, sigma[keep, t], y[keep, t])
            assert found.step_m[:, i, t] == pytest.approx(x, rel=1e-9, abs=1e-9)
            assert found.statistic[i, t] == pytest.approx(statistic, rel=1e-9, abs=1e-9)
            lower = covariance[np.tril_indices(3)]
            assert found.covariance[:, i, t] == pytest.approx(lower, rel=1e-9, abs=1e-9)
            checked += 1
    assert checked > 300


def test_correlations_are_those_of_the_residual_projector() -> None:
    rng = np.random.default_rng(8)
    elevation, azimuth, sigma = random_sky(rng, 8, 5)
    clock = np.arange(8) % 2
    g = geometry(ranges(elevation, azimuth, sigma, clock=clock[:, None]))
    index = np.array([0, 3, 7, 2, 5])
    rho = correlation(g, index)
    for t in range(5):
        rows = design_of(elevation[:, t], azimuth[:, t], clock) / sigma[:, [t]]
        # Of residuals in units of sigma the covariance is this projector.
        projector = np.eye(8) - rows @ np.linalg.pinv(rows)
        size = np.sqrt(np.diag(projector))
        expected = projector[index[t]] / size / size[index[t]]
        assert rho[:, t] == pytest.approx(expected, abs=1e-9)


def test_two_ranges_of_case_b_cannot_be_told_apart() -> None:
    rho = correlation(geometry(sky("B")), np.array([0]))
    assert abs(rho[4, 0]) == pytest.approx(1, abs=1e-12)


def test_a_range_without_redundancy_has_no_reduced_fix() -> None:
    g = geometry(sky("A"))
    found = leave_one_out(g, adjust(g, np.arange(5.0)[:, None]))
    assert np.isnan(found.statistic[4]).all()
    assert np.isfinite(found.statistic[:4]).all()
