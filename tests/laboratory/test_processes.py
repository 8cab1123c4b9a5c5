"""Gauss-Markov errors and Poisson events against their definitions and exact moments."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.laboratory.processes import gauss_markov, poisson_events


@given(
    tau_s=st.floats(1e-3, 1e6),
    interval_s=st.floats(1e-2, 1e3),
    length=st.integers(1, 300),
    seed=st.integers(0, 2**32),
)
def test_doubling_equals_the_plain_recursion(tau_s, interval_s, length, seed):
    generator = np.random.default_rng(seed)
    noise, state = generator.standard_normal((2, length)), generator.standard_normal(2)
    rho = np.exp(-interval_s / tau_s)
    expected, x = [], state
    for e in noise.T:
        x = rho * x + np.sqrt(-np.expm1(-2 * interval_s / tau_s)) * e
        expected.append(x)
    got = gauss_markov(noise, state, interval_s=interval_s, tau_s=tau_s)
    assert got == pytest.approx(np.array(expected).T, abs=1e-12)


def test_blocks_joined_by_the_state_equal_one_run():
    generator = np.random.default_rng(3)
    noise, state = generator.standard_normal((3, 1000)), generator.standard_normal(3)
    kind = {"interval_s": 1.0, "tau_s": 360.0}
    whole = gauss_markov(noise, state, **kind)
    first = gauss_markov(noise[:, :400], state, **kind)
    second = gauss_markov(noise[:, 400:], first[:, -1], **kind)
    assert np.concatenate([first, second], axis=1) == pytest.approx(whole, abs=1e-12)


def test_variance_one_and_correlation_exp_of_lag_over_tau():
    # 40 000 independent paths of 60 steps: exact moments, sampling error 1/sqrt(40 000) = 0.005.
    generator = np.random.default_rng(4)
    noise, state = generator.standard_normal((40_000, 60)), generator.standard_normal(40_000)
    x = gauss_markov(noise, state, interval_s=2.0, tau_s=30.0)
    assert np.var(x[:, -1]) == pytest.approx(1, abs=4 * np.sqrt(2 / 40_000))
    for lag in (1, 15, 45):
        correlation = np.mean(x[:, -1] * x[:, -1 - lag])
        assert correlation == pytest.approx(np.exp(-2.0 * lag / 30.0), abs=4 * 0.005 * 1.42)


def draw(seed, *, rate_per_h=2.0, epochs=36_000, duration_s=(5.0, 50.0), interval_s=1.0):
    return poisson_events(
        np.random.default_rng(seed),
        rate_per_h=rate_per_h,
        duration_s=duration_s,
        interval_s=interval_s,
        epochs=epochs,
        width=2,
    )


def test_counts_are_poisson_with_the_stated_rate():
    # 500 records of 10 h at 2 per hour: mean 20, variance 20.
    counts = np.array([len(draw(seed).start) for seed in range(500)])
    assert counts.mean() == pytest.approx(20, abs=4 * np.sqrt(20 / 500))
    assert counts.var() / counts.mean() == pytest.approx(1, abs=4 * np.sqrt(2 / 500))
    many = draw(1, epochs=36_000_000)
    waits = np.diff(many.start)
    # Exponential: standard deviation equals the mean, exp(-1) of the waits are longer.
    assert waits.std() / waits.mean() == pytest.approx(1, abs=4 / np.sqrt(len(waits)))
    assert np.mean(waits > 1800) == pytest.approx(np.exp(-1), abs=4 * 0.48 / np.sqrt(len(waits)))


def test_a_longer_record_begins_with_the_same_events():
    short, long = draw(7), draw(7, epochs=360_000)
    n = len(short.start)
    assert 0 < n < len(long.start)
    assert (long.start[:n] == short.start).all()
    assert (long.uniform[:n] == short.uniform).all()


def test_durations_lie_in_the_range_and_are_at_least_one_epoch():
    events = draw(2, epochs=36_000_000)
    length = (events.stop - events.start)[:-1]
    assert (length.min(), length.max()) == (5, 50)
    # Log-uniform: half of them below the geometric mean of the two ends.
    fine = draw(2, epochs=36_000_000, duration_s=(5000.0, 50_000.0))
    share = np.mean((fine.stop - fine.start)[:-30] < 5000 * np.sqrt(10))
    assert share == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(len(length)))
    coarse = draw(2, interval_s=300.0, epochs=10_000)
    assert ((coarse.stop - coarse.start) == 1).all()


def test_no_event_at_rate_zero_and_none_beyond_the_end():
    assert len(draw(1, rate_per_h=0.0).start) == 0
    events = draw(3, rate_per_h=100.0, epochs=500, duration_s=(400.0, 400.0))
    assert events.start.max() < 500
    assert events.stop.max() == 500


def test_within_gives_each_block_its_part():
    events = draw(5, rate_per_h=60.0)
    painted = np.zeros(36_000, bool)
    for first in range(0, 36_000, 1000):
        block = np.zeros(1000, bool)
        for _, part in events.within(first, first + 1000):
            block[part] = True
        painted[first : first + 1000] = block
    expected = np.zeros(36_000, bool)
    for start, stop in zip(events.start, events.stop, strict=True):
        expected[start:stop] = True
    assert (painted == expected).all()
