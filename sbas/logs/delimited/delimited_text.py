"""Delimited text (CSV): an alias map, units in headers, times as stamps or week and seconds.

Delimiters are `,` `;` tab and blanks; comment lines begin with `#` or `%`. What was taken for
what is in the recording's options under `columns`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.delimited.column_map import MappedTable, convert_columns, word_findings
from sbas.logs.delimited.column_names import (
    TIME_CURE,
    TIME_PARTS,
    applied_geoid,
    header_sources,
    map_headers,
    map_text,
    no_level_finding,
)
from sbas.logs.delimited.delimited_layout import Layout, data_rows, find_layout, split_line
from sbas.logs.delimited.delimited_lines import LineReader, Part
from sbas.logs.format import Format, Match, Progress
from sbas.logs.text_input import (
    BAD_SHARE,
    TextBlocks,
    bad_line_finding,
    decode_head,
    parse_numbers,
    side_by_side,
)
from sbas.logs.time_stamps import (
    concatenate,
    scale_of_stamps,
    stamps_to_gps,
)
from sbas.recording import Recording, RecordingMeta, with_columns
from sbas.timescales import TimeScale


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
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
    )
    meta = RecordingMeta(
        time_scale=mapped.time_scale,
        leap_seconds=mapped.leap_seconds,
        geoid=mapped.geoid,
        findings=(*mapped.findings, *no_level_finding(mapped.sources)),
        options=mapped.options,
    )
    table = mapped.table if columns is None else with_columns(mapped.table, columns)
    return Recording(table, meta)


def read_mapped(
    path: Path,
    *,
    columns: Collection[str] | None = None,
    extra: Collection[str] = (),
    progress: Progress | None = None,
    time_scale: TimeScale | None = None,
    mode_map: Mapping[str, str] | None = None,
    geoid: float | None = None,
) -> MappedTable:
    """As `read`, before it becomes a Recording; `extra` names columns of `TRUTH_COLUMNS`."""
    blocks = TextBlocks(path, progress)
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
    layout = find_layout(sample, where=str(path))
    reader = LineReader.of(layout, columns, extra, str(path))
    reader.check_decimals(sample)

    last_line = b""

    def data_blocks() -> Iterable[bytes]:
        nonlocal last_line
        for block in chain((_behind_line(first, layout.header_line),), stream):
            last_line = _last_line(block) or last_line
            yield block

    parts = list(side_by_side(reader.block, data_blocks()))
    cut_lines = 0
    if blocks.unfinished.strip():
        if _is_whole(blocks.unfinished, last_line, layout):
            parts.append(reader.block(blocks.unfinished + b"\n"))
        else:
            cut_lines = 1
    return _joined(
        parts, reader, blocks, cut_lines, time_scale=time_scale, mode_map=mode_map, geoid=geoid
    )


def _joined(
    parts: Sequence[Part],
    reader: LineReader,
    blocks: TextBlocks,
    cut_lines: int,
    *,
    time_scale: TimeScale | None,
    mode_map: Mapping[str, str] | None,
    geoid: float | None,
) -> MappedTable:
    stamps = concatenate([part.stamps for part in parts])
    rows = len(stamps.ns)
    bad = sum(part.bad_lines for part in parts) + cut_lines + blocks.nul_lines
    example = next((part.example for part in parts if part.example), "")
    if cut_lines and not example:
        example = (
            f"last line without line end: {blocks.unfinished[:120].decode('utf-8', 'replace')}"
        )
    if not rows:
        raise InputError(
            "no line has a readable time" if bad else "the file has a header and no data",
            code="" if bad else "E15",
            where=reader.where,
            evidence=example,
            cure=TIME_CURE if bad else "check that the recording was written",
        )
    by_week = "time" not in reader.mapped
    header = "week and tow" if by_week else reader.mapped["time"].header
    said = "GPST" if by_week else reader.mapped["time"].scale
    scale, scale_findings = scale_of_stamps(
        stamps, time_scale, said=said, header=header, by_week=by_week, where=reader.where
    )
    keep: Any = slice(None)
    if scale == "GPST" and stamps.leap.any():
        # GPS time has no second 60: such a stamp is no time.
        keep = ~stamps.leap
        bad += int(np.count_nonzero(stamps.leap))
        stamps, rows = stamps[keep], int(np.count_nonzero(keep))
        example = example or "second 60 in GPS time"
    times, leap_seconds, conversions = stamps_to_gps(stamps, scale)

    values: dict[str, NDArray[np.float64]] = {}
    texts: dict[str, Any] = {}
    for name in reader.wanted:
        if name in parts[0].numbers:
            values[name] = np.concatenate([part.numbers[name] for part in parts])[keep]
            continue
        column = pa.chunked_array([part.texts[name] for part in parts]).combine_chunks()
        if isinstance(column, pa.ChunkedArray):
            column = pa.concat_arrays(column.chunks)
        if not isinstance(keep, slice):
            column = column.filter(pa.array(keep))
        if name.startswith("x_"):
            numbers, wrong, _ = parse_numbers(column, reader.layout.decimal)
            if not wrong.any():
                values[name] = numbers
                continue
        texts[name] = column
    columns, column_findings = convert_columns(
        values,
        texts,
        rows=rows,
        factors={name: column.factor for name, column in reader.mapped.items()},
        mode_map=mode_map,
        geoid=geoid,
        where=reader.where,
    )
    findings = (
        *blocks.findings(),
        *_decimal_finding(reader.layout),
        *_units_finding(reader.layout),
        *_repeated_finding(sum(part.repeated_headers for part in parts)),
        *bad_line_finding(bad, rows, example),
        *_unreadable_findings(parts, rows),
        *scale_findings,
        *conversions,
        *word_findings(_summed(part.words for part in parts)),
        *column_findings,
    )
    options = {"columns": map_text(reader.mapped, reader.others)}
    if not said and time_scale is None and scale == "GPST":
        options["time_scale"] = "GPST, since neither header nor times name another"
    if mode_map is not None:
        options["mode_map"] = ", ".join(f"{word}={name}" for word, name in mode_map.items())
    table = pd.DataFrame(columns, index=pd.DatetimeIndex(times, name="time"))
    geoid_text = applied_geoid(geoid, reader.wanted)
    sources = header_sources(reader.mapped, reader.others)
    return MappedTable(table, findings, scale, leap_seconds, options, geoid_text, sources)


def _summed(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    total: dict[str, int] = {}
    for count in counts:
        for name, number in count.items():
            total[name] = total.get(name, 0) + number
    return total


def _unreadable_findings(parts: Sequence[Part], rows: int) -> tuple[Finding, ...]:
    counts = _summed(part.unreadable for part in parts)
    counts = {name: number for name, number in counts.items() if number}
    if not counts:
        return ()
    return (
        Finding(
            "E10",
            "error" if max(counts.values()) > BAD_SHARE * rows else "warning",
            "fields that are no numbers were made missing",
            evidence=", ".join(f"{name} {number:,}" for name, number in counts.items()),
            cure="correct the fields; name the column 'x_...' if it holds no such quantity",
        ),
    )


def _decimal_finding(layout: Layout) -> tuple[Finding, ...]:
    if layout.decimal == ".":
        return ()
    return (
        Finding(
            "E20",
            "warning",
            "commas in numbers were read as decimal commas",
            evidence=f"fields are separated by {layout.delimiter!r}",
            cure="write numbers with a decimal point",
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
)
