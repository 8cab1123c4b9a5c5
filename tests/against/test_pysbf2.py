"""The SBF reader against pysbf2, field by field, over 1e4 epochs of a generated file."""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from sbas.logs.septentrio.sbf_writer import write
from sbas.logs.septentrio.septentrio_sbf import read
from tests.logs.septentrio.sbf_samples import recording

pysbf2 = pytest.importorskip("pysbf2", reason="pysbf2 is the peer of this test")

EPOCHS = 10_000
MISSING_EVERY = 97


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """1e4 epochs of six blocks, with do-not-use values here and there."""
    original = recording(EPOCHS, seed=20)
    table = original.table.copy()
    floats = table.select_dtypes("f8").columns
    table.iloc[::MISSING_EVERY, [table.columns.get_loc(name) for name in floats]] = np.nan
    table.iloc[::MISSING_EVERY, table.columns.get_loc("geo_prn")] = -1
    table.iloc[::MISSING_EVERY, table.columns.get_loc("n_sv")] = -1
    frames = original.side_tables["sbas_frames"].assign(signal="L1")
    path = tmp_path_factory.mktemp("peer") / "generated.sbf"
    write([original.replace(table=table, side_tables={"sbas_frames": frames})], path)
    return path


def absent(value: float, *missing: float) -> float:
    return math.nan if value <= -1e10 or value in missing else value


def test_field_by_field(file: Path) -> None:
    """RAIMStatistics 4011 is unknown to pysbf2; tests/logs/septentrio/test_sbf_writer.py has it."""
    ours = read(file)
    by_kind: dict[str, list[object]] = {}
    for _, parsed in pysbf2.SBFReader(BytesIO(file.read_bytes()), quitonerror=0):
        by_kind.setdefault(parsed.identity, []).append(parsed)
    known = {name: len(by_kind[name]) for name in ("PVTGeodetic", "PosCovGeodetic", "DOP",
                                                  "GEORawL1", "EndOfPVT")}  # fmt: skip
    assert set(known.values()) == {EPOCHS}
    assert len(ours) == EPOCHS

    def peer(kind: str, name: str, *missing: float) -> np.ndarray:
        return np.array([absent(getattr(b, name), *missing) for b in by_kind[kind]])

    def same(column: str, theirs: np.ndarray, tolerance: float = 0.0) -> None:
        np.testing.assert_allclose(ours.table[column], theirs, rtol=0, atol=tolerance)

    same("lat_deg", np.degrees(peer("PVTGeodetic", "Latitude")))
    same("lon_deg", np.degrees(peer("PVTGeodetic", "Longitude")))
    same("height_m", peer("PVTGeodetic", "Height"))
    same("vel_n_mps", peer("PVTGeodetic", "Vn"))
    same("vel_e_mps", peer("PVTGeodetic", "Ve"))
    same("vel_u_mps", peer("PVTGeodetic", "Vu"))
    same("speed_mps", np.hypot(peer("PVTGeodetic", "Vn"), peer("PVTGeodetic", "Ve")))
    same("n_sv", np.nan_to_num(peer("PVTGeodetic", "NrSV", 255), nan=-1))
    # The scaled fields come through as decimals that pysbf2 rounds.
    same("correction_age_s", peer("PVTGeodetic", "MeanCorrAge", 655.35), 1e-9)
    same("x_h_accuracy_m", peer("PVTGeodetic", "HAccuracy", 655.35), 1e-9)
    same("x_v_accuracy_m", peer("PVTGeodetic", "VAccuracy", 655.35), 1e-9)
    prn = peer("PVTGeodetic", "ReferenceID", 65535)
    same("geo_prn", np.where(np.isnan(prn), -1, np.where(prn == 65534, 0, prn)))
    assert set(peer("PVTGeodetic", "Type")) == {6}
    active = peer("PVTGeodetic", "Corr_DO229Active")
    used = active + peer("PVTGeodetic", "Corr_RngUsed")
    mode = np.where(active == 1, "sbas_pa", np.where(used > 0, "sbas_npa", "sbas"))
    assert ours.table["mode"].tolist() == mode.tolist()

    same("sigma_n_m", np.sqrt(peer("PosCovGeodetic", "Cov_latlat")))
    same("sigma_e_m", np.sqrt(peer("PosCovGeodetic", "Cov_lonlon")))
    same("sigma_u_m", np.sqrt(peer("PosCovGeodetic", "Cov_hgthgt")))
    same("cov_en_m2", peer("PosCovGeodetic", "Cov_latlon"))

    for column, name in (("pdop", "PDOP"), ("hdop", "HDOP"), ("vdop", "VDOP")):
        same(column, peer("DOP", name, 0), 1e-9)
    same("hpl_m", peer("DOP", "HPL"))
    same("vpl_m", peer("DOP", "VPL"))

    frames = ours.side_tables["sbas_frames"]
    svid = peer("GEORawL1", "SVID")
    assert frames["prn"].tolist() == np.where(svid > 140, svid - 57, svid).tolist()
    assert frames["crc_passed"].tolist() == (peer("GEORawL1", "CRCPassed") != 0).tolist()
    words = [np.frombuffer(bits_of(b), "<u4").astype(">u4").tobytes() for b in by_kind["GEORawL1"]]
    assert frames["frame"].tolist() == words

    gps = [week_and_tow(b) for b in by_kind["EndOfPVT"]]
    epoch = np.datetime64("1980-01-06", "ms")
    times = np.array([epoch + np.timedelta64(w * 604_800_000 + t, "ms") for w, t in gps])
    assert (ours.time == times).all()


def bits_of(block: object) -> bytes:
    bits = block.NavBits  # type: ignore[attr-defined]
    return bits if isinstance(bits, bytes) else int(bits).to_bytes(32, "little")


def week_and_tow(block: object) -> tuple[int, int]:
    return int(block.WNc), int(block.TOW)  # type: ignore[attr-defined]
