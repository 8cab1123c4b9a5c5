"""Columns `x`, `y`, `z` in the Earth-fixed frame as latitude, longitude and height."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.logs.delimited.column_names import EARTH_FIXED
from sbas.logs.text_input import BAD_SHARE

_LEAST_M, _MOST_M = (
    6.33e6,
    6.42e6,
)  # from the centre, 20 km below the pole to 40 km above the equator


@dataclass(frozen=True)
class EarthFixedCounts:
    """Rows with a position, rows of zeros, and rows that are nowhere near the Earth's surface."""

    positions: int = 0
    zeros: int = 0
    astray: int = 0

    def __add__(self, other: EarthFixedCounts) -> EarthFixedCounts:
        return EarthFixedCounts(
            self.positions + other.positions, self.zeros + other.zeros, self.astray + other.astray
        )

    def findings(self) -> tuple[Finding, ...]:
        """E26 for positions that were converted, E10 for those that were made missing."""
        found = []
        if self.positions:
            zeros = f", {self.zeros:,} of (0, 0, 0) missing" if self.zeros else ""
            found.append(
                Finding(
                    "E26", "info", "x, y, z were read as Earth-fixed metres",
                    evidence=f"{self.positions:,} positions{zeros}",
                )
            )  # fmt: skip
        if self.astray:
            rows = self.positions + self.astray
            mixed = bool(self.positions) and self.astray > BAD_SHARE * rows
            found.append(
                Finding(
                    "E10",
                    "error" if mixed else "warning",
                    "x, y, z that are not on the Earth were left out as positions",
                    evidence=f"{self.astray:,} of {rows:,} rows lie outside "
                    f"{_LEAST_M / 1e3:,.0f} to {_MOST_M / 1e3:,.0f} km from its centre",
                    cure="give metres in the Earth-fixed frame; name columns of anything else "
                    "'x_...'",
                )
            )
        return tuple(found)


def geodetic(
    values: dict[str, NDArray[np.float64]], factors: Mapping[str, float]
) -> tuple[dict[str, NDArray[np.float64]], EarthFixedCounts]:
    """(n,) `lat_deg`, `lon_deg`, `height_m` on WGS 84, of the columns EARTH_FIXED in `values`.

    Those are taken out of `values`. Nothing is returned where there are none.
    """
    if not all(name in values for name in EARTH_FIXED):
        return {}, EarthFixedCounts()
    x, y, z = (values.pop(name) * factors.get(name, 1.0) for name in EARTH_FIXED)
    radius = np.sqrt(x * x + y * y + z * z)
    good = (radius > _LEAST_M) & (radius < _MOST_M)
    zeros = int(np.count_nonzero(radius == 0))
    counts = EarthFixedCounts(
        int(np.count_nonzero(good)),
        zeros,
        int(np.count_nonzero(~good & ~np.isnan(radius))) - zeros,
    )
    found = {name: np.full(len(x), np.nan) for name in ("lat_deg", "lon_deg", "height_m")}
    if good.any():
        places = pymap3d.ecef2geodetic(x[good], y[good], z[good])
        for column, place in zip(found.values(), places, strict=True):
            column[good] = place
    return found, counts
