"""The clock of modelled rates against the exact quadrature and a count."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

from sbas.integrity.exposure.gauss_markov_sampled import extremal_index
from sbas.integrity.tails.sampled_clock import (
    crossings_per_exceedance,
    hazard_per_s,
    log_hazards,
)


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


@pytest.mark.parametrize(
    ("tau", "interval", "axis_ratio", "nugget"),
    [
        (360.0, 1.0, 1.0, 0.0),
        (360.0, 1.0, 0.5, 0.0),
        (1500.0, 10.0, 0.05, 0.0),
        (100.0, 1.0, 0.9, 0.0),
        (30.0, 1.0, 1.0, 0.0),
        (20.0, 1.0, 1.0, 0.3),
        (3.0, 0.5, 0.5, 0.3),
        (50.0, 1.0, 1.0, 0.02),
    ],
)
def test_the_table_agrees_with_each_hazard(
    tau: float, interval: float, axis_ratio: float, nugget: float
) -> None:
    clock = {"tau_s": tau, "interval_s": interval, "axis_ratio": axis_ratio, "nugget": nugget}
    k = np.geomspace(0.05, 20.0, 38)
    exact = np.log([hazard_per_s(float(at), **clock) for at in k])
    np.testing.assert_allclose(log_hazards(k, **clock), exact, rtol=0, atol=1e-3)
    # Each level by itself, whatever others are asked for with it.
    np.testing.assert_array_equal(log_hazards(k[20:21], **clock), log_hazards(k, **clock)[20:21])


def test_the_table_ends_where_the_hazard_does() -> None:
    found = log_hazards(np.array([0.0, 0.04, 20.0, 20.1, 1e6]), tau_s=360.0, interval_s=2.0)
    np.testing.assert_allclose(found[:2], math.log(0.5))
    assert found[2] == pytest.approx(math.log(hazard_per_s(20.0, tau_s=360.0, interval_s=2.0)))
    assert np.all(found[3:] == -math.inf)


def test_white_noise_and_a_level_that_hardly_a_sample_survives() -> None:
    """The hazard is at most p/dt, and there it is nearly that."""
    k = 0.06
    found = hazard_per_s(k, tau_s=1500.0, interval_s=1.0, nugget=0.1)
    assert found == pytest.approx(math.exp(-k * k / 2), rel=0.02)


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
