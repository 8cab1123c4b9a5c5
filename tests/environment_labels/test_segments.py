"""Segments: half-open, in any order, and nothing that cannot be meant."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.environment_labels import EnvironmentSegments, TimeSegment, TrackSegment
from sbas.exceptions import InputError


def at(text: str) -> np.datetime64:
    return np.datetime64(f"2026-11-22T{text}", "ns")


BY_TIME = EnvironmentSegments(
    (
        TimeSegment(at("07:00"), at("07:10"), "tunnel"),
        TimeSegment(at("06:00"), at("07:00"), "open"),
        TimeSegment(at("08:00"), at("08:00:00.5"), "open"),
    )
)


def test_each_segment_has_its_begin_and_not_its_end() -> None:
    times = ["05:59:59", "06:00", "06:59:59.999999999", "07:00", "07:09", "07:10", "08:00"]
    codes = BY_TIME.lookup()(np.array([at(t) for t in times]).astype(np.int64))
    names = [BY_TIME.labels[c] if c >= 0 else None for c in codes]
    assert names == [None, "open", "open", "tunnel", "tunnel", None, "open"]
    assert BY_TIME.labels == ("tunnel", "open")
    assert str(BY_TIME) == "3 segments by time: tunnel, open"


def test_distances_outside_and_unknown_have_no_label() -> None:
    segments = EnvironmentSegments(
        (TrackSegment(0, 1000, "open"), TrackSegment(1000.0, 1500.5, "cutting"))
    )
    found = segments.lookup()(np.array([-0.1, 0.0, 999.9, 1000.0, 1500.5, np.nan]))
    assert found.tolist() == [-1, 0, 0, 1, -1, -1]


def test_segments_of_another_track_are_left_out() -> None:
    segments = EnvironmentSegments(
        (
            TrackSegment(0, 1000, "open", "1"),
            TrackSegment(0, 1000, "tunnel", "2"),
            TrackSegment(1000, 2000, "urban"),
        )
    )
    places = np.array([500.0, 1500.0])
    names = {i: [segments.labels[c] for c in segments.lookup(i)(places)] for i in ("1", "2")}
    assert names == {"1": ["open", "urban"], "2": ["tunnel", "urban"]}
    only = EnvironmentSegments((TrackSegment(0, 1000, "open", "1"),))
    with pytest.raises(InputError, match="no segment is of the track '3'") as refused:
        only.lookup("3")
    assert refused.value.evidence == "segments are of 1"


@given(st.lists(st.integers(0, 50), min_size=2, max_size=12, unique=True), st.data())
def test_neighbours_share_the_line_without_overlap_or_rest(
    borders: list[int], data: st.DataObject
) -> None:
    borders.sort()
    made = [TrackSegment(a, b, f"s{i}") for i, (a, b) in enumerate(itertools.pairwise(borders))]
    segments = EnvironmentSegments(tuple(data.draw(st.permutations(made))))
    places = np.arange(-1, 52, 0.5)
    codes = segments.lookup()(places)
    for place, code in zip(places, codes, strict=True):
        inside = [s.label for s in made if s.from_m <= place < s.to_m]
        assert ([segments.labels[code]] if code >= 0 else []) == inside


@pytest.mark.parametrize(
    ("segments", "words"),
    [
        ((), "no segment"),
        ((TrackSegment(0, 1, "a"), TimeSegment(at("06:00"), at("07:00"), "a")), "all by time"),
        ((TrackSegment(0, 10, "a"), TrackSegment(9, 20, "b")), "overlap"),
        ((TrackSegment(0, 10, "a", "1"), TrackSegment(9, 20, "b")), "overlap"),
        ((TrackSegment(0, 100, "a"), TrackSegment(10, 20, "b")), "overlap"),
        (
            (
                TimeSegment(at("06:00"), at("07:00"), "a"),
                TimeSegment(at("06:59:59"), at("08:00"), "a"),
            ),
            "overlap",
        ),
        ((TrackSegment(10, 10, "a"),), "ends at or before"),
        ((TrackSegment(10, 0, "a"),), "ends at or before"),
        ((TrackSegment(0, float("nan"), "a"),), "ends at or before"),
        ((TimeSegment(at("07:00"), at("06:00"), "a"),), "ends at or before"),
        ((TimeSegment(at("07:00"), np.datetime64("NaT", "ns"), "a"),), "ends at or before"),
        ((TrackSegment(0, 10, ""),), "no label"),
        ((TrackSegment(0, 10, " open"),), "no label"),
        ((TrackSegment(0, 10, "unlabelled"),), "no label"),
    ],
)
def test_what_cannot_be_meant_is_refused(segments: tuple[TimeSegment, ...], words: str) -> None:
    with pytest.raises(InputError, match=words):
        EnvironmentSegments(segments)


def test_overlaps_of_different_tracks_are_none() -> None:
    EnvironmentSegments((TrackSegment(0, 10, "a", "1"), TrackSegment(5, 20, "b", "2")))
