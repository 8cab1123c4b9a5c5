"""Formats that are recognised so that they can be named, though this version does not read them."""

from __future__ import annotations

import functools
import operator
import re

from sbas.logs.format import Match

_COMPRESSED = (
    (b"\x1f\x8b", "gzip"),
    (b"BZh", "bzip2"),
    (b"\xfd7zXZ\x00", "xz"),
    (b"PK\x03\x04", "zip"),
    (b"\x1f\x9d", "Unix compress (.Z)"),
    (b"\x28\xb5\x2f\xfd", "zstd"),
    (b"7z\xbc\xaf\x27\x1c", "7-Zip"),
)
_TEXTS = (
    (re.compile(rb"^.{60}RINEX VERSION / TYPE"), 99, "RINEX"),
    (re.compile(rb"^.{60}CRINEX VERS"), 99, "compressed RINEX (Hatanaka)"),
    (re.compile(rb"^(INPUT|OUTPUT|SBASOUT|SATSEL|MODEL|INFO)\s+\S", re.MULTILINE), 92, "gLAB"),
    (re.compile(rb"^\*\d{4}-\d\d-\d\dT\d\d"), 95, "Ginan .SPP"),
    (re.compile(rb"^RX_TOM;RX_WEEK"), 90, "PEGASUS table"),
    (re.compile(rb"^1\d\d(\s+\d{1,2}){7}\s+[0-9A-Fa-f]{64}\b"), 90, "EMS"),
    (re.compile(rb"^\s*\d{4}\s+\d{1,6}\s+1\d\d\s+\d+\s*:\s*[0-9A-Fa-f]{58}"), 90, "SBAS messages"),
)  # fmt: skip
_NMEA_LINE = re.compile(rb"^[$!]([^*\r\n]{5,1024})\*([0-9A-Fa-f]{2})\r?$", re.MULTILINE)


def unread_format(head: bytes) -> tuple[str, Match, str]:
    """Name of the likeliest format that is not read, how likely, and what to do; "" for none."""
    for magic, name in _COMPRESSED:
        if head.startswith(magic):
            return name, Match(100, f"it begins with {magic!r}"), "decompress it first"
    export = "export it as CSV with a header line, or convert it to Parquet"
    found = [
        (name, Match(score, f"text of {name}"), export)
        for pattern, score, name in _TEXTS
        if pattern.search(head)
    ]
    lines = head.count(b"\n") or 1
    nmea = sum(
        functools.reduce(operator.xor, body) == int(check, 16)
        for body, check in _NMEA_LINE.findall(head)
    )
    if nmea:
        share = min(nmea / lines, 1.0)
        reason = f"{nmea:,} sentences with a good checksum in {lines:,} lines"
        found.append(("NMEA 0183", Match(round(90 * share), reason), export))
    if frames := _ubx_frames(head):
        match = Match(97 if frames >= 3 else 80, f"{frames} frames with a good checksum")
        found.append(("u-blox UBX", match, export))
    return max(found, key=lambda f: f[1].score, default=("", Match(0, ""), ""))


def _ubx_frames(data: bytes) -> int:
    """UBX frames with a good checksum, up to three. Source: u-blox M8 protocol, 32.4."""
    frames = at = 0
    while frames < 3 and (at := data.find(b"\xb5\x62", at)) >= 0:
        length = int.from_bytes(data[at + 4 : at + 6], "little")
        end = at + 6 + length
        if length <= 8192 and end + 2 <= len(data):
            a = b = 0
            for byte in data[at + 2 : end]:
                a = (a + byte) & 0xFF
                b = (b + a) & 0xFF
            if data[end : end + 2] == bytes((a, b)):
                frames += 1
                at = end
                continue
        at += 2
    return frames
