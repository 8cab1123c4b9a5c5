"""The lines of a delimited text, block by block, as columns with readable times."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.logs.delimited.column_names import (
    HEMISPHERES,
    TIME_PARTS,
    MappedColumn,
    map_headers,
    needed_columns,
)
from sbas.logs.delimited.delimited_layout import (
    DELIMITERS,
    Layout,
    bare_fields,
    data_rows,
    header_fields,
    names_columns,
    with_line_of_units,
)
from sbas.logs.text_input import (
    collapse_blanks,
    parse_lines,
    plain_blanks,
)
from sbas.logs.time_stamps import (
    Stamps,
    concatenate,
    parse_date_and_clock,
    parse_stamps,
    week_stamps,
)

_TEXT_COLUMNS = ("time", "date", "mode", "environment", "hardware_fault", *HEMISPHERES)
_COMMENT_LINE = re.compile(rb"^[ \t]*[#%][^\n]*\n?", re.MULTILINE)
_TIME_WORDS = (b"time", b"gpst", b"utc", b"week")
_LONGEST_HEADER_LINE = 1 << 14
_DECIMAL_CURE = (
    "say which it is, --decimal , or --decimal . (numbers with the other sign are then missing); "
    "where fields are separated by commas, write the numbers with a point"
)


@dataclass(frozen=True)
class Part:
    """One block's lines with a readable time."""

    stamps: Stamps
    numbers: dict[str, NDArray[np.float64]]
    texts: dict[str, Any]
    bad_lines: int
    example: str
    unreadable: Counter[str] = field(default_factory=Counter)
    words: Counter[str] = field(default_factory=Counter)
    repeated_headers: int = 0


def joined(parts: Sequence[Part]) -> Part:
    """Consecutive parts as one."""
    first = parts[0]
    if len(parts) == 1:
        return first
    return Part(
        concatenate([part.stamps for part in parts]),
        {name: np.concatenate([part.numbers[name] for part in parts]) for name in first.numbers},
        {name: _one_array([part.texts[name] for part in parts]) for name in first.texts},
        sum(part.bad_lines for part in parts),
        next((part.example for part in parts if part.example), ""),
        sum((part.unreadable for part in parts), Counter()),
        sum((part.words for part in parts), Counter()),
        sum(part.repeated_headers for part in parts),
    )


def _names_time(text: bytes) -> bool:
    lowered = text.lower()
    return any(word in lowered for word in _TIME_WORDS)


def _one_array(arrays: Sequence[Any]) -> Any:
    column = pa.chunked_array(arrays).combine_chunks()
    if isinstance(column, pa.ChunkedArray):
        column = pa.concat_arrays(column.chunks)
    return column


@dataclass(frozen=True)
class LineReader:
    """What every block of a file is read with."""

    layout: Layout
    mapped: Mapping[str, MappedColumn]
    others: Mapping[str, MappedColumn]
    wanted: tuple[str, ...]
    where: str

    @classmethod
    def of(
        cls, layout: Layout, columns: Collection[str] | None, extra: Collection[str], where: str
    ) -> LineReader:
        mapped, others = map_headers(layout.headers, where=where, extra=extra)
        has_week = "week" in mapped and "tow" in mapped
        if "time" in mapped and has_week:
            raise InputError(
                "two columns say the time",
                where=where,
                evidence=f"{mapped['time'].header!r} beside week and seconds of week",
                cure="take one of them out, or rename it to 'x_time'",
            )
        if "time" not in mapped and not has_week:
            lonely = [mapped[name].header for name in TIME_PARTS if name in mapped]
            raise InputError(
                "no column gives the time",
                where=where,
                evidence=f"columns {', '.join(h.strip() for h in layout.headers)[:300]}"
                + (f"; {', '.join(lonely)} alone is not enough" if lonely else ""),
                cure="name the time column 'time' (GPS time) or 'utc', or give 'week' and 'tow'",
            )
        names = needed_columns(columns, mapped, others)
        return cls(layout, mapped, others, names, where)

    def check_decimals(self, sample: str) -> None:
        """E20 where decimal commas meet decimal points, or a delimiter that is a comma."""
        if self.layout.stated:
            return
        rows = data_rows(sample, self.layout)
        numeric = [
            self._column(name).index
            for name in self.wanted
            if name not in _TEXT_COLUMNS and not name.startswith("x_")
        ]
        cells = [row[i] for row in rows for i in numeric if i < len(row)]
        commas = [c for c in cells if re.fullmatch(r"\s*[+-]?\d+,\d+\s*", c)]
        points = [c for c in cells if re.fullmatch(r"\s*[+-]?\d*\.\d+\s*", c)]
        if commas and (points or self.layout.delimiter in " ,"):
            raise InputError(
                "decimal comma and decimal point in one file"
                if points
                else "decimal commas, with blanks or commas between the fields",
                code="E20",
                where=self.where,
                evidence=", ".join([*commas[:2], *points[:2]]),
                cure=_DECIMAL_CURE,
            )

    def _column(self, name: str) -> MappedColumn:
        return self.mapped[name] if name in self.mapped else self.others[name]

    def block(self, block: bytes) -> Part:
        """Columns of one block of lines; lines without a readable time are left out.

        Raises
        ------
        InputError : E06 where the block has a header that is not that of the file (two files
            were joined); E20 where a number has the other decimal sign.
        """
        commented = b"#" in block or b"%" in block
        bare = _COMMENT_LINE.sub(b"", block) if commented else block
        part = self._parsed(bare)
        if not (part.bad_lines or commented) or not _names_time(block):
            return part
        # A header has no readable time: lines are looked at one by one only where one has none.
        texts = block.splitlines(keepends=True)
        if not part.bad_lines and not any(
            self._repeats_header(comment[0]) for comment in _COMMENT_LINE.finditer(block)
        ):
            return part
        kept, headers = self._without_headers(texts)
        if not headers:
            return part
        return replace(
            self._parsed(_COMMENT_LINE.sub(b"", b"".join(kept))), repeated_headers=headers
        )

    def _without_headers(self, lines: Sequence[bytes]) -> tuple[list[bytes], int]:
        """The lines without repetitions of the header and of its line of units, and their count."""
        kept = []
        headers = 0
        above = b""
        for line in lines:
            if self._repeats_header(line):
                headers += 1
                above = line
                continue
            if above:
                pair = [text.decode("utf-8") for text in (above, line)]
                names = header_fields(pair[0], self.layout.delimiter)
                names += ("",) * (len(self.layout.headers) - len(names))
                first = Layout(self.layout.delimiter, names, 0, written=(bare_fields(names),))
                again = with_line_of_units(pair, first, self.where)
                if again.written != self.layout.written:
                    self._refuse_layout(above + line)
                above = b""
                if len(again.written) > 1:
                    continue
            kept.append(line)
        return kept, headers

    def _repeats_header(self, line: bytes) -> bool:
        """Whether a line is the header once more; InputError where it is another header."""
        if len(line) > _LONGEST_HEADER_LINE or not _names_time(line):
            return False
        text = line.decode("utf-8")
        for delimiter in (d for d in DELIMITERS if d in text):
            fields = bare_fields(header_fields(text, delimiter))
            if names_columns(fields):
                if delimiter != self.layout.delimiter or fields != self.layout.written[0]:
                    self._refuse_layout(line)
                return True
        return False

    def _refuse_layout(self, line: bytes) -> NoReturn:
        shown = line.decode("utf-8").strip()
        raise InputError(
            "the file holds tables of two layouts: a later header is not the first one",
            code="E06",
            where=self.where,
            evidence=f"{self._shown()[:150]!r} and {shown[:150]!r}",
            cure="split it at the second header and give the parts as separate files",
        )

    def _shown(self) -> str:
        return "\n".join(self.layout.delimiter.join(fields) for fields in self.layout.written)

    def _parsed(self, block: bytes) -> Part:
        if self.layout.delimiter == " ":
            block = collapse_blanks(plain_blanks(block))
        times = tuple(name for name in TIME_PARTS if name in self.mapped)
        index = {name: str(self._column(name).index) for name in (*times, *self.wanted)}
        texts = [index[name] for name in index if name in _TEXT_COLUMNS or name.startswith("x_")]
        fields = parse_lines(
            block,
            [str(i) for i in range(len(self.layout.headers))],
            texts=texts,
            wanted=list(index.values()),
            delimiter=self.layout.delimiter,
            decimal=self.layout.decimal,
        )
        if fields.other_decimal and not self.layout.stated:
            raise InputError(
                "decimal comma and decimal point in one file"
                if self.layout.delimiter in ";\t"
                else "decimal commas, with blanks or commas between the fields",
                code="E20",
                where=self.where,
                evidence=f"{fields.other_decimal!r}, though the decimal sign of the file is "
                f"{self.layout.decimal!r}",
                cure=_DECIMAL_CURE,
            )
        back = {i: name for name, i in index.items()}
        numbers = {back[i]: v for i, v in fields.numbers.items()}
        text = {back[i]: v for i, v in fields.texts.items()}
        unreadable = {back[i]: v for i, v in fields.unreadable.items()}
        stamps = self._stamps(numbers, text)
        bad, example = fields.bad_lines, fields.first_bad
        good = stamps.readable
        if not good.all():
            if not example:
                at = int(np.argmin(good))
                shown = [text[n][at].as_py() if n in text else numbers[n][at] for n in times]
                example = f"time {' '.join(map(str, shown))}"
            bad += int(np.count_nonzero(~good))
            stamps = stamps[good]
            mask = pa.array(good)
            numbers = {name: v[good] for name, v in numbers.items()}
            text = {name: v.filter(mask) for name, v in text.items()}
            unreadable = {name: v[good] for name, v in unreadable.items()}
        return Part(
            stamps,
            {name: v for name, v in numbers.items() if name not in TIME_PARTS},
            {name: v for name, v in text.items() if name not in TIME_PARTS},
            bad,
            example,
            Counter(
                {n: int(np.count_nonzero(v)) for n, v in unreadable.items() if n not in TIME_PARTS}
            ),
            Counter({back[i]: n for i, n in fields.words.items() if back[i] not in TIME_PARTS}),
        )

    def _stamps(
        self, numbers: Mapping[str, NDArray[np.float64]], text: Mapping[str, Any]
    ) -> Stamps:
        if "time" not in self.mapped:
            return week_stamps(numbers["week"], numbers["tow"] * self.mapped["tow"].factor)
        if "date" not in self.mapped:
            return parse_stamps(text["time"])
        whole = parse_stamps(text["time"])
        return whole if whole.readable.any() else parse_date_and_clock(text["date"], text["time"])
