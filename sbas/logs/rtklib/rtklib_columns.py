"""Fields of an RTKLIB solution file as documented columns: angles, ECEF, modes, sentinels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pymap3d
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.logs.delimited.column_map import (
    counted_sentinel_findings,
    ellipsoidal,
    geoid_finding,
    geoid_unused,
    pl_outside_sbas,
)
from sbas.logs.rtklib.rtklib_layout import Layout
from sbas.logs.sentinels import remove_sentinels
from sbas.recording import (
    MODES,
    Flag,
    ProtectionLevelMeta,
    major_semi_axis_m,
    mode_categories,
)

FloatArray = NDArray[np.float64]

_MODE_OF_Q = {1: "rtk", 2: "rtk", 3: "sbas", 4: "dgnss", 5: "standalone", 0: "none"}
_DEAD_RECKONING_Q = 7
_K_H = (6.00, 6.18)
_K_V = (5.33,)
_HPL_ROUNDING_M = 0.005
_VPL_ROUNDING_M = 0.05
_SIGMA_ROUNDING_M = 0.00005
_DOCUMENTED = {
    "latitude": "lat_deg", "longitude": "lon_deg", "height": "height_m",
    "hpl": "hpl_m", "vpl": "vpl_m", "ns": "n_sv", "age": "correction_age_s",
    "sdn": "sigma_n_m", "sde": "sigma_e_m", "sdu": "sigma_u_m",
}  # fmt: skip


@dataclass(frozen=True)
class LevelFit:
    """How levels fit K times the sigmas beside them, in a piece or in several added.

    Parameters
    ----------
    horizontal, vertical : candidates for K that hold on every epoch; none where no epoch has
        both a level and a sigma.
    outside : epochs with a level whose mode is not SBAS.
    """

    horizontal: frozenset[float] | None = None
    vertical: frozenset[float] | None = None
    outside: int = 0

    def __add__(self, other: LevelFit) -> LevelFit:
        return LevelFit(
            _both(self.horizontal, other.horizontal),
            _both(self.vertical, other.vertical),
            self.outside + other.outside,
        )

    def meta(self) -> ProtectionLevelMeta:
        """Kind and K factors of the levels that were looked at."""
        k_h, k_v = (
            next(iter(fitting)) if fitting is not None and len(fitting) == 1 else None
            for fitting in (self.horizontal, self.vertical)
        )
        known = not self.outside and k_h is not None
        return ProtectionLevelMeta(kind="do229" if known else "unknown", k_h=k_h, k_v=k_v)


def _both(a: frozenset[float] | None, b: frozenset[float] | None) -> frozenset[float] | None:
    return b if a is None else a if b is None else a & b


@dataclass(frozen=True)
class Counts:
    """What was counted in the fields of a piece, or of several added.

    Parameters
    ----------
    rows : epochs.
    missing : values made missing, by column and value.
    heights : heights that are there.
    """

    rows: int = 0
    missing: Counter[tuple[str, str]] = field(default_factory=Counter)
    heights: int = 0
    levels: LevelFit = field(default_factory=LevelFit)

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.rows + other.rows,
            self.missing + other.missing,
            self.heights + other.heights,
            self.levels + other.levels,
        )


def findings(counts: Counts, layout: Layout, geoid: float | None) -> tuple[Finding, ...]:
    """What was converted or made missing in a whole file."""
    found = list(counted_sentinel_findings(counts.missing))
    if layout.height == "geodetic":
        found.append(geoid_finding(counts.heights, counts.rows, geoid))
    elif geoid is not None:
        found.append(geoid_unused())
    if not layout.height:
        found.append(
            Finding(
                "E25",
                "warning",
                "no header line says what heights refer to; taken as ellipsoidal",
                cure="write the solution again with its header (RTKLIB option out-outhead=on)",
            )
        )
    return tuple(found)


def epoch_columns(
    values: dict[str, FloatArray], rows: int, layout: Layout, geoid: float | None
) -> tuple[dict[str, Any], Counts]:
    """Documented columns of (rows,) fields of a piece, and what was counted in them."""
    values, flags, missing = _without_sentinels(values, rows)
    table: dict[str, Any] = {}
    if "x-ecef" in values:
        lat, lon, height = pymap3d.ecef2geodetic(
            *(values[f"{axis}-ecef"] for axis in "xyz"), deg=True
        )
        table |= {"lat_deg": np.asarray(lat), "lon_deg": np.asarray(lon)}
        table["height_m"] = np.asarray(height)
        table |= _sigmas_from_ecef(values, table["lat_deg"], table["lon_deg"])
    else:
        table["lat_deg"], table["lon_deg"] = values["latitude"], values["longitude"]
        table["height_m"] = values["height"]
        for axis in ("e", "n", "u"):
            if f"sd{axis}" in values:
                table[f"sigma_{axis}_m"] = values[f"sd{axis}"]
        if "sdne" in values:
            table["cov_en_m2"] = np.copysign(values["sdne"] ** 2, values["sdne"])
    heights = int(np.count_nonzero(~np.isnan(table["height_m"])))
    if layout.height == "geodetic":
        table["height_m"], _ = ellipsoidal(table["height_m"], geoid)
    table |= _velocities(values, table["lat_deg"], table["lon_deg"])
    if "age" in values:
        table["correction_age_s"] = values["age"]
    if "ns" in values:
        table["n_sv"] = (
            np.where(np.isnan(values["ns"]), -1, values["ns"]).clip(-1, 999).astype("i2")
        )
    if "Q" in values:
        quality = np.where(np.isnan(values["Q"]), -1, values["Q"]).clip(-1, 99).astype(np.int64)
        codes = np.full(rows, MODES.index("other"))
        for number, mode in _MODE_OF_Q.items():
            codes[quality == number] = MODES.index(mode)
        codes[quality < 0] = -1
        table["mode"] = mode_categories(codes)
        flags[quality == _DEAD_RECKONING_Q] |= np.uint32(Flag.DEAD_RECKONING)
    for source, name in (("hpl", "hpl_m"), ("vpl", "vpl_m")):
        if source in values:
            table[name] = values[source]
    if "mode" in table:
        flags |= pl_outside_sbas(table)
    table["flags"] = flags
    return table, Counts(rows, missing, heights, _level_fit(table))


def _without_sentinels(
    values: dict[str, FloatArray], rows: int
) -> tuple[dict[str, FloatArray], NDArray[np.uint32], Counter[tuple[str, str]]]:
    """The fields with what stands for "missing" as NaN, its flags, its counts by column and value.

    Angles of d m s become `latitude` and `longitude`: (0, 0) is told from those alone, and in
    ECEF only the centre of the earth is no position.
    """
    counts = Counter({(n, "NaN"): int(np.count_nonzero(np.isnan(v))) for n, v in values.items()})
    raw = {_DOCUMENTED.get(name, name): array for name, array in values.items()}
    flags = np.zeros(rows, np.uint32)
    if "x-ecef" in values:
        centre = np.all([values[f"{axis}-ecef"] == 0 for axis in "xyz"], axis=0)
        if centre.any():
            counts["position", "(0, 0, 0) in ECEF"] = int(np.count_nonzero(centre))
            flags[centre] |= np.uint32(Flag.POSITION_SENTINEL)
            raw |= {f"{a}-ecef": np.where(centre, np.nan, values[f"{a}-ecef"]) for a in "xyz"}
    else:
        raw["lat_deg"], raw["lon_deg"] = _angle(values, "lat"), _angle(values, "lon")
    for name in ("hpl_m", "vpl_m"):
        if name in raw and (absent := raw[name] == 0).any():
            counts[name, "0 (not computed)"] = int(np.count_nonzero(absent))
            raw[name] = np.where(absent, np.nan, raw[name])
            flags[absent] |= np.uint32(Flag.PL_SENTINEL)
    removed, flags = remove_sentinels(raw, flags)
    counts.update({(name, value): n for name, by in removed.items() for value, n in by.items()})
    if "x-ecef" in raw:
        broken = np.any([~np.isfinite(raw[f"{axis}-ecef"]) for axis in "xyz"], axis=0)
        written = np.all([~np.isnan(values[f"{axis}-ecef"]) for axis in "xyz"], axis=0)
        flags[broken & written] |= np.uint32(Flag.POSITION_SENTINEL)
    shown = {new: name for name, new in _DOCUMENTED.items()}
    cleaned = {shown.get(name, name): array for name, array in raw.items()}
    return cleaned, flags, +counts


def _angle(values: dict[str, FloatArray], stem: str) -> FloatArray:
    """(n,) degrees; of d m s the sign is that of the degrees, of "-0" too."""
    whole = {"lat": "latitude", "lon": "longitude"}[stem]
    if whole in values:
        return values[whole]
    degrees, minutes, seconds = (values[f"{stem}_{part}"] for part in ("d", "m", "s"))
    return np.copysign(np.abs(degrees) + minutes / 60 + seconds / 3600, degrees)


def _east_north_up(lat_deg: FloatArray, lon_deg: FloatArray) -> FloatArray:
    """(n, 3, 3) unit vectors east, north, up (rows) in ECEF."""
    lat, lon = np.radians(lat_deg), np.radians(lon_deg)
    s, c, sl, cl = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
    zero = np.zeros_like(lat)
    rows = [[-sl, cl, zero], [-s * cl, -s * sl, c], [c * cl, c * sl, s]]
    return np.moveaxis(np.array(rows), 2, 0)


def _sigmas_from_ecef(
    values: dict[str, FloatArray], lat_deg: FloatArray, lon_deg: FloatArray
) -> dict[str, FloatArray]:
    """Sigmas east, north, up and their covariance from those of x, y, z (signed roots)."""
    names = ("sdx", "sdy", "sdz", "sdxy", "sdyz", "sdzx")
    if any(name not in values for name in names):
        return {}
    xx, yy, zz, xy, yz, zx = (np.copysign(values[n] ** 2, values[n]) for n in names)
    ecef = np.moveaxis(np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]), 2, 0)
    turn = _east_north_up(lat_deg, lon_deg)
    local = turn @ ecef @ np.swapaxes(turn, 1, 2)
    # Four decimals can leave a variance below zero where the true one is almost none: unknown.
    variances = [np.where(local[:, i, i] > 0, local[:, i, i], np.nan) for i in range(3)]
    return {
        **{f"sigma_{axis}_m": np.sqrt(v) for axis, v in zip("enu", variances, strict=True)},
        "cov_en_m2": np.ascontiguousarray(local[:, 0, 1]),
    }


def _velocities(
    values: dict[str, FloatArray], lat_deg: FloatArray, lon_deg: FloatArray
) -> dict[str, FloatArray]:
    if all(f"v{axis}" in values for axis in "enu"):
        east, north, up = (values[f"v{axis}"] for axis in "enu")
    elif all(f"v{axis}" in values for axis in "xyz"):
        ecef = np.stack([values[f"v{axis}"] for axis in "xyz"], axis=1)
        east, north, up = np.einsum("nij,nj->in", _east_north_up(lat_deg, lon_deg), ecef)
    else:
        return {}
    return {
        "vel_e_mps": east,
        "vel_n_mps": north,
        "vel_u_mps": up,
        "speed_mps": np.hypot(east, north),
    }


def _level_fit(table: dict[str, Any]) -> LevelFit:
    """How the levels of a piece fit the sigmas beside them.

    A level of DO-229 is K d_major (horizontal) and K sigma_u (vertical), K_H 6.00 (NPA: 6.18),
    K_V 5.33; the ratio holds on every epoch within the rounding of the file, or it is not told.
    Source: RTCA DO-229D, J.1.
    """
    if not {"hpl_m", "sigma_e_m", "sigma_n_m", "sigma_u_m", "mode"} <= set(table):
        return LevelFit()
    nothing = np.full(len(table["hpl_m"]), np.nan)
    d_major = major_semi_axis_m(
        table["sigma_e_m"], table["sigma_n_m"], table.get("cov_en_m2", nothing)
    )
    k_h = _fitting(table["hpl_m"], d_major, _K_H, _HPL_ROUNDING_M, 4 * _SIGMA_ROUNDING_M)
    k_v = _fitting(
        table.get("vpl_m", nothing), table["sigma_u_m"], _K_V, _VPL_ROUNDING_M, _SIGMA_ROUNDING_M
    )
    modes = table["mode"].codes[~np.isnan(table["hpl_m"])]
    return LevelFit(k_h, k_v, int(np.count_nonzero(modes != MODES.index("sbas"))))


def _fitting(
    level: FloatArray,
    sigma: FloatArray,
    candidates: Iterable[float],
    level_rounding: float,
    sigma_rounding: float,
) -> frozenset[float] | None:
    """The candidates K with |level - K sigma| within rounding on every epoch that has both."""
    known = np.isfinite(level) & np.isfinite(sigma)
    if not known.any():
        return None
    return frozenset(
        k
        for k in candidates
        if np.all(
            np.abs(level[known] - k * sigma[known]) <= 1.01 * (level_rounding + k * sigma_rounding)
        )
    )
