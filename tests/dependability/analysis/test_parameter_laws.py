"""Laws of parameters against tables and against moments."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from sbas.dependability.analysis.parameter_laws import (
    DirichletRows,
    Fixed,
    Lognormal,
    RateFromCounts,
    law_of,
)
from sbas.estimate import Counted, Estimate, Quoted
from sbas.exceptions import InputError


@pytest.mark.parametrize(
    ("failures", "low", "high"),
    # Two-sided 95 % limits of a Poisson mean as tabulated (Garwood 1936).
    [(0, 0.0, 3.689), (1, 0.0253, 5.572), (2, 0.242, 7.225), (5, 1.623, 11.668),
     (10, 4.795, 18.390)],
)  # fmt: skip
def test_interval_as_tabulated(failures: int, low: float, high: float) -> None:
    found = RateFromCounts(failures, 1000.0).interval()
    assert found[0] * 1000 == pytest.approx(low, abs=6e-4)
    assert found[1] * 1000 == pytest.approx(high, abs=6e-4)


@pytest.mark.parametrize("failures", [1, 3, 40])
def test_gamma_quantiles_are_chi_square_bounds(failures: int) -> None:
    hours = 2e5
    u = np.array([[0.025], [0.5], [0.975]])
    upper = RateFromCounts(failures, hours).draw(u)
    lower = RateFromCounts(failures, hours, added=0.0).draw(u)
    low, high = RateFromCounts(failures, hours).interval()
    assert upper == pytest.approx(stats.chi2.ppf(u[:, 0], 2 * failures + 2) / (2 * hours))
    assert lower == pytest.approx(stats.chi2.ppf(u[:, 0], 2 * failures) / (2 * hours))
    assert upper[2] == pytest.approx(high, rel=1e-12)
    assert lower[0] == pytest.approx(low, rel=1e-12)


def test_lognormal_has_its_median_and_error_factor() -> None:
    p50, p95 = Lognormal(2e-6, 3.0).draw(np.array([[0.5], [0.95]]))
    assert p50 == pytest.approx(2e-6, rel=1e-12)
    assert p95 / p50 == pytest.approx(3.0, rel=1e-12)


def test_dirichlet_moments() -> None:
    law = DirichletRows(((4.5, 1.5, 0.0), (0.5, 0.5, 2.0), (1.0, 1.0, 1.0)))
    rows = law.draw(np.random.default_rng(4).random((40_000, 9)))
    assert rows.sum(axis=2) == pytest.approx(1.0)
    assert np.all(rows[:, 0, 2] == 0.0)
    shape = np.array(law.parameters)
    total = shape.sum(axis=1, keepdims=True)
    mean = shape / total
    spread = np.sqrt(mean * (1 - mean) / (total + 1))
    assert rows.mean(axis=0) == pytest.approx(mean, abs=5 * spread.max() / 200)
    assert rows.std(axis=0) == pytest.approx(spread, abs=0.005)


def test_an_estimate_that_was_counted_is_a_law() -> None:
    counted = Estimate(2e-6, None, 6.3e-6, 0.95, "per_h", Counted(2, 1e6))
    assert law_of(counted, where="E") == RateFromCounts(2, 1e6)
    assert law_of(Fixed(1.0), where="E") == Fixed(1.0)
    for other in (
        Estimate(2e-6, None, None, None, "per_h", Quoted("a sheet", "page 3")),
        Estimate(0.1, None, None, None, "1", Counted(2, 1e6)),
    ):
        with pytest.raises(InputError, match="a rate that was counted"):
            law_of(other, where="E")


def test_refusals() -> None:
    for make in (
        lambda: RateFromCounts(-1, 10.0),
        lambda: RateFromCounts(1, 0.0),
        lambda: RateFromCounts(1, math.inf),
        lambda: RateFromCounts(0, 10.0, added=0.0),
        lambda: Lognormal(1.0, 1.0),
        lambda: Lognormal(0.0, 3.0),
        lambda: Fixed(-1.0),
        lambda: DirichletRows(((1.0, 2.0),)),
        lambda: DirichletRows(((0.0, 0.0), (1.0, 1.0))),
    ):
        with pytest.raises(InputError):
            make()
