"""The points of the grid: how many a band has, and where they lie."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.grid_points import BAND_POINTS, NO_POINT, grid_points, points_at


def band(number: int) -> list[tuple[float, float]]:
    places = grid_points()
    rows = slice(number * BAND_POINTS, (number + 1) * BAND_POINTS)
    lat, lon = places.lat_deg[rows], places.lon_deg[rows]
    return [(a, b) for a, b in zip(lat, lon, strict=True) if not np.isnan(a)]


@pytest.mark.parametrize(
    ("number", "count"), [*((b, 201) for b in range(8)), (8, 200), (9, 192), (10, 192)]
)
def test_the_number_of_points(number: int, count: int) -> None:
    points = band(number)
    assert len(points) == count
    assert len(set(points)) == count


@pytest.mark.parametrize(
    ("number", "point", "place"),
    [
        (7, 41, (10, 105)), (7, 201, (55, 135)), (0, 1, (-75, -180)), (0, 28, (85, -180)),
        (1, 1, (-85, -140)), (3, 51, (-85, -50)), (8, 200, (55, 175)), (9, 1, (60, -180)),
        (9, 73, (65, -180)), (9, 181, (85, -180)), (10, 1, (-60, -180)), (10, 181, (-85, -170)),
        (10, 192, (-85, 160)), (9, 192, (85, 150)),
    ],
)  # fmt: skip
def test_points_that_are_known(number: int, point: int, place: tuple[int, int]) -> None:
    assert band(number)[point - 1] == place


def test_meridians_run_from_south_to_north_and_eastwards() -> None:
    for number in range(9):
        points = band(number)
        assert [(lon, lat) for lat, lon in points] == sorted((lon, lat) for lat, lon in points)
        assert {lon for _, lon in points} == {-180 + 40 * number + 5 * m for m in range(8)}


def test_points_85_from_the_equator_are_four_on_each_side() -> None:
    low = [place for number in range(9) for place in band(number)]
    assert sorted(lon for lat, lon in low if lat == 85) == [-180, -90, 0, 90]
    assert sorted(lon for lat, lon in low if lat == -85) == [-140, -50, 40, 130]
    assert not [place for place in low if abs(place[0]) == 60]


def test_places_come_back_to_their_points() -> None:
    places = grid_points()
    known = np.flatnonzero(~np.isnan(places.lat_deg))
    lat, lon = places.lat_deg[known].astype(int), places.lon_deg[known].astype(int)
    high = known >= 9 * BAND_POINTS
    for is_high in (False, True):
        for turn in (0, 360, -360):
            chosen = high == is_high
            found = points_at(lat[chosen], lon[chosen] + turn, high=is_high)
            np.testing.assert_array_equal(found, known[chosen])


def test_places_without_a_point() -> None:
    lat, lon = np.array([62, 60, 90, -90, 10, 80, 95]), np.array([0, 0, 0, 0, 3, 0, 0])
    assert points_at(lat, lon, high=False).tolist() == [NO_POINT] * 7
