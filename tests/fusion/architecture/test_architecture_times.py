"""The grid of time and the motion on it; wrong ones are in test_architecture_check.py too."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import ModelError
from sbas.fusion.architecture.architecture_check import check_architecture
from sbas.fusion.architecture.architecture_times import MOST_SUBSTEPS, is_multiple
from sbas.fusion.architecture.model import (
    Architecture,
    Phase,
    SatelliteReceiver,
    SpeedProfile,
)

GOOD = Architecture("lab", (SatelliteReceiver("gps"),))


@given(st.integers(1, 100_000), st.floats(1e-6, 1e3))
def test_whole_multiples_are_multiples(count: int, short: float) -> None:
    assert is_multiple(count * short, short)
    assert not is_multiple((count + 0.5) * short, short)
    assert not is_multiple(short / (count + 1), short)


def test_the_longest_run_is_taken_and_one_step_more_is_not() -> None:
    long = replace(GOOD, profile=SpeedProfile((Phase(1.0, 0.0),), 20.0))
    longest = MOST_SUBSTEPS * 0.1
    assert check_architecture(replace(long, duration_s=longest)) == ()
    with pytest.raises(ModelError, match="too long"):
        check_architecture(replace(long, duration_s=longest + 1.0))


def test_only_the_phases_of_the_run_must_go_forward() -> None:
    braking = replace(
        GOOD, profile=SpeedProfile((Phase(10.0, 0.0), Phase(20.0, -5.0)), 10.0), duration_s=10.0
    )
    assert check_architecture(braking) == ()
    with pytest.raises(ModelError) as caught:
        check_architecture(replace(braking, duration_s=15.0))
    assert caught.value.evidence == "-15 m/s at 15 s"
