"""How the lines of delimited text are built: delimiter, header line, units, decimal sign."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from sbas.exceptions import InputError
from sbas.logs.delimited.column_names import (
    HEMISPHERES,
    TIME_PARTS,
    TRUTH_COLUMNS,
    known_names,
    map_headers,
    refuse_too_many,
    with_unit,
)

SAMPLE_LINES = 50
DELIMITERS = (" ", ",", "\t", ";")

_NO_UNIT = re.compile(r"[-\s.]*|nan|-nan|n/?a|#n/a|null|none", re.IGNORECASE)
_DATE_PATTERN = re.compile(r"[ymdhsfz:/.\-_ t%]*", re.IGNORECASE)
_WORDS = ("week", "mode", "environment", "hardware_fault", "flags", *HEMISPHERES)


@dataclass(frozen=True)
class Layout:
    """How the lines of a file are built.

    Parameters
    ----------
    delimiter, decimal : one character each.
    headers : one name a field, with its unit where a line of units says it.
    header_line : index of the last line before the data: the header, or its line of units.
    written : fields of the header line, and of the line of units, as they stand in the file.
    stated : whether the caller named the decimal sign; else it is told from the first lines.
    """

    delimiter: str
    headers: tuple[str, ...]
    header_line: int
    decimal: str = "."
    written: tuple[tuple[str, ...], ...] = ()
    stated: bool = False


def split_line(line: str, delimiter: str) -> list[str]:
    """Fields of a line, quoted ones without their quotes."""
    if delimiter == " ":
        return line.split()
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=False), [])
    except csv.Error:
        return line.split(delimiter)


def header_fields(line: str, delimiter: str) -> tuple[str, ...]:
    """Fields of a header, which may stand in a comment or behind a byte order mark."""
    return tuple(split_line(line.lstrip("#% \ufeff").strip("\r\n"), delimiter))


def bare_fields(fields: Sequence[str]) -> tuple[str, ...]:
    """Fields without blanks around them and without an empty last one, for comparison."""
    bare = tuple(field.strip() for field in fields)
    return bare[:-1] if bare and not bare[-1] else bare


def data_rows(text: str, layout: Layout) -> list[list[str]]:
    """Fields of the first data lines of a file."""
    lines = whole_lines(text)[layout.header_line + 1 :]
    rows = [line for line in lines if line.strip() and not line.lstrip().startswith(("#", "%"))]
    return [split_line(line, layout.delimiter) for line in rows[:SAMPLE_LINES]]


def whole_lines(text: str) -> list[str]:
    lines = re.split(r"\r\n|\n|\r", text)
    return lines[:-1] if len(lines) > 1 else lines


def find_layout(text: str, *, where: str, decimal: str | None = None) -> Layout:
    """Delimiter, header, units and decimal sign of delimited text.

    The header is the first line that is no comment, or the comment line before the data; that
    pair of header and delimiter is taken which names most known columns. The line right below
    it may give units.

    Parameters
    ----------
    text : the first lines of the file.
    where : file, for messages.
    decimal : decimal sign; by default a comma where the fields of `;` or tab have some.

    Raises
    ------
    InputError : a decimal sign that is none, no header with two fields or more, more than
        MAX_COLUMNS of them, lines with other counts than the header, or units that contradict
        the header.
    """
    if decimal not in (None, ".", ","):
        raise InputError(
            f"the decimal sign cannot be {decimal!r}",
            where="decimal",
            cure="--decimal . or --decimal ,",
        )
    lines = whole_lines(text)
    plain = [i for i, s in enumerate(lines) if s.strip() and not s.lstrip().startswith(("#", "%"))]
    comments = [i for i, s in enumerate(lines) if s.lstrip().startswith(("#", "%"))]
    candidates = plain[:1]
    candidates += [i for i in comments if plain and i < plain[0]][-1:]
    best: tuple[tuple[int, float, int], Layout] | None = None
    for at in candidates:
        for rank, delimiter in enumerate(DELIMITERS):
            names = header_fields(lines[at], delimiter)
            if len(names) < 2:
                continue
            refuse_too_many(len(names), where=where)
            layout = Layout(delimiter, names, at, written=(bare_fields(names),))
            rows = data_rows(text, layout)
            if rows and all(len(r) == len(names) + 1 and not r[-1].strip() for r in rows):
                layout = replace(layout, headers=(*names, ""))
            fitting = sum(len(r) == len(layout.headers) for r in rows) / max(len(rows), 1)
            score = (len(known_names(names)), fitting, rank)
            if best is None or score > best[0]:
                best = score, layout
    if best is None:
        raise InputError(
            "this is no table: no line has two fields",
            where=where,
            evidence=(lines[candidates[0]] if candidates else text)[:80],
            cure="separate the fields by commas, semicolons, tabs or blanks, with a header line",
        )
    (_, fitting, _), layout = best
    rows = data_rows(text, layout)
    if rows and fitting <= 0.5:
        longer = sum(len(row) > len(layout.headers) for row in rows) > len(rows) / 2
        # A header that names nothing is a line of data: the real one was lost.
        named = bool(known_names(layout.headers))
        comma = named and longer and layout.delimiter == ","
        count = len(layout.headers)
        other = next(row for row in rows if len(row) != count)
        number = next(
            n
            for n, line in enumerate(lines[layout.header_line + 1 :], layout.header_line + 2)
            if split_line(line, layout.delimiter) == other
        )
        raise InputError(
            "lines have more fields than the header: decimal commas between commas?"
            if comma
            else "lines have another number of fields than the header",
            code="E20" if comma else "E10",
            where=where,
            evidence=f"{sum(len(row) != count for row in rows)} of the first {len(rows)} lines; "
            f"fields of the header {count}, of line {number} {len(other)}: "
            f"{layout.delimiter.join(other)[:120]}",
            cure="write decimal points, or separate the fields by ';' and say --decimal ,"
            if comma
            else "take such lines out, or give every field a name in the header",
        )
    layout = with_line_of_units(lines, layout, where)
    if decimal is not None:
        return replace(layout, decimal=decimal, stated=True)
    if layout.delimiter in ";\t":
        cells = [cell for row in data_rows(text, layout) for cell in row]
        if any(re.fullmatch(r"\s*[+-]?\d+,\d+\s*", cell) for cell in cells):
            layout = replace(layout, decimal=",")
    return layout


def names_columns(fields: Sequence[str]) -> bool:
    """Whether the fields of a line are a header: a time and another known column."""
    names = set(known_names([field.strip() for field in fields]))
    timed = "time" in names or {"week", "tow"} <= names
    return timed and bool(names - set(TIME_PARTS))


def with_line_of_units(lines: Sequence[str], layout: Layout, where: str) -> Layout:
    """The layout with the units of the line right below its header, where that is such a line.

    A line of words in the place of numbers is one: units that do not belong to their columns
    are then refused as those in headers are.
    """
    at = next((i for i in range(layout.header_line + 1, len(lines)) if lines[i].strip()), None)
    if at is None:
        return layout
    fields = header_fields(lines[at], layout.delimiter)
    cells = [field.strip().strip("[]()").strip() for field in fields]
    if len(cells) != len(layout.headers) or names_columns(fields):
        return layout
    if any(re.search(r"\d", re.sub(r"(?<=m)\^?2$|^1$", "", cell)) for cell in cells):
        return layout
    headers = list(layout.headers)
    numbers = 0
    for index, (header, cell) in enumerate(zip(layout.headers, cells, strict=True)):
        name = next(iter(known_names([header], extra=TRUTH_COLUMNS)), None)
        timed = name in ("time", "date")
        if name is None or name in _WORDS or (_DATE_PATTERN if timed else _NO_UNIT).fullmatch(cell):
            continue
        numbers += not timed
        stated, said = with_unit(header, cell)
        if not said:
            headers[index] = stated
        elif said.lower() != cell.lower() and _factor(stated) != _factor(header):
            raise InputError(
                f"column {header!r} and the line of units below it name two units",
                where=f"{where}, line {at + 1}",
                evidence=f"{said!r} and {cell!r}",
                cure="correct one of them",
            )
    if not numbers:
        return layout
    comment = lines[at].lstrip().startswith(("#", "%"))
    try:
        map_headers(headers, where=f"{where}, line {at + 1}", extra=TRUTH_COLUMNS)
    except InputError:
        if comment:  # a remark that happens to have as many words as there are columns
            return layout
        raise
    return replace(
        layout,
        headers=tuple(headers),
        header_line=at,
        written=(*layout.written, bare_fields(fields)),
    )


def _factor(header: str) -> float | None:
    mapped, _ = map_headers([header], where="line of units", extra=TRUTH_COLUMNS)
    return next((column.factor for column in mapped.values()), None)
