"""How exceedances of a recording cluster: extremal index and clusters from their positions.

A high level is exceeded in clusters; their number, not the number of samples, is what a rate
counts. The extremal index is one over the mean number of exceedances in a cluster, and carries
the risk of a sample over to an exposure without a process model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import require

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Clusters:
    """Clusters of exceedances: the first and last sample of each.

    Parameters
    ----------
    first, last : (n,) positions of the first and last exceedance of each cluster.
    theta : extremal index that separated them, or None for clusters merged by a time.
    """

    first: Indices
    last: Indices
    theta: float | None = None

    @property
    def count(self) -> int:
        return int(self.first.size)


def exceedance_positions(scaled_error: ArrayLike, *, level: float) -> Indices:
    """Positions of the samples at or above a level; a missing value is none.

    Parameters
    ----------
    scaled_error : (n,) error over its sigma [1] (or error and level both in m), on a regular
        grid of time with NaN where missing.
    level : level, in the same unit; a tie counts, the unsafe side.

    Returns
    -------
    (m,) int64, increasing.

    Raises
    ------
    InputError : a level that is not finite, or an error that is not one-dimensional.
    """
    require("level", level)
    error = np.asarray(scaled_error, dtype=np.float64)
    if error.ndim != 1:
        raise InputError(
            "the error is not a series", where="scaled_error", evidence=f"shape {error.shape}"
        )
    return np.flatnonzero(error >= level).astype(np.int64)


def ferro_segers_index(positions: ArrayLike) -> float:
    """Extremal index from the gaps between exceedances, by the intervals estimator.

    Parameters
    ----------
    positions : (m,) strictly increasing sample numbers of the exceedances, m >= 2, on the grid of
        the samples (missing samples take their places in it).

    Returns
    -------
    float in (0, 1]. It is too high by 15 to 30 % at three or four clusters, and by less the more
    there are. Gaps of 1 and 2 samples only say nothing of clusters: the sample form is then
    used, and it can come out near 1.

    Raises
    ------
    InputError : fewer than two exceedances, or positions that do not increase.

    Notes
    -----
    With the gaps T, n of them: max T <= 2: min(1, 2 (sum T)^2/(n sum T^2)); else
    min(1, 2 (sum(T-1))^2/(n sum (T-1)(T-2))).

    References
    ----------
    Ferro and Segers 2003, J. R. Stat. Soc. B 65, 545, eqs. 3 to 5.

    Examples
    --------
    >>> round(ferro_segers_index([10, 11, 13, 50, 52, 200]), 5)
    0.6025
    """
    at = _positions(positions)
    if at.size < 2:
        raise InputError(
            "an extremal index needs two exceedances or more",
            where="positions",
            evidence=f"{at.size} exceedances",
            cure="take a lower level, or a longer record",
        )
    gaps = np.diff(at).astype(np.float64)
    n = gaps.size
    if gaps.max() <= 2:
        return min(1.0, 2 * float(gaps.sum()) ** 2 / (n * float((gaps**2).sum())))
    excess = gaps - 1
    return min(1.0, 2 * float(excess.sum()) ** 2 / (n * float((excess * (gaps - 2)).sum())))


def ferro_segers_clusters(positions: ArrayLike) -> Clusters:
    """Clusters of exceedances, separated by the largest gaps, as many as the extremal index says.

    Parameters
    ----------
    positions : (m,) strictly increasing sample numbers of the exceedances; m may be 0 or 1.

    Returns
    -------
    Clusters. None without exceedance; one where all gaps are 1 or 2 samples.

    Raises
    ------
    InputError : positions that do not increase.

    Notes
    -----
    C = ceil(theta m) clusters, separated by the C - 1 largest gaps. Gaps as large as the largest
    one that does not separate do not separate either: C is lowered until the cut is strict.

    References
    ----------
    Ferro and Segers 2003, J. R. Stat. Soc. B 65, 545, section 4.
    """
    at = _positions(positions)
    if at.size < 2:
        return Clusters(at, at.copy())
    theta = ferro_segers_index(at)
    gaps = np.diff(at)
    if gaps.max() <= 2:
        return Clusters(at[:1], at[-1:], theta)
    # Products such as 0.5 * 6 must not be rounded up to one cluster more.
    separating = min(math.ceil(theta * at.size * (1 - 1e-12)) - 1, gaps.size)
    ordered = np.sort(gaps)[::-1]
    floor = int(ordered[separating]) if separating < gaps.size else 0
    return _split(at, gaps > floor, theta)


def run_clusters(positions: ArrayLike, *, merge_samples: float) -> Clusters:
    """Clusters of exceedances, merged where no more than a given number of samples lie between.

    Parameters
    ----------
    positions : (m,) strictly increasing sample numbers of the exceedances; m may be 0.
    merge_samples : merge time over the interval [1], not negative: the end of one run (its last
        sample + 1) and the start of the next are merged if no further apart.

    Returns
    -------
    Clusters.

    Raises
    ------
    InputError : positions that do not increase, or a negative merge time.

    References
    ----------
    Leadbetter, Weissman, de Haan, Rootzen 1989, Univ. of North Carolina report 260 (runs
    method); default merge time max(tau/2, 60 s): choice of this package.
    """
    require("merge_samples", merge_samples, least=0)
    at = _positions(positions)
    return _split(at, np.diff(at) - 1 > merge_samples, None)


def clustered_risk(per_sample_risk: float, *, theta: float, samples: int) -> float:
    """Risk of an exposure from the risk of one sample and an extremal index.

    Parameters
    ----------
    per_sample_risk : probability of exceedance at one sample [1], in (0, 1).
    theta : extremal index at that level, in (0, 1]. One from a lower level is smaller or larger
        than at this level according to the process: for a Gauss-Markov error it grows with the
        level, so that one from a lower level gives too low a risk.
    samples : number of samples in the exposure, at least 1.

    Returns
    -------
    float [1]: 1 - (1 - p)^(1 + theta (N - 1)); n_es is about 1 + theta (N - 1).

    Raises
    ------
    InputError : an argument out of range.

    References
    ----------
    Leadbetter 1983, Z. Wahrscheinlichkeitstheorie verw. Gebiete 65, 291.
    """
    require("per_sample_risk", per_sample_risk, above=0, below=1)
    require("theta", theta, above=0, most=1)
    require("samples", samples, least=1)
    return -math.expm1((1 + theta * (samples - 1)) * math.log1p(-per_sample_risk))


def _split(at: Indices, cut: NDArray[np.bool_], theta: float | None) -> Clusters:
    if at.size == 0:
        return Clusters(at, at.copy(), theta)
    starts = np.concatenate(([0], np.flatnonzero(cut) + 1))
    ends = np.concatenate((starts[1:] - 1, [at.size - 1]))
    return Clusters(at[starts], at[ends], theta)


def _positions(positions: Any) -> Indices:
    at = np.asarray(positions)
    if at.size == 0:
        return np.zeros(0, dtype=np.int64)
    if at.ndim != 1 or at.dtype.kind not in "iu" or np.any(np.diff(at.astype(np.int64)) <= 0):
        raise InputError(
            "positions are not strictly increasing sample numbers",
            where="positions",
            evidence=f"{at.dtype} of shape {at.shape}",
        )
    return at.astype(np.int64)
