"""Histories of onsets as small whole numbers, for chains that carry one in each state."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from sbas.dependability.exact.state_space import Ints
from sbas.dependability.exact.transitions import Truth
from sbas.exceptions import InputError

Sequence_ = tuple[tuple[str, ...], ...]
"""Steps in order; events of one step begin in one epoch."""

CUT = ("...",)
"""First step of a sequence whose oldest onsets were not kept."""

_BITS = 62
_Steps = tuple[int, ...]
_EMPTY: tuple[bool, _Steps] = (False, ())


class OnsetTags:
    """Numbers of histories, given as they come; 0 is the empty one.

    Parameters
    ----------
    events : names of the basic events.
    longest : onsets (steps) that a history keeps.
    repeating : events of which every onset counts; of the others only the last one does.
    """

    def __init__(
        self, events: Sequence[str], longest: int, *, repeating: Collection[str] = ()
    ) -> None:
        if len(events) > _BITS:
            raise InputError("too many basic events", evidence=f"{len(events)}, at most {_BITS}")
        if longest < 1:
            raise InputError("a history keeps one onset or more", where=f"longest = {longest}")
        self.events = list(events)
        self.longest = longest
        self._once = sum(1 << i for i, name in enumerate(self.events) if name not in repeating)
        self._known: list[tuple[bool, _Steps]] = [_EMPTY]
        self._number = {_EMPTY: 0}
        self._after: dict[tuple[int, int], int] = {}

    def masks(self, truth: Truth, size: int) -> Ints:
        """(size,) bits of the events that are true in each state."""
        bits = np.zeros(size, dtype=np.int64)
        for i, name in enumerate(self.events):
            bits |= truth[name].astype(np.int64) << i
        return bits

    def step(self, tags: Ints, onsets: Ints, alive: Ints) -> Ints:
        """Histories one epoch on.

        Parameters
        ----------
        tags : numbers of histories.
        onsets : bits of events that become true.
        alive : 0 where history ends: no event is true, and nothing holds what was.
        """
        moved = np.where(alive == 0, 0, tags)
        at = np.flatnonzero(onsets)
        pairs, back = np.unique(
            np.stack([tags[at], onsets[at]], axis=1), axis=0, return_inverse=True
        )
        after = [self._add(tag, onset) for tag, onset in pairs.tolist()]
        moved[at] = np.array(after, dtype=np.int64)[back.reshape(-1)]
        return moved

    def _add(self, tag: int, onset: int) -> int:
        key = tag, onset
        if key not in self._after:
            cut, steps = self._known[tag]
            earlier = (step & ~(onset & self._once) for step in steps)
            steps = (*(step for step in earlier if step), onset)
            if len(steps) > self.longest:
                cut, steps = True, _shortened(steps)
            history = cut, steps
            if history not in self._number:
                self._number[history] = len(self._known)
                self._known.append(history)
            self._after[key] = self._number[history]
        return self._after[key]

    def sequence(self, tag: int) -> Sequence_:
        """The history of a number, in names."""
        cut, steps = self._known[tag]
        named = tuple(
            tuple(name for i, name in enumerate(self.events) if step >> i & 1) for step in steps
        )
        return (CUT, *named) if cut else named


def _shortened(steps: _Steps) -> _Steps:
    """Without the oldest step all of whose events came again, else without the oldest."""
    for i, step in enumerate(steps):
        later = 0
        for other in steps[i + 1 :]:
            later |= other
        if step & ~later == 0:
            return (*steps[:i], *steps[i + 1 :])
    return steps[1:]


def contains(long: Sequence_, short: Sequence_) -> bool:
    """Whether the steps of `short` lie, in order, within steps of `long`."""
    place = 0
    for step in long:
        if place < len(short) and set(short[place]) <= set(step):
            place += 1
    return place == len(short)
