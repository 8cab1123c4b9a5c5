"""Intervals of figures that are sums over runs: whole runs are drawn again, not episodes.

Episodes of one run share its sensors' errors, so they are no independent sample; runs are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.sparse import csr_array

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Counts = NDArray[np.uint16]

FEW_RUNS = 5
"""What fewer runs show has no interval by drawing runs again: it would be far too narrow."""
ENOUGH_RUNS = 20
"""For shares of epochs, of which one run has many, and for mean times, 5 runs are still too few."""
TAIL = 0.025
"""Of each side of the intervals, which are at 95 %."""
_STREAM = 8_127_051
"""Keeps the draws apart from those of a simulation with the same seed."""
_BLOCK_CELLS = 4_000_000


def drawn_runs(runs: int, *, replicates: int, seed: int) -> Counts:
    """How often each run is in each sample; the first sample is the one that was seen.

    Parameters
    ----------
    runs : number of runs.
    replicates : number of samples drawn.
    seed : of the draws.

    Returns
    -------
    (runs, replicates + 1) counts: ones, then multinomial draws of `runs` runs each.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM,)))
    seen = np.ones((1, runs), np.uint16)
    return np.ascontiguousarray(np.concatenate([seen, resampled(runs, replicates, rng)]).T)


def resampled(runs: int, replicates: int, rng: np.random.Generator) -> Counts:
    """(replicates, runs) how often each run is drawn, in as many draws as there are runs."""
    drawn = np.empty((replicates, runs), np.uint16)
    for row in drawn:
        row[:] = np.bincount(rng.integers(runs, size=runs), minlength=runs)
    return drawn


@dataclass(frozen=True, eq=False)
class RunSums:
    """Sums over runs of several quantities, as seen and in each sample drawn.

    Parameters
    ----------
    of_run : (quantities, runs concerned) values.
    drawn : (quantities, 1 + replicates) sums.
    """

    of_run: csr_array
    drawn: Floats

    def part_and_whole(self, part: list[int], whole: list[int]) -> tuple[Ints, Ints]:
        """(runs concerned) sums over two sets of quantities, of each run."""
        sums = (self.of_run[quantities].sum(axis=0) for quantities in (part, whole))
        first, second = (np.asarray(s).astype(np.int64) for s in sums)
        return first, second


def sums_over_runs(
    quantity: Ints, run: Ints, value: Ints, *, quantities: int, weights: Counts
) -> RunSums:
    """Add values by quantity and run, and over the runs of each sample.

    Parameters
    ----------
    quantity, run, value : (k,) what is added up, where, and how much.
    quantities : number of quantities.
    weights : (runs, 1 + replicates) result of `drawn_runs`.
    """
    concerned, column = np.unique(run, return_inverse=True)
    table = csr_array(
        (value.astype(np.float64), (quantity, column)), shape=(quantities, concerned.size)
    )
    columns = weights.shape[1]
    drawn = np.empty((quantities, columns))
    # In blocks: the weights of all runs as floats would be the largest array of all.
    block = max(1, _BLOCK_CELLS // max(concerned.size, 1))
    for first in range(0, columns, block):
        part = slice(first, first + block)
        drawn[:, part] = table @ weights[concerned, part].astype(np.float64)
    return RunSums(of_run=table, drawn=drawn)


def percentile_bounds(replicates: Floats) -> tuple[Floats, Floats]:
    """Bounds at 95 % along the last axis, undefined replicates left out.

    They are values that occur, not means of two: times stay whole steps, and may be infinite.
    """
    ordered = np.sort(replicates, axis=-1)  # NaN comes last
    known = np.count_nonzero(~np.isnan(ordered), axis=-1)
    low = np.maximum(np.floor(TAIL * known).astype(int) - 1, 0)
    high = np.maximum(known - 1 - low, 0)
    lower, upper = (
        np.take_along_axis(ordered, np.expand_dims(i, -1), -1)[..., 0] for i in (low, high)
    )
    return lower, upper


def share_bounds(
    part: Ints, whole: Ints, replicates: Floats, *, few: int = FEW_RUNS
) -> tuple[float, float]:
    """Interval at 95 % of a share, by drawing runs again where enough runs show it.

    Parameters
    ----------
    part, whole : (runs concerned) count of each run, and out of how many.
    replicates : (replicates,) the share in each sample drawn.
    few : runs with the part, and with the rest, that a bound by drawing needs.

    Returns
    -------
    Lower and upper bound. Percentiles of the replicates; where fewer than `few` runs have any of
    the part, or fewer any of the rest, exact binomial bounds on the wide side: runs, each
    counted once, are the trials of the bound away from 0 (from 1), all cases those of the other.

    References
    ----------
    B. Efron, R. Tibshirani, An Introduction to the Bootstrap, 1993, chapter 13 (percentiles);
    C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404.
    """
    cases, runs = int(whole.sum()), int(np.count_nonzero(whole))
    if not cases:
        return np.nan, np.nan
    with_part, with_rest = int(np.count_nonzero(part)), int(np.count_nonzero(whole - part))
    bounds = []
    if with_part < few:
        bounds.append((_exact_lower(with_part, cases), _exact_upper(with_part, runs)))
    if with_rest < few:
        bounds.append((1 - _exact_upper(with_rest, runs), 1 - _exact_lower(with_rest, cases)))
    if not bounds:
        lower, upper = percentile_bounds(replicates)
        return float(lower), float(upper)
    value = int(part.sum()) / cases
    return min(value, *(b[0] for b in bounds)), max(value, *(b[1] for b in bounds))


def _exact_lower(hits: int, trials: int) -> float:
    return float(special.betaincinv(hits, trials - hits + 1, TAIL)) if hits else 0.0


def _exact_upper(hits: int, trials: int) -> float:
    return float(special.betainccinv(hits + 1, trials - hits, TAIL)) if hits < trials else 1.0
