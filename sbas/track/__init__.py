"""A track centre line: distance along it, error across it, azimuth."""

from sbas.track.centre_line import Track, TrackLine
from sbas.track.pieces import TrackPosition
from sbas.track.track_check import track_findings

__all__ = ["Track", "TrackLine", "TrackPosition", "track_findings"]
