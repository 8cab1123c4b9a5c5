"""Recordings on their grid: outages, interruptions, records side by side, epochs in cells."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import Thresholds
from sbas.fusion.recorded.recorded_errors import RecordedErrors
from sbas.fusion.recorded.recorded_grid import (
    epoch_cells,
    free_stretches,
    longest_stretch,
    recorded_grid,
    window_starts,
)
from sbas.fusion.states import states_of
from tests.fusion.recorded.test_recorded_errors import found, recording


def record(
    along_m: Any, *, seconds: Any = None, labels: Any = None, limit_m: float = 1e6, **changes: Any
) -> RecordedErrors:
    """A recording whose error along the track is known to the digit; NaN is an epoch without."""
    along = np.asarray(along_m, float)
    base = found(recording(0.0, np.where(np.isnan(along), np.nan, 0.1), seconds=seconds))
    thresholds = Thresholds(1.0, limit_m)
    if labels is not None:
        names = sorted({name for name in labels if name})
        codes = np.array([names.index(name) if name else -1 for name in labels])
        changes |= {"labels": tuple(names), "environment": codes}
    return replace(
        base, along_m=along, across_m=along / 2, up_m=-along, thresholds=thresholds,
        state=states_of(along, thresholds), **changes,
    )  # fmt: skip


def test_short_gaps_are_outages_and_long_ones_interruptions() -> None:
    errors = record(np.arange(1.0, 7.0), seconds=[0, 1, 4, 5, 70, 71])
    grid = recorded_grid(errors, 10.0, 1)
    assert grid.values[0][:6] == pytest.approx([1, 2, np.nan, np.nan, 3, 4], nan_ok=True)
    first, length = free_stretches(grid, by_label=False)
    assert length.tolist() == [6, 2]
    assert grid.values[0][first].tolist() == [1.0, 5.0]
    bridged = recorded_grid(errors, 100.0, 1)
    assert free_stretches(bridged, by_label=False)[1].tolist() == [72]
    none = recorded_grid(errors, 0.0, 1)
    assert free_stretches(none, by_label=False)[1].tolist() == [2, 2, 2]


def test_the_longest_outage_is_the_time_without_epochs() -> None:
    errors = record(np.arange(5.0), seconds=[0, 1, 2, 6, 7])
    assert len(free_stretches(recorded_grid(errors, 3.0, 1), by_label=False)[0]) == 1
    assert len(free_stretches(recorded_grid(errors, 2.9, 1), by_label=False)[0]) == 2


def test_epochs_that_tell_nothing_interrupt() -> None:
    unknown = np.array([False, False, True, False, False, False])
    errors = record([1.0, 2.0, np.nan, 4.0, np.nan, 6.0], unknown=unknown)
    grid = recorded_grid(errors, 60.0, 1)
    assert free_stretches(grid, by_label=False)[1].tolist() == [2, 3]
    # A gap behind such an epoch is as doubtful as the epoch itself.
    late = replace(errors, time=errors.time + np.array([0, 0, 0, 3, 3, 3], "m8[s]"))
    assert free_stretches(recorded_grid(late, 60.0, 1), by_label=False)[1].tolist() == [2, 3]


def test_a_fix_without_a_direction_is_no_outage() -> None:
    errors = record([1.0, 2.0, 3.0, 4.0])
    along = errors.along_m.copy()
    along[1] = np.nan
    grid = recorded_grid(replace(errors, along_m=along), 60.0, 1)
    assert free_stretches(grid, by_label=False)[1].tolist() == [1, 2]
    up = errors.up_m.copy()
    up[2] = np.nan
    flat = replace(errors, up_m=up)
    assert free_stretches(recorded_grid(flat, 60.0, 1), by_label=False)[1].tolist() == [4]
    assert free_stretches(recorded_grid(flat, 60.0, 3), by_label=False)[1].tolist() == [2, 1]


def test_labels_and_records_end_stretches() -> None:
    one = record(np.arange(4.0), labels=["open", "open", "town", "town"])
    two = record(np.arange(4.0, 7.0), labels=["town", "town", None])
    grid = recorded_grid([one, two], 60.0, 1)
    assert grid.labels == ("open", "town")
    assert free_stretches(grid, by_label=False)[1].tolist() == [4, 3]
    assert free_stretches(grid, by_label=True)[1].tolist() == [2, 2, 2, 1]
    assert longest_stretch(grid, None) == 4
    assert longest_stretch(grid, "town") == 2
    starts = window_starts(grid, 2, by_label=True)
    assert grid.values[0][starts].tolist() == [0.0, 2.0, 4.0]
    with pytest.raises(InputError, match="no environment 'wood'") as caught:
        grid.code_of("wood")
    assert "open, town" in caught.value.cure


def test_a_receivers_clock_does_not_lose_cells() -> None:
    errors = record(np.arange(2000.0), seconds=np.arange(2000) * 1.0004 + 0.2)
    grid = recorded_grid(errors, 60.0, 1)
    assert longest_stretch(grid, None) == 2000


def test_epochs_of_a_simulation_in_cells() -> None:
    assert epoch_cells(1.0, 1.0, 4.0).tolist() == [0, 1, 2, 3]
    assert epoch_cells(1.0, 2.0, 8.0).tolist() == [0, 2, 4, 6]
    assert epoch_cells(1.0, 0.5, 3.0).tolist() == [-1, 0, -1, 1, -1, 2]
    assert epoch_cells(1.0004, 1.0, 3.0).tolist() == [0, 1, 2]
    assert epoch_cells(0.2, 1.0, 2.0).tolist() == [0, 5]


@pytest.mark.parametrize(
    ("interval", "step", "duration"),
    [(1.0, 0.3, 3.0), (1.0, 1.5, 3.0), (5.0, 1.0, 3.0), (0.7, 1.0, 4.0)],
)
def test_steps_that_do_not_fit_are_refused(interval: float, step: float, duration: float) -> None:
    with pytest.raises(InputError, match="do not fit"):
        epoch_cells(interval, step, duration)


@pytest.mark.parametrize(("step", "duration"), [(0.0, 3.0), (1.0, 2.5), (-1.0, 2.0), (2.0, 1.0)])
def test_a_run_is_a_whole_number_of_steps(step: float, duration: float) -> None:
    with pytest.raises(InputError, match="whole number"):
        epoch_cells(1.0, step, duration)


def test_records_that_do_not_go_together_are_refused() -> None:
    one = record(np.arange(4.0))
    with pytest.raises(InputError, match="interval or alert limit"):
        recorded_grid([one, record(np.arange(4.0), limit_m=9.0)], 60.0, 1)
    with pytest.raises(InputError, match="interval or alert limit"):
        recorded_grid([one, record(np.arange(4.0), seconds=[0, 2, 4, 6])], 60.0, 1)
    with pytest.raises(InputError, match="no recording"):
        recorded_grid([], 60.0, 1)
    with pytest.raises(InputError, match="1 axis or 3"):
        recorded_grid(one, 60.0, 2)
    with pytest.raises(InputError, match="longest outage"):
        recorded_grid(one, -1.0, 1)
