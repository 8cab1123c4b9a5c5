"""Truth trajectories: what they need, and that nothing odd passes."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sbas.exceptions import InputError
from sbas.logs.arrow import parquet
from sbas.logs.delimited import delimited_text
from sbas.logs.truth_files import read_truth_table
from sbas.recording import Recording

ROWS = "2025-05-23 14:09:16,50.5,15.5,289.5\n2025-05-23 14:09:17,50.6,15.6,289.6\n"


def put(folder: Path, text: str) -> Path:
    path = folder / "truth.csv"
    path.write_text(text)
    return path


def test_csv(tmp_path: Path) -> None:
    text = "time,lat_deg,lon_deg,height_m,sigma_h_m,sigma_v_mm,heading_deg,note\n" + ROWS.replace(
        "\n", ",0.02,30,271.5,x\n"
    )
    table = read_truth_table(put(tmp_path, text))
    assert list(table) == [
        "lat_deg", "lon_deg", "height_m", "sigma_h_m", "sigma_v_m", "heading_deg",
    ]  # fmt: skip
    assert table.iloc[0].tolist() == [50.5, 15.5, 289.5, 0.02, 0.03, 271.5]
    assert table.index.name == "time"
    assert table.index.dtype == np.dtype("M8[ns]")


def test_utc_and_geoid(tmp_path: Path) -> None:
    table = read_truth_table(put(tmp_path, "utc,lat,lon,alt\n" + ROWS), geoid=44.5)
    assert str(table.index[0]) == "2025-05-23 14:09:34"
    assert table["height_m"].tolist() == [334.0, 334.1]
    with pytest.raises(InputError, match="above the geoid"):
        read_truth_table(put(tmp_path, "utc,lat,lon,alt\n" + ROWS))


def test_parquet(tmp_path: Path) -> None:
    table = read_truth_table(put(tmp_path, "time,lat,lon,h\n" + ROWS))
    own = tmp_path / "own.parquet"
    parquet.write([Recording(table)], own)
    pd.testing.assert_frame_equal(read_truth_table(own), table)
    foreign = tmp_path / "foreign.parquet"
    table.assign(heading_deg=1.5).reset_index().to_parquet(foreign)
    found = read_truth_table(foreign, time_scale="GPST")
    pd.testing.assert_frame_equal(found, table.assign(heading_deg=1.5))
    with pytest.raises(InputError, match="time scale"):
        read_truth_table(foreign)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,lat,lon\n2025-05-23 14:09:16,50.5,15.5\n", "no height_m"),
        ("time,lat,lon,h\n" + ROWS.replace("289.5", "-2e10"), "not clean"),
        ("time,lat,lon,h\n" + ROWS.replace("289.5", "high"), "not clean"),
        ("time,lat,lon,h\n" + ROWS + "2025-05-23 14:09\n", "not clean"),
        ("time,lat,lon,h\n" + ROWS + "2025-05-23 14:09:18,50.7,15.7,28", "not clean"),
        ("time,lat,lon,h\n" + ROWS.replace("289.5", ""), "without a position"),
    ],
)
def test_a_truth_must_be_clean(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_truth_table(put(tmp_path, text))
    assert caught.value.cure


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such truth file"):
        read_truth_table(tmp_path / "none.csv")


def test_decimal_commas_with_semicolons(tmp_path: Path) -> None:
    text = "time;lat;lon;h\n" + ROWS.replace(",", ";").replace(".", ",")
    table = read_truth_table(put(tmp_path, text))
    assert table["lat_deg"].tolist() == [50.5, 50.6]


def test_the_time_scale_serves_a_file_that_does_not_say_it(tmp_path: Path) -> None:
    silent = put(tmp_path, "time,lat,lon,h\n" + ROWS)
    assert str(read_truth_table(silent, time_scale="UTC").index[0]) == "2025-05-23 14:09:34"
    assert str(read_truth_table(silent, time_scale="GPST").index[0]) == "2025-05-23 14:09:16"
    said = put(tmp_path, "gpst,lat,lon,h\n" + ROWS)
    # What is asked goes before the header, with the warning that a recording carries.
    table = read_truth_table(said, time_scale="UTC")
    recording = delimited_text.read(said, time_scale="UTC")
    assert str(table.index[0]) == str(recording.table.index[0]) == "2025-05-23 14:09:34"
    (warning,) = (f for f in recording.meta.findings if f.code == "E26")
    assert table.attrs["findings"] == [warning.to_dict()]
    assert "findings" not in read_truth_table(said, time_scale="GPST").attrs


@pytest.mark.parametrize(
    ("text", "cure"),
    [
        ("time,lat,lon,alt\n" + ROWS, "--truth-geoid"),
        ("time,lat,lon,h\n2016-12-31 23:59:60,50,15,289.5\n2017-01-01 00:00:00,50,15,289.5\n",
         "--truth-time-scale UTC"),
        ("gpst,lat,lon,h\n" + ROWS.replace(",50", "Z,50"), "--truth-time-scale UTC"),
        ("time;lat;lon;h\n" + ROWS.replace(",", ";").replace("289.5", "289,5"), "decimal points"),
    ],
)  # fmt: skip
def test_cures_name_options_of_the_truth(tmp_path: Path, text: str, cure: str) -> None:
    with pytest.raises(InputError) as caught:
        read_truth_table(put(tmp_path, text))
    assert cure in caught.value.cure


def test_an_undulation_for_the_recording_leaves_ellipsoidal_heights(tmp_path: Path) -> None:
    table = read_truth_table(put(tmp_path, "time,lat,lon,h\n" + ROWS), geoid=44.5)
    assert table["height_m"].tolist() == [289.5, 289.6]
    own = tmp_path / "own.parquet"
    parquet.write([Recording(table)], own)
    pd.testing.assert_frame_equal(read_truth_table(own, time_scale="UTC", geoid=44.5), table)


def test_a_pipe_is_no_truth(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="no regular file"):
        read_truth_table(tmp_path / "pipe")


def test_projected_coordinates(tmp_path: Path) -> None:
    # IOGP Guidance Note 7-2, Krovak: this place of S-JTSK is 50 12' 32.442" N, 16 50' 59.179" E.
    text = "time,easting_m,northing_m,height_m,heading_deg\n2025-05-23 14:09:16,"
    text += "-568990.997,-1050538.643,300.5,12.5\n"
    path = put(tmp_path, text)
    table = read_truth_table(path, frame="EPSG:5514")
    assert list(table) == ["lat_deg", "lon_deg", "height_m", "heading_deg"]
    assert table.iloc[0].tolist() == pytest.approx(
        [50 + 12 / 60 + 32.442 / 3600, 16 + 50 / 60 + 59.179 / 3600, 300.5, 12.5], abs=1.5e-7
    )
    with pytest.raises(InputError, match="nobody said of which projection"):
        read_truth_table(path)
    with pytest.raises(InputError, match="not projected"):
        read_truth_table(path, frame="ETRF2000")
    table = pd.DataFrame(
        {"easting_m": [-568990.997], "northing_m": [-1050538.643], "height_m": [300.5]},
        index=pd.DatetimeIndex(["2025-05-23 14:09:16"], name="time").as_unit("ns"),
    )
    foreign = tmp_path / "foreign.parquet"
    table.reset_index().to_parquet(foreign)
    found = read_truth_table(foreign, frame="EPSG:5514", time_scale="GPST")
    assert found["lat_deg"].iloc[0] == pytest.approx(50 + 12 / 60 + 32.442 / 3600, abs=1.5e-7)
    with pytest.raises(InputError, match="no numbers"):
        read_truth_table(put(tmp_path, text.replace("-568990.997", "west")), frame="EPSG:5514")
    with pytest.raises(InputError, match="no lat_deg"):
        read_truth_table(put(tmp_path, text.replace("northing_m", "northing")), frame="EPSG:5514")
