"""Normal equations against numpy's own inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.positioning.normal_equations import (
    PAIRS,
    design,
    enu_of,
    fix_geometry,
    full_matrices,
    inverse,
    normal_sums,
    times,
)


def sky(seed: int, satellites: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Elevations, azimuths and sigmas."""
    rng = np.random.default_rng(seed)
    return (
        rng.uniform(5, 90, satellites), rng.uniform(0, 360, satellites),
        rng.uniform(0.5, 60, satellites),
    )  # fmt: skip


@given(st.integers(0, 10**6), st.integers(4, 14))
def test_covariance_is_the_inverse(seed: int, satellites: int) -> None:
    elevation, azimuth, sigma = sky(seed, satellites)
    e, a = np.radians(elevation), np.radians(azimuth)
    rows = np.column_stack(
        [np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e), np.ones(satellites)]
    )
    normal = rows.T @ np.diag(sigma**-2.0) @ rows
    if np.linalg.cond(normal) > 1e8:
        return
    epoch = np.zeros(satellites, np.int64)
    got = fix_geometry(design(enu_of(elevation, azimuth)), sigma, epoch, 1)
    assert got.solved[0]
    exact = np.linalg.inv(normal)
    whole = full_matrices(got.covariance_m2)[0]
    assert np.abs(whole - exact).max() < 1e-6 * np.abs(exact).max()
    assert (whole == whole.T).all()


def test_sums_are_by_epoch() -> None:
    g = design(enu_of(*sky(3, 9)[:2]))
    weight = np.linspace(1, 2, 9)
    epoch = np.array([0, 0, 0, 2, 2, 2, 2, 3, 3])
    sums = normal_sums(g, weight, epoch, 4)
    for n in range(4):
        rows = epoch == n
        whole = (g[:, rows] * weight[rows]) @ g[:, rows].T
        assert sums[:, n] == pytest.approx([whole[i, j] for i, j in PAIRS], abs=1e-12)


@pytest.mark.parametrize(
    "degenerate",
    [
        "same direction", "same elevation", "three", "nothing",
    ],
)  # fmt: skip
def test_degenerate_geometries_give_none(degenerate: str) -> None:
    elevation, azimuth, sigma = sky(5, 6)
    if degenerate == "same direction":
        elevation[:], azimuth[:] = 40.0, 120.0
    elif degenerate == "same elevation":
        elevation[:] = 40.0  # up and clock cannot be told apart
    elif degenerate == "three":
        sigma[3:] = np.nan
    else:
        sigma[:] = 0.0
    got = fix_geometry(design(enu_of(elevation, azimuth)), sigma, np.zeros(6, np.int64), 1)
    assert not got.solved[0]
    assert np.isnan(got.covariance_m2).all()


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf, 1e-200, 1e200])
def test_a_sigma_that_is_none_never_weighs(bad: float) -> None:
    elevation, azimuth, sigma = sky(7, 8)
    g, epoch = design(enu_of(elevation, azimuth)), np.zeros(8, np.int64)
    without = fix_geometry(g[:, :7], sigma[:7], epoch[:7], 1)
    sigma[7] = bad
    with_it = fix_geometry(g, sigma, epoch, 1)
    assert with_it.weight[7] == 0.0
    assert with_it.covariance_m2 == pytest.approx(without.covariance_m2, rel=1e-12)


def test_a_direction_that_is_none_never_weighs() -> None:
    elevation, azimuth, sigma = sky(7, 8)
    g, epoch = design(enu_of(elevation, azimuth)), np.zeros(8, np.int64)
    without = fix_geometry(g[:, :7], sigma[:7], epoch[:7], 1)
    g[1, 7] = np.nan
    assert fix_geometry(g, sigma, epoch, 1).covariance_m2 == pytest.approx(without.covariance_m2)


def test_condition_is_never_judged_too_mild() -> None:
    """Along a family of ever worse matrices refusal begins before numpy's condition says so."""
    small = 10.0 ** -np.linspace(6, 13, 200)
    diagonal = np.ones((10, small.size))
    for number, (i, j) in enumerate(PAIRS):
        diagonal[number] = 1.0 if i == j else 0.0
    diagonal[9] = small
    _, solved = inverse(diagonal, np.ones(small.size, bool))
    condition = np.array([np.linalg.cond(m) for m in full_matrices(diagonal)])
    assert not solved[condition >= 1e10].any()
    assert solved[condition < 2.4e9].all()


def test_products() -> None:
    rng = np.random.default_rng(2)
    triangle, vector = rng.normal(size=(10, 5)), rng.normal(size=(4, 5))
    exact = np.einsum("nij,jn->in", full_matrices(triangle), vector)
    assert times(triangle, vector) == pytest.approx(exact)
