"""The GNSS sensor of a recording: signs, states, declarations, and one definition of wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sbas
from sbas.exceptions import InputError
from sbas.fusion.architecture.model import Thresholds
from sbas.fusion.recorded.recorded_errors import RecordedErrors, along_track_errors
from sbas.fusion.states import DA, NO_DATA, N, U
from sbas.laboratory.settings import LaboratorySettings
from sbas.recording import MODES, Flag, Recording, mode_categories
from tests.dependability.state_recordings import BEGIN, TRUTH, state_recording
from tests.positioning.test_protected_recording import files

LIMIT = Thresholds(1.0, 2.5)


def recording(
    east_m: Any, north_m: Any, *, seconds: Any = None, hpl_m: Any = None, **columns: Any
) -> Recording:
    """Positions so far from TRUTH; NaN is no position."""
    east, north = np.broadcast_arrays(np.asarray(east_m, float), np.asarray(north_m, float))
    at = np.arange(east.size) if seconds is None else np.asarray(seconds)
    lat, lon, height = pymap3d.enu2geodetic(
        east, north, np.zeros(east.size), TRUTH.lat_deg, TRUTH.lon_deg, TRUTH.height_m
    )
    table: dict[str, Any] = {"lat_deg": lat, "lon_deg": lon, "height_m": height}
    if hpl_m is not None:
        table["hpl_m"] = np.broadcast_to(np.asarray(hpl_m, float), east.shape).copy()
    time = BEGIN + np.round(np.asarray(at, float) * 1e9).astype("m8[ns]")
    index = pd.DatetimeIndex(time, name="time")
    return Recording(pd.DataFrame({**table, **columns}, index=index))


def found(source: Recording, **options: Any) -> RecordedErrors:
    given_options: dict[str, Any] = {"truth": TRUTH, "azimuth_deg": 90.0, "thresholds": LIMIT}
    return along_track_errors(source, **{**given_options, **options})


def test_the_check_value_of_the_page() -> None:
    # dE, dN = 3, 4 with the track towards the east: along 3, across -4, HPE 5 (page, section 11).
    errors = found(recording([3.0, 0.3], [4.0, 0.4]))
    assert errors.along_m == pytest.approx([3.0, 0.3], abs=1e-6)
    assert errors.across_m == pytest.approx([-4.0, -0.4], abs=1e-6)
    assert errors.hpe_m == pytest.approx([5.0, 0.5], abs=1e-6)
    north = found(recording([3.0, 0.3], [4.0, 0.4]), azimuth_deg=0.0)
    assert north.along_m == pytest.approx([4.0, 0.4], abs=1e-6)
    assert north.across_m == pytest.approx([3.0, 0.3], abs=1e-6)


def test_the_sign_is_that_of_the_direction_of_travel() -> None:
    ahead = found(recording([1.0, 1.0], [0.5, 0.5]), azimuth_deg=30.0)
    back = found(recording([1.0, 1.0], [0.5, 0.5]), azimuth_deg=210.0)
    assert ahead.along_m == pytest.approx(-back.along_m)
    assert ahead.across_m == pytest.approx(-back.across_m)
    assert np.all(np.abs(ahead.along_m) <= ahead.hpe_m)


def test_the_table_of_states_and_declarations() -> None:
    #        N usable, DA usable, U usable, N barred, DA barred, U barred, MI, U without level
    north = [0.5, 1.5, 3.0, 0.5, 1.5, 3.0, 1.5, 3.0]
    level = [2.0, 2.0, 2.0, 2.5, 9.0, 9.0, 1.2, np.nan]
    errors = found(recording(0.0, north, hpl_m=level))
    c = errors.counts
    assert errors.state.tolist() == [N, DA, U, N, DA, U, DA, U]
    assert errors.declared_usable.tolist() == [True, True, True, False, False, False, True, False]
    assert (c.safe, c.available, c.hazard) == (1, 2, 1)
    assert (c.false_alarm_n, c.false_alarm_da, c.detected) == (1, 1, 1)
    assert (c.misleading, c.no_level_n, c.no_level_da, c.no_level_u) == (1, 0, 0, 1)
    assert (c.judged, c.acceptable, c.unacceptable) == (8, 5, 3)
    assert c.summary().to_numpy().tolist() == [[1, 1, 0], [2, 1, 0], [1, 1, 1]]
    assert json.loads(json.dumps(errors.to_dict()))["counts"]["hazard"] == 1


def test_ties_go_to_the_unsafe_side() -> None:
    errors = found(recording(0.0, [3.0, 3.0]))
    hpe = float(errors.hpe_m[0])
    at = found(recording(0.0, [3.0, 3.0], hpl_m=hpe), thresholds=Thresholds(1.0, hpe))
    assert at.state.tolist() == [U, U]
    assert at.counts.detected == 2, "a level that equals the alert limit does not declare usable"
    nominal = found(recording(0.0, [3.0, 3.0], hpl_m=hpe), thresholds=Thresholds(hpe, 9.0))
    assert nominal.state.tolist() == [DA, DA]
    assert nominal.counts.misleading == 2, "an error that equals its level is not bounded by it"
    above = found(recording(0.0, [3.0, 3.0]), thresholds=Thresholds(1.0, np.nextafter(hpe, 9)))
    assert above.state.tolist() == [DA, DA]


def test_judged_by_the_error_along_the_track() -> None:
    source = recording([0.5, 3.0], [3.0, 0.0], hpl_m=2.0)
    assert found(source).counts.hazard == 2
    along = found(source, judged_by="along")
    assert along.state.tolist() == [N, U]
    assert along.counts.hazard == 1


def test_levels_outside_the_service_declare_nothing() -> None:
    flags = np.array([0, Flag.PL_DECLARED_INVALID, Flag.PL_OUTSIDE_SBAS], np.uint32)
    errors = found(recording(0.0, [3.0, 3.0, 3.0], hpl_m=2.0, flags=flags))
    assert (errors.counts.hazard, errors.counts.no_level_u) == (1, 2)
    assert np.isnan(errors.hpl_m[1:]).all()


def test_gaps_are_neither_bridged_nor_filled() -> None:
    errors = found(recording(0.0, [0.1, 0.2, 0.3, 0.4, 0.5], seconds=[0, 1, 2, 30, 31]))
    assert errors.time.size == 5
    assert errors.follows.tolist() == [False, True, True, False, True]
    silent = found(recording(0.0, [0.1, np.nan, 0.3]))
    assert silent.state.tolist() == [N, NO_DATA, N]
    assert silent.counts.no_data == 1
    assert not silent.unknown.any()


def test_what_raim_has_failed_is_no_data_and_counted() -> None:
    flags = np.array([0, Flag.RAIM_FAILED, Flag.RAIM_FAILED, 0], np.uint32)
    errors = found(recording(0.0, [0.1, 0.2, 9.0, 9.0], flags=flags))
    assert errors.state.tolist() == [N, NO_DATA, NO_DATA, U]
    assert (errors.counts.raim_failed, errors.counts.raim_failed_u) == (2, 1)
    assert any("RAIM found a fault" in f.message for f in errors.findings)


@pytest.mark.parametrize("hpl", [0.0, -1.0])
def test_a_level_of_nothing_is_refused(hpl: float) -> None:
    with pytest.raises(InputError, match="protects nothing") as caught:
        found(recording(0.0, [0.1, 0.2], hpl_m=[hpl, 9.0]))
    assert caught.value.code == "E13"


def test_without_truth_or_direction_there_is_no_sign() -> None:
    source = recording(0.0, [0.1, 0.2])
    own = sbas.FixedPoint(50.0, 15.0, 300.0, lower_bound=True)
    for truth in (None, own):
        with pytest.raises(InputError, match="no sign") as caught:
            found(source, truth=truth)
        assert "--truth" in caught.value.cure
    with pytest.raises(InputError, match="direction of travel") as caught:
        found(source, azimuth_deg=None)
    assert "--azimuth" in caught.value.cure
    with pytest.raises(InputError, match="two directions"):
        found(source, direction_above_mps=1.0)
    with pytest.raises(InputError, match="between -360 and 360"):
        found(source, azimuth_deg=np.nan)
    with pytest.raises(InputError, match="judge by"):
        found(source, judged_by="vertical")
    with pytest.raises(InputError, match="alert limit"):
        found(source, thresholds=Thresholds(3.0, 2.5))


def test_a_trajectory_tells_the_direction_where_it_moves() -> None:
    # Eastwards at 10 m/s for 20 s, after standing for 20 s; 1 m ahead and 2 m to the right.
    t = np.arange(40)
    path = np.maximum(t - 19, 0) * 10.0
    place = pymap3d.enu2geodetic(path, 0 * path, 0 * path, 50.0, 15.0, 300.0)
    names = ("lat_deg", "lon_deg", "height_m")
    index = pd.DatetimeIndex(BEGIN + t.astype("m8[s]").astype("m8[ns]"), name="time")
    truth = sbas.Trajectory(
        pd.DataFrame(dict(zip(names, place, strict=True)), index=index), frame="ITRF2014 2026.0"
    )
    source = recording(path + 1.0, -2.0)
    errors = along_track_errors(
        source, truth=truth, direction_above_mps=1.0, thresholds=Thresholds(1.0, 50.0)
    )
    moving = np.arange(21, 39)
    assert errors.along_m[moving] == pytest.approx(1.0, abs=1e-3)
    assert errors.across_m[moving] == pytest.approx(2.0, abs=1e-3)
    assert np.isnan(errors.along_m[:19]).all()
    assert (errors.state == DA).all(), "the horizontal error needs no direction"
    assert any("direction of travel is unknown" in f.message for f in errors.findings)
    along = along_track_errors(
        source, truth=truth, direction_above_mps=1.0, judged_by="along", thresholds=LIMIT
    )
    assert along.unknown[:19].all()
    assert along.counts.unknown == int(np.isnan(errors.along_m).sum())


# --- one definition with sbas.receiver_states -------------------------------------------------


def assert_same_states(source: Recording, errors: RecordedErrors, truth: Any) -> None:
    limit = errors.thresholds.alert_limit_m
    states = sbas.receiver_states(source, truth=truth, threshold_m=limit)
    c = errors.counts
    assert states.epochs["wrong"] == c.hazard + c.detected + c.no_level_u
    assert states.epochs["wrong"] == int(np.sum(errors.state == U))
    assert (
        states.epochs["correct"]
        == c.acceptable
        == int(np.sum(errors.state < U)) - int(np.sum(errors.state == NO_DATA))
    )
    assert states.epochs["missing"] == c.no_data
    silent = ("hardware", "first_fix_wait", "unknown")
    assert sum(states.epochs[name] for name in silent) == c.unknown
    code = np.where(errors.state == U, 1, np.where(errors.state == NO_DATA, 2, 0))
    pairs = np.zeros((3, 3), int)
    # Labels cut the chain of `receiver_states`; these recordings have none.
    np.add.at(pairs, (code[:-1][errors.follows[1:]], code[1:][errors.follows[1:]]), 1)
    assert np.array_equal(pairs, states.chain.counts)


@given(
    st.lists(st.integers(1, 6), min_size=2, max_size=60),
    st.lists(st.booleans(), min_size=60, max_size=60),
    st.lists(st.booleans(), min_size=60, max_size=60),
    st.lists(st.sampled_from([np.nan, 10.0, 50.0, 200.0]), min_size=60, max_size=60),
)
def test_wrong_is_unacceptable_in_any_recording(
    states: list[int], gaps: list[bool], failed: list[bool], levels: list[float]
) -> None:
    n = len(states)
    seconds = np.arange(n) + 5 * np.cumsum([g and i % 3 == 2 for i, g in enumerate(gaps[:n])])
    source = state_recording(states, seconds=seconds, hpl_m=np.array(levels[:n]))
    flags = source.table["flags"].to_numpy() | np.where(
        failed[:n], np.uint32(Flag.RAIM_FAILED), np.uint32(0)
    )
    source = source.replace(table=source.table.assign(flags=flags.astype(np.uint32)))
    options: dict[str, Any] = {"thresholds": Thresholds(10.0, 50.0)}
    if not any(s in (1, 2) and not f for s, f in zip(states, failed, strict=False)):
        with pytest.raises(InputError, match="no epoch has a known error"):
            found(source, **options)
        return
    errors = found(source, **options)
    assert_same_states(source, errors, TRUTH)


def test_wrong_is_unacceptable_where_the_truth_does_not_reach() -> None:
    t = np.arange(30)
    index = pd.DatetimeIndex(BEGIN + t[:20].astype("m8[s]").astype("m8[ns]"), name="time")
    place = {"lat_deg": TRUTH.lat_deg, "lon_deg": TRUTH.lon_deg, "height_m": TRUTH.height_m}
    truth = sbas.Trajectory(pd.DataFrame(place, index=index), frame="ITRF2014 2026.0")
    north = np.where(t % 7 == 3, 5.0, 0.4)
    modes = mode_categories(np.where(t % 11 == 5, MODES.index("none"), MODES.index("sbas_npa")))
    source = recording(0.0, north, hpl_m=2.0, mode=modes)
    errors = found(source, truth=truth)
    assert errors.unknown.sum() == sum(1 for i in range(20, 30) if i % 11 != 5)
    assert_same_states(source, errors, truth)


def test_a_laboratory_recording_agrees_and_its_injected_failures_are_the_hazard() -> None:
    settings = LaboratorySettings(
        hours=1.0, failure_rate_per_h=6.0, failure_duration_s=(10.0, 10.0),
        failure_error_m=(30.0, 30.0), gaps_per_day=60.0, gap_duration_s=(2.0, 40.0),
        sbas_frames=False, seed=3,
    )  # fmt: skip
    source = sbas.simulate(settings)
    truth = sbas.FixedPoint(
        settings.lat_deg, settings.lon_deg, settings.height_m, frame="ITRF2014 2009.7"
    )
    errors = found(source, truth=truth, azimuth_deg=40.0, thresholds=Thresholds(5.0, 25.0))
    assert_same_states(source, errors, truth)
    injected = source.side_tables["injected"]
    failures = injected[injected["kind"] == "failure"]
    inside = np.zeros(len(source), bool)
    for start, length in zip(failures["time"], failures["duration_s"], strict=True):
        since = (source.time - np.datetime64(start)) / np.timedelta64(1, "s")
        inside |= (since >= 0) & (since < length)
    assert 0 < errors.counts.hazard <= int(inside.sum())
    assert not np.any((errors.state == U) & ~inside)


# --- real recordings --------------------------------------------------------------------------


def test_a_real_static_recording(reference_data: Path) -> None:
    source = sbas.read(reference_data / "data/egnos_debrecen_2016194/debr194m.pos")
    place = source.table[["lat_deg", "lon_deg", "height_m"]].median()
    lat, lon, height = place.tolist()
    truth = sbas.FixedPoint(lat, lon, height, frame="ITRF2008 2016.5")
    errors = found(source, truth=truth, thresholds=Thresholds(0.5, 8.0))
    assert errors.counts.judged == len(source) == 3467
    assert_same_states(source, errors, truth)
    assert np.hypot(errors.along_m, errors.across_m) == pytest.approx(errors.hpe_m)
    # PROVENANCE.md: the median level is 7.86 m; most epochs are declared usable at 8 m.
    assert 0.5 < errors.declared_usable.mean() < 0.7
    assert np.array_equal(errors.declared_usable, source.table["hpl_m"].to_numpy() < 8.0)


def test_a_real_vehicle(reference_data: Path) -> None:
    source = sbas.protect(**files(reference_data, "vehicle"), mode="auto")
    # No independent truth exists: the vehicle's own smoothed path stands in for the code's sake.
    names = ["lat_deg", "lon_deg", "height_m"]
    fixed = source.table[source.table["mode"] != "none"][names]
    path = fixed.rolling(9, center=True).mean().dropna()
    truth = sbas.Trajectory(path, frame="ITRF2005 2008.4")
    errors = along_track_errors(
        source, truth=truth, direction_above_mps=1.0, thresholds=Thresholds(0.5, 1.5)
    )
    assert_same_states(source, errors, truth)
    known = np.isfinite(errors.along_m)
    # It stands until about 06:05:10 and moves 844 m afterwards (PROVENANCE.md).
    moving = source.time > np.datetime64("2008-05-26T06:05:15")
    assert known[moving].mean() > 0.9
    assert known[~moving].mean() < 0.1
    assert np.hypot(errors.along_m, errors.across_m)[known] == pytest.approx(errors.hpe_m[known])
    assert errors.counts.no_data == 2
