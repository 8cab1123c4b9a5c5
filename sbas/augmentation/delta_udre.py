"""Factor on the UDRE at epochs, by clock-ephemeris covariance or by service regions.

Source: RTCA DO-229D, A.4.4.13 (type 27), A.4.4.16 and A.4.5.2 (type 28), J.2.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.message_types import ClockEphemerisCovariances
from sbas.augmentation.prn_masks import NONE, MaskTimeline, latest_of_slot
from sbas.augmentation.reception import Instants
from sbas.augmentation.row_groups import row_groups
from sbas.augmentation.service_regions import RegionState, region_factor
from sbas.augmentation.tables import SERVICE_TIMEOUT_S, SLOW_TIMEOUT_S, Mode

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CovarianceAt:
    """Messages of type 28 that hold at (n,) epochs: rows, -1 for none, and which are too old for
    the mode and for precision approach; `expired` is True and `expired_pa` False for none."""

    row: Ints
    expired: Bools
    expired_pa: Bools


def covariance_of_slot(
    messages: ClockEphemerisCovariances,
    masks: MaskTimeline,
    slot: int,
    instants: Instants,
    *,
    mode: Mode,
) -> CovarianceAt:
    """The covariance of a satellite at epochs, under the current mask or the one before."""
    row = latest_of_slot(masks, slot, messages.time_s, messages.iodp, messages.position, instants)
    return _judged(messages, row, instants, mode)


def _judged(
    messages: ClockEphemerisCovariances, row: Ints, instants: Instants, mode: Mode
) -> CovarianceAt:
    none = row == NONE
    if not messages.time_s.size:
        return CovarianceAt(row, none, ~none)
    stamp = messages.time_s[row]
    expired = none | instants.expired(stamp, SLOW_TIMEOUT_S[mode])
    return CovarianceAt(row, expired, ~none & instants.expired(stamp, SLOW_TIMEOUT_S["pa"]))


def covariance_factor(
    messages: ClockEphemerisCovariances,
    row: Ints,
    line_of_sight: Floats,
    c_covariance: Floats,
) -> Floats:
    """(n,) factor |R I| + C_covariance SF; 1 where `row` is -1.

    Parameters
    ----------
    line_of_sight : (n, 3) unit vectors from the receiver to the satellite, earth-fixed; the
        fourth component of I is 1. Source: RTCA DO-229D, A.4.5.2.
    """
    factor = np.ones(row.size)
    have = np.flatnonzero(row >= 0)
    if have.size:
        r = messages.factor[row[have]]
        seen = np.column_stack([line_of_sight[have], np.ones(have.size)])
        length = np.linalg.norm(np.einsum("nij,nj->ni", r, seen), axis=1)
        factor[have] = length + c_covariance[have] * messages.scale[row[have]]
    return factor


def service_factor(
    states: tuple[RegionState, ...], instants: Instants, lat_deg: Floats, lon_deg: Floats
) -> tuple[Floats, Bools, Bools]:
    """(n,) factor by type 27, True where no set is complete, and True where it has expired; the
    factor is 1 in both.

    Parameters
    ----------
    lat_deg, lon_deg : (n,) receiver.
    """
    n = instants.second.size
    factor, incomplete, expired = np.ones(n), np.ones(n, bool), np.zeros(n, bool)
    at = instants.latest(np.array([state.from_s for state in states], np.int64))
    for (k,), here in row_groups(at):
        complete = states[k].complete if k >= 0 else None
        if complete is None:
            continue
        when = instants.some(here)
        factor[here] = region_factor(complete, states[k].begun, lat_deg[here], lon_deg[here])
        incomplete[here] = False
        latest = states[k].complete_s[when.latest(states[k].complete_s)]
        expired[here] = when.expired(latest, SERVICE_TIMEOUT_S)
    factor[expired] = 1.0
    return factor, incomplete, expired
