"""Truth trajectories: position over time from CSV or Parquet.

A truth must be clean: what a recording may carry as a warning (unreadable lines, sentinels,
heights of unknown kind) is refused here, since every error figure would rest on it.
"""

from __future__ import annotations

import os
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq

from sbas.exceptions import InputError
from sbas.frames import find_frame, unprojected
from sbas.logs.arrow.parquet import opened, read
from sbas.logs.arrow.parquet_foreign import map_foreign
from sbas.logs.arrow.parquet_writer import META_KEY
from sbas.logs.delimited import delimited_text
from sbas.logs.delimited.column_map import MappedTable, geoid_unused
from sbas.logs.delimited.column_names import TRUTH_COLUMNS
from sbas.timescales import TimeScale

POSITION = ("lat_deg", "lon_deg", "height_m")
PROJECTED = ("x_easting_m", "x_northing_m")
"""Columns `easting_m` and `northing_m`, which no recording documents."""


def read_truth_table(
    path: str | os.PathLike[str],
    *,
    time_scale: TimeScale | None = None,
    geoid: float | None = None,
    frame: str = "",
) -> pd.DataFrame:
    """Truth trajectory of a file.

    Parameters
    ----------
    path : CSV or Parquet with time, latitude, longitude and height, in any spelling that the
        alias map of delimited text knows; optional `sigma_h_m`, `sigma_v_m`, `heading_deg`.
    time_scale : scale of the times, which goes before what a header says; needed for Parquet
        without metadata of sbas.
    geoid : undulation [m], added where the file says that its heights are above the geoid.
    frame : projection such as "EPSG:25833", for a file with `easting_m` and `northing_m`.

    Returns
    -------
    Table indexed by `time` (GPS time), float64 columns `lat_deg`, `lon_deg`, `height_m`, and
    the optional ones that the file has; rows in file order. Of projected coordinates, latitude
    and longitude in the datum of the projection. Where `time_scale` contradicts the header, the
    warning that a recording carries is in `attrs["findings"]`, as a dict.

    Raises
    ------
    InputError : a column is missing, or anything was odd about the file.
    """
    file = Path(path)
    if not file.is_file():
        raise InputError(
            "the truth is no regular file" if file.exists() else "there is no such truth file",
            where=str(path),
            cure="check the name and the folder",
        )
    with open(file, "rb") as stream:
        is_parquet = stream.read(4) == b"PAR1"
    columns = (*POSITION, *TRUTH_COLUMNS, *PROJECTED)
    if not is_parquet:
        try:
            mapped = delimited_text.read_mapped(
                file, columns=columns, extra=TRUTH_COLUMNS, time_scale=time_scale, geoid=geoid
            )
        except InputError as error:
            error.cure = _of_truth(error.cure)
            raise
        return _checked(mapped, frame, str(path))
    with opened(file) as parquet:
        if META_KEY not in (parquet.schema_arrow.metadata or {}):
            mapped = _foreign(parquet, file, columns, time_scale, geoid)
            return _checked(mapped, frame, str(path))
    recording = read(file, columns=POSITION)  # its metadata say scale and kind of height
    errors = tuple(f for f in recording.meta.findings if f.severity == "error")
    return _checked(MappedTable(recording.table, errors, "GPST", None, {}), frame, str(path))


def _foreign(
    parquet: pq.ParquetFile,
    file: Path,
    columns: tuple[str, ...],
    time_scale: TimeScale | None,
    geoid: float | None,
) -> MappedTable:
    if time_scale is None:
        raise InputError(
            "the truth does not say in which time scale its times are",
            where=str(file),
            cure="--truth-time-scale UTC or --truth-time-scale GPST; 18 s are 700 m at 140 km/h",
        )
    return map_foreign(
        parquet, file, columns=columns, extra=TRUTH_COLUMNS, time_scale=time_scale, geoid=geoid
    )


def _of_truth(cure: str) -> str:
    """A cure for recordings in the options of the truth, which are fewer."""
    if any(option in cure for option in ("--decimal", "--encoding", "--max-line", "--mode-map")):
        return "write it as UTF-8, with decimal points and a line for each epoch"
    for option in ("--time-scale", "--geoid"):
        cure = cure.replace(option, f"--truth-{option.removeprefix('--')}")
    return cure


def _checked(mapped: MappedTable, frame: str, where: str) -> pd.DataFrame:
    projected = "lat_deg" not in mapped.table and all(name in mapped.table for name in PROJECTED)
    needed = (*PROJECTED, "height_m") if projected else POSITION
    lacking = [name for name in needed if name not in mapped.table]
    if lacking:
        raise InputError(
            f"the truth has no {', '.join(lacking)}",
            where=where,
            evidence=mapped.options.get("columns", ", ".join(mapped.table.columns)),
            cure="name the columns time, lat_deg, lon_deg, height_m (or easting_m, northing_m)",
        )
    # Decimal commas are read without doubt or refused; an undulation that no height needs is
    # there for the track.
    told = [f for f in mapped.findings if f.code == "E26" and f.severity == "warning"]
    odd = [
        finding
        for finding in mapped.findings
        if finding.severity != "info"
        and finding.code != "E20"
        and finding != geoid_unused()
        and finding not in told
    ]
    if odd:
        raise InputError(
            f"the truth is not clean: {odd[0].message}",
            where=where,
            evidence=odd[0].evidence,
            cure=_of_truth(odd[0].cure) or "correct the file",
        )
    table = mapped.table[[n for n in (*needed, *TRUTH_COLUMNS) if n in mapped.table]]
    incomplete = table[list(needed)].isna().any(axis=1)
    if incomplete.any():
        raise InputError(
            "the truth has rows without a position",
            where=where,
            evidence=f"{int(incomplete.sum()):,} of {len(table):,}, first at "
            f"{table.index[incomplete.to_numpy().argmax()]}",
            cure="take those rows out: a gap in the truth is honest",
        )
    if projected:
        table = _unprojected(table, frame, where)
    table = table.astype("f8")
    if told:
        table.attrs["findings"] = [finding.to_dict() for finding in told]
    return table


def _unprojected(table: pd.DataFrame, frame: str, where: str) -> pd.DataFrame:
    if not frame:
        raise InputError(
            "the truth has easting and northing, and nobody said of which projection",
            where=where,
            cure="--frame EPSG:25833, the code of the projection",
        )
    if any(table[name].dtype.kind not in "fiu" for name in PROJECTED):
        raise InputError("the truth's easting and northing are no numbers", where=where)
    lat, lon = unprojected(find_frame(frame), *(table[name].to_numpy() for name in PROJECTED))
    others = [name for name in table if name not in PROJECTED]
    return table.assign(lat_deg=lat, lon_deg=lon)[["lat_deg", "lon_deg", *others]]
