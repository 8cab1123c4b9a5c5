"""Degradation parameters (type 10) at epochs.

Source: RTCA DO-229D, A.4.4.6 and A.4.5.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.message_types import Degradation
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import SLOW_TIMEOUT_S, Mode

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class DegradationAt:
    """Parameters at (n,) epochs, 0 where no message of type 10 holds; names as in Degradation."""

    missing: Bools
    expired: Bools
    b_rrc_m: Floats
    c_ltc_lsb_m: Floats
    c_ltc_v1_mps: Floats
    i_ltc_v1_s: Floats
    c_ltc_v0_m: Floats
    i_ltc_v0_s: Floats
    c_geo_lsb_m: Floats
    c_geo_v_mps: Floats
    i_geo_s: Floats
    c_er_m: Floats
    c_iono_step_m: Floats
    i_iono_s: Floats
    c_iono_ramp_mps: Floats
    rss_udre: Floats
    rss_iono: Floats
    c_covariance: Floats

    @property
    def valid(self) -> Bools:
        """(n,) True where a message of type 10 holds."""
        good: Bools = ~(self.missing | self.expired)
        return good

    def some(self, rows: Ints) -> DegradationAt:
        """Some of the epochs."""
        return DegradationAt(*(getattr(self, field.name)[rows] for field in fields(self)))


def degradation_at(messages: Degradation, instants: Instants, *, mode: Mode) -> DegradationAt:
    """The latest message of type 10 at each epoch, unless it is older than its time-out."""
    index = instants.latest(messages.time_s)
    missing = index < 0
    if messages.time_s.size:
        expired = ~missing & instants.expired(messages.time_s[index], SLOW_TIMEOUT_S[mode])
    else:
        expired = np.zeros(index.size, bool)
    holds = ~(missing | expired)
    values = [
        np.where(holds, getattr(messages, field.name)[index].astype(float), 0.0)
        if messages.time_s.size
        else np.zeros(index.size)
        for field in fields(DegradationAt)[2:]
    ]
    return DegradationAt(missing, expired, *values)
