"""Walks along a chain against matrix powers, and the run of twelve of the method page."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.dependability.exact.transient import check_mass, expectations, first_passage, matrix_of
from sbas.dependability.exact.transitions import Chain
from sbas.exceptions import SbasError


def dense(p: np.ndarray, start: np.ndarray, epochs: int) -> Chain:
    rows, columns = np.nonzero(p)
    indptr = np.searchsorted(rows, np.arange(len(p) + 1))
    return Chain(start, indptr, columns, (p[rows, columns],), (epochs,), {})


@pytest.mark.parametrize("size", [3, 100])
@pytest.mark.parametrize("epochs", [1, 2, 127, 1300])
def test_expectations_are_powers(size: int, epochs: int) -> None:
    rng = np.random.default_rng(size)
    p = rng.random((size, size)) * (rng.random((size, size)) < 0.3) + np.eye(size)
    p /= p.sum(axis=1, keepdims=True)
    start, columns = np.eye(size)[0], rng.random((size, 2))
    chain = dense(p, start, epochs)
    values = expectations(start, [matrix_of(chain)], chain.ends, [columns])
    assert values.shape == (epochs + 1, 2)
    for n in {0, 1, epochs // 2, epochs}:
        exact = start @ np.linalg.matrix_power(p, n) @ columns
        assert values[n] == pytest.approx(exact, rel=1e-11)


def test_run_of_twelve() -> None:
    p = np.zeros((13, 13))
    for run in range(12):
        p[run, 0] = 0.999 if run == 0 else 0.95
        p[run, run + 1] = 0.001 if run == 0 else 0.05
    chain = dense(p, np.eye(13)[0], 3600)
    hits = first_passage(chain, np.arange(13) == 12)
    assert hits[-1] == pytest.approx(1.75059921070166569e-14, rel=1e-12)
    assert hits[11] == 0.0 < hits[12]


def test_a_start_inside_counts_only_if_it_stays() -> None:
    p = np.array([[0.25, 0.75], [0.0, 1.0]])
    hits = first_passage(dense(p, np.array([1.0, 0.0]), 3), np.array([True, False]))
    assert hits.tolist() == [0.0, 0.25, 0.25, 0.25]


def test_lost_mass_is_an_error() -> None:
    check_mass(1.0 + 1e-12)
    with pytest.raises(SbasError, match="do not sum to 1"):
        check_mass(1.0 - 1e-8)
