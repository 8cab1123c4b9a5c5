"""Fields of many sentences at once: numbers, times of day, angles and letters.

Numbers are read digit by digit as integers and divided once by a power of ten, so that they are
rounded as `float(text)` rounds (up to 15 digits), and times of day are exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sbas.logs.nmea.nmea_framing import Bytes, Positions, Sentences
from sbas.timescales import NS_PER_S

_LONGEST = 20
_MOST_DIGITS = 18
_POINT, _MINUS, _PLUS = ord("."), ord("-"), ord("+")
_TEN = 10 ** np.arange(_MOST_DIGITS + 1, dtype=np.int64)
NO_TIME = -1

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Numerals:
    """Written numbers.

    Parameters
    ----------
    mantissa : (n,) the digits as a signed integer; 0 where there is no number.
    decimals, whole : (n,) digits behind and before the point.
    known : (n,) whether there is a number.
    signed : (n,) whether it has a sign.
    """

    mantissa: Ints
    decimals: NDArray[np.int8]
    whole: NDArray[np.int8]
    known: Bools
    signed: Bools

    def values(self) -> Floats:
        """(n,) numbers, NaN where there is none."""
        return np.where(self.known, self.mantissa / _TEN[self.decimals], np.nan)


def numerals(data: Bytes, start: Positions, end: Positions) -> Numerals:
    """Numbers `[+-]digits[.digits]` in the spans [start, end) of some bytes."""
    n = len(start)
    found = Numerals(
        np.zeros(n, np.int64),
        np.zeros(n, np.int8),
        np.zeros(n, np.int8),
        np.zeros(n, np.bool_),
        np.zeros(n, np.bool_),
    )
    length = np.minimum(end - start, _LONGEST + 1)
    sizes = np.flatnonzero(np.bincount(length, minlength=1))
    for size in sizes[(sizes > 0) & (sizes <= _LONGEST)].tolist():
        at = np.flatnonzero(length == size)
        text = np.ascontiguousarray(sliding_window_view(data, size)[start[at]].T)
        _read_size(text, at, found)
    return found


def _read_size(text: Bytes, at: NDArray[np.intp], found: Numerals) -> None:
    """Numbers of (size, m) bytes, all of one length, put at `at`; one pass a place of the point."""
    size = len(text)
    digit = text - np.uint8(48)
    digits = (digit <= 9).sum(axis=0, dtype=np.int8)
    is_point = text == _POINT
    points = is_point.sum(axis=0, dtype=np.int8)
    sign = (text[0] == _MINUS) | (text[0] == _PLUS)
    good = (digits + points + sign == size) & (points <= 1) & (digits > 0)
    good &= digits <= _MOST_DIGITS
    place = np.where(points == 1, is_point.argmax(axis=0), size)
    pattern = np.where(good, 2 * place + sign, 2 * size + 2)
    for kind in np.flatnonzero(np.bincount(pattern, minlength=2 * size + 3)[:-1]).tolist():
        point, signed = divmod(kind, 2)
        chosen = np.flatnonzero(pattern == kind)
        rows = digit if len(chosen) == digit.shape[1] else digit[:, chosen]
        value = np.zeros(len(chosen), np.int64)
        for column in range(signed, size):
            if column != point:
                value *= 10
                value += rows[column]
        to = at[chosen]
        if signed:
            value = np.where(text[0, chosen] == _MINUS, -value, value)
        found.mantissa[to], found.known[to], found.signed[to] = value, True, bool(signed)
        found.whole[to] = point - signed
        found.decimals[to] = max(size - point - 1, 0)


class Fields:
    """Fields by number (0 is the address) of sentences of one kind; unreadable ones are counted.

    A field that a sentence lacks is empty.
    """

    def __init__(self, sentences: Sentences) -> None:
        self.sentences = sentences
        self.data = sentences.data
        self.unreadable = 0
        self.out_of_range = np.zeros(len(sentences), np.bool_)

    def __len__(self) -> int:
        return len(self.sentences)

    def span(self, field: int) -> tuple[Positions, Positions]:
        """(n,) first place and place behind of a field."""
        s = self.sentences
        there = field <= s.commas
        mark = s.first + np.where(there, field, 0)
        start, end = s.marks[mark] + 1, s.marks[mark + 1]
        return start, np.where(there, end, start)

    def _numerals(self, field: int) -> Numerals:
        start, end = self.span(field)
        found = numerals(self.data, start, end)
        self.unreadable += int(np.count_nonzero(~found.known & (end > start)))
        return found

    def number(self, field: int) -> Floats:
        """(n,) numbers, NaN where the field is empty or no number."""
        return self._numerals(field).values()

    def integer(self, field: int, missing: int = -1) -> Ints:
        """(n,) whole numbers that are not negative; `missing` for anything else."""
        found = self._numerals(field)
        good = found.known & (found.decimals == 0) & ~found.signed
        return np.where(good, found.mantissa, missing)

    def letter(self, field: int) -> Bytes:
        """(n,) the character of a field of one character, else 0."""
        start, end = self.span(field)
        return np.where(end - start == 1, self.data[start], np.uint8(0))

    def filled(self, field: int) -> Bools:
        """(n,) whether the field is not empty."""
        start, end = self.span(field)
        return end > start

    def clock_ns(self, field: int) -> Ints:
        """(n,) nanoseconds of day of `hhmmss[.f]`, from 0; `NO_TIME` where it is none.

        The seconds of a leap second (60) count on: 23:59:60 is 86,400 s.
        """
        found = self._numerals(field)
        over = np.maximum(found.decimals.astype(np.int64) - 9, 0)
        digits = found.mantissa // _TEN[over] * _TEN[9 - (found.decimals - over)]
        clock, fraction = np.divmod(digits, NS_PER_S)
        hour, minute, second = clock // 10_000, clock // 100 % 100, clock % 100
        good = found.known & ~found.signed & (found.whole == 6)
        good &= (hour < 24) & (minute < 60) & (second <= 60)
        self.unreadable += int(np.count_nonzero(found.known & ~good))
        seconds = hour * 3600 + minute * 60 + second
        return np.where(good, seconds * NS_PER_S + fraction, NO_TIME)

    def angle_deg(
        self, field: int, positive: bytes, negative: bytes, largest_deg: int
    ) -> tuple[Floats, NDArray[np.int8]]:
        """Degrees of (n,) fields `[d]ddmm[.f]` with their hemisphere in the field behind.

        Returns
        -------
        degrees : (n,) NaN where the field is empty or impossible.
        decimals : (n,) written decimals of the minutes.
        """
        found = self._numerals(field)
        letter = self.letter(field + 1)
        south = letter == negative[0]
        unit = _TEN[np.minimum(found.decimals, 12)]
        degree, minutes = np.divmod(found.mantissa, 100 * unit)
        good = found.known & ~found.signed & (found.decimals <= 12)
        good &= south | (letter == positive[0])
        parts = degree * (60 * unit) + minutes
        good &= (minutes < 60 * unit) & (parts <= largest_deg * (60 * unit))
        self.out_of_range |= found.known & ~good
        # One division of two exact integers: the nearest float64 to what was written.
        value = parts / (60 * unit)
        return np.where(good, np.where(south, -value, value), np.nan), found.decimals
