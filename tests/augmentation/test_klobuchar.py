"""The broadcast ionosphere."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.klobuchar import LIGHT_MPS, klobuchar

NONE = (0.0, 0.0, 0.0, 0.0)


def at(
    alpha: tuple[float, ...], beta: tuple[float, ...], second: float, lat: float, lon: float,
    elevation: float = 90.0, azimuth: float = 0.0,
) -> tuple[float, float]:  # fmt: skip
    found = klobuchar(alpha, beta, *(np.array([v]) for v in (second, lat, lon, elevation, azimuth)))
    return float(found.delay_m[0]), float(found.sigma_m[0])


def test_at_night_the_delay_is_five_nanoseconds() -> None:
    assert at(NONE, NONE, 0.0, 40.0, 0.0)[0] == pytest.approx(5e-9 * LIGHT_MPS)
    peak = (2e-8, 0.0, 0.0, 0.0)
    assert at(peak, NONE, 0.0, 40.0, 0.0)[0] == pytest.approx(5e-9 * LIGHT_MPS)


def test_at_two_in_the_afternoon_the_whole_amplitude_is_added() -> None:
    """Local time 50,400 s: at 0 E that is the second of the day, at 90 E six hours before."""
    peak = (2e-8, 0.0, 0.0, 0.0)
    for second, lon in ((50400.0, 0.0), (50400.0 - 21600, 90.0), (7200.0, 180.0), (72000.0, -90.0)):
        assert at(peak, NONE, second, 40.0, lon)[0] == pytest.approx(2.5e-8 * LIGHT_MPS)


def test_the_period_is_at_least_20_hours() -> None:
    """Of 72,000 s: an hour from the peak is an angle of 0.1 pi."""
    found = at((2e-8, 0.0, 0.0, 0.0), (1000.0, 0.0, 0.0, 0.0), 54000.0, 40.0, 0.0)[0]
    assert found == pytest.approx((5e-9 + 2e-8 * np.cos(0.1 * np.pi)) * LIGHT_MPS)
    longer = at((2e-8, 0.0, 0.0, 0.0), (144000.0, 0.0, 0.0, 0.0), 54000.0, 40.0, 0.0)[0]
    assert longer == pytest.approx((5e-9 + 2e-8 * np.cos(0.05 * np.pi)) * LIGHT_MPS)


def test_a_negative_amplitude_counts_as_none() -> None:
    assert at((-2e-8, 0.0, 0.0, 0.0), NONE, 50400.0, 40.0, 0.0)[0] == pytest.approx(
        5e-9 * LIGHT_MPS
    )


def test_amplitudes_go_with_the_geomagnetic_latitude() -> None:
    """The geomagnetic pole lies at 78.3 N, 291 E: there phi is a quarter turn, half a
    semicircle."""
    second = 50400.0 - 43200.0 * (291 - 360) / 180
    found = at((0.0, 2e-8, 4e-8, 8e-8), NONE, second, 78.3, 291.0 - 360)[0]
    amplitude = 2e-8 / 2 + 4e-8 / 4 + 8e-8 / 8
    assert found == pytest.approx((5e-9 + amplitude) * LIGHT_MPS)


@pytest.mark.parametrize(
    ("phi", "vertical"), [(0, 9), (19.99, 9), (20.01, 4.5), (-54.99, 4.5), (55.01, 6), (-89, 6)]
)
def test_the_least_sigma_goes_by_the_zone(phi: float, vertical: float) -> None:
    """Along the meridian of the pole, 291 E, phi is the latitude and 11.7 degrees."""
    assert at(NONE, NONE, 0.0, phi - 11.7 + 0.0, 291.0 - 360)[1] == pytest.approx(vertical)


def test_a_fifth_of_a_large_delay_is_larger_than_the_least_sigma() -> None:
    huge = (2e-7, 0.0, 0.0, 0.0)
    delay, sigma = at(huge, NONE, 50400.0, 40.0, 0.0)
    assert delay > 22.5
    assert sigma == pytest.approx(delay / 5)


def test_the_slant_factor() -> None:
    """gLAB on Kamakura, G09 at 54.905 degrees: sigma 5.3672 m is 4.5 m slanted."""
    found = at(NONE, NONE, 0.0, 35.34, 139.52, elevation=54.905, azimuth=100.0)
    assert found[1] == pytest.approx(5.3672, abs=1e-4)
