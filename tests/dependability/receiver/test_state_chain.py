"""Figures of a counted chain against scipy, numpy and exact cases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from sbas.dependability.receiver.state_chain import (
    StateChain,
    StateRuns,
    binomial_limits,
    state_chain,
    stationary_law,
)
from sbas.estimate import Refusal


def chain(counts: list[list[int]]) -> StateChain:
    pairs = np.array(counts)
    nothing = tuple(StateRuns((), ()) for _ in range(3))
    return state_chain(
        "", pairs.sum(axis=0).tolist(), pairs, np.zeros((3, 3, 3), np.int64), nothing,
        [(), (), ()], confidence=0.95, tail_runs=6,
    )  # fmt: skip


def test_limits_are_clopper_and_pearsons() -> None:
    k, n = np.array([0, 1, 7, 400, 20, 0]), np.array([10, 10, 20, 1000, 20, 0])
    lower, upper = binomial_limits(k, n, 0.95)
    for i in range(5):
        peer = stats.binomtest(int(k[i]), int(n[i])).proportion_ci(0.95, "exact")
        assert (lower[i], upper[i]) == pytest.approx((peer.low, peer.high), rel=1e-10, abs=1e-15)
    assert (lower[5], upper[5]) == (0.0, 1.0)


def test_a_zero_count_allows_up_to_three_in_n() -> None:
    found = chain([[900, 100, 0], [3, 0, 0], [0, 0, 0]])
    up = found.up_to()
    assert up[0][2] == pytest.approx(1 - 0.05 ** (1 / 1000), rel=1e-12)
    assert up[0][2] == pytest.approx(3 / 1000, rel=4e-3)
    assert up[0][0] is None
    assert up[2] == (None, None, None)
    assert found.probabilities[2] is None
    assert found.dirichlet[1] == (3.5, 0.5, 0.5)


@given(st.lists(st.floats(0.001, 1.0), min_size=9, max_size=9))
def test_the_stationary_law_is_a_left_eigenvector(values: list[float]) -> None:
    rows = np.array(values).reshape(3, 3)
    rows /= rows.sum(axis=1, keepdims=True)
    law = stationary_law(rows)
    assert isinstance(law, tuple)
    assert np.array(law) @ rows == pytest.approx(np.array(law), rel=1e-13)


def test_rare_states_keep_their_digits() -> None:
    """pi3/pi1 = p13/p31 where only these two states talk."""
    law = stationary_law(np.array([[1 - 1e-30, 0, 1e-30], [0.5, 0.5, 0], [0.25, 0, 0.75]]))
    assert law[2] == pytest.approx(4e-30, rel=1e-14)  # type: ignore[index]


def test_states_without_counts() -> None:
    assert chain([[5, 2, 0], [2, 1, 0], [0, 0, 0]]).stationary() == pytest.approx((0.7, 0.3, 0.0))
    assert isinstance(chain([[5, 2, 1], [2, 1, 0], [0, 0, 0]]).stationary(), Refusal)
    assert isinstance(chain([[5, 0, 0], [0, 4, 0], [1, 1, 1]]).stationary(), Refusal)
    assert chain([[0, 0, 0], [0, 0, 0], [0, 0, 9]]).stationary() == (0.0, 0.0, 1.0)
    assert isinstance(chain([[0, 0, 0], [0, 0, 0], [0, 0, 0]]).stationary(), Refusal)


def test_json_there_and_back() -> None:
    found = chain([[11, 4, 3], [3, 4, 1], [4, 0, 6]])
    assert StateChain.from_dict(found.to_dict()) == found
