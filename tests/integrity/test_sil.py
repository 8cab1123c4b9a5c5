"""Verdicts: half-open bands, the upper bound only, and what can never be demonstrated."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from sbas.estimate import Estimate, Fitted, Quoted
from sbas.exceptions import InputError
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.sil import meets, sil_band, sil_verdict

MODEL = Fitted("exponential tail", {"b": 1.0}, 5.4)
CLAIM = Quoted("Filip, Bazant, Mocek 2010", "2.1.2")


def rate(upper: float | None, basis: Any = None, **changes: Any) -> Estimate:
    """An estimated rate with the given upper bound; counted unless another basis is given."""
    counted = poisson_bounds(0, 1, 0.95).basis
    fields = {
        "value": 0.0, "lower": None, "upper": upper, "unit": "per_h", "basis": basis or counted,
        "confidence": None if upper is None else 0.95,
    }  # fmt: skip
    return Estimate(**{**fields, **changes})


@pytest.mark.parametrize(
    ("rate_per_h", "level"),
    [
        (5e-9, 4), (5e-8, 3), (1e-7, 2), (4.8e-6, 1), (2e-5, None),
        (0, 4), (1e-10, 4), (1e-9, 4), (1e-8, 3), (1e-6, 1), (1e-5, None), (math.inf, None),
        (math.nextafter(1e-7, 0), 3), (math.nextafter(1e-5, 0), 1),
    ],
)  # fmt: skip
def test_bands_are_half_open(rate_per_h: float, level: int | None) -> None:
    # IEC 61508-1, 7.6.2: SIL 3 is at least 1e-8/h and below 1e-7/h.
    assert sil_band(rate_per_h) == level


@pytest.mark.parametrize("rate_per_h", [-1e-9, math.nan, "1e-7", None, True])
def test_no_band_for_what_is_no_rate(rate_per_h: Any) -> None:
    with pytest.raises(InputError, match="rate_per_h"):
        sil_band(rate_per_h)


def test_counted_bound_demonstrates() -> None:
    verdict = sil_verdict(poisson_bounds(0, 1e8, 0.95))
    assert (verdict.demonstrated, verdict.level) == (True, 3)
    assert verdict.text.startswith("SIL 3 demonstrated at 95 %")
    assert json.loads(json.dumps(verdict.to_dict()))["upper_per_h"] == verdict.upper_per_h


def test_the_bound_decides_not_the_value() -> None:
    estimate = poisson_bounds(1, 3e7, 0.95)
    assert sil_band(estimate.value) == 3
    assert sil_verdict(estimate).level == 2


def test_a_laboratory_record_demonstrates_nothing() -> None:
    verdict = sil_verdict(poisson_bounds(0, 3e5 / 3600, 0.95))
    assert (verdict.demonstrated, verdict.level) == (False, None)
    assert verdict.text.startswith("NOT DEMONSTRATED")


def test_below_the_last_band_there_is_a_note() -> None:
    assert any("no band" in note for note in sil_verdict(rate(9e-10)).notes)
    assert not any("no band" in note for note in sil_verdict(rate(1e-9)).notes)


@pytest.mark.parametrize("basis", [MODEL, CLAIM])
def test_models_and_claims_never_demonstrate(basis: Any) -> None:
    for upper in (1e-12, 5e-8, 1.0):
        estimate = rate(upper, basis)
        for verdict in (sil_verdict(estimate), meets(estimate, 1e-7)):
            assert not verdict.demonstrated
            assert verdict.text.startswith("NOT DEMONSTRATED")
            assert str(basis) in verdict.text
    assert "in the band of SIL 3" in sil_verdict(rate(5e-8, basis)).text
    assert "is below the target" in meets(rate(5e-8, basis), 1e-7).text
    assert "is not below the target" in meets(rate(1e-7, basis), 1e-7).text


def test_a_claim_without_bound_is_answered_in_words() -> None:
    estimate = rate(None, CLAIM, value=1e-7)
    assert sil_verdict(estimate).text.startswith("NOT DEMONSTRATED: a claim is no evidence")
    assert not meets(estimate, 1.0).demonstrated


def test_targets_are_missed_by_a_bound_on_them() -> None:
    assert meets(rate(math.nextafter(1e-7, 0)), 1e-7).demonstrated
    assert not meets(rate(1e-7), 1e-7).demonstrated


def test_a_missed_target_says_what_it_takes() -> None:
    verdict = meets(poisson_bounds(0, 83.3, 0.95, of="HMI events"), 1e-7)
    assert verdict.notes[-1] == (
        "with 0 HMI events this takes 2.996×10⁷ h (3,418 years); recorded are 83.3 h"
    )
    assert "upper bound 0.0359632/h at 95 % is not below the target of 1e-07/h" in verdict.text


def test_confidence_is_not_rounded_to_certainty() -> None:
    assert "99.9999999 %" in sil_verdict(poisson_bounds(0, 1e9, 0.999999999)).text


@pytest.mark.parametrize(
    "estimate",
    [
        rate(None),
        rate(None, MODEL),
        rate(5e-8, unit="1"),
        rate(5e-8, lower=0.0, sided="lower"),
        poisson_bounds(3, 100, 0.95, sided="lower"),
    ],
)
def test_estimates_that_carry_no_verdict(estimate: Estimate) -> None:
    with pytest.raises(InputError, match="a verdict needs"):
        sil_verdict(estimate)
    with pytest.raises(InputError, match="a verdict needs"):
        meets(estimate, 1e-7)


@pytest.mark.parametrize("target", [0, -1, math.nan, math.inf, "1e-7"])
def test_targets_that_are_none(target: Any) -> None:
    with pytest.raises(InputError, match="target_per_h"):
        meets(rate(5e-8), target)
