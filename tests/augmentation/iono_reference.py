"""The vertical delay at one place, as plain as can be: for comparison with `slant_ionosphere`.

Points are looked up by latitude and longitude; triangles are solved as planes through three
points, not by the formulas of the standard.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np

GIVE_VARIANCE = [0.0084, 0.0333, 0.0749, 0.1331, 0.2079, 0.2994, 0.4075, 0.5322, 0.6735, 0.8315,
                 1.1974, 1.8709, 3.3260, 20.7870, 187.0826]  # fmt: skip
OUTSIDE_GRID, DO_NOT_USE, NOT_MONITORED, OUTSIDE_TRIANGLE = 40, 41, 42, 44
NE, NW, SW, SE = range(4)
PLACES = {NE: (1, 1), NW: (0, 1), SW: (0, 0), SE: (1, 0)}


@dataclass(frozen=True)
class Point:
    """A point in the mask: raw delay and GIVEI; `None` where nothing was sent."""

    delay: int | None = None
    givei: int = 15

    @property
    def forbidden(self) -> bool:
        return self.delay == 511

    @property
    def usable(self) -> bool:
        return self.delay is not None and self.givei < 15 and not self.forbidden


@dataclass(frozen=True)
class Between:
    """A place at 85 degrees between two points."""

    west: Point
    east: Point
    share: float

    @property
    def forbidden(self) -> bool:
        return self.west.forbidden or self.east.forbidden

    @property
    def usable(self) -> bool:
        return self.west.usable and self.east.usable


Grid = dict[tuple[str, int, int], Point]
"""By kind ("low" bands 0-8, "high" bands 9 and 10), latitude and longitude in 0..359."""
Corner = Point | Between


def values(corner: Corner) -> tuple[float, float]:
    if isinstance(corner, Between):
        (d0, v0), (d1, v1) = values(corner.west), values(corner.east)
        w = corner.share
        return d0 * (1 - w) + d1 * w, v0 * (1 - w) + v1 * w
    assert corner.delay is not None
    return corner.delay * 0.125, GIVE_VARIANCE[corner.givei]


def find(grid: Grid, lat: int, lon: int) -> Point | None:
    high = grid.get(("high", lat, lon % 360))
    return high if high is not None else grid.get(("low", lat, lon % 360))


def shares(x: float, y: float, have: list[int]) -> dict[int, float]:
    """Weights of the corners in `have`: bilinear of four, the plane through three."""
    if len(have) == 4:
        return {c: (x if px else 1 - x) * (y if py else 1 - y) for c, (px, py) in PLACES.items()}
    rows = np.array([[1.0, *PLACES[c]] for c in have]).T
    solved = np.linalg.solve(rows, np.array([1.0, x, y]))
    return dict(zip(have, solved.tolist(), strict=True))


Cell = tuple[list[Corner | None], float, float]


def fits(cell: Cell, count: int) -> bool:
    corners, x, y = cell
    have = [c for c in range(4) if corners[c] is not None]
    if len(have) != count:
        return False
    return count == 4 or min(shares(x, y, have).values()) >= -1e-12


def square(grid: Grid, lat: float, lon: float, south: int, west: int, high: int, wide: int) -> Cell:
    corners: list[Corner | None] = [
        find(grid, south + high, west + wide), find(grid, south + high, west),
        find(grid, south, west), find(grid, south, west + wide),
    ]  # fmt: skip
    return corners, ((lon - west) % 360) / wide, (lat - south) / high


def choose(grid: Grid, lat: float, lon: float) -> Cell | None:
    if abs(lat) <= 75:
        return _below_75(grid, lat, lon)
    if abs(lat) <= 85:
        return _between(grid, lat, lon)
    sign = 1 if lat > 0 else -1
    first = 0 if lat > 0 else 40
    base = floor((lon - first) / 90) * 90 + first
    points = [find(grid, 85 * sign, base + step) for step in (180, 270, 0, 90)]
    if any(point is None for point in points):
        return None
    y = (abs(lat) - 85) / 10
    x = (lon - base) / 90 * (1 - 2 * y) + y
    return list(points), x, y


def _below_75(grid: Grid, lat: float, lon: float) -> Cell | None:
    wide: list[Cell] = []
    if abs(lat) <= 60:
        south, west = 5 * floor(lat / 5), 5 * floor(lon / 5)
        first = square(grid, lat, lon, south, west, 5, 5)
        for down, left in ((0, 0), (0, 5), (5, 5), (5, 0)):
            inner = lat >= -55 if down else lat < 55
            if inner or (west - left) % 10 == 0:
                wide.append(square(grid, lat, lon, south - down, west - left, 10, 10))
    else:
        south, west = 10 * floor((lat - 5) / 10) + 5, 10 * floor(lon / 10)
        south += 5 if lat - south >= 5 else 0
        first = square(grid, lat, lon, south, west, 5, 10)
        if lat < 70:
            wide.append(square(grid, lat, lon, south, west, 10, 10))
        if lat >= -70:
            wide.append(square(grid, lat, lon, south - 5, west, 10, 10))
    for cells in ([first], wide):
        for count in (4, 3):
            for cell in cells:
                if fits(cell, count):
                    return cell
    return None


def _between(grid: Grid, lat: float, lon: float) -> Cell | None:
    sign = 1 if lat > 0 else -1
    west = 10 * floor(lon / 10)

    def at_85(target: int) -> Between | None:
        for kind, spacing, first in (("high", 30, 10), ("low", 90, 40)):
            origin = 0 if lat > 0 else first
            base = floor((target - origin) / spacing) * spacing + origin
            pair = [grid.get((kind, 85 * sign, (base + s) % 360)) for s in (0, spacing)]
            if pair[0] is not None and pair[1] is not None:
                return Between(pair[0], pair[1], (target - base) / spacing)
        return None

    far = [at_85(west + 10), at_85(west)]
    near = [find(grid, 75 * sign, west), find(grid, 75 * sign, west + 10)]
    if sign > 0:
        cell: Cell = [*far, *near], (lon - west) / 10, (lat - 75) / 10
    else:
        cell = [near[1], near[0], far[1], far[0]], (lon - west) / 10, (lat + 85) / 10
    return cell if fits(cell, 4) or fits(cell, 3) else None


def vertical(grid: Grid, lat: float, lon: float) -> tuple[int, float, float]:
    """Reason, delay [m] and variance [m2]; the longitude in 0..360."""
    cell = choose(grid, lat, lon)
    if cell is None:
        return OUTSIDE_GRID, 0, 0
    corners, x, y = cell
    if any(corner is not None and corner.forbidden for corner in corners):
        return DO_NOT_USE, 0, 0
    have = [c for c in range(4) if (p := corners[c]) is not None and p.usable]
    if len(have) < 3:
        return NOT_MONITORED, 0, 0
    if len(have) == 4 and abs(lat) > 85:
        weight = {c: (x if px else 1 - x) * (y if py else 1 - y) for c, (px, py) in PLACES.items()}
    else:
        weight = shares(x, y, have)
    if min(weight.values()) < -1e-12:
        return OUTSIDE_TRIANGLE, 0, 0
    delay = variance = 0.0
    for c, w in weight.items():
        corner = corners[c]
        assert corner is not None
        d, v = values(corner)
        delay, variance = delay + w * d, variance + w * v
    return 0, delay, variance
