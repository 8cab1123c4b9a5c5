"""Modelled rates of events against the exact hazard of the process that made the errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sbas.estimate import Estimate, Refusal
from sbas.integrity.error_process import ErrorProcess
from sbas.integrity.exposure.gauss_markov_sampled import extremal_index
from sbas.integrity.level_counts import LevelCounter, LevelCounts
from sbas.integrity.modelled_rates import modelled_event_rate
from sbas.integrity.rate_evidence import EventKind
from sbas.recording import MODES
from tests.integrity.test_error_process import K_NPA, K_OF_MODE, gauss_markov, gridded, process_of

TAU_S = 40.0


def true_rate_per_h(k: float) -> float:
    """Hazard of the sampled two-dimensional Gauss-Markov process, exact."""
    theta = extremal_index(k, correlation=math.exp(-1 / TAU_S))
    return 3600 * theta * math.exp(-k * k / 2)


@pytest.fixture(scope="module")
def process() -> ErrorProcess:
    return process_of(gridded(gauss_markov(TAU_S, 200_000, 21)))


def levels_of(hpl_m: np.ndarray) -> LevelCounts:
    counter = LevelCounter(1_500_000_000)
    time = np.arange(hpl_m.size) * 1_000_000_000
    counter.update(time, hpl_m, np.full(hpl_m.size, MODES.index("sbas_npa"), np.int8))
    return counter.result()


def rate(kind: EventKind, limit: float, process: ErrorProcess, hpl_m: np.ndarray) -> Estimate:
    found = modelled_event_rate(
        kind, limit, process=process, levels=levels_of(hpl_m), confidence=0.95
    )
    assert isinstance(found, Estimate), found
    return found


@pytest.mark.parametrize(
    ("kind", "limit", "k"), [("mi", 50.0, K_NPA), ("exceeds_al", 5.0, 5.0), ("hmi", 6.5, 6.5)]
)
def test_the_bound_holds_the_exact_rate_and_is_not_far(
    process: ErrorProcess, kind: EventKind, limit: float, k: float
) -> None:
    # Sigma is 1 m and HPL 6.18 m, so that an alert limit in metres is a K.
    found = rate(kind, limit, process, np.full(200_000, 6.18))
    truth = true_rate_per_h(k)
    assert found.upper is not None
    assert truth < found.upper < 30 * truth
    assert truth / 10 < found.value < 10 * truth


def test_hmi_is_impossible_where_the_level_is_above_the_limit(process: ErrorProcess) -> None:
    hpl = np.full(1_000_000, 6.18)
    impossible = modelled_event_rate(
        "hmi", 6.0, process=process, levels=levels_of(hpl), confidence=0.95
    )
    assert isinstance(impossible, Refusal)
    half = np.where(np.arange(1_000_000) < 500_000, 6.18, 12.36)
    both, one = rate("hmi", 7.0, process, half), rate("exceeds_al", 7.0, process, hpl)
    # Half of the epochs are possible; the others, of twice the sigma, are not.
    assert both.value == pytest.approx(one.value / 2, rel=1e-3)
    assert any("50 %" in caveat for caveat in both.caveats)


def test_epochs_of_larger_sigma_make_the_rate_of_large_errors(process: ErrorProcess) -> None:
    small = np.full(1_000_000, 6.18)
    mixed = np.where(np.arange(1_000_000) < 10_000, 12.36, 6.18)
    rare = rate("exceeds_al", 7.0, process, small).value
    often = rate("exceeds_al", 7.0, process, mixed).value
    at_half = rate("exceeds_al", 3.5, process, small).value
    assert often == pytest.approx(0.99 * rare + 0.01 * at_half, rel=0.02)


def test_a_level_that_jumps_brings_events_of_its_own(process: ErrorProcess) -> None:
    """Each short spike of sigma meets the error anew: nearly a chance of p each, not h dt."""
    spiky = np.full(100_000, 6.18)
    spiky[::500] *= 2
    found = rate("exceeds_al", 8.0, process, spiky)
    # 7.2 spikes an hour, each one epoch of K = 4: exp(-K^2/2), exact; the rest is negligible.
    truth = 7.2 * math.exp(-8)
    assert found.upper is not None
    assert truth < found.upper < 5 * truth
    assert truth / 3 < found.value < 3 * truth
    # As a share of a slow process alone it would be less by the extremal index.
    slow = true_rate_per_h(4.0) * 200 / 100_000
    assert found.value > 3 * slow


def test_a_refused_tail_gives_its_reason() -> None:
    process = process_of(Refusal("without truth no error is formed"))
    found = modelled_event_rate(
        "mi", 50.0, process=process, levels=levels_of(np.ones(3)), confidence=0.95
    )
    assert found == process.tail
    assert process.k_of_mode is K_OF_MODE
