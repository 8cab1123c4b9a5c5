"""The series in blocks against the recursion itself, in long double."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.integrity.gauss_markov_series import gauss_markov_series


@pytest.mark.parametrize("correlation", [1e-3, 0.3, 0.9, 0.999, 1 - 1e-6])
@pytest.mark.parametrize("shape", [(1,), (7,), (2, 3, 1000)])
def test_is_the_recursion(correlation: float, shape: tuple[int, ...]) -> None:
    noise = np.random.default_rng(3).standard_normal(shape)
    expected = noise.astype(np.longdouble)
    for i in range(1, shape[-1]):
        expected[..., i] += np.longdouble(correlation) * expected[..., i - 1]
    size = np.abs(expected).max()
    double = gauss_markov_series(noise, correlation)
    assert double.dtype == np.float64
    assert np.abs(double - expected).max() <= 1e-13 * size
    single = gauss_markov_series(noise.astype(np.float32), correlation)
    assert single.dtype == np.float32
    assert np.abs(single - expected).max() <= 2e-5 * size
