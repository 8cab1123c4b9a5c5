"""Which SBAS and broadcast data hold for each range: looked up a satellite at a time.

Source: RTCA DO-229D, A.4.4 and J.2.2; Filip, Bazant, Mocek 2010, section 2.3 (which data a
precision and a non-precision approach need).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.fast_corrections import Profile
from sbas.augmentation.long_term import LongTermAt
from sbas.augmentation.reasons import Reason
from sbas.augmentation.reception import Instants
from sbas.augmentation.tables import SLOW_TIMEOUT_S, Mode
from sbas.augmentation.timeline import CorrectionTimeline
from sbas.positioning.geo_orbits import geo_navigation_at
from sbas.positioning.measurements import FIRST_SBAS_SLOT
from sbas.positioning.orbits import choose_records
from sbas.rinex.ephemerides import KeplerEphemerides

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class DataRules:
    """Which data serve; see ReceiverSettings."""

    mode: Mode
    profile: Profile
    causal: bool


@dataclass(eq=False)
class RangeData:
    """(k,) data of every range.

    `record`, `long_term` and `geo` are rows of broadcast records, long-term corrections and type
    9 messages, -1 where none serves; `old_for_pa` where slow data are past what a precision
    approach allows; other names as in CorrectedRanges.
    """

    reason: Ints
    full: Bools
    barred: Bools
    udrei: Ints
    prc_m: Floats
    rrc_m: Floats
    eps_fc_m: Floats
    eps_rrc_m: Floats
    record: Ints
    long_term: Ints
    geo: Ints
    old_for_pa: Bools
    covariance_row: Ints
    iode: Ints

    @classmethod
    def empty(cls, k: int) -> RangeData:
        def none() -> Ints:
            return np.full(k, -1, np.int64)

        def zero() -> Floats:
            return np.zeros(k)

        def no() -> Bools:
            return np.zeros(k, bool)

        return cls(
            reason=np.zeros(k, np.int64), full=no(), barred=no(), udrei=none(), prc_m=zero(),
            rrc_m=zero(), eps_fc_m=zero(), eps_rrc_m=zero(), record=none(), long_term=none(),
            geo=none(), old_for_pa=no(), covariance_row=none(), iode=none(),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class UdreFactors:
    """Which messages give the factor on the UDRE at (n,) epochs: of type 27, or of type 28."""

    by_region: Bools
    by_covariance: Bools


def udre_factors(timeline: CorrectionTimeline, instants: Instants, profile: Profile) -> UdreFactors:
    """Type 28 where it is sent and 27 is not, and the other way round; neither where both are.

    gLAB goes by what has been heard up to an epoch. By default a satellite that sends one of them
    at all is known to send it: before the first one came, there is no factor to rely on.
    """
    times = (timeline.decoded.service_regions.time_s, timeline.decoded.covariances.time_s)
    if profile == "glab":
        regions, covariances = (instants.latest(time_s) >= 0 for time_s in times)
    else:
        regions, covariances = (np.full(instants.second.size, time_s.size > 0) for time_s in times)
    return UdreFactors(regions & ~covariances, covariances & ~regions)


def look_up(
    out: RangeData,
    rows: Ints,
    slot: int,
    timeline: CorrectionTimeline,
    orbits: KeplerEphemerides,
    instants: Instants,
    received_s: Floats,
    rules: DataRules,
) -> None:
    """Fill the rows of one satellite.

    Parameters
    ----------
    slot : its number in the PRN mask: 1-37 GPS, 120-158 SBAS.
    instants, received_s : of its rows; seconds on the time scale of `orbits`.
    """
    fast = timeline.fast_corrections(slot, instants, mode=rules.mode, profile=rules.profile)
    reason = fast.reason.copy()
    covariance = timeline.covariance(slot, instants, mode=rules.mode)
    by_covariance = udre_factors(timeline, instants, rules.profile).by_covariance
    if rules.mode == "pa":
        _because(reason, Reason.NO_COVARIANCE, by_covariance & (covariance.row < 0))
        _because(reason, Reason.COVARIANCE_EXPIRED, by_covariance & covariance.expired)
    if slot >= FIRST_SBAS_SLOT:
        slow, old = _own_orbit(out, rows, reason, timeline, instants, rules.mode)
        located = slow
    else:
        slow, old = _long_term(
            out, rows, reason, timeline, orbits, slot, instants, received_s, rules
        )
        located = out.record[rows] >= 0
        reason[~located] = Reason.NO_EPHEMERIS
    out.reason[rows] = reason
    out.full[rows] = fast.usable & slow
    out.barred[rows] = fast.barred | ~located
    out.udrei[rows] = fast.udrei
    for name in ("prc_m", "rrc_m", "eps_fc_m", "eps_rrc_m"):
        getattr(out, name)[rows] = np.where(fast.usable, getattr(fast, name), 0.0)
    old |= by_covariance & covariance.expired_pa
    if rules.profile == "mops":
        old |= fast.fast_expired_pa
    out.old_for_pa[rows] = old
    out.covariance_row[rows] = np.where(covariance.expired, -1, covariance.row)


def _because(reason: Ints, code: Reason, where: Bools) -> None:
    reason[(reason == 0) & where] = code


def _own_orbit(
    out: RangeData,
    rows: Ints,
    reason: Ints,
    timeline: CorrectionTimeline,
    instants: Instants,
    mode: Mode,
) -> tuple[Bools, Bools]:
    """(k,) True where the SBAS satellite's own orbit serves, and where it is past what a precision
    approach allows."""
    void = timeline.reception.void_before_s(instants.second)
    found = geo_navigation_at(timeline.decoded.geo_navigation, instants, void, mode=mode)
    serves = (found.row >= 0) & ~found.expired & ~found.barred
    # Without its place a satellite is of no use in any mode: this reason goes before the others.
    reason[found.row < 0] = Reason.NO_GEO_NAVIGATION
    reason[found.expired] = Reason.GEO_NAVIGATION_EXPIRED
    reason[found.barred] = Reason.GEO_URA
    out.geo[rows] = np.where(serves, found.row, -1)
    return serves, found.expired_pa


def _long_term(
    out: RangeData,
    rows: Ints,
    reason: Ints,
    timeline: CorrectionTimeline,
    orbits: KeplerEphemerides,
    slot: int,
    instants: Instants,
    received_s: Floats,
    rules: DataRules,
) -> tuple[Bools, Bools]:
    """(k,) True where a long-term correction and its broadcast record serve, and where the
    correction is past what a precision approach allows."""
    lt = timeline.decoded.long_term
    found = timeline.long_term(slot, instants, mode=rules.mode)
    _because(reason, Reason.NO_LONG_TERM, found.row < 0)
    _because(reason, Reason.LONG_TERM_EXPIRED, found.expired)
    row, record, expired = _matching_record(found, lt.iod, orbits, slot, received_s, rules.causal)
    _because(reason, Reason.NO_MATCHING_EPHEMERIS, (row >= 0) & ~expired & (record < 0))
    slow = (row >= 0) & ~expired & (record >= 0)
    lacking = np.flatnonzero(~slow)
    if lacking.size:
        record = record.copy()
        record[lacking] = choose_records(orbits, slot, received_s[lacking], causal=rules.causal)
    out.record[rows] = record
    out.long_term[rows] = np.where(slow, row, -1)
    out.iode[rows] = np.where(slow, lt.iod[row] if lt.iod.size else -1, -1)
    stamp = lt.time_s[np.maximum(row, 0)] if lt.iod.size else row
    return slow, (row >= 0) & instants.expired(stamp, SLOW_TIMEOUT_S["pa"])


def _matching_record(
    found: LongTermAt,
    iod: Ints,
    orbits: KeplerEphemerides,
    slot: int,
    received_s: Floats,
    causal: bool,
) -> tuple[Ints, Ints, Bools]:
    """(k,) long-term row, the broadcast record of its issue, and whether the row has expired; the
    issue before it serves as long as no record of the new one has come."""
    row, expired = found.row, found.expired
    if not iod.size:
        return row, np.full(row.size, -1), expired
    record = choose_records(
        orbits, slot, received_s, np.where(row >= 0, iod[row], -1), causal=causal
    )
    older = np.flatnonzero((record < 0) & (found.before >= 0) & ~found.before_expired)
    if older.size:
        before = choose_records(
            orbits, slot, received_s[older], iod[found.before[older]], causal=causal
        )
        swap = older[before >= 0]
        row, record, expired = row.copy(), record.copy(), expired.copy()
        row[swap], record[swap], expired[swap] = found.before[swap], before[before >= 0], False
    return row, record, expired
