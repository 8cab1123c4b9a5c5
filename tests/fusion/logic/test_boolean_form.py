"""Boolean forms: Figure 9 in two lines, and implicants found in two independent ways."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sbas.exceptions import InputError
from sbas.fusion.logic.boolean_form import (
    Implicant,
    holds,
    minimal_cuts,
    prime_implicants,
    two_line_form,
)
from sbas.fusion.logic.published_tables import figure_9
from sbas.fusion.logic.truth_table import TruthTable, differences, monotony_violations
from sbas.fusion.states import DA, N, U, combination_states

CONDITIONS: tuple[Literal["notN", "isU"], ...] = ("notN", "isU")
NAMES = ("Odo", "Acc", "GPS")


def tables(monotone: bool) -> st.SearchStrategy[TruthTable]:
    def made(n: int, outcomes: np.ndarray) -> TruthTable:
        shaped = outcomes.reshape((3,) * n)
        if monotone:
            for axis in range(n):
                shaped = np.maximum.accumulate(shaped, axis=axis)
        return TruthTable(tuple("ABCDE"[:n]), shaped.ravel(), "random")

    def of_size(n: int) -> st.SearchStrategy[TruthTable]:
        # Mostly N, so that closing upwards leaves something.
        levels = st.sampled_from([0] * 8 + [1, 1, 2]) if monotone else st.integers(0, 2)
        return hnp.arrays(np.int8, 3**n, elements=levels).map(lambda o: made(n, o))

    return st.integers(1, 4).flatmap(of_size)


def covered(implicants: Sequence[Implicant], sensors: int) -> np.ndarray:
    """(3^n,) combinations that any of the implicants makes true."""
    states = combination_states(np.arange(3**sensors), sensors).T
    lowest, highest = (np.array([getattr(i, end) for i in implicants]).reshape(-1, sensors)
                       for end in ("lowest", "highest"))  # fmt: skip
    inside = (states[:, None] >= lowest) & (states[:, None] <= highest)
    return inside.all(axis=2).any(axis=1)


# --- Figure 9 ---------------------------------------------------------------------------------


def test_two_lines_are_the_corrected_figure_9() -> None:
    assert differences(two_line_form(NAMES), figure_9()).size == 0
    assert differences(two_line_form(NAMES), figure_9("printed")).size == 2


def test_minimal_cuts_of_the_corrected_figure_are_the_two_lines() -> None:
    not_nominal = minimal_cuts(figure_9(), "notN")
    assert [i.words(NAMES) for i in not_nominal] == [
        "Odo = U", "Acc = U", "GPS = U", "Odo >= DA and Acc >= DA and GPS >= DA",
    ]  # fmt: skip
    (unacceptable,) = minimal_cuts(figure_9(), "isU")
    assert unacceptable.words(NAMES) == "Odo = U and Acc = U and GPS = U"


def test_the_printed_figure_needs_upper_bounds() -> None:
    printed = figure_9("printed")
    with pytest.raises(InputError, match="no minimal cuts") as caught:
        minimal_cuts(printed, "notN")
    assert caught.value.evidence == "true in (N, N, U), false in (N, DA, U)"
    assert [i.words(NAMES) for i in prime_implicants(printed, "notN")] == [
        "Odo = U",
        "Acc = U",
        "Odo >= DA and GPS = U",
        "Acc = N and GPS = U",
        "Odo = N and Acc >= DA and GPS = N",
        "Odo >= DA and Acc >= DA and GPS >= DA",
    ]
    assert np.array_equal(covered(prime_implicants(printed, "notN"), 3), holds(printed, "notN"))
    # Where the output is U the printed tree is monotone.
    assert minimal_cuts(printed, "isU") == prime_implicants(printed, "isU")


# --- any table --------------------------------------------------------------------------------


@given(tables(monotone=True), st.sampled_from(CONDITIONS))
def test_cuts_by_diagram_and_by_lattice_agree_and_reproduce_the_table(
    table: TruthTable, condition: Literal["notN", "isU"]
) -> None:
    implicants = prime_implicants(table, condition)
    assert minimal_cuts(table, condition) == implicants
    n = len(table.names)
    assert np.array_equal(covered(implicants, n), holds(table, condition))
    # None can be spared.
    for k in range(len(implicants)):
        rest = implicants[:k] + implicants[k + 1 :]
        assert not np.array_equal(covered(rest, n), holds(table, condition))
    assert all(i.highest == (U,) * n for i in implicants)


@given(tables(monotone=False), st.sampled_from(CONDITIONS))
def test_prime_implicants_by_definition(
    table: TruthTable, condition: Literal["notN", "isU"]
) -> None:
    """All boxes of levels inside the function that no other such box contains."""
    n = len(table.names)
    true = holds(table, condition)
    assert np.array_equal(covered(prime_implicants(table, condition), n), true)
    if n > 3:
        return
    states = combination_states(np.arange(3**n), n).T
    stretches = [(low, high) for low in range(3) for high in range(low, 3)]
    boxes = []
    for product in itertools.product(stretches, repeat=n):
        low, high = np.array(product).T
        if np.all(true[np.all((states >= low) & (states <= high), axis=1)]):
            boxes.append(product)

    def contains(wide: tuple[tuple[int, int], ...], box: tuple[tuple[int, int], ...]) -> bool:
        return all(w[0] <= b[0] and b[1] <= w[1] for w, b in zip(wide, box, strict=True))

    prime = {
        Implicant(tuple(s[0] for s in box), tuple(s[1] for s in box))
        for box in boxes
        if not any(other != box and contains(other, box) for other in boxes)
    }
    assert set(prime_implicants(table, condition)) == prime


@pytest.mark.parametrize("outcome", [N, DA, U])
def test_constant_tables(outcome: int) -> None:
    table = TruthTable(("A", "B"), np.full(9, outcome), "")
    for condition, true in (("notN", outcome != N), ("isU", outcome == U)):
        for found in (prime_implicants(table, condition), minimal_cuts(table, condition)):  # type: ignore[arg-type]
            assert [i.words(table.names) for i in found] == (["always"] if true else [])
            assert np.all(covered(found, 2) == true)


def test_implicants_of_ten_sensors() -> None:
    table = two_line_form([f"s{k}" for k in range(10)])
    for condition, number in (("notN", 11), ("isU", 1)):
        found = prime_implicants(table, condition)  # type: ignore[arg-type]
        assert len(found) == number
        assert minimal_cuts(table, condition) == found  # type: ignore[arg-type]


def test_too_many_sensors_for_a_function_that_falls() -> None:
    outcomes = np.zeros(3**10, np.int8)
    outcomes[0] = DA
    table = TruthTable(tuple(f"s{k}" for k in range(10)), outcomes, "")
    assert len(monotony_violations(table)) == 10
    with pytest.raises(InputError, match="not monotone and has more than 9"):
        prime_implicants(table, "notN")
    with pytest.raises(InputError, match="no condition"):
        holds(table, "isN")  # type: ignore[arg-type]
