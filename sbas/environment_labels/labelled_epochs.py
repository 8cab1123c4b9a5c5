"""A source whose epochs get their environment label as they pass."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.environment_labels.segments import EnvironmentSegments
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.recording import EpochSource, Recording, RecordingMeta
from sbas.timescales import NS_PER_S
from sbas.track import Track, TrackLine
from sbas.truth import FixedPoint, Trajectory, Truth

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Numbers = Floats | Ints

MOST_BRIDGED_S = 1800.0
"""Without a place on the track for longer, the train may have gone anywhere."""


@overload
def label_epochs(
    source: Recording, segments: EnvironmentSegments, *, track: Track | None = None,
    truth: Truth | None = None,
) -> Recording: ...  # fmt: skip
@overload
def label_epochs(
    source: EpochSource, segments: EnvironmentSegments, *, track: Track | None = None,
    truth: Truth | None = None,
) -> EpochSource: ...  # fmt: skip
def label_epochs(
    source: EpochSource,
    segments: EnvironmentSegments,
    *,
    track: Track | None = None,
    truth: Truth | None = None,
) -> EpochSource:
    """The source with the column `environment` from segments.

    Parameters
    ----------
    source : a Recording, or a source of `sbas.scan`, which goes on streaming.
    segments : by time, or by distance along the track.
    track : the centre line; needed by distance, unless the truth is one.
    truth : where the antenna was; then labels do not depend on the errors that they sort.

    Returns
    -------
    A Recording of a Recording, else a view that labels batch by batch. Labels that the source
    had are replaced, which a finding says.

    Raises
    ------
    InputError : segments by distance without a track, or of other tracks only.

    Notes
    -----
    By distance an epoch lies at its true place on the track, and where the truth does not reach
    at its recorded one. Without a position, or off the track, it lies at a place interpolated in
    time between the epochs before and after, if these are on the same part of the track and at
    most `MOST_BRIDGED_S` apart: a receiver without a fix in a tunnel is in the tunnel.
    """
    if track is None and isinstance(truth, TrackLine):
        track = truth.track
    if not segments.by_distance:
        view = _Labelled(source, segments, segments.lookup(), None, None)
    elif track is None:
        raise InputError(
            "segments by distance need the track", cure="label_epochs(..., track=Track(...))"
        )
    else:
        view = _Labelled(source, segments, segments.lookup(track.track_id), track, truth)
    if not isinstance(source, Recording):
        return view
    codes = [batch["environment"].cat.codes for batch in view.batches(("environment",))]
    labels = pd.Categorical.from_codes(np.concatenate(codes), categories=list(segments.labels))
    return replace(source, table=source.table.assign(environment=labels), meta=view.meta)


_POSITION = ("lat_deg", "lon_deg", "height_m")


@dataclass(frozen=True, eq=False)
class _Labelled:
    """A source whose epochs are labelled as they pass."""

    source: EpochSource
    segments: EnvironmentSegments
    codes: Callable[[Numbers], Ints]
    track: Track | None
    truth: Truth | None

    @property
    def meta(self) -> RecordingMeta:
        meta = self.source.meta
        how = str(self.segments)
        if self.track is not None:
            how += f"; {self.track.label}"
        findings = meta.findings
        if "environment" in self.source.columns:
            said = Finding(
                "E26", "info", "the recording's own environment labels were replaced",
                evidence=how,
            )  # fmt: skip
            findings = (*findings, said)
        return replace(meta, findings=findings, options={**meta.options, "environment": how})

    @property
    def columns(self) -> tuple[str, ...]:
        own = [name for name in self.source.columns if name != "environment"]
        return (*own, "environment")

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        """See EpochSource."""
        if "environment" not in columns:
            yield from self.source.batches(columns)
            return
        own = [name for name in columns if name != "environment"]
        if self.track is None:
            for batch in self.source.batches(own):
                yield self._with(batch, batch.index.to_numpy().astype(np.int64), columns)
            return
        positions = self.source.batches(list(dict.fromkeys((*own, *_POSITION))))
        for batch, distance_m in _bridged((b, *self._places(b)) for b in positions):
            yield self._with(batch, distance_m, columns)

    def _with(self, batch: pd.DataFrame, at: Numbers, columns: Sequence[str]) -> pd.DataFrame:
        labels = pd.Categorical.from_codes(self.codes(at), categories=list(self.segments.labels))
        return batch.assign(environment=labels)[list(columns)]

    def _places(self, batch: pd.DataFrame) -> tuple[Floats, Ints]:
        """(n,) distance along the track [m], NaN off it, and the part of the track."""
        assert self.track is not None
        recorded = [batch[name].to_numpy() for name in _POSITION]
        # A truth that is a track itself does not tell the place along it.
        if isinstance(self.truth, FixedPoint | Trajectory):
            true = self.truth.at(batch.index.to_numpy())
            known = np.isfinite(true.lat_deg)
            places = (true.lat_deg, true.lon_deg, true.height_m)
            recorded = [np.where(known, t, r) for t, r in zip(places, recorded, strict=True)]
        found = self.track.project(*recorded)
        return found.distance_m, found.part


def _bridged(
    batches: Iterable[tuple[pd.DataFrame, Floats, Ints]],
) -> Iterator[tuple[pd.DataFrame, Floats]]:
    """Batches with their distances, completed; one waits only while its end may be bridged."""
    held: list[pd.DataFrame] = []
    # Of the held epochs, after the last one before them that has a place.
    time, distance_m, part = np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64)
    done = 0
    completed = distance_m
    for batch, more_m, more_part in batches:
        held.append(batch)
        time = np.concatenate([time, batch.index.to_numpy().astype(np.int64)])
        distance_m = np.concatenate([distance_m, more_m])
        part = np.concatenate([part, more_part])
        completed = _completed(time, distance_m, part)
        known = np.flatnonzero(np.isfinite(distance_m))
        last = int(known[-1]) if known.size else -1
        waits = 0 <= last < time.size - 1 and time[-1] - time[last] <= _BRIDGED_NS
        while held and not (waits and done + len(held[0]) > last + 1):
            stop = done + len(held[0])
            yield held.pop(0), completed[done:stop]
            done = stop
        before = known[known < done][-1:]
        keep = np.concatenate([before, np.arange(done, time.size)])
        time, distance_m, part = time[keep], distance_m[keep], part[keep]
        completed, done = completed[keep], before.size
    for batch in held:
        yield batch, completed[done : done + len(batch)]
        done += len(batch)


_BRIDGED_NS = int(MOST_BRIDGED_S * NS_PER_S)


def _completed(time_ns: Ints, distance_m: Floats, part: Ints) -> Floats:
    """(n,) distances [m] with those interpolated in time that lie between two of one part."""
    known = np.flatnonzero(np.isfinite(distance_m))
    missing = np.flatnonzero(~np.isfinite(distance_m))
    after = np.searchsorted(known, missing)
    within = (after > 0) & (after < known.size)
    missing, after = missing[within], after[within]
    left, right = known[after - 1], known[after]
    step_ns = time_ns[right] - time_ns[left]
    usable = (part[left] == part[right]) & (step_ns > 0) & (step_ns <= _BRIDGED_NS)
    missing, left, right, step_ns = (a[usable] for a in (missing, left, right, step_ns))
    share = (time_ns[missing] - time_ns[left]) / step_ns
    result = distance_m.copy()
    result[missing] = distance_m[left] + share * (distance_m[right] - distance_m[left])
    return result
