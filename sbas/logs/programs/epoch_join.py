"""Messages of one epoch brought together by their time, in the order of the file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def joined_epochs(times_ns: Sequence[Ints], lines: Sequence[Ints]) -> tuple[Ints, list[Ints]]:
    """Epochs of several messages.

    Where a time occurs again, its first message of one kind belongs to the first of the other
    kinds, and so on.

    Parameters
    ----------
    times_ns : (n_k,) times of each kind of message.
    lines : (n_k,) places in the file, one scale for all kinds.

    Returns
    -------
    (n,) times, each epoch at the place of its first message; and of each kind the (n,) row of
    the epoch's message, -1 where it has none.
    """
    none = np.zeros(0, np.int64)
    times, code = np.unique(np.concatenate([none, *times_ns]), return_inverse=True)
    most = len(code) + 1
    ends = np.cumsum([len(t) for t in times_ns])
    keys = [piece * most + occurrence(piece) for piece in np.split(code, ends)[: len(times_ns)]]
    joined = distinct(np.concatenate([none, *keys]))
    place = np.full(len(joined), np.iinfo(np.int64).max)
    rows = []
    for key, line in zip(keys, lines, strict=True):
        at = np.searchsorted(joined, key)
        row = np.full(len(joined), -1)
        row[at] = np.arange(len(key))
        place[at] = np.minimum(place[at], line)
        rows.append(row)
    order = np.argsort(place, kind="stable")
    return times[joined // most][order], [row[order] for row in rows]


def occurrence(values: Ints) -> Ints:
    """(n,) how often each of (n,) values stands before."""
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    count = np.empty(len(values), np.int64)
    count[order] = np.arange(len(values)) - np.searchsorted(ordered, ordered)
    return count


def distinct(values: Ints) -> Ints:
    """(m,) different values of (n,) ones, in order; quick where they come nearly in order."""
    ordered = np.sort(values, kind="stable")
    first = np.ones(len(ordered), bool)
    first[1:] = ordered[1:] != ordered[:-1]
    return ordered[first]
