"""Observations of one or more RINEX files as arrays over epochs and satellites."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sbas.findings import Finding

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ObservationHeader:
    """What the header of an observation file says.

    `position_m` is the approximate antenna position, earth-fixed, None where it is absent or
    zero; `antenna_delta_m` height, east, north of the antenna above the marker; `codes` the
    observation codes of each system in file order; `time_scale` that of the file (the arrays
    are in GPS time); `scale` what values in the file must be divided by, where that is not 1.
    """

    version: float
    marker: str
    receiver: str
    antenna: str
    position_m: tuple[float, float, float] | None
    antenna_delta_m: tuple[float, float, float]
    interval_s: float | None
    time_scale: str
    leap_seconds: int | None
    codes: Mapping[str, tuple[str, ...]]
    scale: Mapping[tuple[str, str], int] = field(default_factory=dict)
    strength_unit: str = ""


@dataclass(frozen=True, eq=False)
class SystemObservations:
    """Observations of one system.

    Parameters
    ----------
    time : (n,) GPS time of the receiver's clock, the same array for all systems.
    satellites : (m,) names such as G05, sorted.
    values : (n, m) by code; metres, cycles, Hz or dB-Hz as in the file, NaN where there is none.
    loss_of_lock, strength : (n, m) digits by code, -1 where blank.
    """

    time: NDArray[np.datetime64]
    satellites: tuple[str, ...]
    values: Mapping[str, Floats]
    loss_of_lock: Mapping[str, NDArray[np.int8]]
    strength: Mapping[str, NDArray[np.int8]]


@dataclass(frozen=True, eq=False)
class Observations:
    """Observations by system letter (G, R, E, C, J, S, I), with the first file's header."""

    header: ObservationHeader
    systems: Mapping[str, SystemObservations]
    findings: tuple[Finding, ...] = ()
