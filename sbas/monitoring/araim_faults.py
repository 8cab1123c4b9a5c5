"""Which faults ARAIM looks at: events, sets of them, and the risk of all others.

Source: WG-C ARAIM Airborne Algorithm Description Document 3.0 (2017), determination of the
faults and subsets to be monitored. An event is the fault of one satellite or of one whole
constellation; events are independent.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]

MOST_MODES = 100_000
"""Fault modes of an epoch, beyond which a computation would not end in useful time."""


def most_faults(total: Floats, events: Ints, *, threshold: float, cap: int | None = None) -> Ints:
    """Most faults at a time that must be looked at.

    The least r >= 1 with total^(r+1) / (r+1)! <= threshold, which bounds the probability of more
    than r independent events.

    Parameters
    ----------
    total : (n,) sums of the priors of all events.
    events : (n,) number of events: there are never more faults.
    threshold : risk that may be left, P_THRES.
    cap : at most this many, whatever the threshold says.
    """
    limit = np.maximum(events if cap is None else np.minimum(events, cap), 1)
    r = np.ones(total.shape, np.int64)
    with np.errstate(divide="ignore"):
        log_total = np.log(total)
    for more in range(1, int(limit.max(initial=1))):
        left = np.exp((more + 1) * log_total - math.lgamma(more + 2))
        further = (r == more) & (left > threshold) & (limit > more)
        if not further.any():
            break
        r = np.where(further, more + 1, r)
    return r


def more_faults_than(priors: Floats, most: Ints) -> Floats:
    """(n,) probability that more than `most` (n,) of the independent (e, n) events happen.

    Recursion over the events with an absorbing state "more": sums of positive terms, exact for
    the smallest probabilities.
    """
    top = int(most.max(initial=0))
    state = np.zeros((top + 2, priors.shape[1]))
    state[0] = 1.0
    for p in priors:
        moved = state[:-1] * p
        state[:-1] *= 1.0 - p
        state[1:] += moved
    counts = np.arange(top + 2)[:, None]
    more: Floats = np.where(counts > most, state, 0.0).sum(axis=0)
    return more


@dataclass(frozen=True, eq=False)
class FaultSets:
    """Fault sets of one size with the same constellations: `clocks` that fail, and `slots`
    (k, size) of satellites that fail beside them."""

    clocks: tuple[int, ...]
    slots: Ints

    @property
    def faults(self) -> int:
        return len(self.clocks) + int(self.slots.shape[1])


def number_of_sets(slots: int, clocks: int, most: int) -> int:
    """Number of sets of 1 to `most` events over satellite slots and constellations."""
    return sum(math.comb(slots + clocks, size) for size in range(1, most + 1))


@lru_cache(maxsize=64)
def fault_sets(slots: int, clocks: int, most: int) -> tuple[FaultSets, ...]:
    """All sets of 1 to `most` events over satellite slots and constellations.

    Sets of a constellation and one of its own satellites are among them, since slots belong to
    different constellations at different epochs; `priors_of` gives those the prior 0.

    Raises
    ------
    InputError : more sets than `MOST_MODES`.
    """
    count = number_of_sets(slots, clocks, most)
    if count > MOST_MODES:
        raise InputError(
            f"{count} fault modes an epoch are too many",
            where="priors",
            evidence=f"{slots} satellites, {clocks} constellations, {most} faults at a time",
            cure="AraimSettings(most_faults=2): what is then unmonitored is charged to the budget",
        )
    return tuple(_sets(slots, clocks, most))


def _sets(slots: int, clocks: int, most: int) -> Iterator[FaultSets]:
    for failed in range(min(clocks, most) + 1):
        for clock_set in combinations(range(clocks), failed):
            for size in range(0 if failed else 1, min(slots, most - failed) + 1):
                chosen = list(combinations(range(slots), size))
                yield FaultSets(clock_set, np.array(chosen, np.int64).reshape(len(chosen), size))


def priors_of(
    sets: FaultSets, *, p_satellite: Floats, p_clock: Floats, clock: Ints, most: Ints
) -> Floats:
    """(k, n) priors of fault sets: products of the priors of their events.

    Parameters
    ----------
    p_satellite : (s, n), 0 where a slot takes no part.
    p_clock : (c, n), 0 where a constellation has no satellite.
    clock : (s, n) constellation of each slot.
    most : (n,) faults at a time that are looked at.

    Notes
    -----
    A constellation's prior covers whatever its own satellites do meanwhile: a set with both is
    part of the constellation's mode and has the prior 0 here.
    """
    alone = p_satellite
    shared = (most >= sets.faults).astype(np.float64)
    for number in sets.clocks:
        alone = np.where(clock == number, 0.0, alone)
        shared = shared * p_clock[number]
    prior = np.broadcast_to(shared, (len(sets.slots), shared.size)).copy()
    for column in sets.slots.T:
        prior *= alone[column]
    return prior
