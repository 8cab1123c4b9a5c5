"""The tree of an integrity allocation: its nodes, and what makes them one sound tree."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

from sbas.exceptions import ModelError
from sbas.integrity.counting import is_number

SHARE_TOLERANCE = 1e-12

Kind = Literal["total", "faulted", "fault_free"]
Axis = Literal["H", "V", "along"]
Sided = Literal["two", "one"]
CHOICES = {"kind": get_args(Kind), "axis": get_args(Axis), "sided": get_args(Sided)}


@dataclass(frozen=True, kw_only=True)
class AllocationNode:
    """One branch of the tree; with an `axis` it is a leaf that a K factor serves.

    Parameters
    ----------
    id : name, unique in the tree.
    parent : id of the node above; None for the root.
    kind : what the risk is of: "total", "faulted" or "fault_free".
    share : part of the parent's risk [1], in (0, 1]; None where `value` is given.
    value : risk per exposure [1]; the root has one.
    exposure_s : time that the risk is of [s]; a child has its parent's.
    axis : of a leaf with a K factor: "H", "V" or "along".
    dim : dimensions of the error, 1 or 2.
    sided : errors that count in one dimension: "two" signs or "one".
    axis_ratio : minor over major axis of the error ellipse in two dimensions; 1 is a circle.
    clock_n : independent samples in the exposure [1], 1 or more (in TOML `clock = { n = 10 }`).
    published_k : the rounded K that a standard prints.
    source : document and paragraph of the figures.
    """

    id: str
    kind: Kind
    source: str
    parent: str | None = None
    share: float | None = None
    value: float | None = None
    exposure_s: float | None = None
    axis: Axis | None = None
    dim: int | None = None
    sided: Sided = "two"
    axis_ratio: float = 1.0
    clock_n: float | None = None
    published_k: float | None = None

    def exceedance_options(self) -> dict[str, Any]:
        """Options of `k_factor` and `exceedance` for this leaf."""
        if self.dim == 1:
            return {"distribution": "gaussian", "one_sided": self.sided == "one"}
        if self.axis_ratio == 1:
            return {"distribution": "rayleigh"}
        return {"distribution": "ellipse", "axis_ratio": self.axis_ratio}


def check_tree(name: str, nodes: tuple[AllocationNode, ...]) -> None:
    """Raise ModelError unless the nodes are one sound tree; see `Allocation`."""
    by_id = {node.id: node for node in nodes}
    if len(by_id) != len(nodes):
        twice = next(n.id for i, n in enumerate(nodes) if n.id in {m.id for m in nodes[:i]})
        raise ModelError("two nodes have the same id", where=f"{name}: {twice}")
    roots = [node for node in nodes if node.parent is None]
    if len(roots) != 1:
        raise ModelError(
            "a tree has one root, the node without parent",
            where=name,
            evidence=f"roots: {', '.join(n.id for n in roots) or 'none'}",
        )
    for node in nodes:
        _check_node(f"{name}: {node.id}", node)
        _check_ancestors(f"{name}: {node.id}", node, by_id)
    exposure_s = roots[0].exposure_s
    values = node_values(nodes)
    for node in nodes:
        where = f"{name}: {node.id}"
        if node.exposure_s not in (None, exposure_s):
            raise ModelError(
                "a node has the exposure of its branch",
                where=f"{where}.exposure_s",
                evidence=f"{node.exposure_s:g} s, the root {exposure_s:g} s",
                cure="convert the risk to the exposure of the root first",
            )
        children = [child for child in nodes if child.parent == node.id]
        if children and node.axis is not None:
            raise ModelError("a node with an axis is a leaf", where=where)
        total = math.fsum(share_of(child, values) for child in children)
        if children and abs(total - 1) > SHARE_TOLERANCE:
            parts = ", ".join(f"{c.id} {share_of(c, values):.12g}" for c in children)
            raise ModelError(
                "the shares of a node's children do not sum to 1",
                where=where,
                evidence=f"{parts}: sum {total:.15g}",
                cure="state every share; nothing is normalised",
            )


def _check_node(where: str, node: AllocationNode) -> None:
    for key, allowed in CHOICES.items():
        value = getattr(node, key)
        if value not in allowed and not (key == "axis" and value is None):
            raise ModelError(
                f"unknown {key} {value!r}",
                where=f"{where}.{key}",
                cure=nearest(str(value), allowed),
            )
    if not node.source.strip():
        raise ModelError("figures without a source", where=f"{where}.source")
    if node.parent is None:
        if node.value is None or node.share is not None or node.exposure_s is None:
            raise ModelError("the root has a value and an exposure_s, and no share", where=where)
    elif (node.share is None) == (node.value is None):
        raise ModelError("a node has either a share or a value", where=where)
    _check_range(where, "share", node.share, "in (0, 1]", lambda x: 0 < x <= 1)
    _check_range(where, "value", node.value, "a risk in (0, 1)", lambda x: 0 < x < 1)
    _check_range(where, "exposure_s", node.exposure_s, "above 0", lambda x: 0 < x < math.inf)
    _check_range(where, "axis_ratio", node.axis_ratio, "in [0, 1]", lambda x: 0 <= x <= 1)
    _check_range(where, "clock.n", node.clock_n, "1 or more", lambda x: 1 <= x < math.inf)
    _check_range(where, "published_k", node.published_k, "in (0, 30]", lambda x: 0 < x <= 30)
    if node.axis is None:
        given = [k for k in ("dim", "clock_n", "published_k") if getattr(node, k) is not None]
        if given or node.sided != "two" or node.axis_ratio != 1:
            raise ModelError(
                "only a leaf with an axis has dim, sided, axis_ratio, clock and published_k",
                where=where,
                cure='add axis = "H", "V" or "along"',
            )
        return
    if type(node.dim) is not int or node.dim not in (1, 2) or node.clock_n is None:
        raise ModelError(
            "a leaf with an axis has dim = 1 or 2 and a clock",
            where=where,
            evidence=f"dim {node.dim!r}, clock n {node.clock_n!r}",
            cure="dim = 2 and clock = { n = 10 }",
        )
    if node.dim == 2 and (node.axis != "H" or node.sided != "two"):
        raise ModelError("two dimensions are horizontal and two-sided", where=where)
    if node.dim == 1 and node.axis_ratio != 1:
        raise ModelError("one dimension has no axis_ratio", where=f"{where}.axis_ratio")


def _check_range(
    where: str, key: str, value: Any, allowed: str, inside: Callable[[float], bool]
) -> None:
    if value is not None and not (is_number(value) and inside(value)):
        raise ModelError(
            f"{key} is out of range",
            where=f"{where}.{key}",
            evidence=repr(value),
            cure=f"{key} is {allowed}",
        )


def _check_ancestors(where: str, node: AllocationNode, by_id: Mapping[str, AllocationNode]) -> None:
    seen = {node.id}
    while node.parent is not None:
        if node.parent not in by_id:
            raise ModelError(
                f"unknown parent {node.parent!r}",
                where=f"{where}.parent",
                cure=nearest(node.parent, by_id),
            )
        if node.parent in seen:
            raise ModelError("the tree runs in a circle", where=where)
        node = by_id[node.parent]
        seen.add(node.id)


def node_values(nodes: tuple[AllocationNode, ...]) -> dict[str, float]:
    """Risk of every node of a tree whose parents are known and which has no circle."""
    by_id = {node.id: node for node in nodes}

    def value(node: AllocationNode) -> float:
        if node.value is not None:
            return node.value
        assert node.share is not None
        assert node.parent is not None
        return node.share * value(by_id[node.parent])

    return {node.id: value(node) for node in nodes}


def share_of(node: AllocationNode, values: Mapping[str, float]) -> float:
    """Part of its parent's risk that a node has [1]; 1 for the root."""
    if node.share is not None or node.parent is None:
        return 1.0 if node.share is None else node.share
    return values[node.id] / values[node.parent]


def nearest(word: str, known: Iterable[str]) -> str:
    """Which known word was probably meant, and all that are allowed."""
    known = list(known)
    close = difflib.get_close_matches(word, known, n=1)
    guess = f"did you mean {close[0]!r}? " if close else ""
    return f"{guess}allowed are {', '.join(known)}"
