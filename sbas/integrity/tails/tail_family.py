"""Tail of the squared size of a Gaussian horizontal error with a given axis ratio.

With y = (error/sigma)^2/2 and sigma along the major axis, equal axes make y exponential. An
elongated ellipse falls faster at first and like the exponential only far out: an exponential
fitted near the 95 % quantile of such errors would promise too much.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.integrity.k_factors import log_exceedance

Floats = NDArray[np.float64]

_LEVELS = np.concatenate([[0.0], np.geomspace(1e-3, 800.0, 500)])
_NODES, _WEIGHTS = np.polynomial.laguerre.laggauss(32)


@dataclass(frozen=True, eq=False)
class TailFamily:
    """-ln P(y > v) and mean excess of y over v, tabulated, for unit sigma.

    Parameters
    ----------
    axis_ratio : minor over major axis, in [0, 1].
    level : (m,) increasing v [1].
    depth : (m,) -ln P(y > v), increasing.
    relative_excess : (m,) E(y - v | y > v)/v at the levels above 0, falling.
    """

    axis_ratio: float
    level: Floats
    depth: Floats
    relative_excess: Floats

    def depth_at(self, level: ArrayLike) -> Floats:
        """-ln P(y > level); beyond the table with slope 1, which it approaches from above."""
        v = np.asarray(level, dtype=np.float64)
        beyond = np.maximum(v - self.level[-1], 0.0)
        return np.asarray(np.interp(v, self.level, self.depth) + beyond)

    def level_at(self, depth: ArrayLike) -> Floats:
        """The level that y exceeds with probability exp(-depth); 0 for depths below 0."""
        d = np.asarray(depth, dtype=np.float64)
        beyond = np.maximum(d - self.depth[-1], 0.0)
        return np.asarray(np.interp(d, self.depth, self.level) + beyond)

    def scale(self, threshold: ArrayLike, mean_excess: ArrayLike) -> Floats:
        """Factor s such that y/s has unit sigma, from the mean excess over a threshold."""
        u = np.asarray(threshold, dtype=np.float64)
        ratio = np.asarray(mean_excess, dtype=np.float64) / u
        # log-log: for equal axes the table is v -> 1/v, which is then exact.
        log_level = np.interp(-np.log(ratio), -np.log(self.relative_excess), np.log(self.level[1:]))
        return np.asarray(u / np.exp(log_level))


@lru_cache(maxsize=32)
def tail_family(axis_ratio: float) -> TailFamily:
    """Table of the tail of y = R^2/2, R the Hoyt-distributed size of a Gaussian error.

    Parameters
    ----------
    axis_ratio : minor over major axis, in [0, 1]; K and y in units of the major axis.

    Returns
    -------
    TailFamily.

    Raises
    ------
    InputError : an axis ratio outside [0, 1].

    Notes
    -----
    Mean excess: the integral of P(y > v + x)/P(y > v) over x, by 32 Gauss-Laguerre nodes.

    References
    ----------
    Hoyt 1947, Proc. IRE 35, 486; tail from `sbas.integrity.k_factors.log_exceedance`.
    """

    def depth(level: Floats) -> Floats:
        return -np.asarray(
            log_exceedance(np.sqrt(2 * level), distribution="ellipse", axis_ratio=axis_ratio)
        )

    at = depth(_LEVELS)
    v = _LEVELS[1:]
    further = depth(v[:, None] + _NODES)
    # Gauss-Laguerre weights hold exp(-x) already.
    excess = np.exp(at[1:, None] + _NODES - further) @ _WEIGHTS
    return TailFamily(axis_ratio, _LEVELS, at, excess / v)
