"""Cut sequences: closed forms, and every history of small models told by the definition."""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from sbas.dependability.analysis.cut_sequences import cut_sequences
from sbas.dependability.tree.gate_truth import gate_truth
from sbas.dependability.tree.model import (
    And,
    AtLeast,
    Con,
    Dur,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
    Pand,
    Undeveloped,
)
from sbas.exceptions import ModelError
from tests.dependability.analysis.small_models import hardware_tree
from tests.dependability.path_enumeration import _histories, by_paths

RATES = {"x": 0.2, "y": 0.3}


def by_name(found: object) -> dict[str, float]:
    return {str(s): s.probability for s in found.minimal}  # type: ignore[attr-defined]


def test_and_without_repair_in_closed_form() -> None:
    found = cut_sequences(hardware_tree(RATES, And("T", ("X", "Y"))))
    p, q = (-np.expm1(-rate) for rate in RATES.values())
    n = np.arange(5)
    first_x, first_y = p * (1 - p) ** n, q * (1 - q) ** n
    table = by_name(found)
    x_then_y = sum(first_x[i] * first_y[i + 1 :].sum() for i in range(5))
    y_then_x = sum(first_y[i] * first_x[i + 1 :].sum() for i in range(5))
    assert table["X -> Y"] == pytest.approx(x_then_y, rel=1e-12)
    assert table["Y -> X"] == pytest.approx(y_then_x, rel=1e-12)
    assert table["X & Y"] == pytest.approx((first_x * first_y).sum(), rel=1e-12)
    assert found.at_least_once == pytest.approx(first_x.sum() * first_y.sum(), rel=1e-12)
    assert abs(found.remainder) < 1e-14
    assert found.cut_sets == (frozenset({"X", "Y"}),)
    assert found.summary()["share"].sum() == pytest.approx(1.0)
    assert json.loads(json.dumps(found.to_dict()))["cut_sets"] == [["X", "Y"]]


@pytest.mark.parametrize("repair", [0.0, 0.7])
def test_a_priority_and_shows_its_order_only(repair: float) -> None:
    model = hardware_tree(RATES, Pand("T", ("X", "Y")), repair_rate_per_h=repair)
    found = cut_sequences(model)
    assert set(by_name(found)) == {"X -> Y", "X & Y"}
    assert sum(by_name(found).values()) == pytest.approx(by_paths(model)["T"].once, rel=1e-11)
    strict = replace(model, gates=(Pand("T", ("X", "Y"), exclusive=True),))
    assert set(by_name(cut_sequences(strict))) == {"X -> Y"}


def test_a_latched_order_is_not_forgotten() -> None:
    model = hardware_tree(
        {**RATES, "z": 0.4},
        Pand("P", ("X", "Y"), latched=True),
        And("T", ("Z", "P")),
        repair_rate_per_h=0.8,
        epochs=4,
    )
    found = cut_sequences(model, longest=8)
    for sequence in found.entries:
        steps = [set(step) for step in sequence.steps]
        pairs = [
            (i, j)
            for i, first in enumerate(steps)
            for j, second in enumerate(steps)
            if "X" in first and "Y" in second and i <= j
        ]
        assert pairs, str(sequence)
    assert any(s.steps[-1] == ("Z",) for s in found.minimal)
    assert abs(found.remainder) < 1e-14


def histories_by_definition(model: HybridFaultTree, longest: int = 99) -> dict[str, float]:
    """Last onsets since all were last false, at the first true epoch of the top, path by path."""
    histories, weights = _histories(model)
    truth = gate_truth(model, histories)
    events = [e.name for e in model.events]
    found: dict[str, float] = defaultdict(float)
    for m, weight in enumerate(weights):
        top = np.flatnonzero(truth[model.top][m, 1:])
        if not top.size:
            continue
        end = int(top[0]) + 1
        on = np.array([truth[name][m, : end + 1] for name in events])
        quiet = np.flatnonzero(~on.any(axis=0))
        begin = int(quiet[-1]) + 1 if quiet.size else 0
        onsets: dict[int, list[str]] = defaultdict(list)
        for name, line in zip(events, on, strict=True):
            rises = [n for n in range(begin, end + 1) if line[n] and (n == 0 or not line[n - 1])]
            if rises:
                onsets[rises[-1]].append(name)
        text = " -> ".join(" & ".join(onsets[n]) for n in sorted(onsets)) or "(no event)"
        found[text] += weight
    return dict(found)


def mixed_model() -> HybridFaultTree:
    source = MarkovSource(
        "S", ("good", "bad"), ((0.7, 0.3), (0.4, 0.6)), (0.9, 0.1), guard=("x",), restart="first"
    )
    model = hardware_tree(
        RATES,
        Con("C", 2, "BAD"),
        Pand("P", ("Y", "C")),
        Dur("D", 3600.0, "X"),
        Or("T", ("P", "D", "U")),
        repair_rate_per_h=0.5,
        epochs=4,
    )
    events = (*model.events, InState("BAD", "S", ("bad",)), Undeveloped("U", 0.01))
    return replace(model, sources=(source,), events=events)


def test_every_history_of_a_mixed_model() -> None:
    model = mixed_model()
    # Without the drawn event: it is a part of its own, followed alone.
    alone = replace(model, gates=(*model.gates[:3], Or("T", ("P", "D"))), events=model.events[:-1])
    expected = histories_by_definition(alone)
    found = cut_sequences(alone, longest=8)
    assert {str(s) for s in found.entries} == set(expected)
    for sequence in found.entries:
        assert sequence.probability == pytest.approx(expected[str(sequence)], rel=1e-11)
    assert sum(s.probability for s in found.minimal) + found.several == pytest.approx(
        by_paths(alone)["T"].once, rel=1e-11
    )


def test_parts_that_share_nothing_meet() -> None:
    model = mixed_model()
    found = cut_sequences(model, longest=8)
    once = by_paths(model)["T"].once
    assert found.at_least_once == pytest.approx(once, rel=1e-11)
    assert sum(s.probability for s in found.entries) == pytest.approx(once, rel=1e-11)
    assert abs(found.remainder) < 1e-13
    assert found.cut_sets is None


def test_or_of_parts_in_closed_form() -> None:
    found = cut_sequences(hardware_tree(RATES, Or("T", ("X", "Y"))))
    p, q = (-np.expm1(-rate) for rate in RATES.values())
    n = np.arange(5)
    both_up = ((1 - p) * (1 - q)) ** n
    table = by_name(found)
    # One epoch for both: it counts for the part that is named first.
    assert table["X"] == pytest.approx((both_up * p).sum(), rel=1e-12)
    assert table["Y"] == pytest.approx((both_up * (1 - p) * q).sum(), rel=1e-12)


def test_long_histories_are_marked() -> None:
    names = ("v", "w", "x", "y", "z")
    model = hardware_tree(
        dict.fromkeys(names, 0.2), And("T", tuple(n.upper() for n in names)), epochs=8
    )
    found = cut_sequences(model)
    assert found.unresolved > 0.0
    assert all(s.steps[0] == ("...",) for s in found.entries if len(s.steps) > 4)
    whole = cut_sequences(model, longest=5)
    assert whole.unresolved == 0.0
    assert whole.at_least_once == pytest.approx((-np.expm1(-1.6)) ** 5, rel=1e-12)
    for result in (found, whole):
        assert abs(result.remainder) < 1e-14
    # No unresolved mass is called minimal: simultaneous steps stay sequences of their own.
    assert sum(by_name(found).values()) < sum(by_name(whole).values())


def test_sets_of_a_static_tree_are_those_of_its_sequences() -> None:
    model = hardware_tree(
        {**RATES, "z": 0.1}, AtLeast("G", 2, ("X", "Y", "Z")), Or("T", ("G", "X"))
    )
    found = cut_sequences(model)
    of_sequences = {frozenset(n for step in s.steps for n in step) for s in found.minimal}
    assert found.cut_sets is not None
    assert of_sequences == set(found.cut_sets) == {frozenset("X"), frozenset("YZ")}


def test_a_top_without_any_event() -> None:
    found = cut_sequences(hardware_tree(RATES, Not("T", "X"), epochs=2))
    assert str(found.minimal[0]) == "(no event)"
    assert found.cut_sets is None


def test_too_large_a_model_is_refused_with_its_size() -> None:
    model = hardware_tree(RATES, Pand("T", ("X", "Y")), repair_rate_per_h=0.7)
    with pytest.raises(ModelError, match="too large") as error:
        cut_sequences(model, max_states=5)
    assert "5 states" in error.value.evidence
