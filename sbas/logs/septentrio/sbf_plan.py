"""Which fields of which blocks a reading needs for the columns that are asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set

from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio.sbf_table import KINDS

FILLED = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "vdop", "pdop", "n_sv", "mode",
    "geo_prn", "sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2", "speed_mps", "vel_e_mps",
    "vel_n_mps", "vel_u_mps", "herl_m", "verl_m", "correction_age_s", "flags",
    "x_h_accuracy_m", "x_v_accuracy_m", "x_undulation_m",
)  # fmt: skip
"""Columns that SBF fills. The accuracies are the receiver's own, 2 sigma; the undulation is that
of its geoid model."""

FRAMES = {sbf.GEO_RAW_L1: "L1", sbf.GEO_RAW_L5: "L5"}
"""Blocks with frames of SBAS satellites, and their signal."""
SATELLITES = (sbf.SATELLITE_POSITIONS, sbf.GEO_CORRECTIONS, sbf.RESIDUALS)
"""Blocks with a row a satellite."""

Plan = Mapping[int, tuple[str, ...]]
"""Block number -> fields to keep of it."""

_PVT_FIELDS: dict[str, tuple[str, ...]] = {
    "lat_deg": ("lat", "x", "y", "z"), "lon_deg": ("lon", "x", "y", "z"),
    "height_m": ("height", "x", "y", "z"),
    **dict.fromkeys(("speed_mps", "vel_e_mps", "vel_n_mps", "vel_u_mps"),
                    ("vn", "ve", "vu", "vx", "vy", "vz", "x", "y", "z")),
    "n_sv": ("n_sv",), "mode": ("mode", "wa_corr_info"),
    "geo_prn": ("mode", "geo_svid", "reference_id"),
    "correction_age_s": ("correction_age",),
    "flags": ("mode", "lat", "lon", "x", "y", "z", "alert_flag"),
    "x_h_accuracy_m": ("h_accuracy",), "x_v_accuracy_m": ("v_accuracy",),
    "x_undulation_m": ("undulation",),
    "hpl_m": ("signal_info",), "vpl_m": ("signal_info",),
}  # fmt: skip
_CARTESIAN_COVARIANCE = ("xx", "yy", "zz", "xy", "xz", "yz")
_COVARIANCE_FIELDS: dict[str, tuple[str, ...]] = {
    "sigma_e_m": ("ee", *_CARTESIAN_COVARIANCE),
    "sigma_n_m": ("nn", *_CARTESIAN_COVARIANCE),
    "sigma_u_m": ("uu", *_CARTESIAN_COVARIANCE),
    "cov_en_m2": ("ne", *_CARTESIAN_COVARIANCE),
}
_DILUTION_FIELDS: dict[str, tuple[str, ...]] = {
    "hdop": ("hdop",), "vdop": ("vdop",), "pdop": ("pdop",), "n_sv": ("n_sv",),
    "hpl_m": ("hpl",), "vpl_m": ("vpl",),
}  # fmt: skip
_RAIM_FIELDS: dict[str, tuple[str, ...]] = {
    "herl_m": ("herl",), "verl_m": ("verl",), "flags": ("integrity_flag",),
}  # fmt: skip
_NEEDS: dict[str, tuple[str, ...]] = {
    # What a column needs beside its own fields: rotation, kind of the levels, complete flags.
    **dict.fromkeys(_COVARIANCE_FIELDS, ("lat_deg", "lon_deg")),
    "hpl_m": ("mode", "n_sv"), "vpl_m": ("mode", "n_sv"),
    "flags": ("lat_deg", "lon_deg", "sigma_e_m", "sigma_n_m", "sigma_u_m", "hpl_m", "vpl_m",
              "mode", "n_sv"),
}  # fmt: skip


def with_needs(columns: Iterable[str]) -> set[str]:
    """The columns, and those without which they cannot be filled."""
    asked = set(columns)
    return asked.union(*(_NEEDS.get(name, ()) for name in asked))


def epoch_plan(want: Set[str]) -> dict[int, tuple[str, ...]]:
    """Fields for the columns `want` of the epoch table."""
    by_kind = (_PVT_FIELDS, _COVARIANCE_FIELDS, _DILUTION_FIELDS, _RAIM_FIELDS)
    always: tuple[set[str], ...] = ({"error"}, {"error"}, set(), set())
    plan: dict[int, tuple[str, ...]] = {}
    for numbers, fields, minimum in zip(KINDS, by_kind, always, strict=True):
        names = {name for column in want for name in fields.get(column, ())} | minimum
        for number in numbers:
            plan[number] = tuple(sorted(names & sbf.BLOCKS[number].fields.keys()))
    plan[sbf.END_OF_PVT] = ()
    return plan


def whole_plan(want: Set[str], *, frames: bool, satellites: bool) -> dict[int, tuple[str, ...]]:
    """Fields for the epoch table, for the metadata, and for side tables.

    Parameters
    ----------
    want : columns of the epoch table.
    frames : whether the content of the frames is needed, beside their number.
    satellites : whether the blocks with a row a satellite are needed.
    """
    plan = epoch_plan(want)
    plan[sbf.PVT_GEODETIC] += ("datum", "misc")
    plan[sbf.PVT_CARTESIAN] += ("misc",)
    plan[sbf.RECEIVER_TIME] = ("leap_seconds", "sync_level")
    plan |= dict.fromkeys(FRAMES, ("svid", "crc_passed", "bits") if frames else ())
    if satellites:
        plan |= dict.fromkeys(SATELLITES, ())
    return plan
