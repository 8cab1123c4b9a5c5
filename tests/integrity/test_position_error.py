"""Errors along and across a track, and across a centre line alone."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.integrity.position_error import position_errors
from sbas.track import Track, TrackLine
from sbas.truth import FixedPoint, Trajectory

LAT, LON, HEIGHT = 50.0, 15.0, 250.0
PLAIN = ["east_m", "north_m", "up_m", "hpe_m", "vpe_m", "truth_sigma_h_m", "truth_sigma_v_m"]


def table(enu: np.ndarray, step_s: float = 1.0) -> pd.DataFrame:
    """Positions at (n, 3) east, north, up from the origin [m]."""
    lat, lon, height = pymap3d.enu2geodetic(*enu.T, LAT, LON, HEIGHT)
    time = np.datetime64("2025-06-01", "ns") + (np.arange(len(enu)) * step_s * 1e9).astype("m8[ns]")
    index = pd.DatetimeIndex(time, name="time")
    return pd.DataFrame({"lat_deg": lat, "lon_deg": lon, "height_m": height}, index=index)


def straight(azimuth_deg: float, sigma_m: float = 0.2, frame: str = "ETRF2000") -> Track:
    """1 km either way of the origin."""
    e, n = np.sin(np.radians(azimuth_deg)), np.cos(np.radians(azimuth_deg))
    ends = np.array([(-1000 * e, -1000 * n, 0), (1000 * e, 1000 * n, 0)])
    lat, lon, _ = pymap3d.enu2geodetic(*ends.T, LAT, LON, HEIGHT)
    return Track(
        (np.column_stack([lat, lon, [HEIGHT, HEIGHT]]),), "1", sigma_m=sigma_m, frame=frame
    )


@pytest.mark.parametrize("azimuth", [0.0, 30.0, 135.0, 280.0])
def test_errors_turn_into_the_track(azimuth: float) -> None:
    rng = np.random.default_rng(3)
    error = rng.normal(0, 5, (50, 3))
    truth = FixedPoint(LAT, LON, HEIGHT, frame="ETRF2000")
    found = position_errors(table(error), truth, track=straight(azimuth))
    e, n = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    np.testing.assert_allclose(found["along_m"], error[:, 0] * e + error[:, 1] * n, atol=1e-3)
    np.testing.assert_allclose(found["across_m"], error[:, 0] * n - error[:, 1] * e, atol=1e-3)
    turned = (found["track_azimuth_deg"] - azimuth + 180) % 360 - 180
    assert turned.abs().max() < 2e-3
    # The place is that of the truth, whatever the error.
    np.testing.assert_allclose(found["distance_m"], 1000, atol=1e-3)
    assert not found["track_ambiguous"].any()
    plain = position_errors(table(error), truth)
    pd.testing.assert_frame_equal(found[PLAIN], plain)
    assert list(plain) == PLAIN


def test_a_moving_truth_is_placed_on_the_track() -> None:
    truth = table(np.column_stack([np.zeros(40), np.arange(40) * 30.0 - 900, np.zeros(40)]))
    away = table(np.column_stack([np.full(40, 2.0), np.arange(40) * 30.0 - 903, np.zeros(40)]))
    found = position_errors(away, Trajectory(truth), track=straight(0.0))
    np.testing.assert_allclose(found["distance_m"], 100 + 30 * np.arange(40), atol=1e-2)
    np.testing.assert_allclose(found["across_m"], 2.0, atol=1e-3)
    np.testing.assert_allclose(found["along_m"], -3.0, atol=1e-3)
    by_motion = position_errors(away, Trajectory(truth), direction_above_mps=1.0)
    np.testing.assert_allclose(by_motion["across_m"].iloc[1:-1], 2.0, atol=1e-3)
    assert np.isnan(by_motion["across_m"].iloc[0])
    assert "distance_m" not in by_motion
    headed = Trajectory(truth.assign(heading_deg=180.0))
    np.testing.assert_allclose(position_errors(away, headed)["across_m"], -2.0, atol=1e-3)
    far = position_errors(away, Trajectory(truth.assign(lat_deg=truth["lat_deg"] + 0.5)),
                          track=straight(0.0))  # fmt: skip
    assert far["across_m"].isna().all()
    assert far["hpe_m"].notna().all()


def test_a_track_as_truth_gives_the_error_across_alone() -> None:
    error = np.array([(3.0, 40.0, 1.0), (-2.0, -70.0, 5.0), (200.0, 0.0, 0.0), (0.0, 1005.0, 0.0)])
    found = position_errors(table(error), TrackLine(straight(0.0)))
    np.testing.assert_allclose(found["across_m"].iloc[:2], [3.0, -2.0], atol=1e-3)
    np.testing.assert_allclose(found["hpe_m"].iloc[:2], [3.0, 2.0], atol=1e-3)
    np.testing.assert_allclose(found["east_m"].iloc[:2], [3.0, -2.0], atol=1e-3)
    np.testing.assert_allclose(found["north_m"].iloc[:2], 0.0, atol=1e-3)
    # 200 m away, and beyond the end: no error, and no certainty of one.
    assert found.iloc[2:].drop(columns="track_ambiguous").isna().all(axis=None)
    for name in ("along_m", "up_m", "vpe_m", "truth_sigma_v_m"):
        assert found[name].isna().all()
    assert found["truth_sigma_h_m"].iloc[0] == pytest.approx(0.2)
    unstated = position_errors(table(error), TrackLine(straight(0.0, frame="")))
    assert unstated["truth_sigma_h_m"].iloc[0] == pytest.approx(np.hypot(0.2, 1.0))


@given(st.floats(0, 360), st.lists(st.tuples(st.floats(-90, 90), st.floats(-90, 90)), min_size=1))
def test_the_error_across_never_exceeds_the_horizontal_one(
    azimuth: float, errors: list[tuple[float, float]]
) -> None:
    positions = table(np.array([(e, n, 0.0) for e, n in errors]))
    whole = position_errors(positions, FixedPoint(LAT, LON, HEIGHT))["hpe_m"].to_numpy()
    bound = position_errors(positions, TrackLine(straight(azimuth)))["hpe_m"].to_numpy()
    known = np.isfinite(bound)
    assert (bound[known] <= whole[known] + 1e-3).all()


def test_what_cannot_be_asked() -> None:
    positions = table(np.zeros((2, 3)))
    with pytest.raises(InputError, match="a track already"):
        position_errors(positions, TrackLine(straight(0.0)), track=straight(0.0))
    with pytest.raises(InputError, match="speed"):
        position_errors(positions, FixedPoint(LAT, LON, HEIGHT), direction_above_mps=-1.0)


def test_no_epochs_give_no_rows() -> None:
    nothing = table(np.zeros((2, 3))).iloc[:0]
    truth = FixedPoint(LAT, LON, HEIGHT)
    assert len(position_errors(nothing, truth, track=straight(10.0))) == 0
    assert len(position_errors(nothing, TrackLine(straight(10.0)))) == 0
