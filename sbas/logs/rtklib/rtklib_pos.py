"""RTKLIB solution files (`.pos`), plain and with the protection levels of rtklib_ws.

Layout by header: latitude and longitude in degrees or d m s, or ECEF; dates or week and
seconds; GPST, UTC or JST; heights ellipsoidal or geodetic (above the geoid). rtklib_ws writes
`hpl (m) vpl (m)` in place of `age(s) ratio`, and in its ECEF rows behind them though its header
says otherwise: there the number of fields decides. Source: solution.c of RTKLIB and rtklib_ws.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd

from sbas.exceptions import InputError
from sbas.logs.epoch_spool import SpooledEpochs, in_pieces, spool
from sbas.logs.format import Format, Match, Progress
from sbas.logs.rtklib.rtklib_columns import Counts, FloatArray, epoch_columns, findings
from sbas.logs.rtklib.rtklib_layout import (
    COLUMN_HEADER,
    Layout,
    fit_rows,
    header_text,
    parse_header,
)
from sbas.logs.text_input import (
    WHOLE_BYTES,
    TextBlocks,
    bad_line_finding,
    collapse_blanks,
    decode_head,
    parse_lines,
    plain_blanks,
    side_by_side,
)
from sbas.logs.time_stamps import (
    Stamps,
    concatenate,
    parse_date_and_clock,
    stamps_to_gps,
    week_stamps,
)
from sbas.logs.time_tally import TimeTally
from sbas.recording import EpochSource, Recording, RecordingMeta, with_columns


@dataclass(frozen=True)
class _Part:
    stamps: Stamps
    values: dict[str, FloatArray]
    bad_lines: int
    example: str


@dataclass(frozen=True)
class _LineReader:
    layout: Layout
    wanted: tuple[str, ...]
    where: str

    def block(self, block: bytes) -> _Part:
        """Numbers of one block of lines; a line with any unreadable field is left out."""
        block = self._without_headers(block)
        block = collapse_blanks(plain_blanks(block, self.layout.separator))
        time_names = self.layout.fields[:2]
        fields = parse_lines(
            block,
            self.layout.fields,
            texts=() if self.layout.by_week else time_names,
            wanted=(*time_names, *self.wanted),
            delimiter=" ",
        )
        if self.layout.by_week:
            stamps = week_stamps(fields.numbers["week"], fields.numbers["tow"])
        else:
            stamps = parse_date_and_clock(fields.texts["date"], fields.texts["clock"])
        good = stamps.readable
        if self.layout.scale == "GPST":
            good = good & ~stamps.leap
        for wrong in fields.unreadable.values():
            good = good & ~wrong
        values = {name: fields.numbers[name] for name in self.wanted}
        bad, example = fields.bad_lines, fields.first_bad
        if not good.all():
            bad += int(np.count_nonzero(~good))
            example = example or "a field is no number, or the time is none"
            stamps = stamps[good]
            values = {name: array[good] for name, array in values.items()}
        return _Part(stamps, values, bad, example)

    def _without_headers(self, block: bytes) -> bytes:
        if b"%" not in block:
            return block
        lines = block.splitlines(keepends=True)
        for line in lines:
            found = line.startswith(b"%") and COLUMN_HEADER.match(line.decode("utf-8"))
            if found and header_text(found) != self.layout.header:
                raise InputError(
                    "the file holds solutions of two layouts",
                    where=self.where,
                    evidence=f"{self.layout.header!r} and {header_text(found)!r}",
                    cure="split it at the second header and read the parts one by one",
                )
        return b"".join(line for line in lines if not line.startswith(b"%"))


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    geoid: float | None = None,
    encoding: str | None = None,
    max_line: int | None = None,
) -> Recording:
    """Recording of an RTKLIB solution file.

    Parameters
    ----------
    path : the file.
    columns : documented columns to keep; all by default.
    progress : called with bytes done and in all.
    geoid : undulation [m] where the heights are geodetic (above the geoid).
    encoding : encoding of the text; by default told from its first bytes.
    max_line : longest line [bytes]; by default 65,536.

    Raises
    ------
    InputError : no column header, baselines instead of positions, two layouts in one file, no
        row of data.
    """
    lines = _opened(path, progress, encoding, max_line)
    table, tally = _epochs(list(lines.parts), lines.reader.layout, columns, geoid)
    return Recording(table, _meta(tally, lines, geoid))


def scan(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    geoid: float | None = None,
    encoding: str | None = None,
    max_line: int | None = None,
) -> EpochSource:
    """Epochs of an RTKLIB solution file in bounded memory; arguments and errors as for `read`.

    A file of up to WHOLE_BYTES is read whole. The epochs of a longer one are set aside in a
    temporary file, so that an analysis can go over them more than once.
    """
    if path.stat().st_size <= WHOLE_BYTES:
        return read(
            path,
            columns=columns,
            progress=progress,
            geoid=geoid,
            encoding=encoding,
            max_line=max_line,
        )
    lines = _opened(path, progress, encoding, max_line)
    tallies: list[_Tally] = []

    def tables() -> Iterator[pd.DataFrame]:
        for parts in in_pieces(lines.parts, lambda part: len(part.stamps.ns)):
            table, tally = _epochs(parts, lines.reader.layout, columns, geoid)
            tallies.append(tally)
            yield table

    held = spool(tables())
    return SpooledEpochs(_meta(sum(tallies, _Tally()), lines, geoid), held)


@dataclass(frozen=True)
class _Lines:
    """A file with its header read, and the parts of its rows to come."""

    blocks: TextBlocks
    reader: _LineReader
    parts: Iterator[_Part]


def _opened(
    path: Path, progress: Progress | None, encoding: str | None, max_line: int | None
) -> _Lines:
    where = str(path)
    blocks = TextBlocks(path, progress, encoding=encoding, max_line=max_line)
    stream = iter(blocks)
    head = b""
    first_row = None
    for block in stream:
        head += block
        first_row = next((s for s in _rows(head) if s), None)
        if first_row is not None:
            break
    layout = parse_header(head.decode("utf-8", "replace"), where=where)
    if first_row is None:
        raise InputError(
            "the file has a header and no data",
            code="E15",
            where=where,
            evidence=f"{path.stat().st_size:,} bytes",
            cure="the solution found no fix: check its observations and options",
        )
    separator = None if layout.separator == " " else layout.separator
    text = first_row.replace(separator, " ") if separator else first_row
    layout = fit_rows(layout, text.split())
    reader = _LineReader(layout, layout.names, where)
    return _Lines(blocks, reader, side_by_side(reader.block, chain((head,), stream)))


def _rows(head: bytes) -> Iterable[str]:
    return (
        line.decode("utf-8", "replace").strip()
        for line in head.splitlines()
        if not line.startswith(b"%") and line.strip()
    )


@dataclass(frozen=True)
class _Tally:
    """What was counted in a piece, or in several added in file order."""

    times: TimeTally = field(default_factory=TimeTally)
    counts: Counts = field(default_factory=Counts)
    bad_lines: int = 0
    example: str = ""

    def __add__(self, other: _Tally) -> _Tally:
        return _Tally(
            self.times + other.times,
            self.counts + other.counts,
            self.bad_lines + other.bad_lines,
            self.example or other.example,
        )


def _epochs(
    parts: Sequence[_Part], layout: Layout, columns: Sequence[str] | None, geoid: float | None
) -> tuple[pd.DataFrame, _Tally]:
    """Epoch table and tally of consecutive parts."""
    stamps = concatenate([part.stamps for part in parts])
    names = parts[0].values
    values = {name: np.concatenate([part.values[name] for part in parts]) for name in names}
    times, _, _ = stamps_to_gps(stamps, layout.scale)
    table, counts = epoch_columns(values, len(times), layout, geoid)
    tally = _Tally(
        TimeTally.of(stamps),
        counts,
        sum(part.bad_lines for part in parts),
        next((part.example for part in parts if part.example), ""),
    )
    frame = pd.DataFrame(table, index=pd.DatetimeIndex(times, name="time"))
    return frame if columns is None else with_columns(frame, columns), tally


def _meta(tally: _Tally, lines: _Lines, geoid: float | None) -> RecordingMeta:
    """Metadata of a file that was read to its end; InputError where it has no epoch."""
    blocks, layout = lines.blocks, lines.reader.layout
    # RTKLIB ends every line: a last line without its end was cut, and its last number with it.
    cut = bool(blocks.unfinished.strip())
    bad = tally.bad_lines + cut + blocks.nul_lines
    example = tally.example
    if cut and not example:
        shown = blocks.unfinished[-60:].decode("utf-8", "replace")
        example = f"last line without line end: {shown}"
    if not tally.times.rows:
        raise InputError(
            "no line of the .pos file can be read",
            code="E10",
            where=lines.reader.where,
            evidence=example,
            cure="the lines do not fit the header line: write the solution again",
        )
    leap_seconds, conversions = tally.times.conversions(layout.scale)
    return RecordingMeta(
        time_scale=layout.scale,
        leap_seconds=leap_seconds,
        frame=layout.datum,
        geoid="" if geoid is None or layout.height != "geodetic" else f"{geoid:g} m as given",
        pl=tally.counts.levels.meta(),
        findings=(
            *blocks.findings(),
            *bad_line_finding(bad, tally.times.rows, example),
            *conversions,
            *findings(tally.counts, layout, geoid),
        ),
    )


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """95 for the `%` line that names RTKLIB's columns."""
    found = COLUMN_HEADER.search(_unix_lines(decode_head(head)))
    if found is None:
        return Match(0, "no header of RTKLIB")
    return Match(95, f"RTKLIB header with {found[3].split()[0]}")


def _unix_lines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


FORMAT = Format(
    name="rtklib_pos",
    extensions=(".pos",),
    description="RTKLIB solution, with or without the protection levels of rtklib_ws",
    sniff=sniff,
    read=read,
    scan=scan,
)
