"""Hours to record, against the closed form and against the bound that they must give."""

from __future__ import annotations

import json
import math
from typing import Any

import mpmath as mp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.planning import pass_probability, plan_hours
from sbas.integrity.sil import meets


def test_hours_for_the_rate_of_sil_3() -> None:
    plan = plan_hours(1e-7)
    assert plan.hours == pytest.approx(-math.log(0.05) / 1e-7, rel=1e-14)
    assert plan.hours == pytest.approx(2.9957e7, rel=2e-5)
    assert plan.years == pytest.approx(3417, abs=0.5)
    assert plan.pass_probability is None


@pytest.mark.parametrize("events", [0, 1, 5, 40])
def test_a_true_rate_at_the_limit_passes_with_one_minus_the_confidence(events: int) -> None:
    # The definition of the bound: sum of the Poisson probabilities up to `events`, 40 digits.
    plan = plan_hours(1e-4, confidence=0.9, events=events, assumed_rate_per_h=1e-4)
    with mp.workdps(40):
        mean = mp.mpf(plan.hours) * mp.mpf(1e-4)
        chance = mp.exp(-mean) * sum(mean**k / mp.factorial(k) for k in range(events + 1))
    assert float(chance) == pytest.approx(0.1, rel=1e-12)
    assert plan.pass_probability == pytest.approx(float(chance), rel=1e-12)


def test_pass_probability_of_a_better_rate() -> None:
    plan = plan_hours(1e-7, assumed_rate_per_h=1e-8)
    assert plan.pass_probability == pytest.approx(0.05**0.1, rel=1e-12)
    assert plan_hours(1e-7, assumed_rate_per_h=0).pass_probability == 1
    assert pass_probability(0, 2.0, 3.0) == pytest.approx(math.exp(-6), rel=1e-14)


@given(
    rate=st.floats(-12, 2).map(lambda e: 10.0**e),
    confidence=st.floats(0.5, 0.999999),
    events=st.integers(0, 200),
)
def test_the_planned_trial_passes(rate: float, confidence: float, events: int) -> None:
    plan = plan_hours(rate, confidence=confidence, events=events)
    assert meets(poisson_bounds(events, plan.hours, confidence), rate).demonstrated
    shorter = poisson_bounds(events, plan.hours * (1 - 1e-12), confidence)
    assert not meets(shorter, rate).demonstrated
    assert not meets(poisson_bounds(events + 1, plan.hours, confidence), rate).demonstrated


def test_plan_reads_and_travels() -> None:
    plan = plan_hours(1e-7, events=3, assumed_rate_per_h=2e-8)
    assert "at most 3 events" in str(plan)
    assert "true rate is 2e-08/h" in str(plan)
    assert "without an event" in str(plan_hours(1e-7))
    assert "true rate is 1e-08/h, the trial passes with probability 0.741" in str(plan_hours(1e-7))
    plain = json.loads(json.dumps(plan.to_dict()))
    assert plain["hours"] == plan.hours
    assert plain["pass_probability"] == plan.pass_probability


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"rate_per_h": 0}, "rate to demonstrate"),
        ({"rate_per_h": math.nan}, "rate to demonstrate"),
        ({"rate_per_h": "1e-7"}, "rate to demonstrate"),
        ({"rate_per_h": 5e-324}, "no double holds these hours"),
        ({"rate_per_h": 1e-7, "confidence": 1}, "confidence"),
        ({"rate_per_h": 1e-7, "events": -1}, "whole number"),
        ({"rate_per_h": 1e-7, "events": 1.5}, "whole number"),
        ({"rate_per_h": 1e-7, "assumed_rate_per_h": -1e-9}, "assumed rate"),
        ({"rate_per_h": 1e-7, "assumed_rate_per_h": math.nan}, "assumed rate"),
    ],
)
def test_refusals(arguments: dict[str, Any], named: str) -> None:
    with pytest.raises(InputError, match=named):
        plan_hours(**arguments)
