"""Parquet: the recording as a table of documented columns, with its metadata, written and read.

The schema key `sbas` holds the metadata as JSON; `pandas.read_parquet` returns the table indexed
by `time` (GPS time). Side tables lie beside it in files `stem.NAME.parquet`. Tables of other
programs are read with the alias map of delimited text.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.arrow.parquet_foreign import read_foreign
from sbas.logs.arrow.parquet_tables import (
    count_impossible_levels,
    impossible_levels,
    one_array,
    refuse_memory,
    refuse_second_file,
    words,
)
from sbas.logs.arrow.parquet_writer import LAYOUT_KEY, META_KEY, TIME_TYPE, Layout, sha256_of, write
from sbas.logs.format import Format, Match, Progress
from sbas.logs.sentinels import sentinel_findings
from sbas.recording import (
    BATCH_ROWS,
    COLUMNS,
    MODES,
    EpochSource,
    Flag,
    Recording,
    RecordingMeta,
    Source,
    with_columns,
)
from sbas.timescales import TimeScale

_DAMAGE = (pa.ArrowException, OSError, UnicodeDecodeError, RecursionError)


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
) -> Recording:
    """Recording of a Parquet file; side tables come with it.

    Parameters
    ----------
    path : the file.
    columns : documented columns to read; all by default.
    progress : called with bytes done and in all.
    time_scale : scale of the times; needed where the file has no metadata of sbas.
    mode_map, geoid : for tables of other programs, as for delimited text.

    Raises
    ------
    InputError : a cut or damaged file, unreadable metadata, or no metadata and no `time_scale`.
    """
    source = scan(
        path,
        columns=columns,
        progress=progress,
        time_scale=time_scale,
        mode_map=mode_map,
        geoid=geoid,
    )
    if not isinstance(source, ParquetEpochs):
        assert isinstance(source, Recording)
        return source
    wanted = source.columns if columns is None else tuple(columns)
    with opened(path) as file:
        table = file.read(columns=source.needed(wanted)).unify_dictionaries().combine_chunks()
        frame = with_columns(_frame(table, source.categories, path), wanted)
        side_tables, findings = _side_tables(path, _layout(file, path))
    if progress is not None:
        progress(path.stat().st_size, path.stat().st_size)
    meta = replace(source.meta, findings=(*source.meta.findings, *findings))
    return Recording(frame, meta, side_tables)


def scan(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
) -> EpochSource:
    """Epochs of a Parquet file in batches; a table of another program is read whole instead.

    Arguments and errors as for `read`.
    """
    with opened(path) as file:
        schema = file.schema_arrow
        text = (schema.metadata or {}).get(META_KEY)
        if text is None:
            return read_foreign(
                file,
                path,
                columns=columns,
                progress=progress,
                time_scale=time_scale,
                mode_map=mode_map,
                geoid=geoid,
            )
        for option, value in (("mode_map", mode_map), ("geoid", geoid), ("time_scale", time_scale)):
            if value is not None and value != "GPST":
                raise InputError(
                    f"{option}= is for tables of other programs",
                    where=str(path),
                    evidence="the file has metadata of sbas, which say what its columns are",
                    cure=f"leave out {option}=",
                )
        layout = _layout(file, path)
        meta = _meta(text, layout, path)
        rows = file.metadata.num_rows
        findings: list[Finding] = []
        if rows != layout.rows:
            findings.append(
                Finding(
                    "E25",
                    "error",
                    "the file does not hold as many epochs as were written",
                    where=str(path),
                    evidence=f"{rows:,} rows, {layout.rows:,} written",
                    cure="write or copy the file again",
                )
            )
        if LAYOUT_KEY not in (file.metadata.metadata or {}):
            findings.append(
                Finding(
                    "E25", "warning", "another program wrote the file again: epochs may be missing",
                    where=str(path), cure="use the file as sbas wrote it",
                )
            )  # fmt: skip
        names = tuple(name for name in schema.names if name != "time")
        _check_schema(schema, path)
        impossible = count_impossible_levels(file)
        findings += sentinel_findings({n: {"65535 or more": k} for n, k in impossible.items()})
    meta = replace(meta, findings=(*meta.findings, *findings))
    return ParquetEpochs(path, meta, names, rows, layout.categories, progress, bool(impossible))


@dataclass(frozen=True, eq=False)
class ParquetEpochs:
    """Epochs of a Parquet file that sbas wrote, decoded batch by batch; an EpochSource.

    Parameters
    ----------
    path : the file.
    meta, columns : as of the recording.
    rows : epochs.
    categories : names of each categorical column.
    progress : called with bytes done and in all.
    repairing : whether levels are made missing, which shows in the flags.
    """

    path: Path
    meta: RecordingMeta
    columns: tuple[str, ...]
    rows: int
    categories: Mapping[str, Sequence[str]]
    progress: Progress | None = None
    repairing: bool = False

    def __len__(self) -> int:
        return self.rows

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Tables of at most BATCH_ROWS epochs in file order; only these columns are decoded."""
        present = self.needed(columns)
        size = self.path.stat().st_size
        done = 0
        with opened(self.path) as file:
            for batch in _batches(file, present):
                table = pa.Table.from_batches([batch])
                yield with_columns(_frame(table, self.categories, self.path), columns)
                done += len(batch)
                if self.progress is not None:
                    self.progress(size * done // max(self.rows, 1), size)
            if not done:
                empty = file.schema_arrow.empty_table().select(present)
                yield with_columns(_frame(empty, self.categories, self.path), columns)

    def needed(self, columns: Sequence[str]) -> list[str]:
        """Columns to decode for those asked: with the flags, the levels that change them."""
        asked = set(columns)
        if self.repairing and "flags" in asked:
            asked |= {"hpl_m", "vpl_m"}
        return ["time", *(name for name in self.columns if name in asked)]


def _batches(file: pq.ParquetFile, columns: Sequence[str]) -> Iterator[Any]:
    # One call of iter_batches over the whole file holds what it has read until its end (0.8 GB
    # of a year at 1 Hz); over one row group after the other it holds one.
    for group in range(file.num_row_groups):
        yield from file.iter_batches(batch_size=BATCH_ROWS, row_groups=[group], columns=columns)


@contextlib.contextmanager
def opened(path: Path) -> Iterator[pq.ParquetFile]:
    """The file, with damage found now or later as InputError."""
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            refuse_second_file(file, path)
            yield file
    except MemoryError as error:
        refuse_memory(path, error)
    except _DAMAGE as error:
        _damaged(path, error)


def _damaged(path: Path, error: Exception) -> NoReturn:
    raise InputError(
        "the Parquet file is cut or damaged",
        code="E10",
        where=str(path),
        evidence=str(error)[:300],
        cure="write or copy it again; its end holds the index, so a cut file cannot be read",
    ) from error


def _check_schema(schema: pa.Schema, path: Path) -> None:
    if "time" not in schema.names or not pa.types.is_timestamp(schema.field("time").type):
        raise InputError(
            "the file has metadata of sbas but no column 'time' of time stamps",
            where=str(path),
            cure="write it again with sbas, or drop the schema key 'sbas' and say --time-scale",
        )
    if len(set(schema.names)) < len(schema.names):
        raise InputError(
            "two columns have the same name", where=str(path), evidence=str(schema.names)
        )


def _layout(file: pq.ParquetFile, path: Path) -> Layout:
    text = (file.metadata.metadata or {}).get(LAYOUT_KEY)
    if text is None:
        return Layout(file.metadata.num_rows)
    try:
        layout = Layout(**json.loads(text))
        strings = [name for names in layout.categories.values() for name in names]
        side = [
            value
            for info in layout.side_tables.values()
            for value in (info["file"], info["sha256"])
        ]
        if not isinstance(layout.rows, int) or not all(
            isinstance(s, str) for s in [*strings, *side]
        ):
            raise TypeError("unexpected types")
    except (TypeError, ValueError, KeyError, AttributeError, RecursionError) as error:
        raise InputError(
            "the layout of the Parquet file cannot be read",
            where=str(path),
            evidence=str(error)[:200],
            cure="write the recording again",
        ) from error
    return layout


def _meta(text: bytes, layout: Layout, path: Path) -> RecordingMeta:
    """Metadata of the file, checked to hold what their types say (the file may be hostile)."""
    try:
        meta = RecordingMeta.from_json(text.decode("utf-8"))
        meta = replace(
            meta,
            sources=(*meta.sources, *(Source(**s) for s in layout.later_sources)),
            findings=(*meta.findings, *(Finding(**f) for f in layout.later_findings)),
        )
        plain = asdict(meta)
        numbers = [plain["pl"].pop(k) for k in ("k_h", "k_v", "risk")] + [plain.pop("leap_seconds")]
        sizes = [source.pop("bytes") for source in plain["sources"]] + [plain.pop("schema")]
        if not (
            _all_text(plain)
            and all(n is None or (isinstance(n, int | float) and np.isfinite(n)) for n in numbers)
            and all(isinstance(n, int) for n in sizes)
            and all(f.severity in ("error", "warning", "info") for f in meta.findings)
        ):
            raise ValueError("a value has the wrong type")
    except (InputError, TypeError, ValueError, KeyError, AttributeError, RecursionError) as error:
        raise InputError(
            "the metadata of the Parquet file cannot be read",
            where=str(path),
            evidence=getattr(error, "evidence", "") or str(error)[:200],
            cure="write the recording again with this version of sbas",
        ) from error
    return meta


def _all_text(value: Any) -> bool:
    if isinstance(value, dict):
        return all(_all_text(v) for v in (*value, *value.values()))
    if isinstance(value, list | tuple):
        return all(_all_text(v) for v in value)
    return isinstance(value, str)


def _frame(table: pa.Table, categories: Mapping[str, Sequence[str]], path: Path) -> pd.DataFrame:
    """Epoch table of an Arrow table with column `time`."""
    time = table.column("time")
    if time.null_count or (time.type.tz is not None):
        raise InputError(
            "column 'time' has missing times or a time zone",
            where=str(path),
            cure="write the recording again with sbas",
        )
    index = pd.DatetimeIndex(time.cast(TIME_TYPE).to_numpy(), name="time")
    columns = {
        name: _values(name, table.column(name), categories.get(name), path)
        for name in table.column_names
        if name != "time"
    }
    for name in ("hpl_m", "vpl_m"):
        if name in columns and (impossible := impossible_levels(columns[name])).any():
            columns[name] = np.where(impossible, np.nan, columns[name])
            if "flags" in columns:
                added = np.where(impossible, np.uint32(Flag.PL_SENTINEL), np.uint32(0))
                columns["flags"] = columns["flags"] | added
    return pd.DataFrame(columns, index=index)


def _values(name: str, column: Any, categories: Sequence[str] | None, path: Path) -> Any:
    """Values of a column in its documented dtype."""
    array = one_array(column)
    known = COLUMNS.get(name)
    if known is not None and known.dtype == "category" and not pa.types.is_dictionary(array.type):
        array = words(array, header=name, where=str(path)).dictionary_encode()
    if (
        known is not None
        and known.dtype not in ("bool", "category")
        and pa.types.is_boolean(array.type)
    ):
        raise InputError(
            f"column {name!r} holds truth values where numbers should be",
            where=str(path),
            cure="write the recording again",
        )
    try:
        if pa.types.is_dictionary(array.type) and (known is None or known.dtype == "category"):
            names = list(MODES) if name == "mode" else categories
            return _categorical(name, array, names, path)
        if known is None:
            return array.to_pandas().array  # without an index, which would be aligned
        if known.dtype == "f8":
            return array.cast(pa.float64()).to_numpy(zero_copy_only=False)
        kind = {"i2": pa.int16(), "u4": pa.uint32(), "bool": pa.bool_()}[known.dtype]
        whole = pc.fill_null(array.cast(kind), pa.scalar(known.missing, kind))
        return whole.to_numpy(zero_copy_only=False)
    except pa.ArrowInvalid as error:
        raise InputError(
            f"column {name!r} does not hold what it should",
            where=str(path),
            evidence=str(error)[:200],
            cure="write the recording again",
        ) from error


def _categorical(name: str, array: Any, names: Sequence[str] | None, path: Path) -> pd.Categorical:
    present = array.dictionary.cast(pa.string()).to_pylist()
    names = list(dict.fromkeys(present)) if names is None else list(names)
    position = {word: i for i, word in enumerate(names)}
    if strange := [word for word in present if word not in position]:
        raise InputError(
            f"column {name!r} has unknown values",
            where=str(path),
            evidence=", ".join(map(str, strange[:8])),
            cure=f"known are {', '.join(names)}",
        )
    lookup = np.array([position[word] for word in present] + [-1], np.int64)
    indices = array.indices.fill_null(len(present)).to_numpy(zero_copy_only=False)
    return pd.Categorical.from_codes(lookup[indices], pd.Index(names, dtype="str"))


def _side_tables(path: Path, layout: Layout) -> tuple[dict[str, pd.DataFrame], tuple[Finding, ...]]:
    """Side tables by name; one that is missing or altered becomes a finding E25."""
    tables: dict[str, pd.DataFrame] = {}
    findings = []
    for name, described in layout.side_tables.items():
        file = path.with_name(Path(described["file"]).name)
        problem = ""
        if not file.is_file():
            problem = "is missing"
        elif sha256_of(file) != described["sha256"]:
            problem = "was altered since the recording was written"
        else:
            with opened(file) as companion:
                tables[name] = _side_frame(companion.read())
        if problem:
            findings.append(
                Finding(
                    "E25",
                    "warning",
                    f"side table {name} {problem} and is left out",
                    where=str(file),
                    cure="keep the companion files of a recording together; write it again",
                )
            )
    return tables, tuple(findings)


def _side_frame(table: pa.Table) -> pd.DataFrame:
    """A side table as it was written; pandas cannot itself read fixed-size binary back."""

    def mapped(kind: pa.DataType) -> pd.ArrowDtype | None:
        return pd.ArrowDtype(kind) if pa.types.is_fixed_size_binary(kind) else None

    frame: pd.DataFrame = table.to_pandas(ignore_metadata=True, types_mapper=mapped)
    return frame


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """100 for `PAR1` at both ends with the key `sbas`, 95 without, 60 for the beginning alone."""
    if not head.startswith(b"PAR1"):
        return Match(0, "no Parquet magic")
    if not tail.endswith(b"PAR1"):
        return Match(60, "Parquet magic at the beginning only: cut")
    if LAYOUT_KEY in tail:
        return Match(100, "Parquet written by sbas")
    return Match(95, "Parquet magic at both ends")


FORMAT = Format(
    name="parquet",
    extensions=(".parquet", ".pq"),
    description="Parquet table; with metadata and streaming where sbas wrote it",
    sniff=sniff,
    read=read,
    scan=scan,
    write=write,
)
