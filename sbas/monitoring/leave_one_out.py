"""Every fix without each of its ranges, and how far two ranges can be told apart.

Source: rank-one updates of the inverse (Sherman and Morrison 1950); W. Baarda, "A testing
procedure for use in geodetic networks", 1968, for the correlation of tests.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sbas.monitoring.normal_equations import (
    PAIRS,
    Adjustment,
    Floats,
    Geometry,
    Ints,
    times,
)


def correlation(g: Geometry, index: Ints) -> Floats:
    """(s, n) correlation of each w-test with that of the range (n,) `index` of its epoch.

    rho_ij = R_ij sigma_j / sigma_i / sqrt(r_i r_j) with R = I - G S; 1 or -1 where two ranges
    cannot be told apart, NaN where one has no redundancy.
    """
    here = np.arange(index.size)
    root = np.sqrt(g.weight)
    same = sum(
        member * member[index, here] / total
        for member, total in zip(g.member, g.clock_weight, strict=True)
    )
    across = (times(g.covariance, g.rows[:, index, here])[:, None] * g.rows).sum(axis=0)
    off = -(same + across) * root * root[index, here]
    r = np.where(g.redundancy >= g.least_redundancy, g.redundancy, np.nan)
    rho: Floats = off / np.sqrt(r * r[index, here])
    rho[index, here] = np.where(np.isfinite(r[index, here]), 1.0, np.nan)
    return rho


@dataclass(frozen=True, eq=False)
class LeaveOneOut:
    """Every epoch without each of its ranges in turn; NaN where a range has no redundancy.

    `step_m` (3, s, n), `statistic` (s, n), `covariance` (6, s, n) of the s reduced fixes.
    """

    step_m: Floats
    statistic: Floats
    covariance: Floats


def leave_one_out(g: Geometry, a: Adjustment) -> LeaveOneOut:
    """Reduced fixes by rank-one updates: nothing is inverted again.

    x(-i) = x - S_i e_i / r_i, T(-i) = T - w_i e_i^2 / r_i, P(-i) = P + S_i S_i' / (w_i r_i).
    """
    r = np.where(g.redundancy >= g.least_redundancy, g.redundancy, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        more = 1 / (g.weight * r)
    step = a.step_m[:, None] - g.gain * (a.residual_m / r)
    statistic = np.maximum(a.statistic - g.weight * a.residual_m**2 / r, 0.0)
    covariance = np.stack(
        [g.covariance[k] + g.gain[i] * g.gain[j] * more for k, (i, j) in enumerate(PAIRS)]
    )
    return LeaveOneOut(step, statistic, covariance)
