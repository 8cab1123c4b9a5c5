"""Raw SBF fields to documented columns: units, codes, and values that mean "no value".

Sources: Septentrio PolaRx5TR Reference Guide, firmware 5.5.0, pages 383-429; the fields that use 0
as do-not-use value (DOPs, WACorrInfo, AlertFlag, SignalInfo) after the mosaic guide of firmware
4.10.1.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.recording import MODES, Flag

Floats = NDArray[np.float64]
Raw = Mapping[str, NDArray[Any]]
Removed = Counter[tuple[str, str]]
"""(column, what was seen) -> how many values became missing."""

_LEAST_RADIUS_M = 1e6


@dataclass
class Decoded:
    """Columns from the blocks of one number, with what was made missing on the way."""

    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    removed: Removed = field(default_factory=Counter)

    def add_flags(self, flag: Flag, where: NDArray[np.bool_]) -> None:
        if "flags" not in self.columns:
            self.columns["flags"] = np.zeros(len(where), np.uint32)
        self.columns["flags"] |= where * np.uint32(flag)

    def floats(self, column: str, raw: NDArray[Any]) -> Floats:
        """Floats with the do-not-use value and everything not finite as NaN."""
        values = raw.astype(np.float64)
        good = values > sbf.FLOAT_MISSING_BELOW
        good &= values < np.inf
        if not good.all():
            sentinel = values <= sbf.FLOAT_MISSING_BELOW
            self.count(column, "-2e10", sentinel)
            self.count(column, "not a finite number", ~good & ~sentinel)
            values[~good] = np.nan
        return values

    def scaled(self, column: str, raw: NDArray[Any], *missing: int, unit: float = 0.01) -> Floats:
        """Unsigned raw values in a unit; the values in `missing` become NaN."""
        values = raw * unit
        for value in missing:
            at = raw == value
            if at.any():
                self.count(column, str(value), at)
                values[at] = np.nan
        return values

    def remove(self, column: str, reason: str, where: NDArray[np.bool_], values: Floats) -> None:
        """Make values missing, in place, counting those that were there."""
        there = where & ~np.isnan(values)
        if there.any():
            self.count(column, reason, there)
            values[there] = np.nan

    def count(self, column: str, reason: str, where: NDArray[np.bool_]) -> None:
        """Note that values of a column became missing, and why."""
        if count := int(where.sum()):
            self.removed[column, reason] += count


_TYPES = np.full(16, MODES.index("other"), np.int8)
for _type, _mode in {0: "none", 1: "standalone", 2: "dgnss", 6: "sbas", 4: "rtk", 5: "rtk",
                     7: "rtk", 8: "rtk"}.items():  # fmt: skip
    _TYPES[_type] = MODES.index(_mode)
_SBAS_TYPE = 6
_PRECISE_APPROACH = 16
_SEVERAL_GEOS = 65534


def fix_mode(mode: NDArray[Any], error: NDArray[Any], wa_corr_info: NDArray[Any]) -> NDArray[Any]:
    """Index into MODES from the fields Mode, Error and WACorrInfo (guide, pages 383, 405)."""
    kind = mode & 15
    code: NDArray[Any] = _TYPES[kind]
    is_sbas = kind == _SBAS_TYPE
    if is_sbas.any():
        precise = (wa_corr_info & _PRECISE_APPROACH) != 0
        code[is_sbas & precise] = MODES.index("sbas_pa")
        code[is_sbas & ~precise & (wa_corr_info != 0)] = MODES.index("sbas_npa")
    code[error != 0] = MODES.index("none")
    return code


def prn_of_svid(svid: NDArray[Any]) -> NDArray[np.int16]:
    """SBAS PRN of SVID 120..140 and 198..215; -1 for any other number."""
    wide = svid.astype(np.int32)
    low = (wide >= 120) & (wide <= 140)
    high = (wide >= 198) & (wide <= 215)
    return np.where(low, wide, np.where(high, wide - 57, -1)).astype(np.int16)


def _geo_of_reference(reference: NDArray[Any], mode: NDArray[Any]) -> NDArray[np.int16]:
    known = (reference >= 120) & (reference <= 158)
    prn = np.where(known, reference, np.where(reference == _SEVERAL_GEOS, 0, -1))
    return np.where((mode & 15) == _SBAS_TYPE, prn, -1).astype(np.int16)


def _count_of_satellites(raw: NDArray[Any], missing: int) -> NDArray[np.int16]:
    return np.where(raw == missing, -1, raw.astype(np.int16)).astype(np.int16)


def _pvt(raw: Raw, want: Set[str], version_1: bool, position: Callable[[Decoded], None]) -> Decoded:
    """What all PVT blocks share; `position` adds position and velocity before the rest."""
    out = Decoded()
    position(out)
    columns = out.columns
    if "correction_age_s" in want:
        columns["correction_age_s"] = out.scaled("correction_age_s", raw["correction_age"], 65535)
    if "n_sv" in want:
        columns["n_sv"] = _count_of_satellites(raw["n_sv"], 255)
    if "mode" in want:
        use = np.zeros_like(raw["mode"]) if version_1 else raw["wa_corr_info"]
        columns["mode"] = fix_mode(raw["mode"], raw["error"], use)
    if "geo_prn" in want:
        columns["geo_prn"] = (
            prn_of_svid(raw["geo_svid"])
            if version_1
            else _geo_of_reference(raw["reference_id"], raw["mode"])
        )
    for name in ("h_accuracy", "v_accuracy"):
        if f"x_{name}_m" in want and not version_1:
            columns[f"x_{name}_m"] = out.scaled(f"x_{name}_m", raw[name], 65535)
    if "x_undulation_m" in want and "undulation" in raw:
        columns["x_undulation_m"] = out.floats("x_undulation_m", raw["undulation"])
    if "flags" in want:
        out.add_flags(Flag.TWO_DIMENSIONAL, (raw["mode"] & 0x80) != 0)
    no_position = raw["error"] != 0
    if no_position.any():
        for name in _OF_POSITION & set(columns):
            out.remove(name, "value beside an error code", no_position, columns[name])
    return out


_OF_POSITION = {
    "lat_deg", "lon_deg", "height_m", "speed_mps", "vel_e_mps", "vel_n_mps", "vel_u_mps",
    "sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2",
}  # fmt: skip
_COVARIANCE = {"sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2"}
_SPEEDS = {"speed_mps", "vel_e_mps", "vel_n_mps", "vel_u_mps"}
_PLACE = {"lat_deg", "lon_deg", "height_m"}


def pvt_geodetic(raw: Raw, want: Set[str], *, version_1: bool) -> Decoded:
    """Columns from PVTGeodetic 4007 or 5904."""

    def position(out: Decoded) -> None:
        outside = None
        for name, field_name, limit in (("lat", "lat", np.pi / 2), ("lon", "lon", np.pi)):
            if f"{name}_deg" in want:
                radians = out.floats(f"{name}_deg", raw[field_name])
                too_large = np.abs(radians) > limit
                if too_large.any():
                    out.remove(f"{name}_deg", "angle out of range", too_large, radians)
                    outside = too_large if outside is None else outside | too_large
                out.columns[f"{name}_deg"] = np.degrees(radians)
        if "height_m" in want:
            out.columns["height_m"] = out.floats("height_m", raw["height"])
        if "flags" in want:
            sentinel = np.minimum(raw["lat"], raw["lon"]) <= sbf.FLOAT_MISSING_BELOW
            out.add_flags(Flag.POSITION_SENTINEL, sentinel)
            if outside is not None:
                out.add_flags(Flag.OUT_OF_RANGE, outside)
        if want & _SPEEDS:
            _speeds(out, want, *(out.floats(f"vel_{a}_mps", raw[f"v{a}"]) for a in "enu"))

    return _pvt(raw, want, version_1, position)


def _speeds(out: Decoded, want: Set[str], east: Floats, north: Floats, up: Floats) -> None:
    velocities = {"vel_e_mps": east, "vel_n_mps": north, "vel_u_mps": up}
    out.columns.update({name: v for name, v in velocities.items() if name in want})
    if "speed_mps" in want:
        out.columns["speed_mps"] = np.hypot(east, north)


def pvt_cartesian(raw: Raw, want: Set[str], *, version_1: bool) -> Decoded:
    """Columns from PVTCartesian 4006 or 5903: geodetic on WGS 84, velocity to east-north-up."""

    def position(out: Decoded) -> None:
        if not want & (_PLACE | _SPEEDS | {"flags"}):
            return
        from pymap3d import ecef2enuv, ecef2geodetic  # 0.1 s to import, needed by few files

        x, y, z = _cartesian(out, raw, "xyz", _PLACE & want)
        near_centre = np.hypot(np.hypot(x, y), z) < _LEAST_RADIUS_M
        for name in sorted(_PLACE & want):
            out.count(name, "position near the Earth's centre", near_centre)
        known = ~np.isnan(x + y + z) & ~near_centre
        place = np.full((3, len(x)), np.nan)
        if known.any():
            place[:, known] = ecef2geodetic(x[known], y[known], z[known])
        lat_deg, lon_deg, height_m = place
        named = {"lat_deg": lat_deg, "lon_deg": lon_deg, "height_m": height_m}
        out.columns.update({name: v for name, v in named.items() if name in want})
        if "flags" in want:
            sentinel = np.minimum.reduce([raw[axis] for axis in "xyz"])
            out.add_flags(Flag.POSITION_SENTINEL, sentinel <= sbf.FLOAT_MISSING_BELOW)
            if near_centre.any():
                out.add_flags(Flag.OUT_OF_RANGE, near_centre)
        if want & _SPEEDS:
            ecef = _cartesian(out, raw, ("vx", "vy", "vz"), _SPEEDS & want)
            _speeds(out, want, *ecef2enuv(*ecef, lat_deg, lon_deg))

    return _pvt(raw, want, version_1, position)


def _cartesian(out: Decoded, raw: Raw, names: Iterable[str], columns: Set[str]) -> list[Floats]:
    """Components whose missing values count once a row, for the columns that need all of them."""
    apart = Decoded()
    values = [apart.floats(name, raw[name]) for name in names]
    missing = np.isnan(sum(values))
    for column in sorted(columns):
        out.count(column, "-2e10 in a Cartesian component", missing)
    return values


def covariance_geodetic(raw: Raw, want: Set[str]) -> Decoded:
    """Columns from PosCovGeodetic 5906."""
    out = Decoded()
    variances = {f"sigma_{a}_m": raw[f"{a}{a}"] for a in "enu" if f"sigma_{a}_m" in want}
    return _sigmas(
        out, raw, want, {name: out.floats(name, value) for name, value in variances.items()},
        out.floats("cov_en_m2", raw["ne"]) if "cov_en_m2" in want else None,
    )  # fmt: skip


def covariance_cartesian(raw: Raw, want: Set[str], lat_deg: Floats, lon_deg: Floats) -> Decoded:
    """Columns from PosCovCartesian 5905, turned to east-north-up at the position of the fix.

    C_enu = R C_xyz R', R with rows east, north, up (Misra and Enge, Global Positioning System,
    2nd ed., eq. 4.26). Where the position is missing, so are the sigmas.
    """
    out = Decoded()
    pairs = ("xx", "yy", "zz", "xy", "xz", "yz")
    columns = _COVARIANCE & want
    if not columns:
        return out
    c = dict(zip(pairs, _cartesian(out, raw, pairs, columns), strict=True))
    c |= {pair[::-1]: value for pair, value in c.items()}
    sin_lat, cos_lat = np.sin(np.radians(lat_deg)), np.cos(np.radians(lat_deg))
    sin_lon, cos_lon = np.sin(np.radians(lon_deg)), np.cos(np.radians(lon_deg))
    zero = np.zeros_like(sin_lat)
    axes = {
        "e": {"x": -sin_lon, "y": cos_lon, "z": zero},
        "n": {"x": -sin_lat * cos_lon, "y": -sin_lat * sin_lon, "z": cos_lat},
        "u": {"x": cos_lat * cos_lon, "y": cos_lat * sin_lon, "z": sin_lat},
    }

    def turned(a: str, b: str) -> Floats:
        total = zero.copy()
        for i in "xyz":
            for j in "xyz":
                total += axes[a][i] * c[i + j] * axes[b][j]
        return total

    variances = {f"sigma_{a}_m": turned(a, a) for a in "enu" if f"sigma_{a}_m" in want}
    return _sigmas(out, raw, want, variances, turned("e", "n") if "cov_en_m2" in want else None)


def _sigmas(
    out: Decoded, raw: Raw, want: Set[str], variances: dict[str, Floats], cov_en: Floats | None
) -> Decoded:
    no_position = raw["error"] != 0
    for name, variance in variances.items():
        negative = variance < 0
        if negative.any():
            out.remove(name, "negative variance", negative, variance)
            if "flags" in want:
                out.add_flags(Flag.OUT_OF_RANGE, negative)
        out.columns[name] = np.sqrt(variance)
    if cov_en is not None:
        out.columns["cov_en_m2"] = cov_en
    if no_position.any():
        for name, values in out.columns.items():
            if name in _OF_POSITION:
                out.remove(name, "value beside an error code", no_position, values)
    return out


def dilution(raw: Raw, want: Set[str]) -> Decoded:
    """Columns from DOP 4001 or 5909: dilutions and protection levels."""
    out = Decoded()
    for name in ("hdop", "vdop", "pdop"):
        if name in want:
            out.columns[name] = out.scaled(name, raw[name], 0, 65535)
    for name in ("hpl", "vpl"):
        if f"{name}_m" in want:
            out.columns[f"{name}_m"] = out.floats(f"{name}_m", raw[name])
            if "error" in raw:
                level, failed = out.columns[f"{name}_m"], np.asarray(raw["error"]) != 0
                out.remove(f"{name}_m", "value beside an error code", failed, level)
            if "flags" in want:
                out.add_flags(Flag.PL_SENTINEL, raw[name] <= sbf.FLOAT_MISSING_BELOW)
    if "n_sv" in want:
        out.columns["n_sv"] = _count_of_satellites(raw["n_sv"], 0)
    return out


def raim(raw: Raw, want: Set[str]) -> Decoded:
    """Columns from RAIMStatistics 4011 or 5915."""
    out = Decoded()
    for name in ("herl", "verl"):
        if f"{name}_m" in want:
            out.columns[f"{name}_m"] = out.floats(f"{name}_m", raw[name])
    if "flags" in want:
        out.columns["flags"] = _INTEGRITY_FLAGS[np.minimum(raw["integrity_flag"], 3)]
    return out


_INTEGRITY_FLAGS = np.array(
    [Flag.RAIM_PASSED, Flag.RAIM_FAILED, Flag.RAIM_NOT_AVAILABLE, 0], np.uint32
)
ALERT_FLAGS = np.array([0, Flag.RAIM_PASSED, Flag.RAIM_FAILED, 0], np.uint32)
"""Integrity of AlertFlag bits 0-1, whose codes differ from those of RAIMStatistics."""
