"""Environment labels from segments: which epoch was in the open, in a cutting, in a tunnel."""

from sbas.environment_labels.labelled_epochs import MOST_BRIDGED_S, label_epochs
from sbas.environment_labels.segment_file import load_segments
from sbas.environment_labels.segments import (
    UNLABELLED,
    EnvironmentSegments,
    TimeSegment,
    TrackSegment,
)

__all__ = [
    "MOST_BRIDGED_S",
    "UNLABELLED",
    "EnvironmentSegments",
    "TimeSegment",
    "TrackSegment",
    "label_epochs",
    "load_segments",
]
