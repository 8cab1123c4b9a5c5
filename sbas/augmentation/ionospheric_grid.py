"""The ionospheric grid over time: masks, vertical delays and their GIVE at every point.

Source: RTCA DO-229D, A.4.4.9 (type 18), A.4.4.10 (type 26), A.4.5.1.5 (degradation).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.grid_points import BAND_POINTS, BANDS, NO_POINT
from sbas.augmentation.long_term import whole_steps
from sbas.augmentation.message_types import IonoDelays, IonoMasks
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import (
    DELAY_DO_NOT_USE,
    GIVE_VARIANCE_M2,
    GIVEI_NOT_MONITORED,
    IONO_DELAY_TIMEOUT_S,
)
from sbas.timescales import NS_PER_S

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

BLOCK_POINTS = 15
_POINTS = BANDS * BAND_POINTS
_SPAN = np.int64(1) << 40
"""Above any GPS second: keys of (point, second) stay apart."""


class PointState(IntEnum):
    """What a grid point is at an epoch."""

    USABLE = 0
    NOT_MONITORED = 1
    DO_NOT_USE = 2
    NOT_IN_MASK = 3


@dataclass(frozen=True, eq=False)
class _Series:
    """Values of points over time: keys of point and second, sorted, and the row of each."""

    key: Ints
    second: Ints

    def latest(self, point: Ints, second: Ints) -> Ints:
        """Index of the latest entry of each point; -1 where there is none."""
        found: Ints = np.searchsorted(self.key, point * _SPAN + second, side="right") - 1
        if self.key.size:
            found[self.key[found] // _SPAN != point] = -1
        return np.where(point == NO_POINT, -1, found)


@dataclass(frozen=True, eq=False)
class IonosphericGrid:
    """Grid of one satellite.

    Parameters
    ----------
    issue_s : (g,) when each issue of the mask became current.
    mask_s : (k,) every message of type 18.
    updates : delays by point and the second from which they hold; with `stamp_s` (u,) when they
        were sent, raw `delay`, `givei` and the `issue` they are of.
    bits : mask bits by point and second, with `bit` and `bit_issue`.
    """

    issue_s: Ints
    mask_s: Ints
    updates: _Series
    stamp_s: Ints
    delay: Ints
    givei: Ints
    issue: Ints
    bits: _Series
    bit: Bools
    bit_issue: Ints


def contradicted_grids_s(masks: IonoMasks) -> Ints:
    """(c,) when a band's mask came with the issue in force and other content; see
    `sbas.augmentation.prn_masks.contradicted_masks_s`."""
    found = []
    last: dict[tuple[int, int], int] = {}
    issue = -1
    for row, (iodi, band) in enumerate(zip(masks.iodi.tolist(), masks.band.tolist(), strict=True)):
        if iodi != issue:
            last = {key: value for key, value in last.items() if key[0] == issue}
            issue = iodi
        before = last.get((iodi, band))
        if before is not None and not np.array_equal(masks.point[before], masks.point[row]):
            found.append(int(masks.time_s[row]))
        last[iodi, band] = row
    return np.array(found, np.int64)


def ionospheric_grid(masks: IonoMasks, delays: IonoDelays, alarm_s: Ints) -> IonosphericGrid:
    """Replay masks and delays in the order of time.

    A block of delays that comes before its mask waits for it, and then holds with its own stamp.
    """
    kind = np.concatenate([np.zeros(masks.time_s.size), np.ones(delays.time_s.size)])
    row = np.concatenate([np.arange(masks.time_s.size), np.arange(delays.time_s.size)])
    time_s = np.concatenate([masks.time_s, delays.time_s])
    order = np.lexsort((kind, time_s))
    alarms = np.searchsorted(alarm_s, time_s, side="left")
    current = previous = None
    known: dict[tuple[int, int], Ints] = {}
    waiting: dict[tuple[int, int, int], int] = {}
    issue, last_alarm = -1, 0
    issue_s: list[int] = []
    applied: list[tuple[Ints, int, int, int]] = []
    seen: list[tuple[int, int, int]] = []

    def apply(delay: int, from_s: int, of_issue: int) -> None:
        band, block = int(delays.band[delay]), int(delays.block[delay])
        numbers = known[int(delays.iodi[delay]), band]
        chosen = numbers[BLOCK_POINTS * block : BLOCK_POINTS * (block + 1)]
        applied.append((band * BAND_POINTS + chosen, delay, from_s, of_issue))

    for at in order.tolist():
        if alarms[at] != last_alarm:
            last_alarm = int(alarms[at])
            current = previous = None
            known, waiting = {}, {}
        i, second = int(row[at]), int(time_s[at])
        if kind[at] == 0:
            iodi, band = int(masks.iodi[i]), int(masks.band[i])
            if iodi != current:
                previous, current = current, iodi
                issue += 1
                issue_s.append(second)
                known = {key: value for key, value in known.items() if key[0] == previous}
            # A mask that comes again with the same issue has the same content.
            if band < BANDS and (iodi, band) not in known:
                known[iodi, band] = np.flatnonzero(masks.point[i])
                seen.append((i, second, issue))
                for key in [k for k in waiting if k[:2] == (iodi, band)]:
                    apply(waiting.pop(key), second, issue)
            continue
        iodi, band = int(delays.iodi[i]), int(delays.band[i])
        if iodi in (current, previous) and (iodi, band) in known:
            apply(i, second, issue if iodi == current else issue - 1)
        else:
            waiting[iodi, band, int(delays.block[i])] = i
    return _grid(masks, delays, issue_s, applied, seen)


def _grid(
    masks: IonoMasks,
    delays: IonoDelays,
    issue_s: list[int],
    applied: list[tuple[Ints, int, int, int]],
    seen: list[tuple[int, int, int]],
) -> IonosphericGrid:
    sizes = np.array([points.size for points, *_ in applied], np.int64)
    point = np.concatenate([points for points, *_ in applied]) if applied else sizes
    delay_row, from_s, of_issue = (
        np.repeat(np.array([entry[k] for entry in applied], np.int64), sizes) for k in (1, 2, 3)
    )
    within = np.arange(point.size) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    order = np.lexsort((np.arange(point.size), from_s, point))
    band = masks.band[[i for i, *_ in seen]] if seen else sizes[:0]
    bit_point = (band[:, None] * BAND_POINTS + np.arange(BAND_POINTS)).reshape(-1)
    bit_s, bit_issue = (
        np.repeat(np.array([entry[k] for entry in seen], np.int64), BAND_POINTS) for k in (1, 2)
    )
    bit = masks.point[[i for i, *_ in seen]].reshape(-1) if seen else np.empty(0, bool)
    bit_order = np.lexsort((bit_s, bit_point))
    return IonosphericGrid(
        np.array(issue_s, np.int64),
        masks.time_s,
        _Series((point * _SPAN + from_s)[order], from_s[order]),
        delays.time_s[delay_row][order] if delay_row.size else delay_row,
        delays.delay[delay_row, within][order] if delay_row.size else delay_row,
        delays.givei[delay_row, within][order] if delay_row.size else delay_row,
        of_issue[order],
        _Series((bit_point * _SPAN + bit_s)[bit_order], bit_s[bit_order]),
        bit[bit_order],
        bit_issue[bit_order],
    )


@dataclass(frozen=True, eq=False)
class PointsAt:
    """Grid points at epochs: state, vertical delay [m], its variance with degradation [m2]."""

    state: Ints
    delay_m: Floats
    variance_m2: Floats


def points_in_mask(
    grid: IonosphericGrid, point: Ints, instants: Instants, *, needs_data: bool
) -> Bools:
    """(n, k) True where points are in the mask of the current issue or of the one before.

    Parameters
    ----------
    point : (n, k) identities, -1 for none.
    needs_data : a point counts only once a delay for it has come (as gLAB has it).
    """
    issue = instants.latest(grid.issue_s)[:, None]
    second, since = instants.second[:, None], instants.since_s[:, None]
    if needs_data:
        index = grid.updates.latest(point, np.broadcast_to(second, point.shape))
        if not grid.issue.size:
            return np.zeros(point.shape, bool)
        inside = (grid.issue[index] >= issue - 1) & (grid.updates.second[index] > since)
        return np.asarray((index >= 0) & (issue >= 0) & inside)
    index = grid.bits.latest(point, np.broadcast_to(second, point.shape))
    if not grid.bit.size:
        return np.zeros(point.shape, bool)
    inside = grid.bit[index] & (grid.bit_issue[index] >= issue - 1)
    inside &= grid.bits.second[index] > since
    return np.asarray((index >= 0) & (issue >= 0) & inside)


def points_at_epochs(
    grid: IonosphericGrid,
    point: Ints,
    in_mask: Bools,
    instants: Instants,
    degradation: DegradationAt,
) -> PointsAt:
    """State, delay and variance of (n, k) points at (n,) epochs.

    The variance is that of the GIVE with the degradation of its age: added to the sigma, or to
    the variance where the type 10 message says so (RSS_iono).
    """
    shape = point.shape
    if not grid.delay.size:
        nothing = np.full(shape, np.nan)
        state = np.where(in_mask, PointState.NOT_MONITORED, PointState.NOT_IN_MASK)
        return PointsAt(state, nothing, nothing)
    index = grid.updates.latest(point, np.broadcast_to(instants.second[:, None], shape))
    issue = instants.latest(grid.issue_s)[:, None]
    have = (index >= 0) & (grid.issue[index] >= issue - 1)
    have &= grid.updates.second[index] > instants.since_s[:, None]
    raw, givei, stamp = grid.delay[index], grid.givei[index], grid.stamp_s[index]
    age_ns = instants.time_ns[:, None] - stamp * NS_PER_S
    expired = age_ns - instants.flight_time_ns > IONO_DELAY_TIMEOUT_S * NS_PER_S
    silent = ~have | expired | (givei == GIVEI_NOT_MONITORED)
    state = np.where(silent, PointState.NOT_MONITORED, PointState.USABLE)
    state = np.where(have & ~expired & (raw == DELAY_DO_NOT_USE), PointState.DO_NOT_USE, state)
    state = np.where(in_mask, state, PointState.NOT_IN_MASK)
    d = degradation
    first_bit_age_s = age_ns / NS_PER_S + 1
    steps = whole_steps(first_bit_age_s, d.i_iono_s[:, None])
    eps = d.c_iono_step_m[:, None] * steps + d.c_iono_ramp_mps[:, None] * first_bit_age_s
    give = GIVE_VARIANCE_M2[givei]
    variance = np.where(d.rss_iono[:, None] > 0, give + eps**2, (np.sqrt(give) + eps) ** 2)
    usable = state == PointState.USABLE
    return PointsAt(
        state, np.where(usable, 0.125 * raw, np.nan), np.where(usable, variance, np.nan)
    )
