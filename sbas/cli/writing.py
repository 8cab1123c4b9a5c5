"""Recordings to files, in the format that the file's name asks for."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from sbas.exceptions import InputError
from sbas.logs.registry import formats
from sbas.recording import Recording


def write_recording(out: Path, pieces: Iterable[Recording]) -> None:
    """Write consecutive pieces of a recording; folders are made.

    Raises
    ------
    InputError : a name whose extension no format writes.
    """
    writers = {ext: f.write for f in formats() if f.write for ext in f.extensions}
    write = writers.get(out.suffix.lower())
    if write is None:
        raise InputError(
            f"cannot write {out.name!r}",
            cure=f"name a file that ends in one of {', '.join(sorted(writers))}",
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    write(pieces, out)
