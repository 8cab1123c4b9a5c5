"""Messages of one navigation epoch belong together: runs of equal time of week in file order.

A receiver sends all NAV messages of an epoch before those of the next, so an epoch is a run of
messages with one time of week; a run in which a kind comes again is split there, so that no row
mixes values of two. Only the last run of a chunk is open, and is handed on to the next: memory
stays bounded, and the size of chunks changes nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sbas.logs.ublox import ubx_messages as ubx
from sbas.logs.ublox.ubx_messages import MESSAGES, Raw
from sbas.logs.ublox.ubx_times import WEEK_MS, Anchors, week_near

KINDS = (
    ubx.NAV_PVT, ubx.NAV_DOP, ubx.NAV_COV, ubx.NAV_PL, ubx.NAV_SBAS, ubx.NAV_EOE, ubx.NAV_TIMEGPS,
)  # fmt: skip
"""Messages that an epoch consists of; bit k of `Rows.cover` says whether it has KINDS[k]."""
MAKING_ROWS = (ubx.NAV_PVT, ubx.NAV_DOP, ubx.NAV_COV, ubx.NAV_PL)
"""Those of which any one makes a row of the epoch table."""
_NEAR_MS = 3_600_000
"""A time of week takes the week of an anchor only this near to it."""

Index = NDArray[np.int64]


@dataclass(frozen=True)
class Open:
    """What is handed on from chunk to chunk: the messages of the last run, and the last anchors.

    Two anchors are enough: the last before that run, and the last of all.
    """

    raw: Mapping[int, Raw] = field(default_factory=dict)
    anchors: Anchors = field(default_factory=Anchors.none)


@dataclass(frozen=True)
class Rows:
    """Rows of the epoch table, and the messages that they consist of.

    Parameters
    ----------
    time_ms : (rows,) GPS time since 1980-01-06 [ms].
    inferred : (rows,) whether the week is that of an earlier message.
    cover : (rows,) bits of the kinds of message that each row has.
    raw : fields by kind of message, those of messages without a row left out.
    row_of : row of each message by kind; None where message i is row i.
    without_time : messages left out for want of a time, by name.
    disagreeing : rows whose NAV-TIMEGPS and NAV-PVT state different weeks.
    """

    time_ms: Index
    inferred: NDArray[np.bool_]
    cover: NDArray[np.uint8]
    raw: Mapping[int, Raw]
    row_of: Mapping[int, Index | None]
    without_time: Counter[str]
    disagreeing: int


def assemble(
    held: Open, new: Mapping[int, Raw], anchors: Anchors, *, final: bool
) -> tuple[Rows, Open]:
    """Rows that are complete, and what to hand on.

    Parameters
    ----------
    held : what the chunk before handed on.
    new : fields of the messages of this chunk by kind, those of `KINDS`, with `itow_ms`; of
        NAV-PVT and NAV-TIMEGPS with `time_ms`, -1 where unknown.
    anchors : messages of this chunk that state their whole time.
    final : whether this is the end of the file.
    """
    known = held.anchors.joined(anchors)
    kinds = [key for key in KINDS if key in held.raw or key in new]
    raw = {key: _joined(held.raw.get(key), new.get(key)) for key in kinds}
    sizes = [len(raw[key]["position"]) for key in kinds]
    if not sum(sizes):
        return _rows({}, [], [], np.empty(0, np.int64), known), Open({}, _last(known, None))
    position = np.concatenate([raw[key]["position"] for key in kinds])
    order = np.argsort(position, kind="stable")
    kind = np.repeat(np.arange(len(kinds), dtype=np.int8), sizes)[order]
    itow = np.concatenate([raw[key]["itow_ms"] for key in kinds])[order]
    run = _runs(itow, kind, kinds.index(ubx.NAV_EOE) if ubx.NAV_EOE in kinds else -1)
    run_of_message = np.empty(len(run), np.int64)
    run_of_message[order] = run
    runs = np.split(run_of_message, np.cumsum(sizes)[:-1])
    start = position[order][np.flatnonzero(np.diff(run, prepend=-1))]
    if final:
        return _rows(raw, kinds, runs, start, known), Open({}, _last(known, None))
    last = len(start) - 1
    carried, closed = {}, {}
    for key, of_kind in zip(kinds, runs, strict=True):
        cut = int(np.searchsorted(of_kind, last))
        closed[key] = {name: values[:cut] for name, values in raw[key].items()}
        if cut < len(of_kind):
            # A copy, for a slice would keep the whole chunk in memory.
            carried[key] = {name: values[cut:].copy() for name, values in raw[key].items()}
    rows = _rows(closed, kinds, [of_kind[of_kind < last] for of_kind in runs], start[:-1], known)
    return rows, Open(carried, _last(known, int(start[-1])))


def _joined(held: Raw | None, new: Raw | None) -> Raw:
    if held is None or new is None:
        return held if new is None else new  # type: ignore[return-value]
    return {name: np.concatenate([held[name], new[name]]) for name in new}


def _last(anchors: Anchors, run_start: int | None) -> Anchors:
    """The last anchor, and the last before the open run."""
    keep = {len(anchors.position) - 1}
    if run_start is not None:
        keep.add(int(np.searchsorted(anchors.position, run_start)) - 1)
    index = np.array(sorted(keep - {-1}), np.int64)
    return Anchors(anchors.position[index], anchors.time_ms[index])


def _runs(itow: NDArray[np.uint32], kind: NDArray[np.int8], closing: int) -> Index:
    """(n,) number of the run of each message in file order; NAV-EOE closes one, too."""
    begins = np.ones(len(itow), np.bool_)
    np.not_equal(itow[1:], itow[:-1], out=begins[1:])
    begins[1:] |= kind[:-1] == closing
    run = np.cumsum(begins) - 1
    again: set[int] = set()
    for code in range(int(kind.max()) + 1):
        of_kind = run[kind == code]
        again.update(of_kind[1:][of_kind[1:] == of_kind[:-1]].tolist())
    # Only runs with repeats are walked; they are as rare as two logs joined to one file.
    for low in np.searchsorted(run, sorted(again)).tolist():
        seen: set[int] = set()
        for i in range(low, len(run)):
            if run[i] != run[low]:
                break
            if (code := int(kind[i])) in seen:
                begins[i] = True
                seen.clear()
            seen.add(code)
    return np.cumsum(begins) - 1 if again else run


def _rows(
    raw: Mapping[int, Raw], kinds: list[int], runs: list[Index], start: Index, anchors: Anchors
) -> Rows:
    """Rows of closed runs: their times, and which messages they consist of."""
    count = len(start)
    makes_row = np.zeros(count, np.bool_)
    time_ms = np.full(count, -1, np.int64)
    itow = np.zeros(count, np.int64)
    cover = np.zeros(count, np.uint8)
    run_of = dict(zip(kinds, runs, strict=True))
    for key, of_kind in run_of.items():
        cover[of_kind] |= np.uint8(1 << KINDS.index(key))
        if key in MAKING_ROWS:
            makes_row[of_kind] = True
            itow[of_kind] = raw[key]["itow_ms"]
    disagreeing = 0
    if ubx.NAV_PVT in run_of:
        time_ms[run_of[ubx.NAV_PVT]] = raw[ubx.NAV_PVT]["time_ms"]
    if ubx.NAV_TIMEGPS in run_of:
        of_kind, stated = run_of[ubx.NAV_TIMEGPS], raw[ubx.NAV_TIMEGPS]["time_ms"]
        usable = stated >= 0
        of_kind, stated = of_kind[usable], stated[usable]
        disagreeing = int(np.count_nonzero((time_ms[of_kind] >= 0) & (time_ms[of_kind] != stated)))
        time_ms[of_kind] = stated
    # A NAV-PVT that knows no time says that the receiver has none; then no other gives it.
    open_ = makes_row & (time_ms < 0) & ((cover & 1) == 0) & (itow < WEEK_MS)
    inferred = np.zeros(count, np.bool_)
    if open_.any():
        near = anchors.before(start[open_])
        time = week_near(itow[open_], near) * WEEK_MS + itow[open_]
        usable = (near >= 0) & (np.abs(time - near) <= _NEAR_MS)
        time_ms[open_] = np.where(usable, time, -1)
        inferred[open_] = usable
    is_row = makes_row & (time_ms >= 0)
    without_time: Counter[str] = Counter()
    if is_row.all():
        kept, rows_of = dict(raw), run_of
    else:
        number = np.where(is_row, np.cumsum(is_row) - 1, -1)
        kept, rows_of = {}, {}
        for key, of_kind in run_of.items():
            if key in MAKING_ROWS and (lost := int((~is_row[of_kind]).sum())):
                without_time[MESSAGES[key].name] = lost
            use = is_row[of_kind]
            kept[key] = {name: values[use] for name, values in raw[key].items()}
            rows_of[key] = number[of_kind[use]]
        time_ms, inferred, cover = time_ms[is_row], inferred[is_row], cover[is_row]
    rows = len(time_ms)
    return Rows(
        time_ms,
        inferred,
        cover,
        kept,
        # Within a kind runs only rise: as many messages as rows are one in each.
        {key: None if len(of) == rows else of for key, of in rows_of.items()},
        without_time,
        disagreeing,
    )
