from __future__ import annotations

import pytest

from sbas.dependability.static import decision_diagram
from sbas.dependability.static.decision_diagram import FALSE, TRUE, TreeFunctions, build_diagram
from sbas.dependability.static.static_tree import BasicEvent, StaticGate, StaticTree
from sbas.dependability.tree.model import House
from sbas.exceptions import ModelError


def parity(n: int) -> StaticTree:
    events = tuple(BasicEvent(f"e{i}", 0.5) for i in range(n))
    gates = [StaticGate("g1", "xor", ("e0", "e1"))]
    gates += [StaticGate(f"g{i}", "xor", (f"g{i - 1}", f"e{i}")) for i in range(2, n)]
    return StaticTree("parity", events, tuple(gates), f"g{n - 1}")


def test_parity_has_two_nodes_a_level_and_no_complemented_edges() -> None:
    """Bryant 1986: 2n - 1 nodes; with complemented edges it would be n."""
    diagram = build_diagram(parity(10))
    assert len(diagram.level) - 2 == 19
    assert all(diagram.high[i] < i and diagram.low[i] < i for i in range(2, len(diagram.level)))
    assert all(diagram.level[c] > diagram.level[i] or c < 2
               for i in range(2, len(diagram.level))
               for c in (diagram.high[i], diagram.low[i]))  # fmt: skip


def test_constant_trees_are_leaves() -> None:
    for value, leaf in ((True, TRUE), (False, FALSE)):
        gate = StaticGate("T", "or", ("h",))
        diagram = build_diagram(StaticTree("c", (), (gate,), "T", (House("h", value),)))
        assert diagram.roots == (leaf,)


def test_cofactors_of_a_two_out_of_three() -> None:
    events = tuple(BasicEvent(name, 0.1) for name in "abc")
    tree = StaticTree("v", events, (StaticGate("T", "atleast", tuple("abc"), 2),), "T")
    functions = TreeFunctions(tree)
    on, off = functions.cofactors("a")
    b, c = functions.bdd.var("b"), functions.bdd.var("c")
    assert on == functions.either(b, c)
    assert off == functions.both(b, c)


def unordered(n: int) -> StaticTree:
    """Bryant 1986: x1 y1 or x2 y2 or ... has 2^n nodes where all x stand above all y."""
    pairs = [StaticGate(f"a{i}", "and", (f"x{i}", f"y{i}")) for i in range(n)]
    gates = (
        StaticGate("x", "or", tuple(f"x{i}" for i in range(n))),
        StaticGate("y", "or", tuple(f"y{i}" for i in range(n))),
        *pairs,
        StaticGate("q", "or", tuple(f"a{i}" for i in range(n))),
        StaticGate("T", "and", ("x", "y", "q")),
    )
    events = tuple(BasicEvent(f"{k}{i}", 0.1) for k in "xy" for i in range(n))
    return StaticTree("unordered", events, gates, "T")


def test_a_diagram_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decision_diagram, "MAX_NODES", 2000)
    with pytest.raises(ModelError, match="diagram of the tree is too large") as caught:
        build_diagram(unordered(20))
    assert caught.value.evidence == "more than 2000 nodes"


def test_the_memory_limit_of_the_library_is_a_refusal_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("dd.cudd", reason="the limit is one of dd.cudd, which is not installed")
    monkeypatch.setattr(decision_diagram, "_CUDD_MEMORY_BYTES", 20 * 2**20)
    with pytest.raises(ModelError, match="diagram of the tree is too large") as caught:
        build_diagram(unordered(24))
    assert "out of memory" in caught.value.evidence
