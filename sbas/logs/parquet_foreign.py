"""Parquet tables of other programs: columns by the alias map, times by a stated scale."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.column_map import (
    TIME_CURE,
    MappedTable,
    applied_geoid,
    convert_columns,
    map_headers,
    map_text,
    needed_columns,
)
from sbas.logs.format import Progress
from sbas.logs.time_stamps import (
    Stamps,
    parse_stamps,
    scale_of_stamps,
    stamps_to_gps,
    week_stamps,
)
from sbas.recording import COLUMNS, Recording, RecordingMeta, with_columns
from sbas.timescales import TimeScale


def read_foreign(
    file: pq.ParquetFile,
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
) -> Recording:
    """Recording of an open Parquet file without metadata of sbas; see `parquet.read`."""
    if time_scale is None:
        raise InputError(
            "the Parquet file does not say in which time scale its times are",
            where=str(path),
            evidence="no metadata of sbas (schema key 'sbas')",
            cure="say it: --time-scale GPST, or time_scale='UTC' and so on",
        )
    mapped = map_foreign(
        file, path, columns=columns, time_scale=time_scale, mode_map=mode_map, geoid=geoid
    )
    unstated = Finding(
        "E25",
        "warning",
        "the Parquet file has no metadata of sbas: frame, antenna and kind of protection level "
        "are not known",
        where=str(path),
        evidence=f"times taken as {time_scale} as asked",
    )
    meta = RecordingMeta(
        time_scale=mapped.time_scale,
        leap_seconds=mapped.leap_seconds,
        geoid=mapped.geoid,
        findings=(unstated, *mapped.findings),
        options=mapped.options,
    )
    if progress is not None:
        progress(path.stat().st_size, path.stat().st_size)
    table = mapped.table if columns is None else with_columns(mapped.table, columns)
    return Recording(table, meta)


def map_foreign(
    file: pq.ParquetFile,
    path: Path,
    *,
    columns: Collection[str] | None = None,
    extra: Collection[str] = (),
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
) -> MappedTable:
    """Documented columns of an open Parquet file; arguments as of `delimited_text.read_mapped`."""
    where = str(path)
    names = list(file.schema_arrow.names)
    headers = ["time" if n == "__index_level_0__" else n for n in names]
    mapped, others = map_headers(headers, where=where, extra=extra)
    by_week = "time" not in mapped
    time_names = ("week", "tow") if by_week else ("time",)
    if any(name not in mapped for name in time_names) or (
        not by_week and "week" in mapped and "tow" in mapped
    ):
        raise InputError(
            "no column, or more than one, gives the time",
            where=where,
            evidence=f"columns {', '.join(headers)[:300]}",
            cure="name the time column 'time', or give 'week' and 'tow'",
        )
    wanted = needed_columns(columns, mapped, others)
    every = {**mapped, **others}
    table = file.read(columns=[names[every[name].index] for name in (*time_names, *wanted)])
    arrays = {name: table.column(names[every[name].index]) for name in (*time_names, *wanted)}
    stamps, said = (
        (
            week_stamps(_numbers(arrays["week"]), _numbers(arrays["tow"]) * mapped["tow"].factor),
            "GPST",
        )
        if by_week
        else (_stamps(arrays["time"], where), mapped["time"].scale)
    )
    good = stamps.readable
    bad = int(np.count_nonzero(~good))
    stamps = stamps[good]
    if not len(stamps.ns):
        raise InputError(
            "the table has no row with a time",
            code="E15",
            where=where,
            evidence=f"{len(table):,} rows",
            cure="check its time column, or write the recording again",
        )
    header = every[time_names[0]].header
    scale, findings = scale_of_stamps(
        stamps, time_scale, said=said, header=header, by_week=by_week, where=where
    )
    times, leap_seconds, conversions = stamps_to_gps(stamps, scale)
    if bad:
        share = bad / len(good)
        findings += (
            Finding(
                "E10",
                "error" if share > 0.01 else "warning",
                f"{bad:,} of {len(good):,} rows have no readable time and are left out",
                where=where,
                cure="take them out, or complete their times",
            ),
        )
    mask = pa.array(good)
    values, texts, narrow = {}, {}, []
    for name in wanted:
        column = arrays[name].filter(mask)
        kind = column.type.value_type if pa.types.is_dictionary(column.type) else column.type
        if pa.types.is_float32(kind):
            narrow.append(name)
        if _is_text(kind) or name == "mode":
            texts[name] = _one(column.cast(pa.string()))
        elif _is_number(kind):
            values[name] = _numbers(column)
        elif name in COLUMNS:
            raise InputError(
                f"column {every[name].header!r} is neither number nor text",
                where=where,
                evidence=str(kind),
                cure="write it as numbers, or rename it to 'x_...'",
            )
    wrong_text = [n for n in texts if COLUMNS.get(n) is not None and COLUMNS[n].dtype == "f8"]
    if wrong_text or "altitude" in texts:
        raise InputError(
            "columns that should be numbers are text",
            where=where,
            evidence=", ".join(wrong_text or ["altitude"]),
            cure="write them as numbers",
        )
    if narrow:
        findings += (
            Finding(
                "E25",
                "warning",
                "numbers stored as float32 were widened; degrees in float32 lie up to 0.4 m apart",
                evidence=f"{len(good):,} rows of {', '.join(narrow)}",
                cure="write positions as float64",
            ),
        )
    converted, more = convert_columns(
        values,
        texts,
        rows=len(times),
        factors={name: column.factor for name, column in mapped.items()},
        mode_map=mode_map,
        geoid=geoid,
        where=where,
    )
    frame = pd.DataFrame(converted, index=pd.DatetimeIndex(times, name="time"))
    options = {"columns": map_text(mapped, others)}
    if mode_map is not None:
        options["mode_map"] = ", ".join(f"{word}={name}" for word, name in mode_map.items())
    found = (*findings, *conversions, *more)
    return MappedTable(frame, found, scale, leap_seconds, options, applied_geoid(geoid, wanted))


def _is_text(kind: Any) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _is_number(kind: Any) -> bool:
    return bool(
        pa.types.is_integer(kind)
        or pa.types.is_floating(kind)
        or pa.types.is_boolean(kind)
        or pa.types.is_decimal(kind)
    )


def _one(column: Any) -> Any:
    array = column.combine_chunks()
    if isinstance(array, pa.ChunkedArray):
        array = pa.concat_arrays(array.chunks) if array.num_chunks else pa.array([], array.type)
    return array


def _numbers(column: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    kind = column.type
    if pa.types.is_boolean(kind):
        column = column.cast(pa.int8())
    values: np.ndarray[Any, np.dtype[np.float64]] = (
        _one(column).cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    )
    return values


def _stamps(column: Any, where: str) -> Stamps:
    kind = column.type
    if _is_text(kind):
        return parse_stamps(_one(column))
    if not pa.types.is_timestamp(kind):
        raise InputError(
            "the time column holds numbers whose origin and unit are not said",
            where=where,
            evidence=str(kind),
            cure=TIME_CURE,
        )
    known = column.is_valid().to_numpy().astype(bool)
    try:
        ns = _one(pc.fill_null(column, pa.scalar(0, kind))).cast(pa.timestamp("ns", kind.tz))
    except pa.ArrowInvalid as error:
        raise InputError(
            "times lie outside 1678 to 2261",
            where=where,
            evidence=str(error)[:120],
            cure="check the time column",
        ) from error
    none = np.zeros(len(known), bool)
    zoned = np.full(len(known), kind.tz is not None)
    numbers = ns.cast(pa.int64()).to_numpy()
    first = np.datetime64("1980-01-06", "ns").astype(np.int64)
    return Stamps(numbers, known & (numbers >= first), none, zoned)
