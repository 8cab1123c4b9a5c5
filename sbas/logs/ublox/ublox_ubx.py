"""u-blox UBX: receiver logs of binary messages, also between NMEA and RTCM.

The chain: `ubx_framing` finds the frames, `ubx_messages` names their fields, `ubx_times` gives
them GPS time, `ubx_epochs` joins them to epochs, `ubx_decode` and `ubx_levels` make columns of
them, `ubx_table` puts the columns together, `ubx_frames` keeps the SBAS frames, and `ubx_report`
says what was found.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from sbas.exceptions import InputError
from sbas.logs.format import Format, Match, Progress
from sbas.logs.ublox.ubx_batches import UbxEpochs, survey
from sbas.logs.ublox.ubx_framing import CHUNK_BYTES, MAX_PAYLOAD, Frames, frame
from sbas.logs.ublox.ubx_framing import scan as scan_frames
from sbas.logs.ublox.ubx_leftovers import Leftovers
from sbas.logs.ublox.ubx_levels import HorizontalLevel
from sbas.logs.ublox.ubx_report import meta_of
from sbas.logs.ublox.ubx_stream import Chunk, Seen, extract, fields_for, load
from sbas.logs.ublox.ubx_table import FILLED
from sbas.recording import Recording

_LONGEST_PAYLOAD = 65535


def sniff(head: bytes, middle: bytes, tail: bytes, path: Path) -> Match:
    """How surely content is UBX: by frames with a good checksum, 97 for three and 80 for one."""
    seen: set[bytes] = set()
    for piece in (head, middle, tail):
        found = frame(np.frombuffer(piece, np.uint8))
        # Samples of a short file overlap; their bytes tell its frames apart.
        spans = zip(found.start.tolist(), found.end.tolist(), strict=True)
        seen.update(piece[first:after] for first, after in spans)
    if not seen:
        return Match(0, "no UBX frame with a good checksum")
    return Match(97 if len(seen) >= 3 else 80, f"{len(seen)} UBX frames with a good checksum")


def read(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    ubx_pl: HorizontalLevel = "norm",
    ubx_max_payload: int = MAX_PAYLOAD,
) -> Recording:
    """Recording of a UBX file.

    Every frame with a good checksum counts, also in a damaged file or between other data.

    Parameters
    ----------
    path : the file.
    columns : columns to read, of `FILLED`; by default all. Those that UBX lacks are left out.
    progress : called with bytes done and bytes in all.
    ubx_pl : how the two horizontal levels of NAV-PL become `hpl_m`: "norm", the root of the sum
        of their squares, or "max", the larger.
    ubx_max_payload : longer payloads are taken for damage [bytes].

    Returns
    -------
    Recording; frames of SBAS satellites are in the side table `sbas_frames` with `time` (that of
    the last epoch before the frame, NaT in a log without any), `prn` (-1 where the number is no
    SBAS satellite's), `crc_passed`, `signal` and `frame`: 32 bytes, the first received bit in
    front, of which the last 6 bits carry nothing. A log without positions has no rows. Findings
    in the metadata say what was removed, cut, left over or unusual.

    Raises
    ------
    InputError : an option with another value than these.
    """
    return read_in_chunks(
        path,
        CHUNK_BYTES,
        columns=columns,
        progress=progress,
        ubx_pl=ubx_pl,
        ubx_max_payload=ubx_max_payload,
    )


def read_in_chunks(
    path: Path,
    chunk_bytes: int,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    ubx_pl: HorizontalLevel = "norm",
    ubx_max_payload: int = MAX_PAYLOAD,
) -> Recording:
    """`read` with a stated size of chunks, which changes speed and memory, never the result."""
    check_options(ubx_pl, ubx_max_payload)
    path = Path(path)
    asked = asked_columns(columns)
    chunks = _chunks(path, asked, chunk_bytes, ubx_max_payload, progress)
    seen = Seen(Leftovers(path, ubx_max_payload))
    table, side_tables = load(chunks, asked, ubx_pl, seen)
    return Recording(table, meta_of(seen, ubx_pl), side_tables)


def scan(
    path: Path,
    *,
    columns: Sequence[str] | None = None,
    progress: Progress | None = None,
    ubx_pl: HorizontalLevel = "norm",
    ubx_max_payload: int = MAX_PAYLOAD,
) -> UbxEpochs:
    """Epochs of a UBX file in batches, in bounded memory; arguments and errors as for `read`.

    One pass makes the findings, each round of batches is another. Side tables are left out.
    """
    check_options(ubx_pl, ubx_max_payload)
    path = Path(path)

    def open_chunks(asked: tuple[str, ...]) -> Iterator[Chunk]:
        return _chunks(path, asked, CHUNK_BYTES, ubx_max_payload, progress)

    seen = Seen(Leftovers(path, ubx_max_payload))
    return survey(open_chunks, asked_columns(columns), ubx_pl, seen)


def check_options(ubx_pl: str, ubx_max_payload: int) -> None:
    """Raise InputError for options that mean nothing."""
    if ubx_pl not in ("norm", "max"):
        raise InputError(
            f"unknown way {ubx_pl!r} to make one horizontal level of two",
            where="ubx_pl",
            cure="use norm or max",
        )
    if not 0 < ubx_max_payload <= _LONGEST_PAYLOAD:
        raise InputError(
            "no UBX payload has this length",
            where="ubx_max_payload",
            evidence=f"{ubx_max_payload}",
            cure=f"give 1 to {_LONGEST_PAYLOAD} bytes",
        )


def asked_columns(columns: Sequence[str] | None) -> tuple[str, ...]:
    """Those of the columns asked that UBX fills, each once."""
    return FILLED if columns is None else tuple(c for c in dict.fromkeys(columns) if c in FILLED)


def _chunks(
    path: Path,
    asked: tuple[str, ...],
    chunk_bytes: int,
    max_payload: int,
    progress: Progress | None,
) -> Iterator[Chunk]:
    fields = fields_for(set(asked))

    def keep(frames: Frames) -> Chunk:
        return extract(frames, fields)

    return scan_frames(
        path, keep, chunk_bytes=chunk_bytes, max_payload=max_payload, progress=progress
    )


FORMAT = Format(
    name="ublox_ubx",
    extensions=(".ubx",),
    description="u-blox UBX receiver log, checksums checked, with raw SBAS frames",
    sniff=sniff,
    read=read,
    scan=scan,
)
