from __future__ import annotations

import numpy as np
import pytest

from sbas.monitoring.detection_constants import MonitorDesign, detectable_noncentrality
from sbas.monitoring.levels import external_levels_m, level_columns
from sbas.monitoring.normal_equations import geometry, ranges
from sbas.monitoring.separation import SeparationBudget
from sbas.monitoring.slopes import horizontal_slope, largest
from tests.monitoring.skies import random_sky, sky

DESIGN = MonitorDesign(false_alarm=1e-3, missed_detection=0.2, outlier_alarm=1e-3)
PAGE = {
    "A": (4.77139348, np.inf, (4.77139348, 4.13214797, 3.37388469)),
    "B": (5.99251742, 6.04350141, (5.99251742, 5.18967232, 5.78832734)),
    "C": (2.84082563, 3.38537047, (2.84082563, 2.46022716, 2.00876707)),
}


@pytest.mark.parametrize("case", PAGE)
def test_external_reliability_of_the_methods_page(case: str) -> None:
    herl, verl, along = PAGE[case]
    g = geometry(sky(case))
    found = external_levels_m(g, DESIGN.shift)
    assert found[0][0] == pytest.approx(herl, abs=5e-8)
    assert found[1][0] == pytest.approx(verl, abs=5e-8)
    for heading, expected in zip((0, 30, 45), along, strict=True):
        columns = level_columns(g, DESIGN, SeparationBudget(), heading)
        assert columns["erl_along_m"][0] == pytest.approx(expected, abs=5e-8)
        turned = level_columns(g, DESIGN, SeparationBudget(), heading - 90)
        assert columns["erl_across_m"][0] == pytest.approx(turned["erl_along_m"][0], rel=1e-12)


def test_every_level_rests_on_the_same_slope() -> None:
    rng = np.random.default_rng(2)
    g = geometry(ranges(*random_sky(rng, 8, 100)))
    columns = level_columns(g, DESIGN, SeparationBudget(), rng.uniform(0, 360, 100))
    slope = largest(horizontal_slope(g))
    assert columns["herl_m"] == pytest.approx(DESIGN.shift * slope, rel=1e-12)
    bias = float(detectable_noncentrality(1e-3, 0.2, 4))
    assert columns["hpl_slope_m"] == pytest.approx(bias * slope, rel=1e-12)
    assert (columns["erl_along_m"] <= columns["herl_m"] * (1 + 1e-12)).all()
    assert (columns["sigma_along_m"] <= columns["sigma_major_m"] * (1 + 1e-12)).all()


def test_without_a_spare_range_there_is_no_level() -> None:
    four = geometry(ranges(*random_sky(np.random.default_rng(0), 4, 3)))
    columns = level_columns(four, DESIGN, SeparationBudget(), 10.0)
    assert all(np.isnan(v).all() for name, v in columns.items() if not name.startswith("sigma"))
    assert all(np.isfinite(v).all() for name, v in columns.items() if name.startswith("sigma"))
