"""Which format the content of a file has; the extension is a hint."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.decompression import PlainFile
from sbas.logs.format import Format, Match
from sbas.logs.not_read import unread_format

HEAD_BYTES = MIDDLE_BYTES = 1 << 16
TAIL_BYTES = 1 << 12
LOWEST_SCORE = 20
CLOSE_SCORES = 10
EXTENSION_BONUS = 5


class Detection(NamedTuple):
    """The format of a file, why, and what is odd about it (an extension of another format)."""

    format: Format
    match: Match
    findings: tuple[Finding, ...] = ()


def told_format(plain: PlainFile, formats: Sequence[Format]) -> Detection:
    """The one of some formats that a file has by its content.

    Raises
    ------
    InputError : no score of 20; two within 10 points of another.
    """
    file = plain.path
    head, middle, tail = samples(file)
    extension = plain.extension
    where = str(plain.given)
    scored = []
    for candidate in formats:
        match = candidate.sniff(head, middle, tail, file)
        bonus = EXTENSION_BONUS if match.score and extension in candidate.extensions else 0
        scored.append((match.score + bonus, candidate, match))
    scored.sort(key=lambda entry: -entry[0])
    best_score, best, match = scored[0]
    unread, unread_match, unread_cure = unread_format(head)
    if unread_match.score >= max(best_score, LOWEST_SCORE):
        raise InputError(
            f"this is {unread}, which this version does not read",
            code="E16",
            where=where,
            evidence=unread_match.reason,
            cure=unread_cure,
        )
    if best_score < LOWEST_SCORE:
        raise InputError(
            "the format of the file is not recognised",
            code="E16",
            where=where,
            evidence=_first_sight(head)
            + "; likeliest: "
            + ", ".join(f"{c.name} {s} ({m.reason})" for s, c, m in scored),
            cure=f"name it: --format with one of {', '.join(f.name for f in formats)}",
        )
    if len(scored) > 1 and best_score - scored[1][0] < CLOSE_SCORES:
        second_score, second, second_match = scored[1]
        raise InputError(
            f"the file could be {best.name} or {second.name}",
            code="E16",
            where=where,
            evidence=f"{best.name} {best_score} ({match.reason}), "
            f"{second.name} {second_score} ({second_match.reason})",
            cure=f"name it: --format {best.name} or --format {second.name}",
        )
    owners = [f.name for f in formats if extension in f.extensions]
    if owners and best.name not in owners:
        finding = Finding(
            "E17",
            "warning",
            f"the extension says {' or '.join(owners)}, the content is {best.name}",
            where=where,
            evidence=f"{extension}; {match.reason}",
            cure=f"rename it to {Path(plain.name).stem}{best.extensions[0]}",
        )
        return Detection(best, match, (finding,))
    return Detection(best, match)


def samples(file: Path) -> tuple[bytes, bytes, bytes]:
    """First 64 KiB, 64 KiB from the middle and last 4 KiB."""
    size = file.stat().st_size
    with open(file, "rb") as stream:
        head = stream.read(HEAD_BYTES)
        stream.seek(max((size - MIDDLE_BYTES) // 2, 0))
        middle = stream.read(MIDDLE_BYTES)
        stream.seek(max(size - TAIL_BYTES, 0))
        return head, middle, stream.read(TAIL_BYTES)


def _first_sight(head: bytes) -> str:
    printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in head)
    return f"first bytes {head[:16].hex(' ')}, {printable / len(head):.0%} printable"
