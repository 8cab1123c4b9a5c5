"""Pictures of the causal analysis: they draw where they are told and leave no trace."""

from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sbas.exceptions import InputError
from sbas.fusion.critical.critical_times import CriticalTimes, critical_times
from sbas.fusion.fused_runs import FusedRuns
from sbas.plots.combination_picture import combination_ribbon
from sbas.plots.incidence_picture import MOST, incidence_curve


def runs_of(n: int = 3, t: int = 30, r: int = 200, seed: int = 0) -> FusedRuns:
    rng = np.random.default_rng(seed)
    sensor = rng.integers(0, 3, (n, t, r)).astype(np.int8)
    for k in range(1, t):
        stay = rng.random(r) < 0.8
        sensor[:, k, stay] = sensor[:, k - 1, stay]
    output = np.where(rng.random((t, r)) < 0.1, 2, rng.integers(0, 2, (t, r))).astype(np.int8)
    return FusedRuns(
        tuple(f"S{i}" for i in range(n)), 1.0, sensor, output, np.zeros((t, r)), output < 2
    )


def analysed(fused: FusedRuns) -> CriticalTimes:
    return critical_times(
        fused.sensor_state, fused.output_state, names=fused.names, step_s=fused.step_s,
        replicates=100,
    )  # fmt: skip


def without_events() -> CriticalTimes:
    calm = np.zeros((1, 5, 3), np.int8)
    return analysed(FusedRuns(("S",), 1.0, calm, calm[0], np.zeros((5, 3)), calm[0] == 0))


def empty() -> FusedRuns:
    return FusedRuns(
        ("S",), 1.0, np.zeros((1, 0, 0), np.int8), np.zeros((0, 0), np.int8),
        np.zeros((0, 0)), np.zeros((0, 0), bool),
    )  # fmt: skip


CASES: dict[str, tuple[Any, Any]] = {
    "curves": (incidence_curve, lambda: analysed(runs_of())),
    "no curve": (incidence_curve, without_events),
    "ribbon": (combination_ribbon, runs_of),
    "ribbon of one epoch": (combination_ribbon, lambda: runs_of(t=1, r=1)),
    "ribbon of nothing": (combination_ribbon, empty),
}


@pytest.mark.parametrize("case", CASES)
def test_draws_on_the_given_axes_and_touches_nothing_else(case: str) -> None:
    from matplotlib import pyplot

    draw, make = CASES[case]
    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    figure = Figure()
    ax = figure.subplots()
    assert draw(make(), ax=ax) is ax
    assert figure.axes == [ax]
    assert ax.get_xlabel()
    figure.canvas.draw()
    own = draw(make())
    assert own.figure is not figure
    own.figure.canvas.draw()
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures


def names_drawn(ax: Axes) -> list[str]:
    return [str(line.get_label()).split(",")[0] for line in ax.get_lines()]


def test_curves_are_those_of_the_result() -> None:
    result = analysed(runs_of())
    ax = incidence_curve(result, ("UUU", "NND"))
    assert names_drawn(ax) == ["UUU", "NND"]
    for line in ax.get_lines():
        curve = result.curves[str(line.get_label()).split(",")[0]]
        at = np.searchsorted(line.get_xdata(), curve.time_s)
        np.testing.assert_allclose(line.get_ydata()[at], curve.incidence)
        assert line.get_ydata()[0] == 0
    assert "S0, S1, S2; modelled, 200 runs" in ax.get_legend().get_title().get_text()


def test_without_a_choice_the_highest_incidences_are_drawn() -> None:
    result = analysed(runs_of())
    drawn = names_drawn(incidence_curve(result))
    table = result.table.loc[list(result.curves)]
    critical = table[table["verdict"] == "critical"]["incidence"]
    assert len(drawn) == min(MOST, len(table))
    assert set(drawn[: len(critical)]) <= set(critical.nlargest(MOST, keep="all").index)


def test_what_cannot_be_drawn_is_said() -> None:
    assert "no combination with 5 events" in incidence_curve(without_events()).texts[0].get_text()
    result = analysed(runs_of())
    with pytest.raises(InputError, match="no incidence of XYZ"):
        incidence_curve(result, ("XYZ",))
    with pytest.raises(InputError, match="more than 6"):
        incidence_curve(result, tuple(result.curves)[: MOST + 1])
    with pytest.raises(InputError, match="no run 200"):
        combination_ribbon(runs_of(), 200)


def test_ribbons_show_the_states_of_the_run() -> None:
    sensor = np.array([[[0], [1], [1], [2]], [[-1], [-1], [0], [0]]], np.int8)
    output = np.array([[0], [0], [1], [2]], np.int8)
    fused = FusedRuns(("odo", "gps"), 0.5, sensor, output, np.zeros((4, 1)), output < 2)
    ax = combination_ribbon(fused)
    assert [label.get_text() for label in ax.get_yticklabels()] == ["odo", "gps", "output"]
    rows = ax.get_yticks()
    spans = {
        (round(box.x0, 3), round(box.x1, 3), int(np.argmin(abs(rows - box.y0 - 0.39))))
        for ribbon in ax.collections
        for box in (path.get_extents() for path in ribbon.get_paths() if len(path.vertices))
    }  # fmt: skip
    assert spans == {
        (0, 0.5, 0), (0.5, 1.5, 0), (1.5, 2, 0),
        (0, 1, 1), (1, 2, 1),
        (0, 1, 2), (1, 1.5, 2), (1.5, 2, 2),
    }  # fmt: skip
    legend = [text.get_text() for text in ax.get_legend().get_texts()]
    assert legend == ["N", "DA", "U", "no data"]
    assert [t.get_text() for t in ax.texts] == ["N", "DA", "U", "N", "N", "DA", "U"]
