"""Fields of NAV-PVT, NAV-DOP and NAV-COV to documented columns, and values that mean "no value".

Sources: the tables of pyubx2 1.4.0; what a receiver without a fix sends (position 0, 0, accuracy
4294967295, dilution 99.99) was seen in real logs.
"""

from __future__ import annotations

from collections.abc import Set

import numpy as np
from numpy.typing import NDArray

from sbas.logs.septentrio.sbf_decode import Decoded
from sbas.logs.ublox.ubx_messages import Raw
from sbas.recording import MODES, Flag

_U4_MISSING = 4294967295
_DOP_MISSING = 9999
_FIX_OK, _DIFFERENTIAL = 1, 2
_NO_FIX, _DEAD_RECKONING, _TWO_DIMENSIONAL = (0, 5), (1, 4), 2
_LAST_FIX_TYPE = 5
_INVALID_LLH = 1

AGE_LIMITS_S = np.array(
    [np.nan, 1, 2, 5, 10, 15, 20, 30, 45, 60, 90, 120, np.nan, np.nan, np.nan, np.nan]
)
"""Upper bound of each class of correction age [s]: NAV-PVT tells the class only. Class 0 means
not available; classes from 12 on mean 120 s or more, which has no upper bound."""
_NO_LIMIT = 12

_PLACE = ("lat_deg", "lon_deg", "height_m", "x_undulation_m")
OF_POSITION = {
    *_PLACE, "speed_mps", "vel_e_mps", "vel_n_mps", "vel_u_mps",
    "sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2", "x_h_accuracy_m", "x_v_accuracy_m",
}  # fmt: skip
"""Columns that mean nothing beside a fix that is none."""
WITHOUT_FIX = "value without a fix"

Floats = NDArray[np.float64]


def has_no_fix(raw: Raw) -> NDArray[np.bool_]:
    """(n,) whether NAV-PVT carries no position to use: fixType 0 or 5, or gnssFixOk 0."""
    none: NDArray[np.bool_] = np.isin(raw["fix_type"], _NO_FIX)
    none |= (raw["fix_flags"] & _FIX_OK) == 0
    return none


def fix_mode(raw: Raw) -> NDArray[np.int8]:
    """(n,) index into MODES from NAV-PVT; `dgnss` until NAV-SBAS tells that it is SBAS."""
    flags, fix_type = raw["fix_flags"], raw["fix_type"]
    differential = (flags & _DIFFERENTIAL) != 0
    code = np.where(differential, MODES.index("dgnss"), MODES.index("standalone")).astype(np.int8)
    carrier = flags >> 6
    code[(carrier == 1) | (carrier == 2)] = MODES.index("rtk")
    code[(carrier == 3) | (fix_type > _LAST_FIX_TYPE)] = MODES.index("other")
    code[np.isin(fix_type, _DEAD_RECKONING)] = MODES.index("other")
    code[has_no_fix(raw)] = MODES.index("none")
    return code


def pvt(raw: Raw, want: Set[str]) -> Decoded:
    """Columns from NAV-PVT."""
    out = Decoded()
    columns = out.columns
    outside = np.zeros(len(raw["position"]), np.bool_)
    for name, limit in (("lat", 900_000_000), ("lon", 1_800_000_000)):
        if f"{name}_deg" in want:
            columns[f"{name}_deg"] = raw[name] / 1e7
            too_large = np.abs(raw[name].astype(np.int64)) > limit
            if too_large.any():
                out.remove(f"{name}_deg", "angle out of range", too_large, columns[f"{name}_deg"])
                outside |= too_large
    if "height_m" in want:
        columns["height_m"] = raw["height"] / 1000
    if "x_undulation_m" in want:
        columns["x_undulation_m"] = (raw["height"].astype(np.int64) - raw["altitude"]) / 1000
    for name, field, sign in (("n", "vn", 1000), ("e", "ve", 1000), ("u", "vd", -1000)):
        if f"vel_{name}_mps" in want:
            columns[f"vel_{name}_mps"] = raw[field] / sign
    if "speed_mps" in want:
        columns["speed_mps"] = raw["speed"] / 1000
    for name in ("h_accuracy", "v_accuracy"):
        if (column := f"x_{name}_m") in want:
            columns[column] = raw[name] / 1000
            out.remove(column, str(_U4_MISSING), raw[name] == _U4_MISSING, columns[column])
    if "pdop" in want:
        columns["pdop"] = out.scaled("pdop", raw["pdop"], _DOP_MISSING)
    if "n_sv" in want:
        columns["n_sv"] = raw["n_sv"].astype(np.int16)
    if "correction_age_s" in want:
        age_class = raw["fix_flags_3"] >> 1 & 15
        columns["correction_age_s"] = AGE_LIMITS_S[age_class]
        out.count("correction_age_s", "120 s or more", age_class >= _NO_LIMIT)
    origin = _remove_unusable(raw, out)
    if "flags" in want:
        out.add_flags(Flag.POSITION_SENTINEL, origin)
        out.add_flags(Flag.OUT_OF_RANGE, outside)
        out.add_flags(Flag.TWO_DIMENSIONAL, raw["fix_type"] == _TWO_DIMENSIONAL)
        out.add_flags(Flag.DEAD_RECKONING, np.isin(raw["fix_type"], _DEAD_RECKONING))
    return out


def _remove_unusable(raw: Raw, out: Decoded) -> NDArray[np.bool_]:
    """Make missing what stands beside no fix; returns where the position is (0, 0)."""
    origin = np.zeros(len(raw["position"]), np.bool_)
    if "lat" in raw and "lon" in raw:
        origin = (raw["lat"] == 0) & (raw["lon"] == 0)
    invalid = (raw["fix_flags_3"] & _INVALID_LLH) != 0
    no_fix = has_no_fix(raw)
    for where, names, reason in (
        (origin, _PLACE, "(0, 0)"),
        (invalid, _PLACE, "value marked invalid"),
        (no_fix, tuple(OF_POSITION), WITHOUT_FIX),
    ):
        if where.any():
            for name in out.columns:
                if name in names:
                    out.remove(name, reason, where, out.columns[name])
    return origin


def dilution(raw: Raw, want: Set[str]) -> Decoded:
    """Columns from NAV-DOP."""
    out = Decoded()
    for name in ("hdop", "vdop", "pdop"):
        if name in want:
            out.columns[name] = out.scaled(name, raw[name], _DOP_MISSING)
    return out


def covariance(raw: Raw, want: Set[str]) -> Decoded:
    """Columns from NAV-COV, whose axes are north, east, down."""
    out = Decoded()
    invalid = raw["position_valid"] != 1
    for name, field in (("sigma_e_m", "ee"), ("sigma_n_m", "nn"), ("sigma_u_m", "dd")):
        if name in want:
            variance = out.floats(name, raw[field])
            out.remove(name, "value marked invalid", invalid, variance)
            negative = variance < 0
            if negative.any():
                out.remove(name, "negative variance", negative, variance)
                if "flags" in want:
                    out.add_flags(Flag.OUT_OF_RANGE, negative)
            out.columns[name] = np.sqrt(variance)
    if "cov_en_m2" in want:
        out.columns["cov_en_m2"] = out.floats("cov_en_m2", raw["ne"])
        out.remove("cov_en_m2", "value marked invalid", invalid, out.columns["cov_en_m2"])
    return out
