"""Several files of one receiver as one recording, in the order of their times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import numpy as np
import pandas as pd
from pandas.api.types import union_categoricals

from sbas.findings import Finding
from sbas.recording import (
    COLUMNS,
    EpochSource,
    ProtectionLevelMeta,
    Recording,
    RecordingMeta,
    with_columns,
)


@dataclass(frozen=True, eq=False)
class Archive:
    """Sources one after the other, in the order of their first epochs.

    `meta` is the first source's, with the files and findings of all. What overlaps is a finding,
    and shows as time going backward in the check.
    """

    sources: tuple[EpochSource, ...]
    meta: RecordingMeta

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(chain.from_iterable(s.columns for s in self.sources)))

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """Batches of every source in turn; see EpochSource."""
        return chain.from_iterable(source.batches(columns) for source in self.sources)


@dataclass(frozen=True, eq=False)
class _Part:
    """A source with its smallest and largest time [ns]; None where it has no epoch."""

    source: EpochSource
    begin_ns: int | None
    end_ns: int | None

    @property
    def name(self) -> str:
        return self.source.meta.sources[-1].path if self.source.meta.sources else "a recording"


def join_sources(sources: Iterable[EpochSource]) -> EpochSource:
    """One source from several, sorted by their first epoch; a single one is handed on.

    Files of another receiver, frame or level definition than the first, and files that overlap
    in time, are a finding E06; levels of another kind or stated risk are E23, which nobody can
    accept.
    """
    found = tuple(sources)
    if len(found) == 1:
        return found[0]
    parts = _in_order(found)
    return Archive(tuple(part.source for part in parts), _meta(parts))


def _in_order(sources: Sequence[EpochSource]) -> list[_Part]:
    """The sources by their first epoch; those without any come last."""
    parts = []
    for source in sources:
        spans = [
            (int(ns[0]), int(ns.min()), int(ns.max()))
            for batch in source.batches(())
            if len(ns := batch.index.to_numpy().astype(np.int64))
        ]
        begin = min((span[1] for span in spans), default=None)
        end = max((span[2] for span in spans), default=None)
        first = spans[0][0] if spans else np.iinfo(np.int64).max
        parts.append((first, _Part(source, begin, end)))
    return [part for _, part in sorted(parts, key=lambda entry: entry[0])]


def _meta(parts: Sequence[_Part]) -> RecordingMeta:
    metas = [part.source.meta for part in parts]
    # Of a file without epochs nothing is evaluated; what it says of levels may be missing.
    known = [part for part in parts if part.begin_ns is not None] or list(parts)
    return replace(
        metas[0],
        sources=tuple(chain.from_iterable(m.sources for m in metas)),
        options=_shared_options([part.source.meta for part in known]),
        findings=(
            *chain.from_iterable(m.findings for m in metas),
            *_differences(known),
            *_overlaps(known),
        ),
    )


def _shared_options(metas: Sequence[RecordingMeta]) -> dict[str, str]:
    """What was done alike to all parts: what was done to one of them is not true of the whole."""
    first = metas[0].options
    return {
        key: value
        for key, value in first.items()
        if all(key in m.options and m.options[key] == value for m in metas)
    }


_SAME = ("receiver", "frame", "height_reference", "antenna")
_IN_WORDS = {
    **{name: name.replace("_", " ") for name in _SAME},
    "pl": "protection levels",
}


def _differences(parts: Sequence[_Part]) -> Iterator[Finding]:
    """E06 for each property that differs among the files; E23 for levels of two kinds."""
    metas = [part.source.meta for part in parts]
    names: tuple[str, ...] = _SAME
    if never_pooled(metas):
        shown = {
            f"{m.pl.kind}, {_risk(m)}": part.name for m, part in zip(metas, parts, strict=True)
        }
        yield Finding(
            "E23",
            "error",
            "the files hold protection levels of different kinds or stated risks, which are "
            "never pooled",
            evidence="; ".join(f"{kind}: {name}" for kind, name in list(shown.items())[:3]),
            cure="evaluate the files of each kind apart",
        )
    else:
        names += ("pl",)
    for name in names:
        values = [getattr(meta, name) for meta in metas]
        if any(value != values[0] for value in values):
            words = map(_levels_in_words if name == "pl" else str, values)
            different = dict.fromkeys(word or "not stated" for word in words)
            yield Finding(
                "E06",
                "error",
                f"the files differ in their {_IN_WORDS[name]}: one recording is of one receiver",
                evidence="; ".join(list(different)[:3]),
                cure="evaluate them apart, or --accept E06 where it is the same receiver",
            )


def never_pooled(metas: Iterable[RecordingMeta]) -> bool:
    """Whether levels differ in kind or in stated risk.

    A kind that is not known may be any but `tmir`: those levels state a risk of their own.
    """
    levels = [meta.pl for meta in metas]
    kinds = {pl.kind for pl in levels}
    risks = {(pl.risk, pl.risk_per) for pl in levels if pl.risk is not None}
    return len(risks) > 1 or len(kinds - {"unknown"}) > 1 or ("tmir" in kinds and len(kinds) > 1)


def _levels_in_words(pl: ProtectionLevelMeta) -> str:
    factors = [("K_H", pl.k_h), ("K_V", pl.k_v)]
    known = [f"{name} {k:g}" for name, k in factors if k is not None]
    return f"kind {pl.kind}, {' and '.join(known) or 'K not stated'}"


def _risk(meta: RecordingMeta) -> str:
    return "risk not stated" if meta.pl.risk is None else f"{meta.pl.risk:g} {meta.pl.risk_per}"


def _overlaps(parts: Sequence[_Part]) -> Iterator[Finding]:
    """E06 where a file begins before an earlier one ends: sorted, their epochs would mix."""
    ends = np.maximum.accumulate([part.end_ns or 0 for part in parts])
    overlapping = [
        (earlier, later)
        for (earlier, later), end in zip(pairwise(parts), ends, strict=False)
        if later.begin_ns is not None and later.begin_ns < end
    ]
    if overlapping:
        earlier, later = overlapping[0]
        yield Finding(
            "E06",
            "error",
            f"{len(overlapping):,} of {len(parts):,} files overlap an earlier one in time: "
            "epochs of two files would mix",
            where=later.name,
            evidence=f"it begins {np.datetime64(later.begin_ns, 'ns')}, before the end of "
            f"{earlier.name} or of one before that",
            cure="give one of them; or, where both are of the same receiver, "
            "--sort --duplicates first --accept E06",
        )


def joined_recording(recordings: Sequence[Recording]) -> Recording:
    """The epochs and side tables of several recordings in memory, in the order of their times."""
    if len(recordings) == 1:
        return recordings[0]
    parts = _in_order(recordings)
    ordered = [part.source for part in parts if isinstance(part.source, Recording)]
    documented = dict.fromkeys(n for part in ordered for n in part.table if n in COLUMNS)
    tables = []
    for part in ordered:
        further = [name for name in part.table if name not in COLUMNS]
        tables.append(with_columns(part.table, [*documented, *further]))
    labels = pd.concat(tables)
    for name in ("mode", "environment"):
        if name in labels:
            labels[name] = union_categoricals([_named(table[name].array) for table in tables])
    sides = {name for part in ordered for name in part.side_tables}
    return Recording(
        labels,
        _meta(parts),
        {
            name: pd.concat(
                [p.side_tables[name] for p in ordered if name in p.side_tables], ignore_index=True
            )
            for name in sorted(sides)
        },
    )


def _named(column: pd.Categorical) -> pd.Categorical:
    """The column; without any category, those are text too, as union_categoricals demands."""
    if len(column.categories):
        return column
    return pd.Categorical.from_codes(column.codes, pd.Index([], dtype="str"))
