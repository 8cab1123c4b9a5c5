"""Fixes without the satellites of each fault mode: sigma, bias and separation on every axis.

One or two satellites are taken out by an update of the complete fix; everything else is solved
anew, since a constellation takes its clock with it. Source: WG-C ARAIM Airborne Algorithm
Description Document 3.0 (2017), solution separation; the updates are those of Sherman, Morrison
and Woodbury (1950).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.monitoring.araim_faults import FaultSets
from sbas.monitoring.normal_equations import Geometry, Ints, Ranges, geometry, variance

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


_LEAST_DETERMINANT = 1e-6
"""Of the redundancy of a pair, below which an update would lose more than six digits."""


@dataclass(frozen=True, eq=False)
class Subsets:
    """Fixes of n epochs without each of k fault sets, on q axes.

    Parameters
    ----------
    full : (k, n) False where what is left gives no fix: such a set cannot be monitored.
    sigma_m : (q, k, n) of the reduced fix, from the integrity variances.
    bias_m : (q, k, n) bound of what the nominal biases do to it.
    sigma_separation_m : (q, k, n) of reduced less complete fix, from the accuracy variances.
    separation_m : (q, k, n) reduced less complete fix, None without residuals.
    """

    full: Bools
    sigma_m: Floats
    bias_m: Floats
    sigma_separation_m: Floats
    separation_m: Floats | None


@dataclass(frozen=True, eq=False)
class Errors:
    """(s, n) errors of the ranges: accuracy variance [m2], bound of the nominal bias [m] and
    residuals [m], 0 where a slot takes no part."""

    accuracy_m2: Floats
    bias_m: Floats
    residual_m: Floats | None


def along_axes(values: Floats, axes: Floats) -> Floats:
    """(q, ..., n) components of (3, ..., n) vectors along (q, 3, n) axes."""
    shape = (len(axes), 3, *(1,) * (values.ndim - 2), axes.shape[2])
    turned = axes.reshape(shape)
    return np.stack([(axis * values).sum(axis=0) for axis in turned])


def complete_fix(fix: Geometry, axes: Floats, errors: Errors) -> tuple[Floats, Floats, Floats]:
    """Sigma, bias bound and accuracy sigma, each (q, n) [m], of the fix with every satellite."""
    gain = along_axes(fix.gain, axes)
    sigma = np.stack([np.sqrt(variance(fix.covariance, axis)) for axis in axes])
    with np.errstate(over="ignore"):
        bias = (np.abs(gain) * errors.bias_m).sum(axis=1)
    accuracy = np.sqrt((gain**2 * errors.accuracy_m2).sum(axis=1))
    return sigma, bias, accuracy


def subsets(
    given: Ranges, fix: Geometry, sets: Sequence[FaultSets], axes: Floats, errors: Errors
) -> Subsets:
    """Reduced fixes of fault sets that follow each other, epochs last.

    Parameters
    ----------
    fix : geometry of the ranges `given`.
    axes : (q, 3, n) unit vectors in east, north, up.
    """
    whole = along_axes(fix.gain, axes)
    parts = [_part(given, fix, one, axes, errors, whole) for one in sets]
    steps = [part.separation_m for part in parts if part.separation_m is not None]
    return Subsets(
        full=np.concatenate([part.full for part in parts]),
        sigma_m=np.concatenate([part.sigma_m for part in parts], axis=1),
        bias_m=np.concatenate([part.bias_m for part in parts], axis=1),
        sigma_separation_m=np.concatenate([part.sigma_separation_m for part in parts], axis=1),
        separation_m=np.concatenate(steps, axis=1) if steps else None,
    )


def _part(
    given: Ranges, fix: Geometry, sets: FaultSets, axes: Floats, errors: Errors, whole: Floats
) -> Subsets:
    weight = given.weight
    for number in sets.clocks:
        weight = np.where(given.clock == number, 0.0, weight)
    size = sets.slots.shape[1]
    if size in (1, 2):
        left = geometry(given, weight) if sets.clocks else fix
        gain, var, full = _less_one(left, axes) if size == 1 else _less_two(left, sets.slots, axes)
        if size == 2:
            weak = np.flatnonzero(~full.all(axis=1) & left.solved.any())
            if weak.size:
                gain[:, :, weak], var[:, weak], full[weak] = _less_several(
                    given, weight, sets.slots[weak], axes
                )
    else:
        gain, var, full = _less_several(given, weight, sets.slots, axes)
    bias = np.einsum("qskn,sn->qkn", np.abs(gain), errors.bias_m)
    gain -= whole[:, :, None]
    separation = None
    if errors.residual_m is not None:
        separation = np.einsum("qskn,sn->qkn", gain, errors.residual_m)
    np.square(gain, out=gain)
    spread = np.sqrt(np.einsum("qskn,sn->qkn", gain, errors.accuracy_m2))
    return Subsets(full, np.sqrt(var), bias, spread, separation)


def _less_several(
    given: Ranges, weight: Floats, slots: Ints, axes: Floats
) -> tuple[Floats, Floats, Bools]:
    """Gains (q, s, k, n), variances (q, k, n) and soundness (k, n) without (k, size) slots."""
    (s, n), k = weight.shape, len(slots)
    kept = np.ones((s, k, 1))
    for column in slots.T:
        kept[column, np.arange(k)] = 0.0
    # Every mode is an epoch of its own to the normal equations.
    rows = np.broadcast_to(given.rows[:, :, None], (3, s, k, n)).reshape(3, s, k * n)
    clock = np.broadcast_to(given.clock[:, None], (s, k, n)).reshape(s, k * n)
    every = (weight[:, None] * kept).reshape(s, k * n)
    reason = np.where(every > 0, 0, 1).astype(np.int8)
    twice = np.broadcast_to(given.twice, (k, n)).reshape(k * n)
    left = geometry(Ranges(rows, every, clock, given.clocks, reason, twice))
    turned = np.tile(axes, (1, 1, k))
    gain = along_axes(left.gain, turned).reshape(len(axes), s, k, n)
    var = np.stack([variance(left.covariance, axis) for axis in turned])
    return gain, var.reshape(len(axes), k, n), left.solved.reshape(k, n)


def _influence(fix: Geometry) -> Floats:
    """(s, s, n) H less the unit matrix: of range j (first) on the fitted range i.

    H = G S has the position's part and the clock's, which satellites of one constellation share.
    """
    hat: Floats = np.einsum("ain,ajn->jin", fix.rows, fix.gain)
    for member, total in zip(fix.member, fix.clock_weight, strict=True):
        hat += np.where(member, fix.weight / total, 0.0)[:, None] * member[None]
    each = np.arange(len(hat))
    hat[each, each] -= 1.0
    return hat


def _less_one(fix: Geometry, axes: Floats) -> tuple[Floats, Floats, Bools]:
    """Gains (q, s, s, n), variances (q, s, n) and soundness (s, n) without each satellite.

    S(-i) = S - S_i (unit_i - H_i) / r_i, P(-i) = P + S_i S_i' / (w_i r_i); the satellite left out
    comes last but one.
    """
    gain = along_axes(fix.gain, axes)
    sound = (fix.redundancy >= fix.least_redundancy) & (fix.dof >= 1)
    r = np.where(sound, fix.redundancy, 1.0)
    lever = gain / r
    reduced = gain[:, :, None] + lever[:, None] * _influence(fix)
    each = np.arange(len(r))
    # Exactly 0 but for rounding: the satellite is not there.
    reduced[:, each, each] = 0.0
    var = np.stack([variance(fix.covariance, axis) for axis in axes])
    return reduced, var[:, None] + gain * lever / _divisor(fix), sound & fix.solved


def _less_two(fix: Geometry, slots: Ints, axes: Floats) -> tuple[Floats, Floats, Bools]:
    """Gains (q, s, k, n), variances (q, k, n) and soundness (k, n) without (k, 2) satellites.

    S(-A) = S - S_A R^-1 (unit_A - H_A), P(-A) = P + S_A R^-1 W_A^-1 S_A' with R = (I - H)_AA.
    Not sound also where R is nearly singular, such as for the only two satellites of a
    constellation, whose clock goes with them: such pairs must be solved anew.
    """
    gain, hat, w = along_axes(fix.gain, axes), _influence(fix), _divisor(fix)
    i, j = slots.T
    # `hat` has the fitted range last: hat[j, i] is H_ij.
    r_i, r_j, h_ij, h_ji = -hat[i, i], -hat[j, j], hat[j, i], hat[i, j]
    determinant = r_i * r_j - h_ij * h_ji
    sound = (determinant >= _LEAST_DETERMINANT) & (fix.dof >= 2) & fix.solved
    determinant = np.where(sound, determinant, 1.0)
    s_i, s_j = gain[:, i], gain[:, j]
    lever_i = (s_i * r_j + s_j * h_ji) / determinant
    lever_j = (s_i * h_ij + s_j * r_i) / determinant
    reduced = lever_i[:, None] * hat[:, i]
    reduced += lever_j[:, None] * hat[:, j]
    reduced += gain[:, :, None]
    pair = np.arange(len(slots))
    reduced[:, i, pair] = 0.0
    reduced[:, j, pair] = 0.0
    var = np.stack([variance(fix.covariance, axis) for axis in axes])[:, None]
    return reduced, var + lever_i * s_i / w[i] + lever_j * s_j / w[j], sound


def _divisor(fix: Geometry) -> Floats:
    """(s, n) weights; 1 where a slot takes no part."""
    divisor: Floats = np.where(fix.weight > 0, fix.weight, 1.0)
    return divisor
