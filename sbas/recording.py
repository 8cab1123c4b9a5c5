"""Recording: the table every source yields and every analysis takes.

One row per epoch, GPS time as index, documented columns with the unit in the name. `COLUMNS`
is the one nomenclature: validation, readers, docs and tests read it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from enum import IntFlag
from typing import Any, Literal, Protocol

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding

SCHEMA_VERSION = 1
BATCH_ROWS = 1 << 19
"""Epochs per batch where a source can stream; bounds the memory of every analysis."""

MODES = (
    "none", "standalone", "sbas_pa", "sbas_npa", "sbas", "dgnss", "rtk", "other",
)  # fmt: skip
"""What the fix used; `sbas` where the format does not tell PA from NPA."""

SBAS_MODES = ("sbas_pa", "sbas_npa", "sbas")


class Flag(IntFlag):
    """Bits of the column `flags`."""

    PL_SENTINEL = 1
    POSITION_SENTINEL = 2
    PL_OUTSIDE_SBAS = 4
    PL_DECLARED_INVALID = 8
    RAIM_PASSED = 16
    RAIM_FAILED = 32
    RAIM_NOT_AVAILABLE = 64
    TWO_DIMENSIONAL = 128
    DATE_INFERRED = 256
    DUPLICATE_TIME = 512
    TIME_BACKWARD = 1024
    EPOCH_INCOMPLETE = 2048
    OUT_OF_RANGE = 4096
    DEAD_RECKONING = 8192
    AFTER_GAP = 16384


@dataclass(frozen=True)
class Column:
    """One column of the epoch table: its dtype, what stands for missing, unit and meaning."""

    name: str
    dtype: Literal["f8", "i2", "u4", "bool", "category"]
    missing: float | int | bool | None
    unit: str
    meaning: str


def _columns(dtype: str, missing: Any, rows: Sequence[tuple[str, str, str]]) -> list[Column]:
    return [Column(name, dtype, missing, unit, meaning) for name, unit, meaning in rows]  # type: ignore[arg-type]


COLUMNS: dict[str, Column] = {
    column.name: column
    for column in (
        *_columns("f8", np.nan, [
            ("lat_deg", "deg", "geodetic latitude, -90..90, frame in the metadata"),
            ("lon_deg", "deg", "geodetic longitude, -180..180"),
            ("height_m", "m", "height above the ellipsoid"),
            ("hpl_m", "m", "horizontal protection level as reported; never 0"),
            ("vpl_m", "m", "vertical protection level as reported; never 0"),
            ("hdop", "1", "horizontal dilution of precision"),
            ("vdop", "1", "vertical dilution of precision"),
            ("pdop", "1", "position dilution of precision"),
            ("sigma_e_m", "m", "1-sigma of the reported fix, east"),
            ("sigma_n_m", "m", "1-sigma of the reported fix, north"),
            ("sigma_u_m", "m", "1-sigma of the reported fix, up"),
            ("cov_en_m2", "m2", "east-north covariance of the reported fix"),
            ("speed_mps", "m/s", "speed over ground"),
            ("vel_e_mps", "m/s", "velocity, east"),
            ("vel_n_mps", "m/s", "velocity, north"),
            ("vel_u_mps", "m/s", "velocity, up"),
            ("herl_m", "m", "RAIM horizontal external reliability level"),
            ("verl_m", "m", "RAIM vertical external reliability level"),
            ("correction_age_s", "s", "mean age of the (fast) corrections"),
        ]),
        *_columns("i2", -1, [
            ("n_sv", "1", "satellites used in the fix"),
            ("n_sv_tracked", "1", "satellites tracked or suitable"),
            ("geo_prn", "1", "PRN of the SBAS satellite used, 120..158; 0 = several or any"),
        ]),
        Column("mode", "category", None, "", "what the fix used: " + ", ".join(MODES)),
        Column("flags", "u4", 0, "", "bits of sbas.recording.Flag"),
        Column("environment", "category", None, "", "environment label, such as open or cutting"),
        Column("hardware_fault", "bool", False, "", "the receiver reported a hardware fault"),
    )
}  # fmt: skip
"""Every documented column; further columns carry the prefix `x_`."""

PlKind = Literal["do229", "raim", "receiver", "tmir", "unknown"]


@dataclass(frozen=True)
class ProtectionLevelMeta:
    """What the protection levels of a recording are: their kind, K factors and stated risk."""

    kind: PlKind = "unknown"
    k_h: float | None = None
    k_v: float | None = None
    risk: float | None = None
    risk_per: str = ""


@dataclass(frozen=True)
class Source:
    """A file that a recording was read from, or the generator that made it."""

    path: str
    bytes: int = 0
    sha256: str = ""
    format: str = ""
    reader_version: str = ""


@dataclass(frozen=True)
class RecordingMeta:
    """Where a recording comes from and how its columns are to be understood.

    All values are plain, so that the metadata pass through JSON (and thereby Parquet) unchanged.
    """

    sources: tuple[Source, ...] = ()
    time_scale: str = "GPST"
    leap_seconds: int | None = None
    frame: str = ""
    frame_epoch: str = ""
    height_reference: str = "ellipsoid"
    geoid: str = ""
    antenna: str = ""
    receiver: str = ""
    firmware: str = ""
    pl: ProtectionLevelMeta = field(default_factory=ProtectionLevelMeta)
    findings: tuple[Finding, ...] = ()
    options: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    schema: int = SCHEMA_VERSION

    def to_json(self) -> str:
        return json.dumps(asdict(self), sort_keys=True)

    @classmethod
    def from_json(cls, text: str) -> RecordingMeta:
        """Inverse of `to_json`; raises InputError for anything that `to_json` did not write."""
        try:
            plain = json.loads(text)
            if plain["schema"] > SCHEMA_VERSION:
                raise ValueError(f"schema {plain['schema']} is newer than {SCHEMA_VERSION}")
            plain["sources"] = tuple(Source(**s) for s in plain["sources"])
            plain["findings"] = tuple(Finding(**f) for f in plain["findings"])
            plain["pl"] = ProtectionLevelMeta(**plain["pl"])
            return cls(**plain)
        except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
            raise InputError(
                "the recording's metadata cannot be read",
                evidence=str(error),
                cure="write the recording again with this version of sbas",
            ) from error


class EpochSource(Protocol):
    """What an analysis needs: metadata, and epochs in batches of documented columns."""

    @property
    def meta(self) -> RecordingMeta: ...

    @property
    def columns(self) -> tuple[str, ...]: ...

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Tables in file order, indexed by time, with just these columns.

        Columns that the source lacks are filled with their missing value.
        """
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Epochs of one receiver, with metadata and side tables.

    Parameters
    ----------
    table : one row per epoch, index `time` (GPS time, datetime64[ns]), columns of `COLUMNS`
        (any subset) or with prefix `x_`.
    meta : RecordingMeta.
    side_tables : further tables by name, such as `sbas_frames` (raw SBAS frames) and
        `satellites` (epoch x satellite); each has a column `time`.

    Raises
    ------
    InputError : a column that is not documented, has another dtype, or an index that is not
        GPS time.
    """

    table: pd.DataFrame
    meta: RecordingMeta = field(default_factory=RecordingMeta)
    side_tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)

    def __post_init__(self) -> None:
        validate_table(self.table)
        for name, side in self.side_tables.items():
            if "time" not in side.columns:
                raise InputError(
                    f"side table {name!r} has no column 'time'",
                    cure="give every row of a side table its GPS time",
                )

    def __len__(self) -> int:
        return len(self.table)

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(self.table.columns)

    @property
    def time(self) -> NDArray[np.datetime64]:
        """(n,) GPS times, in file order."""
        times: NDArray[np.datetime64] = self.table.index.to_numpy()
        return times

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """The whole table as batches; see EpochSource."""
        for start in range(0, max(len(self.table), 1), BATCH_ROWS):
            yield with_columns(self.table.iloc[start : start + BATCH_ROWS], columns)

    def replace(self, **changes: Any) -> Recording:
        """A recording with other table, meta or side tables; nothing is written in place."""
        return replace(self, **changes)

    def with_findings(self, *findings: Finding) -> Recording:
        """The same recording with findings added to its metadata."""
        return self.replace(meta=replace(self.meta, findings=(*self.meta.findings, *findings)))

    def __repr__(self) -> str:
        sources = ", ".join(f"{s.path} ({s.format})" for s in self.meta.sources) or "no source"
        lines = [f"Recording of {len(self):,} epochs from {sources}"]
        if len(self):
            lines.append(f"  time     {self.time[0]} to {self.time[-1]} GPST")
        for name in self.table.columns:
            values = self.table[name]
            column = COLUMNS.get(name)
            if column is None or column.dtype not in ("f8", "i2"):
                continue
            known = values.notna() if column.dtype == "f8" else values != column.missing
            if known.any():
                seen = values[known]
                text = f"{seen.min():.6g} .. {seen.median():.6g} .. {seen.max():.6g}"
            else:
                text = "missing"
            lines.append(f"  {name:17s}{text}  ({int(known.sum()):,} epochs)")
        lines += [
            f"  side table {name}: {len(side):,} rows" for name, side in self.side_tables.items()
        ]
        lines += [f"  {f.code} {f.severity}: {f.message}" for f in self.meta.findings]
        return "\n".join(lines)


def missing_values(name: str, rows: int) -> Any:
    """(rows,) array or categorical of a documented column's missing value."""
    column = COLUMNS.get(name)
    if column is None:
        raise InputError(f"unknown column {name!r}", cure=f"known are {', '.join(COLUMNS)}")
    if column.dtype == "category":
        categories = MODES if name == "mode" else ()
        return pd.Categorical.from_codes(np.full(rows, -1, np.int8), categories=list(categories))
    return np.full(rows, column.missing, dtype=column.dtype)


def with_columns(table: pd.DataFrame, columns: Sequence[str]) -> pd.DataFrame:
    """The table with just these columns; documented ones that it lacks are filled as missing."""
    absent = [name for name in columns if name not in table.columns]
    if not absent:
        return table[list(columns)]
    filled = {name: missing_values(name, len(table)) for name in absent}
    return table.assign(**filled)[list(columns)]


def mode_categories(codes: NDArray[np.integer[Any]]) -> pd.Categorical:
    """Column `mode` from (n,) indices into `MODES`."""
    return pd.Categorical.from_codes(np.asarray(codes, np.int8), categories=list(MODES))


def validate_table(table: pd.DataFrame) -> None:
    """Raise InputError unless the table is an epoch table as `COLUMNS` describes."""
    index = table.index
    if index.name != "time" or index.dtype != np.dtype("M8[ns]"):
        raise InputError(
            "the index of an epoch table is GPS time",
            evidence=f"index {index.name!r} of dtype {index.dtype}",
            cure="table.index = times.astype('datetime64[ns]').rename('time')",
        )
    if index.hasnans:
        raise InputError("an epoch has no time", cure="drop rows without time, and count them")
    if not table.columns.is_unique:
        raise InputError("two columns have the same name", evidence=str(list(table.columns)))
    for name in table.columns:
        column = COLUMNS.get(name)
        if column is None:
            if not str(name).startswith("x_"):
                raise InputError(
                    f"column {name!r} is not documented",
                    cure=f"rename it to 'x_{name}', or to one of {', '.join(COLUMNS)}",
                )
            continue
        dtype = table[name].dtype
        is_category = isinstance(dtype, pd.CategoricalDtype)
        right = is_category if column.dtype == "category" else dtype == np.dtype(column.dtype)
        if right and name == "mode":
            right = list(dtype.categories) == list(MODES)
        if not right:
            raise InputError(
                f"column {name!r} has the wrong type",
                evidence=f"{dtype}, expected {column.dtype}",
                cure=f"table[{name!r}].astype({column.dtype!r})",
            )


def left_out_levels(table: pd.DataFrame) -> NDArray[np.bool_]:
    """(n,) True where a protection level is none of the service: the fix was no SBAS fix, or the
    source declared the level invalid. A mode that nobody stated leaves the level in.

    Parameters
    ----------
    table : epochs with the columns `flags` and `mode`.
    """
    flagged = (table["flags"].to_numpy() & _LEFT_OUT) != 0
    codes = table["mode"].cat.codes.to_numpy()
    inside = np.isin(codes, [-1, *(MODES.index(mode) for mode in SBAS_MODES)])
    outside: NDArray[np.bool_] = flagged | ~inside
    return outside


_LEFT_OUT = np.uint32(Flag.PL_OUTSIDE_SBAS | Flag.PL_DECLARED_INVALID)


def major_semi_axis_m(
    sigma_e_m: NDArray[np.float64], sigma_n_m: NDArray[np.float64], cov_en_m2: NDArray[np.float64]
) -> NDArray[np.float64]:
    """1-sigma major semi-axis of the horizontal error ellipse [m], DO-229 `d_major`.

    Where the covariance is missing (NaN), the safe root sum of squares of the two sigmas, which
    is never smaller, stands in. Source: RTCA DO-229D, J.1; Filip, Bazant, Mocek 2010, Fig. 3.
    """
    se2, sn2 = sigma_e_m**2, sigma_n_m**2
    half_sum, half_difference = (se2 + sn2) / 2, (se2 - sn2) / 2
    radius = np.hypot(half_difference, np.where(np.isnan(cov_en_m2), 0.0, cov_en_m2))
    axis = np.sqrt(half_sum + radius)
    return np.where(np.isnan(cov_en_m2), np.sqrt(se2 + sn2), axis)
