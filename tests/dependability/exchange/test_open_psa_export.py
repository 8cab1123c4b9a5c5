from __future__ import annotations

import pytest
from hypothesis import given

from sbas.dependability.exact.exact import solve
from sbas.dependability.exchange.open_psa import read_open_psa, read_open_psa_model
from sbas.dependability.exchange.open_psa_export import open_psa_text
from sbas.dependability.static.static_tree import static_tree_of, top_probability
from sbas.dependability.tree.model import Component, Failed, HybridFaultTree, Or
from sbas.exceptions import ModelError
from tests.dependability.exchange.hybrid_models import static_models, with_memory


@given(static_models())
def test_static_models_come_back_as_they_were(model: HybridFaultTree) -> None:
    exported = open_psa_text(model)
    assert not exported.report.lost
    assert read_open_psa_model(exported.text.encode()).model == model


@given(static_models())
def test_the_static_tree_of_a_file_is_that_of_the_model(model: HybridFaultTree) -> None:
    tree = read_open_psa(open_psa_text(model).text.encode()).tree
    assert float(top_probability(tree)) == float(top_probability(static_tree_of(model)))


def test_gates_with_memory_are_refused_by_name() -> None:
    with pytest.raises(ModelError, match="Open-PSA cannot hold 3 elements") as caught:
        open_psa_text(with_memory())
    assert all(name in caught.value.evidence for name in ("wrong", "two", "three"))
    with pytest.raises(ModelError, match="on_loss = 'drop' is unknown"):
        open_psa_text(with_memory(), on_loss="drop")  # type: ignore[arg-type]


def test_flattened_elements_carry_their_point_probability_and_say_what_they_share() -> None:
    model = with_memory()
    exported = open_psa_text(model, on_loss="flatten")
    tree = read_open_psa(exported.text.encode(), mission_s=30).tree
    rows = solve(model).rows
    p = tree.probabilities()
    assert p["two"] == rows["two"].at_end
    assert p["three"] == rows["three"].at_end
    assert p["a"] == pytest.approx(rows["a"].at_end, rel=1e-12)
    assert "wrong" not in p
    told = {loss.element: loss for loss in exported.report.lost}
    assert told["two"].treatment == "flattened"
    assert "A, O with three" in told["two"].consequence
    assert "A with a" in told["two"].consequence
    assert told["wrong"].treatment == "refused"
    assert told["unused"].construct == "component without an event"
    assert told["runs"].construct == "options, notes and sources of figures"
    # Taken as independent, the shared source is wrong, and the report says so.
    assert float(top_probability(tree)) != pytest.approx(rows["T"].at_end, rel=1e-3)


def test_a_second_event_on_a_component_is_the_same_event() -> None:
    model = HybridFaultTree(
        "twice", 1, 60, (Component("A", 1.0),), (), (Failed("x", "A"), Failed("y", "A")),
        (Or("T", ("x", "y")),), "T",
    )  # fmt: skip
    exported = open_psa_text(model)
    tree = read_open_psa(exported.text.encode()).tree
    assert float(top_probability(tree)) == float(top_probability(static_tree_of(model)))
    assert "second event on a component" in exported.report.summary()["construct"].tolist()


def test_numbers_have_seventeen_digits() -> None:
    model = HybridFaultTree(
        "digits", 1, 60, (Component("A", 0.1),), (), (Failed("x", "A"),), (Or("T", ("x",)),), "T"
    )
    assert 'value="0.10000000000000001"' in open_psa_text(model).text
