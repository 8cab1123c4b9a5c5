"""Weighted least squares against published protection levels and a plain matrix inverse."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.laboratory.geometry import centred, external_reliability_m, position_covariance
from sbas.recording import major_semi_axis_m

# (elevation, azimuth, sigma) of a real receiver and the levels published with them: SBAS PRN 120,
# 2017-02-19, K_H 6.0, K_V 5.33, recomputed by a second implementation.
PUBLISHED = {
    (17.6549, 20.2920): [
        (19.0651, 176.31, 1.958562), (42.6512, 148.8728, 1.430721), (77.5947, 62.7627, 1.24434),
        (63.7754, 218.5625, 1.281244), (31.3713, 292.354, 1.606398),
    ],
    (7.4850, 12.3840): [
        (5.0562, 335.6853, 2.748428), (23.7356, 175.5345, 1.799016),
        (62.5324, 278.6834, 1.299358), (46.8385, 145.1215, 1.391119),
        (32.845, 56.6363, 1.689508), (73.1207, 60.0882, 1.288052),
        (59.8705, 211.0886, 1.306134), (35.5422, 294.7292, 1.529274),
        (20.548, 100.8735, 2.150393),
    ],
    (7.5733, 14.3297): [
        (6.3949, 332.1993, 2.682291), (28.2861, 174.7634, 1.675249),
        (63.8174, 268.2769, 1.312994), (50.6037, 140.7646, 1.382604),
        (29.9138, 53.214, 1.763046), (68.8676, 59.6108, 1.304467),
        (55.7081, 205.8538, 1.330621), (39.6128, 296.877, 1.537565),
    ],
}  # fmt: skip


def directions(elevation_deg, azimuth_deg):
    el, az = np.radians(elevation_deg), np.radians(azimuth_deg)
    return np.stack([np.cos(el) * np.sin(az), np.cos(el) * np.cos(az), np.sin(el)])


def random_sky(seed, satellites, epochs=40):
    generator = np.random.default_rng(seed)
    elevation = np.degrees(np.arcsin(generator.uniform(0.1, 1, (satellites, epochs))))
    azimuth = generator.uniform(0, 360, (satellites, epochs))
    return directions(elevation, azimuth), 1 / generator.uniform(1, 4, (satellites, epochs)) ** 2


def design(line_of_sight, epoch):
    rows = line_of_sight[:, :, epoch].T
    return np.column_stack([rows, np.ones(len(rows))])


@pytest.mark.parametrize(("levels", "sky"), PUBLISHED.items())
def test_published_protection_levels(levels, sky):
    elevation, azimuth, sigma = np.array(sky).T[:, :, None]
    line_of_sight, weight = directions(elevation, azimuth), sigma**-2
    cov = position_covariance(centred(line_of_sight, weight), weight)
    d_major = major_semi_axis_m(np.sqrt(cov.ee), np.sqrt(cov.nn), cov.en)
    assert (6.0 * d_major[0], 5.33 * np.sqrt(cov.uu[0])) == pytest.approx(levels, abs=1e-4)


@pytest.mark.parametrize("satellites", [4, 5, 9, 14])
def test_covariance_is_the_position_block_of_the_full_inverse(satellites):
    line_of_sight, weight = random_sky(satellites, satellites)
    cov = position_covariance(centred(line_of_sight, weight), weight)
    for t in range(weight.shape[1]):
        g = design(line_of_sight, t)
        full = np.linalg.inv(g.T @ np.diag(weight[:, t]) @ g)
        got = [cov.ee[t], cov.nn[t], cov.uu[t], cov.en[t], cov.eu[t], cov.nu[t]]
        index = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
        assert got == pytest.approx(full[index], rel=1e-6, abs=1e-9 * np.trace(full))


def test_a_satellite_of_weight_zero_is_not_there():
    line_of_sight, weight = random_sky(1, 8)
    with_unused = weight.copy()
    with_unused[[2, 6]] = 0
    keep = [0, 1, 3, 4, 5, 7]
    a = position_covariance(centred(line_of_sight, with_unused), with_unused)
    b = position_covariance(centred(line_of_sight[:, keep], weight[keep]), weight[keep])
    assert a.ee == pytest.approx(b.ee)
    assert a.nu == pytest.approx(b.nu)


def test_three_satellites_or_one_plane_have_no_solution():
    line_of_sight, weight = random_sky(2, 6)
    weight[3:] = 0
    assert np.isnan(position_covariance(centred(line_of_sight, weight), weight).ee).all()
    circle = directions(np.full((6, 1), 30.0), np.arange(0, 360, 60.0)[:, None])
    ones = np.ones((6, 1))
    assert np.isnan(position_covariance(centred(circle, ones), ones).ee).all()
    nothing = np.zeros((6, 1))
    assert np.isnan(position_covariance(centred(circle, nothing), nothing).uu).all()


def test_external_reliability_is_the_shift_by_the_smallest_detectable_error():
    line_of_sight, weight = random_sky(5, 8, epochs=10)
    rows = centred(line_of_sight, weight)
    herl, verl = external_reliability_m(
        rows, weight, position_covariance(rows, weight), noncentrality=7.0
    )
    for t in range(10):
        g, w = design(line_of_sight, t), np.diag(weight[:, t])
        estimate = np.linalg.inv(g.T @ w @ g) @ g.T @ w
        residual = np.eye(8) - g @ estimate
        shifts = []
        for i in range(8):
            biased = np.zeros(8)
            biased[i] = 7.0 / np.sqrt(weight[i, t] * residual[i, i])
            shifts.append(estimate @ biased)
        east, north, up, _ = np.abs(shifts).T
        assert herl[t] == pytest.approx(np.hypot(east, north).max(), rel=1e-6)
        assert verl[t] == pytest.approx(up.max(), rel=1e-6)


def test_raim_needs_five_satellites():
    for satellites, available in ((4, False), (5, True)):
        line_of_sight, weight = random_sky(9, satellites)
        rows = centred(line_of_sight, weight)
        cov = position_covariance(rows, weight)
        herl, verl = external_reliability_m(rows, weight, cov, noncentrality=7.0)
        assert np.isnan(herl).all() == np.isnan(verl).all() == (not available)
