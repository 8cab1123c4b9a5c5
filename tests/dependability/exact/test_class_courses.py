from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from sbas.dependability.exact.class_courses import ClassCourse, combined
from sbas.dependability.exact.exact import solve
from sbas.dependability.exact.plan import split, tree_of
from sbas.dependability.tree.model import (
    And,
    Component,
    Failed,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Or,
    Pand,
    Undeveloped,
)
from sbas.dependability.tree.redundancy import k_out_of_n
from sbas.exceptions import InputError
from tests.dependability.paper_models import localisation_unit
from tests.dependability.path_enumeration import by_paths


def test_a_function_of_classes_by_all_cases() -> None:
    rng = np.random.default_rng(7)
    parts = []
    for classes in (2, 3, 2):
        pairs = rng.random((4, classes, classes))
        pairs /= pairs.sum(axis=(1, 2), keepdims=True)
        pairs[0] = 0.0
        on = pairs.sum(axis=1)
        on[0] = 1.0 / classes
        parts.append(ClassCourse(on, pairs, rng.random((4, classes, 2))))
    table = rng.random((2, 3, 2)) < 0.5
    found = combined(table, parts)
    cases = list(product(range(2), range(3), range(2)))
    on, inside = np.zeros((4, 2)), np.zeros((4, 2, 2))
    pairs = np.zeros((4, 2, 2))
    for now in cases:
        on[:, int(table[now])] += np.prod(
            [p.on[:, c] for p, c in zip(parts, now, strict=True)], axis=0
        )
        inside[:, int(table[now])] += np.prod(
            [p.inside[:, c] for p, c in zip(parts, now, strict=True)], axis=0
        )
        for was in cases:
            pairs[:, int(table[was]), int(table[now])] += np.prod(
                [p.pairs[:, b, c] for p, b, c in zip(parts, was, now, strict=True)], axis=0
            )
    np.testing.assert_allclose(found.on, on, rtol=1e-13)
    np.testing.assert_allclose(found.pairs, pairs, rtol=1e-13)
    np.testing.assert_allclose(found.inside, inside, rtol=1e-13)


def channel(*, common: float, epochs: int = 3) -> HybridFaultTree:
    """A small unit: wrong after two kinds of order, missing otherwise; software common to all."""
    source = MarkovSource(
        "o", ("good", "wrong"), ((0.8, 0.2), (0.4, 0.6)), (1.0, 0.0), guard=("r",)
    )
    return HybridFaultTree(
        "channel", 3600.0, 3600.0 * epochs, (Component("r", 0.2, 0.5),), (source,),
        (Failed("failed", "r"), InState("wrong", "o", ("wrong",)), Undeveloped("soft", common)),
        (Or("lost", ("failed", "soft")), Pand("unsafe", ("wrong",) * 2),
         Or("top", ("lost", "unsafe"))),
        "top", ("lost", "unsafe"),
    )  # fmt: skip


@pytest.mark.parametrize(("k", "n"), [(2, 2), (1, 2)])
@pytest.mark.parametrize("common", [0.0, 0.1])
@pytest.mark.parametrize("shared", [True, False])
def test_two_channels_by_every_path(k: int, n: int, common: float, shared: bool) -> None:
    model = k_out_of_n(channel(common=common), k, n, share_sources=shared, unsafe="unsafe")
    solved = solve(model, first_passage=True)
    for name, path in by_paths(model).items():
        row = solved.rows[name]
        got = (row.mean_unavailability, row.at_end, row.occurrences, row.at_least_once)
        expected = (path.on[1:].mean(), path.on[-1], path.occurrences, path.once)
        assert got == pytest.approx(expected, rel=1e-12, abs=1e-300), name


def test_a_vote_of_three_against_one_chain() -> None:
    model = k_out_of_n(channel(common=0.1, epochs=40), 2, 3, share_sources=False, unsafe="unsafe")
    apart = solve(model)
    # An event that changes nothing, read by every gate, ties all channels into one chain.
    tie = Undeveloped("tie", 0.5)
    tied = {g.name: f"{g.name} tied" for g in model.gates}
    gates = tuple(
        (
            And(f"{n} on", (n, "tie")),
            And(f"{n} off", (n, "not tie")),
            Or(t, (f"{n} on", f"{n} off")),
        )
        for n, t in tied.items()
    )
    whole = replace(
        model,
        events=(*model.events, tie),
        gates=(*model.gates, Not("not tie", "tie"), *(g for three in gates for g in three)),
    )
    part = split("top", tree_of(model))
    assert [len(block) for block in part.blocks].count(2) >= 1
    assert not split("top tied", tree_of(whole)).parts
    for name in ("top", "unsafe", "Unavailable"):
        one = solve(whole, names=[f"{name} tied"]).rows[f"{name} tied"]
        assert apart.rows[name].mean_unavailability == pytest.approx(
            one.mean_unavailability, rel=1e-11, abs=0.0
        )
        assert apart.rows[name].occurrences == pytest.approx(one.occurrences, rel=1e-11, abs=0.0)


def test_a_duplicated_unit_needs_no_joint_chain() -> None:
    unit = localisation_unit()
    single = solve(unit, curve=True)
    pair = solve(k_out_of_n(unit, 2, 2, share_sources=False, unsafe="C"))
    alone = single.curves["C"]
    assert pair.rows["C"].mean_unavailability == pytest.approx(
        (alone[1:] ** 2).mean(), rel=1e-12, abs=0.0
    )
    assert pair.rows["C"].states < 1000
    top = single.curves["TOP"]
    assert pair.top.mean_unavailability == pytest.approx((2 * top - top**2)[1:].mean(), rel=1e-12)


def test_refusals_before_anything_large_is_built() -> None:
    unit = localisation_unit()
    shared = k_out_of_n(unit, 2, 2, share_sources=True, unsafe="C")
    with pytest.raises(InputError) as refused:
        solve(shared, names=["C"])
    for words in ("406272 states", "antenna_1", "simulation", "share_sources=False"):
        assert words in str(refused.value)
    apart = k_out_of_n(unit, 2, 2, share_sources=False, unsafe="C")
    with pytest.raises(InputError) as refused:
        solve(apart, names=["C"], first_passage=True, max_states=100_000)
    for words in ("at least once", "C_1", "C_2", "occurrences are an upper bound", "simulation"):
        assert words in str(refused.value)
