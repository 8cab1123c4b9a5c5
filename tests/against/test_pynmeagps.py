"""The NMEA reader against pynmeagps, field by field, over 1e4 epochs of a generated file."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from sbas.logs.nmea.nmea import read
from sbas.recording import Flag
from sbas.timescales import utc_to_gps
from tests.logs.nmea.nmea_samples import log

pynmeagps = pytest.importorskip("pynmeagps", reason="pynmeagps is the peer of this test")

EPOCHS = 10_000
KNOT_MPS = 1852 / 3600


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """1e4 epochs of ten sentences of three talkers, across a midnight."""
    path = tmp_path_factory.mktemp("peer") / "generated.nmea"
    path.write_bytes(b"".join(log(EPOCHS, seed=9)))
    return path


def test_field_by_field(file: Path) -> None:
    ours = read(file)
    table = ours.table
    by_kind: dict[str, list[object]] = {}
    for _, parsed in pynmeagps.NMEAReader(BytesIO(file.read_bytes())):
        by_kind.setdefault(parsed.identity, []).append(parsed)
    assert {len(v) for v in by_kind.values()} == {EPOCHS, 2 * EPOCHS}
    assert len(table) == EPOCHS

    def peer(kind: str, name: str) -> np.ndarray:
        values = [getattr(message, name) for message in by_kind[kind]]
        return np.array([np.nan if value == "" else value for value in values])

    def same(column: str, theirs: np.ndarray, tolerance: float = 0.0) -> None:
        np.testing.assert_allclose(table[column], theirs, rtol=0, atol=tolerance)

    stamps = [f"{m.date}T{m.time}" for m in by_kind["GNRMC"]]  # type: ignore[attr-defined]
    assert (ours.time == utc_to_gps(np.array(stamps, "M8[ns]"))).all()

    quality = peer("GNGGA", "quality")
    fixed = quality > 0
    assert 0 < fixed.sum() < EPOCHS
    # pynmeagps rounds degrees to ten decimals.
    same("lat_deg", np.where(fixed, peer("GNGGA", "lat"), np.nan), 1e-10)
    same("lon_deg", np.where(fixed, peer("GNGGA", "lon"), np.nan), 1e-10)
    height = peer("GNGGA", "alt") + peer("GNGGA", "sep")
    same("height_m", np.where(fixed, height, np.nan), 1e-9)
    same("speed_mps", np.where(fixed, peer("GNRMC", "spd") * KNOT_MPS, np.nan), 1e-9)
    course = np.radians(peer("GNRMC", "cog"))
    for column, part in (("vel_e_mps", np.sin(course)), ("vel_n_mps", np.cos(course))):
        velocity = peer("GNRMC", "spd") * KNOT_MPS * part
        same(column, np.where(fixed, velocity, np.nan), 1e-9)
    words = np.array(["none", "standalone", "dgnss", "", "rtk", "rtk", "other"])
    assert table["mode"].tolist() == words[quality.astype(int)].tolist()
    # Where GGA stops at twelve, the satellites that GPS and GLONASS list in GSA are counted.
    listed = sum(
        np.array([sum(getattr(m, f"svid_{k:02d}") != "" for k in range(1, 13)) for m in by_kind[n]])
        for n in ("GPGSA", "GLGSA")
    )
    counted = peer("GNGGA", "numSV")
    assert (counted == 12).any()
    same("n_sv", np.where(counted == 12, listed, counted))
    same("hdop", peer("GNGGA", "HDOP"))
    same("correction_age_s", peer("GNGGA", "diffAge"))
    same("x_station_id", peer("GNGGA", "diffStation").astype(float))
    same("x_undulation_m", peer("GNGGA", "sep"))

    same("pdop", peer("GPGSA", "PDOP"))
    same("vdop", peer("GPGSA", "VDOP"))
    ids = np.array([peer("GPGSA", f"svid_{k:02d}").astype(float) for k in range(1, 13)])
    sbas = np.nanmax(np.where(ids >= 33, ids + 87, -1), axis=0)
    assert (sbas > 0).any()
    same("geo_prn", sbas)
    flat = peer("GPGSA", "navMode").astype(int) == 2
    flags = table["flags"].to_numpy()
    assert ((flags & np.uint32(Flag.TWO_DIMENSIONAL) != 0) == flat).all()

    for column, name in (
        ("sigma_n_m", "stdLat"),
        ("sigma_e_m", "stdLong"),
        ("sigma_u_m", "stdAlt"),
    ):
        same(column, peer("GNGST", name))
    major, minor = peer("GNGST", "stdMajor"), peer("GNGST", "stdMinor")
    angle = np.radians(peer("GNGST", "orient"))
    same("cov_en_m2", (major**2 - minor**2) * np.sin(2 * angle) / 2, 1e-12)
    for column, name in (
        ("x_gbs_sigma_n_m", "errLat"), ("x_gbs_sigma_e_m", "errLon"), ("x_gbs_sigma_u_m", "errAlt"),
        ("x_gbs_failed_sv", "svid"), ("x_gbs_missed_detection", "prob"), ("x_gbs_bias_m", "bias"),
        ("x_gbs_bias_sigma_m", "stddev"),
    ):  # fmt: skip
        same(column, peer("GNGBS", name).astype(float))
    heard = np.zeros(EPOCHS)
    for kind in ("GPGSV", "GLGSV"):
        strong = [
            sum(getattr(m, f"cno_{k:02d}", "") not in ("", 0) for k in range(1, 5))
            for m in by_kind[kind]
        ]
        heard += np.array(strong).reshape(EPOCHS, -1).sum(axis=1)
    assert heard.min() > 0
    same("n_sv_tracked", heard)
