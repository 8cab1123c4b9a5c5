"""Two Gauss-Markov processes in one autocorrelation: what a mixture is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sbas.integrity.correlation.autocorrelation import Floats

LAGS = 200
"""Lags of the fit, evenly spaced on a log scale."""
FLOOR = 0.1
"""The fit ends at the first lag with r below this: what follows is mostly sampling error."""
GRID = 40


def seconds_text(seconds: float) -> str:
    """Seconds with three digits, never as a power of ten."""
    return f"{seconds:.3g} s" if seconds < 999.5 else f"{float(f'{seconds:.3g}'):.0f} s"


@dataclass(frozen=True)
class TwoProcesses:
    """Sum of two Gauss-Markov processes and white noise.

    Parameters
    ----------
    tau_1_s, tau_2_s : 1/e times, the shorter one first [s].
    share_1, share_2 : their shares of the variance without its white part; their sum is 1.
    nugget : white share of the variance.
    rms : root mean square of r less the fit.
    """

    tau_1_s: float
    tau_2_s: float
    share_1: float
    share_2: float
    nugget: float
    rms: float

    @property
    def tau_short_s(self) -> float:
        """1/sum(share/tau) [s]: the one tau with the hazard of high levels, on the safe side.

        It is -1/r'(0+) of the part without white noise. Source: method page 2.5.
        """
        return 1 / (self.share_1 / self.tau_1_s + self.share_2 / self.tau_2_s)

    def correlation(self, lag_s: Floats) -> Floats:
        """(m,) autocorrelation at lags above 0 [s], the white part taken into account."""
        lag = np.asarray(lag_s, float)
        slow = self.share_2 * np.exp(-lag / self.tau_2_s)
        r: Floats = (1 - self.nugget) * (self.share_1 * np.exp(-lag / self.tau_1_s) + slow)
        return r

    def to_dict(self) -> dict[str, float]:
        return {**vars(self), "tau_short_s": self.tau_short_s}

    def __str__(self) -> str:
        return (
            f"{100 * self.share_1:.3g} % with tau {seconds_text(self.tau_1_s)} and "
            f"{100 * self.share_2:.3g} % with tau {seconds_text(self.tau_2_s)}"
        )


def fit_two_processes(r: Floats, step_s: float) -> TwoProcesses | None:
    """Two exponentials and a white part through an autocorrelation.

    Parameters
    ----------
    r : (m,) autocorrelation from lag 0 on, r(0) = 1.
    step_s : step of the lags [s].

    Returns
    -------
    The least-squares fit; None when fewer than 8 lags lie above the floor or no second
    exponential helps.

    Notes
    -----
    For given taus the amplitudes are linear (and kept at 0 or more): a grid of taus finds the
    valley, a search in ln tau its bottom. Source: Golub and Pereyra 1973, variable projection.
    """
    from scipy.optimize import minimize

    low = np.flatnonzero(~(r >= FLOOR))
    end = int(low[0]) if low.size else r.size
    if end < 8:
        return None
    lags = np.unique(np.geomspace(1, end - 1, LAGS).astype(int))
    t, y = step_s * lags, np.asarray(r, float)[lags]
    taus = np.geomspace(step_s / 2, 3 * t[-1], GRID)

    def loss(log_tau: Floats) -> float:
        return _amplitudes(t, y, np.exp(log_tau))[1]

    pairs = [(math.log(a), math.log(b)) for i, a in enumerate(taus) for b in taus[i + 1 :]]
    begin = np.array(min(pairs, key=lambda pair: loss(np.array(pair))))
    found = minimize(
        loss, begin, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-18, "maxiter": 800}
    )
    tau = np.exp(np.sort(found.x))
    amplitude, squares = _amplitudes(t, y, tau)
    if not (amplitude > 0).all() or not tau[1] > 1.05 * tau[0]:
        return None
    total = float(amplitude.sum())
    share = amplitude / total
    return TwoProcesses(
        float(tau[0]),
        float(tau[1]),
        float(share[0]),
        float(share[1]),
        max(0.0, 1 - total),
        math.sqrt(squares / t.size),
    )


def _amplitudes(t: Floats, y: Floats, tau: Floats) -> tuple[Floats, float]:
    """(2,) least-squares amplitudes, 0 or more, and the sum of squares that they leave."""
    columns = np.exp(-t / tau[:, None])
    gram, right = columns @ columns.T, columns @ y
    determinant = gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2
    if determinant > 1e-12 * gram[0, 0] * gram[1, 1]:
        both = np.array(
            [gram[1, 1] * right[0] - gram[0, 1] * right[1],
             gram[0, 0] * right[1] - gram[0, 1] * right[0]]
        ) / determinant  # fmt: skip
        if (both >= 0).all():
            return both, float(np.sum((y - both @ columns) ** 2))
    single = np.maximum(right / np.diag(gram), 0.0)
    squares = [float(np.sum((y - single[i] * columns[i]) ** 2)) for i in (0, 1)]
    best = int(np.argmin(squares))
    kept = np.zeros(2)
    kept[best] = single[best]
    return kept, squares[best]
