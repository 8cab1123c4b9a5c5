"""Long-term corrections of broadcast orbits and clocks, at epochs.

Source: RTCA DO-229D, A.4.4.7 (types 24 and 25), A.4.5.1.3 (degradation), J.2.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.message_types import LongTermCorrections
from sbas.augmentation.prn_masks import NONE, MaskTimeline, latest_of_slot
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import SLOTS, SLOW_TIMEOUT_S, Mode

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

DAY_S = 86400


@dataclass(frozen=True, eq=False)
class LongTermAt:
    """Records that hold at (n,) epochs: the newest, and the last one of another issue before it.

    `row` and `before` are rows of the messages, -1 where there is none; `expired` and
    `before_expired` for the mode, True where there is none.
    """

    row: Ints
    before: Ints
    expired: Bools
    before_expired: Bools


def last_of_other_issue(messages: LongTermCorrections) -> Ints:
    """(m,) row of the last record of the same satellite with another issue of ephemeris than the
    run of equal ones that each record belongs to; -1 for none."""
    m = messages.iod.size
    satellite = messages.iodp * SLOTS + messages.position
    order = np.lexsort((np.arange(m), satellite))
    same = np.diff(satellite[order]) == 0
    begins = np.ones(m, bool)
    begins[1:] = ~same | (np.diff(messages.iod[order]) != 0)
    first = np.ones(m, bool)
    first[1:] = ~same
    start = np.maximum.accumulate(np.where(begins, np.arange(m), 0))
    before = np.full(m, NONE)
    before[order] = np.where(first[start], NONE, order[start - 1])
    return before


def long_term_of_slot(
    messages: LongTermCorrections,
    other_issue: Ints,
    masks: MaskTimeline,
    slot: int,
    instants: Instants,
    *,
    mode: Mode,
) -> LongTermAt:
    """Long-term records of a satellite at epochs.

    Parameters
    ----------
    other_issue : of `last_of_other_issue`.
    """
    row = latest_of_slot(masks, slot, messages.time_s, messages.iodp, messages.position, instants)
    return _with_the_issue_before(messages, row, other_issue, instants, mode)


def _with_the_issue_before(
    messages: LongTermCorrections, row: Ints, other_issue: Ints, instants: Instants, mode: Mode
) -> LongTermAt:
    if not messages.time_s.size:
        gone = np.ones(row.size, bool)
        return LongTermAt(row, row, gone, gone)
    before = np.where(row >= 0, other_issue[row], NONE)
    before[messages.time_s[before] <= instants.since_s] = NONE

    def expired(rows: Ints) -> Bools:
        old = instants.expired(messages.time_s[rows], SLOW_TIMEOUT_S[mode])
        return np.asarray((rows == NONE) | old)

    return LongTermAt(row, before, expired(row), expired(before))


@dataclass(frozen=True, eq=False)
class OrbitClockCorrection:
    """Corrections at (n,) transmission times: (n, 3) position [m], clock [s], degradation [m]."""

    delta_m: Floats
    clock_s: Floats
    eps_ltc_m: Floats


def orbit_clock_correction(
    messages: LongTermCorrections,
    row: Ints,
    transmission_time_s: Floats,
    instants: Instants,
    degradation: DegradationAt,
) -> OrbitClockCorrection:
    """Corrections of (n,) records; zero where `row` is -1.

    Parameters
    ----------
    transmission_time_s : (n,) GPS seconds; the time of applicability is one of the day.
    degradation : parameters of type 10 at the epochs; without them there is no degradation term.
    """
    n = row.size
    delta, clock, eps = np.zeros((n, 3)), np.zeros(n), np.zeros(n)
    have = np.flatnonzero(row >= 0)
    if not have.size:
        return OrbitClockCorrection(delta, clock, eps)
    r = row[have]
    rates = messages.velocity_code[r] == 1
    since = day_difference_s(transmission_time_s[have], messages.t0_s[r])
    elapsed = np.where(rates, since, 0.0)
    delta[have] = messages.delta_m[r] + messages.delta_rate_mps[r] * elapsed[:, None]
    clock[have] = messages.clock_s[r] + messages.clock_rate[r] * elapsed
    first_bit_age = instants.some(have).age_s(messages.time_s[r]) + 1
    d = degradation
    fixed = d.c_ltc_v0_m[have] * whole_steps(first_bit_age, d.i_ltc_v0_s[have])
    moving = outside_interval(since, d.i_ltc_v1_s[have], d.c_ltc_lsb_m[have], d.c_ltc_v1_mps[have])
    eps[have] = np.where(rates, moving, fixed)
    return OrbitClockCorrection(delta, clock, eps)


def day_difference_s(time_s: Floats, time_of_day_s: Ints) -> Floats:
    """Time since a time of day that lies within half a day [s]."""
    difference = (time_s - time_of_day_s) % DAY_S
    nearest: Floats = np.where(difference > DAY_S / 2, difference - DAY_S, difference)
    return nearest


def whole_steps(age_s: Floats, interval_s: Floats) -> Floats:
    """Whole intervals in an age; 0 where the interval is 0. Rounding errors never lose one."""
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = np.floor(age_s / interval_s + 1e-9)
    return np.where(interval_s > 0, steps, 0.0)


def outside_interval(since_s: Floats, interval_s: Floats, step_m: Floats, rate: Floats) -> Floats:
    """Degradation outside the interval of validity: a step, and a rate with the time outside.

    Source: RTCA DO-229D, A.4.5.1.3.1 (velocity code 1) and A.4.5.1.3.3 (type 9).
    """
    inside = (since_s > 0) & (since_s < interval_s)
    late = np.maximum(0.0, np.maximum(-since_s, since_s - interval_s))
    return np.where(inside, 0.0, step_m + rate * late)
