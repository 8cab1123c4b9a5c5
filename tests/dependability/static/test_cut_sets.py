from __future__ import annotations

import math
from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import given

from sbas.dependability.exchange.open_psa import read_open_psa
from sbas.dependability.static.cut_sets import minimal_cut_sets
from sbas.dependability.static.static_tree import (
    BasicEvent,
    StaticGate,
    StaticTree,
    top_probability,
)
from sbas.exceptions import InputError, ModelError
from tests.dependability.static_trees import MONOTONE, exact, static_trees, truth


def by_definition(tree: StaticTree) -> set[frozenset[str]]:
    """Smallest sets of events that make the top true, tried in order of size."""
    names = [event.name for event in tree.events]
    found: set[frozenset[str]] = set()
    for size in range(len(names) + 1):
        for chosen in map(frozenset, combinations(names, size)):
            if any(cut <= chosen for cut in found):
                continue
            if truth(tree, {name: name in chosen for name in names})[tree.top]:
                found.add(chosen)
    return found


@given(static_trees(MONOTONE))
def test_all_minimal_cut_sets_and_no_other(tree: StaticTree) -> None:
    cuts = minimal_cut_sets(tree)
    expected = by_definition(tree)
    listed = list(cuts.sets())
    assert set(listed) == expected
    assert len(listed) == len(expected)
    for order in range(4):
        assert set(cuts.sets(max_order=order)) == {c for c in expected if len(c) <= order}
    assert sum(cuts.counts().values()) == len(expected)
    p = tree.probabilities()
    products = [math.prod(p[event] for event in cut) for cut in expected]
    assert cuts.rare_event_sum() == pytest.approx(math.fsum(products), rel=1e-13)
    bound = -math.expm1(math.fsum(math.log1p(-x) for x in products)) if 1 not in products else 1
    assert cuts.min_cut_bound() == pytest.approx(bound, rel=1e-12)
    top = float(exact(tree))
    assert top <= cuts.min_cut_bound() * (1 + 1e-12) <= cuts.rare_event_sum() * (1 + 1e-11) + 1e-300


@pytest.mark.parametrize(
    ("name", "number"),
    # Counts published with the Aralia set, also by SCRAM 0.16.2.
    [("chinese", 392), ("isp9605", 5630), ("das9205", 17280), ("das9209", 82_000_000_000)],
)
def test_number_of_cut_sets_of_aralia_trees(reference_data: Path, name: str, number: int) -> None:
    tree = read_open_psa(reference_data / "reference/fault_trees" / f"{name}.xml").tree
    cuts = minimal_cut_sets(tree)
    assert sum(cuts.counts().values()) == number
    assert float(top_probability(tree)) <= cuts.rare_event_sum()
    if number > 1_000_000:
        with pytest.raises(InputError, match="more than 1000000"):
            cuts.min_cut_bound()


def test_a_coherent_function_behind_negations_is_taken() -> None:
    events = tuple(BasicEvent(name, 0.1) for name in "ab")
    gates = (
        StaticGate("na", "not", ("a",)),
        StaticGate("nb", "not", ("b",)),
        StaticGate("T", "nand", ("na", "nb")),
    )
    tree = StaticTree("or", events, gates, "T")
    assert set(minimal_cut_sets(tree).sets()) == {frozenset("a"), frozenset("b")}


def test_a_tree_that_is_not_coherent_is_refused_with_an_event_that_shows_it() -> None:
    events = tuple(BasicEvent(name, 0.1) for name in "ab")
    tree = StaticTree("xor", events, (StaticGate("T", "xor", ("a", "b")),), "T")
    with pytest.raises(ModelError, match="not coherent: event 'a'"):
        minimal_cut_sets(tree)
