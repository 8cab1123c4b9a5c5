from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given

from sbas.dependability.exact.exact import solve
from sbas.dependability.exchange.galileo import read_galileo
from sbas.dependability.exchange.galileo_export import galileo_text
from sbas.dependability.tree.model import Component, Failed, House, HybridFaultTree, Not, Or, Pand
from sbas.exceptions import ModelError
from tests.dependability.exchange.hybrid_models import static_models, with_memory


@given(static_models(plain=True))
def test_what_the_format_holds_comes_back_as_it_was(model: HybridFaultTree) -> None:
    text = galileo_text(model, time_unit="h").text
    again = read_galileo(
        text.encode(), time_unit="h", step_s=model.step_s, mission_s=model.mission_s
    ).model
    assert replace(again, name=model.name) == model


def ordered(*, repair: float = 0.0, exclusive: bool | None = None) -> HybridFaultTree:
    return HybridFaultTree(
        "ordered", 1, 60,
        (Component("x-hardware", 1.0, repair), Component("y-hardware", 2.0)), (),
        (Failed("x", "x-hardware"), Failed("y", "y-hardware")),
        (Pand("T", ("x", "y"), False, exclusive),), "T",
    )  # fmt: skip


def test_priority_and_of_what_is_not_repaired() -> None:
    for exclusive, kind in ((None, "pand-incl"), (False, "pand-incl"), (True, "pand-excl")):
        model = ordered(exclusive=exclusive)
        text = galileo_text(model, time_unit="h").text
        assert f'"T" {kind} "x" "y";' in text
        again = read_galileo(text.encode(), time_unit="h", step_s=1, mission_s=60).model
        assert again.gates == (Pand("T", ("x", "y"), False, bool(exclusive)),)


def test_repair_needs_its_dialect_and_order_does_not_survive_it() -> None:
    model = replace(ordered(repair=0.5), gates=(Or("T", ("x", "y")),))
    with pytest.raises(ModelError, match="Galileo cannot hold 1 elements"):
        galileo_text(model, time_unit="h")
    text = galileo_text(model, time_unit="min", dialect="dftcalc").text
    again = read_galileo(text.encode(), time_unit="min", step_s=1, mission_s=60).model
    assert again.components[0].repair_rate_per_h == pytest.approx(0.5, rel=1e-15)
    with pytest.raises(ModelError, match="priority and"):
        galileo_text(ordered(repair=0.5), time_unit="h", dialect="dftcalc")
    flat = galileo_text(ordered(repair=0.5), time_unit="h", dialect="dftcalc", on_loss="flatten")
    assert f'"T" prob={solve(ordered(repair=0.5)).top.at_end:.17g};' in flat.text


def test_negation_and_memory_are_refused_or_flattened() -> None:
    model = HybridFaultTree(
        "negated", 1, 60, (Component("A", 1.0),), (), (Failed("x", "A"), House("h", True)),
        (Not("n", "x"), Or("T", ("n", "h"))), "T",
    )  # fmt: skip
    with pytest.raises(ModelError, match="n \\(not"):
        galileo_text(model, time_unit="h")
    told = {loss.element: loss for loss in galileo_text(
        model, time_unit="h", on_loss="flatten").report.lost}  # fmt: skip
    assert told["n"].treatment == "flattened"
    assert told["h"].treatment == "approximated"
    shared = galileo_text(with_memory(), time_unit="h", on_loss="flatten").report
    assert any("A, O with three" in loss.consequence for loss in shared.lost)


@pytest.mark.parametrize("name", ['a"b', "a;b", "a//b"])
def test_names_that_would_end_a_statement_are_refused(name: str) -> None:
    model = HybridFaultTree(
        "n", 1, 60, (Component("A", 1.0),), (), (Failed(name, "A"),), (Or("T", (name,)),), "T"
    )
    with pytest.raises(ModelError, match="cannot stand in a Galileo file"):
        galileo_text(model, time_unit="h")


def test_options_are_among_those_known() -> None:
    with pytest.raises(ModelError, match="dialect = 'other'"):
        galileo_text(ordered(), time_unit="h", dialect="other")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="time_unit = 'week'"):
        galileo_text(ordered(), time_unit="week")  # type: ignore[arg-type]
