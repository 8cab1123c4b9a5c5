"""Strata cover all sets of failing components, or say how much they leave out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.dependability.simulation.forced_failures import choose_strata, failure_probability
from sbas.dependability.tree.model import (
    And,
    Component,
    Failed,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Options,
)
from sbas.exceptions import InputError
from tests.dependability.paper_models import check_unit, localisation_unit


def parallel(count: int, rate: float) -> HybridFaultTree:
    names = [f"c{i}" for i in range(count)]
    return HybridFaultTree(
        "parallel", 1.0, 3600.0, tuple(Component(n, rate) for n in names), (),
        tuple(Failed(f"{n} failed", n) for n in names),
        (And("all", tuple(f"{n} failed" for n in names)),), "all",
    )  # fmt: skip


def test_weights_of_all_sets_sum_to_1() -> None:
    strata, possible, unsampled = choose_strata(localisation_unit(), 10_000, None)
    assert len(strata) == 16
    assert math.fsum(s.weight for s in strata) == pytest.approx(1.0, abs=1e-15)
    assert sum(s.histories for s in strata) == pytest.approx(10_000, abs=16)
    assert not unsampled.any()
    chance = {c.name: failure_probability(c, 3600.0) for c in localisation_unit().components}
    pair = next(s for s in strata if set(s.failing) == {"ecs", "antenna"})
    assert pair.weight == pytest.approx(
        chance["ecs"] * chance["antenna"] * math.exp(-10.14e-6), rel=1e-12
    )
    assert possible.shape == (16, 18)


def test_the_set_in_which_nothing_can_happen_is_left_out() -> None:
    strata, _, _ = choose_strata(parallel(3, 1e-6), 10_000, None)
    assert [len(s.failing) for s in strata] == [1, 1, 1, 2, 2, 2, 3]


def test_larger_sets_of_many_components_are_bounded() -> None:
    strata, _, unsampled = choose_strata(parallel(20, 1e-6), 10_000, None)
    assert max(len(s.failing) for s in strata) == 1
    # Two or more of 20: 190 pairs of 1e-12, and the binomial terms beyond.
    p = failure_probability(Component("c", 1e-6), 3600.0)
    exact = sum(math.comb(20, i) * p**i * (1 - p) ** (20 - i) for i in range(2, 21))
    assert unsampled[0] == pytest.approx(exact, rel=1e-12)


def test_likely_failures_are_left_to_themselves() -> None:
    strata, _, _ = choose_strata(check_unit(), 10_000, None)
    assert [(s.failing, s.weight) for s in strata] == [((), 1.0)]


def test_a_row_is_impossible_only_where_nothing_can_bring_it_about() -> None:
    model = HybridFaultTree(
        "source", 1.0, 10.0, (Component("c", 1e-6),),
        (MarkovSource("s", ("good", "bad"), ((0.9, 0.1), (0.5, 0.5)), (1.0, 0.0), ("c",)),
         MarkovSource("t", ("good", "bad"), ((1.0, 0.0), (0.5, 0.5)), (1.0, 0.0)),),
        (Failed("failed", "c"), InState("bad", "s", ("bad",)), InState("down", "s", ("down",)),
         InState("never", "t", ("bad",))),
        (Not("works", "failed"), And("both", ("failed", "bad"))), "both",
    )  # fmt: skip
    strata, possible, _ = choose_strata(model, 1000, None)
    by_set = {s.failing: p.tolist() for s, p in zip(strata, possible, strict=True)}
    #                  failed  bad  down   never  works both
    assert by_set[()] == [False, True, False, False, True, False]
    assert by_set[("c",)] == [True, True, True, False, True, True]


@pytest.mark.parametrize(
    ("force", "match"),
    [
        ([("nobody",)], "names components"),
        ([("ecs", "ecs")], "each once"),
        ([("ecs",), ("ecs",)], "stands twice"),
    ],
)
def test_sets_that_cannot_be_are_refused(force: list[tuple[str, ...]], match: str) -> None:
    with pytest.raises(InputError, match=match):
        choose_strata(localisation_unit(options=Options()), 1000, force)


def test_named_sets_leave_other_components_free() -> None:
    strata, _, unsampled = choose_strata(localisation_unit(), 1000, [("ecs",), ()])
    assert {s.failing: s.never for s in strata} == {("ecs",): (), (): ("ecs",)}
    assert not np.any(unsampled)
