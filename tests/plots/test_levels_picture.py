"""Levels over time: spikes, gaps and epochs without a level."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.plots.levels_picture import level_lines
from sbas.recording import Recording
from tests.plots.synthetic import synthetic_recording


def with_levels(recording: Recording, level: np.ndarray) -> Recording:
    return recording.replace(table=recording.table.assign(hpl_m=level))


def test_a_spike_of_one_epoch_is_drawn_at_its_height() -> None:
    ax = level_lines({"A": synthetic_recording(50_000, spikes={31_234: 99.0})})
    line = ax.get_lines()[0]
    assert np.nanmax(line.get_ydata()) == 99.0
    x = line.get_xdata()[np.nanargmax(line.get_ydata())]
    assert x * 3600 == pytest.approx(31_234, abs=50)
    assert ax.get_yscale() == "log"


def test_epochs_without_a_level_are_bars_and_gaps_of_the_record_are_not() -> None:
    recording = synthetic_recording(100)
    level = recording.table["hpl_m"].to_numpy().copy()
    level[10:30] = np.nan
    lacking = with_levels(recording, level)
    lacking = lacking.replace(table=lacking.table.drop(lacking.table.index[15:20]))
    ax = level_lines({"A": lacking, "B": recording})
    bars = [path.vertices for c in ax.collections for path in c.get_paths()]
    edges = sorted((v[:, 0].min(), v[:, 0].max()) for v in bars)
    # Epochs 10 to 14 and 20 to 29 lack a level; 15 to 19 were not recorded.
    np.testing.assert_allclose(edges, [(10, 15), (20, 30)])
    labels = [t.get_text() for t in ax.get_legend().get_texts()]
    assert labels == ["A, 80 of 95 epochs", "B, 100 of 100 epochs"]


def test_more_recordings_than_colours_are_refused() -> None:
    with pytest.raises(ValueError, match="at most 5"):
        level_lines({str(i): synthetic_recording(3) for i in range(6)})


def test_a_short_record_is_one_unbroken_line() -> None:
    ax = level_lines({"A": synthetic_recording(312)})
    x = np.asarray(ax.get_lines()[0].get_xdata(), float)
    # Strokes of begin, end, NaN: 312 of them, each begins where the one before ended.
    assert x.size == 3 * 312
    np.testing.assert_allclose(x[3::3], x[1:-3:3], atol=1e-9)
    np.testing.assert_allclose((x[::3] + x[1::3]) / 2, np.arange(312), atol=1e-9)
