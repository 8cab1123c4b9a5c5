"""Autocorrelation of series with gaps, in blocks, so that a year at 1 Hz needs little memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

BLOCK = 1 << 18
"""Cells that one Fourier transform takes."""
LEAST_PAIRS = 0.1
"""A lag with fewer pairs than this share of the samples has no autocorrelation."""


@dataclass(frozen=True, eq=False)
class Autocorrelation:
    """Normalised autocorrelation of components that are missing together.

    Parameters
    ----------
    step_s : lag between successive entries [s].
    components : (k, m + 1) r of each component at lags 0..m; NaN where pairs are too few.
    pairs : (m + 1,) pairs of samples behind each lag.
    """

    step_s: float
    components: Floats
    pairs: NDArray[np.int64]

    @property
    def mean(self) -> Floats:
        """(m + 1,) average over the components."""
        average: Floats = self.components.mean(axis=0)
        return average

    @property
    def lag_s(self) -> Floats:
        """(m + 1,) lags [s]."""
        lags: Floats = self.step_s * np.arange(self.pairs.size, dtype=float)
        return lags


def autocorrelation(
    values: NDArray[np.floating[Any]],
    *,
    step_s: float,
    max_lag: int,
    leave_out: Bools | None = None,
    block: int = BLOCK,
) -> Autocorrelation:
    """Autocorrelation r(l) = c(l)/c(0) of series with gaps.

    Parameters
    ----------
    values : (k, n) samples on a regular grid, mean removed, NaN (in all components) if missing.
    step_s : step of the grid [s].
    max_lag : largest lag [cells], below n.
    leave_out : (n,) True for samples to be taken as missing too.
    block : cells of one Fourier transform.

    Notes
    -----
    c(l) = sum m m' x x' / sum m m' over all cells l apart, with m = 1 where a sample is known.
    Source: Parzen 1963, "On spectral analysis with missing observations", Sankhya A 25.
    """
    products, pairs = lagged_products(values, max_lag, leave_out=leave_out, block=block)
    enough = pairs >= max(LEAST_PAIRS * pairs[0], 1)
    covariance = products / np.where(enough, pairs, 1)
    r = np.where(enough, covariance / covariance[:, :1], np.nan)
    return Autocorrelation(step_s, r, pairs)


def lagged_products(
    values: NDArray[np.floating[Any]],
    max_lag: int,
    *,
    leave_out: Bools | None = None,
    block: int = BLOCK,
) -> tuple[Floats, NDArray[np.int64]]:
    """Sums of products l cells apart, and how many pairs each sum has.

    Parameters
    ----------
    values, leave_out, block : as for `autocorrelation`.
    max_lag : largest lag [cells], below n.

    Returns
    -------
    (k, max_lag + 1) sums over the pairs of which both samples are known; (max_lag + 1,) pairs.

    Notes
    -----
    A stretch of `size - max_lag` cells is correlated with itself and the `max_lag` cells that
    follow: no product wraps round, every pair is counted in the one stretch where it begins,
    so that spectra add up and one inverse transform ends it.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    k, n = values.shape
    if n + max_lag <= block:
        size = stretch = next_fast_len(n + max_lag, real=True)
    else:
        size = max(block, 1 << int(np.ceil(np.log2(4 * max_lag + 1))))
        stretch = size - max_lag
    complete = leave_out is None and bool(np.isfinite(values[0]).all())
    spectra = np.zeros((k, size // 2 + 1), complex)
    mask_spectrum = np.zeros(size // 2 + 1, complex)
    for start in range(0, n, stretch):
        piece = np.array(values[:, start : start + size], dtype=float)
        known = np.isfinite(piece[0])
        if leave_out is not None:
            known &= ~leave_out[start : start + size]
        piece[:, ~known] = 0.0
        spectra += rfft(piece[:, :stretch], size).conj() * rfft(piece, size)
        if not complete:
            mask = known.astype(float)
            mask_spectrum += rfft(mask[:stretch], size).conj() * rfft(mask, size)
    products: Floats = irfft(spectra, size)[:, : max_lag + 1]
    if complete:
        return products, n - np.arange(max_lag + 1)
    return products, np.rint(irfft(mask_spectrum, size)[: max_lag + 1]).astype(np.int64)


def bartlett_sigma(lag_s: Floats, *, tau_s: float, length_s: float) -> Floats:
    """1-sigma of the sample autocorrelation of a Gauss-Markov process at given lags [1].

    Parameters
    ----------
    lag_s : (m,) lags [s].
    tau_s : 1/e time [s].
    length_s : length of the record, far longer than tau [s].

    Notes
    -----
    With x = lag/tau: variance (tau/T) (1 - exp(-2x) - 2x exp(-2x)), the continuous limit of
    Bartlett's formula for AR(1). Source: Bartlett 1946; Brockwell and Davis, "Time Series:
    Theory and Methods", 2nd ed., example 7.2.3.
    """
    from scipy.special import gammainc  # gammainc(2, 2x) is the bracket, without cancellation

    x = np.asarray(lag_s, float) / tau_s
    sigma: Floats = np.sqrt(tau_s / length_s * gammainc(2.0, 2 * x))
    return sigma
