"""Frames with checksums: SBF, UBX (also as hexadecimal lines) and NMEA sentences."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import numpy as np

from sbas.logs.septentrio import sbf_writer
from sbas.recording import Recording
from sbas.timescales import gps_to_utc, week_and_tow_ns
from tests.corruption.forms import Form, Pieces
from tests.logs.nmea import nmea_samples
from tests.logs.ublox import ubx_samples
from tests.logs.ublox.test_ubx_hex_csv import line as hex_line

_RISK_OF_LEVELS = (5, 0)


def _sbf(recording: Recording) -> Pieces:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "made.sbf"
        sbf_writer.write([recording], path)
        data = path.read_bytes()
    length = len(data) // len(recording)
    return Pieces(b"", tuple(data[i : i + length] for i in range(0, len(data), length)))


def _utc(recording: Recording) -> list[datetime]:
    # Two receivers' clocks are no matter here: whole milliseconds.
    utc: list[datetime] = gps_to_utc(recording.time).astype("M8[ms]").tolist()
    return utc


def ubx_epochs(
    recording: Recording, risk: tuple[int, int] = _RISK_OF_LEVELS
) -> Iterator[tuple[bytes, ...]]:
    """Messages of each epoch; two equal axes make the horizontal level."""
    table = recording.table
    weeks, tow_ns = week_and_tow_ns(recording.time)
    column = {name: table[name].tolist() for name in table if name != "mode"}
    for i, utc in enumerate(_utc(recording)):
        itow, week = int(tow_ns[i] // 1_000_000), int(weeks[i])
        hpl, vpl = column["hpl_m"][i], column["vpl_m"][i]
        axis = round(1000 * hpl / np.sqrt(2))
        yield (
            ubx_samples.dop(itow, hdop=round(100 * column["hdop"][i])),
            ubx_samples.pvt(
                itow, utc=utc, n_sv=column["n_sv"][i], lat=round(column["lat_deg"][i] * 1e7),
                lon=round(column["lon_deg"][i] * 1e7), height=round(1000 * column["height_m"][i]),
            ),
            ubx_samples.timegps(itow, week=week),
            ubx_samples.sbas(itow),
            ubx_samples.pl(itow, (axis, axis, round(1000 * vpl)), risk=risk),
            ubx_samples.eoe(itow),
        )  # fmt: skip


def _ubx(recording: Recording) -> Pieces:
    return Pieces(b"", tuple(b"".join(messages) for messages in ubx_epochs(recording)))


def _ubx_hex(recording: Recording) -> Pieces:
    return Pieces(
        b"", tuple("".join(map(hex_line, epoch)).encode() for epoch in ubx_epochs(recording))
    )


def _nmea(recording: Recording) -> Pieces:
    table = recording.table
    column = {name: table[name].tolist() for name in ("lat_deg", "lon_deg", "height_m", "hdop",
                                                      "n_sv")}  # fmt: skip
    entries = []
    for i, utc in enumerate(_utc(recording)):
        time = f"{utc:%H%M%S}.{utc.microsecond // 10_000:02d}"
        where = nmea_samples.position(column["lat_deg"][i], column["lon_deg"][i], 7)
        hdop, n = column["hdop"][i], column["n_sv"][i]
        entries.append(
            nmea_samples.sentence(f"GNRMC,{time},A,{where},10.0,90.0,{utc:%d%m%y},,,D")
            + nmea_samples.sentence(
                f"GNGGA,{time},{where},2,{n:02d},{hdop:.2f},{column['height_m'][i] - 44.5:.3f},M,"
                "44.5,M,3.0,0120"
            )
            + nmea_samples.sentence(f"GNGST,{time},1.2,0.9,0.7,12.0,0.8,0.7,1.4")
            + nmea_samples.sentence(f"GPZDA,{time},{utc:%d,%m,%Y},00,00")
        )
    return Pieces(b"", tuple(entries))


BINARY_FORMS = (
    Form("sbf", "septentrio_sbf", ".sbf", "framed", _sbf),
    Form("ubx", "ublox_ubx", ".ubx", "framed", _ubx),
    Form("ubx hex", "ubx_hex_csv", ".csv", "framed", _ubx_hex),
    Form("nmea", "nmea", ".nmea", "framed", _nmea, levels=False),
)
