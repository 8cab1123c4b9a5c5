from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
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


def with_column(recording: Recording, name: str, values: object) -> Recording:
    side = recording.side_tables[SIDE_TABLE].copy()
    side[name] = values
    return recording.replace(side_tables={SIDE_TABLE: side})


@pytest.mark.parametrize(
    ("values", "text"),
    [
        (np.nan, "float64"),
        (1, "int64"),
        ("True", "booleans"),
        (pd.array([True, pd.NA] * 12, dtype="boolean"), "12 rows of 24"),
        (pd.Categorical([True, False] * 12), "category"),
    ],
    ids=["float", "int", "text", "unknown", "category"],
)
def test_used_is_a_boolean(values: object, text: str) -> None:
    with pytest.raises(InputError, match=text):
        recorded_ranges(with_column(noisy(1, 6, 4), "used", values))


def test_booleans_that_could_be_unknown_and_are_not_are_booleans() -> None:
    plain = noisy(1, 6, 4)
    nullable = with_column(plain, "used", pd.array([True, False] * 12, dtype="boolean"))
    assert recorded_ranges(nullable).used.sum() == 12


@pytest.mark.parametrize("name", ["elevation_deg", "azimuth_deg", "sigma_m", "residual_m"])
def test_values_are_numbers(name: str) -> None:
    with pytest.raises(InputError, match=name):
        recorded_ranges(with_column(noisy(1, 6, 4), name, "1.5"))
    missing = pd.array([pd.NA, *[40.0] * 23], dtype="Float64")
    found = recorded_ranges(with_column(noisy(1, 6, 4), name, missing))
    assert (found.reason == MonitorReason.INCOMPLETE).sum() == 1


def test_times_are_dates() -> None:
    with pytest.raises(InputError, match="dates"):
        recorded_ranges(with_column(noisy(1, 6, 4), "time", "2024-03-05"))


def test_no_epochs_with_satellites_are_no_ranges() -> None:
    recording = edited(noisy(1, 6, 4), 2, sigma_m=np.nan)
    found = recorded_ranges(recording.replace(table=recording.table[:0]))
    assert found.reason.size == 0
    assert "24 rows of 24" in found.findings[0].evidence


@pytest.mark.parametrize("wrong", [0.0, -1.0])
def test_a_sigma_of_0_or_less_is_refused_with_its_count(wrong: float) -> None:
    recording = edited(noisy(1, 6, 4), 2, sigma_m=wrong)
    with pytest.raises(InputError, match="1 of 24 ranges"):
        recorded_ranges(recording)
    assert recorded_ranges(recording, sigma=2.0).used.all()
    assert (recorded_ranges(edited(recording, 2, used=False)).reason == 0).all()


@pytest.mark.parametrize("mask", [np.nan, -20.0, 90.5, 500.0, "5", True])
def test_a_mask_is_an_elevation(mask: float) -> None:
    with pytest.raises(InputError, match="elevation mask"):
        recorded_ranges(noisy(1, 6, 4), elevation_mask_deg=mask)


@pytest.mark.parametrize(
    "sigma", [[1, 2], "a", (1.0, 2.0, 3.0), (1.0,), np.nan, -1.0, True, (1, "a")], ids=str
)
def test_a_sigma_is_one_number_or_two(sigma: Any) -> None:
    with pytest.raises(InputError, match="sigma needs"):
        recorded_ranges(noisy(1, 6, 4), sigma=sigma)


def test_radians_are_refused_from_one_epoch_on() -> None:
    recording = noisy(1, 6, 1)
    radians = np.deg2rad(recording.side_tables[SIDE_TABLE]["elevation_deg"])
    with pytest.raises(InputError, match="radians"):
        recorded_ranges(with_column(recording, "elevation_deg", radians))


def test_cures_name_the_argument() -> None:
    with pytest.raises(InputError) as caught:
        recorded_ranges(noisy(1, 6, 1).replace(side_tables={}))
    assert "sigma=" in caught.value.cure
    assert "sigma=" in recorded_ranges(noisy(1, 6, 2), sigma=400.0).findings[0].cure


def test_variances_for_sigmas_are_noticed() -> None:
    found = recorded_ranges(noisy(1, 6, 2), sigma=400.0)
    assert [f.code for f in found.findings] == ["E08"]


@pytest.mark.parametrize("sigma_m", [1e-200, 1e200])
def test_a_sigma_without_a_weight_leaves_its_fix_incomplete(sigma_m: float) -> None:
    recording = noisy(3, 8, 5)
    side = recording.side_tables[SIDE_TABLE].copy()
    at = (side["satellite"] == "G03") & (side["time"] == recording.time[2])
    side.loc[at, "sigma_m"] = sigma_m
    found = recorded_ranges(recording.replace(side_tables={SIDE_TABLE: side}))
    assert (found.reason == MonitorReason.INCOMPLETE).tolist() == [False, False, True, False, False]
