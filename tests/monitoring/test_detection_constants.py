from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from sbas.exceptions import InputError
from sbas.monitoring.detection_constants import (
    MonitorDesign,
    chi_square_threshold,
    detectable_noncentrality,
    detectable_shift,
    equivalent_alarm,
    upper_quantile,
    upper_tail,
)


def test_the_classical_pair_of_baarda() -> None:
    # 4.13 and 17.07 are the numbers of every textbook on geodetic networks.
    assert detectable_shift(1e-3, 0.2) == pytest.approx(4.132147965, abs=5e-10)
    assert detectable_shift(1e-3, 0.2) ** 2 == pytest.approx(17.07464681, abs=5e-9)


def test_thresholds_of_the_methods_page() -> None:
    expected = [15.90317832, 19.23161086, 21.95456211]
    assert chi_square_threshold(6.666667e-5, np.array([1, 2, 3])) == pytest.approx(
        expected, abs=5e-9
    )
    assert np.isnan(chi_square_threshold(1e-3, np.array([0, -2]))).all()


def test_quantiles_in_the_far_tail() -> None:
    for p in (1e-3, 1e-9, 1e-15):
        with mp.workdps(40):
            exact = float(mp.sqrt(2) * mp.erfinv(1 - 2 * mp.mpf(p)))
        assert upper_quantile(p) == pytest.approx(exact, rel=1e-12)
        assert upper_tail(exact) == pytest.approx(p, rel=1e-11)


@pytest.mark.parametrize(("alarm", "missed"), [(0.05, 0.5), (0.2, 0.3), (1e-3, 0.6)])
def test_the_far_side_of_the_test_counts_where_it_matters(alarm: float, missed: float) -> None:
    k, d = upper_quantile(alarm / 2), detectable_shift(alarm, missed)
    rejected = mp.ncdf(-(k - d)) + mp.ncdf(-(k + d))
    assert float(rejected) == pytest.approx(1 - missed, abs=1e-12)


@pytest.mark.parametrize("dof", [1, 2, 5, 9])
@pytest.mark.parametrize(("alarm", "missed"), [(1e-3, 1e-4), (1e-7, 1e-7), (0.05, 0.2)])
def test_noncentralities_miss_as_often_as_they_say(alarm: float, missed: float, dof: int) -> None:
    square = float(detectable_noncentrality(alarm, missed, dof)) ** 2
    assert ncx2.cdf(chi2.isf(alarm, dof), dof, square) == pytest.approx(missed, rel=1e-9)
    equal = float(equivalent_alarm(alarm, missed, dof))
    square = detectable_shift(alarm, missed) ** 2
    assert ncx2.cdf(chi2.isf(equal, dof), dof, square) == pytest.approx(missed, rel=1e-9)


def test_with_one_spare_range_both_tests_are_one() -> None:
    assert float(detectable_noncentrality(1e-3, 1e-4, 1)) == pytest.approx(
        detectable_shift(1e-3, 1e-4), rel=1e-12
    )
    assert float(equivalent_alarm(1e-3, 1e-4, 1)) == pytest.approx(1e-3, rel=1e-9)


def test_the_b_method_gives_one_bias_and_its_threshold() -> None:
    design = MonitorDesign(overall="b_method")
    dof = np.array([0, 1, 4])
    assert design.bias(dof)[1:] == pytest.approx(design.shift)
    assert np.isnan(design.bias(dof)[0])
    for k, threshold in zip((1, 4), design.threshold(dof)[1:], strict=True):
        assert chi2.sf(threshold, k) == pytest.approx(float(design.overall_alarm(k)), rel=1e-9)


@pytest.mark.parametrize(
    "wrong",
    [
        {"false_alarm": 0.0}, {"missed_detection": 1.0},
        {"false_alarm": 0.7, "missed_detection": 0.4},
        {"outlier_alarm": math.nan}, {"overall": "else"}, {"exclusions": 3}, {"rival": 0.0},
    ],
)  # fmt: skip
def test_designs_that_make_no_test_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError):
        MonitorDesign(**wrong)  # type: ignore[arg-type]
