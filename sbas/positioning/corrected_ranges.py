"""Everything SBAS says of each range that does not depend on where the receiver is.

Fast, range-rate and long-term corrections, the satellite's place and clock, and the terms of
sigma_flt but the factor on the UDRE. Source: RTCA DO-229D, A.4.4 and A.4.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.degradation import DegradationAt
from sbas.augmentation.long_term import orbit_clock_correction
from sbas.augmentation.reasons import Reason
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import UDRE_VARIANCE_M2
from sbas.augmentation.timeline import CorrectionTimeline
from sbas.positioning.geo_orbits import geo_clock_s, geo_state
from sbas.positioning.measurements import Measurements
from sbas.positioning.orbits import LIGHT_MPS, kepler_clock_s, kepler_state
from sbas.positioning.satellite_corrections import DataRules, RangeData, look_up
from sbas.rinex.ephemerides import KeplerEphemerides

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

WEEK_NS = 604_800 * 1_000_000_000


@dataclass(frozen=True, eq=False)
class CorrectedRanges:
    """(k,) ranges with their corrections; in the order of the measurements.

    `reason` why a range cannot serve in the mode; `full` True where fast and long-term
    corrections serve; `barred` True where SBAS forbids the satellite in any mode, or nobody knows
    where it is. Ranges and epsilons in m; `satellite_m` (k, 3) at transmission, long-term
    correction applied; `clock_m` and `relativity_m` of the satellite's clock, c times seconds.
    """

    reason: Ints
    full: Bools
    barred: Bools
    udrei: Ints
    sigma_udre_m: Floats
    prc_m: Floats
    rrc_m: Floats
    eps_fc_m: Floats
    eps_rrc_m: Floats
    eps_ltc_m: Floats
    eps_er_m: Floats
    clock_correction_m: Floats
    satellite_m: Floats
    clock_m: Floats
    relativity_m: Floats
    tgd_m: Floats
    iode: Ints
    covariance_row: Ints

    def some(self, rows: Ints | Bools) -> CorrectedRanges:
        """Some of the ranges."""
        return CorrectedRanges(*(values[rows] for values in vars(self).values()))


def corrected_ranges(
    measured: Measurements,
    timeline: CorrectionTimeline,
    ephemerides: KeplerEphemerides,
    instants: Instants,
    degradation: DegradationAt,
    rules: DataRules,
) -> CorrectedRanges:
    """Corrections of every range.

    Parameters
    ----------
    instants, degradation : of every row of `measured`.
    """
    reference_ns = int(measured.time_ns[0] // WEEK_NS * WEEK_NS) if measured.time_ns.size else 0
    reference_s = reference_ns / 1e9
    orbits = ephemerides.counted_from(reference_s)
    received_s = (instants.time_ns - reference_ns) / 1e9
    data = RangeData.empty(len(measured))
    for column in np.unique(measured.satellite).tolist():
        rows = np.flatnonzero(measured.satellite == column)
        look_up(
            data, rows, int(measured.slot[column]), timeline, orbits, instants.some(rows),
            received_s[rows], rules,
        )  # fmt: skip
    # The clock is wanted at transmission, which depends on it: its own size is near enough.
    about_s = received_s - measured.raw_code_m / LIGHT_MPS
    sent_s = about_s - kepler_clock_s(orbits, data.record, about_s)
    slow = orbit_clock_correction(
        timeline.decoded.long_term, data.long_term, sent_s + reference_s, instants, degradation
    )
    state = kepler_state(
        orbits, data.record, sent_s - slow.clock_s,
        relativity="motion" if rules.profile == "glab" else "elements",
    )  # fmt: skip
    position, eps_slow = state.position_m + slow.delta_m, slow.eps_ltc_m
    clock, relativity_s, group_delay = state.clock_s, state.relativity_s, state.tgd_s
    geo = np.flatnonzero(data.geo >= 0)
    if geo.size:
        own, row = timeline.decoded.geo_navigation, data.geo[geo]
        sent = about_s[geo] + reference_s
        sent = sent - geo_clock_s(own, row, sent)
        at = geo_state(own, row, sent, degradation.some(geo))
        position[geo], clock[geo], eps_slow[geo] = at.position_m, at.clock_s, at.eps_geo_m
        relativity_s[geo] = group_delay[geo] = 0.0
    npa = rules.mode == "npa"
    variance = UDRE_VARIANCE_M2[np.clip(data.udrei, 0, 15)]
    return CorrectedRanges(
        data.reason if npa else _with_degradation(data.reason, degradation),
        data.full,
        data.barred,
        data.udrei,
        np.where(data.udrei >= 0, np.sqrt(variance), np.nan),
        data.prc_m,
        data.rrc_m,
        data.eps_fc_m,
        data.eps_rrc_m,
        eps_slow,
        np.where(npa & data.old_for_pa, degradation.c_er_m, 0.0),
        slow.clock_s * LIGHT_MPS,
        position,
        (clock + slow.clock_s) * LIGHT_MPS,
        relativity_s * LIGHT_MPS,
        group_delay * LIGHT_MPS,
        data.iode,
        data.covariance_row,
    )


def _with_degradation(reason: Ints, degradation: DegradationAt) -> Ints:
    """Reasons of a precision approach, which needs type 10: it is looked for before the fast
    corrections, so its codes go before theirs."""
    late = ((reason == 0) | (reason >= Reason.NO_FAST_CORRECTION)) & (reason != Reason.LINK_LOST)
    reason = np.where(late & degradation.missing, Reason.NO_DEGRADATION, reason)
    return np.where(late & degradation.expired, Reason.DEGRADATION_EXPIRED, reason)
