"""Pictures of the software receiver: they draw where they are told and leave no trace."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import matplotlib
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sbas.augmentation.messages import SbasMessages
from sbas.plots import ground_plan, level_lines, message_timeline, sky, variance_budget
from sbas.recording import Recording
from tests.augmentation import encoding
from tests.plots.protected import protected, without_satellites


def empty(recording: Recording) -> Recording:
    side = {name: table.iloc[:0] for name, table in recording.side_tables.items()}
    return recording.replace(table=recording.table.iloc[:0], side_tables=side)


def bare(recording: Recording) -> Recording:
    """Times alone."""
    return without_satellites(recording).replace(table=recording.table[[]])


def no_message() -> SbasMessages:
    return encoding.heard((0, encoding.null())).of_prn(120)


RECORDINGS: dict[str, Callable[[], Recording]] = {
    "usual": protected,
    "one epoch": lambda: protected(1),
    "no epoch": lambda: empty(protected()),
    "times alone": lambda: bare(protected()),
}
Draw = Callable[..., Axes]


def cases() -> Iterator[tuple[str, Draw, Any]]:
    for kind, make in RECORDINGS.items():
        yield f"sky, {kind}", sky, make()
        yield f"variance_budget, {kind}", variance_budget, make()
        yield f"level_lines, {kind}", level_lines, {"A": make(), "B": protected()}
        yield f"level_lines alone, {kind}", level_lines, {"A": make()}
        yield f"ground_plan, {kind}", ground_plan, {"A": make(), "B": protected()}
        yield f"ground_plan alone, {kind}", ground_plan, {"A": make()}
    yield "level_lines, none", level_lines, {}
    yield "ground_plan, none", ground_plan, {}
    yield "message_timeline, none", message_timeline, no_message()
    yield "message_timeline, one", message_timeline, encoding.heard((0, encoding.null()))
    yield "message_timeline, usual", message_timeline, encoding.hourly({5: encoding.alarm()}, 50)


@pytest.mark.parametrize(("draw", "given"), [pytest.param(*c[1:], id=c[0]) for c in cases()])
def test_draws_on_the_given_axes_and_touches_nothing_else(draw: Draw, given: Any) -> None:
    from matplotlib import pyplot

    settings, open_figures = dict(matplotlib.rcParams), pyplot.get_fignums()
    before = [table.copy() for table in tables(given)]
    figure = Figure(figsize=(6, 6))
    ax = figure.subplots()
    assert draw(given, ax=ax) is ax
    assert figure.axes == [ax]
    figure.canvas.draw()
    own = draw(given)
    assert own.figure is not figure
    own.figure.canvas.draw()
    assert dict(matplotlib.rcParams) == settings
    assert pyplot.get_fignums() == open_figures
    for a, b in zip(before, tables(given), strict=True):
        pd.testing.assert_frame_equal(a, b)


def tables(given: Any) -> list[pd.DataFrame]:
    if isinstance(given, SbasMessages):
        return [pd.DataFrame({"time_s": given.time_s, "kind": given.kind})]
    recordings = given.values() if isinstance(given, dict) else [given]
    return [t for r in recordings for t in (r.table, *r.side_tables.values())]


@pytest.mark.parametrize("draw", [sky, variance_budget])
def test_an_empty_picture_says_why(draw: Draw) -> None:
    words = " ".join(t.get_text() for t in draw(bare(protected())).texts)
    assert "in this recording" in words
