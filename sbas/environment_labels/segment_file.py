"""Environment segments from a CSV file."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sbas.environment_labels.segments import EnvironmentSegments, TimeSegment, TrackSegment
from sbas.exceptions import InputError
from sbas.timescales import TimeScale, to_gps

_BY_TIME = ["begin", "end", "label"]
_BY_DISTANCE = ["from_m", "label", "to_m"]
_DAY = r"\d{4}-\d\d-\d\d"
_STAMP = re.compile(rf"({_DAY}(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d{{1,9}})?)?)?)(Z|[+-]\d\d:?\d\d)?")
_NUMBER = re.compile(r"[+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?")


def load_segments(
    path: str | os.PathLike[str], *, time_scale: TimeScale = "GPST"
) -> EnvironmentSegments:
    """Environment segments from a CSV file.

    Parameters
    ----------
    path : a file with the header `label,begin,end` (ISO 8601 dates and times) or
        `label,from_m,to_m`, this with or without `track_id`; fields in any order.
    time_scale : of the times in the file; those marked `Z` are UTC whatever it says.

    Raises
    ------
    InputError : unknown or missing fields, a time or number that cannot be read, times of which
        only some are marked as UTC, an offset from UTC, or segments that EnvironmentSegments
        refuses.
    """
    source = Path(path)
    try:
        lines = source.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            "the segments cannot be read", where=str(source), evidence=str(error),
            cure="give a CSV file in UTF-8",
        ) from error  # fmt: skip
    rows = csv.reader(lines, strict=True)
    segments: list[TimeSegment | TrackSegment] = []
    try:
        header = [name.strip() for name in next(rows, [])]
        make = _maker(header, time_scale)
        for row in rows:
            if row and len(row) != len(header):
                raise InputError(f"{len(row)} fields where the header has {len(header)}")
            if row:
                segments.append(make(dict(zip(header, map(str.strip, row), strict=True))))
    except csv.Error as error:
        raise InputError(
            "the line is no CSV", where=f"{source}, line {rows.line_num}", evidence=str(error)
        ) from error
    except InputError as error:
        error.where = f"{source}, line {max(rows.line_num, 1)}"
        raise
    try:
        return EnvironmentSegments(tuple(segments))  # type: ignore[arg-type]
    except InputError as error:
        error.where = str(source)
        raise


def _maker(
    header: list[str], time_scale: TimeScale
) -> Callable[[dict[str, str]], TimeSegment | TrackSegment]:
    """What makes a segment of a row's fields."""
    if sorted(header) == _BY_TIME:
        marked: set[bool] = set()
        return lambda row: TimeSegment(
            _time(row["begin"], time_scale, marked),
            _time(row["end"], time_scale, marked),
            row["label"],
        )
    if sorted(header) in (_BY_DISTANCE, sorted([*_BY_DISTANCE, "track_id"])):
        return lambda row: TrackSegment(
            _metres(row["from_m"]), _metres(row["to_m"]), row["label"], row.get("track_id", "")
        )
    raise InputError(
        "the header names other fields than those of segments",
        evidence=",".join(header),
        cure="label,begin,end or label,from_m,to_m (this with track_id where tracks have one)",
    )


def _time(text: str, scale: TimeScale, marked: set[bool]) -> np.datetime64:
    """GPS time of a stamp; `marked` collects whether the file's stamps name UTC."""
    match = _STAMP.fullmatch(text)
    try:
        if match is None:
            raise ValueError("not of the form 2026-11-22T06:30:00.000")
        time = np.datetime64(match[1], "ns")
    except ValueError as error:
        raise InputError(
            f"no time: {text!r}", evidence=str(error), cure="write ISO 8601, as in "
            "2026-11-22T06:30:00",
        ) from error  # fmt: skip
    if match[2] not in (None, "Z"):
        raise InputError(
            f"{text!r} names an offset from UTC", cure="write UTC with a Z, or GPS time without"
        )
    marked.add(bool(match[2]))
    if len(marked) > 1 and scale != "UTC":
        raise InputError(
            f"some times are marked as UTC, and others are taken as {scale}",
            evidence=repr(text),
            cure="mark all times with Z, or none",
        )
    gps: np.datetime64 = to_gps(np.array([time]), "UTC" if match[2] else scale)[0]
    return gps


def _metres(text: str) -> float:
    if not _NUMBER.fullmatch(text):
        raise InputError(f"no distance in metres: {text!r}", cure="write it as in 1250.5")
    return float(text)
