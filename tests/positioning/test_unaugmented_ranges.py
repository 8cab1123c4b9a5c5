from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sbas.findings import Finding
from sbas.positioning.orbits import kepler_state
from sbas.positioning.unaugmented_ranges import _galileo, e1_observations
from sbas.rinex.ephemerides import KeplerEphemerides
from sbas.rinex.navigation_file import read_navigation
from sbas.rinex.observations import SystemObservations

NAVIGATION = "data/rinex/ELKO00USA_R_20182100000_01D_MN.rnx.gz"


def steps_between_records(orbits: KeplerEphemerides) -> float:
    """Median distance [m] of two successive records half way between them."""
    orbits = orbits.counted_from(float(orbits.toe_s[0] // 604_800 * 604_800))
    pairs = []
    for prn in np.unique(orbits.prn):
        own = np.flatnonzero(orbits.prn == prn)
        own = own[np.argsort(orbits.toe_s[own])]
        after = orbits.toe_s[own[1:]] - orbits.toe_s[own[:-1]]
        near = (after > 0) & (after <= 7200)
        pairs.append(np.stack([own[:-1][near], own[1:][near]]))
    first, second = np.concatenate(pairs, axis=1)
    middle = (orbits.toe_s[first] + orbits.toe_s[second]) / 2
    one, two = (kepler_state(orbits, record, middle).position_m for record in (first, second))
    return float(np.median(np.linalg.norm(one - two, axis=1)))


def test_galileo_orbits_have_galileos_constant_of_gravity(reference_data: Path) -> None:
    """Broadcast records meet each other far better with the constant they were fitted with."""
    orbits = read_navigation(reference_data / NAVIGATION).galileo
    fits = (orbits.source & 2) != 0
    chosen = KeplerEphemerides(**{name: v[fits] for name, v in vars(orbits).items()})
    findings: list[Finding] = []
    assert steps_between_records(_galileo(orbits, findings)) < 0.5 * steps_between_records(chosen)
    assert not findings


def test_clocks_that_do_not_fit_the_group_delay_are_named(reference_data: Path) -> None:
    orbits = read_navigation(reference_data / NAVIGATION).galileo
    findings: list[Finding] = []
    _galileo(replace(orbits, source=np.full(len(orbits), 517)), findings)
    assert [f.code for f in findings] == ["E28"]


def test_e1_is_what_was_tracked() -> None:
    nan = np.nan
    values = {
        "C1C": np.array([[1.0, nan]]), "C1X": np.array([[9.0, 2.0]]), "S1X": np.array([[40.0, 41]]),
    }  # fmt: skip
    time = np.array(["2024-01-01"], "M8[ns]")
    found = e1_observations(SystemObservations(time, ("E01", "E02"), values, {}, {})).values
    assert found["C1C"].tolist() == [[1.0, 2.0]]
    assert found["S1C"].tolist() == [[40.0, 41.0]]
    assert "L1C" not in found
