"""What positions show to be wrong or doubtful about a track."""

from __future__ import annotations

import numpy as np
import pymap3d
from numpy.typing import ArrayLike, NDArray

from sbas.findings import Finding
from sbas.track.centre_line import Track
from sbas.track.pieces import on_ellipsoid

Floats = NDArray[np.float64]

EARTH_RADIUS_M = 6_371_000.0


def track_findings(
    track: Track, lat_deg: ArrayLike, lon_deg: ArrayLike, *, reach_m: float = 100.0
) -> tuple[Finding, ...]:
    """What (n,) positions show to be wrong or doubtful about a track.

    E12 where no position is on it (with the distances as given and with latitude and longitude
    swapped), E01 where some are off it, E09 where another place of it is nearly as near, or
    where its vertices are so far apart that the line between them is a matter of definition.
    """
    lat, lon = np.array(lat_deg, float, ndmin=1), np.array(lon_deg, float, ndmin=1)
    known = int(np.sum(np.isfinite(lat) & np.isfinite(lon)))
    place = track.project(lat, lon, reach_m=reach_m)
    on = int(np.sum(place.part >= 0))
    found = list(_coarse(track))
    if known and not on:
        tries = {"as given": (lat, lon), "latitude and longitude swapped": (lon, lat)}
        far = {name: _nearest_km(track, *place) for name, place in tries.items()}
        swapped = far["latitude and longitude swapped"] < 10
        return (
            Finding(
                "E12", "error", "no position is on the track",
                evidence="nearest vertex: " + ", ".join(f"{n} {d:.3f} km" for n, d in far.items()),
                cure="the track's file has latitude and longitude swapped: GeoJSON gives the "
                "longitude first" if swapped else "check the track, its frame and the recording",
            ),
        )  # fmt: skip
    if on < known:
        found.append(
            Finding(
                "E01", "warning", f"{known - on:,} of {known:,} positions are off the track",
                evidence=f"farther than {reach_m:g} m from it, or beyond an end",
                cure="they have no place on it and form no error; give the whole line",
            )
        )  # fmt: skip
    if doubtful := int(place.ambiguous.sum()):
        found.append(
            Finding(
                "E09", "warning",
                f"{doubtful:,} of {known:,} positions are nearly as near to another place of the "
                "track",
                evidence="a parallel track or a loop; the nearest place was taken, which makes "
                "errors too small and distances doubtful",
                cure="keep only the track that was run",
            )
        )  # fmt: skip
    return tuple(found)


def _coarse(track: Track) -> tuple[Finding, ...]:
    bow_m = 0.0
    for part in track.parts:
        corners = on_ellipsoid(part[:, 0], part[:, 1])
        step = np.diff(corners, axis=0)
        middle = (part[1:, 0] + part[:-1, 0]) / 2
        east, _, _ = pymap3d.ecef2enuv(*step.T, middle, (part[1:, 1] + part[:-1, 1]) / 2)
        # Between a geodesic and a straight line in longitude and latitude: s^2 tan(lat) / 8 R.
        bow = np.linalg.norm(step, axis=1) * np.abs(east) * np.abs(np.tan(np.radians(middle)))
        bow_m = max(bow_m, float(bow.max()) / 8 / EARTH_RADIUS_M)
    if bow_m <= 0.1:
        return ()
    return (
        Finding(
            "E09", "warning", "vertices of the track are far apart",
            evidence=f"a straight line in longitude and latitude would be up to {bow_m:.2g} m from "
            "the geodesic that was taken",
            cure="give the centre line with more vertices",
        ),
    )  # fmt: skip


def _nearest_km(track: Track, lat: Floats, lon: Floats) -> float:
    known = np.flatnonzero(np.isfinite(lat) & np.isfinite(lon) & (np.abs(lat) <= 90))
    if not known.size:
        return np.inf
    some = known[:: -(-known.size // 1000)]
    away, _ = track.pieces.tree.query(on_ellipsoid(lat[some], lon[some]))
    return float(away.min()) / 1000
