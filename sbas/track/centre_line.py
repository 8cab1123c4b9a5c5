"""A track centre line: where along it and how far across it positions lie.

Distance is measured horizontally, at the line's own heights where it has them, else on the
ellipsoid: railway chainage is measured in plan.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.track.pieces import MOST_HEIGHT_M, Pieces, TrackPosition, cut, place_of

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Track:
    """A centre line of one or more parts, which nothing joins.

    Parameters
    ----------
    parts : each (v, 3): latitude, longitude [deg], height above the ellipsoid [m]; heights are
        NaN throughout where they are not known.
    track_id : name.
    kp_start_m : distance at the start of each part [m]; one per part.
    sigma_m : 1-sigma of the line across itself [m]; NaN where nobody stated it.
    frame : such as "ITRF2014 2025.5"; empty where nobody stated it.
    transformation : how the line came into its frame, for reports.

    Raises
    ------
    InputError : a part with fewer than two places, coordinates out of range, vertices more than
        20 km apart, heights known in part, or a number of starts other than that of parts.
    """

    parts: tuple[Floats, ...]
    track_id: str = ""
    kp_start_m: tuple[float, ...] = (0.0,)
    sigma_m: float = np.nan
    frame: str = ""
    transformation: str = ""

    def __post_init__(self) -> None:
        if not self.parts or len(self.kp_start_m) != len(self.parts):
            raise InputError(
                "a track has one start of distance for each part",
                evidence=f"{len(self.parts)} parts, {len(self.kp_start_m)} starts",
                cure="kp_start_m with one number for each part, such as [0, 12500]",
            )
        if not np.isfinite(self.kp_start_m).all() or self.sigma_m < 0 or np.isinf(self.sigma_m):
            raise InputError(
                "kp_start_m and sigma_m are metres", evidence=f"{self.kp_start_m}, {self.sigma_m}"
            )
        for number, part in enumerate(self.parts):
            where = f"part {number + 1}"
            if part.ndim != 2 or part.shape[1] != 3 or len(part) < 2:
                raise InputError(
                    "a part of a track is two or more of latitude, longitude, height",
                    where=where,
                    evidence=f"an array of shape {part.shape}",
                )
            lat, lon, height = part.T
            if not (np.all(np.abs(lat) <= 90) and np.all(np.abs(lon) <= 180)):
                raise InputError(
                    "the track is not on Earth", code="E12", where=where,
                    evidence=f"latitude {lat.min():.6g}..{lat.max():.6g}, longitude "
                    f"{lon.min():.6g}..{lon.max():.6g}",
                    cure="degrees; in GeoJSON the longitude stands first",
                )  # fmt: skip
            known = np.isfinite(height)
            if (
                known.any() != known.all()
                or np.isinf(height).any()
                or np.any(np.abs(height[known]) > MOST_HEIGHT_M)
            ):
                raise InputError(
                    "a track has a height everywhere, in metres, or nowhere", where=where
                )
        if self.has_heights != any(np.isfinite(part[0, 2]) for part in self.parts):
            raise InputError("some parts of the track have heights and others have none")
        self.pieces  # noqa: B018  # a track that cannot be used is not built

    @property
    def has_heights(self) -> bool:
        return all(bool(np.isfinite(part[0, 2])) for part in self.parts)

    @property
    def length_m(self) -> float:
        """Length of all parts together, gaps between them not counted."""
        return float(self.pieces.length_m.sum())

    @property
    def label(self) -> str:
        name = f" {self.track_id}" if self.track_id else ""
        done = f"; {self.transformation}" if self.transformation else ""
        return f"track{name} of {self.length_m / 1000:.3f} km{done}"

    @cached_property
    def pieces(self) -> Pieces:
        """The line cut for the search; made once."""
        return cut(self.parts, self.kp_start_m)

    def project(
        self,
        lat_deg: ArrayLike,
        lon_deg: ArrayLike,
        height_m: ArrayLike | None = None,
        *,
        reach_m: float = 100.0,
        ambiguous_within_m: float = 3.0,
    ) -> TrackPosition:
        """Nearest place of the track for each position.

        Parameters
        ----------
        lat_deg, lon_deg : (n,) geodetic positions in the track's frame [deg].
        height_m : (n,) heights above the ellipsoid [m], where known.
        reach_m : farther from every part a position is off the track [m].
        ambiguous_within_m : another part, or a place elsewhere along the same one, that is
            farther by less than this makes a position ambiguous [m]; tracks of a double line
            are some 4 m apart.

        Returns
        -------
        TrackPosition. A position whose nearest place is the end of a part, and which lies
        beyond it, is off the track: an error along the line is none across it.
        Accuracy: better than 1 mm for vertices up to 20 km apart.
        """
        if not (0 < reach_m <= 10_000 and 0 <= ambiguous_within_m <= 1000):
            raise InputError(
                "the reach is up to 10 km, and ambiguity is judged within 1 km",
                evidence=f"reach {reach_m} m, within {ambiguous_within_m} m",
            )
        given = (lat_deg, lon_deg, np.nan if height_m is None else height_m)
        lat, lon, height = np.broadcast_arrays(*(np.array(v, float, ndmin=1) for v in given))
        known = np.isfinite(lat) & np.isfinite(lon)
        place = place_of(
            self.pieces, lat[known], lon[known], height[known], reach_m, ambiguous_within_m
        )
        missing = (np.nan, np.nan, np.nan, np.nan, -1, False)
        whole = [np.full(lat.size, nothing) for nothing in missing]
        for values, some in zip(whole, place, strict=True):
            values[known] = some
        return TrackPosition(*whole)


@dataclass(frozen=True, eq=False)
class TrackLine:
    """A centre line as truth: it gives the error across the track, and none along it.

    The error across is at most the horizontal one, so that every figure of it is a lower bound.
    An antenna that is not above the centre line, or on a canted curve, adds its offset.

    Parameters
    ----------
    track : with its sigma_m stated.
    reach_m : farther from the line no error is formed [m].

    Raises
    ------
    InputError : nobody stated how well the line is known.
    """

    track: Track
    reach_m: float = 100.0

    lower_bound = True

    def __post_init__(self) -> None:
        if np.isnan(self.track.sigma_m):
            raise InputError(
                "nobody stated how well the track is known",
                evidence=self.track.label,
                cure="property sigma_m in the file, or --track-sigma 0.5 (metres across the line)",
            )

    @property
    def frame(self) -> str:
        return self.track.frame

    @property
    def label(self) -> str:
        return f"track centre line: cross-track errors only; {self.track.label}"
