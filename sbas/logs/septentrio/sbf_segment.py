"""A part of an SBF file to epochs and satellites."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sbas.logs.septentrio import sbf_blocks as sbf
from sbas.logs.septentrio.sbf_epochs import Epochs, gps_times, join
from sbas.logs.septentrio.sbf_parts import Part
from sbas.logs.septentrio.sbf_satellites import Fixes, Satellites, satellites_of
from sbas.logs.septentrio.sbf_table import KINDS, Filled, empty_column, fill_table, incomplete
from sbas.recording import Flag

EPOCH_NUMBERS = (*(number for kind in KINDS for number in kind), sbf.END_OF_PVT)
"""Blocks that the epochs are joined from."""


@dataclass(frozen=True)
class Segment:
    """Epochs of a part: their rows, their columns, and their satellites."""

    epochs: Epochs
    filled: Filled
    satellites: Satellites

    def __len__(self) -> int:
        return len(self.epochs.time_ms)


def decode_part(part: Part, want: Set[str]) -> Segment:
    """Join the blocks of a part to epochs, and decode their fields.

    Parameters
    ----------
    part : blocks, among which are all that stand at any of their times.
    want : columns to fill, with those that they need.
    """
    epochs = join({number: part.stamps(number) for number in EPOCH_NUMBERS}, sbf.END_OF_PVT)
    filled = fill_table(epochs, part.raw, want)
    unknown = np.full(len(epochs.time_ms), np.nan)
    places = ("lat_deg", "lon_deg", "height_m")
    fixes = Fixes(*(filled.columns.get(name, unknown) for name in places))
    return Segment(epochs, filled, satellites_of(part.sub, epochs, fixes))


def epoch_table(
    segment: Segment, columns: Sequence[str], kinds: int, before_ms: int | None
) -> pd.DataFrame:
    """The epoch table of a segment, with the flags that depend on the rest of the file.

    Parameters
    ----------
    segment : from a decoding that had these columns among those to fill.
    columns : of `FILLED`; those that no block filled are missing throughout.
    kinds : kinds of block that the file has, as `sbf_table.kinds_of` gives them.
    before_ms : time of the epoch before the segment, None at the beginning of the file.
    """
    time_ms, filled = segment.epochs.time_ms, dict(segment.filled.columns)
    if "flags" in filled:
        missing = incomplete(segment.filled.has, kinds)
        filled["flags"] = filled["flags"] | missing * np.uint32(Flag.EPOCH_INCOMPLETE)
        if before_ms is not None and len(segment) and time_ms[0] < before_ms:
            filled["flags"][0] |= np.uint32(Flag.TIME_BACKWARD)
    index = pd.DatetimeIndex(gps_times(time_ms), name="time", copy=False)
    data = {
        name: filled[name] if name in filled else empty_column(name, len(index)) for name in columns
    }
    return pd.DataFrame(data, index=index, copy=False)


def epoch_tables(segments: Sequence[Segment], columns: Sequence[str], kinds: int) -> pd.DataFrame:
    """The epoch table of the segments of a whole file."""
    tables, before_ms = [], None
    for segment in segments:
        if len(segment):
            tables.append(epoch_table(segment, columns, kinds, before_ms))
            before_ms = int(segment.epochs.time_ms[-1])
    if not tables:
        return epoch_table(segments[0], columns, kinds, None)
    return tables[0] if len(tables) == 1 else pd.concat(tables)
