"""The process behind the errors: K by mode, the sigma that errors had, when a tail is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from sbas.estimate import Estimate, Refusal
from sbas.integrity.correlation.error_grid import ErrorGrid
from sbas.integrity.error_process import ErrorProcess, error_process
from sbas.integrity.tails.tail_fit import TailFit
from sbas.recording import MODES

K_NPA = 6.18
EPOCHS = 30_000
"""One length where any will do: the simulated records behind an interval are then shared."""
NO_INTERVAL = 999
"""Below the least number of epochs for a decorrelation time: nothing is simulated."""
K_OF_MODE = np.full(len(MODES) + 1, np.nan)
K_OF_MODE[MODES.index("sbas_npa")] = K_NPA


def gauss_markov(tau: float, n: int, seed: int) -> np.ndarray:
    rho = math.exp(-1 / tau)
    noise = np.random.default_rng(seed).standard_normal((2, n)) * math.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], noise)


def gridded(errors: np.ndarray, hpl_m: float = 6.18) -> ErrorGrid:
    n = errors.shape[1]
    return ErrorGrid(
        errors.astype(np.float32), 1_000_000_000, 0, np.full(n, hpl_m, np.float32),
        np.full(n, MODES.index("sbas_npa"), np.int8),
    )  # fmt: skip


def process_of(grid: ErrorGrid | Refusal, *, lower_bound: bool = False) -> ErrorProcess:
    return error_process(grid, k_of_mode=K_OF_MODE, confidence=0.95, lower_bound=lower_bound)


@pytest.fixture(scope="module")
def ordinary() -> ErrorProcess:
    return process_of(gridded(gauss_markov(40, EPOCHS, 1)))


def test_a_gaussian_record_has_tau_tail_and_unit_sigma(ordinary: ErrorProcess) -> None:
    tau = ordinary.decorrelation.tau_s
    assert isinstance(tau, Estimate)
    assert tau.lower is not None
    assert tau.upper is not None
    assert tau.lower < 40 < tau.upper
    assert isinstance(ordinary.tail, TailFit)
    assert ordinary.tail.refusal is None
    assert ordinary.tail.tau_s == tau.value
    assert (ordinary.tail.tau_low_s, ordinary.tail.tau_high_s) == (tau.lower, tau.upper)
    # 750 decorrelation times: sigma to some 3 %, and the larger eigenvalue is a little larger.
    assert ordinary.sigma_ratio == pytest.approx(1.0, abs=0.06)
    assert ordinary.tau_upper_s == tau.upper


def test_sigma_counts_the_mean_error_too() -> None:
    errors = gauss_markov(1, NO_INTERVAL, 2) + np.array([[3.0], [0.0]])
    ratio = process_of(gridded(errors)).sigma_ratio
    assert ratio == pytest.approx(math.sqrt(1 + 9), rel=0.05)


def test_half_the_level_is_twice_the_ratio() -> None:
    errors = gauss_markov(1, NO_INTERVAL, 3)
    whole, half = (process_of(gridded(errors, hpl)).sigma_ratio for hpl in (6.18, 3.09))
    assert whole is not None
    assert half == pytest.approx(2 * whole, rel=1e-6)


def test_merge_time_is_half_a_tau_but_at_least_a_minute(ordinary: ErrorProcess) -> None:
    assert ordinary.merge_s == 60.0
    slow = process_of(gridded(gauss_markov(400, EPOCHS, 4)))
    tau = slow.decorrelation.tau_s
    assert isinstance(tau, Estimate)
    assert slow.merge_s == tau.value / 2 > 60


def test_white_noise_beside_a_slow_error_reaches_the_clock() -> None:
    errors = gauss_markov(100, 100_000, 5)
    noise = np.random.default_rng(6).standard_normal(errors.shape)
    found = process_of(gridded(math.sqrt(0.9) * errors + math.sqrt(0.1) * noise))
    assert found.decorrelation.white_share == pytest.approx(0.1, abs=0.01)
    assert isinstance(found.tail, TailFit)
    assert found.tail.nugget == found.decorrelation.white_share
    assert found.tail.refusal is None


def test_errors_against_the_own_median_are_not_modelled() -> None:
    found = process_of(gridded(gauss_markov(40, EPOCHS, 7)), lower_bound=True)
    assert isinstance(found.decorrelation.tau_s, Estimate)
    assert isinstance(found.tail, Refusal)
    assert "lower bound" in found.tail.reason


def test_a_mixture_gives_no_clock() -> None:
    errors = gauss_markov(5, 100_000, 8) + gauss_markov(300, 100_000, 9)
    found = process_of(gridded(errors))
    assert found.decorrelation.misfit == "mixture"
    assert isinstance(found.tail, Refusal)
    assert "mixture" in found.tail.reason


@pytest.mark.parametrize("what", ["no level", "too short", "no grid"])
def test_what_cannot_be_known_is_refused_in_words(what: str) -> None:
    grid: ErrorGrid | Refusal
    if what == "no level":
        grid = gridded(gauss_markov(40, EPOCHS, 1), math.nan)
    elif what == "too short":
        grid = gridded(gauss_markov(400, 1000, 11))
    else:
        grid = Refusal("without truth no error is formed")
    found = process_of(grid)
    assert isinstance(found.tail, Refusal)
    assert len(found.tail.reason) > 20
    if what != "no level":
        assert found.tau_upper_s is None
        assert found.merge_s == 60.0
