"""PEGASUS-style tables: columns, reference, decimals, damage."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs import text_input
from sbas.logs.programs import pegasus_csv
from sbas.recording import Recording
from sbas.truth import Trajectory

HEADER = (
    "RX_TOM;RX_WEEK;NSV_LOCK;NSV_USED;NS_LAT;NS_LON;NS_ALT;NS_VE;NS_VN;NS_VU;NS_HPL;NS_VPL;"
    "REF_LAT;REF_LON;REF_ALT"
)


def row(tow: float, hpl: str = "11.250", week: int = 2353) -> str:
    return (
        f"{tow:.3f};{week};10;8;50.0345;15.7712;289.8;3.0;4.0;-0.5;{hpl};18.500;"
        "50.0344;15.7713;288.3"
    )


def table_of(count: int) -> str:
    return "\n".join(
        [HEADER, *(row(561_662 + i, f"{11.25 + i % 5:.3f}") for i in range(count)), ""]
    )


def read(folder: Path, text: str | bytes, **options: object) -> Recording:
    path = folder / "flight.b10"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return pegasus_csv.read(path, **options)  # type: ignore[arg-type]


def codes(recording: Recording) -> list[tuple[str, str]]:
    return [(f.code, f.severity) for f in recording.meta.findings]


USUAL = [("E25", "warning"), ("E25", "info")]


def test_every_column(tmp_path: Path) -> None:
    recording = read(tmp_path, table_of(2))
    first = recording.table.iloc[0]
    expected = {
        "lat_deg": 50.0345, "lon_deg": 15.7712, "height_m": 289.8, "hpl_m": 11.25, "vpl_m": 18.5,
        "n_sv": 8, "n_sv_tracked": 10, "vel_e_mps": 3.0, "vel_n_mps": 4.0, "vel_u_mps": -0.5,
        "speed_mps": 5.0, "x_ref_lat_deg": 50.0344, "x_ref_lon_deg": 15.7713,
        "x_ref_height_m": 288.3,
    }  # fmt: skip
    assert {name: first[name] for name in expected} == expected
    # Week 2353 began on Sunday 2025-02-09: seconds 561662 are Saturday, 12:01:02.
    assert recording.time[0] == np.datetime64("2025-02-15T12:01:02")
    assert codes(recording) == USUAL
    assert recording.meta.pl.kind == "unknown"
    assert "seconds of the GPS week" in recording.meta.findings[0].message
    assert "561662 .. 561663" in recording.meta.findings[0].evidence


def test_the_reference_serves_as_truth(tmp_path: Path) -> None:
    recording = read(tmp_path, table_of(5))
    table = pegasus_csv.reference_trajectory(recording)
    assert list(table.columns) == ["lat_deg", "lon_deg", "height_m"]
    truth = Trajectory(table).at(recording.time)
    assert truth.lat_deg == pytest.approx([50.0344] * 5, abs=1e-12)
    assert truth.height_m == pytest.approx([288.3] * 5, abs=1e-6)
    assert "reference_trajectory" in recording.meta.findings[-1].cure


def test_a_reference_with_holes_and_repetitions(tmp_path: Path) -> None:
    lines = [HEADER, row(10), row(12), row(12), row(11), row(13).replace("288.3", ""), row(14), ""]
    lines[6] = lines[6].replace("50.0344;15.7713", "0;0")
    recording = read(tmp_path, "\n".join(lines))
    table = pegasus_csv.reference_trajectory(recording)
    assert len(recording) == 6
    assert (table.index.to_numpy().astype("M8[s]").astype(int) % 60).tolist() == [10, 12]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [("50.0344;15.7713", "0.8733;0.2753", "radians"), ("50.0344", "5002.064", "not on Earth")],
)
def test_a_reference_that_is_no_position(tmp_path: Path, old: str, new: str, message: str) -> None:
    recording = read(tmp_path, table_of(3).replace(old, new))
    with pytest.raises(InputError, match=message):
        pegasus_csv.reference_trajectory(recording)


def test_no_reference(tmp_path: Path) -> None:
    recording = read(tmp_path, "RX_WEEK;RX_TOM;NS_HPL\n2353;10;11.5\n")
    assert codes(recording) == [("E25", "warning")]
    with pytest.raises(InputError, match="no reference"):
        pegasus_csv.reference_trajectory(recording)


def test_other_order_case_and_further_columns(tmp_path: Path) -> None:
    text = "ns_hpl;RX_WEEK;Comment;RX_TOM;TEMP\n11.5;2353;a b;10;21.5\n12.5;2353;;11;22\n"
    recording = read(tmp_path, text)
    assert recording.table["hpl_m"].tolist() == [11.5, 12.5]
    assert recording.table["x_temp"].tolist() == [21.5, 22.0]
    assert recording.table["x_comment"].tolist() == ["a b", ""]


def test_decimal_commas(tmp_path: Path) -> None:
    recording = read(tmp_path, table_of(3).replace(".", ","))
    pd.testing.assert_frame_equal(recording.table, read(tmp_path, table_of(3)).table)
    assert ("E20", "warning") in codes(recording)
    mixed = table_of(3).replace(".", ",") + row(561_670) + "\n"
    with pytest.raises(InputError, match="decimal comma and decimal point") as caught:
        read(tmp_path, mixed)
    assert caught.value.code == "E20"


def test_missing_values_and_words(tmp_path: Path) -> None:
    text = "\n".join([HEADER, row(10, ""), row(11, "NaN"), row(12, "12.0"), ""])
    recording = read(tmp_path, text)
    assert recording.table["hpl_m"].isna().tolist() == [True, True, False]
    assert ("E07", "warning") in codes(recording)


def test_sentinels(tmp_path: Path) -> None:
    text = "\n".join([HEADER, row(10, "65535"), row(11, "0"), ""])
    recording = read(tmp_path, text)
    assert recording.table["hpl_m"].tolist()[1] == 0  # for the input check: E13, not missing
    assert np.isnan(recording.table["hpl_m"].iloc[0])


def test_bad_lines_are_counted(tmp_path: Path) -> None:
    good = table_of(300)
    bad = good + row(561_970).replace(";8;", ";") + "\n" + row(700_000) + "\n"
    recording = read(tmp_path, bad)
    assert len(recording) == 300
    found = recording.meta.findings[0]
    assert (found.code, found.severity) == ("E10", "warning")
    assert found.message.startswith("2 of 302 lines")
    recording = read(tmp_path, good + "x" + row(561_971, "1l.5") + "\n")
    assert ("E10", "warning") in codes(recording)


def test_an_unreadable_field_is_missing(tmp_path: Path) -> None:
    recording = read(tmp_path, "\n".join([HEADER, row(10, "1l.5"), row(11), ""]))
    assert recording.table["hpl_m"].isna().tolist() == [True, False]
    assert ("E10", "error") in codes(recording)


def test_the_last_line_without_end(tmp_path: Path) -> None:
    recording = read(tmp_path, table_of(300).rstrip("\n")[:-2])
    assert len(recording) == 299
    assert ("E10", "warning") in codes(recording)


def test_times_stay_in_file_order(tmp_path: Path) -> None:
    recording = read(tmp_path, "\n".join([HEADER, row(12), row(10), row(12), ""]))
    assert (recording.time.astype("M8[s]").astype(int) % 60).tolist() == [12, 10, 12]


def test_a_repeated_header_is_no_line(tmp_path: Path) -> None:
    recording = read(tmp_path, table_of(3) + "\n".join([HEADER, row(561_670), ""]))
    assert len(recording) == 4
    assert codes(recording) == USUAL


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEADER + "\n", "has no line"),
        (HEADER + "\n" + row(700_000) + "\n", "readable time"),
        ("RX_TOM;NS_HPL\n1;2\n", "no RX_TOM or no RX_WEEK"),
        ("RX_TOM;RX_WEEK;RX_WEEK\n1;2;3\n", "two columns"),
        ("", "no RX_TOM or no RX_WEEK"),
    ],
)
def test_refusals(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(tmp_path, text)


def test_the_size_of_blocks_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = read(tmp_path, table_of(200))
    monkeypatch.setattr(text_input, "BLOCK_BYTES", 1_003)
    pieces = read(tmp_path, table_of(200))
    pd.testing.assert_frame_equal(pieces.table, whole.table)
    assert pieces.meta == whole.meta


def test_a_file_cut_anywhere_gives_rows_of_the_whole_one(tmp_path: Path) -> None:
    text = table_of(6)
    whole = read(tmp_path, text).table
    for at in range(1, len(text), 5):
        with contextlib.suppress(InputError):
            cut = read(tmp_path, text[:at]).table
            pd.testing.assert_frame_equal(cut, whole.loc[cut.index])


@given(
    st.lists(
        st.tuples(
            st.floats(0, 604_799.9),
            st.floats(-90, 90).filter(lambda v: abs(v) > 1e-6),
            st.floats(-180, 180),
            st.floats(0.1, 600),
        ),
        min_size=1,
        max_size=20,
    )
)
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, float, float, float]]
) -> None:
    lines = [f"{t:.9f};2353;{lat!r};{lon!r};{hpl!r}" for t, lat, lon, hpl in rows]
    text = "\n".join(["RX_TOM;RX_WEEK;NS_LAT;NS_LON;NS_HPL", *lines, ""])
    table = read(tmp_path_factory.getbasetemp(), text).table
    assert table["lat_deg"].tolist() == [r[1] for r in rows]
    assert table["lon_deg"].tolist() == [r[2] for r in rows]
    assert table["hpl_m"].tolist() == [r[3] for r in rows]


def test_sniff() -> None:
    assert pegasus_csv.sniff(table_of(2).encode(), b"", b"", Path("x")).score == 90
    bom = b"\xef\xbb\xbf" + table_of(2).encode()
    assert pegasus_csv.sniff(bom, b"", b"", Path("x")).score == 90
    for other in (b"", b"time;lat;lon\n", b"\xff\xfe\x00", HEADER[7:].encode()):
        assert pegasus_csv.sniff(other, b"", b"", Path("x")).score == 0
