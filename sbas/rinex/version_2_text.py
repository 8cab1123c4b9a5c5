"""The body of RINEX 2 observations, written as that of version 3: one line a satellite.

Version 2 has no mark for epochs and folds the values of a satellite at five a line, so that it
must be walked line by line. Source: RINEX 2.11, table A2.
"""

from __future__ import annotations

import re

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.rinex.observation_header import parse_types
from sbas.rinex.observations import ObservationHeader
from sbas.rinex.version_2_codes import codes_of_version_2

_EPOCH = re.compile(
    rb" ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d)([ \d]{3}\.\d{7})  (\d)([ \d]{2}\d)"
)
_EVENT = re.compile(rb" {28}([2-5])([ \d]{2}\d)")
_A_LINE = 5
_NAMES = 12
_FIRST_CENTURY_YEAR = 80
_UNTIMED = b">".ljust(31)


def body_as_version_3(
    body: bytes, header: ObservationHeader, *, ends_whole: bool, where: str
) -> tuple[bytes, tuple[Finding, ...]]:
    """Epoch records and satellite lines of version 3, of the lines behind a header of version 2.

    An epoch with a line too few or too many gets another number of satellite lines than it
    announces, by which it is known as partial later.

    Parameters
    ----------
    ends_whole : the last line has its line end; otherwise it is left out.

    Raises
    ------
    InputError : an event changes the observation types.
    """
    lines = body.replace(b"\r", b"").split(b"\n")
    # Behind the last line end there is nothing, or a line that is cut.
    last = lines.pop()
    cut = bool(last.strip()) and not ends_whole
    per_satellite = -(-len(next(iter(header.codes.values()))) // _A_LINE)
    usual = next(iter(header.codes)) if len(header.codes) == 1 else "G"
    out: list[bytes] = []
    at = 0
    while at < len(lines):
        line = lines[at]
        epoch = _EPOCH.match(line)
        event = None if epoch else _EVENT.match(line)
        if epoch and epoch[7] in b"016":
            at = _epoch(lines, at, epoch, per_satellite, usual.encode(), out)
            continue
        if epoch or event:
            flag, count = (epoch[7], epoch[8]) if epoch else (event[1], event[2])  # type: ignore[index]
            end = at + 1 + int(count)
            _check_event(lines[at + 1 : end], header, f"{where}, line {at + 1} after the header")
            out.append(_UNTIMED + flag + count.rjust(3))
            at = end
            continue
        if line.strip():
            out.append(b"?")  # a line too many for the epoch before it
        at += 1
    findings: tuple[Finding, ...] = (
        Finding("E26", "info", "observation types of RINEX 2 are named as in RINEX 3", where=where),
    )
    if cut:
        findings += (
            Finding("E10", "warning", "the last line is cut and left out", where=where,
                    cure="get the file again"),
        )  # fmt: skip
    return b"\n".join(out) + b"\n", findings


def _epoch(
    lines: list[bytes],
    at: int,
    epoch: re.Match[bytes],
    per_satellite: int,
    usual: bytes,
    out: list[bytes],
) -> int:
    """Writes an epoch, as far as it goes, and returns the line behind it."""
    year = int(epoch[1])
    century = b"19" if year >= _FIRST_CENTURY_YEAR else b"20"
    date = b" ".join(part.replace(b" ", b"0") for part in epoch.groups()[:5])
    count = int(epoch[8])
    out.append(b"> " + century + date + epoch[6] + b"  " + epoch[7] + epoch[8])
    names = b""
    for k in range(max(-(-count // _NAMES), 1)):
        if at == len(lines) or (k and lines[at][:32].strip()):
            return at
        names += lines[at][32:68].ljust(36)
        at += 1
    for i in range(count):
        name = names[3 * i : 3 * i + 3]
        block = lines[at : at + per_satellite]
        if len(block) < per_satellite or any(map(_EPOCH.match, block)):
            while at < len(lines) and not _EPOCH.match(lines[at]):
                at += 1
            return at
        text = b"".join([part.ljust(80)[:80] for part in block])
        out.append((usual if name[:1] == b" " else name[:1]) + name[1:] + text.rstrip())
        at += per_satellite
    return at


def _check_event(lines: list[bytes], header: ObservationHeader, where: str) -> None:
    text = [line.decode("latin-1") for line in lines]
    types = parse_types(text, where=where)
    codes = codes_of_version_2(types, "M")
    if any(codes[letter] != names for letter, names in header.codes.items() if codes):
        raise InputError(
            "the observation types change inside the file",
            code="E06",
            where=where,
            evidence=" ".join(types),
            cure="split the file at that event and give both parts",
        )
