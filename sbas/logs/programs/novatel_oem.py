"""NovAtel OEM4 to OEM7 logs, binary and ASCII, through the library novatel-edie.

The library finds, checks and translates the messages; their fixed binary layout is then read as
arrays. BESTPOS (42), BESTVEL (99), PSRDOP (174) and RAIMSTATUS (1286) are used. The protection
levels of RAIMSTATUS are the receiver's RAIM levels, not those of DO-229: NovAtel has no log with
the latter. Source: OEM7 Commands and Logs Reference Manual; message database of novatel-edie.
"""

from __future__ import annotations

import functools
import importlib
import operator
import os
import re
import zlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.delimited.column_map import pl_outside_sbas
from sbas.logs.format import Format, Match, Progress
from sbas.logs.programs.epoch_join import joined_epochs
from sbas.logs.sentinels import remove_sentinels, sentinel_findings
from sbas.recording import (
    MODES,
    Flag,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    mode_categories,
    with_columns,
)
from sbas.timescales import gps_time

CHUNK_BYTES = 1 << 18
_HEADER = [
    ("sync", "V4"), ("id", "<u2"), ("format", "V4"), ("sequence", "<u2"), ("idle", "u1"),
    ("time_status", "u1"), ("week", "<u2"), ("ms", "<u4"), ("rest", "V8"),
]  # fmt: skip
_BODIES: dict[int, list[tuple[str, str]]] = {
    42: [("status", "<u4"), ("type", "<u4"), ("lat", "<f8"), ("lon", "<f8"), ("height", "<f8"),
         ("undulation", "<f4"), ("datum", "<u4"), ("sigma_n", "<f4"), ("sigma_e", "<f4"),
         ("sigma_u", "<f4"), ("station", "S4"), ("age", "<f4"), ("solution_age", "<f4"),
         ("tracked", "u1"), ("used", "u1")],
    99: [("status", "<u4"), ("type", "<u4"), ("latency", "<f4"), ("age", "<f4"),
         ("speed", "<f8"), ("track", "<f8"), ("up", "<f8")],
    174: [("gdop", "<f4"), ("pdop", "<f4"), ("hdop", "<f4")],
    1286: [("mode", "<u4"), ("integrity", "<u4"), ("hpl_status", "<u4"), ("hpl", "<f8"),
           ("vpl_status", "<u4"), ("vpl", "<f8")],
}  # fmt: skip
_POSITION, _VELOCITY, _DILUTION, _RAIM = _BODIES
_NAMES = {42: "BESTPOS", 99: "BESTVEL", 174: "PSRDOP", 1286: "RAIMSTATUS"}
_SOLUTION_COMPUTED = 0
_WGS84 = 61
_LOWEST_TIME_STATUS = 100
"""COARSE; below it the receiver's time is unknown, approximate or still being adjusted."""
_MODE_OF_TYPE = {
    "none": (0,), "standalone": (16,), "dgnss": (17,), "sbas": (18,),
    "rtk": (32, 33, 34, 35, 46, 47, 48, 49, 50),
}  # fmt: skip
_PROPAGATED = 19
_AVAILABLE = (1, 2)
_RAIM_FLAG = {0: Flag.RAIM_NOT_AVAILABLE, 1: Flag.RAIM_PASSED, 2: Flag.RAIM_FAILED}
_LAST_WEEK = 14_000
_LONG_SYNC, _SHORT_SYNC = b"\xaa\x44\x12", b"\xaa\x44\x13"
_SHORT_HEADER_BYTES = 12
_ASCII_LINE = re.compile(rb"#([A-Z0-9]+A,[^*\r\n]{20,4096})\*([0-9a-f]{8})")
_NMEA_LINE = re.compile(rb"\$([^$*\r\n]{5,1024})\*([0-9A-Fa-f]{2})\r?\n?")
_BETWEEN_BYTES = 1 << 20

Raw = NDArray[np.void]


@dataclass
class _Log:
    """Messages by number as they come, and bytes that are none."""

    messages: dict[int, list[bytes]] = field(default_factory=lambda: defaultdict(list))
    places: dict[int, list[int]] = field(default_factory=lambda: defaultdict(list))
    orphan_bytes: int = 0
    first_orphan: bytes = b""
    other_layout: int = 0
    between: bytearray = field(default_factory=bytearray)


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Recording of a NovAtel log.

    Parameters
    ----------
    path : the file, binary or ASCII or both.
    columns : documented columns to keep; all by default.
    progress : called with bytes done and in all.

    Returns
    -------
    Recording of the epochs of BESTPOS and RAIMSTATUS, with the speed of BESTVEL and the
    dilutions of PSRDOP where their time is the same.

    Raises
    ------
    InputError : the library novatel-edie is not installed.
    """
    log = _load(path, progress)
    arrays = {number: _array(number, log) for number in _BODIES}
    untimed = 0
    places = {}
    for number, raw in arrays.items():
        timed = (raw["time_status"] >= _LOWEST_TIME_STATUS) & (raw["week"] < _LAST_WEEK)
        untimed += int(np.count_nonzero(~timed))
        arrays[number] = raw[timed]
        places[number] = np.array(log.places[number], np.int64)[timed]
    times = {number: _times_ns(raw) for number, raw in arrays.items()}
    epochs = (_POSITION, _RAIM)
    time_ns, rows = joined_epochs([times[n] for n in epochs], [places[n] for n in epochs])
    of = dict(zip(epochs, rows, strict=True))
    for number in (_VELOCITY, _DILUTION):
        of[number] = _row_at(times[number], time_ns)
    table, pl, findings = _columns(arrays, of, len(time_ns))
    frame = pd.DataFrame(table, index=pd.DatetimeIndex(time_ns.view("M8[ns]"), name="time"))
    datums = set(np.unique(arrays[_POSITION]["datum"]).tolist())
    meta = RecordingMeta(
        frame="WGS84" if datums == {_WGS84} else "",
        pl=pl,
        findings=(*_damage_findings(log, untimed, path.stat().st_size), *findings),
    )
    return Recording(frame if columns is None else with_columns(frame, columns), meta)


def _library(where: str) -> Any:
    try:
        return importlib.import_module("novatel_edie")
    except ImportError as error:
        raise InputError(
            "NovAtel logs are read through the library novatel-edie, which is not installed",
            where=where,
            evidence=str(error),
            cure="pip install 'sbas[novatel]'",
        ) from error


def _load(path: Path, progress: Progress | None) -> _Log:
    library = _library(str(path))
    parser = library.oem.Parser()
    parser.return_unknown_bytes = True
    wanted = library.oem.Filter()
    for number in _BODIES:
        wanted.add_message_id(number)
    parser.filter = wanted
    log = _Log()
    place = 0
    # The library yields one message at a time: this loop is the price of its checks.
    for message in _parsed(path, parser, progress):
        if isinstance(message, library.UnknownBytes):
            log.between += message.data
            _note_orphans(log, final=False)
        elif isinstance(message, library.oem.Message):
            flat = message.to_flattened_binary().message
            number = int.from_bytes(flat[4:6], "little")
            if len(flat) < _dtype(number).itemsize:
                log.other_layout += 1
                continue
            log.messages[number].append(flat[: _dtype(number).itemsize])
            log.places[number].append(place)
            place += 1
    log.between += parser.flush(return_flushed_bytes=True)
    _note_orphans(log, final=True)
    return log


def _parsed(path: Path, parser: Any, progress: Progress | None) -> Iterator[Any]:
    total = os.path.getsize(path)
    done = 0
    with open(path, "rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            done += len(chunk)
            while chunk:
                # More than it has space for, the parser takes not in part but not at all.
                taken = parser.write(chunk[: parser.available_space])
                chunk = chunk[taken:]
                yield from parser
                if not taken and not parser.available_space:
                    raise InputError(
                        "the library novatel-edie does not get on with this file",
                        where=f"{path}, near byte {done - len(chunk):,}",
                        evidence="its buffer is full and it finds no message",
                        cure="cut the file before that byte, or update novatel-edie",
                    )
            if progress is not None:
                progress(done, total)


def _note_orphans(log: _Log, *, final: bool) -> None:
    """Count what is between the messages and no NMEA sentence, in whole lines until the end."""
    if not final and len(log.between) < _BETWEEN_BYTES:
        return
    cut = len(log.between) if final else log.between.rfind(b"\n") + 1 or len(log.between)
    between = bytes(log.between[:cut])
    del log.between[:cut]
    rest = _NMEA_LINE.sub(lambda m: b"" if _xor(m[1]) == int(m[2], 16) else m[0], between)
    rest = rest.strip(b"\r\n\t \0")
    log.orphan_bytes += len(rest)
    log.first_orphan = log.first_orphan or rest[:24]


def _xor(data: bytes) -> int:
    return functools.reduce(operator.xor, data, 0)


@functools.cache
def _dtype(number: int) -> np.dtype[Any]:
    return np.dtype(_HEADER + _BODIES[number])


def _array(number: int, log: _Log) -> Raw:
    return np.frombuffer(b"".join(log.messages[number]), _dtype(number))


def _times_ns(raw: Raw) -> NDArray[np.int64]:
    ns = raw["ms"].astype(np.int64) * 1_000_000
    return gps_time(raw["week"].astype(np.int64), ns).astype(np.int64)


def _row_at(times_ns: NDArray[np.int64], wanted_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) row of the last of some times that is the wanted one; -1 where there is none."""
    order = np.argsort(times_ns, kind="stable")
    at = np.searchsorted(times_ns[order], wanted_ns, side="right") - 1
    row = np.append(order, -1)[at]
    found = np.append(times_ns, np.iinfo(np.int64).min)[row] == wanted_ns
    return np.where(found, row, -1)


def _columns(
    arrays: Mapping[int, Raw], of: Mapping[int, NDArray[np.int64]], count: int
) -> tuple[dict[str, Any], ProtectionLevelMeta, tuple[Finding, ...]]:
    flags = np.zeros(count, np.uint32)

    def value(number: int, name: str) -> NDArray[np.float64]:
        picked: NDArray[np.float64] = np.append(arrays[number][name].astype(np.float64), np.nan)[
            of[number]
        ]
        return picked

    solved = value(_POSITION, "status") == _SOLUTION_COMPUTED
    kind = value(_POSITION, "type")
    solved &= kind != 0
    codes = np.where(np.isnan(kind), -1, MODES.index("other"))
    for mode, types in _MODE_OF_TYPE.items():
        codes[np.isin(kind, types)] = MODES.index(mode)
    codes[~solved & ~np.isnan(kind)] = MODES.index("none")
    flags[kind == _PROPAGATED] |= np.uint32(Flag.DEAD_RECKONING)
    fix = {
        "lat_deg": value(_POSITION, "lat"),
        "lon_deg": value(_POSITION, "lon"),
        "height_m": value(_POSITION, "height") + value(_POSITION, "undulation"),
        "sigma_e_m": value(_POSITION, "sigma_e"),
        "sigma_n_m": value(_POSITION, "sigma_n"),
        "sigma_u_m": value(_POSITION, "sigma_u"),
    }
    raw = {name: np.where(solved, values, np.nan) for name, values in fix.items()}
    counts = {}
    for name in ("sigma_e_m", "sigma_n_m", "sigma_u_m"):
        if (zero := raw[name] == 0).any():
            counts[name] = {"0 (not given)": int(np.count_nonzero(zero))}
            raw[name] = np.where(zero, np.nan, raw[name])
    corrected = np.isin(codes, [MODES.index(mode) for mode in ("sbas", "dgnss", "rtk")])
    raw["correction_age_s"] = np.where(corrected, value(_POSITION, "age"), np.nan)
    moving = value(_VELOCITY, "status") == _SOLUTION_COMPUTED
    speed, track = value(_VELOCITY, "speed"), np.radians(value(_VELOCITY, "track"))
    raw["speed_mps"] = np.where(moving, speed, np.nan)
    raw["vel_e_mps"] = np.where(moving, speed * np.sin(track), np.nan)
    raw["vel_n_mps"] = np.where(moving, speed * np.cos(track), np.nan)
    raw["vel_u_mps"] = np.where(moving, value(_VELOCITY, "up"), np.nan)
    raw["hdop"], raw["pdop"] = value(_DILUTION, "hdop"), value(_DILUTION, "pdop")
    integrity = value(_RAIM, "integrity")
    for number, flag in _RAIM_FLAG.items():
        flags[integrity == number] |= np.uint32(flag)
    unavailable = np.zeros(count, bool)
    for name in ("hpl", "vpl"):
        available = np.isin(value(_RAIM, f"{name}_status"), _AVAILABLE)
        raw[f"{name}_m"] = np.where(available, value(_RAIM, name), np.nan)
        unavailable |= ~available & (of[_RAIM] >= 0)
    flags[unavailable] |= np.uint32(Flag.PL_DECLARED_INVALID)
    if len(arrays[_POSITION]) and len(arrays[_RAIM]):
        flags[(of[_POSITION] < 0) | (of[_RAIM] < 0)] |= np.uint32(Flag.EPOCH_INCOMPLETE)
    removed, flags = remove_sentinels(raw, flags)
    for name, found in removed.items():
        counts[name] = {**counts.get(name, {}), **found}
    table: dict[str, Any] = dict(raw)
    for name, source in (("n_sv", "used"), ("n_sv_tracked", "tracked")):
        satellites = value(_POSITION, source)
        table[name] = np.where(np.isnan(satellites), -1, satellites).astype(np.int16)
    table["mode"] = mode_categories(codes)
    table["geo_prn"] = _geo_prn(arrays[_POSITION]["station"], of[_POSITION], codes)
    table["flags"] = flags | pl_outside_sbas(table)
    has_levels = len(arrays[_RAIM]) > 0
    pl = ProtectionLevelMeta(kind="raim" if has_levels else "unknown")
    return table, pl, (*sentinel_findings(counts), *_level_findings(table, unavailable, has_levels))


def _geo_prn(
    station: NDArray[Any], row: NDArray[np.int64], codes: NDArray[np.int64]
) -> NDArray[np.int16]:
    """(n,) PRN of the SBAS satellite, which an SBAS fix names as its base station; -1 for none."""
    names, index = np.unique(station, return_inverse=True)
    numbers = [int(name) if name.isdigit() and 120 <= int(name) <= 158 else -1 for name in names]
    prn = np.append(np.array(numbers, np.int16)[index], np.int16(-1))[row]
    return np.where(codes == MODES.index("sbas"), prn, np.int16(-1))


def _level_findings(
    table: Mapping[str, Any], unavailable: NDArray[np.bool_], has_levels: bool
) -> tuple[Finding, ...]:
    if not has_levels:
        return (
            Finding(
                "E25",
                "warning",
                "the log has no RAIMSTATUS: every epoch counts as without protection level",
                cure="log RAIMSTATUSB ONTIME 1; levels of DO-229 are in no NovAtel log",
            ),
        )
    levels = int(np.count_nonzero(~np.isnan(table["hpl_m"])))
    return (
        Finding(
            "E23",
            "warning",
            "the protection levels are those of the receiver's RAIM, not of SBAS (DO-229)",
            where="RAIMSTATUS",
            evidence=f"{levels:,} epochs with HPL; {np.count_nonzero(unavailable):,} with a level "
            "that the receiver calls not available",
            cure="never pool them with SBAS levels",
        ),
    )


def _damage_findings(log: _Log, untimed: int, size: int) -> tuple[Finding, ...]:
    findings = []
    if log.orphan_bytes:
        share = log.orphan_bytes / max(size, 1)
        findings.append(
            Finding(
                "E24",
                "error" if share > 0.01 else "warning",
                f"{log.orphan_bytes:,} bytes ({share:.2%}) belong to no valid message",
                evidence=f"first {log.first_orphan.hex(' ')}",
                cure="--accept E24 after a look",
            )
        )
    if log.other_layout:
        findings.append(
            Finding(
                "E10",
                "warning",
                "messages shorter than their layout were left out",
                evidence=f"{log.other_layout:,} of {', '.join(_NAMES.values())}",
                cure="update novatel-edie",
            )
        )
    if untimed:
        findings.append(
            Finding(
                "E10",
                "warning",
                "messages without a reliable time were left out",
                evidence=f"{untimed:,} with a time status below COARSE",
                cure="none: the receiver had not found its time yet",
            )
        )
    return tuple(findings)


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """98 for three messages with a good CRC-32, 85 for one; needs no library."""
    found = {body for sample in (head, middle) for body in _checked_messages(sample)}
    if not found:
        return Match(0, "no NovAtel message with a good CRC")
    score = 98 if len(found) >= 3 else 85
    return Match(score, f"{len(found)} NovAtel messages with a good CRC")


def _checked_messages(data: bytes) -> Iterator[bytes]:
    """Up to four messages with a good CRC, binary with either header, or ASCII."""
    left = 4
    for sync in (_LONG_SYNC, _SHORT_SYNC):
        at = data.find(sync)
        while at >= 0 and left:
            end = at + _message_bytes(data[at : at + 10])
            body, check = data[at:end], data[end : end + 4]
            if len(check) == 4 and _crc32(body) == int.from_bytes(check, "little"):
                left -= 1
                yield body
                at = data.find(sync, end + 4)
            else:
                at = data.find(sync, at + 1)
    for line in _ASCII_LINE.finditer(data):
        if left and _crc32(line[1]) == int(line[2], 16):
            left -= 1
            yield line[1]


def _message_bytes(start: bytes) -> int:
    """Header and body of a binary message, by its first ten bytes."""
    padded = start.ljust(10, b"\0")
    if start.startswith(_LONG_SYNC):
        return padded[3] + int.from_bytes(padded[8:10], "little")
    return _SHORT_HEADER_BYTES + padded[3]


def _crc32(data: bytes) -> int:
    """CRC-32 that starts from zero and is not inverted, as NovAtel's (OEM7 manual, 1.7)."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


FORMAT = Format(
    name="novatel_oem",
    extensions=(".gps", ".novatel", ".oem"),
    description="NovAtel OEM log, binary or ASCII (needs the extra 'novatel')",
    sniff=sniff,
    read=read,
)
