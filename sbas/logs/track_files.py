"""Track centre lines of GeoJSON files (RFC 7946): longitude before latitude, WGS 84 degrees.

A track must be clean: what is odd about a file is refused, since every error across it would
rest on it.
"""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.track import Track

MOST_BYTES = 64 << 20
"""More than the centre lines of a whole country."""

_LINES = ("LineString", "MultiLineString")
_DEGREES = {("OGC", "CRS84"): "", ("EPSG", "4326"): "", ("EPSG", "4258"): "ETRS89"}
_HEIGHT_CURES = {
    "": "--track-height ellipsoidal, --track-height geoid with --truth-geoid UNDULATION in "
    "metres, or --track-height ignore",
    "geoid": "--truth-geoid UNDULATION in metres (about 45 in Central Europe), or --track-height "
    "ignore",
}

HeightKind = Literal["ellipsoidal", "geoid", "ignore"]


def load_track(
    path: str | os.PathLike[str],
    *,
    track_id: str | None = None,
    height: HeightKind | None = None,
    geoid: float | None = None,
    sigma_m: float | None = None,
    frame: str | None = None,
) -> Track:
    """Track of a GeoJSON file with one line.

    Parameters
    ----------
    path : Feature, FeatureCollection, LineString or MultiLineString. Properties read:
        `track_id`, `kp_start_m` (one number for each part), `sigma_m`, `height`, `frame`.
    track_id : which line to take where the file has several.
    height : what a third coordinate is; asked for where there is one and the file does not say.
    geoid : undulation [m], where heights are above the geoid.
    sigma_m, frame : go before the file's properties. RFC 7946 says "WGS 84", which many
        European files are not, so that it counts as a frame that nobody stated.

    Raises
    ------
    InputError : no GeoJSON, no line or several, coordinates that are no degrees in the order
        longitude, latitude, or heights of a kind that nobody stated.
    """
    where = str(path)
    root = _parsed(path)
    stated = _stated_frame(root, where)
    geometry, properties = _line(root, track_id, where)
    kinds = {"LineString": 1, "MultiLineString": 2}
    places = geometry.get("coordinates")
    lines = [places] if kinds[geometry["type"]] == 1 else places
    if not isinstance(lines, list) or not lines:
        raise InputError("the track has no coordinates", where=where)
    parts = tuple(_part(line, f"{where}, part {n + 1}") for n, line in enumerate(lines))
    own = properties.get("sigma_m") if sigma_m is None else sigma_m
    name = properties.get("track_id", "")
    return Track(
        tuple(_with_heights(parts, height or properties.get("height"), geoid, where)),
        track_id=str(name) if isinstance(name, str | int | float) else "",
        kp_start_m=_starts(properties.get("kp_start_m"), len(parts), where),
        sigma_m=math.nan if own is None else _number(own, "sigma_m", where),
        frame=str(properties.get("frame", stated) if frame is None else frame),
    )


def _parsed(path: str | os.PathLike[str]) -> dict[str, Any]:
    file, where = Path(path), str(path)
    if not file.is_file():
        raise InputError("there is no such track file", where=where, cure="check the name")
    size = file.stat().st_size
    if size > MOST_BYTES:
        raise InputError(
            "the track file is too large", where=where, evidence=f"{size:,} bytes",
            cure=f"give the one line that was run, in at most {MOST_BYTES >> 20} MiB",
        )  # fmt: skip
    try:
        root = json.loads(
            file.read_bytes().decode("utf-8-sig"), parse_constant=_refused, object_pairs_hook=_once
        )
    except (ValueError, RecursionError) as error:
        raise InputError(
            "the track is no GeoJSON", where=where, evidence=str(error)[:200],
            cure="write it as GeoJSON (RFC 7946), in UTF-8",
        ) from None  # fmt: skip
    if not isinstance(root, dict):
        raise InputError("the track is no GeoJSON object", where=where)
    return root


def _refused(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"a key stands twice: {next(n for n in names if names.count(n) > 1)}")
    return found


def _stated_frame(root: dict[str, Any], where: str) -> str:
    """Frame of the member `crs` that GeoJSON had before RFC 7946."""
    crs = root.get("crs")
    if crs is None:
        return ""
    named = crs.get("properties") if isinstance(crs, dict) else None
    name = str(named.get("name", "")) if isinstance(named, dict) else ""
    words = name.upper().split(":")  # EPSG:4326, urn:ogc:def:crs:EPSG::4326
    for (authority, code), frame in _DEGREES.items():
        if authority in words and words[-1] == code:
            return frame
    raise InputError(
        "the track is not in degrees of WGS 84", where=where, evidence=f"crs {str(crs)[:120]}",
        cure="write it as RFC 7946 says: longitude, latitude in degrees, without 'crs'",
    )  # fmt: skip


def _line(
    root: dict[str, Any], track_id: str | None, where: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Geometry and properties of the one line."""
    kind = root.get("type")
    if kind in _LINES:
        return root, {}
    features = root.get("features") if kind == "FeatureCollection" else [root]
    if kind not in ("Feature", "FeatureCollection") or not isinstance(features, list):
        raise InputError(
            "the track is no line", where=where, evidence=f"type {str(kind)[:40]!r}",
            cure="give a LineString, a MultiLineString, a Feature or a FeatureCollection",
        )  # fmt: skip
    lines = []
    for feature in features:
        geometry = feature.get("geometry") if isinstance(feature, dict) else None
        if isinstance(geometry, dict) and geometry.get("type") in _LINES:
            properties = feature.get("properties")
            lines.append((geometry, properties if isinstance(properties, dict) else {}))
    names = [str(properties.get("track_id", "")) for _, properties in lines]
    if track_id is not None:
        lines = [line for line, name in zip(lines, names, strict=True) if name == track_id]
    if len(lines) != 1:
        raise InputError(
            f"the file has {len(lines) or 'no'} line"
            + ("" if track_id is None else f" with track_id {track_id!r}"),
            where=where,
            evidence=f"track_id of its lines: {', '.join(names)[:200]}" if names else "",
            cure="name one with --track-id; one track in parts is a MultiLineString",
        )
    return lines[0]


def _part(line: Any, where: str) -> NDArray[np.float64]:
    """(v, 3) latitude, longitude, third coordinate (NaN where there is none)."""
    sizes = {len(p) if isinstance(p, list) else 0 for p in line} if isinstance(line, list) else {0}
    if sizes not in ({2}, {3}):
        raise InputError(
            "places of a track are [longitude, latitude] or [longitude, latitude, height]",
            where=where,
            evidence=f"places of {', '.join(map(str, sorted(sizes)))} numbers",
            cure="give all places of a track alike",
        )
    if any(type(value) not in (int, float) for place in line for value in place):
        raise InputError("a coordinate of the track is no number", where=where)
    try:
        places = np.array(line, dtype=float)
    except OverflowError:
        places = np.full((len(line), 2), np.inf)
    if not np.isfinite(places).all():
        raise InputError("a coordinate of the track is not finite", where=where)
    lon, lat = places[:, 0], places[:, 1]
    if np.abs(places[:, :2]).max() > 360:
        raise InputError(
            "the track's coordinates are no degrees", where=where,
            evidence=f"{lon[0]:.6g}, {lat[0]:.6g}",
            cure="convert easting and northing to longitude and latitude",
        )  # fmt: skip
    if np.abs(lat).max() > 90 or np.abs(lon).max() > 180:
        swapped = np.abs(lon).max() <= 90
        raise InputError(
            "latitude and longitude of the track are swapped" if swapped
            else "the track is not on Earth",
            code="E12", where=where,
            evidence=f"{lon.min():.6g}..{lon.max():.6g}, {lat.min():.6g}..{lat.max():.6g}",
            cure="GeoJSON gives the longitude first, -180..180",
        )  # fmt: skip
    third = places[:, 2] if places.shape[1] == 3 else np.full(len(places), np.nan)
    return np.column_stack([lat, lon, third])


def _with_heights(
    parts: tuple[NDArray[np.float64], ...], kind: Any, geoid: float | None, where: str
) -> list[NDArray[np.float64]]:
    if not any(np.isfinite(part[0, 2]) for part in parts):
        return list(parts)
    shift = {"ellipsoidal": 0.0, "geoid": geoid, "ignore": math.nan}
    if not isinstance(kind, str) or kind not in shift or shift[kind] is None:
        raise InputError(
            "the track's heights have no undulation"
            if kind == "geoid"
            else "nobody said what the track's heights are above",
            where=where,
            evidence=f"first height {parts[0][0, 2]:.3f} m; geoid and ellipsoid part by 45 m in "
            "Central Europe",
            cure=_HEIGHT_CURES["geoid" if kind == "geoid" else ""],
        )
    return [part + np.array([0.0, 0.0, shift[kind]]) for part in parts]


def _starts(given: Any, parts: int, where: str) -> tuple[float, ...]:
    if given is None and parts == 1:
        return (0.0,)
    starts = given if isinstance(given, list) else [given]
    if given is None or len(starts) != parts:
        raise InputError(
            "each part of a track needs its start of distance", where=where,
            evidence=f"{parts} parts, kp_start_m {given!r}"[:200],
            cure="property kp_start_m: [0, 12500], a number for each part",
        )  # fmt: skip
    return tuple(_number(start, "kp_start_m", where) for start in starts)


def _number(value: Any, name: str, where: str) -> float:
    if type(value) not in (int, float) or not abs(value) < 1e9:
        raise InputError(f"{name} is a number of metres", where=where, evidence=repr(value)[:80])
    return float(value)
