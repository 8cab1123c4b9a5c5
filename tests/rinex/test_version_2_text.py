"""RINEX 2 observations, read as those of version 3."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.rinex.observation_file import read_observations
from sbas.rinex.observations import Observations
from tests.rinex.rinex_samples import START, Epoch, epoch_2, header_2, line, ranges

TYPES = ("C1", "L1", "D1", "S1", "P2", "L2", "S2")
NEW = ("C1C", "L1C", "D1C", "S1C", "C2W", "L2W", "S2W")
NAMES = (*(f"G{n:02d}" for n in range(1, 15)), "S36", "R03")


def epoch(k: int, names: tuple[str, ...] = NAMES) -> Epoch:
    return ranges(k, names, len(TYPES))


def read(folder: Path, text: str, **options: object) -> Observations:
    path = folder / "a.24o"
    path.write_text(text)
    return read_observations(path, **options)  # type: ignore[arg-type]


def assert_epochs(found: Observations, numbers: list[int]) -> None:
    gps = found.systems["G"]
    assert gps.time.tolist() == np.array([ranges(k)[0] for k in numbers], "M8[ns]").tolist()
    for row, k in enumerate(numbers):
        for name, cells in epoch(k)[1].items():
            system = found.systems[name[0]]
            names = found.header.codes[name[0]]
            column = system.satellites.index(name)
            for code, (value, lock, strength) in zip(names, cells, strict=True):
                assert system.values[code][row, column] == value
                assert system.loss_of_lock[code][row, column] == int(lock or -1)
                assert system.strength[code][row, column] == int(strength)


def body(*numbers: int) -> str:
    return "".join(epoch_2(epoch(k)) for k in numbers)


def test_folded_lines_of_many_satellites(tmp_path: Path) -> None:
    found = read(tmp_path, header_2(TYPES) + body(0, 1, 2))
    assert found.header.codes["G"] == NEW
    assert found.header.codes["R"] == ("C1C", "L1C", "D1C", "S1C", "C2P", "L2P", "S2P")
    assert_epochs(found, [0, 1, 2])
    assert [f.code for f in found.findings] == ["E26"]


def test_line_ends_of_other_systems(tmp_path: Path) -> None:
    path = tmp_path / "a.24o"
    path.write_bytes((header_2(TYPES) + body(0, 1)).replace("\n", "\r\n").encode())
    assert_epochs(read_observations(path), [0, 1])


def test_blank_values_and_blank_letters(tmp_path: Path) -> None:
    cells = [(None, "", ""), (5.0, "1", "")] + [(None, "", "")] * 5
    text = epoch_2((START, {"G05": cells, "G07": cells})).replace("G05G07", "  5  7", 1)
    found = read(tmp_path, header_2(TYPES, "G") + text + epoch_2(epoch(1, ("G05",))))
    gps = found.systems["G"]
    assert gps.satellites == ("G05", "G07")
    np.testing.assert_array_equal(gps.values["L1C"][0], [5.0, 5.0])
    assert np.isnan(gps.values["C1C"][0]).all()
    assert gps.values["C1C"][1, 0] == ranges(1)[1]["G05"][0][0]


def test_a_file_cut_anywhere_keeps_every_whole_epoch(tmp_path: Path) -> None:
    names = ("G05", "S36")
    parts = [epoch_2(ranges(k, names, 7)) for k in range(4)]
    text = header_2(TYPES) + "".join(parts)
    ends = np.cumsum([len(header_2(TYPES)), *map(len, parts)])
    for size in range(len(text) - 1, int(ends[1]), -1):
        found = read(tmp_path, text[:size])
        whole = int(np.count_nonzero(ends[1:] <= size))
        assert found.systems["G"].time.size == whole, size
        for k in range(whole):
            assert found.systems["G"].values["S2W"][k, 0] == ranges(k, names, 7)[1]["G05"][6][0]
        told = [f.code for f in found.findings if f.severity != "info"]
        assert bool(told) == bool(text[int(ends[whole]) : size].strip())


@pytest.mark.parametrize("lost", [1, 2, 3, 7])
def test_a_line_lost_or_doubled_costs_its_epoch_only(tmp_path: Path, lost: int) -> None:
    parts = [epoch_2(epoch(k)) for k in range(5)]
    rows = parts[2].split("\n")
    for changed in (rows[:lost] + rows[lost + 1 :], [*rows[:lost], rows[lost], *rows[lost:]]):
        text = header_2(TYPES) + "".join(parts[:2]) + "\n".join(changed) + "".join(parts[3:])
        assert_epochs(read(tmp_path, text), [0, 1, 3, 4])


def test_a_damaged_epoch_line_costs_two_epochs_at_most(tmp_path: Path) -> None:
    damaged = epoch_2(epoch(2)).replace(" 24", " x4", 1)
    found = read(tmp_path, header_2(TYPES) + body(0, 1) + damaged + body(3, 4))
    assert_epochs(found, [0, 3, 4])
    assert "E10" in [f.code for f in found.findings]


def test_events(tmp_path: Path) -> None:
    event = " " * 28 + "4  2\n" + line("G05 of a comment", "COMMENT") + line("  2", "COMMENT")
    timed = " 24  3  5 10  0  0.5000000  3  1\n" + line("OTHER", "MARKER NAME")
    slips = epoch_2(epoch(1), 6)
    text = header_2(TYPES) + body(0) + event + timed + slips + body(1)
    found = read(tmp_path, text)
    assert_epochs(found, [0, 1])
    assert "3 event records" in " ".join(f.message for f in found.findings)


def test_types_that_change_are_refused(tmp_path: Path) -> None:
    same = " " * 28 + "4  1\n" + header_2(TYPES).split("\n")[2] + "\n"
    assert_epochs(read(tmp_path, header_2(TYPES) + body(0) + same + body(1)), [0, 1])
    other = same.replace("C1    L1", "L1    C1")
    with pytest.raises(InputError, match="types change"):
        read(tmp_path, header_2(TYPES) + body(0) + other + body(1))


def test_a_second_header_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="second header"):
        read(tmp_path, header_2(TYPES) + body(0) + header_2(TYPES[::-1]) + body(1))


def test_scales_and_centuries(tmp_path: Path) -> None:
    then = (dt.datetime(1998, 12, 31, 23, 59, 59), epoch(0)[1])
    found = read(tmp_path, header_2(TYPES, scale="GLO") + epoch_2(then))
    # UTC was 12 s behind GPS time before the leap second at the end of 1998 (Bulletin C 16).
    assert found.systems["G"].time[0] == np.datetime64("1999-01-01T00:00:11", "ns")


def test_codes_are_asked_for_by_their_new_names(tmp_path: Path) -> None:
    found = read(tmp_path, header_2(TYPES) + body(0), codes=["C2W"], systems="G")
    assert list(found.systems) == ["G"]
    assert list(found.systems["G"].values) == ["C2W"]
