"""The PRN mask over time: which satellite each correction is of.

Source: RTCA DO-229D, A.4.4.2 (type 1) and A.4.4.1.1 (issue of data PRN).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.message_types import Masks
from sbas.augmentation.reception import Instants
from sbas.augmentation.row_groups import row_groups
from sbas.augmentation.tables import MASK_TIMEOUT_S, SLOW_TIMEOUT_S

Ints = NDArray[np.int64]

NOT_IN_MASK = -1
NONE = -1
FORGOTTEN_S = MASK_TIMEOUT_S + SLOW_TIMEOUT_S["npa"]


@dataclass(frozen=True, eq=False)
class MaskTimeline:
    """Masks in the order in which they became current.

    Parameters
    ----------
    time_s : (k,) when each became current.
    iodp : (k,) its issue.
    position_of : (k, 211) mask position of each slot number, -1 where it is not in the mask.
    last_s : (k,) the last message of type 1 with it.
    refreshed_s : (n,) every message of type 1.
    """

    time_s: Ints
    iodp: Ints
    position_of: Ints
    last_s: Ints
    refreshed_s: Ints

    def current(self, instants: Instants) -> Ints:
        """(n,) index of the current mask; -1 where there is none."""
        return instants.latest(self.time_s)

    def previous(self, current: Ints, instants: Instants) -> Ints:
        """(n,) index of the mask before the current one, as long as it may still be used; -1."""
        if not self.time_s.size:
            return current
        before = np.maximum(current - 1, 0)
        gone = (current < 1) | (self.time_s[before] <= instants.since_s)
        gone |= instants.expired(self.last_s[before], MASK_TIMEOUT_S)
        return np.where(gone, NONE, before)

    def expired(self, instants: Instants) -> NDArray[np.bool_]:
        """(n,) True where the last message of type 1 is too old, or there is none."""
        index = instants.latest(self.refreshed_s)
        if not self.refreshed_s.size:
            return np.ones(index.size, bool)
        return (index < 0) | instants.expired(self.refreshed_s[index], MASK_TIMEOUT_S)


def mask_timeline(masks: Masks, alarm_s: Ints) -> MaskTimeline:
    """Masks that became current: each with another issue than the one before, or the first after
    an alarm. A mask that comes again with the same issue only renews the time."""
    after_alarm = np.searchsorted(alarm_s, masks.time_s, side="left")
    changed = np.ones(masks.time_s.size, bool)
    changed[1:] = (np.diff(masks.iodp) != 0) | (np.diff(after_alarm) != 0)
    rows = np.flatnonzero(changed)
    position_of = np.full((rows.size, 211), NOT_IN_MASK)
    mask, position = np.nonzero(masks.prn_of[rows])
    position_of[mask, masks.prn_of[rows][mask, position]] = position
    last = np.append(rows[1:], masks.time_s.size) - 1 if rows.size else rows
    return MaskTimeline(
        masks.time_s[rows], masks.iodp[rows], position_of, masks.time_s[last], masks.time_s
    )


def contradicted_masks_s(masks: Masks) -> Ints:
    """(c,) when a mask came whose content is not that of the last one with its issue.

    A service changes the issue with the content. After a gap of hours the two bits of the issue
    may have come round; without a gap the mask contradicts itself. Either way what was heard
    under the issue names other satellites now. An old mask that another issue has replaced for
    longer than any of its data may live is forgotten.
    """
    found = []
    last: dict[int, int] = {}
    for row, issue in enumerate(masks.iodp.tolist()):
        before = last.get(issue)
        if before is not None:
            replaced = bool((masks.iodp[before:row] != issue).any())
            old = masks.time_s[row] - masks.time_s[before] > FORGOTTEN_S
            same = np.array_equal(masks.prn_of[before], masks.prn_of[row])
            if not same and not (replaced and old):
                found.append(int(masks.time_s[row]))
        last[issue] = row
    return np.array(found, np.int64)


def latest_of_slot(
    masks: MaskTimeline, slot: int, time_s: Ints, iodp: Ints, position: Ints, instants: Instants
) -> Ints:
    """(n,) row of the newest of some messages about a satellite at each epoch; -1 for none.

    Slow messages go on under the mask before the current one until those of the new mask come,
    so each is read by the mask of its own issue.

    Parameters
    ----------
    time_s, iodp, position : (m,) messages in the order of time: issue of the mask, place in it.
    """
    row = np.full(instants.second.size, NONE)
    current = masks.current(instants)
    for pair, here in row_groups(current, masks.previous(current, instants)):
        about = np.zeros(time_s.size, bool)
        for mask in pair:
            if mask != NONE and masks.position_of[mask, slot] != NOT_IN_MASK:
                about |= (iodp == masks.iodp[mask]) & (position == masks.position_of[mask, slot])
        own = np.flatnonzero(about)
        if own.size:
            at = instants.some(here).latest(time_s[own])
            row[here] = np.where(at >= 0, own[at], NONE)
    return row
