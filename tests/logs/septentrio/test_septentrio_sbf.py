"""The SBF reader against real blocks, the page's check values, and hand-made files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.findings import Finding
from sbas.logs.septentrio import septentrio_sbf
from sbas.logs.septentrio.sbf_writer import write
from sbas.logs.septentrio.septentrio_sbf import FORMAT, read, read_in_chunks, scan, sniff
from sbas.recording import Flag, Recording, major_semi_axis_m
from tests.logs.septentrio.sbf_samples import (
    WEEK,
    block,
    opaque_block,
    recording,
    with_sub_blocks,
)

DOP_REAL = bytes.fromhex("244057f9a10f2000e052c91c3f0925004f0028002c004200f5e77840fc96b540")
RTCM_1005 = bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")
NMEA = b"$GPGGA,093000.00,5002.0700,N,01546.2720,E,2,08,1.1,245.3,M,44.5,M,3.0,0120*47\r\n"
MODE_SBAS = 6


@pytest.fixture
def load(tmp_path: Path):  # type: ignore[no-untyped-def]
    def load_bytes(*pieces: bytes, columns: list[str] | None = None) -> Recording:
        path = tmp_path / "log.sbf"
        path.write_bytes(b"".join(pieces))
        return read(path, columns=columns)

    return load_bytes


def codes(recording: Recording) -> list[tuple[str, str]]:
    return [(finding.code, finding.severity) for finding in recording.meta.findings]


def finding(recording: Recording, code: str, words: str = "") -> Finding:
    return next(f for f in recording.meta.findings if f.code == code and words in f.message)


def epoch(tow_ms: int, *, hpl: float = 11.0, **pvt: object) -> bytes:
    """PVT, covariance, DOP, RAIM and end block of one epoch in SBAS PA mode."""
    fields: dict[str, object] = {
        "mode": MODE_SBAS, "wa_corr_info": 31, "lat": 0.87, "lon": 0.27, "height": 289.4,
        "n_sv": 8, "reference_id": 120, "signal_info": 1, "vn": 0.0, "ve": 0.0, "vu": 0.0,
    }  # fmt: skip
    return (
        block(4007, 2, tow_ms=tow_ms, **{**fields, **pvt})
        + block(5906, tow_ms=tow_ms, nn=1.0, ee=0.25, uu=4.0, ne=0.1)
        + block(4001, tow_ms=tow_ms, n_sv=8, hdop=110, vdop=150, pdop=190, hpl=hpl, vpl=17.0)
        + block(4011, tow_ms=tow_ms, integrity_flag=0, herl=3.0, verl=5.0)
        + block(5921, tow_ms=tow_ms)
    )


class TestRealFiles:
    """Blocks of a mosaic-X5 (semuconsulting/pysbf2, tests); values from the page's section 11."""

    def test_dilution_only(self, reference_data: Path) -> None:
        r = read(reference_data / "data/sbf_pysbf2/pygpsdata_x5_pvtextra.log")
        assert len(r) == 1
        row = r.table.iloc[0]
        assert r.time[0] == np.datetime64("2025-05-23T14:09:16")
        assert row.hpl_m == pytest.approx(3.889158, abs=5e-7)
        assert row.vpl_m == pytest.approx(5.674681, abs=5e-7)
        assert (row.pdop, row.hdop, row.vdop) == pytest.approx((0.79, 0.44, 0.66), abs=1e-12)
        assert row.n_sv == 37
        assert row[["lat_deg", "lon_deg", "height_m", "speed_mps", "mode"]].isna().all()
        assert "37" not in r.meta.pl.kind
        assert r.meta.pl.kind == "receiver"
        assert "more than 16 satellites" in finding(r, "E23").evidence

    def test_position(self, reference_data: Path) -> None:
        r = read(reference_data / "data/sbf_pysbf2/pygpsdata_x5_pvtgeod.log")
        row = r.table.iloc[0]
        assert len(r) == 1
        assert (row.lat_deg, row.lon_deg) == pytest.approx((53.344052492, -2.246685986), abs=5e-10)
        assert row.height_m == pytest.approx(131.18597, abs=5e-6)
        assert (row["mode"], row.geo_prn, row.n_sv) == ("sbas_npa", 123, 36)
        assert row.correction_age_s == pytest.approx(2.78, abs=1e-12)
        sigmas = (row.sigma_n_m, row.sigma_e_m, row.sigma_u_m)
        assert sigmas == pytest.approx((0.40224, 0.31349, 0.69059), abs=5e-6)
        axis = major_semi_axis_m(*(r.table[c].to_numpy() for c in
                                   ("sigma_e_m", "sigma_n_m", "cov_en_m2")))  # fmt: skip
        assert axis[0] == pytest.approx(0.40623, abs=5e-6)
        # The receiver's own 2-sigma figures follow from the covariance, to their centimetre.
        assert row.x_h_accuracy_m == 1.02
        assert math.hypot(row.sigma_n_m, row.sigma_e_m) == pytest.approx(0.50997, abs=5e-6)
        assert row.x_v_accuracy_m == pytest.approx(2 * row.sigma_u_m, abs=0.01)
        assert row.x_undulation_m == pytest.approx(48.5, abs=0.1)
        assert row["flags"] == Flag.RAIM_PASSED  # AlertFlag 1; there is no RAIMStatistics

    @pytest.mark.parametrize(("name", "frames"), [("constellations", 0), ("rawnav", 1)])
    def test_no_epoch(self, reference_data: Path, name: str, frames: int) -> None:
        r = read(reference_data / f"data/sbf_pysbf2/pygpsdata_x5_{name}.log")
        assert len(r) == 0
        assert len(r.side_tables.get("sbas_frames", ())) == frames

    def test_frame(self, reference_data: Path) -> None:
        r = read(reference_data / "data/sbf_pysbf2/pygpsdata_x5_rawnav.log")
        frame = r.side_tables["sbas_frames"].iloc[0]
        expected = "c612ffc4000003ffffe8000000000000000000000003bbad7b8000000dc52980"
        assert frame["frame"].hex() == expected
        assert (frame["prn"], frame["signal"], bool(frame["crc_passed"])) == (136, "L1", True)
        assert r.side_tables["sbas_frames"]["frame"].dtype.pyarrow_dtype.byte_width == 32

    def test_sniffed(self, reference_data: Path) -> None:
        for path in sorted((reference_data / "data/sbf_pysbf2").iterdir()):
            data = path.read_bytes()
            assert sniff(data, data, data[-4096:], path).score == 98


def test_page_check_value_of_a_dop_block(load) -> None:  # type: ignore[no-untyped-def]
    r = load(DOP_REAL)
    assert len(r) == 1
    assert r.table["hpl_m"].iloc[0] == pytest.approx(3.889158, abs=5e-7)


def test_sniff_counts_blocks_not_their_copies() -> None:
    path = Path("x.sbf")
    one = sniff(DOP_REAL, DOP_REAL, DOP_REAL, path)
    assert one.score == 85
    assert sniff(b"", b"", b"", path).score == 0
    assert sniff(NMEA * 9, b"", NMEA, path).score == 0
    assert FORMAT.sniff is sniff
    assert FORMAT.read is read
    assert FORMAT.scan is scan
    assert FORMAT.write is write


def test_modes(load) -> None:  # type: ignore[no-untyped-def]
    # Mode & 15, Error, WACorrInfo -> mode: table of the page's section 1.
    cases = [
        (0, 0, 0, "none"), (1, 0, 0, "standalone"), (2, 0, 0, "dgnss"), (3, 0, 0, "other"),
        (4, 0, 0, "rtk"), (5, 0, 0, "rtk"), (6, 0, 0, "sbas"), (6, 0, 16, "sbas_pa"),
        (6, 0, 31, "sbas_pa"), (6, 0, 7, "sbas_npa"), (6, 0, 96, "sbas_npa"), (7, 0, 0, "rtk"),
        (8, 0, 0, "rtk"), (10, 0, 0, "other"), (15, 0, 0, "other"), (6, 4, 16, "none"),
        (1 | 0x80, 0, 0, "standalone"), (6 | 0x40, 0, 16, "sbas_pa"),
    ]  # fmt: skip
    r = load(*(epoch(1000 * i, mode=m, error=e, wa_corr_info=w)
               for i, (m, e, w, _) in enumerate(cases)))  # fmt: skip
    assert r.table["mode"].tolist() == [mode for *_, mode in cases]
    flat = (r.table["flags"].to_numpy() & Flag.TWO_DIMENSIONAL) != 0
    assert flat.tolist() == [bool(m & 0x80) for m, *_ in cases]
    sbas = r.table["mode"].isin(["sbas", "sbas_pa", "sbas_npa"])
    outside = (r.table["flags"].to_numpy() & Flag.PL_OUTSIDE_SBAS) != 0
    assert (outside == ~sbas).all()
    lost = [i for i, (_, e, _, _) in enumerate(cases) if e]
    assert r.table["lat_deg"].isna().to_numpy().nonzero()[0].tolist() == lost
    assert "beside an error code" in finding(r, "E07").evidence


def test_do_not_use_values_are_missing_and_counted(load) -> None:  # type: ignore[no-untyped-def]
    r = load(
        block(4007, 2, tow_ms=0),
        block(5906, tow_ms=0),
        block(4001, tow_ms=0),
        block(4011, tow_ms=0),
        epoch(1000),
    )
    row = r.table.iloc[0]
    floats = r.table.select_dtypes("f8").columns
    assert row[floats].isna().all()
    assert (row["n_sv"], row["geo_prn"]) == (-1, -1)
    expected = Flag.PL_SENTINEL | Flag.POSITION_SENTINEL | Flag.EPOCH_INCOMPLETE
    assert row["flags"] == expected
    warning = next(f for f in r.meta.findings if f.code == "E07" and f.severity == "warning")
    assert "hpl_m: 1 x -2e10" in warning.evidence
    assert "lat_deg: 1 x -2e10" in warning.evidence
    info = next(f for f in r.meta.findings if f.code == "E07" and f.severity == "info")
    for text in ("hdop: 1 x 0", "herl_m: 1 x -2e10", "correction_age_s: 2 x 65535"):
        assert text in info.evidence


def test_scaled_do_not_use_values_of_dilutions(load) -> None:  # type: ignore[no-untyped-def]
    r = load(block(4001, tow_ms=0, hdop=65535, vdop=0, pdop=65534))
    assert r.table[["hdop", "vdop"]].isna().all(axis=None)
    assert r.table["pdop"].iloc[0] == pytest.approx(655.34)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_levels_that_are_no_number(load, bad: float) -> None:  # type: ignore[no-untyped-def]
    r = load(epoch(0, hpl=bad))
    assert math.isnan(r.table["hpl_m"].iloc[0])
    assert "hpl_m: 1 x" in finding(r, "E07").evidence


def test_zero_level_is_handed_on_for_the_input_check(load) -> None:  # type: ignore[no-untyped-def]
    assert load(epoch(0, hpl=0.0)).table["hpl_m"].iloc[0] == 0.0


def test_angles_out_of_range(load) -> None:  # type: ignore[no-untyped-def]
    r = load(epoch(0, lat=1.6), epoch(1000, lon=-3.2), epoch(2000, lat=-math.pi / 2, lon=math.pi))
    assert np.isnan(r.table["lat_deg"]).tolist() == [True, False, False]
    assert np.isnan(r.table["lon_deg"]).tolist() == [False, True, False]
    out = (r.table["flags"].to_numpy() & Flag.OUT_OF_RANGE) != 0
    assert out.tolist() == [True, True, False]
    assert "angle out of range" in finding(r, "E07").evidence
    assert (r.table["lat_deg"].iloc[2], r.table["lon_deg"].iloc[2]) == (-90.0, 180.0)


def test_raim_codes(load) -> None:  # type: ignore[no-untyped-def]
    # RAIMStatistics: 0 passed, 1 failed, 2 not available (guide p. 412); AlertFlag bits 0-1,
    # only where the block is absent: 0 not active, 1 passed, 2 failed (p. 429).
    bits = Flag.RAIM_PASSED | Flag.RAIM_FAILED | Flag.RAIM_NOT_AVAILABLE
    own = [(0, Flag.RAIM_PASSED), (1, Flag.RAIM_FAILED), (2, Flag.RAIM_NOT_AVAILABLE), (255, 0)]
    r = load(*(block(4007, 2, tow_ms=i, alert_flag=2 if code == 0 else 1)
               + block(4011, tow_ms=i, integrity_flag=code)
               for i, (code, _) in enumerate(own)))  # fmt: skip
    assert (r.table["flags"].to_numpy() & bits).tolist() == [flag for _, flag in own]
    alerts = [(0, 0), (1, Flag.RAIM_PASSED), (2, Flag.RAIM_FAILED), (5, Flag.RAIM_PASSED)]
    r = load(*(block(4007, 2, tow_ms=i, alert_flag=c) for i, (c, _) in enumerate(alerts)))
    assert (r.table["flags"].to_numpy() & bits).tolist() == [flag for _, flag in alerts]


def test_geo_numbers(load) -> None:  # type: ignore[no-untyped-def]
    reference = [120, 158, 65534, 65535, 0, 119, 159]
    r = load(*(epoch(1000 * i, reference_id=n) for i, n in enumerate(reference)))
    assert r.table["geo_prn"].tolist() == [120, 158, 0, -1, -1, -1, -1]
    assert load(epoch(0, mode=2, reference_id=123)).table["geo_prn"].tolist() == [-1]


@pytest.mark.parametrize(
    ("fields", "kind", "words"),
    [
        ({}, "do229", ""),
        ({"signal_info": 1 | 1 << 24}, "do229", ""),
        ({"signal_info": 1 | 1 << 8}, "receiver", "signals other"),
        ({"signal_info": 0}, "unknown", ""),
        ({"n_sv": 17}, "receiver", "more than 16"),
        ({"n_sv": 16}, "do229", ""),
        ({"mode": 1}, "receiver", "outside SBAS mode"),
    ],
)
def test_kind_of_level(load, fields: dict[str, int], kind: str, words: str) -> None:  # type: ignore[no-untyped-def]
    r = load(epoch(0, **fields), epoch(1000, **fields))
    assert r.meta.pl.kind == kind
    assert ("E23" in dict(codes(r))) == bool(words)
    if words:
        assert words in finding(r, "E23").evidence


def test_standalone_start_does_not_spoil_the_kind(load) -> None:  # type: ignore[no-untyped-def]
    r = load(epoch(0, mode=1), epoch(1000))
    assert r.meta.pl.kind == "do229"
    assert "1 outside SBAS mode" in finding(r, "E23").evidence
    outside = (r.table["flags"].to_numpy() & Flag.PL_OUTSIDE_SBAS) != 0
    assert outside.tolist() == [True, False]


def test_no_level_no_kind(load) -> None:  # type: ignore[no-untyped-def]
    assert load(block(4007, 2, tow_ms=0)).meta.pl.kind == "unknown"


class TestCartesian:
    LLH = (50.0345, 15.7712, 289.4)

    def fields(self) -> dict[str, object]:
        x, y, z = pymap3d.geodetic2ecef(*self.LLH)
        vx, vy, vz = pymap3d.enu2ecefv(3.0, 4.0, -0.5, *self.LLH[:2])
        return {"mode": 6, "wa_corr_info": 31, "x": x, "y": y, "z": z, "vx": vx, "vy": vy,
                "vz": vz, "n_sv": 8, "signal_info": 1}  # fmt: skip

    @pytest.mark.parametrize("number", [4006, 5903])
    def test_position_and_velocity(self, load, number: int) -> None:  # type: ignore[no-untyped-def]
        fields = self.fields()
        if number == 5903:
            del fields["wa_corr_info"], fields["signal_info"]
        row = load(block(number, tow_ms=0, **fields)).table.iloc[0]
        assert (row.lat_deg, row.lon_deg) == pytest.approx(self.LLH[:2], abs=1e-9)
        assert row.height_m == pytest.approx(289.4, abs=1e-6)
        velocity = (row.vel_e_mps, row.vel_n_mps, row.vel_u_mps, row.speed_mps)
        assert velocity == pytest.approx((3, 4, -0.5, 5), abs=1e-5)

    def test_covariance_is_turned(self, load) -> None:  # type: ignore[no-untyped-def]
        enu = np.array([[0.25, 0.1, 0.02], [0.1, 1.0, -0.3], [0.02, -0.3, 4.0]])
        axes = np.column_stack([pymap3d.enu2ecefv(*e, *self.LLH[:2]) for e in np.eye(3)])
        c = axes @ enu @ axes.T
        cov = block(5905, tow_ms=0, xx=c[0, 0], yy=c[1, 1], zz=c[2, 2], xy=c[0, 1], xz=c[0, 2],
                    yz=c[1, 2])  # fmt: skip
        row = load(block(4006, tow_ms=0, **self.fields()), cov).table.iloc[0]
        got = (row.sigma_e_m, row.sigma_n_m, row.sigma_u_m, row.cov_en_m2)
        assert got == pytest.approx((0.5, 1.0, 2.0, 0.1), abs=1e-5)
        assert load(cov).table["sigma_e_m"].isna().all()

    def test_geodetic_goes_first(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(
            block(4006, tow_ms=0, **self.fields()), epoch(0),
            block(4006, tow_ms=1000, **self.fields()), block(4001, tow_ms=1000, hpl=9.0),
        )  # fmt: skip
        assert r.table["height_m"].to_numpy() == pytest.approx([289.4, 289.4], abs=1e-6)
        assert r.table["lat_deg"].to_numpy() == pytest.approx(
            [math.degrees(0.87), self.LLH[0]], abs=1e-9
        )

    def test_missing_components(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(block(4006, tow_ms=0, mode=1), block(4006, tow_ms=1, mode=1, x=0.0, y=0.0, z=0.0))
        assert r.table[["lat_deg", "lon_deg", "height_m", "speed_mps"]].isna().all(axis=None)
        assert (r.table["flags"].to_numpy() & 4098).tolist() == [
            Flag.POSITION_SENTINEL,
            Flag.OUT_OF_RANGE,
        ]
        assert "lat_deg: 1 x -2e10" in finding(r, "E07").evidence


class TestVersion1:
    def test_all_blocks(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(
            block(5904, tow_ms=0, n_sv=7, mode=6, geo_svid=124, lat=0.5, lon=-1.0, height=100.0,
                  vn=3.0, ve=4.0, vu=0.0, undulation=45.5, correction_age=250),
            block(5909, tow_ms=0, n_sv=7, hdop=120, hpl=12.5, vpl=20.0),
            block(5915, tow_ms=0, integrity_flag=1, herl=2.0, verl=4.0),
        )  # fmt: skip
        row = r.table.iloc[0]
        assert (row.lat_deg, row.lon_deg) == (math.degrees(0.5), math.degrees(-1))
        assert (row.height_m, row.speed_mps, row.hpl_m, row.vpl_m) == (100, 5, 12.5, 20)
        assert (row.herl_m, row.verl_m, row.n_sv, row.geo_prn) == (2, 4, 7, 124)
        assert (row["mode"], row.hdop, row.correction_age_s) == ("sbas", 1.2, 2.5)
        assert row["flags"] == Flag.RAIM_FAILED
        assert row.x_undulation_m == 45.5
        assert r.meta.pl.kind == "unknown"  # version 1 does not tell the signals

    def test_older_block_without_its_last_fields(self, load) -> None:  # type: ignore[no-untyped-def]
        from sbas.logs.septentrio.sbf_writer import encode_blocks

        rows = encode_blocks(
            5904, 0, {"week": WEEK, "tow_ms": 0, "mode": 1, "lat": 0.5, "lon": 1.0}, length=72
        )
        row = load(rows.tobytes()).table.iloc[0]
        assert row.lat_deg == math.degrees(0.5)
        assert math.isnan(row.correction_age_s)

    def test_version_2_goes_first(self, load) -> None:  # type: ignore[no-untyped-def]
        old = block(5909, tow_ms=0, hpl=99.0) + block(5909, tow_ms=1000, hpl=98.0)
        r = load(old, epoch(0))
        assert r.table["hpl_m"].tolist() == [11.0, 98.0]


def test_unknown_revision_and_length_are_read_by_what_they_hold(load) -> None:  # type: ignore[no-untyped-def]
    from sbas.logs.septentrio.sbf_writer import encode_blocks

    stamp = {"week": WEEK, "mode": 1, "lat": 0.5, "lon": 1.0, "h_accuracy": 150}
    later = encode_blocks(4007, 5, {**stamp, "tow_ms": 0}, length=120)
    del stamp["h_accuracy"]
    first = encode_blocks(4007, 0, {**stamp, "tow_ms": 1000})
    r = load(later.tobytes(), first.tobytes(), later.tobytes()[:0])
    assert r.table["lat_deg"].tolist() == [math.degrees(0.5)] * 2
    assert r.table["x_h_accuracy_m"].iloc[0] == 1.5
    assert math.isnan(r.table["x_h_accuracy_m"].iloc[1])
    short = encode_blocks(4007, 2, {"week": WEEK, "tow_ms": 2000, "mode": 1}, length=16)
    assert load(short.tobytes()).table["lat_deg"].isna().all()


class TestJoin:
    def test_outer_join_keeps_what_there_is(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(
            epoch(0),
            block(4001, tow_ms=1000, hpl=9.0),
            block(4007, 2, tow_ms=2000, mode=1, lat=0.1, lon=0.2),
            epoch(3000),
        )
        assert r.table["hpl_m"].fillna(0).tolist() == [11, 9, 0, 11]
        assert r.table["lat_deg"].isna().tolist() == [False, True, False, False]
        partial = (r.table["flags"].to_numpy() & Flag.EPOCH_INCOMPLETE) != 0
        assert partial.tolist() == [False, True, True, False]
        assert r.table["mode"].isna().tolist() == [False, True, False, False]
        assert "2 of 4" in finding(r, "E10").evidence

    @pytest.mark.parametrize("lost", range(5))
    def test_each_missing_block_marks_its_epoch(self, load, lost: int) -> None:  # type: ignore[no-untyped-def]
        from tests.logs.septentrio.sbf_samples import reference_blocks

        blocks = [whole for _, _, whole in reference_blocks(epoch(1000))]
        r = load(epoch(0), *(b for i, b in enumerate(blocks) if i != lost), epoch(2000))
        partial = (r.table["flags"].to_numpy() & Flag.EPOCH_INCOMPLETE) != 0
        assert partial.tolist() == [False, True, False]

    def test_lone_end_block_is_no_epoch(self, load) -> None:  # type: ignore[no-untyped-def]
        assert len(load(epoch(0), block(5921, tow_ms=1000))) == 1
        assert len(load(block(5921, tow_ms=1000))) == 0

    def test_blocks_without_time_are_counted(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(
            epoch(0),
            block(4001, tow_ms=4294967295, hpl=9.0),
            block(4001, tow_ms=1000, week=65535, hpl=9.0),
            block(4001, tow_ms=604_800_000, hpl=9.0),
            block(4001, tow_ms=1000, week=20_000, hpl=9.0),
        )
        assert len(r) == 1
        assert "4 DOP" in finding(r, "E10", "no usable time").evidence

    def test_time_of_week_and_week_make_the_time(self, load) -> None:  # type: ignore[no-untyped-def]
        # 2009-09-19 00:00:00 GPST is week 1549, 518400 s (page, section 11).
        assert load(epoch(518_400_000)).time[0] == np.datetime64("2009-09-19T00:00:00")

    def test_same_time_twice_stays_twice(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(epoch(0), epoch(1000), epoch(1000, hpl=13.0, lat=0.5), epoch(2000))
        assert r.table["hpl_m"].tolist() == [11, 11, 13, 11]
        assert r.table["lat_deg"].iloc[2] == math.degrees(0.5)
        twice = (r.table["flags"].to_numpy() & Flag.DUPLICATE_TIME) != 0
        assert twice.tolist() == [False, False, True, False]

    def test_two_logs_in_one_file_do_not_mix(self, load) -> None:  # type: ignore[no-untyped-def]
        """The first log lost its DOP block; the second's must not join the first's position."""
        from tests.logs.septentrio.sbf_samples import reference_blocks

        first = b"".join(w for _, n, w in reference_blocks(epoch(1000, lat=0.1)) if n != 4001)
        r = load(epoch(0, lat=0.1), first, epoch(0, lat=0.2, hpl=20), epoch(1000, lat=0.2, hpl=21))
        expected = [(0.1, 11.0), (0.1, None), (0.2, 20.0), (0.2, 21.0)]
        for row, (lat, hpl) in zip(r.table.itertuples(), expected, strict=True):
            assert row.lat_deg == math.degrees(lat)
            assert math.isnan(row.hpl_m) if hpl is None else row.hpl_m == hpl
        flags = r.table["flags"].to_numpy()
        assert ((flags & Flag.DUPLICATE_TIME) != 0).tolist() == [False, False, True, True]
        assert ((flags & Flag.TIME_BACKWARD) != 0).tolist() == [False, False, True, False]

    def test_blocks_repeated_within_one_epoch(self, load) -> None:  # type: ignore[no-untyped-def]
        pvt = [block(4007, 2, tow_ms=0, mode=1, lat=lat, lon=0.0) for lat in (0.1, 0.2, 0.3)]
        dop = [block(4001, tow_ms=0, hpl=hpl) for hpl in (1.0, 2.0, 3.0)]
        r = load(pvt[0], pvt[1], dop[1], dop[2], pvt[2])
        assert r.table["lat_deg"].to_numpy() == pytest.approx(np.degrees([0.1, 0.2, 0.3]))
        assert r.table["hpl_m"].fillna(0).tolist() == [0, 2, 3]

    def test_file_order_stays(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(epoch(5000), epoch(6000), epoch(1000), epoch(7000))
        seconds = (r.time - r.time.min()) / np.timedelta64(1, "s")
        assert seconds.tolist() == [4, 5, 0, 6]
        backward = (r.table["flags"].to_numpy() & Flag.TIME_BACKWARD) != 0
        assert backward.tolist() == [False, False, True, False]
        assert not (r.table["flags"].to_numpy() & Flag.DUPLICATE_TIME).any()

    def test_sections_out_of_order_join(self, load) -> None:  # type: ignore[no-untyped-def]
        pvt = [block(4007, 2, tow_ms=t, mode=1, lat=t / 1e4, lon=0.0) for t in (0, 1000, 2000)]
        dop = [block(4001, tow_ms=t, hpl=t / 100) for t in (1000, 2000)]
        r = load(*dop, *pvt)
        assert r.table["hpl_m"].fillna(-1).tolist() == [10, 20, -1]
        assert r.table["lat_deg"].to_numpy() == pytest.approx(np.degrees([0.1, 0.2, 0]))

    def test_slower_block(self, load) -> None:  # type: ignore[no-untyped-def]
        """Blocks at another interval join where they are; the quick and the general way agree."""
        parts = []
        for i in range(40):
            parts.append(block(4007, 2, tow_ms=100 * i, mode=1, lat=0.5, lon=0.1, height=i * 1.0))
            if i % 10 == 3:
                parts.append(block(4001, tow_ms=100 * i, hpl=float(i + 1)))
        r = load(*parts)
        known = r.table["hpl_m"].dropna()
        assert known.tolist() == [4, 14, 24, 34]
        assert (known.to_numpy() == r.table.loc[known.index, "height_m"] + 1).all()
        late = load(*parts, block(4007, 2, tow_ms=50, mode=1))  # forces the general way
        pd.testing.assert_frame_equal(late.table.iloc[:-1], r.table)

    @settings(max_examples=100)
    @given(st.lists(st.tuples(st.integers(0, 3), st.sampled_from([4007, 4001, 5906, 5921]))))
    def test_no_block_is_lost_or_used_twice(
        self, tmp_path_factory: pytest.TempPathFactory, plan: list[tuple[int, int]]
    ) -> None:
        path = tmp_path_factory.mktemp("join") / "x.sbf"
        parts = []
        for i, (t, number) in enumerate(plan):
            value = {4007: {"mode": 1, "height": float(i)}, 4001: {"hpl": float(i)},
                     5906: {"nn": float(i) ** 2}, 5921: {}}[number]  # fmt: skip
            parts.append(block(number, 2 if number == 4007 else 0, tow_ms=1000 * t, **value))
        path.write_bytes(b"".join(parts))
        table = read(path).table
        seconds = (table.index - pd.Timestamp("2009-09-13")) // pd.Timedelta("1s")
        for number, column in ((4007, "height_m"), (4001, "hpl_m"), (5906, "sigma_n_m")):
            got = {(s, round(v)) for s, v in zip(seconds, table[column], strict=True) if v == v}
            assert got == {(t, i) for i, (t, n) in enumerate(plan) if n == number}
            assert table[column].notna().sum() == len(got)
        # An epoch of one time is split only where one of its kinds of block comes twice.
        for t in {t for t, n in plan if n != 5921}:
            kinds = [n for s, n in plan if s == t]
            if len(set(kinds)) == len(kinds):
                assert (seconds == t).sum() == 1
        assert (
            ~table.index.duplicated() == ((table["flags"].to_numpy() & Flag.DUPLICATE_TIME) == 0)
        ).all()


class TestLeftovers:
    def test_clean_file_has_none(self, load) -> None:  # type: ignore[no-untyped-def]
        assert not {"E10", "E24"} & dict(codes(load(epoch(0), epoch(1000)))).keys()

    def test_other_streams_are_no_damage(self, load) -> None:  # type: ignore[no-untyped-def]
        # The RTCM 1005 frame is the example of RTCM 10403.1, 4.2.
        r = load(NMEA, RTCM_1005, epoch(0), NMEA, NMEA, epoch(1000), RTCM_1005, NMEA, RTCM_1005)
        assert "E24" not in dict(codes(r))
        assert len(r) == 2

    def test_orphans_are_counted(self, load) -> None:  # type: ignore[no-untyped-def]
        junk = b"junk$GPGGA,1*00\r\n\xd3\0\1xyzz"
        many = b"".join(epoch(1000 * i) for i in range(60))
        r = load(epoch(900_000), junk, NMEA, many)
        evidence = finding(r, "E24").evidence
        assert evidence.startswith(f"{len(junk)} of ")
        assert "1 NMEA" in evidence
        assert finding(r, "E24").severity == "warning"
        assert finding(r, "E24").where == f"first at byte {len(epoch(0)):,}"
        assert finding(load(junk, epoch(0)), "E24").severity == "error"

    def test_damaged_block_is_orphan_bytes(self, load) -> None:  # type: ignore[no-untyped-def]
        hurt = bytearray(epoch(1000))
        hurt[40] ^= 1
        r = load(epoch(0), bytes(hurt), epoch(2000))
        assert finding(r, "E24").evidence.startswith("96 of ")
        assert r.table["lat_deg"].isna().tolist() == [False, True, False]

    @pytest.mark.parametrize("kept", [1, 2, 7, 8, 40, 95])
    def test_cut_last_block(self, load, kept: int) -> None:  # type: ignore[no-untyped-def]
        r = load(epoch(0), epoch(1000)[:kept])
        assert len(r) == 1
        if kept == 1:
            assert finding(r, "E24").evidence.startswith("1 of ")
        else:
            found = finding(r, "E10", "cut")
            assert found.evidence.startswith(f"{kept} bytes of {'96' if kept >= 8 else 'unknown'}")
            assert "E24" not in dict(codes(r))

    def test_wrapped_block(self, load) -> None:  # type: ignore[no-untyped-def]
        dop = block(4001, tow_ms=0, hpl=5.0)
        r = load(opaque_block(4097, dop), dop)
        assert len(r) == 1
        assert finding(r, "E24", "Encapsulated").evidence == "1 blocks"
        assert finding(r, "E24", "Encapsulated").severity == "info"

    def test_long_foreign_stretch_is_read_piece_by_piece(
        self, load, monkeypatch: pytest.MonkeyPatch
    ) -> None:  # type: ignore[no-untyped-def]
        monkeypatch.setattr("sbas.logs.septentrio.sbf_foreign.PIECE_BYTES", 3000)
        r = load(epoch(0), NMEA * 500, b"!" * 7, NMEA * 300, epoch(1000), NMEA * 3)
        assert finding(r, "E24").evidence.startswith("7 of ")
        assert "803 NMEA" in finding(r, "E24").evidence
        r = load(epoch(0), b"!" * 9000, NMEA, b"!", epoch(1000))
        first = len(epoch(0))
        assert finding(r, "E24").where == f"first at byte {first}, {first + 9000 + len(NMEA):,}"


def test_receiver_time(load) -> None:  # type: ignore[no-untyped-def]
    def clock(tow_ms: int, leap: int, level: int = 7) -> bytes:
        return block(5914, tow_ms=tow_ms, utc_year=9, leap_seconds=leap, sync_level=level)

    assert load(epoch(0)).meta.leap_seconds is None
    r = load(clock(0, 15), epoch(0), clock(1000, 15))
    assert r.meta.leap_seconds == 15
    assert "E25" not in dict(codes(r))
    assert "E11" not in dict(codes(r))
    # Week 1549 begins on 2009-09-13; a value that is not known is no change.
    r = load(clock(0, -128, 3), epoch(0), clock(1000, 14), clock(1500, -128), clock(2000, 15))
    assert r.meta.leap_seconds == 15
    found = finding(r, "E11")
    assert found.severity == "error"
    assert found.evidence == "2009-09-13T00:00:02 GPST: 14 s to 15 s, k = +1"
    assert "1 of 4" in finding(r, "E25", "clock").evidence
    r = load(*(clock(1000 * i, 14 + i % 3) for i in range(9)))
    assert finding(r, "E11").evidence.endswith("k = -2; 2009-09-13T00:00:04 GPST: 14 s to 15 s, "
                                               "k = +1; 2009-09-13T00:00:05 GPST: 15 s to 16 s, "
                                               "k = +1; and 3 more")  # fmt: skip


def test_frame_of_reference(load) -> None:  # type: ignore[no-untyped-def]
    assert load(epoch(0, datum=0)).meta.frame == "WGS84"
    assert load(epoch(0, datum=0), epoch(1000, datum=19)).meta.frame == ""
    assert load(DOP_REAL).meta.frame == ""


def test_antenna(load) -> None:  # type: ignore[no-untyped-def]
    """Positions are those of the marker; Misc bits 6-7: whether it is the ARP (guide, p. 400)."""
    unknown, same, off = (epoch(0, misc=bits << 6 | 3) for bits in (0, 1, 2))
    for blocks, antenna in (
        ((unknown,), "marker"), ((same,), "marker, which is the ARP"),
        ((off,), "marker, off the ARP"), ((same, off), "marker"), ((DOP_REAL,), "marker"),
    ):  # fmt: skip
        assert load(*blocks).meta.antenna == antenna


def test_frames_of_both_signals(load) -> None:  # type: ignore[no-untyped-def]
    bits = np.arange(8, dtype=np.uint32)[None, :] + 0x01020300
    r = load(
        block(4021, tow_ms=0, svid=140, crc_passed=1, bits=bits),
        block(4020, tow_ms=1000, svid=198, crc_passed=0, bits=bits),
        block(4021, tow_ms=2000, svid=215, crc_passed=1, bits=bits),
        block(4020, tow_ms=3000, svid=33, crc_passed=1, bits=bits),
        block(4020, tow_ms=4294967295, svid=33, crc_passed=1, bits=bits),
    )
    frames = r.side_tables["sbas_frames"]
    assert frames["signal"].tolist() == ["L5", "L1", "L5", "L1"]
    assert frames["prn"].tolist() == [140, 141, 158, -1]
    assert frames["prn"].dtype == "i2"
    assert frames["crc_passed"].tolist() == [True, False, True, True]
    assert frames["frame"].iloc[0] == b"".join(w.to_bytes(4, "big") for w in bits[0].tolist())
    assert "1 GEORawL1" in finding(r, "E10", "no usable time").evidence
    assert len(r) == 0


class TestColumns:
    @pytest.mark.parametrize("name", septentrio_sbf.FILLED)
    def test_one_column_is_as_among_all(self, tmp_path: Path, name: str) -> None:
        path = tmp_path / "log.sbf"
        fixed = block(4006, tow_ms=0, **TestCartesian().fields())
        cov = block(5905, tow_ms=0, xx=1.0, yy=2.0, zz=3.0, xy=0.1, xz=0.2, yz=0.3)
        path.write_bytes(fixed + cov + epoch(1000) + epoch(2000, mode=1) + epoch(3000, error=1))
        whole, one = read(path), read(path, columns=[name])
        assert one.columns == (name,)
        pd.testing.assert_series_equal(one.table[name], whole.table[name])

    def test_order_and_absent_ones(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(epoch(0), columns=["vpl_m", "environment", "hpl_m"])
        assert r.columns == ("vpl_m", "hpl_m")
        assert r.meta.pl.kind == "do229"
        assert len(load(epoch(0), columns=[])) == 1


@pytest.mark.parametrize("chunk_bytes", [1, 70_000, 1 << 20, 32 << 20])
def test_size_of_chunks_changes_nothing(tmp_path: Path, chunk_bytes: int) -> None:
    path = tmp_path / "log.sbf"
    write([recording(1500, seed=5)], path)
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(2)
    data[200_000:200_030] = rng.bytes(900)
    for at in rng.integers(0, len(data), 40):
        data[at] ^= 4
    path.write_bytes(bytes(data[:-7]))
    whole = read(path)
    other = read_in_chunks(path, chunk_bytes)
    pd.testing.assert_frame_equal(other.table, whole.table)
    pd.testing.assert_frame_equal(
        other.side_tables["sbas_frames"], whole.side_tables["sbas_frames"]
    )
    assert other.meta == whole.meta
    assert {"E10", "E24"} <= dict(codes(whole)).keys()


PIECES = st.one_of(
    st.binary(max_size=80),
    st.builds(
        lambda number, revision, body, tow: opaque_block(number | revision << 13, body, tow),
        st.sampled_from([4001, 4006, 4007, 4011, 4020, 4021, 4097, 5903, 5904, 5905, 5906, 5909,
                         5914, 5915, 5921]),
        st.integers(0, 7), st.binary(max_size=90), st.integers(0, 3),
    ),
    st.builds(lambda t, lat: epoch(t, lat=lat), st.integers(0, 3), st.floats()),
    st.builds(lambda number, head, body: with_sub_blocks(number, 0, bytes(head), body),
              st.sampled_from([4008, 4009, 5935]),
              st.lists(st.integers(0, 80), max_size=6), st.binary(max_size=200)),
)  # fmt: skip


@settings(max_examples=150)
@given(st.lists(PIECES, max_size=8))
def test_any_content_gives_a_recording(
    tmp_path_factory: pytest.TempPathFactory, pieces: list[bytes]
) -> None:
    """Hostile fields in blocks with a good CRC: no exception, no level or angle out of range."""
    path = tmp_path_factory.mktemp("fuzz") / "x.sbf"
    path.write_bytes(b"".join(pieces))
    table = read(path).table
    floats = table.select_dtypes("f8")
    assert not np.isinf(floats.to_numpy()).any()
    assert not (floats <= -1e10).any(axis=None)
    assert (table["lat_deg"].abs().fillna(0) <= 90).all()
    assert (table["lon_deg"].abs().fillna(0) <= 180).all()
    assert isinstance(repr(read(path)), str)
    assert 0 <= sniff(path.read_bytes(), b"", b"", path).score <= 98


@pytest.mark.parametrize("size", range(60))
def test_any_short_cut(tmp_path: Path, size: int) -> None:
    path = tmp_path / "x.sbf"
    path.write_bytes(epoch(0)[:size])
    assert len(read(path)) == 0
