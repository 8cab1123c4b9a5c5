"""The L1 message types in physical units, all messages of a type at once.

Every class holds the messages of one satellite in the order of time. A message whose content
the standard does not allow is left out and counted in `Decoded.void`.
Source: RTCA DO-229D, A.4.4 (bit layouts), held against gLAB 6.0.0.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Masks:
    """Type 1: the satellites that other messages number. `prn_of` (n, 51) slot number of each
    mask position (1-37 GPS, 38-61 GLONASS, 120-158 SBAS), 0 beyond the last."""

    time_s: Ints
    iodp: Ints
    prn_of: Ints


@dataclass(frozen=True, eq=False)
class FastCorrections:
    """Types 0 (with content), 2 to 5 and 24, an entry a satellite: (n,) each."""

    time_s: Ints
    iodp: Ints
    iodf: Ints
    position: Ints
    prc_m: Floats
    udrei: Ints
    block: Ints


@dataclass(frozen=True, eq=False)
class Integrity:
    """Type 6: (n, 51) UDREI of every mask position and (n, 4) IODF of their blocks of 13."""

    time_s: Ints
    iodf: Ints
    udrei: Ints


@dataclass(frozen=True, eq=False)
class FastDegradation:
    """Type 7: latency (n,) [s] and degradation factor indicator (n, 51)."""

    time_s: Ints
    iodp: Ints
    latency_s: Ints
    ai: Ints


@dataclass(frozen=True, eq=False)
class GeoNavigation:
    """Type 9: the satellite's own orbit and clock; (n, 3) position [m], velocity, acceleration."""

    time_s: Ints
    t0_s: Ints
    ura: Ints
    position_m: Floats
    velocity_mps: Floats
    acceleration_mps2: Floats
    clock_s: Floats
    drift: Floats


@dataclass(frozen=True, eq=False)
class Degradation:
    """Type 10: (n,) degradation parameters, named as in RTCA DO-229D, table A-8."""

    time_s: Ints
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
    rss_udre: Bools
    rss_iono: Bools
    c_covariance: Floats


@dataclass(frozen=True, eq=False)
class Almanacs:
    """Type 17: (n,) places of SBAS satellites, coarse; position [m] and velocity (n, 3)."""

    time_s: Ints
    prn: Ints
    health: Ints
    t0_s: Ints
    position_m: Floats
    velocity_mps: Floats


@dataclass(frozen=True, eq=False)
class IonoMasks:
    """Type 18: which points of a band's grid are used; `point` (n, 201) bool."""

    time_s: Ints
    bands: Ints
    band: Ints
    iodi: Ints
    point: Bools


@dataclass(frozen=True, eq=False)
class LongTermCorrections:
    """Types 24 and 25: (n,) corrections of a satellite's broadcast orbit and clock.

    `velocity_code` 1 has rates and a time of day `t0_s`; else they are 0.
    """

    time_s: Ints
    iodp: Ints
    position: Ints
    iod: Ints
    velocity_code: Ints
    delta_m: Floats
    delta_rate_mps: Floats
    clock_s: Floats
    clock_rate: Floats
    t0_s: Ints


@dataclass(frozen=True, eq=False)
class IonoDelays:
    """Type 26: raw vertical delay (0.125 m) and GIVEI of the (n, 15) points of a block."""

    time_s: Ints
    band: Ints
    block: Ints
    iodi: Ints
    delay: Ints
    givei: Ints


@dataclass(frozen=True, eq=False)
class ServiceRegions:
    """Type 27: regions with factors on the UDRE; `corners_deg` (n, 5, 4): lat1, lon1, lat2, lon2
    of at most five, `rectangle` (n, 5)."""

    time_s: Ints
    iods: Ints
    messages: Ints
    number: Ints
    regions: Ints
    priority: Ints
    inside: Ints
    outside: Ints
    corners_deg: Ints
    rectangle: Bools


@dataclass(frozen=True, eq=False)
class ClockEphemerisCovariances:
    """Type 28: upper triangular factor R (n, 4, 4) of a satellite's covariance, scaled, and the
    scale factor (n,)."""

    time_s: Ints
    iodp: Ints
    position: Ints
    factor: Floats
    scale: Floats


@dataclass(frozen=True, eq=False)
class Decoded:
    """All messages of one satellite by type; `void` counts those whose content is not allowed."""

    masks: Masks
    fast: FastCorrections
    integrity: Integrity
    fast_degradation: FastDegradation
    geo_navigation: GeoNavigation
    degradation: Degradation
    almanacs: Almanacs
    iono_masks: IonoMasks
    long_term: LongTermCorrections
    iono_delays: IonoDelays
    service_regions: ServiceRegions
    covariances: ClockEphemerisCovariances
    void: Mapping[int, int]
