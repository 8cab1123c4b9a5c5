"""Values that stand for something else in files that do not say so, found and counted: "missing",
and longitudes that run to 360 degrees."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.recording import Flag

_DOP = ("hdop", "vdop", "pdop")
_SAFETY_COLUMNS = ("hpl_m", "vpl_m", "lat_deg", "lon_deg", "height_m")
_COUNTS = ("n_sv", "n_sv_tracked", "geo_prn")
_METRES = ("hpl_m", "vpl_m", "herl_m", "verl_m", "sigma_e_m", "sigma_n_m", "sigma_u_m",
           "correction_age_s")  # fmt: skip
_SENTINELS: dict[str, tuple[float, ...]] = {
    **dict.fromkeys(_DOP, (99.99, 655.35, 65535.0)),
    **dict.fromkeys(_COUNTS, (255.0, 65535.0)),
    **dict.fromkeys(_METRES, (655.35, 65535.0, 4294967.295, 4294967295.0)),
}
"""Documented stand-ins for "missing" besides -2e10: 65535 (u2) and 65535/100, 4294967295 (u4)
and 4294967295/1000, 255 (u1), 99.99 as DOP. Not for heights: 655.35 m is one."""


def remove_sentinels(
    raw: dict[str, NDArray[np.float64]], flags: NDArray[np.uint32]
) -> tuple[dict[str, dict[str, int]], NDArray[np.uint32]]:
    """Make sentinels NaN in `raw` (arrays replaced, not written to); counts by column and value."""
    counts: dict[str, dict[str, int]] = {}

    def remove(name: str, rows: NDArray[np.bool_], value: str) -> None:
        number = int(np.count_nonzero(rows))
        if not number:
            return
        counts.setdefault(name, {})[value] = number
        raw[name] = np.where(rows, np.nan, raw[name])
        if name in ("hpl_m", "vpl_m"):
            flags[rows] |= np.uint32(Flag.PL_SENTINEL)
        if name in ("lat_deg", "lon_deg", "height_m", "altitude"):
            flags[rows] |= np.uint32(Flag.POSITION_SENTINEL)

    if "hpl_m" in raw and "vpl_m" in raw:
        alarm = (raw["hpl_m"] == 8000) & (raw["vpl_m"] == 100)
        remove("hpl_m", alarm, "8000 (beside VPL 100)")
        remove("vpl_m", alarm, "100 (beside HPL 8000)")
    if "lat_deg" in raw and "lon_deg" in raw:
        origin = (raw["lat_deg"] == 0) & (raw["lon_deg"] == 0)
        remove("lat_deg", origin, "(0, 0)")
        remove("lon_deg", origin, "(0, 0)")
    for name in list(raw):
        if name.startswith("x_"):
            continue
        remove(name, raw[name] <= -1e10, "-2e10")
        remove(name, np.isinf(raw[name]), "infinite")
        for sentinel in _SENTINELS.get(name, ()):
            remove(name, raw[name] == sentinel, f"{sentinel:.10g}")
    return counts, flags


def sentinel_findings(counts: Mapping[str, Mapping[str, int]]) -> tuple[Finding, ...]:
    """E07 with the count by column and value; none where nothing was counted."""
    shown = [
        f"{name}: {number:,} x {value}"
        for name, values in counts.items()
        for value, number in values.items()
        if number
    ]
    if not shown:
        return ()
    return (
        Finding(
            "E07",
            "warning",
            "values that stand for 'missing' were made missing; a missing protection level is "
            "unavailable, it is not counted as below the alert limit",
            evidence="; ".join(shown),
        ),
    )


def removed_findings(removed: Mapping[tuple[str, str], int]) -> tuple[Finding, ...]:
    """E07 of a receiver's own marks: a warning for positions and protection levels, for the rest
    only information.

    Parameters
    ----------
    removed : values made missing, by column and value.
    """
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for (column, value), number in sorted(removed.items()):
        counts[column][value] += number
    grave = {name: counts.pop(name) for name in _SAFETY_COLUMNS if name in counts}
    if not counts:
        return sentinel_findings(grave)
    return (
        *sentinel_findings(grave),
        Finding(
            "E07",
            "info",
            "values that the receiver marked as not available were made missing",
            evidence="; ".join(
                f"{name}: {number:,} x {value}"
                for name, values in counts.items()
                for value, number in values.items()
            ),
        ),
    )


def wrapped_longitudes(
    lon_deg: NDArray[np.float64],
) -> tuple[NDArray[np.float64], tuple[Finding, ...]]:
    """(n,) longitudes of the convention 0..360 as -180..180, counted; any others as they are."""
    known = lon_deg[np.isfinite(lon_deg)]
    beyond = lon_deg > 180
    if not beyond.any() or known.min() < 0 or known.max() > 360:
        return lon_deg, ()
    finding = Finding(
        "E26",
        "info",
        "longitudes of 0 to 360 degrees were written as -180 to 180",
        evidence=f"{np.count_nonzero(beyond):,} of {len(lon_deg):,} above 180",
    )
    return np.where(beyond, lon_deg - 360, lon_deg), (finding,)
