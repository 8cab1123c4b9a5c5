"""Protection levels against published values and closed forms (page section 15, check values 3
and 4, and its property tests)."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.positioning.normal_equations import design, enu_of, fix_geometry, full_matrices
from sbas.positioning.protection_levels import (
    K_H_NPA,
    K_H_PA,
    K_V,
    horizontal_level_m,
    k_along,
    level_along_m,
    vertical_level_m,
)

BUTE = (
    # EGNOS PRN 120 at the Budapest University of Technology, 2017-02-19: elevation, azimuth and
    # sigma of each satellite with HPL and VPL, as rtklib_ws quotes them.
    (
        [(19.0651, 176.31, 1.958562), (42.6512, 148.8728, 1.430721), (77.5947, 62.7627, 1.24434),
         (63.7754, 218.5625, 1.281244), (31.3713, 292.354, 1.606398)],
        17.6549, 20.2920,
    ),
    (
        [(5.0562, 335.6853, 2.748428), (23.7356, 175.5345, 1.799016),
         (62.5324, 278.6834, 1.299358), (46.8385, 145.1215, 1.391119),
         (32.845, 56.6363, 1.689508), (73.1207, 60.0882, 1.288052),
         (59.8705, 211.0886, 1.306134), (35.5422, 294.7292, 1.529274),
         (20.548, 100.8735, 2.150393)],
        7.4850, 12.3840,
    ),
    (
        [(6.3949, 332.1993, 2.682291), (28.2861, 174.7634, 1.675249),
         (63.8174, 268.2769, 1.312994), (50.6037, 140.7646, 1.382604),
         (29.9138, 53.214, 1.763046), (68.8676, 59.6108, 1.304467),
         (55.7081, 205.8538, 1.330621), (39.6128, 296.877, 1.537565)],
        7.5733, 14.3297,
    ),
)  # fmt: skip

Sky = tuple[np.ndarray, np.ndarray, np.ndarray]


def covariance(elevation: np.ndarray, azimuth: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """(1, 4, 4)"""
    g = design(enu_of(np.asarray(elevation, float), np.asarray(azimuth, float)))
    geometry = fix_geometry(g, np.asarray(sigma, float), np.zeros(len(sigma), np.int64), 1)
    return full_matrices(geometry.covariance_m2)


@st.composite
def skies(draw: st.DrawFn) -> Sky:
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    m = draw(st.integers(5, 12))
    # Four that span the sky keep the geometry regular.
    elevation = np.concatenate([[80.0, 15.0, 20.0, 25.0], rng.uniform(5, 90, m - 4)])
    azimuth = np.concatenate([[10.0, 30.0, 150.0, 270.0], rng.uniform(0, 360, m - 4)])
    return elevation, azimuth, rng.uniform(0.5, 30, m)


@pytest.mark.parametrize(("satellites", "hpl_m", "vpl_m"), BUTE)
def test_published_levels(
    satellites: list[tuple[float, float, float]], hpl_m: float, vpl_m: float
) -> None:
    d = covariance(*(np.array(column) for column in zip(*satellites, strict=True)))
    assert horizontal_level_m(d, 6.0)[0] == pytest.approx(hpl_m, abs=6e-5)
    assert vertical_level_m(d, 5.33)[0] == pytest.approx(vpl_m, abs=6e-5)


def test_published_factors() -> None:
    with mpmath.workdps(30):
        rayleigh = mpmath.sqrt(-2 * mpmath.log(mpmath.mpf("5e-9")))
        lateral, vertical = (
            mpmath.sqrt(2) * mpmath.erfinv(1 - 2 * mpmath.mpf(p)) for p in ("1e-9", "5e-8")
        )
    assert pytest.approx(float(rayleigh), abs=0.005) == K_H_NPA
    assert pytest.approx(float(lateral), abs=0.005) == K_H_PA
    assert pytest.approx(float(vertical), abs=0.005) == K_V


def test_the_factor_along_a_line() -> None:
    assert k_along(6.0, "pa") == 6.0
    for k in (3.0, 6.18):
        with mpmath.workdps(40):
            risk = mpmath.exp(-(mpmath.mpf(k) ** 2) / 2)
            two_sided = mpmath.erfc(mpmath.mpf(k_along(k, "npa")) / mpmath.sqrt(2))
        assert float(two_sided) == pytest.approx(float(risk), rel=1e-10)


@given(skies())
def test_hpl_is_the_largest_level_of_any_direction(sky: Sky) -> None:
    d = covariance(*sky)
    levels = [level_along_m(d, azimuth, 6.0)[0] for azimuth in np.linspace(0, 180, 721)]
    hpl = horizontal_level_m(d, 6.0)[0]
    assert max(levels) <= hpl * (1 + 1e-12)
    assert max(levels) == pytest.approx(hpl, rel=2e-5)
    assert level_along_m(d, 0.0, 6.0)[0] == pytest.approx(6.0 * np.sqrt(d[0, 1, 1]))
    assert level_along_m(d, 90.0, 6.0)[0] == pytest.approx(6.0 * np.sqrt(d[0, 0, 0]))
    values = np.linalg.eigvalsh(d[0, :2, :2])
    assert hpl == pytest.approx(6.0 * np.sqrt(values[-1]), rel=1e-9)


@given(skies(), st.floats(-360, 360))
def test_turning_the_sky_changes_no_level(sky: Sky, turn: float) -> None:
    elevation, azimuth, sigma = sky
    before, after = covariance(*sky), covariance(elevation, azimuth + turn, sigma)
    assert horizontal_level_m(after, 6.0)[0] == pytest.approx(horizontal_level_m(before, 6.0)[0])
    assert vertical_level_m(after, 5.33)[0] == pytest.approx(vertical_level_m(before, 5.33)[0])


@given(skies(), st.floats(0.01, 100))
def test_levels_grow_with_the_sigmas(sky: Sky, factor: float) -> None:
    elevation, azimuth, sigma = sky
    before, after = covariance(*sky), covariance(elevation, azimuth, factor * sigma)
    for level in (horizontal_level_m, vertical_level_m):
        assert level(after, 6.0)[0] == pytest.approx(factor * level(before, 6.0)[0], rel=1e-7)


@given(skies(), st.integers(0, 11))
def test_a_further_satellite_never_raises_a_level(sky: Sky, out: int) -> None:
    keep = np.arange(sky[0].size) != 4 + out % (sky[0].size - 4)
    fewer = covariance(*(column[keep] for column in sky))
    for level in (horizontal_level_m, vertical_level_m):
        assert level(covariance(*sky), 6.0)[0] <= level(fewer, 6.0)[0] * (1 + 1e-9)
