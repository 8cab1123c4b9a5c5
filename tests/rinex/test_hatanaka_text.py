"""Compact RINEX, whole and cut."""

from __future__ import annotations

from pathlib import Path

import hatanaka
import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.rinex.hatanaka_text import is_compact, restored
from sbas.rinex.observation_file import read_observations
from tests.rinex.rinex_samples import CODES, epoch_2, epoch_3, header_2, header_3, line, ranges
from tests.rinex.test_observation_file import assert_epochs, codes_of

MADE = line("somebody", "PGM / RUN BY / DATE")


def compact(text: str) -> bytes:
    return bytes(hatanaka.rnx2crx(text.encode()))


def file(epochs: int) -> str:
    text = header_3(CODES, version="3.03", extra=MADE)
    return text + "".join(epoch_3(ranges(k)) for k in range(epochs))


def test_what_was_packed_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "a.crx"
    path.write_bytes(compact(file(6)))
    assert is_compact(path)
    data, findings = restored(path, where="a.crx")
    assert data.decode() == file(6)
    assert not findings
    found = read_observations(path)
    assert_epochs(found, [0, 1, 2, 3, 4, 5])
    assert not found.findings


def test_version_2(tmp_path: Path) -> None:
    path = tmp_path / "a.24d"
    text = header_2(("C1", "L1", "D1", "S1")) + "".join(epoch_2(ranges(k)) for k in range(3))
    path.write_bytes(compact(text))
    assert_epochs(read_observations(path), [0, 1, 2])


def test_a_file_cut_anywhere_keeps_every_whole_epoch(tmp_path: Path) -> None:
    path = tmp_path / "a.crx"
    data = compact(file(5))
    path.write_bytes(data)
    # Where each epoch ends in the packed text: its satellites' lines come last.
    lines = data[data.find(b"END OF HEADER") :].split(b"\n")
    begin = data.find(b"\n", data.find(b"END OF HEADER")) + 1
    ends, at = [], begin
    for k, text in enumerate(lines[1:-1]):
        at += len(text) + 1
        if k % 5 == 4:  # epoch, clock and three satellites
            ends.append(at)
    assert ends[-1] == len(data)
    for size in range(len(data) - 1, ends[0], -3):
        path.write_bytes(data[:size])
        found = read_observations(path)
        whole = sum(end <= size for end in ends)
        assert_epochs(found, list(range(whole)))
        assert codes_of(found) == ([] if size in ends else ["E10 warning"])


def test_damage_in_the_middle_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.crx"
    rows = compact(file(6)).split(b"\n")
    rows[-11] = b"junk line"  # the record of the fifth epoch
    path.write_bytes(b"\n".join(rows))
    found = read_observations(path)
    assert_epochs(found, [0, 1, 2, 3])
    assert "E10 warning" in codes_of(found)


def test_marks_that_are_damaged_take_their_values_with_them(tmp_path: Path) -> None:
    path = tmp_path / "a.crx"
    rows = compact(file(6)).split(b"\n")
    rows[-8] += b" x"
    path.write_bytes(b"\n".join(rows))
    values = read_observations(path).systems["G"].values["C1C"]
    assert np.isnan(values[:, 1]).tolist() == [False] * 4 + [True] * 2
    assert np.isfinite(values[:, 0]).all()


@pytest.mark.parametrize("size", [81, 200, 500])
def test_a_file_that_ends_in_its_header_is_refused(tmp_path: Path, size: int) -> None:
    path = tmp_path / "a.crx"
    path.write_bytes(compact(file(2))[:size])
    with pytest.raises(InputError):
        read_observations(path)


def test_a_text_out_of_proportion_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.crx"
    path.write_bytes(compact(file(50)))
    monkeypatch.setattr("sbas.rinex.hatanaka_text.output_limit", lambda size: size)
    with pytest.raises(InputError, match="out of proportion") as caught:
        restored(path, where="a.crx")
    assert caught.value.code == "E21"
