"""Several files of one receiver as one recording, in the order of their times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import pandas as pd
from pandas.api.types import union_categoricals

from sbas.findings import Finding
from sbas.recording import EpochSource, Recording, RecordingMeta, with_columns


@dataclass(frozen=True, eq=False)
class Archive:
    """Sources one after the other; what overlaps shows as time going backward in the check."""

    sources: tuple[EpochSource, ...]

    @property
    def meta(self) -> RecordingMeta:
        """The first source's metadata, with the files and findings of all."""
        metas = [source.meta for source in self.sources]
        findings = tuple(chain.from_iterable(m.findings for m in metas))
        return replace(
            metas[0],
            sources=tuple(chain.from_iterable(m.sources for m in metas)),
            findings=(*findings, *_differences(metas)),
        )

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(chain.from_iterable(s.columns for s in self.sources)))

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Batches of every source in turn; see EpochSource."""
        return chain.from_iterable(source.batches(columns) for source in self.sources)


def join_sources(sources: Iterable[EpochSource]) -> EpochSource:
    """One source from several, sorted by their first epoch; a single one is handed on.

    Files of another receiver, frame or level definition than the first are a finding E06.
    """
    found = tuple(sources)
    if len(found) == 1:
        return found[0]
    return Archive(tuple(sorted(found, key=_begin)))


def _begin(source: EpochSource) -> pd.Timestamp:
    """Time of the first epoch; a source without any comes last."""
    firsts = (batch.index[0] for batch in source.batches(()) if len(batch))
    return next(firsts, pd.Timestamp.max)


_SAME = ("receiver", "frame", "height_reference", "antenna", "pl")


def _differences(metas: Sequence[RecordingMeta]) -> Iterator[Finding]:
    """E06 for each property that differs among the files."""
    for name in _SAME:
        values = [getattr(meta, name) for meta in metas]
        if any(value != values[0] for value in values):
            shown = dict.fromkeys(str(value) or "not stated" for value in values)
            yield Finding(
                "E06",
                "error",
                f"the files differ in their {name}: one recording is of one receiver",
                evidence="; ".join(list(shown)[:3]),
                cure="evaluate them apart, or --accept E06 where it is the same receiver",
            )


def joined_recording(recordings: Sequence[Recording]) -> Recording:
    """The epochs and side tables of several recordings in memory, in the order of their times."""
    if len(recordings) == 1:
        return recordings[0]
    parts = sorted(recordings, key=_begin)
    labels = pd.concat([part.table for part in parts])
    for name in ("mode", "environment"):
        if name in labels:
            columns = [with_columns(part.table, (name,))[name] for part in parts]
            labels[name] = union_categoricals([c.array for c in columns])
    sides = {name for part in parts for name in part.side_tables}
    return Recording(
        labels,
        Archive(tuple(parts)).meta,
        {
            name: pd.concat(
                [p.side_tables[name] for p in parts if name in p.side_tables], ignore_index=True
            )
            for name in sorted(sides)
        },
    )
