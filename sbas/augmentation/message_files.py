"""SBAS messages from files of text or of receivers, or from a recording's frames."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.message_lines import (
    COLUMNS,
    EMS,
    EMS_NEW,
    HEX,
    SBS,
    SourceMessages,
    of_columns,
    of_ems,
    of_hex,
    of_new_ems,
    of_sbs,
    source_messages,
)
from sbas.augmentation.messages import SbasMessages, checked_messages
from sbas.augmentation.rinex_b import MESSAGE_S, RINEX_B, of_rinex_b
from sbas.exceptions import InputError
from sbas.logs.decompression import plain_file
from sbas.logs.registry import read
from sbas.recording import Recording
from sbas.timescales import GPS_EPOCH_NS, NS_PER_S

Ints = NDArray[np.int64]
Stamp = Literal["end", "start"]
_Reader = Callable[[bytes, int | None, str], SourceMessages]

HEAD_BYTES = 1 << 14
MAX_TEXT_BYTES = 1 << 30
"""Largest message file that is read: some 100 days of ten satellites have fewer bytes."""

_TEXTS: tuple[tuple[re.Pattern[bytes], _Reader], ...] = (
    (RINEX_B, of_rinex_b),
    (EMS, of_ems),
    (EMS_NEW, of_new_ems),
    (SBS, of_sbs),
    (COLUMNS, of_columns),
    (HEX, of_hex),
)
"""Kinds of text by a line that only they have."""


def read_messages(
    paths: str | os.PathLike[str] | Recording | Sequence[str | os.PathLike[str]],
    *,
    prn: int | None = None,
    stamp: Stamp = "end",
) -> SbasMessages:
    """L1 messages of one or more files, or of a recording's SBAS frames.

    Parameters
    ----------
    paths : EMS, `.sbs`, hexadecimal text, RINEX-B, SBF or UBX files, plain or compressed; or a
        Recording with the side table `sbas_frames`.
    prn : only this satellite; needed for files that do not name theirs (week, seconds and bits).
    stamp : whether times stamp the end of a message (as EMS and `.sbs` do) or its start; a
        message lasts 1 s. RINEX-B always stamps the start.

    Returns
    -------
    SbasMessages, of `prn` alone where it was given; what was left out is counted.

    Raises
    ------
    InputError : a file that holds no message, or is of no known kind; a satellite without any.
    """
    if isinstance(paths, Recording):
        parts = [_of_recording(paths, "the recording", stamp)]
    else:
        names = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
        parts = [_of_file(Path(name), prn, stamp) for name in names]
    if not parts:
        raise InputError("no message file was given", cure="--messages FILE.ems")
    found = checked_messages(
        np.concatenate([part.time_s for part in parts]),
        np.concatenate([part.prn for part in parts]),
        np.concatenate([part.frame for part in parts]),
        has_crc=np.concatenate([part.has_crc for part in parts]),
        crc_bad=np.concatenate([part.crc_bad for part in parts]),
        l5=np.concatenate([part.l5 for part in parts]),
        stated_kind=np.concatenate([part.kind for part in parts]),
        unreadable=sum(part.unreadable for part in parts),
        findings=tuple(finding for part in parts for finding in part.findings),
    )
    if prn is None:
        return found
    chosen = found.of_prn(prn)
    if not len(chosen):
        raise InputError(
            f"there is no message of PRN {prn}",
            evidence=f"heard: {', '.join(map(str, found.prns)) or 'none'}",
            cure=f"--geo {found.prns[0]}" if found.prns else "give another message file",
        )
    return chosen


def _of_file(path: Path, prn: int | None, stamp: Stamp) -> SourceMessages:
    try:
        packed = plain_file(path)
        plain = packed.path
        with plain.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(
            "the message file cannot be read",
            where=str(path),
            evidence=error.strerror or str(error),
            cure="check the name and the folder",
        ) from error
    reader = next((reader for pattern, reader in _TEXTS if pattern.search(head)), None)
    if reader is None:
        return _of_recording(read(path), str(path), stamp)
    if plain.stat().st_size > MAX_TEXT_BYTES:
        raise InputError(
            "the message file is larger than any such file",
            code="E21",
            where=str(path),
            evidence=f"{plain.stat().st_size:,} bytes, limit {MAX_TEXT_BYTES:,}",
            cure="split it by days",
        )
    found = reader(plain.read_bytes(), prn, str(path))
    if not len(found):
        raise InputError(
            "the file holds no SBAS message",
            code="E15",
            where=str(path),
            evidence=f"{found.unreadable:,} unreadable records",
            cure="give EMS, .sbs, RINEX-B, SBF or UBX files with SBAS frames",
        )
    return found if reader is of_rinex_b else _ended(found, stamp)


def _ended(found: SourceMessages, stamp: Stamp) -> SourceMessages:
    """Messages stamped at their end."""
    return replace(found, time_s=found.time_s + (MESSAGE_S if stamp == "start" else 0))


def _of_recording(recording: Recording, where: str, stamp: Stamp) -> SourceMessages:
    """The frames of a receiver log; a receiver's word on the CRC stands beside our own check.

    Frames without a time are unreadable.
    """
    frames = recording.side_tables.get("sbas_frames")
    if frames is None or not len(frames):
        raise InputError(
            "there are no SBAS frames",
            where=where,
            evidence=f"side tables: {', '.join(recording.side_tables) or 'none'}",
            cure="log GEORawL1 (SBF) or RXM-SFRBX (UBX)",
        )
    time = frames["time"].to_numpy().astype("M8[ns]")
    timed = ~np.isnat(time)
    time_ns = np.where(timed, time.astype(np.int64), GPS_EPOCH_NS) - GPS_EPOCH_NS
    found = source_messages(
        np.rint(time_ns / NS_PER_S).astype(np.int64),
        np.stack([np.frombuffer(frame, np.uint8) for frame in frames["frame"]]),
        prn=frames["prn"].to_numpy().astype(np.int64),
        unreadable=0,
        exists=timed,
        l5=(frames["signal"] == "L5").to_numpy(),
        crc_bad=~frames["crc_passed"].to_numpy(),
        findings=recording.meta.findings,
    )
    return _ended(found, stamp)
