"""Truth tables: what Figure 9 obeys as printed and as corrected, and tables of any size."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sbas.exceptions import InputError
from sbas.fusion.logic.published_tables import figure_9
from sbas.fusion.logic.truth_table import (
    TruthTable,
    critical_by_midpoint,
    differences,
    is_symmetric,
    monotony_violations,
    table_from_letters,
    table_from_outcomes,
    table_from_rule,
)
from sbas.fusion.states import DA, N, U, combination_codes, combination_words

EQUAL = (1 / 3, 1 / 3, 1 / 3)
NAMES = ("Odo", "Acc", "GPS")


def words(codes: np.ndarray) -> list[str]:
    return [combination_words(int(code), 3) for code in codes]


def random_tables() -> st.SearchStrategy[TruthTable]:
    def build(n: int) -> st.SearchStrategy[TruthTable]:
        return hnp.arrays(np.int8, 3**n, elements=st.integers(0, 2)).map(
            lambda outcomes: TruthTable(tuple("ABCDE"[:n]), outcomes, "random")
        )

    return st.integers(1, 4).flatmap(build)


# --- Figure 9 ---------------------------------------------------------------------------------


def test_the_printed_tree_improves_three_times_with_a_worse_sensor() -> None:
    found = monotony_violations(figure_9("printed"))
    assert [tuple(words(pair)) for pair in found] == [
        ("(N, N, U)", "(N, DA, U)"),
        ("(N, DA, N)", "(N, DA, DA)"),
        ("(N, DA, N)", "(DA, DA, N)"),
    ]
    assert len(monotony_violations(figure_9())) == 0


def test_exactly_two_changes_of_two_leaves_cure_the_printed_tree() -> None:
    """The method page's argument for the exchange of O4 and O6; no single leaf does."""
    printed = figure_9("printed")
    cures = []
    for count in (1, 2):
        for leaves in itertools.combinations(range(27), count):
            for values in itertools.product(range(3), repeat=count):
                changed = printed.outcomes.copy()
                changed[list(leaves)] = values
                if np.sum(changed != printed.outcomes) == count:
                    table = TruthTable(NAMES, changed, "")
                    if len(monotony_violations(table)) == 0:
                        cures.append(
                            [(leaf + 1, v) for leaf, v in zip(leaves, values, strict=True)]
                        )
    assert cures == [[(3, N), (4, N)], [(4, N), (6, DA)]]


def test_symmetry_and_counts() -> None:
    assert is_symmetric(figure_9())
    assert not is_symmetric(figure_9("printed"))
    assert figure_9().counts() == figure_9("printed").counts() == (7, 19, 1)


@pytest.mark.parametrize(("n", "counts"), [(2, (3, 5, 1)), (3, (7, 19, 1)), (4, (15, 65, 1))])
def test_counts_of_tree_bounds(n: int, counts: tuple[int, int, int]) -> None:
    table = table_from_rule(tuple("ABCD"[:n]), np.full(n, 1 / n))
    assert table.counts() == counts


def test_both_versions_differ_at_o4_and_o6() -> None:
    codes = differences(figure_9(), figure_9("printed"))
    assert words(codes) == ["(N, DA, N)", "(N, DA, U)"]
    rule = table_from_rule(NAMES, EQUAL)
    assert differences(figure_9(), rule).size == 0
    other = table_from_rule(("Acc", "Odo", "GPS"), EQUAL)
    with pytest.raises(InputError, match="different sensors"):
        differences(figure_9(), other)


@pytest.mark.parametrize(
    ("end_m", "corrected", "printed"),
    [(7.99, 9, 9), (8.0, 15, 14), (10.49, 15, 14), (10.5, 18, 17)],
)
def test_fifteen_critical_combinations_as_the_paper_counts(
    end_m: float, corrected: int, printed: int
) -> None:
    """Railways 2014, section 3.3: 15 critical; X from 8 to 10.5 m by the method page.

    By hand, equal weights: (N, DA, U) has its middle at (1 + 2.5 + 2.5 + 1 + X)/6 = 2.5 for X = 8,
    (N, N, U) at (2.5 + 2 + X)/6 = 2.5 for X = 10.5.
    """

    def count(version: str) -> int:
        table = figure_9(version)  # type: ignore[arg-type]
        return critical_by_midpoint(table, EQUAL, unacceptable_end_m=end_m).size

    assert count("corrected") == corrected
    assert count("printed") == printed


def test_the_fifteen_have_a_u_and_are_not_one_u_among_nominals() -> None:
    found = set(critical_by_midpoint(figure_9(), EQUAL, unacceptable_end_m=9.0).tolist())
    states = list(itertools.product((N, DA, U), repeat=3))
    expected = {
        code
        for code, combination in enumerate(states)
        if U in combination and sorted(combination) != [N, N, U] and combination != (U, U, U)
    }
    assert found == expected
    assert len(expected) == 15
    with pytest.raises(InputError, match="a weight for each sensor"):
        critical_by_midpoint(figure_9(), (0.5, 0.5), unacceptable_end_m=9.0)


# --- tables of any size -----------------------------------------------------------------------


@given(random_tables())
def test_violations_and_symmetry_by_definition(table: TruthTable) -> None:
    n = len(table.names)
    every = list(itertools.product(range(3), repeat=n))
    expected = set()
    for states in every:
        for k in range(n):
            if states[k] < U:
                worse = (*states[:k], states[k] + 1, *states[k + 1 :])
                if table.outcome(worse) < table.outcome(states):
                    expected.add((every.index(states), every.index(worse)))
    found = [tuple(pair) for pair in monotony_violations(table).tolist()]
    assert found == sorted(expected)
    by_count: dict[tuple[int, ...], set[int]] = {}
    for states in every:
        by_count.setdefault(tuple(sorted(states)), set()).add(table.outcome(states))
    assert is_symmetric(table) == all(len(outcomes) == 1 for outcomes in by_count.values())


@given(random_tables())
def test_a_table_comes_back_from_its_outcomes_and_letters(table: TruthTable) -> None:
    n = len(table.names)
    states = list(itertools.product(range(3), repeat=n))
    written = {s: table.outcome(s) for s in reversed(states)}
    back = table_from_outcomes(table.names, written, provenance="again")
    assert differences(table, back).size == 0
    letters = "".join("NDU"[o] for o in table.outcomes)
    assert differences(table, table_from_letters(table.names, letters, provenance="")).size == 0
    frame = table.frame()
    assert len(frame) == 3**n
    assert list(frame.columns) == [*table.names, "output"]
    codes = combination_codes(
        frame[list(table.names)].replace({"N": 0, "DA": 1, "U": 2}).to_numpy().astype(np.int8).T
    )
    assert codes.tolist() == list(range(3**n))


def test_twelve_sensors() -> None:
    n = 12
    table = table_from_rule([f"s{k}" for k in range(n)], np.full(n, 1 / n))
    # N: no U and at least one N.
    assert table.counts() == (2**n - 1, 3**n - 2**n, 1)
    assert len(monotony_violations(table)) == 0
    assert is_symmetric(table)


def test_the_provenance_of_a_rule_says_all_that_it_used() -> None:
    table = table_from_rule(NAMES, EQUAL, rule="eq3_midpoint", unacceptable_end_m=8.0)
    for piece in ("eq3_midpoint", "0.3333", "beta 1 m", "AL 2.5 m", "X 8 m"):
        assert piece in table.provenance
    assert "X inf m" in table_from_rule(NAMES, EQUAL).provenance


def test_outcomes_are_read_only_and_not_the_callers() -> None:
    mine = np.zeros(27, np.int8)
    table = TruthTable(NAMES, mine, "")
    mine[0] = 2
    assert table.outcomes[0] == N
    with pytest.raises(ValueError, match="read-only"):
        table.outcomes[0] = U


@pytest.mark.parametrize(
    ("names", "outcomes", "text"),
    [
        (NAMES, np.zeros(26), "27 outcomes"),
        (NAMES, np.full(27, 3), "27 outcomes"),
        (NAMES, np.full(27, -1), "27 outcomes"),
        (NAMES, np.full(27, 0.5), "27 outcomes"),
        (NAMES, np.full(27, math.nan), "27 outcomes"),
        (("A", "A"), np.zeros(9), "different names"),
        ((), np.zeros(1), "1 to 12"),
    ],
)
def test_what_is_no_table_is_refused(
    names: tuple[str, ...], outcomes: np.ndarray, text: str
) -> None:
    with pytest.raises(InputError, match=text):
        TruthTable(names, outcomes, "")


def test_incomplete_outcomes_are_named() -> None:
    without_u: dict[tuple[int, ...], int] = {(a, b): N for a in range(2) for b in range(3)}
    with pytest.raises(InputError, match="3 of 9 combinations") as caught:
        table_from_outcomes(("A", "B"), without_u, provenance="")
    assert "(U, N), (U, DA), (U, U)" in caught.value.evidence
    with pytest.raises(InputError, match="has 2 states"):
        table_from_outcomes(("A", "B"), {(N,): N}, provenance="")
    everything: dict[tuple[int, ...], int] = {(a, b): N for a in range(3) for b in range(3)}
    with pytest.raises(InputError, match="or one has no data"):
        table_from_outcomes(("A", "B"), everything | {(-1, N): N}, provenance="")
    with pytest.raises(InputError, match="'X' is no state"):
        table_from_letters(("A",), "NDX", provenance="")


def test_a_combination_is_asked_with_all_its_states() -> None:
    assert figure_9().outcome((N, DA, U)) == DA
    with pytest.raises(InputError, match="has 3 states"):
        figure_9().outcome((N, N))
    with pytest.raises(InputError, match="without data"):
        figure_9().outcome((N, N, -1))
