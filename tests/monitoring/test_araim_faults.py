"""Fault modes: how many faults at a time, which sets, and the risk of all others."""

from __future__ import annotations

from itertools import combinations

import mpmath as mp
import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.araim_faults import fault_sets, more_faults_than, most_faults, priors_of


@pytest.mark.parametrize(("total", "expected"), [(3e-4, 1), (1e-2, 3), (1e-1, 5)])
def test_most_faults_of_the_definition(total: float, expected: int) -> None:
    # (3e-4)^2/2 = 4.5e-8; 1e-8/24 < 8e-8 < 1e-6/6; 1e-6/720 < 8e-8 < 1e-5/120.
    found = most_faults(np.array([total]), np.array([12]), threshold=8e-8)
    assert found.tolist() == [expected]


def test_most_faults_at_each_epoch_and_limits() -> None:
    total = np.array([0.0, 3e-4, 1e-1, 1e-1, 1e-1])
    events = np.array([0, 12, 12, 3, 12])
    assert most_faults(total, events, threshold=8e-8).tolist() == [1, 1, 5, 3, 5]
    assert most_faults(total, events, threshold=8e-8, cap=2).tolist() == [1, 1, 2, 2, 2]


def test_just_two_faults_with_24_satellites_of_two_constellations() -> None:
    # 24 x 1e-5 + 2 x 1e-4 = 4.4e-4, and (4.4e-4)^2/2 = 9.68e-8 exceeds 8e-8.
    assert most_faults(np.array([4.4e-4]), np.array([26]), threshold=8e-8).tolist() == [2]


@pytest.mark.parametrize("scale", [0.3, 1e-3, 1e-15])
@pytest.mark.parametrize("most", [1, 2, 3])
def test_more_faults_than_is_exact_for_the_smallest_probabilities(scale: float, most: int) -> None:
    p = scale * np.array([1.0, 0.5, 0.25, 0.8, 0.1, 0.0, 1.0])
    exact = mp.mpf(0)
    for size in range(most + 1, len(p) + 1):
        for chosen in combinations(range(len(p)), size):
            exact += mp.fprod(
                mp.mpf(p[i]) if i in chosen else 1 - mp.mpf(p[i]) for i in range(len(p))
            )
    found = more_faults_than(p[:, None], np.array([most]))[0]
    assert found == pytest.approx(float(exact), rel=1e-13)
    assert found > 0


def test_more_faults_than_counts_at_each_epoch() -> None:
    p = np.full((3, 2), 0.1)
    found = more_faults_than(p, np.array([1, 2]))
    assert found == pytest.approx([0.028, 0.001], rel=1e-14)


def events_of(slots: int, clocks: int, most: int) -> set[tuple[tuple[int, ...], tuple[int, ...]]]:
    found = []
    for part in fault_sets(slots, clocks, most):
        found += [(part.clocks, tuple(row)) for row in part.slots.tolist()]
    assert len(found) == len(set(found))
    return set(found)


def test_sets_are_all_combinations_of_events() -> None:
    events = [("s", i) for i in range(4)] + [("c", i) for i in range(2)]
    for most in (1, 2, 3):
        expected = set()
        for size in range(1, most + 1):
            for chosen in combinations(events, size):
                clocks = tuple(i for kind, i in chosen if kind == "c")
                expected.add((clocks, tuple(i for kind, i in chosen if kind == "s")))
        assert events_of(4, 2, most) == expected


def test_number_of_modes_of_the_example_and_of_two_faults() -> None:
    assert len(events_of(10, 2, 1)) == 12
    assert len(events_of(24, 2, 2)) == 26 + 26 * 25 // 2


def test_too_many_modes_are_refused_with_a_cure() -> None:
    with pytest.raises(InputError, match="most_faults=2"):
        fault_sets(40, 2, 5)


def test_priors_are_products_and_a_constellation_covers_its_satellites() -> None:
    p_satellite = np.array([[1e-5, 1e-5], [2e-5, 0.0], [3e-5, 3e-5]])
    p_clock = np.array([[1e-4, 1e-4], [1e-3, 1e-3]])
    clock = np.array([[0, 0], [0, 0], [1, 0]])
    most = np.array([2, 1])
    found: dict[tuple[object, ...], list[float]] = {}
    for part in fault_sets(3, 2, 2):
        prior = priors_of(part, p_satellite=p_satellite, p_clock=p_clock, clock=clock, most=most)
        for row, values in zip(part.slots.tolist(), prior.tolist(), strict=True):
            found[part.clocks, tuple(row)] = values
    assert found[(), (1,)] == [2e-5, 0.0]
    assert found[(), (0, 2)] == pytest.approx([3e-10, 0.0])
    assert found[(0,), ()] == [1e-4, 1e-4]
    assert found[(0,), (0,)] == [0.0, 0.0]
    assert found[(0,), (2,)] == pytest.approx([3e-9, 0.0])
    assert found[(1,), (0,)] == pytest.approx([1e-8, 0.0])
    assert found[(0, 1), ()] == pytest.approx([1e-7, 0.0])
