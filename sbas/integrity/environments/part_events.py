"""Events of a part of a record: which of the record's events it counts, and their time in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sbas.integrity.environments.record_part import RecordPart
from sbas.integrity.events import Events, Runs
from sbas.timescales import NS_PER_S


@dataclass(frozen=True, eq=False)
class PartEvents:
    """What a part of a record has of its events.

    Parameters
    ----------
    events : events of the record with a bad epoch in the part, whole as they are.
    runs : runs of bad epochs, merged to events or not, with an epoch in the part.
    within_s : time of the part within any event of the record [s].
    after_others_s : time of the part within the merge time after events that it does not count
        [s]: none can begin there, and their own parts take off the merge time in full.
    """

    events: Events
    runs: int
    within_s: float
    after_others_s: float


def events_in(
    runs: Runs, events: Events, *, merge_s: float, part: RecordPart | None = None
) -> PartEvents:
    """The events that a part of a record counts.

    Parameters
    ----------
    runs : runs of bad epochs of the whole record.
    events : events that `find_events` made of them.
    merge_s : merge time of these events [s].
    part : None for the whole record.

    Notes
    -----
    Runs are merged, and held against the time to alert, over the whole record: a border between
    two parts neither ends an event nor makes it shorter. An event counts in every part in which
    one of its bad epochs lies, so that the sum over all parts is never below the record's count.
    """
    if part is None or len(runs) == 0:
        return PartEvents(events, len(runs), float(events.duration_s.sum()), 0.0)
    here = part.rows_between(runs.first, runs.last + 1) > 0
    counted = np.zeros(len(events), bool)
    if len(events):
        event = np.searchsorted(events.start_ns, runs.start_ns, side="right") - 1
        # A run before the first event, or after the end of one, was too short to be one.
        lasting = (event >= 0) & (runs.start_ns < events.end_ns[event])
        counted[event[here & lasting]] = True
    within = part.ns_between(events.start_ns, events.end_ns) / NS_PER_S
    after = events.end_ns[~counted]
    others = part.ns_between(after, after + round(merge_s * NS_PER_S)) / NS_PER_S
    own = Events(events.start_ns[counted], events.end_ns[counted], events.censored[counted])
    return PartEvents(own, int(here.sum()), float(within.sum()), float(others.sum()))
