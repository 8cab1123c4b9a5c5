"""Coordinates in another unit or order, as far as the numbers themselves show it (E03, E08, E12).

What only a comparison with the truth can show is in `against_truth`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sbas.input_check.judgement import Judged, judged
from sbas.recording_survey import Rows, Survey
from sbas.streaming import Distribution

Floats = NDArray[np.float64]

UNITS_DEG = {
    "1e-7 deg": 1e-7,
    "1e-6 deg": 1e-6,
    "mas": 1 / 3.6e6,
    "arcsec": 1 / 3600,
}
"""Size of an angle's unit in degrees; `ddmm` (5002.07 for 50 deg 2.07 min) is no scale."""
UNITS_M = {"mm": 1e-3, "cm": 1e-2, "ft": 0.3048, "km": 1e3}
"""Size of a length's unit in metres."""
HIGHEST_M = 9000.0
"""No railway and no road is higher, as the median of a recording."""


class CoordinateRanges:
    """Largest latitude, longitude and height, and whether they could be degrees and minutes."""

    COLUMNS = ("lat_deg", "lon_deg", "height_m")

    def __init__(self) -> None:
        self.known = 0
        self.most = [0.0, 0.0]
        self.no_minutes = 0
        self.wrong_if_swapped = 0
        self.height = Distribution()

    def update(self, rows: Rows) -> None:
        lat, lon = rows.values["lat_deg"], rows.values["lon_deg"]
        known = np.isfinite(lat) & np.isfinite(lon)
        lat, lon = np.abs(lat[known]), np.abs(lon[known])
        if lat.size:
            self.known += lat.size
            self.most = [max(self.most[0], float(lat.max())), max(self.most[1], float(lon.max()))]
            self.no_minutes += int(np.sum((lat % 100 >= 60) | (lon % 100 >= 60)))
            self.wrong_if_swapped += int(np.sum((lon > 90) | (lat > 180)))
        self.height.update(rows.values["height_m"])

    def beyond(self, unit: str) -> tuple[str, ...]:
        """Columns that a unit is of: degrees and minutes of both, a scale of those too large."""
        if unit == "ddmm":
            return "lat_deg", "lon_deg"
        limits = {"lat_deg": 90.0, "lon_deg": 180.0}
        return tuple(n for n, m in zip(limits, self.most, strict=True) if m > limits[n])

    def units(self) -> list[str]:
        """Units other than degrees in which all positions would be on Earth."""
        lat, lon = self.most
        found = []
        if self.no_minutes == 0 and lat <= 9000 and lon <= 18000:
            found.append("ddmm")
        return found + [
            unit for unit, size in UNITS_DEG.items()
            if (lat <= 90 or lat * size <= 90) and (lon <= 180 or lon * size <= 180)
        ]  # fmt: skip

    def swapped(self) -> bool:
        """Whether all positions would be on Earth with the columns exchanged."""
        return self.wrong_if_swapped == 0


def to_degrees(values: Floats, unit: str) -> Floats:
    """(n,) angles of a unit of `UNITS_DEG`, `ddmm` or `rad` in degrees."""
    if unit == "ddmm":
        size = np.abs(values)
        whole = np.floor(size / 100)
        return np.asarray(np.copysign(whole + (size - 100 * whole) / 60, values))
    if unit == "rad":
        return np.asarray(np.degrees(values))
    return np.asarray(values * UNITS_DEG[unit])


def looks_like_radians(facts: Survey) -> bool:
    """Whether all positions lie within pi/2 and pi."""
    lat, lon = facts.lat_range_deg, facts.lon_range_deg
    small = max(map(abs, lat)) <= np.pi / 2 and max(map(abs, lon)) <= np.pi
    return facts.positions > 0 and facts.out_of_range == 0 and bool(small)


def radians(facts: Survey) -> Iterator[Judged]:
    """E03: angles that could be radians, without a truth that says otherwise."""
    if not looks_like_radians(facts):
        return
    lat, lon = facts.lat_range_deg, facts.lon_range_deg
    yield judged(
        "E03", "error", "latitude and longitude look like radians",
        evidence=f"latitude {lat[0]:.6f}..{lat[1]:.6f}, longitude {lon[0]:.6f}..{lon[1]:.6f}; "
        f"as radians {np.degrees(lat[0]):.4f}..{np.degrees(lat[1]):.4f}, "
        f"{np.degrees(lon[0]):.4f}..{np.degrees(lon[1]):.4f} degrees",
        cure="--angles rad, or state the unit in the column's header, such as lat[rad]",
        repair={"angles": "rad"},
    )  # fmt: skip


def outside(facts: Survey, ranges: CoordinateRanges, fitting: list[str]) -> Iterator[Judged]:
    """E08 or E12: positions that are not on Earth.

    Parameters
    ----------
    facts, ranges : of the recording.
    fitting : units in which it would be near the truth; empty without truth.
    """
    if not facts.out_of_range:
        return
    lat, lon = ranges.most
    seen = f"largest |latitude| {lat:.10g}, |longitude| {lon:.10g}"
    if (facts.positions == 0 and not ranges.swapped()) or fitting:
        candidates = fitting or ranges.units()
        yield judged(
            "E08", "error", f"{facts.out_of_range:,} positions are outside +-90, +-180 degrees",
            evidence=f"{seen}; on Earth as {', '.join(candidates) or 'nothing known'}"
            + ("; near the truth" if fitting else ""),
            cure=_unit_cure(ranges, candidates),
            repair=_unit_repair(ranges, candidates),
        )  # fmt: skip
    elif ranges.swapped():
        yield judged(
            "E12", "error", "latitudes beyond 90 degrees: latitude and longitude look swapped",
            evidence=f"{seen}; {facts.out_of_range:,} positions are not on Earth as given, all are "
            "when swapped",
            cure="--swap-latlon",
            repair={"swap_latlon": True},
        )  # fmt: skip
    else:
        yield judged(
            "E08", "error", f"{facts.out_of_range:,} positions are outside +-90, +-180 degrees",
            evidence=f"{seen}; {facts.positions:,} others are inside",
            cure="correct these rows, or state the unit in the column's header, such as lat[rad]",
        )  # fmt: skip


def _unit_cure(ranges: CoordinateRanges, candidates: list[str]) -> str:
    if not candidates:
        return "state the unit in the column's header, such as lat[rad]"
    return " or ".join(
        " ".join(f'--unit "{name}={unit}"' for name in ranges.beyond(unit))
        for unit in candidates[:2]
    )


def _unit_repair(ranges: CoordinateRanges, candidates: list[str]) -> dict[str, object]:
    """Degrees and minutes prove themselves by all rows; scales only when one alone is left."""
    if len(candidates) == 1 or "ddmm" in candidates:
        return {"unit": dict.fromkeys(ranges.beyond(candidates[0]), candidates[0])}
    return {}


def heights(ranges: CoordinateRanges) -> Iterator[Judged]:
    """E08: a median height above any railway."""
    median = ranges.height.quantile(0.5)
    if not abs(median) > HIGHEST_M:
        return
    yield judged(
        "E08", "error", f"the median height is {median / 1000:.4g} km",
        evidence=f"heights {ranges.height.min:.6g}..{ranges.height.max:.6g} m; "
        + ", ".join(f"as {u} {median * UNITS_M[u]:.6g} m" for u in ("mm", "cm", "ft")),
        cure="--unit height_m=mm, or what the file's documentation says",
    )  # fmt: skip
