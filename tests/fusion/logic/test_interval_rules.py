"""Every named rule against Figure 9 of Railways 2014, over a grid of weights and ranges."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import Thresholds
from sbas.fusion.logic.interval_rules import (
    IntervalRule,
    interval_outcomes,
    mean_weights,
    output_intervals,
    smallest_unacceptable_end_m,
)
from sbas.fusion.logic.published_tables import figure_9
from sbas.fusion.states import DA, N, U, combination_states

EQUAL = (1 / 3, 1 / 3, 1 / 3)
PRINTED, CORRECTED = figure_9("printed").outcomes, figure_9().outcomes
STATES = combination_states(np.arange(27), 3).T


def scores(
    rule: IntervalRule, weights: tuple[float, ...], end_m: float, free: Thresholds | None = None
) -> tuple[int, int]:
    """Leaves of 27 that a rule has as the printed, and as the corrected figure."""
    seen = interval_outcomes(rule, weights, unacceptable_end_m=end_m, output_thresholds=free)
    return int(np.sum(seen == PRINTED)), int(np.sum(seen == CORRECTED))


WEIGHTS = [(i / 20, j / 20, (20 - i - j) / 20) for i in range(1, 19) for j in range(1, 20 - i)]
GRID = [(w, x) for w in [*WEIGHTS, EQUAL] for x in (2.6, 4.0, 5.5, 6.0, 8.0, 10.5, 50.0, math.inf)]


@pytest.mark.parametrize(
    ("rule", "printed", "corrected"),
    [
        ("tree_bounds", 25, 27),
        ("eq3_midpoint", 23, 24),
        ("eq3_literal_ndu", 15, 15),
        ("eq3_literal_udn", 2, 1),
        ("upper_end", 15, 15),
        ("lower_end", 24, 25),
        ("subset_else_da", 21, 21),
    ],
)
def test_best_scores_of_the_method_page(rule: IntervalRule, printed: int, corrected: int) -> None:
    """The page's best of 1177 weights (steps of 0.02) and 23 X; a coarser grid finds the same."""
    found = [scores(rule, weights, end_m) for weights, end_m in GRID]
    assert max(score for score, _ in found) == printed
    assert max(score for _, score in found) == corrected


@pytest.mark.parametrize(
    ("rule", "weights", "end_m", "expected"),
    [
        ("tree_bounds", EQUAL, math.inf, (25, 27)),
        ("eq3_midpoint", (0.1, 0.65, 0.25), 2.6, (23, 23)),
        ("eq3_midpoint", EQUAL, 2.6, (22, 24)),
        ("eq3_midpoint", EQUAL, math.inf, (5, 6)),
        ("eq3_literal_ndu", (0.1, 0.1, 0.8), 2.6, (15, 15)),
        ("eq3_literal_ndu", EQUAL, 2.6, (12, 12)),
        ("eq3_literal_udn", EQUAL, math.inf, (2, 1)),
        ("upper_end", EQUAL, 2.6, (15, 15)),
        ("lower_end", EQUAL, math.inf, (22, 24)),
        ("lower_end", (0.4, 0.35, 0.25), 2.6, (24, 24)),
        ("lower_end", (0.3, 0.3, 0.4), 2.6, (23, 25)),
        ("subset_else_da", EQUAL, 2.6, (21, 21)),
    ],
)
def test_scores_at_one_place(
    rule: IntervalRule, weights: tuple[float, ...], end_m: float, expected: tuple[int, int]
) -> None:
    assert scores(rule, weights, end_m) == expected


def test_the_default_differs_from_the_printed_tree_at_o4_and_o6() -> None:
    seen = interval_outcomes("tree_bounds", EQUAL)
    assert (np.flatnonzero(seen != PRINTED) + 1).tolist() == [4, 6]


@pytest.mark.parametrize(("end_m", "score"), [(5.5, 24), (6.0, 27), (math.inf, 27)])
def test_tree_bounds_need_a_large_end(end_m: float, score: int) -> None:
    assert scores("tree_bounds", EQUAL, end_m)[1] == score


shares_of_one = st.lists(st.integers(1, 200), min_size=3, max_size=3).map(
    lambda parts: tuple(p / sum(parts) for p in parts)
)


@given(shares_of_one)
def test_tree_bounds_give_the_corrected_tree_at_any_weights(weights: tuple[float, ...]) -> None:
    assert scores("tree_bounds", weights, math.inf)[1] == 27
    bound = smallest_unacceptable_end_m(weights)
    assert scores("tree_bounds", weights, bound * (1 + 1e-6))[1] == 27
    assert scores("tree_bounds", weights, bound)[1] < 27


def test_the_bound_of_a_finite_end() -> None:
    assert smallest_unacceptable_end_m(EQUAL) == pytest.approx(5.5)
    assert smallest_unacceptable_end_m((0.5, 0.5, 0.0)) == math.inf


@pytest.mark.parametrize(
    ("weights", "end_m", "expected"),
    [((0.42, 0.34, 0.24), 5.5, (24, 26)), ((0.56, 0.4, 0.04), 5.0, (24, 24))],
)
def test_signed_midpoint_reaches_the_scores_of_the_page_at_unequal_weights(
    weights: tuple[float, ...], end_m: float, expected: tuple[int, int]
) -> None:
    assert scores("eq3_midpoint_signed", weights, end_m) == expected


def test_signed_midpoint_at_equal_weights_hangs_on_a_tie() -> None:
    """The method page has 24 and 26 (all but UUU) at equal weights and X = 4.54.

    There the middle of (N, DA, DA) is (1 + 2.5 + 2.5)/6 = 1 m = beta exactly, and rounds below it.
    With ties to the worse state, this package's rule, three leaves turn DA: 21 and 23.
    """
    lowest, highest = output_intervals(EQUAL, unacceptable_end_m=4.54, signed=True)
    middle = (lowest + highest) / 2
    better = (middle > 1 + 1e-9).astype(int) + (middle > 2.5 + 1e-9)
    assert (int(np.sum(better == PRINTED)), int(np.sum(better == CORRECTED))) == (24, 26)
    assert np.flatnonzero(better != CORRECTED).tolist() == [26]
    assert scores("eq3_midpoint_signed", EQUAL, 4.54) == (21, 23)
    worse = interval_outcomes("eq3_midpoint_signed", EQUAL, unacceptable_end_m=4.54)
    turned = np.flatnonzero((worse != CORRECTED) & (worse == DA) & (CORRECTED == N))
    assert STATES[turned].tolist() == [[N, DA, DA], [DA, N, DA], [DA, DA, N]]


def test_midpoint_with_free_bounds_gives_the_tree_inside_the_region_of_the_page() -> None:
    """X = 8 m: u = 5.25; 4/3 < beta_out <= 1.75 and (1.75 + 2u)/3 = 4.0833 < AL_out <= 5.25."""

    def score(beta: float, limit: float) -> int:
        free = Thresholds(beta, limit)
        return scores("midpoint_free", EQUAL, 8.0, free=free)[1]

    assert score(1.34, 4.1) == score(1.75, 5.25) == 27
    for beta, limit in ((4 / 3, 4.1), (1.76, 4.1), (1.5, 4.083), (1.5, 5.26)):
        assert score(beta, limit) < 27, (beta, limit)
    # u must exceed 3 m, that is X > 3.5 m.
    assert scores("midpoint_free", EQUAL, 3.5, free=Thresholds(1.34, 2.99))[1] < 27


def test_the_stated_thresholds_cannot_give_figure_9() -> None:
    """(N, DA, DA) at equal weights lies in 2/3 to 2 m: its middle is 4/3 m, above beta."""
    lowest, highest = output_intervals(EQUAL)
    code = 4
    assert STATES[code].tolist() == [N, DA, DA]
    assert (lowest[code] + highest[code]) / 2 == pytest.approx(4 / 3)


@given(shares_of_one, st.floats(2.6, 30))
def test_the_first_clause_of_the_text_adds_nothing(
    weights: tuple[float, ...], end_m: float
) -> None:
    """An interval inside the range of a state has its middle there."""
    lowest, highest = output_intervals(weights, unacceptable_end_m=end_m)
    seen = interval_outcomes("eq3_midpoint", weights, unacceptable_end_m=end_m)
    assert np.all(seen[highest < 1] == N)
    assert np.all(seen[(lowest > 1) & (highest < 2.5)] == DA)
    assert np.all(seen[lowest > 2.5] == U)


@given(shares_of_one, st.floats(2.6, 30), st.integers(0, 2**32 - 1))
def test_every_mean_of_errors_in_the_states_lies_in_the_interval(
    weights: tuple[float, ...], end_m: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    low, high = np.array([0, 1, 2.5]), np.array([1, 2.5, end_m])
    size = low[STATES] + rng.random((27, 3)) * (high - low)[STATES]
    sign = rng.choice([-1, 1], (27, 3))
    lowest, highest = output_intervals(weights, unacceptable_end_m=end_m)
    mean = size @ np.array(weights)
    assert np.all((mean >= lowest - 1e-12) & (mean <= highest + 1e-12))
    lowest, highest = output_intervals(weights, unacceptable_end_m=end_m, signed=True)
    mean = np.abs((size * sign) @ np.array(weights))
    assert np.all((mean >= lowest - 1e-12) & (mean <= highest + 1e-12))


@pytest.mark.parametrize("signed", [False, True])
def test_intervals_equal_sums_written_out(signed: bool) -> None:
    weights, end_m = (0.2, 0.5, 0.3), 7.0
    low, high = [0, 1, 2.5], [1, 2.5, end_m]
    lowest, highest = output_intervals(weights, unacceptable_end_m=end_m, signed=signed)
    for code, states in enumerate(STATES):
        own = [w * low[s] for w, s in zip(weights, states, strict=True)]
        top = [w * high[s] for w, s in zip(weights, states, strict=True)]
        expected = max(0, *(own[i] - sum(top) + top[i] for i in range(3))) if signed else sum(own)
        assert lowest[code] == pytest.approx(expected)
        assert highest[code] == pytest.approx(sum(top))


def test_a_sensor_without_weight_changes_nothing_even_if_unbounded() -> None:
    for rule in get_args(IntervalRule):
        free = Thresholds(1.5, 4.5) if rule == "midpoint_free" else None
        with_it = interval_outcomes(rule, (0.5, 0.5, 0.0), output_thresholds=free)
        without = interval_outcomes(rule, (0.5, 0.5), output_thresholds=free)
        assert with_it.tolist() == np.repeat(without, 3).tolist(), rule


def test_twelve_sensors_are_all_combinations_and_thirteen_are_refused() -> None:
    seen = interval_outcomes("tree_bounds", np.full(12, 1 / 12))
    assert seen.size == 3**12
    assert np.count_nonzero(seen == U) == 1
    with pytest.raises(InputError, match="1 to 12 sensors"):
        mean_weights(np.full(13, 1 / 13))


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        ((0.5, 0.4), "do not add up to 1"),
        ((0.0, 0.0), "do not add up to 1"),
        ((1.5, -0.5), "negative"),
        ((math.nan, 1.0), "no number"),
        ((math.inf, 1.0), "no number"),
        ((), "1 to 12"),
    ],
)
def test_weights_that_are_no_mean_are_refused(weights: tuple[float, ...], words: str) -> None:
    with pytest.raises(InputError, match=words):
        interval_outcomes("tree_bounds", weights)


def test_options_that_do_not_belong_together_are_refused() -> None:
    with pytest.raises(InputError, match="is no rule"):
        interval_outcomes("midpoint", EQUAL)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="midpoint_free"):
        interval_outcomes("midpoint_free", EQUAL)
    with pytest.raises(InputError, match="midpoint_free"):
        interval_outcomes("tree_bounds", EQUAL, output_thresholds=Thresholds())
    for end_m in (2.5, 1.0, math.nan):
        with pytest.raises(InputError, match="exceed the alert limit"):
            interval_outcomes("tree_bounds", EQUAL, unacceptable_end_m=end_m)
    with pytest.raises(InputError, match="alert limit"):
        interval_outcomes("tree_bounds", EQUAL, thresholds=Thresholds(2.5, 1.0))
