"""SBAS messages from lines of text: EMS, RTKLIB `.sbs`, plain hexadecimal text and columns.

A format is a pattern of lines; a line with content that fits none, or states a time that does not
exist, is unreadable and counted. Sources: EGNOS message server user interface (EMS), RTKLIB 2.4
`sbas.c` (`.sbs`), the data of cssrlib (columns), held against files of these programs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.bit_fields import FRAME_BYTES
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.timescales import GPS_EPOCH_NS, NS_PER_S, WEEK_S

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

EMS = re.compile(
    rb"^(\d{3}) (\d\d)" + 5 * rb" +(\d\d?)" + rb" +(\d\d?) +([0-9A-Fa-f]{64})\s*$",
    re.MULTILINE,
)
EMS_NEW = re.compile(
    rb"^([ \d]{2}\d)" + 6 * rb" (\d\d)" + rb"\.\d{6} ([A-Z])(\d).{6}"
    rb"(\d\d| \d|\d ) ([0-9A-Fa-f]{64})\s*$",
    re.MULTILINE,
)
SBS = re.compile(
    rb"^\s*(\d{1,5})\s+(\d{1,6})\s+(\d{1,3})\s+(\d{1,2})\s*:\s*([0-9A-Fa-f]{58})\s*$",
    re.MULTILINE,
)
HEX = re.compile(rb"^\s*(\d{1,5})\s+(\d{1,6})\s+([0-9A-Fa-f]{64})\s*$", re.MULTILINE)
COLUMNS = re.compile(
    rb"^\s*(\d{1,5})\s+(\d{1,6})\s+(\d{1,3})\s+([01])\s+\d+\s+([0-9A-Fa-f]{64})\s*$", re.MULTILINE
)


@dataclass(frozen=True, eq=False)
class SourceMessages:
    """Messages as a source states them: (n,) and (n, 32).

    `time_s` is the end of the message; `prn` and `kind` are -1 where the source states none;
    `has_crc` where bits 226 to 249 are as received, `crc_bad` where a receiver found them wrong,
    `l5` where the source says so; `unreadable` counts records that gave no message.
    """

    time_s: Ints
    prn: Ints
    kind: Ints
    frame: NDArray[np.uint8]
    has_crc: Bools
    l5: Bools
    crc_bad: Bools
    unreadable: int = 0
    findings: tuple[Finding, ...] = ()

    def __len__(self) -> int:
        return self.time_s.size


def source_messages(
    time_s: Ints,
    frame: NDArray[np.uint8],
    *,
    prn: Ints,
    unreadable: int,
    exists: Bools | None = None,
    kind: Ints | None = None,
    has_crc: bool = True,
    l5: Bools | None = None,
    crc_bad: Bools | None = None,
    findings: tuple[Finding, ...] = (),
) -> SourceMessages:
    """Messages whose time exists; the others are unreadable."""
    n = time_s.size
    keep = np.ones(n, bool) if exists is None else exists
    return SourceMessages(
        time_s[keep],
        prn[keep],
        (np.full(n, -1) if kind is None else kind)[keep],
        frame[keep],
        np.full(n, has_crc)[keep],
        (np.zeros(n, bool) if l5 is None else l5)[keep],
        (np.zeros(n, bool) if crc_bad is None else crc_bad)[keep],
        unreadable + int(np.count_nonzero(~keep)),
        findings,
    )


def whole(groups: Iterable[bytes]) -> Ints:
    """(n,) integers of (n,) texts of digits."""
    return np.array([int(group) for group in groups], np.int64)


def frames_of(hexadecimal: Iterable[bytes]) -> NDArray[np.uint8]:
    """(n, 32) bytes of (n,) texts of 58 or 64 digits."""
    text = b"".join(digits.ljust(2 * FRAME_BYTES, b"0") for digits in hexadecimal)
    return np.frombuffer(bytes.fromhex(text.decode("ascii")), np.uint8).reshape(-1, FRAME_BYTES)


def calendar_s(columns: Sequence[Sequence[bytes]]) -> tuple[Ints, Bools]:
    """GPS seconds of years (two digits, 1980 to 2079), months, days, hours, minutes and seconds,
    and which of them exist."""
    year, month, day, hour, minute, second = (whole(column) for column in columns)
    full = np.where(year < 80, 2000, 1900) + year
    months = ((full - 1970) * 12 + month - 1).astype("M8[M]")
    first = months.astype("M8[D]").astype(np.int64)
    length = (months + np.timedelta64(1, "M")).astype("M8[D]").astype(np.int64) - first
    exists = (month >= 1) & (month <= 12) & (day >= 1) & (day <= length)
    exists &= (hour < 24) & (minute < 60) & (second < 60)
    of_day = hour * 3600 + minute * 60 + second
    return (first + day - 1) * 86400 + of_day - GPS_EPOCH_NS // NS_PER_S, exists


def _week_s(week: Sequence[bytes], tow: Sequence[bytes]) -> tuple[Ints, Bools]:
    tow_s = whole(tow)
    return whole(week) * WEEK_S + tow_s, tow_s < WEEK_S


def _unreadable(data: bytes, found: int) -> int:
    """Lines with content that fit no record; a last line that the file's end cuts is one."""
    lines = sum(1 for line in data.splitlines() if line.strip() and not line.startswith(b"%"))
    return max(lines - found, 0)


def of_ems(data: bytes, prn: int | None, where: str) -> SourceMessages:
    """Classic EMS: `PRN YY MM DD hh mm ss MT` and 64 digits."""
    found = EMS.findall(data)
    satellites, *calendar, kind, digits = zip(*found, strict=True)
    time_s, exists = calendar_s(calendar)
    return source_messages(
        time_s,
        frames_of(digits),
        prn=whole(satellites),
        unreadable=_unreadable(data, len(found)),
        exists=exists,
        kind=whole(kind),
    )


def of_new_ems(data: bytes, prn: int | None, where: str) -> SourceMessages:
    """EMS with microseconds, band and frequency; the whole second is the stamp."""
    found = EMS_NEW.findall(data)
    satellites, *calendar, band, frequency, kind, digits = zip(*found, strict=True)
    time_s, exists = calendar_s(calendar)
    on_l1 = np.array([b == b"L" and f == b"1" for b, f in zip(band, frequency, strict=True)])
    return source_messages(
        time_s,
        frames_of(digits),
        prn=whole(satellites),
        unreadable=_unreadable(data, len(found)),
        exists=exists,
        kind=whole(kind),
        l5=~on_l1,
    )


def of_sbs(data: bytes, prn: int | None, where: str) -> SourceMessages:
    """RTKLIB: `week tow prn mt : ` and 58 digits, without the CRC."""
    found = SBS.findall(data)
    week, tow, satellites, kind, digits = zip(*found, strict=True)
    time_s, exists = _week_s(week, tow)
    return source_messages(
        time_s,
        frames_of(digits),
        prn=whole(satellites),
        unreadable=_unreadable(data, len(found)),
        exists=exists,
        kind=whole(kind),
        has_crc=False,
    )


def of_hex(data: bytes, prn: int | None, where: str) -> SourceMessages:
    """`week tow` and 64 digits of one satellite that only the caller knows."""
    found = HEX.findall(data)
    if prn is None:
        raise InputError(
            "the message file does not name its satellite",
            where=where,
            evidence="lines of week, seconds and bits",
            cure="--geo PRN",
        )
    week, tow, digits = zip(*found, strict=True)
    time_s, exists = _week_s(week, tow)
    return source_messages(
        time_s,
        frames_of(digits),
        prn=np.full(time_s.size, prn),
        unreadable=_unreadable(data, len(found)),
        exists=exists,
    )


def of_columns(data: bytes, prn: int | None, where: str) -> SourceMessages:
    """cssrlib: `week tow prn frequency bytes` and 64 digits; frequency 0 is L1, 1 is L5."""
    found = COLUMNS.findall(data)
    week, tow, satellites, frequency, digits = zip(*found, strict=True)
    time_s, exists = _week_s(week, tow)
    return source_messages(
        time_s,
        frames_of(digits),
        prn=whole(satellites),
        unreadable=_unreadable(data, len(found)),
        exists=exists,
        l5=whole(frequency) == 1,
    )
