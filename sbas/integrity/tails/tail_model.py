"""Modelled rates: a fitted tail with a clock, extrapolated to a level.

The tail says how probable a level is at one sample, the clock (a Gauss-Markov process with the
measured decorrelation time) how often such a sample begins something new.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.estimate import Estimate, Fitted, Refusal
from sbas.exceptions import InputError
from sbas.integrity.counting import Sided, checked_alpha
from sbas.integrity.tails.sampled_clock import log_hazards
from sbas.integrity.tails.tail_family import TailFamily, tail_family
from sbas.integrity.tails.tail_fit import LEAST_TAUS, TailFit
from sbas.integrity.tails.tail_reference import tail_reference

Floats = NDArray[np.float64]

HEAVY_SCALE = 1.1
"""Scale of sigma^2 above which the result carries a flag."""
MOST_DECADES = 12.0
_BOOTSTRAPS, _SEED, _NODES = 400, 20261122, 128
_DEEPEST = 40.0
"""In K^2/2: a level so much deeper than the lowest has less than e-40 of its hazard."""
_CURVE = np.concatenate([np.arange(0.0, 40.0, 0.25), np.geomspace(40.0, 400.0, 40)])


def modelled_rate(
    fit: TailFit | Refusal,
    level_k: ArrayLike,
    *,
    counts: ArrayLike | None = None,
    rises: ArrayLike | None = None,
    confidence: float = 0.95,
    sided: Sided = "upper",
) -> Estimate | Refusal:
    """Rate per hour at which errors reach a level, by the fitted tail: `modelled` evidence.

    Parameters
    ----------
    fit : result of `fit_tail`.
    level_k : level over sigma [1], one for all epochs or (m,) several: HPL/sigma for
        HPE >= HPL, AL/sigma for HPE >= AL; infinite where the event is impossible (HPL >= AL).
    counts : (m,) epochs at each level; None: one each.
    rises : (m,) how often the chance rose to that of this level from one epoch to the next
        (from a higher level, or from none), less how often it rose from it; None: never, the
        level changes slowly or not at all.
    confidence : of the bound, in [0.5, 1).
    sided : "upper", "lower" or "two".

    Returns
    -------
    Estimate in "per_h": median-unbiased value and bounds; a Refusal where the tail misfits, or
    the level lies more than 12 decades beyond the record. Every exceedance counts, whatever its
    duration.

    Raises
    ------
    InputError : levels that are negative or NaN, counts that are not those of the levels, or a
        confidence out of range.

    Notes
    -----
    P(y) = 0.05 exp(-(y - u)/b), for an ellipse along the Hoyt tail; K_e with p(K_e) = P;
    rate = P h(K_e)/p(K_e), h the hazard of the sampled Gauss-Markov process, averaged over the
    epochs; where the level itself comes down on an error that stays, at most the rise of the
    chance is added (union bound). The bound takes the larger of two: the inversion of the
    estimator's distribution on simulated records of the same length (at the upper tau), and a
    block bootstrap of count and sum of the excesses (blocks of 10 tau); and the clock at the
    lower tau. The exponential's block bootstrap alone covers 86 % of 95.

    References
    ----------
    Inversion: Lehmann and Romano 2005, Testing Statistical Hypotheses, 3.5; blocks: Kunsch
    1989, Ann. Stat. 17, 1217.
    """
    alpha = checked_alpha(confidence) / (2 if sided == "two" else 1)
    if isinstance(fit, Refusal):
        return fit
    if fit.refusal is not None:
        return fit.refusal
    levels, weights, risen, possible = _levels(level_k, counts, rises)
    if levels.size == 0:
        return Refusal("the event is impossible at every epoch: the level is above its limit")
    nodes = levels
    if levels.size > _NODES:
        # Epochs beyond the highest node count with it: far too rare to be seen in the sum, even
        # by the bound, which is flatter than the tail.
        highest = math.hypot(levels[0], math.sqrt(6 * _DEEPEST * fit.scale))
        nodes = np.geomspace(max(levels[0], 1e-3), max(min(levels[-1], highest), 2e-3), _NODES)
    value_v, low_v, high_v = _level_bounds(fit, nodes**2 / 2, alpha)

    def rate(v: Floats, tau_s: float) -> float:
        # Over y the fitted level is nearly a straight line.
        at = np.interp(levels**2, nodes**2, v)
        seen = np.minimum(at, at.min() + _DEEPEST)
        log_hazard = log_hazards(
            np.sqrt(2 * seen), tau_s=tau_s, interval_s=fit.interval_s,
            axis_ratio=fit.axis_ratio, nugget=fit.nugget,
        )  # fmt: skip
        per_s = np.exp(-tail_family(fit.axis_ratio).depth_at(seen)) / fit.interval_s
        begun = float(np.dot(weights, np.exp(log_hazard)) + np.dot(risen, per_s))
        # No more events begin than epochs exceed.
        return 3600 * min(begun, float(np.dot(weights, per_s)))

    value = rate(value_v, fit.tau_s)
    decades = -math.log10(value * fit.hours) if value > 1e-290 else math.inf
    if decades > MOST_DECADES:
        return Refusal(
            f"the level lies more than {MOST_DECADES:g} decades beyond the {fit.hours:.4g} h of "
            "the record",
            "no tail says anything there; use the demonstrated bound",
        )
    # A longer tau lowers the rate, a higher level too: both are taken to the side asked for.
    upper = max(value, rate(low_v, fit.tau_low_s)) if sided != "lower" else None
    lower = min(value, rate(high_v, fit.tau_high_s)) if sided != "upper" else None
    return Estimate(
        value=value,
        lower=lower,
        upper=upper,
        confidence=confidence,
        unit="per_h",
        basis=Fitted("tail of all exceedances with a Gauss-Markov clock", _parameters(fit),
                     max(0.0, decades)),
        sided=sided,
        caveats=_caveats(fit, possible),
    )  # fmt: skip


def tail_probability(
    fit: TailFit, level_k: ArrayLike, *, confidence: float = 0.95
) -> tuple[Floats, Floats, Floats]:
    """Probability of a sample beyond each level by the fitted tail, for a picture.

    Parameters
    ----------
    fit : fitted tail; given for a misfit too, so that the misfit can be seen.
    level_k : (m,) level over sigma [1].
    confidence : of the two-sided interval, in [0.5, 1).

    Returns
    -------
    value, lower, upper : (m,) [1]; at each level by itself.

    Raises
    ------
    InputError : a confidence out of range.
    """
    level = np.asarray(level_k, dtype=np.float64)
    found = _level_bounds(fit, level**2 / 2, checked_alpha(confidence) / 2)
    family = tail_family(fit.axis_ratio)
    value, upper, lower = (np.exp(-family.depth_at(v)) for v in found)
    return value, lower, upper


# --- level and bounds -------------------------------------------------------------------------


def _levels(
    level_k: ArrayLike, counts: ArrayLike | None, rises: ArrayLike | None
) -> tuple[Floats, Floats, Floats, float]:
    """Distinct finite levels; of the epochs the share with each, the share that rose to it, and
    the share that has one."""
    level = np.atleast_1d(np.asarray(level_k, dtype=np.float64)).ravel()
    if level.size == 0 or np.isnan(level).any() or np.any(level < 0):
        raise InputError(
            "levels are numbers of 0 or more", where="level_k", evidence=f"{level.size} levels"
        )
    epochs = np.ones(level.size) if counts is None else np.asarray(counts, dtype=np.float64).ravel()
    if epochs.shape != level.shape or not (np.all(epochs >= 0) and 0 < epochs.sum() < math.inf):
        raise InputError(
            "counts are numbers of epochs, one a level, of which some are above 0",
            where="counts",
            evidence=f"{epochs.size} counts for {level.size} levels, sum {epochs.sum():g}",
        )
    some = np.isfinite(level) & (epochs > 0)
    distinct, which = np.unique(level[some], return_inverse=True)
    shares = np.bincount(which, epochs[some], distinct.size) / epochs.sum()
    risen = np.zeros(level.size) if rises is None else np.asarray(rises, dtype=np.float64).ravel()
    if risen.shape != level.shape or not np.isfinite(risen).all():
        raise InputError("rises are finite numbers, one a level", where="rises",
                         evidence=f"{risen.size} rises for {level.size} levels")  # fmt: skip
    rose = np.bincount(which, risen[some], distinct.size) / epochs.sum()
    return distinct, shares, rose, float(epochs[some].sum() / epochs.sum())


def _level_bounds(fit: TailFit, y: Floats, alpha: float) -> tuple[Floats, Floats, Floats]:
    """Levels in fitted sigma (as K^2/2): median-unbiased, lower (unsafe) and upper bound."""
    family = tail_family(fit.axis_ratio)
    per_tau = fit.tau_s / fit.interval_s
    # Fewer decorrelation times, as the upper tau has them, scatter more.
    fewest = max(fit.taus * fit.tau_s / fit.tau_high_s, LEAST_TAUS)
    observed = _fitted_level(family, y, fit.threshold, fit.excess, 0.05)

    def inverse(taus: float, quantile: float) -> Floats:
        """True levels under which the observed one would be the given quantile."""
        seen = _seen_levels(taus, per_tau, fit.axis_ratio, fit.nugget, quantile)
        slope = (seen[-1] - seen[-2]) / (_CURVE[-1] - _CURVE[-2])
        beyond = np.maximum(observed - seen[-1], 0) / slope
        return np.asarray(np.interp(observed, seen, _CURVE) + beyond)

    value = inverse(fit.taus, 0.5)
    excess, share = _resampled(fit)
    again = _fitted_level(family, y, fit.threshold, excess, share)
    lowest, highest = np.quantile(again, [alpha, 1 - alpha], axis=0)
    low = np.minimum(inverse(fewest, 1 - alpha), lowest)
    high = np.maximum(inverse(fewest, alpha), highest)
    return value, np.minimum(low, value), np.maximum(high, value)


@lru_cache(maxsize=4)
def _resampled(fit: TailFit) -> tuple[Floats, Floats]:
    """Mean excess and share beyond the threshold of (r, 1) block bootstraps."""
    generator = np.random.default_rng(_SEED)
    blocks = fit.block_count.size
    pick = generator.integers(0, blocks, (_BOOTSTRAPS, blocks))
    count, total = fit.block_count[pick].sum(axis=1), fit.block_sum[pick].sum(axis=1)
    filled = (count > 0) & (total > 0)
    count, total = count[filled, None], total[filled, None]
    return total / count, 0.05 * count / fit.block_count.mean() / blocks


@lru_cache(maxsize=128)
def _seen_levels(
    taus: float, per_tau: float, axis_ratio: float, nugget: float, quantile: float
) -> Floats:
    """Quantile of the fitted level at each true level of `_CURVE`, over simulated records."""
    reference = tail_reference(taus, per_tau=per_tau, axis_ratio=axis_ratio, nugget=nugget)
    u, b = np.exp(reference.log_threshold)[:, None], np.exp(reference.log_excess)[:, None]
    levels = _fitted_level(tail_family(axis_ratio), _CURVE, u, b, 0.05)
    return np.asarray(np.quantile(levels, quantile, axis=0))


def _fitted_level(family: TailFamily, y: Floats, threshold: Any, excess: Any, share: Any) -> Floats:
    """Level in sigma (as K^2/2) with the probability that the fitted tail gives to y."""
    scale = family.scale(threshold, excess)
    depth = family.depth_at(y / scale) - family.depth_at(threshold / scale) - np.log(share)
    return family.level_at(depth)


def _parameters(fit: TailFit) -> dict[str, float]:
    return {
        "threshold": fit.threshold,
        "mean_excess": fit.excess,
        "scale": fit.scale,
        "shape": fit.shape,
        "axis_ratio": fit.axis_ratio,
        "clusters": float(fit.clusters),
        "fit_p": fit.fit_p,
        "tau_s": fit.tau_s,
        "nugget": fit.nugget,
        "hours": fit.hours,
    }


def _caveats(fit: TailFit, possible: float) -> tuple[str, ...]:
    caveats = ["modelled, not demonstrated: it holds as far as the error stays Gaussian"]
    if fit.scale > HEAVY_SCALE:
        caveats.append(f"flag: errors are larger than their sigma says, scale {fit.scale:.3g}")
    if fit.shape > 0:
        caveats.append(
            f"flag: shape {fit.shape:.2g} above 0, within what Gaussian records show "
            f"(p = {fit.fit_p:.2g})"
        )
    if fit.bias is None:
        caveats.append("from sizes of errors alone: equal axes and no bias are supposed")
    if fit.tau_low_s == fit.tau_s:
        caveats.append("the decorrelation time was taken as known")
    if possible < 1:
        caveats.append(f"the event is possible at {100 * possible:.4g} % of the epochs")
    return tuple(caveats)
