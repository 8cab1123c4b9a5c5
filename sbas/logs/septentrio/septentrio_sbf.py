"""Septentrio SBF: receiver logs of PolaRx, AsteRx and mosaic receivers.

The chain: `sbf_framing` finds the blocks, `sbf_blocks` and `sbf_sub_blocks` name their fields,
`sbf_parts` gathers them, `sbf_epochs` joins them to epochs, `sbf_decode` makes columns of them,
`sbf_satellites` and `sbf_raw_frames` side tables, `sbf_foreign` looks at what is left over and
`sbf_report` says what was found. `sbf_stream` lets all this go segment by segment.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sbas.logs.format import Format, Match, Progress
from sbas.logs.septentrio.sbf_foreign import Leftovers
from sbas.logs.septentrio.sbf_framing import CHUNK_BYTES, frame
from sbas.logs.septentrio.sbf_parts import parts_of
from sbas.logs.septentrio.sbf_plan import FILLED, whole_plan, with_needs
from sbas.logs.septentrio.sbf_raw_frames import frame_table
from sbas.logs.septentrio.sbf_report import recording_meta
from sbas.logs.septentrio.sbf_satellites import side_table
from sbas.logs.septentrio.sbf_segment import epoch_tables
from sbas.logs.septentrio.sbf_stream import (
    SEGMENT_BYTES,
    RevisitedTime,
    SbfEpochs,
    read_all,
    survey,
)
from sbas.logs.septentrio.sbf_writer import write
from sbas.recording import EpochSource, Recording
from sbas.satellite_table import SIDE_TABLE


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """How surely content is SBF: by blocks with a good CRC, 98 for three and 85 for one."""
    seen: set[bytes] = set()
    for piece in (head, middle, tail):
        for group in frame(np.frombuffer(piece, np.uint8)).groups:
            # Samples of a short file overlap; CRC, ID and time tell its blocks apart.
            seen.update(row.tobytes() for row in group.rows[:, 2:14])
    if not seen:
        return Match(0, "no SBF block with a good CRC")
    return Match(98 if len(seen) >= 3 else 85, f"{len(seen)} SBF blocks with a good CRC")


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Recording of an SBF file.

    Every block with a good CRC counts, also in a damaged file or between other data. Version 2
    blocks go before version 1 and geodetic before Cartesian ones where both carry an epoch.

    Parameters
    ----------
    path : the file.
    columns : columns to read, of `FILLED`; by default all. Those that SBF lacks are left out.
    progress : called with bytes done and bytes in all.

    Returns
    -------
    Recording; frames of SBAS satellites are in the side table `sbas_frames` with `time`, `prn`
    (-1 where the number is no SBAS satellite's), `crc_passed`, `signal` (L1 or L5) and `frame`:
    32 bytes, the first received bit in front, of which the last 6 bits carry nothing. Where all
    columns are read and the file has blocks with a row a satellite, they are in the side table
    `satellites` (`sbas.satellite_table`), with `x_w`, the size of the w-test statistic of the
    code residual, and `x_signal`, the number of its signal. Findings in the metadata say what was
    removed, cut, left over or unusual.
    """
    return read_in_chunks(path, CHUNK_BYTES, columns=columns, progress=progress)


def read_in_chunks(
    path: Path,
    chunk_bytes: int,
    segment_bytes: int = SEGMENT_BYTES,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """`read` with stated sizes, which change speed and memory, never the result."""
    asked = _filled(columns)
    want = with_needs(asked)
    plan = whole_plan(want, frames=True, satellites=columns is None)
    leftovers = Leftovers(Path(path))
    parts = parts_of(Path(path), plan, chunk_bytes, progress, leftovers.add)
    found = read_all(parts, want, segment_bytes)
    side = {
        "sbas_frames": frame_table(found.frames),
        SIDE_TABLE: side_table([segment.satellites for segment in found.segments]),
    }
    return Recording(
        epoch_tables(found.segments, asked, found.seen.kinds),
        recording_meta(found.seen, leftovers),
        {name: table for name, table in side.items() if table is not None},
    )


def scan(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> EpochSource:
    """Epochs of an SBF file in batches, with the epochs, metadata and findings of `read`.

    A first look at the whole file gives the metadata; each further look decodes just the columns
    it asks for. A time that comes again far behind in the file (two logs of one hour joined, a
    block stored long after its epoch) needs all of the file at once: such a file is read whole.

    Arguments as for `read`.
    """
    return scan_in_segments(path, CHUNK_BYTES, SEGMENT_BYTES, columns=columns, progress=progress)


def scan_in_segments(
    path: Path,
    chunk_bytes: int,
    segment_bytes: int,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> EpochSource:
    """`scan` with stated sizes, which change speed and memory, never the result."""
    asked = _filled(columns)
    want = with_needs(asked)
    plan = whole_plan(want, frames=False, satellites=columns is None)
    leftovers = Leftovers(Path(path))
    parts = parts_of(Path(path), plan, chunk_bytes, progress, leftovers.add)
    try:
        seen = survey(parts, want, segment_bytes)
    except RevisitedTime:
        return read_in_chunks(path, chunk_bytes, columns=columns, progress=progress)
    return SbfEpochs(
        path=Path(path),
        meta=recording_meta(seen, leftovers),
        columns=asked,
        rows=seen.epochs,
        kinds=seen.kinds,
        chunk_bytes=chunk_bytes,
        segment_bytes=segment_bytes,
        progress=progress,
    )


def _filled(columns: Sequence[str] | None) -> tuple[str, ...]:
    return tuple(FILLED if columns is None else (c for c in columns if c in FILLED))


FORMAT = Format(
    name="septentrio_sbf",
    extensions=(".sbf",),
    description="Septentrio SBF receiver log, CRC-checked, with raw SBAS frames",
    sniff=sniff,
    read=read,
    scan=scan,
    write=write,
)
