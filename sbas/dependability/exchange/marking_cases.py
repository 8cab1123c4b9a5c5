"""A condition on a marking as separate cases, each a conjunction of bounds on places."""

from __future__ import annotations

from dataclasses import dataclass

from sbas.dependability.simulation.petri_net import AtLeastOf, Condition, NotOf, Tokens
from sbas.exceptions import ModelError

Bounds = dict[str, tuple[int, int | None]]
"""Of each place: tokens it holds at least, and tokens it holds fewer than (None: any number)."""

MAX_CASES = 4096
_MAX_TERMS = 5000


@dataclass(frozen=True)
class Cases:
    """All markings, split by a condition: no two cases overlap."""

    true: tuple[Bounds, ...]
    false: tuple[Bounds, ...]


def separate_cases(condition: Condition, where: str) -> Cases:
    """Cases in which a condition holds and in which it does not.

    Parameters
    ----------
    condition : guard of a transition.
    where : for errors.

    Raises
    ------
    ModelError : more than `MAX_CASES` cases.

    References
    ----------
    Shannon expansion, one term "p holds k or more" at a time.
    """
    if _terms(condition) > _MAX_TERMS:
        raise ModelError(
            f"a guard of more than {_MAX_TERMS} terms cannot be written with arcs", where=where
        )
    true: list[Bounds] = []
    false: list[Bounds] = []
    stack: list[Bounds] = [{}]
    while stack:
        bounds = stack.pop()
        value, open_term = _evaluate(condition, bounds)
        if open_term is None:
            (true if value else false).append(bounds)
        else:
            place, k = open_term.place, open_term.at_least
            low, high = bounds.get(place, (0, None))
            stack.append({**bounds, place: (low, k)})
            stack.append({**bounds, place: (k, high)})
        if len(true) + len(false) + len(stack) > MAX_CASES:
            raise ModelError(
                f"a guard of more than {MAX_CASES} cases cannot be written with arcs", where=where
            )
    return Cases(tuple(true), tuple(false))


def _terms(condition: Condition) -> int:
    count, stack = 0, [condition]
    while stack:
        at = stack.pop()
        count += 1
        if isinstance(at, AtLeastOf):
            stack.extend(at.terms)
        elif isinstance(at, NotOf):
            stack.append(at.term)
    return count


def _evaluate(condition: Condition, bounds: Bounds) -> tuple[bool | None, Tokens | None]:
    """The value where the bounds settle it, else a term that they leave open."""
    if isinstance(condition, Tokens):
        low, high = bounds.get(condition.place, (0, None))
        if low >= condition.at_least:
            return True, None
        if high is not None and high <= condition.at_least:
            return False, None
        return None, condition
    if isinstance(condition, NotOf):
        value, term = _evaluate(condition.term, bounds)
        return (None, term) if value is None else (not value, None)
    held = still_open = 0
    first = None
    for part in condition.terms:
        value, term = _evaluate(part, bounds)
        if value is None:
            still_open += 1
            first = first or term
        held += bool(value)
    if held >= condition.k:
        return True, None
    if held + still_open < condition.k:
        return False, None
    return None, first
