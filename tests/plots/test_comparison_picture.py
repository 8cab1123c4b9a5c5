from __future__ import annotations

from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from sbas.integrity.comparison.comparison import compare
from sbas.integrity.comparison.comparison_results import Comparison
from sbas.plots.comparison_picture import pair_strips
from sbas.recording import Recording
from tests.examples import quiet


def compared(kind: str) -> Comparison:
    a, b = quiet(3000), quiet(3000, seed=2)
    if kind == "moving":
        drift = np.linspace(0, 0.05, 3000)
        a, b = (with_columns(r, lat_deg=r.table["lat_deg"] + drift) for r in (a, b))
        a, b = (with_columns(r, speed_mps=np.full(3000, 30.0)) for r in (a, b))
    elif kind == "bare":
        a, b = (r.replace(table=r.table[["hpl_m"]]) for r in (a, b))
    elif kind == "two_epochs":
        a, b = (r.replace(table=r.table.iloc[:2]) for r in (a, b))
    return compare(a, b)


def with_columns(recording: Recording, **columns: Any) -> Recording:
    return recording.replace(table=recording.table.assign(**columns))


@pytest.mark.parametrize("kind", ["static", "moving", "bare", "two_epochs"])
def test_draws_on_the_given_axes_and_touches_nothing_else(kind: str) -> None:
    comparison = compared(kind)
    settings = dict(matplotlib.rcParams)
    before = comparison.strips.low.copy()
    figure = Figure(figsize=(7, 6))
    axes = list(figure.subplots(4))
    drawn = pair_strips(comparison, axes=axes)
    assert list(drawn) == axes == figure.axes
    assert all(ax.get_ylabel() for ax in drawn)
    figure.canvas.draw()
    assert pair_strips(comparison)[0].figure is not figure
    assert dict(matplotlib.rcParams) == settings
    np.testing.assert_array_equal(before, comparison.strips.low)


def test_what_is_missing_is_said() -> None:
    words = "\n".join(t.get_text() for ax in pair_strips(compared("bare")) for t in ax.texts)
    for text in ("no speed", "no HDOP", "no number of satellites", "position in both"):
        assert text in words


def test_both_recordings_and_the_largest_distance_are_drawn() -> None:
    comparison = compared("moving")
    speed, distance, hdop, satellites = pair_strips(comparison)
    assert [len(ax.get_lines()) for ax in (speed, hdop, satellites)] == [2, 2, 2]
    assert np.nanmax(speed.get_lines()[0].get_ydata()) == 30.0
    heights = np.concatenate([line.get_ydata() for line in distance.get_lines()])
    found = comparison.to_dict()["difference_m"]
    assert np.nanmax(heights) == pytest.approx(found["max"])
    assert any(f"{found['p95']:.3f} m" in text.get_text() for text in distance.texts)
