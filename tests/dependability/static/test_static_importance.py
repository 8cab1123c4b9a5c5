from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given

from sbas.dependability.exchange.open_psa import read_open_psa
from sbas.dependability.static.cut_sets import minimal_cut_sets
from sbas.dependability.static.static_importance import static_importance
from sbas.dependability.static.static_tree import BasicEvent, StaticGate, StaticTree
from sbas.exceptions import ModelError
from tests.dependability.static_trees import MONOTONE, exact, static_trees


def compare(tree: StaticTree) -> None:
    top = exact(tree)
    if top == 0:
        with pytest.raises(ModelError, match="probability zero"):
            static_importance(tree)
        return
    if float(top) < 1e-250:
        return
    found = static_importance(tree)
    assert found.top_probability == pytest.approx(float(top), rel=1e-13)
    p = tree.probabilities()
    for row in found.events:
        on, off = exact(tree, {row.event: True}), exact(tree, {row.event: False})
        assert row.birnbaum == pytest.approx(float(on - off), rel=1e-12, abs=1e-15)
        assert row.criticality == pytest.approx(
            float(p[row.event] * float((on - off) / top)), rel=1e-12, abs=1e-15
        )
        assert row.raw == pytest.approx(float(on / top), rel=1e-12)
        assert row.diagnostic == pytest.approx(p[row.event] * float(on / top), rel=1e-12)
        assert row.rrw == (math.inf if off == 0 else pytest.approx(float(top / off), rel=1e-12))


@given(static_trees())
def test_against_all_cases_in_rational_arithmetic(tree: StaticTree) -> None:
    compare(tree)


@given(static_trees(MONOTONE))
def test_birnbaum_of_coherent_trees_keeps_its_digits(tree: StaticTree) -> None:
    top = exact(tree)
    if float(top) < 1e-250:
        return
    for row in static_importance(tree).events:
        on, off = exact(tree, {row.event: True}), exact(tree, {row.event: False})
        assert row.birnbaum == pytest.approx(float(on - off), rel=1e-12, abs=0)


@given(static_trees(MONOTONE))
def test_fussell_vesely_is_the_union_of_the_cut_sets_that_hold_the_event(
    tree: StaticTree,
) -> None:
    top = exact(tree)
    if float(top) < 1e-250:
        return
    cuts = list(minimal_cut_sets(tree).sets())
    for row in static_importance(tree).events:
        held = [cut for cut in cuts if row.event in cut]
        union = 0.0
        if held:
            gates = [StaticGate(f"c{i}", "and", tuple(cut)) for i, cut in enumerate(held)]
            gates.append(StaticGate("U", "or", tuple(gate.name for gate in gates)))
            union = float(exact(StaticTree("u", tree.events, tuple(gates), "U")))
        assert row.fussell_vesely == pytest.approx(union / float(top), rel=1e-12)


def test_a_small_difference_of_large_figures() -> None:
    """MIF of x in "x or y" is 1 - p_y; of x in "b or (x and y)" it is (1 - p_b) p_y = 1e-30."""
    events = (BasicEvent("x", 1e-20), BasicEvent("y", 2e-30), BasicEvent("b", 0.5))
    gates = (StaticGate("g", "and", ("x", "y")), StaticGate("T", "or", ("b", "g")))
    rows = {r.event: r for r in static_importance(StaticTree("t", events, gates, "T")).events}
    assert rows["x"].birnbaum == pytest.approx(1e-30, rel=1e-14)


def test_a_tree_that_is_not_coherent_has_no_fussell_vesely() -> None:
    events = tuple(BasicEvent(name, 0.1) for name in "ab")
    tree = StaticTree("xor", events, (StaticGate("T", "xor", ("a", "b")),), "T")
    rows = static_importance(tree).events
    assert [row.fussell_vesely for row in rows] == [None, None]
    assert rows[0].birnbaum == pytest.approx(0.8, rel=1e-14)


def test_chinese_tree_and_its_table(reference_data: Path) -> None:
    """SCRAM 0.16.2 with --bdd --importance true prints MIF 0.0386197 and CIF 0.329919 for e1."""
    file = reference_data / "reference/fault_trees/chinese.xml"
    table = static_importance(read_open_psa(file).tree).summary()
    assert table.loc["e1", "birnbaum"] == pytest.approx(0.0386197, rel=1e-5)
    assert table.loc["e1", "criticality"] == pytest.approx(0.329919, rel=1e-5)
    assert table["criticality"].is_monotonic_decreasing
