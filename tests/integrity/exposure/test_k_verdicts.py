"""Verdicts on a K, with the intervals of sigma and tau carried through."""

from __future__ import annotations

import json
import math

import pytest
from scipy import stats

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.exposure_models import exposure_risk
from sbas.integrity.exposure.k_verdicts import k_verdict, sigma_factors

HOUR = Exposure(3600, 360, 1)


@pytest.mark.parametrize(
    ("tau", "components", "factor", "risk"),
    [
        # Methods page, section 8: a record of 3e5 s.
        (360, 1, 1.0421, 2.27e-8),
        (360, 2, 1.0294, 1.47e-8),
        (1500, 1, 1.0902, 1.04e-7),
        (1500, 2, 1.0620, 4.37e-8),
    ],
)
def test_upper_factor_of_sigma(tau: float, components: int, factor: float, risk: float) -> None:
    sigma = sigma_factors(record_s=3e5, tau_s=tau, components=components)
    assert sigma.upper == pytest.approx(factor, abs=6e-5)
    assert math.exp(-((6.182852 / sigma.upper) ** 2) / 2) == pytest.approx(risk, rel=4e-3)


def test_factors_are_the_chi_square_quantiles() -> None:
    nu = 3e5 / 700
    sigma = sigma_factors(record_s=3e5, tau_s=700, confidence=0.99)
    assert sigma.upper == pytest.approx(math.sqrt(nu / stats.chi2.ppf(0.01, nu)), rel=1e-12)
    assert sigma.lower == pytest.approx(math.sqrt(nu / stats.chi2.isf(0.01, nu)), rel=1e-12)


def test_five_percent_of_sigma_is_six_times_the_risk() -> None:
    # Methods page, section 8: 5 % more sigma multiplies the risk per sample by 5.9, 10 % by 27.6.
    for more, times in ((1.05, 5.9), (1.10, 27.6)):
        ratio = math.exp(-((6.182852 / more) ** 2) / 2) / 5e-9
        assert ratio == pytest.approx(times, rel=5e-3)
    plain = k_verdict(5e-8, HOUR, tau_lower_s=360, tau_upper_s=360, record_s=3e5, k=6.182852)
    wider = k_verdict(
        5e-8, HOUR, tau_lower_s=360, tau_upper_s=360, record_s=3e5, k=6.182852, sigma_ratio=1.05
    )
    assert wider.risks["naive"].point / plain.risks["naive"].point == pytest.approx(5.9, rel=5e-3)


def test_6_18_at_360_s_is_not_enough_for_a_gauss_markov_error() -> None:
    answer = k_verdict(5e-8, HOUR, tau_lower_s=300, tau_upper_s=420, record_s=3e5)
    assert answer.k == 6.18
    ar1 = answer.risks["ar1"]
    assert ar1.point == pytest.approx(1.431601e-6, rel=1e-6)
    upper = 6.18 / sigma_factors(record_s=3e5, tau_s=420, components=2).upper
    assert ar1.upper_sigma == pytest.approx(exposure_risk(upper, HOUR), rel=1e-12)
    assert ar1.upper_sigma_lower_tau == pytest.approx(
        exposure_risk(upper, Exposure(3600, 300, 1)), rel=1e-12
    )
    assert ar1.lower_sigma_upper_tau < ar1.point < ar1.upper_sigma < ar1.upper_sigma_lower_tau
    assert ar1.verdict == "not enough"
    # The standard's own count of samples lies in the interval: the models disagree.
    assert answer.risks["naive"].verdict == "undecided"
    assert "ar1" in answer.verdict.split("not enough")[0]
    assert "disagree" in answer.verdict
    assert json.loads(json.dumps(answer.to_dict()))["risks"]["ar1"]["verdict"] == "not enough"
    assert "nugget" not in answer.summary().index


def test_a_smaller_sigma_than_the_one_behind_the_hpl_is_enough() -> None:
    answer = k_verdict(5e-8, HOUR, tau_lower_s=300, tau_upper_s=420, record_s=3e5, sigma_ratio=0.3)
    assert {r.verdict for r in answer.risks.values()} == {"enough"}
    assert "disagree" not in answer.verdict


def test_a_nugget_has_its_own_row() -> None:
    white = Exposure(3600, 360, 1, nugget=0.08)
    answer = k_verdict(5e-8, white, tau_lower_s=300, tau_upper_s=420, record_s=3e5)
    assert answer.risks["nugget"].point > 3 * answer.risks["ar1"].point


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"tau_lower_s": 400}, "tau_lower_s"),
        ({"tau_upper_s": 300}, "tau_upper_s"),
        ({"record_s": 100}, "exposure_s"),
        ({"k": 0}, "k"),
        ({"sigma_ratio": 0}, "sigma_ratio"),
        ({"sigma_ratio": 7}, "sigma_ratio"),
        ({"confidence": 1}, "confidence"),
        ({"target": 0}, "target"),
    ],
)
def test_arguments_out_of_range(changes: dict[str, float], where: str) -> None:
    arguments = {"target": 5e-8, "tau_lower_s": 300.0, "tau_upper_s": 420.0, "record_s": 3e5}
    arguments |= changes
    with pytest.raises(InputError) as error:
        k_verdict(arguments.pop("target"), HOUR, **arguments)  # type: ignore[arg-type]
    assert error.value.where == where
