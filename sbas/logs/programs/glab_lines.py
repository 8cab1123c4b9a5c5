"""Lines of gLAB's output by their first word, as columns of numbers.

Every line begins with the name of its message, then year, day of year and seconds of day in GPS
time. Source: message help of gLAB 6.0.0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sbas.logs.text_input import collapse_blanks, parse_lines
from sbas.timescales import NS_PER_S

Floats = NDArray[np.float64]

_WORD_BYTES = 16
_REST, _QUOTE = 0x02, 0x03
"""Stand for the blanks of a last field that is free text or a list, and for quotation marks:
control characters that are no white space, so that they spoil a number."""
_DAY_NS = 86_400 * NS_PER_S
_GPS_FIRST_YEAR, _LAST_YEAR = 1980, 2261

OTHER_MESSAGES = frozenset(
    name + suffix
    for names, suffixes in (
        (("INFO", "USERADDEDERROR", "INPUT", "MEAS", "EPOCHSAT", "FILTER", "DGNSS", "SATDIFF",
          "SATSTAT", "SATSTATTOT", "SATPVT", "SUMMARY", "SBASUNUSED", "SBASUNUSED*",
          "DGNSSUNUSED", "DGNSSUNSED"), ("",)),
        (("PREFIT", "POSTFIT"), ("", "*")),
        (("CS", "SFCSDATA", "MWCSDATA", "LICSDATA", "IGFCSDATA", "USERADDEDERROR", "INPUT",
          "MEAS"), ("", "_USER", "_REF")),
    )
    for name in names
    for suffix in suffixes
)  # fmt: skip
"""First words of messages that are known and not needed here."""


@dataclass(frozen=True)
class Message:
    """How the lines of one message are built.

    Parameters
    ----------
    fields : number of fields.
    columns : what to read: name by the number of the field, counted from 1 as gLAB's help does.
    texts : those of the names that are words.
    open_ended : whether the last field takes all that follows, as a quoted text or a list does.
    """

    fields: int
    columns: Mapping[int, str]
    texts: tuple[str, ...] = ()
    open_ended: bool = False


@dataclass(frozen=True)
class Rows:
    """Lines of one message: (n,) times, line numbers, stars behind the name, and columns."""

    time_ns: NDArray[np.int64]
    line: NDArray[np.int64]
    starred: NDArray[np.bool_]
    numbers: dict[str, Floats] = field(default_factory=dict)
    texts: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time_ns)

    def __getitem__(self, keep: NDArray[np.bool_]) -> Rows:
        if keep.all():
            return self
        mask = pa.array(keep)
        return Rows(
            self.time_ns[keep],
            self.line[keep],
            self.starred[keep],
            {name: values[keep] for name, values in self.numbers.items()},
            {name: words.filter(mask) for name, words in self.texts.items()},
        )


@dataclass
class Damage:
    """Lines that were left out, and the first of them."""

    lines: int = 0
    example: str = ""

    def add(self, lines: int, example: str) -> None:
        if lines:
            self.lines += lines
            self.example = self.example or example


@dataclass(frozen=True)
class SplitBlock:
    """The lines of a block by message.

    Parameters
    ----------
    texts : whole lines by message.
    lines : their (n,) numbers within the block.
    starred : (n,) whether a star follows the name.
    count : lines of the block in all.
    """

    texts: dict[str, bytes]
    lines: dict[str, NDArray[np.int64]]
    starred: dict[str, NDArray[np.bool_]]
    count: int


def split_block(block: bytes, wanted: Sequence[str], damage: Damage) -> SplitBlock:
    """Whole lines of a block by their first word.

    Parameters
    ----------
    block : whole lines, fields separated by blanks.
    wanted : messages to return; a star behind the name is no part of it.
    damage : takes the lines whose first word is no message of gLAB.
    """
    raw = np.frombuffer(block + b"\n" * _WORD_BYTES, np.uint8)
    ends = np.flatnonzero(raw[: len(block)] == 0x0A)
    starts = np.concatenate([[0], ends[:-1] + 1]) if len(ends) else np.zeros(0, np.int64)
    head = raw[starts[:, None] + np.arange(_WORD_BYTES)]
    head[np.logical_or.accumulate(head <= 0x20, axis=1)] = 0
    words, word_of_line = np.unique(head.view(f"S{_WORD_BYTES}").ravel(), return_inverse=True)
    names = [word.decode("utf-8", "replace") for word in words.tolist()]
    known = {*wanted, *(f"{name}*" for name in wanted), *OTHER_MESSAGES, ""}
    strange = np.array([name not in known for name in names], bool)[word_of_line]
    strange |= (raw[starts] <= 0x20) & (ends > starts)
    if strange.any():
        first = int(np.argmax(strange))
        shown = block[starts[first] : ends[first]][:120].decode("utf-8", "replace")
        damage.add(int(np.count_nonzero(strange)), f"no message of gLAB: {shown}")
    lengths = ends + 1 - starts
    texts, lines, stars = {}, {}, {}
    for message in wanted:
        chosen = [i for i, name in enumerate(names) if name in (message, f"{message}*")]
        if not chosen:
            continue
        mask = np.isin(word_of_line, chosen)
        texts[message] = raw[: len(block)][np.repeat(mask, lengths)].tobytes()
        lines[message] = np.flatnonzero(mask)
        star = np.array([name.endswith("*") for name in names], bool)
        stars[message] = star[word_of_line[mask]]
    return SplitBlock(texts, lines, stars, len(starts))


def read_rows(split: SplitBlock, name: str, message: Message, damage: Damage) -> Rows | None:
    """Columns of the lines of one message; None where a block has none.

    Lines with another number of fields, with a field that is no number or with an impossible
    time are left out and counted in `damage`.
    """
    if name not in split.texts:
        return None
    text, good = _fielded(collapse_blanks(split.texts[name]), message)
    if not good.all():
        damage.add(int(np.count_nonzero(~good)), f"{name} line with another number of fields")
    names = {1: "word", 2: "year", 3: "day", 4: "second", **message.columns}
    fields = parse_lines(
        text,
        [names.get(i, str(i)) for i in range(1, message.fields + 1)],
        texts=message.texts,
        wanted=[n for i, n in names.items() if i > 1],
        delimiter=" ",
    )
    numbers = fields.numbers
    time_ns, readable = time_of_day_of_year(
        numbers.pop("year"), numbers.pop("day"), numbers.pop("second")
    )
    for wrong in fields.unreadable.values():
        readable &= ~wrong
    for values in numbers.values():
        readable &= ~np.isinf(values)
    rows = Rows(time_ns, split.lines[name][good], split.starred[name][good], numbers, fields.texts)
    if not readable.all():
        damage.add(
            int(np.count_nonzero(~readable)), f"{name} line with a field or time that is none"
        )
    return rows[readable]


def free_text(words: Any) -> Any:
    """(n,) texts of an open-ended last field with their blanks, without quotes around them."""
    plain = pc.replace_substring(words, chr(_REST), " ")
    return pc.replace_substring(plain, chr(_QUOTE), "")


def list_items(words: Any) -> tuple[Any, NDArray[np.int64]]:
    """Items of (n,) lists in an open-ended last field, and the row of each item."""
    lists = pc.split_pattern(words, chr(_REST))
    rows = pc.list_parent_indices(lists).to_numpy(zero_copy_only=False)
    return pc.list_flatten(lists), np.asarray(rows, np.int64)


def time_of_day_of_year(
    year: Floats, day: Floats, second: Floats
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(n,) nanoseconds on the datetime64 scale of year, day of year and second of day.

    Returns
    -------
    (n,) times and (n,) whether the three are a time of GPS at all; 0 where they are not.
    """
    good = (year >= _GPS_FIRST_YEAR) & (year <= _LAST_YEAR) & (year == np.floor(year))
    good &= (day >= 1) & (day <= 366) & (day == np.floor(day))
    good &= (second >= 0) & (second < 86_400)
    years = np.where(good, year, 2000).astype(np.int64) - 1970
    first = years.astype("M8[Y]").astype("M8[D]").astype(np.int64)
    days = first + np.where(good, day, 1).astype(np.int64) - 1
    good &= days < (years + 1).astype("M8[Y]").astype("M8[D]").astype(np.int64)
    ns = days * _DAY_NS + np.rint(np.where(good, second, 0.0) * 1e9).astype(np.int64)
    return np.where(good, ns, 0), good


def join_rows(parts: Sequence[Rows | None], first_lines: Sequence[int]) -> Rows | None:
    """The rows of all blocks, with line numbers counted through the file."""
    found = [(part, at) for part, at in zip(parts, first_lines, strict=True) if part is not None]
    if not found:
        return None
    rows = [part for part, _ in found]
    return Rows(
        np.concatenate([part.time_ns for part in rows]),
        np.concatenate([part.line + at for part, at in found]),
        np.concatenate([part.starred for part in rows]),
        {name: np.concatenate([part.numbers[name] for part in rows]) for name in rows[0].numbers},
        {
            name: pa.concat_arrays([part.texts[name].cast(pa.large_string()) for part in rows])
            for name in rows[0].texts
        },
    )


def _fielded(text: bytes, message: Message) -> tuple[bytes, NDArray[np.bool_]]:
    """The lines with as many fields as the message has, and which of the (n,) lines they are."""
    raw = np.frombuffer(text, np.uint8)
    ends = np.flatnonzero(raw == 0x0A)
    blanks = np.flatnonzero(raw == 0x20)
    behind = np.searchsorted(blanks, ends)
    counts = np.diff(behind, prepend=0)
    separators = message.fields - 1
    # A quotation mark must not hide the fields behind it.
    edited = np.where(raw == 0x22, np.uint8(_QUOTE), raw)
    if not message.open_ended:
        good = counts == separators
    else:
        good = counts >= separators
        before = np.repeat(behind - counts, counts)
        edited[blanks[np.arange(len(blanks)) - before >= separators]] = _REST
    return _lines_kept(edited, ends, good), good


def _lines_kept(raw: NDArray[np.uint8], ends: NDArray[np.int64], keep: NDArray[np.bool_]) -> bytes:
    if keep.all():
        return raw.tobytes()
    return raw[np.repeat(keep, np.diff(ends, prepend=-1))].tobytes()
