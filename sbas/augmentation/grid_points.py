"""Where the points of the ionospheric grid lie: bands, numbers, and back.

Source: RTCA DO-229D, A.4.4.9 and table A-14, as read from gLAB 6.0.0.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

BAND_POINTS = 201
BANDS = 11
NO_POINT = -1
_LAT_ROWS, _LON_COLUMNS = 35, 72


class GridPoints(NamedTuple):
    """Points by identity `band * 201 + number - 1`, and identities by place.

    `lat_deg`, `lon_deg` (2211,): NaN where a band has no such number; `low`, `high` (35, 72)
    identities at latitude -85 + 5 i and longitude 5 j, of bands 0-8 and of bands 9 and 10.
    """

    lat_deg: NDArray[np.float64]
    lon_deg: NDArray[np.float64]
    low: Ints
    high: Ints


def _band(number: int) -> list[tuple[int, int]]:
    """(latitude, longitude) of a band's points in the order of their numbers."""
    if number >= 9:
        sign = 1 if number == 9 else -1
        points = [(60 * sign, lon) for lon in range(-180, 180, 5)]
        for lat in (65, 70, 75):
            points += [(lat * sign, lon) for lon in range(-180, 180, 10)]
        first = -180 if sign > 0 else -170
        return points + [(85 * sign, lon) for lon in range(first, 180, 30)]
    long = [-75, -65, *range(-55, 60, 5), 65, 75]
    points = []
    for meridian in range(8):
        lon = -180 + 40 * number + 5 * meridian
        lats = long if meridian % 2 == 0 else list(range(-55, 60, 5))
        if (lon + 180) % 90 == 0:
            lats = [*lats, 85]
        if (lon - 40) % 90 == 0:
            lats = [-85, *lats]
        points += [(lat, lon) for lat in lats]
    return points


@cache
def grid_points() -> GridPoints:
    """All points of the standard's eleven bands."""
    lat, lon = np.full(BANDS * BAND_POINTS, np.nan), np.full(BANDS * BAND_POINTS, np.nan)
    low = np.full((_LAT_ROWS, _LON_COLUMNS), NO_POINT)
    high = low.copy()
    for band in range(BANDS):
        for number, (point_lat, point_lon) in enumerate(_band(band)):
            identity = band * BAND_POINTS + number
            lat[identity], lon[identity] = point_lat, point_lon
            place = (point_lat + 85) // 5, point_lon % 360 // 5
            (high if band >= 9 else low)[place] = identity
    return GridPoints(lat, lon, low, high)


def points_at(lat_deg: Ints, lon_deg: Ints, *, high: bool) -> Ints:
    """Identities of the points at places, of bands 9 and 10 or of the others; -1 for none."""
    points = grid_points()
    table = points.high if high else points.low
    row, column = (lat_deg + 85) // 5, lon_deg % 360 // 5
    inside = (lat_deg % 5 == 0) & (lon_deg % 5 == 0) & (row >= 0) & (row < _LAT_ROWS)
    found: Ints = np.where(inside, table[np.clip(row, 0, _LAT_ROWS - 1), column], NO_POINT)
    return found
