"""Single values of a model: what they may be, in one voice."""

from __future__ import annotations

import math
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

from sbas.exceptions import ModelError


def refuse(what: str, where: str, seen: object, cure: str) -> ModelError:
    """The error that names the key path, what stands there and what to write."""
    evidence = seen if isinstance(seen, str) else repr(seen)
    return ModelError(what, where=where, evidence=evidence[:300], cure=cure)


def items(value: Any, where: str) -> tuple[Any, ...]:
    """The value, which must be a tuple."""
    if not isinstance(value, tuple):
        raise refuse("a list is expected here", where, value, "write a tuple, in a file a list")
    return value


def a_number(value: Any, where: str, *, positive: bool = False, high: float = math.inf) -> float:
    """A finite number, 0 (or, if positive, more) to `high`."""
    fits = isinstance(value, Real) and not isinstance(value, bool)
    try:
        number = float(value) if fits else math.nan
    except OverflowError:
        number = math.inf
    if not (math.isfinite(number) and 0.0 <= number <= high) or (positive and number == 0.0):
        low = "more than 0" if positive else "0 or more"
        limit = f" and at most {high:g}" if math.isfinite(high) else ""
        raise refuse("a value out of range", where, value, f"write a finite number, {low}{limit}")
    return number


def a_whole_number(value: Any, where: str) -> int:
    """An integer; 6.0 and true are none."""
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise refuse("a count that is no integer", where, value, "write an integer, such as 2")
    return int(value)


def a_truth(value: Any, where: str) -> bool:
    """True or false and nothing like it."""
    if not isinstance(value, bool):
        raise refuse("neither true nor false", where, value, "write true or false")
    return value


def a_text(value: Any, where: str) -> str:
    """A string."""
    if not isinstance(value, str):
        raise refuse("a text is expected here", where, value, "write it in quotes")
    return value


def a_name(value: Any, where: str) -> str:
    """A string of printable characters, not empty and without space at its ends."""
    if not isinstance(value, str) or not value.isprintable() or value.strip() != value or not value:
        raise refuse("no name", where, value, "write a printable name without space at its ends")
    return value


def a_choice(value: Any, known: Iterable[str], where: str) -> str:
    """One of the known words."""
    words = tuple(known)
    if not isinstance(value, str) or value not in words:
        raise refuse("an unknown choice", where, value, f"write one of {', '.join(words)}")
    return value
