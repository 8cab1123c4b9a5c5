"""Delimited text: headers, units, times, sentinels, decimals, damage."""

from __future__ import annotations

import contextlib
import math
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs.delimited import delimited_text
from sbas.logs.epoch_spool import SpooledEpochs
from sbas.recording import MODES, EpochSource, Flag, Recording

T = "2025-05-23 14:09:1"


def read(folder: Path, text: str | bytes, **options: object) -> Recording:
    path = folder / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return delimited_text.read(path, **options)  # type: ignore[arg-type]


def codes(recording: Recording) -> list[tuple[str, str]]:
    """Codes and severities, but of the missing level, which most tables here are without."""
    return [
        (f.code, f.severity)
        for f in recording.meta.findings
        if not f.message.startswith("no column was taken for HPL")
    ]


def one(folder: Path, header: str, value: str, **options: object) -> pd.Series:
    recording = read(folder, f"time,{header}\n{T}6,{value}\n", **options)
    return recording.table.drop(columns="flags", errors="ignore").iloc[:, 0]


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_delimiters(tmp_path: Path, delimiter: str) -> None:
    text = f"time,lat,lon,height,HPL,n_sat\n{T}6,50.5,15.25,289.5,11.5,9\n{T}7,50.6,15.35,,12.5,8\n"
    recording = read(tmp_path, text.replace(",", delimiter))
    table = recording.table
    assert table.index.to_numpy().astype("M8[s]").astype(str).tolist() == [
        "2025-05-23T14:09:16", "2025-05-23T14:09:17",
    ]  # fmt: skip
    assert table["lat_deg"].tolist() == [50.5, 50.6]
    assert table["n_sv"].tolist() == [9, 8]
    assert table["height_m"].isna().tolist() == [False, True]
    assert recording.meta.findings == ()
    assert recording.meta.time_scale == "GPST"
    assert "lat_deg <- lat" in recording.meta.options["columns"]


def test_blanks_and_comments(tmp_path: Path) -> None:
    text = f"# receiver 1\n# date time  lat   lon\n{T}6   50.5  15.2\n# note\n  {T}7  50.6 15.3 \n"
    table = read(tmp_path, text).table
    assert table["lat_deg"].tolist() == [50.5, 50.6]
    assert len(table) == 2


@pytest.mark.parametrize(
    ("header", "value", "name", "expected"),
    [
        ("HPL [m]", "11.5", "hpl_m", 11.5),
        ("hpl_mm", "11500", "hpl_m", 11.5),
        ("HPL-SBAS(km)", "0.0115", "hpl_m", 11.5),
        ("VPL (cm)", "1550", "vpl_m", 15.5),
        ("lat(deg)", "50.5", "lat_deg", 50.5),
        ("Latitude [rad]", repr(math.radians(50.5)), "lat_deg", 50.5),
        ("lng", "15.5", "lon_deg", 15.5),
        ("h_ell", "289.5", "height_m", 289.5),
        ("h_mm", "289500", "height_m", 289.5),
        ("sdn", "1.5", "sigma_n_m", 1.5),
        ("SDE [mm]", "1500", "sigma_e_m", 1.5),
        ("num SV", "9", "n_sv", 9),
        ("speed [km/h]", "36", "speed_mps", 10.0),
        ("cov_en_m2", "-0.5", "cov_en_m2", -0.5),
        ("geo_prn", "123", "geo_prn", 123),
        ("Correction_Age [ms]", "2780", "correction_age_s", 2.78),
        ("x_lat", "3", "x_lat", 3.0),
        ("C/N0 mean", "44.5", "x_C_N0_mean", 44.5),
        ("comment", "tunnel", "x_comment", "tunnel"),
    ],
)
def test_headers_and_units(
    tmp_path: Path, header: str, value: str, name: str, expected: object
) -> None:
    series = one(tmp_path, header, value)
    assert series.name == name
    found = series.iloc[0]
    assert found == (
        pytest.approx(expected, rel=1e-15) if isinstance(expected, float) else expected
    )


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("time,lat,latitude", "two columns mean lat_deg"),
        ("time,utc,lat", "two columns mean time"),
        ("time,week,tow", "two columns say the time"),
        ("time,lat [ft],lon", "unit"),
        ("time,hpl [deg],lon", "unit"),
        ("time [s],lat,lon", "unit"),
        ("date,lat,lon", "no column gives the time"),
        ("tow,lat,lon", "no column gives the time"),
        ("a,b,c", "no column gives the time"),
    ],
)
def test_ambiguous_headers_are_refused(tmp_path: Path, header: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, f"{header}\n{T}6,1,2\n")
    assert caught.value.cure


def test_both_heights_the_ellipsoidal_one_serves(tmp_path: Path) -> None:
    table = read(tmp_path, f"time,height,altitude\n{T}6,289.5,245.0\n").table
    assert table["height_m"].tolist() == [289.5]
    assert table["x_altitude"].tolist() == [245.0]


@pytest.mark.parametrize(
    ("header", "stamps", "expected", "scale"),
    [
        ("time", "2009-09-19 00:00:00", "2009-09-19T00:00:00", "GPST"),
        ("GPST", "2009-09-19T00:00:00.25", "2009-09-19T00:00:00.25", "GPST"),
        ("utc", "2009-09-18 23:59:45", "2009-09-19T00:00:00", "UTC"),
        ("time", "2009-09-18T23:59:45Z", "2009-09-19T00:00:00", "UTC"),
        ("Time (UTC)", "2009-09-18 23:59:45", "2009-09-19T00:00:00", "UTC"),
        ("timestamp", "2009-09-19T01:59:45+02:00", "2009-09-19T00:00:00", "UTC"),
        ("utc", "2016-12-31 23:59:60", "2017-01-01T00:00:17", "UTC"),
        ("date,time", "2009-09-19,00:00:00.5", "2009-09-19T00:00:00.5", "GPST"),
        ("date,utc", "2009/09/18,23:59:45", "2009-09-19T00:00:00", "UTC"),
        ("week,tow", "1549,518400.000000001", "2009-09-19T00:00:00.000000001", "GPST"),
        ("week,SOW [ms]", "1549,518400250", "2009-09-19T00:00:00.25", "GPST"),
    ],
)
def test_times(tmp_path: Path, header: str, stamps: str, expected: str, scale: str) -> None:
    recording = read(tmp_path, f"{header},lat\n{stamps},50.5\n")
    assert recording.time.astype(str).tolist() == [str(np.datetime64(expected, "ns"))]
    assert recording.meta.time_scale == scale
    assert codes(recording) == ([] if scale == "GPST" else [("E25", "info")])


def test_time_scale_as_asked(tmp_path: Path) -> None:
    text = f"time,lat\n{T}6,50.5\n"
    assert str(read(tmp_path, text, time_scale="UTC").time[0])[:19] == "2025-05-23T14:09:34"
    assert str(read(tmp_path, text, time_scale="BDT").time[0])[:19] == "2025-05-23T14:09:30"
    with pytest.raises(InputError, match="zone"):
        read(tmp_path, text.replace("6,", "6Z,"), time_scale="GPST")
    with pytest.raises(InputError, match="some times name a zone"):
        read(tmp_path, text + f"{T}7Z,50.5\n")


@pytest.mark.parametrize("stamp", ["518400.0", "1747999999", "14:09:16", "23.05.2025 14:09:16"])
def test_times_without_origin_or_order_are_refused(tmp_path: Path, stamp: str) -> None:
    with pytest.raises(InputError, match="no line has a readable time") as caught:
        read(tmp_path, f"time,lat\n{stamp},50.5\n")
    assert "week" in caught.value.cure
    assert stamp in caught.value.evidence


def test_modes_need_a_map(tmp_path: Path) -> None:
    text = f"time,fix\n{T}6,3\n{T}7,1\n{T}8,\n"
    with pytest.raises(InputError, match="not known") as caught:
        read(tmp_path, text)
    assert caught.value.cure.startswith("--mode-map 1=MODE,3=MODE with one of none, standalone")
    words = f"time,fix\n{T}6,PA\n{T}7,NPA\n{T}8,sbas_npa\n"
    with pytest.raises(InputError, match="not known") as caught:
        read(tmp_path, words)
    assert caught.value.cure.startswith("--mode-map NPA=sbas_npa,PA=sbas_pa; modes are")
    # What the cure names is enough: documented names stay known beside it.
    table = read(tmp_path, words, mode_map={"NPA": "sbas_npa", "PA": "sbas_pa"}).table
    assert table["mode"].tolist() == ["sbas_pa", "sbas_npa", "sbas_npa"]
    with pytest.raises(InputError, match="not known") as caught:
        read(tmp_path, f"{words}{T}9,no idea\n", mode_map={"NPA": "sbas_npa", "PA": "sbas_pa"})
    assert "--mode-map 'NPA=sbas_npa,PA=sbas_pa,no idea=MODE'" in caught.value.cure
    table = read(tmp_path, text, mode_map={"3": "sbas", 1: "standalone"}).table
    assert table["mode"].astype(object).tolist()[:2] == ["sbas", "standalone"]
    assert table["mode"].isna().tolist() == [False, False, True]
    with pytest.raises(InputError, match="unknown modes"):
        read(tmp_path, text, mode_map={"3": "SBAS", "1": "none"})
    assert one(tmp_path, "mode", "sbas_pa").tolist() == ["sbas_pa"]


def test_altitudes_need_the_undulation(tmp_path: Path) -> None:
    text = f"time,alt\n{T}6,245.0\n"
    without = read(tmp_path, text)
    assert without.table["height_m"].isna().all()
    assert codes(without) == [("E25", "warning")]
    assert read(tmp_path, text, geoid=44.5).table["height_m"].tolist() == [289.5]
    assert codes(read(tmp_path, text, geoid=44.5)) == [("E25", "info")]
    assert codes(read(tmp_path, f"time,h\n{T}6,245.0\n", geoid=44.5)) == [("E25", "warning")]


@pytest.mark.parametrize(
    ("header", "value", "column", "flag"),
    [
        ("hpl", "-2e10", "hpl_m", Flag.PL_SENTINEL),
        ("hpl", "4294967295", "hpl_m", Flag.PL_SENTINEL),
        ("hpl_mm", "4294967295", "hpl_m", Flag.PL_SENTINEL),
        ("vpl", "655.35", "vpl_m", Flag.PL_SENTINEL),
        ("hpl", "inf", "hpl_m", Flag.PL_SENTINEL),
        ("lat_rad", "-2e10", "lat_deg", Flag.POSITION_SENTINEL),
        ("height", "-20000000000.0", "height_m", Flag.POSITION_SENTINEL),
        ("hdop", "99.99", "hdop", Flag(0)),
        ("vdop", "655.35", "vdop", Flag(0)),
        ("sdn", "65535", "sigma_n_m", Flag(0)),
    ],
)
def test_sentinels(tmp_path: Path, header: str, value: str, column: str, flag: Flag) -> None:
    recording = read(tmp_path, f"time,{header}\n{T}6,12.5\n{T}7,{value}\n")
    assert recording.table[column].isna().tolist() == [False, True]
    flags = recording.table.get("flags", pd.Series([0, 0])).tolist()
    assert flags == [0, flag]
    assert codes(recording) == [("E07", "warning")]
    assert f"{column}: 1 x" in recording.meta.findings[0].evidence


def test_paired_sentinels(tmp_path: Path) -> None:
    text = (
        "time,lat,lon,hpl,vpl,nsv\n"
        f"{T}5,0,0,8000,100,255\n{T}6,0,15.5,8000,90,9\n{T}7,50.5,0,20,100,65535\n"
    )
    table = read(tmp_path, text).table
    assert table["lat_deg"].isna().tolist() == [True, False, False]
    assert table["lon_deg"].isna().tolist() == [True, False, False]
    assert table["hpl_m"].isna().tolist() == [True, False, False]
    assert table["vpl_m"].isna().tolist() == [True, False, False]
    assert table["n_sv"].tolist() == [-1, 9, -1]
    only = read(tmp_path, text, columns=["hpl_m"]).table
    pd.testing.assert_frame_equal(only, table[["hpl_m"]])


def test_levels_of_zero_are_left_for_the_input_check(tmp_path: Path) -> None:
    recording = read(tmp_path, f"time,hpl\n{T}6,0\n{T}7,-1\n")
    assert recording.table["hpl_m"].tolist() == [0.0, -1.0]
    assert recording.meta.findings == ()


def test_a_height_of_655_35_m_is_a_height(tmp_path: Path) -> None:
    assert one(tmp_path, "height", "655.35").tolist() == [655.35]


def test_nan_words_and_unreadable_fields(tmp_path: Path) -> None:
    rows = "".join(f"2025-05-23 {h:02d}:{m:02d}:00,11.5\n" for h in range(20) for m in range(60))
    text = "time,hpl\n" + rows + f"2025-05-24 00:00:00,NaN\n2025-05-24 00:00:01,n/a\n{T}6,11;5\n"
    recording = read(tmp_path, text)
    assert recording.table["hpl_m"].isna().sum() == 3
    assert codes(recording) == [("E10", "warning"), ("E07", "warning")]
    assert "hpl_m 1" in recording.meta.findings[0].evidence
    assert "hpl_m: 2 x NaN" in recording.meta.findings[1].evidence
    fast = read(tmp_path, f"time,hpl\n{T}6,nan\n{T}7,\n{T}8,3.5\n")
    assert fast.table["hpl_m"].isna().tolist() == [True, True, False]
    assert "hpl_m: 1 x NaN" in fast.meta.findings[0].evidence


def test_counts_out_of_range_are_missing_and_flagged(tmp_path: Path) -> None:
    recording = read(tmp_path, f"time,nsat\n{T}6,8.5\n{T}7,40000\n{T}8,9.0\n")
    assert recording.table["n_sv"].tolist() == [-1, -1, 9]
    assert recording.table["flags"].tolist() == [Flag.OUT_OF_RANGE, Flag.OUT_OF_RANGE, 0]
    assert codes(recording) == [("E10", "warning")]


def test_decimal_commas(tmp_path: Path) -> None:
    german = read(tmp_path, f"Zeit;time;lat;HPL\nx;{T}6,25;50,5;11,5\n")
    assert german.table["lat_deg"].tolist() == [50.5]
    assert str(german.time[0]) == "2025-05-23T14:09:16.250000000"
    assert codes(german) == [("E20", "warning")]
    assert read(tmp_path, f"time\tlat\n{T}6\t50,5\n").table["lat_deg"].tolist() == [50.5]


@pytest.mark.parametrize(
    "text",
    [
        f"time;lat;hpl\n{T}6;50,5;11.5\n",
        f"time,lat,lon\n{T}6,50,5,15,25\n{T}7,50,6,15,35\n",
        "week tow lat\n1549 518400 50,5\n",
        f'time,lat\n{T}6,"50,5"\n',
    ],
)
def test_undecided_decimals_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match="E20"):
        read(tmp_path, text)


def test_short_and_long_lines_are_counted(tmp_path: Path) -> None:
    rows = [f"2025-05-23 {h:02d}:{m:02d}:00,50.5,11.5\n" for h in range(20) for m in range(60)]
    rows[10], rows[20] = rows[10][:24] + "\n", rows[20].replace("\n", ",7\n")
    rows[30] = "2025-05-23 00:61:00,50.5,11.5\n"
    recording = read(tmp_path, "time,lat,hpl\n" + "".join(rows))
    assert len(recording) == 1197
    assert codes(recording) == [("E10", "warning")]
    assert "3 of 1,200" in recording.meta.findings[0].message
    bad = read(tmp_path, "time,lat,hpl\n" + "".join(rows[25:60]))
    assert codes(bad) == [("E10", "error")]


def test_last_line_without_end_is_kept_only_if_it_looks_whole(tmp_path: Path) -> None:
    text = f"time,lat,hpl\n{T}6,50.5,11.25\n{T}7,50.6,12.75"
    assert read(tmp_path, text).table["hpl_m"].tolist() == [11.25, 12.75]
    assert read(tmp_path, text).meta.findings == ()
    for cut in range(1, 30):
        recording = read(tmp_path, text[:-cut])
        assert recording.table["hpl_m"].tolist() == [11.25]
        assert codes(recording) == [("E10", "error")]


def test_no_rows(tmp_path: Path) -> None:
    for text in ("time,lat\n", "time,lat", "\n\n", " "):
        with pytest.raises(InputError, match="E15"):
            read(tmp_path, text)
    with pytest.raises(InputError, match="no table"):
        read(tmp_path, "hello\nworld\n")


def test_table_written_by_pandas_comes_back(tmp_path: Path) -> None:
    index = pd.date_range("2025-05-23", periods=5, freq="250ms", name="time")
    table = pd.DataFrame(
        {
            "lat_deg": np.linspace(50, 51, 5) / 7,
            "hpl_m": [1.5, np.nan, 3.25, 4.125, 5.0],
            "n_sv": np.array([9, -1, 7, 6, 5], "i2"),
            "flags": np.array([0, 1, 2, 4, 8192], "u4"),
            "mode": pd.Categorical.from_codes([4, 4, -1, 2, 3], categories=list(MODES)),
            "environment": pd.Categorical(["open", "cutting", None, "open", "open"],
                                          categories=["open", "cutting"]),
            "hardware_fault": [False, True, False, False, True],
            "x_note": pd.array(["a", "b", "c, d", 'e "f"', "g"], dtype="str"),
        },
        index=pd.DatetimeIndex(index.to_numpy().astype("M8[ns]"), name="time"),
    )  # fmt: skip
    table.to_csv(tmp_path / "table.csv")
    back = delimited_text.read(tmp_path / "table.csv")
    pd.testing.assert_frame_equal(back.table, table, check_like=True)
    assert back.meta.findings == ()


def test_block_size_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = "".join(
        f"2025-05-23 {k // 3600:02d}:{k // 60 % 60:02d}:{k % 60:02d},{50 + k / 7},{k % 11}\n"
        for k in range(5000)
    )
    text = "time,lat,nsat\n" + rows
    whole = read(tmp_path, text)
    monkeypatch.setattr("sbas.logs.text_input.BLOCK_BYTES", 3000)
    pd.testing.assert_frame_equal(read(tmp_path, text).table, whole.table)


HEADERS = st.sampled_from(
    ["time,lat,lon,hpl\n", "utc;height;mode;n_sv\n", "week tow h_mm\n", "date\ttime\talt\n", ""]
)


@given(HEADERS, st.one_of(st.binary(max_size=300), st.text(
    "0123456789-: .,;\t\n\"TZe+", max_size=300).map(str.encode)))  # fmt: skip
def test_any_bytes_give_a_recording_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, header: str, data: bytes
) -> None:
    folder = tmp_path_factory.mktemp("fuzz")
    head = data[: 1 << 16]
    match = delimited_text.sniff(header.encode() + head, head, head[-4096:], folder)
    assert 0 <= match.score <= 100
    try:
        recording = read(folder, header.encode() + data)
    except InputError:
        return
    assert len(recording) > 0


HEADER = "time,lat,lon,hpl,vpl\n"
FIRST = f"{T}1,50.5,15.5,11.5,20.5\n{T}2,50.5,15.5,11.5,20.5\n"


@pytest.mark.parametrize(
    "later",
    [
        "time,lat,lon,vpl,hpl\n",
        "utc,lat,lon,hpl,vpl\n",
        "time,lat,lon,hpl [km],vpl\n",
        "time,lat,lon,hpl\n",
        "time;lat;lon;hpl;vpl\n",
        "# time,lat,lon,vpl,hpl\n",
        '"time","lat","lon","vpl","hpl"\n',
        "\ufefftime,lat,lon,vpl,hpl\n",
    ],
)
@pytest.mark.parametrize("columns", [None, ["hpl_m"]])
def test_joined_files_of_two_layouts_are_refused(
    tmp_path: Path, later: str, columns: list[str] | None
) -> None:
    with pytest.raises(InputError, match="two layouts") as caught:
        read(tmp_path, HEADER + FIRST + later + f"{T}3,50.5,15.5,33.5,44.5\n", columns=columns)
    assert caught.value.code == "E06"


@pytest.mark.parametrize("header", [HEADER, "week,tow,lat,hpl\n", "# " + HEADER])
def test_the_header_once_more_is_left_out_and_counted(tmp_path: Path, header: str) -> None:
    rows = FIRST if "week" not in header else "1549,1.5,50.5,11.5\n1549,2.5,50.5,11.5\n"
    last = rows.replace(f"{T}1", f"{T}3").replace(f"{T}2", f"{T}4")
    recording = read(tmp_path, header + rows + header + last)
    assert recording.table["hpl_m"].tolist() == [11.5] * 4
    assert codes(recording) == [("E26", "info")]
    assert recording.meta.findings[0].evidence == "1 times"


def test_a_text_column_that_speaks_of_time_is_no_header(tmp_path: Path) -> None:
    rows = f"{T}1,50.5,time out\n{T}2,50.5,UTC\n{T}x,50.5,time\n"
    recording = read(tmp_path, "time,lat,comment\n" + rows)
    assert len(recording) == 2
    assert codes(recording) == [("E10", "error")]


@pytest.mark.parametrize(
    ("header", "units", "hpl", "first"),
    [
        (HEADER, "-,deg,deg,km,m", 11500.0, "2025-05-23T14:09:11"),
        (HEADER, "# -,deg,deg,km,m", 11500.0, "2025-05-23T14:09:11"),
        (HEADER, "[UTC],[deg],[deg],[mm],[m]", 0.0115, "2025-05-23T14:09:29"),
        (HEADER, "yyyy-mm-dd hh:mm:ss,deg,deg,cm,-", 0.115, "2025-05-23T14:09:11"),
        (HEADER.replace("hpl", "hpl_km"), ",,,km,m", 11500.0, "2025-05-23T14:09:11"),
        (HEADER.replace("hpl", "hpl [km]"), ",,,,m", 11500.0, "2025-05-23T14:09:11"),
    ],
)
def test_a_line_of_units_below_the_header_is_used(
    tmp_path: Path, header: str, units: str, hpl: float, first: str
) -> None:
    recording = read(tmp_path, header + units + "\n" + FIRST)
    assert recording.table["hpl_m"].tolist() == pytest.approx([hpl] * 2, rel=1e-15)
    assert str(recording.time[0])[:19] == first
    assert ("E26", "info") in codes(recording)
    both = read(tmp_path, header + units + "\n" + FIRST + header + units + "\n" + FIRST)
    assert both.table["hpl_m"].tolist() == pytest.approx([hpl] * 4, rel=1e-15)


@pytest.mark.parametrize("units", ["-,deg,deg,ft,m", "-,m,deg,m,m", "x,Breite,Laenge,HPL,VPL"])
def test_a_line_of_other_units_is_refused(tmp_path: Path, units: str) -> None:
    with pytest.raises(InputError, match="unit") as caught:
        read(tmp_path, HEADER + units + "\n" + FIRST)
    assert "line 2" in caught.value.where
    with pytest.raises(InputError, match="two units"):
        read(tmp_path, HEADER.replace("hpl", "hpl [m]") + "-,deg,deg,km,m\n" + FIRST)


def test_a_second_line_of_other_units_is_refused(tmp_path: Path) -> None:
    first, second = "-,deg,deg,m,m\n", "-,deg,deg,km,m\n"
    with pytest.raises(InputError, match="two layouts"):
        read(tmp_path, HEADER + first + FIRST + HEADER + second + FIRST)


@pytest.mark.parametrize(
    "text",
    [
        "1," * 32_000,
        "1," * 32_000 + "\n" + "1," * 32_000,
        "time,lat" + ",a" * 4000 + "\n",
        "time,lat" + "".join(f",c{i}" for i in range(300_000)) + "\n",
        "time,lat," + "a" * 3_000_000 + "\n" + f"{T}6,50.5,1\n",
        "time,lat," + "(" * 60_000 + "\n" + f"{T}6,50.5,1\n",
        "time,lat,lon\n" + f"{T}6,50.5,15.5\n" + "1," * 1_000_000 + f"\n{T}7,50.5,15.5\n",
    ],
)
def test_wide_tables_and_long_lines_end_at_once(tmp_path: Path, text: str) -> None:
    started = time.perf_counter()
    data = text.encode()
    delimited_text.sniff(data[: 1 << 16], data[: 1 << 16], data[-4096:], tmp_path)
    with contextlib.suppress(InputError):
        read(tmp_path, data)
        assert "((" in text  # a strange name alone is no reason to refuse
    assert time.perf_counter() - started < 3


def test_equal_names_are_kept_apart(tmp_path: Path) -> None:
    header = "time,lat,a,a,x_a,3,\n"
    table = read(tmp_path, header + f"{T}6,50.5,1,2,3,4,5\n").table
    assert table.iloc[0].tolist() == [50.5, 1, 2, 3, 4, 5]
    assert list(table)[1:4] == ["x_a", "x_a_", "x_a__"]


@pytest.mark.parametrize("late", ["11.5", "1.250", "1.250,5", "-.5"])
def test_a_point_far_down_among_decimal_commas_is_refused(tmp_path: Path, late: str) -> None:
    row = "2025-05-23 00:{:02d}:{:02d};50,5;{}\n"
    rows = "".join(row.format(k // 60, k % 60, "11,5") for k in range(300))
    with pytest.raises(InputError, match="decimal comma and decimal point") as caught:
        read(tmp_path, "time;lat;hpl\n" + rows + row.format(30, 0, late))
    assert caught.value.code == "E20"
    assert late in caught.value.evidence
    whole = "".join(row.format(k // 60, k % 60, "11") for k in range(60)).replace("50,5", "50")
    with pytest.raises(InputError, match="E20"):
        read(tmp_path, "time;lat;hpl\n" + whole + row.format(30, 0, "11,5"))


@pytest.mark.parametrize("value", ["-1", "4294967296", "1.5", "inf"])
def test_flags_that_are_no_bits_are_refused(tmp_path: Path, value: str) -> None:
    with pytest.raises(InputError, match="flags"):
        read(tmp_path, f"time,hpl,flags\n{T}6,11.5,8\n{T}7,11.5,{value}\n")
    table = read(tmp_path, f"time,hpl,flags\n{T}6,11.5,8\n{T}7,11.5,\n").table
    assert table["flags"].tolist() == [8, 0]


def test_a_table_without_levels_says_so(tmp_path: Path) -> None:
    text = f"time,lat,HPL 95%,Protection level\n{T}6,50.5,11.5,12.5\n"
    (finding,) = read(tmp_path, text).meta.findings
    assert (finding.code, finding.severity) == ("E25", "warning")
    assert finding.message.startswith("no column was taken for HPL")
    assert "'HPL 95%', 'Protection level'" in finding.evidence
    assert read(tmp_path, text.replace("HPL 95%", "HPL"), columns=["lat_deg"]).meta.findings == ()


def test_longitudes_of_0_to_360_are_wrapped_and_counted(tmp_path: Path) -> None:
    recording = read(tmp_path, f"time,lon\n{T}6,350.5\n{T}7,180\n{T}8,0\n")
    assert recording.table["lon_deg"].tolist() == [-9.5, 180.0, 0.0]
    assert codes(recording) == [("E26", "info")]
    assert recording.meta.findings[0].evidence.startswith("1 of 3")
    for rows in ("350.5\n{T}7,-9.5", "361\n{T}7,350"):  # no such convention: left for E08
        untouched = read(tmp_path, f"time,lon\n{T}6,{rows.format(T=T)}\n")
        assert codes(untouched) == []


def test_no_data_is_e15(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a header and no data") as caught:
        read(tmp_path, "time,lat\n")
    assert caught.value.code == "E15"
    assert not caught.value.what.startswith("E15")


def test_units_in_a_later_file_alone_are_refused(tmp_path: Path) -> None:
    for units in ("-,deg,deg,km,m\n", "# -,deg,deg,km,m\n"):
        with pytest.raises(InputError, match="two layouts"):
            read(tmp_path, HEADER + FIRST + HEADER + units + FIRST)
        with pytest.raises(InputError, match="two layouts"):
            read(tmp_path, HEADER + units + FIRST + HEADER + FIRST)


# Options of the caller


@pytest.mark.parametrize(
    ("text", "decimal", "hpl"),
    [
        (f"time;hpl\n{T}6;11,5\n", ",", [11.5]),
        ("week tow hpl\n1549 518400,25 11,5\n", ",", [11.5]),
        (f'time,hpl\n{T}6,"11,5"\n', ",", [11.5]),
        (f"time;hpl\n{T}6;11,5\n{T}7;12.5\n", ",", [11.5, math.nan]),
        (f"time;hpl\n{T}6;11,5\n{T}7;12.5\n", ".", [math.nan, 12.5]),
        (f"time;hpl\n{T}6;1.250\n{T}7;12,5\n", ",", [math.nan, 12.5]),  # 1250 or 1.25
    ],
)
def test_the_decimal_sign_as_asked(
    tmp_path: Path, text: str, decimal: str, hpl: list[float]
) -> None:
    recording = read(tmp_path, text, decimal=decimal)
    np.testing.assert_array_equal(recording.table["hpl_m"], hpl)
    expected = [("E10", "error")] if any(map(math.isnan, hpl)) else []
    assert codes(recording) == expected


def test_decimal_commas_between_commas_stay_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="E20"):
        read(tmp_path, f"time,lat,lon\n{T}6,50,5,15,25\n{T}7,50,6,15,35\n", decimal=",")
    with pytest.raises(InputError, match="decimal sign") as caught:
        read(tmp_path, f"time,lat\n{T}6,50.5\n", decimal="'")
    assert "--decimal ," in caught.value.cure


def test_a_lost_header_is_no_matter_of_decimals(tmp_path: Path) -> None:
    lines = f"5.50,15.25\n{T}6,50.5,15.25\n{T}7,50.6,15.35\n"
    with pytest.raises(InputError, match="E10: lines have another number of fields"):
        read(tmp_path, lines)


def test_undecided_decimals_name_the_option(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="E20") as caught:
        read(tmp_path, f"time;lat;hpl\n{T}6;50,5;11.5\n")
    assert "--decimal ," in caught.value.cure


def test_the_encoding_as_asked(tmp_path: Path) -> None:
    text = f"time,x_místo,hpl\n{T}6,Děčín,11.5\n"
    recording = read(tmp_path, text.encode("cp1250"), encoding="cp1250")
    assert recording.table["x_místo"].tolist() == ["Děčín"]
    assert codes(recording) == []
    assert codes(read(tmp_path, text.encode("cp1250")))[0] == ("E19", "warning")


def test_long_lines_as_asked(tmp_path: Path) -> None:
    text = f"time,hpl,x_note\n{T}6,11.5,{'a' * 100_000}\n"
    with pytest.raises(InputError, match="E18"):
        read(tmp_path, text)
    assert len(read(tmp_path, text, max_line=200_000)) == 1


# Long files: piece by piece as at once


def scan(folder: Path, text: str | bytes, **options: object) -> EpochSource:
    path = folder / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(delimited_text, "WHOLE_BYTES", 0)
        patch.setattr("sbas.logs.epoch_spool.PIECE_ROWS", 3)
        patch.setattr("sbas.logs.text_input.BLOCK_BYTES", 150)
        return delimited_text.scan(path, **options)  # type: ignore[arg-type]


def same(folder: Path, text: str | bytes, **options: object) -> None:
    """That a file says the same at once and piece by piece."""
    whole: Recording | InputError
    with pytest.MonkeyPatch.context() as patch:
        # Here too: the layout is told from the first block, which is never so small in fact.
        patch.setattr("sbas.logs.text_input.BLOCK_BYTES", 150)
        try:
            whole = read(folder, text, **options)
        except InputError as error:
            whole = error
    if isinstance(whole, InputError):
        with pytest.raises(InputError) as caught:
            scan(folder, text, **options)
        assert caught.value.code == whole.code
        return
    source = scan(folder, text, **options)
    assert isinstance(source, SpooledEpochs)
    assert source.columns == whole.columns
    assert source.meta == whole.meta
    pd.testing.assert_frame_equal(pd.concat(source.batches(source.columns)), whole.table)


CELLS = {
    "lat": ["50.5", "0", "", "-2e10", "x"],
    "lon": ["15.5", "0", "350.5", "-9.5", ""],
    "hpl": ["11.5", "65535", "8000", "inf", "nan", "1,5"],
    "vpl": ["20.5", "100", "655.35"],
    "alt": ["245.5", "nan", ""],
    "n_sv": ["9", "8.5", "255", "-1"],
    "mode": ["sbas", "rtk", ""],
    "environment": ["open", "cutting", "", "tunnel"],
    "hardware_fault": ["true", "0", ""],
    "note": ["1.5", "a", "", "NaN"],
    "flags": ["0", "8", ""],
}
STAMPS = ["2025-05-23 14:09:{:02d}", "2025-05-23 14:09:{:02d}Z", "2016-12-31 23:59:60", "x"]


@st.composite
def tables(draw: st.DrawFn) -> str:
    names = draw(st.lists(st.sampled_from(sorted(CELLS)), min_size=1, max_size=5, unique=True))
    common = {name: draw(st.sampled_from(CELLS[name])) for name in names}
    header = ",".join([draw(st.sampled_from(["time", "utc"])), *names])
    stamp = draw(st.sampled_from(STAMPS[:3]))
    lines = [header]
    for k in range(draw(st.integers(1, 25))):
        # Mostly like the line before, so that what is odd comes late.
        odd = draw(st.integers(0, 5)) == 0
        cells = [draw(st.sampled_from(CELLS[n])) if odd else common[n] for n in names]
        when = draw(st.sampled_from(STAMPS)) if odd and draw(st.booleans()) else stamp
        line = ",".join([when.format(k), *cells])
        lines.append(line[: draw(st.integers(1, len(line)))] if odd and k % 5 == 0 else line)
    return "\n".join(lines) + draw(st.sampled_from(["", "\n", "\n" + header + "\n"]))


@given(tables(), st.sampled_from([{}, {"geoid": 44.5}, {"time_scale": "UTC"}]))
def test_piece_by_piece_is_as_at_once(
    tmp_path_factory: pytest.TempPathFactory, text: str, options: dict[str, object]
) -> None:
    same(tmp_path_factory.mktemp("pieces"), text, **options)


@pytest.mark.parametrize(
    ("header", "row", "odd"),
    [
        ("lon", "350.5", "10.5"),
        ("lon", "10.5", "350.5"),  # the convention shows late
        ("lon", "350.5", "-10.5"),  # no such convention after all
        ("lat,lon", "50.5,350.5", "0,0"),
        ("note", "1.5", "b"),  # text after all
        ("note", "b", "1.5"),
        ("environment", "open", "cutting"),
        ("hpl", "11.5", "-2e10"),
        ("alt", "245.5", ""),
        ("hpl", "70000", "11.5"),
    ],
)
@pytest.mark.parametrize("at", [0, 5, 11])
def test_what_shows_late_counts_for_the_whole(
    tmp_path: Path, header: str, row: str, odd: str, at: int
) -> None:
    rows = [odd if k == at else row for k in range(12)]
    lines = [f"2025-05-23 14:09:{k:02d},{cells}\n" for k, cells in enumerate(rows)]
    same(tmp_path, f"time,{header}\n" + "".join(lines))
    same(tmp_path, f"time,{header}\n" + "".join(lines), columns=["lon_deg", "hpl_m"])


def test_stamps_with_a_zone_late_are_refused(tmp_path: Path) -> None:
    lines = [f"2025-05-23 14:09:{k:02d}{'Z' * (k == 11)},50.5\n" for k in range(12)]
    with pytest.raises(InputError, match="some times name a zone"):
        scan(tmp_path, "time,lat\n" + "".join(lines))


def test_a_short_file_is_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(f"time,lat\n{T}6,50.5\n")
    assert isinstance(delimited_text.scan(path), Recording)


def test_a_long_file_restricted_to_columns(tmp_path: Path) -> None:
    rows = "".join(f"2025-05-23 14:09:{k:02d},50.5,15.5,{k}.5\n" for k in range(20))
    source = scan(tmp_path, "time,lat,lon,hpl\n" + rows, columns=["hpl_m"])
    assert source.columns == ("hpl_m",)
    batches = list(source.batches(["hpl_m", "n_sv"]))
    assert len(batches) > 1
    assert pd.concat(batches)["hpl_m"].tolist() == [k + 0.5 for k in range(20)]


LEAP = ["2016-12-31 23:59:59", "2016-12-31 23:59:60", "2017-01-01 00:00:00"]


@pytest.mark.parametrize("header", ["time", "gpst"])
def test_a_leap_second_proves_utc(tmp_path: Path, header: str) -> None:
    text = f"{header},hpl\n" + "".join(f"{stamp},9.{i}\n" for i, stamp in enumerate(LEAP))
    found = next(f for f in read(tmp_path, text).meta.findings if f.code == "E02")
    assert (found.severity, found.cure) == ("error", "--time-scale UTC")
    assert found.evidence.startswith("1 times with a second 60")
    exact = read(tmp_path, text, time_scale="UTC")
    # GPST - UTC was 17 s before and is 18 s since (IERS Bulletin C 52).
    assert [str(t) for t in exact.table.index] == [
        f"2017-01-01 00:00:{second}" for second in (16, 17, 18)
    ]
    assert not any(f.code in ("E02", "E10") for f in exact.meta.findings)


def test_a_second_60_where_utc_has_none_proves_nothing(tmp_path: Path) -> None:
    recording = read(tmp_path, f"time,hpl\n{T}6,9.0\n{T[:-4]}09:60.0,9.1\n{T}7,9.2\n")
    assert len(recording.table) == 2
    found = {f.code: f for f in recording.meta.findings}
    assert "E02" not in found
    assert found["E10"].evidence == "a second 60, and the times are GPST"


def test_a_line_lost_to_nul_bytes_is_named_so(tmp_path: Path) -> None:
    path = tmp_path / "nul.csv"
    path.write_bytes(f"time,hpl\n{T}6,9.0\n{T}7,\0\0\0\n{T}8,9.2\n".encode())
    found = {f.code: f for f in delimited_text.read(path).meta.findings}
    assert found["E10"].evidence == "lines with NUL bytes"


def test_lines_that_do_not_fit_the_header_are_shown(tmp_path: Path) -> None:
    text = "time,lat,lon\n" + "".join(f"{T}{i},50.5,15.5\nstatus ok\n" for i in range(9))
    with pytest.raises(InputError, match="another number of fields") as caught:
        read(tmp_path, text)
    assert caught.value.evidence == (
        "9 of the first 18 lines; fields of the header 3, of line 3 1: status ok"
    )


@pytest.mark.parametrize(
    "names", [("lat_dir", "lon_dir"), ("ns", "ew"), ("N/S", "E/W"), ("lat_hem", "Longitude Ref")]
)
def test_letters_of_hemispheres_give_the_sign(tmp_path: Path, names: tuple[str, str]) -> None:
    text = f"time,lat,{names[0]},lon,{names[1]},hpl\n{T}6,33.5,S,70.25,W,9\n{T}7,33.6,n,70.5,E,9\n"
    recording = read(tmp_path, text)
    assert recording.table["lat_deg"].tolist() == [-33.5, 33.6]
    assert recording.table["lon_deg"].tolist() == [-70.25, 70.5]
    assert [f.evidence for f in recording.meta.findings if f.code == "E26"] == [
        "lat_deg N 1, lat_deg S 1, lon_deg E 1, lon_deg W 1"
    ]
    assert read(tmp_path, text, columns=["lat_deg"]).table["lat_deg"].tolist() == [-33.5, 33.6]


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("-33.5,S", "sign beside a letter"),
        ("-33.5,N", "sign beside a letter"),
        ("33.5,", "no letter"),
        ("33.5,E", "no letter"),
    ],
)
def test_letters_that_contradict_are_refused(tmp_path: Path, row: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, f"time,lat,lat_dir,lon\n{T}6,{row},15.5\n")
    assert "first -33.5" in caught.value.evidence or "first 33.5" in caught.value.evidence


def test_ns_alone_are_satellites(tmp_path: Path) -> None:
    assert one(tmp_path, "ns", "9").tolist() == [9]


@pytest.mark.parametrize(
    "names", ["x,y,z", "ecef_x,ecef_y,ecef_z", "X-ECEF (m),Y-ECEF (m),Z-ECEF (m)"]
)
def test_earth_fixed_coordinates_are_positions(tmp_path: Path, names: str) -> None:
    # Equator at 90 degrees east, the pole, 100 m up: semi-axes of WGS 84 (NIMA TR8350.2).
    rows = ["0,6378237,0", "0,0,6356852.3142", "0,0,0", "3950000.1,1115000.2,4865000.3"]
    text = f"time,{names},hpl\n" + "".join(
        f"{T}{6 + i % 4},{r},9\n" for i, r in enumerate(rows * 50)
    )
    recording = read(tmp_path, text)
    table = recording.table
    np.testing.assert_allclose(table["lat_deg"].iloc[:2], [0, 90], atol=1e-12)
    assert table["lon_deg"].iloc[0] == 90
    np.testing.assert_allclose(table["height_m"].iloc[:2], 100, atol=1e-4)
    assert table["lat_deg"].isna().tolist()[:4] == [False, False, True, False]
    assert [f.evidence for f in recording.meta.findings if f.code == "E26"] == [
        "150 positions, 50 of (0, 0, 0) missing"
    ]
    assert not any(name.startswith("x_") for name in table)
    only = read(tmp_path, text, columns=["lat_deg"]).table
    pd.testing.assert_series_equal(only["lat_deg"], table["lat_deg"])


def test_local_coordinates_are_no_positions(tmp_path: Path) -> None:
    recording = read(tmp_path, f"time,x,y,z,hpl\n{T}6,1.5,2.5,3.5,9\n{T}7,1.5,2.5,3.5,9\n")
    assert recording.table["lat_deg"].isna().all()
    assert [f.severity for f in recording.meta.findings if f.code == "E10"] == ["warning"]
    beside = read(tmp_path, f"time,x,y,z,lat,lon\n{T}6,1.5,2.5,3.5,50,15\n").table
    assert beside["x_y"].tolist() == [2.5]
