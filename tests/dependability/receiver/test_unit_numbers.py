"""Numbers of the paper's tree, however it is written; everything else is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from sbas.dependability.receiver.unit_numbers import unit_numbers
from sbas.dependability.tree.model import (
    CausalAnd,
    Con,
    Failed,
    HybridFaultTree,
    InState,
    Or,
    Pand,
    Stage,
    Undeveloped,
)
from sbas.exceptions import ModelError
from tests.dependability.galoroi_tree import STAY, galoroi_tree


def with_nodes(tree: HybridFaultTree, **nodes: Any) -> HybridFaultTree:
    """The tree with nodes of these names in place of its own."""
    return replace(
        tree,
        events=tuple(nodes.get(e.name, e) for e in tree.events),
        gates=tuple(nodes.get(g.name, g) for g in tree.gates),
    )


def test_the_paper() -> None:
    found = unit_numbers(galoroi_tree())
    assert (found.d1, found.d2, found.k, found.l) == (4, 61, 6, 2)
    assert (found.ecs.name, [c.name for c in found.guard]) == ("ecs", ["antenna", "receiver"])
    assert found.fusion is not None
    assert found.fusion.name == "fusion"
    assert (found.epochs, found.wait, found.order, found.ie6) == (3600, 180, (0, 1, 2), "pand")


def test_other_ways_to_write_it() -> None:
    tree = galoroi_tree()
    usual = unit_numbers(tree)
    whole = InState("IE3", "gnss", ("missing", "down"))
    gates = tuple(g for g in tree.gates if g.name not in ("IE3", "IE4"))
    assert unit_numbers(replace(tree, events=(*tree.events, whole), gates=gates)) == usual
    turned = with_nodes(tree, IE1=CausalAnd("IE1", 3.0, ("IE3", "BE2")))
    assert unit_numbers(turned) == usual
    named = replace(
        tree,
        sources=(replace(tree.sources[0], waiting="first_fix"),),
        events=(*tree.events, InState("TTFF", "gnss", ("first_fix",))),
    )
    named = with_nodes(named, IE3=Or("IE3", ("BE5", "IE4", "TTFF")))
    assert unit_numbers(named).d2 == 61
    assert unit_numbers(galoroi_tree(ie6="and")).ie6 == "and"
    assert unit_numbers(galoroi_tree(ie6="joint")).l == 2
    assert unit_numbers(galoroi_tree(pand_exclusive=True)).ie6 == "pand_exclusive"
    assert unit_numbers(galoroi_tree(dur_rule="strict")).d1 == 5


def test_a_top_of_another_form_is_not_predicted() -> None:
    more = with_nodes(galoroi_tree(), UE=Undeveloped("UE", 1e-6))
    assert unit_numbers(more).fusion is None
    less = with_nodes(galoroi_tree(), C=Or("C", ("IE5",)))
    assert unit_numbers(less).fusion is None


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ({"IE5": Or("IE5", ("BE6",))}, "CausalAnd, Dur, Con"),
        ({"IE1": CausalAnd("IE1", 3.0, ("BE2", "BE1"))}, "one failed component"),
        ({"IE1": CausalAnd("IE1", 3.0, ("BE2", "BE6"))}, "same missing GNSS"),
        ({"BE5": InState("BE5", "gnss", ("missing",))}, "leaves out the wait"),
        ({"IE6": Pand("IE6", ("RUN", "BE2"))}, "IE6 is PAND"),
        ({"IE6": Pand("IE6", ("BE1", "RUN"))}, "IE6 is PAND"),
        ({"IE6": Pand("IE6", ("BE2", "RUN"), latched=True)}, "IE6 is PAND"),
        ({"RUN": Con("RUN", 2, "BE5")}, "IE6 is PAND"),
        ({"IE4": Failed("IE4", "antenna"), "BE5": InState("BE5", "gnss", ("missing",))},
         "a part of the guard"),
        ({"BE5": InState("BE5", "gnss", ("missing", "wrong", "down"))}, "one state"),
        ({"BE2": Failed("BE2", "antenna")}, "must not guard"),
    ],
)  # fmt: skip
def test_another_structure_is_refused(nodes: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        unit_numbers(with_nodes(galoroi_tree(), **nodes))


def test_sources_and_options_without_closed_rows_are_refused() -> None:
    tree = galoroi_tree()
    staged = replace(tree.sources[0], stages=(Stage("open", 60.0, STAY),))
    for model, words in (
        (replace(tree, sources=()), "one Markov source"),
        (replace(tree, sources=(staged,)), "no profile"),
        (galoroi_tree(con_gap="hold"), "con_gap"),
        (galoroi_tree(mean_rule="integral"), "means over epochs"),
        (galoroi_tree(first_fix_s=180.5), "whole number of epochs"),
        (replace(tree, gates=tree.gates[:2]), "no gate 'IE1'"),
    ):
        with pytest.raises(ModelError, match=words):
            unit_numbers(model)


def test_waiting_that_is_not_missing_is_refused() -> None:
    tree = galoroi_tree()
    named = replace(tree, sources=(replace(tree.sources[0], waiting="first_fix"),))
    with pytest.raises(ModelError, match="waiting"):
        unit_numbers(named)
