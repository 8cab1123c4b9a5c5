"""Repairs: what they change, that they are made once, and what they leave alone."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sbas
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.input_check import Repairs, repair
from sbas.recording import Flag, ProtectionLevelMeta, Recording, RecordingMeta
from sbas.timescales import gps_to_utc
from tests.examples import quiet
from tests.input_check.damages import rows, timed
from tests.input_check.journeys import START, journey, standing

ROOF = standing(50)


@pytest.mark.parametrize(
    "asked",
    [{"unit": {"height_m": "mm"}}, {"angles": "rad"}, {"swap_latlon": True}, {"sign": "lon"},
     {"sign": "both"},
     {"height_offset_m": 44.5}, {"time": "UTC"}, {"week_rollover": 1024}, {"shift_s": 0.5},
     {"pl_kind": "do229"}],
    ids=lambda asked: next(iter(asked)),
)  # fmt: skip
def test_a_repair_changes_something_is_noted_and_is_made_once(asked: dict[str, object]) -> None:
    once = repair(ROOF, **asked)
    assert not once.table.equals(ROOF.table) or once.meta.pl != ROOF.meta.pl
    assert [f.code for f in once.meta.findings] == ["E26"]
    assert json.loads(once.meta.options["repairs"]) == asked
    twice = repair(once, Repairs(**asked))  # type: ignore[arg-type]
    pd.testing.assert_frame_equal(twice.table, once.table)
    assert twice.meta == once.meta
    assert RecordingMeta.from_json(once.meta.to_json()).options == once.meta.options


@pytest.mark.parametrize(
    ("first", "second"),
    [({"shift_s": 1.0}, {"shift_s": 2.0}), ({"sign": "lat"}, {"sign": "lon"}),
     ({"unit": {"hpl_m": "mm"}}, {"unit": {"hpl_m": "km"}}), ({"time": "UTC"}, {"time": "BDT"})],
)  # fmt: skip
def test_another_value_of_a_repair_that_was_made_is_refused(
    first: dict[str, object], second: dict[str, object]
) -> None:
    with pytest.raises(InputError, match="before"):
        repair(repair(ROOF, **first), **second)


def test_units_of_further_columns_are_made_later() -> None:
    one = repair(ROOF, unit={"hpl_m": "cm"})
    both = repair(one, unit={"hpl_m": "cm", "vpl_m": "cm"})
    for name in ("hpl_m", "vpl_m"):
        np.testing.assert_allclose(both.table[name], ROOF.table[name] / 100)
    assert json.loads(both.meta.options["repairs"])["unit"] == {"hpl_m": "cm", "vpl_m": "cm"}


def test_degrees_and_minutes_of_the_page_and_signs() -> None:
    """5002.0700 and 01546.2720 are 50.0345 and 15.7712 degrees (shared page on formats, NMEA)."""
    table = ROOF.table.iloc[:2].assign(lat_deg=[5002.07, -5002.07], lon_deg=[1546.272, -59.999])
    cured = repair(Recording(table), unit={"lat_deg": "ddmm", "lon_deg": "ddmm"}).table
    np.testing.assert_allclose(cured["lat_deg"], [50.0345, -50.0345], rtol=1e-14)
    np.testing.assert_allclose(cured["lon_deg"], [15.7712, -59.999 / 60], rtol=1e-14)


@pytest.mark.parametrize(
    "asked",
    [{"unit": {"lat_deg": "mm"}}, {"unit": {"n_sv": "mm"}}, {"unit": {"x": "mm"}},
     {"angles": "deg"}, {"sign": "height"}, {"time": "local"}, {"duplicates": "both"},
     {"shift_s": np.nan}, {"height_offset_m": np.inf}, {"nonsense": 1},
     {"unit": {"herl_m": "mm"}}],
    ids=str,
)  # fmt: skip
def test_what_no_repair_knows_is_refused(asked: dict[str, object]) -> None:
    with pytest.raises(InputError):
        repair(ROOF, **asked)


def test_options_read_like_a_command_line() -> None:
    asked = Repairs(unit={"lat_deg": "1e-7 deg"}, swap_latlon=True, height_offset_m=44.5,
                    duplicates="first")  # fmt: skip
    assert asked.options == (
        '--unit "lat_deg=1e-7 deg" --swap-latlon --height-offset 44.5 --duplicates first'
    )
    assert Repairs().options == ""
    assert Repairs().named() == {}


def test_nothing_to_do_leaves_the_recording_as_it_is() -> None:
    asked = Repairs(sort=True, duplicates="first", pl_zero="missing", pl_frozen="missing",
                    leap_slip="fix", unwrap="day", time="GPST")  # fmt: skip
    assert repair(ROOF, asked) is ROOF


def test_stamps_over_a_leap_second_come_back_with_their_side_tables() -> None:
    """2016-12-31T23:59:60 UTC is 2017-01-01T00:00:17 GPST (IERS Bulletin C 52)."""
    for step_ms in (1000, 100):
        n = 60_000 // step_ms
        gps = np.datetime64("2016-12-31T23:59:47", "ns") + np.arange(n) * np.timedelta64(
            step_ms, "ms"
        )
        frames = pd.DataFrame({"time": gps[:: 1000 // step_ms], "prn": 120})
        good = timed(standing(n), gps).replace(side_tables={"sbas_frames": frames})
        bad = timed(good, gps_to_utc(gps)).replace(
            side_tables={"sbas_frames": frames.assign(time=gps_to_utc(frames["time"].to_numpy()))}
        )
        fixed = repair(bad, time="UTC")
        assert (fixed.time == gps).all()
        assert fixed.side_tables["sbas_frames"]["time"].tolist() == frames["time"].tolist()
        assert "added 17, 18 s" in fixed.meta.findings[0].evidence


def test_side_tables_move_with_the_epochs() -> None:
    train, _ = journey(400)
    frames = pd.DataFrame({"time": train.time, "prn": 120})
    good = train.replace(side_tables={"sbas_frames": frames})
    for k in (3, -1, -4):
        time = good.time.copy()
        time[:200] -= np.timedelta64(k, "s")
        bad = timed(good, time).replace(side_tables={"sbas_frames": frames.assign(time=time)})
        fixed = repair(bad, leap_slip="fix")
        assert (fixed.time == train.time).all()
        assert (fixed.side_tables["sbas_frames"]["time"].to_numpy() == train.time).all()
    later = repair(good, week_rollover=-1)
    assert (later.side_tables["sbas_frames"]["time"].to_numpy() == later.time).all()


def test_time_backward_and_its_cure() -> None:
    r = quiet(100)
    mixed = rows(r, np.r_[50:100, :50])
    cured = repair(mixed, sort=True)
    pd.testing.assert_frame_equal(cured.table, r.table)
    assert "100 epochs" in cured.meta.findings[0].message


@pytest.mark.parametrize("keep", ["first", "last"])
def test_repeated_times_and_their_cure(keep: str) -> None:
    r = quiet(100)
    again = r.table.iloc[[10]].assign(hpl_m=99.0)
    twice = r.replace(table=pd.concat([r.table.iloc[:11], again, r.table.iloc[11:]]))
    cured = repair(twice, duplicates=keep)
    assert len(cured) == 100
    assert (cured.table["hpl_m"].iloc[10] == 99.0) == (keep == "last")


def test_levels_of_zero_become_missing() -> None:
    r = quiet(100)
    hpl = r.table["hpl_m"].to_numpy().copy()
    hpl[[3, 5]] = [0.0, -1.0]
    cured = repair(r.replace(table=r.table.assign(hpl_m=hpl)), pl_zero="missing")
    assert cured.table["hpl_m"].isna().sum() == 2


def test_two_halves_of_one_epoch_become_whole() -> None:
    r = quiet(50)
    table = r.table.copy()
    first, second = table.iloc[[20]].copy(), table.iloc[[20]].copy()
    first["hpl_m"] = np.nan
    first["n_sv"] = np.int16(-1)
    second[["lat_deg", "lon_deg", "height_m"]] = np.nan
    split = pd.concat([table.iloc[:20], first, second, table.iloc[21:]])
    for keep in ("first", "last"):
        cured = repair(r.replace(table=split), duplicates=keep)
        pd.testing.assert_frame_equal(cured.table, table)
    second["hpl_m"] = 50.0
    first["hpl_m"] = 11.0
    contradicting = pd.concat([table.iloc[:20], first, second, table.iloc[21:]])
    kept = repair(r.replace(table=contradicting), duplicates="last").table
    assert kept["hpl_m"].iloc[20] == 50.0
    assert np.isnan(kept["lat_deg"].iloc[20])


def test_glonass_time_is_three_hours_ahead_of_utc() -> None:
    """GLONASS ICD 3.3.3; GPST - UTC is 18 s in 2025."""
    cured = repair(ROOF, time="GLONASST")
    assert (START - cured.time[0]) / np.timedelta64(1, "s") == 3 * 3600 - 18


def _of_utc(r: Recording) -> Recording:
    """As a reader of UTC stamps hands it on: GPST - UTC of the date that they show."""
    return repair(timed(r, gps_to_utc(r.time) - np.timedelta64(7168, "D")), time="UTC")


def test_a_rollover_of_utc_stamps_takes_the_leap_seconds_of_the_right_date() -> None:
    """IERS Bulletin C: GPST - UTC was 13 s on 2005-10-15, it is 18 s on 2025-06-01."""
    frames = pd.DataFrame({"time": ROOF.time, "prn": 120})
    rolled = _of_utc(ROOF)
    rolled = rolled.replace(side_tables={"sbas_frames": frames.assign(time=rolled.time)})
    fixed = repair(rolled, week_rollover=1024)
    assert (fixed.time == ROOF.time).all()
    assert (fixed.side_tables["sbas_frames"]["time"].to_numpy() == ROOF.time).all()
    assert "+5 s beside the weeks" in fixed.meta.findings[-1].evidence
    assert fixed.meta.leap_seconds == 18
    both = timed(ROOF, gps_to_utc(ROOF.time) - np.timedelta64(7168, "D"))
    assert (repair(both, time="UTC", week_rollover=1024).time == ROOF.time).all()
    in_gps = timed(ROOF, ROOF.time - np.timedelta64(7168, "D"))
    assert (repair(in_gps, week_rollover=1024).time == ROOF.time).all()


def test_a_rollover_of_nmea_dates(tmp_path: Path) -> None:
    """RMC dates 7168 days old: 12:59:40 UTC on 2025-05-23 is 12:59:58 GPST."""
    lines = []
    for k in range(5):
        for body in (
            f"GPGGA,1259{40 + k}.00,5001.80000,N,01546.20000,E,2,08,1.1,245.0,M,44.5,M,,",
            f"GPRMC,1259{40 + k}.00,A,5001.80000,N,01546.20000,E,0.0,0.0,071005,,,D",
        ):
            check = 0
            for letter in body.encode():
                check ^= letter
            lines.append(f"${body}*{check:02X}\r\n")
    path = tmp_path / "rolled.nmea"
    path.write_text("".join(lines), encoding="ascii")
    fixed = repair(sbas.read(path), week_rollover=1024)
    assert fixed.time[0] == np.datetime64("2025-05-23T12:59:58")


@pytest.mark.parametrize(
    "words",
    ["the levels are those of NAV-PL, not those of DO-229",
     "the protection levels are those of the receiver's RAIM, not of SBAS (DO-229)"],
)  # fmt: skip
def test_what_rested_on_the_kind_falls_with_it(words: str) -> None:
    of_kind, other = Finding("E23", "warning", words), Finding("E23", "warning", "others invalid")
    stating = ROOF.with_findings(of_kind, other)
    stating = stating.replace(meta=replace(stating.meta, pl=ProtectionLevelMeta("tmir")))
    found = repair(stating, pl_kind="do229").meta.findings
    assert of_kind not in found
    assert other in found
    assert [f.code for f in found] == ["E23", "E26"]


def test_levels_that_stand_for_none_become_missing_and_flagged() -> None:
    hpl = ROOF.table["hpl_m"].to_numpy().copy()
    hpl[[4, 7]] = 9999.0
    cured = repair(ROOF.replace(table=ROOF.table.assign(hpl_m=hpl)), pl_sentinel=9999.0)
    assert np.flatnonzero(cured.table["hpl_m"].isna()).tolist() == [4, 7]
    assert np.flatnonzero(
        cured.table["flags"].to_numpy() & np.uint32(Flag.PL_SENTINEL)
    ).tolist() == [4, 7]
    assert cured.table["vpl_m"].notna().all()
    assert repair(ROOF, pl_sentinel=9999.0) is ROOF
