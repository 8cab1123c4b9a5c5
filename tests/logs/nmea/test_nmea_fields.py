"""Numbers, clocks and angles of sentences against Python's own arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sbas.logs.nmea.nmea_fields import NO_TIME, Fields, numerals
from sbas.logs.nmea.nmea_framing import find
from tests.logs.nmea.nmea_samples import sentence


@given(st.lists(st.from_regex(r"[+-]?([0-9]{1,9}\.?[0-9]{0,6}|\.[0-9]{1,6})", fullmatch=True)))
def test_numbers_are_those_of_float(texts: list[str]) -> None:
    data = ",".join([*texts, ""]).encode() + bytes(32)
    ends = np.cumsum([len(t) + 1 for t in texts], dtype=np.int64) - 1
    starts = ends - np.array([len(t) for t in texts], np.int64)
    values = numerals(np.frombuffer(data, np.uint8), starts, ends).values()
    assert values.tolist() == [float(t) for t in texts]


def test_what_is_no_number() -> None:
    texts = ["", "1e5", "0x1", "--1", "1-", "1.2.3", ".", "-", "1 ", "1" * 19, "nan", "1" * 40]
    fields = Fields(find(sentence("GPXXX," + ",".join(texts))))
    for i, _ in enumerate(texts, 1):
        assert np.isnan(fields.number(i)).all()
    assert fields.unreadable == len(texts) - 1
    assert np.isnan(fields.number(99)).all()


@given(st.integers(0, 86_400 * 10**3), st.integers(0, 11))
def test_clocks(milliseconds: int, decimals: int) -> None:
    """Exact to the nanosecond; 23:59:60 counts on."""
    seconds, ms = divmod(milliseconds, 1000)
    clock = min(seconds, 86_399)
    second = clock % 60 + (seconds == 86_400)
    fraction = f"{ms:03d}00000000"[:decimals]
    text = f"{clock // 3600:02d}{clock // 60 % 60:02d}{second:02d}" + f".{fraction}" * bool(
        fraction
    )
    fields = Fields(find(sentence(f"GPXXX,{text}")))
    kept = int(fraction[:9].ljust(9, "0"))
    assert fields.clock_ns(1).tolist() == [seconds * 10**9 + kept]


def test_times_that_are_none() -> None:
    for text in ("240000", "096000", "000061", "93000", "-93000", "", "x93000", "0930000"):
        assert Fields(find(sentence(f"GPXXX,{text}"))).clock_ns(1).tolist() == [NO_TIME]


@given(st.integers(0, 179), st.integers(0, 59), st.text("0123456789", max_size=8))
def test_angles_are_rounded_once(degrees: int, minutes: int, digits: str) -> None:
    """The nearest float64 to the exact quotient, which `fractions` gives."""
    text = f"{degrees:03d}{minutes:02d}" + f".{digits}" * bool(digits)
    fields = Fields(find(sentence(f"GPXXX,{text},W")))
    exact = degrees + Fraction(f"{minutes}.{digits or 0}") / 60
    value, decimals = fields.angle_deg(1, b"E", b"W", 180)
    assert value.tolist() == [-float(exact)]
    assert decimals.tolist() == [len(digits)]
