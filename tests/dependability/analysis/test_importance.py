"""Importance: by hand, by the static tree, by every history of a dynamic one."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from sbas.dependability.analysis.importance import importance
from sbas.dependability.static.static_importance import static_importance
from sbas.dependability.static.static_tree import static_tree_of
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Con,
    Dur,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Options,
    Or,
    Pand,
    Undeveloped,
)
from sbas.exceptions import InputError, ModelError
from tests.dependability.analysis.small_models import hardware_tree
from tests.dependability.path_enumeration import by_paths

RATES = {"x": 0.02, "y": 0.3}


def failed(rate: float, hours: float) -> float:
    return -math.expm1(-rate * hours)


def test_and_at_the_end_by_hand() -> None:
    found = importance(hardware_tree(RATES, And("T", ("X", "Y"))), measure="at_end")
    x, y = failed(0.02, 5), failed(0.3, 5)
    row = found["X"]
    assert found.probability == pytest.approx(x * y, rel=1e-12)
    assert row.birnbaum == pytest.approx(y, rel=1e-12)
    assert row.criticality == pytest.approx(1.0, rel=1e-12)
    assert row.diagnostic == pytest.approx(1.0, rel=1e-12)
    assert row.raw == pytest.approx(1 / x, rel=1e-12)
    assert row.rrw == math.inf
    assert row.fussell_vesely == pytest.approx(1.0, rel=1e-12)
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["rows"][0]["rrw"] is None


def test_or_at_the_end_by_hand() -> None:
    found = importance(hardware_tree(RATES, Or("T", ("X", "Y"))), measure="at_end")
    x, y = failed(0.02, 5), failed(0.3, 5)
    p = x + (1 - x) * y
    row = found["X"]
    assert row.birnbaum == pytest.approx(1 - y, rel=1e-12)
    assert row.criticality == pytest.approx(x * (1 - y) / p, rel=1e-12)
    assert row.diagnostic == pytest.approx(x / p, rel=1e-12)
    assert row.raw == pytest.approx(1 / p, rel=1e-12)
    assert row.rrw == pytest.approx(p / y, rel=1e-12)
    assert row.fussell_vesely == pytest.approx(x / p, rel=1e-12)


def test_means_of_an_and_by_hand() -> None:
    found = importance(hardware_tree(RATES, And("T", ("X", "Y"))))
    x, y = (np.array([failed(rate, n) for n in range(1, 6)]) for rate in RATES.values())
    row = found["X"]
    assert row.birnbaum == pytest.approx(y.mean(), rel=1e-12)
    assert row.probability == pytest.approx(x.mean(), rel=1e-12)
    assert row.criticality == pytest.approx(x.mean() * y.mean() / (x * y).mean(), rel=1e-12)
    assert row.diagnostic == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("rule", ["epochs", "left", "trapezoid", "integral"])
def test_every_share_of_an_and_is_whole_by_every_mean(rule: str) -> None:
    options = Options(mean_rule=rule)  # type: ignore[arg-type]
    found = importance(hardware_tree(RATES, And("T", ("X", "Y")), options=options))
    for row in found.rows:
        assert row.diagnostic == pytest.approx(1.0, rel=1e-11)
        if row.kind == "event":
            assert row.fussell_vesely == pytest.approx(1.0, rel=1e-11)


def test_static_tree_with_shared_events() -> None:
    model = hardware_tree(
        {"x": 0.02, "y": 0.3, "z": 0.1, "w": 1e-4},
        AtLeast("G", 2, ("X", "Y", "Z")),
        And("H", ("W", "X")),
        Or("T", ("G", "H", "UE")),
        repair_rate_per_h=0.4,
    )
    model = replace(model, events=(*model.events, Undeveloped("UE", 1e-3)))
    expected = {row.event: row for row in static_importance(static_tree_of(model)).events}
    found = importance(model, measure="at_end")
    for row in found.rows:
        if row.kind == "component":
            continue
        other = expected[row.name]
        for name in ("probability", "birnbaum", "criticality", "diagnostic", "raw", "rrw"):
            assert getattr(row, name) == pytest.approx(getattr(other, name), rel=1e-9), name
        assert row.fussell_vesely == pytest.approx(other.fussell_vesely, rel=1e-9)
    assert list(found.summary().index[:5]) == [row.name for row in found.rows[:5]]


def test_of_a_gate_below_the_top() -> None:
    model = hardware_tree(RATES, And("G", ("X", "Y")), Or("T", ("G", "X")))
    assert importance(model, of="G") == importance(replace(model, top="G", gates=model.gates[:1]))


def dynamic_model() -> HybridFaultTree:
    source = MarkovSource(
        "S", ("good", "bad"), ((0.7, 0.3), (0.4, 0.6)), (0.9, 0.1), guard=("x",), restart="first"
    )
    model = hardware_tree(
        RATES,
        Con("C", 2, "BAD"),
        Pand("P", ("Y", "C")),
        Dur("D", 3600.0, "X"),
        Or("T", ("P", "D")),
        repair_rate_per_h=0.5,
        epochs=4,
    )
    return replace(model, sources=(source,), events=(*model.events, InState("BAD", "S", ("bad",))))


@pytest.mark.parametrize("measure", ["mean", "at_end"])
def test_dynamic_tree_by_every_history(measure: str) -> None:
    model = dynamic_model()

    def figure(changed: HybridFaultTree, name: str) -> float:
        on = by_paths(changed)[name].on
        return float(on[-1] if measure == "at_end" else on[1:].mean())

    found = importance(model, measure=measure)  # type: ignore[arg-type]
    p_top = figure(model, "T")
    assert found.probability == pytest.approx(p_top, rel=1e-11)
    for name in ("X", "Y", "BAD"):
        given = [
            figure(
                replace(
                    model,
                    events=tuple(House(name, v) if e.name == name else e for e in model.events),
                ),
                "T",
            )
            for v in (True, False)
        ]
        both = figure(replace(model, gates=(*model.gates, And("both", (name, "T")))), "both")
        row = found[name]
        assert row.given_true == pytest.approx(given[0], rel=1e-11)
        assert row.given_false == pytest.approx(given[1], rel=1e-11, abs=1e-300)
        assert row.birnbaum == pytest.approx(given[0] - given[1], rel=1e-10)
        assert row.diagnostic == pytest.approx(both / p_top, rel=1e-10)
        assert row.fussell_vesely is None
    held = [
        replace(model, components=(Component("x", 0.0, 0.0, p), model.components[1]))
        for p in (1.0, 0.0)
    ]
    row = found["x"]
    assert row.kind == "component"
    assert row.given_true == pytest.approx(figure(held[0], "T"), rel=1e-11)
    assert row.given_false == pytest.approx(figure(held[1], "T"), rel=1e-11)
    assert row.diagnostic == pytest.approx(found["X"].diagnostic, rel=1e-11)


def test_a_difference_that_is_rounding_is_not_given() -> None:
    model = hardware_tree(
        {"x": 0.5, "y": 1e-12, "z": 1e-12}, And("G", ("Y", "Z")), Or("T", ("X", "G"))
    )
    row = importance(model, measure="at_end")["Y"]
    assert row.birnbaum is None
    assert row.criticality is None
    assert row.fussell_vesely == pytest.approx(2.5e-23 / failed(0.5, 5), rel=1e-6)


def test_non_coherent_trees_have_no_fussell_vesely() -> None:
    model = hardware_tree(RATES, Not("N", "Y"), And("T", ("X", "N")))
    row = importance(model, measure="at_end")["Y"]
    assert row.fussell_vesely is None
    assert row.birnbaum == pytest.approx(-failed(0.02, 5), rel=1e-12)


def test_refusals() -> None:
    never = hardware_tree({"x": 0.0, "y": 1.0}, And("T", ("X", "Y")))
    with pytest.raises(ModelError, match="probability zero"):
        importance(never)
    model = hardware_tree(RATES, And("T", ("X", "Y")))
    with pytest.raises(InputError, match="no event or gate"):
        importance(model, of="nobody")
    with pytest.raises(InputError, match="a mean or of the end"):
        importance(model, measure="at_least_once")  # type: ignore[arg-type]
