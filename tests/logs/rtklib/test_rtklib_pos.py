"""RTKLIB `.pos`: every layout, the reference hour, damage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs.epoch_spool import SpooledEpochs
from sbas.logs.rtklib import rtklib_pos
from sbas.recording import Flag, Recording

FRAME = "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=#)\n"
LLH = (
    "latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)"
    "  sdeu(m)  sdun(m)"
)
PLAIN = f"%  GPST                  {LLH} age(s)  ratio\n"
LEVELS = f"%  GPST                  {LLH} hpl (m) vpl (m)\n"
ROW = (
    "2016/07/12 12:02:13.000   47.530299305   21.628699868   183.8681   3   4   4.0950   2.9371"
    "   8.5337  -2.6241   3.7817  -5.5198"
)


def read(folder: Path, text: str | bytes, **options: object) -> Recording:
    path = folder / "solution.pos"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return rtklib_pos.read(path, **options)  # type: ignore[arg-type]


def codes(recording: Recording) -> list[tuple[str, str]]:
    return [(f.code, f.severity) for f in recording.meta.findings]


def test_reference_hour(reference_data: Path) -> None:
    # Expected: shared/methods/formats.md section 11 and data/PROVENANCE.md.
    recording = rtklib_pos.read(reference_data / "data/egnos_debrecen_2016194/debr194m.pos")
    table = recording.table
    assert len(recording) == 3467
    assert table["hpl_m"].agg(["min", "median", "max"]).tolist() == [7.09, 7.86, 27.39]
    assert table["vpl_m"].agg(["min", "median", "max"]).tolist() == [13.8, 15.1, 45.7]
    assert recording.meta.pl.kind == "do229"
    assert (recording.meta.pl.k_h, recording.meta.pl.k_v) == (6.0, 5.33)
    assert recording.time[0] == np.datetime64("2016-07-12T12:02:13")
    assert recording.time[-1] == np.datetime64("2016-07-12T12:59:59")
    assert set(table["mode"]) == {"sbas"}
    assert recording.meta.findings == ()
    first = table.iloc[0]
    assert first[["lat_deg", "lon_deg", "height_m"]].tolist() == [
        47.530299305,
        21.628699868,
        183.8681,
    ]
    assert first["cov_en_m2"] == pytest.approx(-(2.6241**2), rel=1e-15)
    assert (first["sigma_n_m"], first["sigma_e_m"], first["sigma_u_m"]) == (4.0950, 2.9371, 8.5337)


def test_age_and_ratio_are_no_protection_levels(tmp_path: Path) -> None:
    recording = read(tmp_path, FRAME + PLAIN + ROW + "   2.50    1.3\n")
    assert "hpl_m" not in recording.table
    assert recording.table["correction_age_s"].tolist() == [2.5]
    assert recording.meta.pl.kind == "unknown"


def test_zero_protection_level_is_missing_and_counted(tmp_path: Path) -> None:
    rows = [ROW + "  27.30   45.5\n", ROW.replace(":13.", ":14.") + "   0.00    0.0\n"]
    recording = read(tmp_path, FRAME + LEVELS + "".join(rows))
    assert recording.table["hpl_m"].tolist()[0] == 27.30
    assert np.isnan(recording.table["hpl_m"].iloc[1])
    assert np.isnan(recording.table["vpl_m"].iloc[1])
    assert recording.table["flags"].tolist() == [0, Flag.PL_SENTINEL]
    assert codes(recording) == [("E07", "warning")]
    assert "hpl_m: 1 x 0" in recording.meta.findings[0].evidence


@pytest.mark.parametrize(
    ("k_h", "k_v", "kind"),
    [(6.0, 5.33, "do229"), (6.18, 5.33, "do229"), (5.0, 5.33, "unknown")],
)
def test_factors_are_told_from_levels_and_sigmas(
    tmp_path: Path, k_h: float, k_v: float, kind: str
) -> None:
    # East and north uncorrelated: d_major is the larger sigma, so the level is K times it.
    rows = ""
    for second in range(20):
        sigma = 1.5 + second / 7
        rows += (
            f"2016/07/12 12:02:{second:02d}.000   47.5   21.6   183.0   3   8   {sigma:.4f}   "
            f"1.0000   {2 * sigma:.4f}   0.0000   0.0000   0.0000  {k_h * sigma:.2f}   "
            f"{k_v * 2 * sigma:.1f}\n"
        )
    meta = read(tmp_path, FRAME + LEVELS + rows).meta
    assert meta.pl.kind == kind
    assert meta.pl.k_h == (k_h if kind == "do229" else None)
    assert meta.pl.k_v == k_v


def test_levels_beside_another_mode_are_flagged_and_not_do229(tmp_path: Path) -> None:
    row = ROW.replace("   3   4 ", "   5   4 ")
    recording = read(tmp_path, FRAME + LEVELS + row + "  27.30   45.5\n")
    assert recording.table["mode"].tolist() == ["standalone"]
    assert recording.table["flags"].tolist() == [Flag.PL_OUTSIDE_SBAS]
    assert recording.meta.pl.kind == "unknown"


def test_every_quality_has_its_mode(tmp_path: Path) -> None:
    rows = "".join(
        ROW.replace(":13.", f":{10 + q}.").replace("   3   4 ", f"   {q}   4 ") + "   2.50    1.3\n"
        for q in range(8)
    )
    recording = read(tmp_path, FRAME + PLAIN + rows)
    assert recording.table["mode"].tolist() == [
        "none", "rtk", "rtk", "sbas", "dgnss", "standalone", "other", "other",
    ]  # fmt: skip
    assert recording.table["flags"].tolist() == [0] * 7 + [Flag.DEAD_RECKONING]


def test_degrees_minutes_seconds_with_the_sign_of_minus_zero(tmp_path: Path) -> None:
    header = PLAIN.replace("latitude(deg)", "latitude(d'\")").replace(
        "longitude(deg)", "longitude(d'\")"
    )
    row = "2016/07/12 12:02:13.000   -0 30 00.00000  -71 15 36.00000   183.8681"
    row += "   3   4   1.0   2.0   3.0   0.5   0.1   0.2   2.50    1.3\n"
    recording = read(tmp_path, FRAME + header + row)
    assert recording.table["lat_deg"].tolist() == [-0.5]
    assert recording.table["lon_deg"].tolist() == [pytest.approx(-71.26, abs=1e-13)]
    assert recording.table["height_m"].tolist() == [183.8681]


ECEF = (
    "x-ecef(m)      y-ecef(m)      z-ecef(m)   Q  ns   sdx(m)   sdy(m)   sdz(m)  sdxy(m)"
    "  sdyz(m)  sdzx(m)"
)


@pytest.mark.parametrize(
    ("xyz", "lat_lon_h", "sigmas_enu", "cov_en"),
    [
        # On the equator at Greenwich: east is y, north is z, up is x.
        ((6378237.0, 0.0, 0.0), (0.0, 0.0, 100.0), (2.0, 3.0, 1.0), 0.36),
        # On the equator at 90 E: east is -x, north is z, up is y.
        ((0.0, 6378137.0, 0.0), (0.0, 90.0, 0.0), (1.0, 3.0, 2.0), 0.16),
        # At the north pole on the meridian of Greenwich: east is y, north is -x, up is z.
        ((0.0, 0.0, 6356752.3142), (90.0, 0.0, 0.0), (2.0, 1.0, 3.0), -0.25),
    ],
)
def test_ecef_positions_and_covariances(
    tmp_path: Path,
    xyz: tuple[float, ...],
    lat_lon_h: tuple[float, ...],
    sigmas_enu: tuple[float, ...],
    cov_en: float,
) -> None:
    row = "2016/07/12 12:02:13.000 " + " ".join(f"{v:14.4f}" for v in xyz)
    # sdx sdy sdz, then signed roots: cov_xy 0.25, cov_yz 0.36, cov_zx -0.16.
    row += "   3   4   1.0000   2.0000   3.0000   0.5000   0.6000  -0.4000   2.50    1.3\n"
    header = f"% (x/y/z-ecef=WGS84,Q=1:fix)\n%  GPST                  {ECEF} age(s)  ratio\n"
    recording = read(tmp_path, header + row)
    table = recording.table.iloc[0]
    assert table["lat_deg"] == pytest.approx(lat_lon_h[0], abs=1e-9)
    assert table["lon_deg"] == pytest.approx(lat_lon_h[1], abs=1e-9)
    assert table["height_m"] == pytest.approx(lat_lon_h[2], abs=1e-4)
    found = table[["sigma_e_m", "sigma_n_m", "sigma_u_m"]].tolist()
    assert found == pytest.approx(list(sigmas_enu), rel=1e-9)
    assert table["cov_en_m2"] == pytest.approx(cov_en, rel=1e-6)
    assert recording.meta.frame == "WGS84"
    assert recording.meta.findings == ()


@pytest.mark.parametrize("names", ["hpl (m) vpl (m)", "age(s)  ratio"])
def test_ecef_rows_of_rtklib_ws_have_the_levels_last(tmp_path: Path, names: str) -> None:
    # zsiki/rtklib_ws solution.c, outecef: age, ratio, hpl, vpl, whatever the header names.
    row = "2016/07/12 12:02:13.000 4104000.0 1627000.0 4682000.0 3 4 1.0 1.0 1.0 0.0 0.0 0.0"
    row += "   2.50    1.3  27.30  45.50\n"
    recording = read(tmp_path, f"%  GPST                  {ECEF} {names}\n{row}")
    assert recording.table["hpl_m"].tolist() == [27.30]
    assert recording.table["vpl_m"].tolist() == [45.50]
    assert recording.table["correction_age_s"].tolist() == [2.50]


def test_baselines_are_refused(tmp_path: Path) -> None:
    header = PLAIN.replace(
        "latitude(deg) longitude(deg)  height(m)", "e-baseline(m) n-baseline(m) u-baseline(m)"
    )
    with pytest.raises(InputError, match="baselines") as caught:
        read(tmp_path, header + ROW + "   2.50    1.3\n")
    assert "llh" in caught.value.cure


@pytest.mark.parametrize(
    ("scale", "stamp", "leap"),
    [
        ("GPST", "2009/09/19 00:00:00.000", None),
        ("GPST", "1549  518400.000", None),
        ("UTC ", "2009/09/18 23:59:45.000", 15),
        ("JST ", "2009/09/19 08:59:45.000", 15),
    ],
)
def test_time_scales(tmp_path: Path, scale: str, stamp: str, leap: int | None) -> None:
    # Week 1549, TOW 518400 s = 2009-09-19 00:00:00 GPST = 2009-09-18 23:59:45 UTC (page 11).
    header = PLAIN.replace("GPST", scale)
    recording = read(tmp_path, FRAME + header + ROW.replace(ROW[:23], stamp) + "   2.50    1.3\n")
    assert recording.time.tolist() == [np.datetime64("2009-09-19T00:00:00", "ns").astype(int)]
    assert recording.meta.leap_seconds == leap
    assert recording.meta.time_scale == scale.strip()
    assert len(recording.meta.findings) == (leap is not None)


def test_leap_second_of_2016(tmp_path: Path) -> None:
    # 2016-12-31 23:59:60 UTC is 17 s behind GPS midnight (IERS Bulletin C 52).
    header = FRAME + PLAIN.replace("GPST", "UTC ")
    stamps = ["2016/12/31 23:59:59.000", "2016/12/31 23:59:60.500", "2017/01/01 00:00:00.000"]
    rows = "".join(ROW.replace(ROW[:23], stamp) + "   2.50    1.3\n" for stamp in stamps)
    expected = ["2017-01-01T00:00:16", "2017-01-01T00:00:17.5", "2017-01-01T00:00:18"]
    assert read(tmp_path, header + rows).time.tolist() == [
        np.datetime64(t, "ns").astype(int) for t in expected
    ]
    dropped = read(tmp_path, FRAME + PLAIN + rows)  # no second 60 in GPS time
    assert len(dropped) == 2
    assert codes(dropped) == [("E10", "error")]


def test_geodetic_heights_need_the_undulation(tmp_path: Path) -> None:
    text = FRAME.replace("ellipsoidal", "geodetic") + PLAIN + ROW + "   2.50    1.3\n"
    without = read(tmp_path, text)
    assert np.isnan(without.table["height_m"]).all()
    assert [(f.code, f.severity) for f in without.meta.findings] == [("E25", "warning")]
    assert "--geoid" in without.meta.findings[0].cure
    given_one = read(tmp_path, text, geoid=44.5)
    assert given_one.table["height_m"].tolist() == [183.8681 + 44.5]
    assert codes(given_one) == [("E25", "info")]
    unused = read(tmp_path, FRAME + PLAIN + ROW + "   2.50    1.3\n", geoid=44.5)
    assert unused.table["height_m"].tolist() == [183.8681]
    assert codes(unused) == [("E25", "warning")]


def test_velocities(tmp_path: Path) -> None:
    header = PLAIN.replace(
        "ratio",
        "ratio    vn(m/s)    ve(m/s)    vu(m/s)   sdvn   sdve   sdvu   sdvne   sdveu   sdvun",
    )
    row = ROW + "   2.50    1.3    3.0    4.0    -0.5    0.1   0.1   0.1   0.0   0.0   0.0\n"
    table = read(tmp_path, FRAME + header + row).table.iloc[0]
    assert table[["vel_n_mps", "vel_e_mps", "vel_u_mps", "speed_mps"]].tolist() == [3, 4, -0.5, 5]
    header = (
        f"%  GPST {ECEF} age(s)  ratio vx(m/s) vy(m/s) vz(m/s) sdvx sdvy sdvz sdvxy sdvyz sdvzx\n"
    )
    row = "2016/07/12 12:02:13.000 6378137.0 0.0 0.0 3 4 1 1 1 0 0 0 2.5 1.3"
    row += " 1.0 2.0 3.0 .1 .1 .1 0 0 0\n"
    table = read(tmp_path, header + row).table.iloc[0]
    assert table[["vel_u_mps", "vel_e_mps", "vel_n_mps"]].tolist() == [1, 2, 3]


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_other_separators_and_line_ends(tmp_path: Path, separator: str) -> None:
    def joined(line: str) -> str:
        return separator.join(line.replace(" (m)", "_(m)").split()).replace("_(m)", " (m)")

    header = "%  GPST                  " + separator + joined(LLH + " hpl (m) vpl (m)")
    row = ROW[:23] + separator + joined(ROW[23:] + " 27.30 45.5")
    recording = read(tmp_path, f"{FRAME}{header}\n{row}\n".replace("\n", "\r\n"))
    assert recording.table["hpl_m"].tolist() == [27.30]
    assert recording.table["lat_deg"].tolist() == [47.530299305]


def test_line_ends_of_old_macs_are_recognised(tmp_path: Path) -> None:
    text = (FRAME + LEVELS + ROW + "  27.30   45.5\n").replace("\n", "\r").encode()
    assert rtklib_pos.sniff(text, text, text, tmp_path / "roof.pos").score == 95
    recording = read(tmp_path, text.decode())
    assert recording.table["hpl_m"].tolist() == [27.30]
    assert codes(recording) == [("E19", "info")]


def test_a_cut_last_line_never_becomes_a_figure(tmp_path: Path) -> None:
    whole = [ROW.replace(":13.", f":{s}.") + "  27.30   45.5" for s in range(10, 60)]
    text = FRAME + LEVELS + "\n".join(whole)
    for cut in range(1, len(whole[-1])):
        recording = read(tmp_path, text[:-cut])
        assert len(recording) == 49
        assert set(recording.table["vpl_m"]) == {45.5}
        assert codes(recording) == [("E10", "error")]


def test_damaged_lines_are_counted_and_left_out(tmp_path: Path) -> None:
    whole = [
        ROW.replace("12:02:13", f"{h:02d}:{m:02d}:13") + "  27.30   45.5\n"
        for h in range(20)
        for m in range(60)
    ]
    whole[100] = whole[100][:70] + "\n"
    whole[200] = whole[200].replace("47.5302", "47.x302")
    whole[300] = whole[300].replace("2016/07/12", "2016/13/12")
    whole[400] = whole[400][:40] + "\0" * 50 + whole[400][40:]
    recording = read(tmp_path, FRAME + LEVELS + "".join(whole))
    assert len(recording) == 1196
    assert ("E10", "warning") in codes(recording)
    assert ("E19", "warning") in codes(recording)
    assert "4 of 1,200" in next(f.message for f in recording.meta.findings if f.code == "E10")


def test_second_header(tmp_path: Path) -> None:
    rows = FRAME + LEVELS + ROW + "  27.30   45.5\n"
    assert len(read(tmp_path, rows + rows)) == 2
    with pytest.raises(InputError, match="two layouts"):
        read(tmp_path, rows + FRAME + PLAIN + ROW + "   2.50    1.3\n")


def test_no_header_and_no_rows(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no header line"):
        read(tmp_path, ROW + "  27.30   45.5\n")
    with pytest.raises(InputError, match="E15"):
        read(tmp_path, FRAME + LEVELS)
    with pytest.raises(InputError, match="E10: no line"):
        read(tmp_path, FRAME + LEVELS + "2016/07/12 12:02:13.000 1 2 3\n")


def test_only_asked_columns(tmp_path: Path) -> None:
    text = FRAME + LEVELS + ROW + "  27.30   45.5\n"
    assert list(read(tmp_path, text, columns=["vpl_m", "herl_m"]).table) == ["vpl_m", "herl_m"]


def test_progress_reaches_the_end(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    read(
        tmp_path,
        FRAME + LEVELS + ROW + "  27.30   45.5\n",
        progress=lambda a, b: seen.append((a, b)),
    )
    assert seen[-1][0] == seen[-1][1] > 0


HEADED = (FRAME + LEVELS).encode()


@given(
    st.one_of(
        st.binary(max_size=400),
        st.binary(max_size=300).map(lambda b: HEADED + ROW.encode() + b),
        st.text("0123456789.-/: \t\n%nahpl()", max_size=300).map(lambda t: HEADED + t.encode()),
    )
)
def test_any_bytes_give_a_recording_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    try:
        recording = read(tmp_path_factory.mktemp("fuzz"), data)
    except InputError:
        return
    assert len(recording) > 0
    assert not (recording.table["hpl_m"] == 0).any()


@pytest.mark.parametrize(
    ("levels", "missing", "shown"),
    [
        ("65535 45.5", (True, False), "hpl_m: 1 x 65535"),
        ("655.35 655.35", (True, True), "vpl_m: 1 x 655.35"),
        ("4294967295 45.5", (True, False), "hpl_m: 1 x 4294967295"),
        ("-2e10 -2e10", (True, True), "hpl_m: 1 x -2e10"),
        ("inf 45.5", (True, False), "hpl_m: 1 x infinite"),
        ("8000 100", (True, True), "8000 (beside VPL 100)"),
    ],
)
def test_sentinel_levels_are_missing_flagged_and_counted(
    tmp_path: Path, levels: str, missing: tuple[bool, bool], shown: str
) -> None:
    rows = ROW + "  27.30   45.5\n" + ROW.replace(":13.", ":14.") + f"  {levels}\n"
    recording = read(tmp_path, FRAME + LEVELS + rows)
    table = recording.table
    assert tuple(table[["hpl_m", "vpl_m"]].iloc[1].isna()) == missing
    assert table["hpl_m"].iloc[0] == 27.30
    assert table["flags"].tolist() == [0, Flag.PL_SENTINEL]
    assert codes(recording) == [("E07", "warning")]
    assert shown in recording.meta.findings[0].evidence


def test_sentinel_positions_are_missing_flagged_and_counted(tmp_path: Path) -> None:
    zero = ROW.replace("47.530299305", "0.0").replace("21.628699868", "0.0")
    recording = read(tmp_path, FRAME + LEVELS + zero + "  27.30   45.5\n")
    assert recording.table[["lat_deg", "lon_deg"]].isna().all(axis=None)
    assert recording.table["flags"].tolist() == [Flag.POSITION_SENTINEL]
    assert "lat_deg: 1 x (0, 0)" in recording.meta.findings[0].evidence
    row = "2016/07/12 12:02:13.000  0.0  0.0  0.0   3   4" + "  1.0" * 6 + "  2.50  1.3\n"
    recording = read(tmp_path, PLAIN.replace(LLH, ECEF) + row)
    assert recording.table[["lat_deg", "lon_deg", "height_m"]].isna().all(axis=None)
    assert recording.table["flags"].tolist() == [Flag.POSITION_SENTINEL]
    assert codes(recording)[-1] == ("E07", "warning")


@pytest.mark.parametrize(
    ("old", "new", "shown"),
    [
        ("height(m)", "heigth(m)", "heigth(m)"),
        ("sdu(m)", "sdV(m)", "sdV(m)"),
        ("longitude(deg)", "longitde(deg)", "longitde(deg)"),
        ("   Q  ", "   q  ", "unknown columns: q"),
        ("hpl (m)", "hpl (km)", "(km)"),
        ("   Q  ", "  ", "lacks Q"),
        ("  height(m)", "", "lacks height"),
    ],
)
def test_a_header_with_unknown_or_lacking_names_is_refused(
    tmp_path: Path, old: str, new: str, shown: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, FRAME + LEVELS.replace(old, new) + ROW + "  27.30   45.5\n")
    assert shown in caught.value.what
    assert caught.value.cure


def test_velocities_and_sigmas_that_lack_one_are_read(tmp_path: Path) -> None:
    header = LEVELS.replace("sdu(m)", "").replace("\n", " vn(m/s) ve(m/s) vu(m/s) sdvn\n")
    row = ROW.replace("8.5337", "") + " 27.30 45.5 1.0 2.0 3.0 0.1\n"
    recording = read(tmp_path, FRAME + header + row)
    assert recording.table["vel_e_mps"].tolist() == [2.0]
    assert "sigma_u_m" not in recording.table


# Long files: piece by piece as at once


def same(folder: Path, text: str, **options: object) -> None:
    """That a file says the same at once and piece by piece."""
    try:
        whole = read(folder, text, **options)
    except InputError as error:
        whole, code = None, error.code
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rtklib_pos, "WHOLE_BYTES", 0)
        patch.setattr("sbas.logs.epoch_spool.PIECE_ROWS", 3)
        patch.setattr("sbas.logs.text_input.BLOCK_BYTES", 700)
        if whole is None:
            with pytest.raises(InputError) as caught:
                rtklib_pos.scan(folder / "solution.pos", **options)  # type: ignore[arg-type]
            assert caught.value.code == code
            return
        source = rtklib_pos.scan(folder / "solution.pos", **options)  # type: ignore[arg-type]
    assert isinstance(source, SpooledEpochs)
    assert source.columns == whole.columns
    assert source.meta == whole.meta
    pd.testing.assert_frame_equal(pd.concat(source.batches(source.columns)), whole.table)


LEVEL_CELLS = [
    "  27.30   45.5",
    "   0.00    0.0",
    "8000 100",
    "65535 45.5",
    "nan 45.5",
    "27.3",
    "x 1",
]


@given(
    st.lists(st.sampled_from([0] * 12 + [1, 2, 3, 4, 5, 6]), min_size=1, max_size=40),
    st.sampled_from(["GPST", "UTC ", "JST "]),
    st.sampled_from(["ellipsoidal", "geodetic"]),
    st.sampled_from([{}, {"geoid": 44.5}, {"columns": ["hpl_m"]}]),
    st.integers(0, 30),
)
def test_piece_by_piece_is_as_at_once(
    tmp_path_factory: pytest.TempPathFactory,
    levels: list[int],
    scale: str,
    height: str,
    options: dict[str, object],
    cut: int,
) -> None:
    rows = "".join(
        ROW.replace(":13.", f":{k:02d}.") + LEVEL_CELLS[cell] + "\n"
        for k, cell in enumerate(levels)
    )
    text = FRAME.replace("ellipsoidal", height) + LEVELS.replace("GPST", scale) + rows
    same(tmp_path_factory.mktemp("pieces"), text[: len(text) - cut], **options)


@pytest.mark.parametrize("late", ["26.30", "27.30"])
def test_the_kind_of_levels_is_that_of_all_pieces(tmp_path: Path, late: str) -> None:
    # d_major of ROW is 4.55: 27.30 is 6.00 times it.
    row = ROW + "  27.30   45.5\n"
    rows = "".join(row.replace(":13.", f":{k:02d}.") for k in range(20))
    rows += row.replace("27.30", late).replace(":13.", ":59.")
    same(tmp_path, FRAME + LEVELS + rows)
    kind = read(tmp_path, FRAME + LEVELS + rows).meta.pl.kind
    assert kind == ("do229" if late == "27.30" else "unknown")


def test_the_reference_hour_piece_by_piece(tmp_path: Path, reference_data: Path) -> None:
    path = reference_data / "data/egnos_debrecen_2016194/debr194m.pos"
    same(tmp_path, path.read_text())


def test_the_encoding_and_long_lines_as_asked(tmp_path: Path) -> None:
    text = FRAME + LEVELS + ROW + "  27.30   45.5\n"
    assert len(read(tmp_path, text.encode("utf-16-le"), encoding="utf-16-le")) == 1
    with pytest.raises(InputError, match="E18"):
        read(tmp_path, text, max_line=50)
