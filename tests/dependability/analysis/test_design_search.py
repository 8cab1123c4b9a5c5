from __future__ import annotations

import json
from typing import Any

import pytest

from sbas.dependability.analysis.design_search import (
    DesignPoint,
    DesignSearch,
    design_search,
    file_parameters,
)
from sbas.dependability.exact.exact import solve
from sbas.dependability.tree.model import HybridFaultTree
from sbas.exceptions import InputError, ModelError
from tests.dependability.paper_models import localisation_unit


def build(**figures: Any) -> HybridFaultTree:
    if figures["k"] <= figures["l"]:
        raise ModelError("k must exceed l")
    return localisation_unit(mission_s=300.0, **figures)


def test_a_grid_of_the_unit() -> None:
    told: list[tuple[int, int]] = []
    grid = {"t2_s": [30.0, 60.0], "k": [2, 6, 10], "l": [2]}
    found = design_search(
        build, grid, target_per_h=0.1, hazard="C", progress=lambda *done: told.append(done)
    )
    assert told == [(i, 6) for i in range(1, 7)]
    assert [p.parameters["k"] for p in found.points] == [2, 6, 10, 2, 6, 10]
    assert [bool(p.refused) for p in found.points] == [True, False, False] * 2
    own = solve(build(t2_s=60.0, k=10, l=2))
    point = found.points[5]
    assert point.hazard_per_h == pytest.approx(own.occurrences_per_h("C"), rel=1e-12)
    assert point.unavailability == pytest.approx(own.top.mean_unavailability, rel=1e-12)
    # One run of k is a share a^(k - l) of the runs of l: 4 epochs more make the hazard rarer.
    assert {p.parameters["k"] for p in found.feasible} == {10}
    # A longer T2 leaves the hazard as it is and the unit more available.
    assert [p.parameters for p in found.pareto_front] == [{"t2_s": 60.0, "k": 10, "l": 2}]
    assert found.summary()["pareto"].tolist() == [False] * 5 + [True]
    json.loads(json.dumps(found.to_dict(), allow_nan=False))


def test_the_front_of_given_points() -> None:
    values = [(1e-6, 0.5), (2e-6, 0.2), (2e-6, 0.2), (3e-6, 0.3), (2e-6, 0.4), (4e-6, 0.1)]
    points = tuple(DesignPoint({"x": float(i)}, h, u, h < 3e-6) for i, (h, u) in enumerate(values))
    found = DesignSearch("h", 3e-6, (*points, DesignPoint({"x": 9.0}, None, None, False, "no")))
    assert [p.parameters["x"] for p in found.pareto_front] == [0.0, 1.0, 2.0, 5.0]
    assert [p.parameters["x"] for p in found.feasible] == [1.0, 2.0, 4.0, 0.0]


def test_parameters_of_the_papers_file() -> None:
    paper = file_parameters("galoroi", environment="urban")
    found = design_search(paper, {"k": [6], "T2_s": [60.0]}, target_per_h=1.0)
    # Page 10.5: W of case C in an hour, mean of the top.
    assert found.points[0].hazard_per_h == pytest.approx(0.38877, rel=1e-5)
    assert found.points[0].unavailability == pytest.approx(1.6386482e-4, rel=1e-7)
    with pytest.raises(InputError, match="no parameter"):
        design_search(paper, {"T3_s": [1.0]}, target_per_h=1.0)


def test_refusals() -> None:
    with pytest.raises(InputError, match="grid"):
        design_search(build, {}, target_per_h=1.0)
    with pytest.raises(InputError, match="grid"):
        design_search(build, {"k": []}, target_per_h=1.0)
    with pytest.raises(InputError, match="target"):
        design_search(build, {"k": [6]}, target_per_h=0.0)
