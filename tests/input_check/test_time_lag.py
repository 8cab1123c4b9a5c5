"""The lag of a moving recording, against its closed form, and where it cannot be seen."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sbas.input_check import repair
from sbas.input_check.against_truth import Comparison
from sbas.input_check.sampled_epochs import SampledEpochs
from sbas.input_check.time_lag import Lag, best_lag
from sbas.recording import Recording
from sbas.recording_survey import epoch_rows
from sbas.truth import Trajectory
from tests.input_check.journeys import START, checked, journey, moved, said, standing


def lag_of(recording: Recording, truth: Trajectory) -> Lag | None:
    sample = SampledEpochs()
    for part in epoch_rows(recording, sample.COLUMNS):
        sample.update(part)
    return best_lag(Comparison.of(sample, truth))


@pytest.mark.parametrize("lag", [-40, -18, -1, 1, 2, 13, 17, 18, 40])
def test_each_lag_is_found_to_a_tenth_of_a_second(lag: int) -> None:
    train, track = journey(900, seed=4)
    found = lag_of(moved(train, -lag), track)
    assert found is not None
    assert found.lag_s == pytest.approx(lag, abs=0.11)
    assert found.block_range_s[0] >= lag - 1
    assert found.block_range_s[1] <= lag + 1


def test_the_distance_at_no_lag_is_speed_times_lag() -> None:
    """Along a meridian at a constant 20 m/s, 18 s are 360 m."""
    seconds = np.arange(0, 900.0)
    radius_m = 6_371_000.0
    lat = 50 + np.degrees(20 * seconds / radius_m)
    index = pd.DatetimeIndex(START + (seconds * 1e9).astype("m8[ns]"), name="time")
    table = pd.DataFrame({"lat_deg": lat, "lon_deg": 15.0, "height_m": 300.0}, index=index)
    found = lag_of(moved(Recording(table), -18), Trajectory(table))
    assert found is not None
    # The meridian's radius of curvature at 50 degrees is 6373 km, 0.04 % from the sphere's.
    assert found.at_zero_m == pytest.approx(360, rel=1e-3)
    assert found.at_best_m == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("shift_s", [3600, -10_782, 86_400, -604_800 + 18])
def test_time_zones_and_wrong_days_are_found(shift_s: int) -> None:
    train, track = journey(900)
    found = lag_of(moved(train, -shift_s), track)
    assert found is not None
    assert found.lag_s == pytest.approx(shift_s, abs=0.11)
    assert np.isnan(found.at_zero_m)


def test_failures_of_the_receiver_hide_no_lag_and_make_none() -> None:
    train, track = journey(900)
    lat = train.table["lat_deg"].to_numpy().copy()
    lat[100:200] += 0.01
    failing = train.replace(table=train.table.assign(lat_deg=lat))
    assert said(checked(failing, track)) == []
    assert ("E02", "error") in said(checked(moved(failing, -1), track))


def test_where_nothing_moves_the_check_says_so() -> None:
    roof = standing(900)
    index = pd.DatetimeIndex(roof.time[::10], name="time")
    place = pd.DataFrame({"lat_deg": 50.03, "lon_deg": 15.77, "height_m": 289.4}, index=index)
    (found,) = checked(roof, Trajectory(place, max_step_s=10, frame="x")).findings
    assert (found.code, found.severity) == ("E02", "info")
    assert "cannot be seen" in found.message


@pytest.mark.parametrize(
    ("lag", "words"), [(18, "--time UTC"), (-18, "truth's times seem to be UTC"),
                       (14, "--time BDT"), (-10_782, "--time GLONASST"), (1, "--shift-s 1")]
)  # fmt: skip
def test_the_cure_names_the_scale_that_the_lag_tells(lag: int, words: str) -> None:
    train, track = journey(900)
    found = [f for f in checked(moved(train, -lag), track).findings if f.code == "E02"]
    assert words in found[0].cure


def test_another_train_is_no_lag() -> None:
    train, _ = journey(900)
    _, track = journey(900)
    table = track.table.assign(lat_deg=track.table["lat_deg"] + 0.02)
    assert not [f for f in checked(train, Trajectory(table, frame="x")).findings
                if f.code == "E02" and f.severity == "error"]  # fmt: skip


@pytest.mark.parametrize("late_s", [0.9, 0.4, -0.6])
def test_a_part_of_a_second_that_makes_events_is_an_error_with_a_cure_that_works(
    late_s: float,
) -> None:
    train, track = journey(900)
    late = moved(train, late_s)
    (found,) = [f for f in checked(late, track).findings if f.code == "E02"]
    assert found.severity == "error"
    option, value = found.cure.split(",")[0].split()
    assert option == "--shift-s"
    assert float(value) == pytest.approx(-late_s, abs=0.11)
    assert said(checked(repair(late, shift_s=float(value)), track)) == [("E26", "info")]


def test_a_part_of_a_second_that_noise_outweighs_is_a_warning() -> None:
    """6 m/s for 0.8 s are 4.8 m: below three distances of 2 m and a tenth of 60 m."""
    seconds = np.arange(0, 1500.0)
    north = 6.0 * seconds
    index = pd.DatetimeIndex(START + (seconds * 1e9).astype("m8[ns]"), name="time")
    table = pd.DataFrame({"lat_deg": 50 + north / 111_229, "lon_deg": 15.0, "height_m": 300.0},
                         index=index)  # fmt: skip
    aside = np.where(np.arange(1500) % 4 < 2, 2.0, -2.0) / 71_700
    walker = Recording(table.assign(lon_deg=15 + aside, hpl_m=60.0 + np.sin(seconds)))
    found = [f for f in checked(moved(walker, 0.8), Trajectory(table, frame="x")).findings
             if f.code == "E02"]  # fmt: skip
    assert [f.severity for f in found] == ["warning"]
    assert "--shift-s -0.8" in found[0].cure
