"""Shares of time with intervals that respect correlation, and differences of two of them.

Epochs are correlated: an interval from their number is far too narrow (it covered 8 to 12 %
instead of 95 % on simulated records). From 50 clusters on a circular block bootstrap is used;
below, the exact binomial limits of an effective number of samples.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import special

from sbas.estimate import Counted, Estimate, Refusal
from sbas.integrity.counting import Sided, checked_alpha
from sbas.integrity.exposure.exposure import require
from sbas.integrity.shares.time_spans import Spans
from sbas.timescales import NS_PER_S

Floats = NDArray[np.float64]

MIN_CLUSTERS = 50
"""Fewer clusters of the rarer state give no bootstrap: it covered 71 to 88 % there."""
MIN_BLOCKS = 20
"""Fewer blocks give no bootstrap: choice of this package."""
BLOCK_TAUS = 10.0
REPLICATES = 2000
_STRETCHES = 1 << 14
_PLACES = 64
"""Places a block length at which a block may begin."""
_CHUNK = 1 << 21


def merge_time_s(tau_s: float) -> float:
    """Spans of a state at most this far apart are one cluster [s]: max(tau/2, 60 s)."""
    return max(tau_s / 2, 60.0)


def share_estimate(
    inside: Spans,
    observed: Spans,
    *,
    tau_s: float,
    confidence: float = 0.95,
    sided: Sided = "two",
    interval_s: float = 0.0,
    of: str = "clusters",
    seed: int = 0,
) -> Estimate | Refusal:
    """Share of the observed time in which a state held, with an interval that respects correlation.

    Parameters
    ----------
    inside : when the state held, such as the service being up; within `observed`.
    observed : when it could be seen.
    tau_s : 1/e time of what drives the state [s], its upper limit; the state's own time, where
        it is longer, takes its place.
    confidence : of the interval, in [0.5, 1).
    sided : "two", "lower" or "upper".
    interval_s : sampling interval [s]; a tau below it counts as the interval.
    of : what the clusters of the rarer state are, for people.
    seed : of the bootstrap's generator.

    Returns
    -------
    Estimate of unit "1", its basis the clusters of the rarer state; a Refusal when nothing was
    observed.

    Raises
    ------
    InputError : an argument out of range, or a state outside the observed time.

    Notes
    -----
    Let q be the share of the rarer state, its spans merged to clusters up to max(tau/2, 60 s) and
    m = (sum d)^2/sum d^2 of their times d the effective number of clusters. From 50 clusters on
    (and m of half as many, and 20 blocks): circular block bootstrap, block 10 tau, or 10 times
    sum d^2/(2 sum d) where clusters last longer than tau; percentiles widened as Student's t is.
    Below: Clopper-Pearson with k = min(q T/tau, m), n = k/q (n = T/tau for q = 0).

    References
    ----------
    Politis and Romano 1992 (circular block bootstrap); Clopper and Pearson 1934, Biometrika 26,
    404; Kish 1965 (m); Hesterberg 2015, The American Statistician 69, 371 (widened percentiles);
    rule of 50 clusters: integrity statistics, 5.2.
    """
    require("tau_s", tau_s, above=0)
    alpha = checked_alpha(confidence) / (2 if sided == "two" else 1)
    if observed.total_s <= 0:
        return Refusal("no time was observed")
    outside = observed.without(inside)
    state_tau = state_tau_s(inside, observed)
    tau_s = max(tau_s, interval_s, 2 * state_tau)
    total, held = observed.total_s, inside.total_s
    value = held / total
    swapped = held > total / 2
    rare = outside if swapped else inside
    share = rare.total_s / total
    clusters, m, lasting_tau = _clusters(rare, tau_s)
    block_s = BLOCK_TAUS * max(tau_s, lasting_tau)
    blocks = _span_s(observed) / block_s
    caveats = []
    enough = min(clusters, share * total / tau_s) >= MIN_CLUSTERS and m >= MIN_CLUSTERS / 2
    if enough and blocks >= MIN_BLOCKS:
        ratios = _bootstrap(((inside, 1.0),), observed, block_s, seed)
        low_q, high_q = _widened(alpha, min(blocks, m))
        lower, upper = (float(x) for x in np.quantile(ratios, [low_q, high_q]))
        caveats.append(f"block bootstrap, blocks of {block_s:.6g} s")
    else:
        n = total / tau_s
        k = share * n
        if k > m > 0:
            k, n = m, m / share
        lower, upper = _binomial_limits(k, n, alpha)
        if swapped:
            lower, upper = 1 - upper, 1 - lower
        caveats.append(
            f"binomial limits of {n:.4g} effective samples (T/tau, tau {tau_s:.6g} s, no more "
            "than the clusters support)"
        )
        if clusters == 0:
            caveats.append("never seen: the bound holds for a state that lasts no longer than tau")
    basis = Counted(clusters, total / 3600, f"{of} ({'outside' if swapped else 'inside'})")
    return Estimate(
        value,
        min(lower, value) if sided != "upper" else None,
        max(upper, value) if sided != "lower" else None,
        float(confidence),
        "1",
        basis,
        sided,
        tuple(caveats),
    )


def state_tau_s(inside: Spans, observed: Spans) -> float:
    """Decorrelation time of a state itself [s]: what drives it may be slower than any error.

    Parameters
    ----------
    inside, observed : when the state held, and when it could be seen.

    Returns
    -------
    Integral of the state's autocorrelation up to its first zero; 0 for a state that never
    changes. At a high level a slow process shows shorter stays than its own time, but they
    come in groups, and those the integral sees.

    Notes
    -----
    The share of each of 2^14 stretches of equal length (or of each shortest span, if longer) is
    correlated by FFT, stretches without observation left out.
    """
    span, origin = _span_s(observed), int(observed.start_ns[0])
    edges = np.linspace(0.0, span, _STRETCHES + 1)
    seen = np.diff(observed.until(edges, origin))
    known = seen > 0.5 * span / _STRETCHES
    if not known.any():
        return 0.0
    held = np.where(known, np.diff(inside.until(edges, origin)) / np.where(known, seen, 1.0), 0.0)
    centred = np.where(known, held - held[known].mean(), 0.0)
    if not np.any(centred):
        return 0.0
    size = 2 * _STRETCHES
    products = np.fft.irfft(np.abs(np.fft.rfft(centred, size)) ** 2)[: _STRETCHES // 2]
    pairs = np.fft.irfft(np.abs(np.fft.rfft(known.astype(float), size)) ** 2)[: _STRETCHES // 2]
    enough = np.rint(pairs) >= 1
    r = np.where(enough, products / np.maximum(pairs, 1.0), 0.0)
    r /= r[0]
    stop = int(np.argmax(r <= 0)) if np.any(r <= 0) else r.size
    return float((r[:stop].sum() - 0.5) * span / _STRETCHES)


def share_difference(
    only_a: Spans,
    only_b: Spans,
    observed: Spans,
    *,
    tau_s: float,
    confidence: float = 0.95,
    interval_s: float = 0.0,
    seed: int = 0,
) -> Estimate | Refusal:
    """Difference of two shares of the same time, from the spans in which just one state held.

    Parameters
    ----------
    only_a, only_b : when the state held for A alone and for B alone; within `observed`.
    observed, tau_s, confidence, interval_s, seed : as for `share_estimate`.

    Returns
    -------
    Estimate of share A less share B, two-sided, unit "1", by the block bootstrap of the paired
    difference; below 50 clusters of discordant time a Refusal: then only the rates of the two
    kinds of events say something.

    Raises
    ------
    InputError : an argument out of range.

    References
    ----------
    As for `share_estimate`; pairing: integrity statistics, 7.
    """
    require("tau_s", tau_s, above=0)
    alpha = checked_alpha(confidence) / 2
    tau_s = max(tau_s, interval_s)
    discordant = _union(only_a, only_b)
    clusters, m, lasting_tau = _clusters(discordant, tau_s)
    block_s = BLOCK_TAUS * max(tau_s, lasting_tau)
    blocks = _span_s(observed) / block_s
    if clusters < MIN_CLUSTERS or m < MIN_CLUSTERS / 2 or blocks < MIN_BLOCKS:
        return Refusal(
            f"{clusters} clusters of discordant time ({m:.3g} effective) in {blocks:.3g} blocks of "
            f"{block_s:.6g} s are too few for an interval; {MIN_CLUSTERS} ({MIN_CLUSTERS // 2}) in "
            f"{MIN_BLOCKS} are needed",
            "use the rates of the two kinds of events, or record longer",
        )
    ratios = _bootstrap(((only_a, 1.0), (only_b, -1.0)), observed, block_s, seed)
    lower, upper = (float(x) for x in np.quantile(ratios, list(_widened(alpha, min(blocks, m)))))
    value = (only_a.total_s - only_b.total_s) / observed.total_s
    return Estimate(
        value,
        min(lower, value),
        max(upper, value),
        float(confidence),
        "1",
        Counted(clusters, observed.total_s / 3600, "clusters of discordant time"),
        "two",
        (f"block bootstrap, blocks of {block_s:.6g} s",),
    )


def quantile_estimate(
    values: Floats, q: float, *, n_effective: float, hours: float, confidence: float, unit: str
) -> Estimate:
    """A quantile of correlated values, with the order statistics that bound it.

    Parameters
    ----------
    values : (n,) known values, at least one.
    q : which quantile, in (0, 1).
    n_effective : effective number of independent values [1], above 0.
    hours : what the values span [h].
    confidence : of the two-sided interval.
    unit : of the values.

    Returns
    -------
    Estimate; where the record is too short for a bound on one side, the other one alone at the
    confidence that it then has; a caveat says so.

    Notes
    -----
    The limits are the quantiles at the Clopper-Pearson limits of the share q among n_effective
    values. All values lie on one side of the true quantile with probability q^n (or (1-q)^n):
    above (1 - confidence)/2 no observed value bounds it.

    References
    ----------
    David and Nagaraja 2003, Order Statistics, 7.1 (distribution-free intervals).
    """
    require("n_effective", n_effective, above=0)
    alpha = checked_alpha(confidence) / 2
    low_q, high_q = _binomial_limits(q * n_effective, n_effective, alpha)
    value, lower, upper = (float(x) for x in np.quantile(values, [q, low_q, high_q]))
    beyond_low = n_effective * math.log1p(-q) > math.log(alpha)
    beyond_high = n_effective * math.log(q) > math.log(alpha)
    caveats = [f"interval from {n_effective:.4g} effective values among {values.size:,}"]
    for beyond, side in ((beyond_low, "lower"), (beyond_high, "upper")):
        if beyond:
            caveats.append(f"too short a record for a bound on the {side} side")
    bounded = not (beyond_low and beyond_high)
    sided: Sided = "two"
    if beyond_low != beyond_high:
        # What is left is one side of the interval, at its own confidence.
        sided, confidence = ("upper" if beyond_low else "lower"), 1 - alpha
    return Estimate(
        value,
        None if beyond_low else min(lower, value),
        None if beyond_high else max(upper, value),
        float(confidence) if bounded else None,
        unit,
        Counted(values.size, hours, "values"),
        sided,
        tuple(caveats),
    )


def _clusters(state: Spans, tau_s: float) -> tuple[int, float, float]:
    """Number of clusters, their effective number, and the tau that their own length implies [s].

    A state whose spans last exponentially with mean D decorrelates with D = sum d^2/(2 sum d).
    """
    merged = state.merged(merge_time_s(tau_s))
    if len(merged) == 0:
        return 0, 0.0, 0.0
    origin = int(merged.start_ns[0])
    edges = np.column_stack([merged.start_ns, merged.end_ns]) - origin
    at = state.until(edges / NS_PER_S, origin)
    held = at[:, 1] - at[:, 0]
    total, squares = float(held.sum()), float((held**2).sum())
    return len(merged), total**2 / squares, squares / (2 * total)


def _span_s(observed: Spans) -> float:
    return float(observed.end_ns[-1] - observed.start_ns[0]) / NS_PER_S


def _bootstrap(
    states: tuple[tuple[Spans, float], ...], observed: Spans, block_s: float, seed: int
) -> Floats:
    """(REPLICATES,) shares of resampled records: sum over blocks of state over observed time.

    Blocks begin anywhere and wrap round the record's end; the time of a state within a block is
    a difference of cumulative sums.
    """
    span, origin = _span_s(observed), int(observed.start_ns[0])
    count = math.ceil(span / block_s)
    places = _PLACES * count
    start = span * np.arange(places) / places

    def within(spans: Spans) -> Floats:
        """(places,) time of the spans within the block that begins at each place."""
        end = start + block_s
        over = np.maximum(end - span, 0.0)
        cut = spans.until(np.minimum(end, span), origin) - spans.until(start, origin)
        return cut + spans.until(over, origin)

    held_there = np.sum([sign * within(spans) for spans, sign in states], axis=0)
    seen_there = within(observed)
    generator = np.random.default_rng(seed)
    parts = []
    rows = max(_CHUNK // count, 1)
    for first in range(0, REPLICATES, rows):
        drawn = (min(rows, REPLICATES - first), count)
        pick = generator.integers(0, places, drawn, dtype=np.int32)
        held, seen = held_there[pick].sum(axis=1), seen_there[pick].sum(axis=1)
        # Blocks that all fall into gaps say nothing.
        parts.append(held[seen > 0] / seen[seen > 0])
    return np.concatenate(parts)


def _widened(alpha: float, n: float) -> tuple[float, float]:
    """Probabilities of percentiles that allow for a variance estimated from n blocks."""
    t = float(special.stdtrit(n - 1, alpha)) * math.sqrt(n / (n - 1))
    low = float(special.ndtr(t))
    return low, 1 - low


def _binomial_limits(k: float, n: float, alpha: float) -> tuple[float, float]:
    """Clopper-Pearson limits of a probability, k of n, not necessarily whole, alpha a side."""
    lower = float(special.betaincinv(k, n - k + 1, alpha)) if k > 0 else 0.0
    upper = float(special.betainccinv(k + 1, n - k, alpha)) if k < n else 1.0
    return lower, upper


def _union(a: Spans, b: Spans) -> Spans:
    """Two sets of spans that do not overlap, as one in order."""
    start = np.concatenate([a.start_ns, b.start_ns])
    order = np.argsort(start, kind="stable")
    return Spans(start[order], np.concatenate([a.end_ns, b.end_ns])[order])
