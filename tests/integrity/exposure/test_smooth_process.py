"""Rice's formula against closed forms, quadrature and simulation."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from scipy import integrate

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure, per_sample_risk
from sbas.integrity.exposure.smooth_process import (
    SECOND_ORDER_TAU,
    filtered_omega0,
    gaussian_acf_omega0,
    rice_hazard,
    second_order_omega0,
    smooth_risk,
)


def test_the_second_order_process_has_its_1_e_time() -> None:
    assert float((1 + SECOND_ORDER_TAU) * math.exp(-SECOND_ORDER_TAU)) == pytest.approx(
        math.exp(-1), rel=1e-15
    )
    assert second_order_omega0(360) == pytest.approx(2.146193 / 360, rel=1e-6)


def test_omega0_is_the_curvature_of_the_autocorrelation() -> None:
    a = 360 / SECOND_ORDER_TAU
    for function, omega0 in (
        (lambda t: (1 + abs(t) / a) * mp.exp(-abs(t) / a), second_order_omega0(360)),
        (lambda t: mp.exp(-((t / 360) ** 2)), gaussian_acf_omega0(360)),
        (
            lambda t: (360 * mp.exp(-abs(t) / 360) - 100 * mp.exp(-abs(t) / 100)) / 260,
            filtered_omega0(360, filter_tau_s=100),
        ),
    ):
        with mp.workdps(40):
            h = mp.mpf("1e-8")
            curvature = 2 * (1 - function(h)) / h**2
        assert math.sqrt(float(curvature)) == pytest.approx(omega0, rel=1e-7)


@pytest.mark.parametrize(("tau", "n_es"), [(360, 53.91), (1500, 13.70)])
def test_check_values(tau: float, n_es: float) -> None:
    hour = Exposure(3600, tau, 1)
    assert smooth_risk(6.18, hour) / per_sample_risk(6.18, hour) == pytest.approx(n_es, rel=1e-3)


def test_closed_forms() -> None:
    tail = math.exp(-4.5)
    assert rice_hazard(3, omega0=0.1, dim=1) == pytest.approx(0.1 / math.pi * tail, rel=1e-14)
    two = 3 * 0.1 / math.sqrt(2 * math.pi) * tail
    assert rice_hazard(3, omega0=0.1) == pytest.approx(two, rel=1e-13)
    assert rice_hazard(3, omega0=0.1, axis_ratio=0) == pytest.approx(
        0.1 / math.pi * tail, rel=1e-13
    )
    assert rice_hazard(3, omega0=0.1, dim=3) == pytest.approx(0.1 / math.pi * 9 * tail, rel=1e-14)


@pytest.mark.parametrize("axis_ratio", [0.05, 0.4, 0.9])
@pytest.mark.parametrize("k", [1, 3, 6.18])
def test_ellipse_by_the_flux_through_the_circle(k: float, axis_ratio: float) -> None:
    def flux(angle: float) -> float:
        x, y = math.cos(angle), math.sin(angle)
        density = math.exp(-(k**2) / 2 * (x**2 + (y / axis_ratio) ** 2))
        speed = math.hypot(x, axis_ratio * y) / math.sqrt(2 * math.pi)
        return density / (2 * math.pi * axis_ratio) * speed * k

    quarter, _ = integrate.quad(flux, 0, math.pi / 2, points=[axis_ratio / k], epsabs=0)
    assert rice_hazard(k, omega0=1, axis_ratio=axis_ratio) == pytest.approx(4 * quarter, rel=1e-9)


def test_simulation_of_a_second_order_process() -> None:
    """Exact steps of (1 + t/a) exp(-t/a) in two states; Rice is high by the clumps at K = 3.5."""
    a, step, steps, records, k = 10.0, 0.25, 800, 8000, 3.5
    rng = np.random.default_rng(3)
    decay = math.exp(-step / a)
    drift = decay * np.array([[1 + step / a, step], [-step / a**2, 1 - step / a]])
    stationary = np.diag([1.0, 1 / a**2])
    noise = np.linalg.cholesky(stationary - drift @ stationary @ drift.T)
    state = np.sqrt(stationary) @ rng.standard_normal((2, 2 * records))
    hit = np.zeros(records, dtype=bool)
    for _ in range(steps):
        radius = np.hypot(state[0, :records], state[0, records:])
        hit |= radius >= k
        state = drift @ state + noise @ rng.standard_normal(state.shape)
    share = float(hit.mean())
    error = math.sqrt(share * (1 - share) / records)
    risk = smooth_risk(k, Exposure(steps * step, a * SECOND_ORDER_TAU, step))
    assert share - 3 * error < risk < 1.08 * share + 3 * error


def test_arguments_out_of_range() -> None:
    with pytest.raises(InputError, match="k is out of range"):
        rice_hazard(0.9, omega0=1)
    with pytest.raises(InputError, match="omega0"):
        rice_hazard(3, omega0=0)
    with pytest.raises(InputError, match="filter_tau_s"):
        filtered_omega0(360, filter_tau_s=0)
    with pytest.raises(InputError, match="tau_s"):
        gaussian_acf_omega0(-1)
