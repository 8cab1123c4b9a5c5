"""Which grid points surround a pierce point, and their weights.

Corners are numbered 0 north-east, 1 north-west, 2 south-west, 3 south-east. Cells are tried in
the order of the standard: squares of four points before triangles of three. Source: RTCA
DO-229D, A.4.4.10.2 (selection) and A.4.4.10.3 (interpolation), read as gLAB 6.0.0 does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

CORNERS = 4
POLAR_LAT_DEG = 75
CAP_LAT_DEG = 85


class Cell(NamedTuple):
    """Candidate cells of (n,) points: south-west corner, sizes [deg], and where they apply."""

    lat_deg: Ints
    lon_deg: Ints
    height_deg: int
    width_deg: int
    applies: Bools


def corners(cell: Cell) -> tuple[Ints, Ints]:
    """(n, 4) latitudes and longitudes of the corners; longitudes in 0..359."""
    north, east = cell.lat_deg + cell.height_deg, cell.lon_deg + cell.width_deg
    lat = np.stack([north, north, cell.lat_deg, cell.lat_deg], axis=-1)
    lon = np.stack([east, cell.lon_deg, cell.lon_deg, east], axis=-1)
    return lat, lon % 360


def within_cell(cell: Cell, lat_deg: Floats, lon_deg: Floats) -> tuple[Floats, Floats]:
    """(n,) coordinates from the south-west corner, in units of the cell."""
    x = ((lon_deg - cell.lon_deg) % 360) / cell.width_deg
    return x, (lat_deg - cell.lat_deg) / cell.height_deg


def _floor_to(value: Floats, step: int) -> Ints:
    multiple: Ints = (np.floor(value / step) * step).astype(np.int64)
    return multiple


def candidate_cells(lat_deg: Floats, lon_deg: Floats) -> Iterator[tuple[Cell, bool]]:
    """Cells up to 75 degrees of latitude, in order; True where triangles are meant.

    Parameters
    ----------
    lat_deg : (n,) latitude of the pierce points.
    lon_deg : (n,) longitude in 0..360.
    """
    low = np.abs(lat_deg) <= 60
    high = ~low & (np.abs(lat_deg) <= POLAR_LAT_DEG)
    lat5, lon5 = _floor_to(lat_deg, 5), _floor_to(lon_deg, 5)
    lon10 = _floor_to(lon_deg, 10)
    lat10 = _floor_to(lat_deg - 5, 10) + 5
    lat_high = lat10 + np.where(lat_deg - lat10 >= 5, 5, 0)
    for triangles in (False, True):
        yield Cell(lat5, lon5, 5, 5, low), triangles
        yield Cell(lat_high, lon10, 5, 10, high), triangles
    for triangles in (False, True):
        for south, west in ((0, 0), (0, 5), (5, 5), (5, 0)):
            lat, lon = lat5 - south, lon5 - west
            inner = np.asarray(lat_deg >= -55 if south else lat_deg < 55)
            yield Cell(lat, lon, 10, 10, low & (inner | (lon % 10 == 0))), triangles
        yield Cell(lat_high, lon10, 10, 10, high & (lat_deg < 70)), triangles
        yield Cell(lat_high - 5, lon10, 10, 10, high & (lat_deg >= -70)), triangles


def weights(x: Floats, y: Floats, usable: Bools) -> Floats:
    """(n, 4) weights of the corners; NaN rows where fewer than three are usable.

    Parameters
    ----------
    x, y : (n,) place in the cell from its south-west corner.
    usable : (n, 4). Of three usable corners those of their triangle are given; one is negative
        where the point lies outside it.
    """
    full = np.stack([x * y, (1 - x) * y, (1 - x) * (1 - y), x * (1 - y)], axis=-1)
    count = usable.sum(axis=-1)
    full[count < CORNERS] = np.nan
    for corner in range(CORNERS):
        rows = np.flatnonzero((count == CORNERS - 1) & ~usable[:, corner])
        if rows.size:
            full[rows] = _triangle(x[rows], y[rows], corner)
    return full


def _triangle(x: Floats, y: Floats, without: int) -> Floats:
    """(n, 4) weights of the three corners but one."""
    zero = np.zeros_like(x)
    columns = (
        (zero, y, 1 - x - y, x),
        (y, zero, 1 - x, x - y),
        (x + y - 1, 1 - x, zero, 1 - y),
        (x, y - x, 1 - y, zero),
    )[without]
    return np.stack(columns, axis=-1)


def choose_cells(
    lat_deg: Floats,
    lon_deg: Floats,
    identify: Callable[[Ints, Ints, Ints], tuple[Ints, Bools]],
) -> tuple[Ints, Floats, Floats, Bools]:
    """The first good cell of each point up to 75 degrees of latitude.

    Parameters
    ----------
    lat_deg, lon_deg : (n,) pierce points, longitude in 0..360.
    identify : rows (k,) of points with (k, 4) latitudes and longitudes of corners -> (k, 4)
        identities and whether each is in the mask.

    Returns
    -------
    (n, 4) identities of the corners (-1 where not in mask), (n,) x and y, (n,) True where found.
    """
    n = lat_deg.size
    chosen = np.full((n, CORNERS), -1)
    place_x, place_y = np.zeros(n), np.zeros(n)
    found = np.zeros(n, bool)
    for cell, triangles in candidate_cells(lat_deg, lon_deg):
        rows = np.flatnonzero(cell.applies & ~found)
        if not rows.size:
            continue
        part = Cell(cell.lat_deg[rows], cell.lon_deg[rows], cell.height_deg, cell.width_deg,
                    cell.applies[rows])  # fmt: skip
        identity, in_mask = identify(rows, *corners(part))
        x, y = within_cell(part, lat_deg[rows], lon_deg[rows])
        if triangles:
            three = in_mask.sum(axis=1) == CORNERS - 1
            fits = np.asarray(three & (weights(x, y, in_mask) >= 0).all(axis=1))
        else:
            fits = np.asarray(in_mask.all(axis=1))
        good = rows[fits]
        chosen[good] = np.where(in_mask, identity, -1)[fits]
        place_x[good], place_y[good] = x[fits], y[fits]
        found[good] = True
    return chosen, place_x, place_y, found
