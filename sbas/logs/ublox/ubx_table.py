"""The columns of the epoch table from the messages of its rows, chunk by chunk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.logs.delimited.column_map import pl_outside_sbas
from sbas.logs.septentrio.sbf_decode import Decoded, Removed
from sbas.logs.ublox import ubx_decode as decode
from sbas.logs.ublox import ubx_messages as ubx
from sbas.logs.ublox.ubx_epochs import KINDS, Rows
from sbas.logs.ublox.ubx_levels import HorizontalLevel, LevelCounts, levels
from sbas.logs.ublox.ubx_times import gps_times
from sbas.recording import COLUMNS, MODES, Flag, missing_values, mode_categories

Columns = dict[str, NDArray[Any]]

_FIELDS: dict[int, dict[str, tuple[str, ...]]] = {
    ubx.NAV_PVT: {
        "lat_deg": ("lat", "lon"), "lon_deg": ("lat", "lon"), "height_m": ("height", "lat", "lon"),
        "x_undulation_m": ("height", "altitude", "lat", "lon"), "vel_n_mps": ("vn",),
        "vel_e_mps": ("ve",), "vel_u_mps": ("vd",), "speed_mps": ("speed",),
        "x_h_accuracy_m": ("h_accuracy",), "x_v_accuracy_m": ("v_accuracy",),
        "pdop": ("pdop",), "n_sv": ("n_sv",), "flags": ("lat", "lon"),
    },
    ubx.NAV_DOP: {"hdop": ("hdop",), "vdop": ("vdop",), "pdop": ("pdop",)},
    ubx.NAV_COV: {"sigma_e_m": ("ee",), "sigma_n_m": ("nn",), "sigma_u_m": ("dd",),
                  "cov_en_m2": ("ne",)},
    ubx.NAV_PL: dict.fromkeys(
        ("hpl_m", "vpl_m"), ("risk_digits", "risk_exponent", "valid", "axes", "reason", "level_1",
                             "level_2", "level_3")),
    ubx.NAV_SBAS: {"mode": ("geo",), "geo_prn": ("geo",)},
}  # fmt: skip
_ALWAYS = {ubx.NAV_PVT: {"fix_type", "fix_flags", "fix_flags_3"},
           ubx.NAV_COV: {"position_valid"}}  # fmt: skip
_NEEDS: dict[str, tuple[str, ...]] = {
    # What a column needs beside its own fields: levels show in the flags, and in the modes.
    "flags": ("lat_deg", "lon_deg", "sigma_e_m", "sigma_n_m", "sigma_u_m", "hpl_m", "vpl_m",
              "mode"),
    "geo_prn": ("mode",),
}  # fmt: skip

FILLED = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "vdop", "pdop", "n_sv", "mode",
    "geo_prn", "sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2", "speed_mps", "vel_e_mps",
    "vel_n_mps", "vel_u_mps", "correction_age_s", "flags", "x_h_accuracy_m", "x_v_accuracy_m",
    "x_undulation_m",
)  # fmt: skip
"""Columns that UBX fills. The accuracies are the receiver's own estimates hAcc and vAcc; the
undulation is that of its geoid model; the age is the upper bound of the class that it reports."""


def needed(asked: Iterable[str]) -> frozenset[str]:
    """Columns to decode for those asked."""
    return frozenset(asked).union(*(_NEEDS.get(name, ()) for name in asked))


def plan(want: Set[str]) -> dict[int, tuple[str, ...]]:
    """Fields to keep of each kind of message beside its times."""
    fields = {
        key: {name for column in want for name in _FIELDS.get(key, {}).get(column, ())}
        | _ALWAYS.get(key, set())
        for key in KINDS
    }
    return {key: tuple(sorted(names)) for key, names in fields.items()}


@dataclass
class Tally:
    """What was counted while rows were made; parts of a file add up to the whole."""

    removed: Removed = field(default_factory=Counter)
    without_time: Counter[str] = field(default_factory=Counter)
    levels: LevelCounts = field(default_factory=LevelCounts)
    covers: NDArray[np.int64] = field(default_factory=lambda: np.zeros(256, np.int64))
    inferred: int = 0
    disagreeing: int = 0

    def add(self, other: Tally) -> None:
        self.removed.update(other.removed)
        self.without_time.update(other.without_time)
        self.levels.add(other.levels)
        self.covers += other.covers
        self.inferred += other.inferred
        self.disagreeing += other.disagreeing

    @property
    def rows(self) -> int:
        return int(self.covers.sum())

    @property
    def kinds(self) -> int:
        """Bits of the kinds of message that any row has."""
        return int(np.bitwise_or.reduce(np.flatnonzero(self.covers), initial=0))

    @property
    def incomplete(self) -> int:
        """Rows that lack a kind of message which other rows have; NAV-TIMEGPS is only a clock."""
        covers = np.arange(256) | _CLOCK
        lacking = (covers & self.kinds) != self.kinds
        return int(self.covers[lacking].sum())


_CLOCK = 1 << KINDS.index(ubx.NAV_TIMEGPS)


@dataclass(frozen=True)
class Part:
    """Rows of a stretch of the file: times, columns, and what only the whole file can settle.

    Parameters
    ----------
    time_ms : (rows,) GPS time since 1980-01-06 [ms].
    columns : name -> (rows,), the mode as index into MODES, -1 for none.
    cover : (rows,) bits of the kinds of message.
    risk : (rows,) risk of the protection levels, NaN where there are none to use.
    """

    time_ms: NDArray[np.int64]
    columns: Columns
    cover: NDArray[np.uint8]
    risk: NDArray[np.float64]


def joined(parts: Sequence[Part]) -> Part:
    """Parts of one file as one; columns are taken out of the parts as they go in."""
    if len(parts) == 1:
        return parts[0]
    return Part(
        np.concatenate([part.time_ms for part in parts]),
        {
            name: np.concatenate([part.columns.pop(name) for part in parts])
            for name in list(parts[0].columns)
        },
        np.concatenate([part.cover for part in parts]),
        np.concatenate([part.risk for part in parts]),
    )


def _empty(name: str, rows: int) -> NDArray[Any]:
    if name == "mode":
        return np.full(rows, -1, np.int8)
    missing: NDArray[Any] = missing_values(name, rows) if name in COLUMNS else np.full(rows, np.nan)
    return missing


def fill(rows: Rows, want: Set[str], horizontal: HorizontalLevel) -> tuple[Part, Tally]:
    """Columns of some rows.

    Parameters
    ----------
    rows : the rows and their messages.
    want : columns to fill, with those that they need.
    horizontal : how the two horizontal levels of NAV-PL become one.
    """
    count = len(rows.time_ms)
    columns: Columns = {name: _empty(name, count) for name in want}
    tally = Tally(
        without_time=rows.without_time,
        covers=np.bincount(rows.cover, minlength=256),
        inferred=int(np.count_nonzero(rows.inferred)),
        disagreeing=rows.disagreeing,
    )
    risk = np.full(count, np.nan)
    if "flags" in want:
        columns["flags"] |= rows.inferred * np.uint32(Flag.DATE_INFERRED)

    def put(key: int, decoded: Decoded) -> None:
        tally.removed.update(decoded.removed)
        at = rows.row_of[key]
        for name, values in decoded.columns.items():
            if name == "flags":
                columns[name][slice(None) if at is None else at] |= values
            elif at is None:
                columns[name] = values
            else:
                columns[name][at] = values

    no_fix = None
    if ubx.NAV_PVT in rows.row_of:
        raw, at = rows.raw[ubx.NAV_PVT], rows.row_of[ubx.NAV_PVT]
        put(ubx.NAV_PVT, decode.pvt(raw, want))
        no_fix = np.zeros(count, np.bool_)
        no_fix[slice(None) if at is None else at] = decode.has_no_fix(raw)
        if "mode" in want:
            columns["mode"][slice(None) if at is None else at] = decode.fix_mode(raw)
    if ubx.NAV_DOP in rows.row_of:
        put(ubx.NAV_DOP, decode.dilution(rows.raw[ubx.NAV_DOP], want))
    if ubx.NAV_COV in rows.row_of:
        decoded = decode.covariance(rows.raw[ubx.NAV_COV], want)
        at = rows.row_of[ubx.NAV_COV]
        if no_fix is not None and (without := no_fix if at is None else no_fix[at]).any():
            for name in decode.OF_POSITION & decoded.columns.keys():
                decoded.remove(name, decode.WITHOUT_FIX, without, decoded.columns[name])
        put(ubx.NAV_COV, decoded)
    if ubx.NAV_PL in rows.row_of and want & {"hpl_m", "vpl_m"}:
        raw, at = rows.raw[ubx.NAV_PL], rows.row_of[ubx.NAV_PL]
        decoded, of_level, tally.levels = levels(raw, want, horizontal)
        put(ubx.NAV_PL, decoded)
        risk[slice(None) if at is None else at] = of_level
    if ubx.NAV_SBAS in rows.row_of and "mode" in want:
        _tell_sbas(rows, columns)
    return Part(rows.time_ms, columns, rows.cover, risk), tally


def _tell_sbas(rows: Rows, columns: Columns) -> None:
    """Differential fixes of epochs whose NAV-SBAS names a GEO in use are SBAS fixes."""
    at = rows.row_of[ubx.NAV_SBAS]
    geo = np.zeros(len(rows.time_ms), np.int16)
    geo[slice(None) if at is None else at] = rows.raw[ubx.NAV_SBAS]["geo"]
    sbas = (columns["mode"] == MODES.index("dgnss")) & (geo != 0)
    columns["mode"][sbas] = MODES.index("sbas")
    if "geo_prn" in columns:
        known = sbas & (geo >= 120) & (geo <= 158)
        columns["geo_prn"][known] = geo[known]


def repeated_rows(time_ms: NDArray[np.int64]) -> NDArray[np.int64]:
    """Numbers of the rows whose time an earlier row has, in order."""
    if (np.diff(time_ms) > 0).all():
        return np.empty(0, np.int64)
    first = np.ones(len(time_ms), np.bool_)
    first[np.unique(time_ms, return_index=True)[1]] = False
    return np.flatnonzero(first)


@dataclass(frozen=True)
class Whole:
    """What only the whole file tells: kinds of message in it, the risk kept, repeated rows."""

    kinds: int
    risk: float | None
    repeated: NDArray[np.int64]


def finish(part: Part, whole: Whole, *, first_row: int = 0, before_ms: int | None = None) -> Part:
    """The part with what the whole file settles: flags, and levels of one risk only.

    Parameters
    ----------
    part : rows as `fill` made them; its columns are written to.
    whole : of the whole file.
    first_row : number of the part's first row in the file.
    before_ms : time of the row before, or None at the begin of the file.
    """
    columns = part.columns
    of_other_risk = ~np.isnan(part.risk) & (part.risk != whole.risk)
    if of_other_risk.any():
        for name in {"hpl_m", "vpl_m"} & columns.keys():
            columns[name][of_other_risk] = np.nan
    if "flags" not in columns:
        return part
    flags = columns["flags"]
    flags |= of_other_risk * np.uint32(Flag.PL_DECLARED_INVALID)
    lacking = ((part.cover | _CLOCK) & whole.kinds) != whole.kinds
    flags |= lacking * np.uint32(Flag.EPOCH_INCOMPLETE)
    low, high = np.searchsorted(whole.repeated, [first_row, first_row + len(flags)])
    flags[whole.repeated[low:high] - first_row] |= np.uint32(Flag.DUPLICATE_TIME)
    step = np.diff(part.time_ms, prepend=part.time_ms[:1] if before_ms is None else [before_ms])
    flags[step[: len(flags)] < 0] |= np.uint32(Flag.TIME_BACKWARD)
    flags |= pl_outside_sbas({**columns, "mode": mode_categories(columns["mode"])})
    return part


def frame_of(part: Part, asked: Sequence[str]) -> pd.DataFrame:
    """The epoch table of a finished part, with these columns."""
    index = pd.DatetimeIndex(gps_times(part.time_ms), name="time", copy=False)
    data: dict[str, Any] = {
        name: mode_categories(part.columns[name]) if name == "mode" else part.columns[name]
        for name in asked
    }
    return pd.DataFrame(data, index=index, copy=False)
