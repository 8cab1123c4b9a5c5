"""Random processes whose digits do not depend on how a record is cut into pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_NEGLIGIBLE = 1e-20
"""Weight below which an older term cannot change a double of order one."""
_DRAWN_AT_ONCE = 64


def gauss_markov(
    noise: NDArray[np.float64], state: NDArray[np.float64], *, interval_s: float, tau_s: float
) -> NDArray[np.float64]:
    """First-order Gauss-Markov process of unit variance, sampled exactly.

    Parameters
    ----------
    noise : (k, n) independent standard normal values, one row a component.
    state : (k,) values of the process one interval before the first sample.
    interval_s, tau_s : step and 1/e time [s].

    Returns
    -------
    (k, n) x_i = rho x_(i-1) + sqrt(1 - rho^2) noise_i with rho = exp(-interval/tau).

    Notes
    -----
    The recursion is summed by doubling: after pass j each value holds the last 2^j terms. All
    weights are powers of rho, so nothing cancels or overflows. Source: exact discretisation of
    the Ornstein-Uhlenbeck process (docs/methods/laboratory.md).
    """
    rho = np.exp(-interval_s / tau_s)
    x: NDArray[np.float64] = np.sqrt(-np.expm1(-2 * interval_s / tau_s)) * noise
    x[:, 0] += rho * state
    step, weight = 1, rho
    while step < x.shape[1] and weight > _NEGLIGIBLE:
        x[:, step:] += weight * x[:, :-step]
        step, weight = 2 * step, weight * weight
    return x


@dataclass(frozen=True)
class Events:
    """Events on the epochs of a record: each from epoch `start` up to, not with, `stop`.

    `uniform` holds further (events, k) values in [0, 1) for sizes, directions and satellites.
    """

    start: NDArray[np.int64]
    stop: NDArray[np.int64]
    uniform: NDArray[np.float64]

    def within(self, first: int, last: int) -> list[tuple[int, slice]]:
        """(event number, slice of the block) of every event that touches epochs first..last-1."""
        (touching,) = np.nonzero((self.start < last) & (self.stop > first))
        return [
            (
                int(i),
                slice(max(int(self.start[i]) - first, 0), min(int(self.stop[i]), last) - first),
            )
            for i in touching
        ]


def poisson_events(
    generator: np.random.Generator,
    *,
    rate_per_h: float,
    duration_s: tuple[float, float],
    interval_s: float,
    epochs: int,
    width: int,
) -> Events:
    """Events of a Poisson process with independent durations.

    Parameters
    ----------
    generator : numpy Generator that serves this process only.
    rate_per_h : events per hour of the record.
    duration_s : shortest and longest duration [s]; log-uniform in between, so that seconds and
        tens of seconds are equally common. At least one epoch.
    interval_s : step of the record [s].
    epochs : length of the record; events that begin later are dropped, the last one is cut.
    width : number of further uniform values for each event.

    Returns
    -------
    Events; a longer record begins with the same events.
    """
    shortest, longest = duration_s
    starts, stops, uniforms = [np.empty(0)], [np.empty(0)], [np.empty((0, width))]
    now_s = 0.0
    while rate_per_h > 0 and now_s < epochs * interval_s:
        drawn = generator.random((_DRAWN_AT_ONCE, 2 + width))
        times = now_s + np.cumsum(-np.log1p(-drawn[:, 0]) * 3600 / rate_per_h)
        lengths = shortest * (longest / shortest) ** drawn[:, 1]
        first = np.floor(times / interval_s)
        starts.append(first)
        stops.append(first + np.maximum(np.rint(lengths / interval_s), 1))
        uniforms.append(drawn[:, 2:])
        now_s = float(times[-1])
    start = np.concatenate(starts)
    inside = start < epochs
    return Events(
        start=start[inside].astype(np.int64),
        stop=np.minimum(np.concatenate(stops)[inside], epochs).astype(np.int64),
        uniform=np.concatenate(uniforms)[inside],
    )
