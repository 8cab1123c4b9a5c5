"""What the tail of a Gaussian, Gauss-Markov record of the same length looks like, by simulation.

Tails of correlated records scatter far more than those of independent samples, and skewly. A
goodness of fit or an interval means something only against records as correlated and as short
as the one at hand: these are simulated once for each length, with a fixed seed.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.integrity.gauss_markov_series import gauss_markov_series
from sbas.integrity.tails.tail_family import tail_family

Floats = NDArray[np.float64]

QUANTILES = (0.5, 0.9, 0.95, 0.98, 0.99)
THRESHOLD = QUANTILES.index(0.95)
STATISTICS = (
    "mean excess, 90 against 95 %",
    "mean excess, 98 against 95 %",
    "mean excess, 99 against 95 %",
    "mean excess against quantile, 95 %",
    "quantiles, 95 against 50 %",
    "shape of the excesses over 95 %",
    "largest value against quantile",
)
"""What is compared; each falls or rises where the tail is lighter or heavier than Gaussian."""

PER_TAU = 25
"""Samples per decorrelation time that carry nearly all a record says of its tail."""

RECORDS = 600
_LONGEST_TAUS, _SEED, _AT_ONCE, _QUANTILES_OF_ENDLESS = 400, 20261122, 50, 1_000_000


@dataclass(frozen=True, eq=False)
class TailSummary:
    """Thresholds, mean excesses and shape statistics of one record, or of many.

    Parameters
    ----------
    threshold, excess : (..., 5) quantile of y at each of `QUANTILES`, mean excess over it.
    statistic : (..., 7) `STATISTICS`, logarithms of ratios but for the shape.
    """

    threshold: Floats
    excess: Floats
    statistic: Floats


def summarise_tail(y: NDArray[np.floating[Any]]) -> TailSummary:
    """Thresholds, mean excesses and statistics of each row of y.

    Parameters
    ----------
    y : (..., n) squared errors, n >= 200.

    Returns
    -------
    TailSummary; a tail without spread gives statistics that are not finite.

    Notes
    -----
    Shape of a generalised Pareto tail by moments, (1 - mean^2/variance)/2: Hosking and Wallis
    1987, Technometrics 29, 339.
    """
    return summarise_ordered_tail(np.sort(y, axis=-1))


def summarise_ordered_tail(ordered: NDArray[np.floating[Any]]) -> TailSummary:
    """`summarise_tail` of rows in rising order; sums of single precision are double."""
    n = ordered.shape[-1]
    cuts = [math.floor(n * q) for q in QUANTILES]
    threshold = np.stack([ordered[..., c] for c in cuts], axis=-1).astype(np.float64)
    mean = [ordered[..., c:].mean(axis=-1, dtype=np.float64) for c in cuts]
    excess = np.stack(mean, axis=-1) - threshold
    tail = ordered[..., cuts[THRESHOLD] :]
    with np.errstate(divide="ignore", invalid="ignore"):
        shape = (1 - excess[..., THRESHOLD] ** 2 / tail.var(axis=-1, dtype=np.float64)) / 2
        log_u, log_b = np.log(threshold), np.log(excess)
        statistic = np.stack(
            [
                log_b[..., 1] - log_b[..., 2],
                log_b[..., 3] - log_b[..., 2],
                log_b[..., 4] - log_b[..., 2],
                log_b[..., 2] - log_u[..., 2],
                log_u[..., 2] - log_u[..., 0],
                shape,
                np.log(ordered[..., -1], dtype=np.float64) - log_u[..., 2],
            ],
            axis=-1,
        )
    return TailSummary(threshold, excess, statistic)


@dataclass(frozen=True, eq=False)
class TailReference:
    """Tails of simulated records of unit sigma; rows are records.

    Parameters
    ----------
    log_threshold, log_excess : (r,) of the 95 % quantile and the mean excess over it.
    centre, spread : (7,) mean and standard deviation of each statistic.
    largest : (r,) sorted largest |statistic - centre|/spread of each record.
    stability : (5,) standard deviation of ln mean excess at each quantile.
    """

    log_threshold: Floats
    log_excess: Floats
    centre: Floats
    spread: Floats
    largest: Floats
    stability: Floats

    def misfit(self, statistic: Floats) -> tuple[Floats, float]:
        """(7,) standardised statistics, and the share of Gaussian records that fit worse."""
        z = (statistic - self.centre) / self.spread
        if not np.isfinite(z).all():
            return z, 0.0
        rank = np.searchsorted(self.largest, np.abs(z).max())
        return z, float((self.largest.size - rank) / self.largest.size)


@lru_cache(maxsize=512)
def tail_reference(
    taus: float, *, per_tau: float, axis_ratio: float = 1.0, nugget: float = 0.0
) -> TailReference:
    """Simulated tails of Gaussian, Gauss-Markov records.

    Parameters
    ----------
    taus : length of the record in decorrelation times, at least 20.
    per_tau : samples per decorrelation time, at most `PER_TAU` are used.
    axis_ratio : minor over major axis of the error, in [0, 1].
    nugget : share of the variance that is white.

    Returns
    -------
    TailReference. Lengths are rounded down to steps of 2 %. Beyond 400 decorrelation times the
    deviations are those of 400, shrunk by the root of the length (they are nearly normal there),
    and biases shrink with the length; the largest value grows by the logarithm of the length.
    """
    length = 1.02 ** math.floor(math.log(taus) / math.log(1.02) + 1e-9)
    used = min(length, _LONGEST_TAUS)
    rate = max(2, round(min(per_tau, PER_TAU)))
    axis_ratio = round(axis_ratio, 2)
    # White noise changes a tail so slowly that steps of 2 % serve, and records share one.
    white = math.ceil(50 * nugget - 1e-9) / 50
    records = _simulate(round(used * rate), rate, axis_ratio, white)
    return _standardise(records, _endless(axis_ratio), used / length)


@lru_cache(maxsize=256)
def _simulate(samples: int, per_tau: int, axis_ratio: float, nugget: float) -> TailSummary:
    generator = np.random.default_rng(_SEED)
    correlation = math.exp(-1 / per_tau)
    axes = np.array([1.0, axis_ratio])[:, None]

    def drawn() -> tuple[Floats, Floats | None]:
        shape = (_AT_ONCE, 2, samples)
        noise = generator.standard_normal(shape)
        return noise, generator.standard_normal(shape) if nugget > 0 else None

    def summarised(noise: Floats, white: Floats | None) -> TailSummary:
        noise[..., 1:] *= math.sqrt((1 - correlation) * (1 + correlation))
        error = gauss_markov_series(noise, correlation)
        if white is not None:
            error = math.sqrt(1 - nugget) * error + math.sqrt(nugget) * white
        return summarise_tail(((axes * error) ** 2).sum(axis=1) / 2)

    # Random numbers are half of the work: the next are drawn while the last are summarised.
    with ThreadPoolExecutor(1) as other:
        running = [other.submit(summarised, *drawn()) for _ in range(RECORDS // _AT_ONCE)]
        parts = [r.result() for r in running]
    return TailSummary(
        np.concatenate([p.threshold for p in parts]),
        np.concatenate([p.excess for p in parts]),
        np.concatenate([p.statistic for p in parts]),
    )


@lru_cache(maxsize=32)
def _endless(axis_ratio: float) -> TailSummary:
    """Summary of an endless record: of the quantiles of the distribution itself."""
    p = (np.arange(_QUANTILES_OF_ENDLESS) + 0.5) / _QUANTILES_OF_ENDLESS
    return summarise_tail(tail_family(axis_ratio).level_at(-np.log1p(-p)))


def _standardise(records: TailSummary, endless: TailSummary, shrink: float) -> TailReference:
    """Deviations and biases of records 1/shrink times as long."""

    def longer(values: Floats, limit: Floats) -> Floats:
        middle = np.median(values, axis=0)
        return np.asarray(limit + shrink * (middle - limit) + math.sqrt(shrink) * (values - middle))

    statistic = longer(records.statistic, endless.statistic)
    centre, spread = statistic.mean(axis=0), statistic.std(axis=0)
    # The largest y of a record m times as long is larger by ln m, with the same deviation.
    top = records.statistic[:, -1] + np.log(records.threshold[:, THRESHOLD])
    growth = math.exp(float(top.mean()))
    limit_u = math.log(float(endless.threshold[THRESHOLD]))
    centre[-1] = math.log(growth - math.log(shrink)) - limit_u
    spread[-1] = records.statistic[:, -1].std() * growth / (growth - math.log(shrink))
    own_centre, own_spread = records.statistic.mean(axis=0), records.statistic.std(axis=0)
    log_excess = longer(np.log(records.excess), np.log(endless.excess))
    log_threshold = longer(np.log(records.threshold), np.log(endless.threshold))
    return TailReference(
        log_threshold[:, THRESHOLD],
        log_excess[:, THRESHOLD],
        centre,
        spread,
        np.sort(np.abs((records.statistic - own_centre) / own_spread).max(axis=1)),
        log_excess.std(axis=0),
    )
