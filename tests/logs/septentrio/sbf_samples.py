"""Recordings and SBF bytes that several tests share; all made here, none from a receiver."""

from __future__ import annotations

import struct
from binascii import crc_hqx

import numpy as np
import pandas as pd
import pyarrow as pa

from sbas.logs.septentrio.sbf_writer import encode_blocks
from sbas.recording import COLUMNS, Recording, mode_categories

WEEK = 1549
EVERY_FLOAT = [name for name, column in COLUMNS.items() if column.dtype == "f8"]


def recording(epochs: int, *, seed: int = 0, frames: int | None = None) -> Recording:
    """Epochs at 1 Hz with random but possible values; one SBAS frame an epoch by default."""
    rng = np.random.default_rng(seed)
    time = np.datetime64("2009-09-19T00:00:00", "ns") + np.arange(epochs) * np.timedelta64(1, "s")
    data: dict[str, object] = {name: rng.uniform(0.5, 40, epochs) for name in EVERY_FLOAT}
    data["lat_deg"] = rng.uniform(-90, 90, epochs)
    data["lon_deg"] = rng.uniform(-180, 180, epochs)
    data["cov_en_m2"] = rng.uniform(-1, 1, epochs)
    data["vel_e_mps"] = rng.uniform(-40, 40, epochs)
    data["vel_u_mps"] = rng.uniform(-2, 2, epochs)
    data["speed_mps"] = np.hypot(data["vel_e_mps"], data["vel_n_mps"])  # type: ignore[arg-type]
    data["n_sv"] = rng.integers(4, 15, epochs).astype("i2")
    data["geo_prn"] = rng.choice(np.array([0, 120, 123, 136, 158], "i2"), epochs)
    data["mode"] = mode_categories(rng.choice(np.array([2, 3, 4]), epochs))
    data["flags"] = rng.choice(np.array([16, 32, 64], "u4"), epochs)
    table = pd.DataFrame(data, index=pd.DatetimeIndex(time, name="time"))
    count = epochs if frames is None else frames
    side = {} if not count else {"sbas_frames": frame_table(time[:count], rng)}
    return Recording(table, side_tables=side)


def frame_table(time: np.ndarray, rng: np.random.Generator) -> pd.DataFrame:
    n = len(time)
    raw = rng.integers(0, 256, (n, 32), dtype=np.uint8)
    array = pa.FixedSizeBinaryArray.from_buffers(pa.binary(32), n, [None, pa.py_buffer(raw)])
    return pd.DataFrame(
        {
            "time": time,
            "prn": rng.choice(np.array([120, 123, 140, 141, 158], "i2"), n),
            "crc_passed": rng.random(n) < 0.9,
            "signal": pd.Categorical(rng.choice(["L1", "L5"], n), categories=["L1", "L5"]),
            "frame": pd.arrays.ArrowExtensionArray(pa.chunked_array([array])),
        }
    )


def block(number: int, revision: int = 0, **fields: object) -> bytes:
    """One block at `WEEK`, or where `week` says; `tow_ms` is needed."""
    rows = encode_blocks(number, revision, {"week": WEEK, **fields})  # type: ignore[dict-item]
    return rows.tobytes()


def opaque_block(number: int, body: bytes, tow_ms: int = 0) -> bytes:
    """A block of any number with a body of any content, padded to a multiple of 4."""
    body += bytes(-len(body) % 4)
    head = number.to_bytes(2, "little") + (len(body) + 14 + 2).to_bytes(2, "little")
    rest = head + tow_ms.to_bytes(4, "little") + WEEK.to_bytes(2, "little") + b"\0\0" + body
    return b"$@" + crc_hqx(rest, 0).to_bytes(2, "little") + rest


def reference_blocks(data: bytes) -> list[tuple[int, int, bytes]]:
    """(place, number, bytes) of every block, by a plain loop after the guide's framing rules.

    After a failure it goes on two bytes on; after a block, behind the block.
    """
    found = []
    at = data.find(b"$@")
    while at >= 0:
        length = int.from_bytes(data[at + 6 : at + 8], "little")
        whole = data[at : at + length]
        if (
            at + 16 <= len(data)
            and length >= 16
            and length % 4 == 0
            and len(whole) == length
            and crc_hqx(whole[4:], 0) == int.from_bytes(whole[2:4], "little")
        ):
            found.append((at, int.from_bytes(whole[4:6], "little") & 0x1FFF, whole))
            at = data.find(b"$@", at + length)
        else:
            at = data.find(b"$@", at + 2)
    return found


def with_sub_blocks(number: int, tow_ms: int, head: bytes, *sub_blocks: bytes) -> bytes:
    """A block of any number: what follows the time, then sub-blocks as they are."""
    body = b"".join(sub_blocks)
    rest = tow_ms.to_bytes(4, "little") + WEEK.to_bytes(2, "little") + head + body
    rest += bytes(-(len(rest) + 8) % 4)
    rest = number.to_bytes(2, "little") + (len(rest) + 8).to_bytes(2, "little") + rest
    return b"$@" + crc_hqx(rest, 0).to_bytes(2, "little") + rest


def positions_block(
    tow_ms: int, satellites: dict[int, tuple[float, float, float]], *, size: int = 48
) -> bytes:
    """PVTSatCartesian: SVID -> position; revision 0 (40 bytes a satellite), 1 (48) or later."""
    rows = [
        struct.pack("<BBHddd", svid, 0, 7, *xyz).ljust(size, b"\xaa")
        for svid, xyz in satellites.items()
    ]
    number = 4008 | (1 << 13 if size > 40 else 0)
    return with_sub_blocks(number, tow_ms, bytes([len(rows), size]), *rows)


def corrections_block(
    tow_ms: int, satellites: dict[int, tuple[float, float, float, float]], *, size: int = 64
) -> bytes:
    """GEOCorrections: SVID -> variances (corrections, ionosphere, receiver, troposphere)."""
    rows = [
        struct.pack("<BB2x11f4f", svid, 9, *range(11), *variances)[:size].ljust(size, b"\xbb")
        for svid, variances in satellites.items()
    ]
    return with_sub_blocks(5935, tow_ms, bytes([len(rows), size]), *rows)


def signal(
    svid: int,
    *,
    signal: int = 0,
    antenna: int = 0,
    kind: int = 1,
    code: tuple[float, int, int] | None = None,
    phase: tuple[float, int, int] | None = None,
    doppler: tuple[float, int, int] | None = None,
    sizes: tuple[int, int] = (12, 8),
) -> bytes:
    """One signal of PVTResiduals with its residuals: (residual, W, MDB) raw."""
    residuals = [code, phase, doppler]
    info = kind | sum(4 << i for i, values in enumerate(residuals) if values is not None)
    first = struct.pack("<6BHHH", svid, 0, signal | antenna << 5, 255, 255, info, 5, 100, 120)
    return first.ljust(sizes[0], b"\xcc") + b"".join(
        struct.pack("<fHH", *values).ljust(sizes[1], b"\xdd")
        for values in residuals
        if values is not None
    )


def residuals_block(tow_ms: int, *signals: bytes, sizes: tuple[int, int] = (12, 8)) -> bytes:
    """PVTResiduals version 2."""
    return with_sub_blocks(4009 | 1 << 13, tow_ms, bytes([len(signals), *sizes, 0, 0, 0]), *signals)
