"""Allocation trees: the constants of DO-229, re-allocation, and files that say the impossible."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path
from typing import Any

import mpmath as mp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.bundled import bundled
from sbas.exceptions import InputError, ModelError
from sbas.integrity.allocation import (
    Allocation,
    LeafFactor,
    allocation_from_dict,
    load_allocation,
)

BUNDLED = sorted(p.stem for p in bundled("allocations").glob("*.toml"))


def leaf(allocation: Allocation, node: str) -> LeafFactor:
    return next(factor for factor in allocation.k_factors() if factor.node == node)


def test_precision_approach_gives_6_0_and_5_33() -> None:
    pa = load_allocation("pa_do229")
    horizontal, vertical = leaf(pa, "horizontal"), leaf(pa, "vertical")
    # Filip, Bazant, Mocek 2010, section 2.1.1: 2e-9 horizontal in 150 s; the rest is vertical.
    assert horizontal.risk == pytest.approx(2e-9, rel=1e-15)
    assert vertical.risk == pytest.approx(0.98e-7, rel=1e-15)
    with mp.workdps(30):
        for factor in (horizontal, vertical):
            tail = mp.erfc(mp.mpf(factor.k) / mp.sqrt(2))
            assert tail == pytest.approx(factor.risk, rel=1e-12)
    assert horizontal.k == pytest.approx(5.997807015, rel=1e-9)
    assert vertical.k == pytest.approx(5.330393852, rel=1e-9)
    assert (round(horizontal.k, 1), round(vertical.k, 2)) == (6.0, 5.33)
    assert (horizontal.published_k, vertical.published_k) == (6.0, 5.33)
    assert horizontal.published_risk == pytest.approx(1.973175e-9, rel=1e-6)
    assert vertical.published_risk == pytest.approx(9.821277e-8, rel=1e-6)


def test_non_precision_approach_gives_6_18() -> None:
    npa = leaf(load_allocation("npa_do229"), "horizontal")
    assert (npa.risk, npa.exposure_s) == (pytest.approx(5e-8, rel=1e-15), 3600)
    with mp.workdps(30):
        per_sample = 1 - (1 - mp.mpf(npa.risk)) ** (mp.mpf(1) / 10)
        assert npa.per_sample_risk == pytest.approx(float(per_sample), rel=1e-14)
        assert npa.k == pytest.approx(float(mp.sqrt(-2 * mp.log(per_sample))), rel=1e-14)
        exact_hour = 1 - (1 - mp.exp(-(mp.mpf(6.18) ** 2) / 2)) ** 10
    assert npa.k == pytest.approx(6.182851757, rel=1e-8)
    assert round(npa.k, 2) == 6.18
    # The rounded 6.18 is rounded down: it gives more than the allocated 5e-8 per hour.
    assert npa.published_per_sample_risk == pytest.approx(5.088921e-9, rel=1e-6)
    assert npa.published_risk == pytest.approx(float(exact_hour), rel=1e-12)
    assert npa.published_risk is not None
    assert npa.published_risk > npa.risk


def test_along_the_track_one_dimension_needs_less() -> None:
    along = leaf(load_allocation("npa_along_track"), "along_track")
    assert along.axis == "along"
    assert along.published_k is along.published_risk is None
    # One dimension is the ellipse of axis ratio 0, of which K at 5e-9 is 5.847172.
    assert along.k == pytest.approx(5.847172, rel=1e-7)


@pytest.mark.parametrize("name", BUNDLED)
def test_bundled_trees_are_whole_and_sourced(name: str) -> None:
    allocation = load_allocation(name)
    assert allocation.name == name
    assert all(node.source for node in allocation.nodes)
    values = allocation.values()
    for node in allocation.nodes:
        children = allocation.children(node.id)
        if children:
            assert math.fsum(values[c.id] for c in children) == pytest.approx(values[node.id])
    plain = json.loads(json.dumps(allocation.to_dict()))
    assert allocation_from_dict(plain) == allocation
    assert all(json.dumps(factor.to_dict()) for factor in allocation.k_factors())


def test_bundled_names() -> None:
    assert BUNDLED == ["npa_along_track", "npa_do229", "pa_do229"]


# --- re-allocation ----------------------------------------------------------------------------


@given(share=st.floats(1e-6, 1 - 1e-6))
def test_reallocated_risk_is_conserved(share: float) -> None:
    pa = load_allocation("pa_do229").reallocate({"horizontal": share, "vertical": 1 - share})
    values = pa.values()
    assert values["horizontal"] + values["vertical"] == pytest.approx(1e-7, rel=1e-12)
    assert leaf(pa, "horizontal").risk == pytest.approx(share * 1e-7, rel=1e-15)
    if share > 0.02:
        assert leaf(pa, "horizontal").k < leaf(load_allocation("pa_do229"), "horizontal").k


def test_reallocation_is_recorded_and_leaves_the_original() -> None:
    pa = load_allocation("pa_do229")
    even = pa.reallocate({"horizontal": 0.5, "vertical": 0.5})
    assert even.node("horizontal").source.startswith("re-allocated, share 0.5 in place of 0.02 (")
    assert even.node("faulted") == pa.node("faulted")
    assert pa == load_allocation("pa_do229")
    assert leaf(even, "horizontal").k == leaf(even, "vertical").k
    # The published factor stays, with the risk that it really gives.
    assert leaf(even, "horizontal").published_risk == leaf(pa, "horizontal").published_risk


def test_reallocation_never_normalises() -> None:
    pa = load_allocation("pa_do229")
    with pytest.raises(ModelError, match=r"(?s)do not sum to 1.*horizontal 0\.5, vertical 0\.98"):
        pa.reallocate({"horizontal": 0.5})
    with pytest.raises(ModelError, match="do not sum to 1"):
        pa.reallocate({"horizontal": 0.02 + 1e-11, "vertical": 0.98})
    assert pa.reallocate({"horizontal": 0.02 + 1e-13, "vertical": 0.98})
    for share in (0, -0.5, 1.5, math.nan, "0.5", True):
        with pytest.raises(ModelError, match="share is out of range"):
            pa.reallocate({"horizontal": share, "vertical": 0.5})  # type: ignore[dict-item]
    with pytest.raises(ModelError, match="the root has no share"):
        pa.reallocate({"total": 1.0})
    with pytest.raises(InputError, match="did you mean 'vertical'"):
        pa.reallocate({"vertcal": 0.5})


def test_values_in_place_of_shares() -> None:
    plain = load_allocation("pa_do229").to_dict()
    for node in plain["nodes"]:
        value = {"horizontal": 2e-9, "vertical": 0.98e-7}.get(node["id"])
        if value:
            del node["share"]
            node["value"] = value
    by_value = allocation_from_dict(plain)
    assert leaf(by_value, "horizontal").risk == 2e-9
    even = by_value.reallocate({"horizontal": 0.5, "vertical": 0.5})
    assert even.node("horizontal").value is None
    plain["nodes"][-1]["value"] = 1e-7
    with pytest.raises(ModelError, match="do not sum to 1"):
        allocation_from_dict(plain)


# --- other shapes of leaves -------------------------------------------------------------------


def npa(**changes: Any) -> dict[str, Any]:
    """The bundled NPA tree as plain data, its leaf changed; None removes a key."""
    plain = load_allocation("npa_do229").to_dict()
    node = {**plain["nodes"][-1], **changes}
    plain["nodes"][-1] = {key: value for key, value in node.items() if value is not None}
    return plain


def test_one_sided_and_elliptical_leaves() -> None:
    one_sided = allocation_from_dict(npa(axis="V", dim=1, sided="one", published_k=None))
    with mp.workdps(30):
        factor = leaf(one_sided, "horizontal")
        tail = mp.erfc(mp.mpf(factor.k) / mp.sqrt(2)) / 2
        assert tail == pytest.approx(factor.per_sample_risk, rel=1e-12)
    # Methods page "Integrity statistics", section 9: Hoyt, 5e-9, q = 0.5.
    ellipse = leaf(allocation_from_dict(npa(axis_ratio=0.5)), "horizontal")
    assert ellipse.k == pytest.approx(5.871837, rel=1e-7)
    assert ellipse.published_per_sample_risk == pytest.approx(7.433210e-10, rel=1e-6)


# --- refusals ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "where", "named"),
    [
        ({"shar": 1.0}, "nodes[3].shar", "did you mean 'share'"),
        ({"clock": {"n": 10, "tau": 360}}, "nodes[3].clock.tau", "allowed are n"),
        ({"clock": {}}, "nodes[3].clock.n", "finite number"),
        ({"clock": 10}, "nodes[3].clock", "clock = { n = 10 }"),
        ({"clock": {"n": 0.5}}, "clock.n", "1 or more"),
        ({"clock": None}, "horizontal", "dim = 1 or 2 and a clock"),
        ({"source": None}, "nodes[3].source", "source"),
        ({"source": "  "}, "nodes[3].source", "text"),
        ({"kind": None}, "nodes[3].kind", "'kind' is missing"),
        ({"kind": "faulty"}, "horizontal.kind", "did you mean 'faulted'"),
        ({"axis": "X"}, "horizontal.axis", "allowed are H, V, along"),
        ({"axis": "V"}, "horizontal", "two dimensions are horizontal"),
        ({"sided": "one"}, "horizontal", "two-sided"),
        ({"sided": "both"}, "horizontal.sided", "allowed are two, one"),
        ({"dim": 3}, "horizontal", "dim = 1 or 2"),
        ({"dim": True}, "horizontal", "dim = 1 or 2"),
        ({"dim": 2.0}, "horizontal", "dim = 1 or 2"),
        ({"dim": 1, "axis_ratio": 0.5}, "axis_ratio", "one dimension has no axis_ratio"),
        ({"axis_ratio": 1.5}, "axis_ratio", "in [0, 1]"),
        ({"axis": None}, "horizontal", "only a leaf with an axis"),
        ({"share": "1"}, "nodes[3].share", "finite number"),
        ({"share": math.nan}, "nodes[3].share", "finite number"),
        ({"share": True}, "nodes[3].share", "finite number"),
        ({"share": 0.5}, "fault_free", "do not sum to 1"),
        ({"share": None}, "horizontal", "either a share or a value"),
        ({"value": 5e-8}, "horizontal", "either a share or a value"),
        ({"exposure_s": 150.0}, "horizontal.exposure_s", "150 s, the root 3600 s"),
        ({"published_k": -6.18}, "published_k", "in (0, 30]"),
        ({"parent": "fault_fre"}, "horizontal.parent", "did you mean 'fault_free'"),
        ({"parent": None}, "npa_do229", "roots: total, horizontal"),
        ({"parent": "horizontal"}, "horizontal", "circle"),
        ({"id": "total"}, "total", "same id"),
        ({"id": 7}, "nodes[3].id", "text"),
    ],
)
def test_impossible_leaves(changes: dict[str, Any], where: str, named: str) -> None:
    with pytest.raises(ModelError) as caught:
        allocation_from_dict(npa(**changes))
    assert caught.value.where.endswith(where)
    assert named in str(caught.value)


def test_impossible_roots_and_files() -> None:
    good = load_allocation("npa_do229").to_dict()

    def refused(change: Any) -> str:
        plain = copy.deepcopy(good)
        change(plain)
        with pytest.raises(ModelError) as caught:
            allocation_from_dict(plain)
        return str(caught.value)

    assert "the root has a value" in refused(lambda p: p["nodes"][0].update(share=1.0))
    assert "the root has a value" in refused(lambda p: p["nodes"][0].pop("exposure_s"))
    assert "in (0, 1)" in refused(lambda p: p["nodes"][0].update(value=1.0))
    assert "roots: none" in refused(lambda p: p["nodes"][0].update(parent="faulted"))
    below = {**good["nodes"][1], "id": "below", "parent": "horizontal", "share": 1.0}
    assert "a node with an axis is a leaf" in refused(lambda p: p["nodes"].append(below))
    assert "roots: none" in refused(lambda p: p.update(nodes=[]))
    assert "array of tables" in refused(lambda p: p.update(nodes={}))
    assert "this version reads schema 1" in refused(lambda p: p.update(schema=2))
    assert "'title' is missing" in refused(lambda p: p.pop("title"))
    assert "did you mean 'nodes'" in refused(lambda p: p.update(node=[]))


def test_a_circle_beside_the_root() -> None:
    plain = npa(parent="loop")
    plain["nodes"].append({**plain["nodes"][1], "id": "loop", "parent": "horizontal"})
    with pytest.raises(ModelError, match="circle"):
        allocation_from_dict(plain)


def test_files(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_bytes(bundled("allocations", "pa_do229.toml").read_bytes())
    assert load_allocation(own) == load_allocation(str(own)) == load_allocation("pa_do229")
    own.write_text("schema = ")
    with pytest.raises(ModelError, match="no TOML file"):
        load_allocation(own)
    own.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ModelError, match="no TOML file"):
        load_allocation(own)
    with pytest.raises(InputError, match="cannot be read"):
        load_allocation(tmp_path / "absent.toml")
    with pytest.raises(InputError, match="did you mean 'npa_do229'"):
        load_allocation("npa_do22")
    with pytest.raises(InputError, match="no bundled file"):
        bundled("allocations", "absent.toml")
    with pytest.raises(InputError, match="did you mean 'vertical'"):
        load_allocation("pa_do229").node("vertica")
