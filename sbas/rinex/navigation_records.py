"""Records of RINEX navigation text, versions 2, 3 and 4: satellite, time and numbers.

Numbers stand in columns of 19 characters, in some files of 20: the distance of the decimal
points tells. Source: RINEX 2.11, tables A4 and A16; RINEX 3.05, tables A6, A8 and A12;
RINEX 4.01, section 8.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sbas.timescales import GPS_EPOCH_NS, NS_PER_S

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[DdEe][+-]?\d{1,3})?")
LINES = {"G": 7, "E": 7, "S": 3}
"""Lines of a record after its first, of the systems that are read."""
_LAST_NUMBERS = {"G": 2, "E": 1, "S": 4}
"""Numbers that the last line of a record must have: behind them come spares."""
_MESSAGES = {"G": ("LNAV",), "E": ("INAV", "FNAV"), "S": ("SBAS",)}
"""RINEX 4 messages that are read."""
_HEAD_2 = re.compile(r"[ \d]\d [ \d]\d [ \d]\d [ \d]\d [ \d]\d [ \d]\d[ \d]{3}\.\d")
_FIRST_2, _OTHER_2 = 22, 3
_FIRST_3, _OTHER_3 = 23, 4


@dataclass(frozen=True)
class Record:
    """One record: satellite, time of clock [GPS s] and its numbers, NaN where blank."""

    system: str
    prn: int
    toc_s: float
    numbers: tuple[float, ...]
    line: str


@dataclass
class Seen:
    """What was found in the files besides records."""

    alpha: tuple[float, ...] = ()
    beta: tuple[float, ...] = ()
    leap_seconds: int | None = None
    unreadable: int = 0
    first_unreadable: str = ""

    def note(self, line: str) -> None:
        """Count a record that is left out."""
        self.unreadable += 1
        self.first_unreadable = self.first_unreadable or line[:60].rstrip()


def parse_number(text: str) -> float:
    """A number with D or E for ten to the power of; NaN where there is none."""
    stripped = text.strip()
    if not _NUMBER.fullmatch(stripped):
        return float("nan")
    value = float(stripped.replace("D", "E").replace("d", "e"))
    return value if math.isfinite(value) else float("nan")


def parse_records(
    body: Sequence[str], version: float, kind: str, seen: Seen, *, ends_whole: bool
) -> Iterator[Record]:
    """Records of GPS, Galileo and SBAS satellites; one that cannot be read is counted.

    Parameters
    ----------
    body : lines behind the header.
    kind : of version 2: N for GPS, H for SBAS.
    ends_whole : the last line has its line end; otherwise its last number may be cut.
    """
    lines = [line for line in body if line.strip("\0 \x1a")]
    open_line = None if ends_whole or not lines else lines[-1]
    if version < 3:
        yield from _records_2(lines, "S" if kind == "H" else "G", seen, open_line)
    else:
        yield from _records_3(lines, seen, open_line)


def _width(lines: Sequence[str]) -> int:
    """Characters of a field: the usual distance of the decimal points of one line."""
    steps: Counter[int] = Counter()
    for line in lines[:200]:
        points = [i for i, character in enumerate(line) if character == "."]
        steps.update(b - a for a, b in pairwise(points) if b - a in (19, 20))
    return 20 if steps[20] > steps[19] else 19


def _record(
    system: str,
    prn: int,
    calendar: Sequence[str],
    lines: Sequence[str],
    starts: tuple[int, int],
    width: int,
    open_line: str | None,
) -> Record | None:
    """A record of its lines, the first number of each at `starts`; None where one is unreadable."""
    values: list[float] = []
    for i, line in enumerate(lines):
        start = starts[min(i, 1)]
        for k in range(4 if i else 3):
            cell = line[start + width * k : start + width * (k + 1)]
            value = parse_number(cell)
            if value != value and cell.strip():
                return None
            values.append(value)
    if lines[-1] is open_line and len(open_line) < starts[1] + width * _LAST_NUMBERS[system]:
        return None
    toc_s = _gps_seconds(calendar)
    return None if toc_s is None else Record(system, prn, toc_s, tuple(values), lines[0])


def _gps_seconds(calendar: Sequence[str]) -> float | None:
    try:
        year, month, day, hour, minute = (int(part) for part in calendar[:5])
        second = float(calendar[5])
        if len(calendar[0].strip()) <= 2:
            year += 1900 if year >= 80 else 2000
        midnight = np.datetime64(f"{year:04d}-{month:02d}-{day:02d}", "s").astype(np.int64)
    except ValueError:
        return None
    if not (1980 <= year < 2262 and 0 <= hour < 24 and 0 <= minute < 60 and 0 <= second < 61):
        return None
    return float(int(midnight) - GPS_EPOCH_NS // NS_PER_S + hour * 3600 + minute * 60 + second)


def _records_2(
    lines: Sequence[str], system: str, seen: Seen, open_line: str | None
) -> Iterator[Record]:
    width = _width(lines)
    at = 0
    while at < len(lines):
        head = lines[at]
        end = at + 1
        while end < len(lines) and not _HEAD_2.match(lines[end]):
            end += 1
        stop = end
        if end - at > LINES[system] + 1 and lines[end - 1] is open_line:
            seen.note(open_line)  # the first line of one more record, cut
            stop -= 1
        record = None
        # With a line too many it is not known which one does not belong to the record.
        if _HEAD_2.match(head) and stop - at == LINES[system] + 1:
            calendar = (head[2:5], head[5:8], head[8:11], head[11:14], head[14:17], head[17:22])
            number = int(head[:2]) + (100 if system == "S" else 0)
            record = _record(
                system, number, calendar, lines[at:stop], (_FIRST_2, _OTHER_2), width, open_line
            )
        if record is None:
            seen.note(head)
        else:
            yield record
        at = end


def _records_3(lines: Sequence[str], seen: Seen, open_line: str | None) -> Iterator[Record]:
    width = _width(lines)
    wanted: tuple[str, ...] | None = None
    at = 0
    while at < len(lines):
        head = lines[at]
        end = at + 1
        while end < len(lines) and lines[end][0] == " ":
            end += 1
        if head[0] == ">":
            words = [*head[1:].split(), "", "", ""]
            # Records without a mark, as in version 3, are read all the same.
            wanted = (words[2],) if words[0] == "EPH" else ()
            if words[0] == "ION" and words[1][:1] == "G" and words[2] == "LNAV":
                _read_klobuchar(lines[at + 1 : end], width, seen)
            at = end
            continue
        system = head[0]
        if system in LINES and (wanted is None or set(wanted) & set(_MESSAGES[system])):
            record = None
            number = head[1:3].replace(" ", "0")
            if number.isascii() and number.isdecimal() and end - at == LINES[system] + 1:
                calendar = (head[4:8], head[9:11], head[12:14], head[15:17], head[18:20],
                            head[21:23])  # fmt: skip
                prn = int(number) + (100 if system == "S" else 0)
                record = _record(
                    system, prn, calendar, lines[at:end], (_FIRST_3, _OTHER_3), width, open_line
                )
            if record is None:
                seen.note(head)
            else:
                yield record
        elif not ("A" <= system <= "Z"):
            seen.note(head)
        at = end


def _read_klobuchar(lines: Sequence[str], width: int, seen: Seen) -> None:
    """Coefficients of a RINEX 4 record: three behind the time, then four, then one."""
    if len(lines) < 3:
        return seen.note(lines[0] if lines else "> ION")
    cells = [(lines[0], _FIRST_3, k) for k in range(3)]
    cells += [(lines[1], _OTHER_3, k) for k in range(4)] + [(lines[2], _OTHER_3, 0)]
    values = [parse_number(line[at + width * k : at + width * (k + 1)]) for line, at, k in cells]
    if not np.isfinite(values).all():
        return seen.note(lines[0])
    seen.alpha, seen.beta = tuple(values[:4]), tuple(values[4:])
    return None
