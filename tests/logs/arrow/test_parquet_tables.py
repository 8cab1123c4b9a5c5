"""Parquet tables as others may write them: bombs, odd types, levels that are none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sbas.exceptions import InputError
from sbas.logs.arrow import parquet, parquet_tables
from sbas.logs.arrow.parquet_writer import META_KEY
from sbas.recording import Flag, Recording, RecordingMeta

ROWS = 4
TIMES = pa.array(np.datetime64("2025-05-23T14:09:16", "ns") + np.arange(ROWS) * 10**9)


def table_of(**columns: Any) -> pa.Table:
    given = {"time": TIMES, "hpl": pa.array([11.5, 12.5, 13.5, 14.5])}
    return pa.table({**given, **columns})


def read(folder: Path, table: pa.Table, **options: Any) -> Recording:
    path = folder / "foreign.parquet"
    pq.write_table(table, path)
    return parquet.read(path, time_scale="GPST", **options)


def bomb(path: Path, rows: int) -> None:
    same = pa.array(np.full(rows, 12.5))
    times = pa.array(np.full(rows, np.datetime64("2025-05-23", "ns")))
    pq.write_table(pa.table({"time": times, "hpl": same, "note": same}), path, compression="zstd")


def test_columns_out_of_proportion_are_refused_before_they_are_decoded(tmp_path: Path) -> None:
    path = tmp_path / "bomb.parquet"
    bomb(path, 4_000_000)  # 92 MiB of numbers in some kilobytes
    before = pa.total_allocated_bytes()
    with pytest.raises(InputError, match="out of proportion") as caught:
        parquet.read(path, time_scale="GPST")
    assert caught.value.code == "E21"
    assert "92 MiB or more from 0." in caught.value.evidence
    assert pa.total_allocated_bytes() - before < 1 << 20
    few = parquet.read(path, time_scale="GPST", columns=["hpl_m"])  # 61 MiB: within the bound
    assert len(few) == 4_000_000


def test_long_texts_of_a_dictionary_are_counted_as_written_out(tmp_path: Path) -> None:
    rows = 40_000
    times = pa.array(np.datetime64("2025-05-23", "ns") + np.arange(rows))
    codes = pa.array(np.zeros(rows, "i4"))
    long = pa.DictionaryArray.from_arrays(codes, ["x" * 2000])  # 76 MiB written out
    table = pa.table({"time": times, "hpl": np.full(rows, 11.5), "note": long})
    with pytest.raises(InputError, match="out of proportion"):
        read(tmp_path, table)
    with pytest.raises(InputError, match="out of proportion"):
        read(tmp_path, table.set_column(2, "note", long.cast(pa.string())))
    assert len(read(tmp_path, table, columns=["hpl_m"])) == rows


def test_only_needed_columns_are_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[list[str]] = []
    whole = pq.ParquetFile.iter_batches

    def noted(self: Any, **options: Any) -> Any:
        asked.append(options["columns"])
        return whole(self, **options)

    monkeypatch.setattr(pq.ParquetFile, "iter_batches", noted)
    nested = pa.array([{"a": 1}] * ROWS)
    recording = read(tmp_path, table_of(note=pa.array(["x"] * ROWS), extra=nested))
    assert asked == [["time", "hpl", "note"]]
    assert any("extra (struct" in f.evidence for f in recording.meta.findings)
    read(tmp_path, table_of(note=pa.array(["x"] * ROWS)), columns=["hpl_m"])
    assert asked[1] == ["time", "hpl"]


def test_too_little_memory_is_no_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any, **__: Any) -> Any:
        raise pa.lib.ArrowMemoryError("malloc of size 17179869184 failed")

    monkeypatch.setattr(pq.ParquetFile, "iter_batches", full)
    with pytest.raises(InputError, match="memory") as caught:
        read(tmp_path, table_of())
    assert "damaged" not in str(caught.value)
    assert caught.value.code == "E21"


def test_row_groups_come_back_in_order(tmp_path: Path) -> None:
    path = tmp_path / "groups.parquet"
    mode = pa.array(["sbas", "none", None, "sbas_pa"])
    pq.write_table(table_of(mode=mode), path, row_group_size=1)
    table = parquet.read(path, time_scale="GPST").table
    assert table["hpl_m"].tolist() == [11.5, 12.5, 13.5, 14.5]
    assert table["mode"].astype(object).fillna("?").tolist() == ["sbas", "none", "?", "sbas_pa"]


@pytest.mark.parametrize(
    "values",
    [
        pa.array(["open", "open", "tunnel", None]).cast(pa.string_view()),
        pa.array(["open", "open", "tunnel", None]).dictionary_encode(),
        pa.array([b"open", b"open", b"tunnel", None]),
        pa.array(["open", "open", "tunnel", None], pa.large_string()),
    ],
)
def test_every_kind_of_text_is_text(tmp_path: Path, values: pa.Array) -> None:
    labels = read(tmp_path, table_of(environment=values)).table["environment"]
    assert labels.astype(object).fillna("").tolist() == ["open", "open", "tunnel", ""]
    assert read(tmp_path, table_of(remark=values)).table["x_remark"].iloc[2] == "tunnel"


@pytest.mark.parametrize(
    "name", ["vpl", "hpl", "flags", "nsat", "mode", "environment", "hardware_fault", "remark"]
)
def test_columns_of_nulls_are_missing(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, table_of(**{name: pa.nulls(ROWS)})).table
    expected = {"flags": 0, "nsat": -1, "hardware_fault": False}
    column = table[{"vpl": "vpl_m", "hpl": "hpl_m", "nsat": "n_sv", "remark": "x_remark"}.get(
        name, name)]  # fmt: skip
    if name in expected:
        assert column.tolist() == [expected[name]] * ROWS
    else:
        assert column.isna().all()


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"hpl": pa.array([True] * ROWS)}, "truth values"),
        ({"hpl": pa.array(["11.5"] * ROWS)}, "text where numbers"),
        ({"nsat": pa.array(["8"] * ROWS)}, "text where numbers"),
        ({"hpl": pa.array([{"a": 1.0}] * ROWS)}, "no numbers"),
        ({"hpl": pa.array([1] * ROWS, pa.duration("s"))}, "no numbers"),
        ({"mode": pa.array([b"\xff\xfe"] * ROWS)}, "no text"),
        ({"mode": pa.array([3.5] * ROWS)}, "not known"),
        ({"flags": pa.array([-1] * ROWS)}, "flags"),
        ({"time": pa.nulls(ROWS)}, "time"),
        ({"time": pa.array([b"\xff"] * ROWS)}, "no text"),
    ],
)
def test_columns_of_impossible_types_are_refused(
    tmp_path: Path, columns: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, table_of(**columns))
    assert "damaged" not in caught.value.what


def test_equal_names_are_refused(tmp_path: Path) -> None:
    array = pa.array([1.0] * ROWS)
    for name in ("foo", "hpl"):
        table = pa.Table.from_arrays([TIMES, array, array], names=["time", name, name])
        with pytest.raises(InputError, match="same name"):
            read(tmp_path, table)


def own(folder: Path, **columns: Any) -> Path:
    path = folder / "own.parquet"
    table = pa.table({"time": TIMES, **columns})
    pq.write_table(table.replace_schema_metadata({META_KEY: RecordingMeta().to_json()}), path)
    return path


def test_own_levels_of_65535_and_more_are_missing_and_counted(tmp_path: Path) -> None:
    hpl = pa.array([65535.0, np.inf, -2e10, 11.5])
    flags = pa.array([8, 0, 0, 0], pa.uint32())
    path = own(tmp_path, hpl_m=hpl, vpl_m=pa.array([1.0, 2.0, 70_000.0, 4.0]), flags=flags)
    recording = parquet.read(path)
    assert recording.table["hpl_m"].isna().tolist() == [True, True, True, False]
    assert recording.table["vpl_m"].isna().tolist() == [False, False, True, False]
    marked = int(Flag.PL_SENTINEL)
    assert recording.table["flags"].tolist() == [8 | marked, marked, marked, 0]
    (finding,) = (f for f in recording.meta.findings if f.code == "E07")
    assert finding.code == "E07"
    assert finding.evidence == "hpl_m: 3 x 65535 or more; vpl_m: 1 x 65535 or more"
    source = parquet.scan(path)
    assert source.meta.findings == recording.meta.findings
    (only_flags,) = source.batches(["flags"])
    pd.testing.assert_frame_equal(only_flags, recording.table[["flags"]])


def test_own_modes_as_plain_text(tmp_path: Path) -> None:
    path = own(tmp_path, mode=pa.array(["sbas", "standalone", None, "sbas"]))
    table = parquet.read(path).table
    assert isinstance(table["mode"].dtype, pd.CategoricalDtype)
    assert table["mode"].astype(object).fillna("").tolist() == ["sbas", "standalone", "", "sbas"]
    for columns in (
        {"mode": pa.array(["SBAS"] * ROWS)},
        {"mode": pa.array([b"\xff"] * ROWS)},
        {"hpl_m": pa.array([True] * ROWS)},
        {"flags": pa.array([-1] * ROWS)},
    ):
        with pytest.raises(InputError):
            parquet.read(own(tmp_path, **columns))


def test_levels_within_the_statistics_are_not_read_to_be_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = own(tmp_path, hpl_m=pa.array([11.5, 12.5, np.nan, 65534.0]))
    monkeypatch.setattr(pq.ParquetFile, "read_row_group", None)
    with pq.ParquetFile(path) as file:
        assert parquet_tables.count_impossible_levels(file) == {}
