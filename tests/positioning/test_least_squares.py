"""Steps against numpy.linalg.lstsq, epoch by epoch."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.positioning.least_squares import dilution, step
from sbas.positioning.normal_equations import design, enu_of


def test_steps_are_those_of_lstsq() -> None:
    rng = np.random.default_rng(11)
    epochs = 40
    count = rng.integers(2, 13, epochs)
    epoch = np.repeat(np.arange(epochs), count)
    k = epoch.size
    g = design(enu_of(rng.uniform(5, 90, k), rng.uniform(0, 360, k)))
    sigma, prefit = rng.uniform(0.5, 20, k), rng.normal(0, 30, k)
    sigma[rng.random(k) < 0.1] = np.nan
    prefit[rng.random(k) < 0.05] = np.nan
    got = step(g, sigma, prefit, epoch, epochs)
    for n in range(epochs):
        rows = np.flatnonzero((epoch == n) & np.isfinite(sigma) & np.isfinite(prefit))
        if rows.size < 4:
            assert np.isnan(got.enu_m[n]).all()
            assert np.isnan(got.clock_m[n])
            continue
        w = 1 / sigma[rows]
        a = g[:, rows].T * w[:, None]
        if np.linalg.cond(a) > 1e4:
            continue
        x = np.linalg.lstsq(a, prefit[rows] * w, rcond=None)[0]
        # A range longer than modelled means a receiver farther away.
        assert [*-got.enu_m[n], got.clock_m[n]] == pytest.approx(x, rel=1e-7, abs=1e-7)
        every = np.flatnonzero((epoch == n) & np.isfinite(prefit))
        left = prefit[every] - g[:, every].T @ x
        assert got.residual_m[every] == pytest.approx(left, rel=1e-6, abs=1e-6)


def test_a_known_displacement_is_found() -> None:
    rng = np.random.default_rng(4)
    g = design(enu_of(rng.uniform(5, 90, 9), rng.uniform(0, 360, 9)))
    enu, clock = np.array([3.0, -2.0, 5.0]), 77.0
    # Moving towards a satellite shortens its range.
    prefit = -(g[:3].T @ enu) + clock
    got = step(g, rng.uniform(1, 5, 9), prefit, np.zeros(9, np.int64), 1)
    assert got.enu_m[0] == pytest.approx(enu, abs=1e-9)
    assert got.clock_m[0] == pytest.approx(clock, abs=1e-9)
    assert np.abs(got.residual_m).max() < 1e-9


def test_dilution_has_weights_of_one() -> None:
    rng = np.random.default_rng(5)
    g = design(enu_of(rng.uniform(5, 90, 9), rng.uniform(0, 360, 9)))
    used = np.array([True] * 6 + [False] * 3)
    got = dilution(g, used, np.zeros(9, np.int64), 1, np.ones(1, bool))
    assert got[0] == pytest.approx(np.linalg.inv(g[:, :6] @ g[:, :6].T), rel=1e-9)
    none = dilution(g, used, np.zeros(9, np.int64), 1, np.zeros(1, bool))
    assert np.isnan(none).all()
