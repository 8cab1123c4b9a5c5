"""A centre line as straight pieces, and the nearest of them to many positions.

Between two vertices the line is the geodesic, cut into straight pieces of at most 100 m, whose
chords lie within 0.2 mm of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.exceptions import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LONGEST_PIECE_M = 100.0
MOST_HEIGHT_M = 20_000.0
MOST_VERTEX_STEP_M = 20_000.0
"""Vertices farther apart are no centre line; up to here the pieces are exact to 1 mm."""
END_SLACK_M = 1e-6
"""A place this far beyond the line's end is its end: rounding, not a way off the line."""
_PAIRS = 1 << 19  # positions times neighbours at a time: bounds the memory of the search


class TrackPosition(NamedTuple):
    """(n,) places on a track; NaN, and part -1, where a position is off it.

    `distance_m` along the line from the zero of its chainage; `across_m` of the position from
    the line, right of increasing distance positive; `azimuth_deg` of the line there, towards
    increasing distance, 0..360; `up_m` above the line, NaN where either height is unknown;
    `ambiguous` where another place of the track is nearly as near.
    """

    distance_m: Floats
    across_m: Floats
    azimuth_deg: Floats
    up_m: Floats
    part: Ints
    ambiguous: NDArray[np.bool_]


class Pieces(NamedTuple):
    """(m,) straight pieces on the ellipsoid: start, forward, right in ECEF; what lies on them."""

    tree: Any
    start: Floats
    forward: Floats
    right: Floats
    chord_m: Floats
    azimuth_deg: Floats
    distance_m: Floats
    length_m: Floats
    height_m: Floats
    rise_m: Floats
    part: Ints
    is_first: NDArray[np.bool_]
    is_last: NDArray[np.bool_]


def cut(parts: Sequence[Floats], kp_start_m: Sequence[float]) -> Pieces:
    from scipy.spatial import KDTree

    steps = [
        np.linalg.norm(np.diff(on_ellipsoid(part[:, 0], part[:, 1]), axis=0), axis=1)
        for part in parts
    ]
    everything = np.concatenate(steps)
    if everything.size and everything.max() > MOST_VERTEX_STEP_M:
        raise InputError(
            "two vertices of the track are too far apart", code="E12",
            evidence=f"{everything.max() / 1000:.4g} km, at most {MOST_VERTEX_STEP_M / 1000:g} km",
            cure="give the centre line with its vertices; parts that do not touch are a "
            "MultiLineString",
        )  # fmt: skip
    used = everything[everything > 0]
    # Pieces of like length keep the search short; twice as many as vertices at most.
    piece_m = min(max(float(used.mean()), 1.0), LONGEST_PIECE_M) if used.size else 1.0
    columns = [
        _cut_part(part, step, piece_m, start, number)
        for number, (part, step, start) in enumerate(zip(parts, steps, kp_start_m, strict=True))
    ]
    joined = [np.concatenate(c) for c in zip(*columns, strict=True)]
    start, forward, chord_m = joined[0], joined[1], joined[3]
    return Pieces(KDTree(start + forward * chord_m[:, None] / 2), *joined)


def _cut_part(
    part: Floats, step_m: Floats, piece_m: float, kp_start_m: float, number: int
) -> tuple[Any, ...]:
    keep = np.concatenate([[True], step_m > 0])
    lat, lon, height = part[keep].T
    if lat.size < 2:
        raise InputError(
            "a part of the track has fewer than two places", where=f"part {number + 1}"
        )
    counts = np.ceil(step_m[step_m > 0] / piece_m).astype(int)
    owner = np.repeat(np.arange(counts.size), counts)
    share = (np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)) / np.repeat(
        counts, counts
    )
    corners = on_ellipsoid(lat, lon)
    # Places on the chord, dropped along the ellipsoid's normal, lie on the geodesic to micrometres.
    inner = corners[owner] + share[:, None] * np.diff(corners, axis=0)[owner]
    on_lat, on_lon, _ = pymap3d.ecef2geodetic(*inner.T)
    exact = share == 0
    on_lat = np.append(np.where(exact, lat[owner], on_lat), lat[-1])
    on_lon = np.append(np.where(exact, lon[owner], on_lon), lon[-1])
    places = on_ellipsoid(on_lat, on_lon)
    known = np.nan_to_num(height)
    level = np.append(known[owner] + share * np.diff(known)[owner], known[-1])
    chord = np.diff(places, axis=0)
    chord_m = np.linalg.norm(chord, axis=1)
    forward = chord / chord_m[:, None]
    middle_lat, middle_lon, _ = pymap3d.ecef2geodetic(*(places[:-1] + chord / 2).T)
    normal = _up(middle_lat, middle_lon)
    right = np.cross(forward, normal)
    right /= np.linalg.norm(right, axis=1)[:, None]
    azimuth = _azimuth(forward, middle_lat, middle_lon)
    radius = _radius_m(middle_lat, azimuth)
    length_m = chord_m * (1 + (level[1:] + level[:-1]) / 2 / radius)
    ends = np.zeros((2, chord_m.size), bool)
    ends[0, 0] = ends[1, -1] = True
    missing = np.nan if np.isnan(height[0]) else 0.0
    return (
        places[:-1], forward, right, chord_m, azimuth,
        kp_start_m + np.cumsum(length_m) - length_m, length_m, level[:-1] + missing,
        np.diff(level), np.full(chord_m.size, number), ends[0], ends[1],
    )  # fmt: skip


class _Nearest(NamedTuple):
    """(n,) the nearest piece, where its foot is, and how the position lies from there [m]."""

    piece: Ints
    foot_m: Floats
    across_m: Floats
    excess_m: Floats
    ambiguous: NDArray[np.bool_]


def place_of(
    pieces: Pieces, lat: Floats, lon: Floats, height: Floats, reach_m: float, within_m: float
) -> TrackPosition:
    """The nearest place of (n,) positions that are known."""
    near = _search(pieces, on_ellipsoid(lat, lon), reach_m, within_m)
    at = near.piece
    apart = np.hypot(near.across_m, near.excess_m)
    ahead, behind = near.excess_m > END_SLACK_M, near.excess_m < -END_SLACK_M
    off = (pieces.is_last[at] & ahead) | (pieces.is_first[at] & behind) | ~(apart <= reach_m)
    share = near.foot_m / pieces.chord_m[at]
    # At a corner the line turns through all azimuths between those of its two pieces; the
    # position is square to one of them.
    side = np.sign(near.across_m)
    turned = np.degrees(np.arctan2(near.across_m, near.excess_m)) - 90 * side
    azimuth = (pieces.azimuth_deg[at] + np.where(near.excess_m == 0, 0.0, turned)) % 360
    level = pieces.height_m[at] + share * pieces.rise_m[at]
    # On the ellipsoid everything is smaller than at the height where it is measured.
    used = np.where(np.isnan(level), height, level)
    used = np.where(np.abs(used) < MOST_HEIGHT_M, used, 0.0)
    across = np.copysign(apart, near.across_m) * (1 + used / _radius_m(lat, azimuth + 90))
    distance = pieces.distance_m[at] + share * pieces.length_m[at]
    return TrackPosition(
        np.where(off, np.nan, distance),
        np.where(off, np.nan, across),
        np.where(off, np.nan, azimuth),
        np.where(off, np.nan, height - level),
        np.where(off, -1, pieces.part[at]),
        near.ambiguous & ~off,
    )


def _search(pieces: Pieces, at: Floats, reach_m: float, within_m: float) -> _Nearest:
    """The nearest piece of (n, 3) places on the ellipsoid.

    A piece lies nowhere nearer than its middle less half the longest piece. So many middles are
    taken that all further pieces are known to be farther than what was found.
    """
    n, total = len(at), pieces.chord_m.size
    far = np.full((3, n), np.inf)
    found = _Nearest(np.zeros(n, np.int64), far[0], far[1], far[2], np.zeros(n, bool))
    half_m = float(pieces.chord_m.max()) / 2
    k = min(total, int(np.clip(np.ceil((5 + within_m) / half_m) + 2, 4, 32)))
    todo = np.arange(n)
    while todo.size:
        left = []
        for rows in np.array_split(todo, -(-todo.size * k // _PAIRS)):
            middle_m, piece = pieces.tree.query(
                at[rows], k=[*range(1, k + 1)], distance_upper_bound=reach_m + within_m + half_m
            )
            some, apart = _nearest_of(pieces, at[rows], piece, within_m)
            known_m = np.inf if k == total else middle_m[:, -1] - half_m
            proven = known_m >= np.minimum(apart, reach_m) + within_m
            for whole, values in zip(found, some, strict=True):
                whole[rows[proven]] = values[proven]
            left.append(rows[~proven])
        todo, k = np.concatenate(left), min(total, 2 * k)
    return found


def _nearest_of(
    pieces: Pieces, at: Floats, piece: Ints, within_m: float
) -> tuple[_Nearest, Floats]:
    """The nearest of (n, k) pieces to each place, and its distance [m]."""
    none = piece == pieces.chord_m.size  # fewer than k in reach
    piece = np.where(none, 0, piece)
    away = at[:, None, :] - pieces.start[piece]
    ahead = np.einsum("ijk,ijk->ij", away, pieces.forward[piece])
    across = np.einsum("ijk,ijk->ij", away, pieces.right[piece])
    foot = np.clip(ahead, 0, pieces.chord_m[piece])
    excess = ahead - foot
    apart = np.where(none, np.inf, np.hypot(across, excess))
    best = np.argmin(apart, axis=1)[:, None]

    def of_best(values: NDArray[Any]) -> NDArray[Any]:
        return np.take_along_axis(values, best, axis=1)

    limit = of_best(apart) + within_m
    along = pieces.distance_m[piece] + foot
    elsewhere = (pieces.part[piece] != of_best(pieces.part[piece])) | (
        np.abs(along - of_best(along)) > 2 * limit
    )
    beyond = (pieces.is_first[piece] & (excess < -END_SLACK_M)) | (
        pieces.is_last[piece] & (excess > END_SLACK_M)
    )
    rival = (elsewhere & ~beyond & (apart <= limit)).any(axis=1)
    nearest = of_best(apart)[:, 0]
    chosen, foot, across, excess = (of_best(v)[:, 0] for v in (piece, foot, across, excess))
    across = np.where(np.isinf(nearest), np.inf, across)
    return _Nearest(chosen, foot, across, excess, rival), nearest


def on_ellipsoid(lat: Floats, lon: Floats) -> Floats:
    """(n, 3) ECEF places at height zero [m]."""
    return np.column_stack(pymap3d.geodetic2ecef(lat, lon, np.zeros(lat.shape)))


def _up(lat: Floats, lon: Floats) -> Floats:
    """(n, 3) outward normals of the ellipsoid."""
    phi, lam = np.radians(lat), np.radians(lon)
    return np.column_stack([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])


def _azimuth(forward: Floats, lat: Floats, lon: Floats) -> Floats:
    """(n,) azimuths of (n, 3) directions in ECEF [deg], 0..360."""
    east, north, _ = pymap3d.ecef2enuv(*forward.T, lat, lon)
    return np.asarray(np.degrees(np.arctan2(east, north)) % 360)


def _radius_m(lat: Floats, azimuth_deg: Floats) -> Floats:
    """(n,) radius of curvature in an azimuth [m]; Euler's theorem (Torge, Geodesy, 4.1.3)."""
    meridian, vertical = pymap3d.rcurve.meridian(lat), pymap3d.rcurve.transverse(lat)
    c, s = np.cos(np.radians(azimuth_deg)), np.sin(np.radians(azimuth_deg))
    return np.asarray(1 / (c**2 / meridian + s**2 / vertical))
