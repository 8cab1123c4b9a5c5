"""How the lines of delimited text are built: delimiter, header line, decimal sign."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from sbas.exceptions import InputError
from sbas.logs.column_map import map_headers

SAMPLE_LINES = 50


@dataclass(frozen=True)
class Layout:
    """How the lines of a file are built.

    Parameters
    ----------
    delimiter, decimal : one character each.
    headers : one name a field.
    header_line : index of the header line; data begin behind it.
    """

    delimiter: str
    headers: tuple[str, ...]
    header_line: int
    decimal: str = "."


def split_line(line: str, delimiter: str) -> list[str]:
    """Fields of a line, quoted ones without their quotes."""
    if delimiter == " ":
        return line.split()
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=False), [])
    except csv.Error:
        return line.split(delimiter)


def data_rows(text: str, layout: Layout) -> list[list[str]]:
    """Fields of the first data lines of a file."""
    lines = whole_lines(text)[layout.header_line + 1 :]
    rows = [line for line in lines if line.strip() and not line.lstrip().startswith(("#", "%"))]
    return [split_line(line, layout.delimiter) for line in rows[:SAMPLE_LINES]]


def whole_lines(text: str) -> list[str]:
    lines = re.split(r"\r\n|\n|\r", text)
    return lines[:-1] if len(lines) > 1 else lines


def find_layout(text: str, *, where: str) -> Layout:
    """Delimiter, header and decimal sign of delimited text.

    The header is the first line that is no comment, or the comment line before the data; that
    pair of header and delimiter is taken which names most known columns.

    Parameters
    ----------
    text : the first lines of the file.
    where : file, for messages.

    Raises
    ------
    InputError : no header with two fields or more, or lines with other counts than the header.
    """
    lines = whole_lines(text)
    plain = [i for i, s in enumerate(lines) if s.strip() and not s.lstrip().startswith(("#", "%"))]
    comments = [i for i, s in enumerate(lines) if s.lstrip().startswith(("#", "%"))]
    candidates = plain[:1]
    candidates += [i for i in comments if plain and i < plain[0]][-1:]
    best: tuple[tuple[int, float, int], Layout] | None = None
    for at in candidates:
        for rank, delimiter in enumerate((" ", ",", "\t", ";")):
            names = tuple(split_line(lines[at].lstrip("#% \ufeff").strip("\r\n"), delimiter))
            if len(names) < 2:
                continue
            layout = Layout(delimiter, names, at)
            rows = data_rows(text, layout)
            if rows and all(len(r) == len(names) + 1 and not r[-1].strip() for r in rows):
                layout = Layout(delimiter, (*names, ""), at)
            fitting = sum(len(r) == len(layout.headers) for r in rows) / max(len(rows), 1)
            score = (_known_count(names), fitting, rank)
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
        comma = longer and layout.delimiter == ","
        raise InputError(
            "lines have more fields than the header: decimal commas between commas?"
            if comma
            else "lines have another number of fields than the header",
            code="E20" if comma else "E10",
            where=where,
            evidence=f"{len(layout.headers)} names, {len(rows[0])} fields: "
            f"{layout.delimiter.join(rows[0])[:120]}",
            cure="write decimal points, or separate the fields by ';'"
            if comma
            else "give every field a name in the header",
        )
    if layout.delimiter in ";\t":
        cells = [cell for row in rows for cell in row]
        if any(re.fullmatch(r"\s*[+-]?\d+,\d+\s*", cell) for cell in cells):
            layout = replace(layout, decimal=",")
    return layout


def _known_count(names: Sequence[str]) -> int:
    count = 0
    for name in names:
        try:
            count += bool(map_headers([name], where="")[0])
        except InputError:
            count += 1
    return count
