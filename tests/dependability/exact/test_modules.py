"""Independent parts against the definition of a rise, part by part."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from sbas.dependability.exact.modules import Course, any_passage, at_least, independent_groups


def two_epochs(before: float, now: float, rise: float) -> Course:
    return Course(np.array([before, now]), np.array([0.0, rise]))


PARTS = [two_epochs(0.2, 0.3, 0.15), two_epochs(0.5, 0.4, 0.1), two_epochs(0.05, 0.07, 0.06)]


@pytest.mark.parametrize("k", [1, 2, 3])
def test_at_least_k_by_all_cases(k: int) -> None:
    on = rise = 0.0
    for case in product(product((0, 1), repeat=2), repeat=3):
        p = 1.0
        for part, (before, now) in zip(PARTS, case, strict=True):
            stay = part.on[1] - part.rise[1]
            pair = {
                (0, 0): 1 - part.on[0] - part.rise[1], (0, 1): part.rise[1],
                (1, 0): part.on[0] - stay, (1, 1): stay,
            }  # fmt: skip
            p *= pair[before, now]
        was, is_now = (sum(column) >= k for column in zip(*case, strict=True))
        on += p * is_now
        rise += p * (is_now and not was)
    course = at_least(k, PARTS)
    assert course.on[1] == pytest.approx(on, rel=1e-14)
    assert course.rise[1] == pytest.approx(rise, rel=1e-14)


def test_rare_parts_keep_their_digits() -> None:
    rare = [two_epochs(0.0, 1e-30, 1e-30), two_epochs(0.0, 3e-30, 3e-30)]
    assert at_least(1, rare).on[1] == pytest.approx(4e-30, rel=1e-15)
    assert at_least(1, rare).rise[1] == pytest.approx(4e-30, rel=1e-15)
    assert at_least(2, rare).on[1] == pytest.approx(3e-60, rel=1e-15)
    assert any_passage([np.array([1e-30]), np.array([0.5])])[0] == 0.5


def test_groups_follow_what_is_shared() -> None:
    below = {"a": frozenset("x"), "b": frozenset("y"), "c": frozenset("xz"), "d": frozenset("zw")}
    groups = independent_groups(["a", "b", "c", "d"], below)
    assert sorted(map(sorted, groups)) == [["a", "c", "d"], ["b"]]
