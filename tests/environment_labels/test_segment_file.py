"""Segments from CSV: both headers, time scales, and errors that name the line."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from sbas.environment_labels import TimeSegment, TrackSegment, load_segments
from sbas.exceptions import InputError


def written(path: Path, text: str) -> Path:
    file = path / "segments.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_by_time_in_any_order_of_fields(tmp_path: Path) -> None:
    file = written(
        tmp_path,
        "\ufeffbegin, end, label\n2026-11-22T06:00:00,2026-11-22 06:10:00.25,open\n\n"
        '2026-11-22T06:10:00.25,2026-11-23,"forest, dense"\n',
    )
    assert load_segments(file).segments == (
        TimeSegment(
            np.datetime64("2026-11-22T06:00:00"), np.datetime64("2026-11-22T06:10:00.25"), "open"
        ),
        TimeSegment(
            np.datetime64("2026-11-22T06:10:00.25"), np.datetime64("2026-11-23"), "forest, dense"
        ),
    )


def test_utc_becomes_gps_time(tmp_path: Path) -> None:
    file = written(tmp_path, "label,begin,end\nopen,2026-11-22T06:00:00Z,2026-11-22T06:10:00\n")
    segment = load_segments(file, time_scale="UTC").segments[0]
    assert isinstance(segment, TimeSegment)
    # 18 leap seconds since 2017-01-01 (IERS Bulletin C 52).
    assert segment.begin == np.datetime64("2026-11-22T06:00:18")
    assert segment.end == np.datetime64("2026-11-22T06:10:18")


@pytest.mark.parametrize("scale", ["GPST", "UTC"])
def test_a_zone_decides_for_itself(tmp_path: Path, scale: Literal["GPST", "UTC"]) -> None:
    file = written(tmp_path, "label,begin,end\nopen,2026-11-22T06:00:00Z,2026-11-22T06:10:00Z\n")
    segment = load_segments(file, time_scale=scale).segments[0]
    assert isinstance(segment, TimeSegment)
    assert segment.begin == np.datetime64("2026-11-22T06:00:18")
    assert segment.end == np.datetime64("2026-11-22T06:10:18")


def test_by_distance_with_and_without_a_track(tmp_path: Path) -> None:
    file = written(tmp_path, "label,from_m,to_m\nopen,-10.5,1e3\n")
    assert load_segments(file).segments == (TrackSegment(-10.5, 1000.0, "open"),)
    file = written(tmp_path, "track_id,label,from_m,to_m\n7,open,0,10\n,urban,10,20.5\n")
    assert load_segments(file).segments == (
        TrackSegment(0.0, 10.0, "open", "7"), TrackSegment(10.0, 20.5, "urban"),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "words", "line"),
    [
        ("", "header", 1),
        ("label,begin,end,colour\n", "header", 1),
        ("label,begin\n", "header", 1),
        ("label,from_m,end\n", "header", 1),
        ("label,from_m,to_m,to_m\n", "header", 1),
        ("label,begin,end,track_id\n", "header", 1),
        ("label,from_m,to_m\na,0,10\nb,10\n", "2 fields where the header has 3", 3),
        ("label,from_m,to_m\na,0,10,\n", "4 fields", 2),
        ("label,from_m,to_m\na,0,ten\n", "no distance in metres: 'ten'", 2),
        ("label,from_m,to_m\na,0,inf\n", "no distance in metres", 2),
        ("label,from_m,to_m\na,0,1_000\n", "no distance in metres", 2),
        ("label,begin,end\na,2026-11-22T06:00,22.11.2026\n", "no time: '22.11.2026'", 2),
        ("label,begin,end\na,2026-11-22T06:00,2026-13-22T06:00\n", "no time", 2),
        ("label,begin,end\na,2026-11-22T06:00,2026-11-22T06:00:60\n", "no time", 2),
        ("label,begin,end\na,2026-11-22T06:00Z,2026-11-22T07:00\n", "marked as UTC, and others", 2),
        ("label,begin,end\na,2026-11-22T06:00+02:00,2026-11-22T07:00\n", "offset from UTC", 2),
        ('label,from_m,to_m\n"a"b,0,1\n', "no CSV", 2),
    ],
)
def test_an_error_names_the_file_and_the_line(
    tmp_path: Path, text: str, words: str, line: int
) -> None:
    file = written(tmp_path, text)
    with pytest.raises(InputError, match=words) as refused:
        load_segments(file)
    assert refused.value.where == f"{file}, line {line}"


def test_what_segments_are_together_is_of_the_file(tmp_path: Path) -> None:
    for text, words in (
        ("label,from_m,to_m\n", "no segment"),
        ("label,from_m,to_m\na,0,10\n\nb,5,20\n", "overlap"),
        ("label,from_m,to_m\na,10,0\n", "ends at or before"),
    ):
        file = written(tmp_path, text)
        with pytest.raises(InputError, match=words) as refused:
            load_segments(file)
        assert refused.value.where == str(file)
    with pytest.raises(InputError, match="cannot be read"):
        load_segments(tmp_path / "absent.csv")
