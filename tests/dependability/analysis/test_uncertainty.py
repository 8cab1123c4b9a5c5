"""Uncertain parameters through the exact solution, held against closed forms."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from sbas.dependability.analysis.asked_measure import Measure
from sbas.dependability.analysis.parameter_laws import (
    DirichletRows,
    Fixed,
    Lognormal,
    RateFromCounts,
)
from sbas.dependability.analysis.uncertainty import Laws, latin_hypercube, uncertainty
from sbas.dependability.tree.model import And, HybridFaultTree, InState, MarkovSource, Or
from sbas.estimate import Counted, Estimate
from sbas.exceptions import InputError
from tests.dependability.analysis.small_models import hardware_tree

PAIR = hardware_tree({"x": 0.02, "y": 0.3}, And("T", ("X", "Y")))


def generator() -> np.random.Generator:
    return np.random.default_rng(20261122)


def test_gamma_rate_in_closed_form() -> None:
    law = RateFromCounts(3, 200.0)
    found = uncertainty(
        PAIR, {"x.failure_rate_per_h": law}, rng=generator(), names=("X", "T"), measure="at_end"
    )
    row = found["X"]
    # E[exp(-rate t)] of a gamma law: (h/(h + t))^shape.
    mean = 1.0 - (200.0 / 205.0) ** 4
    assert row.mean == pytest.approx(mean, abs=5 * row.mean_error)
    assert row.mean_error < 0.002 * mean
    for q, point, error in (
        (0.05, row.p05, row.p05_error), (0.5, row.p50, row.p50_error),
        (0.95, row.p95, row.p95_error),
    ):  # fmt: skip
        exact = -math.expm1(-5.0 * stats.gamma.ppf(q, 4) / 200.0)
        assert point == pytest.approx(exact, abs=5 * error)
    assert row.nominal == pytest.approx(-math.expm1(-0.1))
    y = -math.expm1(-1.5)
    assert found["T"].mean == pytest.approx(row.mean * y, rel=1e-9)


def test_one_parameter_one_sample() -> None:
    law = Lognormal(0.02, 3.0)
    both = ("x.failure_rate_per_h", "y.failure_rate_per_h")
    shared = uncertainty(PAIR, {both: law}, rng=generator(), samples=200, measure="at_end")
    assert np.array_equal(shared.drawn[both[0]], shared.drawn[both[1]])
    squares = np.expm1(-5.0 * shared.drawn[both[0]]) ** 2
    assert shared.values["T"] == pytest.approx(squares, rel=1e-9)
    apart = uncertainty(
        PAIR, dict.fromkeys(both, law), rng=generator(), samples=200, measure="at_end"
    )
    assert abs(np.corrcoef(np.array(list(apart.drawn.values())))[0, 1]) < 0.35
    assert apart["T"].mean < shared["T"].mean


def test_what_is_known_does_not_scatter() -> None:
    found = uncertainty(PAIR, {"x.failure_rate_per_h": Fixed(0.02)}, rng=generator(), samples=100)
    row = found["T"]
    assert row.p05 == row.p95 == pytest.approx(row.nominal, rel=1e-12)
    assert row.mean_error <= 1e-15
    assert json.loads(json.dumps(found.to_dict()))["samples"] == 100
    assert list(found.summary().index) == ["T"]


def two_states() -> HybridFaultTree:
    source = MarkovSource("S", ("good", "bad"), ((0.9, 0.1), (0.5, 0.5)), (1.0, 0.0))
    model = hardware_tree({}, Or("T", ("BAD",)), epochs=1)
    return replace(model, sources=(source,), events=(InState("BAD", "S", ("bad",)),))


def test_rows_from_counts() -> None:
    law = DirichletRows(((18.5, 2.5), (1.5, 1.5)))
    found = uncertainty(two_states(), {"S.rows": law}, rng=generator())["T"]
    assert found.mean == pytest.approx(2.5 / 21, abs=5 * found.mean_error)
    assert found.p95 == pytest.approx(stats.beta.ppf(0.95, 2.5, 18.5), abs=5 * found.p95_error)


def test_an_estimate_goes_in_as_it_is() -> None:
    counted = Estimate(0.02, None, None, None, "per_h", Counted(4, 200.0))
    known: Laws = {"x.failure_rate_per_h": RateFromCounts(4, 200.0)}
    a = uncertainty(PAIR, {"x.failure_rate_per_h": counted}, rng=generator(), samples=100)
    b = uncertainty(PAIR, known, rng=generator(), samples=100)
    assert a.rows == b.rows


def test_progress_and_every_measure() -> None:
    measures: tuple[Measure, ...] = ("mean", "at_end", "at_least_once", "occurrences_per_h")
    calls: list[tuple[int, int]] = []
    laws: Laws = {"x.failure_rate_per_h": RateFromCounts(4, 200.0)}
    means = [
        uncertainty(
            PAIR, laws, rng=generator(), samples=100, measure=measure,
            progress=lambda done, total: calls.append((done, total)),
        )["T"].mean
        for measure in measures
    ]  # fmt: skip
    assert calls[:100] == [(i, 100) for i in range(1, 101)]
    # Without repair the AND stays true: first passage = probability at the end = 5 h of W/T.
    assert means[1] == pytest.approx(means[2], rel=1e-9)
    assert means[1] == pytest.approx(5 * means[3], rel=1e-9)
    assert means[0] < means[1]


def test_latin_hypercube_has_a_point_in_each_slice() -> None:
    points = latin_hypercube(50, 3, generator())
    for column in points.T:
        assert sorted((column * 50).astype(int)) == list(range(50))
    assert len(np.unique(points[:, 0] - points[:, 1])) == 50


@pytest.mark.parametrize(
    ("laws", "said"),
    [
        ({"x.failure_rate": Fixed(1.0)}, "no parameter of that name"),
        ({"x.failure_rate_per_h": Fixed(1.0), ("x.failure_rate_per_h",): Fixed(1.0)}, "two laws"),
        ({"x.failure_rate_per_h": DirichletRows(((1.0,),))}, "for a single figure"),
        ({"x.initially_failed": RateFromCounts(1, 2.0)}, "for a probability"),
        ({"x.initially_failed": Fixed(2.0)}, "for a probability"),
    ],
)
def test_refusals(laws: Laws, said: str) -> None:
    with pytest.raises(InputError, match=said):
        uncertainty(PAIR, laws, rng=generator())


def test_refusals_of_rows_and_samples() -> None:
    with pytest.raises(InputError, match="another size"):
        uncertainty(two_states(), {"S.rows": DirichletRows(((1.0,),))}, rng=generator())
    with pytest.raises(InputError, match="for rows"):
        uncertainty(two_states(), {"S.rows": Fixed(1.0)}, rng=generator())
    with pytest.raises(InputError, match="samples"):
        uncertainty(PAIR, {}, rng=generator(), samples=99)
    with pytest.raises(InputError, match="to follow"):
        uncertainty(PAIR, {}, rng=generator(), names=())
