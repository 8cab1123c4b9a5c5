"""SBAS messages from RINEX-B, the broadcast data of RINEX 2.10 and 2.11.

A record is a line `PRN YY MM DD hh mm ss.s  L1  nnn rrr SSS` and two lines of 18 and 14 bytes in
hexadecimal, the message type in front. It stamps the first bit: the message ends a second later.
Source: annex of RINEX 2.11 (Suard, Gurtner, Estey), as gLAB 6.0.0 reads and writes it.
"""

from __future__ import annotations

import re

import numpy as np

from sbas.augmentation.message_lines import (
    SourceMessages,
    calendar_s,
    frames_of,
    source_messages,
    whole,
)
from sbas.exceptions import InputError

RINEX_B = re.compile(rb"^.{60}RINEX VERSION / TYPE", re.MULTILINE)
MESSAGE_S = 1
_RECORD = re.compile(
    rb"^([ \d]{2}\d)" + 5 * rb" ([ \d]\d)" + rb" ([ \d]\d)(?:\.\d*)? +([A-Z]\d) +(\d+)(?: .*)?$"
)
_DIGITS = re.compile(rb"[0-9A-Fa-f]{64}")


def of_rinex_b(data: bytes, prn: int | None, where: str) -> SourceMessages:
    """Messages of a RINEX-B file, those of other bands marked."""
    head, found_end, body = data.replace(b"\r\n", b"\n").partition(b"END OF HEADER")
    if data[20:21] != b"B" or not found_end:
        raise InputError(
            "this RINEX file holds no broadcast messages",
            where=where,
            evidence=head[:60].decode("latin-1").strip(),
            cure="observations go to --obs, navigation to --nav",
        )
    lines = body.split(b"\n")[1:]
    rows: list[tuple[bytes, ...]] = []
    used = 0
    for at, line in enumerate(lines):
        record = _RECORD.match(line)
        if record is None:
            continue
        parts = lines[at + 1 : at + 3]
        kind = parts[0][:6].strip() if parts else b""
        digits = b"".join(part[6:60] for part in parts).replace(b" ", b"")
        if kind.isdigit() and _DIGITS.fullmatch(digits):
            rows.append((*record.groups()[:8], kind, digits))
            used += 3
    unreadable = max(sum(1 for line in lines if line.strip()) - used, 0)
    if not rows:
        nothing = np.empty(0, np.int64)
        return source_messages(nothing, frames_of(()), prn=nothing, unreadable=unreadable)
    satellites, *calendar, band, kinds, hexadecimal = zip(*rows, strict=True)
    time_s, exists = calendar_s(calendar)
    return source_messages(
        time_s + MESSAGE_S,
        frames_of(hexadecimal),
        prn=whole(satellites),
        unreadable=unreadable,
        exists=exists,
        kind=whole(kinds),
        l5=np.array([b != b"L1" for b in band]),
    )
