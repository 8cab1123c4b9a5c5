"""All corrections of one SBAS satellite over time, built once and looked up for all epochs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.decoding import decode
from sbas.augmentation.degradation import DegradationAt, degradation_at
from sbas.augmentation.delta_udre import CovarianceAt, covariance_of_slot
from sbas.augmentation.fast_corrections import FastAt, FastSource, Profile, fast_at
from sbas.augmentation.fast_history import FastTimeline, fast_timeline
from sbas.augmentation.ionospheric_grid import (
    IonosphericGrid,
    contradicted_grids_s,
    ionospheric_grid,
)
from sbas.augmentation.long_term import LongTermAt, last_of_other_issue, long_term_of_slot
from sbas.augmentation.message_types import Decoded
from sbas.augmentation.messages import SbasMessages
from sbas.augmentation.prn_masks import MaskTimeline, contradicted_masks_s, mask_timeline
from sbas.augmentation.reception import AlarmRule, Instants, Reception, receive
from sbas.augmentation.service_regions import RegionState, region_states
from sbas.augmentation.tables import Mode
from sbas.exceptions import InputError

Ints = NDArray[np.int64]

FLIGHT_TIME_S = 0.12
"""Assumed between the stamp of a message and its reception, as gLAB 6.0.0 does."""


@dataclass(frozen=True, eq=False)
class CorrectionTimeline:
    """What one SBAS satellite said, ready to be looked up at any epoch.

    `other_issue` is of `last_of_other_issue`; `alarms_ignored` counts messages of type 0 that
    were not taken as alarms, which makes a result one of a test signal; `contradicted_s` (c,)
    when masks came whose content is not that of their issue.
    """

    prn: int
    decoded: Decoded
    reception: Reception
    masks: MaskTimeline
    fast: FastTimeline
    grid: IonosphericGrid
    regions: tuple[RegionState, ...]
    other_issue: Ints
    alarms_ignored: int
    contradicted_s: Ints

    @property
    def void(self) -> Mapping[int, int]:
        """Messages whose content is not allowed, by type."""
        return self.decoded.void

    def degradation(self, instants: Instants, *, mode: Mode) -> DegradationAt:
        """Parameters of type 10 at epochs."""
        return degradation_at(self.decoded.degradation, instants, mode=mode)

    def fast_corrections(
        self, slot: int, instants: Instants, *, mode: Mode, profile: Profile
    ) -> FastAt:
        """Fast corrections of a satellite (slot 1-37 GPS, 120-158 SBAS) at epochs."""
        source = FastSource(
            self.masks,
            self.fast,
            self.decoded.fast_degradation,
            self.decoded.degradation,
            self.reception,
        )
        return fast_at(source, slot, instants, mode=mode, profile=profile)

    def long_term(self, slot: int, instants: Instants, *, mode: Mode) -> LongTermAt:
        """Long-term records of a satellite at epochs: rows of `decoded.long_term`."""
        return long_term_of_slot(
            self.decoded.long_term, self.other_issue, self.masks, slot, instants, mode=mode
        )

    def covariance(self, slot: int, instants: Instants, *, mode: Mode) -> CovarianceAt:
        """Clock-ephemeris covariance of a satellite at epochs: rows of `decoded.covariances`."""
        return covariance_of_slot(self.decoded.covariances, self.masks, slot, instants, mode=mode)


def correction_timeline(
    messages: SbasMessages,
    *,
    alarms: AlarmRule = "alarm",
    flight_time_s: float = FLIGHT_TIME_S,
) -> CorrectionTimeline:
    """Replay the messages of one satellite.

    Parameters
    ----------
    messages : of one PRN, such as `read_messages(path, prn=131)`.
    alarms : what type 0 means; "as_mt2" and "ignore" are for test signals only.
    flight_time_s : see `FLIGHT_TIME_S`.

    Raises
    ------
    InputError : messages of several satellites, or none.
    """
    if len(messages.prns) != 1:
        raise InputError(
            "corrections are those of one SBAS satellite",
            evidence=f"PRN {', '.join(map(str, messages.prns)) or 'none'}",
            cure="--geo PRN",
        )
    type_0 = int(np.count_nonzero(messages.kind == 0))
    kept, reception = receive(messages, alarms=alarms, flight_time_s=flight_time_s)
    decoded = decode(kept)
    contradicted = np.union1d(
        contradicted_masks_s(decoded.masks), contradicted_grids_s(decoded.iono_masks)
    )
    wiped_s = np.union1d(reception.alarm_s, contradicted - 1)
    reception = replace(reception, wiped_s=wiped_s)
    return CorrectionTimeline(
        messages.prns[0],
        decoded,
        reception,
        mask_timeline(decoded.masks, wiped_s),
        fast_timeline(decoded.fast, decoded.integrity, reception),
        ionospheric_grid(decoded.iono_masks, decoded.iono_delays, wiped_s),
        region_states(decoded.service_regions, wiped_s),
        last_of_other_issue(decoded.long_term),
        type_0 - reception.alarm_s.size,
        contradicted,
    )
