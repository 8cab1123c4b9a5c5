"""Numbers of an architecture by path: every one is found, replaced alone, or refused."""

from __future__ import annotations

import re

import pytest

from sbas.exceptions import ModelError
from sbas.fusion.architecture.architecture_parameters import parameter_paths, with_parameter
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Bursts,
    Odometer,
    Redundancy,
    SatelliteReceiver,
)

ARCHITECTURE = Architecture(
    "two odometers",
    (Odometer("odo"), Odometer("odo 2"), Accelerometer("acc"), SatelliteReceiver("gps")),
    weights="fixed",
    fixed_weights=(0.2, 0.2, 0.2, 0.4),
    redundancy=(Redundancy(("odo", "odo 2"), "per_run", 0.5),),
)
PATHS = parameter_paths(ARCHITECTURE)


def test_paths_of_every_kind() -> None:
    assert {
        "odo.scale_sd", "odo 2.slip.largest", "gps.multipath.largest", "filter.gate", "step_s",
        "profile.phases.0.until_s", "fixed_weights.3", "redundancy.0.share",
        "thresholds.alert_limit_m", "acc.failure_rate_per_h",
    } <= set(PATHS)  # fmt: skip
    assert not {p for p in PATHS if p.endswith(("name", "source", "renormalise", "policy"))}


def test_replaces_that_number_and_no_other() -> None:
    changed = with_parameter(ARCHITECTURE, "gps.multipath.largest", 12.0)
    assert changed.sensors[:3] == ARCHITECTURE.sensors[:3]
    assert changed.sensors[3] == SatelliteReceiver("gps", multipath=Bursts(1 / 60, 5.0, 1.5, 12.0))
    assert with_parameter(ARCHITECTURE, "filter.gate", 6.63).filter.gate == 6.63
    assert with_parameter(ARCHITECTURE, "fixed_weights.1", 0.1).fixed_weights == (
        0.2,
        0.1,
        0.2,
        0.4,
    )
    profile = with_parameter(ARCHITECTURE, "profile.phases.1.until_s", 80.0).profile
    assert [phase.until_s for phase in profile.phases] == [40.0, 80.0, 100.0]


@pytest.mark.parametrize("path", PATHS)
def test_every_path_leads_to_a_number_of_its_own(path: str) -> None:
    changed = with_parameter(ARCHITECTURE, path, 77.0)
    assert parameter_paths(changed) == PATHS
    # Read by another way: the text of the architecture holds the number once more.
    assert len(re.findall(r"\b77\.0\b", repr(changed))) == 1
    assert with_parameter(changed, path, 78.0) == with_parameter(ARCHITECTURE, path, 78.0)


@pytest.mark.parametrize(
    ("path", "cure"),
    [
        ("gps.multipath.bigest", "did you mean 'gps.multipath.largest'?"),
        ("gsp.white_m", "did you mean 'gps.white_m'?"),
        ("gps", "allowed are"),
        ("", "allowed are"),
        ("gps.name", "allowed are"),
    ],
)
def test_unknown_path_names_the_nearest(path: str, cure: str) -> None:
    with pytest.raises(ModelError) as caught:
        with_parameter(ARCHITECTURE, path, 1.0)
    assert cure in caught.value.cure
    assert caught.value.where == path


def test_one_path_twice() -> None:
    with pytest.raises(ModelError) as caught:
        parameter_paths(Architecture("alike", (Odometer("odo"), Odometer("odo"))))
    assert caught.value.where == "odo.scale_sd"
