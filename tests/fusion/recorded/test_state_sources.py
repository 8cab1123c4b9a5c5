"""Sensor states as Markov sources: counts, priors, links, joint states, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.fusion.recorded.state_sources import combination_source, recorded_source, sensor_source
from sbas.fusion.states import NO_DATA
from tests.fusion.recorded.test_recorded_errors import found, recording


def test_rows_are_counts_by_hand() -> None:
    # N>N N>DA DA>U U>N N>DA DA>DA DA>N | N>U U>N: by hand.
    state = np.array([[0, 0, 1, 2, 0, 1, 1, 0], [0, 2, 0, 0, 0, 0, 0, 0]], np.int8).T
    source = sensor_source("odo", state, step_s=1.0, stages=1)
    assert source.states == ("N", "DA", "U")
    n = 1 + 5  # stays at N: one in the first run, five in the second
    assert source.rows[0] == pytest.approx((n / 9, 2 / 9, 1 / 9))
    assert source.rows[1] == pytest.approx((1 / 3, 1 / 3, 1 / 3))
    assert source.rows[2] == pytest.approx((1.0, 0.0, 0.0))
    assert source.initial == (1.0, 0.0, 0.0)
    assert source.stages == ()
    assert "14 transitions counted" in source.source
    assert "geometric" in source.source


def test_nothing_is_counted_where_epochs_do_not_follow() -> None:
    state = np.array([0, 1, 2, 0, 1, 2, 0], np.int8)
    follows = np.array([False, True, True, True, False, True, True])
    source = sensor_source("odo", state, step_s=1.0, stages=1, follows=follows)
    assert "5 transitions" in source.source
    with pytest.raises(InputError, match="do not belong together"):
        sensor_source("odo", state, step_s=1.0, stages=1, follows=follows[:-1])


def test_a_chain_is_recovered_from_its_own_runs() -> None:
    rows = np.array([[0.95, 0.04, 0.01, 0.0], [0.3, 0.6, 0.1, 0.0], [0.2, 0.2, 0.5, 0.1],
                     [0.5, 0.0, 0.0, 0.5]])  # fmt: skip
    rng = np.random.default_rng(3)
    numbers = np.zeros((300, 2000), np.int64)
    for t in range(1, 300):
        u = rng.random(2000)
        numbers[t] = (u[:, None] > np.cumsum(rows, axis=1)[numbers[t - 1]]).sum(axis=1)
    codes = np.array([0, 1, 2, NO_DATA], np.int8)
    source = sensor_source("gps", codes[numbers], step_s=1.0, stages=1)
    assert source.states == ("N", "DA", "U", "no data")
    # The rarest row is left some 6000 times: five sigma of its largest binomial.
    assert np.abs(np.array(source.rows) - rows).max() < 5 * 0.5 / np.sqrt(6000)


def test_a_state_that_was_never_seen_is_refused_or_possible() -> None:
    state = np.array([0, 0, 1, 0, 0, 1, 0], np.int8)
    with pytest.raises(InputError, match="'U' was never seen to go on") as caught:
        sensor_source("odo", state, step_s=1.0, stages=1)
    assert "posterior" in caught.value.cure
    source = sensor_source("odo", state, step_s=1.0, stages=1, estimate="posterior")
    # Perks: a third of an observation for each; N is left four times, twice for DA.
    assert source.rows[0] == pytest.approx(((2 + 1 / 3) / 5, (2 + 1 / 3) / 5, (1 / 3) / 5))
    assert source.rows[2] == pytest.approx((1 / 3, 1 / 3, 1 / 3))
    assert "never seen: U" in source.source


def test_joint_states_keep_what_sensors_share() -> None:
    shared = np.random.default_rng(1).integers(0, 3, (50, 40)).astype(np.int8)
    source = combination_source(np.stack([shared, shared]), step_s=1.0)
    assert set(source.states) == {"NN", "DD", "UU"}
    silent = combination_source(np.array([[0, 0, -1, 0], [2, 0, 1, 2]], np.int8), step_s=1.0)
    assert set(silent.states) == {"NU", "NN", "-D"}


def test_a_recording_as_a_source() -> None:
    north = [0.1, 0.1, 1.5, 3.0, 0.1, 1.5, 3.0, 3.0, 0.1]
    errors = found(recording(0.0, north, seconds=[0, 1, 2, 3, 4, 60, 61, 62, 63]))
    source = recorded_source("gps", errors)
    # Nothing across the gap: N>N N>DA DA>U U>N | DA>U U>U U>N.
    assert source.rows[0] == pytest.approx((1 / 2, 1 / 2, 0))
    assert source.rows[1] == pytest.approx((0, 0, 1))
    assert source.rows[2] == pytest.approx((2 / 3, 0, 1 / 3))
    assert "step 1 s" in source.source
    # By hand: N goes to DA in half the steps, DA to U, and U lasts 3/2 steps: 1 : 1/2 : 3/4.
    assert source.initial == pytest.approx((4 / 9, 2 / 9, 3 / 9))
    assert source.stages == ()


@pytest.mark.parametrize("state", [[0, 1, 5], [[[0]]]])
def test_what_is_no_state_is_refused(state: object) -> None:
    with pytest.raises(InputError, match="codes N, DA, U or no data"):
        sensor_source("odo", state, step_s=1.0)  # type: ignore[arg-type]


def test_an_unknown_estimate_is_refused() -> None:
    with pytest.raises(InputError, match="unknown estimate"):
        sensor_source("odo", [0, 1, 2, 0], step_s=1.0, estimate="guess")  # type: ignore[arg-type]


def drifting_runs() -> NDArray[np.int8]:
    """Runs of 30 epochs that start N and get worse, as dead reckoning does."""
    rng = np.random.default_rng(5)
    age = np.arange(30)[:, None] + rng.integers(0, 15, 2000)
    return (age > 20).astype(np.int8) + (age > 32).astype(np.int8)


def test_runs_that_drift_have_no_stationary_law() -> None:
    with pytest.raises(InputError, match="states drift") as caught:
        sensor_source("acc", drifting_runs(), step_s=1.0, start="stationary")
    assert "1 by the law" in caught.value.evidence
    assert "start='first'" in caught.value.cure


def test_a_stage_a_step_gives_the_shares_of_every_epoch() -> None:
    state = drifting_runs()
    source = sensor_source("acc", state, step_s=0.5, stages=29)
    law = np.array(source.initial)
    for epoch, stage in enumerate(source.stages, 1):
        law = law @ np.array(stage.rows)
        shares = [np.mean(state[epoch] == code) for code in (0, 1, 2)]
        assert law == pytest.approx(shares, abs=1e-12)
        assert stage.seconds == 0.5
    coarse = sensor_source("acc", state, step_s=0.5, stages=4)
    assert [s.seconds for s in coarse.stages] == [4.0, 3.5, 3.5, 3.5]
    assert [s.label for s in coarse.stages][:2] == ["step 1 to 8", "step 9 to 15"]
    joint = combination_source(np.stack([state, state]), step_s=0.5, stages=29, estimate="counts")
    law = np.array(joint.initial)
    for stage in joint.stages:
        law = law @ np.array(stage.rows)
    assert law[joint.states.index("UU")] == pytest.approx(np.mean(state[-1] == 2), abs=1e-12)


def test_starts_and_stages_that_mean_nothing_are_refused() -> None:
    with pytest.raises(InputError, match="unknown start"):
        sensor_source("odo", [0, 1, 2, 0], step_s=1.0, start="now")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="counted from 1"):
        sensor_source("odo", [0, 1, 2, 0], step_s=1.0, stages=0)
    with pytest.raises(InputError, match="no transition"):
        sensor_source("odo", [0], step_s=1.0, estimate="posterior")
