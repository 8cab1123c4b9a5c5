"""Epochs of UBX messages in bounded memory: one pass for the findings, then batches on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sbas.logs.ublox.ubx_levels import HorizontalLevel
from sbas.logs.ublox.ubx_report import meta_of
from sbas.logs.ublox.ubx_stream import Chunk, Seen, stream, whole_of
from sbas.logs.ublox.ubx_table import Whole, finish, frame_of, needed
from sbas.recording import RecordingMeta, with_columns

OpenChunks = Callable[[tuple[str, ...]], Iterator[Chunk]]
"""Columns asked -> the chunks of a file from its begin, with the fields that those need."""


@dataclass(frozen=True, eq=False)
class UbxEpochs:
    """Epochs of UBX messages, decoded batch by batch; an EpochSource.

    Parameters
    ----------
    meta, columns : as of the recording.
    rows : epochs.
    whole : what the whole file tells, found in a first pass.
    horizontal : how the two horizontal levels of NAV-PL become one.
    open_chunks : opens the file anew.
    """

    meta: RecordingMeta
    columns: tuple[str, ...]
    rows: int
    whole: Whole
    horizontal: HorizontalLevel
    open_chunks: OpenChunks

    def __len__(self) -> int:
        return self.rows

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Tables in file order, a chunk of the file each; only these columns are decoded."""
        asked = tuple(name for name in columns if name in self.columns)
        done, before_ms = 0, None
        for part, _ in stream(self.open_chunks(asked), needed(asked), self.horizontal, Seen()):
            rows = len(part.time_ms)
            if not rows and self.rows:
                continue
            part = finish(part, self.whole, first_row=done, before_ms=before_ms)
            yield with_columns(frame_of(part, asked), columns)
            if not self.rows:
                return
            done, before_ms = done + rows, int(part.time_ms[-1])


def survey(
    open_chunks: OpenChunks, asked: tuple[str, ...], horizontal: HorizontalLevel, seen: Seen
) -> UbxEpochs:
    """Pass once over a file; memory holds a few chunks, and 8 bytes an epoch until it is done.

    Parameters
    ----------
    open_chunks : opens the file.
    asked : columns to offer.
    horizontal : how the two horizontal levels of NAV-PL become one.
    seen : counts, added to.
    """
    times = []
    rising, last_ms = True, -1
    for part, _ in stream(open_chunks(asked), needed(asked), horizontal, seen):
        if len(part.time_ms):
            rising &= bool((np.diff(part.time_ms, prepend=last_ms) > 0).all())
            times.append(part.time_ms)
            last_ms = int(part.time_ms[-1])
    # One array of all times is only needed where a time can have come again.
    nothing = np.empty(0, np.int64)
    whole = whole_of(seen, nothing if rising else np.concatenate(times))
    meta = meta_of(seen, horizontal)
    return UbxEpochs(meta, asked, seen.tally.rows, whole, horizontal, open_chunks)
