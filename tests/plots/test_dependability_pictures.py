"""Pictures of the localisation unit: they draw what was found, and what is absent is said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from sbas.dependability import ReceiverStates, load_models, receiver_states, solve
from sbas.dependability.analysis.architectures import ArchitectureLadder, ArchitectureRow
from sbas.dependability.analysis.hazard_verdict import rate_verdict
from sbas.dependability.analysis.importance import Importances, importance
from sbas.dependability.exact.solution import Solution
from sbas.dependability.receiver.thinned_states import StateStrip, state_strip
from sbas.dependability.tree.model import HybridFaultTree, Or, Undeveloped
from sbas.exceptions import InputError
from sbas.plots import (
    architecture_ladder,
    importance_bars,
    probability_curve,
    sojourn_survival,
    state_ribbon,
    tree_picture,
)
from sbas.plots.tree_layout import tree_layout
from tests.dependability.small_unit import small_unit
from tests.dependability.state_recordings import TRUTH, chain_states, state_recording

ROWS = [[0.97, 0.02, 0.01], [0.5, 0.45, 0.05], [0.1, 0.0, 0.9]]


@cache
def seen() -> tuple[ReceiverStates, StateStrip]:
    recording = state_recording(chain_states(ROWS, 4000, 1))
    return (
        receiver_states(recording, truth=TRUTH, threshold_m=50),
        state_strip(recording, truth=TRUTH, threshold_m=50),
    )


@cache
def only_correct() -> tuple[ReceiverStates, StateStrip]:
    recording = state_recording("1" * 50)
    return (
        receiver_states(recording, truth=TRUTH, threshold_m=50),
        state_strip(recording, truth=TRUTH, threshold_m=50),
    )


@cache
def solved() -> Solution:
    return solve(small_unit(), first_passage=True, curve=True)


@cache
def weighed() -> Importances:
    return importance(small_unit())


def compared(*rates: float, thr_per_h: float | None = 1e-8) -> ArchitectureLadder:
    """Architectures with these rates, and one that was too large."""
    rows = [
        ArchitectureRow(
            f"number {i}", 0.1, 0.01, None, rate_verdict(rate, "Case C", thr_per_h=thr_per_h)
        )
        for i, rate in enumerate(rates)
    ]
    rows.append(ArchitectureRow("huge", None, None, None, None, "1e9 states\n  cure: simulate"))
    return ArchitectureLadder("Case C", thr_per_h, tuple(rows))


def wide_tree(boxes: int) -> HybridFaultTree:
    names = tuple(f"e{i}" for i in range(boxes))
    return replace(
        small_unit(), components=(), sources=(), cases=(), top="G",
        events=tuple(Undeveloped(name, 0.1) for name in names), gates=(Or("G", names),),
    )  # fmt: skip


PICTURES: dict[str, Callable[..., Any]] = {
    "ribbon": lambda **o: state_ribbon(seen()[1], **o),
    "ribbon of one state": lambda **o: state_ribbon(only_correct()[1], **o),
    "runs": lambda **o: sojourn_survival(seen()[0], **o),
    "runs of none": lambda **o: sojourn_survival(only_correct()[0], **o),
    "tree": lambda **o: tree_picture(small_unit(), solved(), **o),
    "tree alone": lambda **o: tree_picture(small_unit(), **o),
    "tree too wide": lambda **o: tree_picture(wide_tree(40), **o),
    "curves": lambda **o: probability_curve(solved(), **o),
    "no curves": lambda **o: probability_curve(replace(solved(), curves={}), **o),
    "ladder": lambda **o: architecture_ladder(compared(0.4, 3e-9, 0.0, 1e-20), **o),
    "ladder without target": lambda **o: architecture_ladder(compared(1e-7, thr_per_h=None), **o),
    "empty ladder": lambda **o: architecture_ladder(ArchitectureLadder("C", None, ()), **o),
    "importance": lambda **o: importance_bars(weighed(), **o),
    "importance of nothing": lambda **o: importance_bars(replace(weighed(), rows=()), **o),
}


@pytest.mark.parametrize("name", PICTURES)
def test_draws_on_the_given_axes_and_touches_nothing_else(name: str) -> None:
    from matplotlib import pyplot

    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    figure = Figure()
    ax = figure.subplots()
    assert PICTURES[name](ax=ax) is ax
    figure.canvas.draw()
    assert PICTURES[name]().figure is not figure
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures


def written(ax: Axes) -> list[str]:
    return [t.get_text() for t in ax.texts]


def labels(ax: Axes) -> list[str]:
    return [t.get_text() for t in ax.get_legend().get_texts()]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("runs of none", "no run of wrong epochs"),
        ("tree too wide", "more than 14 boxes"),
        ("no curves", "curve=True"),
        ("ladder", "no figures: 1e9 states"),
        ("ladder", "never true in this model"),
        ("empty ladder", "no architecture"),
        ("importance of nothing", "depends on no event"),
    ],
)
def test_what_cannot_be_drawn_is_said(name: str, words: str) -> None:
    assert words in " ".join(written(PICTURES[name]()))


def test_one_wrong_epoch_of_a_day_is_seen_in_the_ribbon() -> None:
    states = np.ones(86_400, int)
    states[40_000] = 2
    strip = state_strip(state_recording(states), truth=TRUTH, threshold_m=50)
    ax = state_ribbon(strip)
    assert any(label.startswith("wrong: 1 (") for label in labels(ax))
    vermilion = [
        c.get_paths()[0].get_extents()
        for c in ax.collections
        if c.get_paths() and np.allclose(c.get_facecolor()[0][:3], (0xD5 / 255, 0x5E / 255, 0))
    ]
    upper = [box for box in vermilion if box.y0 > 1]
    (box,) = upper
    assert box.x0 <= 40_000 / 3600 <= box.x1
    assert box.x1 - box.x0 == pytest.approx(0.02)  # 72 s of 24 h


def test_runs_survive_as_counted_by_hand() -> None:
    # Wrong runs of 1, 1, 2 and 4 epochs, all seen from begin to end.
    states = receiver_states(
        state_recording("1211211221122221111"), truth=TRUTH, threshold_m=50, tail_runs=2
    )
    ax = sojourn_survival(states)
    counted, law = ax.lines[1], ax.lines[2]
    assert list(counted.get_xdata()) == [1, 2, 3]
    assert list(counted.get_ydata()) == pytest.approx([1, 1 / 2, 1 / 4])
    # Stay 4 of 8 times: P(L >= r) = 2^(1 - r).
    assert np.interp(2, law.get_xdata(), law.get_ydata()) == pytest.approx(0.5, rel=0.02)
    assert "4 runs seen whole, 0 cut" in labels(ax)
    with pytest.raises(InputError, match="no state"):
        sojourn_survival(states, state="hardware")


def test_the_tree_of_the_paper_has_every_gate_with_kind_and_number() -> None:
    model = load_models("galoroi")["urban"]
    solution = solve(model)
    ax = tree_picture(model, solution)
    text = written(ax)
    for kind in ("DUR 60 s", "CON 6", "CON 2", "PAND", "AND 3 s"):
        assert text.count(kind) == 1, kind
    # 11 gates; IE3 under two of them; BE2 and BE6 twice.
    assert {name: text.count(name) for name in ("TOP", "IE3", "BE2", "BE6", "IE4")} == {
        "TOP": 1, "IE3": 2, "BE2": 2, "BE6": 2, "IE4": 1,
    }  # fmt: skip
    # Calibrated to the rows that the paper prints (Table II, urban).
    assert {"1.57×10⁻⁴", "1.63×10⁻⁸", "8.34×10⁻¹¹"} <= set(text)
    assert "dashed: drawn in full elsewhere" in text[-1]


def test_boxes_stand_apart_and_gates_above_the_middle_of_their_inputs() -> None:
    model = load_models("galoroi")["urban"]
    layout = tree_layout(model, most_columns=14)
    assert layout is not None
    assert (layout.columns, layout.layers) == (11, 6)
    places = [(box.column, box.layer) for box in layout.boxes]
    for layer in range(layout.layers):
        row = sorted(column for column, own in places if own == layer)
        assert np.all(np.diff(row) >= 1), layer
    for i, box in enumerate(layout.boxes):
        below = [b.column for b in layout.boxes if b.parent == i]
        if below:
            assert box.column == (min(below) + max(below)) / 2


def test_deep_layers_that_do_not_fit_are_folded() -> None:
    model = load_models("galoroi")["urban"]
    layout = tree_layout(model, most_columns=8)
    assert layout is not None
    assert layout.columns <= 8
    assert "folded" in {box.kind for box in layout.boxes}
    assert tree_layout(wide_tree(40), most_columns=14) is None
    assert "left out" in written(tree_picture(replace(model, top="Case A")))[-1]


def test_curves_are_those_of_the_solution_and_a_long_one_keeps_its_peak() -> None:
    ax = probability_curve(solved(), ["Run", "Case C"])
    run = ax.lines[0]
    assert run.get_label() == "Run"
    known = np.isfinite(run.get_ydata())
    assert np.array_equal(np.asarray(run.get_ydata())[known], solved().curves["Run"][known])
    # 3 wrong epochs need 3 epochs; then 0.08 * 0.5 * 0.5.
    assert solved().curves["Run"][3] == pytest.approx(0.02)
    long = np.full(100_001, 1e-6)
    long[77_777] = 1e-3
    model = replace(small_unit(), mission_s=100_000.0)
    peaked = replace(solved(), model=model, curves={"Run": long})
    line = probability_curve(peaked, ["Run"]).lines[0]
    assert len(line.get_xdata()) < 2000
    at = int(np.argmax(line.get_ydata()))
    assert line.get_ydata()[at] == 1e-3
    assert line.get_xdata()[at] == pytest.approx(77_777 / 3600)
    with pytest.raises(InputError, match="no row"):
        probability_curve(solved(), ["absent"])


def test_bars_are_as_long_as_the_criticality() -> None:
    found = weighed()
    ax = importance_bars(found)
    ends = {}
    for bar in ax.patches:
        ends[round(bar.get_y() + bar.get_height() / 2)] = bar.get_x() + bar.get_width()
    for i, row in enumerate(found.rows):
        if row.criticality is not None and row.criticality > ax.get_xlim()[0]:
            assert ends[i] == pytest.approx(row.criticality)
    assert [t.get_text() for t in ax.get_yticklabels()] == [row.name for row in found.rows]


def test_the_ladder_stands_at_the_rates_and_marks_what_fails_the_target() -> None:
    ax = architecture_ladder(compared(0.4, 1e-8, 3e-9, 0.0))
    marks = {
        round(float(line.get_ydata()[0])): (float(line.get_xdata()[0]), line.get_markerfacecolor())
        for line in ax.lines
        if line.get_marker() == "o"
    }
    assert {i: x for i, (x, _) in marks.items()} == {0: 0.4, 1: 1e-8, 2: 3e-9}
    # A rate of just the target does not meet it.
    assert [face == "white" for _, face in marks.values()] == [True, True, False]
    # IEC 61508-1, 7.6.2: SIL 4 from 1e-9 to 1e-8 per hour.
    at = {t.get_text(): t.xy[0] for t in ax.texts if isinstance(t, Annotation)}
    assert 1e-9 < at["SIL 4"] < 1e-8 < at["SIL 3"] < 1e-7
    assert at["no SIL"] > 1e-5
    assert at["THR 1e-08/h"] == 1e-8
