"""The UBX reader against real files, the page's check values, and hand-made files."""

from __future__ import annotations

import math
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.ublox import ublox_ubx
from sbas.logs.ublox.ublox_ubx import FORMAT, read, read_in_chunks, scan, sniff
from sbas.logs.ublox.ubx_table import FILLED
from sbas.recording import Flag, Recording
from tests.logs.ublox.ubx_samples import (
    FRAME,
    ITOW,
    LEAP_S,
    NMEA,
    RTCM_1005,
    WEEK,
    cov,
    dop,
    eoe,
    epoch,
    pl,
    pvt,
    raw,
    rawx,
    reference_frames,
    sbas,
    sfrbx,
    timegps,
    ubx,
    utc_of,
)

FIRST = np.datetime64("2026-03-04T18:00:00", "ns")


@pytest.fixture
def load(tmp_path: Path):  # type: ignore[no-untyped-def]
    def load_bytes(*pieces: bytes, **options: object) -> Recording:
        path = tmp_path / "log.ubx"
        path.write_bytes(b"".join(pieces))
        return read(path, **options)  # type: ignore[arg-type]

    return load_bytes


def findings(recording: Recording, code: str) -> list[Finding]:
    return [finding for finding in recording.meta.findings if finding.code == code]


def finding(recording: Recording, code: str, words: str = "") -> Finding:
    return next(f for f in findings(recording, code) if words in f.message)


def flags(recording: Recording, flag: Flag) -> list[bool]:
    return ((recording.table["flags"].to_numpy() & flag) != 0).tolist()


class TestRealFiles:
    """Logs of gpsd and RTKLIB; the counts are those of shared/data/PROVENANCE.md."""

    def test_x20p(self, reference_data: Path) -> None:
        r = read(reference_data / "data/egnos_x20p_2026065/ublox-x20p.log")
        data = (reference_data / "data/egnos_x20p_2026065/ublox-x20p.log").read_bytes()
        assert [key for _, key, _ in reference_frames(data)].count(0x0120) == 29
        frames = r.side_tables["sbas_frames"]
        assert (len(r), len(frames)) == (0, 120)
        assert frames["crc_passed"].all()
        assert frames["prn"].value_counts().to_dict() == dict.fromkeys((121, 123, 136, 127), 30)
        assert set(frames["signal"]) == {"L1"}
        assert r.meta.leap_seconds == 18
        rows = (reference_data / "data/egnos_x20p_2026065/sbas_frames.txt").read_text().split("\n")
        expected = [line.split() for line in rows if line and not line.startswith("#")]
        assert [f.hex().upper() for f in frames["frame"]] == [line[4] for line in expected]
        assert frames["prn"].tolist() == [int(line[0]) for line in expected]
        origin = np.datetime64("1980-01-06") + np.timedelta64(2408 * 7, "D")
        seconds = (frames["time"].to_numpy() - origin) / np.timedelta64(1, "s")
        known = [None if line[1] == "NA" else float(line[1]) for line in expected]
        assert known.count(None) == 4  # they get the time of the first epoch
        assert seconds.tolist() == [588792.0 if second is None else second for second in known]
        assert "4 before the first epoch" in finding(r, "E25").evidence
        # The file begins with a comment of gpsd, of 221 bytes, and ends with a line end.
        assert "222 of 92,534" in finding(r, "E24").evidence

    def test_vehicle(self, reference_data: Path) -> None:
        folder = reference_data / "data/msas_vehicle_2008147"
        r = read(folder / "ubx_20080526.ubx")
        keys = [key for _, key, _ in reference_frames((folder / "ubx_20080526.ubx").read_bytes())]
        assert (keys.count(0x0211), keys.count(0x0210)) == (842, 242)
        frames = r.side_tables["sbas_frames"]
        assert (len(r), len(frames)) == (0, 482)
        assert frames["crc_passed"].all()
        assert frames["prn"].value_counts().to_dict() == {129: 241, 137: 241}
        assert finding(r, "E10").evidence == "18 bytes of 50"
        # RTKLIB's messages of both receivers of the vehicle, to the second: 236 of the 240 seconds
        # of this file agree bit by bit, up to 06:01:33 (this receiver alone) all but the first.
        origin = np.datetime64("1980-01-06") + np.timedelta64(1481 * 7, "D")
        second = np.rint((frames["time"].to_numpy() - origin) / np.timedelta64(1, "s"))
        # 226 bits: of the last byte the first two.
        text = [f[:28].hex().upper() + f"{f[28] & 0xC0:02X}" for f in frames["frame"]]
        ours = dict(zip(zip(frames["prn"], second, strict=True), text, strict=True))
        for prn in (129, 137):
            lines = (folder / f"msas_{prn}.sbs").read_text().splitlines()
            stated = {float(line.split()[1]): line.split()[5] for line in lines}
            same = [t for t, message in stated.items() if ours.get((prn, t)) == message]
            assert len(same) == 236
            assert [t for t in stated if t < 108_093 and t not in same] == [107_965]

    def test_sniffed(self, reference_data: Path) -> None:
        for name in ("egnos_x20p_2026065/ublox-x20p.log", "msas_vehicle_2008147/ubx_20080526.ubx"):
            data = (reference_data / "data" / name).read_bytes()
            assert sniff(data[:65536], data[-65536:], data[-4096:], Path(name)).score == 97


def test_sniff_counts_frames_not_their_copies() -> None:
    path = Path("x.ubx")
    one = pvt(ITOW)
    assert sniff(one, one, one, path).score == 80
    assert sniff(epoch(ITOW), b"", b"", path).score == 97
    assert sniff(b"", b"", b"", path).score == 0
    assert sniff(NMEA * 9, b"", NMEA, path).score == 0
    assert (FORMAT.sniff, FORMAT.read, FORMAT.scan) == (sniff, read, scan)


def test_all_columns_of_an_epoch(load) -> None:  # type: ignore[no-untyped-def]
    r = load(epoch(ITOW))
    row = r.table.iloc[0]
    assert r.columns == FILLED
    assert r.time[0] == FIRST
    assert (row.lat_deg, row.lon_deg, row.height_m) == (50.0345, 15.7712, 289.4)
    assert (row.vel_n_mps, row.vel_e_mps, row.vel_u_mps) == (0.1, -0.2, -0.03)
    assert (row.speed_mps, row.n_sv, row.x_undulation_m) == (0.224, 12, 44.5)
    assert (row.x_h_accuracy_m, row.x_v_accuracy_m) == (1.2, 1.9)
    assert (row.hdop, row.vdop, row.pdop) == pytest.approx((0.9, 1.2, 1.5), abs=1e-12)
    assert (row.sigma_n_m, row.sigma_e_m, row.sigma_u_m) == (1.0, 0.5, 2.0)
    assert row.cov_en_m2 == pytest.approx(0.1, abs=1e-8)
    assert (row["mode"], row.geo_prn, row.correction_age_s) == ("sbas", 123, 5.0)
    assert (row.hpl_m, row.vpl_m) == (5.0, 9.0)
    assert row["flags"] == 0
    assert [f.code for f in r.meta.findings] == ["E23"]


class TestTime:
    def test_ten_hertz_and_negative_nanoseconds(self, load) -> None:  # type: ignore[no-untyped-def]
        # A time just before the full second is the second with a negative fraction.
        r = load(pvt(ITOW + 100), pvt(ITOW + 200, utc=utc_of(ITOW + 1000), nano=-800_000_000))
        assert (r.time - FIRST).astype("m8[ms]").astype(int).tolist() == [100, 200]
        assert not r.meta.findings

    @pytest.mark.parametrize("itow", [0, 17_900, 18_000, 604_799_900])
    def test_week_from_the_date_at_its_ends(self, load, itow: int) -> None:  # type: ignore[no-untyped-def]
        r = load(pvt(itow))
        week_ms = (WEEK * 7 * 86_400_000) + itow
        assert r.time[0] == np.datetime64("1980-01-06", "ms") + np.timedelta64(week_ms, "ms")

    def test_leap_second_itself(self, load) -> None:  # type: ignore[no-untyped-def]
        # 2016-12-31 23:59:60 UTC is 2017-01-01 00:00:17 GPST: Sunday, week 1930.
        second = bytearray(pvt(17_000, utc=datetime(2016, 12, 31, 23, 59, 59, tzinfo=UTC)))
        second[6 + 10] = 60
        r = load(ubx(0x0107, bytes(second[6:-2])))
        assert r.time[0] == np.datetime64("2017-01-01T00:00:17")
        assert not r.meta.findings

    def test_timegps_goes_before_the_date(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(pvt(ITOW, utc=utc_of(ITOW, WEEK - 1024)), timegps(ITOW))
        assert r.time[0] == FIRST
        assert "different weeks" in finding(r, "E25", "different").message
        r = load(pvt(ITOW, valid=0), timegps(ITOW))
        assert r.time.tolist() == [FIRST.astype(int)]

    def test_week_of_an_invalid_timegps_does_not_count(self, load) -> None:  # type: ignore[no-untyped-def]
        assert load(pvt(ITOW), timegps(ITOW, week=5, valid=1)).time[0] == FIRST

    @pytest.mark.parametrize("valid", [0, 1, 2, 4])
    def test_without_date_and_time_no_epoch(self, load, valid: int) -> None:  # type: ignore[no-untyped-def]
        r = load(pvt(ITOW), dop(ITOW), pvt(ITOW + 1000, valid=valid), dop(ITOW + 1000))
        assert len(r) == 1
        assert finding(r, "E10").evidence == "1 NAV-DOP, 1 NAV-PVT"

    @pytest.mark.parametrize("at", [(4, 0), (4, 40), (6, 13), (7, 0), (7, 31), (8, 24), (10, 61)])
    def test_impossible_dates(self, load, at: tuple[int, int]) -> None:  # type: ignore[no-untyped-def]
        payload = bytearray(pvt(ITOW, utc=datetime(2026, 2, 3, tzinfo=UTC))[6:-2])
        payload[at[0]] = at[1]
        if at[0] == 4:
            payload[5] = 0
        assert len(load(ubx(0x0107, bytes(payload)))) == 0

    def test_impossible_time_of_week(self, load) -> None:  # type: ignore[no-untyped-def]
        assert len(load(pvt(604_800_000, utc=utc_of(0)))) == 0

    def test_other_messages_take_the_week_of_the_epoch_before(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(dop(ITOW - 1000), pvt(604_799_000), dop(0), pl(0), raw(1000, WEEK + 1), dop(2000))
        origin = np.datetime64("1980-01-06") + np.timedelta64(7 * (WEEK + 1), "D")
        seconds = (r.time - origin) / np.timedelta64(1, "s")
        assert seconds.tolist() == [-1, 0, 2]
        assert flags(r, Flag.DATE_INFERRED) == [False, True, True]
        assert "2 of 3" in finding(r, "E10", "week of the epoch before").evidence
        assert finding(r, "E10", "no usable time").evidence == "1 NAV-DOP"

    def test_no_week_from_far_away(self, load) -> None:  # type: ignore[no-untyped-def]
        assert len(load(pvt(ITOW), dop(ITOW + 3_600_000))) == 2
        assert len(load(pvt(ITOW), dop(ITOW + 3_600_001))) == 1

    def test_old_leap_second_count_does_no_harm(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(*(pvt(ITOW + i, utc=utc_of(ITOW + i) - timedelta(seconds=2)) for i in (0, 100)))
        assert r.time[0] == FIRST
        assert "2 epochs by -2 s" in finding(r, "E25").evidence

    def test_leap_seconds_as_stated(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(timegps(ITOW, leap_s=16), timegps(ITOW + 1000), timegps(ITOW + 2000, valid=3))
        assert r.meta.leap_seconds == LEAP_S
        assert finding(r, "E25").evidence == "16 s, 18 s"


def test_modes(load) -> None:  # type: ignore[no-untyped-def]
    # fixType, flags, GEO of NAV-SBAS (None: no such message) -> mode: the page's section 1.
    cases = [
        (3, 1, 123, "standalone"), (3, 3, 123, "sbas"), (3, 3, 0, "dgnss"), (3, 3, None, "dgnss"),
        (3, 0x43, 123, "rtk"), (3, 0x83, 123, "rtk"), (3, 0x81, None, "rtk"), (3, 0xC3, 0, "other"),
        (2, 3, 123, "sbas"), (1, 3, 123, "other"), (4, 1, None, "other"), (0, 3, 123, "none"),
        (5, 3, 123, "none"), (3, 2, 123, "none"), (1, 0, None, "none"), (6, 3, 123, "other"),
    ]  # fmt: skip
    pieces = []
    for i, (fix, bits, geo, _) in enumerate(cases):
        pieces.append(pvt(ITOW + i, fix_type=fix, flags=bits))
        if geo is not None:
            pieces.append(sbas(ITOW + i, geo))
    r = load(*pieces)
    assert r.table["mode"].tolist() == [mode for *_, mode in cases]
    assert r.table["geo_prn"].tolist() == [123 if m == "sbas" else -1 for *_, m in cases]
    assert flags(r, Flag.TWO_DIMENSIONAL) == [fix == 2 for fix, *_ in cases]
    assert flags(r, Flag.DEAD_RECKONING) == [fix in (1, 4) for fix, *_ in cases]
    lost = [mode == "none" for *_, mode in cases]
    assert r.table["lat_deg"].isna().tolist() == lost
    assert "value without a fix" in finding(r, "E07").evidence


def test_geo_that_is_no_prn(load) -> None:  # type: ignore[no-untyped-def]
    r = load(pvt(ITOW), sbas(ITOW, 87))
    assert (r.table["mode"].iloc[0], r.table["geo_prn"].iloc[0]) == ("sbas", -1)


def test_no_fix_values_are_missing_and_counted(load) -> None:  # type: ignore[no-untyped-def]
    missing = 0xFFFFFFFF
    r = load(
        pvt(ITOW, fix_type=0, flags=0, lat=0, lon=0, height=0, altitude=-17_000, h_acc=missing,
            v_acc=missing, pdop=9999, n_sv=0, vn=0, ve=0, vd=0, speed=0, flags_3=0),
        dop(ITOW, 9999, 9999, 9999),
        cov(ITOW, valid=0),
        pl(ITOW, (missing,) * 3, valid=0, frame=0),
        epoch(ITOW + 1000),
    )  # fmt: skip
    row = r.table.iloc[0]
    assert row[r.table.select_dtypes("f8").columns].isna().all()
    assert (row["mode"], row.n_sv) == ("none", 0)
    expected = Flag.PL_SENTINEL | Flag.POSITION_SENTINEL | Flag.PL_DECLARED_INVALID
    assert row["flags"] == expected | Flag.EPOCH_INCOMPLETE
    grave, rest = findings(r, "E07")
    assert (grave.severity, rest.severity) == ("warning", "info")
    for text in ("lat_deg: 1 x (0, 0)", "lon_deg: 1 x (0, 0)", "height_m: 1 x (0, 0)",
                 "hpl_m: 1 x 4294967295", "vpl_m: 1 x 4294967295"):  # fmt: skip
        assert text in grave.evidence
    for text in ("hdop: 1 x 9999", "x_h_accuracy_m: 1 x 4294967295", "sigma_e_m: 1 x value marked",
                 "vel_n_mps: 1 x value without a fix"):  # fmt: skip
        assert text in rest.evidence


def test_position_marked_invalid(load) -> None:  # type: ignore[no-untyped-def]
    r = load(pvt(ITOW, flags_3=1))
    assert r.table[["lat_deg", "lon_deg", "height_m"]].isna().all(axis=None)
    assert r.table["speed_mps"].iloc[0] == 0.224
    assert "marked invalid" in finding(r, "E07").evidence


def test_angles_out_of_range(load) -> None:  # type: ignore[no-untyped-def]
    r = load(
        pvt(ITOW, lat=900_000_001), pvt(ITOW + 1, lon=-1_800_000_001),
        pvt(ITOW + 2, lat=-900_000_000, lon=1_800_000_000),
    )  # fmt: skip
    assert r.table["lat_deg"].isna().tolist() == [True, False, False]
    assert r.table["lon_deg"].isna().tolist() == [False, True, False]
    assert flags(r, Flag.OUT_OF_RANGE) == [True, True, False]
    assert "angle out of range" in finding(r, "E07").evidence


def test_correction_age_is_the_upper_bound_of_its_class(load) -> None:  # type: ignore[no-untyped-def]
    r = load(*(pvt(ITOW + i, flags_3=i << 1) for i in range(16)))
    age = r.table["correction_age_s"]
    assert age.iloc[1:12].tolist() == [1, 2, 5, 10, 15, 20, 30, 45, 60, 90, 120]
    assert age.iloc[[0, 12, 13, 14, 15]].isna().all()
    assert "correction_age_s: 4 x 120 s or more" in finding(r, "E07").evidence


@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0])
def test_variance_that_is_none(load, bad: float) -> None:  # type: ignore[no-untyped-def]
    r = load(pvt(ITOW), cov(ITOW, ee=bad))
    assert math.isnan(r.table["sigma_e_m"].iloc[0])
    assert r.table["sigma_n_m"].iloc[0] == 1.0
    assert "sigma_e_m: 1 x" in finding(r, "E07").evidence
    assert flags(r, Flag.OUT_OF_RANGE) == [bad == -1.0]


def test_older_shorter_and_later_longer_messages(load) -> None:  # type: ignore[no-untyped-def]
    r = load(pvt(ITOW, length=84), pvt(ITOW + 1000, length=100), ubx(0x0107, bytes(60)),
             ubx(0x0107, b""))  # fmt: skip
    assert r.table["lat_deg"].tolist() == [50.0345] * 2
    assert finding(r, "E10").evidence == "1 NAV-PVT"  # the empty one asks for the message


class TestLevels:
    def test_norm_and_max(self, load) -> None:  # type: ignore[no-untyped-def]
        assert load(pl_epoch(0)).table["hpl_m"].tolist() == [5.0]
        r = load(pl_epoch(0), ubx_pl="max")
        assert r.table[["hpl_m", "vpl_m"]].iloc[0].tolist() == [4.0, 9.0]
        assert r.meta.options == {"ubx_pl": "max"}
        assert "larger of the two" in finding(r, "E23").evidence
        with pytest.raises(InputError, match="ubx_pl"):
            load(b"", ubx_pl="mean")

    @pytest.mark.parametrize(
        ("risk", "fraction"), [((5, 0), 0.05), ((1, -5), 1e-7), ((50, -1), 0.05), ((100, 0), None)]
    )
    def test_risk_is_in_percent(self, load, risk: tuple[int, int], fraction: float | None) -> None:  # type: ignore[no-untyped-def]
        r = load(pl_epoch(0, risk=risk))
        assert (r.meta.pl.kind, r.meta.pl.risk, r.meta.pl.risk_per) == ("tmir", fraction, "epoch")
        assert math.isnan(r.table["hpl_m"].iloc[0]) == (fraction is None)

    @pytest.mark.parametrize("frame", [0, 1, 2, 3, 4])
    def test_frames(self, load, frame: int) -> None:  # type: ignore[no-untyped-def]
        r = load(pl_epoch(0, frame=frame))
        usable = frame in (1, 2, 3)
        assert r.table["vpl_m"].fillna(0).tolist() == [9.0 if usable else 0.0]
        assert flags(r, Flag.PL_DECLARED_INVALID) == [not usable]
        if not usable:
            assert f"in frame {frame}" in finding(r, "E23", "invalid").evidence

    def test_declared_invalid(self, load) -> None:  # type: ignore[no-untyped-def]
        reasons = [0, 1, 29, 30, 100, 101, 30]
        r = load(*(pl_epoch(i, valid=0, reason=c) for i, c in enumerate(reasons)), pl_epoch(9))
        assert r.table["hpl_m"].isna().tolist() == [True] * 7 + [False]
        assert r.table["vpl_m"].isna().tolist() == [True] * 7 + [False]
        assert flags(r, Flag.PL_DECLARED_INVALID) == [True] * 7 + [False]
        evidence = finding(r, "E23", "invalid").evidence
        assert evidence.startswith("7 of 8 NAV-PL: 2 x set-up not verified (reason 30)")
        for text in ("not trustworthy (reason 1)", "not trustworthy (reason 29)", "reason 101",
                     "set-up not verified (reason 100)", "no reason stated"):  # fmt: skip
            assert f"1 x {text}" in evidence

    def test_all_invalid_as_in_a_real_record(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(*(pl_epoch(i, valid=0) for i in range(5)))
        assert r.table["hpl_m"].isna().all()
        assert flags(r, Flag.PL_DECLARED_INVALID) == [True] * 5
        assert (r.meta.pl.kind, r.meta.pl.risk) == ("tmir", 0.05)
        assert [f.message[:12] for f in findings(r, "E23")] == ["the receiver"]

    def test_levels_of_another_risk_are_never_pooled(self, load) -> None:  # type: ignore[no-untyped-def]
        risks = [(5, 0), (1, -5), (50, -1), (1, -5), (1, -5)]
        pieces = [pl_epoch(i, risk=risk) for i, risk in enumerate(risks)]
        r = load(*pieces)
        assert r.table["hpl_m"].notna().tolist() == [False, True, False, True, True]
        assert flags(r, Flag.PL_DECLARED_INVALID) == [True, False, True, False, False]
        assert flags(r, Flag.PL_OUTSIDE_SBAS) == [False, True, False, True, True]
        assert r.meta.pl.risk == 1e-7
        other = finding(r, "E23", "never pooled").evidence
        assert other == "kept 3 of 1e-07 an epoch; left out 2 of 0.05"
        # Of two as frequent the larger risk: the safe side.
        assert load(*pieces[:4]).meta.pl.risk == 0.05

    def test_invalid_messages_have_no_vote(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(pl_epoch(0, risk=(1, -5)), *(pl_epoch(i, valid=0) for i in range(1, 4)))
        assert r.meta.pl.risk == 1e-7
        assert r.table["hpl_m"].notna().tolist() == [True, False, False, False]

    def test_one_missing_axis(self, load) -> None:  # type: ignore[no-untyped-def]
        for way in ("norm", "max"):
            r = load(pl_epoch(0, levels=(3000, 0xFFFFFFFF, 9000)), ubx_pl=way)
            assert math.isnan(r.table["hpl_m"].iloc[0])
            assert r.table["vpl_m"].iloc[0] == 9.0
            assert flags(r, Flag.PL_SENTINEL) == [True]
            assert "hpl_m: 1 x 4294967295" in finding(r, "E07").evidence

    def test_zero_level_is_handed_on_for_the_input_check(self, load) -> None:  # type: ignore[no-untyped-def]
        assert load(pl_epoch(0, levels=(0, 0, 9000))).table["hpl_m"].iloc[0] == 0.0

    def test_flag_outside_sbas(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(pl_epoch(0, flags=1), epoch(ITOW + 1000))
        assert flags(r, Flag.PL_OUTSIDE_SBAS) == [True, False]

    def test_without_nav_pl_no_kind(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(pvt(ITOW))
        assert (r.meta.pl.kind, r.meta.options) == ("unknown", {})


def pl_epoch(i: int, levels: tuple[int, int, int] = (3000, 4000, 9000), **changes: object) -> bytes:
    bits = changes.pop("flags", 3)
    return pvt(ITOW + 1000 * i, flags=bits) + pl(ITOW + 1000 * i, levels, **changes)  # type: ignore[arg-type]


class TestJoin:
    def test_outer_join_keeps_what_there_is(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(epoch(ITOW), dop(ITOW + 100), pl(ITOW + 200), pvt(ITOW + 300), epoch(ITOW + 400))
        assert r.table["hdop"].notna().tolist() == [True, True, False, False, True]
        assert r.table["lat_deg"].notna().tolist() == [True, False, False, True, True]
        assert r.table["hpl_m"].notna().tolist() == [True, False, True, False, True]
        assert flags(r, Flag.EPOCH_INCOMPLETE) == [False, True, True, True, False]
        assert "3 of 5" in finding(r, "E10", "lack a message").evidence

    @pytest.mark.parametrize("lost", [0, 1, 3, 4, 5, 6])
    def test_each_missing_message_marks_its_epoch(self, load, lost: int) -> None:  # type: ignore[no-untyped-def]
        messages = [whole for _, _, whole in reference_frames(epoch(ITOW + 1000))]
        kept = (m for i, m in enumerate(messages) if i != lost)
        r = load(epoch(ITOW), *kept, epoch(ITOW + 2000))
        assert flags(r, Flag.EPOCH_INCOMPLETE) == [False, True, False]

    def test_message_that_the_log_never_has_is_not_missed(self, load) -> None:  # type: ignore[no-untyped-def]
        assert flags(load(pvt(ITOW), pvt(ITOW + 100)), Flag.EPOCH_INCOMPLETE) == [False, False]

    def test_same_time_twice_stays_twice(self, load) -> None:  # type: ignore[no-untyped-def]
        again = pvt(ITOW + 100, lat=1) + dop(ITOW + 100, hdop=77)
        r = load(epoch(ITOW), pvt(ITOW + 100), dop(ITOW + 100), again, epoch(ITOW + 200))
        assert r.table["lat_deg"].tolist() == [50.0345, 50.0345, 1e-7, 50.0345]
        assert r.table["hdop"].to_numpy() == pytest.approx([0.9, 0.9, 0.77, 0.9])
        assert flags(r, Flag.DUPLICATE_TIME) == [False, False, True, False]

    def test_end_of_epoch_closes_one(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(pvt(ITOW), eoe(ITOW), dop(ITOW), eoe(ITOW))
        assert r.table["lat_deg"].notna().tolist() == [True, False]

    def test_messages_that_make_no_row(self, load) -> None:  # type: ignore[no-untyped-def]
        assert len(load(timegps(ITOW), sbas(ITOW), eoe(ITOW), sfrbx(123))) == 0

    def test_file_order_stays(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(*(pvt(ITOW + t) for t in (5000, 6000, 1000, 7000, 6000)))
        assert ((r.time - FIRST) / np.timedelta64(1, "s")).tolist() == [5, 6, 1, 7, 6]
        assert flags(r, Flag.TIME_BACKWARD) == [False, False, True, False, True]
        assert flags(r, Flag.DUPLICATE_TIME) == [False] * 4 + [True]

    @settings(max_examples=60)
    @given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 4)), max_size=30))
    def test_no_message_is_lost_or_used_twice(
        self, tmp_path_factory: pytest.TempPathFactory, order: list[tuple[int, int]]
    ) -> None:
        """Each message carries its own number; a row holds at most one of each kind."""
        path = tmp_path_factory.mktemp("join") / "log.ubx"
        pieces = []
        for i, (t, kind) in enumerate(order):
            itow = ITOW + 1000 * t
            pieces.append(
                (pvt(itow, height=i), dop(itow, hdop=i + 1), cov(itow, nn=float(i)),
                 pl(itow, (1, 1, i)), eoe(itow))[kind]
            )  # fmt: skip
        path.write_bytes(timegps(ITOW) + b"".join(pieces))
        r = read(path)
        numbers = {
            0: r.table["height_m"] * 1000, 1: r.table["hdop"] * 100 - 1,
            2: r.table["sigma_n_m"] ** 2, 3: r.table["vpl_m"] * 1000,
        }  # fmt: skip
        seconds = (r.time - FIRST) / np.timedelta64(1, "s")
        for kind, values in numbers.items():
            known = values.dropna().round().astype(int)
            assert known.tolist() == [i for i, (_, k) in enumerate(order) if k == kind]
            at = np.flatnonzero(values.notna())
            assert seconds[at].tolist() == [order[i][0] for i in known]


class TestFrames:
    def test_times_are_those_of_the_epoch_before(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(sfrbx(120), timegps(ITOW), sfrbx(121), rawx(ITOW / 1000 + 1), sfrbx(122),
                 raw(ITOW + 2000), sfrbx(123), pvt(ITOW + 3000), sfrbx(124), dop(ITOW + 4000),
                 sfrbx(125))  # fmt: skip
        frames = r.side_tables["sbas_frames"]
        seconds = (frames["time"].to_numpy() - FIRST) / np.timedelta64(1, "s")
        assert seconds.tolist() == [0, 0, 1, 2, 3, 3]
        assert frames["prn"].tolist() == [120, 121, 122, 123, 124, 125]
        assert frames["frame"].tolist() == [FRAME] * 6
        assert frames["frame"].dtype.pyarrow_dtype.byte_width == 32

    def test_page_check_value(self, load) -> None:  # type: ignore[no-untyped-def]
        frame = load(timegps(ITOW), sfrbx(136)).side_tables["sbas_frames"].iloc[0]
        assert (frame["prn"], frame["signal"], bool(frame["crc_passed"])) == (136, "L1", True)
        assert frame["frame"][1] >> 2 & 63 == 26  # message type: bits 8 to 13

    def test_every_flipped_bit_fails(self, load) -> None:  # type: ignore[no-untyped-def]
        number = int.from_bytes(FRAME, "big")
        hurt = [(number ^ 1 << 255 - bit).to_bytes(32, "big") for bit in range(250)]
        frames = load(timegps(ITOW), *(sfrbx(136, f) for f in hurt)).side_tables["sbas_frames"]
        assert not frames["crc_passed"].any()

    def test_without_any_time(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(sfrbx(120), raw(ITOW, 0), timegps(ITOW, valid=1), pvt(ITOW, valid=0))
        assert r.side_tables["sbas_frames"]["time"].isna().all()
        assert "no time" in finding(r, "E10", "SBAS frames").message

    def test_sparse_epochs_are_told(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(timegps(ITOW), sfrbx(120), timegps(ITOW + 30_000))
        assert finding(r, "E25").severity == "warning"
        assert "30 s apart" in finding(r, "E25").evidence

    def test_others_are_left_out(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(timegps(ITOW), sfrbx(5, FRAME + bytes(8), gnss=0), sfrbx(136, FRAME + bytes(4)),
                 sfrbx(200), sfrbx(136, signal=3))  # fmt: skip
        frames = r.side_tables["sbas_frames"]
        assert frames["prn"].tolist() == [-1, 136]
        assert frames["signal"].isna().tolist() == [False, True]
        assert "1 of 2" in finding(r, "E25", "signal").evidence
        assert finding(r, "E10").evidence == "1 messages"


class TestDamage:
    def test_mixed_with_nmea_and_rtcm_is_normal(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(NMEA, epoch(ITOW), NMEA, NMEA, epoch(ITOW + 1000), RTCM_1005, epoch(ITOW + 2000))
        assert len(r) == 3
        assert not findings(r, "E24")

    def test_orphan_bytes(self, load) -> None:  # type: ignore[no-untyped-def]
        some = [epoch(ITOW + 1000 * i) for i in range(40)]
        r = load(*some, b"abcdef", epoch(ITOW + 90_000))
        orphan = finding(r, "E24")
        assert (orphan.severity, len(r)) == ("warning", 41)
        assert orphan.where == f"first at byte {40 * len(some[0]):,}"
        assert finding(load(bytes(99), epoch(ITOW)), "E24").severity == "error"

    @pytest.mark.parametrize("left", [1, 5, 6, 50, 99])
    def test_cut_last_frame(self, load, left: int) -> None:  # type: ignore[no-untyped-def]
        whole = epoch(ITOW)
        r = load(whole, pvt(ITOW + 1000)[:left])
        assert len(r) == 1
        if left == 1:
            assert "1 of" in finding(r, "E24").evidence
        else:
            cut = finding(r, "E10", "cut by the end")
            assert cut.where == f"byte {len(whole):,}"
            stated = "unknown length" if left < 6 else "100"
            assert cut.evidence == f"{left} bytes of {stated}"
            assert not findings(r, "E24")

    def test_positions_in_other_messages_are_named(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(ubx(0x0102, bytes(28)), ubx(0x0106, bytes(52)), ubx(0x0102, bytes(28)))
        assert len(r) == 0
        assert finding(r, "E10").evidence == "2 NAV-POSLLH, 1 NAV-SOL"

    @pytest.mark.parametrize("seed", range(4))
    def test_damage_never_invents_or_alters_epochs(self, load, seed: int) -> None:  # type: ignore[no-untyped-def]
        rng = np.random.default_rng(seed)
        clean = b"".join(epoch(ITOW + 100 * i, lat=500_000_000 + i) for i in range(150))
        whole = load(clean).table
        hurt = bytearray(clean)
        for at in rng.integers(len(hurt), size=30).tolist():
            hurt[at] ^= 1 << int(rng.integers(8))
        low, high = sorted(rng.integers(0, len(hurt), 2).tolist())
        del hurt[low : min(high, low + 5000)]
        r = load(bytes(hurt))
        assert r.time.tolist() == sorted(set(r.time.tolist()))
        assert r.table.index.isin(whole.index).all()
        assert len(r) > 100
        same = whole.loc[r.table.index]
        for name in r.table.columns:
            if name in ("flags", "mode", "geo_prn", "pdop"):
                continue  # a lost message shows in these
            known = r.table[name].notna() if name != "n_sv" else r.table[name] >= 0
            assert (r.table[name][known] == same[name][known]).all(), name
        either = np.uint32(Flag.EPOCH_INCOMPLETE | Flag.DATE_INFERRED)
        complete = (r.table["flags"].to_numpy() & either) == 0
        pd.testing.assert_frame_equal(r.table[complete], same[complete])
        assert findings(r, "E24")

    @settings(max_examples=100)
    @given(st.binary(max_size=300), st.integers(0, 200))
    def test_any_bytes_read(
        self, tmp_path_factory: pytest.TempPathFactory, data: bytes, cut: int
    ) -> None:
        path = tmp_path_factory.mktemp("any") / "any.ubx"
        path.write_bytes(epoch(ITOW)[cut:] + data + ubx(0x0107, data) + ubx(0x0162, data[:60]))
        r = read(path)
        assert set(r.columns) == set(FILLED)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rng = np.random.default_rng(5)
    pieces = []
    for i in range(900):
        itow = ITOW + 100 * i
        risk = (5, 0) if i % 7 else (1, -5)
        messages = [sfrbx(120 + i % 9), dop(itow), pvt(itow, height=i), sbas(itow, i % 3 * 60),
                    cov(itow), pl(itow, risk=risk), timegps(itow), eoe(itow)]  # fmt: skip
        messages = [m for m in messages if rng.random() < 0.95]
        if rng.random() < 0.02:
            messages.append(rng.bytes(40))
        if rng.random() < 0.02:
            messages *= 2
        if pieces and rng.random() < 0.02:
            pieces.append(pieces[len(pieces) // 2])
        pieces.append(b"".join(messages) + NMEA * (i % 5 == 0))
    path = tmp_path_factory.mktemp("chunks") / "log.ubx"
    path.write_bytes(b"".join(pieces) + pvt(0)[:40])
    return path


class TestChunks:
    @pytest.mark.parametrize("chunk_bytes", [1, 9001, 70_000, 32 << 20])
    def test_size_of_chunks_changes_nothing(self, path: Path, chunk_bytes: int) -> None:
        whole = read(path)
        assert 0 < len(whole) != 900
        r = read_in_chunks(path, chunk_bytes)
        assert r.meta == whole.meta
        pd.testing.assert_frame_equal(r.table, whole.table)
        frames = "sbas_frames"
        pd.testing.assert_frame_equal(r.side_tables[frames], whole.side_tables[frames])

    def test_scan_equals_read(self, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        whole = read(path)
        monkeypatch.setattr(ublox_ubx, "CHUNK_BYTES", 9001)
        source = scan(path)
        assert (len(source), source.meta, source.columns) == (len(whole), whole.meta, FILLED)
        for columns in (list(FILLED), ["flags"], ["hpl_m", "n_sv_tracked"], ["mode"]):
            batches = list(source.batches(columns))
            assert len(batches) > 10
            assert all(list(batch.columns) == columns for batch in batches)
            got = pd.concat(batches)
            known = [name for name in columns if name in FILLED]
            pd.testing.assert_frame_equal(got[known], whole.table[known])

    @pytest.mark.parametrize("name", FILLED)
    def test_each_column_alone(self, path: Path, name: str) -> None:
        whole = read(path)
        r = read(path, columns=[name, "herl_m"])
        assert r.columns == (name,)
        pd.testing.assert_frame_equal(r.table, whole.table[[name]])

    def test_scan_of_a_log_without_positions(self, tmp_path: Path) -> None:
        path = tmp_path / "frames.ubx"
        path.write_bytes(timegps(ITOW) + sfrbx(120))
        (batch,) = scan(path).batches(["hpl_m"])
        assert batch.empty


def test_longest_payload_is_an_option(load) -> None:  # type: ignore[no-untyped-def]
    assert len(load(epoch(ITOW), ubx_max_payload=91)) == 1  # the row of the others
    assert load(epoch(ITOW), ubx_max_payload=91).table["lat_deg"].isna().all()
    for bad in (0, 65536):
        with pytest.raises(InputError, match="ubx_max_payload"):
            load(b"", ubx_max_payload=bad)


def test_progress(tmp_path: Path) -> None:
    path = tmp_path / "log.ubx"
    path.write_bytes(epoch(ITOW))
    calls: list[tuple[int, int]] = []
    read(path, progress=lambda *call: calls.append(call))
    assert calls[-1] == (len(epoch(ITOW)),) * 2
