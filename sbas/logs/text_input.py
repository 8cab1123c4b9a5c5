"""Text files as blocks of whole lines, and lines as columns of numbers.

What a text reader meets before it can think about columns: encodings, NUL bytes, lines that are
cut or far too long, fields that are no numbers. All of it is counted (findings E10, E18, E19).
"""

from __future__ import annotations

import codecs
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.format import Progress
from sbas.logs.text_encodings import REPLACEMENT, check_encoding, decoded, text_encoding

BLOCK_BYTES = 4 << 20
MAX_LINE_BYTES = 1 << 16
WHOLE_BYTES = 128 << 20
"""A longer text is not held whole in memory where an analysis goes batch by batch."""
BAD_SHARE = 0.01
"""Share of unreadable lines above which a file counts as damaged rather than scratched."""

_MISSING_WORDS = ("nan", "-nan", "na", "n/a", "#n/a", "null", "none", "-")
_NUMBER = r"^[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?$"
_OTHER_NUMBER = r"^[+-]?[0-9]*([.,][0-9]{3})*[.,][0-9]+([eE][+-]?[0-9]+)?$"

A = TypeVar("A")
B = TypeVar("B")


def decode_head(head: bytes) -> str:
    """Text of the first bytes of a file, for sniffing; never raises."""
    encoding, skip = text_encoding(head)
    if encoding == "utf-8":
        try:
            # A character cut by the end of the sample says nothing about the encoding.
            return codecs.getincrementaldecoder("utf-8")().decode(head[skip:])
        except UnicodeDecodeError:
            return head.decode("latin-1")
    return head[skip:].decode(encoding, errors="replace")


class TextBlocks:
    """Blocks of whole lines in UTF-8 with `\\n` or `\\r\\n`, and what was odd about the bytes.

    The text behind the last line end is not part of any block but left in `unfinished`: only the
    reader of a format can tell whether it is a whole record.

    Parameters
    ----------
    path : the file.
    progress : called with bytes done and in all.
    encoding : encoding of the file; by default told from its first bytes.
    max_line : longest line [bytes]; by default MAX_LINE_BYTES.

    Raises
    ------
    InputError : an encoding that is not known, or a length of lines below 1; while reading, E18
        for a longer line.
    """

    def __init__(
        self,
        path: Path,
        progress: Progress | None = None,
        *,
        encoding: str | None = None,
        max_line: int | None = None,
    ) -> None:
        if encoding is not None:
            check_encoding(encoding)
        if max_line is not None and max_line < 1:
            raise InputError(
                f"max_line cannot be {max_line}", where="max_line", cure="give bytes above 0"
            )
        self.path = path
        self.unfinished = b""
        self.nul_lines = 0
        self._progress = progress
        self._encoding = encoding
        self._max_line = MAX_LINE_BYTES if max_line is None else max_line
        self._notes: list[str] = []
        self._nul_bytes = 0
        self._latin_bytes = 0
        self._replaced = 0
        self._first_odd: int | None = None

    def __iter__(self) -> Iterator[bytes]:
        total = os.path.getsize(self.path)
        done = 0
        carry = b""
        with open(self.path, "rb") as file:
            head = file.read(MAX_LINE_BYTES)
            encoding, skip = self._encoding, 0
            if encoding is None:
                encoding, skip = text_encoding(head)
                if skip or encoding != "utf-8":
                    self._notes.append(f"{encoding.upper()}{' with byte order mark' * bool(skip)}")
            file.seek(skip)
            decoder = None
            if self._encoding is not None or encoding != "utf-8":
                decoder = codecs.getincrementaldecoder(encoding)(errors="replace")
                head = decoded(decoder, head)
                decoder.reset()
            old_mac = b"\n" not in head and b"\r" in head
            if old_mac:
                self._notes.append("lines end in CR alone")
            while raw := file.read(BLOCK_BYTES):
                offset, done = done, done + len(raw)
                if decoder is not None:
                    raw = decoded(decoder, raw)
                    if not offset:
                        raw = raw.removeprefix(codecs.BOM_UTF8)
                    if lost := raw.count(REPLACEMENT):
                        self._replaced += lost
                        self._seen(offset + skip)
                if old_mac:
                    raw = raw.replace(b"\r", b"\n")
                text = carry + raw
                self._refuse_long_lines(text, skip + done - len(text))
                cut = text.rfind(b"\n") + 1
                carry = text[cut:]
                if cut:
                    yield self._clean(text[:cut], offset + skip)
                if self._progress is not None:
                    self._progress(min(done + skip, total), total)
            if decoder is not None and (tail := decoder.decode(b"", True)):
                carry += tail.encode("utf-8", errors="replace")  # half a character: cut
                self._replaced += 1
        self.unfinished = self._clean(carry, done) if carry.strip() else b""

    def _refuse_long_lines(self, text: bytes, offset: int) -> None:
        """E18 for a line above `max_line`, of NULs (a hole that a crash left) apart."""
        start = 0
        while len(text) - start > self._max_line:
            # The last line end within reach: a jump of many lines at once.
            if (end := text.rfind(b"\n", start, start + self._max_line + 1)) < 0:
                end = text.find(b"\n", start)
                end = len(text) if end < 0 else end
                if text[start:end].strip(b"\0"):
                    raise InputError(
                        f"no line end within {self._max_line:,} bytes",
                        code="E18",
                        where=f"{self.path}, near byte {offset + start:,}",
                        evidence=f"{text[start : start + 40]!r}",
                        cure="this is no text file of records, or its line ends are lost; "
                        "name the right format with --format; where such lines are right, say "
                        f"--max-line {4 * self._max_line}",
                    )
            start = end + 1

    def _clean(self, text: bytes, offset: int) -> bytes:
        if (at := text.find(0)) >= 0:
            self._nul_bytes += text.count(0)
            self._seen(offset + at)
            text = self._without_nul_lines(text)
        if not text.isascii():
            try:
                text.decode("utf-8")
            except UnicodeDecodeError as error:
                self._latin_bytes += int(np.count_nonzero(np.frombuffer(text, np.uint8) >= 0x80))
                self._seen(offset + error.start)
                text = text.decode("latin-1").encode("utf-8")
        return text

    def _without_nul_lines(self, text: bytes) -> bytes:
        # NULs are holes that a crash left: what stands around them need not belong together.
        kept, start = [], 0
        while (at := text.find(0, start)) >= 0:
            begin = text.rfind(b"\n", start, at) + 1 or start
            kept.append(text[start:begin])
            start = text.find(b"\n", at) + 1 or len(text)
            self.nul_lines += bool(text[begin:start].strip(b"\0\r\n \t"))
        return b"".join([*kept, text[start:]])

    def _seen(self, offset: int) -> None:
        if self._first_odd is None:
            self._first_odd = offset

    def findings(self) -> tuple[Finding, ...]:
        """E19 once the blocks are read: byte order marks, UTF-16, NULs, bytes beyond UTF-8."""
        notes = list(self._notes)
        if self._nul_bytes:
            notes.append(
                f"{self._nul_bytes:,} NUL bytes, {self.nul_lines:,} lines with them left out"
            )
        if self._latin_bytes:
            notes.append(f"{self._latin_bytes:,} bytes are no UTF-8 and were read as Latin-1")
        if self._replaced:
            notes.append(f"{self._replaced:,} characters cannot be read in its encoding")
        if not notes:
            return ()
        where = "" if self._first_odd is None else f"from byte {self._first_odd:,}"
        return (
            Finding(
                "E19",
                "warning" if self._nul_bytes or self._latin_bytes or self._replaced else "info",
                "the text is not plain UTF-8: " + "; ".join(notes),
                where=where,
                cure="save the file as UTF-8, or name what it is: --encoding latin-1",
            ),
        )


@dataclass(frozen=True)
class Fields:
    """Columns of one block of lines.

    Parameters
    ----------
    rows : lines with the expected number of fields.
    numbers : (rows,) float64 by name; NaN where empty or unreadable.
    texts : (rows,) pyarrow strings by name.
    unreadable : (rows,) bool by name of a number column: there was text, but no number.
    words : words for "missing" (such as NaN) met, by name.
    bad_lines : lines with another number of fields, and the first of them.
    other_decimal : the first number with the other decimal sign than `decimal`, "" for none.
    """

    rows: int
    numbers: dict[str, NDArray[np.float64]]
    texts: dict[str, Any]
    unreadable: dict[str, NDArray[np.bool_]] = field(default_factory=dict)
    words: dict[str, int] = field(default_factory=dict)
    bad_lines: int = 0
    first_bad: str = ""
    other_decimal: str = ""


def parse_lines(
    block: bytes,
    names: Sequence[str],
    *,
    texts: Sequence[str],
    wanted: Sequence[str],
    delimiter: str,
    decimal: str = ".",
) -> Fields:
    """Columns of a block of delimited lines.

    Parameters
    ----------
    block : whole lines, UTF-8.
    names : one name a field; every line must have as many fields.
    texts : names whose fields stay text; all others are numbers.
    wanted : names to decode.
    delimiter : one character.
    decimal : decimal point of the numbers.
    """
    bad: list[str] = []

    def on_bad_line(row: Any) -> str:
        bad.append(f"{row.actual_columns} fields for {row.expected_columns}: {row.text[:120]}")
        return "skip"

    quoted = b'"' in block
    if quoted:
        block, unbalanced = _without_unbalanced_quotes(block)
        bad += unbalanced

    def decode(as_text: Sequence[str]) -> Any:
        types = {n: pa.string() if n in as_text else pa.float64() for n in wanted}
        return pa.csv.read_csv(
            pa.BufferReader(block),
            # One thread a block: the blocks themselves are decoded side by side.
            read_options=pa.csv.ReadOptions(
                column_names=list(names), block_size=max(len(block), 1), use_threads=False
            ),
            parse_options=pa.csv.ParseOptions(
                delimiter=delimiter,
                quote_char='"' if quoted else False,
                invalid_row_handler=on_bad_line,
            ),
            convert_options=pa.csv.ConvertOptions(
                column_types=types,
                include_columns=list(wanted),
                null_values=[""],
                strings_can_be_null=False,
                decimal_point=decimal,
            ),
        )

    if not block.strip():
        table = pa.table(
            {n: pa.array([], pa.string() if n in texts else pa.float64()) for n in wanted}
        )
        as_text = list(texts)
    else:
        held = list(bad)
        as_text = list(texts)
        try:
            table = decode(as_text)
        except pa.ArrowInvalid:
            # A field is no number: decode all as text and judge field by field.
            bad[:] = held
            as_text = list(wanted)
            table = decode(as_text)

    numbers: dict[str, NDArray[np.float64]] = {}
    text_columns: dict[str, Any] = {}
    unreadable: dict[str, NDArray[np.bool_]] = {}
    words: dict[str, int] = {}
    other_decimal = ""
    for name in wanted:
        column = table.column(name).combine_chunks()
        if isinstance(column, pa.ChunkedArray):
            column = (
                pa.concat_arrays(column.chunks) if column.num_chunks else pa.array([], column.type)
            )
        if name in texts:
            text_columns[name] = column
            continue
        if name in as_text:
            values, wrong, missing_words = parse_numbers(column, decimal)
            if wrong.any():
                unreadable[name] = wrong
                other_decimal = other_decimal or _other_decimal(column.filter(pa.array(wrong)))
        else:
            values = column.to_numpy(zero_copy_only=False)
            missing_words = int(np.count_nonzero(np.isnan(values))) - column.null_count
        if missing_words:
            words[name] = missing_words
        numbers[name] = values
    return Fields(
        table.num_rows,
        numbers,
        text_columns,
        unreadable,
        words,
        len(bad),
        bad[0] if bad else "",
        other_decimal,
    )


def _other_decimal(unreadable: Any) -> str:
    """The first of some fields that are no numbers which would be one with the other sign."""
    meant = pc.match_substring_regex(
        pc.utf8_trim_whitespace(unreadable.cast(pa.string())), _OTHER_NUMBER
    )
    found = unreadable.filter(meant)
    return str(found[0]) if len(found) else ""


def parse_numbers(
    column: Any, decimal: str = "."
) -> tuple[NDArray[np.float64], NDArray[np.bool_], int]:
    """Numbers of a text column: (n,) values, (n,) where text is no number, count of NaN words."""
    text = pc.utf8_trim_whitespace(column.cast(pa.string()))
    good = pc.match_substring_regex(text, _NUMBER)
    if decimal != ".":
        # A point in such a text is no decimal point (1.250 may be 1250): no number.
        pointed = pc.match_substring(text, ".")
        text = pc.replace_substring(text, decimal, ".")
        good = pc.and_(pc.match_substring_regex(text, _NUMBER), pc.invert(pointed))
    cleaned = pc.replace_substring_regex(pc.if_else(good, text, None), r"^\+", "")
    values = cleaned.cast(pa.float64()).to_numpy(zero_copy_only=False)
    empty = pc.fill_null(pc.equal(text, ""), True)
    word = pc.is_in(pc.utf8_lower(text), value_set=pa.array(_MISSING_WORDS))
    is_number = pc.fill_null(good, False).to_numpy(zero_copy_only=False)
    is_word = word.to_numpy(zero_copy_only=False)
    wrong = ~(is_number | is_word | empty.to_numpy(zero_copy_only=False))
    return np.asarray(values, np.float64), wrong, int(np.count_nonzero(is_word))


def _without_unbalanced_quotes(block: bytes) -> tuple[bytes, list[str]]:
    # An open quote would swallow all lines behind it as one field.
    raw = np.frombuffer(block, np.uint8)
    ends = np.flatnonzero(raw == 0x0A)
    line_of_quote = np.searchsorted(ends, np.flatnonzero(raw == 0x22))
    odd = set(np.flatnonzero(np.bincount(line_of_quote) % 2).tolist())
    if not odd:
        return block, []
    lines = block.split(b"\n")
    bad = [f"open quote: {lines[i][:120].decode('utf-8', 'replace').rstrip()}" for i in sorted(odd)]
    return b"\n".join(line for i, line in enumerate(lines) if i not in odd), bad


def collapse_blanks(block: bytes) -> bytes:
    """The lines with runs of blanks made one, and none at the start or end of a line."""
    pieces = []
    trailing = False
    size = 1 << 18  # a piece with its mask stays in the processor's cache
    for start in range(0, len(block), size):
        before = min(start, 1)
        raw = np.frombuffer(block, np.uint8, min(size, len(block) - start) + before, start - before)
        blank, end = raw == 0x20, raw == 0x0A
        trailing = trailing or bool((blank[:-1] & end[1:]).any())
        keep = np.ones(len(raw), bool)
        keep[1:] = ~(blank[1:] & (blank | end)[:-1])
        keep[0] = not before and not blank[0]
        pieces.append(raw[keep].tobytes())
    collapsed = b"".join(pieces)
    return collapsed.replace(b" \n", b"\n") if trailing else collapsed


def plain_blanks(block: bytes, separator: str = " ") -> bytes:
    """The lines with tabs and separators as blanks, without carriage returns."""
    if separator == " " and b"\t" not in block and b"\r" not in block:
        return block
    table = bytes.maketrans(b"\t" + separator.encode(), b"  ")
    return block.translate(table, b"\r")


def side_by_side(function: Callable[[A], B], items: Iterable[A]) -> Iterator[B]:
    """Results of a function over items, in order, computed on all processors, few ahead."""
    workers = min(os.cpu_count() or 1, 8)
    with ThreadPoolExecutor(workers) as pool:
        waiting: deque[Future[B]] = deque()
        for item in items:
            waiting.append(pool.submit(function, item))
            if len(waiting) > workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def bad_line_finding(bad: int, kept: int, example: str) -> tuple[Finding, ...]:
    """E10 for lines that were left out: a warning, an error above 1 % of all lines."""
    if not bad:
        return ()
    share = bad / (bad + kept)
    return (
        Finding(
            "E10",
            "error" if share > BAD_SHARE else "warning",
            f"{bad:,} of {bad + kept:,} lines are cut or unreadable and left out",
            evidence=example,
            cure="copy or write the file again; or take out the lines if they are known",
        ),
    )
