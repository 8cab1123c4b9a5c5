"""Which pairs of frames are held to be one, and what is said of the others."""

from __future__ import annotations

import pytest

from sbas.frames import find_frame, frame_doubts


@pytest.mark.parametrize(
    ("truth", "recording", "year", "expected"),
    [
        ("ETRF2000", "WGS84", 2026.5, ["'ETRF2000>ITRF2014@2026.5'"]),
        ("ETRS89", "WGS 84/ITRF", None, ["'ETRS89>ITRF2014@2025.5'"]),
        ("ITRF2014 2026.0", "WGS84", 2026.5, []),
        ("IGS20 2026.0", "ITRF2014", 2026.5, []),
        ("WGS 84 (Transit)", "WGS84", None, ["WGS 84 (Transit)>"]),
        ("ITRF2014 2010.0", "WGS84", 2026.5, ["'ITRF2014 2010>ETRF2014>ITRF2014@2026.5'"]),
        ("ETRF2000 2010.0", "", 2026.5, []),
        ("ETRS89", "ETRS89", None, []),
        ("ETRF2000", "local", None, ["ETRF2000>"]),
        ("EPSG:5514", "", None, ["'S-JTSK>ETRS89>ITRF2014@2025.5'"]),
    ],
)
def test_doubts_name_the_transformation(
    truth: str, recording: str, year: float | None, expected: list[str]
) -> None:
    found = list(frame_doubts(find_frame(truth), recording, year))
    assert [f.code for f in found] == ["E09"] * len(expected)
    for finding, text in zip(found, expected, strict=True):
        assert text in finding.cure
    assert all(f.severity == ("error" if "5514" in truth else "warning") for f in found)
