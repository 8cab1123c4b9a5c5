"""Findings of sound architectures: each is provoked, and gone once its cure is followed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from sbas.fusion.architecture.architecture_check import check_architecture
from sbas.fusion.architecture.architecture_warnings import warnings_of
from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Missing,
    Odometer,
    SatelliteReceiver,
    Unmodelled,
)

ODO, ACC, GPS = Odometer("odo"), Accelerometer("acc"), SatelliteReceiver("gps")
GOOD = Architecture("lab", (ODO, ACC, GPS))
PULLED = replace(GPS, missing=Missing("remove", renormalise=False))

CASES = {
    "no receiver": (
        replace(GOOD, sensors=(ODO, ACC)), GOOD, "sensors", "no satellite receiver",
    ),
    "removed, not renormalised": (
        replace(GOOD, sensors=(ODO, ACC, PULLED)), GOOD, "sensors.gps.missing.renormalise",
        "drawn to the origin",
    ),
    "weights of a filter": (
        replace(GOOD, operator="kalman", weights="fixed", fixed_weights=(0.5, 0.25, 0.25)),
        replace(GOOD, operator="kalman"), "weights", "takes no weights",
    ),
    "detection beside a filter": (
        replace(GOOD, operator="kalman", fault_detection="leave_one_out"),
        replace(GOOD, operator="kalman"), "fault_detection", "of its own",
    ),
    "leave one of two out": (
        replace(GOOD, sensors=(ODO, GPS), fault_detection="leave_one_out"),
        replace(GOOD, sensors=(ODO, GPS)), "fault_detection", "never removes",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_each_warning_is_provoked_and_cured(name: str) -> None:
    doubtful, cured, where, words = CASES[name]
    (finding,) = check_architecture(doubtful)
    assert (finding.code, finding.severity, finding.where) == ("E28", "warning", where)
    assert words in finding.message
    assert finding.cure
    assert check_architecture(cured) == ()


def test_a_description_says_that_it_is_one() -> None:
    (finding,) = warnings_of(replace(GOOD, sensors=(GPS, Unmodelled("gyro", "gyroscope"))))
    assert finding.severity == "info"
    assert finding.evidence == "gyro (gyroscope)"
