"""Epochs set aside come back as they were."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sbas.exceptions import InputError
from sbas.logs import epoch_spool
from sbas.logs.epoch_spool import SpooledEpochs, can_spool, in_pieces, spool
from sbas.recording import RecordingMeta, mode_categories


def table(begin: int, rows: int, labels: list[str | None], **more: object) -> pd.DataFrame:
    time = (np.arange(begin, begin + rows) * 10**9).astype("M8[ns]")
    return pd.DataFrame(
        {
            "hpl_m": np.where(np.arange(rows) % 3 == 0, np.nan, begin + np.arange(rows) / 7),
            "n_sv": np.arange(rows).astype("i2") - 1,
            "mode": mode_categories(np.arange(rows) % 4 - 1),
            "environment": pd.Categorical(labels * rows).take(range(rows)),
            "hardware_fault": np.arange(rows) % 2 == 0,
            "x_note": pd.array([f"{begin} é"] * rows, dtype="str"),
            **more,
        },
        index=pd.DatetimeIndex(time, name="time"),
    )


def test_pieces_come_back_as_one_table() -> None:
    pieces = [table(0, 5, ["open", None]), table(5, 4, ["cutting", "open"])]
    source = SpooledEpochs(RecordingMeta(receiver="r"), spool(iter(pieces)))
    assert (len(source), source.columns) == (9, tuple(pieces[0].columns))
    found = pd.concat(source.batches(source.columns))
    for name in ("hpl_m", "n_sv", "hardware_fault", "x_note"):
        pd.testing.assert_series_equal(found[name], pd.concat([p[name] for p in pieces]))
    assert found["environment"].astype(object).where(found["environment"].notna(), "").tolist() == [
        "open", "", "open", "", "open", "cutting", "open", "cutting", "open",
    ]  # fmt: skip
    assert found["mode"].cat.codes.tolist() == [-1, 0, 1, 2, -1, -1, 0, 1, 2]
    (first, second) = source.batches(["herl_m", "hpl_m"])
    assert list(first) == ["herl_m", "hpl_m"]
    assert second["herl_m"].isna().all()


def test_flags_are_there_where_one_piece_has_them() -> None:
    flagged = table(2, 2, ["open"], flags=np.array([0, 4], "u4"))
    source = SpooledEpochs(RecordingMeta(), spool([table(0, 2, ["open"]), flagged]))
    assert source.columns[-1] == "flags"
    assert pd.concat(source.batches(["flags"]))["flags"].tolist() == [0, 0, 0, 4]
    without = spool([table(0, 2, ["open"])])
    assert "flags" not in without.columns


def test_the_file_goes_with_its_source() -> None:
    source = SpooledEpochs(RecordingMeta(), spool([table(0, 2, ["open"])]))
    path = source.spool.file.path
    batches = source.batches(["hpl_m"])
    del source
    assert len(next(batches)) == 2
    del batches
    gc.collect()
    assert not path.exists()


def test_errors_of_the_reader_pass_and_leave_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    def broken() -> Iterator[pd.DataFrame]:
        yield table(0, 2, ["open"])
        raise InputError("no more")

    with pytest.raises(InputError, match="no more"):
        spool(broken())
    gc.collect()
    assert not list(tmp_path.iterdir())


def test_no_room_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(epoch_spool, "_writer", full)
    with pytest.raises(InputError, match="set aside") as caught:
        spool([table(0, 2, ["open"])])
    assert "TMPDIR" in caught.value.cure


def test_parts_are_joined_to_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(epoch_spool, "PIECE_ROWS", 4)
    assert list(in_pieces([1, 3, 0, 5, 2, 0], lambda rows: rows)) == [[1, 3], [0, 5], [2, 0]]
    assert list(in_pieces([0], lambda rows: rows)) == [[0]]


def test_what_can_be_set_aside() -> None:
    assert can_spool(table(0, 2, ["open"]))
    assert not can_spool(table(0, 2, ["open"], x_when=np.zeros(2, "M8[ns]")))
