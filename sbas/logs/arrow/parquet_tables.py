"""Decoding Parquet columns within bounds: only those needed, group by group, of a sane size.

A file of a hundred kilobytes can hold columns of many gigabytes; text columns stay dictionaries
until their size is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.recording import BATCH_ROWS

MOST_BYTES = 8 << 30
FREE_BYTES = 64 << 20
MOST_TIMES = 200
_NO_LEVEL_M = 65535.0


def value_type(kind: Any) -> Any:
    """Type of the values of an Arrow type, of those of a dictionary where it is one."""
    return kind.value_type if pa.types.is_dictionary(kind) else kind


def is_text(kind: Any) -> bool:
    """Whether an Arrow type holds text, or bytes that may be text."""
    kind = value_type(kind)
    return any(
        test(kind)
        for test in (
            pa.types.is_string, pa.types.is_large_string, pa.types.is_string_view,
            pa.types.is_binary, pa.types.is_large_binary, pa.types.is_binary_view,
            pa.types.is_fixed_size_binary,
        )
    )  # fmt: skip


def is_number(kind: Any) -> bool:
    """Whether an Arrow type holds numbers; truth values are none."""
    kind = value_type(kind)
    return bool(
        pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_decimal(kind)
    )


def one_array(column: Any) -> Any:
    """A chunked column as one array."""
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if isinstance(array, pa.ChunkedArray):
        array = pa.concat_arrays(array.chunks) if array.num_chunks else pa.array([], array.type)
    return array


def words(column: Any, *, header: str, where: str) -> Any:
    """Strings of a column of text, bytes, numbers or a dictionary of them.

    Raises
    ------
    InputError : bytes that are no UTF-8.
    """
    try:
        array = one_array(column)
        if pa.types.is_dictionary(array.type):
            texts = pc.cast(array.dictionary, pa.string())
            return texts.take(array.indices)
        return array.cast(pa.string())
    except (pa.ArrowInvalid, UnicodeDecodeError) as error:
        raise InputError(
            f"column {header!r} holds bytes that are no text",
            where=where,
            evidence=str(error)[:200],
            cure="write it as text in UTF-8, or leave the column out",
        ) from error


def read_columns(path: Path, columns: Sequence[str], *, where: str) -> pa.Table:
    """Columns of a Parquet file whose names are unique, text as dictionaries.

    Raises
    ------
    InputError : E21 where the decoded columns are larger than MOST_BYTES, or than MOST_TIMES the
        file and FREE_BYTES.
    """
    file_bytes = path.stat().st_size
    bound = min(MOST_BYTES, max(MOST_TIMES * file_bytes, FREE_BYTES))
    with pq.ParquetFile(path, page_checksum_verification=True) as file:
        schema = file.schema_arrow
        text = [name for name in columns if is_text(schema.field(name).type)]
    with pq.ParquetFile(path, page_checksum_verification=True, read_dictionary=text) as file:
        # Numbers become float64 and times int64, whatever their width in the file.
        fixed = 8 * file.metadata.num_rows * len(columns)
        if fixed > bound:
            _refuse_size(fixed, file_bytes, where)
        batches = []
        texts = 0
        for group in range(file.num_row_groups):
            for batch in file.iter_batches(
                batch_size=BATCH_ROWS, row_groups=[group], columns=list(columns)
            ):
                texts += sum(_text_bytes(batch.column(name)) for name in text)
                if fixed + texts > bound:
                    _refuse_size(fixed + texts, file_bytes, where)
                batches.append(batch)
        if not batches:
            return file.schema_arrow.empty_table().select(list(columns))
        table = pa.Table.from_batches([batch.select(list(columns)) for batch in batches])
        return table.unify_dictionaries()


def _text_bytes(array: Any) -> int:
    """Bytes of the texts of an array once they are written out."""
    if not pa.types.is_dictionary(array.type):
        return int(array.nbytes)
    lengths = pc.fill_null(pc.binary_length(array.dictionary.cast(pa.large_binary())), 0)
    counts = np.bincount(
        array.indices.drop_null().to_numpy(zero_copy_only=False), minlength=len(lengths)
    )
    return int(counts @ lengths.to_numpy(zero_copy_only=False).astype(np.int64))


def _refuse_size(decoded: int, file_bytes: int, where: str) -> NoReturn:
    raise InputError(
        "the decoded columns are out of proportion to the file",
        code="E21",
        where=where,
        evidence=f"{decoded / 2**20:,.0f} MiB or more from {file_bytes / 2**20:,.3g} MiB; bounds "
        f"are {MOST_BYTES >> 30} GiB, and {MOST_TIMES} times the file above "
        f"{FREE_BYTES >> 20} MiB",
        cure="read fewer columns, or split the file; if it is not yours, do not trust it",
    )


def impossible_levels(levels: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) True where a protection level [m] is none but stands for "missing": 65535 and more."""
    with np.errstate(invalid="ignore"):
        impossible: NDArray[np.bool_] = np.abs(levels) >= _NO_LEVEL_M
    return impossible


def count_impossible_levels(file: pq.ParquetFile) -> dict[str, int]:
    """Impossible values by name of a level column; read where the statistics allow any."""
    names = file.schema_arrow.names
    counts: dict[str, int] = {}
    for name in ("hpl_m", "vpl_m"):
        if name not in names or not is_number(file.schema_arrow.field(name).type):
            continue
        at = next(i for i in range(len(file.schema)) if file.schema.column(i).path == name)
        for group in range(file.num_row_groups):
            known = file.metadata.row_group(group).column(at).statistics
            if (
                known is not None
                and known.has_min_max
                and max(abs(known.min), abs(known.max)) < _NO_LEVEL_M
            ):
                continue
            column = file.read_row_group(group, columns=[name]).column(0)
            levels = one_array(column).cast(pa.float64(), safe=False)
            found = impossible_levels(levels.to_numpy(zero_copy_only=False))
            counts[name] = counts.get(name, 0) + int(np.count_nonzero(found))
    return {name: count for name, count in counts.items() if count}


def refuse_memory(path: Path, error: BaseException) -> NoReturn:
    """Raise InputError for a table that needs more memory than there is."""
    raise InputError(
        "the Parquet file needs more memory than there is",
        code="E21",
        where=str(path),
        evidence=str(error)[:300],
        cure="read fewer columns, or split the file",
    ) from error


def refuse_second_file(file: pq.ParquetFile, path: Path) -> None:
    """E24 for two files one behind the other: the last index would be read with the first pages."""
    columns = [
        file.metadata.row_group(g).column(c)
        for g in range(file.num_row_groups)
        for c in range(file.metadata.num_columns)
    ]
    pages_end = max(
        (
            (c.dictionary_page_offset or c.data_page_offset) + c.total_compressed_size
            for c in columns
        ),
        default=4,
    )
    with open(path, "rb") as stream:
        stream.seek(pages_end)
        between = stream.read(FREE_BYTES)
    if b"PAR1PAR1" in between:
        raise InputError(
            "two Parquet files stand one behind the other",
            code="E24",
            where=f"{path}, byte {pages_end + between.index(b'PAR1PAR1') + 4:,}",
            evidence=f"pages end at byte {pages_end:,} of {path.stat().st_size:,}",
            cure="write each to a file of its own and give both",
        )
