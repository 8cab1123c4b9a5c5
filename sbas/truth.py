"""Where the antenna really was: a surveyed point, a reference trajectory or a track.

Positions are geodetic on WGS 84 / GRS 80 with ellipsoidal heights. The truth's own uncertainty
travels with it, since an error cannot be known better than the truth it is formed against.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import pandas as pd
import pymap3d
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.frames import (
    Changed,
    FrameChange,
    change_frame,
    decimal_year,
    find_frame,
    frame_change,
    frame_doubts,
)
from sbas.recording import RecordingMeta
from sbas.timescales import NS_PER_S
from sbas.track import Track, TrackLine

Floats = NDArray[np.float64]

UNSTATED_FRAME_SIGMA_M = 1.0
"""Allowed for a truth without a stated frame: ITRF and ETRS89 part by 2.5 cm a year since 1989."""

MOST_ACCELERATION_MPS2 = 10.0
"""No vehicle on rails or roads is accelerated more; bounds the bend of an interpolation."""


def unstated_sigma_m(frame: str) -> float:
    """What is allowed for a frame that nobody stated [m]; 0 where somebody did."""
    return 0.0 if frame else UNSTATED_FRAME_SIGMA_M


class TruePosition(NamedTuple):
    """True antenna positions at (n,) epochs; NaN where the truth does not reach."""

    lat_deg: Floats
    lon_deg: Floats
    height_m: Floats
    sigma_h_m: Floats
    sigma_v_m: Floats


@dataclass(frozen=True)
class FixedPoint:
    """A surveyed point.

    Parameters
    ----------
    lat_deg, lon_deg : geodetic coordinates [deg].
    height_m : height of the mark above the ellipsoid [m].
    antenna_height_m : reference point of the receiver's positions above the mark [m].
    sigma_h_m, sigma_v_m : 1-sigma of the survey [m], horizontal (any direction) and vertical.
    frame : such as "ITRF2014 2010.0"; empty where nobody stated it, which adds 1 m.
    lower_bound : True for a recording's own median: errors against it are too small.
    transformation : how the point came into its frame, for reports.

    Raises
    ------
    InputError : coordinates out of range, or a sigma that is negative.
    """

    lat_deg: float
    lon_deg: float
    height_m: float
    antenna_height_m: float = 0.0
    sigma_h_m: float = 0.02
    sigma_v_m: float = 0.03
    frame: str = ""
    lower_bound: bool = False
    transformation: str = ""

    def __post_init__(self) -> None:
        if not (abs(self.lat_deg) <= 90 and abs(self.lon_deg) <= 180):
            raise InputError(
                "the true position is not on Earth",
                evidence=f"latitude {self.lat_deg}, longitude {self.lon_deg} [deg]",
                cure="give --truth LAT,LON,HEIGHT in decimal degrees and metres",
            )
        _check_heights(height_m=self.height_m, antenna_height_m=self.antenna_height_m)
        if not (0 <= self.sigma_h_m < 1e6 and 0 <= self.sigma_v_m < 1e6):
            raise InputError("the uncertainty of the truth must be 0 m or more")

    @property
    def label(self) -> str:
        if self.lower_bound:
            return "median of the recording itself"
        place = f"{self.lat_deg:.8f}, {self.lon_deg:.8f}, {self.height_m:.3f} m"
        return "; ".join(filter(None, (f"fixed point {place}", self.transformation)))

    def at(self, time: NDArray[np.datetime64]) -> TruePosition:
        """The point at every one of (n,) epochs."""
        extra = 0.0 if self.lower_bound else unstated_sigma_m(self.frame)
        values = (
            self.lat_deg,
            self.lon_deg,
            self.height_m + self.antenna_height_m,
            float(np.hypot(self.sigma_h_m, extra)),
            float(np.hypot(self.sigma_v_m, extra)),
        )
        return TruePosition(*(np.broadcast_to(v, time.shape) for v in values))


def _check_heights(**heights_m: float) -> None:
    for name, value in heights_m.items():
        if not abs(value) < 20_000:
            raise InputError(
                f"the truth's {name} is out of range",
                evidence=f"{value} m",
                cure="give metres above the ellipsoid",
            )


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A reference trajectory, interpolated only where its own steps are short enough.

    Parameters
    ----------
    table : index `time` (GPS time, increasing), columns lat_deg, lon_deg, height_m and
        optionally sigma_h_m, sigma_v_m, heading_deg.
    antenna_height_m : reference point of the receiver's positions above the trajectory's [m].
    max_step_s : longest step of the trajectory that is interpolated [s]; elsewhere no error
        is formed.
    sigma_h_m, sigma_v_m : used where the table has none.
    frame, transformation : as for FixedPoint.

    Raises
    ------
    InputError : missing columns, times out of order, or fewer than two points.
    """

    table: pd.DataFrame
    antenna_height_m: float = 0.0
    max_step_s: float = 1.0
    sigma_h_m: float = 0.02
    sigma_v_m: float = 0.03
    frame: str = ""
    transformation: str = ""

    lower_bound = False

    def __post_init__(self) -> None:
        needed = {"lat_deg", "lon_deg", "height_m"}
        if absent := needed - set(self.table.columns):
            raise InputError(
                "the trajectory lacks columns",
                evidence=", ".join(sorted(absent)),
                cure="give time, lat_deg, lon_deg and height_m (ellipsoidal)",
            )
        if self.table.index.dtype != np.dtype("M8[ns]") or len(self.table) < 2:
            raise InputError(
                "a trajectory has two or more points with GPS time",
                evidence=f"{len(self.table)} points, times of dtype {self.table.index.dtype}",
            )
        steps = np.diff(self._time_ns)
        if np.any(steps <= 0):
            raise InputError(
                "the trajectory's times do not increase",
                where=f"after point {int(np.argmax(steps <= 0)) + 1}",
                cure="sort it and keep one point a time",
            )
        if not 0 < self.max_step_s < np.inf:
            raise InputError("max_step_s must be above 0 s", evidence=f"{self.max_step_s}")
        _check_heights(antenna_height_m=self.antenna_height_m)
        sigmas = [self.sigma_h_m, self.sigma_v_m]
        sigmas += [v for n in ("sigma_h_m", "sigma_v_m") if n in self.table for v in self.table[n]]
        if not all(sigma >= 0 for sigma in sigmas if not np.isnan(sigma)):
            raise InputError("the uncertainty of the truth must be 0 m or more")

    @property
    def _time_ns(self) -> NDArray[np.int64]:
        return self.table.index.to_numpy().astype(np.int64)  # type: ignore[no-any-return]

    @property
    def label(self) -> str:
        points = f"trajectory of {len(self.table):,} points"
        return "; ".join(filter(None, (points, self.transformation)))

    def at(self, time: NDArray[np.datetime64]) -> TruePosition:
        """True positions at (n,) epochs: cubic in ECEF between points at most `max_step_s` apart.

        The cubic keeps the shape of its points (Fritsch and Carlson 1980), so that noise on two
        of them makes no overshoot, as a spline's would; where it leaves the chord farther than
        an acceleration of `MOST_ACCELERATION_MPS2` can (a h^2 / 8), the chord stands. The sigma
        at an epoch is the larger one of its two neighbours', and the distance from the chord,
        which bounds what the interpolation may have invented.
        """
        from scipy.interpolate import PchipInterpolator  # loaded only for trajectories

        knots = self._time_ns
        epochs = np.asarray(time, "M8[ns]").astype(np.int64)
        ecef = np.column_stack(
            pymap3d.geodetic2ecef(*(self.table[c].to_numpy(float) for c in _POSITION))
        )
        result = np.full((epochs.size, 3), np.nan)
        bend_m = np.zeros(epochs.size)
        known = np.isfinite(ecef).all(axis=1)
        steps = np.diff(knots)
        joined = (steps <= self.max_step_s * NS_PER_S) & known[1:] & known[:-1]
        segment_of_knot = np.concatenate([[0], np.cumsum(~joined)])
        left = np.clip(np.searchsorted(knots, epochs, side="right") - 1, 0, knots.size - 1)
        right = np.clip(np.searchsorted(knots, epochs, side="left"), 0, knots.size - 1)
        inside = np.flatnonzero(
            (segment_of_knot[left] == segment_of_knot[right])
            & (epochs >= knots[0])
            & (epochs <= knots[-1])
            & known[left]
        )
        order = inside[np.argsort(segment_of_knot[left[inside]], kind="stable")]
        segments, starts = np.unique(segment_of_knot[left[order]], return_index=True)
        # One spline a segment: a polynomial must not be drawn across a step that is too long.
        for segment, rows in zip(segments, np.split(order, starts[1:]), strict=False):
            nodes = np.arange(*np.searchsorted(segment_of_knot, [segment, segment + 1]))
            # Seconds from the segment's start: exact to nanoseconds for a year.
            x = (knots[nodes] - knots[nodes[0]]) / NS_PER_S
            at = (epochs[rows] - knots[nodes[0]]) / NS_PER_S
            chord = np.column_stack([np.interp(at, x, ecef[nodes, i]) for i in range(3)])
            cubic = chord if nodes.size < 3 else PchipInterpolator(x, ecef[nodes])(at)
            bend = np.linalg.norm(cubic - chord, axis=1)
            step_s = (knots[right[rows]] - knots[left[rows]]) / NS_PER_S
            most = MOST_ACCELERATION_MPS2 * step_s**2 / 8
            result[rows] = np.where((bend <= most)[:, None], cubic, chord)
            bend_m[rows] = np.minimum(bend, most)
        lat, lon, height = pymap3d.ecef2geodetic(*result.T)
        extra = unstated_sigma_m(self.frame)
        sigmas = []
        for name in ("sigma_h_m", "sigma_v_m"):
            usual = np.full(knots.size, getattr(self, name))
            own = self.table[name].to_numpy(float) if name in self.table else usual
            own = np.where(np.isfinite(own), own, usual)
            larger = np.hypot(np.maximum(own[left], own[right]), bend_m)
            sigmas.append(np.where(np.isnan(result[:, 0]), np.nan, np.hypot(larger, extra)))
        height = np.asarray(height) + self.antenna_height_m
        return TruePosition(np.asarray(lat), np.asarray(lon), height, *sigmas)

    def heading_deg(self, time: NDArray[np.datetime64]) -> Floats:
        """Heading of the table at (n,) epochs [deg], 0..360, turned evenly between two points.

        NaN where the table has none, where steps are too long, and between headings that are
        90 degrees or more apart, since nothing tells which way the vehicle turned.
        """
        knots = self._time_ns
        epochs = np.asarray(time, "M8[ns]").astype(np.int64)
        if "heading_deg" not in self.table:
            return np.full(epochs.size, np.nan)
        heading = self.table["heading_deg"].to_numpy(float)
        left = np.clip(np.searchsorted(knots, epochs, side="right") - 1, 0, knots.size - 1)
        right = np.clip(np.searchsorted(knots, epochs, side="left"), 0, knots.size - 1)
        step = knots[right] - knots[left]
        turn = (heading[right] - heading[left] + 180) % 360 - 180
        share = np.where(step > 0, (epochs - knots[left]) / np.maximum(step, 1), 0.0)
        inside = (epochs >= knots[0]) & (epochs <= knots[-1])
        known = inside & (step <= self.max_step_s * NS_PER_S) & (np.abs(turn) < 90)
        return np.where(known, (heading[left] + share * turn) % 360, np.nan)

    def motion_deg(self, time: NDArray[np.datetime64], *, above_mps: float) -> Floats:
        """Direction of motion at (n,) epochs [deg], 0..360: from a second before to one after.

        NaN where the truth does not reach that far, and at `above_mps` [m/s] or slower.
        """
        second = np.timedelta64(NS_PER_S, "ns")
        epochs = np.asarray(time, "M8[ns]")
        before, after = (self.at((epochs + d).astype("M8[ns]")) for d in (-second, second))
        east, north, _ = east_north_up_m(after.lat_deg, after.lon_deg, after.height_m, before)
        known = np.hypot(east, north) / 2 > above_mps
        return np.where(known, np.degrees(np.arctan2(east, north)) % 360, np.nan)


_POSITION = ("lat_deg", "lon_deg", "height_m")

Truth = FixedPoint | Trajectory | TrackLine

Framed = TypeVar("Framed", bound=FixedPoint | Trajectory | TrackLine | Track)


def transformed(truth: Framed, change: str) -> Framed:
    """A truth or a track in another frame, by a named transformation.

    Parameters
    ----------
    truth : what to move; its sigma grows by the accuracy of the transformation.
    change : such as "ETRF2000>ITRF2014@2025.5"; see `sbas.frames`. A trajectory's points have
        their own times as epochs where no epoch is named.

    Raises
    ------
    InputError : as `sbas.frames.change_frame`, or the truth is said to be in another frame than
        the one that the change begins with.
    """
    steps = frame_change(change)
    if truth.frame:
        stated, epoch = find_frame(truth.frame), steps.source.epoch
        if stated.code != steps.source.code or (epoch and stated.epoch not in (None, epoch)):
            raise InputError(
                "the truth's frame is not the one that the transformation begins with",
                evidence=f"{truth.frame}, and {change!r}",
                cure=f"begin with it: '{truth.frame}>...'",
            )
        if stated.epoch is not None:
            steps = replace(steps, source=replace(steps.source, epoch=stated.epoch))
    moved: Any
    if isinstance(truth, FixedPoint):
        moved = _moved_point(truth, steps)
    elif isinstance(truth, Trajectory):
        moved = _moved_trajectory(truth, steps)
    elif isinstance(truth, Track):
        moved = _moved_track(truth, steps)
    else:
        moved = replace(truth, track=_moved_track(truth.track, steps))
    return moved  # type: ignore[no-any-return]


def _moved_point(truth: FixedPoint, steps: FrameChange) -> FixedPoint:
    done = change_frame(steps, truth.lat_deg, truth.lon_deg, truth.height_m)
    lat, lon, height = (float(v[0]) for v in (done.lat_deg, done.lon_deg, done.height_m))
    return replace(truth, lat_deg=lat, lon_deg=lon, height_m=height, **_known(truth, done))


def _moved_trajectory(truth: Trajectory, steps: FrameChange) -> Trajectory:
    position = (truth.table[name].to_numpy(float) for name in _POSITION)
    done = change_frame(steps, *position, epoch=decimal_year(truth.table.index))
    table = truth.table.assign(**dict(zip(_POSITION, done[:3], strict=True)))
    for name in ("sigma_h_m", "sigma_v_m"):
        if name in table:
            table[name] = np.hypot(table[name], done.sigma_m)
    return replace(truth, table=table, **_known(truth, done))


def _moved_track(track: Track, steps: FrameChange) -> Track:
    lat, lon, height = np.concatenate(track.parts).T
    done = change_frame(steps, lat, lon, np.nan_to_num(height))
    up = np.where(np.isnan(height), np.nan, done.height_m)
    places = np.column_stack([done.lat_deg, done.lon_deg, up])
    cuts = np.cumsum([len(part) for part in track.parts])[:-1]
    return replace(
        track,
        parts=tuple(np.split(places, cuts)),
        sigma_m=float(np.hypot(track.sigma_m, done.sigma_m)),
        frame=str(done.frame),
        transformation=done.description,
    )


def _known(truth: FixedPoint | Trajectory, done: Changed) -> dict[str, Any]:
    """How well a truth is known after a change of frame, and what was done."""
    return {
        "sigma_h_m": float(np.hypot(truth.sigma_h_m, done.sigma_m)),
        "sigma_v_m": float(np.hypot(truth.sigma_v_m, done.sigma_m)),
        "frame": str(done.frame),
        "transformation": done.description,
    }


def east_north_up_m(
    lat_deg: ArrayLike, lon_deg: ArrayLike, height_m: ArrayLike, truth: TruePosition
) -> tuple[Floats, Floats, Floats]:
    """Signed east, north and up of positions from the truth [m], in the truth's tangent plane.

    Parameters
    ----------
    lat_deg, lon_deg, height_m : (n,) geodetic positions [deg, m]; where only the height is
        missing, east and north are formed at the truth's height and up is NaN.
    truth : (n,) true positions.
    """
    height = np.asarray(height_m, dtype=float)
    flat = np.isnan(height)
    used = np.where(flat, truth.height_m, height)
    east, north, up = pymap3d.geodetic2enu(
        lat_deg, lon_deg, used, truth.lat_deg, truth.lon_deg, truth.height_m
    )
    return np.asarray(east), np.asarray(north), np.where(flat, np.nan, up)


def frame_findings(
    meta: RecordingMeta, truth: Truth | None, *, year: float | None = None
) -> tuple[Finding, ...]:
    """E09 where the frame of a truth makes errors that are none of the receiver.

    It is not stated; it is not known; its ellipsoid is not that of GNSS; its coordinates are of
    another year; or it is another frame than the recording's, and no transformation was named.

    Parameters
    ----------
    meta : of the recording.
    truth : None, and a recording's own median, have no frame to compare.
    year : decimal year of the recording, where known.
    """
    if truth is None or (isinstance(truth, FixedPoint) and truth.lower_bound):
        return ()
    if not truth.frame:
        return (
            Finding(
                "E09", "warning",
                "the truth's reference frame is not stated: errors may be wrong by some 1 m",
                evidence="ITRF and ETRS89 part by about 2.5 cm a year since 1989; the 1 m is in "
                "truth_sigma_h_m, no error and no count is changed by it",
                cure="--frame, such as --frame 'ETRF2000'",
            ),
        )  # fmt: skip
    try:
        frame = find_frame(truth.frame)
    except InputError as error:
        return (
            Finding(
                "E09", "warning",
                f"the truth's frame {truth.frame!r} is not known and was not compared",
                evidence=error.evidence, cure=error.cure,
            ),
        )  # fmt: skip
    return tuple(frame_doubts(frame, meta.frame, year))
