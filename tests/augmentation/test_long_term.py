"""Long-term records over issues, masks and time-outs, and their degradation."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.long_term import (
    day_difference_s,
    orbit_clock_correction,
    outside_interval,
    whole_steps,
)
from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import CorrectionTimeline, correction_timeline
from tests.augmentation import encoding as enc

A, B = (3, 5, 9), (1, 3, 7)
LIGHT_MPS = 299792458.0


def record(position: int, iod: int, dx: int = 8, iodp: int = 0) -> bytes:
    return enc.long_term(enc.half_fixed(iodp, (position, iod, [dx, 0, 0], 16)), [])


def timeline(messages: dict[int, bytes], seconds: int = 900) -> CorrectionTimeline:
    return correction_timeline(enc.hourly({0: enc.mask(0, A), **messages}, seconds))


@pytest.mark.parametrize(("mode", "limit"), [("pa", 240), ("npa", 360)])
def test_a_record_times_out_at_its_exact_second(mode: Mode, limit: int) -> None:
    line = timeline({10: record(1, 7)})
    instants = line.reception.instants(
        enc.epochs_ns(10, 11, 10 + limit, 10.12 + limit, 10.13 + limit)
    )
    found = line.long_term(3, instants, mode=mode)
    assert found.row.tolist() == [-1, 0, 0, 0, 0]
    assert found.expired.tolist() == [True, False, False, False, True]
    assert found.before.tolist() == [-1] * 5


def test_the_record_of_the_issue_before_is_kept_with_its_own_time() -> None:
    line = timeline(
        {10: record(1, 7, 1), 50: record(1, 7, 2), 100: record(1, 8, 3), 150: record(1, 8, 4)}
    )
    instants = line.reception.instants(enc.epochs_ns(51, 101, 151, 290.12, 290.13, 410.13))
    found = line.long_term(3, instants, mode="pa")
    delta = line.decoded.long_term.delta_m
    assert (delta[found.row, 0] / 0.125).tolist() == [2, 3, 4, 4, 4, 4]
    assert found.before[0] == -1
    assert (delta[found.before[1:], 0] / 0.125).tolist() == [2] * 5
    assert found.before_expired.tolist() == [True, False, False, False, True, True]
    assert not line.long_term(3, instants, mode="npa").before_expired[4]


def test_the_issues_of_other_satellites_do_not_mix() -> None:
    line = timeline({10: record(1, 7), 20: record(2, 9), 30: record(1, 7), 40: record(2, 10)})
    instants = line.reception.instants(enc.epochs_ns(100))
    assert line.long_term(3, instants, mode="pa").before.tolist() == [-1]
    assert line.long_term(5, instants, mode="pa").before.tolist() == [1]
    assert line.long_term(9, instants, mode="pa").row.tolist() == [-1]


def test_records_of_the_old_mask_serve_until_those_of_the_new_one_come() -> None:
    line = timeline({10: record(1, 7, 1), 50: enc.mask(1, B), 90: record(2, 7, 2, iodp=1)})
    instants = line.reception.instants(enc.epochs_ns(49, 51, 90, 91))
    found = line.long_term(3, instants, mode="pa")
    assert (line.decoded.long_term.delta_m[found.row, 0] / 0.125).tolist() == [1, 1, 1, 2]
    assert not found.expired.any()


def test_an_alarm_wipes_out_records() -> None:
    line = timeline({10: record(1, 7), 20: record(1, 8), 30: enc.alarm(), 100: enc.mask(0, A),
                     110: record(1, 9)})  # fmt: skip
    instants = line.reception.instants(enc.epochs_ns(29, 105, 111))
    found = line.long_term(3, instants, mode="pa")
    assert found.row.tolist() == [1, -1, 2]
    assert found.before.tolist() == [0, -1, -1]


def corrected(
    messages: dict[int, bytes], epoch: float, sent_s: float
) -> tuple[np.ndarray, float, float]:
    line = timeline(messages)
    instants = line.reception.instants(enc.epochs_ns(epoch))
    found = line.long_term(3, instants, mode="npa")
    degradation = line.degradation(instants, mode="npa")
    result = orbit_clock_correction(
        line.decoded.long_term, found.row, np.array([sent_s]), instants, degradation
    )
    return result.delta_m[0], float(result.clock_s[0]), float(result.eps_ltc_m[0])


PARAMETERS = enc.degradation(c_ltc_lsb=38, c_ltc_v1=76, i_ltc_v1=256, c_ltc_v0=152, i_ltc_v0=100)


@pytest.mark.parametrize(("age", "steps"), [(98, 0), (98.9, 0), (99, 1), (198.9, 1), (199, 2)])
def test_degradation_without_rates_is_in_steps_of_the_first_bits_age(
    age: float, steps: int
) -> None:
    delta, clock, eps = corrected({10: record(1, 7), 12: PARAMETERS}, 10 + age, enc.START_S + 10.0)
    assert delta.tolist() == [1.0, 0, 0]
    assert clock == 16 / 2**31
    assert eps == pytest.approx(0.304 * steps)


@pytest.mark.parametrize(
    ("since", "eps"),
    [
        (0.001, 0),
        (255.999, 0),
        (0, 0.076),
        (256, 0.076),
        (-10, 0.076 + 0.038),
        (276, 0.076 + 0.076),
    ],
)
def test_corrections_with_rates_degrade_outside_their_interval(since: float, eps: float) -> None:
    """GPS 1,200,000,000 is 76,800 s of its day; t0 is 16 s later."""
    half = enc.half_moving(0, 1, 7, [8, -8, 16], 4, [16, 32, -64], 64, 76816 // 16)
    message = {10: enc.long_term(half, []), 12: PARAMETERS}
    delta, clock, found = corrected(message, 20, enc.START_S + 16 + since)
    np.testing.assert_allclose(delta, [1 + since / 128, -1 + since / 64, 2 - since / 32], atol=1e-9)
    assert clock == pytest.approx(4 / 2**31 + since * 64 / 2**39, rel=1e-12)
    assert found == pytest.approx(eps, abs=1e-9)


def test_without_type_10_there_is_no_degradation() -> None:
    assert corrected({10: record(1, 7)}, 200, enc.START_S + 10.0)[2] == 0.0


def test_times_of_the_day_wrap_at_midnight() -> None:
    midnight = 86400.0 * 20000
    time_s = np.array([midnight + 5, midnight - 5, midnight + 43200, midnight + 43201])
    found = day_difference_s(time_s, np.array([86384, 16, 0, 0]))
    assert found.tolist() == [21, -21, 43200, -43199]


def test_steps_survive_rounding_and_an_interval_of_zero() -> None:
    """30 - 4e-15 s is 30 s; an interval of 0 gives no step."""
    age, interval = np.array([30 - 4e-15, 29.999, 90.0]), np.array([30.0, 30.0, 0.0])
    assert whole_steps(age, interval).tolist() == [1, 0, 0]


def test_the_interval_is_open_at_both_ends() -> None:
    since = np.array([0.0, 1e-9, 10 - 1e-9, 10.0, 12.0, -2.0])
    ones = np.ones(6)
    found = outside_interval(since, 10 * ones, 3 * ones, 0.5 * ones)
    assert found.tolist() == [3, 0, 0, 3, 4, 4]
