"""Columns of letters N, S, E, W: the signs of latitudes and longitudes."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.logs.delimited.mode_words import encoded

_LETTERS = {
    "lat_hemisphere": {"n": 1.0, "north": 1.0, "s": -1.0, "south": -1.0},
    "lon_hemisphere": {"e": 1.0, "east": 1.0, "w": -1.0, "west": -1.0},
}


def with_signs(
    degrees: NDArray[np.float64], words: Any, name: str, where: str
) -> tuple[NDArray[np.float64], Counter[tuple[str, str]]]:
    """(n,) degrees with the signs of (n,) letters, and how many have each letter.

    Raises
    ------
    InputError : letters of no hemisphere, or a degree with a sign that the letter contradicts or
        repeats.
    """
    known = _LETTERS[name]
    codes, uniques = encoded(words)
    plain = [word.strip().lower() for word in uniques]
    signs = np.array([known.get(word, np.nan) for word in plain] + [np.nan])[codes]
    there = np.isfinite(degrees) & (degrees != 0)
    if (lost := there & np.isnan(signs)).any():
        at = int(np.argmax(lost))
        raise InputError(
            "a position has no letter of its hemisphere",
            where=where,
            evidence=f"{int(lost.sum()):,} rows, first {degrees[at]:.9g} with "
            f"{uniques[codes[at]]!r}",
            cure="write N or S, and E or W; or take the column out where the numbers have signs",
        )
    if (signed := there & (degrees < 0)).any():
        at = int(np.argmax(signed))
        raise InputError(
            "degrees have a sign beside a letter of the hemisphere: one of them is wrong, or said "
            "twice",
            where=where,
            evidence=f"{int(signed.sum()):,} rows, first {degrees[at]:.9g} {uniques[codes[at]]}",
            cure=f"take the column of letters out, or rename it to 'x_{name}', where the numbers "
            "have the right signs",
        )
    letter = [word[:1].upper() for word in plain]
    numbers = np.bincount(codes[there], minlength=len(plain))
    counts: Counter[tuple[str, str]] = Counter()
    for word, number in zip(letter, numbers.tolist(), strict=True):
        if number:
            counts[name, word] += number
    return np.where(there, degrees * signs, degrees), counts
