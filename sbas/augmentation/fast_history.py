"""Fast corrections and UDREI of one satellite over time: histories, their cuts, and the UDREI
that holds.

Fast messages of one issue of the PRN mask in a row are a *generation*. A history is what one
issue says of one position in the mask; it lives on while its generation is the latest or the one
before. A UDREI of 14 or 15, and a gap in reception, cut it: what came before never serves again.
Source: RTCA DO-229D, A.4.4.3, A.4.4.4 and J.2.2; gLAB 6.0.0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.message_types import FastCorrections, Integrity
from sbas.augmentation.reception import NEVER, Reception
from sbas.augmentation.tables import SLOTS, UDREI_NOT_MONITORED

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

IODF_ALARM = 3
BLOCK = 13


@dataclass(frozen=True, eq=False)
class History:
    """Everything said about one mask position under one generation.

    Fast corrections (f,): `time_s`, `prc_m`, `udrei`, `iodf`, `block`, `session`; `cuts` the
    number of cuts up to each, its own included; `is_cut`. Integrity messages (i,) with the same
    names and prefix `integrity_`; `integrity_before_s` the last one with another IODF than the
    run of equal ones that each belongs to, `integrity_of_s` (i, 4) the last one up to each with
    each IODF. Cuts (c,): `cut_s` and their UDREI.
    """

    time_s: Ints
    prc_m: Floats
    udrei: Ints
    iodf: Ints
    block: Ints
    session: Ints
    cuts: Ints
    is_cut: Bools
    integrity_s: Ints
    integrity_udrei: Ints
    integrity_iodf: Ints
    integrity_cuts: Ints
    integrity_is_cut: Bools
    integrity_before_s: Ints
    integrity_of_s: Ints
    cut_s: Ints
    cut_udrei: Ints


@dataclass(frozen=True, eq=False)
class FastTimeline:
    """Fast corrections of one SBAS satellite.

    Parameters
    ----------
    generation_s : (g,) first fast message of each generation.
    generation_iodp : (g,) its issue of data PRN.
    lane : (g,) number of its histories: that of the generation two before where the issue is the
        same again, as those histories have lived on.
    histories : by lane and mask position.
    """

    generation_s: Ints
    generation_iodp: Ints
    lane: Ints
    histories: Mapping[tuple[int, int], History]


def fast_timeline(
    fast: FastCorrections, integrity: Integrity, reception: Reception
) -> FastTimeline:
    """Histories of all positions from the messages of types 0, 2 to 6 and 24."""
    after_alarm = np.searchsorted(reception.wiped_s, fast.time_s, side="left")
    changed = np.ones(fast.time_s.size, bool)
    changed[1:] = (np.diff(fast.iodp) != 0) | (np.diff(after_alarm) != 0)
    first = np.flatnonzero(changed)
    generation_s, generation_iodp = fast.time_s[first], fast.iodp[first]
    lane = np.arange(first.size)
    for g in range(2, first.size):
        if generation_iodp[g] == generation_iodp[g - 2]:
            lane[g] = lane[g - 2] if after_alarm[first[g]] == after_alarm[first[g - 2]] else g
    of_fast = lane[np.cumsum(changed) - 1]
    # An integrity message names no issue: it is of the generation that was current.
    generation = np.searchsorted(generation_s, integrity.time_s, side="right") - 1
    of_integrity = np.where(generation >= 0, lane[generation], -1) if lane.size else generation
    session = reception.session(fast.time_s)
    integrity_session = reception.session(integrity.time_s)
    order = np.lexsort((np.arange(fast.time_s.size), fast.position, of_fast))
    key = of_fast[order] * SLOTS + fast.position[order]
    histories = {}
    for rows in np.split(order, np.flatnonzero(np.diff(key)) + 1) if order.size else ():
        number, position = int(of_fast[rows[0]]), int(fast.position[rows[0]])
        with_it = np.flatnonzero(of_integrity == number)
        histories[number, position] = _history(
            fast, rows, session[rows], integrity, integrity_session[with_it], with_it, position
        )
    return FastTimeline(generation_s, generation_iodp, lane, histories)


def _history(
    fast: FastCorrections,
    rows: Ints,
    session: Ints,
    integrity: Integrity,
    integrity_session: Ints,
    with_it: Ints,
    position: int,
) -> History:
    time_s, udrei, iodf = fast.time_s[rows], fast.udrei[rows], fast.iodf[rows]
    i_time = integrity.time_s[with_it]
    i_udrei = integrity.udrei[with_it, position]
    i_iodf = integrity.iodf[with_it, min(position // BLOCK, 3)]
    cut = udrei >= UDREI_NOT_MONITORED
    # The UDREI of an integrity message holds where it is an alarm or is of the same correction;
    # it cuts a history that still serves, so once.
    before = np.searchsorted(time_s, i_time, side="right") - 1
    i_cut = (before >= 0) & ~cut[before] & (session[before] == integrity_session)
    i_cut &= (i_iodf == IODF_ALARM) | (i_iodf == iodf[before])
    i_cut &= i_udrei >= UDREI_NOT_MONITORED
    first = np.flatnonzero(i_cut)
    i_cut[first[1:][np.diff(before[first]) == 0]] = False
    cut_s = np.concatenate([time_s[cut], i_time[i_cut]])
    order = np.argsort(cut_s, kind="stable")
    cut_s = cut_s[order]
    new_run = np.ones(i_time.size, bool)
    new_run[1:] = np.diff(i_iodf) != 0
    start = np.maximum.accumulate(np.where(new_run, np.arange(i_time.size), 0))
    by_iodf = np.where(i_iodf[:, None] == np.arange(IODF_ALARM + 1), i_time[:, None], NEVER)
    return History(
        time_s,
        fast.prc_m[rows],
        udrei,
        iodf,
        fast.block[rows],
        session,
        np.searchsorted(cut_s, time_s, side="right"),
        cut,
        i_time,
        i_udrei,
        i_iodf,
        np.searchsorted(cut_s, i_time, side="right"),
        i_cut,
        np.where(start > 0, i_time[start - 1], NEVER) if i_time.size else i_time,
        np.maximum.accumulate(by_iodf, axis=0),
        cut_s,
        np.concatenate([udrei[cut], i_udrei[i_cut]])[order],
    )
