"""Segments with their labels, by time or by distance along a track.

Both kinds are half-open, so that neighbours share no epoch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Numbers = Floats | Ints

UNLABELLED = "unlabelled"
"""Stands in results for the epochs that no segment and no label covers."""


@dataclass(frozen=True)
class TimeSegment:
    """Epochs from `begin` to before `end`, GPS time."""

    begin: np.datetime64
    end: np.datetime64
    label: str

    def __str__(self) -> str:
        return f"{self.label} {self.begin}..{self.end}"


@dataclass(frozen=True)
class TrackSegment:
    """The track from `from_m` to before `to_m`, metres along it; of any track without an id."""

    from_m: float
    to_m: float
    label: str
    track_id: str = ""

    def __str__(self) -> str:
        return f"{self.label} {self.from_m:g}..{self.to_m:g} m"


@dataclass(frozen=True)
class EnvironmentSegments:
    """Segments with their labels, all by time or all by distance, in any order.

    Raises
    ------
    InputError : no segment, both kinds, a label without text, an end that is not after its
        begin, or segments that overlap.
    """

    segments: tuple[TimeSegment, ...] | tuple[TrackSegment, ...]

    def __post_init__(self) -> None:
        if not self.segments:
            raise InputError("there is no segment", cure="give at least one, with its label")
        if len({type(s) for s in self.segments}) > 1:
            raise InputError("segments are all by time or all by distance")
        for segment in self.segments:
            if segment.label != segment.label.strip() or segment.label in ("", UNLABELLED):
                raise InputError(
                    f"no label: {segment.label!r}",
                    evidence=f"{UNLABELLED!r} stands for the epochs outside all segments",
                    cure="give a word, such as open, urban, woody, cutting or tunnel",
                )
        for track_id in sorted({s.track_id for s in self.segments if isinstance(s, TrackSegment)}):
            self._table(track_id)
        if not self.by_distance:
            self._table("")

    @property
    def by_distance(self) -> bool:
        return isinstance(self.segments[0], TrackSegment)

    @property
    def labels(self) -> tuple[str, ...]:
        """Each label once, in order of first appearance."""
        return tuple(dict.fromkeys(s.label for s in self.segments))

    def lookup(self, track_id: str = "") -> Callable[[Numbers], Ints]:
        """A function from (n,) GPS times [ns], or distances [m], to indices into `labels`.

        Parameters
        ----------
        track_id : of the track whose distances they are; segments of another one are left out.

        Returns
        -------
        The function; it gives -1 outside all segments and for NaN.
        """
        begin, end, code = self._table(track_id)

        def codes(at: Numbers) -> Ints:
            i = np.searchsorted(begin, at, side="right") - 1
            inside = (i >= 0) & (at < end[i])
            return np.where(inside, code[i], -1)

        return codes

    def _table(self, track_id: str) -> tuple[Numbers, Numbers, Ints]:
        """(s,) begins, ends and labels of one track's segments, in order and checked."""
        mine = [
            s for s in self.segments
            if isinstance(s, TimeSegment) or s.track_id in ("", track_id)
        ]  # fmt: skip
        if not mine:
            known = sorted({s.track_id for s in self.segments if isinstance(s, TrackSegment)})
            raise InputError(
                f"no segment is of the track {track_id!r}",
                evidence=f"segments are of {', '.join(known)}",
                cure="use the track's own id, or none",
            )
        mine.sort(key=lambda s: _ends(s)[0])
        ends = [_ends(s) for s in mine]
        for segment, (begin, end) in zip(mine, ends, strict=True):
            # Written so that NaN is refused.
            if not begin < end:
                raise InputError(
                    "a segment ends at or before its begin", evidence=str(segment),
                    cure="give begin and end in this order; a segment has a length",
                )  # fmt: skip
        for i in range(len(mine) - 1):
            if ends[i + 1][0] < ends[i][1]:
                raise InputError(
                    "two segments overlap", evidence=f"{mine[i]} and {mine[i + 1]}",
                    cure="let one end where the next begins: the end itself is not part of it",
                )  # fmt: skip
        begins, stops = (np.array(column) for column in zip(*ends, strict=True))
        return begins, stops, np.array([self.labels.index(s.label) for s in mine])

    def __str__(self) -> str:
        how = "distance along the track" if self.by_distance else "time"
        return f"{len(self.segments)} segments by {how}: {', '.join(self.labels)}"


def _ends(segment: TimeSegment | TrackSegment) -> tuple[float, float]:
    """Begin and end as numbers, of time in whole nanoseconds; NaN where there is none."""
    if isinstance(segment, TrackSegment):
        return segment.from_m, segment.to_m
    times = np.array([segment.begin, segment.end], "M8[ns]")
    if np.isnat(times).any():
        return math.nan, math.nan
    begin, end = times.astype(np.int64).tolist()
    return begin, end
