"""Navigation files: values, times, damage, and georinex as a second opinion."""

from __future__ import annotations

import datetime as dt
import gzip
import warnings
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.rinex.ephemerides import Navigation
from sbas.rinex.navigation_file import read_navigation
from tests.rinex.rinex_samples import (
    START,
    geo_numbers,
    head_2,
    head_3,
    kepler_numbers,
    line,
    nav_header,
    record,
)

GPS_EPOCH = dt.datetime(1980, 1, 6)
START_S = (START - GPS_EPOCH).total_seconds()
TOE_S = 2304 * 604800 + 208800.0
KLOBUCHAR = (
    (4.6566e-9, 1.4901e-8, -5.9605e-8, -5.9605e-8),
    (77824.0, 49152.0, -65536.0, -327680.0),
)


def read(folder: Path, *texts: str) -> Navigation:
    paths = [folder / f"{i}.nav" for i in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_bytes(text.encode("latin-1"))
    return read_navigation(paths)


def gps_3(satellite: str = "G05", time: dt.datetime = START, **changes: float | None) -> str:
    return record(head_3(satellite, time), kepler_numbers(**changes), indent=4)  # type: ignore[arg-type]


def assert_values(found: Navigation) -> None:
    """One GPS record with the numbers of `kepler_numbers`, each in its own place."""
    assert len(found.gps) == 1
    expected = {
        "prn": 5, "toc_s": START_S, "toe_s": TOE_S, "transmission_s": TOE_S - 208800 + 201618,
        "iode": 45, "iodc": 45, "health": 0, "source": 0, "fit_h": 4.0, "ura_m": 2.0,
        "af0_s": -1.5e-4, "af1": 2.5e-12, "af2": 0.0, "tgd_s": -1.1e-8, "sqrt_a": 5153.65,
        "eccentricity": 0.0125, "i0": 0.965, "idot": 3.5e-10, "omega0": -2.25,
        "omega_dot": -8.1e-9, "omega": 0.75, "m0": 1.25, "delta_n": 4.2e-9, "cuc": -1.1e-6,
        "cus": 9.5e-6, "crc_m": 215.5, "crs_m": -21.5, "cic": 1.5e-7, "cis": -8.5e-8,
    }  # fmt: skip
    assert {f.name for f in fields(found.gps)} == set(expected)
    for name, value in expected.items():
        assert getattr(found.gps, name).tolist() == [value], name


@pytest.mark.parametrize("exponent", ["D", "E", "d", "e"])
def test_version_3(tmp_path: Path, exponent: str) -> None:
    text = record(head_3("G05"), kepler_numbers(), indent=4, exponent=exponent)
    found = read(tmp_path, nav_header("3.04") + text)
    assert_values(found)
    assert not found.findings


def test_version_4_message_by_message(tmp_path: Path) -> None:
    body = (
        "> EPH G05 LNAV\n" + gps_3()
        + "> EPH G06 CNAV\n" + gps_3("G06") + "     1.0D+00\n"
        + "> STO G05 LNAV\n    2024 03 05 10 00 00 GPUT\n     1.0D+00\n"
        + "> EOP J04 CNAV\n    2024 03 05 10 00 00 1.0D+00\n     1.0D+00\n     1.0D+00\n"
        + "> EPH E11 INAV\n" + gps_3("E11") + "> EPH E11 FNAV\n" + gps_3("E11", iode=46)
        + "> EPH S36 SBAS\n" + record(head_3("S36"), geo_numbers(), indent=4)
        + "> EPH R02 FDMA\nR02 2024 03 05 10 00 00 1.0D+00\n     1.0D+00\n"
    )  # fmt: skip
    alpha, beta = KLOBUCHAR
    ion = record("    2024 03 05 10 00 00", (*alpha, *beta), indent=4)
    other = record("    2024 03 05 10 00 00", (1.0,) * 8, indent=4)
    body += "> ION G05 LNAV\n" + ion + "> ION J04 LNAV\n" + other
    found = read(tmp_path, nav_header("4.01", system="M") + body)
    assert_values(found)
    assert found.galileo.iode.tolist() == [45, 46]
    assert found.geo.prn.tolist() == [136]
    assert found.klobuchar == KLOBUCHAR
    assert not found.findings


@pytest.mark.parametrize("width", [19, 20])
def test_version_2_and_its_wider_fields(tmp_path: Path, width: int) -> None:
    text = record(head_2(5), kepler_numbers(), indent=3, width=width)
    found = read(tmp_path, nav_header("2.11") + text)
    assert_values(found)
    assert not found.findings


def test_version_2_geo(tmp_path: Path) -> None:
    body = record(head_2(36), geo_numbers(), indent=3)
    body += record(head_2(20), geo_numbers(health=63.0), indent=3)
    found = read(tmp_path, nav_header("2.11", "H") + body)
    geo = found.geo
    assert geo.prn.tolist() == [120, 136]
    assert geo.health.tolist() == [63, 0]
    assert geo.t0_s.tolist() == [START_S] * 2
    assert geo.transmission_s.tolist() == [TOE_S - 30.0] * 2
    np.testing.assert_array_equal(geo.position_m[1], [30000500.0, 29000250.0, 12125.0])
    np.testing.assert_allclose(geo.velocity_mps[1], [1.0, -2.0, 3.0], rtol=1e-15)
    np.testing.assert_allclose(geo.acceleration_mps2[1], [1.25e-4, -2.5e-4, 5e-5], rtol=1e-15)
    assert (geo.clock_s[1], geo.drift[1]) == (1.5e-8, 9e-13)
    assert (geo.ura_m[1], geo.iodn[1]) == (2.0, 77)


def test_header_of_either_version(tmp_path: Path) -> None:
    alpha = "  0.4657D-08  0.1490D-07 -0.5961D-07 -0.5961D-07"
    beta = "  0.7782D+05  0.4915D+05 -0.6554D+05 -0.3277D+06"
    old = (
        line("  " + alpha, "ION ALPHA")
        + line("  " + beta, "ION BETA")
        + line("    18", "LEAP SECONDS")
    )
    found = read(
        tmp_path, nav_header("2.11", extra=old) + record(head_2(5), kepler_numbers(), indent=3)
    )
    assert found.klobuchar == (
        (0.4657e-8, 0.149e-7, -0.5961e-7, -0.5961e-7), (77820.0, 49150.0, -65540.0, -327700.0),
    )  # fmt: skip
    assert found.leap_seconds == 18
    new = line("GPSA " + alpha, "IONOSPHERIC CORR") + line("GPSB " + beta, "IONOSPHERIC CORR")
    new += line("GAL    4.9250E+01  2.0703E-01  4.0283E-03  0.0000E+00", "IONOSPHERIC CORR")
    new += line("     4     4  1929     7BDS", "LEAP SECONDS")
    again = read(tmp_path, nav_header("3.05", extra=new) + gps_3())
    assert again.klobuchar == found.klobuchar
    assert again.leap_seconds == 18


def test_weeks_roll_over(tmp_path: Path) -> None:
    """Seconds of the week lie in the week nearest to the time of clock."""
    sunday = dt.datetime(2024, 3, 10)  # week 2305 begins
    late = dt.datetime(2024, 3, 9, 23, 59, 44)
    body = (
        gps_3("G01", sunday, toe=0.0, sent=-7182.0)
        + gps_3("G02", sunday, toe=0.0, sent=597618.0)
        + gps_3("G03", late, toe=0.0, sent=597618.0)
        + gps_3("G04", sunday, toe=604784.0, sent=600000.0)
        + gps_3("G05", sunday, toe=7200.0, sent=6.0)
    )
    gps = read(tmp_path, nav_header("3.04") + body).gps
    week = 2305 * 604800
    assert (gps.toe_s - week).tolist() == [0.0, 0.0, 0.0, -16.0, 7200.0]
    assert (gps.transmission_s - week).tolist() == [-7182.0, -7182.0, -7182.0, -4800.0, 6.0]
    assert (gps.toc_s - week).tolist() == [0.0, 0.0, -16.0, 0.0, 0.0]


def test_blank_and_unknown_fields(tmp_path: Path) -> None:
    numbers = kepler_numbers()
    numbers[23] = numbers[26] = numbers[28] = None  # URA, IODC, fit interval
    body = record(head_3("G05"), numbers, indent=4) + gps_3("G06", sent=0.9999e9, fit=1.0)
    body += gps_3("G07", sent=None, fit=6.0)
    gps = read(tmp_path, nav_header("3.04") + body).gps
    assert np.isnan(gps.ura_m).tolist() == [True, False, False]
    assert gps.iodc.tolist() == [-1, 45, 45]
    assert gps.fit_h.tolist() == [0.0, 0.0, 6.0]
    # Not before its reference time is a record of unknown age used by a receiver in real time.
    assert gps.transmission_s.tolist() == [TOE_S - 7182, TOE_S, TOE_S]


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (0, None), (10, None), (24, None), (25, None),  # clock, sqrt(A), health, group delay
        (10, 0.0), (10, 9999.0), (8, 0.7), (8, -0.1), (11, -1.0), (11, 700000.0), (3, 1e12),
    ],
)  # fmt: skip
def test_impossible_records_are_left_out_and_counted(
    tmp_path: Path, place: int, value: float | None
) -> None:
    numbers = kepler_numbers()
    numbers[place] = value
    body = gps_3("G01") + record(head_3("G05"), numbers, indent=4)
    found = read(tmp_path, nav_header("3.04") + body)
    assert found.gps.prn.tolist() == [1]
    assert [f.code for f in found.findings] == ["E10"]
    assert "G05" in found.findings[0].evidence


DAMAGE = {
    "a date that is none": lambda t: t.replace("G05 2024 03", "G05 2024 13"),
    "a number": lambda t: t.replace("5.153650000000D+03", "5.15365x000000D+03"),
    "an exponent cut": lambda t: t.replace("5.153650000000D+03", "5.153650000000D+  "),
    "an exponent too large": lambda t: t.replace("5.153650000000D+03", "5.15365000000D+999"),
    "a satellite": lambda t: t.replace("G05", "Gx5"),
    "a line lost": lambda t: "".join(
        t.splitlines(keepends=True)[:3] + t.splitlines(keepends=True)[4:]
    ),
    "a line doubled": lambda t: "".join(
        t.splitlines(keepends=True)[:4] + t.splitlines(keepends=True)[3:]
    ),
    "zeros": lambda t: t[:100] + "\0" * 40 + t[140:],
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
@pytest.mark.parametrize("version", ["2.11", "3.04"])
def test_a_damaged_record_costs_itself_only(tmp_path: Path, version: str, damage: object) -> None:
    if version == "3.04":
        one, two, three = (gps_3(f"G0{k}") for k in (4, 5, 6))
    else:
        one, two, three = (record(head_2(k), kepler_numbers(), indent=3) for k in (4, 5, 6))
        two = two.replace(" 5 24", "G05 2024 03", 1) if damage is DAMAGE["a satellite"] else two
        if damage is DAMAGE["a date that is none"]:
            two = two.replace(" 24  3  5", " 24 13  5", 1)
    found = read(tmp_path, nav_header(version) + one + damage(two) + three)  # type: ignore[operator]
    assert found.gps.prn.tolist()[-1] == 6
    assert 5 not in found.gps.prn
    assert [f.code for f in found.findings] == ["E10"]


@pytest.mark.parametrize("version", ["2.11", "3.04"])
def test_a_cut_record_is_left_out_whole(tmp_path: Path, version: str) -> None:
    if version == "3.04":
        one, two = gps_3("G04"), gps_3("G05")
    else:
        one, two = (record(head_2(k), kepler_numbers(), indent=3) for k in (4, 5))
    text = nav_header(version) + one + two
    for size in range(len(text) - 2, len(text) - len(two), -1):
        found = read(tmp_path, text[:size])
        assert found.gps.prn.tolist() == [4], size
        begun = text[len(text) - len(two) : size].strip()
        assert [f.code for f in found.findings] == (["E10"] if begun else [])
    assert read(tmp_path, text[:-1]).gps.prn.tolist() == [4, 5]  # but for its line end it is whole


@pytest.mark.parametrize("kind", ["E", "S"])
def test_cut_records_of_galileo_and_sbas(tmp_path: Path, kind: str) -> None:
    numbers = kepler_numbers()[:28] if kind == "E" else geo_numbers()
    one, two = (record(head_3(f"{kind}{k}"), numbers, indent=4) for k in (21, 22))
    text = nav_header("3.04", system="M") + one + two
    for size in range(len(text) - 2, len(text) - len(two), -1):
        found = read(tmp_path, text[:size])
        assert len(found.galileo) + len(found.geo) == 1, size
    found = read(tmp_path, text[:-1])
    assert len(found.galileo) + len(found.geo) == 2


def test_line_ends_blank_lines_and_tails(tmp_path: Path) -> None:
    text = nav_header("3.04") + gps_3()
    for other in (text.replace("\n", "\r\n"), text.replace("\n", "\n\n"), text + "\0" * 99,
                  text + "\n\x1a"):  # fmt: skip
        found = read(tmp_path, other)
        assert_values(found)
        assert not found.findings


def test_galileo_keeps_both_messages_and_has_no_fit_interval(tmp_path: Path) -> None:
    numbers = kepler_numbers()
    numbers[20], numbers[26] = 517.0, -4.2e-9  # I/NAV of E1-B and E5b; group delay of E5b
    body = record(head_3("E05"), numbers, indent=4) + gps_3("E05", sent=201700.0)
    found = read(tmp_path, nav_header("3.04", system="E") + body)
    assert found.galileo.source.tolist() == [517, 1]
    assert found.galileo.iodc.tolist() == found.galileo.iode.tolist() == [45, 45]
    assert found.galileo.fit_h.tolist() == [0.0, 0.0]


def test_files_together_and_records_twice(tmp_path: Path) -> None:
    one = (
        nav_header("3.04")
        + gps_3("G05")
        + gps_3("G01", START + dt.timedelta(hours=2), toe=216000.0)
    )
    two = nav_header("2.11") + record(head_2(5), kepler_numbers(), indent=3)
    geo = nav_header("2.11", "H") + record(head_2(36), geo_numbers(), indent=3)
    glonass = nav_header("2.11", "GLONASS NAV DATA") + "  1 24  3  5 10 15  0.0\n"
    found = read(tmp_path, one, two, geo, geo, glonass)
    assert found.gps.prn.tolist() == [1, 5]
    assert len(found.geo) == 1
    assert [f.code for f in found.findings] == ["E15"]
    assert found.findings[0].where.endswith("4.nav")


@pytest.mark.parametrize(
    "text",
    [
        "", "no rinex\n", nav_header("3.04"), nav_header("3.04")[:-30],
        nav_header("5.00") + gps_3(), nav_header("nan") + gps_3(),
        nav_header("3.04", "OBSERVATION DATA") + gps_3(),
        nav_header("2.11", "J") + record(head_2(5), kepler_numbers(), indent=3),
        nav_header("3.04") + "R01" + gps_3()[3:],
    ],
)  # fmt: skip
def test_files_without_records_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, text)


def test_no_file_and_a_missing_one() -> None:
    with pytest.raises(InputError, match="no navigation file"):
        read_navigation([])
    with pytest.raises(InputError, match="cannot be read"):
        read_navigation("none.nav")


PEER_NAMES = {
    "af0_s": "SVclockBias", "af1": "SVclockDrift", "af2": "SVclockDriftRate", "crs_m": "Crs",
    "delta_n": "DeltaN", "m0": "M0", "cuc": "Cuc", "eccentricity": "Eccentricity", "cus": "Cus",
    "sqrt_a": "sqrtA", "cic": "Cic", "omega0": "Omega0", "cis": "Cis", "i0": "Io",
    "crc_m": "Crc", "omega": "omega", "omega_dot": "OmegaDot", "idot": "IDOT", "health": "health",
}  # fmt: skip
GPS_NAMES = PEER_NAMES | {"iode": "IODE", "tgd_s": "TGD", "iodc": "IODC", "ura_m": "SVacc"}
GALILEO_NAMES = PEER_NAMES | {"iode": "IODnav", "tgd_s": "BGDe5a", "ura_m": "SISA",
                              "source": "DataSrc"}  # fmt: skip


def peer_rows(path: Path, letter: str, names: dict[str, str]) -> set[tuple[float, ...]]:
    """Records as georinex reads them: satellite, time of clock and values."""
    import georinex

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table = georinex.load(path, use={letter})
    rows = set()
    for sv in table.sv.values:
        one = table.sel(sv=sv)
        for i, time in enumerate(one.time.values):
            values = tuple(float(one[name].values[i]) for name in names.values())
            if not np.isnan(values[0]):
                seconds = (time - np.datetime64(GPS_EPOCH, "ns")) / np.timedelta64(1, "s")
                number = int(str(sv)[1:3]) + (100 if letter == "S" else 0)
                rows.add((number, float(seconds), *values))
    return rows


@pytest.mark.parametrize(
    ("name", "letter", "count"),
    [("ELKO00USA_R_20182100000", "G", 225), ("VILL00ESP_R_20181700000", "G", 263),
     ("VILL00ESP_R_20181700000", "E", 961)],
)  # fmt: skip
def test_real_records_against_georinex(
    tmp_path: Path, reference_data: Path, name: str, letter: str, count: int
) -> None:
    packed = reference_data / "data" / "rinex" / f"{name}_01D_MN.rnx.gz"
    path = tmp_path / f"{name}_01D_MN.rnx"
    path.write_bytes(gzip.decompress(packed.read_bytes()))
    found = read_navigation(path)
    own = found.gps if letter == "G" else found.galileo
    assert len(own) == count
    names = GPS_NAMES if letter == "G" else GALILEO_NAMES
    columns = [getattr(own, n).astype(float).tolist() for n in ("prn", "toc_s", *names)]
    mine = set(zip(*columns, strict=True))
    peers = peer_rows(path, letter, names)
    # The library keeps one record of a satellite and time; of Galileo several kinds share one.
    assert len(peers) > 200
    assert peers <= mine
    assert {row[:2] for row in peers} == {row[:2] for row in mine}


def test_real_geo_records_against_georinex(tmp_path: Path, reference_data: Path) -> None:
    packed = reference_data / "data" / "rinex" / "VILL00ESP_R_20181700000_01D_MN.rnx.gz"
    path = tmp_path / "VILL00ESP_R_20181700000_01D_MN.rnx"
    path.write_bytes(gzip.decompress(packed.read_bytes()))
    geo = read_navigation(path).geo
    names = {"X": 0, "dX": 1, "dX2": 2, "health": 3, "Y": 4, "URA": 5, "Z": 6, "IODN": 7}
    peers = peer_rows(path, "S", dict.fromkeys(names, "") | {n: n for n in names})
    mine = {
        (int(prn), t, x, vx, ax, h, y, u, z, i)
        for prn, t, (x, y, z), (vx, _, _), (ax, _, _), h, u, i in zip(
            geo.prn, geo.t0_s.tolist(), geo.position_m.tolist(), geo.velocity_mps.tolist(),
            geo.acceleration_mps2.tolist(), geo.health.tolist(), geo.ura_m.tolist(),
            geo.iodn.tolist(), strict=True,
        )
    }  # fmt: skip
    assert len(geo) == 1631
    assert len(peers) > 1600
    assert peers <= {tuple(map(float, row)) for row in mine}


@pytest.mark.parametrize(
    ("name", "gps", "galileo", "geo"),
    [
        # Records counted in the texts: lines that begin a record of each message.
        ("waas_2020001/sugl0010.20n", 418, 0, 0),
        ("msas_kamakura_2025046/046m_rnx.nav", 17, 103, 106),
        ("msas_vehicle_2008147/all.nav", 18, 0, 8),
    ],
)
def test_real_files_are_read_whole(
    reference_data: Path, name: str, gps: int, galileo: int, geo: int
) -> None:
    found = read_navigation(reference_data / "data" / name)
    assert (len(found.gps), len(found.galileo), len(found.geo)) == (gps, galileo, geo)
    assert not found.findings
