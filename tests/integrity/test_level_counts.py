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


S = 1_000_000_000


def counted(levels: np.ndarray, modes: np.ndarray | int = NPA, first: int = 0) -> LevelCounter:
    """Levels of successive seconds from second `first` on."""
    counter = LevelCounter(int(1.5 * S))
    time = (first + np.arange(levels.size)) * S
    counter.update(time, levels, np.broadcast_to(np.asarray(modes, np.int8), levels.shape))
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
    result = counted(levels, np.array([PA, NPA, -1])).result()
    k = np.full(len(MODES) + 1, np.nan)
    k[PA], k[NPA] = 6.0, 6.18
    assert result.share_below(100.0, 6.7 / k) == pytest.approx(2 / 3, abs=0)
    pairs = result.by_k(k)
    order = np.argsort(pairs.k)
    assert pairs.k[order].tolist() == [6.0, 6.18]
    assert pairs.epochs.tolist() == [1, 1]
    assert np.all(pairs.lower_m[order] <= [5.0, 6.0])
    assert np.all(pairs.upper_m[order] > [5.0, 6.0])


def _chance(levels: np.ndarray) -> np.ndarray:
    """Any rising function of the level serves as its chance; 0 where there is none."""
    return np.where(np.isfinite(levels), np.exp(np.nan_to_num(levels) / 10), 0.0)


@given(
    st.lists(st.sampled_from([np.nan, 5.0, 8.0, 8.1, 12.0, 19.9, 20.0, 31.0]), min_size=1,
             max_size=40),
    st.lists(st.sampled_from([NPA, PA]), min_size=40, max_size=40),
    st.sampled_from([8.1, 20.0, 40.0]),
)  # fmt: skip
def test_rises_of_the_chance_are_those_from_epoch_to_epoch(
    levels: list[float], modes: list[int], limit: float
) -> None:
    level, mode = np.array(levels), np.array(modes[: len(levels)])
    k = np.full(len(MODES) + 1, np.nan)
    k[PA], k[NPA] = 6.0, 6.18
    pairs = counted(level, mode).result().by_k(k)
    chance = _chance(level)
    before = np.concatenate([[0.0], chance[:-1]])
    before[1:][mode[1:] != mode[:-1]] = 0.0  # another K: as if nothing had been before
    exact = np.maximum(chance - before, 0.0).sum()
    # The bin's edge stands for the level: 0.05 % of it.
    at = _chance(pairs.upper_m)
    assert float(pairs.rises @ at) == pytest.approx(exact, rel=3e-3, abs=1e-9)
    possible = np.where(level < limit, chance, 0.0)
    before = np.concatenate([[0.0], possible[:-1]])
    before[1:][mode[1:] != mode[:-1]] = 0.0
    below = np.maximum(possible - before, 0.0).sum()
    assert float(pairs.rises_below(limit) @ np.where(pairs.lower_m < limit, at, 0.0)) >= below * (
        1 - 1e-12
    )


@given(
    st.lists(st.sampled_from([np.nan, 5.0, 8.0, 12.0]), min_size=2, max_size=30),
    st.integers(0, 30),
    st.booleans(),
)
def test_moves_across_the_border_of_two_parts(levels: list[float], cut: int, gap: bool) -> None:
    level = np.array(levels)
    cut = min(cut, level.size)
    time = np.arange(level.size) * S
    if gap:
        time[cut:] += 10 * S
    mode = np.full(level.size, NPA, np.int8)
    whole, first, second = (LevelCounter(int(1.5 * S)) for _ in range(3))
    whole.update(time, level, mode)
    first.update(time[:cut], level[:cut], mode[:cut])
    second.update(time[cut:], level[cut:], mode[cut:])
    first.merge(second)
    one, other = whole.result(), first.result()
    assert one.epochs == other.epochs
    for name in ("counts", "fresh", "ups", "downs"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_parts_add_up_to_the_whole() -> None:
    levels = np.random.default_rng(1).uniform(1, 80, 1000)
    whole, first = counted(levels), counted(levels[:300])
    first.merge(counted(levels[300:], first=300))
    assert np.array_equal(whole.result().counts, first.result().counts)
    assert whole.result().epochs == first.result().epochs


def test_lengths_that_differ_are_refused() -> None:
    with pytest.raises(InputError, match="length"):
        LevelCounter(S).update(np.arange(3), np.ones(3), np.zeros(2, np.int8))
