"""Several files of one receiver as one recording, in the order of their times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import pandas as pd

from sbas.recording import EpochSource, Recording, RecordingMeta


@dataclass(frozen=True, eq=False)
class Archive:
    """Sources one after the other; what overlaps shows as time going backward in the check."""

    sources: tuple[EpochSource, ...]

    @property
    def meta(self) -> RecordingMeta:
        """The first source's metadata, with the files and findings of all."""
        metas = [source.meta for source in self.sources]
        return replace(
            metas[0],
            sources=tuple(chain.from_iterable(m.sources for m in metas)),
            findings=tuple(chain.from_iterable(m.findings for m in metas)),
        )

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(chain.from_iterable(s.columns for s in self.sources)))

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Batches of every source in turn; see EpochSource."""
        return chain.from_iterable(source.batches(columns) for source in self.sources)


def join_sources(sources: Iterable[EpochSource]) -> EpochSource:
    """One source from several, sorted by their first epoch; a single one is handed on."""
    found = tuple(sources)
    if len(found) == 1:
        return found[0]
    return Archive(tuple(sorted(found, key=_begin)))


def _begin(source: EpochSource) -> pd.Timestamp:
    """Time of the first epoch; a source without any comes last."""
    firsts = (batch.index[0] for batch in source.batches(()) if len(batch))
    return next(firsts, pd.Timestamp.max)


def gathered(source: EpochSource) -> Recording:
    """All epochs of a source in memory."""
    if isinstance(source, Recording):
        return source
    table = pd.concat(list(source.batches(source.columns)))
    return Recording(table, source.meta)
