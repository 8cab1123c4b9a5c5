"""Orbit and clock of the SBAS satellite itself, from its own message of type 9.

Source: RTCA DO-229D, A.4.4.11 (type 9) and A.4.5.1.4 (degradation of the navigation message).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.long_term import day_difference_s, outside_interval
from sbas.augmentation.message_types import GeoNavigation
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import SLOW_TIMEOUT_S, Mode

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

URA_DO_NOT_USE = 15


@dataclass(frozen=True, eq=False)
class GeoNavigationAt:
    """Messages that hold at (n,) epochs: rows, -1 where there is none, and what bars them."""

    row: Ints
    expired: Bools
    expired_pa: Bools
    barred: Bools


def geo_navigation_at(
    messages: GeoNavigation, instants: Instants, void_before_s: Ints, *, mode: Mode
) -> GeoNavigationAt:
    """The latest message of type 9 at each epoch.

    Parameters
    ----------
    void_before_s : (n,) damage to the link voids messages up to this second: the satellite must
        prove itself anew before it serves as a ranging source.
    """
    row = instants.latest(messages.time_s)
    if not messages.time_s.size:
        no = np.zeros(row.size, bool)
        return GeoNavigationAt(row, no, no, no)
    stamp = messages.time_s[row]
    row = np.where(stamp <= void_before_s, -1, row)
    have = row >= 0
    return GeoNavigationAt(
        row,
        have & instants.expired(stamp, SLOW_TIMEOUT_S[mode]),
        have & instants.expired(stamp, SLOW_TIMEOUT_S["pa"]),
        have & (messages.ura[row] >= URA_DO_NOT_USE),
    )


@dataclass(frozen=True, eq=False)
class GeoState:
    """The satellite at (n,) times: (n, 3) position [m] earth-fixed at that time, clock offset [s]
    and degradation of the message [m]."""

    position_m: Floats
    clock_s: Floats
    eps_geo_m: Floats


def geo_state(
    messages: GeoNavigation, row: Ints, transmission_time_s: Floats, degradation: DegradationAt
) -> GeoState:
    """Position, clock and eps_geo of (n,) messages at (n,) transmission times [GPS seconds]."""
    since = day_difference_s(transmission_time_s, messages.t0_s[row])
    d = since[:, None]
    position = (
        messages.position_m[row]
        + messages.velocity_mps[row] * d
        + messages.acceleration_mps2[row] * d**2 / 2
    )
    return GeoState(
        position,
        geo_clock_s(messages, row, transmission_time_s),
        outside_interval(
            since, degradation.i_geo_s, degradation.c_geo_lsb_m, degradation.c_geo_v_mps
        ),
    )


def geo_clock_s(messages: GeoNavigation, row: Ints, time_s: Floats) -> Floats:
    """(n,) clock offset of the satellite [s] at (n,) times [GPS seconds]."""
    since = day_difference_s(time_s, messages.t0_s[row])
    clock: Floats = messages.clock_s[row] + messages.drift[row] * since
    return clock
