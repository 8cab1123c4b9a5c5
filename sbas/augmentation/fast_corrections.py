"""Fast corrections at epochs: pseudorange and range-rate correction, UDREI and degradation.

Source: RTCA DO-229D, A.4.4.3 (corrections), A.4.5.1.1 and A.4.5.1.2 (degradation of fast and
range-rate corrections), J.2.2; gLAB 6.0.0 where `Profile` says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.fast_history import BLOCK, IODF_ALARM, FastTimeline, History
from sbas.augmentation.message_types import Degradation, FastDegradation
from sbas.augmentation.prn_masks import NONE, MaskTimeline
from sbas.augmentation.reasons import Reason
from sbas.augmentation.reception import NEVER, Instants, Reception
from sbas.augmentation.row_groups import row_groups
from sbas.augmentation.tables import (
    DEGRADATION_MPS2,
    FAST_TIMEOUT_S,
    SLOTS,
    SLOW_TIMEOUT_S,
    UDREI_NOT_MONITORED,
    UDREI_TIMEOUT_S,
    Mode,
)

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

Profile = Literal["mops", "glab"]
"""`mops`: as RTCA DO-229 has it; `glab`: as gLAB 6.0.0 does where it differs."""

LARGEST_PA_UDREI = 11
BLOCKS = 4


@dataclass(eq=False)
class FastAt:
    """Fast corrections of one satellite at (n,) epochs; NaN and -1 where there is none.

    Parameters
    ----------
    reason : why the satellite cannot be used with full corrections (`Reason`), 0 if it can.
    usable : True where a fast correction with UDREI, rate and degradation serves.
    barred : True where the satellite must not be used at all.
    prc_m, rrc_m : fast and range-rate correction, to be added to the pseudorange.
    udrei : the one that holds.
    eps_fc_m, eps_rrc_m : degradation.
    iodp, position : issue of the mask and place in it that the correction is of.
    fast_expired_pa : True where the correction is past its time-out for precision approach.
    """

    reason: Ints
    usable: Bools
    barred: Bools
    prc_m: Floats
    rrc_m: Floats
    udrei: Ints
    eps_fc_m: Floats
    eps_rrc_m: Floats
    iodp: Ints
    position: Ints
    fast_expired_pa: Bools


def _empty(n: int) -> FastAt:
    whole = np.full(n, -1, np.int64)
    nothing = np.full(n, np.nan)
    return FastAt(
        np.full(n, Reason.NO_FAST_CORRECTION, np.int64), np.zeros(n, bool), np.zeros(n, bool),
        nothing, nothing.copy(), whole, nothing.copy(), nothing.copy(), whole.copy(),
        whole.copy(), np.zeros(n, bool),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class FastSource:
    """What fast corrections at epochs are made of: the timelines, and messages of types 7 and
    10."""

    masks: MaskTimeline
    fast: FastTimeline
    factors: FastDegradation
    degradation: Degradation
    reception: Reception


def fast_at(
    source: FastSource, slot: int, instants: Instants, *, mode: Mode, profile: Profile
) -> FastAt:
    """Fast corrections of the satellite of a slot number (1-37 GPS, 120-158 SBAS) at epochs.

    A satellite is barred from a UDREI of 14 or 15, or a gap in reception, until a correction
    with another UDREI comes.
    """
    result = _empty(instants.second.size)
    masks = source.masks
    current = masks.current(instants)
    previous = masks.previous(current, instants)
    generation = instants.latest(source.fast.generation_s)
    for (mask, before, latest), rows in row_groups(current, previous, generation):
        if mask == NONE:
            continue
        known = [i for i in (mask, before) if i != NONE and masks.position_of[i, slot] >= 0]
        if not known:
            result.reason[rows] = Reason.NOT_IN_MASK
            result.barred[rows] = True
            continue
        result.iodp[rows] = masks.iodp[known[0]]
        result.position[rows] = masks.position_of[known[0], slot]
        _fill(result, rows, source, slot, known, latest, instants.some(rows), mode, profile)
    gone = (current == NONE) | masks.expired(instants)
    result.reason[gone] = np.where(current[gone] == NONE, Reason.NO_MASK, Reason.MASK_EXPIRED)
    lost = source.reception.lost(instants)
    result.reason[lost] = Reason.LINK_LOST
    result.barred |= gone | lost
    result.usable &= ~result.barred
    return result


@dataclass(frozen=True, eq=False)
class _Heard:
    """A satellite's history at epochs: the mask and the place in it, the newest correction,
    whether it still serves, its stamp unless it is a cut, and the last cut with its UDREI."""

    history: History
    mask: int
    position: int
    newest: Ints
    alive: Bools
    good_s: Ints
    cut_s: Ints
    cut_udrei: Ints


def _fill(
    result: FastAt,
    rows: Ints,
    source: FastSource,
    slot: int,
    known: list[int],
    generation: int,
    instants: Instants,
    mode: Mode,
    profile: Profile,
) -> None:
    """Epochs at which certain masks name the satellite, and one generation is the latest."""
    fast, masks = source.fast, source.masks
    bar_s, bar_udrei = _gap(source, slot, known, generation, instants)
    lifted_s = np.full(rows.size, NEVER)
    heard: list[_Heard] = []
    for g in (generation, generation - 1):
        numbering = [i for i in known if g >= 0 and masks.iodp[i] == fast.generation_iodp[g]]
        if not numbering:
            continue
        position = int(masks.position_of[numbering[0], slot])
        history = fast.histories.get((int(fast.lane[g]), position))
        if history is None:
            continue
        found = _hear(history, numbering[0], position, source.reception, instants)
        heard.append(found)
        later = found.cut_s > bar_s
        bar_s = np.where(later, found.cut_s, bar_s)
        bar_udrei = np.where(later, found.cut_udrei, bar_udrei)
        lifted_s = np.maximum(lifted_s, found.good_s)
    open_ = np.ones(rows.size, bool)
    for found in heard:
        serves = open_ & found.alive & (found.history.time_s[found.newest] > bar_s)
        open_ &= ~serves
        use = np.flatnonzero(serves)
        if use.size:
            _correct(result, rows[use], source, found, use, instants.some(use), mode, profile)
    still = open_ & (bar_s > lifted_s)
    barred = rows[still]
    result.reason[barred] = result.udrei[barred] = bar_udrei[still]
    result.barred[barred] = True


def _gap(
    source: FastSource, slot: int, known: list[int], generation: int, instants: Instants
) -> tuple[Ints, Ints]:
    """(k,) second before the end of the last gap in reception that counts as "not monitored" for
    the satellite, as the mask of the fast corrections then named it; NEVER for none."""
    fast, masks, reception = source.fast, source.masks, source.reception
    gap_s = np.full(instants.second.size, NEVER)
    until = instants.second
    for g in (generation, generation - 1):
        if g < 0:
            break
        naming = [masks.time_s[i] for i in known if masks.iodp[i] == fast.generation_iodp[g]]
        end_s = reception.last_gap_s(until)
        if naming:
            counts = (end_s > naming[0]) & (end_s > instants.since_s)
            if g == generation:
                counts &= end_s > fast.generation_s[g]
            # The message that ends a gap may itself bring a correction: the gap lies before it.
            gap_s = np.maximum(gap_s, np.where(counts, end_s - 1, NEVER))
        until = np.minimum(until, fast.generation_s[g])
    return gap_s, np.full(gap_s.size, UDREI_NOT_MONITORED)


def _hear(
    history: History, mask: int, position: int, reception: Reception, instants: Instants
) -> _Heard:
    cuts = np.searchsorted(history.cut_s, instants.second, side="right")
    newest = instants.latest(history.time_s)
    alive = (newest >= 0) & (history.session[newest] == reception.session(instants.second))
    alive &= (history.cuts[newest] == cuts) & ~history.is_cut[newest]
    if history.cut_s.size:
        cut = (cuts > 0) & (history.cut_s[cuts - 1] > instants.since_s)
        cut_s = np.where(cut, history.cut_s[cuts - 1], NEVER)
        cut_udrei = history.cut_udrei[cuts - 1]
    else:
        cut_s = cut_udrei = np.full(cuts.size, NEVER)
    good = (newest >= 0) & ~history.is_cut[newest]
    good_s = np.where(good, history.time_s[newest], NEVER)
    return _Heard(history, mask, position, newest, alive, good_s, cut_s, cut_udrei)


def _correct(
    result: FastAt,
    at: Ints,
    source: FastSource,
    found: _Heard,
    use: Ints,
    when: Instants,
    mode: Mode,
    profile: Profile,
) -> None:
    """Fill rows `at` of the result from a history that serves."""
    history, position = found.history, found.position
    index = found.newest[use]
    iodp = int(source.masks.iodp[found.mask])
    session = source.reception.session(when.second)
    cuts = history.cuts[index]
    result.iodp[at], result.position[at] = iodp, position
    reason = np.zeros(use.size, np.int64)

    def because(code: Reason, where: Bools) -> None:
        reason[(reason == 0) & where] = code

    # Which UDREI holds, and since when (section J.2.2).
    t_fast = history.time_s[index]
    udrei, t_udre, t_used = history.udrei[index], t_fast.copy(), t_fast.copy()
    alarm = history.iodf[index] == IODF_ALARM
    if history.integrity_s.size:
        last = when.latest(history.integrity_s)
        valid = (last >= 0) & (history.integrity_s[last] > t_fast)
        valid &= (history.integrity_cuts[last] == cuts) & ~history.integrity_is_cut[last]
        valid &= source.reception.session(history.integrity_s[last]) == session
        t_integrity, iodf = history.integrity_s[last], history.integrity_iodf[last]
        is_alarm = valid & (iodf == IODF_ALARM)
        same = valid & (iodf == history.iodf[index]) & ~is_alarm
        other = valid & ~same & ~is_alarm
        udrei = np.where(is_alarm | same, history.integrity_udrei[last], udrei)
        t_udre = np.where(valid, t_integrity, t_udre)
        t_used = np.where(same, t_integrity, t_used)
        extended = (
            history.integrity_before_s[last]
            if profile == "glab"
            else history.integrity_of_s[last, history.iodf[index]]
        )
        t_used = np.where(other, np.maximum(t_fast, extended), t_used)
        alarm |= is_alarm
    pa = mode == "pa"
    old = when.expired(t_udre, UDREI_TIMEOUT_S[mode])
    if pa:
        old |= t_udre <= source.reception.void_before_s(when.second)
    because(Reason.UDREI_EXPIRED, old)
    if pa:
        because(Reason.UDREI_TOO_LARGE, udrei > LARGEST_PA_UDREI)

    # Degradation factor and time-outs of the satellite, of the same issue of the mask.
    own = np.flatnonzero(source.factors.iodp == iodp)
    if not own.size:  # the tables need a message; every epoch has a reason not to use it
        ais, latencies = np.zeros((1, SLOTS), np.int64), np.zeros(1, np.int64)
        d = np.full(use.size, -1)
    else:
        ais, latencies = source.factors.ai[own], source.factors.latency_s[own]
        d_time = source.factors.time_s[own]
        d = when.latest(d_time)
        because(
            Reason.FAST_DEGRADATION_EXPIRED,
            (d >= 0) & when.expired(d_time[d], SLOW_TIMEOUT_S[mode]),
        )
    because(Reason.NO_FAST_DEGRADATION, d < 0)
    ai, latency = ais[d, position], latencies[d]
    a = DEGRADATION_MPS2[ai]
    timeout = FAST_TIMEOUT_S[mode][ai]
    fast_old = when.expired(t_used, timeout)
    because(Reason.FAST_CORRECTION_EXPIRED, fast_old)
    slots = int(source.masks.position_of[found.mask].max()) + 1
    shortest = _shortest_timeout(ais, slots, mode, profile)[d, history.block[index]]

    previous = _previous(history, index, alarm, shortest, profile)
    if pa:
        because(Reason.ONE_FAST_CORRECTION, ~_has_previous(history, index))
    # An alarm in the correction before changes the rule as well.
    alarm |= (previous >= 0) & (history.iodf[previous] == IODF_ALARM)
    previous = _previous(history, index, alarm, shortest, profile)
    dt = np.where(previous >= 0, t_fast - history.time_s[previous], 1.0)
    rate = np.where(previous >= 0, (history.prc_m[index] - history.prc_m[previous]) / dt, 0.0)
    rated = (a > 0) & (previous >= 0)
    age_fast = when.age_s(t_fast)
    too_long, too_old = rated & (dt > shortest), rated & (age_fast > 8 * dt)
    because(Reason.ALARM_RANGE_RATE_STEP_TOO_LONG, too_long & alarm)
    because(Reason.ALARM_RANGE_RATE_TOO_OLD, too_old & alarm)
    because(Reason.RANGE_RATE_STEP_TOO_LONG, too_long & ~alarm)
    because(Reason.RANGE_RATE_TOO_OLD, too_old & ~alarm)
    b = _b_rrc(source.degradation, when, mode)
    in_sequence = (history.iodf[index] - history.iodf[previous]) % 3 == 1
    steady = np.where(in_sequence, 0.0, a * shortest / 4 + b / dt)
    alarmed = np.where(dt == shortest / 2, 0.0, a * np.abs(dt - shortest / 2) / 2 + b / dt)
    first_bit_age = age_fast + 1
    eps_rrc = np.where(alarm, alarmed, steady) * first_bit_age
    result.prc_m[at] = history.prc_m[index]
    result.rrc_m[at] = np.where(rated, rate * first_bit_age, 0.0)
    result.eps_rrc_m[at] = np.where(rated & ~np.isnan(eps_rrc), eps_rrc, 0.0)
    result.eps_fc_m[at] = a * (when.age_s(t_used) + 1 + latency) ** 2 / 2
    result.udrei[at] = udrei
    result.fast_expired_pa[at] = when.expired(t_used, FAST_TIMEOUT_S["pa"][ai])
    result.reason[at] = reason
    result.usable[at] = reason == 0


def _has_previous(history: History, index: Ints) -> Bools:
    before = np.maximum(index - 1, 0)
    has = (
        (index > 0)
        & (history.session[before] == history.session[index])
        & (history.cuts[before] == history.cuts[index])
        & ~history.is_cut[before]
    )
    return np.asarray(has)


def _previous(
    history: History, index: Ints, alarm: Bools, shortest: Floats, profile: Profile
) -> Ints:
    """(k,) the correction that the range rate is formed with; -1 where there is none."""
    previous = np.where(_has_previous(history, index), index - 1, -1)
    found: dict[tuple[int, float], int] = {}
    for k in np.flatnonzero(alarm & (previous >= 0)).tolist():  # alarms are rare
        key = int(index[k]), float(shortest[k])
        if key not in found:
            found[key] = _previous_in_alarm(history, *key, profile)
        previous[k] = found[key]
    return previous


def _previous_in_alarm(history: History, current: int, shortest: float, profile: Profile) -> int:
    """The correction about half a time-out before the current one: the nearest to it, or as gLAB
    has it the oldest that is younger, else the youngest within the time-out, else none."""
    low = current
    while _has_previous(history, np.array([low]))[0]:
        low -= 1
    candidates = np.arange(low, current)
    dt = history.time_s[current] - history.time_s[candidates]
    if profile == "mops":
        return int(candidates[np.argmin(np.abs(dt - shortest / 2))])
    short = candidates[dt < shortest / 2]
    middle = candidates[(dt >= shortest / 2) & (dt <= shortest)]
    return int(short[0] if short.size else middle[-1] if middle.size else -1)


def _shortest_timeout(ais: Ints, slots: int, mode: Mode, profile: Profile) -> Floats:
    """(d, 4) I_fc of range-rate corrections by message of type 7 and block of satellites [s].

    The shortest of the satellites in the same message; gLAB takes it over the whole mask but its
    last satellite.
    """
    timeout = FAST_TIMEOUT_S[mode][ais]
    if profile == "glab":
        whole = timeout[:, : max(slots - 1, 1)].min(axis=1)
        return np.repeat(whole[:, None], BLOCKS, axis=1)
    place = np.arange(SLOTS)
    in_block = (place // BLOCK == np.arange(BLOCKS)[:, None]) & (place < slots)
    of_block: Floats = np.where(in_block, timeout[:, None, :], np.inf).min(axis=2)
    return of_block


def _b_rrc(degradation: Degradation, when: Instants, mode: Mode) -> Floats:
    """(k,) B_rrc of the type 10 message that holds; NaN where none does."""
    index = when.latest(degradation.time_s)
    if not degradation.time_s.size:
        return np.full(index.size, np.nan)
    old = when.expired(degradation.time_s[index], SLOW_TIMEOUT_S[mode])
    return np.where((index < 0) | old, np.nan, degradation.b_rrc_m[index])
