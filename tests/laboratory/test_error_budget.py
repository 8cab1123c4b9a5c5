"""Sigma terms against values worked out from DO-229's formulas at 12 digits."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.laboratory.error_budget import (
    GIVE_VARIANCE_M2,
    UDRE_VARIANCE_M2,
    obliquity,
    sigma_air_m,
    sigma_flt_m,
    sigma_tropo_m,
    uive_variance_m2,
)

ELEVATIONS = np.array([5.0, 10.0, 90.0])


def test_closed_forms_at_three_elevations():
    assert obliquity(ELEVATIONS) == pytest.approx([3.040638169510, 2.790373003995, 1], rel=1e-11)
    assert obliquity(np.array([30.0])) == pytest.approx([1.751421095157], rel=1e-11)
    assert sigma_tropo_m(ELEVATIONS) == pytest.approx(
        [1.226153329898, 0.669874063202, 0.12], rel=1e-11
    )
    assert sigma_air_m(ELEVATIONS) == pytest.approx(
        [0.577422947183, 0.484983987421, 0.382775404316], rel=1e-11
    )


def test_tabulated_variances_are_the_999_percent_bounds_over_3_29():
    # DO-229 tabulates the 99.9 % bounds (metres) beside the variances; 3.29 = two-sided 99.9 %.
    udre = (0.75, 1, 1.25, 1.75, 2.25, 3, 3.75, 4.5, 5.25, 6, 7.5, 15, 50, 150)
    give = (0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3, 3.6, 4.5, 6, 15, 45)
    for variance, bound in ((UDRE_VARIANCE_M2, udre), (GIVE_VARIANCE_M2, give)):
        assert np.array(variance) == pytest.approx(
            (np.array(bound) / 3.29) ** 2, rel=1e-3, abs=1e-4
        )


def test_sigma_flt_passes_from_the_horizon_index_to_the_zenith_index():
    kind = {"udrei_zenith": 5, "udrei_horizon": 10, "elevation_scale_deg": 10.0}
    low, scale, high = sigma_flt_m(np.array([0.0, 10.0, 1e4]), **kind)
    assert low**2 == pytest.approx(5.1968)
    assert high**2 == pytest.approx(0.8315)
    assert (scale - high) / (low - high) == pytest.approx(0.36787944117)


def test_ionosphere_is_worst_at_14_h_local_solar_time():
    kind = {"givei_night": 4, "givei_day": 8}
    # At 15 deg E local solar time is an hour ahead: 13 h GPS time is 14 h there.
    hours = np.array([13, 1, 7], "m8[h]") + np.datetime64("2009-09-19", "ns")
    day, night, between = uive_variance_m2(hours, lon_deg=15.0, **kind)
    assert (day, night) == pytest.approx((0.6735, 0.2079))
    assert between == pytest.approx((0.6735 + 0.2079) / 2)
