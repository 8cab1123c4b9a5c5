"""The fast and long-term part of the variance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.augmentation.range_error import sigma_flt_m


def sigma(*terms: float, rss: bool = False, degraded: bool = True) -> float:
    arrays = [np.array([term]) for term in terms]
    found = sigma_flt_m(*arrays, root_sum_square=np.array([rss]), degraded=np.array([degraded]))
    return float(found[0])


@pytest.mark.parametrize(
    ("terms", "wanted"),
    [
        ((1.8237, 1.002, 0.1856, 0.0, 0.3040, 0.0), 2.3174),
        ((1.3678, 1.021, 0.0261, 0.0544, 0.0, 0.0), 1.4768),
    ],
)
def test_budgets_of_glab(terms: tuple[float, ...], wanted: float) -> None:
    """Kamakura, G20 at 12:03:00 (UDREI 9), and the vehicle, G22 at 06:03:32: as printed."""
    assert sigma(*terms) == pytest.approx(wanted, abs=1e-3)


def test_terms_as_squares() -> None:
    assert sigma(2, 3, 2, 3, 6, 0, rss=True) == pytest.approx(np.sqrt(36 + 4 + 9 + 36))
    assert sigma(2, 3, 2, 3, 6, 1) == 18


def test_without_degradation_parameters_eight_metres_are_added() -> None:
    for rss in (False, True):
        assert sigma(2, 3, 2, 3, 6, 1, rss=rss, degraded=False) == 14


@given(st.lists(st.floats(0, 100), min_size=6, max_size=6))
def test_squares_never_give_more_than_the_sum(terms: list[float]) -> None:
    assert sigma(*terms, rss=True) <= sigma(*terms) * (1 + 1e-12)
    assert sigma(*terms, rss=True) >= terms[0] * terms[1] * (1 - 1e-12)
