"""The SBF reader against pysbf2, field by field, over 1e4 epochs of a generated file."""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from sbas.logs.septentrio.sbf_writer import write
from sbas.logs.septentrio.septentrio_sbf import read
from tests.logs.septentrio.sbf_samples import (
    corrections_block,
    positions_block,
    recording,
    residuals_block,
    signal,
)

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


SATELLITE_BLOCKS = {
    4008: ("PVTSatCartesian", {
        "TOW": "U004", "WNc": "U002", "N": "U001", "SBLength": "U001",
        "sat_grp": ("N", {
            "SVID": "U001", "FreqNr": "U001", "IODE": "U002", "x": "F008", "y": "F008",
            "z": "F008", "Vx": "F004", "Vy": "F004", "Vz": "F004", "_Padding": "SBLength",
        }),
    }),
    5935: ("GEOCorrections", {
        "TOW": "U004", "WNc": "U002", "N": "U001", "SBLength": "U001",
        "sat_grp": ("N", {
            "SVID": "U001", "IODE": "U001", "Reserved": "U002", "PRC": "F004",
            "CorrAgeFC": "F004", "DeltaX": "F004", "DeltaY": "F004", "DeltaZ": "F004",
            "DeltaClock": "F004", "CorrAgeLT": "F004", "IonoPPlat": "F004", "IonoPPlon": "F004",
            "SlantIono": "F004", "CorrAgeIono": "F004", "VarFLT": "F004", "VarUIRE": "F004",
            "VarAir": "F004", "VarTropo": "F004",
        }),
    }),
    4009: ("PVTResiduals", {
        "TOW": "U004", "WNc": "U002", "N": "U001", "SB1Length": "U001", "SB2Length": "U001",
        "Reserved": "U003",
        "sig_grp": ("N", {
            "SVID": "U001", "FreqNr": "U001", "Type": "U001", "RefSVID": "U001",
            "RefFreqNr": "U001", "MeasInfo": "U001", "IODE": "U002", "CorrAge": "U002",
            "ReferenceID": "U002",
            **{f"{name}_alt": (("MeasInfo+1", [v for v in range(256) if v & bit]), {
                f"{name}Residual": "F004", f"{name}W": "U002", f"{name}MDB": "U002"})
               for name, bit in (("Code", 4), ("Phase", 8), ("Doppler", 16))},
        }),
    }),
}  # fmt: skip
"""Layouts after the receiver's guide (PolaRx5TR 5.5.0, p. 406-414); pysbf2 knows none of them."""


def test_satellites_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pysbf2 import sbfmessage

    for number, (name, layout) in SATELLITE_BLOCKS.items():
        monkeypatch.setitem(pysbf2.SBF_MSGIDS, number, (name, name))
        monkeypatch.setitem(sbfmessage.SBF_BLOCKS, name, layout)
    rng = np.random.default_rng(12)

    def triple(missing: float) -> tuple[float, int, int] | None:
        w, mdb = rng.integers(0, 65535, 2).tolist()
        return None if rng.random() < missing else (float(np.float32(rng.normal())), w, mdb)

    parts = []
    for i in range(300):
        svids = (rng.permutation(37)[: rng.integers(0, 12)] + 1).tolist()
        parts.append(positions_block(1000 * i, {s: tuple(rng.uniform(7e6, 3e7, 3)) for s in svids},
                                     size=int(rng.choice([40, 48]))))  # fmt: skip
        parts.append(corrections_block(1000 * i, {s: tuple(rng.random(4)) for s in svids}))
        parts.append(residuals_block(1000 * i, *(
            signal(s, code=triple(0.2), phase=triple(0.5), doppler=triple(0.5)) for s in svids)
        ))  # fmt: skip
    path = tmp_path / "satellites.sbf"
    path.write_bytes(b"".join(parts))
    theirs: dict[tuple[int, str], dict[str, float]] = {}
    for _, parsed in pysbf2.SBFReader(BytesIO(path.read_bytes()), quitonerror=2):
        for k in range(1, parsed.N + 1):

            def value(name: str) -> float:
                return float(getattr(parsed, f"{name}_{k:02d}", math.nan))  # noqa: B023

            row = theirs.setdefault((parsed.TOW, f"G{int(value('SVID')):02d}"), {})
            if parsed.identity == "PVTSatCartesian":
                row |= {f"{axis}_ecef_m": value(axis) for axis in "xyz"}
            elif parsed.identity == "GEOCorrections":
                names = {"flt": "FLT", "uire": "UIRE", "air": "Air", "tropo": "Tropo"}
                terms = {name: value(f"Var{kind}") for name, kind in names.items()}
                row |= {f"sigma_{name}_m": math.sqrt(v) for name, v in terms.items()}
                row["sigma_m"] = math.sqrt(sum(terms.values()))
            else:
                row["residual_m"] = value("CodeResidual")
                row |= {"mdb_m": value("CodeMDB") * 0.1, "x_w": value("CodeW") * 0.001}
    table = read(path).side_tables["satellites"]
    tow = (table["time"] - np.datetime64("2009-09-13")).dt.total_seconds() * 1000
    assert len(theirs) == len(table) > 1500
    columns = [name for name in next(iter(theirs.values())) if name in table]
    assert len(columns) == 11
    expected = [theirs[key] for key in zip(tow, table["satellite"], strict=True)]
    for name in columns:
        np.testing.assert_allclose(table[name], [row[name] for row in expected], rtol=1e-14)
    assert table["residual_m"].isna().sum() > 100
