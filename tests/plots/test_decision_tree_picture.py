"""The decision tree: every path of the table is there, in words, colour and shape."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from sbas.exceptions import InputError
from sbas.fusion.logic.boolean_form import two_line_form
from sbas.fusion.logic.published_tables import figure_9
from sbas.fusion.logic.truth_table import TruthTable
from sbas.fusion.states import WORDS, combination_words
from sbas.plots.decision_tree_picture import decision_tree
from sbas.plots.style import GREEN, MUTED, ORANGE, VERMILION


def of_sensors(n: int) -> TruthTable:
    return two_line_form([f"sensor number {k}" for k in range(n)])


def written(ax: Axes) -> list[str]:
    return [t.get_text() for t in ax.texts]


def edges(ax: Axes, low: float, high: float) -> dict[float, str]:
    """Colour of each horizontal edge that begins and ends in a stretch of x, by its height."""
    found = {}
    for line in ax.lines:
        x, y = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
        if x.size == 2 and y[0] == y[1] and low < x[0] < x[1] <= high:
            found[float(y[0])] = str(line.get_color())
    return found


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_draws_on_the_given_axes_and_touches_nothing_else(n: int) -> None:
    from matplotlib import pyplot

    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    table = of_sensors(n)
    figure = Figure()
    ax = figure.subplots()
    assert decision_tree(table, ax=ax) is ax
    figure.canvas.draw()
    assert decision_tree(table).figure is not figure
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures


@pytest.mark.parametrize("version", ["corrected", "printed"])
def test_every_leaf_of_figure_9_has_its_number_combination_and_output(version: str) -> None:
    table = figure_9(version)  # type: ignore[arg-type]
    ax = decision_tree(table)
    text = written(ax)
    for code, outcome in enumerate(table.outcomes.tolist()):
        words = f"O{code + 1}  {combination_words(code, 3)}: {WORDS[outcome]}"
        assert text.count(words) == 1
    assert {"Odo", "Acc", "GPS"} <= set(text)
    assert any(table.provenance[:40] in t for t in text)
    legend = ax.get_legend()
    assert legend is not None
    assert [t.get_text() for t in legend.get_texts()] == [
        "N, nominal: 7",
        "DA, degraded but acceptable: 19",
        "U, unacceptable: 1",
    ]


def test_an_edge_has_the_colour_of_all_leaves_beyond_it() -> None:
    ax = decision_tree(figure_9())
    last = edges(ax, 2.1, 3.0)
    of_state = {0: GREEN, 1: ORANGE, 2: VERMILION}
    assert last == {float(k): of_state[o] for k, o in enumerate(figure_9().outcomes.tolist())}
    # Second sensor: nine edges in the middle of three leaves; the third of each is all DA, and
    # with the odometer in U all but (U, U, .).
    second = edges(ax, 1.1, 2.0)
    expected = [MUTED, MUTED, ORANGE, MUTED, MUTED, ORANGE, ORANGE, ORANGE, MUTED]
    assert second == {1.0 + 3 * k: colour for k, colour in enumerate(expected)}
    assert set(edges(ax, 0.1, 1.0).values()) == {MUTED}


def test_outputs_differ_in_shape_for_those_who_see_no_colour() -> None:
    ax = decision_tree(figure_9())
    shapes = {
        (line.get_marker(), str(line.get_color()))
        for line in ax.lines
        if line.get_marker() not in ("None", "none", "")
    }
    assert shapes == {("o", GREEN), ("s", ORANGE), ("D", VERMILION)}


@pytest.mark.parametrize(
    "table", [of_sensors(2), figure_9(), of_sensors(4)], ids=["two", "figure 9", "four"]
)
def test_no_two_texts_of_a_tree_that_stands_alone_overlap(table: TruthTable) -> None:
    ax = decision_tree(table)
    figure = ax.figure
    assert isinstance(figure, Figure)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    renderer = canvas.get_renderer()  # type: ignore[no-untyped-call]
    boxes = [t.get_window_extent(renderer) for t in ax.texts]
    corners = np.array([[b.x0, b.y0, b.x1, b.y1] for b in boxes])
    first, second = np.triu_indices(len(corners), 1)
    a, b = corners[first], corners[second]
    overlap = np.all((a[:, :2] < b[:, 2:] - 0.5) & (b[:, :2] < a[:, 2:] - 0.5), axis=1)
    texts = written(ax)
    assert [(texts[first[i]], texts[second[i]]) for i in np.flatnonzero(overlap)] == []
    width, height = canvas.get_width_height()
    assert np.all(corners[:, :2] >= 0)
    assert np.all(corners[:, 2:] <= [width, height])


def test_five_sensors_are_refused_in_words() -> None:
    with pytest.raises(InputError, match="at most 4 sensors") as caught:
        decision_tree(of_sensors(5))
    assert "243 leaves" in caught.value.evidence
    assert "frame()" in caught.value.cure
