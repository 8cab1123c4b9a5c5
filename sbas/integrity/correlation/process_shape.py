"""Is it one Gauss-Markov process? The shape of an autocorrelation, and how far chance bends it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sbas.integrity.correlation.autocorrelation import Autocorrelation, Floats
from sbas.integrity.correlation.robust_tau import fit_exponentials

EARLY, LATE = (0.95, 0.7), (0.5, 0.25)
MIXTURE_RATIO, MIXTURE_EXPONENT, SMOOTH_EXPONENT = 1.5, 0.75, 1.4
CHANCE = 2.5
"""Standard deviations that are left to chance: 3 of 500 Gauss-Markov records lie beyond."""
COARSE = 0.25
"""A lag above this share of tau tells nothing about short lags: the ratio alone is judged."""
RATIO_SIGMA, EXPONENT_SIGMA, EXPONENT_WHITE_SIGMA = 2.2, 0.54, 1.45
"""Sampling error: ln(late/early) and exponent times sqrt(tau/T), and the exponent's white part.

From 150 simulated Gauss-Markov records each of 25, 50, 100, 200 and 833 tau, with and without
30 % white noise (`benchmarks/decorrelation.py shape`).
"""

Shape = Literal["gm1", "smooth", "mixture"]


@dataclass(frozen=True)
class ProcessShape:
    """Two figures that are 1 and about 0.9 for a Gauss-Markov process; NaN where undefined.

    `amplitude` and `tau_s` of the exponential fit; `exponent_lag_s` is the lag of the exponent.
    """

    late_over_early: float
    short_lag_exponent: float
    amplitude: float
    tau_s: float
    exponent_lag_s: float


def short_lag_exponent(r: Floats, lag: int) -> float:
    """Exponent of the variogram at short lags: near 1 for Gauss-Markov, 2 for a smooth process.

    Parameters
    ----------
    r : (m,) autocorrelation; a white part cancels.
    lag : l [steps], 4 l < m.

    Returns
    -------
    log2[(r(2l) - r(4l))/(r(l) - r(2l))]; -inf where r does not fall at one of these lags, NaN
    where it is not known. Source: method page 3.2; Gneiting, Sevcikova, Percival 2012
    (variogram estimators of the fractal index).
    """
    if 4 * lag >= r.size:
        return math.nan
    near, far = r[lag] - r[2 * lag], r[2 * lag] - r[4 * lag]
    if math.isnan(near) or math.isnan(far):
        return math.nan
    return math.log2(far / near) if near > 0 and far > 0 else -math.inf


def gauss_markov_exponent(x: float) -> float:
    """Short-lag exponent of r(t) = exp(-t/tau) at the lag l with x = exp(-l/tau).

    (x^2 - x^4)/(x - x^2) = x (1 + x): 0.892 at tau/20, 1 in the limit of short lags.
    """
    return math.log2(x * (1 + x))


def late_over_early(r: Floats, amplitude: float) -> float:
    """Ratio of the tau fitted where r/min(A, 1) falls from .5 to .25 to that from .95 to .7.

    1 for a Gauss-Markov process, below for a smooth one, above for a mixture; NaN where the
    record or the white part leaves too few lags. Source: method page 3.2.
    """
    scaled = np.array(r / min(amplitude, 1.0))[None]
    taus = []
    for high, low in (LATE, EARLY):
        fit = fit_exponentials(scaled, 1.0, high=high, low=low, least=2)
        taus.append(float(fit.tau_s[0]))
    return taus[0] / taus[1] if all(map(math.isfinite, taus)) else math.nan


def process_shape(acf: Autocorrelation) -> ProcessShape:
    """Shape of the autocorrelation averaged over components."""
    r = acf.mean
    fit = fit_exponentials(r[None], acf.step_s)
    tau, amplitude = float(fit.tau_s[0]), float(fit.amplitude[0])
    if not math.isfinite(tau):
        return ProcessShape(math.nan, math.nan, math.nan, math.inf, math.nan)
    lag = max(2, round(tau / (20 * acf.step_s)))
    return ProcessShape(
        late_over_early(r, amplitude),
        short_lag_exponent(r, lag),
        amplitude,
        tau,
        lag * acf.step_s,
    )


def shape_verdict(shape: ProcessShape, *, recorded_s: float, step_s: float) -> Shape:
    """Whether a shape is beyond convention and chance for a Gauss-Markov process.

    Parameters
    ----------
    shape : of the record's autocorrelation, without its outliers; a tau that is not finite there,
        though it is with them, is a mixture.
    recorded_s : known time in the record [s].
    step_s : step of the record [s].

    Notes
    -----
    `mixture` from late/early > 1.5 or exponent < 0.75 (or -inf), `smooth` from exponent
    > 1.4 (method page 3.2). A short or noisy record reaches these by chance: the limits are
    moved outward to `CHANCE` standard deviations there.
    """
    if not math.isfinite(shape.tau_s):
        return "mixture"
    share = math.sqrt(shape.tau_s / recorded_s)
    nugget = min(max(0.0, 1 - shape.amplitude), 0.9)
    white = math.sqrt(nugget * (2 - nugget) * step_s / (2 * recorded_s))
    x = math.exp(-shape.exponent_lag_s / shape.tau_s)
    sigma = math.hypot(
        EXPONENT_SIGMA * share, EXPONENT_WHITE_SIGMA * white / ((x - x**2) * (1 - nugget))
    )
    # The limits are meant for a lag of tau/20; a coarse step has only longer ones.
    expected = gauss_markov_exponent(x)
    shift = expected - gauss_markov_exponent(math.exp(-1 / 20))
    least = min(MIXTURE_EXPONENT + shift, expected - CHANCE * sigma)
    most = max(SMOOTH_EXPONENT + shift, expected + CHANCE * sigma)
    steepest = max(math.log(MIXTURE_RATIO), CHANCE * RATIO_SIGMA * share)
    if shape.late_over_early > math.exp(steepest):
        return "mixture"
    if not shape.exponent_lag_s <= COARSE * shape.tau_s:
        return "gm1"
    exponent = shape.short_lag_exponent
    if exponent < least:
        return "mixture"
    return "smooth" if exponent > most else "gm1"
