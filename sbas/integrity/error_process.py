"""How a recording's errors move and how large they get: what rates, intervals and K rest on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.integrity.correlation.correlation import decorrelation_of
from sbas.integrity.correlation.decorrelation_results import Decorrelation
from sbas.integrity.correlation.error_grid import ErrorGrid, room
from sbas.integrity.shares.block_bootstrap import merge_time_s
from sbas.integrity.tails.tail_fit import TailFit, fit_tail

Floats = NDArray[np.float64]

_CONFIDENCES = (0.95, 0.99)
"""The interval of tau is two-sided: at 95 % each end already holds at 97.5 %."""
_CELLS_AT_ONCE = 1 << 20


@dataclass(frozen=True, eq=False)
class ErrorProcess:
    """The process behind the errors of a recording.

    Parameters
    ----------
    decorrelation : how long errors stay correlated, or why that is not known.
    tail : fitted tail of the errors over sigma = HPL/K, or why there is none.
    sigma_ratio, pooled_ratio : root mean square of the error along its major axis, and over
        both components, over sigma = HPL/K [1]; None where no epoch has both.
    k_of_mode : (m + 1,) K of each mode, the last where no mode is stated; NaN where unknown.
    """

    decorrelation: Decorrelation
    tail: TailFit | Refusal
    sigma_ratio: float | None
    pooled_ratio: float | None
    k_of_mode: Floats

    @property
    def merge_s(self) -> float:
        """Runs of bad epochs closer than this are one event of a rate [s]: max(tau/2, 60 s).

        60 s where the decorrelation time is not known.
        """
        tau = self.decorrelation.tau_s
        return merge_time_s(0.0 if isinstance(tau, Refusal) else tau.value)

    @property
    def tau_upper_s(self) -> float | None:
        """Upper limit of the decorrelation time [s], safe for shares of time; None if unknown."""
        tau = self.decorrelation.tau_s
        return None if isinstance(tau, Refusal) else tau.upper


def error_process(
    grid: ErrorGrid | Refusal, *, k_of_mode: Floats, confidence: float, lower_bound: bool
) -> ErrorProcess:
    """The process behind the errors of a grid with protection levels.

    Parameters
    ----------
    grid : signed errors with levels, or why there are none.
    k_of_mode : (m + 1,) K of each mode, NaN where unknown: its epochs are in no tail.
    confidence : of the rates that will rest on it; the interval of tau has at least 0.95.
    lower_bound : True where the truth shows but a part of the errors (own median, track line).
    """
    low, high = _CONFIDENCES
    if isinstance(grid, Refusal):
        return ErrorProcess(Decorrelation("", grid, None, None, low), grid, None, None, k_of_mode)
    found = decorrelation_of(grid.values, grid.step_s, confidence=min(max(confidence, low), high))
    sigma = _sigma_m(grid, k_of_mode)
    ratio, pooled = _sigma_ratios(grid, sigma)
    if lower_bound:
        tail: TailFit | Refusal = Refusal(
            "not modelled: errors against this truth are only a lower bound",
            "--truth LAT,LON,HEIGHT of the antenna",
        )
    elif ratio is None:
        tail = Refusal("no epoch has both an error and a level with a known K")
    else:
        tail = _tail(grid, sigma, found)
    return ErrorProcess(found, tail, ratio, pooled, k_of_mode)


def _tail(grid: ErrorGrid, sigma: NDArray[np.float32], found: Decorrelation) -> TailFit | Refusal:
    tau = found.tau_s
    if isinstance(tau, Refusal):
        return Refusal(f"without a decorrelation time a tail has no clock: {tau.reason}", tau.cure)
    if found.misfit == "mixture":
        return Refusal(
            "the errors are a mixture: one decorrelation time is no clock for a tail",
            "model the parts apart, by environment or by time",
        )
    low = tau.value if tau.lower is None else tau.lower
    if low <= grid.step_s:
        return Refusal(
            f"the decorrelation time may be as short as {low:.3g} s, no longer than the step of "
            f"{grid.step_s:g} s: too short for the clock of a tail",
            "record at a higher rate",
        )
    # Without an upper limit tau may be as long as the record, where a tail scatters most.
    longest = found.recorded_s if tau.upper is None else tau.upper
    return fit_tail(
        grid.values,
        sigma,
        interval_s=grid.step_s,
        tau_s=tau.value,
        tau_low_s=low,
        tau_high_s=longest,
        nugget=found.white_share,
    )


def _sigma_m(grid: ErrorGrid, k_of_mode: Floats) -> NDArray[np.float32]:
    """(n,) standard deviation along the major axis that each level claims [m], NaN if unknown."""
    assert grid.hpl_m is not None
    assert grid.modes is not None
    sigma = room(grid.hpl_m.shape)
    np.divide(grid.hpl_m, k_of_mode.astype(np.float32)[grid.modes], out=sigma)
    sigma[~(sigma > 0)] = np.nan
    return sigma


def _sigma_ratios(
    grid: ErrorGrid, sigma: NDArray[np.float32]
) -> tuple[float, float] | tuple[None, None]:
    moments, known = np.zeros((2, 2)), 0
    for first in range(0, sigma.size, _CELLS_AT_ONCE):
        part = slice(first, first + _CELLS_AT_ONCE)
        scaled = grid.values[:, part].astype(np.float64) / sigma[part]
        scaled = scaled[:, np.isfinite(scaled).all(axis=0)]
        moments += scaled @ scaled.T
        known += scaled.shape[1]
    if known == 0:
        return None, None
    major = float(np.linalg.eigvalsh(moments / known)[-1])
    return math.sqrt(major), math.sqrt(float(np.trace(moments)) / known / 2)
