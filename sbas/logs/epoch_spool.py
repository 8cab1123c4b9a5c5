"""Epochs set aside in a temporary file, so that a long recording is read in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from sbas.exceptions import InputError
from sbas.logs.temporary_file import TemporaryFile
from sbas.recording import BATCH_ROWS, RecordingMeta, with_columns

PIECE_ROWS = BATCH_ROWS
"""Epochs converted at a time on their way into a spool."""

_TIME = "time"

A = TypeVar("A")


def in_pieces(parts: Iterable[A], rows_of: Callable[[A], int]) -> Iterator[list[A]]:
    """Consecutive parts in lists of PIECE_ROWS or more rows; the last list may have fewer."""
    piece: list[A] = []
    rows = 0
    for part in parts:
        piece.append(part)
        rows += rows_of(part)
        if rows >= PIECE_ROWS:
            yield piece
            piece, rows = [], 0
    if piece:
        yield piece


@dataclass(frozen=True, eq=False)
class Spool:
    """A temporary file of epochs.

    Parameters
    ----------
    columns : names of the epochs' columns; `flags` last where only a later piece has them.
    categories : names of each categorical column, in the order of their codes.
    text : columns of text.
    rows : epochs.
    """

    file: TemporaryFile
    columns: tuple[str, ...]
    categories: Mapping[str, tuple[str, ...]]
    text: frozenset[str]
    rows: int


@dataclass(frozen=True, eq=False)
class SpooledEpochs:
    """Epochs of a spool with their metadata; an EpochSource."""

    meta: RecordingMeta
    spool: Spool

    @property
    def columns(self) -> tuple[str, ...]:
        return self.spool.columns

    def __len__(self) -> int:
        return self.spool.rows

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Tables of at most BATCH_ROWS epochs in file order; only these columns are read."""
        names = [name for name in self.columns if name in set(columns)]
        with pq.ParquetFile(self.spool.file.path) as file:
            # Group by group: one call over the whole file would hold what it has read.
            for group in range(file.num_row_groups):
                table = file.read_row_group(group, columns=[_TIME, *names])
                yield with_columns(self._frame(table, names), columns)

    def _frame(self, table: pa.Table, names: Sequence[str]) -> pd.DataFrame:
        time = table.column(_TIME).to_numpy().view("M8[ns]")
        data: dict[str, Any] = {}
        for name in names:
            column = table.column(name)
            if name in self.spool.text:
                data[name] = pd.array(column.to_pylist(), dtype="str")
                continue
            data[name] = column.to_numpy()
            if name in self.spool.categories:
                kinds = pd.Index(self.spool.categories[name], dtype="str")
                data[name] = pd.Categorical.from_codes(data[name], kinds)
        return pd.DataFrame(data, index=pd.DatetimeIndex(time, name=_TIME))


def can_spool(table: pd.DataFrame) -> bool:
    """Whether every column is one that a spool gives back as it was: numbers, names, text."""
    return all(
        isinstance(dtype, pd.CategoricalDtype | pd.StringDtype) or dtype.kind in "fiub"
        for dtype in table.dtypes
    )


def spool(tables: Iterable[pd.DataFrame]) -> Spool:
    """Set epoch tables aside.

    Parameters
    ----------
    tables : consecutive pieces of one epoch table, one at least, with the same columns; `flags`
        may stand in some of them only.

    Raises
    ------
    InputError : the folder of temporary files has no room.
    """
    file = TemporaryFile(".parquet")
    try:
        return _written(tables, file)
    except OSError as error:
        raise InputError(
            "a long recording cannot be set aside while it is read",
            where=str(file.path.parent),
            evidence=str(error),
            cure="make room there, or name another folder in the variable TMPDIR",
        ) from error


def _written(tables: Iterable[pd.DataFrame], file: TemporaryFile) -> Spool:
    categories: dict[str, dict[str, int]] = {}
    text: set[str] = set()
    names: list[str] = []
    columns: list[str] = []
    has_flags = False
    rows = 0
    writer: pq.ParquetWriter | None = None
    try:
        for table in tables:
            has_flags |= "flags" in table
            arrays = {_TIME: pa.array(table.index.to_numpy().view(np.int64))}
            for name in table.columns:
                series = table[name]
                if isinstance(series.dtype, pd.CategoricalDtype):
                    known = categories.setdefault(name, {})
                    arrays[name] = pa.array(_codes(series, known))
                elif isinstance(series.dtype, np.dtype) and series.dtype.kind in "fiub":
                    arrays[name] = pa.array(series.to_numpy())  # from numpy: NaN stays NaN
                else:
                    text.add(name)
                    arrays[name] = pa.array(series.to_list(), pa.string())
            arrays.setdefault("flags", pa.array(np.zeros(len(table), np.uint32)))
            if writer is None:
                names = [name for name in arrays if name not in (_TIME, "flags")]
                columns = list(table.columns)
                writer = _writer(file, pa.table(arrays).schema)
            ordered = pa.table({name: arrays[name] for name in (_TIME, *names, "flags")})
            writer.write_table(ordered, row_group_size=BATCH_ROWS)
            rows += len(table)
    finally:
        if writer is not None:
            writer.close()
    if has_flags and "flags" not in columns:
        columns.append("flags")
    kinds = {name: tuple(known) for name, known in categories.items()}
    return Spool(file, tuple(columns), kinds, frozenset(text), rows)


def _codes(series: pd.Series, known: dict[str, int]) -> np.ndarray[Any, np.dtype[np.int32]]:
    """Codes of a piece's categories among those of all pieces; new ones join at the end."""
    own = [known.setdefault(str(name), len(known)) for name in series.cat.categories]
    lookup = np.array([*own, -1], np.int32)
    codes: np.ndarray[Any, np.dtype[np.int32]] = lookup[series.cat.codes.to_numpy()]
    return codes


def _writer(file: TemporaryFile, schema: pa.Schema) -> pq.ParquetWriter:
    schema = pa.schema([schema.field(n) for n in schema.names if n != "flags"]).append(
        pa.field("flags", pa.uint32())
    )
    split = [f.name for f in schema if pa.types.is_floating(f.type)]
    coded = [f.name for f in schema if f.name not in split and f.name != _TIME]
    return pq.ParquetWriter(
        file.path,
        schema,
        compression="zstd",
        compression_level=1,
        use_dictionary=coded,
        use_byte_stream_split=split or False,
        column_encoding={_TIME: "DELTA_BINARY_PACKED"},
    )
