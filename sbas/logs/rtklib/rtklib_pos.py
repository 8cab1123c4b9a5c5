"""RTKLIB solution files (`.pos`), plain and with the protection levels of rtklib_ws.

Layout by header: latitude and longitude in degrees or d m s, or ECEF; dates or week and
seconds; GPST, UTC or JST; heights ellipsoidal or geodetic (above the geoid). rtklib_ws writes
`hpl (m) vpl (m)` in place of `age(s) ratio`, and in its ECEF rows behind them though its header
says otherwise: there the number of fields decides. Source: solution.c of RTKLIB and rtklib_ws.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd

from sbas.exceptions import InputError
from sbas.logs.format import Format, Match, Progress
from sbas.logs.rtklib.rtklib_columns import FloatArray, epoch_columns, protection_level_meta
from sbas.logs.rtklib.rtklib_layout import (
    COLUMN_HEADER,
    Layout,
    fit_rows,
    header_text,
    parse_header,
)
from sbas.logs.text_input import (
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
from sbas.recording import Recording, RecordingMeta, with_columns


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
) -> Recording:
    """Recording of an RTKLIB solution file.

    Parameters
    ----------
    path : the file.
    columns : documented columns to keep; all by default.
    progress : called with bytes done and in all.
    geoid : undulation [m] where the heights are geodetic (above the geoid).

    Raises
    ------
    InputError : no column header, baselines instead of positions, two layouts in one file, no
        row of data.
    """
    where = str(path)
    blocks = TextBlocks(path, progress)
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
    parts = list(side_by_side(reader.block, chain((head,), stream)))
    return _joined(parts, reader, blocks, columns, geoid)


def _rows(head: bytes) -> Iterable[str]:
    return (
        line.decode("utf-8", "replace").strip()
        for line in head.splitlines()
        if not line.startswith(b"%") and line.strip()
    )


def _joined(
    parts: Sequence[_Part],
    reader: _LineReader,
    blocks: TextBlocks,
    columns: Sequence[str] | None,
    geoid: float | None,
) -> Recording:
    layout = reader.layout
    stamps = concatenate([part.stamps for part in parts])
    # RTKLIB ends every line: a last line without its end was cut, and its last number with it.
    cut = bool(blocks.unfinished.strip())
    bad = sum(part.bad_lines for part in parts) + cut + blocks.nul_lines
    example = next((part.example for part in parts if part.example), "")
    if cut and not example:
        example = (
            f"last line without line end: {blocks.unfinished[-60:].decode('utf-8', 'replace')}"
        )
    if not len(stamps.ns):
        raise InputError(
            "no line of the .pos file can be read",
            where=reader.where,
            evidence=example,
            cure="the lines do not fit the header line: write the solution again",
        )
    values = {name: np.concatenate([p.values[name] for p in parts]) for name in reader.wanted}
    times, leap_seconds, conversions = stamps_to_gps(stamps, layout.scale)
    table, findings = epoch_columns(values, len(times), layout, geoid)
    pl = protection_level_meta(table)
    frame = pd.DataFrame(table, index=pd.DatetimeIndex(times, name="time"))
    meta = RecordingMeta(
        time_scale=layout.scale,
        leap_seconds=leap_seconds,
        frame=layout.datum,
        geoid="" if geoid is None or layout.height != "geodetic" else f"{geoid:g} m as given",
        pl=pl,
        findings=(
            *blocks.findings(),
            *bad_line_finding(bad, len(times), example),
            *conversions,
            *findings,
        ),
    )
    return Recording(frame if columns is None else with_columns(frame, columns), meta)


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """95 for the `%` line that names RTKLIB's columns."""
    found = COLUMN_HEADER.search(decode_head(head).replace("\r", ""))
    if found is None:
        return Match(0, "no header of RTKLIB")
    return Match(95, f"RTKLIB header with {found[3].split()[0]}")


FORMAT = Format(
    name="rtklib_pos",
    extensions=(".pos",),
    description="RTKLIB solution, with or without the protection levels of rtklib_ws",
    sniff=sniff,
    read=read,
)
