"""Why a satellite has no full SBAS correction at an epoch: one code, the first that holds.

Numbers up to 48 are those that gLAB 6.0.0 prints in its SBASUNSEL messages, so that a comparison
is one of numbers; the words are our own.
"""

from __future__ import annotations

from enum import IntEnum


class Reason(IntEnum):
    """Reasons in the order in which they are looked for; 0 is none."""

    USED = 0
    NO_MASK = 7
    MASK_EXPIRED = 8
    NOT_IN_MASK = 9
    NO_DEGRADATION = 10
    DEGRADATION_EXPIRED = 11
    NO_FAST_CORRECTION = 12
    UDREI_EXPIRED = 13
    NOT_MONITORED = 14
    DO_NOT_USE = 15
    UDREI_TOO_LARGE = 16
    NO_FAST_DEGRADATION = 17
    FAST_DEGRADATION_EXPIRED = 18
    FAST_CORRECTION_EXPIRED = 19
    ONE_FAST_CORRECTION = 20
    ALARM_RANGE_RATE_STEP_TOO_LONG = 21
    ALARM_RANGE_RATE_TOO_OLD = 22
    RANGE_RATE_STEP_TOO_LONG = 23
    RANGE_RATE_TOO_OLD = 24
    SERVICE_EXPIRED = 25
    SERVICE_INCOMPLETE = 26
    NO_COVARIANCE = 27
    COVARIANCE_EXPIRED = 28
    NO_GEO_NAVIGATION = 29
    GEO_NAVIGATION_EXPIRED = 30
    GEO_URA = 31
    NO_LONG_TERM = 32
    LONG_TERM_EXPIRED = 33
    NO_MATCHING_EPHEMERIS = 34
    NO_EPHEMERIS = 35
    NO_IONO_MASK = 37
    IONO_MASK_EXPIRED = 38
    NOT_A_GRID_POINT = 39
    OUTSIDE_GRID = 40
    IONO_DO_NOT_USE = 41
    IONO_NOT_MONITORED = 42
    IONO_OUTSIDE_TRIANGLE = 44
    LOW_ELEVATION = 48
    LINK_LOST = 60
    WEAK_SIGNAL = 71
    SHORT_ARC = 72
    CYCLE_SLIP = 73
    OUTLIER = 74
    NO_PSEUDORANGE = 75
    NO_SOLUTION = 76
    NOT_A_RANGING_SATELLITE = 77


WORDS: dict[Reason, str] = {
    Reason.USED: "",
    Reason.NO_MASK: "no PRN mask",
    Reason.MASK_EXPIRED: "PRN mask expired",
    Reason.NOT_IN_MASK: "not in the PRN mask",
    Reason.NO_DEGRADATION: "no degradation parameters (MT10)",
    Reason.DEGRADATION_EXPIRED: "degradation parameters (MT10) expired",
    Reason.NO_FAST_CORRECTION: "no fast correction",
    Reason.UDREI_EXPIRED: "UDREI expired",
    Reason.NOT_MONITORED: "not monitored (UDREI 14)",
    Reason.DO_NOT_USE: "do not use (UDREI 15)",
    Reason.UDREI_TOO_LARGE: "UDREI 12 or 13",
    Reason.NO_FAST_DEGRADATION: "no fast correction degradation (MT7)",
    Reason.FAST_DEGRADATION_EXPIRED: "fast correction degradation (MT7) expired",
    Reason.FAST_CORRECTION_EXPIRED: "fast correction expired",
    Reason.ONE_FAST_CORRECTION: "only one fast correction yet",
    Reason.ALARM_RANGE_RATE_STEP_TOO_LONG: "fast corrections too far apart after an alarm",
    Reason.ALARM_RANGE_RATE_TOO_OLD: "range rate correction too old after an alarm",
    Reason.RANGE_RATE_STEP_TOO_LONG: "fast corrections too far apart for a range rate",
    Reason.RANGE_RATE_TOO_OLD: "range rate correction too old",
    Reason.SERVICE_EXPIRED: "service regions (MT27) expired",
    Reason.SERVICE_INCOMPLETE: "service regions (MT27) not complete",
    Reason.NO_COVARIANCE: "no clock-ephemeris covariance (MT28)",
    Reason.COVARIANCE_EXPIRED: "clock-ephemeris covariance (MT28) expired",
    Reason.NO_GEO_NAVIGATION: "no orbit of the SBAS satellite (MT9)",
    Reason.GEO_NAVIGATION_EXPIRED: "orbit of the SBAS satellite (MT9) expired",
    Reason.GEO_URA: "the SBAS satellite bars itself from ranging (URA 15)",
    Reason.NO_LONG_TERM: "no long-term correction",
    Reason.LONG_TERM_EXPIRED: "long-term correction expired",
    Reason.NO_MATCHING_EPHEMERIS: "no ephemeris of the issue that the correction is for",
    Reason.NO_EPHEMERIS: "no ephemeris",
    Reason.NO_IONO_MASK: "no ionospheric mask",
    Reason.IONO_MASK_EXPIRED: "ionospheric mask expired",
    Reason.NOT_A_GRID_POINT: "no ionospheric grid there",
    Reason.OUTSIDE_GRID: "outside the monitored ionospheric grid",
    Reason.IONO_DO_NOT_USE: "ionospheric grid point: do not use",
    Reason.IONO_NOT_MONITORED: "ionospheric grid points not monitored",
    Reason.IONO_OUTSIDE_TRIANGLE: "outside the triangle of monitored grid points",
    Reason.LINK_LOST: "messages lost, or an alarm of the SBAS satellite",
    Reason.LOW_ELEVATION: "below the elevation mask",
    Reason.WEAK_SIGNAL: "signal below the C/N0 mask",
    Reason.SHORT_ARC: "arc too short",
    Reason.CYCLE_SLIP: "cycle slip",
    Reason.OUTLIER: "residual far from those of the others",
    Reason.NO_PSEUDORANGE: "no pseudorange",
    Reason.NO_SOLUTION: "fewer than four satellites, or a degenerate geometry",
    Reason.NOT_A_RANGING_SATELLITE: "SBAS satellites are not used for ranging",
}
"""What each reason means, for tables and reports."""
