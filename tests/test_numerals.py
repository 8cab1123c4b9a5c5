"""Numbers as text: bounds keep to the safe side, and 100 % means all."""

from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.numerals import count, downward, hours, number, share, stamp, upward

_BACK = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def _read(text: str) -> Decimal:
    mantissa, _, exponent = text.replace(",", "").partition("×10")
    return Decimal(mantissa).scaleb(int(exponent.translate(_BACK) or "0"))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (1e-7, "1×10⁻⁷"), (0.0359488, "0.03595"), (29957322.7, "2.996×10⁷"),
        (3417.4, "3,417"), (123456.0, "123,500"), (-0.5, "-0.5"), (9.9996e-5, "1×10⁻⁴"),
    ],
)  # fmt: skip
def test_number(value: float, text: str) -> None:
    assert number(value) == text


@given(st.floats(min_value=1e-300, max_value=1e300))
def test_bounds_are_rounded_to_the_safe_side(value: float) -> None:
    exact = Decimal(repr(value))
    assert exact <= _read(upward(value)) <= exact * Decimal("1.0011")
    assert exact * Decimal("0.9989") <= _read(downward(value)) <= exact


@given(st.integers(1, 10**9), st.integers(0, 10**9))
def test_share_never_says_more_than_there_is(epochs: int, lost: int) -> None:
    lost = min(lost, epochs)
    value = (epochs - lost) / epochs
    text = share(value)
    shown = Decimal(text.removesuffix(" %")) / 100
    assert shown <= Decimal(repr(value))
    assert (text == "100 %") == (lost == 0)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.99996333, "99.9963 %"), (0.5, "50.0 %"), (0.0, "0 %"), (0.9999999999, "99.999999990 %")],
)
def test_share(value: float, text: str) -> None:
    assert share(value) == text


def test_durations_take_the_unit_that_suits() -> None:
    assert hours(83.3333) == "83.33 h"
    assert hours(0.5) == "30 min"
    assert hours(2 / 3600) == "2 s"


def test_counts_and_stamps() -> None:
    assert count(300000) == "300,000"
    assert count(1.5) == "1.5"
    assert stamp(1_253_318_400_000_000_000) == "2009-09-19 00:00:00"
    assert stamp(1_253_318_400_500_000_000) == "2009-09-19 00:00:00.500"
