"""The UBX reader against pyubx2, field by field, over 1e4 epochs of a generated file."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from sbas.logs.checksums import crc24q_of_rows
from sbas.logs.ublox.ublox_ubx import read
from sbas.recording import Flag, Recording
from tests.logs.ublox import ubx_samples as samples

pyubx2 = pytest.importorskip("pyubx2", reason="pyubx2 is the peer of this test")

EPOCHS = 10_000
FRAME_EVERY = 10
WEEK, FIRST_MS, STEP_MS = 2408, 604_000_000, 100
"""The file runs over the end of the week."""


def _messages(i: int, rng: np.random.Generator) -> Iterator[bytes]:
    since_ms = WEEK * 604_800_000 + FIRST_MS + STEP_MS * i
    itow = since_ms % 604_800_000
    utc = samples.utc_of(itow, since_ms // 604_800_000)

    def integer(low: int, high: int) -> int:
        return int(rng.integers(low, high))

    signed = {n: integer(-50_000, 50_000) for n in ("vn", "ve", "vd", "altitude", "height")}
    carrier = int(rng.choice([0, 0, 0, 1, 2]))
    yield samples.pvt(
        itow, utc=utc, fix_type=3 if i % 50 else 0, flags=1 | integer(0, 2) << 1 | carrier << 6,
        n_sv=integer(0, 30), lon=integer(-1_800_000_000, 1_800_000_001),
        lat=integer(-900_000_000, 900_000_001), h_acc=integer(0, 9000) if i % 50 else 4294967295,
        v_acc=integer(0, 9000), speed=integer(0, 50_000), pdop=integer(50, 900),
        flags_3=integer(0, 16) << 1, **signed,
    )  # fmt: skip
    dops = {name: integer(50, 900) if i % 40 else 9999 for name in ("pdop", "vdop", "hdop")}
    yield samples.dop(itow, **dops)
    variances = {name: float(rng.uniform(0.1, 9)) for name in ("nn", "ne", "ee", "dd")}
    yield samples.cov(itow, valid=int(i % 30 != 0), **variances)
    levels = (integer(100, 90_000), integer(100, 90_000), integer(100, 90_000))
    yield samples.pl(itow, levels, risk=(1, -5), valid=int(i % 20 != 0), frame=integer(1, 4))
    yield samples.sbas(itow, int(rng.choice([0, 123, 136])))
    if i % FRAME_EVERY == 0:
        yield samples.sfrbx(integer(120, 159), rng.bytes(32))


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rng = np.random.default_rng(7)
    path = tmp_path_factory.mktemp("peer") / "generated.ubx"
    with path.open("wb") as out:
        for i in range(EPOCHS):
            out.writelines(_messages(i, rng))
    return path


def test_field_by_field(file: Path) -> None:
    ours = read(file)
    by_kind: dict[str, list[object]] = {}
    for _, parsed in pyubx2.UBXReader(BytesIO(file.read_bytes()), quitonerror=2):
        by_kind.setdefault(parsed.identity, []).append(parsed)
    kinds = ("NAV-PVT", "NAV-DOP", "NAV-COV", "NAV-PL", "NAV-SBAS")
    counts = {kind: len(found) for kind, found in by_kind.items()}
    assert counts == dict.fromkeys(kinds, EPOCHS) | {"RXM-SFRBX": EPOCHS // FRAME_EVERY}
    assert len(ours) == EPOCHS

    def peer(kind: str, name: str) -> np.ndarray:
        return np.array([getattr(message, name) for message in by_kind[kind]], np.float64)

    def same(column: str, theirs: np.ndarray, tolerance: float = 1e-12) -> None:
        np.testing.assert_allclose(ours.table[column], theirs, rtol=0, atol=tolerance)

    fix = peer("NAV-PVT", "fixType") == 3
    for column, name, unit in (
        ("lat_deg", "lat", 1), ("lon_deg", "lon", 1), ("height_m", "height", 1e-3),
        ("vel_n_mps", "velN", 1e-3), ("vel_e_mps", "velE", 1e-3), ("vel_u_mps", "velD", -1e-3),
        ("speed_mps", "gSpeed", 1e-3), ("x_h_accuracy_m", "hAcc", 1e-3),
        ("x_v_accuracy_m", "vAcc", 1e-3),
    ):  # fmt: skip
        same(column, np.where(fix, peer("NAV-PVT", name) * unit, np.nan), 1e-10)
    undulation = (peer("NAV-PVT", "height") - peer("NAV-PVT", "hMSL")) * 1e-3
    same("x_undulation_m", np.where(fix, undulation, np.nan))
    same("n_sv", peer("NAV-PVT", "numSV"))
    limits = [np.nan, 1, 2, 5, 10, 15, 20, 30, 45, 60, 90, 120, *[np.nan] * 4]
    age = peer("NAV-PVT", "lastCorrectionAge").astype(int)
    same("correction_age_s", np.array(limits)[age])
    for column, name in (("pdop", "pDOP"), ("vdop", "vDOP"), ("hdop", "hDOP")):
        theirs = peer("NAV-DOP", name)
        same(column, np.where(theirs == 99.99, np.nan, theirs))

    valid = fix & (peer("NAV-COV", "posCovValid") == 1)
    for column, pair in (("sigma_n_m", "NN"), ("sigma_e_m", "EE"), ("sigma_u_m", "DD")):
        same(column, np.where(valid, np.sqrt(peer("NAV-COV", f"posCov{pair}")), np.nan))
    same("cov_en_m2", np.where(valid, peer("NAV-COV", "posCovNE"), np.nan))

    _same_levels(ours, peer)
    _same_modes(ours, peer, fix)

    frames = ours.side_tables["sbas_frames"]
    assert frames["prn"].tolist() == peer("RXM-SFRBX", "svId").tolist()
    words = [[getattr(m, f"dwrd_{k:02d}") for k in range(1, 9)] for m in by_kind["RXM-SFRBX"]]
    bits = np.array(words, ">u4")
    assert frames["frame"].tolist() == [row.tobytes() for row in bits]
    numbers = [int.from_bytes(row.tobytes(), "big") >> 6 for row in bits]
    shifted = np.frombuffer(b"".join(n.to_bytes(32, "big") for n in numbers), np.uint8)
    good = crc24q_of_rows(shifted.reshape(-1, 32)) == 0
    assert frames["crc_passed"].tolist() == good.tolist()

    epoch = np.datetime64("1980-01-06", "ms") + np.timedelta64(WEEK * 604_800_000, "ms")
    times = epoch + np.timedelta64(FIRST_MS, "ms") + np.arange(EPOCHS) * STEP_MS
    assert (ours.time == times).all()
    assert (frames["time"] == times[::FRAME_EVERY]).all()
    itow = (times - epoch).astype(np.int64) % 604_800_000
    assert (peer("NAV-PVT", "iTOW") == itow).all()


def _same_levels(ours: Recording, peer) -> None:  # type: ignore[no-untyped-def]
    valid = peer("NAV-PL", "plPosValid") == 1
    north, east, down = (peer("NAV-PL", f"plPos{k}") * 1e-3 for k in (1, 2, 3))
    expected = {"hpl_m": np.hypot(north, east), "vpl_m": down}
    for column, level in expected.items():
        theirs = np.where(valid, level, np.nan)
        np.testing.assert_allclose(ours.table[column], theirs, rtol=1e-14)
    invalid = (ours.table["flags"].to_numpy() & Flag.PL_DECLARED_INVALID) != 0
    assert (invalid == ~valid).all()
    # pyubx2 gives no unit; 1 x 10^-5 is percent.
    assert (ours.meta.pl.kind, ours.meta.pl.risk) == ("tmir", 1e-7)


def _same_modes(ours: Recording, peer, fix: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    geo = peer("NAV-SBAS", "geo")
    mode = np.where(peer("NAV-PVT", "diffSoln") == 0, "standalone",
                    np.where(geo != 0, "sbas", "dgnss"))  # fmt: skip
    mode = np.where(peer("NAV-PVT", "carrSoln") != 0, "rtk", mode)
    mode = np.where(fix, mode, "none")
    assert ours.table["mode"].tolist() == mode.tolist()
    assert set(mode) == {"none", "standalone", "sbas", "dgnss", "rtk"}
    assert ours.table["geo_prn"].tolist() == np.where(mode == "sbas", geo, -1).tolist()
