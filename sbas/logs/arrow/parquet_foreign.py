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
from sbas.logs.arrow.parquet_tables import (
    is_number,
    is_text,
    one_array,
    read_columns,
    value_type,
    words,
)
from sbas.logs.delimited.column_map import MappedTable, convert_columns
from sbas.logs.delimited.column_names import (
    HEMISPHERES,
    TIME_CURE,
    MappedColumn,
    applied_geoid,
    header_sources,
    map_headers,
    map_text,
    needed_columns,
    no_level_finding,
)
from sbas.logs.format import Progress
from sbas.logs.time_stamps import (
    Stamps,
    counts_leap_seconds,
    leap_stamp_finding,
    leap_stamps_of_utc,
    parse_stamps,
    scale_of_stamps,
    stamps_to_gps,
    week_stamps,
)
from sbas.recording import Recording, RecordingMeta, with_columns
from sbas.timescales import TimeScale

_WORDS = ("mode", "environment", "hardware_fault", *HEMISPHERES)


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
        findings=(unstated, *mapped.findings, *no_level_finding(mapped.sources)),
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
    schema = file.schema_arrow
    names = list(schema.names)
    if len(set(names)) < len(names):
        raise InputError(
            "two columns have the same name",
            where=where,
            evidence=", ".join(sorted({n for n in names if names.count(n) > 1})[:8]),
            cure="rename or drop one of them",
        )
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
    every = {**mapped, **others}
    kinds = {name: schema.field(column.index).type for name, column in every.items()}
    wanted = needed_columns(columns, mapped, others)
    unusable = [name for name in wanted if name.startswith("x_") and not _usable(kinds[name])]
    wanted = tuple(name for name in wanted if name not in unusable)
    _check_kinds({name: kinds[name] for name in wanted}, every, where)
    table = read_columns(
        path, [names[every[name].index] for name in (*time_names, *wanted)], where=where
    )
    arrays = {name: table.column(names[every[name].index]) for name in (*time_names, *wanted)}
    stamps, said = (
        (
            week_stamps(_numbers(arrays["week"]), _numbers(arrays["tow"]) * mapped["tow"].factor),
            "GPST",
        )
        if by_week
        else (_stamps(arrays["time"], mapped["time"].header, where), mapped["time"].scale)
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
    if not counts_leap_seconds(scale) and stamps.leap.any():
        leaps = int(np.count_nonzero(leap_stamps_of_utc(stamps)))
        findings += leap_stamp_finding(leaps, scale)
        bad += int(np.count_nonzero(stamps.leap)) - leaps
        good = good.copy()
        good[good] = ~stamps.leap
        stamps = stamps[~stamps.leap]
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
    if unusable:
        findings += (
            Finding(
                "E25",
                "info",
                "columns that are neither numbers nor text were left out",
                evidence=", ".join(f"{every[n].header} ({kinds[n]})" for n in unusable)[:300],
            ),
        )
    mask = pa.array(good)
    values, texts, narrow = {}, {}, []
    for name in wanted:
        column = arrays[name].filter(mask)
        kind = value_type(column.type)
        if pa.types.is_float32(kind) or pa.types.is_float16(kind):
            narrow.append(name)
        if name in _WORDS or is_text(kind):
            texts[name] = words(column, header=every[name].header, where=where)
        elif pa.types.is_null(kind):
            values[name] = np.full(len(column), np.nan)
        else:
            values[name] = _numbers(column)
    if narrow:
        findings += (
            Finding(
                "E25",
                "warning",
                "numbers stored as float32 or float16 were widened; degrees in float32 lie up to "
                "0.4 m apart",
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
    return MappedTable(
        frame,
        found,
        scale,
        leap_seconds,
        options,
        applied_geoid(geoid, wanted),
        header_sources(mapped, others),
    )


def _usable(kind: Any) -> bool:
    plain = value_type(kind)
    return is_text(kind) or is_number(kind) or pa.types.is_boolean(plain) or pa.types.is_null(plain)


def _check_kinds(kinds: Mapping[str, Any], every: Mapping[str, MappedColumn], where: str) -> None:
    """Refuse documented columns of a type that cannot be what they are named."""
    for name, kind in kinds.items():
        plain = value_type(kind)
        if name.startswith("x_") or is_number(plain) or pa.types.is_null(plain):
            continue
        if pa.types.is_boolean(plain):
            fits, instead = name == "hardware_fault", "truth values"
        else:
            fits, instead = is_text(plain) and name in _WORDS, "text" if is_text(plain) else "no"
        if not fits:
            raise InputError(
                f"column {every[name].header!r} holds {instead}"
                + (" where numbers should be" if instead != "no" else " numbers"),
                where=where,
                evidence=str(kind),
                cure="write it as numbers, or rename it to 'x_...'",
            )


def _numbers(column: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    kind = value_type(column.type)
    column = column.cast(pa.int8() if pa.types.is_boolean(kind) else kind)
    values: np.ndarray[Any, np.dtype[np.float64]] = (
        one_array(column).cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    )
    return values


def _stamps(column: Any, header: str, where: str) -> Stamps:
    kind = value_type(column.type)
    if is_text(kind):
        return parse_stamps(words(column, header=header, where=where))
    column = column.cast(kind)
    if not pa.types.is_timestamp(kind):
        raise InputError(
            "the time column holds numbers whose origin and unit are not said",
            where=where,
            evidence=str(kind),
            cure=TIME_CURE,
        )
    known = column.is_valid().to_numpy().astype(bool)
    try:
        ns = one_array(pc.fill_null(column, pa.scalar(0, kind))).cast(pa.timestamp("ns", kind.tz))
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
