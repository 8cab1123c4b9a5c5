"""Which events a part counts, on a case small enough to draw."""

from __future__ import annotations

import numpy as np

from sbas.integrity.environments.part_events import events_in
from sbas.integrity.environments.record_part import RecordPart
from sbas.integrity.events import Stretch, find_events, find_runs

S = 1_000_000_000


def part(*rows: tuple[int, int]) -> RecordPart:
    first, stop = np.array(rows, np.int64).T
    return RecordPart(first, stop, first * S, stop * S)


def test_page_case_with_a_border_in_each_place() -> None:
    #            0         10        20        30        40
    # bad:          ###       #        ######          ##
    bad = np.array([3, 4, 5, 13, *range(22, 28), 38, 39])
    runs = find_runs(bad, Stretch(np.arange(60) * S, int(1.5 * S)))
    events = find_events(runs, interval_ns=S, minimum_s=2.0)
    assert (events.start_ns // S).tolist() == [3, 22, 38]
    a, b = part((0, 4), (12, 25), (40, 60)), part((4, 12), (25, 40))
    of_a, of_b = (events_in(runs, events, merge_s=5.0, part=p) for p in (a, b))
    # A run crosses 4 and 25; the one at 13 is too short to be an event.
    assert (of_a.events.start_ns // S).tolist() == [3, 22]
    assert (of_b.events.start_ns // S).tolist() == [3, 22, 38]
    assert of_a.events.duration_s.tolist() == [3, 6]
    assert (of_a.runs, of_b.runs) == (3, 3)
    assert (of_a.within_s, of_b.within_s) == (1 + 3, 2 + 3 + 2)
    # The event at 38 is none of a, but no event can begin in a from 40 to 45.
    assert (of_a.after_others_s, of_b.after_others_s) == (5, 0)
    whole = events_in(runs, events, merge_s=5.0)
    assert (whole.runs, whole.within_s, whole.after_others_s) == (4, 11, 0)


def test_without_runs_there_is_nothing() -> None:
    runs = find_runs(np.empty(0, np.int64), Stretch(np.arange(9) * S, int(1.5 * S)))
    found = events_in(runs, find_events(runs, interval_ns=S), merge_s=60.0, part=part((2, 5)))
    assert (len(found.events), found.runs, found.within_s, found.after_others_s) == (0, 0, 0, 0)
