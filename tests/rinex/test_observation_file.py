"""Observation files as they should be, and as they come."""

from __future__ import annotations

import datetime as dt
import gzip
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.rinex.observation_file import read_observations
from sbas.rinex.observations import Observations
from tests.rinex.rinex_samples import (
    CODES,
    START,
    Epoch,
    code_lines,
    epoch_3,
    epoch_line,
    header_3,
    line,
    ranges,
    small_file,
)


def read(folder: Path, text: str | bytes, **options: object) -> Observations:
    path = folder / "a.rnx"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("latin-1"))
    return read_observations(path, **options)  # type: ignore[arg-type]


def codes_of(found: Observations) -> list[str]:
    return [f"{f.code} {f.severity}" for f in found.findings]


def assert_epochs(found: Observations, numbers: list[int]) -> None:
    """The epochs are those numbers of `ranges`, whole and right."""
    expected = [ranges(k) for k in numbers]
    gps, geo = found.systems["G"], found.systems["S"]
    times = [np.datetime64(t, "ns") for t, _ in expected]
    assert gps.time.tolist() == [t.item() for t in times] == geo.time.tolist()
    for system in (gps, geo):
        for column, name in enumerate(system.satellites):
            for row, (_, satellites) in enumerate(expected):
                for code, (value, lock, strength) in zip(CODES["G"], satellites[name], strict=True):
                    assert system.values[code][row, column] == value
                    assert system.loss_of_lock[code][row, column] == int(lock or -1)
                    assert system.strength[code][row, column] == int(strength)


def test_a_small_file(tmp_path: Path) -> None:
    found = read(tmp_path, small_file())
    assert found.systems["G"].satellites == ("G05", "G12")
    assert found.systems["S"].satellites == ("S36",)
    assert_epochs(found, [0, 1, 2, 3, 4])
    assert not found.findings


cell_values = st.tuples(
    st.one_of(
        st.none(), st.integers(-(10**12) + 1, 10**13 - 1).filter(bool).map(lambda n: n / 1000)
    ),
    st.sampled_from(["", *"01234567"]),
    st.sampled_from(["", *"123456789"]),
)


@st.composite
def files(draw: st.DrawFn) -> tuple[list[Epoch], bool]:
    names = draw(st.lists(st.sampled_from(["G01", "G07", "G32", "S20", "S58"]), min_size=1,
                          unique=True))  # fmt: skip
    epochs: list[Epoch] = []
    for k in range(draw(st.integers(1, 4))):
        present = [n for n in names if draw(st.booleans())]
        cells = {n: [draw(cell_values) for _ in range(4)] for n in present}
        epochs.append((START + dt.timedelta(seconds=30 * k), cells))
    return epochs, draw(st.booleans())


@given(sample=files())
def test_values_marks_and_blanks_are_what_was_written(
    tmp_path_factory: pytest.TempPathFactory, sample: tuple[list[Epoch], bool]
) -> None:
    epochs, trim = sample
    text = header_3(CODES) + "".join(epoch_3(e, trim=trim) for e in epochs)
    found = read(tmp_path_factory.getbasetemp(), text)
    seen = {name for s in found.systems.values() for name in s.satellites}
    assert seen == {name for _, cells in epochs for name in cells}
    for letter, system in found.systems.items():
        for i, code in enumerate(CODES[letter]):
            for column, name in enumerate(system.satellites):
                for row, (_, cells) in enumerate(epochs):
                    value, lock, strength = cells.get(name, [(None, "", "")] * 4)[i]
                    got = system.values[code][row, column]
                    assert np.isnan(got) if value is None else got == value
                    assert system.loss_of_lock[code][row, column] == int(lock or -1)
                    assert system.strength[code][row, column] == int(strength or -1)


def test_a_file_cut_at_any_byte_keeps_every_whole_epoch(tmp_path: Path) -> None:
    whole = small_file(8)
    starts = [i for i in range(len(whole)) if whole[i : i + 2] == "> "] + [len(whole)]
    first_end = starts[1]
    for size in range(len(whole) - 1, first_end - 2, -1):
        found = read(tmp_path, whole[:size])
        # A last line of full width is whole without its line end.
        complete = sum(s <= size + 1 for s in starts[1:])
        assert_epochs(found, list(range(complete)))
        between = size in starts or size + 1 in starts
        assert codes_of(found) == ([] if between else ["E10 warning"]), size
    for size in (first_end - 2, first_end // 2, 100, 81, 3):
        with pytest.raises(InputError):
            read(tmp_path, whole[:size])


@pytest.mark.parametrize("end", ["\r\n", "\n\n", "\n   \n"])
def test_line_ends_and_blank_lines(tmp_path: Path, end: str) -> None:
    head, body = small_file().split("END OF HEADER\n")
    found = read(tmp_path, head.replace("\n", "\r\n") + "END OF HEADER\n" + body.replace("\n", end))
    assert_epochs(found, [0, 1, 2, 3, 4])
    assert not found.findings


def test_a_tail_never_written_is_not_a_line(tmp_path: Path) -> None:
    for tail in (b"\0" * 5000, b"\x1a", b"\n\n"):
        found = read(tmp_path, small_file().encode() + tail)
        assert_epochs(found, [0, 1, 2, 3, 4])
        assert not found.findings


JUNK = {
    "no date": "> 9999 99 99 99 99 99.9999999  0  3\n",
    "letters": "> what is this\n",
    "day 31 of February": "> 2024 02 31 10 00  2.0000000  0  3\n",
    "a line too many": epoch_line(START + dt.timedelta(seconds=2), 2),
    "a line too few": epoch_line(START + dt.timedelta(seconds=2), 4),
    "zeros": "\0" * 35 + "\n",
    "no mark": " 2024 03 05 10 00  2.0000000  0  3\n",
    "flag 7": epoch_line(START + dt.timedelta(seconds=2), 3, 7),
}


@pytest.mark.parametrize("junk", JUNK.values(), ids=JUNK)
def test_a_junk_epoch_spoils_nothing_else(tmp_path: Path, junk: str) -> None:
    parts = [epoch_3(ranges(k)) for k in range(200)]
    parts[2] = junk + parts[2].split("\n", 1)[1]
    found = read(tmp_path, header_3(CODES) + "".join(parts))
    without_mark = not junk.startswith(">")
    kept = [k for k in range(200) if k != 2 and not (without_mark and k == 1)]
    assert_epochs(found, kept)
    assert codes_of(found) == ["E10 warning"]


def test_many_junk_epochs_are_an_error(tmp_path: Path) -> None:
    parts = [epoch_3(ranges(k)) for k in range(9)]
    parts[2] = parts[5] = "> what\n"
    found = read(tmp_path, header_3(CODES) + "".join(parts))
    assert codes_of(found) == ["E10 error"]


def test_bytes_changed_at_random_change_no_other_epoch(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    text = small_file(6).encode()
    begin = text.find(b">")
    starts = [i for i in range(len(text)) if text[i : i + 2] == b"> "] + [len(text)]
    for _ in range(150):
        at = int(rng.integers(begin, len(text)))
        damaged = bytearray(text)
        damaged[at] = int(rng.integers(0, 256))
        if damaged[at] in b"0123456789":
            continue  # another digit is another number
        found = read(tmp_path, bytes(damaged))
        hit = int(np.searchsorted(starts, at, side="right")) - 1
        times = found.systems["G"].time
        for k in range(6):
            row = np.flatnonzero(times == np.datetime64(ranges(k)[0], "ns"))
            if abs(k - hit) > 1:
                assert row.size == 1
            if row.size == 1 and k != hit:
                assert found.systems["G"].values["C1C"][row[0], 0] == ranges(k)[1]["G05"][0][0]


def test_event_records_are_passed_over(tmp_path: Path) -> None:
    k0, k1, k2 = (epoch_3(ranges(k)) for k in range(3))
    slips = epoch_3((ranges(1)[0], {"G05": [(3.0, "", ""), (None, "", "")]}), 6)
    text = (
        header_3(CODES) + k0
        + ">                              2  0\n"
        + ">                              4  4\n"
        + line("G05 12345678.123 is a comment of an event", "COMMENT")
        + line("> another one", "COMMENT") + code_lines("G", CODES["G"])
        + code_lines("S", CODES["S"])
        + k1
        + "> 2024 03 05 10 00  1.5000000  3  1\n" + line("OTHER", "MARKER NAME")
        + "> 2024 03 05 10 00  1.7000000  5  0\n"
        + slips + k2
    )  # fmt: skip
    found = read(tmp_path, text)
    assert_epochs(found, [0, 1, 2])
    assert codes_of(found) == ["E26 info"]
    assert "5 event records" in found.findings[0].message


def test_epochs_after_a_power_failure_are_epochs(tmp_path: Path) -> None:
    text = header_3(CODES) + epoch_3(ranges(0)) + epoch_3(ranges(1), 1)
    assert_epochs(read(tmp_path, text), [0, 1])


def test_codes_that_change_inside_the_file_are_refused(tmp_path: Path) -> None:
    event = ">                              4  1\n" + code_lines("G", ("L1C", "C1C", "D1C", "S1C"))
    with pytest.raises(InputError, match="codes change inside"):
        read(tmp_path, small_file() + event + epoch_3(ranges(9)))
    event = ">                              4  1\n" + line("G   10", "SYS / SCALE FACTOR")
    with pytest.raises(InputError, match="codes change inside"):
        read(tmp_path, small_file() + event + epoch_3(ranges(9)))


def test_a_second_header_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="second header"):
        read(tmp_path, small_file() + small_file())


def test_repeated_times(tmp_path: Path) -> None:
    same = read(tmp_path, small_file() + epoch_3(ranges(1)))
    assert_epochs(same, [0, 1, 2, 3, 4])
    assert "E05 warning" in codes_of(same)
    other = (ranges(1)[0], ranges(2)[1])
    found = read(tmp_path, small_file() + epoch_3(other))
    assert_epochs(found, [0, 1, 2, 3, 4])
    assert "E05 error" in codes_of(found)


def test_epochs_out_of_order_are_sorted_and_told(tmp_path: Path) -> None:
    text = header_3(CODES) + "".join(epoch_3(ranges(k)) for k in (3, 4, 0, 1, 2))
    found = read(tmp_path, text)
    assert_epochs(found, [0, 1, 2, 3, 4])
    assert codes_of(found) == ["E14 warning"]
    assert "1 times" in found.findings[0].message


@pytest.mark.parametrize(
    ("scale", "stamp", "gps"),
    [
        # UTC was 18 s behind GPS time in 2024 (IERS Bulletin C 52), BDT is 14 s behind.
        ("GLO", "> 2024 03 05 10 00  0.0000000", "2024-03-05T10:00:18"),
        ("BDT", "> 2024 03 05 10 00  0.0000000", "2024-03-05T10:00:14"),
        ("GAL", "> 2024 03 05 10 00  0.0000000", "2024-03-05T10:00:00"),
        ("QZS", "> 2024 03 05 10 00  0.1234567", "2024-03-05T10:00:00.123456700"),
        # The leap second at the end of 2016 (Bulletin C 52): 17 s before, 18 s after.
        ("GLO", "> 2016 12 31 23 59 59.0000000", "2017-01-01T00:00:16"),
        ("GLO", "> 2016 12 31 23 59 60.0000000", "2017-01-01T00:00:17"),
        ("GLO", "> 2017 01 01 00 00  0.0000000", "2017-01-01T00:00:18"),
        ("GPS", "> 2024 03 05 10 00 60.0000000", "2024-03-05T10:01:00"),
    ],
)
def test_times_are_gps_time(tmp_path: Path, scale: str, stamp: str, gps: str) -> None:
    body = epoch_3(ranges(0)).split("\n", 1)[1]
    found = read(tmp_path, header_3(CODES, scale=scale) + f"{stamp}  0  3\n" + body)
    assert found.systems["G"].time.tolist() == np.array([gps], "M8[ns]").tolist()


def test_versions_4(tmp_path: Path) -> None:
    for version in ("4.00", "4.01", "4.02"):
        text = small_file().replace("     3.05", f"     {version}", 1)
        found = read(tmp_path, text)
        assert_epochs(found, [0, 1, 2, 3, 4])
        assert found.header.version == float(version)


def test_zeros_are_missing_values(tmp_path: Path) -> None:
    # RINEX 3.05, table A3: missing observations are written as 0.0 or blanks.
    cells = [(0.0, "", ""), (-0.0, "", ""), (-1.5, "", ""), (None, "", "")]
    found = read(tmp_path, header_3(CODES) + epoch_3((START, {"G05": cells})))
    values = found.systems["G"].values
    assert np.isnan(values["C1C"][0, 0])
    assert np.isnan(values["L1C"][0, 0])
    assert values["D1C"][0, 0] == -1.5
    assert codes_of(found) == ["E07 info"]
    assert found.findings[0].message.startswith("2 values")


def test_scale_factors_are_divided_out(tmp_path: Path) -> None:
    extra = line("G  100   1 L1C", "SYS / SCALE FACTOR")
    found = read(tmp_path, header_3(CODES, extra=extra) + epoch_3(ranges(0)))
    first = ranges(0)[1]["G05"]
    values = found.systems["G"].values
    assert values["L1C"][0, 0] == (first[1][0] or 0) / 100
    assert values["C1C"][0, 0] == first[0][0]
    assert codes_of(found) == ["E26 info"]


def test_numbers_with_other_decimals_are_read_where_all_are_so(tmp_path: Path) -> None:
    text = small_file()
    head, body = text.split("END OF HEADER\n")
    rows = [
        t if t.startswith(">") else
        t[:3] + "".join(f"{float(t[a:a + 14]):14.2f}  " for a in range(3, len(t), 16))
        for t in body.splitlines()
    ]  # fmt: skip
    found = read(tmp_path, head + "END OF HEADER\n" + "\n".join(rows) + "\n")
    assert found.systems["G"].values["C1C"][0, 0] == round(ranges(0)[1]["G05"][0][0] or 0, 2)
    assert codes_of(found) == ["E26 info"]


@pytest.mark.parametrize("shift", [1, 2, -1, -2])
def test_a_shifted_line_gives_no_number(tmp_path: Path, shift: int) -> None:
    parts = [epoch_3(ranges(k), trim=False) for k in range(40)]
    rows = parts[20].split("\n")
    rows[1] = rows[1][:3] + ("7" * shift + rows[1][3:] if shift > 0 else rows[1][3 - shift :])
    parts[20] = "\n".join(rows)
    found = read(tmp_path, header_3(CODES) + "".join(parts))
    for values in found.systems["G"].values.values():
        assert np.isnan(values[20, 0])
        assert np.isfinite(np.delete(values[:, 0], 20)).all()
    assert codes_of(found)[0].startswith("E10")


def test_a_satellite_twice_in_an_epoch_is_left_out(tmp_path: Path) -> None:
    text = header_3(CODES) + epoch_3(ranges(0)) + epoch_3(ranges(1)).replace("G12", "G05")
    found = read(tmp_path, text)
    assert np.isnan(found.systems["G"].values["C1C"][1]).all()
    assert "2 lines" in found.findings[0].message
    assert codes_of(found) == ["E10 warning"]


def test_lines_of_no_known_system_are_counted(tmp_path: Path) -> None:
    for name in ("X05", "R05", "G  ", "G0x", "G00"):
        found = read(tmp_path, header_3(CODES) + epoch_3(ranges(0)).replace("G12", name))
        assert found.systems["G"].satellites == ("G05",)
        assert codes_of(found) == ["E10 warning"], name


def test_lines_before_the_first_epoch_are_counted(tmp_path: Path) -> None:
    found = read(tmp_path, small_file().replace("> 2024", "G09  2\n> 2024", 1))
    assert_epochs(found, [0, 1, 2, 3, 4])
    assert codes_of(found) == ["E24 warning"]


def test_wanted_systems_and_codes(tmp_path: Path) -> None:
    found = read(tmp_path, small_file(), systems="S", codes={"S1C", "C1C"})
    assert list(found.systems) == ["S"]
    assert set(found.systems["S"].values) == {"C1C", "S1C"}
    assert found.systems["S"].values["S1C"][0, 0] == ranges(0)[1]["S36"][3][0]
    assert read(tmp_path, small_file(), codes=[]).systems["G"].values == {}
    with pytest.raises(InputError, match="no satellite system"):
        read(tmp_path, small_file(), systems=["GPS"])


def test_a_file_that_unfolds_out_of_proportion_is_refused(tmp_path: Path) -> None:
    names = [f"C{i // 26}{chr(65 + i % 26)}" for i in range(260)]
    empty = "".join(epoch_line(START + dt.timedelta(milliseconds=k), 0) for k in range(20_000))
    every = {f"G{n:02d}": [(1.0, "", "")] for n in range(1, 100)}
    with pytest.raises(InputError, match="out of proportion") as caught:
        read(tmp_path, header_3({"G": names}) + epoch_3((START - dt.timedelta(1), every)) + empty)
    assert caught.value.code == "E21"


def test_a_line_longer_than_its_codes_is_cut_off(tmp_path: Path) -> None:
    text = small_file()
    rows = text.splitlines()
    rows = [r + " " * 40 + "9" * 5000 if r.startswith("G05") else r for r in rows]
    assert_epochs(read(tmp_path, "\n".join(rows) + "\n"), [0, 1, 2, 3, 4])


@pytest.mark.parametrize("text", ["", "no rinex\n", "\0" * 1000, header_3(CODES)[:-30],
                                  header_3(CODES), header_3(CODES) + "> junk\n"])  # fmt: skip
def test_files_without_an_epoch_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, text)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_observations(tmp_path / "none.rnx")
    with pytest.raises(InputError, match="no observation file"):
        read_observations([])


def test_compressed_files(tmp_path: Path) -> None:
    path = tmp_path / "a.rnx.gz"
    path.write_bytes(gzip.compress(small_file().encode()))
    assert_epochs(read_observations(path), [0, 1, 2, 3, 4])


def test_reading_loads_no_heavy_library() -> None:
    code = (
        "import sys, sbas.rinex.observation_file, sbas.rinex.navigation_file;"
        "print([m for m in ('georinex', 'xarray', 'hatanaka') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_day_of_five_systems(reference_data: Path) -> None:
    """Rows and codes as formats.md, section 11 counts them."""
    name = "CEBR00ESP_R_20182000000_01D_30S_MO.crx.gz"
    found = read_observations(reference_data / "data" / "rinex" / name)
    rows = {"G": (28820, 18), "R": (23764, 16), "E": (19260, 16), "C": (14962, 8), "S": (14378, 4)}
    for letter, (most, codes) in rows.items():
        system = found.systems[letter]
        assert system.time.size == 2880
        assert len(system.values) == codes
        present = np.any([np.isfinite(v) for v in system.values.values()], axis=0)
        assert int(present.sum()) == most
    assert [f.code for f in found.findings] == ["E07"]
