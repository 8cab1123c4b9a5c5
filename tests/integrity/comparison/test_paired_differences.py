"""A track with known offsets: what the receivers' difference is, is known to the millimetre."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sbas.integrity.comparison.comparison import compare
from sbas.integrity.comparison.comparison_results import Comparison, Differences
from tests.examples import recording


def track(
    time_s: np.ndarray,
    *,
    east_m: float = 0.0,
    north_m: float = 0.0,
    forward_m: float = 0.0,
    right_m: float = 0.0,
    late_s: float = 0.0,
    noise_m: float = 0.0,
    seed: int = 0,
    **columns: Any,
) -> Any:
    """A vehicle on an ellipse of 2 km by 1 km whose speed goes up and down between 5 and 40 m/s.

    `late_s`: its positions are those of so much earlier.
    """
    rng = np.random.default_rng(seed)
    t = np.asarray(time_s, float) - late_s
    # The path's parameter; its speed is smooth and never zero.
    angle = (22.5 * t + 17.5 * 60 * np.sin(t / 60)) / 1500
    east, north = 2000 * np.sin(angle), 1000 * np.cos(angle)
    heading = np.arctan2(2000 * np.cos(angle), -1000 * np.sin(angle))
    sine, cosine = np.sin(heading), np.cos(heading)
    east = east + east_m + forward_m * sine + right_m * cosine
    north = north + north_m + forward_m * cosine - right_m * sine
    n = t.size
    return recording(
        east + rng.normal(0, noise_m, n) if noise_m else east,
        north + rng.normal(0, noise_m, n) if noise_m else north,
        np.full(n, 11.0),
        time_s=np.asarray(time_s, float),
        **columns,
    )


SECONDS = np.arange(7200.0)


def found(result: Comparison) -> Differences:
    assert isinstance(result.difference, Differences)
    return result.difference


def test_positions_are_compared_at_the_same_instant() -> None:
    """0.07 to 0.4 s at up to 60 m/s would be metres; a cubic's rest is below 9/384 of the fourth
    derivative times step^4: about a millimetre here."""
    half = compare(track(SECONDS), track(SECONDS + 0.4))
    assert not half.static
    # The first and the last interval lack neighbours: a line, acceleration x step^2/8.
    assert found(half).max < 0.2
    assert found(half).p95.value < 0.002
    assert found(half).interpolated == half.paired - 1
    assert found(half).max_shift_s == pytest.approx(0.4)
    fine = np.arange(36_000) / 5 + 0.07
    for a, b in ((track(SECONDS), track(fine)), (track(fine), track(SECONDS))):
        result = compare(a, b)
        assert found(result).max < 0.002
        assert result.interval_s == 1.0
    assert any("interpolated" in text for text in half.caveats)
    assert [f.code for f in half.findings if "brought" in f.message] == ["E26"]


def test_a_static_antenna_is_not_interpolated() -> None:
    still = np.zeros(600)
    a = recording(still, still, still + 11)
    b = recording(still + 0.3, still - 0.4, still + 11, time_s=np.arange(600) + 0.4)
    result = compare(a, b)
    assert result.static
    assert found(result).interpolated == 0
    assert found(result).median.value == pytest.approx(0.5, abs=1e-5)
    assert found(result).east.median == pytest.approx(-0.3, abs=1e-5)
    assert found(result).north.median == pytest.approx(0.4, abs=1e-5)
    assert any("0.4 s apart" in text for text in result.caveats)


def test_a_lever_arm_turns_with_the_vehicle() -> None:
    a = track(SECONDS, forward_m=0.8, right_m=-0.5, noise_m=0.2)
    result = compare(a, track(SECONDS, noise_m=0.2, seed=1))
    assert result.offset is not None
    assert result.offset.frame == "along, right, up"
    assert result.offset.delay_s is None
    assert result.offset.offset_m == pytest.approx((0.8, -0.5, 0.0), abs=0.05)
    assert "lever arm" in str(result)


def test_an_offset_of_frames_does_not_turn() -> None:
    a = track(SECONDS, east_m=0.6, north_m=-0.3, noise_m=0.2)
    result = compare(a, track(SECONDS, noise_m=0.2, seed=1))
    assert result.offset is not None
    assert result.offset.frame == "east, north, up"
    assert result.offset.offset_m == pytest.approx((0.6, -0.3, 0.0), abs=0.05)


def test_a_time_offset_grows_with_the_speed() -> None:
    a = track(SECONDS, late_s=0.25, noise_m=0.2)
    result = compare(a, track(SECONDS, noise_m=0.2, seed=1))
    assert result.offset is not None
    assert result.offset.delay_s == pytest.approx(-0.25, abs=0.01)
    assert "s behind B's" in str(result.offset)


def test_noise_alone_is_no_offset() -> None:
    flagged = [
        compare(track(SECONDS, noise_m=0.4, seed=i), track(SECONDS, noise_m=0.4, seed=i + 50))
        for i in range(10)
    ]
    assert all(result.offset is None for result in flagged)


def test_a_short_record_is_not_asked_for_an_offset() -> None:
    """T/(2 tau) = 5 needs an hour at 360 s."""
    a, b = track(SECONDS[:3000], east_m=5.0), track(SECONDS[:3000])
    assert compare(a, b).offset is None
    assert compare(a, b, tau_s=30).offset is not None


def test_missing_heights_leave_east_and_north() -> None:
    a = track(SECONDS[:600])
    lacking = a.replace(table=a.table.assign(height_m=np.nan))
    result = compare(lacking, track(SECONDS[:600], east_m=1.0))
    assert found(result).up is None
    assert found(result).median.value == pytest.approx(1.0, abs=1e-3)
    assert found(result).epochs == 600


def test_a_missing_neighbour_is_not_bridged() -> None:
    b = track(SECONDS[:600] + 0.4)
    holed = b.replace(table=b.table.drop(b.table.index[100:110]))
    result = compare(track(SECONDS[:600]), holed)
    # Ten epochs have no partner; the one before the gap's end lacks a neighbour.
    assert result.paired == 590
    assert found(result).epochs == 590 - 2
