"""Parquet: round trip of everything a recording holds, streaming, damage, foreign tables."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.laboratory import simulate
from sbas.logs.arrow import parquet, parquet_writer
from sbas.recording import (
    COLUMNS,
    MODES,
    Flag,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    Source,
)

META = RecordingMeta(
    sources=(Source("roof.sbf", 10, "ab" * 32, "sbf", "0.1"),),
    time_scale="UTC",
    leap_seconds=18,
    frame="ITRF2020 \u00e9",
    pl=ProtectionLevelMeta("do229", 6.0, 5.33, 1e-7, "h"),
    findings=(Finding("E07", "warning", "message", "where", "evidence", "cure"),),
    options={"geoid": "44.5"},
    versions={"sbas": "0.1.0"},
)


def table_of(rows: int, start: str = "2025-05-23", seed: int = 0) -> pd.DataFrame:
    """Every documented column, with missing values in each, and columns of further kinds."""
    rng = np.random.default_rng(seed)
    columns: dict[str, object] = {}
    for name, column in COLUMNS.items():
        gap = rng.random(rows) < 0.2
        if column.dtype == "f8":
            columns[name] = np.where(gap, np.nan, rng.normal(size=rows))
        elif column.dtype == "i2":
            columns[name] = np.where(gap, -1, rng.integers(0, 200, rows)).astype("i2")
        elif column.dtype == "u4":
            columns[name] = rng.integers(0, 2**32, rows).astype("u4")
        elif column.dtype == "bool":
            columns[name] = gap
        else:
            names = list(MODES) if name == "mode" else ["tunnel", "open", "cutting"]
            codes = np.where(gap, -1, rng.integers(0, len(names), rows))
            columns[name] = pd.Categorical.from_codes(codes, categories=names)
    columns["x_text"] = pd.array([f"t{k}" for k in range(rows)], dtype="str")
    columns["x_float32"] = rng.normal(size=rows).astype("f4")
    columns["x_int"] = rng.integers(-(2**62), 2**62, rows)
    columns["x_stamp"] = np.arange(rows).astype("M8[ms]")
    index = np.datetime64(start, "ns") + np.arange(rows) * np.timedelta64(200_000_001, "ns")
    return pd.DataFrame(columns, index=pd.DatetimeIndex(index, name="time"))


def written(folder: Path, *pieces: Recording) -> Path:
    path = folder / "recording.parquet"
    parquet.write(pieces, path)
    return path


@pytest.mark.parametrize("rows", [0, 1, 1000])
def test_round_trip(tmp_path: Path, rows: int) -> None:
    recording = Recording(table_of(rows), META)
    path = written(tmp_path, recording)
    back = parquet.read(path)
    pd.testing.assert_frame_equal(back.table, recording.table)
    assert back.meta == META
    batches = list(parquet.scan(path).batches(recording.columns))
    pd.testing.assert_frame_equal(pd.concat(batches), recording.table)
    assert list(tmp_path.iterdir()) == [path]


VALUES = {
    "f8": st.floats(allow_nan=True, allow_infinity=True),
    "i2": st.integers(-1, 32767),
    "u4": st.integers(0, 2**32 - 1),
    "bool": st.booleans(),
}
LEVELS = st.floats(-65534, 65534) | st.just(float("nan"))  # beyond, levels are made missing


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    rows = draw(st.integers(0, 12))
    chosen = draw(st.lists(st.sampled_from(sorted(COLUMNS)), unique=True, max_size=6))
    columns: dict[str, object] = {}
    for name in chosen:
        dtype = COLUMNS[name].dtype
        if dtype == "category":
            words = st.text(st.characters(exclude_categories=("Cs",)), max_size=5)
            labels = st.lists(words, unique=True, max_size=4)
            names = list(MODES) if name == "mode" else draw(labels)
            codes = st.integers(-1, len(names) - 1)
            drawn = draw(st.lists(codes, min_size=rows, max_size=rows))
            columns[name] = pd.Categorical.from_codes(drawn, pd.Index(names, dtype="str"))
        else:
            values = LEVELS if name in ("hpl_m", "vpl_m") else VALUES[dtype]
            drawn = draw(st.lists(values, min_size=rows, max_size=rows))
            columns[name] = np.array(drawn, dtype)
    times = draw(st.lists(st.integers(0, 2**62), min_size=rows, max_size=rows))
    index = pd.DatetimeIndex(np.array(times, "i8").astype("M8[ns]"), name="time")
    table = pd.DataFrame(columns, index=index)
    texts = st.text(st.characters(exclude_categories=("Cs",)), max_size=20)
    code = st.sampled_from(["E04", "E07", "E25"])
    findings = draw(
        st.lists(
            st.builds(Finding, code, st.just("warning"), texts, texts, texts, texts), max_size=3
        )
    )
    k_h = draw(st.none() | st.floats(0.1, 10))
    meta = RecordingMeta(
        findings=tuple(dict.fromkeys(findings)),
        receiver=draw(texts),
        pl=ProtectionLevelMeta(k_h=k_h),
        options=draw(st.dictionaries(texts, texts, max_size=2)),
    )
    return Recording(table, meta)


@given(recordings())
def test_any_recording_comes_back(
    tmp_path_factory: pytest.TempPathFactory, recording: Recording
) -> None:
    back = parquet.read(written(tmp_path_factory.mktemp("round"), recording))
    pd.testing.assert_frame_equal(back.table, recording.table, check_exact=True)
    assert back.meta == recording.meta


def test_pandas_returns_the_table_indexed_by_time(tmp_path: Path) -> None:
    recording = Recording(table_of(50), META)
    path = written(tmp_path, recording)
    frame = pd.read_parquet(path)
    assert frame.index.name == "time"
    assert frame.index.dtype == np.dtype("M8[ns]")
    assert list(frame) == list(recording.columns)
    pd.testing.assert_series_equal(frame["hpl_m"], recording.table["hpl_m"])
    schema = pq.read_schema(path)
    assert schema.field("time").type == pa.timestamp("ns")
    assert RecordingMeta.from_json(schema.metadata[b"sbas"].decode()) == META
    assert pq.ParquetFile(path).metadata.row_group(0).column(1).compression == "ZSTD"


def test_pieces_become_one_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parquet_writer, "BATCH_ROWS", 70)
    monkeypatch.setattr(parquet, "BATCH_ROWS", 70)
    pieces = [Recording(table_of(n, f"2025-05-{n:02d}", n), META) for n in (10, 25, 31, 9)]
    later = Finding("E10", "warning", "later")
    pieces[2] = pieces[2].with_findings(later)
    path = written(tmp_path, *pieces)
    whole = pd.concat([piece.table for piece in pieces])
    back = parquet.read(path)
    pd.testing.assert_frame_equal(back.table, whole)
    assert back.meta == replace(META, findings=(*META.findings, later))
    assert pq.ParquetFile(path).num_row_groups == 2
    batches = list(parquet.scan(path).batches(["hpl_m", "mode"]))
    assert max(map(len, batches)) <= 70
    pd.testing.assert_frame_equal(pd.concat(batches), whole[["hpl_m", "mode"]])


def test_pieces_with_new_environment_labels(tmp_path: Path) -> None:
    def piece(second: int, label: str) -> Recording:
        index = pd.DatetimeIndex(
            [np.datetime64("2025-05-23", "ns") + np.timedelta64(second, "ns")], name="time"
        )
        return Recording(pd.DataFrame({"environment": pd.Categorical([label])}, index=index))

    path = written(tmp_path, piece(0, "open"), piece(1, "tunnel"))
    back = parquet.read(path).table["environment"]
    assert back.astype(object).tolist() == ["open", "tunnel"]
    assert back.cat.categories.tolist() == ["open", "tunnel"]


def test_scan_decodes_only_what_is_asked_and_fills_the_rest(tmp_path: Path) -> None:
    table = table_of(100)[["lat_deg", "hpl_m"]]
    source = parquet.scan(written(tmp_path, Recording(table)))
    assert source.columns == ("lat_deg", "hpl_m")
    batch = next(iter(source.batches(["hpl_m", "herl_m", "mode"])))
    assert list(batch) == ["hpl_m", "herl_m", "mode"]
    assert batch["herl_m"].isna().all()
    assert batch["mode"].isna().all()
    only = parquet.read(tmp_path / "recording.parquet", columns=["hpl_m"])
    pd.testing.assert_frame_equal(only.table, table[["hpl_m"]])


def test_side_tables(tmp_path: Path) -> None:
    def piece(start: int) -> Recording:
        frames = pd.DataFrame(
            {
                "time": np.arange(start, start + 4).astype("M8[ns]"),
                "prn": np.array([123, 136, 123, 136], "i2"),
                "bits": [bytes([start, k] * 16) for k in range(4)],
            }
        )
        table = table_of(5, f"2025-05-2{start}", start)
        return Recording(table, META, {"sbas_frames": frames})

    path = written(tmp_path, piece(1), piece(2))
    companion = tmp_path / "recording.sbas_frames.parquet"
    back = parquet.read(path)
    expected = pd.concat([piece(k).side_tables["sbas_frames"] for k in (1, 2)], ignore_index=True)
    pd.testing.assert_frame_equal(back.side_tables["sbas_frames"], expected)
    assert back.meta == META

    companion.write_bytes(companion.read_bytes() + b" ")
    altered = parquet.read(path)
    assert altered.side_tables == {}
    assert (altered.meta.findings[-1].code, altered.meta.findings[-1].severity) == (
        "E25",
        "warning",
    )
    assert "altered" in altered.meta.findings[-1].message
    companion.unlink()
    assert "missing" in parquet.read(path).meta.findings[-1].message


def test_a_simulated_recording_comes_back_with_its_raw_frames(tmp_path: Path) -> None:
    made = simulate(hours=0.1, seed=3)
    assert made.side_tables["sbas_frames"]["frame"].dtype == pd.ArrowDtype(pa.binary(32))
    back = parquet.read(written(tmp_path, made))
    assert set(back.side_tables) == set(made.side_tables)
    for name, side in made.side_tables.items():
        pd.testing.assert_frame_equal(back.side_tables[name], side)


def test_a_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = written(tmp_path, Recording(table_of(10), META))
    before = path.read_bytes()

    def pieces():  # type: ignore[no-untyped-def]
        yield Recording(table_of(20), META)
        raise RuntimeError("the power went")

    with pytest.raises(RuntimeError):
        parquet.write(pieces(), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_what_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing"):
        written(tmp_path)
    one, two = table_of(3), table_of(3)[["hpl_m"]]
    with pytest.raises(InputError, match="different columns"):
        written(tmp_path, Recording(one), Recording(two))
    with pytest.raises(InputError, match="cannot be written"):
        parquet.write([Recording(one)], tmp_path / "no" / "folder.parquet")
    side = pd.DataFrame({"time": np.array([], "M8[ns]")})
    with pytest.raises(InputError, match="file name"):
        written(tmp_path, Recording(one, META, {"../x": side}))
    assert list(tmp_path.iterdir()) == []


def test_a_cut_file_is_refused_at_every_length(tmp_path: Path) -> None:
    path = written(tmp_path, Recording(table_of(40), META))
    whole = path.read_bytes()
    for length in range(0, len(whole) - 1, 97):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError, match="E10: the Parquet file is cut or damaged"):
            parquet.read(path)


def test_two_files_one_behind_the_other_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path, Recording(table_of(40), META))
    once = path.read_bytes()
    path.write_bytes(once + once)
    for call in (parquet.read, parquet.scan):
        with pytest.raises(InputError, match="E24: two Parquet files") as caught:
            call(path)
        assert f"byte {len(once):,}" in caught.value.where


def test_a_file_that_another_program_wrote_again_says_so(tmp_path: Path) -> None:
    path = written(tmp_path, Recording(table_of(40), META))
    pq.write_table(pq.read_table(path).slice(0, 30), path)
    back = parquet.read(path)
    assert len(back) == 30
    assert [(f.code, f.severity) for f in back.meta.findings][1:] == [("E25", "warning")]


@given(st.data())
def test_flipped_bytes_are_refused_or_harmless(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    recording = Recording(table_of(40)[["lat_deg", "hpl_m", "n_sv", "mode"]], META)
    path = written(tmp_path_factory.mktemp("flip"), recording)
    raw = bytearray(path.read_bytes())
    footer = len(raw) - 8 - int.from_bytes(raw[-8:-4], "little")
    at = data.draw(st.integers(0, len(raw) - 1))
    raw[at] ^= data.draw(st.integers(1, 255))
    path.write_bytes(raw)
    try:
        back = parquet.read(path)
    except InputError:
        return
    if at < footer:  # the checksums of the pages cover all data
        pd.testing.assert_frame_equal(back.table, recording.table)


def with_metadata(path: Path, metadata: dict[bytes, bytes]) -> None:
    pq.write_table(pq.read_table(path).replace_schema_metadata(metadata), path)


GOOD = json.loads(META.to_json())


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"\xff",
        b"null",
        b"[" * 100_000,
        b'{"schema": 99}',
        json.dumps({**GOOD, "sources": [{"path": 5}]}).encode(),
        json.dumps({**GOOD, "leap_seconds": "18"}).encode(),
        json.dumps({**GOOD, "pl": {"k_h": "6"}}).encode(),
        json.dumps({**GOOD, "options": {"a": [1]}}).encode(),
        json.dumps(
            {**GOOD, "findings": [{"code": "E99", "severity": "x", "message": ""}]}
        ).encode(),
        json.dumps(
            {**GOOD, "findings": [{"code": "E07", "severity": "x", "message": ""}]}
        ).encode(),
        json.dumps({**GOOD, "unknown": 1}).encode(),
    ],
)
def test_hostile_metadata_are_refused(tmp_path: Path, text: bytes) -> None:
    path = written(tmp_path, Recording(table_of(3)[["hpl_m"]], META))
    with_metadata(path, {b"sbas": text})
    with pytest.raises(InputError, match="metadata of the Parquet file cannot be read"):
        parquet.read(path)


@pytest.mark.parametrize(
    "layout",
    [
        b"7", b"{}", b'{"rows": "3"}', b"\xff", b'{"rows": 3, "side_tables": {"a": {}}}',
        b'{"rows": 3, "categories": {"mode": [1]}}', b'{"rows": 3, "later_findings": [{}]}',
    ],
)  # fmt: skip
def test_hostile_layouts_are_refused(tmp_path: Path, layout: bytes) -> None:
    path = written(tmp_path, Recording(table_of(3)[["hpl_m"]], META))
    table = pq.read_table(path).replace_schema_metadata({b"sbas": META.to_json().encode()})
    with pq.ParquetWriter(path, table.schema) as writer:
        writer.write_table(table)
        writer.add_key_value_metadata({b"sbas_layout": layout})
    with pytest.raises(InputError):
        parquet.read(path)


def test_a_companion_outside_the_folder_is_not_read(tmp_path: Path) -> None:
    side = {"a": {"file": "../../secret.parquet", "rows": 1, "sha256": ""}}
    path = tmp_path / "in" / "recording.parquet"
    path.parent.mkdir()
    table = pa.table({"time": pa.array([0], pa.timestamp("ns"))})
    table = table.replace_schema_metadata({b"sbas": META.to_json().encode()})
    with pq.ParquetWriter(path, table.schema) as writer:
        writer.write_table(table)
        writer.add_key_value_metadata(
            {b"sbas_layout": json.dumps({"rows": 1, "side_tables": side})}
        )
    finding = parquet.read(path).meta.findings[-1]
    assert finding.where == str(tmp_path / "in" / "secret.parquet")


def test_rows_that_do_not_match_the_layout(tmp_path: Path) -> None:
    path = tmp_path / "recording.parquet"
    table = pa.table({"time": pa.array([0], pa.timestamp("ns"))})
    table = table.replace_schema_metadata({b"sbas": META.to_json().encode()})
    with pq.ParquetWriter(path, table.schema) as writer:
        writer.write_table(table)
        writer.add_key_value_metadata({b"sbas_layout": json.dumps({"rows": 2})})
    finding = parquet.read(path).meta.findings[-1]
    assert (finding.code, finding.severity) == ("E25", "error")


def test_columns_of_wrong_kinds_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "recording.parquet"
    meta = {b"sbas": META.to_json().encode()}
    time = pa.array([0], pa.timestamp("ns"))
    wrong = [
        {"time": pa.array([0])},
        {"hpl_m": pa.array([1.0])},
        {"time": pa.array([None], pa.timestamp("ns"))},
        {"time": pa.array([0], pa.timestamp("ns", "UTC"))},
        {"time": time, "hpl_m": pa.array(["far"])},
        {"time": time, "n_sv": pa.array([70000])},
        {"time": time, "mode": pa.array(["fast"]).dictionary_encode()},
        {"time": time, "speed": pa.array([1.0])},
    ]
    for columns in wrong:
        pq.write_table(pa.table(columns).replace_schema_metadata(meta), path)
        with pytest.raises(InputError):
            parquet.read(path)


def foreign(folder: Path, frame: pd.DataFrame, *, index: bool = False) -> Path:
    path = folder / "foreign.parquet"
    frame.to_parquet(path, index=index)
    return path


def test_foreign_tables_need_a_time_scale(tmp_path: Path) -> None:
    times = pd.to_datetime(["2025-01-01 00:00:00", "2025-01-01 00:00:01"])
    frame = pd.DataFrame(
        {"timestamp": times, "Latitude": [50.5, 50.6], "HPL [mm]": [11500.0, -2e10]}
    )
    path = foreign(tmp_path, frame)
    with pytest.raises(InputError, match="time scale") as caught:
        parquet.read(path)
    assert "--time" in caught.value.cure
    recording = parquet.read(path, time_scale="UTC")
    assert str(recording.time[0])[:19] == "2025-01-01T00:00:18"
    assert recording.table["hpl_m"].tolist()[0] == 11.5
    assert np.isnan(recording.table["hpl_m"].iloc[1])
    assert recording.table["flags"].tolist() == [0, Flag.PL_SENTINEL]
    assert [f.code for f in recording.meta.findings] == ["E25", "E25", "E07"]
    assert parquet.scan(path, time_scale="GPST").columns == ("lat_deg", "hpl_m", "flags")


def test_foreign_kinds(tmp_path: Path) -> None:
    frame = pd.DataFrame(
        {
            "utc": pd.to_datetime(["2025-01-01 00:00:00", None], utc=True),
            "lat": np.array([50.5, 1.0], "f4"),
            "lon": [1, 2],
            "q": [3.0, 1.0],
            "alt": [245.0, 1.0],
            "x_a": ["one", "two"],
            "valid": [True, False],
        }
    )
    path = foreign(tmp_path, frame)
    options = {"mode_map": {"3": "sbas", "1": "standalone"}, "geoid": 44.5}
    recording = parquet.read(path, time_scale="UTC", **options)  # type: ignore[arg-type]
    assert len(recording) == 1
    row = recording.table.iloc[0]
    assert (row["lat_deg"], row["lon_deg"], row["height_m"]) == (50.5, 1.0, 289.5)
    assert (row["mode"], row["x_a"], row["x_valid"]) == ("sbas", "one", 1.0)
    found = {(f.code, f.severity) for f in recording.meta.findings}
    assert found == {("E25", "warning"), ("E25", "info"), ("E10", "error")}
    with pytest.raises(InputError, match="zone"):
        parquet.read(path, time_scale="GPST", **options)  # type: ignore[arg-type]


def test_foreign_index_week_and_text_times(tmp_path: Path) -> None:
    index = pd.DatetimeIndex(["2025-01-01"])
    frame = pd.DataFrame({"hpl": [11.5]}, index=index)
    indexed = parquet.read(foreign(tmp_path, frame, index=True), time_scale="GPST")
    assert str(indexed.time[0])[:10] == "2025-01-01"
    weeks = pd.DataFrame({"week": [1549], "sow": [518400.5], "hpl": [11.5]})
    by_week = parquet.read(foreign(tmp_path, weeks), time_scale="GPST")
    assert str(by_week.time[0])[:21] == "2009-09-19T00:00:00.5"
    texts = pd.DataFrame({"time": ["2025-01-01 00:00:00Z"], "hpl": [11.5]})
    by_text = parquet.read(foreign(tmp_path, texts), time_scale="UTC")
    assert str(by_text.time[0])[:19] == "2025-01-01T00:00:18"
    for bad in ({"time": [1.0], "hpl": [1.0]}, {"hpl": [1.0]}, {"time": ["x"], "hpl": [1.0]},
                {"time": index, "hpl": ["far"]}):  # fmt: skip
        with pytest.raises(InputError):
            parquet.read(foreign(tmp_path, pd.DataFrame(bad)), time_scale="GPST")


def test_options_of_foreign_tables_do_not_fit_own_files(tmp_path: Path) -> None:
    path = written(tmp_path, Recording(table_of(3), META))
    assert len(parquet.read(path, time_scale="GPST")) == 3
    for option in ({"time_scale": "UTC"}, {"geoid": 44.5}, {"mode_map": {"3": "sbas"}}):
        with pytest.raises(InputError, match="other programs"):
            parquet.read(path, **option)  # type: ignore[arg-type]


def test_progress_reaches_the_end(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    path = tmp_path / "recording.parquet"
    parquet.write([Recording(table_of(3))], path, progress=lambda a, b: seen.append((a, b)))
    assert seen
    source = parquet.scan(path, progress=lambda a, b: seen.append((a, b)))
    list(source.batches(["hpl_m"]))
    assert seen[-1] == (path.stat().st_size, path.stat().st_size)


def test_a_foreign_table_with_a_leap_second_and_letters(tmp_path: Path) -> None:
    path = tmp_path / "other.parquet"
    stamps = ["2016-12-31 23:59:59", "2016-12-31 23:59:60", "2017-01-01 00:00:00"]
    pd.DataFrame({"time": stamps, "lat": 33.5, "lat_dir": "S", "lon": 15.5}).to_parquet(path)
    read = parquet.read(path, time_scale="GPST")
    (found,) = (f for f in read.meta.findings if f.code == "E02")
    assert (found.severity, found.cure, len(read.table)) == ("error", "--time-scale UTC", 2)
    exact = parquet.read(path, time_scale="UTC").table
    assert np.diff(exact.index).tolist() == [10**9, 10**9]
    assert exact["lat_deg"].tolist() == [-33.5] * 3
