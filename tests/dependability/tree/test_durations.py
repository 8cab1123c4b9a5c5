"""Epochs of a duration, against the arithmetic of its definition."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.dependability.tree.durations import duration_epochs, whole_epochs
from sbas.exceptions import InputError


@pytest.mark.parametrize(
    ("seconds", "step_s", "age", "count", "strict"),
    [
        (60.0, 1.0, 61, 60, 62),
        (3.0, 1.0, 4, 3, 5),
        (2.5, 1.0, 4, 3, 4),
        (0.0, 1.0, 1, 1, 2),
        (0.3, 0.1, 4, 3, 5),  # 0.3/0.1 is 2.9999999999999996 in binary
        (0.7, 0.1, 8, 7, 9),
        (60.0, 0.25, 241, 240, 242),
        (86400.0 * 365, 0.1, 315360001, 315360000, 315360002),
    ],
)
def test_epochs_of_each_rule(
    seconds: float, step_s: float, age: int, count: int, strict: int
) -> None:
    assert duration_epochs(seconds, step_s, "age") == age
    assert duration_epochs(seconds, step_s, "count") == count
    assert duration_epochs(seconds, step_s, "strict") == strict


@given(st.integers(0, 4000), st.integers(1, 400), st.integers(1, 1000))
def test_against_the_definition_in_fractions(ticks: int, per_step: int, scale: int) -> None:
    """T and step in whole ticks of 1/scale s; the least run by the words of each rule."""
    ratio = Fraction(ticks, per_step)
    seconds, step_s = ticks / scale, per_step / scale
    # At the r-th epoch of a run r - 1 steps have passed since its first one.
    assert duration_epochs(seconds, step_s, "age") - 1 == math.ceil(ratio)
    strict = duration_epochs(seconds, step_s, "strict")
    assert strict - 1 > ratio >= strict - 2
    count = duration_epochs(seconds, step_s, "count")
    assert count >= max(1, ratio)
    assert count == 1 or count - 1 < ratio
    assert whole_epochs(seconds, step_s) == (ratio if ratio.denominator == 1 else None)


@pytest.mark.parametrize(
    ("seconds", "step_s", "rule"),
    [(-1.0, 1.0, "age"), (math.nan, 1.0, "age"), (math.inf, 1.0, "count"), (1.0, 0.0, "age"),
     (1.0, math.nan, "age"), (1e300, 1e-300, "age"), (1.0, 1.0, "later")],
)  # fmt: skip
def test_durations_that_mean_nothing(seconds: float, step_s: float, rule: str) -> None:
    with pytest.raises(InputError):
        duration_epochs(seconds, step_s, rule)  # type: ignore[arg-type]
