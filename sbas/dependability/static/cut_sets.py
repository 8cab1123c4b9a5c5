"""Minimal cut sets of a static fault tree, from its decision diagram, and bounds by them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from sbas.dependability.static.decision_diagram import FALSE, TRUE, Diagram, TreeFunctions
from sbas.dependability.static.static_tree import StaticTree
from sbas.exceptions import InputError, ModelError

_NONE, _EMPTY = 0, 1
"""The family without a set, and the family of the empty set alone."""


@dataclass(frozen=True, eq=False)
class CutSets:
    """All minimal cut sets of a coherent tree, as a shared diagram of sets.

    Parameters
    ----------
    order : (v,) basic events, top level first.
    level, with_event, without : (n,) of each family: its first event, the sets that hold it
        (less that event), and the sets that do not; nodes 0 and 1 are no set and the empty set.
    root : family of all minimal cut sets.
    """

    order: tuple[str, ...]
    level: list[int]
    with_event: list[int]
    without: list[int]
    root: int
    probabilities: Mapping[str, float] = field(repr=False)

    def used_nodes(self) -> list[int]:
        """Nodes below the root, children before parents."""
        seen = {self.root}
        stack = [self.root]
        while stack:
            node = stack.pop()
            new = {self.with_event[node], self.without[node]} - seen
            seen |= new
            stack.extend(new)
        return sorted(seen - {_NONE, _EMPTY})

    def counts(self) -> dict[int, int]:
        """Number of minimal cut sets of each order (number of events)."""
        tallies: list[dict[int, int]] = [{}, {0: 1}]
        for i in range(2, len(self.level)):
            tally = dict(tallies[self.without[i]])
            for size, number in tallies[self.with_event[i]].items():
                tally[size + 1] = tally.get(size + 1, 0) + number
            tallies.append(tally)
        return dict(sorted(tallies[self.root].items()))

    def sets(self, *, max_order: int | None = None) -> Iterator[frozenset[str]]:
        """Minimal cut sets one by one, up to an order.

        Parameters
        ----------
        max_order : largest number of events; None is all.
        """
        limit = len(self.order) if max_order is None else max_order
        stack: list[tuple[int, tuple[str, ...]]] = [(self.root, ())]
        while stack:
            node, chosen = stack.pop()
            if node == _EMPTY:
                yield frozenset(chosen)
            elif node != _NONE:
                stack.append((self.without[node], chosen))
                if len(chosen) < limit:
                    event = self.order[self.level[node]]
                    stack.append((self.with_event[node], (*chosen, event)))

    def rare_event_sum(self) -> float:
        """Sum of the cut sets' probabilities: an approximation, never below the exact top.

        References
        ----------
        Boole's inequality.
        """
        sums = [0.0, 1.0]
        for i in range(2, len(self.level)):
            p = self.probabilities[self.order[self.level[i]]]
            sums.append(p * sums[self.with_event[i]] + sums[self.without[i]])
        return sums[self.root]

    def min_cut_bound(self, *, max_sets: int = 1_000_000) -> float:
        """1 - prod(1 - P(cut set)): an upper bound of a coherent top, by enumeration.

        Parameters
        ----------
        max_sets : refuse above so many cut sets.

        Raises
        ------
        InputError : more cut sets.

        References
        ----------
        Esary and Proschan 1963.
        """
        number = sum(self.counts().values())
        if number > max_sets:
            raise InputError(
                f"{number} minimal cut sets are more than {max_sets}",
                cure="use rare_event_sum(), or top_probability() for the exact figure",
            )
        logs = []
        for cut in self.sets():
            p = math.prod(self.probabilities[event] for event in cut)
            if p == 1:
                return 1.0
            logs.append(math.log1p(-p))
        return -math.expm1(math.fsum(logs))


def minimal_cut_sets(tree: StaticTree) -> CutSets:
    """All minimal cut sets of a coherent static tree.

    Parameters
    ----------
    tree : static fault tree whose top never becomes false because an event becomes true.

    Raises
    ------
    ModelError : a non-coherent tree, with an event that shows it; a tree too large.

    Notes
    -----
    minsol(x, F1, F0) = (x, minsol(F1) without the sets that satisfy F0, minsol(F0)).

    References
    ----------
    Rauzy 1993, New algorithms for fault trees analysis, section 4.
    """
    return cut_sets_of(TreeFunctions(tree), tree)


def cut_sets_of(functions: TreeFunctions, tree: StaticTree) -> CutSets:
    """`minimal_cut_sets` from functions that are there already."""
    shown_by = _non_coherent_event(functions, tree)
    if shown_by is not None:
        raise ModelError(
            f"the tree is not coherent: event {shown_by!r} can make the top false",
            where=f"fault tree {tree.name!r}",
            cure="minimal cut sets need a coherent tree; top_probability() takes any",
        )
    diagram = functions.diagram([functions.top])
    families = _Families(diagram)
    smallest = [_NONE, _EMPTY]
    for i in range(2, len(diagram.level)):
        own = families.less(smallest[diagram.high[i]], diagram.low[i])
        smallest.append(families.node(diagram.level[i], own, smallest[diagram.low[i]]))
    return CutSets(
        diagram.order,
        families.level,
        families.with_event,
        families.without,
        smallest[diagram.roots[0]],
        tree.probabilities(),
    )


def is_coherent(functions: TreeFunctions, tree: StaticTree) -> bool:
    """Whether no event that becomes true makes the top false."""
    return _non_coherent_event(functions, tree) is None


def _non_coherent_event(functions: TreeFunctions, tree: StaticTree) -> str | None:
    if all(gate.kind in ("and", "or", "atleast") for gate in tree.ordered_gates()):
        return None
    for name in functions.order:
        on, off = functions.cofactors(name)
        if functions.both(off, ~on) != functions.bdd.false:
            return name
    return None


class _Families:
    """Families of sets as shared nodes; no family is stored twice."""

    def __init__(self, diagram: Diagram) -> None:
        self.diagram = diagram
        self.level = [-1, -1]
        self.with_event = [_NONE, _EMPTY]
        self.without = [_NONE, _EMPTY]
        self._known: dict[tuple[int, int, int], int] = {}
        self._less: dict[tuple[int, int], int] = {}

    def node(self, level: int, with_event: int, without: int) -> int:
        if with_event == _NONE:
            return without
        key = (level, with_event, without)
        if key not in self._known:
            self._known[key] = len(self.level)
            self.level.append(level)
            self.with_event.append(with_event)
            self.without.append(without)
        return self._known[key]

    def less(self, family: int, function: int) -> int:
        """The sets of a family that do not satisfy a monotone function; no recursion."""
        stack = [(family, function)]
        while stack:
            family_now, function_now = pair = stack[-1]
            if self._plain(pair) is not None:
                stack.pop()
                continue
            at = self.level[family_now]
            if self.diagram.level[function_now] < at:
                # No set of this family holds the function's first event.
                first = (family_now, self.diagram.low[function_now])
                answer = self._plain(first)
                if answer is None:
                    stack.append(first)
                    continue
            else:
                splits = self.diagram.level[function_now] == at
                on = self.diagram.high[function_now] if splits else function_now
                off = self.diagram.low[function_now] if splits else function_now
                first = (self.with_event[family_now], on)
                second = (self.without[family_now], off)
                kept, rest = self._plain(first), self._plain(second)
                if kept is None or rest is None:
                    stack += [part for part in (first, second) if self._plain(part) is None]
                    continue
                answer = self.node(at, kept, rest)
            self._less[pair] = answer
            stack.pop()
        found = self._plain((family, function))
        assert found is not None
        return found

    def _plain(self, pair: tuple[int, int]) -> int | None:
        family, function = pair
        if family == _NONE or function == TRUE:
            return _NONE
        # A monotone function that is not constantly true is false on the empty set.
        if function == FALSE or family == _EMPTY:
            return family
        return self._less.get(pair)
