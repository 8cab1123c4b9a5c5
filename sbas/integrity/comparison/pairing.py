"""Epochs of two recordings side by side: each used once, the others counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.recording_survey import GAP_STEPS

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Pairs:
    """(p,) rows of A and of B that belong together, and how far B's time lies after A's [ns]."""

    row_a: Ints
    row_b: Ints
    offset_ns: Ints

    def __len__(self) -> int:
        return self.row_a.size


def pair_epochs(time_a_ns: Ints, time_b_ns: Ints, *, tolerance_ns: int) -> Pairs:
    """Pair epochs that are each other's nearest and at most a tolerance apart.

    Parameters
    ----------
    time_a_ns, time_b_ns : (n,), (m,) strictly increasing times [ns].
    tolerance_ns : farthest that two epochs of a pair may lie apart [ns], such as dt/2.

    Returns
    -------
    Pairs in the order of time, each epoch in at most one of them.

    Raises
    ------
    InputError : times that do not increase.

    Notes
    -----
    On a tie A's epoch takes the later of B's and B's the earlier of A's, so that two regular
    series half an interval apart are paired throughout.
    """
    for name, time in (("A", time_a_ns), ("B", time_b_ns)):
        if np.any(np.diff(time) <= 0):
            raise InputError(
                f"times of {name} do not increase",
                where=f"after row {int(np.argmax(np.diff(time) <= 0))}",
                cure="--sort and --duplicates first",
            )
    if time_a_ns.size == 0 or time_b_ns.size == 0:
        none = np.empty(0, np.int64)
        return Pairs(none, none, none)
    b_of_a = _nearest(time_a_ns, time_b_ns, later_on_tie=True)
    a_of_b = _nearest(time_b_ns, time_a_ns, later_on_tie=False)
    row_a = np.arange(time_a_ns.size)
    offset = time_b_ns[b_of_a] - time_a_ns
    row_a = row_a[(a_of_b[b_of_a] == row_a) & (np.abs(offset) <= tolerance_ns)]
    return Pairs(row_a, b_of_a[row_a], offset[row_a])


def _nearest(of: Ints, among: Ints, *, later_on_tie: bool) -> Ints:
    right = np.clip(np.searchsorted(among, of), 0, among.size - 1)
    left = np.maximum(right - 1, 0)
    to_left, to_right = np.abs(of - among[left]), np.abs(among[right] - of)
    take_right = to_right <= to_left if later_on_tie else to_right < to_left
    return np.where(take_right, right, left)


@dataclass(frozen=True, eq=False)
class CommonEpochs:
    """(n,) epochs of the span that two recordings share, at the coarser one's interval.

    `row_a`, `row_b` are the rows of A and B at each of them, -1 where that recording has none; at
    least one has one. `offset_ns` is B's time less A's, 0 where one is missing. `outside_a`,
    `outside_b` count epochs before or after the shared span, `unpaired_a`, `unpaired_b` those
    within it that have no partner, `between_a`, `between_b` those of them that only the other's
    coarser interval left out.
    """

    time_ns: Ints
    row_a: Ints
    row_b: Ints
    offset_ns: Ints
    interval_ns: int
    outside_a: int
    outside_b: int
    unpaired_a: int
    unpaired_b: int
    between_a: int
    between_b: int

    @property
    def paired(self) -> NDArray[np.bool_]:
        """(n,) True where both recordings have an epoch."""
        return (self.row_a >= 0) & (self.row_b >= 0)


def common_epochs(
    time_a_ns: Ints, time_b_ns: Ints, *, interval_a_ns: int, interval_b_ns: int
) -> CommonEpochs:
    """The epochs that two recordings share, with those that one of them lacks.

    Parameters
    ----------
    time_a_ns, time_b_ns : (n,), (m,) strictly increasing times [ns].
    interval_a_ns, interval_b_ns : sampling intervals [ns], above 0.

    Returns
    -------
    CommonEpochs: the coarser recording's epochs within the shared span, and in its gaps as many
    of the finer one's as its interval would have given. Pairs lie within half the shorter
    interval.

    Raises
    ------
    InputError : the recordings share no time, or times that do not increase.
    """
    swapped = interval_b_ns > interval_a_ns
    coarse, fine = (time_b_ns, time_a_ns) if swapped else (time_a_ns, time_b_ns)
    interval = max(interval_a_ns, interval_b_ns)
    tolerance = min(interval_a_ns, interval_b_ns) // 2
    coarse_in, fine_in = _shared(coarse, fine, tolerance)
    if coarse_in[0] == coarse_in[1] or fine_in[0] == fine_in[1]:
        spans = (f"{t[0].astype('M8[ns]')} to {t[-1].astype('M8[ns]')}" if t.size else "no epoch"
                 for t in (time_a_ns, time_b_ns))  # fmt: skip
        raise InputError(
            "the two recordings share no time",
            evidence="A {}, B {} GPST".format(*spans),
            cure="compare recordings of the same hours; state the time scale (GPS time or UTC) "
            "and the date of each when it was read",
        )
    held = coarse[slice(*coarse_in)]
    candidates = fine[slice(*fine_in)]
    grid = np.concatenate([held, _fillers(held, candidates, interval)])
    own_row = np.concatenate([np.arange(*coarse_in), np.full(grid.size - held.size, -1, np.int64)])
    order = np.argsort(grid, kind="stable")
    grid, own_row = grid[order], own_row[order]
    pairs = pair_epochs(grid, candidates, tolerance_ns=tolerance)
    other_row = np.full(grid.size, -1, np.int64)
    other_row[pairs.row_a] = pairs.row_b + fine_in[0]
    keep = (own_row >= 0) | (other_row >= 0)
    grid, own_row, other_row = grid[keep], own_row[keep], other_row[keep]
    both = (own_row >= 0) & (other_row >= 0)
    offset = np.zeros(grid.size, np.int64)
    offset[both] = fine[other_row[both]] - grid[both]
    paired = int(both.sum())
    coarse_unpaired = held.size - paired
    fine_unpaired = candidates.size - paired
    between = candidates.size - int(np.sum(other_row >= 0))
    outside = coarse.size - held.size, fine.size - candidates.size
    if swapped:
        return CommonEpochs(
            grid, other_row, own_row, -offset, interval, outside[1], outside[0],
            fine_unpaired, coarse_unpaired, between, 0,
        )  # fmt: skip
    return CommonEpochs(
        grid, own_row, other_row, offset, interval, *outside,
        coarse_unpaired, fine_unpaired, 0, between,
    )  # fmt: skip


def _shared(coarse: Ints, fine: Ints, tolerance: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Rows [first, stop) of each recording that lie within the span of the other."""
    if coarse.size == 0 or fine.size == 0:
        return (0, 0), (0, 0)
    rows = []
    for one, other in ((coarse, fine), (fine, coarse)):
        first = int(np.searchsorted(one, other[0] - tolerance, side="left"))
        rows.append((first, int(np.searchsorted(one, other[-1] + tolerance, side="right"))))
    return rows[0], rows[1]


def _fillers(held: Ints, candidates: Ints, interval: int) -> Ints:
    """Epochs that the coarser recording would have had in its gaps, where the finer has some."""
    left = np.searchsorted(held, candidates, side="right") - 1
    inside = (left >= 0) & (left < held.size - 1)
    left, time = left[inside], candidates[inside]
    gap = held[left + 1] - held[left] > GAP_STEPS * interval
    left, time = left[gap], time[gap]
    slot = (time - held[left] + interval // 2) // interval
    filler = held[left] + slot * interval
    fits = (slot >= 1) & (held[left + 1] - filler > interval // 2)
    return np.unique(filler[fits])
