"""Written times: every form, its refusals, and the way to GPS time."""

from __future__ import annotations

import datetime

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs.time_stamps import (
    parse_date_and_clock,
    parse_stamps,
    scale_of_stamps,
    stamps_to_gps,
    week_stamps,
)


def ns(text: str) -> int:
    return int(np.datetime64(text, "ns").astype(np.int64))


@pytest.mark.parametrize(
    ("text", "expected", "zoned"),
    [
        ("2025-05-23T14:09:16", "2025-05-23T14:09:16", False),
        ("2025/05/23 14:09:16.000000001", "2025-05-23T14:09:16.000000001", False),
        ("2025-05-23 14:09:16.5", "2025-05-23T14:09:16.5", False),
        ("2025-05-23 14:09", "2025-05-23T14:09", False),
        ("2025-05-23 14:09:16.12345678999", "2025-05-23T14:09:16.123456789", False),
        ("2025-05-23T14:09:16Z", "2025-05-23T14:09:16", True),
        ("2025-05-23T14:09:16.25+02:00", "2025-05-23T12:09:16.25", True),
        ("2025-05-23T14:09:16-0330", "2025-05-23T17:39:16", True),
        ("2025-05-23T14:09:16+01", "2025-05-23T13:09:16", True),
        ("2024-02-29 00:00:00", "2024-02-29T00:00:00", False),
    ],
)
def test_forms(text: str, expected: str, zoned: bool) -> None:
    stamps = parse_stamps(pa.array([text]))
    assert stamps.readable.tolist() == [True]
    assert stamps.ns.tolist() == [ns(expected)]
    assert stamps.zoned.tolist() == [zoned]


@pytest.mark.parametrize(
    "text",
    [
        "", "time", "2025-13-01 00:00:00", "2025-02-29 00:00:00", "2025-00-10 00:00:00",
        "2025-01-01 24:00:00", "2025-01-01 23:60:00", "2025-01-01 23:59:61", "1979-12-31 00:00:00",
        "1980-01-05 23:59:59", "2025-01-01", "2025-01-01 1:00:00", "01.02.2025 10:00:00",
        "2025-01-01x10:00:00", "2025-01-01 10:00:00.", "2025-01-01 10:00:00+99:00",
        "2025-01/01 10:00:00", "9999-01-01 00:00:00",
        "2025-01-01 10:00:00." + "1" * 40, "２０２５-01-01 10:00:00",
    ],
)  # fmt: skip
def test_refused_forms(text: str) -> None:
    assert parse_stamps(pa.array([text])).readable.tolist() == [False]


@given(
    st.lists(
        st.datetimes(
            min_value=datetime.datetime(1980, 1, 6), max_value=datetime.datetime(2261, 12, 31)
        ),
        max_size=20,
    )
)
def test_agrees_with_numpy_on_mixed_lengths(times: list[datetime.datetime]) -> None:
    texts = [time.isoformat(sep=" ") for time in times]
    stamps = parse_stamps(pa.array(texts, pa.string()))
    assert stamps.readable.all()
    assert stamps.ns.tolist() == [ns(text) for text in texts]
    sliced = parse_stamps(pa.array(["x", *texts], pa.string())[1:])
    assert sliced.ns.tolist() == stamps.ns.tolist()


def test_date_and_clock_apart() -> None:
    stamps = parse_date_and_clock(pa.array(["2025/05/23", "x"]), pa.array(["14:09:16.25", "00:00"]))
    assert stamps.readable.tolist() == [True, False]
    assert stamps.ns[0] == ns("2025-05-23T14:09:16.25")


def test_weeks() -> None:
    # Page 11: week 1549, TOW 518400 s = 2009-09-19 00:00:00 GPST.
    week = np.array([1549.0, 1549.0, -1, 1.5, np.nan, 65535, 10])
    tow = np.array([518400.0, 0.123456789, 0, 0, 0, 0, 604800.5])
    stamps = week_stamps(week, tow)
    assert stamps.readable.tolist() == [True, True, False, False, False, False, False]
    assert stamps.ns[:2].tolist() == [ns("2009-09-19"), ns("2009-09-13T00:00:00.123456789")]


@pytest.mark.parametrize(
    ("scale", "written", "expected"),
    [
        # Leap seconds from IERS Bulletins C; BDT by BDS-SIS-ICD, GLONASS time is UTC + 3 h.
        ("GPST", "2025-01-01 00:00:18", "2025-01-01T00:00:18"),
        ("UTC", "2025-01-01 00:00:00", "2025-01-01T00:00:18"),
        ("UTC", "2016-12-31 23:59:60.5", "2017-01-01T00:00:17.5"),
        ("UTC", "2015-06-30 23:59:59", "2015-07-01T00:00:15"),
        ("JST", "2025-01-01 09:00:00", "2025-01-01T00:00:18"),
        ("JST", "2017-01-01 08:59:60", "2017-01-01T00:00:17"),
        ("GLONASST", "2025-01-01 03:00:00", "2025-01-01T00:00:18"),
        ("BDT", "2025-01-01 00:00:04", "2025-01-01T00:00:18"),
        ("GST", "2025-01-01 00:00:18", "2025-01-01T00:00:18"),
    ],
)
def test_scales(scale: str, written: str, expected: str) -> None:
    times, _, findings = stamps_to_gps(parse_stamps(pa.array([written])), scale)
    assert times.astype(np.int64).tolist() == [ns(expected)]
    assert len(findings) == (scale != "GPST")


def test_end_of_the_leap_second_table_is_said() -> None:
    stamps = parse_stamps(pa.array(["2040-01-01 00:00:00"]))
    assert [f.severity for f in stamps_to_gps(stamps, "UTC")[2]] == ["info", "warning"]


def test_scale_is_asked_then_zoned_then_said() -> None:
    plain = parse_stamps(pa.array(["2025-01-01 00:00:00"]))
    zoned = parse_stamps(pa.array(["2025-01-01 00:00:00Z"]))
    mixed = parse_stamps(pa.array(["2025-01-01 00:00:00Z", "2025-01-01 00:00:00"]))
    assert scale_of_stamps(plain, None, said="", header="time")[0] == "GPST"
    assert scale_of_stamps(plain, None, said="UTC", header="utc")[0] == "UTC"
    assert scale_of_stamps(zoned, None, said="", header="time")[0] == "UTC"
    scale, findings = scale_of_stamps(plain, "GPST", said="UTC", header="utc")
    assert scale == "GPST"
    assert [f.code for f in findings] == ["E26"]
    for stamps, asked, said in ((mixed, None, ""), (zoned, "GPST", ""), (zoned, None, "GPST")):
        with pytest.raises(InputError, match="zone"):
            scale_of_stamps(stamps, asked, said=said, header="time")
    with pytest.raises(InputError, match="GPS time"):
        scale_of_stamps(plain, "UTC", said="GPST", header="week", by_week=True)
