"""Jeffreys bounds against mpmath and beside the exact ones."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from sbas.estimate import Counted
from sbas.exceptions import InputError
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.tails.jeffreys import jeffreys_bounds, jeffreys_posterior


def test_no_event_is_half_a_chi_square_of_one() -> None:
    # chi2.isf(0.05, 1)/2 = 1.959964^2/2.
    found = jeffreys_bounds(0, 100.0, 0.95)
    assert found.upper == pytest.approx(1.959963984540054**2 / 200, rel=1e-12)
    assert found.evidence == "demonstrated"


@pytest.mark.parametrize("events", [0, 1, 3, 40])
def test_quantiles_against_mpmath(events: int) -> None:
    found = jeffreys_bounds(events, 10.0, 0.9, sided="two")
    shape = mpmath.mpf(events) + mpmath.mpf("0.5")
    for bound, below in ((found.lower, 0.05), (found.value, 0.5), (found.upper, 0.95)):
        assert bound is not None
        assert float(mpmath.gammainc(shape, 0, bound * 10, regularized=True)) == pytest.approx(
            below, rel=1e-9
        )


@pytest.mark.parametrize("events", [0, 1, 5, 60])
def test_the_exact_bound_is_the_safer(events: int) -> None:
    exact, bayes = poisson_bounds(events, 50.0, 0.95), jeffreys_bounds(events, 50.0, 0.95)
    assert exact.upper is not None
    assert bayes.upper is not None
    assert bayes.upper < exact.upper


def test_draws_have_the_posterior_moments() -> None:
    posterior = jeffreys_posterior(Counted(3, 20.0))
    drawn = posterior.draw_per_h(np.random.default_rng(1), 200_000)
    assert posterior.mean_per_h == 3.5 / 20
    assert drawn.mean() == pytest.approx(3.5 / 20, rel=0.01)
    assert np.quantile(drawn, 0.9) == pytest.approx(posterior.quantile_per_h(0.9), rel=0.01)


def test_small_upper_tails_keep_their_digits() -> None:
    posterior = jeffreys_posterior(Counted(0, 1.0))
    upper = posterior.upper_per_h(1e-18)
    tail = mpmath.gammainc(mpmath.mpf("0.5"), upper, mpmath.inf, regularized=True)
    assert float(tail) == pytest.approx(1e-18, rel=1e-9)


@pytest.mark.parametrize(("events", "hours"), [(-1, 10.0), (1, 0.0)])
def test_bad_counts_are_refused(events: float, hours: float) -> None:
    with pytest.raises(InputError):
        jeffreys_bounds(events, hours, 0.95)


def test_unknown_side_is_refused() -> None:
    with pytest.raises(InputError, match="side"):
        jeffreys_bounds(1, 10.0, 0.95, sided="both")  # type: ignore[arg-type]
