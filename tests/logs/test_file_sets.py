"""Paths, patterns and folders as files."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sbas.exceptions import InputError
from sbas.logs.arrow import parquet
from sbas.logs.file_sets import checked_file, find_files, sha256_of
from sbas.recording import Recording


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("b.sbf", "a.sbf", "sub/c.sbf", "sub/deep/d.pos", ".hidden/e.sbf", ".f.sbf"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name)
    os.mkfifo(tmp_path / "pipe.sbf")
    return tmp_path


def names(folder: Path, paths: object) -> list[str]:
    found = find_files(paths)  # type: ignore[arg-type]
    return [str(path.relative_to(folder)) for path in found.files]


def test_one_path_is_itself_whatever_it_is(tmp_path: Path) -> None:
    for name in ("a.sbf", "absent.sbf"):
        files = find_files(tmp_path / name)
        assert (files.files, files.several) == ((tmp_path / name,), False)
        assert find_files([str(tmp_path / name)]).several is False


def test_folders_and_patterns(folder: Path) -> None:
    assert names(folder, folder) == ["a.sbf", "b.sbf", "sub/c.sbf", "sub/deep/d.pos"]
    assert names(folder, str(folder / "*.sbf")) == ["a.sbf", "b.sbf"]
    assert names(folder, folder / "**" / "*.sbf") == ["a.sbf", "b.sbf", "sub/c.sbf"]
    assert names(folder, folder / "su?") == ["sub/c.sbf", "sub/deep/d.pos"]
    assert names(folder, [folder / "b.sbf", folder / "sub"]) == [
        "b.sbf", "sub/c.sbf", "sub/deep/d.pos",
    ]  # fmt: skip
    assert find_files(folder).of_folder == set(find_files(folder).files)
    assert find_files(str(folder / "*.sbf")).of_folder == frozenset()


def test_a_name_that_exists_is_no_pattern(tmp_path: Path) -> None:
    (tmp_path / "day[1].sbf").write_text("1")
    (tmp_path / "day1.sbf").write_text("2")
    assert names(tmp_path, tmp_path / "day[1].sbf") == ["day[1].sbf"]


def test_nothing_found_is_an_error(tmp_path: Path) -> None:
    for paths, message in (
        (tmp_path, "holds no file"),
        (tmp_path / "*.sbf", "no file matches"),
        ([], "no file is named"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            find_files(paths)  # type: ignore[arg-type]
        assert caught.value.cure


def test_equal_bytes_are_kept_once(tmp_path: Path) -> None:
    for name, text in (("a", "same"), ("b", "diff"), ("c", "same"), ("d", "longer")):
        (tmp_path / name).write_text(text)
    files = find_files(tmp_path)
    assert [f.name for f in files.files] == ["a", "b", "d"]
    (finding,) = files.findings
    assert (finding.code, finding.severity) == ("E26", "warning")
    assert finding.message.startswith("1 of 4")


def test_side_tables_belong_to_their_recording(tmp_path: Path) -> None:
    index = pd.DatetimeIndex(np.arange(3).astype("M8[s]").astype("M8[ns]"), name="time")
    side = pd.DataFrame({"time": index, "prn": np.int16(120)})
    recording = Recording(
        pd.DataFrame({"hpl_m": [1.0, 2.0, 3.0]}, index=index), side_tables={"frames": side}
    )
    parquet.write([recording], tmp_path / "day.parquet")
    parquet.write([recording], tmp_path / "day.two.parquet")
    expected = ["day.parquet", "day.two.parquet"]
    assert (tmp_path / "day.frames.parquet").exists()
    assert names(tmp_path, tmp_path) == expected
    assert names(tmp_path, tmp_path / "*.parquet") == expected
    assert names(tmp_path, tmp_path / "day.frames.parquet") == ["day.frames.parquet"]
    (tmp_path / "day.parquet").write_text("no Parquet")
    assert names(tmp_path, tmp_path)[0] == "day.frames.parquet"


def test_sha256(tmp_path: Path) -> None:
    (tmp_path / "abc").write_text("abc")  # FIPS 180-2, appendix B.1
    assert sha256_of(tmp_path / "abc").startswith(
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9c"
    )


def test_unusable_files(tmp_path: Path) -> None:
    (tmp_path / "empty").write_text("")
    for name, message in (("", "a folder"), ("absent", "no such file"), ("empty", "E15")):
        with pytest.raises(InputError, match=message):
            checked_file(tmp_path / name)
