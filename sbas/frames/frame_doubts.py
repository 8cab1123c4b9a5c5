"""Whether the frames of a truth and a recording may be held against each other."""

from __future__ import annotations

import re
from collections.abc import Iterator

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.frames.named_frames import Frame, find_frame
from sbas.frames.transformation import PLATE_M_PER_YEAR

_ELLIPSOIDS_OF_GNSS = ("GRS 1980", "WGS 84")
_GLOBAL = re.compile(r"(itrf|igs|igb|wgs ?84)(?!.*transit)", re.IGNORECASE)


def frame_doubts(frame: Frame, recording: str, year: float | None) -> Iterator[Finding]:
    """E09 where a truth's frame makes errors that are none of the receiver.

    Parameters
    ----------
    frame : of the truth.
    recording : frame of the recording; empty where nobody stated it.
    year : decimal year of the recording, where known.
    """
    when = "2025.5" if year is None else f"{year:.1f}"
    if frame.ellipsoid not in _ELLIPSOIDS_OF_GNSS:
        yield Finding(
            "E09", "error",
            f"the truth is in {frame.name}, up to hundreds of metres from the receiver's frame",
            evidence=f"its ellipsoid is {frame.ellipsoid}",
            cure=f"--truth-transform '{frame.name}>ETRS89>ITRF2014@{when}'",
        )  # fmt: skip
        return
    if frame.dynamic and frame.epoch is not None and year is not None:
        years = abs(year - frame.epoch)
        if years > 1:
            yield Finding(
                "E09", "warning",
                f"the truth is of {frame.epoch:.8g}, the recording of {year:.1f}: the ground has "
                "moved since",
                evidence=f"by about {years * PLATE_M_PER_YEAR:.2f} m in Europe",
                cure=f"--truth-transform '{frame}>ETRF2014>{frame.name}@{when}'",
            )  # fmt: skip
    if recording and not _same_family(frame, recording):
        yield Finding(
            "E09", "warning",
            f"the truth is in {frame.name}, the recording in {recording}, and no transformation "
            "is named",
            evidence="ITRF, and with it WGS 84, and ETRS89 part by about 2.5 cm a year since "
            "1989: 0.9 m in 2026",
            cure=f"--truth-transform '{frame.name}>ITRF2014@{when}'",
        )  # fmt: skip


def _same_family(frame: Frame, recording: str) -> bool:
    """Whether both are global (ITRF, IGS, WGS 84: centimetres apart), or the same by name."""
    if _GLOBAL.match(frame.name) and _GLOBAL.match(recording.strip()):
        return True
    try:
        return find_frame(recording).name == frame.name
    except InputError:
        return False
