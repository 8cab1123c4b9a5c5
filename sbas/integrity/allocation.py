"""Integrity allocation: the tree that divides a total risk, and the K factors of its leaves."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import Any

from sbas.bundled import bundled
from sbas.exceptions import InputError, ModelError
from sbas.integrity.allocation_tree import (
    CHOICES,
    AllocationNode,
    Axis,
    check_tree,
    nearest,
    node_values,
    share_of,
)
from sbas.integrity.k_factors import exceedance, k_factor

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class LeafFactor:
    """K factor of one leaf, and what the published, rounded K really gives.

    Parameters
    ----------
    node : id of the leaf.
    axis : "H", "V" or "along".
    risk : allocated to the leaf per exposure [1].
    exposure_s : [s].
    per_sample_risk : per independent sample [1].
    k : factor that meets it.
    published_k : the rounded K of a standard, or None.
    published_per_sample_risk, published_risk : what that K gives per sample and per exposure.
    """

    node: str
    axis: Axis
    risk: float
    exposure_s: float
    per_sample_risk: float
    k: float
    published_k: float | None
    published_per_sample_risk: float | None
    published_risk: float | None

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return dict(vars(self))


@dataclass(frozen=True)
class Allocation:
    """A checked allocation tree.

    Raises
    ------
    ModelError : not exactly one root, a cycle, an unknown parent, a node without its figures,
        another exposure than the parent's, or children whose shares do not sum to 1 within
        1e-12. Nothing is ever normalised.
    """

    name: str
    title: str
    source: str
    nodes: tuple[AllocationNode, ...]

    def __post_init__(self) -> None:
        check_tree(self.name, self.nodes)

    def node(self, node_id: str) -> AllocationNode:
        """The node of that id; raises InputError with the nearest id for another."""
        found = next((n for n in self.nodes if n.id == node_id), None)
        if found is None:
            known = [n.id for n in self.nodes]
            raise InputError(
                f"no node {node_id!r} in the allocation {self.name!r}",
                cure=nearest(node_id, known),
            )
        return found

    def children(self, node_id: str) -> tuple[AllocationNode, ...]:
        """The nodes right below a node, in file order."""
        return tuple(n for n in self.nodes if n.parent == node_id)

    @property
    def root(self) -> AllocationNode:
        """The node without parent."""
        return next(n for n in self.nodes if n.parent is None)

    @property
    def exposure_s(self) -> float:
        """The time that every risk of the tree is of [s]."""
        assert self.root.exposure_s is not None
        return self.root.exposure_s

    def values(self) -> dict[str, float]:
        """Risk per exposure [1] of every node: share times the parent's, or its own value."""
        return node_values(self.nodes)

    def k_factors(self) -> tuple[LeafFactor, ...]:
        """K factor of every leaf with an axis.

        Notes
        -----
        A leaf of value P with n independent samples has p = -expm1(log1p(-P)/n) per sample, and
        K of `k_factor` at p. The published K gives p' = `exceedance`, and -expm1(n log1p(-p'))
        per exposure.

        References
        ----------
        Filip, Bazant, Mocek 2010, section 2.1 (6.0, 5.33 and 6.18).
        """
        values = self.values()
        return tuple(
            _leaf_factor(node, values[node.id], self.exposure_s)
            for node in self.nodes
            if node.axis is not None
        )

    def reallocate(self, shares: Mapping[str, float]) -> Allocation:
        """The same tree with other shares, which must again sum to 1 below every parent.

        Parameters
        ----------
        shares : new share of its parent's risk [1] by node id. A node given by its value becomes
            one given by its share. Siblings that are not named keep theirs.

        Returns
        -------
        Allocation whose changed nodes say in `source` that they were re-allocated.

        Raises
        ------
        InputError : an unknown node.
        ModelError : a share outside (0, 1], the root, or shares that do not sum to 1.
        """
        for node_id in shares:
            if self.node(node_id).parent is None:
                raise ModelError(
                    "the root has no share: it is the whole risk", where=f"{self.name}: {node_id}"
                )
        values = self.values()
        nodes = tuple(
            replace(
                node,
                share=shares[node.id],
                value=None,
                source=f"re-allocated, share {shares[node.id]!r} in place of "
                f"{share_of(node, values):.12g} ({node.source})",
            )
            if node.id in shares
            else node
            for node in self.nodes
        )
        return replace(self, nodes=nodes)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in the TOML file; the inverse of `allocation_from_dict`."""
        return {
            "schema": SCHEMA_VERSION,
            "name": self.name,
            "title": self.title,
            "source": self.source,
            "nodes": [_node_to_dict(node) for node in self.nodes],
        }


def load_allocation(name_or_path: str | Path) -> Allocation:
    """An allocation tree: a bundled one by its name, or the user's own by its path.

    Parameters
    ----------
    name_or_path : "pa_do229", "npa_do229", "npa_along_track", or a TOML file.

    Raises
    ------
    InputError : no such name or file.
    ModelError : the file is no allocation; `where` is the key path.

    Examples
    --------
    >>> [round(leaf.k, 2) for leaf in load_allocation("pa_do229").k_factors()]
    [6.0, 5.33]
    """
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and path.suffix == "" and path.name == name_or_path:
        folder = bundled("allocations")
        names = sorted(p.stem for p in folder.glob("*.toml"))
        if name_or_path not in names:
            raise InputError(
                f"no bundled allocation {name_or_path!r}",
                where="name_or_path",
                cure=nearest(name_or_path, names) + ", or the path of a .toml file",
            )
        path = folder / f"{name_or_path}.toml"
    try:
        plain = tomllib.loads(path.read_bytes().decode("utf-8"))
    except OSError as error:
        raise InputError(
            "the allocation cannot be read", where=str(path), evidence=str(error)
        ) from error
    except ValueError as error:
        raise ModelError(
            "the allocation is no TOML file", where=str(path), evidence=str(error)
        ) from error
    return allocation_from_dict(plain, where=path.name)


# --- plain data to nodes ----------------------------------------------------------------------

_TOP_KEYS = ("schema", "name", "title", "source", "nodes")
_NODE_KEYS = tuple("clock" if f.name == "clock_n" else f.name for f in fields(AllocationNode))
_TEXTS = ("id", "parent", "source", *CHOICES)


def allocation_from_dict(plain: Mapping[str, Any], *, where: str = "allocation") -> Allocation:
    """An allocation tree from plain values, as `tomllib` gives them.

    Raises
    ------
    ModelError : an unknown key (with the nearest known one), a missing key, a value of the wrong
        type or outside its range, or an impossible tree.
    """
    _refuse_unknown(plain, _TOP_KEYS, where)
    for key in _TOP_KEYS:
        if key not in plain:
            raise ModelError(f"the key {key!r} is missing", where=where)
    if plain["schema"] != SCHEMA_VERSION or isinstance(plain["schema"], bool):
        raise ModelError(
            "unknown schema",
            where=f"{where}: schema",
            evidence=repr(plain["schema"]),
            cure=f"this version reads schema {SCHEMA_VERSION}",
        )
    texts = {key: _text(plain[key], f"{where}: {key}") for key in ("name", "title", "source")}
    nodes = plain["nodes"]
    if not isinstance(nodes, list) or not all(isinstance(n, dict) for n in nodes):
        raise ModelError("nodes are an array of tables", where=f"{where}: nodes", cure="[[nodes]]")
    checked = [_node_from_dict(n, f"{where}: nodes[{i}]") for i, n in enumerate(nodes)]
    return Allocation(nodes=tuple(checked), **texts)


def _node_from_dict(plain: Mapping[str, Any], where: str) -> AllocationNode:
    _refuse_unknown(plain, _NODE_KEYS, where)
    for required in (f.name for f in fields(AllocationNode) if f.default is MISSING):
        if required not in plain:
            raise ModelError(
                f"the key {required!r} is missing",
                where=f"{where}.{required}",
                cure="every node has an id, a kind, and the source of its figures",
            )
    values: dict[str, Any] = {}
    for key, value in plain.items():
        path = f"{where}.{key}"
        if key == "clock":
            if not isinstance(value, dict):
                raise ModelError("a clock is a table", where=path, cure="clock = { n = 10 }")
            _refuse_unknown(value, ("n",), path)
            values["clock_n"] = _number(value.get("n"), f"{path}.n")
        elif key in _TEXTS:
            values[key] = _text(value, path)
        elif key == "dim":
            values[key] = value
        else:
            values[key] = _number(value, path)
    return AllocationNode(**values)


def _node_to_dict(node: AllocationNode) -> dict[str, Any]:
    plain = {f.name: getattr(node, f.name) for f in fields(node)}
    plain["clock"] = None if node.clock_n is None else {"n": node.clock_n}
    return {key: plain[key] for key in _NODE_KEYS if plain[key] is not None}


def _refuse_unknown(plain: Mapping[str, Any], known: Iterable[str], where: str) -> None:
    for key in plain:
        if key not in known:
            raise ModelError(
                f"unknown key {key!r}", where=f"{where}.{key}", cure=nearest(key, known)
            )


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ModelError(
            "a text is expected, and not an empty one", where=where, evidence=f"{value!r}"
        )
    return value


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ModelError("a finite number is expected", where=where, evidence=f"{value!r}")
    return float(value)


def _leaf_factor(node: AllocationNode, risk: float, exposure_s: float) -> LeafFactor:
    assert node.axis is not None
    assert node.clock_n is not None
    options = node.exceedance_options()
    per_sample = -math.expm1(math.log1p(-risk) / node.clock_n)
    published = None if node.published_k is None else exceedance(node.published_k, **options)
    return LeafFactor(
        node=node.id,
        axis=node.axis,
        risk=risk,
        exposure_s=exposure_s,
        per_sample_risk=per_sample,
        k=k_factor(per_sample, **options),
        published_k=node.published_k,
        published_per_sample_risk=published,
        published_risk=None
        if published is None
        else -math.expm1(node.clock_n * math.log1p(-published)),
    )
