"""Observation fields (F14.3, I1, I1) to numbers, eight characters in one integer.

A field of 16 bytes is two 64-bit words, so that one operation of numpy treats eight characters
of every field; conditions on characters become conditions on the bytes of a word.
Source of the format: RINEX 3.05, table A3; of adding neighbouring digits pairwise: D. Lemire,
Number parsing at a gigabyte per second, Software: Practice and Experience 51 (2021).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]
Floats = NDArray[np.float64]
Marks = NDArray[np.int8]
Bools = NDArray[np.bool_]

FIELD = 16
NUMBER = 14
_OTHERWISE = re.compile(rb" *([+-]?(?:[0-9]+\.?[0-9]{0,3}|\.[0-9]{1,3})) *")
_LARGEST = 1e9
"""No pseudorange, phase or Doppler reaches it; a number run into its neighbour may."""


def _word(byte: int, count: int = 8) -> np.uint64:
    """A word of equal bytes."""
    return np.uint64(byte * (0x0101010101010101 >> 8 * (8 - count)))


_ONE, _SPACES, _ZEROS, _TOP, _REST = (_word(b) for b in (0x01, 0x20, 0x30, 0x80, 0x7F))
_ABOVE_9 = _word(0x76)
"""Carries into the highest bit of a byte below 128 where that is above 9."""
_BYTE, _FIRST_2, _NEXT_4, _FIRST_6 = (_word(0xFF, n) for n in (1, 2, 4, 6))
_POINT_AND_ZEROS = np.uint64(int.from_bytes(b".000", "little"))
_MINUS, _PLUS = np.uint64(ord("-") ^ ord(" ")), np.uint64(ord("+") ^ ord(" "))
_4, _8, _16, _24, _32, _40, _56 = (np.uint64(n) for n in (4, 8, 16, 24, 32, 40, 56))


@dataclass(frozen=True, eq=False)
class FieldValues:
    """Fields (r, k): NaN and -1 where blank.

    `irregular` tells where a field is neither blank nor a number with three decimals whose point
    stands in column 10, or has marks that are no digits; it is NaN and -1 too.
    """

    value: Floats
    loss_of_lock: Marks
    strength: Marks
    irregular: Bools


def parse_fields(text: Bytes) -> FieldValues:
    """Numbers and marks of (r, 16 k) bytes, k fields a row.

    Before its first digit a number has nothing but blanks and one sign, anywhere among them.
    """
    words = text.view("<u8")
    low, high = words[:, 0::2], words[:, 1::2]  # characters 0 to 7 and 8 to 15
    # Bit 4 tells a digit from blank and sign; what else has it is refused as no digit.
    digit, digit_89 = (low >> _4) & _ONE, (high >> _4) & (_ONE & _FIRST_2)
    mask, mask_89 = digit * _BYTE, digit_89 * _BYTE
    number, number_89 = (low ^ _ZEROS) & mask, (high ^ _ZEROS) & mask_89
    tail = ((high >> _16) & _NEXT_4) ^ _POINT_AND_ZEROS
    wrong = _above_9(number) | _above_9(number_89 | tail << _16) | (tail & _BYTE)
    # Behind a digit stand digits only.
    wrong |= (digit << _8) & ~digit
    wrong |= (digit >> _56 | (digit_89 << _8)) & ~digit_89 & _FIRST_2
    # What is no digit is blank but for one sign. Signs, other than blanks, are odd.
    other, other_89 = (low ^ _SPACES) & ~mask, (high ^ _SPACES) & ~mask_89 & _FIRST_2
    sign, sign_89 = other & _ONE, other_89 & _ONE
    minus = (other == sign * _MINUS) & (other_89 == sign_89 * _MINUS)
    plus = (other == sign * _PLUS) & (other_89 == sign_89 * _PLUS)
    signs = sign | sign_89 << np.uint64(1)
    good = (wrong == 0) & (minus | plus) & ((signs & (signs - np.uint64(1))) == 0)
    blank = (low == _SPACES) & ((high ^ _SPACES) & _FIRST_6 == 0)

    first = (tail >> _8) & _BYTE
    second, third = (tail >> _16) & _BYTE, (tail >> _24) & _BYTE
    whole = _eight_digits(number) * np.uint64(100)
    whole += (number_89 & _BYTE) * np.uint64(10) + (number_89 >> _8)
    thousandths = whole * np.uint64(1000) + first * np.uint64(100) + second * np.uint64(10) + third
    # Below 2^53 and divided once: the same number as of Python's own parser.
    value = thousandths.astype(np.float64) / 1000
    np.negative(value, out=value, where=minus & (signs != 0))
    lock, strength, marked = _marks(text)
    irregular = ~(good | blank) | ~marked
    np.putmask(value, irregular | blank, np.nan)
    np.putmask(lock, irregular, -1)
    np.putmask(strength, irregular, -1)
    return FieldValues(value, lock, strength, irregular)


def _above_9(numbers: Words) -> Words:
    return (((numbers & _REST) + _ABOVE_9) | numbers) & _TOP


def _eight_digits(numbers: Words) -> Words:
    """Value of eight bytes of 0 to 9, the first one the most significant."""
    pairs = (numbers * np.uint64(10 << 8 | 1) >> _8) & np.uint64(0x00FF00FF00FF00FF)
    fours = (pairs * np.uint64(100 << 16 | 1) >> _16) & np.uint64(0x0000FFFF0000FFFF)
    return fours * np.uint64(10_000 << 32 | 1) >> _32


def _marks(text: Bytes) -> tuple[Marks, Marks, Bools]:
    found = []
    good: Bools | np.bool_ = np.True_
    for column in (NUMBER, NUMBER + 1):
        character = text[:, column::FIELD]
        digit = character - np.uint8(0x30)
        is_digit = digit < 10
        found.append(np.where(is_digit, digit, np.uint8(0xFF)).view(np.int8))
        good = good & (is_digit | (character == 0x20))
    return found[0], found[1], np.asarray(good)


def number_otherwise(text: bytes) -> float:
    """A number of 14 characters whose point stands elsewhere, or nowhere; NaN for what is none.

    At most three decimals, so that a mark behind the number is not taken for its last digit.
    """
    match = _OTHERWISE.fullmatch(text)
    value = float(match[1]) if match else float("nan")
    return value if abs(value) < _LARGEST else float("nan")
