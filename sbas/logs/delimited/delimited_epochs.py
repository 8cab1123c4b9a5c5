"""Parts of a delimited text as epochs, and the findings of all parts together.

A part is converted by itself, so that a long file goes piece by piece. What only the whole file
settles (time scale, longitudes of 0 to 360 degrees, which further columns hold numbers) is in
`Settled`: a reader takes it from the first piece and begins anew where the tally of all pieces
says otherwise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.logs.delimited.column_map import (
    ColumnCounts,
    column_findings,
    convert_piece,
    word_findings,
)
from sbas.logs.delimited.delimited_layout import Layout
from sbas.logs.delimited.delimited_lines import LineReader, Part
from sbas.logs.text_input import BAD_SHARE, bad_line_finding, parse_numbers
from sbas.logs.time_stamps import (
    counts_leap_seconds,
    leap_stamp_finding,
    leap_stamps_of_utc,
    scale_of_stamps,
    stamps_to_gps,
)
from sbas.logs.time_tally import TimeTally
from sbas.timescales import TimeScale


@dataclass(frozen=True)
class Settled:
    """What the whole file settles, not a piece of it: the time scale, whether longitudes are
    wrapped, and the columns `x_...` in which a field is no number, which stay text."""

    scale: str
    wrapped: bool
    textual: frozenset[str]


@dataclass(frozen=True)
class Tally:
    """What was counted in a piece, or in several added in file order.

    Parameters
    ----------
    times : of all readable stamps.
    columns : of the columns.
    bad_lines, example : lines left out, and the first of them.
    leaps : stamps of a leap second of UTC, on a scale that has none.
    strange_leaps : stamps of a second 60 where not even UTC had one, on such a scale.
    textual : columns `x_...` in which a field is no number.
    """

    times: TimeTally = field(default_factory=TimeTally)
    columns: ColumnCounts = field(default_factory=ColumnCounts)
    bad_lines: int = 0
    example: str = ""
    unreadable: Counter[str] = field(default_factory=Counter)
    words: Counter[str] = field(default_factory=Counter)
    repeated_headers: int = 0
    leaps: int = 0
    strange_leaps: int = 0
    textual: frozenset[str] = frozenset()

    def __add__(self, other: Tally) -> Tally:
        return Tally(
            self.times + other.times,
            self.columns + other.columns,
            self.bad_lines + other.bad_lines,
            self.example or other.example,
            self.unreadable + other.unreadable,
            self.words + other.words,
            self.repeated_headers + other.repeated_headers,
            self.leaps + other.leaps,
            self.strange_leaps + other.strange_leaps,
            self.textual | other.textual,
        )


@dataclass(frozen=True)
class Conversion:
    """How parts of one file become epochs: its columns, and the options of the caller."""

    reader: LineReader
    time_scale: TimeScale | None = None
    mode_map: Mapping[str, str] | None = None
    geoid: float | None = None

    @property
    def said(self) -> str:
        """Time scale that the header names; "" for none."""
        return self.reader.mapped["time"].scale if "time" in self.reader.mapped else "GPST"

    def scale(self, times: TimeTally) -> tuple[str, tuple[Finding, ...]]:
        """Time scale of the stamps, and what is odd about it; InputError where they disagree."""
        by_week = "time" not in self.reader.mapped
        return scale_of_stamps(
            times.zones(),
            self.time_scale,
            said=self.said,
            header="week and tow" if by_week else self.reader.mapped["time"].header,
            by_week=by_week,
            where=self.reader.where,
        )

    def settled(self, tally: Tally) -> Settled:
        """What the whole file settles, by the tally of all its pieces."""
        return Settled(self.scale(tally.times)[0], bool(tally.columns.wrapped), tally.textual)

    def epochs(self, part: Part, settled: Settled | None = None) -> tuple[pd.DataFrame, Tally]:
        """Epoch table and tally of a part; without `settled`, the part is the whole file."""
        times = TimeTally.of(part.stamps)
        scale = self.scale(times)[0] if settled is None else settled.scale
        stamps = part.stamps
        keep: NDArray[np.bool_] | None = None
        leaps = strange_leaps = 0
        if stamps.leap.any() and not counts_leap_seconds(scale):
            keep = ~stamps.leap
            leaps = int(np.count_nonzero(leap_stamps_of_utc(stamps)))
            strange_leaps = int(np.count_nonzero(stamps.leap)) - leaps
            stamps = stamps[keep]
        values, texts, textual = self._values(part, keep, settled)
        columns, counts = convert_piece(
            values,
            texts,
            rows=len(stamps.ns),
            factors={name: column.factor for name, column in self.reader.mapped.items()},
            mode_map=self.mode_map,
            geoid=self.geoid,
            wrapped=None if settled is None else settled.wrapped,
            where=self.reader.where,
        )
        gps, _, _ = stamps_to_gps(stamps, scale)
        tally = Tally(
            times,
            counts,
            part.bad_lines,
            part.example,
            part.unreadable,
            part.words,
            part.repeated_headers,
            leaps,
            strange_leaps,
            textual,
        )
        return pd.DataFrame(columns, index=pd.DatetimeIndex(gps, name="time")), tally

    def _values(
        self, part: Part, keep: NDArray[np.bool_] | None, settled: Settled | None
    ) -> tuple[dict[str, NDArray[np.float64]], dict[str, Any], frozenset[str]]:
        """Numbers and texts of a part, and the columns `x_...` that are no numbers."""
        values: dict[str, NDArray[np.float64]] = {}
        texts: dict[str, Any] = {}
        textual = set()
        for name in self.reader.wanted:
            if name in part.numbers:
                values[name] = part.numbers[name] if keep is None else part.numbers[name][keep]
                continue
            column = part.texts[name] if keep is None else part.texts[name].filter(pa.array(keep))
            if name.startswith("x_"):
                numbers, wrong, _ = parse_numbers(column, self.reader.layout.decimal)
                if wrong.any():
                    textual.add(name)
                if name not in (textual if settled is None else settled.textual):
                    values[name] = numbers
                    continue
            texts[name] = column
        return values, texts, frozenset(textual)

    def findings(self, tally: Tally, *, lost_lines: int, lost_line: str) -> tuple[Finding, ...]:
        """Findings of the whole file by the tally of all its pieces.

        `lost_lines` were left out before any part was made, such as a cut last line, which
        `lost_line` shows.
        """
        scale, scale_findings = self.scale(tally.times)
        bad = tally.bad_lines + lost_lines + tally.strange_leaps
        example = tally.example or lost_line
        if not example:
            lost = "lines with NUL bytes"
            example = lost if lost_lines else f"a second 60, and the times are {scale}"
        rows = tally.columns.rows
        return (
            *_decimal_finding(self.reader.layout),
            *_units_finding(self.reader.layout),
            *_repeated_finding(tally.repeated_headers),
            *bad_line_finding(bad, rows, example),
            *_unreadable_findings(tally.unreadable, rows),
            *scale_findings,
            *leap_stamp_finding(tally.leaps, scale),
            *tally.times.conversions(scale)[1],
            *word_findings(tally.words),
            *column_findings(
                tally.columns, altitude="altitude" in self.reader.wanted, geoid=self.geoid
            ),
        )


def _unreadable_findings(counts: Counter[str], rows: int) -> tuple[Finding, ...]:
    found = {name: number for name, number in sorted(counts.items()) if number}
    if not found:
        return ()
    return (
        Finding(
            "E10",
            "error" if max(found.values()) > BAD_SHARE * rows else "warning",
            "fields that are no numbers were made missing",
            evidence=", ".join(f"{name} {number:,}" for name, number in found.items()),
            cure="correct the fields; name the column 'x_...' if it holds no such quantity",
        ),
    )


def _decimal_finding(layout: Layout) -> tuple[Finding, ...]:
    if layout.decimal == "." or layout.stated:
        return ()
    return (
        Finding(
            "E20",
            "warning",
            "commas in numbers were read as decimal commas",
            evidence=f"fields are separated by {layout.delimiter!r}",
            cure="say --decimal , if they are; or write numbers with a decimal point",
        ),
    )


def _units_finding(layout: Layout) -> tuple[Finding, ...]:
    if len(layout.written) < 2:
        return ()
    shown = layout.delimiter.join(layout.written[1])
    return (
        Finding("E26", "info", "the line below the header was read as units", evidence=shown[:300]),
    )


def _repeated_finding(count: int) -> tuple[Finding, ...]:
    if not count:
        return ()
    return (
        Finding(
            "E26",
            "info",
            "the header stands again among the data and was left out",
            evidence=f"{count:,} times",
            cure="give joined files one by one: sbas tells then whether they belong together",
        ),
    )
