"""Events: the method page's exact cases, and joining as if a record had never been cut."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.integrity.events import Runs, Stretch, find_events, find_runs, join_runs

S = 1_000_000_000


def runs_of(bad: np.ndarray, time_s: np.ndarray, judged: np.ndarray | None = None) -> Runs:
    stretch = Stretch(time_s.astype(np.int64) * S, int(1.5 * S))
    return find_runs(np.flatnonzero(bad), stretch, judged)


@pytest.mark.parametrize(
    ("merge", "minimum", "expected"),
    [
        (0, 0, [(3, 6), (10, 11), (12, 14), (30, 37)]),
        (3, 0, [(3, 6), (10, 14), (30, 37)]),
        (3, 6, [(30, 37)]),
    ],
)
def test_page_case_bad_3_to_5_10_12_13_30_to_36(
    merge: int, minimum: int, expected: list[tuple[int, int]]
) -> None:
    bad = np.zeros(40, bool)
    bad[[3, 4, 5, 10, 12, 13, *range(30, 37)]] = True
    events = find_events(
        runs_of(bad, np.arange(40)), interval_ns=S, merge_s=merge, minimum_s=minimum
    )
    spans = zip(events.start_ns // S, events.end_ns // S, strict=True)
    assert [(int(a), int(b)) for a, b in spans] == expected
    assert not events.censored.any()


def test_a_gap_ends_a_run_and_censors_both_sides() -> None:
    time = np.array([0, 1, 2, 10, 11, 12])
    bad = np.array([0, 1, 1, 1, 0, 0], bool)
    events = find_events(runs_of(bad, time), interval_ns=S)
    assert len(events) == 2
    assert events.censored.all()


def test_a_censored_event_is_kept_though_shorter_than_the_time_to_alert() -> None:
    bad = np.array([1, 0, 0, 1, 0, 0, 0], bool)
    events = find_events(runs_of(bad, np.arange(7)), interval_ns=S, minimum_s=6)
    assert events.start_ns.tolist() == [0]
    assert events.censored.tolist() == [True]


def test_an_epoch_that_cannot_be_judged_censors_its_neighbour() -> None:
    bad = np.array([0, 1, 1, 0, 0], bool)
    judged = np.array([1, 1, 1, 0, 1], bool)
    assert runs_of(bad, np.arange(5), judged).cut_end.tolist() == [True]


@given(
    st.lists(st.tuples(st.booleans(), st.booleans(), st.integers(1, 3)), min_size=1, max_size=60),
    st.sets(st.integers(1, 59)),
)
def test_cutting_a_record_anywhere_changes_nothing(
    epochs: list[tuple[bool, bool, int]], cuts: set[int]
) -> None:
    judged = np.array([e[1] for e in epochs])
    bad = np.array([e[0] for e in epochs]) & judged
    time = np.cumsum([e[2] for e in epochs])
    whole = runs_of(bad, time, judged)
    borders = sorted(c for c in cuts if c < len(epochs))
    pieces = [
        runs_of(b, t, j)
        for b, t, j in zip(
            np.split(bad, borders), np.split(time, borders), np.split(judged, borders), strict=True
        )
    ]
    joined = reduce(join_runs, pieces)
    for name in ("first", "last", "start_ns", "last_ns", "cut_start", "cut_end"):
        assert getattr(joined, name).tolist() == getattr(whole, name).tolist(), name
    assert (joined.rows, joined.begin_ns, joined.end_ns) == (
        whole.rows,
        whole.begin_ns,
        whole.end_ns,
    )


@given(st.lists(st.booleans(), min_size=1, max_size=80))
def test_runs_cover_just_the_bad_epochs(bad: list[bool]) -> None:
    runs = runs_of(np.array(bad), np.arange(len(bad)))
    covered = np.zeros(len(bad), bool)
    for first, last in zip(runs.first, runs.last, strict=True):
        covered[first : last + 1] = True
    assert covered.tolist() == bad
