from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from sbas.dependability.exchange.open_psa import read_open_psa
from sbas.dependability.static.cut_sets import minimal_cut_sets
from sbas.dependability.static.static_tree import (
    BasicEvent,
    StaticGate,
    StaticTree,
    failed_probability,
    not_static,
    static_tree_of,
    top_probability,
)
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Component,
    Dur,
    Failed,
    House,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
    Undeveloped,
)
from sbas.exceptions import InputError, ModelError
from tests.dependability.static_trees import exact, static_trees


def tree(*gates: StaticGate, top: str = "T", **events: float) -> StaticTree:
    basic = tuple(BasicEvent(name, p) for name, p in events.items())
    return StaticTree("tree", basic, gates, top)


@given(static_trees())
def test_against_all_cases_in_rational_arithmetic(random: StaticTree) -> None:
    assert float(top_probability(random)) == pytest.approx(float(exact(random)), rel=1e-13)


@given(static_trees())
def test_the_pure_python_library_gives_the_same(random: StaticTree) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "dd.cudd", None)
        slow = top_probability(random)
    assert float(slow) == pytest.approx(float(top_probability(random)), rel=1e-14)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        # Exact values of two BDD evaluations; the published one of das9204, 6.07651e-8, is
        # another model or a misprint.
        ("chinese", 0.0011705818107586692),
        ("isp9605", 1.3717088054554771e-05),
        ("das9205", 1.3840773541217113e-08),
        ("das9204", 2.1694159512164895e-11),
    ],
)
def test_aralia_trees(reference_data: Path, name: str, expected: float) -> None:
    file = reference_data / "reference/fault_trees" / f"{name}.xml"
    assert float(top_probability(read_open_psa(file).tree)) == pytest.approx(expected, rel=1e-12)


def test_the_published_value_of_das9204_cannot_be(reference_data: Path) -> None:
    """The rare-event sum of its 16704 cut sets bounds it: 6.07651e-8 cannot be."""
    file = reference_data / "reference/fault_trees/das9204.xml"
    assert minimal_cut_sets(read_open_psa(file).tree).rare_event_sum() < 2.4e-11


def test_localisation_unit_with_a_receiver_that_is_not_repaired() -> None:
    """5.935483165242355e-06: section 10.8 of the method page, also by SCRAM 0.16.2."""
    mu = 1 / 24
    rates = {"FUS": (6.06e-6, mu), "ECS": (2e-6, mu), "ANT": (4e-6, mu), "REC": (4.08e-6, 0.0)}
    model = HybridFaultTree(
        name="unit",
        step_s=1,
        mission_s=3600,
        components=tuple(Component(f"{k}-hw", *v) for k, v in rates.items()),
        sources=(),
        events=tuple(Failed(k, f"{k}-hw") for k in rates),
        gates=(Or("HW", ("ANT", "REC")), And("G", ("ECS", "HW")), Or("T", ("FUS", "G"))),
        top="T",
    )
    assert float(top_probability(static_tree_of(model))) == pytest.approx(
        5.935483165242355e-06, rel=1e-14
    )


def test_small_results_keep_their_digits_below_negations() -> None:
    """not(not a or not b) is a and b: 1 - (1 - P) would give zero."""
    small = tree(
        StaticGate("na", "not", ("a",)),
        StaticGate("nb", "not", ("b",)),
        StaticGate("T", "nor", ("na", "nb")),
        a=1e-30,
        b=3e-25,
    )
    assert float(top_probability(small)) == pytest.approx(3e-55, rel=1e-14)


def test_arrays_of_probabilities_take_the_place_of_numbers() -> None:
    either = tree(StaticGate("T", "or", ("a", "b")), a=0.5, b=0.25)
    p = np.array([0.0, 0.1, 1.0])
    assert top_probability(either, probabilities={"a": p}) == pytest.approx(
        0.25 + 0.75 * p, rel=1e-15
    )
    with pytest.raises(InputError, match="'c' is no basic event"):
        top_probability(either, probabilities={"c": p})
    with pytest.raises(InputError, match="not between 0 and 1"):
        top_probability(either, probabilities={"a": p + 0.5})


def test_a_chain_of_a_hundred_thousand_gates() -> None:
    """e(n-1) or (e(n-2) and (e(n-3) or ...)): what repeats below the last 50 is absorbed."""
    n = 100_000
    gates = [StaticGate("g0", "or", ("e0", "e1"))]
    for i in range(1, n):
        gates.append(StaticGate(f"g{i}", "or" if i % 2 else "and", (f"g{i - 1}", f"e{i % 50}")))
    events = tuple(BasicEvent(f"e{i}", 0.01) for i in range(50))
    deep = StaticTree("deep", events, tuple(gates), f"g{n - 1}")
    p = 1.0
    for i in range(n - 50, n):
        p = 0.01 + 0.99 * p if i % 2 else 0.01 * p
    assert float(top_probability(deep)) == pytest.approx(p, rel=1e-13)


def test_more_events_than_a_diagram_has_levels_is_refused() -> None:
    events = tuple(BasicEvent(f"e{i}", 1e-6) for i in range(5000))
    wide = StaticTree("wide", events, (StaticGate("T", "or", tuple(e.name for e in events)),), "T")
    with pytest.raises(ModelError, match="5000 basic events are more than the 4000"):
        top_probability(wide)


def test_many_levels_in_pure_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "dd.cudd", None)
    before = sys.getrecursionlimit()
    events = tuple(BasicEvent(f"e{i}", 1e-6) for i in range(1100))
    names = tuple(event.name for event in events)
    # The second gate meets all levels of the first.
    gates = (
        StaticGate("a", "or", names),
        StaticGate("b", "or", names[::-1]),
        StaticGate("T", "and", ("a", "b")),
    )
    p = float(top_probability(StaticTree("wide", events, gates, "T")))
    assert p == pytest.approx(-np.expm1(1100 * np.log1p(-1e-6)), rel=1e-12)
    assert sys.getrecursionlimit() == before


@pytest.mark.parametrize(
    ("gates", "message"),
    [
        ((StaticGate("T", "or", ("U",)), StaticGate("U", "and", ("T", "a"))), "T -> U -> T"),
        ((StaticGate("T", "or", ("T",)),), "cycle: T -> T"),
        ((StaticGate("T", "or", ("x",)),), "uses 'x', which is not defined"),
        ((StaticGate("T", "or", ()),), "has no input"),
        ((StaticGate("T", "or", ("a",)), StaticGate("T", "or", ("a",))), "defined 2 times"),
        ((StaticGate("T", "xor", ("a", "a", "a")),), "takes 2 inputs, not 3"),
        ((StaticGate("T", "not", ("a", "a")),), "takes 1 input, not 2"),
        ((StaticGate("T", "atleast", ("a",), 2),), "between 1 and its 1"),
        ((StaticGate("T", "atleast", ("a",)),), "between 1 and its 1"),
        ((StaticGate("T", "cardinality", ("a",), 1, 0),), "0 <= least <= most"),
        ((StaticGate("T", "or", ("a",), 1),), "has no 'least'"),
        ((StaticGate("T", "pand", ("a",)),), "unknown kind 'pand'"),  # type: ignore[arg-type]
    ],
)
def test_impossible_trees_are_refused(gates: tuple[StaticGate, ...], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        tree(*gates, a=0.1)


@pytest.mark.parametrize("p", [-0.1, 1.5, float("nan")])
def test_probabilities_lie_between_0_and_1(p: float) -> None:
    with pytest.raises(ModelError, match="probability of basic event 'a'"):
        tree(StaticGate("T", "or", ("a",)), a=p)


def test_the_top_must_be_there() -> None:
    with pytest.raises(ModelError, match="top 'X' is not defined"):
        tree(StaticGate("T", "or", ("a",)), top="X", a=0.1)


def test_events_are_ordered_depth_first_from_left_to_right() -> None:
    shared = tree(
        StaticGate("T", "or", ("G", "d", "H")),
        StaticGate("G", "and", ("c", "a")),
        StaticGate("H", "and", ("a", "b")),
        a=0.1,
        b=0.1,
        c=0.1,
        d=0.1,
        unused=0.1,
    )
    assert shared.variable_order() == ("c", "a", "d", "b")
    assert [gate.name for gate in shared.ordered_gates()][-1] == "T"


def hybrid(**changes: object) -> HybridFaultTree:
    fields: dict[str, object] = {
        "name": "unit",
        "step_s": 1,
        "mission_s": 3600,
        "components": (Component("A", 2e-3, 0.5), Component("B", 0, 0, 0.125)),
        "sources": (
            MarkovSource("O", ("ok", "bad"), ((0.9, 0.1), (0.5, 0.5)), (1, 0), guard=("A",)),
        ),
        "events": (
            Failed("a", "A"),
            Failed("again", "A"),
            Failed("b", "B"),
            House("h", True),
            Undeveloped("u", 0.25),
            InState("s", "O", ("bad",)),
        ),
        "gates": (
            AtLeast("v", 2, ("a", "again", "b")),
            Not("n", "h"),
            Dur("d", 10, "s"),
            Or("T", ("v", "n", "u", "d")),
        ),
        "top": "T",
    }
    return HybridFaultTree(**(fields | changes))  # type: ignore[arg-type]


def test_what_is_not_static_is_named_or_replaced() -> None:
    model = hybrid()
    assert not_static(model) == ["s", "d"]
    with pytest.raises(ModelError, match="2 elements have no place in a static tree: s, d"):
        static_tree_of(model)
    static = static_tree_of(model, hours=2.0, flattened={"s": 0.5, "d": 0.0625})
    pa = failed_probability(Component("A", 2e-3, 0.5), 2.0)
    # v: a and again are one component, so "2 of 3" is a; T = a or u or d.
    expected = 1 - (1 - pa) * 0.75 * 0.9375
    assert float(top_probability(static)) == pytest.approx(expected, rel=1e-14)


def test_failed_probability_of_the_two_state_chain() -> None:
    """5.935467498451149e-6: section 10.4 of the method page."""
    fusion = Component("F", 6.06e-6, 1 / 24)
    assert failed_probability(fusion, 1.0) == pytest.approx(5.935467498451149e-6, rel=1e-14)
    assert failed_probability(Component("F", 0, 0, 0.25), 5.0) == 0.25
    assert failed_probability(Component("F", 0, 2.0, 0.25), 1.0) == pytest.approx(
        0.25 * np.exp(-2.0), rel=1e-15
    )


def test_an_event_on_no_component_is_refused() -> None:
    with pytest.raises(ModelError, match="which is no component"):
        static_tree_of(hybrid(events=(Failed("a", "Z"),), gates=(Or("T", ("a",)),), sources=()))
