"""What a format is: how to recognise it, read it and, for some, write it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from sbas.recording import EpochSource, Recording

Progress = Callable[[int, int], None]
"""Called with (done, in all) as long work goes on: bytes of a reader or writer, else epochs."""


@dataclass(frozen=True)
class Match:
    """How surely content is of a format: 0 (not at all) to 100, and what speaks for it."""

    score: int
    reason: str


Sniffer = Callable[[bytes, bytes, bytes, Path], Match]
"""(head, middle, tail, path) -> Match; the first 64 KiB, 64 KiB from the middle and the last
4 KiB of the content. Never raises."""


@dataclass(frozen=True)
class Format:
    """One file format.

    Parameters
    ----------
    name : short name, as in `sbas.read(path, format=name)`.
    extensions : lower-case, with the dot.
    description : one line for help texts and docs.
    sniff : Sniffer.
    read : (path, *, columns=None, progress=None, ...) -> Recording; every further option is a
        keyword spelled out in the signature, so that the registry knows who takes it.
    scan : the same arguments -> EpochSource that streams; None where only `read` can serve.
    write : (recordings, path, *, progress=None) writes consecutive pieces of one recording.
    """

    name: str
    extensions: tuple[str, ...]
    description: str
    sniff: Sniffer
    read: Callable[..., Recording]
    scan: Callable[..., EpochSource] | None = None
    write: Callable[[Iterable[Recording], Path], None] | None = None
