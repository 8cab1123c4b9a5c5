"""The satellite table: one row an epoch and satellite, from up to three blocks."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.logs.septentrio.sbf_satellites import NAMES
from sbas.logs.septentrio.septentrio_sbf import read, read_in_chunks
from sbas.recording import Recording
from sbas.satellite_table import SATELLITE_COLUMNS
from tests.logs.septentrio.sbf_samples import (
    block,
    corrections_block,
    positions_block,
    residuals_block,
    signal,
)

LLH = (50.0345, 15.7712, 289.4)


@pytest.fixture
def load(tmp_path: Path):  # type: ignore[no-untyped-def]
    def load_bytes(*pieces: bytes, columns: list[str] | None = None) -> Recording:
        path = tmp_path / "log.sbf"
        path.write_bytes(b"".join(pieces))
        return read(path, columns=columns)

    return load_bytes


def fix(tow_ms: int, lat: float = LLH[0], lon: float = LLH[1], **more: object) -> bytes:
    return block(4007, 2, tow_ms=tow_ms, mode=6, wa_corr_info=31, lat=math.radians(lat),
                 lon=math.radians(lon), height=LLH[2], n_sv=8, **more)  # fmt: skip


def seen_at(azimuth: float, elevation: float, lat: float = LLH[0], lon: float = LLH[1]):  # type: ignore[no-untyped-def]
    return tuple(float(v) for v in pymap3d.aer2ecef(azimuth, elevation, 2.2e7, lat, lon, LLH[2]))


def evidence(recording: Recording, words: str) -> str:
    return next(f.evidence for f in recording.meta.findings if words in f.message)


def test_svid_names() -> None:
    # PolaRx5TR Reference Guide 5.5.0, table of section 4.1.9 (p. 298-299).
    expected = {
        1: "G01", 37: "G37", 38: "R01", 61: "R24", 63: "R25", 68: "R30", 71: "E01", 106: "E36",
        120: "S20", 140: "S40", 141: "C01", 180: "C40", 181: "J01", 187: "J07", 191: "I01",
        197: "I07", 198: "S41", 215: "S58", 216: "I08", 222: "I14", 223: "C41", 245: "C63",
    }  # fmt: skip
    assert {svid: NAMES[svid] for svid in expected} == expected
    nameless = [0, 62, 69, 70, *range(107, 120), 188, 189, 190, *range(246, 256)]
    assert [svid for svid in range(256) if not NAMES[svid]] == nameless
    named = [name for name in NAMES if name]
    assert len(set(named)) == len(named)


def test_one_row_of_three_blocks(load) -> None:  # type: ignore[no-untyped-def]
    directions = {24: (210.0, 35.0), 36 + 100: (160.0, 12.5)}
    r = load(
        fix(0),
        positions_block(0, {svid: seen_at(*d) for svid, d in directions.items()}),
        corrections_block(0, {136: (4.0, 9.0, 0.25, 0.01), 24: (1.0, 4.0, 0.5, 0.25)}),
        residuals_block(0, signal(24, code=(-1.25, 1500, 83)),
                        signal(136, signal=24, code=(2.5, 0, 7))),
    )  # fmt: skip
    table = r.side_tables["satellites"]
    assert table["satellite"].tolist() == ["G24", "S36"]
    assert (table["time"] == r.time[0]).all()
    assert table["azimuth_deg"].to_numpy() == pytest.approx([210.0, 160.0], abs=1e-6)
    assert table["elevation_deg"].to_numpy() == pytest.approx([35.0, 12.5], abs=1e-6)
    first = table.iloc[0]
    assert (first.x_ecef_m, first.y_ecef_m, first.z_ecef_m) == seen_at(210.0, 35.0)
    sigmas = ["sigma_flt_m", "sigma_uire_m", "sigma_air_m", "sigma_tropo_m"]
    assert first[sigmas].tolist() == [1.0, 2.0, math.sqrt(0.5), 0.5]
    assert first.sigma_m == math.sqrt(1 + 4 + 0.5 + 0.25)
    assert table["sigma_m"].iloc[1] == pytest.approx(math.sqrt(13.26), rel=1e-7)
    assert (first.residual_m, first.mdb_m, first.x_w) == pytest.approx((-1.25, 8.3, 1.5))
    assert table["x_signal"].tolist() == [0, 24]
    assert table["used"].all()
    for name in table.columns[1:]:
        if name in SATELLITE_COLUMNS and SATELLITE_COLUMNS[name].dtype != "category":
            assert table[name].dtype == SATELLITE_COLUMNS[name].dtype


def test_outer_join_keeps_what_there_is(load) -> None:  # type: ignore[no-untyped-def]
    r = load(
        fix(0), positions_block(0, {7: seen_at(10, 20), 5: seen_at(30, 40)}),
        fix(1000), corrections_block(1000, {9: (1.0, 1.0, 1.0, 1.0), 5: (1.0, 1.0, 1.0, 1.0)}),
        positions_block(1000, {5: seen_at(50, 60)}),
        fix(2000), residuals_block(2000, signal(3, code=(1.0, 1, 1)), signal(2, phase=(1.0, 1, 1))),
        fix(3000),
    )  # fmt: skip
    table = r.side_tables["satellites"]
    seconds = ((table["time"] - r.time[0]).dt.total_seconds()).tolist()
    assert list(zip(seconds, table["satellite"], strict=True)) == [
        (0, "G05"), (0, "G07"), (1, "G05"), (1, "G09"), (2, "G02"), (2, "G03"),
    ]  # fmt: skip
    assert table["x_ecef_m"].isna().tolist() == [False, False, False, True, True, True]
    assert table["sigma_m"].isna().tolist() == [True, True, False, False, True, True]
    assert table["residual_m"].isna().tolist() == [True, True, True, True, True, False]
    assert table["used"].all()
    assert not [f for f in r.meta.findings if "satellite" in f.message]


def test_sub_blocks_of_2008_have_no_variances(load) -> None:  # type: ignore[no-untyped-def]
    r = load(fix(0), corrections_block(0, {5: (1.0, 1.0, 1.0, 1.0)}, size=48),
             fix(1000), corrections_block(1000, {5: (1.0, 1.0, 1.0, 1.0)}))  # fmt: skip
    assert r.side_tables["satellites"]["sigma_m"].fillna(-1).tolist() == [-1, 2]
    assert not [f for f in r.meta.findings if "satellites." in f.evidence]


def test_do_not_use_values_are_missing_and_counted(load) -> None:  # type: ignore[no-untyped-def]
    bad = -2e10
    r = load(
        fix(0),
        positions_block(0, {5: (bad, 2e7, 1e7), 6: (1e6, 1e6, 1e6), 7: (1e300, 0.0, 0.0),
                            8: (math.nan, 2e7, 0.0)}),
        corrections_block(0, {5: (bad, 1.0, 1.0, 1.0), 6: (-1.0, 1.0, 1.0, 1.0)}),
        residuals_block(0, signal(5, code=(bad, 65535, 65535))),
    )  # fmt: skip
    table = r.side_tables["satellites"]
    assert table["elevation_deg"].isna().all()
    assert table["sigma_m"].isna().all()
    assert table["sigma_uire_m"].tolist()[:2] == [1.0, 1.0]
    assert table[["residual_m", "mdb_m", "x_w"]].isna().all(axis=None)
    text = next(f for f in r.meta.findings if f.code == "E07" and f.severity == "info").evidence
    for words in (
        "satellites.x_ecef_m: 1 x -2e10", "satellites.x_ecef_m: 1 x position inside the Earth",
        "satellites.x_ecef_m: 1 x position beyond the Moon",
        "satellites.x_ecef_m: 1 x not a finite number",
        "satellites.sigma_flt_m: 1 x -2e10", "satellites.sigma_flt_m: 1 x negative variance",
        "satellites.residual_m: 1 x -2e10", "satellites.mdb_m: 1 x 65535",
        "satellites.x_w: 1 x 65535",
    ):  # fmt: skip
        assert words in text


def test_no_fix_no_direction(load) -> None:  # type: ignore[no-untyped-def]
    sky = {5: seen_at(0, 90)}
    r = load(fix(0), positions_block(0, sky), fix(1000, error=4), positions_block(1000, sky),
             positions_block(5000, sky), fix(6000), positions_block(6000, sky))  # fmt: skip
    table = r.side_tables["satellites"]
    assert table["elevation_deg"].isna().tolist() == [False, True, True, False]
    assert (table["x_ecef_m"] == sky[5][0]).all()
    assert table["time"].is_monotonic_increasing


@pytest.mark.parametrize("place", [(0.0, 0.0), (-45.0, 170.0), (89.9, -30.0), (-90.0, 0.0)])
def test_directions_agree_with_pymap3d(load, place: tuple[float, float]) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(4)
    towards = rng.standard_normal((30, 3))
    xyz = 2.6e7 * towards / np.linalg.norm(towards, axis=1)[:, None]
    r = load(fix(0, *place), positions_block(0, {i + 1: tuple(p) for i, p in enumerate(xyz)}))
    table = r.side_tables["satellites"]
    azimuth, elevation, _ = pymap3d.ecef2aer(*xyz.T, *place, LLH[2])
    assert table["elevation_deg"].to_numpy() == pytest.approx(elevation, abs=1e-9)
    turn = (table["azimuth_deg"].to_numpy() - azimuth + 180) % 360 - 180
    assert np.abs(turn).max() < 1e-7
    assert ((table["azimuth_deg"] >= 0) & (table["azimuth_deg"] < 360)).all()


class TestResiduals:
    def test_the_first_signal_with_a_code_residual_is_taken(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(fix(0), residuals_block(
            0,
            signal(5, signal=3, code=(3.0, 1, 1)), signal(5, signal=0, code=(1.0, 1, 1)),
            signal(6, signal=0, phase=(9.0, 1, 1)), signal(6, signal=4, code=(2.0, 1, 1)),
            signal(7, signal=0, code=(4.0, 1, 1)), signal(7, signal=0, code=(5.0, 1, 1)),
            signal(8, signal=0, doppler=(9.0, 1, 1)), signal(8, signal=4, phase=(9.0, 1, 1)),
        ))  # fmt: skip
        table = r.side_tables["satellites"]
        assert table["residual_m"].fillna(-1).tolist() == [1.0, 2.0, 4.0, -1]
        assert table["x_signal"].tolist() == [0, 4, 0, -1]
        assert table["used"].all()
        assert evidence(r, "one row") == "4 residuals of further signals or base stations"

    def test_other_antennas_and_differences(self, load) -> None:  # type: ignore[no-untyped-def]
        r = load(fix(0), residuals_block(
            0,
            signal(5, kind=2, code=(3.0, 1, 1)), signal(6, kind=0, code=(1.0, 1, 1)),
            signal(7, antenna=1, kind=2, code=(9.0, 1, 1)),
        ))  # fmt: skip
        table = r.side_tables["satellites"]
        assert table["satellite"].tolist() == ["G05", "G06"]
        assert table["residual_m"].fillna(-1).tolist() == [-1, 1.0]
        assert evidence(r, "one row") == (
            "1 residuals against another satellite, 1 residuals of other antennas"
        )

    def test_velocity_only_is_not_used_in_the_position(self, load) -> None:  # type: ignore[no-untyped-def]
        sky = {svid: seen_at(10 * svid, 45) for svid in (5, 6, 7)}
        r = load(
            fix(0), positions_block(0, sky),
            residuals_block(0, signal(5, code=(1.0, 1, 1)), signal(6, doppler=(1.0, 1, 1))),
            fix(1000), positions_block(1000, sky), residuals_block(1000),
        )  # fmt: skip
        assert r.side_tables["satellites"]["used"].tolist() == [True, False, False, *[True] * 3]


def test_satellites_without_a_name_are_counted(load) -> None:  # type: ignore[no-untyped-def]
    r = load(
        fix(0), positions_block(0, {62: seen_at(0, 40), 5: seen_at(1, 40), 110: seen_at(2, 40)})
    )
    assert r.side_tables["satellites"]["satellite"].tolist() == ["G05"]
    assert evidence(r, "one row") == "2 sub-blocks of no known satellite"
    only = load(fix(0), positions_block(0, {62: seen_at(0, 40)}))
    assert "satellites" not in only.side_tables


class TestTimesThatComeAgain:
    def test_two_logs_in_one_file_do_not_mix(self, load) -> None:  # type: ignore[no-untyped-def]
        """Each position goes to the epoch of its own log, also where it comes before its fix."""
        sky = seen_at(100, 50)
        one = fix(0) + positions_block(0, {5: sky}) + fix(1000) + positions_block(1000, {5: sky})
        two = (positions_block(0, {6: sky}) + fix(0, lat=40.0) + fix(1000, lat=40.0)
               + positions_block(1000, {6: sky}))  # fmt: skip
        table = load(one, two).side_tables["satellites"]
        assert table["satellite"].tolist() == ["G05", "G05", "G06", "G06"]
        near, far = pymap3d.ecef2aer(*sky, *LLH)[1], pymap3d.ecef2aer(*sky, 40.0, LLH[1], LLH[2])[1]
        assert table["elevation_deg"].to_numpy() == pytest.approx([near, near, far, far], abs=1e-9)

    def test_a_block_that_comes_twice_is_taken_once(self, load) -> None:  # type: ignore[no-untyped-def]
        first, second = {5: seen_at(0, 40)}, {5: seen_at(90, 40)}
        r = load(fix(0), positions_block(0, first), positions_block(0, second))
        table = r.side_tables["satellites"]
        assert table["azimuth_deg"].to_numpy() % 360 == pytest.approx([0.0], abs=1e-6)
        assert evidence(r, "one row") == "1 satellites named twice in PVTSatCartesian"

    def test_backward_times_join_as_well(self, load) -> None:  # type: ignore[no-untyped-def]
        sky = {5: seen_at(0, 40)}
        parts = [fix(t) + positions_block(t, sky) for t in (3000, 1000, 2000)]
        r = load(*parts, corrections_block(1000, {5: (1.0, 1.0, 1.0, 1.0)}))
        table = r.side_tables["satellites"]
        assert table["time"].tolist() == r.table.index.tolist()
        assert table["sigma_m"].fillna(0).tolist() == [0, 2, 0]


def test_size_of_chunks_changes_nothing(tmp_path: Path) -> None:
    """Blocks of changing length and order, over many chunks; some lie across two of them."""
    rng = np.random.default_rng(8)
    parts = []
    for i in range(400):
        t = 1000 * i
        svids = rng.permutation(40)[: rng.integers(0, 12)] + 1
        sky = {int(s): tuple(rng.uniform(-2e7, 2e7, 3)) for s in svids}
        variances = {int(s): tuple(rng.uniform(0, 4, 4)) for s in svids[1:]}
        signals = [signal(int(s), signal=int(rng.integers(3)), code=(float(rng.normal()), 9, 9))
                   for s in rng.choice(svids, len(svids))]  # fmt: skip
        blocks = [positions_block(t, sky, size=int(rng.choice([40, 48]))),
                  corrections_block(t, variances), residuals_block(t, *signals)]  # fmt: skip
        parts += [fix(t), *(blocks[k] for k in rng.permutation(3)[: rng.integers(1, 4)])]
    path = tmp_path / "log.sbf"
    path.write_bytes(b"".join(parts))
    whole = read(path)
    assert len(whole.side_tables["satellites"]) > 1500
    for chunk_bytes, segment_bytes in ((1, 1 << 20), (1, 70_000), (70_000, 90_000), (200_000, 1)):
        other = read_in_chunks(path, chunk_bytes, segment_bytes)
        pd.testing.assert_frame_equal(
            other.side_tables["satellites"], whole.side_tables["satellites"]
        )
        assert other.meta == whole.meta


def test_named_columns_leave_the_satellites_out(load) -> None:  # type: ignore[no-untyped-def]
    r = load(fix(0), positions_block(0, {5: seen_at(0, 40)}), columns=["hpl_m"])
    assert "satellites" not in r.side_tables


ANY = st.floats(allow_nan=True, allow_infinity=True)
ANY32 = st.floats(width=32)
PIECES = st.one_of(
    st.builds(lambda t, lat, lon, h: block(4007, 2, tow_ms=t, mode=1, lat=lat, lon=lon, height=h),
              st.integers(0, 3), st.floats(-2, 2), st.floats(-4, 4), ANY),
    st.builds(positions_block, st.integers(0, 3),
              st.dictionaries(st.integers(0, 255), st.tuples(ANY, ANY, ANY), max_size=4)),
    st.builds(corrections_block, st.integers(0, 3),
              st.dictionaries(st.integers(0, 255), st.tuples(*[ANY32] * 4), max_size=4)),
    st.builds(lambda t, rows: residuals_block(t, *(signal(s, code=c) for s, c in rows)),
              st.integers(0, 3),
              st.lists(st.tuples(st.integers(0, 255),
                                 st.tuples(ANY32, st.integers(0, 65535), st.integers(0, 65535))),
                       max_size=4)),
)  # fmt: skip


@settings(max_examples=150)
@given(st.lists(PIECES, max_size=10))
def test_any_content_gives_a_sound_table(
    tmp_path_factory: pytest.TempPathFactory, pieces: list[bytes]
) -> None:
    """Hostile fields in blocks with a good CRC: no exception, nothing infinite or out of range."""
    path = tmp_path_factory.mktemp("fuzz") / "x.sbf"
    path.write_bytes(b"".join(pieces))
    table = read(path).side_tables.get("satellites")
    if table is None:
        return
    assert (
        not table.duplicated(["time", "satellite"]).any() or read(path).table.index.has_duplicates
    )
    floats = table.select_dtypes("f8")
    assert not np.isinf(floats.to_numpy()).any()
    assert not (floats <= -1e10).any(axis=None)
    for name in floats.columns.intersection(["elevation_deg"]):
        assert (table[name].abs().fillna(0) <= 90).all()
    for name in floats.columns[floats.columns.str.startswith("sigma")]:
        assert (table[name].fillna(0) >= 0).all()
