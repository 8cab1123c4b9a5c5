from __future__ import annotations

import math

import pytest

from sbas.dependability.analysis.hazard_verdict import (
    hazard_verdict,
    rate_of_and,
    rate_of_or,
    rate_verdict,
)
from sbas.dependability.exact.exact import solve
from sbas.dependability.exact.long_missions import steady_state
from sbas.dependability.tree.model import And, Component, Failed, House, HybridFaultTree, Or
from sbas.exceptions import InputError
from tests.dependability.paper_models import localisation_unit


@pytest.mark.parametrize(
    ("rate", "sil", "meets"),
    [
        (9.999999e-10, 4, True), (1e-9, 4, True), (9.99e-9, 4, True),
        (1e-8, 3, False), (1e-7, 2, False), (1e-6, 1, False), (1e-5, None, False),
    ],
)  # fmt: skip
def test_bands_are_half_open_and_a_tie_does_not_meet(
    rate: float, sil: int | None, meets: bool
) -> None:
    verdict = rate_verdict(rate, "wrong output", thr_per_h=1e-8)
    assert (verdict.sil, verdict.meets) == (sil, meets)
    assert ("does not meet the THR of 1e-08/h" in verdict.text) is not meets
    assert ("no SIL" in verdict.text) is (sil is None)


def test_the_rate_is_of_occurrences_not_the_mean() -> None:
    # Urban, page 10.5: W = 0.38877 in an hour, mean 1.57e-4.
    verdict = hazard_verdict(solve(localisation_unit(), names=["C"]), "C", thr_per_h=1e-3)
    assert verdict.rate_per_h == pytest.approx(0.3887700, rel=1e-6)
    assert (verdict.meets, verdict.sil) == (False, None)


def test_a_hazard_that_is_there_from_the_start_is_an_occurrence() -> None:
    always = HybridFaultTree("m", 1.0, 7200.0, (), (), (House("h", True),), (Or("t", ("h",)),), "t")
    solution = solve(always)
    assert solution.occurrences_per_h("t") == 0.0
    assert hazard_verdict(solution, "t").rate_per_h == 0.5
    assert hazard_verdict(solution, "t").meets is None


def test_and_of_repairable_functions_is_the_bound_of_the_long_run() -> None:
    # Exact: each fails at FR/(1 + FR SDT) in the long run, the other is down FR SDT/(1 + FR SDT).
    rates, downs = (2e-4, 5e-4), (10.0, 4.0)
    model = HybridFaultTree(
        "pair", 1.0, 3600.0,
        (Component("c0", rates[0], 1.0 / downs[0]), Component("c1", rates[1], 1.0 / downs[1])),
        (), (Failed("a", "c0"), Failed("b", "c1")), (And("t", ("a", "b")),), "t",
    )  # fmt: skip
    bound = rate_of_and(rates[0], downs[0], rates[1], downs[1])
    assert bound == pytest.approx(1.4e-6, rel=1e-14)
    exact = bound / math.prod(1.0 + r * d for r, d in zip(rates, downs, strict=True))
    # Between epochs a failure may be repaired unseen: 1e-4 of the shortest down time.
    assert steady_state(model)["t"].occurrences_per_h == pytest.approx(exact, rel=2e-4)


def test_an_or_adds() -> None:
    assert rate_of_or([1e-9, 2e-9, 3e-9]) == pytest.approx(6e-9, rel=1e-15)
    assert rate_of_or([]) == 0.0


def test_refusals() -> None:
    solution = solve(localisation_unit(mission_s=60.0), names=["C"])
    with pytest.raises(InputError, match="no row"):
        hazard_verdict(solution, "Case C")
    for thr in (0.0, -1e-8, math.nan, math.inf):
        with pytest.raises(InputError, match="tolerable"):
            rate_verdict(1e-9, "C", thr_per_h=thr)
    with pytest.raises(InputError):
        rate_verdict(math.nan, "C")
    for bad in (-1.0, math.nan, math.inf):
        with pytest.raises(InputError):
            rate_of_or([1e-9, bad])
        with pytest.raises(InputError):
            rate_of_and(1e-5, bad, 1e-5, 1.0)
