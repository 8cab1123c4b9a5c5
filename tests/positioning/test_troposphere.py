"""The tropospheric model against an evaluation with other tools and against gLAB."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from sbas.positioning.range_budget import day_of_year
from sbas.positioning.troposphere import mapping, residual_sigma_m, zenith_delay_m
from sbas.timescales import GPS_EPOCH_NS

# One row a latitude: mean pressure, temperature, vapour pressure, lapse rate, lambda, and their
# yearly swing, as DO-229D, table A-2 has them.
TABLE = {
    15: ("1013.25 299.65 26.31 0.00630 2.77", "0 0 0 0 0"),
    30: ("1017.25 294.15 21.79 0.00605 3.15", "-3.75 7 8.85 0.00025 0.33"),
    45: ("1015.75 283.15 11.66 0.00558 2.57", "-2.25 11 7.24 0.00032 0.46"),
    60: ("1011.75 272.15 6.78 0.00539 1.81", "-1.75 15 5.36 0.00081 0.74"),
    75: ("1013.00 263.65 4.11 0.00453 1.55", "-0.50 14.5 3.39 0.00062 0.30"),
}


def exact_delay(lat: str, height: str, day: str) -> float:
    """DO-229D, A.4.2.4 with 30 digits, one place at a time."""
    with mpmath.workdps(30):
        phi, h = mpmath.mpf(lat), mpmath.mpf(height)
        at = min(max(abs(phi), 15), 75)
        low = min(int(at // 15) * 15, 60)
        share = (at - low) / 15
        season = mpmath.cos(
            2 * mpmath.pi * (mpmath.mpf(day) - (28 if phi >= 0 else 211)) / mpmath.mpf("365.25")
        )

        def value(number: int) -> mpmath.mpf:
            mean, swing = (
                [mpmath.mpf(TABLE[node][kind].split()[number]) for node in (low, low + 15)]
                for kind in (0, 1)
            )
            return (
                mean[0] + (mean[1] - mean[0]) * share
                - (swing[0] + (swing[1] - swing[0]) * share) * season
            )  # fmt: skip

        p, t, e, beta, lam = (value(number) for number in range(5))
        k1, k2, rd, gm, g = map(mpmath.mpf, ("77.604", "382000", "287.054", "9.784", "9.80665"))
        dry = k1 * rd * p / gm / 10**6
        wet = k2 * rd / (gm * (lam + 1) - beta * rd) * e / t / 10**6
        fall = 1 - beta * h / t
        power = g / (rd * beta)
        return float(dry * fall**power + wet * fall ** ((lam + 1) * power - 1))


@pytest.mark.parametrize("lat", ["0", "15", "22.5", "35.34", "-47.5", "60", "66", "75", "-89"])
@pytest.mark.parametrize(("height", "day"), [("0", "28"), ("1200.5", "46.5"), ("-50", "211")])
def test_zenith_delay(lat: str, height: str, day: str) -> None:
    got = zenith_delay_m(np.array([float(lat)]), np.array([float(height)]), np.array([float(day)]))
    assert got[0] == pytest.approx(exact_delay(lat, height, day), rel=1e-13)


def test_closed_forms() -> None:
    """Page section 15, check value 1."""
    elevation = np.array([5.0, 10.0, 90.0])
    sigma = [1.226153329898, 0.669874063202, 0.12]
    assert residual_sigma_m(elevation) == pytest.approx(sigma, abs=1e-12)
    assert mapping(elevation) == pytest.approx([s / 0.12 for s in sigma], rel=1e-11)


def test_days_of_the_year_run_through_midnight() -> None:
    stamps = ["2020-01-01", "2020-12-31T12", "2019-12-31T23:59:59", "2025-02-15T06"]
    ns = np.array(stamps, "M8[ns]").astype(np.int64) - GPS_EPOCH_NS
    assert day_of_year(ns) == pytest.approx([1.0, 366.5, 365 + 86399 / 86400, 46.25])
