"""The binary decision diagram of a static fault tree, built by `dd` and flattened for passes."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sbas.exceptions import ModelError

if TYPE_CHECKING:
    from sbas.dependability.static.static_tree import StaticGate, StaticTree

FALSE, TRUE = 0, 1
MAX_EVENTS = 4000
"""Levels of a diagram: the library recurses once a level, in C on a stack of 8 MB."""
MAX_NODES = 2_000_000
_CUDD_MEMORY_BYTES = 2**30


@dataclass(frozen=True, eq=False)
class Diagram:
    """A reduced ordered decision diagram without complemented edges.

    Parameters
    ----------
    order : (v,) basic events, top level first.
    level, high, low : (n,) of each node, children before parents; node 0 is false, 1 is true.
    roots : nodes of the functions that were asked for.
    """

    order: tuple[str, ...]
    level: list[int]
    high: list[int]
    low: list[int]
    roots: tuple[int, ...]

    def node_probabilities(
        self, probabilities: Mapping[str, npt.NDArray[np.float64] | float]
    ) -> list[npt.NDArray[np.float64] | float]:
        """P(node) = p P(high) + (1 - p) P(low) of every node, children first.

        Parameters
        ----------
        probabilities : of every basic event in `order`, numbers or arrays [1].
        """
        occurs = [probabilities[name] for name in self.order]
        # 1 - p of an input is exact to half a unit in the last place; of a result it is not.
        absent = [1.0 - p for p in occurs]
        values: list[npt.NDArray[np.float64] | float] = [0.0, 1.0]
        for i in range(2, len(self.level)):
            at = self.level[i]
            values.append(occurs[at] * values[self.high[i]] + absent[at] * values[self.low[i]])
        return values


class TreeFunctions:
    """The functions of a tree's gates in a manager of the library `dd`.

    Parameters
    ----------
    tree : static fault tree, with at most `MAX_EVENTS` events below its top.

    Raises
    ------
    ModelError : more events, or a diagram of more than `MAX_NODES` nodes.
    """

    def __init__(self, tree: StaticTree) -> None:
        self.order = tree.variable_order()
        if len(self.order) > MAX_EVENTS:
            raise ModelError(
                f"{len(self.order)} basic events are more than the {MAX_EVENTS} of a diagram",
                where=f"fault tree {tree.name!r}",
                cure="solve independent branches on their own and put in their probabilities",
            )
        self.bdd = _manager()
        self.bdd.declare(*self.order)
        self._where = f"fault tree {tree.name!r}"
        self._operations = 0
        # Counting nodes takes 0.1 ms: in a tree of many inputs not after each operation.
        self._stride = 1 + sum(len(gate.inputs) for gate in tree.gates) // 2000
        with _deep_recursion(len(self.order)):
            try:
                self.top = self._top(tree)
            except RuntimeError as error:
                # So the library says that its memory limit is reached.
                raise self._too_large(str(error).splitlines()[0]) from None

    def _top(self, tree: StaticTree) -> Any:
        functions = {name: self.bdd.var(name) for name in self.order}
        for house in tree.houses:
            functions[house.name] = self.bdd.true if house.value else self.bdd.false
        gates = tree.ordered_gates()
        left = {gate.name: 0 for gate in gates}
        for gate in gates:
            for name in set(gate.inputs) & left.keys():
                left[name] += 1
        for gate in gates:
            functions[gate.name] = self._gate(gate, [functions[name] for name in gate.inputs])
            for name in set(gate.inputs) & left.keys():
                left[name] -= 1
                if not left[name]:
                    # The last use is over: the library may free what only this gate needs.
                    del functions[name]
        return functions[tree.top]

    def _gate(self, gate: StaticGate, inputs: list[Any]) -> Any:
        kind = gate.kind
        if kind in ("and", "nand"):
            joined = self._fold("and", inputs)
            return ~joined if kind == "nand" else joined
        if kind in ("or", "nor"):
            joined = self._fold("or", inputs)
            return ~joined if kind == "nor" else joined
        if kind == "not":
            return ~inputs[0]
        if kind == "xor":
            return self._fold("xor", inputs)
        if kind == "iff":
            return ~self._fold("xor", inputs)
        if kind == "imply":
            return self._fold("or", [~inputs[0], inputs[1]])
        assert gate.least is not None
        reached = self._at_least(gate.least, inputs)
        if kind == "atleast":
            return reached
        assert gate.most is not None
        return self.bdd.apply("and", reached, ~self._at_least(gate.most + 1, inputs))

    def _fold(self, operator: str, inputs: list[Any]) -> Any:
        # From the right: the first input holds the top levels, so each step touches few nodes.
        joined = inputs[-1]
        for function in reversed(inputs[:-1]):
            joined = self._counted(self.bdd.apply(operator, function, joined))
        return joined

    def _at_least(self, k: int, inputs: list[Any]) -> Any:
        reached = [self.bdd.true] + [self.bdd.false] * k
        for function in reversed(inputs):
            for j in range(k, 0, -1):
                reached[j] = self._counted(self.bdd.ite(function, reached[j - 1], reached[j]))
        return reached[k]

    def _counted(self, function: Any) -> Any:
        self._operations += 1
        if self._operations % self._stride == 0 and len(self.bdd) > MAX_NODES:
            raise self._too_large(f"more than {MAX_NODES} nodes")
        return function

    def _too_large(self, evidence: str) -> ModelError:
        return ModelError(
            "the decision diagram of the tree is too large",
            where=self._where,
            evidence=evidence,
            cure="order the inputs so that gates with common events stand together",
        )

    def cofactors(self, name: str) -> tuple[Any, Any]:
        """The top with a basic event true, and with it false."""
        with _deep_recursion(len(self.order)):
            return (
                self.bdd.let({name: True}, self.top),
                self.bdd.let({name: False}, self.top),
            )

    def both(self, first: Any, second: Any) -> Any:
        """The conjunction of two functions."""
        with _deep_recursion(len(self.order)):
            return self.bdd.apply("and", first, second)

    def either(self, first: Any, second: Any) -> Any:
        """The disjunction of two functions."""
        with _deep_recursion(len(self.order)):
            return self.bdd.apply("or", first, second)

    def diagram(self, roots: Sequence[Any]) -> Diagram:
        """Functions of this manager as one diagram, complements pushed to the children."""
        level, high, low = [-1, -1], [FALSE, TRUE], [FALSE, TRUE]
        number: dict[tuple[int, bool], int] = {}

        def key(function: Any, flip: bool) -> tuple[int, bool]:
            # A complemented edge is the regular node seen through a negation.
            negated = bool(function.negated) != flip
            return abs(int(~function if function.negated else function)), negated

        constant = key(self.bdd.true, False)
        number[constant] = TRUE
        number[constant[0], not constant[1]] = FALSE
        found = []
        for root in roots:
            stack = [(root, False)]
            while stack:
                function, flip = stack[-1]
                own = key(function, flip)
                if own in number:
                    stack.pop()
                    continue
                branches = (function.high, function.low)
                missing = [
                    (branch, own[1]) for branch in branches if key(branch, own[1]) not in number
                ]
                if missing:
                    stack.extend(missing)
                    continue
                stack.pop()
                number[own] = len(level)
                level.append(function.level)
                high.append(number[key(branches[0], own[1])])
                low.append(number[key(branches[1], own[1])])
            found.append(number[key(root, False)])
        return Diagram(self.order, level, high, low, tuple(found))


def build_diagram(tree: StaticTree) -> Diagram:
    """The decision diagram of a tree's top, basic events in depth-first order.

    Parameters
    ----------
    tree : static fault tree.

    Raises
    ------
    ModelError : a tree or a diagram too large.

    References
    ----------
    Bryant 1986; Rauzy 1993; the library `dd` (`dd.cudd` where present, else `dd.autoref`).
    """
    functions = TreeFunctions(tree)
    return functions.diagram([functions.top])


def _manager() -> Any:
    try:
        from dd import cudd

        bdd = cudd.BDD()
        bdd.configure(reordering=False, max_memory=_CUDD_MEMORY_BYTES)
    except ImportError:
        from dd import autoref

        bdd = autoref.BDD()
        bdd.configure(reordering=False)
    return bdd


@contextmanager
def _deep_recursion(levels: int) -> Iterator[None]:
    # The pure Python library recurses a few frames a level.
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, 1000 + 10 * levels))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)
