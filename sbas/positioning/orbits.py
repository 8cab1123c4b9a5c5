"""Satellite positions and clocks from broadcast records, for many times at once.

Source: IS-GPS-200, tables 20-III and 20-IV (orbit), 20.3.3.3.3.1 (clock and relativity).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sbas.rinex.ephemerides import KeplerEphemerides

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LIGHT_MPS = 299792458.0
GM_M3PS2 = 3.986005e14
EARTH_RATE_RADPS = 7.2921151467e-5
RELATIVITY = -4.442807633e-10
"""-2 sqrt(GM) / c^2 [s / sqrt(m)]."""
WEEK_S = 604_800
KEPLER_STEPS = 8
KEPLER_ENOUGH_RAD = 1e-14

RelativityRule = Literal["elements", "motion"]
"""`elements`: F e sqrt(a) sin E, with which broadcast clocks are fitted; `motion`: -2 r.v / c^2
of the broadcast orbit with its harmonics, as gLAB 6.0.0 has it. They differ by some 12 mm."""


@dataclass(frozen=True, eq=False)
class SatelliteState:
    """Satellites at (n,) times, earth-fixed at that time.

    `position_m` (n, 3); `clock_s` the broadcast offset without relativity and group delay;
    `relativity_s` its relativistic part; `tgd_s` the group delay of L1.
    """

    position_m: Floats
    clock_s: Floats
    relativity_s: Floats
    tgd_s: Floats


def kepler_state(
    ephemerides: KeplerEphemerides,
    record: Ints,
    time_s: Floats,
    *,
    relativity: RelativityRule = "elements",
) -> SatelliteState:
    """Satellites of (n,) records at (n,) times [s since the GPS epoch].

    Rows with `record` -1 are NaN.
    """
    missing = record < 0
    if not len(ephemerides):
        nothing = np.full(record.size, np.nan)
        return SatelliteState(np.full((record.size, 3), np.nan), nothing, nothing, nothing)
    e = _chosen(ephemerides, np.where(missing, 0, record))
    axis = e["sqrt_a"] ** 2
    tk = time_s - e["toe_s"]
    motion = np.sqrt(GM_M3PS2 / axis**3) + e["delta_n"]
    eccentric = eccentric_anomaly(e["m0"] + motion * tk, e["eccentricity"])
    sine, cosine = np.sin(eccentric), np.cos(eccentric)
    root = np.sqrt(1 - e["eccentricity"] ** 2)
    closeness = 1 - e["eccentricity"] * cosine
    argument = np.arctan2(root * sine, cosine - e["eccentricity"]) + e["omega"]
    s2, c2 = np.sin(2 * argument), np.cos(2 * argument)
    u = argument + e["cus"] * s2 + e["cuc"] * c2
    r = axis * closeness + e["crs_m"] * s2 + e["crc_m"] * c2
    inclination = e["i0"] + e["idot"] * tk + e["cis"] * s2 + e["cic"] * c2
    node = (
        e["omega0"]
        + (e["omega_dot"] - EARTH_RATE_RADPS) * tk
        - EARTH_RATE_RADPS * (e["toe_s"] % WEEK_S)
    )
    x, y = r * np.cos(u), r * np.sin(u)
    sin_n, cos_n = np.sin(node), np.cos(node)
    across = y * np.cos(inclination)
    position = np.stack(
        [x * cos_n - across * sin_n, x * sin_n + across * cos_n, y * np.sin(inclination)], axis=-1
    )
    if relativity == "elements":
        effect = RELATIVITY * e["eccentricity"] * e["sqrt_a"] * sine
    else:
        # Only the radius changes along the position: r.v = r dr/dt.
        swing = e["crs_m"] * c2 - e["crc_m"] * s2
        rate = axis * e["eccentricity"] * sine + 2 * swing * root / closeness
        effect = -2 * r * rate * motion / closeness / LIGHT_MPS**2
    clock = _polynomial(e, time_s)
    for values in (position, clock, effect):
        values[missing] = np.nan
    return SatelliteState(position, clock, effect, np.where(missing, np.nan, e["tgd_s"]))


def eccentric_anomaly(mean_rad: Floats, eccentricity: Floats) -> Floats:
    """(n,) root E of E - e sin E = M by Newton's method; e of navigation satellites is small."""
    anomaly: Floats = mean_rad + eccentricity * np.sin(mean_rad)
    for _ in range(KEPLER_STEPS):
        excess = anomaly - eccentricity * np.sin(anomaly) - mean_rad
        change = excess / (1 - eccentricity * np.cos(anomaly))
        anomaly = anomaly - change
        # Newton's method is quadratic: after a step below 1e-7 the next one is rounding.
        if np.nanmax(np.abs(change), initial=0.0) < KEPLER_ENOUGH_RAD**0.5:
            break
    return anomaly


def kepler_clock_s(ephemerides: KeplerEphemerides, record: Ints, time_s: Floats) -> Floats:
    """(n,) broadcast clock offset without relativity [s]; NaN where `record` is -1."""
    if not len(ephemerides):
        return np.full(record.size, np.nan)
    e = _chosen(ephemerides, np.maximum(record, 0), ("toc_s", "af0_s", "af1", "af2"))
    return np.where(record >= 0, _polynomial(e, time_s), np.nan)


def _polynomial(e: dict[str, Floats], time_s: Floats) -> Floats:
    since = time_s - e["toc_s"]
    return e["af0_s"] + e["af1"] * since + e["af2"] * since**2


_ELEMENTS = (
    "toc_s", "toe_s", "af0_s", "af1", "af2", "tgd_s", "sqrt_a", "eccentricity", "i0", "idot",
    "omega0", "omega_dot", "omega", "m0", "delta_n", "cuc", "cus", "crc_m", "crs_m", "cic", "cis",
)  # fmt: skip


def _chosen(
    ephemerides: KeplerEphemerides, record: Ints, names: tuple[str, ...] = _ELEMENTS
) -> dict[str, Floats]:
    return {name: getattr(ephemerides, name)[record] for name in names}


def rotated_by_flight(position_m: Floats, receiver_m: Floats) -> Floats:
    """(n, 3) satellite positions at transmission, earth-fixed at reception (Sagnac effect).

    Parameters
    ----------
    position_m : (n, 3), earth-fixed at transmission.
    receiver_m : (n, 3) or (3,).
    """
    flight_s = length(position_m - receiver_m) / LIGHT_MPS
    angle = EARTH_RATE_RADPS * flight_s
    sine, cosine = np.sin(angle), np.cos(angle)
    x, y, z = position_m[..., 0], position_m[..., 1], position_m[..., 2]
    return np.stack([x * cosine + y * sine, y * cosine - x * sine, z], axis=-1)


def length(vector: Floats) -> Floats:
    """(n,) Euclidean length of (n, 3) vectors."""
    size: Floats = np.sqrt(np.einsum("...i,...i->...", vector, vector))
    return size


def choose_records(
    ephemerides: KeplerEphemerides,
    prn: int,
    time_s: Floats,
    iode: Ints | None = None,
    *,
    causal: bool = False,
) -> Ints:
    """(n,) record of a satellite for each time; -1 where none is within half its fit interval.

    Parameters
    ----------
    iode : (n,) issue wanted; None takes any. Of several records of an issue that one is taken
        which was transmitted nearest to the time.
    causal : only records already transmitted by then.
    """
    own = np.flatnonzero(ephemerides.prn == prn)
    best = np.full(time_s.size, -1)
    distance = np.full(time_s.size, np.inf)
    for row in own.tolist():
        fit_h = ephemerides.fit_h[row]
        half_s = (fit_h if fit_h > 0 else 4.0) * 3600 / 2
        good = np.abs(time_s - ephemerides.toe_s[row]) <= half_s
        if iode is not None:
            good &= iode == ephemerides.iode[row]
        since = time_s - ephemerides.transmission_s[row]
        if causal:
            good &= since >= 0
        nearer = good & (np.abs(since) < distance)
        best[nearer] = row
        distance[nearer] = np.abs(since)[nearer]
    return best
