"""RINEX-B: records of three lines, stamped at the first bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sbas.augmentation.message_files import read_messages
from sbas.exceptions import InputError
from tests.augmentation import encoding as enc

HEADER = [
    f"{'     2.10':20}{'B SBAS DATA':20}{'':20}RINEX VERSION / TYPE",
    f"{'SBAS':20}{'TEST':20}{'':20}PGM / RUN BY / DATE",
    f"{'  1 RECEIVER':60}REC INDEX/TYPE/VERS",
    f"{'':60}END OF HEADER",
]


def record(second: float, frame: bytes, prn: int = 131, signal: str = "L1") -> list[str]:
    """The first bit of a message stamped at its end 1 s later; 18 and 14 bytes."""
    pairs = [f"{byte:02X}" for byte in frame]
    return [
        f"{prn:3d} 18 01 14 21 20 {second:4.1f}  {signal}   32   1   000",
        f" {frame[1] >> 2:2d}    {' '.join(pairs[:18])}",
        f"       {' '.join(pairs[18:])}",
    ]


def write(folder: Path, *records: list[str]) -> Path:
    path = folder / "geo.18b"
    lines = [*HEADER, *(line for lines in records for line in lines)]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


MASK = enc.mask(1, (3, 5, 9))


def test_messages_end_a_second_after_their_stamp(tmp_path: Path) -> None:
    path = write(tmp_path, record(0.0, MASK), record(1.1, enc.null()), record(9.9, enc.null()))
    for stamp in ("end", "start"):
        found = read_messages(path, stamp=stamp)
        assert (found.time_s - enc.START_S).tolist() == [1, 2, 10]
    assert found.kind.tolist() == [1, 63, 63]
    assert found.frame[0].tobytes() == MASK
    assert found.crc_checked.all()
    assert not found.findings


def test_other_bands_and_damage(tmp_path: Path) -> None:
    damaged = bytearray(enc.null())
    damaged[30] ^= 1
    path = write(
        tmp_path, record(0, MASK), record(1, MASK, signal="L5"), record(2, bytes(damaged)),
        record(3, MASK, prn=33),
    )  # fmt: skip
    found = read_messages(path)
    assert len(found) == 1
    assert found.left_out == {(131, "l5"): 1, (131, "crc"): 1, (33, "prn"): 1}


@pytest.mark.parametrize("lines", [1, 2])
def test_a_record_that_the_end_cuts_is_unreadable(tmp_path: Path, lines: int) -> None:
    path = write(tmp_path, record(0, MASK), record(1, MASK)[:lines])
    found = read_messages(path)
    assert len(found) == 1
    assert found.left_out == {(0, "unreadable"): lines}


def test_short_digits_are_not_read(tmp_path: Path) -> None:
    short = record(1, MASK)
    short[2] = short[2][:-3]
    found = read_messages(write(tmp_path, record(0, MASK), short, record(2, MASK)))
    assert (found.time_s - enc.START_S).tolist() == [1, 3]
    assert found.left_out == {(0, "unreadable"): 3}


def test_other_rinex_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "day.18o"
    path.write_text(
        f"{'     3.04':20}{'OBSERVATION DATA':40}RINEX VERSION / TYPE\n{'':60}END OF HEADER\n"
    )
    with pytest.raises(InputError, match="no broadcast messages"):
        read_messages(path)


def test_a_file_without_records_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no SBAS message"):
        read_messages(write(tmp_path))


def test_a_day_of_a_real_set_written_and_read_again(tmp_path: Path, reference_data: Path) -> None:
    """600 messages of WAAS through RINEX-B come back with their times and bits."""
    source = read_messages(reference_data / "data/waas_2020001/waas131_2020001.ems", prn=131)
    records = []
    for time_s, frame in zip(source.time_s[:600], source.frame[:600], strict=True):
        moment = np.datetime64("1980-01-06T00:00:00") + np.timedelta64(int(time_s) - 1, "s")
        text = str(moment)
        head = f"131 {text[2:4]} {text[5:7]} {text[8:10]} {text[11:13]} {text[14:16]} "
        lines = record(0, frame.tobytes())
        lines[0] = head + f"{int(text[17:19]):4.1f}" + lines[0][len(head) + 4 :]
        records.append(lines)
    found = read_messages(write(tmp_path, *records))
    np.testing.assert_array_equal(found.time_s, source.time_s[:600])
    np.testing.assert_array_equal(found.frame, source.frame[:600])
