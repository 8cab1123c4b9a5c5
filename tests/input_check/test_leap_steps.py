"""A corrected leap second is told from a gap, from a joined file and from an inserted second."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.input_check import fix, repair
from sbas.input_check.leap_steps import MOST_SLOWING_MPS2, LeapSteps, _least_distance_m
from sbas.recording import Recording
from sbas.recording_survey import epoch_rows, sampling_interval_ns
from tests.input_check.damages import rows, timed
from tests.input_check.journeys import START, TODAY, checked, journey, said, standing


def steps(recording: Recording) -> list[tuple[int, int]]:
    watch = LeapSteps(sampling_interval_ns(recording))
    for part in epoch_rows(recording, watch.COLUMNS):
        watch.update(part)
    return [(step.row, step.seconds) for step in watch.steps]


@pytest.mark.parametrize("lost", range(1, 19))
def test_a_real_gap_of_a_moving_receiver_is_none(lost: int) -> None:
    for seed in range(3):
        train, _ = journey(600, seed)
        for at in (100, 250, 333, 470):
            assert steps(rows(train, np.r_[:at, at + lost : 600])) == []


@pytest.mark.parametrize("k", [-18, -5, -1, 1, 2, 18])
def test_a_corrected_leap_second_is_found_wherever_there_is_speed(k: int) -> None:
    train, _ = journey(600)
    time = train.time.copy()
    time[:100] -= np.timedelta64(k, "s")
    assert steps(timed(train, time)) == [(100, k)]


def test_two_corrections_are_both_found_and_both_fixed() -> None:
    train, _ = journey(600)
    time = train.time.copy()
    time[:100] -= np.timedelta64(2, "s")
    time[:200] += np.timedelta64(1, "s")
    slipped = timed(train, time)
    assert steps(slipped) == [(100, 2), (200, -1)]
    fixed = repair(slipped, leap_slip="fix")
    assert (fixed.time == train.time).all()
    assert [f.code for f in fixed.meta.findings] == ["E26", "E26"]


def test_where_nothing_moves_it_stays_a_gap_with_a_note() -> None:
    roof = standing(600)
    time = roof.time.copy()
    time[:300] -= np.timedelta64(3, "s")
    result = checked(timed(roof, time))
    assert said(result) == [("E04", "warning")]
    assert "cannot be told from a gap" in result.findings[0].evidence


def test_a_file_that_overlaps_is_no_leap_second() -> None:
    """The train is back where it was: positions step back with the time."""
    train, _ = journey(600)
    overlapping = rows(train, np.r_[:300, 290:600])
    assert steps(overlapping) == []
    assert ("E14", "error") in said(checked(overlapping))


def test_an_inserted_second_by_the_bulletins() -> None:
    """IERS Bulletin C 52: a leap second at the end of December 2016. GPST then UTC + 18 s."""
    utc = np.datetime64("2016-12-31T23:58:20", "ns") + np.arange(200) * np.timedelta64(1, "s")
    utc[100:] -= np.timedelta64(1, "s")
    roof = timed(standing(200), utc)
    assert steps(roof) == [(100, -1)]
    ordinary = timed(standing(200), utc + np.timedelta64(365, "D"))
    assert steps(ordinary) == []


@pytest.mark.parametrize(
    ("v1", "v2", "duration_s"), [(30.0, 30.0, 18.0), (5.0, 20.0, 10.0), (25.0, 10.0, 6.0)]
)
def test_the_shortest_way_through_a_gap_is_that_of_full_braking(
    v1: float, v2: float, duration_s: float
) -> None:
    """Against the largest of both slopes, summed in steps of 1 ms: no other course is slower."""
    t = np.arange(0, duration_s, 1e-3) + 5e-4
    slowest = np.maximum(v1 - MOST_SLOWING_MPS2 * t, v2 - MOST_SLOWING_MPS2 * (duration_s - t))
    expected = np.maximum(slowest, 0).sum() * 1e-3
    found = _least_distance_m(*(np.array([v]) for v in (v1, v2, duration_s)))
    assert found[0] == pytest.approx(expected, rel=1e-4)


def test_a_shuffled_recording_is_looked_at_without_a_word() -> None:
    order = np.random.default_rng(3).permutation(600)
    assert isinstance(steps(rows(journey(600)[0], order)), list)
    assert steps(timed(standing(4), START + np.array([0, 1, 3, 4]) * np.timedelta64(1, "s"))) == []


@pytest.mark.parametrize("k", [18, -1, -3])
@pytest.mark.parametrize(("early", "how"), [(True, "fix-after"), (False, "fix")])
def test_the_side_that_fits_the_truth_stands(k: int, early: bool, how: str) -> None:
    train, track = journey(900)
    time = train.time.copy()
    wrong = slice(600, None) if early else slice(None, 600)
    time[wrong] += np.timedelta64(k if early else -k, "s")
    slipped = timed(train, time)
    result = checked(slipped, track)
    assert said(result) == [("E11", "error")]
    assert f"--leap-slip {how} " in result.findings[0].cure
    assert result.repairs.named() == {"leap_slip": how}
    fixed, after = fix(slipped, truth=track, today=TODAY)
    assert (fixed.time == train.time).all()
    assert [c for c, _ in said(after)] == ["E26"]
