"""Simulated Gauss-Markov series, summed in blocks: as fast as a filter, and light to load."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

_FALL = 4.0
"""A block spans this many 1/e times: its weights lie within a factor of exp(4)."""

_SHORTEST = 16
_NEGLIGIBLE = 1e-20
"""Weight below which an older term cannot change a value of order one."""


def gauss_markov_series(
    noise: NDArray[np.floating[Any]], correlation: float
) -> NDArray[np.floating[Any]]:
    """x_i = correlation x_(i-1) + noise_i along the last axis, x_0 = noise_0.

    Parameters
    ----------
    noise : (..., n) innovations; for a stationary series of unit variance those from the second
        on have variance 1 - correlation^2.
    correlation : of successive samples, in (0, 1).

    Returns
    -------
    (..., n) of the same type, right to about its last digits.

    Notes
    -----
    Within a block x_i = c^i sum_j noise_j c^-j + c^(i+1) x_before, c the correlation. Where c
    forgets within few steps, by doubling: after pass j each value holds its last 2^j terms.
    """
    n = noise.shape[-1]
    block = min(n, math.floor(-_FALL / math.log(correlation)))
    if block < _SHORTEST:
        return _doubled(noise.copy(), correlation)
    count = -(-n // block)
    x = np.zeros((*noise.shape[:-1], count * block), noise.dtype)
    x[..., :n] = noise
    x = x.reshape(*noise.shape[:-1], count, block)
    weight = correlation ** np.arange(block)
    x /= weight.astype(noise.dtype)
    np.cumsum(x, axis=-1, out=x)
    x *= weight.astype(noise.dtype)
    before = np.zeros((*noise.shape[:-1], count), noise.dtype)
    whole = noise.dtype.type(correlation**block)
    for i in range(1, count):
        before[..., i] = x[..., i - 1, -1] + whole * before[..., i - 1]
    x += before[..., None] * (correlation * weight).astype(noise.dtype)
    return np.ascontiguousarray(x.reshape(*noise.shape[:-1], count * block)[..., :n])


def _doubled(x: NDArray[np.floating[Any]], weight: float) -> NDArray[np.floating[Any]]:
    step = 1
    while step < x.shape[-1] and weight > _NEGLIGIBLE:
        x[..., step:] += x.dtype.type(weight) * x[..., :-step]
        step, weight = 2 * step, weight * weight
    return x
