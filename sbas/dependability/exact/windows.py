"""Gates of bounded memory without carrying it: from the law of the chain some epochs back.

A gate whose truth at n is decided by the epochs n - L..n is true with probability y(n - L) . h,
where y is the law of the chain that the gate reads and h the chance to be true L epochs on from
each of its states. h is the same for all n. For a single run of d epochs in a set B, L = d - 1
and h = P_BB^(d-1) 1; for several runs at once (`last_runs`) the window of each has a flag "true
ever since it began" in place of a counter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.dependability.exact.product_chain import ProductChain
from sbas.dependability.exact.transient import matrix_of
from sbas.dependability.exact.transitions import Chain, Floats

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class LookBack:
    """What a gate is expected to be, as functions of the state some epochs before.

    Parameters
    ----------
    lag : L, epochs back.
    on : (S, K) expectation of each column at n from the state at n - L.
    rise : (S, F) probabilities of F pairs (n - 1, n), from the state at n - 1 - L: of false and
        true; or, where the columns begin with C classes, of each pair of classes (F = C * C).
    early_on : (L, K) expectations at n = 0..L-1.
    early_rise : (L, F) probabilities of the pairs at n = 1..L.
    """

    lag: int
    on: Floats
    rise: Floats
    early_on: Floats
    early_rise: Floats


@dataclass(frozen=True)
class Run:
    """A gate that is true once the states `inside` (S,) have lasted `length` epochs."""

    inside: Bools
    length: int


Read = Callable[[Sequence[Bools]], Floats]
"""Truth (S,) of each run gate -> (S, K) what is expected."""


def last_runs(chain: Chain, runs: Sequence[Run], read: Read, classes: int = 1) -> LookBack:
    """Any boolean function of the state and of runs (CON, DUR, causal AND) of it.

    Parameters
    ----------
    chain : with one stage.
    runs : whose truth the function reads.
    read : first column: truth of the gate; or the first `classes` columns: truth of classes.
    classes : 1, or the number of classes, one of which holds.

    Returns
    -------
    LookBack; L is the longest run less 1, at most N + 1.

    References
    ----------
    Sericola 1990, distribution of the total time spent in a subset of states: sojourns by powers
    of P_BB.

    Notes
    -----
    Seen from epoch n a run of d is true iff its states held at n - d + 1..n: two values of
    memory, and none before that window begins. A rise at n needs three: the window of n - 1
    holds, only that of n does, neither.
    """
    runs = sorted(runs, key=lambda run: -run.length)  # stable: `read` is told the order it gave
    matrix = matrix_of(chain)
    on = _at_last(runs, [read([np.full(chain.size, v == 1) for v in values])
                         for values in product(range(2), repeat=len(runs))], 2)  # fmt: skip
    then = {
        values: matrix
        @ read([run.inside & v for run, v in zip(runs, values, strict=True)])[:, :classes]
        for values in product((False, True), repeat=len(runs))
    }
    rises = []
    for values in product(range(3), repeat=len(runs)):
        before = read([np.full(chain.size, v == 2) for v in values])[:, :classes]
        rises.append(pairs_of(before, then[tuple(v >= 1 for v in values)]))
    lag = min(runs[0].length - 1, chain.ends[-1] + 1)
    late_on, early_on = _backwards(chain, matrix, runs, on, lag)
    late_rise, early_rise = _backwards(chain, matrix, runs, _at_last(runs, rises, 3), lag)
    return LookBack(lag, late_on, late_rise, early_on, early_rise)


def pairs_of(now: Floats, ahead: Floats) -> Floats:
    """Pairs (an epoch, the next): of false and true, or of each two classes.

    Parameters
    ----------
    now : (S, C) truth, 1 or 0.
    ahead : (S, C) probability of truth at the next epoch.

    Returns
    -------
    (S, 1) for C = 1, else (S, C * C), the class before first.
    """
    if now.shape[1] == 1:
        return np.where(now > 0.0, 0.0, ahead)
    return np.asarray((now[:, :, None] * ahead[:, None, :]).reshape(len(now), -1))


def _at_last(runs: Sequence[Run], columns: list[Floats], values: int) -> Floats:
    """(S, values, ..., values, K): an axis for each run."""
    size, width = columns[0].shape
    table = np.stack(columns, axis=1)
    return table.reshape(size, *([values] * len(runs)), width)


def _backwards(
    chain: Chain, matrix: Any, runs: Sequence[Run], table: Floats, lag: int
) -> tuple[Floats, Floats]:
    """From the last epoch back: (S, K) at the lag, (lag, K) from epoch 0."""
    early = np.empty((lag, table.shape[-1]))
    active = list(runs)  # the longest first: windows that have not begun drop off at the end
    for back in range(lag):
        early[back] = chain.start @ _entered(active, table, back, cut=True)
        for axis, run in reversed(list(enumerate(active, start=1))):
            if run.length - 1 > back:
                table = _where_inside(run, table, np.asarray(table.take([0], axis=axis)))
            else:
                table = _begun(run, table, axis)
                active.pop()
        shape = table.shape
        table = (matrix @ table.reshape(len(table), -1)).reshape(shape)
    return _entered(active, table, lag, cut=False), early


def _begun(run: Run, table: Floats, axis: int) -> Floats:
    """At the first epoch of the window: unbroken where inside; else broken, or (of three
    values) only the window of the epoch before is."""
    last = table.shape[axis] - 1
    return _where_inside(run, _at(table, axis, last), _at(table, axis, last - 1))


def _entered(active: Sequence[Run], table: Floats, back: int, *, cut: bool) -> Floats:
    """(S, K) where the state so many epochs back is the first one that is seen.

    `cut`: it is epoch 0, and windows that began before are broken. One of three values whose
    later window begins right there still holds that.
    """
    for axis, run in reversed(list(enumerate(active, start=1))):
        missing = run.length - 1 - back if cut else 0
        if missing == 0:
            table = _begun(run, table, axis)
        elif missing == 1 and table.shape[axis] == 3:
            table = _where_inside(run, _at(table, axis, 1), _at(table, axis, 0))
        else:
            table = _at(table, axis, 0)
    return table


def _at(table: Floats, axis: int, value: int) -> Floats:
    return np.asarray(table.take(value, axis=axis))


def _where_inside(run: Run, held: Floats, broken: Floats) -> Floats:
    return np.where(run.inside.reshape(-1, *([1] * (held.ndim - 1))), held, broken)


def look_back(
    product_: ProductChain, start: Floats, columns: Floats, lag: int, classes: int = 1
) -> LookBack:
    """Any gate of bounded memory, by its product with the chain.

    Parameters
    ----------
    product_ : entered from every state of the smaller chain, memory empty before; one stage.
    start : (S,) law of the smaller chain at epoch 0.
    columns : over product states, (states, K) what is expected at n; first the truth of the
        gate, or of the classes.
    lag : L, epochs that decide the gate.
    classes : as for `last_runs`.
    """
    matrix = matrix_of(product_.chain)
    true = columns[:, :classes]
    width = columns.shape[1]
    ahead = np.hstack([columns, pairs_of(true, matrix @ true)])
    early = np.empty((lag, ahead.shape[1]))
    for n in range(lag):
        early[n] = start @ ahead[product_.entries]
        ahead = matrix @ ahead
    at = ahead[product_.entries]
    return LookBack(lag, at[:, :width], at[:, width:], early[:, :width], early[:, width:])
