"""Recordings to SBF: per epoch PVTGeodetic, PosCovGeodetic, DOP, RAIMStatistics, EndOfPVT.

The rows of the side table `sbas_frames` become GEORawL1 and GEORawL5 blocks. Block layouts in
`sbf_blocks`; codes after Septentrio PolaRx5TR Reference Guide 5.5.0, pages 383-429.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.logs.checksums import crc16_of_rows
from sbas.logs.format import Progress
from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.recording import MODES, Flag, Recording, with_columns
from sbas.timescales import week_and_tow_ns

STRIP_EPOCHS = 1 << 14
_NS_PER_MS = 1_000_000
_MAX_WEEK = 65534

# Type of fix and WACorrInfo by index into MODES. Type 15 is reserved and reads as "other"; which
# kind of RTK is not known, and 4 (fixed ambiguities) stands for all.
_MODE_CODES = {
    "none": (0, 0), "standalone": (1, 0), "sbas_pa": (6, 0b11111), "sbas_npa": (6, 0b01111),
    "sbas": (6, 0), "dgnss": (2, 0), "rtk": (4, 0), "other": (15, 0),
}  # fmt: skip
_TYPE = np.array([_MODE_CODES[mode][0] for mode in MODES] + [15], np.uint8)
_WA_CORR_INFO = np.array([_MODE_CODES[mode][1] for mode in MODES] + [0], np.uint8)
_L1_GPS_AND_SBAS = 1 << 0 | 1 << 24
_TWO_DIMENSIONAL = 0x80
_NO_POSITION = 1

_EPOCH_BLOCKS = (
    (sbf.PVT_GEODETIC, 2), (sbf.COV_GEODETIC, 0), (sbf.DOP, 0), (sbf.RAIM_STATISTICS, 0),
    (sbf.END_OF_PVT, 0),
)  # fmt: skip
_EPOCH_BYTES = sum(sbf.BLOCKS[number].length(revision) for number, revision in _EPOCH_BLOCKS)
_COLUMNS = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "vdop", "pdop", "sigma_e_m",
    "sigma_n_m", "sigma_u_m", "cov_en_m2", "vel_e_mps", "vel_n_mps", "vel_u_mps", "herl_m",
    "verl_m", "correction_age_s", "n_sv", "geo_prn", "mode", "flags",
)  # fmt: skip


_EXTRA = ("x_h_accuracy_m", "x_v_accuracy_m", "x_undulation_m")


def encode_blocks(
    number: int, revision: int, fields: Mapping[str, ArrayLike], *, length: int | None = None
) -> NDArray[np.uint8]:
    """Blocks of one kind, with the right CRC.

    Parameters
    ----------
    number, revision : the kind of block, a key of `sbf_blocks.BLOCKS`.
    fields : name -> (n,) raw values (`tow_ms`, `week` and those of the block), unscaled; a field
        that is not named gets its do-not-use value.
    length : bytes a block, a multiple of 4; by default that of the revision.

    Returns
    -------
    (n, length) bytes; `.tobytes()` is what stands in a file.

    Raises
    ------
    InputError : a field that this revision does not have, or fields of unequal length.
    """
    counts = {len(np.atleast_1d(value)) for name, value in fields.items() if name != "bits"}
    counts |= {len(np.atleast_2d(fields["bits"]))} if "bits" in fields else set()
    if len(counts - {1}) > 1:
        raise InputError("fields of a block differ in length", evidence=str(sorted(counts)))
    rows = np.empty((max(counts, default=1), length or sbf.BLOCKS[number].length(revision)), "u1")
    sbf.fill_blocks(rows, number, revision, fields)
    _seal(rows)
    return rows


def write(
    recordings: Iterable[Recording], path: Path | str, *, progress: Progress | None = None
) -> None:
    """Write consecutive pieces of one recording to an SBF file.

    Per epoch go out PVTGeodetic (4007, revision 2), PosCovGeodetic (5906), DOP (4001),
    RAIMStatistics (4011), the SBAS frames up to that time (4020, 4021) and EndOfPVT (5921).
    Resolutions: DOP and age 0.01, protection levels and velocities float32, sigmas the square
    root of a float32 variance. Not held by SBF: `speed_mps` without the velocity, tracked
    satellites, environment, hardware faults. A mode that is missing cannot be written beside a
    level or a position, since its epoch would come back as one outside SBAS.

    Parameters
    ----------
    recordings : pieces in order of time.
    path : file to write.
    progress : called with (epochs done, 0): how many will come is not known.

    Raises
    ------
    InputError : a time that is not a whole millisecond, or no week number holds it.
    """
    done = 0
    with Path(path).open("wb") as file:
        for recording in recordings:
            frames = _frame_blocks(recording.side_tables.get("sbas_frames"))
            place = _places(recording, frames)
            for start in range(0, max(len(recording), 1), STRIP_EPOCHS):
                stop = min(start + STRIP_EPOCHS, len(recording))
                last = stop == len(recording)
                low, high = np.searchsorted(place, [start, len(recording) + 1 if last else stop])
                table = recording.table.iloc[start:stop]
                extra = [name for name in _EXTRA if name in table]
                epochs = _epoch_blocks(with_columns(table, [*_COLUMNS, *extra]))
                file.write(_insert(epochs, frames[low:high], place[low:high] - start).data)
                if progress is not None:
                    progress(done + stop, 0)
            done += len(recording)


def _seal(rows: NDArray[np.uint8]) -> None:
    rows[:, 2:4] = crc16_of_rows(rows[:, 4:])[:, None].view("u1")


def _stamps(time: NDArray[np.datetime64]) -> dict[str, NDArray[Any]]:
    """Fields `week` and `tow_ms` of (n,) GPS times."""
    week, tow_ns = week_and_tow_ns(time)
    odd = np.flatnonzero((tow_ns % _NS_PER_MS != 0) | (week < 0) | (week > _MAX_WEEK))
    if len(odd):
        raise InputError(
            "SBF holds times from 1980 on, in whole milliseconds",
            where=f"row {odd[0]}",
            evidence=f"{time[odd[0]]}; {len(odd)} rows in all",
            cure="round the times: table.index = table.index.round('ms')",
        )
    return {"week": week, "tow_ms": tow_ns // _NS_PER_MS}


def _float(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(np.isfinite(values), values, sbf.FLOAT_MISSING)


def _hundredths(values: NDArray[np.float64], missing: int, least: int) -> NDArray[np.uint16]:
    """Raw u2 in 0.01, kept off the values that mean "no value"."""
    known = np.isfinite(values)
    raw = np.clip(np.round(np.where(known, values, 0.0) * 100), least, 65534)
    return np.where(known, raw, missing).astype(np.uint16)


def _epoch_blocks(table: pd.DataFrame) -> NDArray[np.uint8]:
    """(n, bytes) all blocks of each epoch but the frames."""
    column = {name: table[name].to_numpy() for name in _COLUMNS if name != "mode"}
    stamps = _stamps(table.index.to_numpy())
    mode = table["mode"].cat.codes.to_numpy()
    stated = ~np.isnan(column["hpl_m"]) | ~np.isnan(column["lat_deg"])
    if np.any((mode < 0) & stated):
        raise InputError(
            "SBF cannot hold an epoch whose mode is not known",
            where=f"{int(np.sum((mode < 0) & stated)):,} epochs",
            cure="state the column `mode`, or write Parquet",
        )
    flags = column["flags"]
    n_sv, geo = column["n_sv"], column["geo_prn"]
    lost = np.isnan(column["lat_deg"]) | np.isnan(column["lon_deg"])
    sigma_n, sigma_e, sigma_u = (column[f"sigma_{axis}_m"] for axis in "neu")
    # An error code makes a reader drop the position, so it goes only where there is none.
    no_fix = (mode == MODES.index("none")) & lost
    two_dimensional = (flags & Flag.TWO_DIMENSIONAL) != 0
    fix_type = _TYPE[mode] | np.where(two_dimensional, _TWO_DIMENSIONAL, 0).astype(np.uint8)
    east, north = column["vel_e_mps"], column["vel_n_mps"]

    def other(name: str, default: NDArray[np.float64]) -> NDArray[np.float64]:
        values: NDArray[np.float64] = table[name].to_numpy() if name in table else default
        return values

    raim = np.select(
        [(flags & flag) != 0 for flag in
         (Flag.RAIM_FAILED, Flag.RAIM_PASSED, Flag.RAIM_NOT_AVAILABLE)], [1, 0, 2], 255
    )  # fmt: skip
    values: dict[int, dict[str, Any]] = {
        sbf.PVT_GEODETIC: {
            "mode": fix_type,
            "error": np.where(no_fix, _NO_POSITION, 0),
            "lat": _float(np.radians(column["lat_deg"])),
            "lon": _float(np.radians(column["lon_deg"])),
            "height": _float(column["height_m"]),
            "vn": _float(north),
            "ve": _float(east),
            "vu": _float(column["vel_u_mps"]),
            "course": _float(np.degrees(np.arctan2(east, north)) % 360),
            "time_system": 0,
            "datum": 0,
            "n_sv": np.where(n_sv < 0, 255, np.minimum(n_sv, 254)),
            "wa_corr_info": _WA_CORR_INFO[mode],
            "reference_id": np.select([geo < 0, geo == 0], [65535, 65534], geo),
            "correction_age": _hundredths(column["correction_age_s"], 65535, 0),
            "signal_info": np.where(_TYPE[mode] == 6, _L1_GPS_AND_SBAS, 0),
            "alert_flag": np.select([raim == 0, raim == 1], [1, 2], 0),
            "h_accuracy": _hundredths(
                other("x_h_accuracy_m", 2 * np.hypot(sigma_n, sigma_e)), 65535, 0
            ),
            "v_accuracy": _hundredths(other("x_v_accuracy_m", 2 * sigma_u), 65535, 0),
            "undulation": _float(other("x_undulation_m", np.full(len(table), np.nan))),
        },
        sbf.COV_GEODETIC: {
            "mode": fix_type,
            "error": np.where(no_fix, _NO_POSITION, 0),
            "nn": _float(sigma_n**2),
            "ee": _float(sigma_e**2),
            "uu": _float(sigma_u**2),
            "ne": _float(column["cov_en_m2"]),
        },
        sbf.DOP: {
            "n_sv": np.clip(n_sv, 0, 255),
            **{name: _hundredths(column[name], 0, 1) for name in ("pdop", "hdop", "vdop")},
            "hpl": _float(column["hpl_m"]),
            "vpl": _float(column["vpl_m"]),
        },
        sbf.RAIM_STATISTICS: {
            "integrity_flag": raim,
            "herl": _float(column["herl_m"]),
            "verl": _float(column["verl_m"]),
        },
        sbf.END_OF_PVT: {},
    }
    rows = np.empty((len(table), _EPOCH_BYTES), np.uint8)
    place = 0
    for number, revision in _EPOCH_BLOCKS:
        length = sbf.BLOCKS[number].length(revision)
        block = rows[:, place : place + length]
        sbf.fill_blocks(block, number, revision, {**stamps, **values[number]})
        _seal(block)
        place += length
    return rows


def frame_bytes(frames: Any) -> NDArray[np.uint8]:
    """(n, 32) bytes of a column of 32-byte frames."""
    array = pa.array(frames, type=pa.binary(32))
    if isinstance(array, pa.ChunkedArray):
        array = array.combine_chunks()
    if array.null_count:
        raise InputError("an SBAS frame is missing", cure="drop the rows without a frame")
    data = np.frombuffer(array.buffers()[1] or b"", np.uint8)
    return data[array.offset * 32 : (array.offset + len(array)) * 32].reshape(-1, 32)


def _frame_blocks(frames: pd.DataFrame | None) -> NDArray[np.uint8]:
    """(n, 52) GEORaw blocks of the side table `sbas_frames`, in its order."""
    length = sbf.BLOCKS[sbf.GEO_RAW_L1].length(0)
    if frames is None or not len(frames):
        return np.empty((0, length), np.uint8)
    prn = frames["prn"].to_numpy()
    on_l5 = (frames["signal"] == "L5").to_numpy()
    fields = {
        **_stamps(frames["time"].to_numpy()),
        "svid": np.select([prn < 0, prn > 140], [255, prn + 57], prn),
        "crc_passed": frames["crc_passed"].to_numpy(),
        "source": np.where(on_l5, 25, 24),
        "bits": frame_bytes(frames["frame"]).view(">u4"),
    }
    rows = np.empty((len(frames), length), np.uint8)
    for number, chosen in ((sbf.GEO_RAW_L1, ~on_l5), (sbf.GEO_RAW_L5, on_l5)):
        if chosen.any():
            rows[chosen] = encode_blocks(number, 0, {k: v[chosen] for k, v in fields.items()})
    return rows


def _places(recording: Recording, frames: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(n,) epoch before whose EndOfPVT each frame goes; in the order of the side table."""
    if not len(frames):
        return np.empty(0, np.int64)
    times = recording.side_tables["sbas_frames"]["time"].to_numpy()
    place = np.searchsorted(np.maximum.accumulate(recording.time), times)
    return np.maximum.accumulate(np.minimum(place, max(len(recording) - 1, 0)))


def _insert(
    epochs: NDArray[np.uint8], frames: NDArray[np.uint8], place: NDArray[np.int64]
) -> NDArray[np.uint32]:
    """The epochs' blocks with each frame's block put before the EndOfPVT of its epoch."""
    if not len(frames) or not len(epochs):
        return np.ascontiguousarray(np.vstack([e for e in (epochs, frames) if len(e)] or [epochs]))
    words, frame_words = _EPOCH_BYTES // 4, frames.shape[1] // 4
    head_words = words - sbf.BLOCKS[sbf.END_OF_PVT].length(0) // 4
    out = np.empty(epochs.size // 4 + frames.size // 4, np.uint32)
    first = place * words + head_words + np.arange(len(frames)) * frame_words
    of_frames = first[:, None] + np.arange(frame_words)
    free = np.ones(len(out), np.bool_)
    free[of_frames] = False
    out[free] = epochs.view(np.uint32).reshape(-1)
    out[of_frames] = frames.view(np.uint32)
    return out
