"""Boolean form of a truth table: prime implicants of "not N" and "is U", and minimal cuts.

A sensor with three states has two Boolean variables, D (at least DA) and U, where U implies D. A
product of them asks of each sensor a stretch of levels: D is DA..U, not U is N..DA, D and not U
is DA alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.static.cut_sets import minimal_cut_sets
from sbas.dependability.static.static_tree import BasicEvent, StaticGate, StaticTree
from sbas.dependability.tree.model import House
from sbas.exceptions import InputError
from sbas.fusion.logic.truth_table import Codes, TruthTable, monotony_violations
from sbas.fusion.states import DA, N, U, combination_states, combination_words

Condition = Literal["notN", "isU"]
Bools = NDArray[np.bool_]

WORST_FROM: Final[dict[Condition, int]] = {"notN": DA, "isU": U}
"""The condition holds where the output's state has this code or a higher one."""
MAX_NOT_MONOTONE = 9
"""Sensors of a table that is not monotone: it has 6^n products."""

_STRETCHES = ((N, N), (DA, DA), (U, U), (N, DA), (DA, U), (N, U))
_WIDER = ((0, 3), (1, 3), (1, 4), (2, 4), (3, 5), (4, 5))
"""Positions in `_STRETCHES` of one and of another that is one level longer."""
_WORDS = {(N, N): "= N", (DA, DA): "= DA", (U, U): "= U", (N, DA): "<= DA", (DA, U): ">= DA"}


@dataclass(frozen=True, order=True)
class Implicant:
    """A product of conditions on sensors that makes the function true.

    Parameters
    ----------
    lowest, highest : (n,) best and worst state that each sensor may have.
    """

    lowest: tuple[int, ...]
    highest: tuple[int, ...]

    @property
    def literals(self) -> tuple[int, ...]:
        """Sensors on which it sets a condition, by their position."""
        pairs = enumerate(zip(self.lowest, self.highest, strict=True))
        return tuple(k for k, stretch in pairs if stretch != (N, U))

    def words(self, names: Sequence[str]) -> str:
        """The product in words, such as "Odo >= DA and GPS = U"; "always" without a condition."""
        stated = (f"{names[k]} {_WORDS[self.lowest[k], self.highest[k]]}" for k in self.literals)
        return " and ".join(stated) or "always"


def holds(table: TruthTable, condition: Condition) -> Bools:
    """(3^n,) where the output is not N, or is U.

    Raises
    ------
    InputError : another condition.
    """
    if condition not in get_args(Condition):
        raise InputError(
            f"{condition!r} is no condition", where="condition", cure="notN (DA or U) or isU"
        )
    return np.asarray(table.outcomes >= WORST_FROM[condition])


def two_line_form(names: Sequence[str]) -> TruthTable:
    """The table that two lines define: notN = any U, or all at least DA; isU = all U.

    Parameters
    ----------
    names : (n,) sensors.

    Returns
    -------
    TruthTable: N where no sensor is U and at least one is N. Of three sensors it is the corrected
    Figure 9 of Railways 2014.
    """
    states = combination_states(np.arange(3 ** len(names)), len(names))
    not_nominal = np.any(states == U, axis=0) | np.all(states >= DA, axis=0)
    outcomes = not_nominal.astype(np.int8) + np.all(states == U, axis=0).astype(np.int8)
    return TruthTable(tuple(names), outcomes, "notN = any U, or all at least DA; isU = all U")


def prime_implicants(table: TruthTable, condition: Condition) -> tuple[Implicant, ...]:
    """All prime implicants: products of conditions of which none can be dropped or widened.

    Parameters
    ----------
    table : truth table; one that is not monotone has implicants with upper bounds, too.
    condition : "notN" or "isU".

    Returns
    -------
    Implicants, those with fewer conditions first; together they are the function. Of a monotone
    function these are its minimal cuts.

    Raises
    ------
    InputError : a function that is not monotone, of more than 9 sensors.

    Notes
    -----
    Monotone: the lowest combinations at which the function is true. Else: of all 6^n products of
    stretches of levels those that lie in the function and in no wider one that does.

    References
    ----------
    Quine 1952, The problem of simplifying truth functions, on two variables a sensor.
    """
    true = holds(table, condition)
    n = len(table.names)
    lowest = lowest_true(true.reshape((3,) * n))
    if lowest is not None:
        return _in_order(Implicant(tuple(low), (U,) * n) for low in np.argwhere(lowest).tolist())
    if n > MAX_NOT_MONOTONE:
        raise InputError(
            f"{condition} is not monotone and has more than {MAX_NOT_MONOTONE} sensors",
            where="table",
            evidence=f"{n} sensors, {6**n} products",
            cure="monotony_violations() lists what makes it so",
        )
    return _in_order(
        Implicant(
            tuple(_STRETCHES[s][0] for s in product), tuple(_STRETCHES[s][1] for s in product)
        )
        for product in _widest(true, n)
    )


def minimal_cuts(table: TruthTable, condition: Condition) -> tuple[Implicant, ...]:
    """Minimal cuts of a monotone function, from its binary decision diagram.

    Parameters
    ----------
    table : truth table.
    condition : "notN" or "isU".

    Returns
    -------
    The same as `prime_implicants`, found on another way: a check of both.

    Raises
    ------
    InputError : a function that is not monotone, with a pair of combinations that shows it.

    Notes
    -----
    The diagram's variables are D and U of each sensor. It reads U without D, which cannot be, as
    N: then it is monotone in all of them, and a cut that asks for U asks for D, too, so that it
    contains the cut that asks for D alone where that is enough.

    References
    ----------
    Rauzy 1993, New algorithms for fault trees analysis, section 4.
    """
    true = holds(table, condition)
    n = len(table.names)
    falls = _falls(table, true)
    if len(falls):
        better, worse = (combination_words(int(code), n) for code in falls[0])
        raise InputError(
            f"{condition} has no minimal cuts: a worse sensor makes it false",
            where="table",
            evidence=f"true in {better}, false in {worse}",
            cure="prime_implicants() takes any table",
        )
    found = []
    for cut in minimal_cut_sets(_decision_tree(true, n)).sets():
        lowest = [N] * n
        for event in cut:
            level, k = event.split()
            lowest[int(k)] = max(lowest[int(k)], U if level == "U" else DA)
        found.append(Implicant(tuple(lowest), (U,) * n))
    return _in_order(found)


def _falls(table: TruthTable, true: Bools) -> Codes:
    """Pairs of codes, one sensor one level worse, where a function becomes false."""
    return monotony_violations(replace(table, outcomes=true.astype(np.int8)))


def _in_order(implicants: Iterable[Implicant]) -> tuple[Implicant, ...]:
    return tuple(sorted(implicants, key=lambda i: (len(i.literals), i.literals, i)))


def lowest_true(true: Bools) -> Bools | None:
    """Where a monotone function is true, and false as soon as one sensor gets better.

    Parameters
    ----------
    true : (3,) * n where it is true, one axis a sensor, the first first.

    Returns
    -------
    (3,) * n; None where the function is not monotone: a sensor that gets worse makes it false.
    """
    lowest = true.copy()
    for axis in range(true.ndim):
        along = np.moveaxis(true, axis, 0)
        if np.any(along[:U] & ~along[DA:]):
            return None
        worse = np.moveaxis(lowest, axis, 0)[DA:]
        worse &= ~along[:U]
    return lowest


def _widest(true: Bools, n: int) -> list[list[int]]:
    """Products, by positions in `_STRETCHES`, that lie in a function and in no wider that does."""
    inside = true.reshape((3,) * n)
    for axis in range(n):
        levels = np.moveaxis(inside, axis, 0)
        of_stretch = [levels[low : high + 1].all(axis=0) for low, high in _STRETCHES]
        inside = np.stack(of_stretch, axis=axis)
    widest = inside.copy()
    for axis in range(n):
        kept, wider = np.moveaxis(widest, axis, 0), np.moveaxis(inside, axis, 0)
        for one, longer in _WIDER:
            kept[one] &= ~wider[longer]
    products: list[list[int]] = np.argwhere(widest).tolist()
    return products


def _decision_tree(true: Bools, n: int) -> StaticTree:
    """Gates that ask one sensor after the other for its level; equal branches are shared."""
    gates: list[StaticGate] = []
    known: dict[bytes, str] = {}

    def gate(kind: Literal["and", "or"], *inputs: str) -> str:
        gates.append(StaticGate(f"{kind} {len(gates)}", kind, inputs))
        return gates[-1].name

    def branch(values: Bools) -> str:
        if values.all() or not values.any():
            return "always" if values[0] else "never"
        key = values.tobytes()
        if key not in known:
            sensor = n - round(math.log(values.size, 3))
            better, degraded, worst = (branch(part) for part in np.split(values, 3))
            known[key] = gate(
                "or",
                gate("and", f"D {sensor}", f"U {sensor}", worst),
                gate("and", f"D {sensor}", degraded),
                better,
            )
        return known[key]

    top = branch(true)
    events = tuple(BasicEvent(f"{level} {k}", 0.5) for k in range(n) for level in "DU")
    houses = (House("always", True), House("never", False))
    return StaticTree("decision tree", events, tuple(gates), top, houses)
