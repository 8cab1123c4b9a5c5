"""Headers of observation files."""

from __future__ import annotations

import pytest

from sbas.exceptions import InputError
from sbas.rinex.observation_header import parse_header
from sbas.rinex.observations import ObservationHeader
from tests.rinex.rinex_samples import code_lines, header_2, header_3, line


def header(text: str) -> ObservationHeader:
    return parse_header(text.splitlines(), where="a.rnx")


def test_codes_of_several_lines() -> None:
    names = tuple(f"{kind}{band}{c}" for band in "125" for c in "CX" for kind in "CLDS")
    found = header(header_3({"G": names, "S": ("C1C",)}))
    assert found.codes == {"G": names, "S": ("C1C",)}
    assert (found.version, found.marker, found.time_scale) == (3.05, "SITE", "GPST")


def test_a_lost_line_of_codes_is_refused() -> None:
    names = tuple(f"{kind}{band}{c}" for band in "125" for c in "CX" for kind in "CLDS")
    text = header_3({"G": names}).splitlines()
    lost = [t for i, t in enumerate(text) if not (t[:6] == " " * 6 and "OBS TYPES" in t)]
    assert len(lost) < len(text)
    with pytest.raises(InputError, match="not those that the header announces"):
        parse_header(lost, where="a.rnx")


def test_a_code_named_twice_is_refused() -> None:
    with pytest.raises(InputError, match="not those"):
        header(header_3({"G": ("C1C", "C1C")}))


@pytest.mark.parametrize(
    ("stated", "system", "scale"),
    [
        ("GPS", "M", "GPST"), ("GLO", "M", "UTC"), ("GAL", "M", "GST"), ("BDT", "M", "BDT"),
        ("QZS", "M", "QZSST"), ("IRN", "M", "GPST"), ("   ", "R", "UTC"), ("   ", "C", "BDT"),
        ("   ", "G", "GPST"), ("   ", "M", "GPST"), ("glo", "M", "UTC"),
    ],
)  # fmt: skip
def test_time_scales(stated: str, system: str, scale: str) -> None:
    # RINEX 3.05, table A2: GLO stands for UTC.
    assert header(header_3({"G": ("C1C",)}, system=system, scale=stated)).time_scale == scale


def test_an_unknown_time_scale_is_refused() -> None:
    with pytest.raises(InputError, match="time scale 'TAI'"):
        header(header_3({"G": ("C1C",)}, scale="TAI"))


def test_fields_of_the_header() -> None:
    extra = (
        line("  4846664.9180  -370195.2000  4116929.5260", "APPROX POSITION XYZ")
        + line("        0.1780        0.0010        0.0020", "ANTENNA: DELTA H/E/N")
        + line("    30.000", "INTERVAL")
        + line("    18    18  1929     7", "LEAP SECONDS")
        + line("DBHZ", "SIGNAL STRENGTH UNIT")
        + line("123                 RECEIVER            1.0", "REC # / TYPE / VERS")
    )
    found = header(header_3({"G": ("C1C",)}, extra=extra))
    assert found.position_m == (4846664.918, -370195.2, 4116929.526)
    assert found.antenna_delta_m == (0.178, 0.001, 0.002)
    assert (found.interval_s, found.leap_seconds, found.strength_unit) == (30.0, 18, "DBHZ")


def test_leap_seconds_counted_from_beidou_time() -> None:
    # RINEX 3.05, table A2: 4 of BDT are 18 of GPS time, since BDT began 14 leap seconds later.
    extra = line("     4     4  1929     7BDS", "LEAP SECONDS")
    assert header(header_3({"G": ("C1C",)}, extra=extra)).leap_seconds == 18


def test_a_position_of_zero_is_none() -> None:
    extra = line("        0.0000        0.0000        0.0000", "APPROX POSITION XYZ")
    assert header(header_3({"G": ("C1C",)}, extra=extra)).position_m is None


def test_scale_factors() -> None:
    codes = {"G": ("C1C", "L1C"), "E": ("C1C", "L1C")}
    extra = line("G  100   1 L1C", "SYS / SCALE FACTOR") + line("E   10", "SYS / SCALE FACTOR")
    assert header(header_3(codes, extra=extra)).scale == {
        ("G", "L1C"): 100, ("E", "C1C"): 10, ("E", "L1C"): 10,
    }  # fmt: skip
    with pytest.raises(InputError, match="scale factor"):
        header(header_3(codes, extra=line("G    7   1 L1C", "SYS / SCALE FACTOR")))
    with pytest.raises(InputError, match="scale factor"):
        header(header_3(codes, extra=line("G   10   1 L9C", "SYS / SCALE FACTOR")))


@pytest.mark.parametrize(
    "first",
    [
        f"{version:>9}{'':11}{kind}"
        for version, kind in (("3.05", "N"), ("1.00", "O"), ("5.00", "O"), ("nan", "O"), ("", "O"))
    ],
)
def test_other_files_are_refused(first: str) -> None:
    with pytest.raises(InputError, match="of type"):
        parse_header([first], where="a.rnx")


def test_a_header_without_codes_is_refused() -> None:
    with pytest.raises(InputError, match="names no observation codes"):
        header(header_3({}))
    assert code_lines("G", ()) == ""


def test_types_of_version_2_by_the_codes_of_version_3() -> None:
    # RINEX 3.05, tables 4 to 7: which code each tracking has.
    found = header(header_2(("C1", "P1", "L1", "P2", "L2", "C5", "S1", "D2", "C2", "T1")))
    assert found.codes["G"] == ("C1C", "C1W", "L1C", "C2W", "L2W", "C5X", "S1C", "D2W", "C2X", "T1")
    assert found.codes["R"][:5] == ("C1C", "C1P", "L1C", "C2P", "L2P")
    assert found.codes["S"][0] == "C1C"
    assert found.codes["E"][:3] == ("C1X", "P1", "L1X")
