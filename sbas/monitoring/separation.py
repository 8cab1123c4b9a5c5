"""Solution separation with one fault at a time: a level with a stated risk.

A fault of range i that the fix without it does not betray moves the fix by no more than the
threshold of their difference, and by the error of the fix without it. Source: R. G. Brown and
P. W. McBurney, "Self-contained GPS integrity check using maximum solution separation", Navigation
35(1), 1988; the budget is shared equally. Several faults at once belong to ARAIM.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from sbas.exceptions import InputError
from sbas.monitoring.normal_equations import Floats, Geometry, Ints, variance
from sbas.monitoring.slopes import axis_slope


@dataclass(frozen=True)
class SeparationBudget:
    """What a level of solution separation may cost.

    Parameters
    ----------
    risk : that the error exceeds the level without an alarm, per epoch, of one direction
        (vertical, along or across) or of the two horizontal axes together. Half of it belongs to
        the epoch without fault, half to one faulty range.
    false_alarm : of all tests of a direction, or of both horizontal axes.
    prior : probability that a given range is faulty at an epoch.
    """

    risk: float = 1e-7
    false_alarm: float = 1e-3
    prior: float = 1e-5

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0 < value < 1:
                raise InputError(f"{name} is a probability between 0 and 1", evidence=f"{value}")

    def two_faults(self, satellites: int) -> float:
        """Bound on the probability of two or more faulty ranges, which no level here covers."""
        return math.comb(satellites, 2) * self.prior**2


@dataclass(frozen=True, eq=False)
class SeparationFactors:
    """(n,) multiples: `fault_free` of the fix's sigma, `alarm` of the separation's, `missed` of
    the sigma of the fix without a range."""

    fault_free: Floats
    alarm: Floats
    missed: Floats


def separation_factors(budget: SeparationBudget, satellites: Ints, axes: int) -> SeparationFactors:
    """Factors by number of ranges (n,), with the budget shared by one axis or two."""
    n = np.maximum(np.asarray(satellites, np.float64), 1.0)
    half = budget.risk / (2 * axes)
    fault = half / (n * budget.prior)
    return SeparationFactors(
        np.broadcast_to(-ndtri(half / 2), n.shape),
        -ndtri(budget.false_alarm / (2 * axes * n)),
        # A fault rarer than its share needs no room for noise, and yet the room of its alarm.
        np.maximum(-ndtri(np.minimum(fault, 0.5)), 0.0),
    )


def separation_level_m(g: Geometry, axis: Floats, budget: SeparationBudget, axes: int) -> Floats:
    """(n,) max(K_ff sigma, max over i of K_fa sigma_ss,i + K_md sigma(-i)) along an axis [m].

    Infinite where a fault would not show; NaN where there is no test. The sigma of the fix
    without range i is the root of sigma^2 + sigma_ss,i^2.
    """
    slope = axis_slope(g, axis)
    square = variance(g.covariance, axis)
    k = separation_factors(budget, g.satellites, axes)
    with_fault = k.alarm * slope + k.missed * np.sqrt(square + slope * slope)
    worst = np.where(np.isnan(with_fault), -np.inf, with_fault).max(axis=0, initial=-np.inf)
    level = np.maximum(k.fault_free * np.sqrt(square), worst)
    return np.where(g.solved & (g.dof >= 1), level, np.nan)
