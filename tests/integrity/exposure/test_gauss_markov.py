"""Continuous Gauss-Markov hazards against high precision and published limits."""

from __future__ import annotations

import math

import mpmath as mp
import pytest

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure, per_sample_risk
from sbas.integrity.exposure.gauss_markov import (
    SIEGMUND,
    continuous_hazard,
    continuous_risk,
    kummer_root,
    lag_one_tau_s,
    mixture_short_tau_s,
    siegmund_risk,
)

NPA_K = 6.182852


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("k", [0.001, 0.1, 0.7, 1.2, 1.9, 3, 4.5, 6.18, 9, 12])
def test_kummer_root_against_fifty_digits(k: float, dim: int) -> None:
    nu = kummer_root(k, dim=dim)
    with mp.workdps(50):

        def kummer(x: object) -> object:
            return mp.hyp1f1(-x / 2, mp.mpf(dim) / 2, mp.mpf(k) ** 2 / 2, zeroprec=400)

        exact = mp.findroot(kummer, (nu * 1.001, nu * 0.9987), solver="secant", tol=1e-60)
    assert nu == pytest.approx(float(exact), rel=1e-14)


def test_kummer_root_is_the_smallest() -> None:
    # M(0) = 1 > 0: no sign change between 0 and the root.
    for dim in (1, 2, 3):
        for k in (0.01, 0.5, 1, 2, 4):
            nu = kummer_root(k, dim=dim)
            steps = [nu * i / 40 for i in range(40)]
            assert all(mp.hyp1f1(-x / 2, dim / 2, k * k / 2) > 0 for x in steps)


@pytest.mark.parametrize(
    ("k", "dim", "nu"),
    [
        # Roots that are known: M(-1, d/2, z) = 1 - 2z/d vanishes at K = sqrt(d), with nu = 2.
        (1, 1, 2.0),
        (math.sqrt(2), 2, 2.0),
        (math.sqrt(3), 3, 2.0),
        # Check values of the methods page, section 9 (computed there).
        (5.33, 1, 2.772024e-6),
        (6, 1, 7.075264e-8),
        (3, 2, 8.197302e-2),
        (4, 2, 4.593190e-3),
        (6.18, 2, 1.835359e-7),
    ],
)
def test_kummer_root_check_values(k: float, dim: int, nu: float) -> None:
    assert kummer_root(k, dim=dim) == pytest.approx(nu, rel=1e-6)


def test_kummer_root_tends_to_diffusion_in_a_ball_and_to_the_tail() -> None:
    # K -> 0: first eigenvalue of the Laplacian, (pi/2)^2, j01^2, pi^2 over K^2.
    for dim, root in ((1, math.pi / 2), (2, 2.404825557695773), (3, math.pi)):
        assert kummer_root(1e-3, dim=dim) == pytest.approx(root**2 * 1e6, rel=1e-6)
    # K -> infinity: nu -> K f_d(K), from below by about d/K^2.
    for dim in (1, 2, 3):
        log_density = (dim - 1) * math.log(30) - 450 - (dim / 2 - 1) * math.log(2)
        limit = 30 * math.exp(log_density - math.lgamma(dim / 2))
        assert limit * (1 - 1.5 * dim / 900) < kummer_root(30, dim=dim) < limit


@pytest.mark.parametrize(
    ("tau", "continuous", "sampled"), [(360, 362.01, 280.88), (1500, 87.64, 77.50)]
)
def test_effective_samples_of_an_hour(tau: float, continuous: float, sampled: float) -> None:
    hour = Exposure(3600, tau, 1)
    p = per_sample_risk(NPA_K, hour)
    assert continuous_risk(NPA_K, hour) / p == pytest.approx(continuous, rel=1e-4)
    assert siegmund_risk(NPA_K, hour) / p == pytest.approx(sampled, rel=1e-4)


def test_siegmund_constant() -> None:
    assert float(-mp.zeta(0.5) / mp.sqrt(2 * mp.pi)) == pytest.approx(SIEGMUND, rel=1e-15)
    assert round(SIEGMUND, 4) == 0.5826


def test_ellipse_between_its_ends() -> None:
    # Section 9: 2.140e-7 by a two-dimensional grid at q = 0.5.
    ellipse = Exposure(3600, 360, 1, axis_ratio=0.5)
    assert siegmund_risk(NPA_K, ellipse) == pytest.approx(2.140e-7, rel=1e-2)
    for k in (1.0, 3.0, 6.18, 10.0):
        line = continuous_hazard(k, Exposure(3600, 360, 1, dim=1))
        hazards = [
            continuous_hazard(k, Exposure(3600, 360, 1, axis_ratio=q))
            for q in (0, 1e-12, 1e-3, 0.2, 0.5, 0.9, 0.99, 1)
        ]
        assert hazards[0] == pytest.approx(line, rel=1e-12)
        assert hazards[1] == pytest.approx(line, rel=1e-9)
        if k >= 3:
            assert hazards == sorted(hazards)


def test_taus_of_other_processes() -> None:
    # r = sum w exp(-t/tau): -r'(0) = sum w/tau.
    assert mixture_short_tau_s([0.5, 0.5], [100, 720]) == pytest.approx(1 / (0.005 + 0.5 / 720))
    assert mixture_short_tau_s([1], [360]) == pytest.approx(360)
    assert lag_one_tau_s(math.exp(-1 / 360), interval_s=1) == pytest.approx(360)


@pytest.mark.parametrize(
    ("weights", "taus"), [([0.5, 0.6], [1, 2]), ([1.0], [1, 2]), ([], []), ([1.5, -0.5], [1, 2])]
)
def test_impossible_mixtures(weights: list[float], taus: list[float]) -> None:
    with pytest.raises(InputError, match="weights"):
        mixture_short_tau_s(weights, taus)


def test_arguments_out_of_range() -> None:
    with pytest.raises(InputError, match="k is out of range"):
        kummer_root(0)
    with pytest.raises(InputError, match="dim"):
        kummer_root(3, dim=4)
    with pytest.raises(InputError, match="correlation"):
        lag_one_tau_s(1.0, interval_s=1)
