"""The NMEA reader: sentences by the book, dates, damage, chunks, sniffing."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.logs.arrow import parquet
from sbas.logs.delimited import delimited_text
from sbas.logs.nmea import nmea
from sbas.logs.nmea.nmea import read, read_in_chunks, scan
from sbas.logs.rtklib import rtklib_pos
from sbas.logs.septentrio import septentrio_sbf
from sbas.recording import Flag, Recording
from tests.logs.nmea.nmea_samples import angle, gga, log, rmc, sentence

# The check line of the methods page, section 11: 50.0345, 15.7712, height 289.8.
LINE = b"$GPGGA,093000.00,5002.0700,N,01546.2720,E,2,08,1.1,245.3,M,44.5,M,3.0,0120*47\r\n"
DAY = "2025-05-23"
# A DOP block of pysbf2's tests (methods page, section 11).
DOP = bytes.fromhex("244057f9a10f2000e052c91c3f0925004f0028002c004200f5e77840fc96b540")
UBX = b"\xb5\x62\x01\x22\x00\x00\x23\x6a"
RTCM = bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98")
"""Message 1005, the example of RTCM 10403.3, 4.2."""


def put(folder: Path, data: bytes, name: str = "log.nmea") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def of(folder: Path, *lines: bytes, **options: Any) -> Recording:
    return read(put(folder, b"".join(lines)), **options)


def codes(recording: Recording, severity: str = "") -> list[str]:
    return [f.code for f in recording.meta.findings if severity in ("", f.severity)]


def said(recording: Recording, words: str) -> str:
    """Evidence of the one finding whose message has these words."""
    found = [f for f in recording.meta.findings if words in f.message]
    assert len(found) == 1, recording.meta.findings
    return found[0].evidence


def flagged(table: pd.DataFrame, flag: Flag) -> list[bool]:
    bits = table["flags"].to_numpy() & np.uint32(flag)
    found: list[bool] = (bits != 0).tolist()
    return found


def test_the_check_line_of_the_methods_page(tmp_path: Path) -> None:
    assert gga("093000.00") == LINE
    row = of(tmp_path, LINE, date=DAY).table
    # 09:30:00 UTC was 09:30:18 GPS time in 2025 (IERS Bulletin C 52).
    assert row.index[0] == pd.Timestamp("2025-05-23 09:30:18")
    got = row.iloc[0]
    assert got["lat_deg"] == 50 + 2.07 / 60
    assert got["lon_deg"] == pytest.approx(15.7712, abs=1e-12)
    assert got["height_m"] == pytest.approx(289.8, abs=1e-12)
    assert (got["mode"], got["n_sv"], got["hdop"], got["correction_age_s"]) == ("dgnss", 8, 1.1, 3)
    assert (got["x_undulation_m"], got["x_station_id"]) == (44.5, 120)
    assert np.isnan([got["hpl_m"], got["vpl_m"]]).all()
    assert got["flags"] == Flag.DATE_INFERRED


def test_the_real_vehicle_log(reference_data: Path) -> None:
    """Sentences between UBX frames, u-blox, 2008; counts by a regular expression over the file."""
    path = reference_data / "data" / "msas_vehicle_2008147" / "ubx_20080526.ubx"
    recording = read(path)
    assert len(recording) == 242
    # PROVENANCE.md: the file ends at 06:03:26 GPS time.
    assert str(recording.time[-1]) == "2008-05-26T06:03:26.000000000"
    assert recording.meta.leap_seconds == 14
    first = recording.table.iloc[0]
    # $GPGGA,055911.00,3552.37449,N,13823.38721,E,2,08,1.17,956.1,M,38.3,M,999.9,*7C
    assert first["lat_deg"] == pytest.approx(35 + 52.37449 / 60, abs=1e-12)
    assert first["height_m"] == pytest.approx(994.4, abs=1e-9)
    assert np.isnan(first["correction_age_s"])
    # Three GSV: 12 satellites in view, one of them without signal strength.
    assert (first["n_sv"], first["n_sv_tracked"], first["pdop"]) == (8, 11, 2.26)
    assert said(recording, "no UBX, SBF or RTCM frame").endswith("UBX frames")
    assert codes(recording, "error") == []


def test_modes(tmp_path: Path) -> None:
    """GGA quality and the words for it: methods page, section 1."""
    expected = ["none", "standalone", "dgnss", "other", "rtk", "rtk", "other", "other", "other"]
    lines = [gga(f"09{q:02d}00.00", quality=q) for q in range(9)]
    table = of(tmp_path, *lines, date=DAY).table
    assert table["mode"].tolist() == expected
    assert flagged(table, Flag.DEAD_RECKONING) == [q == 6 for q in range(9)]
    recording = of(tmp_path, *lines, date=DAY, assume_dgps="sbas")
    assert recording.table["mode"].tolist()[2] == "sbas"
    assert "1 epochs" in said(recording, "does not tell SBAS")
    words = {"NN": "none", "AN": "standalone", "NDA": "dgnss", "RA": "rtk", "FF": "rtk",
             "E": "other", "P": "other", "S": "other"}  # fmt: skip
    for letters, mode in words.items():
        line = sentence(
            f"GNGNS,093000.00,5002.07,N,01546.272,E,{letters},17,0.8,245.3,44.5,3.0,0120,S"
        )
        got = of(tmp_path, line, date=DAY).table.iloc[0]
        assert got["mode"] == mode
        assert got["n_sv"] == 17
    for mode_field, status, mode in ((",D", "A", "dgnss"), ("", "A", None), (",N", "V", "none")):
        got = of(tmp_path, rmc("093000.00", status=status, mode=mode_field)).table["mode"]
        assert got.isna().all() if mode is None else got.iloc[0] == mode


def test_ashtech_and_u_blox_sentences(tmp_path: Path) -> None:
    """PASHR,POS as printed in gpsd's www/NMEA.adoc; PUBX,00 as in the u-blox M8 manual, 31.3.2."""
    pashr = sentence(
        "PASHR,POS,1,10,125410.00,5525.8138702,N,03833.9587380,E,131.555,1.0,90.0,10.0,-0.001,"
        "2.0,1.0,1.7,1.0,34"
    )
    got = of(tmp_path, pashr, sentence("PASHR,125411.00,1.0,T,1,1,1,1,1,1,1"), date=DAY).table
    assert len(got) == 1
    row = got.iloc[0]
    assert row["lat_deg"] == 55 + 25.8138702 / 60
    assert (row["height_m"], row["mode"], row["n_sv"], row["correction_age_s"]) == (
        131.555, "dgnss", 10, 1.0,
    )  # fmt: skip
    assert row["vel_e_mps"] == pytest.approx(10 * 1852 / 3600)
    assert (row["pdop"], row["hdop"], row["vdop"], row["vel_u_mps"]) == (2.0, 1.0, 1.7, -0.001)
    pubx = b"$PUBX,00,081350.00,4717.113210,N,00833.915187,E,546.589,G3,2.1,2.0,0.007,77.52,"
    pubx += b"0.007,,0.92,1.19,0.77,9,0,0*5F\r\n"
    row = of(tmp_path, pubx, date=DAY).table.iloc[0]
    assert row["lat_deg"] == 47 + 17.113210 / 60
    assert (row["height_m"], row["mode"], row["n_sv"], row["vel_u_mps"]) == (
        546.589, "standalone", 9, -0.007,
    )  # fmt: skip
    assert row["speed_mps"] == pytest.approx(0.007 / 3.6)
    assert (row["x_h_accuracy_m"], row["x_v_accuracy_m"], row["vdop"]) == (2.1, 2.0, 1.19)
    flat = sentence(pubx[1:].split(b"*")[0].decode().replace("G3", "D2"))
    row = of(tmp_path, flat, date=DAY).table.iloc[0]
    assert row["mode"] == "dgnss"
    assert row["flags"] & Flag.TWO_DIMENSIONAL


def test_error_statistics(tmp_path: Path) -> None:
    """GST of the NMEA manual: semi-axes 23 and 3 m at 45 deg give 260 m^2; GBS stays aside."""
    gst = sentence("GPGST,093000.00,0.006,23,3,45,16.401,16.401,0.031")
    gbs = sentence("GPGBS,093000.00,0.031,0.032,0.186,19,0.01,-0.354,6.972")
    row = of(tmp_path, LINE, gst, gbs, date=DAY).table.iloc[0]
    assert row["cov_en_m2"] == pytest.approx((23**2 - 3**2) / 2)
    assert (row["sigma_n_m"], row["sigma_e_m"], row["sigma_u_m"]) == (16.401, 16.401, 0.031)
    assert row["x_gbs_failed_sv"] == 19
    assert (row["x_gbs_bias_m"], row["x_gbs_sigma_e_m"]) == (-0.354, 0.032)
    odd = of(tmp_path, LINE, sentence("GPGST,093000.00,1,23,3,45,1,1,0"), date=DAY)
    assert odd.table[["cov_en_m2", "sigma_u_m"]].isna().all(axis=None)
    assert said(odd, "ellipses contradict") == "1 epochs"
    late = of(tmp_path, LINE, sentence("GPGST,092959.00,1,2,1,45,1,1,1"), date=DAY)
    assert np.isnan(late.table["sigma_e_m"].iloc[0])
    assert "belong to no epoch" in str(late.meta.findings)


@pytest.mark.parametrize(
    ("ids", "tail", "talker", "prn"),
    [
        ("01,02,33", "", "GP", 120), ("01,02,64", ",1", "GN", 151), ("01,33,44", "", "GP", 0),
        ("01,02,32", "", "GP", -1), ("33,34,02", ",3", "GN", -1), ("33,34,02", "", "GA", -1),
        ("65,66,88", "", "GN", -1),
    ],
)  # fmt: skip
def test_satellites_of_gsa(tmp_path: Path, ids: str, tail: str, talker: str, prn: int) -> None:
    """Ids 33 to 64 are SBAS (PRN - 87) only among GPS ids, for Galileo has 33 to 36 itself."""
    gsa = sentence(f"{talker}GSA,A,2,{ids},,,,,,,,,,1.9,1.1,1.5{tail}")
    row = of(tmp_path, LINE, gsa, date=DAY).table.iloc[0]
    assert row["geo_prn"] == prn
    assert (row["pdop"], row["vdop"]) == (1.9, 1.5)
    assert row["flags"] & Flag.TWO_DIMENSIONAL
    assert row["n_sv"] == 8


def test_a_capped_count_yields_to_what_gsa_lists(tmp_path: Path) -> None:
    gsa = sentence("GNGSA,A,3,01,02,03,04,05,06,07,08,09,10,11,12,1.9,1.1,1.5,1")
    more = sentence("GNGSA,A,3,65,66,67,,,,,,,,,,1.9,1.1,1.5,2")
    capped = of(tmp_path, gga("093000.00", n="12"), gsa, more, date=DAY)
    assert capped.table["n_sv"].tolist() == [15]
    assert said(capped, "GSA lists more") == "1 epochs"
    stated = of(tmp_path, gga("093000.00", n="14"), gsa, more, date=DAY)
    assert stated.table["n_sv"].tolist() == [14]
    apart = of(tmp_path, gga("093000.00", n="12"), gsa, rmc("093000.00"), more)
    assert apart.table["n_sv"].tolist() == [12]
    assert "apart from the first" in str(apart.meta.findings)


def test_tracked_satellites_need_all_their_sentences(tmp_path: Path) -> None:
    one = sentence("GPGSV,2,1,05,01,40,083,46,02,17,308,41,12,07,344,39,14,22,228,,1")
    two = sentence("GPGSV,2,2,05,22,30,150,44,1")
    other = sentence("GLGSV,1,1,01,65,40,083,46")
    second_signal = sentence("GPGSV,1,1,01,01,40,083,40,6")
    for lines, expected in (
        ((one, two, other, second_signal), 5), ((one, other), -1), ((two,), -1), ((), -1),
        ((one, two, one, two), -1), ((one, one), -1),
    ):  # fmt: skip
        assert of(tmp_path, LINE, *lines, date=DAY).table["n_sv_tracked"].tolist() == [expected]
    torn = other.replace(b"40", b"41")
    assert of(tmp_path, LINE, one, two, torn, date=DAY).table["n_sv_tracked"].tolist() == [-1]


def test_dates(tmp_path: Path) -> None:
    """RMC or ZDA of the epoch, else counted on over midnight, else the option."""
    zda = sentence("GPZDA,235959.00,31,12,2016,00,00")
    lines = (gga("235958.00"), gga("235959.00"), zda, gga("235960.00"), gga("000000.00"))
    recording = of(tmp_path, *lines)
    # The leap second at the end of 2016 (IERS Bulletin C 52): GPST - UTC was 17 s, then 18 s.
    assert [str(t)[:19] for t in recording.time] == [
        "2017-01-01T00:00:15", "2017-01-01T00:00:16", "2017-01-01T00:00:17", "2017-01-01T00:00:18",
    ]  # fmt: skip
    inferred = flagged(recording.table, Flag.DATE_INFERRED)
    assert inferred == [True, False, True, True]
    assert said(recording, "without a date of their own").startswith("3 of 4 epochs")
    with pytest.raises(InputError, match="no date") as caught:
        of(tmp_path, LINE)
    assert "--date" in caught.value.cure
    assert str(of(tmp_path, rmc("093000.00", "230599")).time[0])[:10] == "1999-05-23"
    assert str(of(tmp_path, rmc("093000.00", "230580")).time[0])[:10] == "1980-05-23"
    unused = of(tmp_path, rmc("093000.00"), date="2001-01-01")
    assert str(unused.time[0])[:10] == DAY
    assert said(unused, "dates of its own") == "given 2001-01-01"
    for wrong in ("2025-02-30", "23.5.2025", "1970-01-01"):
        with pytest.raises(InputError, match="is no date"):
            of(tmp_path, LINE, date=wrong)


def test_a_date_beside_a_warning_counts_only_where_there_is_no_better(tmp_path: Path) -> None:
    cold = rmc("000010.00", "060180", status="V")
    recording = of(tmp_path, cold, rmc("000011.00"))
    assert [str(t)[:10] for t in recording.time] == [DAY, DAY]
    assert str(of(tmp_path, cold).time[0])[:10] == "1980-01-06"
    assert str(of(tmp_path, rmc("000010.00", "310225"), rmc("000011.00")).time[0])[:10] == DAY


def test_zda_of_another_time_and_other_dates(tmp_path: Path) -> None:
    zda = sentence("GPZDA,000000.00,24,05,2025,00,00")
    recording = of(tmp_path, gga("235959.80"), zda, gga("000000.20"))
    assert [str(t)[:21] for t in recording.time] == [
        "2025-05-24T00:00:17.8", "2025-05-24T00:00:18.2",
    ]  # fmt: skip
    clash = of(tmp_path, rmc("093000.00"), sentence("GPZDA,093000.00,24,05,2025,00,00"))
    assert str(clash.time[0])[:10] == "2025-05-24"
    assert said(clash, "different dates") == "1 epochs"


def test_midnight_at_ten_hertz(tmp_path: Path) -> None:
    """GGA at 10 Hz with RMC at 1 Hz; two and three decimals of the second."""
    lines = [rmc("235959.00", "310524")]
    lines += [gga(f"235959.{k}00") for k in range(10)]
    lines += [gga("000000.0"), rmc("000000.00", "010624"), gga("000000.100")]
    recording = of(tmp_path, *lines)
    steps = np.diff(recording.time).astype(int)
    assert len(recording) == 12
    assert set(steps.tolist()) == {100_000_000}
    assert str(recording.time[0]) == "2024-06-01T00:00:17.000000000"


def test_no_fix_no_position(tmp_path: Path) -> None:
    null = "0000.0000,N,00000.0000,E"
    recording = of(tmp_path, gga("093000.00", null, quality=0), gga("093001.00", quality=0),
                   gga("093002.00"), rmc("093002.00", status="V"), gga("093003.00", ",,,"),
                   gga("093004.00"))  # fmt: skip
    assert np.isnan(recording.table["lat_deg"]).tolist() == [True] * 4 + [False]
    assert np.isnan(recording.table["height_m"]).tolist() == [True] * 3 + [False] * 2
    marked = flagged(recording.table, Flag.POSITION_SENTINEL)
    assert marked == [True, True, True, False, False]
    assert "lat_deg: 1 x (0, 0)" in said(recording, "stand for 'missing'")
    assert said(recording, "declared invalid").startswith("2 epochs")
    assert said(recording, "status V").startswith("1 epochs")


def test_heights_need_a_separation(tmp_path: Path) -> None:
    bare = gga("093000.00", sep="")
    without = of(tmp_path, bare, date=DAY)
    assert np.isnan(without.table["height_m"].iloc[0])
    assert said(without, "no height") == "1 epochs"
    given_ = of(tmp_path, bare, gga("093001.00"), date=DAY, geoid=45.0)
    assert given_.table["height_m"].tolist() == pytest.approx([290.3, 289.8])
    assert said(given_, "made ellipsoidal") == "1 epochs, undulation 45 m"
    assert given_.meta.geoid == "45 m as given"
    assert np.isnan(of(tmp_path, gga("093000.00", unit="f"), date=DAY).table["height_m"].iloc[0])


def test_differing_positions(tmp_path: Path) -> None:
    near = rmc("093000.00", where="5002.07,N,01546.27,E")
    assert "E06" not in codes(of(tmp_path, LINE, near))
    far = rmc("093000.00", where="5002.0900,N,01546.2720,E")
    recording = of(tmp_path, far, LINE)
    assert recording.table["lat_deg"].iloc[0] == 50 + 2.07 / 60
    assert said(recording, "different positions") == "1 epochs, by up to 37 m in an axis"


def test_impossible_fields_are_missing_and_counted(tmp_path: Path) -> None:
    lat = ("5060.0000,N", "9000.0001,N", "5002.0700,X", "-502.0700,N", "5002.07.0,N")
    bad = (*(f"{each},01546.2720,E" for each in lat), "5002.0700,N,18000.0001,W")
    recording = of(tmp_path, *(gga(f"0930{i:02d}.00", w) for i, w in enumerate(bad)), date=DAY)
    assert recording.table[["lat_deg", "lon_deg"]].isna().any(axis=1).all()
    assert said(recording, "no possible value") == f"{len(bad)} fields"
    times = ("240000.00", "096000.00", "093061.00", "93000.00", "+93000.00", "", "0930000.0")
    recording = of(tmp_path, LINE, *map(gga, times), date=DAY)
    assert len(recording) == 1
    assert said(recording, "no usable time") == f"{len(times)} sentences"


def test_repeated_lines_and_second_receivers_show_as_repeated_epochs(tmp_path: Path) -> None:
    recording = of(tmp_path, LINE, rmc("093000.00"), LINE, rmc("093000.00"), gga("093001.00"))
    assert [str(t)[17:19] for t in recording.time] == ["18", "18", "19"]
    other = gga("093000.00", "5002.0800,N,01546.2720,E", talker="GN")
    assert len(of(tmp_path, LINE, other, rmc("093000.00"))) == 2


def test_checksums(tmp_path: Path) -> None:
    wrong = LINE.replace(b"*47", b"*46")
    bare = LINE.replace(b"*47", b"")
    lines = [gga(f"09{m:02d}{s:02d}.00") for m in range(10) for s in range(60)]
    one = of(tmp_path, wrong, *lines, date=DAY)
    assert len(one) == 600
    assert codes(one, "warning")[0] == "E10"
    for bad, cut in ((wrong, wrong), (bare, bare), (LINE[20:], LINE[20:]), (b"", LINE[:40])):
        many = of(tmp_path, bad * 30, *lines, cut, date=DAY)
        assert len(many) == 600
        found = codes(many, "error")
        assert found in ([["E10"], ["E24"]] if bad else [[]])
    optional = of(tmp_path, bare, wrong, gga("093001.00"), bare[:-2], date=DAY,
                  nmea_checksum="optional")  # fmt: skip
    assert len(optional) == 2
    lower = gga("093000.00", alt="245.9")
    assert lower[-4:-2] != lower[-4:-2].lower()
    assert len(of(tmp_path, lower[:-4] + lower[-4:-2].lower() + b"\n", date=DAY)) == 1
    with pytest.raises(InputError, match="nmea_checksum cannot be"):
        of(tmp_path, LINE, nmea_checksum="no")
    with pytest.raises(InputError, match="assume_dgps cannot be"):
        of(tmp_path, LINE, assume_dgps="rtk")


def test_sentences_beyond_any_length(tmp_path: Path) -> None:
    long = gga("093001.00", station="0" * 2000)
    recording = of(tmp_path, LINE, long, date=DAY)
    assert len(recording) == 1
    finding = next(f for f in recording.meta.findings if f.code == "E18")
    assert (finding.severity, finding.where) == ("error", f"first at byte {len(LINE)}")
    assert len(of(tmp_path, gga("093001.00", station="0" * 900), date=DAY)) == 1


def test_binary_frames_between_sentences_are_no_damage(tmp_path: Path) -> None:
    gsa = sentence("GPGSA,A,3,01,02,03,,,,,,,,,,1.9,1.1,1.5")
    for frame in (UBX, DOP, RTCM):
        recording = of(tmp_path, LINE, frame * 3, gsa, frame, date=DAY)
        assert set(codes(recording)) == {"E25"}
        assert recording.table["pdop"].tolist() == [1.9]
        assert not recording.table["flags"].iloc[0] & Flag.EPOCH_INCOMPLETE
    damaged = of(tmp_path, LINE, UBX[:-1] + b"\0", gsa, date=DAY)
    assert np.isnan(damaged.table["pdop"].iloc[0])
    assert damaged.table["flags"].iloc[0] & Flag.EPOCH_INCOMPLETE
    assert said(damaged, "belong to no sentence and no").startswith("8 of")


def test_columns_asked_for(tmp_path: Path) -> None:
    path = put(tmp_path, b"".join(log(40)))
    whole = read(path).table
    for name in whole.columns:
        alone = read(path, columns=[name]).table
        pd.testing.assert_frame_equal(alone, whole[[name]], obj=name)
    assert list(read(path, columns=["herl_m", "lat_deg"]).table) == ["lat_deg"]


def test_a_file_without_epochs(tmp_path: Path) -> None:
    recording = of(tmp_path, sentence("GPGSV,1,1,00"), sentence("GPZDA,000000.00,24,05,2025,00,00"))
    assert len(recording) == 0
    assert list(recording.table) == list(nmea.FILLED)
    batches = list(scan(put(tmp_path, sentence("GPTXT,hello"))).batches(["lat_deg", "mode"]))
    assert [len(b) for b in batches] == [0]


def noisy(seed: int = 3) -> bytes:
    """A log with damage, binary frames, comments and a clock that stands for a while."""
    rng = np.random.default_rng(seed)
    parts = log(60, step_s=20.0)
    parts[7] = parts[7].replace(b"GGA", b"GGB")
    parts[11:11] = [parts[10]] * 3
    parts[20] += UBX + b"# note" + RTCM
    data = bytearray(b"".join(parts))
    for at in rng.integers(0, len(data), 25):
        data[at] = rng.integers(0, 256)
    return bytes(data)


def test_the_size_of_chunks_changes_nothing(tmp_path: Path) -> None:
    path = put(tmp_path, noisy())
    whole = read_in_chunks(path, 1 << 25)
    for size in (701, 5_000, 1 << 16):
        part = read_in_chunks(path, size)
        pd.testing.assert_frame_equal(part.table, whole.table)
        assert part.meta == whole.meta


def test_scanning_gives_what_reading_gives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nmea, "CHUNK_BYTES", 4_000)
    monkeypatch.setattr(nmea, "BATCH_EPOCHS", 10)
    path = put(tmp_path, noisy())
    whole, source = read(path), scan(path)
    assert source.meta == whole.meta
    assert source.columns == whole.columns
    batches = list(source.batches([*whole.columns, "herl_m"]))
    assert len(batches) > 3
    found = pd.concat(batches)
    assert found["herl_m"].isna().all()
    pd.testing.assert_frame_equal(found[list(whole.columns)], whole.table)


CLEAN = log(30, seed=5)
UNTIMED = ["hdop", "vdop", "pdop", "n_sv", "n_sv_tracked", "geo_prn"]


@given(st.integers(0, 29), st.data())
def test_damage_stays_in_its_epoch(
    tmp_path_factory: pytest.TempPathFactory, epoch: int, data: st.DataObject
) -> None:
    """Bytes changed in one epoch leave the others' values; the epoch before may lose what its
    untimed sentences told, since the damage may have been part of it."""
    folder = tmp_path_factory.getbasetemp()
    clean = of(folder, *CLEAN).table
    hurt = bytearray(CLEAN[epoch])
    for _ in range(data.draw(st.integers(1, 4))):
        hurt[data.draw(st.integers(0, len(hurt) - 1))] ^= data.draw(st.integers(1, 255))
    entries = [*CLEAN[:epoch], bytes(hurt), *CLEAN[epoch + 1 :]]
    got = of(folder, *entries).table
    others = clean.index != clean.index[epoch]
    assert clean.index[others].isin(got.index).all()
    kept = got.loc[clean.index[others]]
    timed = [n for n in clean.columns if n not in (*UNTIMED, "flags")]
    pd.testing.assert_frame_equal(kept[timed], clean.loc[others, timed])
    for name in UNTIMED:
        same = kept[name].eq(clean.loc[others, name]) | (
            kept[name].isna() & clean.loc[others, name].isna()
        )
        missing = kept[name].isna() | kept[name].eq(-1)
        before = kept.index == clean.index[max(epoch - 1, 0)]
        assert (same | (missing & before)).all()


SCRAPS = [LINE, UBX, DOP, RTCM, b"$GPGGA,", b"*", b"$", *CLEAN[0].splitlines(keepends=True)]


@given(st.lists(st.one_of(st.binary(max_size=60), st.sampled_from(SCRAPS))))
def test_any_bytes_read_or_are_refused(
    tmp_path_factory: pytest.TempPathFactory, parts: list[bytes]
) -> None:
    path = put(tmp_path_factory.getbasetemp(), b"".join(parts), "any.nmea")
    for checksum in ("required", "optional"):
        with contextlib.suppress(InputError):
            recording = read(path, date=DAY, nmea_checksum=checksum)  # type: ignore[arg-type]
            assert len(recording) <= 10 * len(parts)
    match = nmea.sniff(path.read_bytes(), b"", b"", path)
    assert 0 <= match.score <= 100


def score(data: bytes, sniffer: Any = nmea.sniff) -> int:
    found: int = sniffer(data[: 1 << 16], data[: 1 << 16], data[-4096:], Path("x")).score
    return found


def test_sniffing(tmp_path: Path) -> None:
    data = b"".join(log(50))
    assert score(data) == 90
    others = (septentrio_sbf, rtklib_pos, parquet, delimited_text)
    assert max(score(data, other.sniff) for other in others) <= 80
    csv = b"time,lat,lon,height,hpl\n" + b"2025-05-23 14:09:00,50.5,15.5,289.5,11.25\n" * 60
    for strange in (csv, DOP * 60, UBX * 60, b"", b"\0" * 99, b"$HOME,$PATH\n" * 50):
        assert score(strange) == 0
    # A binary reader must be 10 points ahead where its blocks are mixed in.
    for blocks in (DOP, UBX):
        assert score((blocks + LINE * 20) * 20) <= 70
    assert score((RTCM * 9 + LINE) * 20) == 90
    assert score(LINE.replace(b"*47", b"") * 50) == 50
    assert 40 < score(b"".join(b"x" * 50 + line for line in data.splitlines(True))) < 60


def test_angles_of_the_samples_are_right() -> None:
    assert angle(-15.7712, 3, "EW", 4) == "01546.2720,W"
