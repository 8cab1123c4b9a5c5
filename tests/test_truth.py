"""Truth and signed errors against closed forms on the ellipsoid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.position_error import position_errors
from sbas.recording import RecordingMeta
from sbas.track import Track, TrackLine
from sbas.truth import FixedPoint, Trajectory, frame_findings, transformed

A, F = 6_378_137.0, 1 / 298.257223563
E2 = F * (2 - F)


def table(lat: list[float], lon: list[float], height: list[float]) -> pd.DataFrame:
    time = pd.date_range("2020-01-01", periods=len(lat), freq="1s", unit="ns", name="time")
    return pd.DataFrame({"lat_deg": lat, "lon_deg": lon, "height_m": height}, index=time)


def track(n: int, step_s: float = 1.0, speed: float = 40.0) -> pd.DataFrame:
    """A circle at the equator: closed form of where an eastbound vehicle is."""
    time_s = np.arange(n) * step_s
    index = pd.DatetimeIndex(
        np.datetime64("2020-01-01", "ns") + (time_s * 1e9).astype("m8[ns]"), name="time"
    )
    lon = np.degrees(speed * time_s / A)
    return pd.DataFrame({"lat_deg": 0.0, "lon_deg": lon, "height_m": 0.0}, index=index)


def test_a_step_north_is_the_meridian_radius_and_east_the_prime_vertical() -> None:
    lat, d = 50.03, 1e-6
    sin2 = np.sin(np.radians(lat)) ** 2
    meridian = A * (1 - E2) / (1 - E2 * sin2) ** 1.5
    parallel = A / np.sqrt(1 - E2 * sin2) * np.cos(np.radians(lat))
    truth = FixedPoint(lat, 15.77, 289.4)
    error = position_errors(
        table([lat + d, lat, lat], [15.77, 15.77 + d, 15.77], [289.4, 289.4, 291.4]), truth
    )
    # 1e-6 deg is 0.11 m; the tangent plane departs from the arc by less than 1e-8 of it.
    assert error["north_m"].iloc[0] == pytest.approx(np.radians(d) * (meridian + 289.4), rel=1e-6)
    assert error["east_m"].iloc[1] == pytest.approx(
        np.radians(d) * (parallel + 289.4 * np.cos(np.radians(lat))), rel=1e-6
    )
    assert error["up_m"].iloc[2] == pytest.approx(2.0, abs=1e-8)
    assert error["hpe_m"].iloc[2] == pytest.approx(0.0, abs=1e-8)


def test_the_antenna_stands_above_its_mark() -> None:
    truth = FixedPoint(50.0, 15.0, 200.0, antenna_height_m=1.5)
    error = position_errors(table([50.0], [15.0], [201.5]), truth)
    assert error["up_m"].iloc[0] == pytest.approx(0.0, abs=1e-8)


def test_a_missing_height_leaves_the_horizontal_error() -> None:
    error = position_errors(table([50.0, np.nan], [15.0, 15.0], [np.nan, 200.0]),
                            FixedPoint(50.0, 15.0, 200.0))  # fmt: skip
    assert error["hpe_m"].iloc[0] == pytest.approx(0.0, abs=1e-8)
    assert np.isnan(error["vpe_m"].iloc[0])
    assert np.isnan(error["hpe_m"].iloc[1])


def test_an_unstated_frame_allows_a_metre() -> None:
    at = np.array(["2020-01-01"], "M8[ns]")
    assert FixedPoint(50, 15, 200).at(at).sigma_h_m[0] == pytest.approx(np.hypot(0.02, 1.0))
    assert FixedPoint(50, 15, 200, frame="ITRF2014").at(at).sigma_h_m[0] == 0.02


def test_moving_truth_is_interpolated_to_the_closed_form() -> None:
    whole = track(200)
    late = whole.index + pd.Timedelta(milliseconds=370)
    truth = Trajectory(whole, frame="ITRF2014").at(late[:-1].to_numpy())
    lon = np.degrees(40.0 * (np.arange(199) + 0.37) / A)
    # The cubic's error on a circle of Earth radius is far below a micrometre.
    assert np.abs(np.radians(truth.lon_deg - lon) * A).max() < 1e-6
    assert np.abs(truth.height_m).max() < 1e-4


def test_no_truth_is_made_across_a_long_step_or_beyond_the_ends() -> None:
    known = track(30).drop(track(30).index[10:13])
    asked = pd.date_range("2019-12-31T23:59:58", periods=70, freq="500ms", unit="ns")
    truth = Trajectory(known).at(asked.to_numpy())
    have = asked[np.isfinite(truth.lat_deg)]
    assert have.min() == known.index[0]
    assert have.max() == known.index[-1]
    assert not ((have > known.index[9]) & (have < known.index[10])).any()
    assert np.isnan(truth.sigma_h_m[0])
    slow = Trajectory(track(30, step_s=2.0), max_step_s=1.0).at(track(30).index.to_numpy())
    assert np.isfinite(slow.lat_deg).sum() == 15


def test_at_its_own_points_the_truth_is_itself() -> None:
    known = track(7).assign(sigma_h_m=[1, 2, 3, 4, 5, 6, 7.0], sigma_v_m=0.5)
    truth = Trajectory(known, frame="x").at(known.index.to_numpy()[::-1])
    assert np.abs(truth.lon_deg[::-1] - known["lon_deg"]).max() < 1e-12
    assert truth.sigma_h_m[::-1] == pytest.approx([1, 2, 3, 4, 5, 6, 7], abs=1e-6)
    between = known.index.to_numpy()[:1] + np.timedelta64(500, "ms")
    assert Trajectory(known, frame="x").at(between).sigma_h_m[0] == pytest.approx(2, abs=1e-6)


@given(st.lists(st.floats(0.1, 3.0), min_size=2, max_size=40), st.randoms())
def test_the_order_of_epochs_does_not_matter(steps: list[float], random: object) -> None:
    seconds = np.cumsum(steps)
    base = track(len(seconds))
    base.index = pd.DatetimeIndex(
        np.datetime64("2020-01-01", "ns") + (seconds * 1e9).astype("m8[ns]"), name="time"
    )
    truth = Trajectory(base)
    asked = np.datetime64("2020-01-01", "ns") + (
        np.linspace(seconds[0] - 1, seconds[-1] + 1, 50) * 1e9
    ).astype("m8[ns]")
    forward, backward = truth.at(asked), truth.at(asked[::-1])
    np.testing.assert_array_equal(forward.lon_deg, backward.lon_deg[::-1])


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: FixedPoint(91, 0, 0),
        lambda: FixedPoint(0, 0, 1e6),
        lambda: FixedPoint(float("nan"), 0, 0),
        lambda: FixedPoint(0, 0, 0, sigma_h_m=-1),
        lambda: Trajectory(track(5).drop(columns="height_m")),
        lambda: Trajectory(track(5).iloc[::-1]),
        lambda: Trajectory(track(1)),
        lambda: Trajectory(track(5), max_step_s=0),
    ],
)
def test_impossible_truths_are_refused(wrong: object) -> None:
    with pytest.raises(InputError):
        wrong()  # type: ignore[operator]


def test_noise_on_points_close_together_makes_no_overshoot() -> None:
    even = track(40, speed=20.0)
    extra = even.iloc[[20]].copy()
    extra.index = extra.index + pd.Timedelta(microseconds=100)
    extra["lat_deg"] += 0.03 / 111_000
    knots = pd.concat([even, extra]).sort_index()
    asked = even.index[:-1] + pd.Timedelta(milliseconds=500)
    truth = Trajectory(knots, frame="x").at(asked.to_numpy())
    lon = np.degrees(20.0 * (np.arange(39) + 0.5) / A)
    away = np.hypot(np.radians(truth.lon_deg - lon) * A, np.radians(truth.lat_deg) * A)
    assert away.max() < 0.05


def test_a_point_in_another_frame_grows_less_certain() -> None:
    point = FixedPoint(50.03, 15.77, 289.4, antenna_height_m=1.5, frame="S-JTSK")
    moved = transformed(point, "S-JTSK>ETRS89>ITRF2014@2025.5")
    # EPSG states 1 m and 0.1 m for the two steps.
    assert moved.sigma_h_m == pytest.approx(np.sqrt(0.02**2 + 1.0**2 + 0.1**2))
    assert moved.sigma_v_m == pytest.approx(np.sqrt(0.03**2 + 1.0**2 + 0.1**2))
    assert moved.frame == "ITRF2014 2025.5"
    assert moved.antenna_height_m == 1.5
    assert "S-JTSK to ETRS89 (1)" in moved.label
    # The datum shift of S-JTSK is some 80 m to the south and 90 m to the west (EPSG 1623).
    assert (moved.lat_deg - 50.03) * 111_200 == pytest.approx(-80, abs=10)
    assert (moved.lon_deg - 15.77) * 71_500 == pytest.approx(-91, abs=10)


def test_trajectory_and_track_move_as_the_points_do() -> None:
    table = track(5).assign(lat_deg=50.03, sigma_h_m=[0.1, 0.2, 0.3, 0.4, np.nan])
    change = "ETRF2000>ITRF2014@2025.5"
    moved = transformed(Trajectory(table, frame="ETRF2000"), change)
    line = Track((table[["lat_deg", "lon_deg", "height_m"]].to_numpy(),), sigma_m=0.3)
    part = transformed(line, change).parts[0]
    flat = Track((np.where([True, True, False], line.parts[0], np.nan),))
    for i, place in enumerate(line.parts[0]):
        one = transformed(FixedPoint(*place), change)
        expected = (one.lat_deg, one.lon_deg, one.height_m)
        assert tuple(moved.table.iloc[i, :3]) == pytest.approx(expected, abs=1e-9)
        assert tuple(part[i]) == pytest.approx(expected, abs=1e-9)
    assert np.isnan(transformed(flat, change).parts[0][:, 2]).all()
    assert moved.table["sigma_h_m"].tolist()[:4] == [0.1, 0.2, 0.3, 0.4]  # EPSG: accuracy 0 m
    assert moved.frame == "ITRF2014 2025.5"
    assert "ETRF2000 to ITRF2014 at 2025.5" in moved.label
    truth = transformed(TrackLine(line), change)
    assert truth.frame == "ITRF2014 2025.5"
    assert "ITRF2014" in truth.label
    own = transformed(Trajectory(table, frame="ETRF2000"), "ETRF2000>ITRF2014")
    assert own.frame == "ITRF2014 2020"  # the points' own epoch


@pytest.mark.parametrize(
    ("frame", "change"),
    [
        ("ITRF2014 2010.0", "ETRF2000>ITRF2014@2025.5"),
        ("ITRF2014 2010.0", "ITRF2014 2012.0>ETRF2014>ITRF2014@2025.5"),
        ("ITRF2014 2010.0", "ITRF2014>ETRF2014@2025.5"),
        ("nowhere", "ETRF2000>ITRF2014@2025.5"),
    ],
)
def test_a_transformation_must_begin_where_the_truth_is(frame: str, change: str) -> None:
    with pytest.raises(InputError):
        transformed(FixedPoint(50.03, 15.77, 289.4, frame=frame), change)


def test_findings_on_frames() -> None:
    meta = RecordingMeta(frame="WGS84")
    point = FixedPoint(50.03, 15.77, 289.4)
    (unstated,) = frame_findings(meta, point)
    assert (unstated.code, unstated.severity) == ("E09", "warning")
    assert "not stated" in unstated.message
    (other,) = frame_findings(meta, replace(point, frame="ETRF2000"), year=2026.5)
    assert "ETRF2000>ITRF2014@2026.5" in other.cure
    (odd,) = frame_findings(meta, replace(point, frame="ETRF200"))
    assert "ETRF2000" in odd.evidence
    assert frame_findings(meta, replace(point, frame="ITRF2014 2026.2"), year=2026.5) == ()
    assert frame_findings(meta, None) == ()
    assert frame_findings(meta, replace(point, lower_bound=True)) == ()


def test_heading_turns_the_short_way_and_never_across_a_gap() -> None:
    table = track(6, step_s=1.0).assign(heading_deg=[350.0, 10.0, 20.0, 200.0, np.nan, 5.0])
    truth = Trajectory(table)
    start = np.datetime64("2020-01-01", "ns")
    at = start + (np.array([0.25, 0.5, 1.0, 1.75, 2.5, 3.0, 3.5, -1.0, 9.0]) * 1e9).astype("m8[ns]")
    np.testing.assert_allclose(
        truth.heading_deg(at), [355.0, 0.0, 10.0, 17.5, np.nan, 200.0, np.nan, np.nan, np.nan]
    )
    assert np.isnan(Trajectory(track(6)).heading_deg(at)).all()
    slow = Trajectory(table.iloc[::2], max_step_s=1.0)
    assert np.isnan(slow.heading_deg(at[:2])).all()


def test_direction_of_motion_on_a_circle() -> None:
    # 20 m/s on a circle of 300 m: the azimuth grows by 20/300 rad a second.
    second = np.arange(60.0)
    angle = second * 20 / 300
    lat, lon, height = pymap3d.enu2geodetic(
        300 * np.sin(angle), 300 * np.cos(angle), 0 * angle, 50.0, 15.0, 0.0
    )
    index = pd.DatetimeIndex(
        np.datetime64("2020-01-01", "ns") + (second * 1e9).astype("m8[ns]"), name="time"
    )
    truth = Trajectory(pd.DataFrame({"lat_deg": lat, "lon_deg": lon, "height_m": height}, index))
    at = index.to_numpy()[1:-1]

    def error(at: np.ndarray, angle: np.ndarray) -> float:
        away = truth.motion_deg(at, above_mps=1.0) - 90 - np.degrees(angle)
        return float(np.abs((away + 180) % 360 - 180).max())

    # A chord is parallel to the tangent at its middle; 300 m east of the plane's origin its north
    # is 300 m x tan(50 deg) / R = 0.0032 deg off.
    assert error(at, angle[1:-1]) < 4e-3
    between = at[1:-1] + np.timedelta64(400, "ms")
    assert error(between, angle[2:-2] + 0.4 * 20 / 300) < 0.5
    assert np.isnan(truth.motion_deg(at, above_mps=21.0)).all()
    assert np.isnan(truth.motion_deg(index.to_numpy()[:1], above_mps=1.0)[0])
