"""Arcs, slips and smoothing against plain loops (page sections 9.3 and 9.4)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.positioning.arcs import Arcs, find_arcs, smoothed_range


def plain_arcs(
    time: list[float], code: list[float], carrier: list[float]
) -> tuple[list[int], list[bool]]:
    """One epoch after the other, with everything that the rules name kept in lists."""
    places, jumps = [], []
    kept: list[tuple[float, float]] = []
    place, last_time, last_difference = 0, -np.inf, np.nan
    for t, c, phase in zip(time, code, carrier, strict=True):
        x = phase - c
        new = t - last_time > 10
        if not new and np.isfinite(x):
            window = [value for when, value in kept if when >= t - 300]
            if window:
                n = len(window)
                mean = sum(window) / n
                variance = sum((value - mean) ** 2 for value in window) / n
                variance -= (variance - 9) / n
                new = (x - mean) ** 2 > 25 * min(variance, 9)
        if new:
            kept, place, last_difference = [], 0, np.nan
        place += 1
        places.append(place)
        jumps.append(bool(abs(x - last_difference) > 20))
        if np.isfinite(x):
            kept.append((t, x))
        last_time, last_difference = t, x
    return places, jumps


@st.composite
def passes(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A satellite's code and carrier with gaps, slips and missing carriers."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    k = draw(st.integers(1, 900))
    step = rng.choice([1, 1, 1, 1, 9, 10, 11], k)
    step[rng.random(k) < 0.9] = 1
    time = 1000.0 + np.cumsum(step)
    truth = 2.1e7 + 300.0 * (time - time[0])
    code = truth + rng.normal(0, draw(st.sampled_from([0.1, 1.0, 3.0])), k)
    carrier = truth + rng.normal(0, 0.01, k) + 55.0
    for at in rng.integers(0, k, draw(st.integers(0, 4))):
        carrier[at:] += rng.choice([-40.0, 6.0, 16.0, 25.0, 1000.0])
    carrier[rng.random(k) < 0.03] = np.nan
    return time, code, carrier


@given(passes())
def test_arcs_are_those_of_a_plain_loop(ranges: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    time, code, carrier = ranges
    arcs = find_arcs(time, code, carrier)
    places, jumps = plain_arcs(time.tolist(), code.tolist(), carrier.tolist())
    assert arcs.place.tolist() == places
    assert arcs.jumped.tolist() == jumps


def test_arcs_at_their_edges() -> None:
    flat = np.full(6, 2.1e7)
    ten = find_arcs(np.array([0.0, 1, 11, 21, 32, 33]), flat, flat)
    assert ten.place.tolist() == [1, 2, 3, 4, 1, 2]
    slow = find_arcs(np.array([0.0, 30, 60, 120, 165]), flat[:5], flat[:5], interval_s=30.0)
    assert slow.place.tolist() == [1, 2, 3, 1, 2]
    assert find_arcs(np.empty(0), np.empty(0), np.empty(0)).place.size == 0
    # Within the first 15 m of a young window nothing is a slip, beyond it anything is.
    for metres, place in ((14.9, 2), (15.1, 1)):
        carrier = flat[:2] + np.array([0.0, metres])
        assert find_arcs(np.array([0.0, 1.0]), flat[:2], carrier).place.tolist() == [1, place]


def test_many_slips_are_found_one_by_one() -> None:
    time = np.arange(20_000.0)
    code = np.full(time.size, 2.1e7)
    arcs = find_arcs(time, code, code + 100.0 * (time // 7))
    assert arcs.place.tolist() == (time % 7 + 1).astype(int).tolist()


def plain_smoothing(
    places: list[int], code: list[float], carrier: list[float], most: int
) -> tuple[list[float], list[int]]:
    """S = ((n - 1) S + (C - L)) / n, smoothed = S + L."""
    result, counts, n, s = [], [], 0, 0.0
    for place, c, phase in zip(places, code, carrier, strict=True):
        if place <= 2 or not np.isfinite(phase):
            n = 0
            result.append(c)
            counts.append(0)
            continue
        n += 1
        window = min(n, most)
        s = c - phase if n == 1 else ((window - 1) * s + (c - phase)) / window
        result.append(s + phase)
        counts.append(n)
    return result, counts


@given(passes(), st.sampled_from([1.0, 0.2, 30.0, 200.0]))
def test_smoothing_is_that_of_a_plain_loop(
    ranges: tuple[np.ndarray, np.ndarray, np.ndarray], interval: float
) -> None:
    time, code, carrier = ranges
    arcs = find_arcs(time, code, carrier)
    got = smoothed_range(arcs, code, carrier, interval_s=interval)
    most = max(round(100 / interval), 1)
    exact, counts = plain_smoothing(arcs.place.tolist(), code.tolist(), carrier.tolist(), most)
    assert got.range_m == pytest.approx(exact, abs=1e-6)
    assert got.epochs.tolist() == counts


def test_smoothing_takes_the_noise_of_the_code_away() -> None:
    """White code noise: the variance of the mean of n epochs is 1 / n, that of a steady filter
    1 / (2 n - 1) (the sum of its squared weights)."""
    rng = np.random.default_rng(0)
    runs, k = 400, 700
    carrier = np.full(k, 2.1e7)
    arcs = Arcs(np.arange(1, k + 1), np.zeros(k, bool))
    error = np.array(
        [
            smoothed_range(arcs, carrier + rng.normal(0, 1, k), carrier, interval_s=1.0).range_m
            - carrier
            for _ in range(runs)
        ]
    )
    spread = error.std(axis=0)
    assert spread[101] == pytest.approx(100**-0.5, rel=0.15)
    assert spread[600:].mean() == pytest.approx(199**-0.5, rel=0.1)
