"""Sizes of products against the method page."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sbas.dependability.exact.gate_memory import gate_memory
from sbas.dependability.exact.product_chain import ProductChain, product_chain
from sbas.dependability.exact.transitions import component_chain
from sbas.dependability.tree.model import Component, Con, Dur, Failed, HybridFaultTree, Or, Pand
from sbas.dependability.tree.model_check import in_order, supports
from tests.dependability.paper_models import check_unit, localisation_unit


def product_of(model: HybridFaultTree, top: str | None = None) -> ProductChain:
    """With all gates that depend on no more than the top (or another gate) does."""
    below = supports(model)
    support = below[top or model.top]
    chain = component_chain(model, support, max_states=10**6)
    gates = [gate for gate in in_order(model) if below[gate.name] <= support]
    return product_chain(chain, gate_memory(gates, model), max_states=10**6)


def two_state(count: int, gates: tuple[Dur | Con | Or | Pand, ...]) -> HybridFaultTree:
    return HybridFaultTree(
        "m", 1.0, 3600.0, tuple(Component(f"c{i}", 1.0, 1.0) for i in range(count)), (),
        tuple(Failed(f"e{i}", f"c{i}") for i in range(count)), gates, gates[-1].name,
    )  # fmt: skip


@pytest.mark.parametrize(("count", "states"), [(1, 22), (2, 484), (3, 10_648)])
def test_independent_delays_multiply(count: int, states: int) -> None:
    delays = tuple(Dur(f"d{i}", 20.0, f"e{i}") for i in range(count))
    model = two_state(count, (*delays, Or("top", tuple(d.name for d in delays))))
    assert product_of(model).chain.size == states


@pytest.mark.parametrize(("count", "states"), [(2, 5), (3, 11), (4, 23), (5, 47)])
def test_cascades_of_pand(count: int, states: int) -> None:
    model = two_state(count, (Pand("top", tuple(f"e{i}" for i in range(count))),))
    assert product_of(model).chain.size == states


@pytest.mark.parametrize(
    ("t2_s", "first_fix_s", "states"),
    [(60.0, 180.0, 2201), (60.0, 0.0, 251), (10.0, 180.0, 276)],
)
def test_satellite_positioning_alone(t2_s: float, first_fix_s: float, states: int) -> None:
    unit = localisation_unit(t2_s=t2_s, first_fix_s=first_fix_s)
    gates = tuple(g for g in unit.gates if g.name in ("IE2", "IE5"))
    alone = replace(unit, gates=(*gates, Or("top", ("IE2", "IE5"))), top="top", cases=())
    assert product_of(alone).chain.size == states


def test_the_unit_of_the_paper() -> None:
    whole = product_of(localisation_unit()).chain
    assert (whole.size, len(whole.targets)) == (21_920, 355_872)
    assert product_of(localisation_unit(), "C").chain.size == 10_960


def test_the_whole_check_unit() -> None:
    assert product_of(check_unit()).chain.size == 1458


def test_states_that_absorb_are_not_left() -> None:
    model = two_state(1, (Con("top", 2, "e0"),))
    chain = component_chain(model, {"c0"}, max_states=10)
    memory = gate_memory(model.gates, model)
    product = product_chain(chain, memory, max_states=10, absorbing="top").chain
    moves = product.indptr[1:] - product.indptr[:-1]
    assert (moves[product.truth["top"]] == 0).all()
    assert product.size == 3
