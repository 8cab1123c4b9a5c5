"""A truth table as a static fault tree, with the probabilities of its sensors' states.

Basic events of a tree are independent, but DA and U of a sensor exclude each other. So the tree
has the events U and "DA if not U", of probability d/(1 - u): a sensor is at least DA where either
occurs, and exactly DA where the second occurs without the first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.dependability.static.static_tree import BasicEvent, GateKind, StaticGate, StaticTree
from sbas.dependability.tree.model import House
from sbas.exceptions import InputError
from sbas.fusion.logic.boolean_form import Condition, Implicant, prime_implicants
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.states import DA, N, U


def logic_tree(
    table: TruthTable, condition: Condition, *, degraded: ArrayLike, unacceptable: ArrayLike
) -> StaticTree:
    """The static fault tree of "not N" or "is U", sensors being independent of each other.

    Parameters
    ----------
    table : truth table.
    condition : "notN" or "isU"; the name of the top.
    degraded, unacceptable : (n,) probability of each sensor to be in DA and in U [1].

    Returns
    -------
    StaticTree: an "or" of the prime implicants, with gates "not" only where the function is not
    monotone. Events are called SENSOR_U and SENSOR_DA_if_not_U. `top_probability` of it is exact;
    `open_psa_text` writes it.

    Raises
    ------
    InputError : probabilities outside 0..1, or more than 1 together; another number of them.
    ModelError : names of sensors that make two events or gates of one name.

    Notes
    -----
    P(DA if not U) = d/(1 - u), so that P(DA) = (1 - u) d/(1 - u) = d and P(at least DA) = u + d.
    """
    d, u = _marginals(table, degraded, unacceptable)
    builder = _Gates(table.names)
    implicants = prime_implicants(table, condition)
    if not implicants or not implicants[0].literals:
        house = House(condition, bool(implicants))
        return StaticTree(condition, (), (), condition, (house,))
    if len(implicants) == 1:
        builder.add(condition, "and", builder.literals(implicants[0]))
    else:
        products = [
            builder.product(f"{condition}_{i}", implicant)
            for i, implicant in enumerate(implicants, start=1)
        ]
        builder.add(condition, "or", products)
    probability = {}
    for name, of_degraded, of_unacceptable in zip(table.names, d.tolist(), u.tolist(), strict=True):
        rest = 1.0 - of_unacceptable
        probability[_u(name)] = of_unacceptable
        probability[_da(name)] = min(of_degraded / rest, 1.0) if rest > 0 else 0.0
    used = {name for gate in builder.gates for name in gate.inputs}
    events = [BasicEvent(name, p) for name, p in probability.items() if name in used]
    return StaticTree(condition, tuple(events), tuple(builder.gates), condition)


def _u(sensor: str) -> str:
    return f"{sensor}_U"


def _da(sensor: str) -> str:
    return f"{sensor}_DA_if_not_U"


class _Gates:
    """Gates of a tree in the making; a condition on a sensor is written once."""

    def __init__(self, names: Sequence[str]) -> None:
        self.names = names
        self.gates: list[StaticGate] = []
        self._literals: dict[tuple[int, int, int], str] = {}

    def add(self, name: str, kind: GateKind, inputs: Sequence[str]) -> str:
        self.gates.append(StaticGate(name, kind, tuple(inputs)))
        return name

    def product(self, name: str, implicant: Implicant) -> str:
        literals = self.literals(implicant)
        return literals[0] if len(literals) == 1 else self.add(name, "and", literals)

    def literals(self, implicant: Implicant) -> list[str]:
        return [
            self._literal(k, implicant.lowest[k], implicant.highest[k]) for k in implicant.literals
        ]

    def _literal(self, k: int, lowest: int, highest: int) -> str:
        key = (k, lowest, highest)
        if key not in self._literals:
            self._literals[key] = self._condition(self.names[k], lowest, highest)
        return self._literals[key]

    def _condition(self, sensor: str, lowest: int, highest: int) -> str:
        u, da = _u(sensor), _da(sensor)
        if lowest == U:
            return u
        if (lowest, highest) == (DA, U):
            return self.add(f"{sensor}_DA_or_U", "or", (u, da))
        if (lowest, highest) == (N, N):
            return self.add(f"{sensor}_N", "nor", (u, da))
        not_u = f"{sensor}_not_U"
        if all(gate.name != not_u for gate in self.gates):
            self.add(not_u, "not", (u,))
        return not_u if lowest == N else self.add(f"{sensor}_DA", "and", (not_u, da))


def _marginals(
    table: TruthTable, degraded: ArrayLike, unacceptable: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    d, u = (np.asarray(p, dtype=np.float64) for p in (degraded, unacceptable))
    n = len(table.names)
    if d.shape != (n,) or u.shape != (n,):
        raise InputError(
            f"each of the {n} sensors has a probability of DA and of U",
            where="degraded, unacceptable",
            evidence=f"shapes {d.shape} and {u.shape}",
        )
    # The sum of shares of one record may round to just above 1.
    if not np.all((d >= 0) & (u >= 0) & (d + u <= 1 + 4 * math.ulp(1.0))):
        raise InputError(
            "probabilities of DA and U lie between 0 and 1, and so does their sum",
            where="degraded, unacceptable",
            evidence=f"DA {d.tolist()}, U {u.tolist()}",
        )
    return d, u
