"""Interval of the decorrelation time: which true values make the observed one unremarkable?

The estimator is simulated on the record's own gaps, step, daily terms and white part, for a
lattice of true values; its quantiles are then read backwards.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbas.integrity.correlation.autocorrelation import LEAST_PAIRS, Bools, Floats, lagged_products
from sbas.integrity.correlation.robust_tau import (
    LEAST_SAMPLES,
    Cleaned,
    block_means,
    fit_exponentials,
    fitting_periods,
    longest_lag,
    regressors,
)
from sbas.integrity.gauss_markov_series import gauss_markov_series

STEPS_PER_TAU = 25
"""The record is averaged to about this many steps a decorrelation time."""
MOST_CELLS, MOST_TAUS = 1 << 16, 2500
"""Records of more cells, or of more decorrelation times, are simulated in stretches of this
length, and the spread scaled."""
STRETCHES = 8
FEW_OUTLIERS = 0.01
"""A smaller share of averages lost to outliers is no gap: records then share a simulation."""
SIMULATED_SAMPLES = 1 << 23
FEWEST, MOST = 340, 4000
"""Simulated records for one true value, within a budget of samples."""
LONGEST_TRUE = 10.0
"""True values up to this many record lengths are tried; beyond, nothing changes any more."""
MOST_THREADS = 4
_NUGGETS = (0.0, 0.1, 0.2, 0.35, 0.5, 0.65)
"""White shares that are simulated; one below 5 % cannot be told from chance."""


@dataclass(frozen=True)
class Design:
    """Everything but tau that the estimator's distribution depends on.

    Parameters
    ----------
    step_s : step of the averaged grid [s].
    cells : length of a simulated record.
    masks : which cells are known, packed bits, one entry a stretch of the record.
    periods_s : daily terms that are taken out [s].
    nugget : white share of the variance on this grid.
    cross : size of the correlation between the two components.
    shrink : spread of the whole record over that of one stretch.
    draws : simulated records for one true value.
    """

    step_s: float
    cells: int
    masks: tuple[bytes, ...]
    periods_s: tuple[float, ...]
    nugget: float
    cross: float
    shrink: float = 1.0
    draws: int = FEWEST

    @property
    def length_s(self) -> float:
        return self.cells * self.step_s

    def mask(self, stretch: int) -> Bools:
        """(cells,) True where known."""
        packed = np.frombuffer(self.masks[stretch], np.uint8)
        return np.unpackbits(packed, count=self.cells).astype(bool)


@dataclass(frozen=True)
class TauInterval:
    """What the simulated distribution says; None is "not bounded by this record" [s].

    `value_s` is the true value under which the observed one is the median; `simulated` counts
    the records behind it, `step_s` is the grid they were simulated on.
    """

    value_s: float | None
    low_s: float | None
    high_s: float | None
    observed_s: float | None
    simulated: int
    step_s: float


def averaging(tau_s: float, step_s: float) -> int:
    """Cells to average so that about `STEPS_PER_TAU` remain: 1, 2, 3, 4, 6, 8, 12, ..."""
    most = tau_s / (STEPS_PER_TAU * step_s)
    choices = [f << k for k in range(40) for f in (2, 3)]
    return max([1, *(c for c in choices if c <= most)])


def tau_interval(
    cleaned: Cleaned, step_s: float, *, pilot_s: float, confidence: float = 0.95
) -> TauInterval:
    """Median-unbiased decorrelation time and its two-sided interval.

    Parameters
    ----------
    cleaned : errors of `sbas.integrity.correlation.robust_tau.clean`, two components.
    step_s : step of their grid [s].
    pilot_s : robust fit on that grid, or the longest lag if r never falls to the floor [s].
    confidence : of the interval.

    Notes
    -----
    The interval holds every tau under which the observed estimate lies between the quantiles
    (1 -+ confidence)/2 of the estimator (moved outward by one standard error of the simulation);
    it is never narrower than the Gauss-Markov bound exp(+-z sqrt(2 tau/T)).
    Source: Neyman 1937 (inversion); method page 3.2.
    """
    every = averaging(pilot_s, step_s)
    means, recorded = block_means(cleaned, every)
    while every > 1 and 2 * every * recorded.sum() < cleaned.samples:
        # So sparse a record leaves few blocks half full: shorter ones keep more of it.
        every = max(every // 2, 1)
        means, recorded = block_means(cleaned, every)
    observed, nugget = _observe(means, every * step_s)
    known = np.isfinite(means[0])
    if known.sum() >= (1 - FEW_OUTLIERS) * recorded.sum():
        known = recorded
    design = _design(known, every * step_s, cleaned, nugget, pilot_s)
    known_s = cleaned.samples * step_s
    simulated_s = design.step_s * float(design.mask(0).sum())
    lattice = _lattice(pilot_s / min(simulated_s, known_s))
    value, low, high, nodes = _invert(observed, design, lattice, confidence, known_s)
    if value is not None:
        least = _normal_quantile(confidence) * math.sqrt(2 * value / known_s)
        low = None if low is None else min(low, value * math.exp(-least))
        high = None if high is None else max(high, value * math.exp(least))
    seen = observed if math.isfinite(observed) else None
    return TauInterval(value, low, high, seen, nodes * design.draws, design.step_s)


def _normal_quantile(confidence: float) -> float:
    from scipy.special import ndtri

    return float(-ndtri((1 - confidence) / 2))


def _observe(means: NDArray[np.float32], step_s: float) -> tuple[float, float]:
    """The statistic on the averaged grid, and the white share there."""
    known = np.isfinite(means[0])
    centred = means - means[:, known].mean(axis=1, keepdims=True)
    centred[:, ~known] = 0.0
    lags = longest_lag(known.size, step_s)
    _, pairs = lagged_products(np.where(known, 1.0, np.nan)[None], lags)
    fit = fit_exponentials(_mean_correlation(centred[:, None], pairs), step_s)
    nugget = max(0.0, 1 - float(fit.amplitude[0])) if np.isfinite(fit.tau_s[0]) else 0.0
    return float(fit.tau_s[0]), nugget


def _design(known: Bools, step_s: float, cleaned: Cleaned, nugget: float, pilot_s: float) -> Design:
    cells = min(known.size, MOST_CELLS, max(int(MOST_TAUS * pilot_s / step_s), LEAST_SAMPLES))
    count = STRETCHES if known.size > cells else 1
    starts = np.linspace(0, known.size - cells, count).astype(int)
    parts = [known[s : s + cells] for s in starts.tolist()]
    fullest = max(p.sum() for p in parts)
    parts = [p for p in parts if 2 * p.sum() >= fullest]
    # Nearly the same records share one simulation: the quantiles hardly hang on these two.
    near = min(_NUGGETS, key=lambda w: abs(w - nugget))
    share = float(np.mean([p.sum() for p in parts])) / known.sum()
    return Design(
        step_s,
        cells,
        tuple(np.packbits(p).tobytes() for p in parts),
        cleaned.periods_s if count == 1 else fitting_periods(cells * step_s),
        near,
        round(abs(cleaned.cross) * 5) / 5,
        math.sqrt(min(share, 1.0)),
        int(np.clip(SIMULATED_SAMPLES // cells, FEWEST, MOST)),
    )


def _lattice(tau_over_length: float) -> float:
    """Step of ln tau between simulated values: about a standard deviation of the estimate."""
    sigma = math.sqrt(2 * min(tau_over_length, 1.0))
    return float(min(2.0 ** (round(2 * math.log2(1.4 * sigma)) / 2), 0.5))


def _invert(
    observed: float, design: Design, lattice: float, confidence: float, known_s: float
) -> tuple[float | None, float | None, float | None, int]:
    """Where the quantile curves of ln(estimate) over ln(tau) pass the observed one."""
    # A fit to a fall within one lag can give 0: below half a step nothing is told apart.
    log_observed = math.log(observed or design.step_s / 2) if math.isfinite(observed) else math.inf
    tail = (1 - confidence) / 2
    # A quantile of so many draws has an error of its own: it is moved outward by one sigma of it.
    tail = max(tail - math.sqrt(tail * (1 - tail) / design.draws), 0.0)
    start = round(min(log_observed, math.log(design.length_s)) / lattice)
    least = math.ceil(math.log(design.step_s / 2) / lattice)
    most = math.floor(math.log(LONGEST_TRUE * known_s) / lattice)
    _setups(design)  # once, before several threads ask for it
    running: dict[int, Future[Floats]] = {}

    def quantiles(j: int) -> Floats:
        drawn = running[j].result()
        q = np.quantile(drawn, [tail, 0.5, 1 - tail], method="inverted_cdf")
        if design.shrink < 1 and math.isfinite(q[1]):
            # A spread falls with the root of the length, a bias with the length.
            true = j * lattice
            q = true + (q[1] - true) * design.shrink**2 + (q - q[1]) * design.shrink
        return np.asarray(q)

    def too_high(j: int) -> bool:
        return j > least and not log_observed > quantiles(j)[2]

    def too_low(j: int) -> bool:
        return j < most and not log_observed < quantiles(j)[0]

    with ThreadPoolExecutor(min(os.cpu_count() or 1, MOST_THREADS)) as pool:

        def ask(j: int) -> None:
            running[j] = pool.submit(simulated_estimates, design, round(j * lattice, 12))

        # Nodes are about a standard deviation apart: two on either side will be needed, and the
        # outer ones, asked first, say whether a third is.
        lowest, highest = max(start - 2, min(least, start)), min(start + 2, max(most, start))
        for j in sorted(range(lowest, highest + 1), key=lambda j: -abs(j - start)):
            ask(j)
        further = True
        while further:
            further = False
            if too_high(lowest):
                lowest, further = lowest - 1, True
                ask(lowest)
            if too_low(highest):
                highest, further = highest + 1, True
                ask(highest)
    first = last = start
    while too_high(first):
        first -= 1
    while too_low(last):
        last += 1
    nodes = range(first, last + 1)
    q = np.array([quantiles(j) for j in nodes])
    at = np.array(nodes) * lattice
    low = _crossing(at, log_observed, q[:, 2], from_above=False)
    value = _crossing(at, log_observed, q[:, 1], from_above=False)
    high = _crossing(at, log_observed, q[:, 0], from_above=True)
    return value, low, high, len(nodes)


def _crossing(at: Floats, level: float, curve: Floats, *, from_above: bool) -> float | None:
    """exp of the abscissa where a rising curve passes the level, or None if it never does.

    Of several crossings the first, or the last if `from_above`; beside an infinite value of the
    curve the node on the outer side.
    """
    passed = curve >= level if not from_above else curve > level
    rises = np.flatnonzero(~passed[:-1] & passed[1:])
    if rises.size == 0:
        return None
    j = int(rises[-1 if from_above else 0])
    a, b = curve[j], curve[j + 1]
    if not (math.isfinite(a) and math.isfinite(b)):
        return float(math.exp(at[j + 1] if from_above else at[j]))
    return float(math.exp(at[j] + (level - a) / (b - a) * (at[j + 1] - at[j])))


@lru_cache(maxsize=512)
def simulated_estimates(design: Design, log_tau: float) -> Floats:
    """Logarithms of the estimates from simulated records of one true tau, in rising order.

    Parameters
    ----------
    design : gaps, step, white part and daily terms of the record.
    log_tau : ln of the true 1/e time [s].

    Returns
    -------
    (draws,) ln(tau) by the estimator of `fit_exponentials`; inf where r never falls to the
    floor, -inf where it falls there within one lag. The same design and tau give the same numbers.

    Notes
    -----
    Two Gauss-Markov components of correlation `cross`, a white part, gaps, least-squares drift
    and daily terms. Clipping is left out: at 4 sigma it touches 6e-5 of Gauss errors.
    """
    generator = np.random.default_rng([20090919, abs(round(1e6 * log_tau)), design.cells])
    tau = math.exp(log_tau)
    rho = math.exp(-design.step_s / tau)
    innovation = math.sqrt(-math.expm1(-2 * design.step_s / tau))
    draws, n = design.draws, design.cells
    rows = max(1, (1 << 19) // n)
    estimates = []
    setups = _setups(design)
    for batch, done in enumerate(range(0, draws, rows)):
        known, projection, pairs = setups[batch % len(setups)]
        count = min(rows, draws - done)
        noise = generator.standard_normal((2, count, n), dtype=np.float32)
        noise[:, :, 1:] *= innovation
        x = gauss_markov_series(noise, rho)
        if design.cross:
            x[1] *= math.sqrt(1 - design.cross**2)
            x[1] += design.cross * x[0]
        if design.nugget:
            generator.standard_normal(dtype=np.float32, out=noise)
            noise *= math.sqrt(design.nugget)
            x *= math.sqrt(1 - design.nugget)
            x += noise
        if not known.all():
            x *= known
        flat = x.reshape(2 * count, n)
        # Not by @: the threads of a BLAS library wait busily, on the cores of the other nodes.
        shares = np.einsum("bn,jn->bj", flat, projection)
        flat -= np.einsum("bj,jn->bn", shares, projection)
        estimates.append(fit_exponentials(_mean_correlation(x, pairs), design.step_s).tau_s)
    with np.errstate(divide="ignore"):
        return np.sort(np.log(np.concatenate(estimates)))


@lru_cache(maxsize=2)
def _setups(
    design: Design,
) -> tuple[tuple[Bools, NDArray[np.float32], NDArray[np.int64]], ...]:
    """Of each stretch: known cells, orthonormal regressors (0 where missing) and pairs."""
    # Only the fall to the fit's floor is read: longer lags matter where it comes late.
    lags = longest_lag(design.cells, design.step_s)
    setups = []
    for stretch in range(len(design.masks)):
        known = design.mask(stretch)
        rows = regressors(
            np.arange(known.size),
            cells=known.size,
            step_s=design.step_s,
            periods_s=design.periods_s,
        )
        basis, sizes, _ = np.linalg.svd((rows * known).T.astype(float), full_matrices=False)
        basis = basis[:, sizes > 1e-5 * sizes[0]]
        _, pairs = lagged_products(np.where(known, 1.0, np.nan)[None], lags)
        setups.append((known, np.ascontiguousarray(basis.T, np.float32), pairs))
    return tuple(setups)


def _mean_correlation(x: NDArray[np.floating[Any]], pairs: NDArray[np.int64]) -> Floats:
    """(b, m) autocorrelation averaged over components from (k, b, n) samples, 0 where missing."""
    from scipy.fft import irfft, next_fast_len, rfft

    n, lags = x.shape[2], pairs.size - 1
    size = next_fast_len(n + lags, real=True)
    spectrum = np.zeros((x.shape[1], size // 2 + 1), np.float32)
    for component in x:
        transformed = rfft(component, size)
        transformed /= np.sqrt(np.einsum("bn,bn->b", component, component))[:, None]
        parts = transformed.view(spectrum.dtype)
        np.square(parts, out=parts)
        spectrum += parts[:, ::2]
        spectrum += parts[:, 1::2]
    enough = pairs >= max(LEAST_PAIRS * pairs[0], 1)
    scale = pairs[0] / (x.shape[0] * np.where(enough, pairs, 1))
    products = irfft(spectrum, size)[:, : lags + 1]
    return np.where(enough, products * scale, np.nan)
