"""Laws and chains."""

from __future__ import annotations

from fractions import Fraction

import pytest

from sbas.dependability.tree.stochastic_rows import (
    check_law,
    check_rows,
    has_one_stationary_law,
    normalised_rows,
)
from sbas.exceptions import ModelError


def test_the_largest_entry_takes_what_the_others_leave() -> None:
    rows = normalised_rows(((1e-20, 0.7, 0.3 + 4e-10), (0.5, 0.5 - 1e-10, 0.0)))
    assert rows[0][0] == 1e-20
    assert rows[0][2] == 0.3 + 4e-10
    assert rows[1][1:] == (0.5 - 1e-10, 0.0)
    for row in rows:
        assert abs(sum(map(Fraction, row)) - 1) < Fraction(1, 2**53)
    assert normalised_rows(((0.25, 0.25, 0.5),)) == ((0.25, 0.25, 0.5),)


@pytest.mark.parametrize(
    ("rows", "one"),
    [
        (((1.0,),), True),
        (((0.5, 0.5), (0.5, 0.5)), True),
        (((0.0, 1.0), (1.0, 0.0)), True),  # periodic, but one law
        (((1.0, 0.0), (0.0, 1.0)), False),
        (((0.5, 0.25, 0.25), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), False),  # two absorbing states
        (((0.5, 0.5, 0.0), (0.0, 0.5, 0.5), (0.0, 0.5, 0.5)), True),  # a transient state
        (((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)), False),
    ],
)
def test_one_closed_class_is_one_stationary_law(
    rows: tuple[tuple[float, ...], ...], one: bool
) -> None:
    assert has_one_stationary_law(rows) is one


@pytest.mark.parametrize("law", [(0.5, 0.5 + 2e-9), (0.5,), (1.5, -0.5), [0.5, 0.5], ("1", 0.0)])
def test_laws_that_are_refused(law: object) -> None:
    with pytest.raises(ModelError):
        check_law(law, 2, "law")


def test_the_tolerance_is_1e_9() -> None:
    check_law((0.5, 0.5 + 9e-10), 2, "law")
    check_rows(((1.0, 0.0), (0.1, 0.9)), 2, "rows")
