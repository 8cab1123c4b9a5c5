"""Lines and epoch records of RINEX 3 and 4 observations, all at once.

Source: RINEX 3.05, table A3 (epoch record).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sbas.timescales import GPS_EPOCH_NS, NS_PER_S

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

BLANK = 0x20
LONGEST = 3 + 16 * 999
"""Bytes of the longest line that is looked at: I3 codes of 16 characters each."""
PADDING = b" " * LONGEST
"""What must stand behind a text, so that a line can be taken whole wherever it begins."""


@dataclass(frozen=True, eq=False)
class Lines:
    """Places of the lines of a padded text: (n,) first byte and end without the line end."""

    data: Bytes
    start: Ints
    end: Ints

    def some(self, rows: Ints | Bools | slice) -> Lines:
        return Lines(self.data, self.start[rows], self.end[rows])

    def gather(self, first: int, last: int) -> Bytes:
        """(n, last - first) bytes from column `first`, blank beyond a line's end."""
        width = last - first
        text = sliding_window_view(self.data, width)[self.start + first]
        left = self.end - self.start - first
        short = np.flatnonzero(left < width)
        if short.size == left.size:
            np.putmask(text, np.arange(width) >= left[:, None], BLANK)
        elif short.size:
            some = text[short]
            np.putmask(some, np.arange(width) >= left[short, None], BLANK)
            text[short] = some
        return text


def lines_of(data: Bytes, size: int) -> Lines:
    """Lines of a padded text of `size` bytes; what follows the last line end is one too."""
    text = data[:size]
    ends = np.flatnonzero(text == 0x0A)
    if size and (not ends.size or ends[-1] != size - 1):
        ends = np.append(ends, size)
    starts = np.concatenate([[0], ends[:-1] + 1])[: ends.size]
    carriage = (ends > starts) & (data[np.maximum(ends - 1, 0)] == 0x0D)
    return Lines(data, starts, ends - carriage)


@dataclass(frozen=True, eq=False)
class EpochLines:
    """Epoch records (n,).

    `minute_ns` is the whole minute on the datetime64 scale, in the file's time scale, and
    `second_ns` what follows: a leap second has no datetime64. `timed` tells whether both could
    be read, `blank` that there is no time at all, `counted` whether flag and number could.
    """

    minute_ns: Ints
    second_ns: Ints
    flag: Ints
    count: Ints
    timed: Bools
    blank: Bools
    counted: Bools


_SECOND, _POINT, _FLAG, _COUNT = 19, 21, 31, 32
_BETWEEN = [1, 6, 9, 12, 15, 18, 29, 30]


def parse_epochs(lines: Lines) -> EpochLines:
    """Epoch records of lines that begin with `>`."""
    text = lines.gather(0, 35)
    is_digit = text - np.uint8(0x30) < 10
    is_blank = text == BLANK
    digit = np.where(is_digit, text - np.uint8(0x30), 0).astype(np.int64)

    def number(first: int, last: int) -> tuple[Ints, Bools]:
        """A number whose blanks all stand in front of it."""
        value = np.zeros(len(text), np.int64)
        good = is_digit[:, last].copy()
        for column in range(first, last + 1):
            value = 10 * value + digit[:, column]
            good &= is_digit[:, column] | (is_blank[:, column] & ~is_digit[:, first:column].any(1))
        return value, good

    year, timed = number(2, 5)
    month, good = number(7, 8)
    timed &= good
    for first in (10, 13, 16, _SECOND):
        timed &= number(first, first + 1)[1]
    day, hour, minute, second = (number(first, first + 1)[0] for first in (10, 13, 16, _SECOND))
    fraction = np.zeros(len(text), np.int64)
    for column in range(_POINT + 1, _POINT + 8):
        fraction = 10 * fraction + digit[:, column]
    timed &= (text[:, _POINT] == ord(".")) & is_blank[:, _BETWEEN].all(axis=1)
    timed &= is_digit[:, _POINT + 1 : _POINT + 8].all(axis=1)
    timed &= (year >= 1980) & (year < 2262) & (month >= 1) & (month <= 12) & (day >= 1)
    timed &= (hour < 24) & (minute < 60) & (second <= 60)
    months = (np.where(timed, year, 1980) - 1970) * 12 + np.where(timed, month, 1) - 1
    first_day = months.astype("M8[M]").astype("M8[D]").astype(np.int64)
    next_month = (months + 1).astype("M8[M]").astype("M8[D]").astype(np.int64)
    timed &= day <= next_month - first_day
    minute_ns = ((first_day + day - 1) * 86400 + hour * 3600 + minute * 60) * NS_PER_S
    timed &= minute_ns >= GPS_EPOCH_NS
    count, counted = number(_COUNT, _COUNT + 2)
    flag, good = number(_FLAG, _FLAG)
    return EpochLines(
        np.where(timed, minute_ns, GPS_EPOCH_NS),
        np.where(timed, second * NS_PER_S + fraction * 100, 0),
        flag,
        count,
        timed,
        is_blank[:, 1:_FLAG].all(axis=1),
        counted & good,
    )
