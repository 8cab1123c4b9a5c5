"""Fields against Python's own parser of numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.rinex.observation_fields import number_otherwise, parse_fields

digit = st.sampled_from(["", *"0123456789"])
numbers = st.integers(-999_999_999_999, 9_999_999_999_999).map(lambda n: f"{n / 1000:14.3f}")
short = st.integers(-99_999, 99_999).map(lambda n: f"{n / 1000:14.3f}")
bare = short.map(lambda t: t.replace(" 0.", "  .").replace("-0.", " -."))
cells = st.tuples(st.one_of(numbers, short, bare, st.just("")), digit, digit).map(
    lambda c: f"{c[0]:14s}{c[1] or ' '}{c[2] or ' '}"
)


def parsed(texts: list[str]) -> tuple[list[float], list[int], list[int], list[bool]]:
    found = parse_fields(np.frombuffer("".join(texts).encode(), np.uint8).reshape(1, -1))
    return (
        found.value[0].tolist(),
        found.loss_of_lock[0].tolist(),
        found.strength[0].tolist(),
        found.irregular[0].tolist(),
    )


@given(st.lists(cells, min_size=1, max_size=40))
def test_every_field_is_what_python_reads(texts: list[str]) -> None:
    value, lock, strength, irregular = parsed(texts)
    assert not any(irregular)
    for text, v, a, b in zip(texts, value, lock, strength, strict=True):
        if text[:14].strip():
            assert v == float(text[:14])  # equal to the last bit
        else:
            assert math.isnan(v)
        assert a == (int(text[14]) if text[14] != " " else -1)
        assert b == (int(text[15]) if text[15] != " " else -1)


def test_a_grid_of_rows_keeps_its_places() -> None:
    texts = [f"{1000 * r + c:14.3f}{r}{c}" for r in range(7) for c in range(3)]
    found = parse_fields(np.frombuffer("".join(texts).encode(), np.uint8).reshape(7, -1))
    assert np.array_equal(found.value, 1000.0 * np.arange(7)[:, None] + np.arange(3))
    assert np.array_equal(found.loss_of_lock, np.repeat(np.arange(7)[:, None], 3, 1))
    assert np.array_equal(found.strength, np.repeat(np.arange(3)[None], 7, 0))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("     -   1.001", -1.001),
        ("     +  21.001", 21.001),
        ("        -1.000", -1.0),
        ("          .250", 0.25),
        ("         -.250", -0.25),
        ("9999999999.999", 9999999999.999),
        ("-999999999.999", -999999999.999),
    ],
)
def test_a_sign_may_stand_anywhere_before_the_digits(text: str, value: float) -> None:
    assert parsed([text + "  "]) == ([value], [-1], [-1], [False])


@pytest.mark.parametrize(
    "text",
    [
        "     1 -21.001  ", "    +-  21.001  ", "  -    -21.001  ",
        "       1 2.000  ", "         a.000  ", "       1 .0000  ", "1         .000  ",
        "20788290.364    ", "   20788290.36  ", "  20788290.3 4  ", "  20788290,364  ",
        "  20788290.364x ", "  20788290.364 x", "               x", "  2078\x00290.364  ",
        "  2078829:.364  ", "  20788290.36/  ", "  20788290.3\x7f4  ", "           nan  ",
        "    -\x00  21.001  ", "     ,  21.001  ", "     \t  21.001  ", "  207882P0.364  ",
        "   1e5   0.000  ", " _       1.000  ",
    ],
)  # fmt: skip
def test_what_is_no_regular_number_is_told(text: str) -> None:
    value, lock, strength, irregular = parsed([text])
    assert irregular == [True]
    assert math.isnan(value[0])
    assert lock == strength == [-1]


@given(st.binary(min_size=16, max_size=16))
def test_bytes_are_a_number_only_if_python_agrees(text: bytes) -> None:
    found = parse_fields(np.frombuffer(text, np.uint8).reshape(1, -1))
    value = found.value[0, 0]
    if not np.isnan(value):
        assert value == float(text[:14].replace(b" ", b""))
        assert text[10:11] == b"."


one_off = st.tuples(cells, st.integers(0, 15), st.sampled_from(b" 019.-+/:\0\xff@P")).map(
    lambda c: c[0].encode()[: c[1]] + bytes([c[2]]) + c[0].encode()[c[1] + 1 :]
)


@given(one_off)
def test_a_field_with_a_byte_changed_is_read_rightly_or_not_at_all(text: bytes) -> None:
    found = parse_fields(np.frombuffer(text, np.uint8).reshape(1, -1))
    value, number = found.value[0, 0], text[:14]
    if np.isnan(value):
        return
    digits = number.lstrip(b" +-")
    assert b" " not in digits
    assert number[: len(number) - len(digits)].strip(b" ") in (
        b"",
        b"+",
        b"-",
    )
    assert value == float(number.replace(b" ", b""))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (b"  20788290.36 ", 20788290.36),
        (b"20788290.364  ", 20788290.364),
        (b"      20788290", 20788290.0),
        (b"          -.5 ", -0.5),
    ],
)
def test_numbers_with_the_point_elsewhere(text: bytes, value: float) -> None:
    assert number_otherwise(text) == value


@pytest.mark.parametrize(
    "text",
    [b" 24000000.1237", b"8130000000.123", b"8  24000000.12", b"1_000.0       ", b"nan           ",
     b"1e5           ", b"              ", b"- 5.000       ", b".             "],
)  # fmt: skip
def test_numbers_run_into_others_are_none(text: bytes) -> None:
    assert math.isnan(number_otherwise(text))
