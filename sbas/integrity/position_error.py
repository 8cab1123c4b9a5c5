"""Position errors: what a recording says less where the antenna was."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.recording import Recording, with_columns
from sbas.track import Track, TrackLine
from sbas.truth import (
    FixedPoint,
    Trajectory,
    TruePosition,
    Truth,
    east_north_up_m,
    unstated_sigma_m,
)

Floats = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]


def position_errors(
    recording: Recording | pd.DataFrame,
    truth: Truth,
    *,
    track: Track | None = None,
    direction_above_mps: float | None = None,
) -> pd.DataFrame:
    """Signed errors of every epoch and their horizontal and vertical size.

    Parameters
    ----------
    recording : a Recording or its table, (n,) epochs indexed by GPS time.
    truth : FixedPoint, Trajectory, or TrackLine (then the error across the track stands for the
        horizontal one, which it bounds from below).
    track : the line that tells what is along and across.
    direction_above_mps : without a track and without `heading_deg` in the trajectory, take its
        own direction of motion where it is faster than this [m/s].

    Returns
    -------
    (n,) rows on the same index, NaN where position or truth is missing: `east_m`, `north_m`,
    `up_m` (position less truth, in the truth's tangent plane), `hpe_m` = hypot(east, north),
    `vpe_m` = |up|, and the truth's own 1-sigma `truth_sigma_h_m`, `truth_sigma_v_m`.
    Where a track, a heading or a motion gives an azimuth, also `along_m` (towards it), `across_m`
    (right of it) and `track_azimuth_deg`; with a track `distance_m` along it and
    `track_ambiguous`, both of the true position, so that no label depends on the error (of the
    position itself with a TrackLine, which knows no other).

    Raises
    ------
    InputError : a track beside a TrackLine, or a speed below 0.

    References
    ----------
    RTCA DO-229D, 1.7.2 (definitions of horizontal and vertical error).
    """
    if direction_above_mps is not None and not direction_above_mps >= 0:
        raise InputError("a speed is 0 m/s or more", evidence=f"{direction_above_mps} m/s")
    table = recording.table if isinstance(recording, Recording) else recording
    position = with_columns(table, ("lat_deg", "lon_deg", "height_m"))
    lat, lon, height = (position[name].to_numpy() for name in position)
    if isinstance(truth, TrackLine):
        if track is not None:
            raise InputError("the truth is a track already", cure="leave out the other track")
        columns = _from_line(lat, lon, height, truth)
    else:
        time = position.index.to_numpy()
        true = truth.at(time)
        columns = _from_position(lat, lon, height, true)
        columns |= _along(columns, truth, true, time, track, direction_above_mps)
    return pd.DataFrame(columns, index=position.index)


def _from_position(lat: Floats, lon: Floats, height: Floats, true: TruePosition) -> Columns:
    east, north, up = east_north_up_m(lat, lon, height, true)
    return {
        "east_m": east,
        "north_m": north,
        "up_m": up,
        "hpe_m": np.hypot(east, north),
        "vpe_m": np.abs(up),
        "truth_sigma_h_m": true.sigma_h_m,
        "truth_sigma_v_m": true.sigma_v_m,
    }


def _along(
    errors: Columns,
    truth: FixedPoint | Trajectory,
    true: TruePosition,
    time: NDArray[np.datetime64],
    track: Track | None,
    direction_above_mps: float | None,
) -> Columns:
    """The horizontal error turned into the track, where an azimuth is known."""
    more: Columns = {}
    if track is not None:
        fixed = isinstance(truth, FixedPoint)
        some = slice(0, 1) if fixed else slice(None)  # one place serves all epochs
        place = track.project(true.lat_deg[some], true.lon_deg[some], true.height_m[some])
        values = (place.azimuth_deg, place.distance_m, place.ambiguous)
        azimuth, distance, doubtful = (np.broadcast_to(v, time.shape) for v in values)
        more = {"distance_m": distance, "track_ambiguous": doubtful}
    elif isinstance(truth, Trajectory) and "heading_deg" in truth.table:
        azimuth = truth.heading_deg(time)
    elif isinstance(truth, Trajectory) and direction_above_mps is not None:
        azimuth = truth.motion_deg(time, above_mps=direction_above_mps)
    else:
        return {}
    s, c = np.sin(np.radians(azimuth)), np.cos(np.radians(azimuth))
    east, north = errors["east_m"], errors["north_m"]
    return {
        "along_m": east * s + north * c,
        "across_m": east * c - north * s,
        "track_azimuth_deg": azimuth,
        **more,
    }


def _from_line(lat: Floats, lon: Floats, height: Floats, truth: TrackLine) -> Columns:
    place = truth.track.project(lat, lon, height, reach_m=truth.reach_m)
    across, azimuth = place.across_m, np.radians(place.azimuth_deg)
    nothing = np.full(across.shape, np.nan)
    sigma = np.hypot(truth.track.sigma_m, unstated_sigma_m(truth.frame))
    return {
        "east_m": across * np.cos(azimuth),
        "north_m": -across * np.sin(azimuth),
        "up_m": nothing,
        "hpe_m": np.abs(across),
        "vpe_m": nothing,
        "truth_sigma_h_m": np.where(place.part >= 0, sigma, np.nan),
        "truth_sigma_v_m": nothing,
        "along_m": nothing,
        "across_m": across,
        "track_azimuth_deg": place.azimuth_deg,
        "distance_m": place.distance_m,
        "track_ambiguous": place.ambiguous,
    }
