"""Limits, effective sample sizes and closed forms against the paper and exact mathematics."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import (
    Exposure,
    n_eff_mean,
    n_eff_variance,
    n_es,
    naive_risk,
    per_sample_risk,
    risk_from_hazard,
    risk_limits,
)


@pytest.mark.parametrize(
    ("risk", "window_s", "independent", "rate"),
    [
        # Filip, Bazant, Mocek 2010 (PA) and Navipedia, EGNOS_Performances (continuity, APV-I).
        (2e-7, 150, 4.799989e-6, 4.800000e-6),
        (8e-6, 15, 1.918166e-3, 1.920008e-3),
    ],
)
def test_both_readings_of_a_window_requirement(
    risk: float, window_s: float, independent: float, rate: float
) -> None:
    limits = risk_limits(risk, window_s=window_s, exposure_s=3600)
    assert limits.full_correlation == risk
    assert limits.independent_windows == pytest.approx(independent, rel=2e-7)
    assert limits.rate_per_h == pytest.approx(rate, rel=2e-7)


def test_hour_to_a_shorter_window_is_bounded_both_ways() -> None:
    limits = risk_limits(1e-7, window_s=3600, exposure_s=150)
    assert limits.upper == 1e-7
    # 24 windows cover the hour, so that each has at least a 24th (union bound).
    assert limits.lower == pytest.approx(1e-7 / 24, rel=1e-14)
    assert limits.lower <= limits.independent_windows <= limits.upper


@given(risk=st.floats(1e-18, 0.99), window=st.floats(0.1, 1e4), exposure=st.floats(0.1, 1e7))
def test_limits_are_in_order(risk: float, window: float, exposure: float) -> None:
    limits = risk_limits(risk, window_s=window, exposure_s=exposure)
    slack = 1 + 1e-12
    assert 0 < limits.lower <= limits.independent_windows * slack
    assert limits.independent_windows <= limits.upper * slack
    assert limits.upper <= 1


def test_a_mission_of_tiny_risks_does_not_vanish() -> None:
    limits = risk_limits(1e-17, window_s=1, exposure_s=3600)
    assert limits.independent_windows == pytest.approx(3.6e-14, rel=1e-12)


def test_three_effective_sample_sizes() -> None:
    hour = {"exposure_s": 3600.0, "tau_s": 360.0}
    assert n_eff_mean(**hour) == 5
    assert n_eff_variance(**hour) == 10  # FBM's ten independent samples
    assert n_eff_variance(**hour, components=2) == 20
    assert n_es(1.40777e-6, 5e-9) == pytest.approx(281.55, rel=1e-4)


def test_effective_sizes_match_the_variance_of_an_exact_sum() -> None:
    # AR(1): var(mean) = (1/n^2) sum of r^|i-j|; sample variance likewise with r^2|i-j|.
    tau, n = 200.0, 200_000
    lags = range(1, int(20 * tau))
    double_sum = 1 + 2 * sum((1 - m / n) * math.exp(-m / tau) for m in lags)
    assert n / double_sum == pytest.approx(n_eff_mean(exposure_s=n, tau_s=tau), rel=2e-3)
    double_sum = 1 + 2 * sum((1 - m / n) * math.exp(-2 * m / tau) for m in lags)
    assert n / double_sum == pytest.approx(n_eff_variance(exposure_s=n, tau_s=tau), rel=2e-3)


def test_naive_gives_what_the_standard_assumes() -> None:
    # FBM eq. 2: 0.5e-7 per hour at ten samples; 6.18 is rounded down.
    hour = Exposure(3600, 360, 1)
    assert naive_risk(6.182851756998919, hour) == pytest.approx(5e-8, rel=1e-7)
    assert naive_risk(6.18, hour) == pytest.approx(5.088921e-8, rel=1e-6)
    assert naive_risk(5, Exposure(100, 360, 1)) == pytest.approx(math.exp(-12.5), rel=1e-12)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [({"dim": 2}, 5e-9), ({"dim": 1}, math.erfc(6.182851756998919 / math.sqrt(2)))],
)
def test_per_sample_risk(shape: dict[str, int], expected: float) -> None:
    exposure = Exposure(3600, 360, 1, **shape)
    assert per_sample_risk(6.182851756998919, exposure) == pytest.approx(expected, rel=1e-12)


def test_risk_from_hazard_is_exact_when_small_and_bounded_when_large() -> None:
    assert risk_from_hazard(1e-20, hazard_per_s=1e-22, exposure_s=300) == pytest.approx(4e-20)
    assert risk_from_hazard(0.3, hazard_per_s=5, exposure_s=1e6) == pytest.approx(1)


@pytest.mark.parametrize(("step", "samples"), [(0.2, 18000), (0.1, 36000), (1, 3600), (7, 515)])
def test_a_begun_interval_counts_and_rounding_does_not(step: float, samples: int) -> None:
    assert Exposure(3600, 360, step).samples == samples


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"tau_s": 1}, "tau_s"),
        ({"tau_s": math.nan}, "tau_s"),
        ({"tau_s": "long"}, "tau_s"),
        ({"exposure_s": 0.5}, "exposure_s"),
        ({"exposure_s": math.inf}, "exposure_s"),
        ({"interval_s": 0}, "interval_s"),
        ({"dim": 4}, "dim"),
        ({"dim": True}, "dim"),
        ({"axis_ratio": 1.1}, "axis_ratio"),
        ({"axis_ratio": 0.5, "dim": 1}, "axis_ratio"),
        ({"nugget": 1}, "nugget"),
        ({"nugget": -0.1}, "nugget"),
    ],
)
def test_exposures_that_cannot_be(changes: dict[str, float], where: str) -> None:
    arguments = {"exposure_s": 3600.0, "tau_s": 360.0, "interval_s": 1.0} | changes
    with pytest.raises(InputError) as error:
        Exposure(**arguments)  # type: ignore[arg-type]
    assert error.value.where == where


def test_arguments_out_of_range_are_named() -> None:
    with pytest.raises(InputError, match="exposure is shorter"):
        n_eff_variance(exposure_s=100, tau_s=360)
    with pytest.raises(InputError, match="components"):
        n_eff_variance(exposure_s=1000, tau_s=360, components=4)
    with pytest.raises(InputError, match="window_risk"):
        risk_limits(1.0, window_s=150, exposure_s=3600)
    with pytest.raises(InputError, match="k is out of range"):
        per_sample_risk(40, Exposure(3600, 360, 1))
    with pytest.raises(InputError, match="per_sample_risk"):
        n_es(1e-9, 1e-8)
