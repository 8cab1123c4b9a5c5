"""Receiver states while a recording streams by: transitions, triples and runs, batch after batch.

A step that is not one sampling interval, and an epoch of which the record does not tell the state,
cut the chain: nothing is counted across.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.integrity.position_error import position_errors
from sbas.recording import MODES, Flag
from sbas.recording_survey import GAP_STEPS
from sbas.truth import Truth

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

STATES = ("correct", "wrong", "missing")
UNKNOWN, CORRECT, WRONG, MISSING, HARDWARE, WAITING = range(6)
CODES = ("unknown", *STATES, "hardware", "first_fix_wait")

ROOM_CAP = 1 << 20
"""A run's room beyond this is kept as this: 12 days at 1 Hz, and bounded memory."""

_LENGTH_BITS = 40


@dataclass(frozen=True, eq=False)
class Answers:
    """What a receiver gave, epoch by epoch; `after_fault` apart, at most one of these holds.

    Parameters
    ----------
    fix : (n,) a position to be used.
    alarmed : (n,) a position whose fault RAIM has found: no correct one, and no undetected wrong.
    declared_none : (n,) a position that the receiver itself calls none.
    lost : (n,) the logger lost the position's own record: there may well have been one.
    fault : (n,) the hardware has failed.
    waiting : (n,) no position yet since the hardware failed.
    after_fault : (n,) since the latest failure of the hardware, itself included, no `fix` and no
        `alarmed`.
    """

    fix: Bools
    alarmed: Bools
    declared_none: Bools
    lost: Bools
    fault: Bools
    waiting: Bools
    after_fault: Bools


def receiver_answers(table: pd.DataFrame, *, after_fault: bool = False) -> Answers:
    """What the receiver gave at each epoch of a table, whatever its errors are.

    Parameters
    ----------
    table : (n,) epochs with the columns lat_deg, lon_deg, mode, flags and hardware_fault.
    after_fault : of the epoch before the first.
    """
    delivered = np.isfinite(table["lat_deg"].to_numpy()) & np.isfinite(table["lon_deg"].to_numpy())
    none = table["mode"].cat.codes.to_numpy() == MODES.index("none")
    fault = table["hardware_fault"].to_numpy()
    flags = table["flags"].to_numpy()
    failed = (flags & np.uint32(Flag.RAIM_FAILED)) != 0
    incomplete = (flags & np.uint32(Flag.EPOCH_INCOMPLETE)) != 0
    answered = delivered & ~none & ~fault
    lost = ~delivered & ~none & ~fault & incomplete
    latest = np.maximum.accumulate(np.where(fault | answered, np.arange(len(table)), -1))
    since = np.where(latest >= 0, fault[latest], after_fault) if len(table) else fault
    return Answers(
        fix=answered & ~failed,
        alarmed=answered & failed,
        declared_none=delivered & none & ~fault,
        lost=lost,
        fault=fault,
        # However long it takes: after a failure the receiver waits for its first fix.
        waiting=since & ~fault & ~lost,
        after_fault=since,
    )


def one_step_ns(interval_ns: int) -> tuple[int, int]:
    """Shortest and longest time between two epochs that counts as one interval [ns]."""
    return interval_ns - interval_ns // 2, int(GAP_STEPS * interval_ns)


class StateTally:
    """Counts of one pass; `update` with batches in order, then `finish`.

    Parameters
    ----------
    truth : where the antenna was.
    threshold_m : x; an error of x or more is wrong.
    interval_ns : sampling interval [ns].
    destination : count a transition between two environment labels for the second one's.
    """

    COLUMNS = (
        "lat_deg", "lon_deg", "height_m", "mode", "flags", "environment", "hardware_fault",
    )  # fmt: skip

    def __init__(
        self, truth: Truth, threshold_m: float, interval_ns: int, *, destination: bool
    ) -> None:
        self.truth, self.threshold_m, self.destination = truth, threshold_m, destination
        self.min_step_ns, self.max_step_ns = one_step_ns(interval_ns)
        self.labels: list[str] = []
        self.epochs = np.zeros((1, len(CODES)), np.int64)
        self.pairs = np.zeros((1, 9), np.int64)
        self.triples = np.zeros((1, 27), np.int64)
        self.completed, self.censored, self.rooms = Lengths(), Lengths(), Lengths()
        self.cuts = self.short_steps = self.across_labels = 0
        self.without_truth = self.incomplete = self.declared_none = self.unjudged_starts = 0
        self.raim_failed = 0
        self.truth_sigma_h_m = 0.0
        self._after_fault = False
        self._offset = 0
        # Code, label and link of the last two epochs, and the last time.
        self._code = np.zeros(2, np.int64)
        self._label = np.full(2, -1, np.int64)
        self._link = np.zeros(2, bool)
        self._time_ns: int | None = None
        self._begun = True
        self._open: tuple[int, int, bool] | None = None
        self._pending_key: Ints = np.empty(0, np.int64)
        self._pending_at: Ints = np.empty(0, np.int64)

    def update(self, batch: pd.DataFrame) -> None:
        """Count a batch with `COLUMNS`, whose times follow all earlier ones."""
        n = len(batch)
        if n == 0:
            return
        time = batch.index.to_numpy().astype(np.int64)
        step = np.diff(time, prepend=time[0] if self._time_ns is None else self._time_ns)
        near = (step >= self.min_step_ns) & (step <= self.max_step_ns)
        if self._time_ns is None:
            near[0] = False
        else:
            self.cuts += int(not near[0])
        self.cuts += int(np.sum(~near[1:]))
        self.short_steps += int(np.sum((step > 0) & (step < self.min_step_ns)))
        self._time_ns = int(time[-1])
        code = np.concatenate([self._code, self._codes(batch, near)])
        label = np.concatenate([self._label, self._label_codes(batch["environment"])])
        known = (code >= CORRECT) & (code <= MISSING)
        both = np.concatenate([self._link, near & known[2:] & known[1:-1]])
        # Links of the two carried epochs are final already.
        same = np.concatenate([[True, True], label[2:] == label[1:-1]])
        self.across_labels += int(np.sum(both & ~same))
        inside = both & same
        self._count(code, label, both if self.destination else inside)
        self._runs(code[1:], label[1:], inside[1:])
        # A run ends at another label under either rule: its law is that of one environment.
        self._code, self._label = code[-2:], label[-2:]
        self._link = (both if self.destination else inside)[-2:]
        self._offset += n

    def finish(self) -> None:
        """Close what the record's end has cut."""
        self._close_open(completed=False)
        self._settle(self._offset)

    def _codes(self, batch: pd.DataFrame, near: Bools) -> Ints:
        """(n,) states; see `CODES`."""
        gave = receiver_answers(batch, after_fault=self._after_fault)
        self._after_fault = bool(gave.after_fault[-1])
        errors = position_errors(batch, self.truth)
        hpe = errors["hpe_m"].to_numpy()
        formed = np.isfinite(hpe)
        code = np.where(hpe >= self.threshold_m, WRONG, CORRECT)
        code[gave.fix & ~formed] = UNKNOWN
        code[~gave.fix] = MISSING
        code[gave.lost] = UNKNOWN
        code[gave.fault] = HARDWARE
        code[gave.waiting] = WAITING
        self.declared_none += int(np.sum(gave.declared_none))
        self.raim_failed += int(np.sum(gave.alarmed))
        self.without_truth += int(np.sum(gave.fix & ~formed))
        self.incomplete += int(np.sum(gave.lost))
        judged = gave.fix & formed
        if judged.any():
            sigma = float(errors["truth_sigma_h_m"].to_numpy()[judged].max())
            self.truth_sigma_h_m = max(self.truth_sigma_h_m, sigma)
        self.unjudged_starts += self._missing_after_cuts(code, near)
        return code.astype(np.int64)

    def _missing_after_cuts(self, code: NDArray[Any], near: Bools) -> int:
        """Epochs missing from the record's begin, or from a gap, up to the first other state."""
        at = np.arange(code.size)
        other = np.maximum.accumulate(np.where(code != MISSING, at, -1))
        cut = np.maximum.accumulate(np.where(~near, at, -1))
        begun = np.where(np.maximum(other, cut) >= 0, cut > other, self._begun)
        # A cut at a missing epoch begins such a stretch; at any other epoch there is none.
        self._begun = bool(begun[-1])
        return int(np.sum(begun & (code == MISSING)))

    def _label_codes(self, environment: Any) -> Ints:
        """(n,) indices into `labels`, which grows; -1 if unlabelled."""
        own = [str(c) for c in environment.cat.categories]
        codes = environment.cat.codes.to_numpy().astype(np.int64)
        for i in np.unique(codes[codes >= 0]).tolist():
            if own[i] not in self.labels:
                self.labels.append(own[i])
        table = np.array([self.labels.index(c) if c in self.labels else -1 for c in own] + [-1])
        found: Ints = table[codes].astype(np.int64)
        return found

    def _count(self, code: Ints, label: Ints, link: Bools) -> None:
        rows = len(self.labels) + 1
        self.epochs, self.pairs, self.triples = (
            np.concatenate([a, np.zeros((rows - len(a), a.shape[1]), np.int64)])
            for a in (self.epochs, self.pairs, self.triples)
        )
        key = label + 1
        self.epochs += np.bincount(
            key[2:] * len(CODES) + code[2:], minlength=self.epochs.size
        ).reshape(self.epochs.shape)
        at = np.flatnonzero(link[2:]) + 2
        pair = (code[at - 1] - 1) * 3 + code[at] - 1
        self.pairs += np.bincount(key[at] * 9 + pair, minlength=self.pairs.size).reshape(
            self.pairs.shape
        )
        at = at[link[at - 1]]
        triple = (code[at - 2] - 1) * 9 + (code[at - 1] - 1) * 3 + code[at] - 1
        self.triples += np.bincount(key[at] * 27 + triple, minlength=self.triples.size).reshape(
            self.triples.shape
        )

    def _runs(self, code: Ints, label: Ints, link: Bools) -> None:
        """Add runs of (n+1,) epochs, the first of which is the last one of the batch before."""
        code_now, label_now, link_now = code[1:], label[1:], link[1:]
        n = code_now.size
        known = (code_now >= CORRECT) & (code_now <= MISSING)
        start = known & (~link_now | (code_now != code[:-1]))
        border = np.append(np.flatnonzero(start | ~known), n)
        self._settle_at(np.flatnonzero(~link_now))
        head = int(border[0])
        if self._open is not None:
            state, length, whole = self._open
            self._open = (state, length + head, whole)
            if head < n:
                self._close_open(completed=bool(link_now[head]))
        first = np.flatnonzero(start)
        if first.size == 0:
            return
        stop = border[np.searchsorted(border, first, side="right")]
        key = (label_now[first] + 1) * 3 + code_now[first] - 1
        begun = link_now[first]
        ended = (stop < n) & link_now[np.minimum(stop, n - 1)]
        closed = stop < n
        self.completed.add(key[begun & ended], (stop - first)[begun & ended])
        cut = begun & closed & ~ended
        self.censored.add(key[cut], (stop - first)[cut])
        if not closed[-1]:
            self._open = (int(key[-1]), int(n - first[-1]), bool(begun[-1]))
        breaks = np.flatnonzero(~link_now)
        own, key = first[begun], key[begun]
        later = np.searchsorted(breaks, own, side="right")
        settled = later < breaks.size
        self.rooms.add(key[settled], np.minimum(breaks[later[settled]] - own[settled], ROOM_CAP))
        self._pending_key = np.concatenate([self._pending_key, key[~settled]])
        self._pending_at = np.concatenate([self._pending_at, own[~settled] + self._offset])
        old = self._offset + n - self._pending_at >= ROOM_CAP
        self.rooms.add(self._pending_key[old], np.full(int(old.sum()), ROOM_CAP))
        self._pending_key, self._pending_at = self._pending_key[~old], self._pending_at[~old]

    def _close_open(self, *, completed: bool) -> None:
        if self._open is None:
            return
        key, length, begun = self._open
        self._open = None
        if begun:
            kind = self.completed if completed else self.censored
            kind.add(np.array([key]), np.array([length]))

    def _settle_at(self, breaks: Ints) -> None:
        if breaks.size:
            self._settle(self._offset + int(breaks[0]))

    def _settle(self, end: int) -> None:
        """The stretch of linked epochs ends before the epoch `end`: its runs' rooms are known."""
        self.rooms.add(self._pending_key, np.minimum(end - self._pending_at, ROOM_CAP))
        self._pending_key, self._pending_at = self._pending_key[:0], self._pending_at[:0]


class Lengths:
    """Counts of lengths by key (label and state), sparse."""

    def __init__(self) -> None:
        self._keys: Ints = np.empty(0, np.int64)
        self._counts: Ints = np.empty(0, np.int64)

    def add(self, key: Ints, length: Ints) -> None:
        """Add (m,) lengths below 2^40 with their keys."""
        if key.size == 0:
            return
        found, counts = np.unique((key << _LENGTH_BITS) | length, return_counts=True)
        merged, where = np.unique(np.concatenate([self._keys, found]), return_inverse=True)
        sums = np.zeros(merged.size, np.int64)
        np.add.at(sums, where, np.concatenate([self._counts, counts]))
        self._keys, self._counts = merged, sums

    def of(self, keys: Sequence[int]) -> tuple[tuple[int, int], ...]:
        """(length, count) in the order of length, over these keys together."""
        chosen = np.isin(self._keys >> _LENGTH_BITS, keys)
        length = self._keys[chosen] & ((1 << _LENGTH_BITS) - 1)
        distinct, where = np.unique(length, return_inverse=True)
        counts = np.zeros(distinct.size, np.int64)
        np.add.at(counts, where, self._counts[chosen])
        return tuple(zip(distinct.tolist(), counts.tolist(), strict=True))
