from __future__ import annotations

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.recorded_ranges import recorded_ranges
from sbas.monitoring.verdicts import MonitorReason
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE
from tests.monitoring.recordings import noisy


def edited(recording: Recording, row: int, **values: object) -> Recording:
    side = recording.side_tables[SIDE_TABLE].copy()
    for name, value in values.items():
        side.loc[row, name] = value
    return recording.replace(side_tables={SIDE_TABLE: side})


def test_slots_hold_the_ranges_of_the_table() -> None:
    recording = noisy(1, 6, 4)
    side = recording.side_tables[SIDE_TABLE]
    shuffled = side.sample(frac=1, random_state=3).reset_index(drop=True)
    found = recorded_ranges(recording.replace(side_tables={SIDE_TABLE: shuffled}))
    assert found.used.all()
    assert (found.reason == 0).all()
    for epoch, time in enumerate(recording.time):
        for slot in range(6):
            name = found.names[found.satellite[slot, epoch]]
            row = side[(side["time"] == time) & (side["satellite"] == name)].iloc[0]
            assert found.residual_m[slot, epoch] == row["residual_m"]
            assert found.elevation_deg[slot, epoch] == row["elevation_deg"]


@pytest.mark.parametrize("name", ["elevation_deg", "azimuth_deg", "sigma_m", "residual_m"])
def test_an_epoch_with_a_used_range_that_lacks_something_is_incomplete(name: str) -> None:
    found = recorded_ranges(edited(noisy(1, 6, 4), 2, **{name: np.nan}))
    assert found.reason.tolist() == [0, 0, MonitorReason.INCOMPLETE, 0]


def test_a_range_that_was_not_used_may_lack_anything() -> None:
    found = recorded_ranges(edited(noisy(1, 6, 4), 2, sigma_m=np.nan, used=False))
    assert (found.reason == 0).all()
    assert found.used.sum(axis=0).tolist() == [6, 6, 5, 6]


def test_a_satellite_twice_and_an_epoch_twice_are_not_judged() -> None:
    recording = noisy(1, 6, 4)
    assert recorded_ranges(edited(recording, 0, satellite="G02")).reason.tolist() == [
        MonitorReason.TWICE, 0, 0, 0,
    ]  # fmt: skip
    index = recording.table.index[[0, 1, 1, 3]]
    twice = recording.replace(table=recording.table.set_axis(index))
    found = recorded_ranges(twice)
    assert found.reason.tolist() == [
        0, MonitorReason.TIME_TWICE, MonitorReason.TIME_TWICE, 0,
    ]  # fmt: skip
    assert [f.code for f in found.findings] == ["E25"]


def test_epochs_without_satellites_say_so() -> None:
    recording = noisy(1, 6, 4)
    side = recording.side_tables[SIDE_TABLE]
    few = side[side["time"] != recording.time[2]]
    found = recorded_ranges(recording.replace(side_tables={SIDE_TABLE: few}))
    assert found.reason[2] == MonitorReason.NO_SATELLITES
    none = recorded_ranges(recording.replace(side_tables={SIDE_TABLE: side[:0]}))
    assert (none.reason == MonitorReason.NO_SATELLITES).all()


def test_sigma_can_be_a_model_of_the_elevation() -> None:
    found = recorded_ranges(noisy(1, 6, 1), sigma=(3.0, 4.0))
    sine = np.sin(np.deg2rad(found.elevation_deg))
    assert found.sigma_m == pytest.approx(np.sqrt(9 + 16 / sine**2), rel=1e-12)
    assert (recorded_ranges(noisy(1, 6, 1), sigma=2.5).sigma_m == 2.5).all()


def test_a_mask_leaves_ranges_out_of_fix_and_test() -> None:
    recording = noisy(2, 8, 3)
    elevation = recorded_ranges(recording).elevation_deg[:, 0]
    limit = float(np.median(elevation))
    found = recorded_ranges(recording, elevation_mask_deg=limit)
    assert found.masked == 3 * int((elevation < limit).sum())
    assert (found.elevation_deg[found.used] >= limit).all()


def test_sbas_satellites_keep_gps_time_and_others_their_own() -> None:
    names = ["G01", "G02", "S36", "E01", "E02", "G03"]
    found = recorded_ranges(noisy(1, 6, 2, names=names))
    clock = {
        found.names[s]: int(c)
        for s, c in zip(found.satellite[:, 0], found.clock[:, 0], strict=True)
    }
    assert clock["G01"] == clock["S36"] == clock["G03"]
    assert clock["E01"] == clock["E02"] != clock["G01"]


def test_what_cannot_be_right_is_refused() -> None:
    recording = noisy(1, 8, 6)
    side = recording.side_tables[SIDE_TABLE]
    radians = side.assign(
        elevation_deg=np.deg2rad(side["elevation_deg"]), azimuth_deg=np.deg2rad(side["azimuth_deg"])
    )
    with pytest.raises(InputError, match="radians"):
        recorded_ranges(recording.replace(side_tables={SIDE_TABLE: radians}))
    with pytest.raises(InputError, match="90 degrees"):
        recorded_ranges(edited(recording, 1, elevation_deg=97.0))
    with pytest.raises(InputError, match="constellation"):
        recorded_ranges(noisy(1, 6, 2, names=["X01", *(f"G{i:02d}" for i in range(1, 6))]))
    with pytest.raises(InputError, match="which satellites"):
        recorded_ranges(recording.replace(side_tables={}))
    with pytest.raises(InputError, match="sigma"):
        recorded_ranges(recording, sigma=0.0)


def test_variances_for_sigmas_are_noticed() -> None:
    found = recorded_ranges(noisy(1, 6, 2), sigma=400.0)
    assert [f.code for f in found.findings] == ["E08"]
