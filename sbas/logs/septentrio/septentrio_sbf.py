"""Septentrio SBF: receiver logs of PolaRx, AsteRx and mosaic receivers.

The chain: `sbf_framing` finds the blocks, `sbf_blocks` names their fields, `sbf_epochs` joins
them to epochs, `sbf_decode` makes columns of them, `sbf_foreign` looks at what is left over and
`sbf_report` says what was found.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.logs.format import Format, Match, Progress
from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio import sbf_decode as decode
from sbas.logs.septentrio import sbf_report as report
from sbas.logs.septentrio.sbf_epochs import Stamps, join
from sbas.logs.septentrio.sbf_framing import CHUNK_BYTES, Frames, frame, scan
from sbas.logs.septentrio.sbf_table import KINDS, Raw, empty_column, fill_table
from sbas.logs.septentrio.sbf_writer import write
from sbas.recording import Recording, RecordingMeta
from sbas.timescales import GPS_EPOCH_NS, WEEK_S

_WEEK_MS = WEEK_S * 1000
_LAST_WEEK = 14_000
"""Weeks beyond (year 2248) do not fit datetime64[ns]; they count as no time."""

_FRAMES = {sbf.GEO_RAW_L1: "L1", sbf.GEO_RAW_L5: "L5"}

FILLED = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "vpl_m", "hdop", "vdop", "pdop", "n_sv", "mode",
    "geo_prn", "sigma_e_m", "sigma_n_m", "sigma_u_m", "cov_en_m2", "speed_mps", "vel_e_mps",
    "vel_n_mps", "vel_u_mps", "herl_m", "verl_m", "correction_age_s", "flags",
    "x_h_accuracy_m", "x_v_accuracy_m", "x_undulation_m",
)  # fmt: skip
"""Columns that SBF fills. The accuracies are the receiver's own, 2 sigma; the undulation is that
of its geoid model."""

_PVT_FIELDS: dict[str, tuple[str, ...]] = {
    "lat_deg": ("lat", "x", "y", "z"), "lon_deg": ("lon", "x", "y", "z"),
    "height_m": ("height", "x", "y", "z"),
    **dict.fromkeys(("speed_mps", "vel_e_mps", "vel_n_mps", "vel_u_mps"),
                    ("vn", "ve", "vu", "vx", "vy", "vz", "x", "y", "z")),
    "n_sv": ("n_sv",), "mode": ("mode", "wa_corr_info"),
    "geo_prn": ("mode", "geo_svid", "reference_id"),
    "correction_age_s": ("correction_age",),
    "flags": ("mode", "lat", "lon", "x", "y", "z", "alert_flag"),
    "x_h_accuracy_m": ("h_accuracy",), "x_v_accuracy_m": ("v_accuracy",),
    "x_undulation_m": ("undulation",),
    "hpl_m": ("signal_info",), "vpl_m": ("signal_info",),
}  # fmt: skip
_CARTESIAN_COVARIANCE = ("xx", "yy", "zz", "xy", "xz", "yz")
_COVARIANCE_FIELDS: dict[str, tuple[str, ...]] = {
    "sigma_e_m": ("ee", *_CARTESIAN_COVARIANCE),
    "sigma_n_m": ("nn", *_CARTESIAN_COVARIANCE),
    "sigma_u_m": ("uu", *_CARTESIAN_COVARIANCE),
    "cov_en_m2": ("ne", *_CARTESIAN_COVARIANCE),
}
_DILUTION_FIELDS: dict[str, tuple[str, ...]] = {
    "hdop": ("hdop",), "vdop": ("vdop",), "pdop": ("pdop",), "n_sv": ("n_sv",),
    "hpl_m": ("hpl",), "vpl_m": ("vpl",),
}  # fmt: skip
_RAIM_FIELDS: dict[str, tuple[str, ...]] = {
    "herl_m": ("herl",), "verl_m": ("verl",), "flags": ("integrity_flag",),
}  # fmt: skip
_NEEDS: dict[str, tuple[str, ...]] = {
    # What a column needs beside its own fields: rotation, kind of the levels, complete flags.
    **dict.fromkeys(_COVARIANCE_FIELDS, ("lat_deg", "lon_deg")),
    "hpl_m": ("mode", "n_sv"), "vpl_m": ("mode", "n_sv"),
    "flags": ("lat_deg", "lon_deg", "sigma_e_m", "sigma_n_m", "sigma_u_m", "hpl_m", "vpl_m",
              "mode", "n_sv"),
}  # fmt: skip


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """How surely content is SBF: by blocks with a good CRC, 98 for three and 85 for one."""
    seen: set[bytes] = set()
    for piece in (head, middle, tail):
        for group in frame(np.frombuffer(piece, np.uint8)).groups:
            # Samples of a short file overlap; CRC, ID and time tell its blocks apart.
            seen.update(row.tobytes() for row in group.rows[:, 2:14])
    if not seen:
        return Match(0, "no SBF block with a good CRC")
    return Match(98 if len(seen) >= 3 else 85, f"{len(seen)} SBF blocks with a good CRC")


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Recording of an SBF file.

    Every block with a good CRC counts, also in a damaged file or between other data. Version 2
    blocks go before version 1 and geodetic before Cartesian ones where both carry an epoch.

    Parameters
    ----------
    path : the file.
    columns : columns to read, of `FILLED`; by default all. Those that SBF lacks are left out.
    progress : called with bytes done and bytes in all.

    Returns
    -------
    Recording; frames of SBAS satellites are in the side table `sbas_frames` with `time`, `prn`
    (-1 where the number is no SBAS satellite's), `crc_passed`, `signal` (L1 or L5) and `frame`:
    32 bytes, the first received bit in front, of which the last 6 bits carry nothing. Findings
    in the metadata say what was removed, cut, left over or unusual.
    """
    return read_in_chunks(path, CHUNK_BYTES, columns=columns, progress=progress)


def read_in_chunks(
    path: Path,
    chunk_bytes: int,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """`read` with a stated size of chunks, which changes speed and memory, never the result."""
    asked = tuple(FILLED if columns is None else (c for c in columns if c in FILLED))
    want = set(asked)
    for name in asked:
        want.update(_NEEDS.get(name, ()))
    path = Path(path)
    log = _load(path, _plan(want), chunk_bytes, progress)
    stamps = {number: log.stamps(number) for kind in KINDS for number in kind}
    stamps[sbf.END_OF_PVT] = log.stamps(sbf.END_OF_PVT)
    epochs = join(stamps, sbf.END_OF_PVT)
    table = fill_table(epochs, log.raw, want)
    index = pd.DatetimeIndex(_gps_times(epochs.time_ms), name="time", copy=False)
    data = {
        name: table.columns[name] if name in table.columns else empty_column(name, len(index))
        for name in asked
    }
    frames = _frame_table(log.raw)
    seen = report.Seen(
        epochs=len(index),
        incomplete=table.incomplete,
        without_time=log.without_time,
        encapsulated=log.encapsulated,
        removed=table.removed,
        levels=table.levels,
    )
    meta = RecordingMeta(
        leap_seconds=report.leap_seconds(log.raw.get(sbf.RECEIVER_TIME)),
        frame=report.reference_frame(log.raw.get(sbf.PVT_GEODETIC)),
        antenna="marker",
        pl=report.protection_level_meta(table.levels),
        findings=(
            *report.findings(seen, log.raw.get(sbf.RECEIVER_TIME)),
            *report.leftover_findings(path, log.gap_start, log.gap_end),
        ),
    )
    side = {} if frames is None else {"sbas_frames": frames}
    return Recording(pd.DataFrame(data, index=index, copy=False), meta, side)


def _plan(want: set[str]) -> dict[int, tuple[str, ...]]:
    """Fields to keep of each block number."""
    by_kind = (_PVT_FIELDS, _COVARIANCE_FIELDS, _DILUTION_FIELDS, _RAIM_FIELDS)
    always: tuple[set[str], ...] = ({"error"}, {"error"}, set(), set())
    plan: dict[int, tuple[str, ...]] = {}
    for numbers, fields, minimum in zip(KINDS, by_kind, always, strict=True):
        names = {name for column in want for name in fields.get(column, ())} | minimum
        for number in numbers:
            plan[number] = tuple(sorted(names & sbf.BLOCKS[number].fields.keys()))
    plan[sbf.PVT_GEODETIC] += ("datum",)
    plan[sbf.END_OF_PVT] = ()
    plan[sbf.RECEIVER_TIME] = ("leap_seconds", "sync_level")
    plan |= dict.fromkeys(_FRAMES, ("svid", "crc_passed", "bits"))
    return plan


@dataclass
class _Log:
    """What was kept of a file: raw fields by block number, and the stretches between blocks.

    Blocks without a usable time are counted in `without_time` and dropped. `raw[number]` holds
    `position` and `time_ms` beside the fields of the plan.
    """

    raw: dict[int, Raw]
    gap_start: NDArray[np.int64]
    gap_end: NDArray[np.int64]
    without_time: dict[str, int] = field(default_factory=dict)
    encapsulated: int = 0

    def stamps(self, number: int) -> Stamps:
        raw = self.raw.get(number)
        if raw is None:
            nothing = np.empty(0, np.int64)
            return Stamps(nothing, nothing)
        return Stamps(raw["position"], raw["time_ms"])


def _load(
    path: Path, plan: Mapping[int, tuple[str, ...]], chunk_bytes: int, progress: Progress | None
) -> _Log:
    def extract(frames: Frames) -> tuple[list[tuple[int, Raw]], int]:
        kept = []
        encapsulated = 0
        for group in frames.groups:
            if group.number == sbf.ENCAPSULATED:
                encapsulated += len(group.position)
            if group.number in plan:
                names = ("tow_ms", "week", *plan[group.number])
                raw = sbf.read_fields(group.rows, group.number, group.revision, names)
                kept.append((group.number, {"position": group.position, **raw}))
        return kept, encapsulated

    pieces: dict[int, list[Raw]] = defaultdict(list)
    gaps: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    done, encapsulated = 0, 0
    for frames, (kept, more) in scan(path, extract, chunk_bytes=chunk_bytes, progress=progress):
        encapsulated += more
        for number, raw in kept:
            pieces[number].append(raw)
        if len(frames.start):
            before = np.concatenate(([done], frames.end[:-1]))
            gap = frames.start > before
            gaps.append((before[gap], frames.start[gap]))
            done = int(frames.end[-1])
    size = path.stat().st_size
    gaps.append((np.array([done][: size > done]), np.array([size][: size > done])))
    log = _Log(
        {},
        np.concatenate([start for start, _ in gaps]).astype(np.int64),
        np.concatenate([end for _, end in gaps]).astype(np.int64),
        encapsulated=encapsulated,
    )
    for number in sorted(pieces):
        raw = _timed(_joined(pieces.pop(number)))
        if lost := int((raw["time_ms"] < 0).sum()):
            log.without_time[sbf.BLOCKS[number].name] = lost
            raw = {name: values[raw["time_ms"] >= 0] for name, values in raw.items()}
        if len(raw["position"]):
            log.raw[number] = raw
    return log


def _joined(pieces: list[Raw]) -> Raw:
    """Pieces of one block number as one, in file order."""
    raw = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    position = raw["position"]
    if (position[1:] < position[:-1]).any():  # blocks of several revisions
        order = np.argsort(position, kind="stable")
        raw = {name: values[order] for name, values in raw.items()}
    return raw


def _timed(raw: Raw) -> Raw:
    """The raw fields with `time_ms`, -1 where the block has no usable time."""
    tow, week = raw.pop("tow_ms"), raw.pop("week")
    time_ms = week.astype(np.int64) * _WEEK_MS + tow
    unusable = (tow >= _WEEK_MS) | (week >= _LAST_WEEK)
    if unusable.any():
        time_ms[unusable] = -1
    return {**raw, "time_ms": time_ms}


def _gps_times(time_ms: NDArray[np.int64]) -> NDArray[np.datetime64]:
    return (time_ms * 1_000_000 + GPS_EPOCH_NS).view("M8[ns]")


def _frame_table(raw: Mapping[int, Raw]) -> pd.DataFrame | None:
    """Side table `sbas_frames`, in file order; None where the file has no frame."""
    present = [number for number in _FRAMES if number in raw]
    if not present:
        return None
    signal = np.repeat(range(len(present)), [len(raw[n]["position"]) for n in present])
    frames = raw[present[0]]
    if len(present) > 1:
        frames = {name: np.concatenate([raw[n][name] for n in present]) for name in frames}
        order = np.argsort(frames["position"], kind="stable")
        frames, signal = {name: v[order] for name, v in frames.items()}, signal[order]
    # The receiver stores words of 32 bits with the first received bit as the most significant.
    data = pa.py_buffer(frames["bits"].byteswap())
    array = pa.FixedSizeBinaryArray.from_buffers(pa.binary(32), len(signal), [None, data])
    return pd.DataFrame(
        {
            "time": _gps_times(frames["time_ms"]),
            "prn": decode.prn_of_svid(frames["svid"]),
            "crc_passed": frames["crc_passed"] != 0,
            "signal": pd.Categorical.from_codes(
                signal.astype(np.int8), categories=[_FRAMES[n] for n in present]
            ),
            "frame": pd.arrays.ArrowExtensionArray(pa.chunked_array([array])),
        },
        copy=False,
    )


FORMAT = Format(
    name="septentrio_sbf",
    extensions=(".sbf",),
    description="Septentrio SBF receiver log, CRC-checked, with raw SBAS frames",
    sniff=sniff,
    read=read,
    write=write,
)
