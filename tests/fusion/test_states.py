"""States of errors, codes of combinations and shares; rules over time said epoch by epoch."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sbas.exceptions import InputError
from sbas.fusion.architecture.model import MOST_SENSORS, Thresholds
from sbas.fusion.states import (
    DA,
    NO_DATA,
    N,
    U,
    check_thresholds,
    combination_codes,
    combination_name,
    combination_states,
    combination_words,
    detected,
    shares,
    states_of,
)

ERRORS = st.sampled_from([0.0, 0.5, -0.7, 0.75, 0.9, 1.0, -1.2, 2.0, 2.25, 2.4, -2.5, 3.0, np.nan])


# --- from an error to a state -----------------------------------------------------------------


def test_ties_go_to_the_worse_state_and_missing_is_never_unacceptable() -> None:
    error = np.array([0, 0.999, 1, -1, 2.499, -2.499, 2.5, -2.5, np.nan, np.inf, -np.inf])
    assert states_of(error).tolist() == [N, N, DA, DA, DA, DA, U, U, NO_DATA, U, U]
    assert states_of(error).dtype == np.int8
    assert states_of(np.float64(1.5)) == DA


def test_thresholds_of_ones_own_and_any_shape() -> None:
    error = np.linspace(0, 10, 24).reshape(2, 3, 4)
    seen = states_of(error, Thresholds(4.0, 8.0))
    assert seen.shape == error.shape
    assert seen.ravel().tolist() == [0 if e < 4 else 1 if e < 8 else 2 for e in error.ravel()]
    assert states_of(np.empty((0, 3))).shape == (0, 3)


@pytest.mark.parametrize(
    ("thresholds", "words"),
    [
        (Thresholds(2.5, 2.5), "below a finite alert limit"),
        (Thresholds(3.0, 2.5), "below a finite alert limit"),
        (Thresholds(-1.0, 2.5), "above 0 m"),
        (Thresholds(0.0, 2.5), "above 0 m"),
        (Thresholds(math.nan, 2.5), "above 0 m"),
        (Thresholds(1.0, math.nan), "above 0 m"),
        (Thresholds(1.0, math.inf), "finite alert limit"),
        (Thresholds(hysteresis_m=1.0), "hysteresis"),
        (Thresholds(hysteresis_m=-0.1), "hysteresis"),
        (Thresholds(hysteresis_m=math.nan), "hysteresis"),
        (Thresholds(min_dwell_s=-1.0), "dwell"),
        (Thresholds(min_dwell_s=math.nan), "dwell"),
    ],
)
def test_bounds_out_of_order_are_refused_with_a_cure(thresholds: Thresholds, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        check_thresholds(thresholds)
    assert caught.value.cure
    with pytest.raises(ValueError, match=words):
        states_of([0.0], thresholds)


@pytest.mark.parametrize("step_s", [None, 0.0, -1.0, math.nan])
def test_a_dwell_needs_a_step(step_s: float | None) -> None:
    with pytest.raises(InputError, match="time between epochs"):
        states_of([0.0], Thresholds(min_dwell_s=1.0), step_s=step_s)


def test_hysteresis_delays_only_the_better_state() -> None:
    error = [0.5, 0.95, 1.05, 0.95, 0.8, 0.79, 0.95, 2.6, 2.4, 2.3, 2.29, 0.85, 0.5]
    seen = states_of(error, Thresholds(hysteresis_m=0.2))
    #        N  N  DA  .9  .8  N  N  U  .1  .2  DA DA N
    assert seen.tolist() == [0, 0, 1, 1, 1, 0, 0, 2, 2, 2, 1, 1, 0]


def test_a_better_state_must_last_for_the_dwell() -> None:
    error = [3.0, 0, 0, 0, 3.0, 0, 1.5, 0, 0, 0]
    # Better since 1 s; it has lasted 2 s at 3 s. The second time DA or better lasts from 5 s to
    # 7 s, N from 7 s to 9 s.
    seen = states_of(error, Thresholds(min_dwell_s=2.0), step_s=1.0)
    assert seen.tolist() == [2, 2, 2, 0, 2, 2, 2, 1, 1, 0]
    # A tenth of a second three times is the dwell of 0.3 s, though 0.3/0.1 rounds below 3.
    tenths = states_of([3.0, 0, 0, 0, 0, 0], Thresholds(min_dwell_s=0.3), step_s=0.1)
    assert tenths.tolist() == [2, 2, 2, 2, 0, 0]


def test_a_gap_neither_improves_nor_counts_as_dwell() -> None:
    error = [3.0, np.nan, 2.4, np.nan, 2.2, 0.5]
    seen = states_of(error, Thresholds(hysteresis_m=0.2))
    assert seen.tolist() == [2, -1, 2, -1, 1, 0]
    error = [3.0, 0.5, np.nan, 0.5, 0.5]
    seen = states_of(error, Thresholds(min_dwell_s=1.0), step_s=1.0)
    assert seen.tolist() == [2, 2, -1, 2, 0]


def one_by_one(error: list[float], t: Thresholds, step_s: float) -> list[int]:
    """The rules as sentences: for each epoch look back over the dwell."""

    def plain(e: float, off: float) -> int:
        return (abs(e) >= t.nominal_m - off) + (abs(e) >= t.alert_limit_m - off)

    seen: list[int] = []
    state = N
    for j, e in enumerate(error):
        if math.isnan(e):
            seen.append(NO_DATA)
            continue
        if plain(e, 0) > state:
            state = plain(e, 0)
        else:
            for better in range(state):
                back = [k for k in range(j + 1) if (j - k) * step_s <= t.min_dwell_s]
                whole = j * step_s >= t.min_dwell_s
                good = all(
                    not math.isnan(error[k]) and plain(error[k], t.hysteresis_m) <= better
                    for k in back
                )
                if whole and good:
                    state = better
                    break
        seen.append(state)
    return seen


@given(
    st.lists(ERRORS, min_size=1, max_size=30),
    st.sampled_from([0.0, 0.25]),
    st.sampled_from([0.0, 1.0, 2.0, 5.0]),
)
def test_rules_over_time_equal_those_said_epoch_by_epoch(
    error: list[float], hysteresis_m: float, min_dwell_s: float
) -> None:
    thresholds = Thresholds(hysteresis_m=hysteresis_m, min_dwell_s=min_dwell_s)
    expected = one_by_one(error, thresholds, 1.0)
    assert states_of(error, thresholds, step_s=1.0).tolist() == expected
    # Runs beside each other know nothing of each other.
    beside = np.stack([error, np.zeros(len(error)), error], axis=1)
    seen = states_of(beside, thresholds, step_s=1.0)
    assert seen[:, 0].tolist() == expected
    assert seen[:, 2].tolist() == expected
    assert not seen[:, 1].any()


@given(hnp.arrays(np.float64, (12, 3), elements=ERRORS), st.sampled_from([0.0, 0.25]))
def test_hysteresis_and_dwell_never_make_a_state_better(
    error: np.ndarray, hysteresis_m: float
) -> None:
    held = states_of(error, Thresholds(hysteresis_m=hysteresis_m, min_dwell_s=2.0), step_s=1.0)
    plain = states_of(error)
    assert np.all(held >= plain)
    assert np.array_equal(held == NO_DATA, np.isnan(error))


# --- combinations -----------------------------------------------------------------------------


def test_codes_are_the_leaves_of_figure_9() -> None:
    # Railways 2014, Figure 9: leaf O = 1 + 9 c1 + 3 c2 + c3.
    assert combination_codes([N, DA, N]) + 1 == 4
    assert combination_codes([N, DA, U]) + 1 == 6
    assert combination_codes([U, U, U]) + 1 == 27
    assert combination_words(5, 3) == "(N, DA, U)"
    assert combination_words(-1, 3) == "no data"
    assert combination_name([N, DA, U, NO_DATA]) == "NDU-"


def test_codes_of_many_sensors_do_not_overflow() -> None:
    for n in (5, 20, MOST_SENSORS):
        worst = combination_codes(np.full((n, 2), U, np.int8))
        assert worst.tolist() == [3**n - 1] * 2
        assert worst.dtype == np.int64
    with pytest.raises(InputError, match="1 to 39"):
        combination_codes(np.zeros((40, 2), np.int8))
    with pytest.raises(InputError, match="1 to 39"):
        combination_states([0], 40)


@given(hnp.arrays(np.int8, st.tuples(st.integers(1, 6), st.integers(0, 4), st.integers(0, 3)),
                  elements=st.integers(-1, 2)))  # fmt: skip
def test_codes_come_back_as_states(state: np.ndarray) -> None:
    codes = combination_codes(state)
    assert codes.shape == state.shape[1:]
    missing = np.any(state == NO_DATA, axis=0)
    assert np.array_equal(codes == -1, missing)
    back = combination_states(codes, len(state))
    assert np.array_equal(back, np.where(missing, NO_DATA, state))


@pytest.mark.parametrize("state", [[3, 0], [-2, 0]])
def test_what_is_no_state_has_no_code(state: list[int]) -> None:
    with pytest.raises(InputError, match="no state"):
        combination_codes(state)


@pytest.mark.parametrize("code", [-2, 27])
def test_what_is_no_code_has_no_states(code: int) -> None:
    with pytest.raises(InputError, match="no combination of 3 sensors"):
        combination_states([code], 3)


# --- detection, availability and safety -------------------------------------------------------


def test_shares_of_ten_epochs_counted_by_hand() -> None:
    state = np.array([N, N, N, N, DA, DA, U, U, U, NO_DATA], np.int8)
    usable = np.array([1, 1, 1, 0, 1, 0, 1, 0, 0, 1], bool)
    seen = shares(state, usable)
    assert seen.epochs == 10
    assert seen.no_data == 1
    assert seen.available == pytest.approx(0.6)
    assert seen.safe == pytest.approx(0.3)
    assert seen.hazard == pytest.approx(0.1)
    assert seen.false_alarm == pytest.approx(0.2)
    assert detected(state, usable).tolist() == [1, 1, 1, 0, 1, 0, 0, 1, 1, 0]
    assert seen.to_dict()["hazard"] == seen.hazard


@given(hnp.arrays(np.int8, 40, elements=st.integers(-1, 2)), hnp.arrays(np.bool_, 40))
def test_what_is_not_detected_is_a_hazard_or_a_false_alarm(
    state: np.ndarray, usable: np.ndarray
) -> None:
    seen = shares(state, usable)
    right = np.count_nonzero(detected(state, usable)) / 40
    assert right + seen.hazard + seen.false_alarm + seen.no_data / 40 == pytest.approx(1)
    assert seen.safe <= seen.available


def test_shares_of_nothing_and_of_things_apart_are_refused() -> None:
    with pytest.raises(InputError, match="no epoch"):
        shares(np.empty(0, np.int8), np.empty(0, bool))
    with pytest.raises(InputError, match="do not belong together"):
        shares(np.zeros(3, np.int8), np.zeros(2, bool))
    with pytest.raises(InputError, match="do not belong together"):
        detected(np.zeros(3, np.int8), np.zeros(3))
