"""Sentences to epochs: which of them belong together.

An epoch is a stretch of successive position sentences of one time, with each kind at most once:
a kind that comes again opens the next epoch, so that repeated lines and the lines of a second
receiver show as repeated epochs. GST, GBS and ZDA join the epoch of their time, in progress or
the next; GSA, GSV and VTG, which have no time, the one in progress, unless something damaged
lies between: then it could be another's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.logs.nmea.nmea_sentences import NO_DAY, POSITIONS, TIMED, UNTIMED, Columns
from sbas.timescales import NS_PER_S

DAY_NS = 86_400 * NS_PER_S
_MOST_HELD = 1000
"""Sentences of a kind kept of an open epoch; no receiver sends as many."""

UNDATED, WEAK, FOREIGN, OWN = range(4)
"""Where an epoch's date is from: nowhere, an RMC with status V, a ZDA of another time, its own
RMC or ZDA."""

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Epochs:
    """Whole epochs, and the sentences of each.

    Parameters
    ----------
    tod_ns : (n,) time of day [ns].
    day, day_from : (n,) date in days since 1970, `NO_DAY` for none, and where it is from.
    damaged : (n,) whether something unreadable lies in the epoch's stretch.
    row : by kind, the epoch of each sentence.
    columns : by kind, the fields of each sentence.
    unattached : sentences that belong to no epoch.
    other_dates : epochs whose RMC and ZDA tell different dates.
    """

    tod_ns: Ints
    day: Ints
    day_from: NDArray[np.int8]
    damaged: NDArray[np.bool_]
    row: Mapping[str, NDArray[np.intp]]
    columns: Mapping[str, Columns]
    unattached: int = 0
    other_dates: int = 0

    def __len__(self) -> int:
        return len(self.tod_ns)


class Cycles:
    """Takes sentences in file order and hands on the epochs that nothing can join any more."""

    def __init__(self) -> None:
        self._held: dict[str, Columns] = {}
        self._breaks = np.empty(0, np.int64)

    def add(self, columns: Mapping[str, Columns], breaks: Ints, *, last: bool = False) -> Epochs:
        """The epochs that are complete with these sentences.

        Parameters
        ----------
        columns : fields by kind, each kind in file order, all behind those given before.
        breaks : (b,) places of what is damaged, before the last of the sentences.
        last : whether nothing follows.
        """
        now = {
            kind: _joined(self._held.get(kind), columns.get(kind))
            for kind in {**self._held, **columns}
        }
        breaks = np.concatenate([self._breaks, breaks])
        at, row, tod_ns = _rows(now)
        opened = np.concatenate([[True], row[1:] != row[:-1]]) if len(row) else row.astype(bool)
        begin, row_tod = at[opened], tod_ns[opened]
        ready = len(begin) if last else max(len(begin) - 1, 0)
        lost = _drop_early(now, int(begin[0]) if len(begin) else None)
        matched = {kind: _of_time(now[kind], begin, row_tod) for kind in TIMED if kind in now}
        anchors = [at, *(now[kind]["at"][m.same] for kind, m in matched.items())]
        anchor = np.sort(np.concatenate(anchors))
        rows = {kind: _position_rows(now[kind], at, row) for kind in POSITIONS if kind in now}
        rows |= {kind: m.row for kind, m in matched.items()}
        rows |= {
            kind: _in_progress(now[kind], begin, anchor, breaks) for kind in UNTIMED if kind in now
        }
        day, day_from, other_dates = _dates(now, rows, begin, row_tod, ready)
        hit = np.searchsorted(begin, breaks) - 1
        damaged = np.zeros(len(begin) + 1, np.bool_)
        damaged[hit] = True
        hold_from = int(begin[ready]) if ready < len(begin) else None
        self._breaks = breaks[breaks >= hold_from] if hold_from is not None else breaks[:0]
        self._held, kept = {}, {}
        for kind, fields in now.items():
            to = rows[kind]
            later = to >= ready if hold_from is not None else np.zeros(len(to), np.bool_)
            if kind in TIMED and not last:
                later |= (to < 0) & (_stretch(fields, begin) >= ready)
            if kind != "ZDA":
                lost += int(np.count_nonzero((to < 0) & ~later))
            if later.any():
                self._held[kind] = _chosen(fields, np.flatnonzero(later)[:_MOST_HELD])
            kept[kind] = np.flatnonzero((to >= 0) & (to < ready))
        return Epochs(
            row_tod[:ready],
            day,
            day_from,
            damaged[:ready],
            {kind: rows[kind][index] for kind, index in kept.items()},
            {kind: _chosen(now[kind], index) for kind, index in kept.items()},
            lost,
            other_dates,
        )


def _stretch(fields: Columns, begin: Ints) -> Ints:
    """Epoch in progress at each sentence; the first epoch for those before it."""
    return np.maximum(np.searchsorted(begin, fields["at"]) - 1, 0)


def _joined(first: Columns | None, second: Columns | None) -> Columns:
    if first is None or second is None:
        return first or second or {}
    return {name: np.concatenate([first[name], second[name]]) for name in first}


def _chosen(fields: Columns, rows: Any) -> Columns:
    return {name: values[rows] for name, values in fields.items()}


def _rows(now: Mapping[str, Columns]) -> tuple[Ints, Ints, Ints]:
    """Place, epoch and time of day of all position sentences, in file order."""
    kinds = [kind for kind in POSITIONS if kind in now]
    if not kinds:
        nothing = np.empty(0, np.int64)
        return nothing, nothing, nothing
    at = np.concatenate([now[kind]["at"] for kind in kinds])
    tod_ns = np.concatenate([now[kind]["tod_ns"] for kind in kinds])
    code = np.repeat(np.arange(len(kinds)), [len(now[kind]["at"]) for kind in kinds])
    order = np.argsort(at, kind="stable")
    at, tod_ns, code = at[order], tod_ns[order], code[order]
    opens = np.ones(len(at), np.bool_)
    opens[1:] = tod_ns[1:] != tod_ns[:-1]
    stretch = np.cumsum(opens) - 1
    key = stretch * len(kinds) + code
    times = np.bincount(key)
    repeated = np.unique(np.flatnonzero(times > 1) // len(kinds))
    # Rare (repeated lines, two receivers, a clock that stands): each cut depends on the last.
    bounds = np.searchsorted(stretch, [repeated, repeated + 1])
    for low, high in bounds.T.tolist():
        seen: set[int] = set()
        for i, kind_code in enumerate(code[low:high].tolist(), low):
            if kind_code in seen:
                opens[i] = True
                seen.clear()
            seen.add(kind_code)
    return at, np.cumsum(opens) - 1, tod_ns


def _position_rows(fields: Columns, at: Ints, row: Ints) -> Ints:
    return row[np.searchsorted(at, fields["at"])]


@dataclass(frozen=True)
class _Matched:
    """Epoch of each timed sentence (-1 none), and whether it is the one in progress."""

    row: Ints
    same: NDArray[np.bool_]


def _of_time(fields: Columns, begin: Ints, row_tod: Ints) -> _Matched:
    n = len(fields["at"])
    if not len(begin):
        return _Matched(np.full(n, -1), np.zeros(n, np.bool_))
    before = np.searchsorted(begin, fields["at"]) - 1
    following = np.minimum(before + 1, len(begin) - 1)
    same = (before >= 0) & (row_tod[before] == fields["tod_ns"])
    coming = (following > before) & (row_tod[following] == fields["tod_ns"])
    return _Matched(np.where(same, before, np.where(coming, following, -1)), same)


def _in_progress(fields: Columns, begin: Ints, anchor: Ints, breaks: Ints) -> Ints:
    """Epoch in progress at each untimed sentence; -1 where damage makes that doubtful."""
    at = fields["at"]
    row = np.searchsorted(begin, at) - 1
    if len(breaks) and len(anchor):
        since = anchor[np.maximum(np.searchsorted(anchor, at) - 1, 0)]
        row[np.searchsorted(breaks, at) != np.searchsorted(breaks, since)] = -1
    return row


def _drop_early(now: dict[str, Columns], first: int | None) -> int:
    """Of the timed sentences before the first epoch keep those of the last time; count the rest."""
    early = {}
    for kind in TIMED:
        if kind in now:
            at = now[kind]["at"]
            early[kind] = len(at) if first is None else int(np.searchsorted(at, first))
    at = np.concatenate([[-1], *(now[kind]["at"][:n] for kind, n in early.items())])
    tod = np.concatenate([[-1], *(now[kind]["tod_ns"][:n] for kind, n in early.items())])
    order = np.argsort(at, kind="stable")
    other = np.flatnonzero(tod[order] != tod[order[-1]])
    begin = at[order[other[-1]]] if len(other) else -1
    lost = 0
    for kind, n in early.items():
        drop = np.flatnonzero(now[kind]["at"][:n] <= begin)
        lost += len(drop)
        now[kind] = {name: values[len(drop) :] for name, values in now[kind].items()}
    return lost


def _dates(
    now: Mapping[str, Columns], rows: Mapping[str, Ints], begin: Ints, row_tod: Ints, ready: int
) -> tuple[Ints, NDArray[np.int8], int]:
    """Date of each ready epoch, where it is from, and how many have two dates.

    A ZDA of no epoch's time dates the one in progress, which midnight may part from it.
    """
    n = len(row_tod)
    day = np.full(n, NO_DAY, np.int64)
    origin = np.full(n, UNDATED, np.int8)
    other_dates = 0
    if n and "RMC" in now:
        dated = np.flatnonzero(now["RMC"]["day"] != NO_DAY)
        to = rows["RMC"][dated]
        day[to] = now["RMC"]["day"][dated]
        origin[to] = np.where(now["RMC"]["valid"][dated], OWN, WEAK)
    if n and "ZDA" in now:
        fields = now["ZDA"]
        own = rows["ZDA"] >= 0
        # The first of several in an epoch counts, hence backward.
        for chosen, kind in ((~own, FOREIGN), (own, OWN)):
            dated = np.flatnonzero(chosen & (fields["day"] != NO_DAY))[::-1]
            to = (rows["ZDA"] if kind == OWN else _stretch(fields, begin))[dated]
            told = fields["day"][dated]
            if kind == OWN:
                clash = (origin[to] == OWN) & (day[to] != told) & (to < ready)
                other_dates = len(np.unique(to[clash]))
            else:
                later_ns = fields["tod_ns"][dated] - row_tod[to]
                told = told - (later_ns < -DAY_NS // 2) + (later_ns > DAY_NS // 2)
                free = origin[to] < FOREIGN
                to, told = to[free], told[free]
            day[to], origin[to] = told, kind
    return day[:ready], origin[:ready], other_dates
