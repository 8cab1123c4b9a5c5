"""Errors on a regular grid: constants and scales aside, those of position_errors."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sbas.estimate import Refusal
from sbas.integrity.correlation import error_grid as module
from sbas.integrity.correlation.error_grid import ErrorGrid, error_grid, room
from sbas.integrity.position_error import position_errors
from sbas.recording import Recording
from sbas.recording_survey import survey
from sbas.truth import FixedPoint, Trajectory
from tests.examples import POINT, recording


def gridded(source: Recording, truth: object = None, **options: bool) -> ErrorGrid:
    grid, _ = error_grid(source, survey(source), truth, **options)  # type: ignore[arg-type]
    assert isinstance(grid, ErrorGrid)
    return grid


def example(n: int = 500, **columns: np.ndarray) -> Recording:
    rng = np.random.default_rng(8)
    east, north = rng.normal(0, 2, (2, n))
    return recording(east, north, np.full(n, 11.0), **columns)


def test_offsets_are_the_errors_less_a_constant() -> None:
    source = example()
    errors = position_errors(source, POINT)
    grid = gridded(source)
    for row, name in zip(grid.values, ("east_m", "north_m"), strict=True):
        difference = row - errors[name].to_numpy()
        assert np.ptp(difference) < 1e-3
    assert grid.step_s == 1.0


def test_across_the_date_line_offsets_stay_small() -> None:
    point = FixedPoint(10.0, 180.0, 0.0)
    source = example()
    lon = source.table["lon_deg"] - POINT.lon_deg + point.lon_deg
    wrapped = source.replace(table=source.table.assign(lon_deg=(lon + 180) % 360 - 180))
    grid = gridded(wrapped, point)
    assert np.nanmax(np.abs(np.diff(grid.values[0]))) < 20


def test_gaps_and_missing_positions_are_nan_in_both() -> None:
    table = example().table
    table = table.drop(table.index[100:150])
    table.iloc[200, table.columns.get_loc("lat_deg")] = np.nan
    grid = gridded(Recording(table))
    missing = np.isnan(grid.values)
    np.testing.assert_array_equal(missing[0], missing[1])
    np.testing.assert_array_equal(np.flatnonzero(missing[0]), [*range(100, 150), 250])


def test_a_trajectory_gives_errors_along_the_way() -> None:
    source = example()
    drift = np.linspace(0, 0.01, len(source))
    moving = source.replace(table=source.table.assign(lat_deg=source.table["lat_deg"] + drift))
    knots = source.table.index
    true = pd.DataFrame(
        {"lat_deg": POINT.lat_deg + drift, "lon_deg": POINT.lon_deg, "height_m": POINT.height_m},
        index=knots,
    )
    along, still = gridded(moving, Trajectory(true)), gridded(source)
    for a, b in zip(along.values, still.values, strict=True):
        assert np.ptp(a - b) < 0.01  # the plane turns with the way, heights stay


def test_epochs_off_the_grid_are_moved_and_counted() -> None:
    source = example()
    jitter = np.zeros(500)
    jitter[[10, 20]] = 0.4
    jitter[30] = 0.6  # lands on the cell of the next epoch
    index = source.table.index + pd.to_timedelta(jitter, unit="s")
    moved = source.replace(table=source.table.set_index(index.rename("time")))
    grid, findings = error_grid(moved, survey(moved), None)
    assert isinstance(grid, ErrorGrid)
    assert [f.code for f in findings] == ["E26"]
    assert findings[0].message.startswith("3 epochs")
    assert "; 1 took the place" in findings[0].message
    assert np.flatnonzero(np.isnan(grid.values[0])).tolist() == [30]


def test_environment_labels_follow_their_epochs() -> None:
    labels = pd.Categorical(["open"] * 200 + [None] * 100 + ["cutting"] * 200)
    grid = gridded(example(environment=labels), labelled=True)
    assert grid.labels is not None
    assert grid.names == ("cutting", "open") or grid.names == ("open", "cutting")
    names = np.array([*grid.names, ""])
    assert (names[grid.labels] == ["open"] * 200 + [""] * 100 + ["cutting"] * 200).all()


def test_a_span_that_no_memory_holds_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_CELLS", 400)
    source = example()
    grid, _ = error_grid(source, survey(source), None)
    assert isinstance(grid, Refusal)


def test_large_arrays_lie_in_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    assert type(room((2, 10))) is np.ndarray
    monkeypatch.setattr(module, "IN_MEMORY_BYTES", 8)
    array = room((2, 10))
    assert isinstance(array, np.memmap)
    array[:] = 3.0
    assert array.sum() == 60
