"""Small models of which the figures can be had by hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sbas.dependability.tree.model import Component, Failed, Gate, HybridFaultTree


def hardware_tree(
    rates: Mapping[str, float],
    *gates: Gate,
    repair_rate_per_h: float = 0.0,
    epochs: int = 5,
    **changes: Any,
) -> HybridFaultTree:
    """Components x, y, ... with events of the same name in capitals, epochs of an hour; the last
    gate is the top."""
    return HybridFaultTree(
        "small",
        3600.0,
        3600.0 * epochs,
        tuple(Component(name, rate, repair_rate_per_h) for name, rate in rates.items()),
        (),
        tuple(Failed(name.upper(), name) for name in rates),
        gates,
        gates[-1].name,
        **changes,
    )
