"""What a report is made of, as data: nothing here knows HTML."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

Tone = Literal["", "good", "bad", "warning", "demonstrated", "modelled", "claimed"]


@dataclass(frozen=True)
class Cell:
    """Text in a table: with a tone it is a badge.

    `trace` names the method that it links to, `anchor` the target that it is itself; `breaks`
    allows a line break anywhere, as a digest needs.
    """

    text: str
    tone: Tone = ""
    trace: str = ""
    anchor: str = ""
    breaks: bool = False


@dataclass(frozen=True)
class Column:
    """Head of a table's column, with the unit; numbers are set flush right."""

    title: str
    numeric: bool = False


@dataclass(frozen=True)
class Table:
    """Rows of cells under a title, and the sentences without which they mislead."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Picture:
    """A drawn picture: `alt` says what it shows, `caption` what to read from it."""

    key: str
    title: str
    alt: str
    caption: str
    svg: str
    wide: bool = False


@dataclass(frozen=True)
class Callout:
    """A statement that nobody may miss."""

    tone: Tone
    title: str
    paragraphs: tuple[str, ...]


@dataclass(frozen=True)
class Tile:
    """One figure large, with its unit, and what it is."""

    label: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class Section:
    """A part of the report; `key` is its anchor."""

    key: str
    title: str
    callouts: tuple[Callout, ...] = ()
    tiles: tuple[Tile, ...] = ()
    paragraphs: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; of a picture its words."""
        plain = asdict(self)
        for picture in plain["pictures"]:
            del picture["svg"]
        return plain


def cell(value: Cell | str) -> Cell:
    """A cell as it is, or of a text."""
    return value if isinstance(value, Cell) else Cell(value)


def table(
    title: str,
    columns: str,
    rows: list[tuple[Cell | str, ...]],
    *notes: str,
) -> Table:
    """A table from column titles parted by "|", where a title that starts with "#" is numeric."""
    heads = [title.strip() for title in columns.split("|")]
    return Table(
        title,
        tuple(Column(head.removeprefix("#"), head.startswith("#")) for head in heads),
        tuple(tuple(cell(value) for value in row) for row in rows),
        notes,
    )
