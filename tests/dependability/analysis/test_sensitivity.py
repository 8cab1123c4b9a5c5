"""Elasticities: closed forms, and the values printed for the paper's unit."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest

from sbas.dependability.analysis.sensitivity import sensitivities
from sbas.dependability.tree.model import (
    And,
    HybridFaultTree,
    InState,
    MarkovSource,
    Or,
    Undeveloped,
)
from sbas.exceptions import ModelError
from tests.dependability.analysis.small_models import hardware_tree
from tests.dependability.paper_models import localisation_unit


def test_paper_unit() -> None:
    found = sensitivities(localisation_unit())
    for name, printed, digit in (
        ("fusion", 0.01824, 5e-6), ("receiver", 0.01189, 5e-6), ("antenna", 0.01166, 5e-6),
        ("ecs", 9.9e-5, 5e-7),
    ):  # fmt: skip
        row = found[f"{name}.failure_rate_per_h"]
        assert row.elasticity == pytest.approx(printed, abs=digit)
        assert row.error < 1e-8
    repair = sum(row.elasticity for row in found.rows if "repair" in row.parameter)
    assert repair == pytest.approx(-5.4e-4, abs=5e-6)


def test_no_repair_at_the_end_in_closed_form() -> None:
    model = hardware_tree({"x": 0.02, "y": 0.3}, And("T", ("X", "Y")))
    found = sensitivities(model, measure="at_end")
    for name, rate in (("x", 0.02), ("y", 0.3)):
        expected = 5 * rate * math.exp(-5 * rate) / -math.expm1(-5 * rate)
        row = found[f"{name}.failure_rate_per_h"]
        assert row.elasticity == pytest.approx(expected, rel=1e-9)
        assert abs(row.elasticity - expected) < row.error
    assert "x.repair_rate_per_h" in found.left_out
    once = sensitivities(model, measure="at_least_once")
    assert once["x.failure_rate_per_h"].elasticity == pytest.approx(
        found["x.failure_rate_per_h"].elasticity, rel=1e-9
    )


def one_step(*row: float) -> HybridFaultTree:
    states = ("good", "bad", "worse")[: len(row)]
    rows = (row, *(tuple(float(i == j) for j in range(len(row))) for i in range(1, len(row))))
    source = MarkovSource("S", states, rows, (1.0, *([0.0] * (len(row) - 1))))
    model = hardware_tree({}, Or("T", ("BAD",)), epochs=1)
    return replace(model, sources=(source,), events=(InState("BAD", "S", ("bad",)),))


def test_moves_of_a_source_in_closed_form() -> None:
    found = sensitivities(one_step(0.9, 0.06, 0.04))
    assert found["S.good -> bad"].elasticity == pytest.approx(1.0, rel=1e-9)
    assert found["S.good -> worse"].elasticity == pytest.approx(-0.04 / 0.96, rel=1e-8)
    assert found["S.good -> good"].elasticity == pytest.approx(-0.9 / 0.1, rel=1e-8)
    assert found["S.good -> good"].value == 0.9
    assert {"S.bad -> good", "S.bad -> bad"} <= set(found.left_out)


def test_a_stay_close_to_one() -> None:
    found = sensitivities(one_step(0.9999, 0.0001))
    row = found["S.good -> good"]
    assert row.elasticity == pytest.approx(-9999.0, rel=1e-6)
    assert abs(row.elasticity + 9999.0) < row.error


def test_phases_of_a_state_change_together() -> None:
    states, rows = ("good", "bad", "bad"), ((0.5, 0.2, 0.3), (0, 1, 0), (0, 0, 1))
    source = MarkovSource("S", states, rows, (1.0, 0.0, 0.0))
    model = replace(one_step(0.5, 0.5), sources=(source,))
    found = sensitivities(model)["S.good -> bad"]
    assert found.value == 0.5
    assert found.elasticity == pytest.approx(1.0, rel=1e-9)


def test_probability_of_what_was_not_analysed() -> None:
    model = hardware_tree({"x": 0.02}, Or("T", ("X", "U")), epochs=1)
    model = replace(model, events=(*model.events, Undeveloped("U", 0.1)))
    x = -math.expm1(-0.02)
    found = sensitivities(model)
    assert found["U.probability"].elasticity == pytest.approx(0.1 * (1 - x) / (0.1 + 0.9 * x))
    assert found.rows[0].parameter == "U.probability"
    assert found.summary().index[0] == "U.probability"
    assert json.loads(json.dumps(found.to_dict()))["of"] == "T"


def test_zero_has_no_logarithm() -> None:
    with pytest.raises(ModelError, match="no elasticity"):
        sensitivities(hardware_tree({"x": 0.0}, Or("T", ("X",))))
