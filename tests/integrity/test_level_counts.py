"""Levels counted finely: shares below a limit, and what re-scaling does to them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sbas.exceptions import InputError
from sbas.integrity.level_counts import LEVEL_STEP, LevelCounter
from sbas.recording import MODES

ONES = np.ones(len(MODES) + 1)
PA, NPA = MODES.index("sbas_pa"), MODES.index("sbas_npa")


def counted(levels: np.ndarray, modes: np.ndarray | int = NPA) -> LevelCounter:
    counter = LevelCounter()
    counter.update(levels, np.broadcast_to(np.int8(modes), levels.shape))
    return counter


@given(
    arrays(np.float64, st.integers(1, 60), elements=st.floats(0.02, 5e4)),
    st.floats(0.05, 4e4),
    st.floats(0.5, 2.0),
)
def test_share_lies_between_the_exact_one_and_that_of_a_level_slightly_larger(
    levels: np.ndarray, limit: float, factor: float
) -> None:
    share = counted(levels).result().share_below(limit, factor * ONES)
    assert share <= np.mean(levels * factor < limit)
    assert share >= np.mean(levels * factor * (1 + 1.001 * LEVEL_STEP) < limit)


def test_a_level_at_the_limit_is_not_below_it_whatever_its_bin() -> None:
    for level in (10.0, 20.0, 25.0, 50.0, 1e-2, 1e5):
        assert counted(np.array([level])).result().share_below(level, ONES) == 0.0


def test_epochs_without_level_count_as_not_below() -> None:
    result = counted(np.array([5.0, np.nan, 5.0, np.nan])).result()
    assert result.share_below(10.0, ONES) == 0.5
    assert result.epochs == 4


def test_levels_of_unknown_k_are_above_every_limit_and_in_no_pair() -> None:
    levels = np.array([5.0, 6.0, 7.0])
    counter = LevelCounter()
    counter.update(levels, np.array([PA, NPA, -1], np.int8))
    k = np.full(len(MODES) + 1, np.nan)
    k[PA], k[NPA] = 6.0, 6.18
    assert counter.result().share_below(100.0, 6.7 / k) == pytest.approx(2 / 3, abs=0)
    factors, lower, upper, epochs = counter.result().by_k(k)
    assert sorted(factors.tolist()) == [6.0, 6.18]
    assert epochs.tolist() == [1, 1]
    assert np.all(lower[np.argsort(factors)] <= [5.0, 6.0])
    assert np.all(upper[np.argsort(factors)] > [5.0, 6.0])


def test_parts_add_up_to_the_whole() -> None:
    levels = np.random.default_rng(1).uniform(1, 80, 1000)
    whole, first = counted(levels), counted(levels[:300])
    first.merge(counted(levels[300:]))
    assert np.array_equal(whole.counts, first.counts)
    assert whole.epochs == first.epochs


def test_lengths_that_differ_are_refused() -> None:
    with pytest.raises(InputError, match="length"):
        LevelCounter().update(np.ones(3), np.zeros(2, np.int8))
