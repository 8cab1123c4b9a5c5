"""Writing SBF and reading it back; the bytes themselves against the page's field tables."""

from __future__ import annotations

import itertools
import struct
from binascii import crc_hqx
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sbas.exceptions import InputError
from sbas.logs.septentrio.sbf_writer import STRIP_EPOCHS, encode_blocks, write
from sbas.logs.septentrio.septentrio_sbf import FILLED, read
from sbas.recording import MODES, Flag, Recording, mode_categories
from tests.logs.septentrio.sbf_samples import recording, reference_blocks

HUNDREDTH = ("hdop", "vdop", "pdop", "correction_age_s")
SINGLE = ("hpl_m", "vpl_m", "vel_e_mps", "vel_n_mps", "vel_u_mps", "herl_m", "verl_m",
          "cov_en_m2")  # fmt: skip


def round_trip(recordings: list[Recording], folder: Path) -> Recording:
    path = folder / "out.sbf"
    write(recordings, path)
    return read(path)


def assert_same(got: Recording, expected: Recording) -> None:
    """Equal within the resolution of each field; frames, times and codes exactly."""
    assert got.table.index.equals(expected.table.index)
    for name in ("n_sv", "geo_prn", "mode"):
        assert got.table[name].tolist() == expected.table[name].tolist(), name
    for name in HUNDREDTH:
        np.testing.assert_allclose(got.table[name], expected.table[name], rtol=0, atol=0.005001)
    for name in SINGLE:
        single = expected.table[name].to_numpy().astype("f4").astype("f8")
        np.testing.assert_array_equal(got.table[name], single)
    for name in ("lat_deg", "lon_deg"):  # through radians and back: 1e-13 deg is 1e-8 m
        np.testing.assert_allclose(got.table[name], expected.table[name], rtol=0, atol=1e-13)
    np.testing.assert_array_equal(got.table["height_m"], expected.table["height_m"])
    for name in ("sigma_e_m", "sigma_n_m", "sigma_u_m"):
        np.testing.assert_allclose(got.table[name], expected.table[name], rtol=4e-8)
    np.testing.assert_allclose(got.table["speed_mps"], expected.table["speed_mps"], rtol=1e-7)
    own = {"sbas_frames": None, **expected.side_tables}["sbas_frames"]
    if own is not None:
        pd.testing.assert_frame_equal(
            got.side_tables["sbas_frames"].astype({"signal": str}), own.astype({"signal": str})
        )


def test_round_trip(tmp_path: Path) -> None:
    original = recording(3000, seed=1)
    got = round_trip([original], tmp_path)
    assert_same(got, original)
    assert got.table["flags"].tolist() == original.table["flags"].tolist()
    accuracy = 2 * np.hypot(original.table["sigma_e_m"], original.table["sigma_n_m"])
    np.testing.assert_allclose(got.table["x_h_accuracy_m"], accuracy, atol=0.005001)
    assert got.meta.pl.kind == "do229"
    assert {f.code for f in got.meta.findings} == {"E07"}  # no undulation is known
    again = round_trip([got], tmp_path)
    pd.testing.assert_frame_equal(again.table, got.table)


def test_pieces_give_the_same_file(tmp_path: Path) -> None:
    whole = recording(STRIP_EPOCHS + 500, seed=2)
    frames = whole.side_tables["sbas_frames"]
    cut = [0, 1, 400, STRIP_EPOCHS + 3, len(whole)]
    pieces = [
        Recording(whole.table.iloc[a:b], side_tables={"sbas_frames": frames.iloc[a:b]})
        for a, b in itertools.pairwise(cut)
    ]
    write([whole], tmp_path / "whole.sbf")
    write(pieces, tmp_path / "pieces.sbf")
    data = (tmp_path / "whole.sbf").read_bytes()
    assert (tmp_path / "pieces.sbf").read_bytes() == data
    assert len(data) == 288 * len(whole)


def test_blocks_of_an_epoch(tmp_path: Path) -> None:
    path = tmp_path / "x.sbf"
    write([recording(3, frames=2)], path)
    numbers = [number for _, number, _ in reference_blocks(path.read_bytes())]
    assert [4021 if n == 4020 else n for n in numbers] == [
        4007, 5906, 4001, 4011, 4021, 5921, 4007, 5906, 4001, 4011, 4021, 5921,
        4007, 5906, 4001, 4011, 5921,
    ]  # fmt: skip


def test_frames_away_from_epochs(tmp_path: Path) -> None:
    original = recording(5, frames=5)
    frames = original.side_tables["sbas_frames"]
    hours = np.array([-1, 0, 0, 0, 2]) * np.timedelta64(3600, "s")
    moved = frames.assign(time=frames["time"].iloc[0] + hours)
    got = round_trip([original.replace(side_tables={"sbas_frames": moved})], tmp_path)
    assert got.side_tables["sbas_frames"]["time"].tolist() == moved["time"].tolist()
    assert got.side_tables["sbas_frames"]["frame"].tolist() == moved["frame"].tolist()
    alone = round_trip([Recording(original.table.iloc[:0], side_tables={"sbas_frames": moved})],
                       tmp_path)  # fmt: skip
    assert len(alone) == 0
    assert alone.side_tables["sbas_frames"]["prn"].tolist() == moved["prn"].tolist()
    plain = moved.assign(frame=moved["frame"].tolist(), signal=moved["signal"].astype(str))
    again = round_trip([original.replace(side_tables={"sbas_frames": plain})], tmp_path)
    assert again.side_tables["sbas_frames"]["frame"].tolist() == moved["frame"].tolist()


def test_nothing_to_write(tmp_path: Path) -> None:
    write([], tmp_path / "x.sbf")
    write([recording(0)], tmp_path / "y.sbf")
    assert (tmp_path / "x.sbf").read_bytes() == (tmp_path / "y.sbf").read_bytes() == b""


def test_all_missing(tmp_path: Path) -> None:
    bare = Recording(recording(4).table[[]])
    got = round_trip([bare], tmp_path)
    floats = got.table.select_dtypes("f8")
    assert floats.isna().all(axis=None)
    assert (got.table[["n_sv", "geo_prn"]] == -1).all(axis=None)
    assert set(got.table["mode"]) == {"other"}  # nothing stands beside it
    assert got.table["flags"].tolist() == [Flag.PL_SENTINEL | Flag.POSITION_SENTINEL] * 4


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("with_position", [True, False])
def test_every_mode(tmp_path: Path, mode: str, with_position: bool) -> None:
    table = recording(3).table.assign(mode=mode_categories(np.full(3, MODES.index(mode))))
    if not with_position:
        table = table.assign(lat_deg=np.nan, lon_deg=np.nan)
    got = round_trip([Recording(table)], tmp_path)
    assert got.table["mode"].tolist() == [mode] * 3
    assert got.table["lat_deg"].notna().tolist() == [with_position] * 3


def test_codes_in_the_bytes(tmp_path: Path) -> None:
    """Mode 6 with WACorrInfo bit 4 for PA, without for NPA; signals 0 and 24 (page, section 2)."""
    table = recording(4).table.assign(
        mode=mode_categories(np.array([MODES.index(m) for m in
                                       ("sbas_pa", "sbas_npa", "sbas", "standalone")])),
        flags=np.array([128, 0, 0, 0], "u4"), geo_prn=np.array([120, 0, -1, 136], "i2"),
    )  # fmt: skip
    path = tmp_path / "x.sbf"
    write([Recording(table)], path)
    pvt = [whole for _, number, whole in reference_blocks(path.read_bytes()) if number == 4007]
    assert [block[14] for block in pvt] == [6 | 0x80, 6, 6, 1]
    assert [bool(block[75] & 16) for block in pvt] == [True, False, False, False]
    assert [bool(block[75]) for block in pvt] == [True, True, False, False]
    signals = [struct.unpack_from("<I", block, 80)[0] for block in pvt]
    assert signals == [1 << 24 | 1] * 3 + [0]
    reference = [struct.unpack_from("<H", block, 76)[0] for block in pvt]
    assert reference == [120, 65534, 65535, 136]
    assert {struct.unpack_from("<H", block, 4)[0] for block in pvt} == {4007 | 2 << 13}


def test_raim_statistics_by_the_field_table(tmp_path: Path) -> None:
    """pysbf2 does not know block 4011: the table of the page, section 2, by `struct`."""
    original = recording(200, seed=9)
    path = tmp_path / "x.sbf"
    write([original], path)
    blocks = [whole for _, number, whole in reference_blocks(path.read_bytes()) if number == 4011]
    fields = [struct.unpack("<2sHHHIHBxffffHH", whole) for whole in blocks]
    table = original.table
    code = table["flags"].map({16: 0, 32: 1, 64: 2})
    assert [f[6] for f in fields] == code.tolist()
    np.testing.assert_array_equal([f[7] for f in fields], table["herl_m"].astype("f4"))
    np.testing.assert_array_equal([f[8] for f in fields], table["verl_m"].astype("f4"))
    assert {f[9:11] for f in fields} == {(struct.unpack("<f", struct.pack("<f", -2e10))[0],) * 2}
    assert {f[11] for f in fields} == {65535}
    assert {(f[0], f[2], f[3], f[5]) for f in fields} == {(b"$@", 4011, 36, 1549)}
    assert [f[4] for f in fields] == [518_400_000 + 1000 * i for i in range(200)]
    assert all(f[1] == crc_hqx(b[4:], 0) for f, b in zip(fields, blocks, strict=True))


@given(
    hnp.arrays("f8", (12, 6), elements=st.one_of(st.floats(0, 700), st.just(np.nan))),
    st.lists(st.integers(0, 7), min_size=6, max_size=6),
)
def test_any_values_round_trip(
    tmp_path_factory: pytest.TempPathFactory, values: np.ndarray, modes: list[int]
) -> None:
    names = ("hpl_m", "vpl_m", "hdop", "correction_age_s", "sigma_e_m", "sigma_n_m", "sigma_u_m",
             "cov_en_m2", "vel_e_mps", "vel_n_mps", "height_m", "herl_m")  # fmt: skip
    table = recording(6).table.assign(**dict(zip(names, values, strict=True)))
    table = table.assign(mode=mode_categories(np.array(modes)))
    got = round_trip([Recording(table)], tmp_path_factory.mktemp("any")).table
    for name in names:
        expected = table[name].to_numpy()
        assert (got[name].isna() == np.isnan(expected)).all()
        known = ~np.isnan(expected)
        if name in ("hdop", "correction_age_s"):
            least = 0.01 if name == "hdop" else 0.0  # a DOP of 0 would read as missing
            limited = np.clip(expected[known], least, 655.34)
            np.testing.assert_allclose(got[name][known], limited, rtol=0, atol=0.005001)
        else:
            np.testing.assert_allclose(got[name][known], expected[known], rtol=1e-7, atol=1e-20)
    assert got["mode"].tolist() == table["mode"].tolist()


def test_time_that_sbf_cannot_hold(tmp_path: Path) -> None:
    table = recording(3).table
    for index in (table.index + pd.Timedelta("1us"), table.index - pd.Timedelta("40000D")):
        with pytest.raises(InputError, match="whole milliseconds"):
            write([Recording(table.set_axis(index.rename("time")))], tmp_path / "x.sbf")


def test_frame_that_is_missing(tmp_path: Path) -> None:
    original = recording(2)
    frames = original.side_tables["sbas_frames"]
    hole = frames.assign(frame=[frames["frame"].iloc[0], None])
    with pytest.raises(InputError, match="frame is missing"):
        write([original.replace(side_tables={"sbas_frames": hole})], tmp_path / "x.sbf")


def test_progress(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []
    parts = [recording(10), recording(5)]
    write(parts, tmp_path / "x.sbf", progress=lambda *call: calls.append(call))
    assert calls == [(10, 0), (15, 0)]


def test_encode_blocks_refuses_what_it_does_not_know() -> None:
    with pytest.raises(InputError, match="no field 'h_accuracy'"):
        encode_blocks(4007, 1, {"h_accuracy": 3})
    with pytest.raises(InputError, match="differ in length"):
        encode_blocks(4001, 0, {"hpl": [1.0, 2.0], "vpl": [1.0, 2.0, 3.0]})
    assert encode_blocks(4007, 0, {}).shape == (1, 88)
    assert encode_blocks(4001, 0, {"hpl": [1.0, 2.0], "vpl": 3.0}).shape == (2, 32)


def test_every_written_column_is_one_that_the_reader_fills(tmp_path: Path) -> None:
    assert round_trip([recording(3)], tmp_path).columns == FILLED


def test_a_level_without_a_mode_is_not_written(tmp_path: Path) -> None:
    table = recording(3).table.drop(columns="mode")
    with pytest.raises(InputError, match="mode is not known"):
        write([Recording(table)], tmp_path / "x.sbf")
