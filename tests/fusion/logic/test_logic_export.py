"""Truth tables as fault trees: the exact top against a sum over all combinations."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sbas.dependability.exchange.open_psa import read_open_psa
from sbas.dependability.exchange.open_psa_export import open_psa_text
from sbas.dependability.static.cut_sets import minimal_cut_sets
from sbas.dependability.static.static_tree import top_probability
from sbas.exceptions import InputError, ModelError
from sbas.fusion.logic.boolean_form import holds, two_line_form
from sbas.fusion.logic.logic_export import logic_tree
from sbas.fusion.logic.published_tables import figure_9
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.states import combination_states

D, UNACCEPTABLE = (0.2, 0.2, 0.15), (0.1, 0.07, 0.07)
"""Probabilities of DA and U in the check of the method page, section 11."""
Condition = Literal["notN", "isU"]


def by_enumeration(table: TruthTable, condition: Condition, d: np.ndarray, u: np.ndarray) -> float:
    n = len(table.names)
    law = np.array([1 - d - u, d, u])
    states = combination_states(np.arange(3**n), n)
    each = np.prod([law[states[k], k] for k in range(n)], axis=0)
    return math.fsum(each[holds(table, condition)])


def solved(table: TruthTable, condition: Condition, d: object, u: object) -> float:
    tree = logic_tree(table, condition, degraded=d, unacceptable=u)  # type: ignore[arg-type]
    return float(top_probability(tree))


def test_figure_9_at_the_probabilities_of_the_page() -> None:
    """Page: P(isU) = 4.9e-4 = 0.1*0.07*0.07; P(notN) = 1 - prod(1-u) + prod d = 0.22759."""
    assert solved(figure_9(), "isU", D, UNACCEPTABLE) == pytest.approx(4.9e-4, rel=1e-12)
    expected = 1 - 0.9 * 0.93 * 0.93 + 0.2 * 0.2 * 0.15
    assert expected == pytest.approx(0.22759, abs=1e-12)
    assert solved(figure_9(), "notN", D, UNACCEPTABLE) == pytest.approx(expected, rel=1e-12)


def test_treating_da_and_u_as_independent_would_be_wrong() -> None:
    """Page, section 8: .2355 instead of .2276; the tree's second event has d/(1 - u)."""
    naive = 1 - 0.9 * 0.93 * 0.93 * (1 - (0.3 * 0.27 * 0.22))
    assert naive == pytest.approx(0.2355, abs=5e-5)
    tree = logic_tree(figure_9(), "notN", degraded=D, unacceptable=UNACCEPTABLE)
    probability = tree.probabilities()
    assert probability["Odo_U"] == 0.1
    assert probability["Odo_DA_if_not_U"] == pytest.approx(0.2 / 0.9)


def test_the_tree_of_a_monotone_table_is_coherent_with_the_cuts_of_the_two_lines() -> None:
    tree = logic_tree(figure_9(), "notN", degraded=D, unacceptable=UNACCEPTABLE)
    assert {gate.kind for gate in tree.gates} <= {"and", "or"}
    assert {frozenset(cut) for cut in minimal_cut_sets(tree).sets()} == {
        frozenset({"Odo_U"}),
        frozenset({"Acc_U"}),
        frozenset({"GPS_U"}),
        frozenset({"Odo_DA_if_not_U", "Acc_DA_if_not_U", "GPS_DA_if_not_U"}),
    }
    unacceptable = logic_tree(figure_9(), "isU", degraded=D, unacceptable=UNACCEPTABLE)
    assert [event.name for event in unacceptable.events] == ["Odo_U", "Acc_U", "GPS_U"]


@st.composite
def cases(draw: st.DrawFn) -> tuple[TruthTable, np.ndarray, np.ndarray]:
    n = draw(st.integers(1, 4))
    outcomes = draw(hnp.arrays(np.int8, 3**n, elements=st.integers(0, 2)))
    shares = draw(hnp.arrays(np.int64, (3, n), elements=st.integers(0, 1000)))
    shares[0] += shares.sum(axis=0) == 0
    law = shares / shares.sum(axis=0)
    return TruthTable(tuple("ABCD"[:n]), outcomes, "random"), law[1], law[2]


@given(cases(), st.sampled_from(["notN", "isU"]))
def test_the_exact_top_is_the_sum_over_all_combinations(
    case: tuple[TruthTable, np.ndarray, np.ndarray], condition: Condition
) -> None:
    """Any table, monotone or not, with any probabilities, 0 and 1 among them."""
    table, d, u = case
    expected = by_enumeration(table, condition, d, u)
    assert solved(table, condition, d, u) == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_small_probabilities_keep_their_digits() -> None:
    n = 8
    table = two_line_form([f"s{k}" for k in range(n)])
    d, u = np.full(n, 1e-2), np.full(n, 1e-9)
    assert solved(table, "isU", d, u) == pytest.approx(1e-72, rel=1e-12)
    expected = -math.expm1(n * math.log1p(-1e-9)) + 1e-16
    assert solved(table, "notN", d, u) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("version", ["corrected", "printed"])
def test_it_survives_open_psa(version: Literal["corrected", "printed"]) -> None:
    table = figure_9(version)
    tree = logic_tree(table, "notN", degraded=D, unacceptable=UNACCEPTABLE)
    written = open_psa_text(tree)
    assert not written.report.lost
    back = read_open_psa(written.text.encode()).tree
    expected = by_enumeration(table, "notN", np.array(D), np.array(UNACCEPTABLE))
    assert float(top_probability(back)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("outcome", "expected"), [(0, 0.0), (2, 1.0)])
def test_a_constant_table_is_a_house(outcome: int, expected: float) -> None:
    table = TruthTable(("A",), np.full(3, outcome), "")
    for condition in ("notN", "isU"):
        assert solved(table, condition, [0.1], [0.2]) == expected


@pytest.mark.parametrize(
    ("d", "u", "words"),
    [
        ((0.2, 0.2), (0.1, 0.1), "each of the 3 sensors"),
        ((0.95, 0.2, 0.1), (0.1, 0.1, 0.1), "so does their sum"),
        ((-0.1, 0.2, 0.1), (0.1, 0.1, 0.1), "between 0 and 1"),
        ((math.nan, 0.2, 0.1), (0.1, 0.1, 0.1), "between 0 and 1"),
    ],
)
def test_what_is_no_law_of_states_is_refused(d: object, u: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        solved(figure_9(), "isU", d, u)


def test_names_that_collide_are_named() -> None:
    table = two_line_form(("A", "A_not", "A_DA_or"))
    with pytest.raises(ModelError, match="'A_DA_or_U' is defined 2 times"):
        logic_tree(table, "notN", degraded=D, unacceptable=UNACCEPTABLE)
