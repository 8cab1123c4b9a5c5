"""What positions show about a track."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.track import Track, track_findings

LON = np.linspace(15.0, 15.01, 200)
TRACK = Track((np.column_stack([np.full(200, 50.0), LON, np.full(200, np.nan)]),))


def codes(track: Track, lat: object, lon: object) -> list[tuple[str, str]]:
    return [(f.code, f.severity) for f in track_findings(track, lat, lon)]  # type: ignore[arg-type]


def test_positions_on_the_track_show_nothing() -> None:
    assert codes(TRACK, np.full(50, 50.00001), np.linspace(15.001, 15.009, 50)) == []
    assert codes(TRACK, [np.nan], [np.nan]) == []


def test_swapped_latitude_and_longitude_are_named() -> None:
    swapped = Track((TRACK.parts[0][:, [1, 0, 2]],))
    (found,) = track_findings(swapped, [50.0], [15.005])
    assert (found.code, found.severity) == ("E12", "error")
    assert "longitude first" in found.cure
    assert "swapped 0.000 km" in found.evidence
    (far,) = track_findings(TRACK, [40.0], [15.005])
    assert "longitude first" not in far.cure


def test_positions_off_the_track_and_between_tracks_are_counted() -> None:
    away, *rest = track_findings(TRACK, [50.0, 50.01, 50.0], [15.005, 15.005, 15.5])
    assert not rest
    assert (away.code, away.message[:6]) == ("E01", "2 of 3")
    other = TRACK.parts[0] + [4 / 111_200, 0, 0]
    double = Track((TRACK.parts[0], other), kp_start_m=(0, 0))
    (between,) = track_findings(double, [50.0 + 2 / 111_200], [15.005])
    assert (between.code, between.message[:6]) == ("E09", "1 of 1")


def test_sparse_vertices_leave_the_line_open() -> None:
    # 10.7 km along a parallel at 50 deg: s^2 tan(lat) / 8 R = 2.69 m between the two lines.
    sparse = Track((np.array([(50.0, 15.0, np.nan), (50.0, 15.15, np.nan)]),))
    (found,) = track_findings(sparse, [50.0], [15.0000001])
    assert found.code == "E09"
    length = np.radians(0.15) * 6_388_838.290 * np.cos(np.radians(50.0))  # prime vertical radius
    expected = length**2 * np.tan(np.radians(50.0)) / 8 / 6_371_000
    assert f"{expected:.2g} m" in found.evidence
    middle = sparse.project([50.0], [15.075])
    # The geodesic runs north of the parallel, which is thus right of an eastbound line.
    assert middle.across_m[0] == pytest.approx(expected, rel=0.01)
