"""Shares of a top event: exact against enumeration, counted against counting by hand."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.fusion.importance.top_shares import (
    checked_marginals,
    cut_levels,
    fixed_by_table,
    independent_shares,
    marked,
    run_counts,
)
from sbas.fusion.logic.published_tables import figure_9

marginals = st.integers(1, 4).flatmap(
    lambda n: st.lists(
        st.tuples(st.floats(0.01, 0.4), st.floats(0.01, 0.4)), min_size=n, max_size=n
    ).map(lambda rows: np.array([(1 - d - u, d, u) for d, u in rows]))
)


def like_figure_9(n: int) -> np.ndarray:
    """N iff no U and at least one N; U iff all U."""
    combinations = np.array(list(itertools.product(range(3), repeat=n)))
    not_nominal = (combinations == 2).any(axis=1) | (combinations >= 1).all(axis=1)
    return (not_nominal + (combinations == 2).all(axis=1) * 1).reshape((3,) * n)


@given(marginals)
def test_n_sensor_form_of_the_page(p: np.ndarray) -> None:
    # Page section 8: P(isU) = prod u_i, P(notN) = 1 - prod(1 - u_i) + prod d_i.
    d, u = p[:, 1], p[:, 2]
    table = like_figure_9(len(p))
    assert independent_shares(table == 2, p).top == pytest.approx(u.prod(), rel=1e-13)
    expected = 1 - (1 - u).prod() + d.prod()
    assert independent_shares(table >= 1, p).top == pytest.approx(expected, rel=1e-12)


@given(marginals, st.randoms(use_true_random=False))
def test_any_table_against_enumeration(p: np.ndarray, random: object) -> None:
    n = len(p)
    rng = np.random.default_rng(random.getrandbits(32))  # type: ignore[attr-defined]
    top = rng.random((3,) * n) < 0.5
    shares = independent_shares(top, p)
    for i, s in itertools.product(range(n), range(3)):
        terms = [
            math.prod(p[j, c] for j, c in enumerate(x) if j != i)
            for x in itertools.product(range(3), repeat=n)
            if x[i] == s and top[x]
        ]
        assert shares.given[i, s] == pytest.approx(math.fsum(terms), abs=1e-14)
    assert shares.change == pytest.approx(shares.given[:, 1:] - shares.given[:, :1], abs=1e-14)
    assert (p * shares.given).sum(axis=1) == pytest.approx(float(shares.top), abs=1e-14)


def test_rare_states_keep_their_digits() -> None:
    # u = 1e-9 each: 1e-27 exactly, below the rounding of any 1 - p.
    p = np.tile([1 - 2e-9, 1e-9, 1e-9], (3, 1))
    shares = independent_shares(like_figure_9(3) == 2, p)
    assert shares.top == pytest.approx(1e-27, rel=1e-12)
    assert shares.change[0, 1] == pytest.approx(1e-18, rel=1e-12)
    assert shares.change[0, 0] == 0.0


def test_cut_vectors_of_figure_9() -> None:
    # Page section 3: notN = U1 or U2 or U3 or (D1 and D2 and D3), isU = U1 and U2 and U3.
    table = figure_9()
    cuts = cut_levels(marked(table, "notN"))
    assert cuts is not None
    x = np.indices((3, 3, 3))
    all_worse = (x >= 1).all(axis=0)
    for i in range(3):
        assert np.array_equal(cuts[i, 0], all_worse)
        assert np.array_equal(cuts[i, 1], x[i] == 2)
    cuts = cut_levels(marked(table, "isU"))
    assert cuts is not None
    assert not cuts[:, 0].any()
    assert np.array_equal(cuts[0, 1], (x == 2).all(axis=0))


@given(st.integers(1, 3), st.randoms(use_true_random=False))
def test_cut_vectors_by_definition(n: int, random: object) -> None:
    rng = np.random.default_rng(random.getrandbits(32))  # type: ignore[attr-defined]
    every = list(itertools.product(range(3), repeat=n))
    seeds = [every[k] for k in rng.integers(len(every), size=2)]

    def below(y: tuple[int, ...], x: tuple[int, ...]) -> bool:
        return all(a <= b for a, b in zip(y, x, strict=True))

    top = np.zeros((3,) * n, bool)
    for x in every:
        top[x] = any(below(y, x) for y in seeds)
    minimal = [
        y for y in every if top[y] and not any(top[z] and below(z, y) for z in every if z != y)
    ]
    cuts = cut_levels(top)
    assert cuts is not None
    for i, s, x in itertools.product(range(n), (1, 2), every):
        assert cuts[i, s - 1][x] == any(y[i] == s and below(y, x) for y in minimal)


def test_no_cut_vectors_where_a_worse_sensor_betters_the_output() -> None:
    # Page section 3: the printed tree is not monotone in notN; its only U is (U, U, U).
    assert cut_levels(marked(figure_9("printed"), "notN")) is None
    assert cut_levels(marked(figure_9("printed"), "isU")) is not None


def test_levels_that_decide_alone() -> None:
    fixed = fixed_by_table(marked(figure_9(), "notN"))
    assert fixed.tolist() == [[False, False, True]] * 3
    fixed = fixed_by_table(marked(figure_9(), "isU"))
    assert fixed.tolist() == [[True, True, False]] * 3


def test_counts_by_hand() -> None:
    # Two sensors, three epochs, two runs; the last epoch of run 1 does not count.
    states = np.array([[[0, 2], [1, 2], [2, 0]], [[0, 2], [1, 0], [2, 0]]], np.int8)
    known = np.array([[True, True], [True, True], [True, False]])
    top = like_figure_9(2) >= 1
    codes = 3 * states[0].astype(np.int64) + states[1]
    counts = run_counts(top, top.ravel()[codes], states, codes, known)
    assert counts.epochs.tolist() == [3, 2]
    assert counts.top.tolist() == [2, 2]
    assert counts.level[:, 0].tolist() == [[1, 1, 1], [0, 0, 2]]
    assert counts.both[:, 1].tolist() == [[0, 1, 1], [1, 0, 1]]
    # Cuts: any U, or both D. Run 0: DD holds for D in epochs 1 and 2, U in epoch 2.
    assert counts.by_cut[0].tolist() == [[2, 1], [2, 1]]
    assert counts.by_cut[1].tolist() == [[1, 2], [1, 1]]
    pooled = counts.shares(np.ones((1, 2))).first()
    assert pooled.top == pytest.approx(4 / 5)
    assert pooled.given[0].tolist() == [0.0, 1.0, 1.0]
    doubled = counts.shares(np.array([[2.0, 0.0]])).first()
    assert doubled.top == pytest.approx(2 / 3)
    alone = counts.shares(np.array([[0.0, 1.0]])).first()
    assert math.isnan(alone.given[0, 0])
    assert math.isnan(alone.change[0, 1])


@pytest.mark.parametrize(
    ("array", "where"),
    [
        ([[0.5, 0.5, 0.1]], "marginals of a"),
        ([[1.1, -0.1, 0.0]], "marginals of a"),
        ([[math.nan, 0.5, 0.5]], "marginals of a"),
        ([[0.5, 0.5]], "marginals"),
    ],
)
def test_wrong_marginals(array: list[list[float]], where: str) -> None:
    with pytest.raises(InputError) as caught:
        checked_marginals(np.array(array), ("a",))
    assert caught.value.where == where
