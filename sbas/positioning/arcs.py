"""Continuous tracking of satellites: arcs, cycle slips, and ranges smoothed by the carrier.

Source: RTCA DO-229D, 2.1.4.1.1 (smoothing); the arc and slip rules are those of gLAB 6.0.0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

LONGEST_GAP_S = 10.0
LONGEST_GAP_INTERVALS = 1.5
"""Data sampled more slowly than every 10 s have no gap between one epoch and the next."""
SKIPPED_EPOCHS = 2
"""An arc's first epochs are not used."""
SLIP_WINDOW_S = 300.0
SLIP_SIGMAS_SQUARED = 25.0
LARGEST_SLIP_VARIANCE_M2 = 9.0
JUMP_M = 20.0
SMOOTHING_S = 100.0
_FIRST_LOOK = 512


@dataclass(frozen=True, eq=False)
class Arcs:
    """One satellite at its (k,) epochs: place within the arc, from 1, and jumps of the code."""

    place: Ints
    jumped: Bools


def find_arcs(
    time_s: Floats, code_m: Floats, carrier_m: Floats, *, interval_s: float = 1.0
) -> Arcs:
    """Arcs of one satellite: broken by gaps and by cycle slips.

    Parameters
    ----------
    time_s : (k,) rising times at which its code was measured well enough.
    code_m, carrier_m : (k,) code and carrier range; a missing carrier is NaN and shows no slip.
    interval_s : usual time between the receiver's epochs.
    """
    longest_s = max(LONGEST_GAP_S, LONGEST_GAP_INTERVALS * interval_s)
    k = time_s.size
    place = np.zeros(k, np.int64)
    difference = carrier_m - code_m
    jumped = np.zeros(k, bool)
    jumped[1:] = np.abs(np.diff(difference)) > JUMP_M
    start = 0
    breaks = np.flatnonzero(np.diff(time_s) > longest_s) + 1
    for end in [*breaks.tolist(), k]:
        while start < end:
            stop = _arc_end(time_s, difference, start, end)
            place[start:stop] = np.arange(1, stop - start + 1)
            jumped[start] = False
            start = stop
    return Arcs(place, jumped)


def _arc_end(time_s: Floats, difference_m: Floats, start: int, end: int) -> int:
    """First index after `start` at which the arc has slipped, or `end`.

    It looks further and further, so that many slips cost no more than few.
    """
    reach = _FIRST_LOOK
    while True:
        stop = min(start + reach, end)
        slip = _first_slip(time_s[start:stop], difference_m[start:stop])
        if slip is not None:
            return start + slip
        if stop == end:
            return end
        reach *= 4


def _first_slip(time_s: Floats, difference_m: Floats) -> int | None:
    """Index of the first cycle slip within an arc, 1 or more; None where there is none.

    The carrier less the code is held against its mean over the last 300 s; its variance is
    drawn towards 9 m2 while the window is young.
    """
    known = np.flatnonzero(np.isfinite(difference_m))
    if known.size < 2:
        return None
    x = difference_m[known] - difference_m[known[0]]
    t = time_s[known]
    sums = np.concatenate([[0.0], np.cumsum(x)])
    squares = np.concatenate([[0.0], np.cumsum(x**2)])
    first = np.searchsorted(t, t - SLIP_WINDOW_S, side="left")
    here = np.arange(x.size)
    n = (here - first).astype(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (sums[here] - sums[first]) / n
        variance = np.maximum((squares[here] - squares[first]) / n - mean**2, 0.0)
        blended = variance - (variance - LARGEST_SLIP_VARIANCE_M2) / n
        limit = SLIP_SIGMAS_SQUARED * np.minimum(blended, LARGEST_SLIP_VARIANCE_M2)
        slipped = (n > 0) & ((x - mean) ** 2 > limit)
    found = np.flatnonzero(slipped)
    return int(known[found[0]]) if found.size else None


@dataclass(frozen=True, eq=False)
class SmoothedRange:
    """(k,) ranges smoothed by the carrier [m], and for how many epochs the filter has run."""

    range_m: Floats
    epochs: Ints


def smoothed_range(
    arcs: Arcs, code_m: Floats, carrier_m: Floats, *, interval_s: float
) -> SmoothedRange:
    """Code smoothed by the carrier (Hatch filter, one frequency) over 100 s.

    The filter begins anew with each arc, after its first two epochs, and where the carrier is
    missing: nobody has seen then that it did not slip. Without a filter the range is the code.
    """
    most = max(round(SMOOTHING_S / interval_s), 1)
    smoothed, epochs = code_m.copy(), np.zeros(code_m.size, np.int64)
    difference = (code_m - carrier_m).tolist()
    n, mean = 0, 0.0
    # A recursion over epochs: each step needs the one before it.
    for i, (place, d) in enumerate(zip(arcs.place.tolist(), difference, strict=True)):
        if place <= SKIPPED_EPOCHS or d != d:
            n = 0
            continue
        n += 1
        window = min(n, most)
        mean += (d - mean) / window if n > 1 else d - mean
        smoothed[i] = mean + carrier_m[i]
        epochs[i] = n
    return SmoothedRange(smoothed, epochs)
