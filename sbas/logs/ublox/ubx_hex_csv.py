"""UBX messages as hex in CSV: lines `time,U,hex` between lines `time,I,hex` of an IMU.

So are the train runs of ETH-PBL/Railway-Precise-Localization. A line U holds one UBX message or
several, whole; a message never runs over lines. The times of the lines are those of the logger's
own clock without a date and are not used: the messages have GPS time. IMU lines are counted.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.logs.format import Format, Match, Progress
from sbas.logs.text_input import BAD_SHARE, TextBlocks
from sbas.logs.ublox.ublox_ubx import asked_columns, check_options
from sbas.logs.ublox.ubx_batches import UbxEpochs, survey
from sbas.logs.ublox.ubx_framing import MAX_PAYLOAD, Frames, frame
from sbas.logs.ublox.ubx_levels import HorizontalLevel
from sbas.logs.ublox.ubx_report import meta_of
from sbas.logs.ublox.ubx_stream import Chunk, Seen, extract, fields_for, load
from sbas.recording import Recording

_MESSAGE = re.compile(rb"(?m)^[0-9:.]+,U,((?:[0-9A-Fa-f]{2})+)\r?$")
_IMU = re.compile(rb"(?m)^[0-9:.]+,I,[0-9A-Fa-f]+\r?$")
_BLANK = re.compile(rb"(?m)^[ \t\r]*\n")
_EXAMPLE_LETTERS = 60

Bytes = NDArray[np.uint8]
Ends = NDArray[np.int64]


@dataclass
class _Lines:
    """Lines of the file by what they are, and the blocks that they come in.

    Lines U are `whole` where they hold nothing but whole messages, else `broken`.
    """

    blocks: TextBlocks
    whole: int = 0
    imu: int = 0
    broken: int = 0
    other: int = 0
    first_broken: str = ""

    def findings(self) -> tuple[Finding, ...]:
        """E19 and E10 on the lines, and how many were not used."""
        found = list(self.blocks.findings())
        if self.broken:
            share = self.broken / (self.broken + self.whole)
            found.append(
                Finding(
                    "E10",
                    "error" if share > BAD_SHARE else "warning",
                    "lines U hold bytes that are no whole UBX message; whole messages in them "
                    "were read",
                    evidence=f"{self.broken:,} of {self.broken + self.whole:,} lines, first "
                    f"{self.first_broken}",
                    cure="copy or write the file again; or take out the lines if they are known",
                )
            )
        if self.other:
            found.append(
                Finding(
                    "E10",
                    "warning",
                    "lines are neither UBX messages (U) nor IMU data (I) and were left out",
                    evidence=f"{self.other:,} lines",
                )
            )
        if self.imu:
            found.append(
                Finding("E24", "info", "IMU lines were not used", evidence=f"{self.imu:,} lines")
            )
        return tuple(found)


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """95 where a line U holds a whole UBX message; 70 where nearly all lines are U or I."""
    lines = hits = 0
    for piece in (head, middle, tail):
        whole = piece[: piece.rfind(b"\n") + 1]
        data, ends = _decoded(whole)
        if len(_whole_frames(data, ends, 0, MAX_PAYLOAD).start):
            return Match(95, "lines time,U,hex with a whole UBX message")
        lines += whole.count(b"\n")
        hits += len(ends) + len(_IMU.findall(whole))
    if lines and hits > 0.9 * lines:
        return Match(70, "lines time,I,hex or time,U,hex, but no whole UBX message")
    return Match(0, "no line time,U,hex with a UBX message")


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    ubx_pl: HorizontalLevel = "norm",
    ubx_max_payload: int = MAX_PAYLOAD,
) -> Recording:
    """Recording of UBX messages as hex in CSV; arguments, result and errors as for a UBX file."""
    check_options(ubx_pl, ubx_max_payload)
    asked = asked_columns(columns)
    lines = _Lines(TextBlocks(Path(path), progress))
    seen = Seen()
    table, side_tables = load(_chunks(lines, asked, ubx_max_payload), asked, ubx_pl, seen)
    meta = meta_of(seen, ubx_pl)
    meta = replace(meta, findings=(*meta.findings, *lines.findings()))
    return Recording(table, meta, side_tables)


def scan(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    ubx_pl: HorizontalLevel = "norm",
    ubx_max_payload: int = MAX_PAYLOAD,
) -> UbxEpochs:
    """Epochs in batches, in bounded memory; arguments and errors as for `read`."""
    check_options(ubx_pl, ubx_max_payload)
    opened: list[_Lines] = []

    def open_chunks(asked: tuple[str, ...]) -> Iterator[Chunk]:
        opened.append(_Lines(TextBlocks(Path(path), progress)))
        return _chunks(opened[-1], asked, ubx_max_payload)

    epochs = survey(open_chunks, asked_columns(columns), ubx_pl, Seen())
    findings = (*epochs.meta.findings, *opened[0].findings())
    return replace(epochs, meta=replace(epochs.meta, findings=findings))


def _chunks(lines: _Lines, asked: tuple[str, ...], max_payload: int) -> Iterator[Chunk]:
    fields = fields_for(set(asked))
    offset = 0
    for block in _blocks(lines.blocks):
        data, ends = _decoded(block)
        frames = _whole_frames(data, ends, offset, max_payload)
        _count(lines, block, ends, frames)
        offset += len(data)
        yield extract(frames, fields)


def _blocks(blocks: TextBlocks) -> Iterator[bytes]:
    yield from blocks
    # A last line without line end is whole if its messages are.
    if blocks.unfinished.strip():
        yield blocks.unfinished + b"\n"


def _decoded(block: bytes) -> tuple[Bytes, Ends]:
    """Bytes of all well-formed lines U, and (n,) where each line ends in them."""
    texts = _MESSAGE.findall(block)
    data = np.frombuffer(bytes.fromhex(b"".join(texts).decode("ascii")), np.uint8)
    return data, np.cumsum([len(text) // 2 for text in texts], dtype=np.int64)


def _whole_frames(data: Bytes, ends: Ends, offset: int, max_payload: int) -> Frames:
    """Frames that lie in one line."""
    found = frame(data, offset=offset, max_payload=max_payload)
    line = np.searchsorted(ends, found.start - offset, side="right")
    inside = found.end - offset <= ends[line]
    return Frames(data, offset, found.start[inside], found.end[inside], found.key[inside])


def _count(lines: _Lines, block: bytes, ends: Ends, frames: Frames) -> None:
    line = np.searchsorted(ends, frames.start - frames.offset, side="right")
    covered = np.bincount(line, frames.end - frames.start, minlength=len(ends))
    whole: NDArray[np.bool_] = covered == np.diff(ends, prepend=0)
    said = block.count(b",U,")
    good = int(np.count_nonzero(whole))
    lines.whole += good
    lines.broken += said - good
    imu = block.count(b",I,")
    lines.imu += imu
    if (other := block.count(b"\n") - said - imu) > 0:
        lines.other += max(other - len(_BLANK.findall(block)), 0)
    if said > good and not lines.first_broken:
        lines.first_broken = _first_broken(block, whole)


def _first_broken(block: bytes, whole: NDArray[np.bool_]) -> str:
    """Begin of the first line U that holds no whole messages."""
    well_formed = iter(whole.tolist())
    for text in block.split(b"\n"):
        if b",U," in text and not (_MESSAGE.match(text) and next(well_formed)):
            return text[:_EXAMPLE_LETTERS].decode("utf-8", "replace")
    return ""


FORMAT = Format(
    name="ubx_hex_csv",
    extensions=(".csv",),
    description="UBX messages as hex in CSV (lines time,U,hex), as of train runs",
    sniff=sniff,
    read=read,
    scan=scan,
)
