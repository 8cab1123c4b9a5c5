"""Ranges with broadcast orbits and clocks alone: what a receiver without SBAS works with.

Source: IS-GPS-200, 20.3.3 (clock, group delay, health); Galileo OS SIS ICD, 5.1 (orbit constants,
signal health), whose E1 ranges keep GPS's model of the ionosphere, the frequency being the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.positioning.corrected_ranges import WEEK_NS, CorrectedRanges
from sbas.positioning.measurements import Measurements, joined, measurements
from sbas.positioning.orbits import (
    GM_M3PS2,
    LIGHT_MPS,
    choose_records,
    kepler_clock_s,
    kepler_state,
)
from sbas.rinex.ephemerides import KeplerEphemerides, Navigation
from sbas.rinex.observations import Observations, SystemObservations

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

GALILEO_GM_M3PS2 = 3.986004418e14
_E1_HEALTH = 0b111
"""Data validity and health of E1-B in the Galileo health word."""
_F_NAV = 0b10
"""Data source: clocks and group delay of E5a against E1."""

_CODE_NAMES = {"G": "GPS C/A code (C1C)", "E": "Galileo E1 code (C1C or C1X)"}

UNHEALTHY, NO_URA, NO_RECORD = 101, 102, 103
REASON_WORDS = {
    UNHEALTHY: "the broadcast health forbids it",
    NO_URA: "no accuracy (URA, SISA) is broadcast",
    NO_RECORD: "no valid broadcast ephemeris",
}
"""Further reasons beside those of sbas.augmentation.reasons."""


@dataclass(frozen=True, eq=False)
class UnaugmentedRanges:
    """(k,) ranges with satellite places and clocks.

    `corrected` has no SBAS correction in it; `ura_m` (k,) broadcast accuracy; `clock` (k,) 0 for
    GPS, 1 for Galileo; `reason` (k,) why a range cannot serve.
    """

    measured: Measurements
    corrected: CorrectedRanges
    ura_m: Floats
    clock: Ints
    reason: Ints
    findings: tuple[Finding, ...]


def e1_observations(observed: SystemObservations) -> SystemObservations:
    """Galileo E1 under the names of GPS C/A: C1C where it was tracked, else C1X."""
    values = {}
    for kind in "CLS":
        given = [observed.values[c] for c in (f"{kind}1C", f"{kind}1X") if c in observed.values]
        if given:
            values[f"{kind}1C"] = given[0]
        if len(given) == 2:
            values[f"{kind}1C"] = np.where(np.isnan(given[0]), given[1], given[0])
    return replace(observed, values=values)


def unaugmented_ranges(
    observed: Observations, navigation: Navigation, *, systems: str, smoothing: bool, causal: bool
) -> UnaugmentedRanges:
    """Ranges of GPS L1 C/A ("G"), Galileo E1 ("E"), or both ("GE")."""
    parts = []
    for system in systems:
        own = observed.systems.get(system)
        if own is not None:
            own = e1_observations(own) if system == "E" else own
        if own is None or "C1C" not in own.values:
            raise InputError(
                f"the observations have no {_CODE_NAMES[system]}",
                evidence=f"systems {', '.join(observed.systems) or 'none'}",
                cure="log it, or give systems that the file has (--systems E, or GE)",
            )
        parts.append(measurements(own, smoothing=smoothing))
    measured = parts[0] if len(parts) == 1 else joined(*parts)
    findings: list[Finding] = []
    own_of = np.array([name[0] == "E" for name in measured.names], bool)
    clock = own_of[measured.satellite].astype(np.int64)
    k = len(measured)
    reference_ns = int(measured.time_ns[0] // WEEK_NS * WEEK_NS) if measured.time_ns.size else 0
    received_s = ((measured.time_ns - reference_ns) / 1e9)[measured.epoch]
    about_s = received_s - measured.raw_code_m / LIGHT_MPS
    place, clock_m = np.full((k, 3), np.nan), np.full(k, np.nan)
    relativity_m, tgd_m, ura_m = np.full(k, np.nan), np.full(k, np.nan), np.full(k, np.nan)
    iode, reason = np.full(k, -1), measured.reason.copy()
    for number, orbits in enumerate((navigation.gps, _galileo(navigation.galileo, findings))):
        mine = np.flatnonzero(clock == number)
        if not mine.size or not len(orbits):
            continue
        orbits = orbits.counted_from(reference_ns / 1e9)
        record = np.full(mine.size, -1)
        for column in np.unique(measured.satellite[mine]).tolist():
            rows = np.flatnonzero(measured.satellite[mine] == column)
            record[rows] = choose_records(
                orbits, int(measured.slot[column]), received_s[mine][rows], causal=causal
            )
        sent_s = about_s[mine] - kepler_clock_s(orbits, record, about_s[mine])
        state = kepler_state(orbits, record, sent_s)
        place[mine], clock_m[mine] = state.position_m, state.clock_s * LIGHT_MPS
        relativity_m[mine] = state.relativity_s * LIGHT_MPS
        tgd_m[mine] = state.tgd_s * LIGHT_MPS
        known = record >= 0
        at = np.maximum(record, 0)
        ura_m[mine] = np.where(known, orbits.ura_m[at], np.nan)
        iode[mine] = np.where(known, orbits.iode[at], -1)
        health = orbits.health[at] & (_E1_HEALTH if number else -1)
        why = np.where(known & (health != 0), UNHEALTHY, 0)
        why = np.where((why == 0) & known & ~(ura_m[mine] > 0), NO_URA, why)
        reason[mine] = np.where(reason[mine] == 0, why, reason[mine])
    # Nobody knows the group delay of a satellite that does not say: GPS's is then 0.
    tgd_m = np.where(np.isnan(tgd_m) & np.isfinite(clock_m), 0.0, tgd_m)
    reason[(reason == 0) & np.isnan(place).any(axis=1)] = NO_RECORD
    zero, none, no = np.zeros(k), np.full(k, -1), np.zeros(k, bool)
    corrected = CorrectedRanges(
        reason, no, reason > 0, none, np.full(k, np.nan), zero, zero, zero, zero, zero, zero, zero,
        place, clock_m, relativity_m, tgd_m, iode, none,
    )  # fmt: skip
    return UnaugmentedRanges(
        replace(measured, reason=reason), corrected, ura_m, clock, reason, tuple(findings)
    )


def _galileo(orbits: KeplerEphemerides, findings: list[Finding]) -> KeplerEphemerides:
    """Galileo's records with clocks that fit the group delay, for the gravity constant of GPS.

    The mean motion is the root of GM / A^3 plus delta n: the difference of the constants goes
    into delta n.
    """
    if not len(orbits):
        return orbits
    fits = (orbits.source & _F_NAV) != 0
    if fits.any():
        orbits = KeplerEphemerides(**{name: v[fits] for name, v in vars(orbits).items()})
    else:
        findings.append(
            Finding(
                "E28", "warning", "Galileo clocks of I/NAV with the group delay of E5a",
                evidence="no record of F/NAV",
                cure="ranges err by the difference of two group delays, some 0.1 m; give "
                "navigation with F/NAV",
            )
        )  # fmt: skip
    more = (np.sqrt(GALILEO_GM_M3PS2) - np.sqrt(GM_M3PS2)) / orbits.sqrt_a**3
    return replace(orbits, delta_n=orbits.delta_n + more)
