"""The bars of importance and sensitivity: drawn where told, gaps and refusals written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from sbas.fusion.importance.importance_results import StateImportances
from sbas.fusion.importance.parameter_sensitivity import ParameterSensitivity
from sbas.fusion.importance.state_importance import importance_by_state, independent_importance
from sbas.fusion.logic.published_tables import figure_9
from sbas.plots.state_importance_picture import sensitivity_bars, state_importance_bars
from tests.fusion.importance.test_parameter_sensitivity import asked, ishigami
from tests.fusion.importance.test_state_importance import MARGINALS, drawn_runs


@cache
def three_laws() -> StateImportances:
    """300 runs; the accelerometer is never U."""
    runs = drawn_runs(300)
    states = runs.sensor_state.copy()
    states[1][states[1] == 2] = 1
    return importance_by_state(figure_9(), replace(runs, sensor_state=states), replicates=100)


@cache
def indices() -> ParameterSensitivity:
    return asked(ishigami, -np.pi, np.pi, 3, base_points=64, replicates=100)


PICTURES: dict[str, Callable[..., Any]] = {
    "three laws": lambda **o: state_importance_bars(three_laws(), **o),
    "not N": lambda **o: state_importance_bars(three_laws(), top="notN", **o),
    "independent": lambda **o: state_importance_bars(
        independent_importance(figure_9(), MARGINALS), **o
    ),
    "no rows": lambda **o: state_importance_bars(replace(three_laws(), rows=()), **o),
    "indices": lambda **o: sensitivity_bars(indices(), **o),
    "many": lambda **o: sensitivity_bars(replace(indices(), rows=indices().rows * 7), **o),
    "constant": lambda **o: sensitivity_bars(asked(lambda _: 0.1, 0.0, 1.0, 2, base_points=8), **o),
}


@pytest.mark.parametrize("name", PICTURES)
def test_draws_on_the_given_axes_and_touches_nothing_else(name: str) -> None:
    from matplotlib import pyplot

    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    figure = Figure()
    ax = figure.subplots()
    assert PICTURES[name](ax=ax) is ax
    assert ax.get_xlabel()
    figure.canvas.draw()
    assert PICTURES[name]().figure is not figure
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures


def test_bars_are_the_birnbaum_figures() -> None:
    found = three_laws()
    ax = state_importance_bars(found)
    assert [t.get_text() for t in ax.get_yticklabels()] == [
        "Odo DA", "Odo U", "Acc DA", "Acc U", "GPS DA", "GPS U",
    ]  # fmt: skip
    labels = [t.get_text() for t in ax.get_legend().get_texts()]
    assert labels == ["table, independent", "table, joint", "simulated"]
    for bars, law in zip(ax.containers, ("independent", "joint", "simulated"), strict=True):
        drawn = [patch.get_width() for patch in bars]
        rows = [r for r in found.rows if (r.law, r.top) == (law, "isU")]
        assert drawn == [
            0.0 if r.birnbaum.value != r.birnbaum.value else r.birnbaum.value for r in rows
        ]
    whiskers = [line for line in ax.get_lines() if len(set(line.get_ydata())) == 1]
    bounded = [r for r in found.rows if r.top == "isU" and r.birnbaum.bounded]
    assert len(whiskers) == len(bounded) > 0


def test_what_is_not_known_is_written() -> None:
    texts = [t.get_text() for t in state_importance_bars(three_laws()).texts]
    # U of the accelerometer under two laws.
    assert texts.count("not estimable") == 2
    # All epochs with GPS U have the output U, which the table does not know for certain.
    assert "1, no interval" in texts
    texts = [t.get_text() for t in PICTURES["independent"]().texts]
    assert not any("interval" in text for text in texts)
    assert "no sensor" in PICTURES["no rows"]().texts[0].get_text()


def test_indices_largest_total_first_with_half_widths() -> None:
    found = indices()
    ax = sensitivity_bars(found)
    rows = sorted(found.rows, key=lambda row: -row.total)
    assert [t.get_text() for t in ax.get_yticklabels()] == [row.path for row in rows]
    first, total = ([p.get_width() for p in bars] for bars in ax.containers)
    assert first == [row.first for row in rows]
    assert total == [row.total for row in rows]
    ends = [tuple(line.get_xdata()) for line in ax.get_lines()[1:]]
    assert ends[-1] == pytest.approx(
        (rows[-1].total - rows[-1].total_half_width, rows[-1].total + rows[-1].total_half_width)
    )


def test_rows_left_out_and_constant_figures_are_said() -> None:
    assert any("5 more are not shown" in t.get_text() for t in PICTURES["many"]().texts)
    assert "no variance" in PICTURES["constant"]().texts[0].get_text().replace("\n", " ")
