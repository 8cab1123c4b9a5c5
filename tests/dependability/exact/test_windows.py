"""Windows against the formula for one run, and against the carried product for several."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.dependability.exact.transient import matrix_of
from sbas.dependability.exact.transitions import Chain
from sbas.dependability.exact.windows import Run, last_runs


def random_chain(size: int = 6, seed: int = 3) -> Chain:
    rng = np.random.default_rng(seed)
    p = rng.random((size, size))
    p /= p.sum(axis=1, keepdims=True)
    start = rng.random(size)
    indptr = np.arange(0, size * size + 1, size)
    return Chain(
        start / start.sum(), indptr, np.tile(np.arange(size), size), (p.ravel(),), (50,), {}
    )


@pytest.mark.parametrize("length", [1, 2, 5])
def test_one_run_is_a_power_of_its_block(length: int) -> None:
    chain, inside = random_chain(), np.array([True, True, False, True, False, False])
    back = last_runs(chain, [Run(inside, length)], lambda on: on[0].astype(float)[:, None])
    p = matrix_of(chain).toarray()
    h = np.linalg.matrix_power(p[np.ix_(inside, inside)], length - 1).sum(axis=1)
    assert back.lag == length - 1
    assert back.on[inside, 0] == pytest.approx(h, rel=1e-14)
    assert (back.on[~inside] == 0).all()
    entry = p[:, inside] @ h
    assert back.rise[:, 0] == pytest.approx(np.where(inside, 0.0, entry), rel=1e-14)
    assert (back.early_on == 0).all()
    if length > 1:  # the run since epoch 0
        assert back.early_rise[-1] == pytest.approx(chain.start[inside] @ h, rel=1e-14)
        assert (back.early_rise[:-1] == 0).all()


def test_several_runs_by_every_path() -> None:
    chain = random_chain(3)
    sets = (np.array([True, True, False]), np.array([False, True, True]))
    lengths = (4, 2)

    def true(path: tuple[int, ...]) -> bool:
        held = [
            len(path) >= d and all(s[i] for i in path[-d:])
            for s, d in zip(sets, lengths, strict=True)
        ]
        return held[0] != held[1]

    back = last_runs(
        chain,
        [Run(s, d) for s, d in zip(sets, lengths, strict=True)],
        lambda on: (on[0] != on[1]).astype(float)[:, None],
    )
    p = matrix_of(chain).toarray()
    paths = {(i,): float(chain.start[i]) for i in range(3)}
    law = chain.start
    for n in range(7):
        on = sum(w for path, w in paths.items() if true(path))
        rise = sum(w for path, w in paths.items() if n and true(path) and not true(path[:-1]))
        if n < back.lag:
            assert back.early_on[n, 0] == pytest.approx(on, rel=1e-13)
        else:
            law_then = chain.start @ np.linalg.matrix_power(p, n - back.lag)
            assert law_then @ back.on[:, 0] == pytest.approx(on, rel=1e-13)
        if 1 <= n <= back.lag:
            assert back.early_rise[n - 1] == pytest.approx(rise, rel=1e-13)
        elif n:
            assert law @ back.rise == pytest.approx(rise, rel=1e-13)
            law = law @ p
        paths = {(*q, j): w * p[q[-1], j] for q, w in paths.items() for j in range(3)}
