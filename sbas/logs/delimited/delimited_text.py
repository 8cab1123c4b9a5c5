"""Delimited text (CSV): an alias map, units in headers, times as stamps or week and seconds.

Delimiters are `,` `;` tab and blanks; comment lines begin with `#` or `%`. What was taken for
what is in the recording's options under `columns`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import pandas as pd

from sbas.exceptions import InputError
from sbas.logs.delimited.column_map import MappedTable
from sbas.logs.delimited.column_names import (
    TIME_CURE,
    TIME_PARTS,
    applied_geoid,
    header_sources,
    map_headers,
    map_text,
    no_level_finding,
)
from sbas.logs.delimited.delimited_epochs import Conversion, Settled, Tally
from sbas.logs.delimited.delimited_layout import Layout, data_rows, find_layout, split_line
from sbas.logs.delimited.delimited_lines import LineReader, Part, joined
from sbas.logs.epoch_spool import SpooledEpochs, in_pieces, spool
from sbas.logs.format import Format, Match, Progress
from sbas.logs.text_input import WHOLE_BYTES, TextBlocks, decode_head, side_by_side
from sbas.recording import EpochSource, Recording, RecordingMeta, with_columns
from sbas.timescales import TimeScale


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
    encoding: str | None = None,
    decimal: str | None = None,
    max_line: int | None = None,
) -> Recording:
    """Recording of a delimited text file.

    Parameters
    ----------
    path : the file.
    columns : documented columns to read; all by default.
    progress : called with bytes done and in all.
    time_scale : scale of the stamps; by default UTC for a column `utc` or stamps with a zone,
        else GPST.
    mode_map : words of the mode column to names of `sbas.recording.MODES`.
    geoid : undulation [m] where heights are above the geoid (column `altitude`).
    encoding : encoding of the text; by default told from its first bytes.
    decimal : decimal sign of the numbers, `.` or `,`; by default told from the first lines.
    max_line : longest line [bytes]; by default 65,536.

    Raises
    ------
    InputError : no readable time, ambiguous columns or decimals, unknown units or mode words.
    """
    mapped = read_mapped(
        path,
        columns=columns,
        progress=progress,
        time_scale=time_scale,
        mode_map=mode_map,
        geoid=geoid,
        encoding=encoding,
        decimal=decimal,
        max_line=max_line,
    )
    table = mapped.table if columns is None else with_columns(mapped.table, columns)
    return Recording(table, _meta(mapped))


def read_mapped(
    path: Path,
    *,
    columns: Collection[str] | None = None,
    extra: Collection[str] = (),
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
    encoding: str | None = None,
    decimal: str | None = None,
    max_line: int | None = None,
) -> MappedTable:
    """As `read`, before it becomes a Recording; `extra` names columns of `TRUTH_COLUMNS`."""
    lines = _Lines.of(
        path, columns, extra, progress, encoding=encoding, decimal=decimal, max_line=max_line
    )
    conversion = Conversion(lines.reader, time_scale, mode_map, geoid)
    parts = list(lines.parts())
    table, tally = conversion.epochs(joined(parts))
    return _mapped(table, tally, conversion, lines)


def scan(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
    encoding: str | None = None,
    decimal: str | None = None,
    max_line: int | None = None,
) -> EpochSource:
    """Epochs of a delimited text in bounded memory; arguments and errors as for `read`.

    A file of up to WHOLE_BYTES is read whole. The epochs of a longer one are set aside in a
    temporary file, so that an analysis can go over them more than once.
    """
    options: dict[str, Any] = {"encoding": encoding, "decimal": decimal, "max_line": max_line}
    if path.stat().st_size > WHOLE_BYTES:
        lines = _Lines.of(path, columns, (), progress, **options)
        return _spooled(lines, Conversion(lines.reader, time_scale, mode_map, geoid), columns)
    return read(
        path,
        columns=columns,
        progress=progress,
        time_scale=time_scale,
        mode_map=mode_map,
        geoid=geoid,
        **options,
    )


def _spooled(lines: _Lines, conversion: Conversion, columns: Sequence[str] | None) -> SpooledEpochs:
    """Epochs of a long file, converted piece by piece and set aside."""
    settled: Settled | None = None
    while True:
        tallies: list[Tally] = []
        tables = _tables(lines, conversion, settled, tallies)
        held = spool(t if columns is None else with_columns(t, columns) for t in tables)
        used = settled or conversion.settled(tallies[0])
        tally = sum(tallies, Tally())
        settled = conversion.settled(tally)
        if settled == used:
            return SpooledEpochs(_meta(_mapped(pd.DataFrame(), tally, conversion, lines)), held)
        # The first piece was not like the whole: once more, with what the whole settles.
        lines = lines.again()


def _tables(
    lines: _Lines, conversion: Conversion, settled: Settled | None, tallies: list[Tally]
) -> Iterator[pd.DataFrame]:
    """Epoch tables piece by piece, their tallies appended; the first settles, if need be."""
    for parts in in_pieces(lines.parts(), lambda part: len(part.stamps.ns)):
        table, tally = conversion.epochs(joined(parts), settled)
        settled = settled or conversion.settled(tally)
        tallies.append(tally)
        yield table


@dataclass
class _Lines:
    """One pass over the lines of a file.

    Parameters
    ----------
    first, stream : the first block of lines and those behind it.
    again : begins another pass.
    cut_lines, cut_line : whether the last line was left out, and what there was of it.
    """

    blocks: TextBlocks
    reader: LineReader
    first: bytes
    stream: Iterator[bytes]
    again: Callable[[], _Lines]
    cut_lines: int = 0
    cut_line: str = ""

    @classmethod
    def of(
        cls,
        path: Path,
        columns: Collection[str] | None,
        extra: Collection[str],
        progress: Progress | None,
        *,
        encoding: str | None,
        decimal: str | None,
        max_line: int | None,
    ) -> _Lines:
        def begin(progress: Progress | None) -> _Lines:
            blocks = TextBlocks(path, progress, encoding=encoding, max_line=max_line)
            stream = iter(blocks)
            first = next(stream, b"")
            if not first.strip():
                raise InputError(
                    "the file has no whole line" if blocks.unfinished else "the file is blank",
                    code="E15",
                    where=str(path),
                    cure="check that the file was written and copied to its end",
                )
            sample = first[: 1 << 18].decode("utf-8", "replace")
            layout = find_layout(sample, where=str(path), decimal=decimal)
            reader = LineReader.of(layout, columns, extra, str(path))
            reader.check_decimals(sample)
            return cls(blocks, reader, first, stream, lambda: begin(None))

        return begin(progress)

    def parts(self) -> Iterator[Part]:
        """The lines behind the header as columns, block by block, and a whole last line."""
        last_line = b""

        def data_blocks() -> Iterable[bytes]:
            nonlocal last_line
            head = _behind_line(self.first, self.reader.layout.header_line)
            for block in chain((head,), self.stream):
                last_line = _last_line(block) or last_line
                yield block

        yield from side_by_side(self.reader.block, data_blocks())
        unfinished = self.blocks.unfinished
        if not unfinished.strip():
            return
        if _is_whole(unfinished, last_line, self.reader.layout):
            yield self.reader.block(unfinished + b"\n")
            return
        shown = unfinished[:120].decode("utf-8", "replace")
        self.cut_lines, self.cut_line = 1, f"last line without line end: {shown}"


def _mapped(
    table: pd.DataFrame, tally: Tally, conversion: Conversion, lines: _Lines
) -> MappedTable:
    """The table with what its whole file says; InputError where that has no epoch."""
    reader = conversion.reader
    lost = lines.cut_lines + lines.blocks.nul_lines
    if not tally.times.rows:
        bad = tally.bad_lines + lost
        raise InputError(
            "no line has a readable time" if bad else "the file has a header and no data",
            code="" if bad else "E15",
            where=reader.where,
            evidence=tally.example or lines.cut_line or "lines with NUL bytes" * bool(bad),
            cure=TIME_CURE if bad else "check that the recording was written",
        )
    scale, _ = conversion.scale(tally.times)
    leap_seconds, _ = tally.times.conversions(scale)
    options = {"columns": map_text(reader.mapped, reader.others)}
    if not conversion.said and conversion.time_scale is None and scale == "GPST":
        options["time_scale"] = "GPST, since neither header nor times name another"
    if (mode_map := conversion.mode_map) is not None:
        options["mode_map"] = ", ".join(f"{word}={name}" for word, name in mode_map.items())
    return MappedTable(
        table,
        (
            *lines.blocks.findings(),
            *conversion.findings(tally, lost_lines=lost, lost_line=lines.cut_line),
        ),
        scale,
        leap_seconds,
        options,
        applied_geoid(conversion.geoid, reader.wanted),
        header_sources(reader.mapped, reader.others),
    )


def _meta(mapped: MappedTable) -> RecordingMeta:
    return RecordingMeta(
        time_scale=mapped.time_scale,
        leap_seconds=mapped.leap_seconds,
        geoid=mapped.geoid,
        findings=(*mapped.findings, *no_level_finding(mapped.sources)),
        options=mapped.options,
    )


def _behind_line(block: bytes, line: int) -> bytes:
    at = 0
    for _ in range(line + 1):
        at = block.find(b"\n", at) + 1
        if not at:
            return b""
    return block[at:]


def _last_line(block: bytes) -> bytes:
    return block.rstrip(b"\r\n").rpartition(b"\n")[2]


def _is_whole(line: bytes, before: bytes, layout: Layout) -> bool:
    """Whether a last line without line end is complete, as far as its form can tell.

    A cut in the last field would leave a number that looks right; so that field must be a
    decimal fraction with as many decimals as in the line before.
    """
    decimals = re.compile(rf"{re.escape(layout.decimal)}(\d+)$")
    shapes = []
    for text in (line, before):
        fields = split_line(text.decode("utf-8", "replace").strip(), layout.delimiter)
        found = decimals.search(fields[-1].strip()) if fields else None
        shapes.append((len(fields), len(found[1]) if found else 0))
    return shapes[0] == shapes[1] and shapes[0][1] > 0


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """60 for a table with time and position, 50 with time and another known column, else 25."""
    text = decode_head(head)
    odd = sum(not c.isprintable() and c not in "\r\n\t\0" for c in text[:4096])
    if text.lstrip()[:1] in ("<", "{", "["):
        return Match(0, "looks like XML or JSON")
    if not text.strip() or odd > 0.02 * min(len(text), 4096):
        return Match(0, "not text")
    try:
        layout = find_layout(text, where=str(path))
        mapped, _ = map_headers(layout.headers, where=str(path))
    except InputError as error:
        named = error.what.startswith("two columns") or "unit" in error.what
        likely = 25 if named or error.code in ("E18", "E20") else 0
        return Match(likely, f"text, but {error.what}")
    timed = "time" in mapped or ("week" in mapped and "tow" in mapped)
    if timed and "lat_deg" in mapped and "lon_deg" in mapped:
        return Match(60, "delimited text with columns for time and position")
    if timed and len(set(mapped) - set(TIME_PARTS)):
        return Match(50, "delimited text with a column for time")
    if data_rows(text, layout):
        return Match(25, "delimited text, header without known time and position")
    return Match(0, "text without fields")


FORMAT = Format(
    name="csv",
    extensions=(".csv", ".tsv"),
    description="delimited text with a header line (comma, semicolon, tab or blanks)",
    sniff=sniff,
    read=read,
    scan=scan,
)
