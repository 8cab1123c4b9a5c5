"""The clock of modelled rates against the exact quadrature and a count."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from sbas.integrity.exposure.gauss_markov_sampled import extremal_index
from sbas.integrity.tails.sampled_clock import crossings_per_exceedance, hazard_per_s


@pytest.mark.parametrize(("tau", "n_es"), [(360.0, 280.88), (1500.0, 77.50)])
def test_an_hour_of_the_method_page(tau: float, n_es: float) -> None:
    # Page, section 9, Siegmund: risk per hour of K = 6.182852 is n_es times 5e-9, 1 Hz.
    rate = 3600 * hazard_per_s(6.182851757, tau_s=tau, interval_s=1.0)
    # The first sample adds its own risk.
    assert rate / 5e-9 + 1 == pytest.approx(n_es, rel=1e-4)


@pytest.mark.parametrize("k", [2.5, 4.0, 6.18, 12.0])
def test_asymptotic_and_exact_agree_where_they_meet(k: float) -> None:
    exact = extremal_index(k, correlation=math.exp(-1 / 100)) * math.exp(-k * k / 2)
    assert hazard_per_s(k, tau_s=100.0, interval_s=1.0) == pytest.approx(exact, rel=0.015)
    below = hazard_per_s(k, tau_s=99.0, interval_s=1.0)
    assert below == pytest.approx(exact * 100 / 99, rel=0.02)


def test_white_noise_multiplies_the_hazard() -> None:
    # Page, section 9: with 0.09/1.09 white, n_es 1288 instead of 281.55.
    k = 6.182852
    ratio = hazard_per_s(k, tau_s=360.0, interval_s=1.0, nugget=0.09 / 1.09) / hazard_per_s(
        k, tau_s=360.0, interval_s=1.0
    )
    assert ratio == pytest.approx(1288.0 / 281.55, rel=0.01)


def test_an_ellipse_lies_between_a_line_and_a_circle() -> None:
    thin, half, circle = (
        hazard_per_s(5.0, tau_s=50.0, interval_s=1.0, axis_ratio=q) for q in (0.0, 0.5, 1.0)
    )
    assert thin < half < circle


def test_the_ends_of_the_range() -> None:
    assert hazard_per_s(0.0, tau_s=360.0, interval_s=2.0) == 0.5
    assert hazard_per_s(25.0, tau_s=360.0, interval_s=1.0) == 0.0


@pytest.mark.parametrize("nugget", [0.0, 0.05])
def test_crossings_as_counted(nugget: float) -> None:
    tau, n = 40.0, 400_000
    r = math.exp(-1 / tau)
    generator = np.random.default_rng(5)
    drawn = generator.standard_normal((2, n))
    drawn[:, 1:] *= math.sqrt(1 - r * r)
    error = math.sqrt(1 - nugget) * signal.lfilter([1.0], [1.0, -r], drawn, axis=1)
    error = error + math.sqrt(nugget) * generator.standard_normal((2, n))
    above = np.hypot(*error) >= math.sqrt(-2 * math.log(0.05))
    counted = np.count_nonzero(above[1:] & ~above[:-1]) / np.count_nonzero(above)
    expected = crossings_per_exceedance(tau, interval_s=1.0, nugget=nugget)
    assert counted == pytest.approx(expected, rel=0.05)
