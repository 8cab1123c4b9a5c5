"""NMEA 0183: receiver logs of any maker, with the sentences that carry positions and their quality.

The chain: `nmea_framing` finds the sentences, `nmea_sentences` reads their fields, `nmea_cycles`
joins them to epochs, `nmea_columns` makes columns of them, `nmea_dates` gives them dates,
`nmea_between` looks at what is left over and `nmea_report` says what was found.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.logs.format import Format, Match, Progress
from sbas.logs.nmea.nmea_between import Between, binary_bytes
from sbas.logs.nmea.nmea_columns import EXTRA, FILLED, Raw, Tally, fill, kinds_for, needed
from sbas.logs.nmea.nmea_cycles import Cycles, Epochs
from sbas.logs.nmea.nmea_dates import DateSearch, Dating, FirstDate, Span
from sbas.logs.nmea.nmea_framing import CHUNK_BYTES, chunks, find, sentences_of
from sbas.logs.nmea.nmea_report import findings
from sbas.logs.nmea.nmea_sentences import Columns, decode
from sbas.logs.text_input import side_by_side
from sbas.recording import (
    COLUMNS,
    EpochSource,
    Flag,
    Recording,
    RecordingMeta,
    missing_values,
    mode_categories,
    with_columns,
)
from sbas.timescales import gpst_minus_utc_s

BATCH_EPOCHS = 1 << 17
_MIXED_SCORE = 70
_FIRST_LOOK_BYTES = 1 << 18
_DATE = re.compile(r"\d{4}-\d\d-\d\d")

Dgps = Literal["dgnss", "sbas"]
Checksum = Literal["required", "optional"]


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    date: str | None = None,
    assume_dgps: Dgps = "dgnss",
    nmea_checksum: Checksum = "required",
    geoid: float | None = None,
) -> Recording:
    """Recording of a file of NMEA sentences, also between binary frames or damage.

    Read are GGA, GNS, RMC, GST, GBS, ZDA, GSA, GSV and VTG of any talker, PASHR,POS and PUBX,00.
    No sentence carries a protection level: `hpl_m` and `vpl_m` are missing throughout.

    Parameters
    ----------
    path : the file.
    columns : columns to read; by default all of `FILLED`, and those of `EXTRA` whose sentences
        occur. Others are left out.
    progress : called with bytes done and bytes in all.
    date : UTC date YYYY-MM-DD of the first epoch, for a file without RMC and ZDA.
    assume_dgps : what a differential fix is: `dgnss`, or `sbas` where the receiver has no other
        corrections.
    nmea_checksum : whether a sentence without checksum is rejected; a wrong one always is.
    geoid : height of the geoid above the ellipsoid [m] where a sentence does not tell it.

    Returns
    -------
    Recording; findings in the metadata say what was removed, inferred, rejected or left over.

    Raises
    ------
    InputError : epochs without any date; an option that is none.
    """
    return read_in_chunks(
        path,
        CHUNK_BYTES,
        columns=columns,
        progress=progress,
        date=date,
        assume_dgps=assume_dgps,
        nmea_checksum=nmea_checksum,
        geoid=geoid,
    )


def scan(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    date: str | None = None,
    assume_dgps: Dgps = "dgnss",
    nmea_checksum: Checksum = "required",
    geoid: float | None = None,
) -> EpochSource:
    """Epochs of a file of NMEA sentences in batches; arguments and errors as for `read`.

    The file is gone through once now, for the findings, and once for every look at it; the memory
    needed does not depend on its size.
    """
    log = _Log(Path(path), CHUNK_BYTES, date, assume_dgps, nmea_checksum, geoid)
    seen = _Seen()
    names = log.names(columns)
    first = log.first_date()
    for _ in log.parts(names, first, seen, progress):
        pass
    return NmeaEpochs(log, first, log.meta(seen), seen.present(names, columns))


@dataclass(frozen=True)
class NmeaEpochs:
    """Epochs of a file of NMEA sentences, read batch by batch; an EpochSource.

    Parameters
    ----------
    log : the file and how to read it.
    first : its first date.
    meta, columns : as of the recording.
    """

    log: _Log
    first: FirstDate
    meta: RecordingMeta
    columns: tuple[str, ...]

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Tables of about BATCH_EPOCHS epochs in file order; only these columns are decoded."""
        names = tuple(name for name in columns if name in self.columns)
        waiting: list[_Part] = []
        rows = sent = 0
        for part in self.log.parts(names, self.first, _Seen(), None):
            waiting.append(part)
            rows += len(part.times)
            if rows >= BATCH_EPOCHS:
                yield with_columns(_table(waiting, names), columns)
                waiting, rows, sent = [], 0, sent + rows
        if rows or not sent:
            yield with_columns(_table(waiting, names), columns)


def read_in_chunks(
    path: Path,
    chunk_bytes: int,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    date: str | None = None,
    assume_dgps: Dgps = "dgnss",
    nmea_checksum: Checksum = "required",
    geoid: float | None = None,
) -> Recording:
    """`read` with a stated size of chunks, which changes speed and memory, never the result."""
    log = _Log(Path(path), chunk_bytes, date, assume_dgps, nmea_checksum, geoid)
    seen = _Seen()
    names = log.names(columns)
    parts = list(log.parts(names, log.first_date(), seen, progress))
    return Recording(_table(parts, seen.present(names, columns)), log.meta(seen))


@dataclass
class _Seen:
    """What one pass through a file counted."""

    tally: Tally = field(default_factory=Tally)
    between: Between = field(default_factory=Between)
    span: Span = field(default_factory=Span)

    def present(self, names: Sequence[str], asked: Sequence[str] | None) -> tuple[str, ...]:
        """The columns less those of `EXTRA` that nobody asked for and no sentence tells."""
        if asked is not None:
            return tuple(names)
        kinds = {kind for kind, number in self.tally.sentences.items() if number}
        return tuple(n for n in names if n not in EXTRA or kinds & set(EXTRA[n]))


@dataclass(frozen=True)
class _Part:
    """GPS times and columns of some successive epochs."""

    times: NDArray[np.datetime64]
    raw: Raw


@dataclass(frozen=True)
class _Chunk:
    """What one chunk of a file gave.

    `gaps` are the stretches between its sentences, `begin` and `end` the places where the first
    one starts and the last one ends; both are -1 where there is none.
    """

    columns: dict[str, Columns]
    counts: Counter[str]
    gaps: tuple[NDArray[np.int64], NDArray[np.int64]]
    begin: int
    end: int
    sentences: int
    done: int


@dataclass(frozen=True)
class _Log:
    """A file of sentences and how it is to be read; the options are those of `read`."""

    path: Path
    chunk_bytes: int
    date: str | None
    assume_dgps: Dgps
    nmea_checksum: Checksum
    geoid: float | None

    def __post_init__(self) -> None:
        for name, value, known in (
            ("assume_dgps", self.assume_dgps, ("dgnss", "sbas")),
            ("nmea_checksum", self.nmea_checksum, ("required", "optional")),
        ):
            if value not in known:
                raise InputError(
                    f"{name} cannot be {value!r}", where=name, cure=f"say {' or '.join(known)}"
                )
        if self.date is not None and not _is_date(self.date):
            raise InputError(
                f"{self.date!r} is no date", where="date", cure="say --date YYYY-MM-DD"
            )

    def names(self, asked: Sequence[str] | None) -> tuple[str, ...]:
        """The columns to read."""
        known = (*FILLED, *EXTRA)
        return known if asked is None else tuple(name for name in asked if name in known)

    def first_date(self) -> FirstDate:
        """The first date, mostly found in the first chunk; see `DateSearch.result`."""
        search = DateSearch()
        small = replace(self, chunk_bytes=min(self.chunk_bytes, _FIRST_LOOK_BYTES))
        for epochs in small._epochs(set(), _Seen(), None):
            search.add(epochs)
            if search.found:
                break
        return search.result(self.date, str(self.path))

    def parts(
        self, names: Sequence[str], first: FirstDate, seen: _Seen, progress: Progress | None
    ) -> Iterator[_Part]:
        """Epochs of the file with these columns, in file order; `seen` is filled on the way."""
        want = needed(set(names))
        dating = Dating(first, self.date, str(self.path))
        seen.span = dating.span
        for epochs in self._epochs(want, seen, progress):
            times, inferred = dating.add(epochs)
            raw = fill(
                epochs,
                want,
                sbas=self.assume_dgps == "sbas",
                geoid=self.geoid,
                tally=seen.tally,
            )
            if "flags" in raw:
                raw["flags"][inferred] |= np.uint32(Flag.DATE_INFERRED)
            yield _Part(times, {name: raw[name] for name in names if name in raw})

    def _epochs(self, want: set[str], seen: _Seen, progress: Progress | None) -> Iterator[Epochs]:
        """Whole epochs, chunk by chunk."""
        size = self.path.stat().st_size
        kinds = kinds_for(want)
        cycles = Cycles()
        done = ordinal = 0
        nothing = np.empty(0, np.int64)

        def work(bounds: tuple[int, int]) -> _Chunk:
            return self._chunk(*bounds, want, kinds)

        for chunk in side_by_side(work, chunks(size, self.chunk_bytes)):
            breaks = nothing
            if chunk.sentences:
                start, end = chunk.gaps
                if chunk.begin > done:
                    start, end = np.append(done, start), np.append(chunk.begin, end)
                breaks = seen.between.look(self.path, start, end)
                done = chunk.end
                if "GSA" in chunk.columns:
                    chunk.columns["GSA"]["ordinal"] += ordinal
                ordinal += chunk.sentences
                seen.tally.sentences.update(chunk.counts)
                seen.tally.sentences["all"] += chunk.sentences
            epochs = cycles.add(chunk.columns, breaks)
            if progress is not None:
                progress(chunk.done, size)
            if len(epochs) or epochs.unattached:
                yield epochs
        breaks = nothing
        if done < size:
            breaks = seen.between.look(self.path, np.array([done]), np.array([size]))
        yield cycles.add({}, breaks, last=True)

    def _chunk(self, low: int, high: int, want: set[str], kinds: set[str]) -> _Chunk:
        found = sentences_of(self.path, low, high, unchecked=self.nmea_checksum == "optional")
        columns, counts = decode(found, low, want, kinds)
        start, end = found.start + low, found.end + low
        gap = np.flatnonzero(start[1:] > end[:-1])
        return _Chunk(
            columns,
            counts,
            (end[gap], start[gap + 1]),
            int(start[0]) if len(start) else -1,
            int(end[-1]) if len(end) else -1,
            len(found),
            high,
        )

    def meta(self, seen: _Seen) -> RecordingMeta:
        """Metadata with the findings of one pass."""
        span = seen.span
        sbas = self.assume_dgps == "sbas"
        leap = gpst_minus_utc_s(np.array([span.first_ns]).astype("M8[ns]")) if span.rows else None
        return RecordingMeta(
            leap_seconds=None if leap is None else int(leap[0]),
            geoid=f"{self.geoid:g} m as given" if seen.tally.given_separation else "",
            findings=findings(
                seen.tally,
                seen.between,
                span,
                size=self.path.stat().st_size,
                geoid=self.geoid,
                sbas=sbas,
            ),
            options={"assume_dgps": self.assume_dgps} if seen.tally.differential else {},
        )


def _is_date(text: str) -> bool:
    if not _DATE.fullmatch(text):
        return False
    try:
        return bool(np.datetime64(text, "D") >= np.datetime64("1980-01-06"))
    except ValueError:
        return False


def _table(parts: Sequence[_Part], names: Sequence[str]) -> pd.DataFrame:
    """Epoch table of parts in file order, with just these columns."""
    times = np.concatenate([np.empty(0, "M8[ns]"), *(part.times for part in parts)])
    data: dict[str, Any] = {}
    for name in names:
        found = [part.raw[name] for part in parts if name in part.raw]
        if found and name == "mode":
            data[name] = mode_categories(np.concatenate(found))
        elif found:
            data[name] = np.concatenate(found)
        elif name in COLUMNS:
            data[name] = missing_values(name, len(times))
        else:
            data[name] = np.full(len(times), np.nan)
    return pd.DataFrame(data, index=pd.DatetimeIndex(times, name="time", copy=False), copy=False)


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """90 times the share of text in sentences with a good checksum, 50 for those without one;
    at most 70 beside binary blocks, whose own reader tells more."""
    good = unchecked = other = sentences = blocks = 0
    for piece in (head, middle, tail):
        found = find(piece, unchecked=True)
        size = found.end - found.start
        starred = found.data[found.marks[found.first + found.commas + 1]] == ord("*")
        data = np.frombuffer(piece, np.uint8)
        binary, more = binary_bytes(data)
        good += int(size[starred].sum())
        unchecked += int(size[~starred].sum())
        other += max(len(piece) - int(size.sum()) - binary, 0)
        sentences += int(np.count_nonzero(starred))
        blocks += more
    text = good + unchecked + other
    if not good + unchecked:
        return Match(0, "no NMEA sentence")
    score = round((90 * good + 50 * unchecked) / text)
    share = (good + unchecked) / text
    reason = f"{sentences:,} sentences with a good checksum, {share:.0%} of the text in sentences"
    if blocks:
        return Match(min(score, _MIXED_SCORE), f"{reason}, beside binary blocks")
    return Match(score, reason)


FORMAT = Format(
    name="nmea",
    extensions=(".nmea", ".nma", ".nme"),
    description="NMEA 0183 receiver log, checksums compared, also between binary frames",
    sniff=sniff,
    read=read,
    scan=scan,
)
