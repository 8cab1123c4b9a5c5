"""Gate automata against the printed sequences."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.dependability.exact.gate_memory import gate_memory
from sbas.dependability.tree.model import (
    And,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    Gate,
    HybridFaultTree,
    Pand,
)

X = "011011000111000011110110"
Y = "001111101110001111100111"


def output(*gates: Gate) -> str:
    """Truth of the last gate along the two signals."""
    model = HybridFaultTree(
        "signals", 1.0, 23.0, (Component("a", 1.0), Component("b", 1.0)), (),
        (Failed("x", "a"), Failed("y", "b")), gates, gates[-1].name,
    )  # fmt: skip
    memory = gate_memory(gates, model)
    cells = [np.zeros(1, dtype=np.int64) for _ in memory.sizes]
    said = ""
    for x, y in zip(X, Y, strict=True):
        truth = {"x": np.array([x == "1"]), "y": np.array([y == "1"])}
        cells, known = memory.step(cells, truth)
        said += "1" if known[gates[-1].name][0] else "0"
        read = memory.step(cells, truth, moves=False)[1]
        assert read[gates[-1].name][0] == known[gates[-1].name][0]
    return said


@pytest.mark.parametrize(
    ("gates", "expected"),
    [
        ((Con("g", 3, "y"),), "000011100010000011100001"),
        ((Dur("g", 2.0, "y", "age"),), "000011100010000011100001"),
        ((Con("g", 2, "y"),), "000111100110000111100011"),
        ((Dur("g", 2.0, "y", "count"),), "000111100110000111100011"),
        ((Dur("g", 2.0, "y", "strict"),), "000001100000000001100000"),
        ((Dur("g", 2.5, "y", "age"),), "000001100000000001100000"),
        ((CausalAnd("g", 1.0, ("x", "y"), "age"),), "000001000010000001100010"),
        ((Pand("g", ("x", "y")),), "001000000000000000000110"),
        ((Pand("g", ("x", "y"), exclusive=True),), "001000000000000000000000"),
        ((Con("l", 2, "y"), Pand("g", ("x", "l"))), "000000000110000000000010"),
        ((Con("l", 2, "y"), And("g", ("x", "l"))), "000011000110000011100010"),
        ((And("b", ("x", "y")), Con("g", 2, "b")), "000001000010000001100010"),
        ((Pand("g", ("x", "y"), latched=True),), "001111111111111111111111"),
        ((Pand("g", ("x", "x")),), X),
        ((Pand("g", ("x", "x"), exclusive=True),), "0" * 24),
    ],
)  # fmt: skip
def test_printed_sequences(gates: tuple[Gate, ...], expected: str) -> None:
    assert output(*gates) == expected


def test_one_counter_for_each_input() -> None:
    gates = (Con("a", 3, "x"), Con("b", 7, "x"), Dur("c", 1.0, "x"), Con("d", 2, "y"))
    model = HybridFaultTree("m", 1.0, 10.0, (), (), (), gates, "a")
    memory = gate_memory(gates, model)
    assert sorted(memory.sizes.values()) == [3, 8]
    assert memory.growth() == "a and b and c (8 values), d (3 values)"
