"""Normal equations of weighted fixes with four unknowns, solved for all epochs at once.

Ranges are rows (k,) in the order of their epochs, so that nothing is computed for satellites that
were not there. The inverse is formed by Cholesky's decomposition written out: a few dozen
operations on arrays over the epochs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

UNKNOWNS = 4
LEAST_SATELLITES = 4
WORST_CONDITION = 1e10
"""Of normal equations; beyond it a fix is none."""
PAIRS = tuple((i, j) for i in range(UNKNOWNS) for j in range(i + 1))
"""Lower triangle of a symmetric matrix, in the order in which it is kept."""
_AT = {pair: number for number, pair in enumerate(PAIRS)}


def design(enu: Floats) -> Floats:
    """(4, k) derivatives of ranges by east, north, up and clock of (3, k) lines of sight, the
    first three with the opposite sign, as RTCA DO-229D, J.1 has them."""
    return np.concatenate([enu, np.ones((1, enu.shape[1]))])


def enu_of(elevation_deg: Floats, azimuth_deg: Floats) -> Floats:
    """(3, k) unit vectors [cos e sin a, cos e cos a, sin e] of (k,) directions [deg]."""
    e, a = np.deg2rad(elevation_deg), np.deg2rad(azimuth_deg)
    return np.stack([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def sums_by_epoch(values: Floats, epoch: Ints, n: int) -> Floats:
    """(..., n) sums of (..., k) values by epoch; (k,) epochs never fall."""
    sums = np.zeros((*values.shape[:-1], n))
    if epoch.size:
        starts = np.flatnonzero(np.diff(epoch, prepend=-1))
        sums[..., epoch[starts]] = np.add.reduceat(values, starts, axis=-1)
    return sums


def normal_sums(g: Floats, weight: Floats, epoch: Ints, n: int) -> Floats:
    """(10, n) lower triangles of G'WG of (4, k) designs and (k,) weights by epoch."""
    weighted = g * weight
    return sums_by_epoch(np.stack([weighted[i] * g[j] for i, j in PAIRS]), epoch, n)


class Inverse(NamedTuple):
    """(10, n) lower triangles of covariances, NaN where `solved` (n,) is False."""

    covariance: Floats
    solved: Bools


def inverse(normal: Floats, possible: Bools) -> Inverse:
    """Inverses of (10, n) symmetric positive matrices.

    Parameters
    ----------
    possible : (n,) False where no inverse is wanted, such as with fewer than four satellites.

    Notes
    -----
    A matrix is refused where a pivot is not above 0 or where its condition in the 1-norm, which
    is never below that in the 2-norm, reaches `WORST_CONDITION`.
    """
    identity = np.array([1.0 if i == j else 0.0 for i, j in PAIRS])
    a = np.where(possible, normal, identity[:, None])
    solved = possible.copy()
    low: dict[tuple[int, int], Floats] = {}
    for i, j in PAIRS:
        rest = a[_AT[i, j]] - sum(low[i, k] * low[j, k] for k in range(j))
        if i != j:
            low[i, j] = rest / low[j, j]
            continue
        # What is left of a diagonal by rounding alone is no pivot.
        positive = rest > a[_AT[i, i]] * np.finfo(float).eps
        solved &= positive
        low[i, i] = np.sqrt(np.where(positive, rest, 1.0))
    lower_inverse: dict[tuple[int, int], Floats] = {}
    for i in range(UNKNOWNS):
        lower_inverse[i, i] = 1 / low[i, i]
        for j in range(i):
            part = sum(low[i, k] * lower_inverse[k, j] for k in range(j, i))
            lower_inverse[i, j] = -part * lower_inverse[i, i]
    covariance = np.stack(
        [sum(lower_inverse[k, i] * lower_inverse[k, j] for k in range(i, UNKNOWNS))
         for i, j in PAIRS]
    )  # fmt: skip
    solved &= _norm(a) * _norm(covariance) < WORST_CONDITION
    covariance[:, ~solved] = np.nan
    return Inverse(covariance, solved)


def _norm(triangle: Floats) -> Floats:
    """(n,) 1-norm of symmetric matrices."""
    size = np.abs(triangle)
    columns = [
        sum(size[_AT[max(i, j), min(i, j)]] for i in range(UNKNOWNS)) for j in range(UNKNOWNS)
    ]
    norm: Floats = np.maximum.reduce(columns)
    return norm


def times(triangle: Floats, vector: Floats) -> Floats:
    """(4, n) products of (10, n) symmetric matrices and (4, n) vectors."""
    return np.stack(
        [sum(triangle[_AT[max(i, j), min(i, j)]] * vector[j] for j in range(UNKNOWNS))
         for i in range(UNKNOWNS)]
    )  # fmt: skip


def full_matrices(triangle: Floats) -> Floats:
    """(n, 4, 4) symmetric matrices of (10, n) lower triangles."""
    whole = np.empty((triangle.shape[1], UNKNOWNS, UNKNOWNS))
    for number, (i, j) in enumerate(PAIRS):
        whole[:, i, j] = whole[:, j, i] = triangle[number]
    return whole


class Geometry(NamedTuple):
    """Covariances of (n,) fixes.

    `covariance_m2` (10, n) lower triangles of east, north, up and clock with the weights; `weight`
    (k,) of every range, 0 where it does not serve.
    """

    covariance_m2: Floats
    weight: Floats
    solved: Bools


def fix_geometry(g: Floats, sigma_m: Floats, epoch: Ints, n: int) -> Geometry:
    """Geometry of fixes of (4, k) designs and (k,) sigmas by epoch.

    Ranges whose sigma is not a number above 0 do not serve; a fix needs four. Source: RTCA
    DO-229D, J.1.
    """
    serves = (sigma_m > 0) & np.isfinite(sigma_m) & np.isfinite(g).all(axis=0)
    safe = np.where(serves, sigma_m, 1.0)
    with np.errstate(over="ignore", divide="ignore"):
        weight = np.where(serves, 1.0 / (safe * safe), 0.0)
    serves &= np.isfinite(weight) & (weight > 0)
    weight[~serves] = 0.0
    enough = np.bincount(epoch[serves], minlength=n) >= LEAST_SATELLITES
    covariance, solved = inverse(normal_sums(np.where(serves, g, 0.0), weight, epoch, n), enough)
    return Geometry(covariance, weight, solved)
