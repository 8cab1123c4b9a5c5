"""Random static fault trees, and their exact probability by going through all cases."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

from hypothesis import strategies as st

from sbas.dependability.static.static_tree import BasicEvent, GateKind, StaticGate, StaticTree
from sbas.dependability.tree.model import House

MONOTONE: tuple[GateKind, ...] = ("and", "or", "atleast")
ANY: tuple[GateKind, ...] = (
    "and", "or", "not", "xor", "nand", "nor", "iff", "imply", "atleast", "cardinality",
)  # fmt: skip


@st.composite
def static_trees(
    draw: st.DrawFn, kinds: tuple[GateKind, ...] = ANY, names: tuple[str, ...] = ("e", "h", "g")
) -> StaticTree:
    """A tree of up to six events and six gates that share inputs freely."""
    event, house, gate = names
    probability = st.floats(0, 1) | st.floats(1e-30, 1e-6)
    events = [BasicEvent(f"{event}{i}", draw(probability)) for i in range(draw(st.integers(1, 6)))]
    houses = [House(f"{house}{i}", draw(st.booleans())) for i in range(draw(st.integers(0, 1)))]
    known = [element.name for element in (*events, *houses)]
    gates: list[StaticGate] = []
    for i in range(draw(st.integers(1, 6))):
        kind = draw(st.sampled_from(kinds))
        n = {"not": 1, "xor": 2, "iff": 2, "imply": 2}.get(kind, draw(st.integers(1, 4)))
        inputs = tuple(draw(st.sampled_from(known)) for _ in range(n))
        least = most = None
        if kind == "atleast":
            least = draw(st.integers(1, n))
        elif kind == "cardinality":
            least = draw(st.integers(0, n))
            most = draw(st.integers(least, n))
        gates.append(StaticGate(f"{gate}{i}", kind, inputs, least, most))
        known.append(gates[-1].name)
    return StaticTree("random", tuple(events), tuple(gates), gates[-1].name, tuple(houses))


def truth(tree: StaticTree, on: dict[str, bool]) -> dict[str, bool]:
    """Truth of everything, gate by gate from the definitions; gates stand after their inputs."""
    known = on | {house.name: house.value for house in tree.houses}
    for gate in tree.gates:
        x = [known[name] for name in gate.inputs]
        known[gate.name] = {
            "and": lambda x, g: all(x),
            "or": lambda x, g: any(x),
            "not": lambda x, g: not x[0],
            "xor": lambda x, g: x[0] != x[1],
            "nand": lambda x, g: not all(x),
            "nor": lambda x, g: not any(x),
            "iff": lambda x, g: x[0] == x[1],
            "imply": lambda x, g: x[1] or not x[0],
            "atleast": lambda x, g: sum(x) >= g.least,
            "cardinality": lambda x, g: g.least <= sum(x) <= g.most,
        }[gate.kind](x, gate)
    return known


def exact(tree: StaticTree, given: dict[str, bool] | None = None) -> Fraction:
    """P(top), some events given, as a sum over all cases in rational arithmetic."""
    total = Fraction(0)
    fixed = given or {}
    names = [event.name for event in tree.events]
    for values in product((False, True), repeat=len(names)):
        case = dict(zip(names, values, strict=True))
        if any(case[name] != value for name, value in fixed.items()):
            continue
        if truth(tree, case)[tree.top]:
            weight = Fraction(1)
            for event in tree.events:
                if event.name not in fixed:
                    p = Fraction(event.probability)
                    weight *= p if case[event.name] else 1 - p
            total += weight
    return total
