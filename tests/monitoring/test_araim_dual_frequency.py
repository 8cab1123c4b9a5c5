"""Range errors: Appendix D prints C_int and C_acc of ten satellites, all with the GPS model."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.araim_dual_frequency import (
    GALILEO_USER_SIGMA_M,
    SupportMessage,
    dual_frequency_ranges,
    galileo_user_sigma_m,
    gps_user_sigma_m,
    tropospheric_sigma_m,
)
from tests.monitoring.araim_reference import APPENDIX_D, appendix_d


def test_variances_of_appendix_d() -> None:
    example = appendix_d()
    ranges = dual_frequency_ranges(example["elevation_deg"], example["azimuth_deg"], ["G"] * 10)
    # Rows are printed to 5e-5: the steepest change, at 5.5 deg, makes that 3e-3 of a variance of
    # 3.9 m2 at most; in fact all ten agree to 1.3e-4.
    c_int = [row[4] for row in APPENDIX_D]
    c_acc = [row[5] for row in APPENDIX_D]
    assert np.asarray(ranges.sigma_int_m)[0] ** 2 == pytest.approx(c_int, abs=1.5e-4)
    assert np.asarray(ranges.sigma_acc_m)[0] ** 2 == pytest.approx(c_acc, abs=1.5e-4)
    assert (np.asarray(ranges.b_nom_m) == 0.5).all()


def test_gps_at_the_zenith_by_hand() -> None:
    # L1 and L5 are 154 and 115 times 10.23 MHz; the ionosphere-free factor is known as 2.588.
    factor = math.sqrt(154**4 + 115**4) / (154**2 - 115**2)
    assert factor == pytest.approx(2.588, abs=5e-4)
    local = math.hypot(0.13 + 0.53 * math.exp(-9), 0.15 + 0.43 * math.exp(-90 / 6.9))
    assert gps_user_sigma_m(90.0) == pytest.approx(factor * local, rel=1e-14)


def test_galileo_by_the_table() -> None:
    assert len(GALILEO_USER_SIGMA_M) == 18
    assert galileo_user_sigma_m([5.0, 10.0, 45.0, 90.0]).tolist() == [
        0.4529, 0.3553, 0.2396, 0.2277,
    ]  # fmt: skip
    assert galileo_user_sigma_m(7.5) == pytest.approx((0.4529 + 0.3553) / 2, rel=1e-14)
    assert np.isnan(galileo_user_sigma_m([4.999, -1.0, np.nan])).all()


def test_troposphere_at_the_zenith_is_its_vertical_sigma() -> None:
    # 1.001 / sqrt(1.002001) = 1 exactly.
    assert tropospheric_sigma_m(90.0) == pytest.approx(0.12, rel=1e-15)
    assert np.isnan(tropospheric_sigma_m(-0.1))


def test_message_by_constellation() -> None:
    message = SupportMessage(ura_m={"G": 1.0, "E": 3.0}, ure_m=0.0, b_nom_m={"G": 0.1, "E": 0.2})
    ranges = dual_frequency_ranges([[50.0, 50.0]], [[0.0, 90.0]], ["G", "E"], message=message)
    difference = np.asarray(ranges.sigma_int_m) ** 2 - np.asarray(ranges.sigma_acc_m) ** 2
    assert difference == pytest.approx(np.array([[1.0, 9.0]]))
    assert np.asarray(ranges.b_nom_m).tolist() == [[0.1, 0.2]]


def test_galileo_below_its_table_takes_no_part() -> None:
    ranges = dual_frequency_ranges([[4.0, 4.0]], [[0.0, 90.0]], ["G", "E"])
    assert np.isfinite(np.asarray(ranges.sigma_int_m)).tolist() == [[True, False]]


def test_no_model_no_figure() -> None:
    with pytest.raises(InputError, match="constellation R"):
        dual_frequency_ranges([[40.0]], [[80.0]], ["R"])
    with pytest.raises(InputError, match="no ura_m for constellation E"):
        dual_frequency_ranges([[40.0]], [[80.0]], ["E"], message=SupportMessage(ura_m={"G": 1.0}))


@pytest.mark.parametrize("name", ["ura_m", "ure_m", "b_nom_m"])
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_impossible_messages_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=name):
        SupportMessage(**{name: {"G": value}})
