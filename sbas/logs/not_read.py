"""Formats that are recognised so that they can be named, though this version does not read them."""

from __future__ import annotations

import re

from sbas.logs.decompression import packing_not_read
from sbas.logs.format import Match

_RINEX_CURE = "give the recording of a receiver; observations hold no protection level"
_MESSAGE_CURE = "give the recording of a receiver; SBAS messages alone hold no position"
_TEXTS = (
    (re.compile(rb"^.{60}RINEX VERSION / TYPE"), 99, "RINEX", _RINEX_CURE),
    (re.compile(rb"^.{60}CRINEX VERS"), 99, "compressed RINEX (Hatanaka)", _RINEX_CURE),
    (re.compile(rb"^1\d\d(\s+\d{1,2}){7}\s+[0-9A-Fa-f]{64}\b"), 90, "EMS", _MESSAGE_CURE),
    (re.compile(rb"^\s*\d{4}\s+\d{1,6}\s+1\d\d\s+\d+\s*:\s*[0-9A-Fa-f]{58}"), 90, "SBAS messages",
     _MESSAGE_CURE),
)  # fmt: skip


def unread_format(head: bytes) -> tuple[str, Match, str]:
    """Name of the likeliest format that is not read, how likely, and what to do; "" for none."""
    packing, command = packing_not_read(head)
    if packing:
        return packing, Match(100, f"it begins as {packing} does"), f"unpack it first: {command}"
    found = [
        (name, Match(score, f"text of {name}"), cure)
        for pattern, score, name, cure in _TEXTS
        if pattern.search(head)
    ]
    return max(found, key=lambda f: f[1].score, default=("", Match(0, ""), ""))
