from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from sbas.dependability.analysis.architectures import (
    compare_architectures,
    gnss_architectures,
    receiver_alone,
)
from sbas.dependability.exact.exact import solve
from sbas.dependability.tree.model import Component, Failed, HybridFaultTree, Or
from sbas.exceptions import InputError
from tests.dependability.paper_models import URBAN_EXACT, localisation_unit


def unit(**changes: object) -> HybridFaultTree:
    return localisation_unit(**changes)  # type: ignore[arg-type]


def test_the_receiver_alone_has_the_published_availability() -> None:
    alone = receiver_alone(unit(), source="output", hazard="C")
    rows = solve(alone).rows
    # Table III of the paper: 93.88 %.
    assert 1.0 - rows["TOP"].mean_unavailability == pytest.approx(0.93880, abs=5e-6)
    # Each entry into the wrong state is a hazard; of the receiver's chain alone by its powers.
    p = np.array(URBAN_EXACT)
    law, entries = np.array([1.0, 0.0, 0.0]), 0.0
    for _ in range(3600):
        entries += law[0] * p[0, 1] + law[2] * p[2, 1]
        law = law @ p
    assert rows["C"].occurrences == pytest.approx(entries, rel=1e-5)


def test_the_ladder_of_the_paper() -> None:
    found = gnss_architectures(unit(mission_s=600.0), hazard="C", source="output")
    del found["2oo3, shared signals, no first-fix wait"]
    ladder = compare_architectures(found, hazard="C", thr_per_h=0.1)
    rate = {r.name: r.verdict.rate_per_h for r in ladder.rows if r.verdict}
    one, pair = rate["GNSS + ECS"], rate["2oo2, independent signals"]
    assert len(rate) == len(found)
    assert rate["GNSS alone"] > 100.0 * one
    # A switched pair is wrong when either is; a compared pair only with both at once, and with
    # one signal state nearly as often as one channel.
    assert rate["1oo2, independent signals"] == pytest.approx(2.0 * one, rel=1e-3)
    assert pair < 1e-3 * one
    assert rate["2oo3, independent signals"] == pytest.approx(3.0 * pair, rel=1e-3)
    assert rate["2oo2, shared signals, no first-fix wait"] == pytest.approx(one, rel=1e-3)
    frame = ladder.summary()
    assert bool(frame.loc["2oo2, independent signals", "meets_thr"]) is True
    assert bool(frame.loc["GNSS + ECS", "meets_thr"]) is False
    json.dumps(ladder.to_dict())


def simple(rate: float) -> HybridFaultTree:
    return HybridFaultTree(
        "m", 1.0, 3600.0, (Component("c", rate),), (), (Failed("e", "c"),),
        (Or("Case C", ("e",)), Or("t", ("Case C",))), "t",
    )  # fmt: skip


def test_figures_of_one_component_and_a_refused_row() -> None:
    ladder = compare_architectures({"one": simple(2e-6)}, thr_per_h=1e-5, first_passage=True)
    (row,) = ladder.rows
    assert row.at_least_once == pytest.approx(2e-6, rel=1e-5)
    assert row.verdict is not None
    assert (row.verdict.meets, row.verdict.sil) == (True, 1)
    refused = compare_architectures(
        {"unit": localisation_unit(), "one": simple_as("C")}, hazard="C", max_states=100
    )
    assert [bool(r.refused) for r in refused.rows] == [True, False]
    assert "states" in refused.rows[0].refused
    assert refused.rows[0].unavailability is None
    assert refused.summary().loc["unit", "verdict"] == refused.rows[0].refused


def simple_as(name: str) -> HybridFaultTree:
    return replace(simple(1e-6), gates=(Or(name, ("e",)), Or("t", (name,))))


def test_refusals() -> None:
    with pytest.raises(InputError, match="no architectures"):
        compare_architectures({})
    with pytest.raises(InputError, match="without the hazard"):
        compare_architectures({"a": simple_as("C")})
    with pytest.raises(InputError, match="no source"):
        receiver_alone(unit(), source="O")
    with pytest.raises(InputError, match="no such state"):
        receiver_alone(unit(), source="output", wrong=("false",))
