"""Shape of exact autocorrelations, and verdicts beyond convention and chance."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.integrity.correlation.autocorrelation import Autocorrelation
from sbas.integrity.correlation.process_shape import (
    ProcessShape,
    gauss_markov_exponent,
    late_over_early,
    process_shape,
    shape_verdict,
    short_lag_exponent,
)

LAG = np.arange(20_000.0)
A = 360 / 2.146193
GAUSS_MARKOV = np.exp(-LAG / 360)
SECOND_ORDER = (1 + LAG / A) * np.exp(-LAG / A)
MIXED = 0.5 * np.exp(-LAG / 100) + 0.5 * np.exp(-LAG / 720)


def with_white(r: np.ndarray, share: float) -> np.ndarray:
    return np.where(LAG == 0, 1.0, (1 - share) * r)


@pytest.mark.parametrize(("r", "expected"), [(GAUSS_MARKOV, 0.892249), (SECOND_ORDER, 1.761186)])
@pytest.mark.parametrize("white", [0.0, 0.3])
def test_short_lag_exponent_is_free_of_the_white_part(
    r: np.ndarray, expected: float, white: float
) -> None:
    assert short_lag_exponent(with_white(r, white), 18) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("r", "expected"), [(GAUSS_MARKOV, 1.0), (SECOND_ORDER, 0.604), (MIXED, 2.54)]
)
def test_late_over_early_of_the_method_page(r: np.ndarray, expected: float) -> None:
    seen = process_shape(Autocorrelation(1.0, r[None], np.ones(r.size, np.int64)))
    assert seen.late_over_early == pytest.approx(expected, rel=1e-2)
    assert late_over_early(with_white(GAUSS_MARKOV, 0.2), 0.8) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("r", "verdict"), [(GAUSS_MARKOV, "gm1"), (SECOND_ORDER, "smooth"), (MIXED, "mixture")]
)
def test_a_long_record_tells_the_three_kinds_apart(r: np.ndarray, verdict: str) -> None:
    seen = process_shape(Autocorrelation(1.0, r[None], np.ones(r.size, np.int64)))
    assert shape_verdict(seen, recorded_s=3e5, step_s=1.0) == verdict


def test_a_short_record_leaves_more_to_chance() -> None:
    bent = ProcessShape(2.0, 0.7, 1.0, 360.0, 18.0)
    assert shape_verdict(bent, recorded_s=3e5, step_s=1.0) == "mixture"
    assert shape_verdict(bent, recorded_s=1e4, step_s=1.0) == "gm1"
    noisy = ProcessShape(1.0, 0.5, 0.7, 360.0, 18.0)
    assert shape_verdict(noisy, recorded_s=3e5, step_s=1.0) == "mixture"
    assert shape_verdict(noisy, recorded_s=3e5, step_s=60.0) == "gm1"


def test_undefined_is_a_mixture_where_the_record_could_tell() -> None:
    undefined = ProcessShape(np.nan, -np.inf, 1.0, 360.0, 18.0)
    assert shape_verdict(undefined, recorded_s=3e5, step_s=1.0) == "mixture"
    assert short_lag_exponent(np.ones(9), 2) == -np.inf
    unknown = ProcessShape(np.nan, np.nan, 1.0, 360.0, 18.0)
    assert shape_verdict(unknown, recorded_s=3e5, step_s=1.0) == "gm1"
    assert np.isnan(short_lag_exponent(GAUSS_MARKOV[:8], 2))
    lost = ProcessShape(np.nan, np.nan, np.nan, np.inf, np.nan)
    assert shape_verdict(lost, recorded_s=3e5, step_s=1.0) == "mixture"


@pytest.mark.parametrize("tau", [1.5, 5.0, 20.0, 3000.0])
def test_a_coarse_step_is_no_mixture(tau: float) -> None:
    r = np.exp(-LAG / tau)
    seen = process_shape(Autocorrelation(1.0, r[None], np.ones(r.size, np.int64)))
    assert shape_verdict(seen, recorded_s=1e6, step_s=1.0) == "gm1"
    assert seen.short_lag_exponent == pytest.approx(
        gauss_markov_exponent(np.exp(-seen.exponent_lag_s / tau)), rel=1e-6
    )
