"""Weighted least squares of ranges, epochs x satellites at once, one clock per constellation.

The clocks are eliminated: rows and ranges less their weighted means over a constellation leave
three unknowns whatever the number of clocks, and a constellation without satellites vanishes by
itself. Arrays lie satellites first, (s, n), so that sums over satellites run along whole rows of
epochs; anything may stand between, such as (s, k, n) for k fault modes. Source: the partitioned
normal equations of the textbook; G. Strang and K. Borre, "Linear Algebra, Geodesy, and GPS",
1997, chapter 11.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.integer[Any]]
Bools = NDArray[np.bool_]

AXES = 3
PAIRS = ((0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2))
"""Lower triangle of a symmetric matrix over east, north and up, in the order it is kept."""
_AT = {pair: number for number, pair in enumerate(PAIRS)} | {
    (j, i): number for number, (i, j) in enumerate(PAIRS)
}
SMALLEST_EIGENVALUE = 1e-10
"""Of the normal matrix over the sum of weights: a geometry below it (dilutions above some 1e4) is
degenerate."""
SMALLEST_REDUNDANCY = 1e-8
SMALL_REDUNDANCY = 3e-2
"""Below it 1 - leverage loses digits that a sum of squares in its place keeps."""
NEGLIGIBLE_INFLUENCE = 1e-6
"""Share of an axis's sigma that a satellite without redundancy may move and still not matter."""
_ROUNDING = 64 * np.finfo(float).eps


class RangeReason(IntEnum):
    """Why a range takes no part."""

    USED = 0
    NOT_GIVEN = 1
    NO_DIRECTION = 2
    NO_SIGMA = 3
    NO_RESIDUAL = 4
    ALONE = 5
    NO_BIAS = 6

    @property
    def words(self) -> str:
        return _RANGE_WORDS[self]


_RANGE_WORDS = {
    RangeReason.USED: "",
    RangeReason.NOT_GIVEN: "not in the fix",
    RangeReason.NO_DIRECTION: "no direction, or one that is none",
    RangeReason.NO_SIGMA: "no sigma above 0",
    RangeReason.NO_RESIDUAL: "no residual",
    RangeReason.ALONE: "alone in its constellation: it fixes its own clock only",
    RangeReason.NO_BIAS: "no finite bound of its nominal bias",
}


class GeometryReason(IntEnum):
    """Why an epoch has no fix, or none that can be tested."""

    SOUND = 0
    TOO_FEW = 1
    NO_REDUNDANCY = 2
    DEGENERATE = 3
    TWICE = 4

    @property
    def words(self) -> str:
        return _GEOMETRY_WORDS[self]


_GEOMETRY_WORDS = {
    GeometryReason.SOUND: "",
    GeometryReason.TOO_FEW: "fewer satellites than unknowns: no fix",
    GeometryReason.NO_REDUNDANCY: "as many satellites as unknowns: nothing to test",
    GeometryReason.DEGENERATE: "satellites in a degenerate geometry",
    GeometryReason.TWICE: "two satellites of one constellation in the same direction",
}


@dataclass(frozen=True, eq=False)
class Ranges:
    """(s, n) ranges, ready for sums: zero rows and weights where one takes no part.

    `rows` (3, s, n) derivatives by a step east, north, up; `weight` (s, n) [1/m2]; `clock` (s, n)
    constellation of each, 0..`clocks` - 1; `reason` (s, n) of RangeReason; `twice` (n,).
    """

    rows: Floats
    weight: Floats
    clock: Ints
    clocks: int
    reason: Ints
    twice: Bools


def ranges(
    elevation_deg: Floats,
    azimuth_deg: Floats,
    sigma_m: Floats,
    *,
    clock: Ints | int = 0,
    used: Bools | bool = True,
    residual_m: Floats | None = None,
) -> Ranges:
    """Ranges of epochs x satellites.

    Parameters
    ----------
    elevation_deg, azimuth_deg, sigma_m : (s, n) directions [deg] and 1-sigma [m].
    clock : (s, n) or (s, 1) constellation index of each range, or one for all.
    used : (s, n) False where a slot is empty or its range is not in the fix.
    residual_m : (s, n) observed less computed; a range without takes no part. None where only
        the geometry is wanted.
    """
    shape = elevation_deg.shape
    clock = np.broadcast_to(np.asarray(clock), shape)
    reason = np.where(used, RangeReason.USED, RangeReason.NOT_GIVEN).astype(np.int8)
    reason = np.broadcast_to(reason, shape).copy()
    known = np.isfinite(azimuth_deg) & (np.abs(elevation_deg) <= 90)
    _mark(reason, RangeReason.NO_DIRECTION, ~known)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        weight = 1 / (sigma_m * sigma_m)
    heavy = (sigma_m > 0) & (weight > 0) & (weight < np.inf)
    _mark(reason, RangeReason.NO_SIGMA, ~heavy)
    if residual_m is not None:
        _mark(reason, RangeReason.NO_RESIDUAL, ~np.isfinite(residual_m))
    clocks = int(clock.max(initial=0)) + 1
    if clocks > 1:
        serves = reason == 0
        for number in range(clocks):
            own = serves & (clock == number)
            _mark(reason, RangeReason.ALONE, own & (own.sum(axis=0) == 1))
    serves = reason == 0
    elevation = np.deg2rad(np.where(serves, elevation_deg, 0.0))
    azimuth = np.deg2rad(np.where(serves, azimuth_deg, 0.0))
    level = np.where(serves, -np.cos(elevation), 0.0)
    rows = np.stack([level * np.sin(azimuth), level * np.cos(azimuth), -np.sin(elevation)])
    return Ranges(
        rows, np.where(serves, weight, 0.0), clock, clocks, reason, _twice(rows, clock, serves)
    )


def _mark(reason: Ints, code: RangeReason, where: Bools) -> None:
    reason[(reason == 0) & where] = code


def _twice(rows: Floats, clock: Ints, serves: Bools) -> Bools:
    """(n,) True where two ranges of one constellation have the same direction."""
    # Any two different directions differ in this sum but by chance; chance is then looked at.
    key = rows[0] + np.pi * rows[1] + np.e * rows[2] + 10.0 * clock
    key = np.where(serves, key, np.nan)
    ordered = np.sort(key, axis=0)
    suspect = np.flatnonzero((ordered[1:] == ordered[:-1]).any(axis=0))
    twice = np.zeros(rows.shape[-1], bool)
    near, own, here = rows[:, :, suspect], clock[:, suspect], serves[:, suspect]
    for one in range(rows.shape[1]):
        same = (near[:, one, None] == near[:, one + 1 :]).all(axis=0)
        same &= (own[one] == own[one + 1 :]) & here[one + 1 :] & here[one]
        twice[suspect] |= same.any(axis=0)
    return twice


@dataclass(frozen=True, eq=False)
class Geometry:
    """What the weights and directions alone say of (n,) fixes.

    Parameters
    ----------
    rows : (3, s, n) rows less their weighted mean over the constellation.
    weight : (s, n) [1/m2]; 0 where a range takes no part.
    member : (c, s, n) True where a range takes part and is of a constellation.
    clock_weight : (c, n) sums of weights; 1 where a constellation has no range.
    covariance : (6, n) lower triangle of P over east, north, up [m2]; NaN where not `solved`.
    gain : (3, s, n) S, position error [m] by range error [m]; NaN where not `solved`.
    redundancy : (s, n) r, 0..1; NaN where a range takes no part or its epoch is not solved.
    least_redundancy : (n,) below which r is nothing but rounding.
    satellites, clocks, dof : (n,) ranges that take part, constellations among them, and
        satellites - 3 - clocks.
    reason : (n,) of GeometryReason.
    solved : (n,) there is a fix: dof >= 0 and no degenerate geometry.
    """

    rows: Floats
    weight: Floats
    member: Bools
    clock_weight: Floats
    covariance: Floats
    gain: Floats
    redundancy: Floats
    least_redundancy: Floats
    satellites: Ints
    clocks: Ints
    dof: Ints
    reason: Ints
    solved: Bools

    @property
    def takes_part(self) -> Bools:
        """(s, n) ranges of solved epochs that take part."""
        return (self.weight > 0) & self.solved

    @property
    def sigma(self) -> Floats:
        """(s, n) 1-sigma of the ranges [m]; infinite where one takes no part."""
        with np.errstate(divide="ignore"):
            sigma: Floats = 1 / np.sqrt(self.weight)
        return sigma


def geometry(given: Ranges, weight: Floats | None = None) -> Geometry:
    """Covariance, gain and redundancy of all epochs.

    Parameters
    ----------
    weight : (s, n), or (s, k, n) for k variants of every epoch, instead of the ranges' own
        [1/m2]: 0 leaves a range out. A constellation that this empties loses its clock; one that
        is left with a single range keeps it, which changes no position and no redundancy.

    Notes
    -----
    With clocks eliminated P = (sum w d d')^-1 over rows d less the weighted mean of their
    constellation, S_i = P d_i w_i and 1 - r_i = w_i / W_c + w_i d_i' P d_i, where W_c sums the
    weights of the constellation.
    """
    s, n = given.weight.shape
    between = (1,) * (0 if weight is None else weight.ndim - 2)
    own = given.weight.reshape(s, *between, n)
    w = own if weight is None else np.where(own > 0, weight, 0.0)
    rows = given.rows.reshape(AXES, s, *between, n)
    clock = given.clock.reshape(s, *between, n)
    serves = w > 0
    member = np.stack([serves & (clock == number) for number in range(given.clocks)])
    clock_sum = np.stack([np.where(part, w, 0.0).sum(axis=0) for part in member])
    filled = clock_sum > 0
    clock_weight = np.where(filled, clock_sum, 1.0)
    centred = _less_means(np.broadcast_to(rows, (AXES, *w.shape)), w, member, clock_weight)
    weighted = w * centred
    normal = np.stack([(weighted[i] * centred[j]).sum(axis=0) for i, j in PAIRS])
    satellites, clocks = serves.sum(axis=0), filled.sum(axis=0)
    dof = satellites - AXES - clocks
    possible = dof >= 0
    covariance, norm = _scaled_inverse(normal, clock_sum.sum(axis=0), possible)
    degenerate = possible & ~(norm * SMALLEST_EIGENVALUE < 1)
    solved = possible & ~degenerate & ~given.twice
    covariance[:, ~solved] = np.nan
    gain = times(covariance, weighted)
    own_weight = sum(member[c] * clock_weight[c] for c in range(given.clocks)) + ~serves
    leverage = w / own_weight + (gain * centred).sum(axis=0)
    redundancy = np.where(serves, np.clip(1.0 - leverage, 0.0, 1.0), np.nan)
    small = serves & (redundancy < SMALL_REDUNDANCY) & (solved & (dof >= 1))
    if small.any():
        at = np.nonzero(small)
        epochs: Any = (..., *at[1:])
        redundancy[at] = _small_redundancy(
            at[0], redundancy[at], centred[epochs], w[epochs], member[epochs],
            clock_weight[epochs], covariance[epochs],
        )  # fmt: skip
    reason = np.where(dof == 0, GeometryReason.NO_REDUNDANCY, GeometryReason.SOUND)
    reason = np.where(degenerate, GeometryReason.DEGENERATE, reason)
    reason = np.where(~possible, GeometryReason.TOO_FEW, reason)
    reason = np.where(given.twice, GeometryReason.TWICE, reason).astype(np.int8)
    least = np.maximum(SMALLEST_REDUNDANCY, _ROUNDING * np.where(solved, norm, 1.0))
    return Geometry(
        centred, w, member, clock_weight, covariance, gain, redundancy, least,
        satellites, clocks, dof, reason, solved,
    )  # fmt: skip


def _small_redundancy(
    own: Ints, first: Floats, rows: Floats, weight: Floats, member: Bools, clock_weight: Floats,
    covariance: Floats,
) -> Floats:  # fmt: skip
    """(p,) redundancies of ranges `own`, each of one of p epochs, where 1 - leverage is rounding.

    R = I - H of weighted ranges is a projector, r_i = sum_j R_ij^2, so that
    r_i (1 - r_i) = sum over j != i of R_ij^2: positive terms, which lose no digit. `first`
    (p,) are the redundancies as a difference, good enough for the factor 1 - r_i.
    """
    here = np.arange(own.size)
    same = sum(
        part * part[own, here] / total for part, total in zip(member, clock_weight, strict=True)
    )
    off = same + (times(covariance, rows[:, own, here])[:, None] * rows).sum(axis=0)
    off[own, here] = 0.0
    squares: Floats = (off * off * weight).sum(axis=0) * weight[own, here]
    return squares / (1.0 - first)


def _less_means(values: Floats, weight: Floats, member: Bools, clock_weight: Floats) -> Floats:
    """(..., s, n) values less the weighted mean of their constellation; 0 where w is 0."""
    axis = values.ndim - weight.ndim
    mean = np.zeros_like(values)
    for own, total in zip(member, clock_weight, strict=True):
        share = np.where(own, weight, 0.0) / total
        mean += own * np.expand_dims((values * share).sum(axis=axis), axis)
    less: Floats = np.where(weight > 0, values - mean, 0.0)
    return less


def _scaled_inverse(normal: Floats, total: Floats, possible: Bools) -> tuple[Floats, Floats]:
    """(6, ...) inverses, and (...) norms of the scaled ones, infinite where there is none.

    Rows are unit vectors, so that the sum of weights is the scale of every axis: one that the
    satellites leave out is then small, and not blown up to look like the others.
    """
    sound = possible & (total > 0)
    scale = 1 / np.where(sound, total, 1.0)
    a = [
        np.where(sound, part * scale, float(i == j))
        for part, (i, j) in zip(normal, PAIRS, strict=True)
    ]
    # Cholesky's decomposition written out, and the inverse of its factor.
    tiny = 4 * np.finfo(float).eps
    sound = sound & (a[0] > tiny)
    l00 = np.sqrt(np.where(sound, a[0], 1.0))
    l10, l20 = a[1] / l00, a[3] / l00
    pivot = a[2] - l10 * l10
    sound = sound & (pivot > tiny)
    l11 = np.sqrt(np.where(sound, pivot, 1.0))
    l21 = (a[4] - l20 * l10) / l11
    pivot = a[5] - l20 * l20 - l21 * l21
    sound = sound & (pivot > tiny)
    l22 = np.sqrt(np.where(sound, pivot, 1.0))
    k00, k11, k22 = 1 / l00, 1 / l11, 1 / l22
    k10 = -l10 * k00 * k11
    k21 = -l21 * k11 * k22
    k20 = -(l20 * k00 + l21 * k10) * k22
    scaled = (
        k00 * k00 + k10 * k10 + k20 * k20,
        k10 * k11 + k20 * k21,
        k11 * k11 + k21 * k21,
        k20 * k22,
        k21 * k22,
        k22 * k22,
    )
    square = sum(
        (1 if i == j else 2) * part * part for part, (i, j) in zip(scaled, PAIRS, strict=True)
    )
    norm = np.where(sound, np.sqrt(square), np.inf)
    covariance = np.stack(scaled) * scale
    return covariance, norm


def times(triangle: Floats, vector: Floats) -> Floats:
    """(3, s, n) or (3, n) products of (6, n) symmetric matrices and vectors."""
    return np.stack(
        [sum(triangle[_AT[i, j]] * vector[j] for j in range(AXES)) for i in range(AXES)]
    )


def variance(triangle: Floats, axis: Floats) -> Floats:
    """(n,) variances [m2] along an axis, (3,) or (3, n) in east, north, up."""
    total: Floats = sum(
        (1 if i == j else 2) * axis[i] * axis[j] * part
        for part, (i, j) in zip(triangle, PAIRS, strict=True)
    )
    return np.maximum(total, 0.0)


@dataclass(frozen=True, eq=False)
class Adjustment:
    """What the ranges say: `step_m` (3, n) position correction x = S y, `residual_m` (s, n) e
    after it, `statistic` (n,) T = e' W e."""

    step_m: Floats
    residual_m: Floats
    statistic: Floats


def adjust(g: Geometry, observed_m: Floats) -> Adjustment:
    """Least-squares step of (s, n) observed less computed ranges [m].

    Residuals of whatever fix serve as well: the step then leads from that fix to this one. Where
    an epoch is not solved everything is NaN.
    """
    y = np.where(g.weight > 0, observed_m, 0.0)
    # Ranges beyond all sense overflow to an infinite statistic, or to NaN: neither passes.
    with np.errstate(over="ignore", invalid="ignore"):
        centred = _less_means(y, g.weight, g.member, g.clock_weight)
        # The gain of centred ranges is that of the ranges: its sum over a constellation is 0.
        x = (g.gain * centred).sum(axis=1)
        e = centred - (g.rows * x[:, None]).sum(axis=0)
        e = np.where(g.takes_part, e, np.nan)
        square = np.where(g.takes_part, e * e, 0.0)
        t = np.where(g.solved, (g.weight * square).sum(axis=0), np.nan)
    return Adjustment(x, e, t)
