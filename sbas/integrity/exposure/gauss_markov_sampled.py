"""Exact risk of a first-order Gauss-Markov error sampled at an interval, with or without nugget.

The norm of a Gauss-Markov error is a Markov chain whose density is propagated on a quadrature
grid: every number that is added or multiplied is positive, so that a risk of 1e-30 keeps the
digits of a risk of 0.5. The chain is reversible; written with the root of its stationary density
the kernel is symmetric and reaches only a few steps far, so that a band of it is enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.linalg import blas

from sbas.exceptions import InputError
from sbas.integrity.exposure.exposure import MIN_K, Exposure, per_sample_risk, require, require_dim
from sbas.integrity.exposure.gauss_markov import siegmund_risk
from sbas.integrity.k_factors import exceedance

Floats = NDArray[np.float64]

MAX_QUADRATURE_K = 20.0
MAX_SAMPLES_PER_TAU = 40_000
"""Denser sampling would take more than 5 s for one risk; `siegmund_risk` serves there."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
# 16 nodes integrate a Gaussian of standard deviation s over 6 s to 3e-14 of its total.
_PANEL = 6.0
# Gaussian factors below exp(-8.6^2/2) = 1e-16 of the largest are rounding.
_REACH = 8.6
# Panels of a tail integral, in steps from the wall: graded, for tails that fall within a step.
_TAIL_EDGES = np.array([0, 0.125, 0.25, 0.5, 1, 2, 4, 8, 12])
# The exit rates' distance from their limit, relative, at which the geometric tail takes over.
_SETTLED = 1e-9


@dataclass(frozen=True)
class _Chain:
    """A killed chain: at step i it loses exit @ (matrix^i @ start), i = 0, 1, ...

    The matrix is symmetric, stored as its lower band; `start @ start` type products with the
    propagated vector give the survival.
    """

    band: Floats
    start: Floats
    exit: Floats

    def propagate(self, vector: Floats) -> Floats:
        moved: Floats = blas.dsbmv(self.band.shape[0] - 1, 1.0, self.band, vector, lower=1)
        return moved


def sampled_risk(
    k: float, *, correlation: float, samples: int, dim: int = 2, nugget: float = 0.0
) -> float:
    """Probability that a sampled Gauss-Markov error exceeds K sigma at least once.

    Parameters
    ----------
    k : K factor, 1e-3 to 20.
    correlation : of the slow part at successive samples, exp(-dt/tau), in [0, exp(-1/40000)].
    samples : number of samples in the exposure, at least 1; N samples are N - 1 steps.
    dim : number of components, 1 (two-sided) to 3.
    nugget : share of the variance that is white, in [0, 0.99].

    Returns
    -------
    float [1], relative error below 1e-8.

    Raises
    ------
    InputError : an argument out of range.

    Notes
    -----
    P = p + sum of the exits at steps 1 to N - 1. Without nugget the wall is hard: the density
    lives on [0, K], and an exit is the integral of the transition density beyond K. With a
    nugget the wall is soft: in units of the slow sigma a sample at x is lost with
    g(x) = P(|x + white| > K/sqrt(1 - w)). The exits are a completely monotone sequence (the chain
    is reversible): once their decay per step has settled, the rest is a geometric series.

    References
    ----------
    Transition density of the norm: noncentral chi (Johnson, Kotz, Balakrishnan 1995, chapter
    29), for dim = 2 the Rice density.

    Examples
    --------
    >>> risk = sampled_risk(6.182851757, correlation=math.exp(-1 / 360), samples=3600)
    >>> round(risk / 5e-9, 1)
    281.6
    """
    _require_process(k, correlation, dim, nugget)
    if isinstance(samples, bool) or not isinstance(samples, int | np.integer) or samples < 1:
        raise InputError(
            "samples is a whole number from 1 on", where="samples", evidence=repr(samples)[:80]
        )
    p = exceedance(float(k), distribution="chi", dim=dim)
    if samples == 1:
        return p
    chain = _chain(k, correlation, dim, nugget)
    return min(1.0, p + _total_exits(chain, int(samples) - 1, _block(correlation)))


def extremal_index(k: float, *, correlation: float, dim: int = 2, nugget: float = 0.0) -> float:
    """Extremal index of a sampled Gauss-Markov error at the level K.

    Parameters
    ----------
    k, correlation, dim, nugget : as in `sampled_risk`.

    Returns
    -------
    float [1]: theta = (exit per step, given survival so far) / p, in the long run; the hazard is
    theta p/dt, and 1/theta the mean number of exceedances in a cluster.

    Raises
    ------
    InputError : an argument out of range.

    References
    ----------
    Leadbetter 1983, Z. Wahrscheinlichkeitstheorie verw. Gebiete 65, 291.
    """
    _require_process(k, correlation, dim, nugget)
    from scipy.linalg import cho_solve_banded, cholesky_banded

    chain = _chain(k, correlation, dim, nugget)
    # (1 + shift) I - matrix is a Stieltjes matrix: its factors and solutions are sums of terms of
    # one sign, right in every entry. The shift is small against the gap of the spectrum.
    resolvent = -chain.band
    resolvent[0] += 1 + 1e-3 * (1 - correlation) * (1 + correlation)
    factor = cholesky_banded(resolvent, lower=True, check_finite=False)
    vector, hazard = chain.start, math.inf
    while True:
        before = hazard
        # The step settles low levels, where little survives it; the resolvent high ones.
        vector = cho_solve_banded((factor, True), chain.propagate(vector), check_finite=False)
        vector /= float(vector.max())
        hazard = float(chain.exit @ vector) / float(chain.start @ vector)
        if abs(before - hazard) <= _SETTLED * hazard:
            return hazard / exceedance(float(k), distribution="chi", dim=dim)


def ar1_risk(k: float, exposure: Exposure) -> float:
    """Risk of an exposure of a sampled Gauss-Markov error: the default model.

    Parameters
    ----------
    k : K factor, 1e-3 to 20.
    exposure : all but `nugget` count.

    Returns
    -------
    float [1]. Equal axes: exact (`sampled_risk`). An axis ratio below 1: the asymptotic form
    (`siegmund_risk`), what it adds to the risk of one sample being corrected by the factor that
    makes it exact for equal axes; for K >= 3.

    Raises
    ------
    InputError : K out of range, or more than 40000 samples per tau.
    """
    circle = replace(exposure, axis_ratio=1.0)
    exact = _exact_risk(k, circle, nugget=0.0)
    if exposure.axis_ratio == 1:
        return exact
    p, p_circle = per_sample_risk(k, exposure), per_sample_risk(k, circle)
    if exposure.samples == 1:
        return p
    factor = (exact - p_circle) / (siegmund_risk(k, circle) - p_circle)
    return p + (siegmund_risk(k, exposure) - p) * factor


def nugget_risk(k: float, exposure: Exposure) -> float:
    """Risk of an exposure of a sampled Gauss-Markov error with white noise on top, exact.

    Parameters
    ----------
    k : K factor, 1e-3 to 20.
    exposure : all counts; equal axes only, which are the safe side for an ellipse.

    Returns
    -------
    float [1].

    Raises
    ------
    InputError : K out of range, more than 40000 samples per tau, or an axis ratio below 1.
    """
    if exposure.axis_ratio < 1:
        raise InputError(
            "a nugget is computed for equal axes only",
            where="axis_ratio",
            evidence=f"axis_ratio = {exposure.axis_ratio:g}, nugget = {exposure.nugget:g}",
            cure="leave axis_ratio at 1, the safe side of every ellipse",
        )
    return _exact_risk(k, exposure, nugget=exposure.nugget)


def _exact_risk(k: float, exposure: Exposure, *, nugget: float) -> float:
    if exposure.tau_s > MAX_SAMPLES_PER_TAU * exposure.interval_s:
        raise InputError(
            f"more than {MAX_SAMPLES_PER_TAU} samples per tau are not computed exactly",
            where="interval_s",
            evidence=f"tau_s = {exposure.tau_s:g}, interval_s = {exposure.interval_s:g}",
            cure="without a nugget, the K at an interval of tau/20000 is less than 0.01 lower",
        )
    return sampled_risk(
        k,
        correlation=exposure.correlation,
        samples=exposure.samples,
        dim=exposure.dim,
        nugget=nugget,
    )


def _require_process(k: Any, correlation: Any, dim: Any, nugget: Any) -> None:
    require("k", k, least=MIN_K, most=MAX_QUADRATURE_K)
    require("correlation", correlation, least=0, most=math.exp(-1 / MAX_SAMPLES_PER_TAU))
    require_dim(dim)
    require("nugget", nugget, least=0, most=0.99)


# --- the sum of the exits ---------------------------------------------------------------------


def _block(correlation: float) -> int:
    """Steps in half a decorrelation time, at least 1."""
    return 1 if correlation <= math.exp(-1) else max(1, round(-0.5 / math.log(correlation)))


def _total_exits(chain: _Chain, steps: int, block: int) -> float:
    """Sum of the exits of the first `steps` steps, the settled tail as a geometric series."""
    vector, total = chain.start, 0.0
    exit_before, decay_before = math.inf, math.inf
    done = 0
    while done < steps:
        for _ in range(min(block, steps - done)):
            exit_now = float(chain.exit @ vector)
            total += exit_now
            vector = chain.propagate(vector)
        done += block
        if exit_now == 0:  # everything has been lost
            return total
        decay = math.log(exit_before / exit_now) if math.isfinite(exit_before) else math.inf
        if abs(decay_before - decay) <= _SETTLED:
            return total + exit_now * _geometric_sum(max(decay, 0.0) / block, steps - done)
        exit_before, decay_before = exit_now, decay
    return total


def _geometric_sum(decay: float, terms: int) -> float:
    """exp(-d) + exp(-2d) + ... over the given number of terms."""
    if terms <= 0 or decay == 0:
        return float(max(terms, 0))
    return math.exp(-decay) * math.expm1(-decay * terms) / math.expm1(-decay)


# --- the chain on a grid ----------------------------------------------------------------------


def _chain(k: float, correlation: float, dim: int, nugget: float) -> _Chain:
    step = math.sqrt((1 - correlation) * (1 + correlation))
    if nugget == 0:
        x, w = _grid(np.linspace(0, k, max(1, math.ceil(k / (_PANEL * step))) + 1))
        start = np.sqrt(w) * _root_density(x, dim)
        lost = _beyond(correlation * x, k, step, dim)
        return _Chain(_kernel_band(x, w, correlation, step, k, dim), start, start * lost)
    wall = k / math.sqrt(1 - nugget)
    white = math.sqrt(nugget / (1 - nugget))
    # Beyond, x is lost at once or takes no part: given an exceedance of K, the slow part lies
    # below this with all but exp(-36) of the chances.
    top = min(
        wall + _REACH * (step + white),
        math.sqrt((k * k + 72) * (1 - nugget)) + 9 * math.sqrt(nugget),
    )
    x, w = _grid(_soft_edges(wall, top, step, white))
    lost = _beyond(x, wall, white, dim)
    kept = np.where(lost < 0.5, 1 - lost, _within(x, wall, white, dim))
    root_kept = np.sqrt(kept)
    stationary = np.sqrt(w) * _root_density(x, dim)
    hard = _Chain(_kernel_band(x, w, correlation, step, top, dim), stationary, stationary * lost)
    band = hard.band * root_kept
    for offset in range(band.shape[0]):
        band[offset, : x.size - offset] *= root_kept[offset:]
    return _Chain(
        np.asfortranarray(band), root_kept * stationary, root_kept * hard.propagate(hard.exit)
    )


def _grid(edges: Floats) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights of the panels between edges, joined."""
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + _NODES)).ravel(), (half * _WEIGHTS).ravel()


def _soft_edges(wall: float, top: float, step: float, white: float) -> Floats:
    """Panel edges on [0, top] that resolve the kernel and, around the wall, the white noise."""
    near = [max(0.0, wall - _REACH * white), min(top, wall + _REACH * white)]
    fine = _PANEL * min(step, white)
    edges = [0.0]
    for end, width in ((near[0], _PANEL * step), (near[1], fine), (top, _PANEL * step)):
        length = end - edges[-1]
        if length > 1e-12 * top:
            panels = math.ceil(length / width)
            edges += list(np.linspace(edges[-1], end, panels + 1)[1:])
    return np.asarray(edges)


def _root_density(x: Floats, dim: int) -> Floats:
    """Root of the chi density."""
    log_norm = (dim / 2 - 1) * math.log(2) + math.lgamma(dim / 2)
    density: Floats = np.exp((dim - 1) / 2 * np.log(x) - x * x / 4 - log_norm / 2)
    return density


def _kernel_band(
    x: Floats, w: Floats, correlation: float, step: float, top: float, dim: int
) -> Floats:
    """Lower band of sqrt(w_i w_j) k(x_i|x_j) sqrt(f(x_j)/f(x_i)), f the stationary density.

    With z = r x y/s^2 the symmetric kernel is the Gaussian part
    exp(-(1 + r^2)(x - y)^2/(4 s^2) - (1 - r)^2 x y/(2 s^2)) times `_angular`/s. Its exponent has
    no positive term, hence no cancellation.
    """
    # The propagated vector grows towards lower x by at most exp(top s/2) per step s.
    reach = (_REACH + top * step) * step
    width = int(np.max(np.searchsorted(x, x + reach) - np.arange(x.size)))
    offset = np.arange(min(width, x.size))[:, None]
    column = np.arange(x.size)
    row = np.minimum(column + offset, x.size - 1)
    y = x[row]
    gauss = (1 + correlation**2) * (x - y) ** 2 / 4 + (1 - correlation) ** 2 * x * y / 2
    band = np.exp(-gauss / step**2) * _angular(x, y, correlation, step, dim) / step
    band *= np.sqrt(w * w[row])
    band[column + offset >= x.size] = 0.0
    return np.asfortranarray(band)


def _angular(x: Floats, y: Floats, shrink: float, step: float, dim: int) -> Floats:
    """(xy)^((dim-1)/2) (r xy)^(1-dim/2) e^-z I_(dim/2-1)(z), suitably scaled; z = r x y/s^2.

    Shared by the kernel and the transition density: the part of a Gaussian step that its
    directions leave over. dim = 1: (1 + e^-2z)/sqrt(2 pi).
    """
    u = x * y / step**2
    if dim == 1:
        return np.asarray((1 + np.exp(-2 * shrink * u)) / math.sqrt(2 * math.pi))
    if dim == 2:
        return np.asarray(np.sqrt(u) * special.i0e(shrink * u))
    # (1 - e^-2z)/r, at r = 0 too.
    return np.asarray(2 * u * special.exprel(-2 * shrink * u) / math.sqrt(2 * math.pi))


def _step_density(y: Floats, mean: Floats, sigma: float, dim: int) -> Floats:
    """Density at y of the norm of a Gaussian vector with the given norm of mean, sigma an axis."""
    gauss = np.exp(-(((y - mean) / sigma) ** 2) / 2) / sigma
    if dim == 1:
        return np.asarray(gauss * _angular(mean, y, 1.0, sigma, 1))
    if dim == 2:
        return np.asarray(gauss * y / sigma * special.i0e(mean * y / sigma**2))
    u = y / sigma
    ratio = 2 * u * u * special.exprel(-2 * mean * y / sigma**2) / math.sqrt(2 * math.pi)
    return np.asarray(gauss * ratio)


def _beyond(mean: Floats, wall: float, sigma: float, dim: int) -> Floats:
    """P(norm > wall) for a Gaussian vector with each of the given norms of mean."""
    if dim == 1:
        return np.asarray(
            special.ndtr((mean - wall) / sigma) + special.ndtr(-(mean + wall) / sigma)
        )
    # Where the mean lies beyond the wall, up to 10 sigma of it are integrated as well.
    over = np.clip((mean - wall) / sigma, 0, 10)[:, None]
    y, w = _grid(_TAIL_EDGES)
    far = _step_density(wall + sigma * (over + y), mean[:, None], sigma, dim) @ w
    y, w = _grid(np.linspace(0, 1, 5))
    near = over[:, 0] * (_step_density(wall + sigma * over * y, mean[:, None], sigma, dim) @ w)
    tail: Floats = np.where(mean > wall + 10 * sigma, 1.0, np.minimum(1, sigma * (near + far)))
    return tail


def _within(mean: Floats, wall: float, sigma: float, dim: int) -> Floats:
    """P(norm <= wall), for means of about the wall or beyond."""
    edges = np.minimum(_TAIL_EDGES * sigma, wall)
    y, w = _grid(edges)
    inside: Floats = _step_density(wall - y, mean[:, None], sigma, dim) @ w
    return np.minimum(1, inside)
