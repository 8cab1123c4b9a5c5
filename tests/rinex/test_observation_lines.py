"""Lines and epoch records."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.rinex.observation_lines import PADDING, Lines, lines_of, parse_epochs
from tests.rinex.rinex_samples import epoch_line


def lines(text: bytes) -> Lines:
    return lines_of(np.frombuffer(text + PADDING, np.uint8), len(text))


@given(st.lists(st.text("ab ", max_size=4), max_size=6), st.sampled_from(["\n", "\r\n"]),
       st.booleans())  # fmt: skip
def test_lines_are_those_that_python_splits(parts: list[str], end: str, ended: bool) -> None:
    text = end.join(parts) + (end if ended and parts else "")
    found = lines(text.encode())
    texts = [text[a:b] for a, b in zip(found.start, found.end, strict=True)]
    assert texts == text.splitlines()


def test_bytes_beyond_a_lines_end_are_blank() -> None:
    found = lines(b"abcdef\nxy\n\nend").gather(1, 4)
    assert [row.tobytes() for row in found] == [b"bcd", b"y  ", b"   ", b"nd "]


@given(st.datetimes(dt.datetime(1980, 1, 6), dt.datetime(2261, 12, 31)), st.integers(0, 999))
def test_epochs_are_what_was_written(time: dt.datetime, count: int) -> None:
    found = parse_epochs(lines(epoch_line(time, count, 1).encode()))
    assert found.timed[0]
    assert found.counted[0]
    assert not found.blank[0]
    assert (found.flag[0], found.count[0]) == (1, count)
    ns = int(found.minute_ns[0] + found.second_ns[0])
    assert np.datetime64(ns, "ns") == np.datetime64(time, "ns")


def test_a_leap_second_stays_apart_from_the_minute() -> None:
    found = parse_epochs(lines(b"> 2016 12 31 23 59 60.5000000  0  3\n"))
    assert found.timed[0]
    assert found.second_ns[0] == 60_500_000_000


def test_an_event_may_have_no_time() -> None:
    found = parse_epochs(lines(b">                              4  2\n"))
    assert found.blank[0]
    assert found.counted[0]
    assert not found.timed[0]


@pytest.mark.parametrize(
    "text",
    [
        "> 2024 13 05 10 00  0.0000000  0  9", "> 2023 02 29 10 00  0.0000000  0  9",
        "> 2024 02 30 10 00  0.0000000  0  9", "> 2024 03 05 24 00  0.0000000  0  9",
        "> 2024 03 05 10 60  0.0000000  0  9", "> 2024 03 05 10 00 61.0000000  0  9",
        "> 2 24 03 05 10 00  0.0000000  0  9", "> 1979 12 31 10 00  0.0000000  0  9",
        "> 1980 01 05 23 59  0.0000000  0  9", "> 2024 03 05 10 00  0.00 0000  0  9",
        "> 2024 03 05 10 00  0,0000000  0  9", "> 2024 03 05x10 00  0.0000000  0  9",
        "> 2024 03 05 10 00 1 .0000000  0  9", "> 2262 03 05 10 00  0.0000000  0  9",
        "> 2024\x0003 05 10 00  0.0000000  0  9",
    ],
)  # fmt: skip
def test_what_is_no_time_is_none(text: str) -> None:
    assert not parse_epochs(lines(text.encode())).timed[0]


@pytest.mark.parametrize("tail", ["  x  9", "     9", "  0 1 ", "  0   ", "  01 2", "  0 -1", ""])
def test_flag_and_number_must_be_there(tail: str) -> None:
    text = f"> 2024 03 05 10 00  0.0000000{tail}"
    assert not parse_epochs(lines(text.encode())).counted[0]
