"""The motion against the closed form of its phases."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.fusion.architecture.model import Phase, SpeedProfile
from sbas.fusion.simulation.speed_profile import (
    accelerations_mps2,
    positions_m,
    speeds_mps,
)

DEFAULT = SpeedProfile()


def test_default_profile_check_values() -> None:
    """Page causal-analysis, section 5: at most 20 m/s and 1350 m after 100 s."""
    speed = speeds_mps(DEFAULT, 0.1, 1000)
    assert speed.max() == pytest.approx(20.0, abs=1e-12)
    assert speed[[99, 399, 700, 874]] == pytest.approx([5.0, 20.0, 20.0, 10.0], abs=1e-9)
    assert speed[-1] == pytest.approx(0.0, abs=1e-9)
    assert (speed >= 0).all()
    assert positions_m(DEFAULT, 0.1, 1000)[-1] == pytest.approx(1350.0, abs=1e-9)


def test_right_rectangles_exactly() -> None:
    """Constant acceleration from a stand: sum of a k h^2, k = 1..n, is a h^2 n (n + 1) / 2."""
    profile = SpeedProfile((Phase(1.0, 0.5),))
    n, h = np.arange(1, 301), 0.2
    assert positions_m(profile, h, 300) == pytest.approx(0.5 * h**2 * n * (n + 1) / 2, rel=1e-13)


@pytest.mark.parametrize("substep_s", [0.05, 0.1, 0.2, 0.5, 1.0])
def test_phases_hold_up_to_their_end(substep_s: float) -> None:
    count = round(100 / substep_s)
    phase = [round(until / substep_s) for until in (40, 75, 100)]
    expected = np.repeat([0.5, 0.0, -0.8], np.diff(phase, prepend=0))
    assert (accelerations_mps2(DEFAULT, substep_s, count) == expected).all()


def test_phase_ends_are_met_up_to_rounding() -> None:
    """3 x 0.1 is more than 0.3 in binary numbers; the third sub-step is in the phase."""
    profile = SpeedProfile((Phase(0.3, 1.0), Phase(0.7, 0.0), Phase(1.0, 2.0)))
    expected = np.repeat([1.0, 0.0, 2.0], [3, 4, 3])
    assert (accelerations_mps2(profile, 0.1, 10) == expected).all()


def test_phase_ends_within_a_substep() -> None:
    """The speed is that of the motion all the same: 0.5 m/s2 for 0.7 s, then 1 m/s2."""
    profile = SpeedProfile((Phase(0.7, 0.5), Phase(1.0, 1.0)), start_speed_mps=3.0)
    assert speeds_mps(profile, 0.5, 3) == pytest.approx([3.25, 3.65, 4.15], rel=1e-14)
    assert (accelerations_mps2(profile, 0.5, 3) == [0.5, 1.0, 1.0]).all()


def test_last_phase_goes_on() -> None:
    profile = SpeedProfile((Phase(1.0, 0.0),), start_speed_mps=20.0)
    assert (speeds_mps(profile, 0.1, 50) == 20.0).all()
