"""Broadcast orbits and clocks as arrays, one entry a record.

Units are SI and radians; times are seconds since the GPS epoch (1980-01-06), weeks included.
Source of the names: IS-GPS-200, table 20-III; RINEX 3.05, tables A6 and A12 (SBAS).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class KeplerEphemerides:
    """Records of one constellation with Keplerian elements, (k,) each, by PRN and `toe_s`.

    `iode` is the issue that SBAS long-term corrections refer to; `source` the data sources word
    of Galileo (0 for GPS), `fit_h` the fit interval [h] (0 where not stated). `iodc` is -1 and
    `ura_m` NaN where the file leaves them blank; `transmission_s` is `toe_s` where it is not
    known. Of Galileo `tgd_s` is the group delay of E5a against E1, `iodc` the same as `iode`.
    """

    prn: Ints
    toc_s: Floats
    toe_s: Floats
    transmission_s: Floats
    iode: Ints
    iodc: Ints
    health: Ints
    source: Ints
    fit_h: Floats
    ura_m: Floats
    af0_s: Floats
    af1: Floats
    af2: Floats
    tgd_s: Floats
    sqrt_a: Floats
    eccentricity: Floats
    i0: Floats
    idot: Floats
    omega0: Floats
    omega_dot: Floats
    omega: Floats
    m0: Floats
    delta_n: Floats
    cuc: Floats
    cus: Floats
    crc_m: Floats
    crs_m: Floats
    cic: Floats
    cis: Floats

    def __len__(self) -> int:
        return self.prn.size

    def counted_from(self, reference_s: float) -> KeplerEphemerides:
        """The same with times since another origin, a whole number of weeks after GPS's: small
        numbers keep their digits."""
        return replace(
            self,
            toc_s=self.toc_s - reference_s,
            toe_s=self.toe_s - reference_s,
            transmission_s=self.transmission_s - reference_s,
        )


@dataclass(frozen=True, eq=False)
class GeoEphemerides:
    """Records of SBAS satellites (k,), position, velocity and acceleration (k, 3) [m, s].

    `health` is as the file has it, 63 for a satellite that must not be used for ranging.
    """

    prn: Ints
    t0_s: Floats
    transmission_s: Floats
    position_m: Floats
    velocity_mps: Floats
    acceleration_mps2: Floats
    clock_s: Floats
    drift: Floats
    health: Ints
    ura_m: Floats
    iodn: Ints

    def __len__(self) -> int:
        return self.prn.size


@dataclass(frozen=True, eq=False)
class Navigation:
    """Everything a set of navigation files says.

    `klobuchar` is (alpha, beta), four numbers each, None where no file has them.
    """

    gps: KeplerEphemerides
    galileo: KeplerEphemerides
    geo: GeoEphemerides
    klobuchar: tuple[tuple[float, ...], tuple[float, ...]] | None
    leap_seconds: int | None
    findings: tuple[Finding, ...] = ()
