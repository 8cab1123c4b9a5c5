"""Message files of every kind, good and bad."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.augmentation.message_files import read_messages
from sbas.augmentation.messages import SbasMessages
from sbas.exceptions import InputError
from sbas.recording import Recording
from tests.augmentation import encoding as enc

FRAMES = [
    (0, enc.mask(1, (3, 5, 9))),
    (1, enc.fast(2, 0, 1, [4] * 13, [5] * 13)),
    (2, enc.null()),
    (3, enc.iono_delays(3, 2, 1, [9] * 15, [2] * 15)),
]
# 2018-01-15 21:20:00 is GPS second 1,200,000,000 (week 1984, second 76,800 of the week).
WEEK, TOW = divmod(enc.START_S, 604800)


def kind_of(frame: bytes) -> int:
    return frame[1] >> 2


def ems(second: int, frame: bytes, prn: int = 131) -> str:
    return f"{prn} 18 01 14 21 20 {second:02d} {kind_of(frame)} {frame.hex().upper()}"


def new_ems(second: int, frame: bytes, prn: int = 131, signal: str = "L1") -> str:
    line = f"{prn:3d} 18 01 14 21 20 {second:02d}.000000 {signal}"
    return f"{line:37}{kind_of(frame):02d} {frame.hex().upper()}"


def sbs(second: int, frame: bytes, prn: int = 131) -> str:
    digits = frame.hex().upper()[:56] + f"{frame[28] & 0xC0:02X}"
    return f"{WEEK} {TOW + second} {prn} {kind_of(frame):2d} : {digits}"


def plain(second: int, frame: bytes, prn: int = 131) -> str:
    return f"{WEEK} {TOW + second} {frame.hex().upper()}"


def columns(second: int, frame: bytes, prn: int = 131, frequency: int = 0) -> str:
    return f"{WEEK}\t{TOW + second}\t{prn}\t{frequency}\t32\t{frame.hex()}"


def write(folder: Path, *lines: str, name: str = "messages.txt") -> Path:
    path = folder / name
    path.write_text("".join(line + "\n" for line in lines), encoding="latin-1", newline="")
    return path


def assert_the_frames(found: SbasMessages, *, crc: bool = True) -> None:
    assert (found.time_s - enc.START_S).tolist() == [second for second, _ in FRAMES]
    assert set(found.prn.tolist()) == {131}
    assert found.kind.tolist() == [kind_of(frame) for _, frame in FRAMES]
    bits = np.unpackbits(found.frame, axis=1)[:, : 250 if crc else 226]
    wanted = np.unpackbits(
        np.frombuffer(b"".join(f for _, f in FRAMES), np.uint8).reshape(-1, 32), axis=1
    )
    np.testing.assert_array_equal(bits, wanted[:, : bits.shape[1]])
    assert set(found.crc_checked.tolist()) == {crc}


@pytest.mark.parametrize("form", [ems, new_ems, sbs, plain, columns])
@pytest.mark.parametrize("packed", [False, True])
def test_every_kind_of_lines(tmp_path: Path, form, packed: bool) -> None:  # type: ignore[no-untyped-def]
    path = write(tmp_path, *(form(second, frame) for second, frame in FRAMES))
    if packed:
        path = tmp_path / "messages.txt.gz"
        path.write_bytes(gzip.compress((tmp_path / "messages.txt").read_bytes()))
    found = read_messages(path, prn=131)
    assert_the_frames(found, crc=form is not sbs)
    assert not found.findings


@pytest.mark.parametrize("form", [ems, new_ems, sbs, plain, columns])
def test_stamps_of_the_start_are_a_second_before_the_end(tmp_path: Path, form) -> None:  # type: ignore[no-untyped-def]
    path = write(tmp_path, *(form(second, frame) for second, frame in FRAMES))
    end, start = (read_messages(path, prn=131, stamp=s).time_s for s in ("end", "start"))
    np.testing.assert_array_equal(start, end + 1)


@pytest.mark.parametrize("form", [ems, new_ems, sbs, plain, columns])
def test_lines_of_another_system(tmp_path: Path, form) -> None:  # type: ignore[no-untyped-def]
    """Carriage returns, blank lines, and what fits no line."""
    lines = [form(second, frame) for second, frame in FRAMES]
    cut = lines[0][:-8]
    path = write(tmp_path, *(line + "\r" for line in lines), "", "\r", "caf\xe9", cut)
    found = read_messages(path, prn=131)
    assert len(found) == len(FRAMES)
    assert found.left_out == {} or set(found.left_out) == {(0, "unreadable")}
    evidence = [f.message for f in found.findings]
    assert evidence == ["2 messages that cannot be read left out, 4 kept"]


def test_a_file_that_ends_within_a_line(tmp_path: Path) -> None:
    path = write(tmp_path, *(ems(second, frame) for second, frame in FRAMES))
    path.write_bytes(path.read_bytes()[:-20])
    found = read_messages(path)
    assert len(found) == 3
    assert "1 messages that cannot be read" in found.findings[0].message


@pytest.mark.parametrize(
    "line",
    [
        "131 18 13 14 21 20 05 63 ", "131 18 00 14 21 20 05 63 ", "131 18 02 29 21 20 05 63 ",
        "131 18 01 00 21 20 05 63 ", "131 18 01 14 24 20 05 63 ", "131 18 01 14 21 60 05 63 ",
        "131 18 01 14 21 20 60 63 ",
    ],
)  # fmt: skip
def test_times_that_do_not_exist_are_unreadable(tmp_path: Path, line: str) -> None:
    path = write(tmp_path, ems(*FRAMES[0]), line + enc.null().hex())
    found = read_messages(path)
    assert (found.time_s - enc.START_S).tolist() == [0]
    assert "1 messages that cannot be read" in found.findings[0].message


def test_a_leap_day_exists(tmp_path: Path) -> None:
    path = write(tmp_path, "131 20 02 29 23 59 59 63 " + enc.null().hex())
    assert read_messages(path).time_s[0] == (
        pd.Timestamp("2020-02-29 23:59:59") - pd.Timestamp("1980-01-06")
    ) // pd.Timedelta("1s")


def test_seconds_beyond_the_week_are_unreadable(tmp_path: Path) -> None:
    path = write(tmp_path, sbs(0, enc.null()), f"{WEEK} 604800 131 63 : {enc.null().hex()[:58]}")
    assert len(read_messages(path)) == 1


def test_types_that_are_not_the_one_stated_and_damage(tmp_path: Path) -> None:
    wrong_type = ems(4, enc.null()).replace(" 63 ", " 62 ")
    turned = bytearray(enc.null())
    turned[20] ^= 1
    path = write(tmp_path, *(ems(*f) for f in FRAMES), wrong_type, ems(5, bytes(turned)))
    found = read_messages(path, prn=131)
    assert len(found) == 4
    assert found.left_out == {(131, "kind"): 1, (131, "crc"): 1}
    assert (found.bad_time_s - enc.START_S).tolist() == [4, 5]


def test_lines_of_l5_and_of_other_navigation_data(tmp_path: Path) -> None:
    lines = [new_ems(s, f) for s, f in FRAMES]
    lines += [new_ems(0, enc.null(), signal="L5")]
    lines += [new_ems(0, enc.null(), prn=33), new_ems(0, enc.null(), prn=193)]
    found = read_messages(write(tmp_path, *lines))
    assert found.left_out == {(131, "l5"): 1, (33, "prn"): 1, (193, "prn"): 1}
    path = write(tmp_path, *(columns(s, f) for s, f in FRAMES), columns(0, enc.null(), frequency=1))
    assert read_messages(path).left_out == {(131, "l5"): 1}


def test_several_files_are_one_stream(tmp_path: Path) -> None:
    first = write(tmp_path, *(ems(s, f) for s, f in FRAMES[:2]), name="a.ems")
    second = write(tmp_path, *(sbs(s, f) for s, f in FRAMES[1:]), name="b.sbs")
    found = read_messages([first, second])
    assert (found.time_s - enc.START_S).tolist() == [0, 1, 2, 3]
    assert found.left_out == {(131, "repeated"): 1}
    assert found.crc_checked.tolist() == [True, True, False, False]


def test_a_file_without_a_satellite_asks_for_it(tmp_path: Path) -> None:
    path = write(tmp_path, plain(*FRAMES[0]))
    with pytest.raises(InputError, match="does not name its satellite"):
        read_messages(path)


def test_another_satellite_than_those_heard(tmp_path: Path) -> None:
    path = write(tmp_path, ems(*FRAMES[0]))
    with pytest.raises(InputError, match="no message of PRN 137") as caught:
        read_messages(path, prn=137)
    assert "131" in str(caught.value)


@pytest.mark.parametrize("content", ["", "\n\n", "nothing of any kind\n" * 30])
def test_files_without_a_message_are_refused(tmp_path: Path, content: str) -> None:
    path = write(tmp_path, content)
    with pytest.raises(InputError):
        read_messages(path)


def test_a_missing_file_and_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_messages(tmp_path / "absent.ems")
    with pytest.raises(InputError, match="no message file"):
        read_messages([])


def test_a_file_larger_than_any(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sbas.augmentation.message_files.MAX_TEXT_BYTES", 200)
    path = write(tmp_path, *(ems(s, f) for s, f in FRAMES))
    with pytest.raises(InputError, match="larger than any"):
        read_messages(path)


def recording(frames: pd.DataFrame | None) -> Recording:
    index = pd.DatetimeIndex(np.array(["2018-01-14T21:20:00"], "M8[ns]"), name="time")
    tables = {} if frames is None else {"sbas_frames": frames}
    return Recording(pd.DataFrame(index=index), side_tables=tables)


def frame_table(seconds: list[float | None]) -> pd.DataFrame:
    start = pd.Timestamp("2018-01-14T21:20:00")
    time = pd.to_datetime([None if s is None else start + pd.Timedelta(seconds=s) for s in seconds])
    n = len(seconds)
    frames = [FRAMES[i % 4][1] for i in range(n)]
    return pd.DataFrame(
        {
            "time": time.astype("M8[ns]"),
            "prn": np.full(n, 131, np.int16),
            "crc_passed": np.ones(n, bool),
            "signal": pd.Categorical(["L1"] * n, ["L1", "L5"]),
            "frame": frames,
        }
    )


def test_frames_of_a_recording() -> None:
    found = read_messages(recording(frame_table([0.0, 1.02, 1.98, 3.0])))
    assert_the_frames(found)


def test_frames_without_time_crc_or_satellite() -> None:
    frames = frame_table([0.0, None, 2.0, 3.0, 4.0])
    frames.loc[2, "crc_passed"] = False
    frames.loc[3, "signal"] = "L5"
    frames.loc[4, "prn"] = -1
    found = read_messages(recording(frames))
    assert (found.time_s - enc.START_S).tolist() == [0]
    assert found.left_out == {
        (0, "unreadable"): 1, (131, "crc"): 1, (131, "l5"): 1, (-1, "prn"): 1,
    }  # fmt: skip


def test_a_recording_without_frames() -> None:
    with pytest.raises(InputError, match="no SBAS frames"):
        read_messages(recording(None))


@given(st.binary(max_size=300))
def test_no_bytes_raise_anything_but_an_input_error(tmp_path_factory, data: bytes) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path_factory.mktemp("any") / "any.ems"
    path.write_bytes(ems(*FRAMES[0]).encode() + b"\n" + data)
    assert len(read_messages(path)) <= 1


# Off the air


def test_the_mixed_hour_of_six_satellites(reference_data: Path) -> None:
    """3600 messages of L1 for each, 17,938 of L5 left out, none taken for damage."""
    found = read_messages(reference_data / "data/msas_kamakura_2025046/046m_sbas.txt.gz")
    assert found.prns == (122, 130, 134, 137, 143, 144)
    assert {int(np.count_nonzero(found.prn == prn)) for prn in found.prns} == {3600}
    assert {why for _, why in found.left_out} == {"l5"}
    assert sum(found.left_out.values()) == 17938
    assert found.bad_time_s.size == 0
    assert set(np.unique(found.kind).tolist()) <= set(range(29)) | {62, 63}


@pytest.mark.parametrize(
    ("name", "prn", "count"),
    [
        ("msas_kamakura_2025046/msas137_2025046.ems", 137, 10800),
        ("waas_2020001/waas131_2020001.ems", 131, 4200),
        ("waas_2020001/geo131_2086_2_23_55_4200.txt.gz", 131, 4200),
    ],
)
def test_sets_off_the_air_are_whole(reference_data: Path, name: str, prn: int, count: int) -> None:
    found = read_messages(reference_data / "data" / name, prn=prn)
    assert len(found) == count
    assert set(np.diff(found.time_s).tolist()) == {1}
    assert not found.left_out
    assert found.crc_checked.all()


def test_the_same_messages_in_three_forms(reference_data: Path) -> None:
    folder = reference_data / "data/msas_vehicle_2008147"
    one, other = (read_messages(folder / f"msas_129.{kind}", prn=129) for kind in ("ems", "sbs"))
    np.testing.assert_array_equal(one.time_s, other.time_s)
    np.testing.assert_array_equal(
        np.unpackbits(one.frame, axis=1)[:, :226], np.unpackbits(other.frame, axis=1)[:, :226]
    )


def test_frames_of_a_receivers_log(reference_data: Path) -> None:
    """u-blox X20P: 30 frames each of EGNOS 121, 123, 136 and GAGAN 127; every CRC is right."""
    found = read_messages(reference_data / "data/egnos_x20p_2026065/ublox-x20p.log")
    assert found.prns == (121, 123, 127, 136)
    assert {why for _, why in found.left_out} <= {"repeated", "contradicting"}
    text = (reference_data / "data/egnos_x20p_2026065/sbas_frames.txt").read_text().split("\n")
    wanted = {(int(f[0]), f[4]) for f in map(str.split, text) if len(f) == 5 and f[0] != "#"}
    have = {
        (int(p), frame.tobytes().hex().upper())
        for p, frame in zip(found.prn, found.frame, strict=True)
    }
    assert have <= wanted
