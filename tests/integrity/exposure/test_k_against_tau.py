"""K over tau against the check values of the methods page, the exact K and the limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.exposure_models import exposure_k
from sbas.integrity.exposure.k_against_tau import k_against_tau

WHITE = 0.09 / 1.09


def test_check_values_at_360_and_1500_s() -> None:
    # Methods page, section 2.7 and, for the nugget, section 9.
    answer = k_against_tau(5e-8, taus_s=[1500, 360], nugget=WHITE)
    assert answer.tau_s.tolist() == [360, 1500]
    expected = {"naive": (6.1829, 5.9476), "ar1": (6.7236, 6.5232), "rice": (6.4562, 6.2349)}
    for name, values in expected.items():
        assert answer.k[name] == pytest.approx(values, abs=6e-5)
    assert answer.k["nugget"][0] == pytest.approx(6.9629, rel=1e-5)


def test_ten_samples_an_hour_by_hand() -> None:
    """K = sqrt(-2 ln(1 - (1 - 5e-8)^(tau/T))), exact for one to 120 independent samples."""
    answer = k_against_tau(5e-8)
    per_sample = -np.expm1(answer.tau_s / 3600 * math.log1p(-5e-8))
    np.testing.assert_allclose(answer.k["naive"], np.sqrt(-2 * np.log(per_sample)), rtol=1e-9)
    assert answer.tau_s.size == 25
    assert answer.tau_s[[0, -1]] == pytest.approx([30, 3600])


@pytest.mark.parametrize(
    ("taus", "exposure_s", "tolerance"), [((30, 900), 3600, 1e-6), ((2.0, 2000), 2000, 1e-4)]
)
def test_between_the_nodes_it_is_the_exact_k(
    taus: tuple[float, float], exposure_s: float, tolerance: float
) -> None:
    answer = k_against_tau(1e-7, exposure_s=exposure_s, taus_s=np.geomspace(*taus, 18), nugget=0.05)
    for entry in (1, 8, 15):
        process = Exposure(exposure_s, float(answer.tau_s[entry]), 1, nugget=0.05)
        for model in ("ar1", "nugget"):
            exact = exposure_k(1e-7, process, model=model)
            assert answer.k[model][entry] == pytest.approx(exact, rel=tolerance)


def test_order_of_the_models() -> None:
    """The rougher the error, the larger its K; never larger than that of all samples apart."""
    answer = k_against_tau(5e-8, nugget=0.02)
    k = answer.k
    assert list(k) == ["naive", "rice", "ar1", "nugget"]
    assert np.all(k["naive"] < k["rice"])
    assert np.all(k["rice"] < k["ar1"])
    assert np.all(k["ar1"] < k["nugget"])
    assert np.all(k["nugget"] < math.sqrt(-2 * math.log(5e-8 / 3600)))
    assert all(np.all(np.diff(curve) < 0) for curve in k.values())


def test_nugget_and_dimension_are_echoed() -> None:
    answer = k_against_tau(5e-8, taus_s=[360], dim=1)
    assert set(answer.k) == {"naive", "rice", "ar1"}
    # Methods page, section 9: one dimension.
    assert answer.k["ar1"][0] == pytest.approx(6.3955, rel=1e-5)
    assert (answer.risk, answer.exposure_s, answer.interval_s) == (5e-8, 3600, 1)
    assert (answer.dim, answer.nugget) == (1, 0)


def test_no_number_where_a_model_has_no_k() -> None:
    # K = 1 is exceeded in one sample with exp(-1/2) = 0.607, in 100 s with less than 0.999.
    empty = k_against_tau(0.999, exposure_s=100, taus_s=np.geomspace(80, 100, 9))
    assert all(np.all(np.isnan(curve)) for curve in empty.k.values())
    # Two samples in a tau: upcrossings between them are not seen.
    sparse = k_against_tau(5e-8, interval_s=30, taus_s=[60, 3600])
    assert np.isnan(sparse.k["rice"]).tolist() == [True, False]
    assert np.all(np.isfinite(sparse.k["ar1"]))
    # 100 000 samples in a tau are not computed exactly; the others stay.
    dense = k_against_tau(5e-8, interval_s=0.01, taus_s=[10, 1000])
    assert np.isnan(dense.k["ar1"]).tolist() == [False, True]
    assert np.all(np.isfinite(dense.k["naive"]))


def test_curve_of_a_short_exposure_and_a_long_interval() -> None:
    short = k_against_tau(1e-7, exposure_s=150)
    assert short.tau_s[[0, -1]] == pytest.approx([15, 150])
    wide = k_against_tau(1e-7, interval_s=30)
    assert wide.tau_s[[0, -1]] == pytest.approx([60, 3600])


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"risk": 0}, "risk"),
        ({"risk": math.nan}, "risk"),
        ({"exposure_s": -1}, "exposure_s"),
        ({"exposure_s": 1.5}, "exposure_s"),
        ({"interval_s": 0}, "interval_s"),
        ({"taus_s": [1.0, 360]}, "taus_s"),
        ({"taus_s": [360, 3601]}, "taus_s"),
        ({"taus_s": [360, math.nan]}, "taus_s"),
        ({"taus_s": []}, "taus_s"),
        ({"dim": 4}, "dim"),
        ({"nugget": 1.0}, "nugget"),
        ({"nugget": -0.1}, "nugget"),
    ],
)
def test_arguments_out_of_range(changes: dict[str, object], where: str) -> None:
    arguments: dict[str, object] = {"risk": 5e-8} | changes
    with pytest.raises(InputError) as error:
        k_against_tau(arguments.pop("risk"), **arguments)  # type: ignore[arg-type]
    assert error.value.where == where
