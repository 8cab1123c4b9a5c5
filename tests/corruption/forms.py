"""How a recording is written in each format: head, one piece of bytes an epoch, foot.

The pieces let damage be done where it happens: within a record, between two, to one epoch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from sbas.recording import Recording

Family = Literal["framed", "text", "table"]
"""Frames with a checksum, lines of text without one, Parquet."""


@dataclass(frozen=True)
class Pieces:
    """A file: `head`, then the epochs in order, then `foot`."""

    head: bytes
    epochs: tuple[bytes, ...]
    foot: bytes = b""

    @property
    def data(self) -> bytes:
        return self.head + b"".join(self.epochs) + self.foot


@dataclass(frozen=True)
class Form:
    """One way to write a recording.

    Parameters
    ----------
    name : of the form; several may be of one format.
    format, extension : as the registry has them.
    family : how damage to it shows.
    write : Recording -> Pieces.
    levels : whether protection levels are held.
    numbers : whether coordinates and levels are plain numbers, so that a tool may write them in
        another unit.
    dates : whether time is a date and a clock, so that the date may be wrong at midnight.
    options : options that reading needs.
    """

    name: str
    format: str
    extension: str
    family: Family
    write: Callable[[Recording], Pieces]
    levels: bool = True
    numbers: bool = False
    dates: bool = False
    options: dict[str, Any] = field(default_factory=dict)
