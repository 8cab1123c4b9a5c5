"""Places on a track against geodesics of another program, plane geometry and closed forms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pymap3d
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

from sbas.exceptions import InputError
from sbas.track import Track, TrackLine, pieces

GEOD = Geod(ellps="WGS84")
A = 6_378_137.0


def line(*places: tuple[float, float], height: float = np.nan) -> np.ndarray:
    return np.array([(lat, lon, height) for lat, lon in places])


def plane(
    places: Sequence[tuple[float, float]], lat0: float = 50.0, lon0: float = 15.0
) -> np.ndarray:
    """Places of a plane (east, north) [m] around a point, on the ellipsoid."""
    east, north = np.array(places, float).T
    lat, lon, _ = pymap3d.enu2geodetic(east, north, 0 * east, lat0, lon0, 0.0)
    return np.column_stack([lat, lon, np.full(east.size, np.nan)])


@pytest.mark.parametrize("lat0", [0.0, 50.03, -71.0])
@pytest.mark.parametrize("azimuth0", [0.0, 37.0, 90.0, 200.0, 271.5])
@pytest.mark.parametrize("length", [35.0, 900.0, 6000.0, 19_900.0])
def test_along_and_across_are_those_of_geodesics(
    lat0: float, azimuth0: float, length: float
) -> None:
    lon0 = 179.97  # eastward lines cross the antimeridian
    lon1, lat1, _ = GEOD.fwd(lon0, lat0, azimuth0, length)
    track = Track((line((lat0, lon0), (lat1, lon1)),), kp_start_m=(1000.0,))
    along = np.linspace(0.01, 0.99, 23) * length
    across = np.linspace(-95, 95, 23)
    n = along.size
    lon, lat, back = GEOD.fwd(np.full(n, lon0), np.full(n, lat0), np.full(n, azimuth0), along)
    azimuth = (back + 180) % 360
    lon, lat, _ = GEOD.fwd(lon, lat, azimuth + 90 * np.sign(across), np.abs(across))
    found = track.project(lat, lon)
    assert np.abs(found.distance_m - 1000 - along).max() < 1e-3
    assert np.abs(found.across_m - across).max() < 1e-3
    # One azimuth a piece: meridians turn by 50 m x tan(71 deg) / R = 0.0013 deg over its half.
    assert np.abs((found.azimuth_deg - azimuth + 180) % 360 - 180).max() < 2e-3
    assert track.length_m == pytest.approx(length, abs=1e-4)
    assert (found.part == 0).all()
    assert not found.ambiguous.any()


def test_distances_are_measured_at_the_height_of_the_line() -> None:
    # Along the equator the parallel at height h has radius A + h; northward, M = A (1 - e^2).
    height, to_lon = 500.0, 0.05
    track = Track((line((0.0, 0.0), (0.0, 0.01), (0.0, to_lon), height=height),))
    assert track.length_m == pytest.approx(np.radians(to_lon) * (A + height), abs=1e-5)
    meridian = A * (1 - 0.0066943799901413165)
    found = track.project([-1e-4], [0.02], [503.5])
    assert found.distance_m[0] == pytest.approx(np.radians(0.02) * (A + height), abs=1e-5)
    assert found.across_m[0] == pytest.approx(np.radians(1e-4) * (meridian + height), abs=1e-5)
    assert found.azimuth_deg[0] == pytest.approx(90.0, abs=1e-6)
    assert found.up_m[0] == pytest.approx(3.5, abs=1e-9)


def test_without_heights_the_error_across_is_that_at_the_antenna() -> None:
    track = Track((line((0.0, 0.0), (0.0, 0.01)),))
    meridian = A * (1 - 0.0066943799901413165)
    found = track.project([-5e-4], [0.005], [5000.0])
    assert found.across_m[0] == pytest.approx(np.radians(5e-4) * (meridian + 5000), abs=1e-4)
    assert np.isnan(found.up_m[0])
    assert track.project([-5e-4], [0.005]).across_m[0] == pytest.approx(
        np.radians(5e-4) * meridian, abs=1e-4
    )


def test_heights_between_vertices_are_even() -> None:
    part = np.array([(50.0, 15.0, 200.0), (50.0, 15.05, 260.0)])
    found = Track((part,)).project([50.0], [15.0125], [230.0])
    # A quarter of the way in longitude; the geodesic of 3.6 km rises evenly.
    assert found.up_m[0] == pytest.approx(230 - 215, abs=1e-3)


def nearest_by_hand(parts: list[np.ndarray], point: np.ndarray) -> tuple[float, float, int, bool]:
    """Distance, distance along, part, and whether it lies beyond an end: every segment tried."""
    best = (np.inf, np.nan, -1, False)
    for number, part in enumerate(parts):
        walked = 0.0
        for i in range(len(part) - 1):
            step = part[i + 1] - part[i]
            length = float(np.hypot(*step))
            if length == 0:
                continue
            t = float((point - part[i]) @ step) / length
            foot = min(max(t, 0.0), length)
            apart = float(np.hypot(*(point - part[i] - foot * step / length)))
            if apart < best[0]:
                beyond = (i == 0 and t < 0) or (i == len(part) - 2 and t > length)
                best = (apart, walked + foot, number, beyond)
            walked += length
    return best


coordinates = st.tuples(st.integers(-800, 800), st.integers(-800, 800))
polylines = st.lists(
    st.lists(coordinates, min_size=2, max_size=12, unique=True), min_size=1, max_size=3
)


@given(polylines, st.lists(coordinates, min_size=1, max_size=12), st.sampled_from([60, 500, 9000]))
def test_the_nearest_of_all_segments_is_found(
    lines: list[list[tuple[int, int]]], points: list[tuple[int, int]], reach: int
) -> None:
    flat = [np.array(part, float) for part in lines]
    track = Track(tuple(plane(part) for part in lines), kp_start_m=(0.0,) * len(lines))
    places = plane([(e + 0.37, n - 0.41) for e, n in points])
    found = track.project(places[:, 0], places[:, 1], reach_m=reach)
    for i, point in enumerate(points):
        at = np.array(point) + np.array([0.37, -0.41])
        apart, along, _, beyond = nearest_by_hand(flat, at)
        ends = [p for p in (nearest_by_hand([part], at) for part in flat) if p[3]]
        if found.part[i] < 0:
            # An end as near as another segment, to a millimetre, may be taken for it.
            assert beyond or apart > reach - 1e-3 or any(p[0] < apart + 1e-3 for p in ends)
            continue
        # The plane departs from the ellipsoid by some 1e-8 of a kilometre.
        assert abs(found.across_m[i]) == pytest.approx(apart, abs=1e-3)
        assert not beyond or found.ambiguous[i]
        if not found.ambiguous[i]:
            assert found.distance_m[i] == pytest.approx(along, abs=2e-3)


def test_right_is_positive_and_around_a_corner_nothing_jumps() -> None:
    track = Track((plane([(0, -500), (0, 0), (400, 400)]),))  # north, then north-east
    angle = np.radians(np.linspace(175, 320, 60))
    places = plane([(20 * np.cos(a), 20 * np.sin(a)) for a in angle[angle < np.radians(180)]])
    left = track.project(places[:, 0], places[:, 1])
    assert np.abs(left.across_m + 20).max() < 1e-6  # outside of the corner, left of the line
    assert np.abs(left.distance_m - 500).max() < 1e-3
    turned = np.radians(np.linspace(135.5, 179.5, 45))
    places = plane([(20 * np.cos(a), 20 * np.sin(a)) for a in turned])
    corner = track.project(places[:, 0], places[:, 1])
    assert np.abs(corner.distance_m - 500).max() < 1e-3
    # The offset points left of the azimuth: mathematical angle a is azimuth 90 - a, plus 90.
    assert np.abs(corner.azimuth_deg - (180 - np.degrees(turned)) % 360).max() < 1e-3
    right = track.project(*plane([(3.0, -100.0)])[0, :2])
    assert right.across_m[0] == pytest.approx(3.0, abs=1e-6)


def test_beyond_the_ends_and_in_a_gap_there_is_no_track() -> None:
    track = Track(
        (plane([(0, 0), (100, 0)]), plane([(160, 0), (300, 0)])), kp_start_m=(0.0, 5000.0)
    )
    places = plane([(-5, 1), (0, 1), (50, 1), (100, 1), (110, 1), (155, 1), (170, 1), (306, 1)])
    found = track.project(places[:, 0], places[:, 1])
    assert found.part.tolist() == [-1, 0, 0, 0, -1, -1, 1, -1]
    assert np.isnan(found.across_m).tolist() == [p < 0 for p in found.part]
    assert found.distance_m[6] == pytest.approx(5010, abs=1e-3)
    assert not found.ambiguous.any()


def test_parallel_tracks_and_loops_are_ambiguous() -> None:
    double = Track((plane([(0, 0), (900, 0)]), plane([(0, 4), (900, 4)])), kp_start_m=(0, 0))
    places = plane([(450, 0.2), (450, 0.6), (450, 2.0), (450, -3.0), (450, 4.2)])
    assert double.project(places[:, 0], places[:, 1]).ambiguous.tolist() == [
        False, True, True, False, False,
    ]  # fmt: skip
    close = double.project(places[:, 0], places[:, 1], ambiguous_within_m=0.5)
    assert close.ambiguous.tolist() == [False, False, True, False, False]
    angle = np.radians(np.linspace(0, 350, 60))
    loop = Track((plane([(300 * np.cos(a), 300 * np.sin(a)) for a in angle]),))
    centre = plane([(0, 0), (299, 1)])
    found = loop.project(centre[:, 0], centre[:, 1], reach_m=400)
    assert found.ambiguous.tolist() == [True, False]


def test_missing_positions_stay_missing_and_one_may_be_given() -> None:
    track = Track((plane([(0, 0), (900, 0)]),))
    found = track.project([np.nan, 50.0], [15.0, 15.005])
    assert found.part.tolist() == [-1, 0]
    assert np.isnan(found.azimuth_deg[0])
    assert track.project(50.0, 15.005).across_m.shape == (1,)
    assert track.project([], []).distance_m.shape == (0,)


def test_how_many_are_searched_at_a_time_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    corners = [(float(e), float(n)) for e, n in rng.integers(-900, 900, (40, 2))]
    track = Track((plane(corners),))
    places = plane([(float(e), float(n)) for e, n in rng.uniform(-900, 900, (500, 2))])
    whole = track.project(places[:, 0], places[:, 1], reach_m=300)
    monkeypatch.setattr(pieces, "_PAIRS", 37)
    for a, b in zip(whole, track.project(places[:, 0], places[:, 1], reach_m=300), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: Track(()),
        lambda: Track((line((50, 15)),)),
        lambda: Track((line((50, 15), (50, 15)),)),
        lambda: Track((line((50, 15), (50, 15.001)),), kp_start_m=(0.0, 1.0)),
        lambda: Track((line((50, 15), (50, 15.001)),), kp_start_m=(np.nan,)),
        lambda: Track((line((50, 15), (50, 15.001)),), sigma_m=-1.0),
        lambda: Track((line((95, 15), (50, 15.001)),)),
        lambda: Track((line((np.nan, 15), (50, 15.001)),)),
        lambda: Track((line((50, 15), (51, 15)),)),
        lambda: Track((np.array([(50, 15, 200.0), (50, 15.001, np.nan)]),)),
        lambda: Track((np.array([(50, 15, np.inf), (50, 15.001, np.inf)]),)),
        lambda: Track((line((50, 15), (50, 15.001)), line((50, 15), (50, 15.001), height=1.0)),
                      kp_start_m=(0, 0)),
        lambda: Track((line((50, 15), (50, 15.001)),)).project([50.0], [15.0], reach_m=np.nan),
        lambda: TrackLine(Track((line((50, 15), (50, 15.001)),))),
    ],
)  # fmt: skip
def test_impossible_tracks_are_refused(wrong: object) -> None:
    with pytest.raises(InputError):
        wrong()  # type: ignore[operator]


def test_a_line_as_truth_says_that_it_bounds_from_below() -> None:
    track = Track((line((50, 15), (50, 15.001)),), track_id="3", sigma_m=0.3, frame="ETRF2000")
    truth = TrackLine(track)
    assert truth.lower_bound
    assert truth.frame == "ETRF2000"
    assert truth.label.startswith("track centre line: cross-track errors only; track 3 of 0.07")
