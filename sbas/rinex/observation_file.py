"""RINEX observation files to arrays."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.logs.decompression import plain_file
from sbas.rinex.epoch_records import whole_epochs
from sbas.rinex.georinex_engine import read_by_georinex
from sbas.rinex.hatanaka_text import is_compact, restored
from sbas.rinex.joined_observations import joined
from sbas.rinex.observation_arrays import observation_arrays
from sbas.rinex.observation_header import SYSTEMS, parse_header
from sbas.rinex.observation_lines import PADDING, lines_of
from sbas.rinex.observations import ObservationHeader, Observations
from sbas.rinex.version_2_text import body_as_version_3

Engine = Literal["native", "georinex"]

MAX_BYTES = 1 << 32
_HEADER_BYTES = 1 << 22


def read_observations(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    systems: Collection[str] | None = None,
    codes: Collection[str] | None = None,
    engine: Engine = "native",
) -> Observations:
    """Observations of one or more files of one receiver, joined by time.

    Parameters
    ----------
    paths : RINEX 2, 3 or 4, plain, compressed, or packed after Hatanaka.
    systems : letters of the systems to read; by default all.
    codes : observation codes to read, as version 3 names them; by default all.
    engine : "georinex" has versions 2 and 3 read by that library, for comparison: slow.

    Returns
    -------
    Observations; partial epochs and fields that are no numbers are left out and counted (E10).

    Raises
    ------
    InputError : no observation file, an empty one, or one whose header does not end.
    """
    names = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    if not names:
        raise InputError("no observation file was given", cure="--obs FILE.obs")
    unknown = sorted(set(systems or ()) - set(SYSTEMS))
    if unknown:
        raise InputError(
            f"there is no satellite system {unknown[0]!r}",
            where="systems",
            cure=f"systems are {', '.join(SYSTEMS)}",
        )
    parts = [_file(Path(name), systems, codes, engine) for name in names]
    return parts[0] if len(parts) == 1 else joined(parts)


def _file(
    path: Path, systems: Collection[str] | None, codes: Collection[str] | None, engine: Engine
) -> Observations:
    where = str(path)
    data, findings = _content(path)
    header, body = _header(data, where)
    ends_whole = data.endswith(b"\n")
    if data.find(b"RINEX VERSION / TYPE", body) >= 0:
        raise InputError(
            "a second header stands inside the file",
            code="E06",
            where=where,
            cure="split the file before that header and give both parts",
        )
    if engine == "georinex" and header.version < 3:
        found = read_by_georinex(data, header, systems=systems, codes=codes, where=where)
        return replace(found, findings=(*findings, *found.findings))
    if header.version < 3:
        body_3, more = body_as_version_3(data[body:], header, ends_whole=ends_whole, where=where)
        data, body, ends_whole, findings = body_3, 0, True, (*findings, *more)
    text = np.frombuffer(data + PADDING, np.uint8, offset=body)
    lines = lines_of(text, len(data) - body)
    epochs = whole_epochs(lines, header, ends_whole=ends_whole, where=where)
    if engine == "georinex":
        spans = [text[low:high].tobytes() for low, high in epochs.span.tolist()]
        whole = data[:body] + b"\n".join(spans) + b"\n"
        found = read_by_georinex(
            whole, header, systems=systems, codes=codes, where=where, stamps=epochs.time
        )
        return replace(found, findings=(*findings, *epochs.findings, *found.findings))
    found = observation_arrays(lines, epochs, header, systems, codes, where)
    return replace(found, findings=(*findings, *found.findings))


def _content(path: Path) -> tuple[bytes, tuple[Finding, ...]]:
    """The file as plain RINEX."""
    where = str(path)
    try:
        plain = plain_file(path)
        size = plain.path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                "the observation file is too large to be read at once",
                code="E21",
                where=where,
                evidence=f"{size:,} bytes, limit {MAX_BYTES:,}",
                cure="split it by hours and give all parts",
            )
        if is_compact(plain.path):
            data, findings = restored(plain.path, where=where)
        else:
            data, findings = plain.path.read_bytes(), ()
    except OSError as error:
        raise InputError(
            "the observation file cannot be read",
            where=where,
            evidence=error.strerror or str(error),
            cure="check the name and the folder",
        ) from error
    # Space set aside by a logger and never written, or the end mark of old systems.
    return data.rstrip(b"\0\x1a"), (*plain.findings, *findings)


def _header(data: bytes, where: str) -> tuple[ObservationHeader, int]:
    """Header, and where the body begins."""
    first = data[:81].split(b"\n")[0].decode("latin-1")
    if "RINEX VERSION" not in first[60:80]:
        raise InputError(
            "this is no RINEX file" if data else "the observation file is empty",
            code="E16" if data else "E15",
            where=where,
            evidence=repr(first[:60]),
            cure="give RINEX observations (the first line ends in RINEX VERSION / TYPE)",
        )
    lines: list[str] = []
    at = 0
    while at < min(len(data), _HEADER_BYTES):
        end = data.find(b"\n", at)
        if end < 0:
            break
        line = data[at:end].rstrip(b"\r").decode("latin-1")
        at = end + 1
        if line[60:80].strip() == "END OF HEADER":
            return parse_header(lines, where=where), at
        lines.append(line)
    raise InputError(
        "the header of the observation file does not end",
        code="E10",
        where=where,
        evidence=f"{len(data):,} bytes",
        cure="get the file again",
    )
