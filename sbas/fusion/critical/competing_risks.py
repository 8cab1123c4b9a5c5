"""Cumulative incidence of an event where something else may come first, at discrete times.

Leaving a combination is no censoring: what has been left can no longer reach the event. One
minus Kaplan-Meier, which treats it so, overstates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from sbas.exceptions import InputError
from sbas.fusion.critical.episodes import ENDED, LEFT, REACHED

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CumulativeIncidence:
    """Probability that the event has come by each time, and that nothing has come yet.

    Parameters
    ----------
    time : (m,) distinct times, in the unit given.
    incidence : (m,) or (m, b) F: the event has come by this time.
    free : (m,) or (m, b) S: neither the event nor its competitor has come by this time.
    """

    time: Floats
    incidence: Floats
    free: Floats


def cumulative_incidence(
    time: NDArray[np.float64] | NDArray[np.int64],
    outcome: NDArray[np.int8] | NDArray[np.int64],
    *,
    weights: Floats | None = None,
) -> CumulativeIncidence:
    """Aalen-Johansen estimate of the event's cumulative incidence, ties as they are.

    Parameters
    ----------
    time : (e,) time to the outcome, 0 or more.
    outcome : (e,) 1 the event, 2 its competitor, 0 observation ended.
    weights : (e,) or (e, b) weights 0 or more, such as bootstrap counts of b replicates; None
        for 1 each.

    Returns
    -------
    CumulativeIncidence at the distinct times, with the weights' trailing shape.

    Raises
    ------
    InputError : lengths that differ, other outcomes, negative times or weights.

    Notes
    -----
    From S = 1 and F = 0, at each time t with n at risk (T >= t), d1 events and d2 competitors:
    F grows by S d1/n, then S shrinks by the factor 1 - (d1 + d2)/n.

    References
    ----------
    O. O. Aalen, S. Johansen, Scand. J. Statist. 5 (1978) 141; J. D. Kalbfleisch, R. L. Prentice,
    The Statistical Analysis of Failure Time Data, 2nd ed. 2002, section 8.2.
    """
    time, outcome = np.asarray(time, np.float64), np.asarray(outcome, np.int64)
    given = np.ones(time.shape) if weights is None else np.asarray(weights, np.float64)
    if time.ndim != 1 or outcome.shape != time.shape or given.shape[:1] != time.shape:
        raise InputError(
            "times, outcomes and weights of different lengths",
            evidence=f"shapes {time.shape}, {outcome.shape}, {given.shape}",
        )
    if not np.all(np.isin(outcome, (ENDED, REACHED, LEFT))):
        raise InputError("an outcome is 0, 1 or 2", where="outcome")
    if not (np.all(time >= 0) and np.all(np.isfinite(time)) and np.all(given >= 0)):
        raise InputError("times and weights are 0 or more", where="time, weights")
    distinct, place = np.unique(time, return_inverse=True)
    cells = csr_array(
        (np.ones(time.size), (outcome * distinct.size + place, np.arange(time.size))),
        shape=(3 * distinct.size, time.size),
    )
    counts = (cells @ given).reshape(3, distinct.size, *given.shape[1:])
    incidence, free = incidence_of_counts(counts)
    return CumulativeIncidence(time=distinct, incidence=incidence, free=free)


def incidence_of_counts(counts: Floats) -> tuple[Floats, Floats]:
    """F and S of `cumulative_incidence` from counts by outcome and time.

    Parameters
    ----------
    counts : (3, m, ...) how many ended, reached the event, left, at each of m rising times.

    Returns
    -------
    F and S, (m, ...) each. Nothing at risk leaves both as they are.
    """
    here = counts.sum(axis=0)
    at_risk = np.flip(np.cumsum(np.flip(here, 0), axis=0), 0)
    stays = counts[ENDED] + np.concatenate([at_risk[1:], np.zeros_like(at_risk[:1])])
    # Nothing at risk: 0 events of 0, no step.
    none = at_risk == 0
    n = np.where(none, 1.0, at_risk)
    free = np.asarray(np.cumprod(np.where(none, 1.0, stays) / n, axis=0), np.float64)
    before = np.concatenate([np.ones_like(free[:1]), free[:-1]])
    incidence: Floats = np.cumsum(before * counts[REACHED] / n, axis=0)
    return incidence, free


def event_time_quantile(time: Floats, events: Floats, p: float) -> Floats:
    """Quantile of the time of the events alone, given that the event comes.

    Parameters
    ----------
    time : (m,) rising times.
    events : (m, ...) how many events at each.
    p : probability in (0, 1].

    Returns
    -------
    (...) smallest time by which a share p of the events has come; NaN without events.
    """
    by_then = np.cumsum(events, axis=0)
    total = by_then[-1]
    quantile = time[np.argmax(by_then >= p * total * (1 - 1e-12), axis=0)]
    return np.where(total > 0, quantile, np.nan)


def reach_time(time: Floats, incidence: Floats, at_entry: Floats, p: float) -> Floats:
    """Time by which the event has come with probability p, those there at entry included.

    Parameters
    ----------
    time : (m,) rising times.
    incidence : (m, ...) F of what is not there at entry.
    at_entry : (...) probability to be there at entry [1], or NaN.
    p : probability in (0, 1].

    Returns
    -------
    (...) smallest t with a + (1 - a) F(t) >= p: 0 where already a >= p, infinite where p is not
    reached in the times observed, NaN with a. Taken at a small p it is the safe figure: the
    quantile given the event leaves out both what never comes and what is there at once.
    """
    since = np.concatenate([[0.0], time])
    reached = np.concatenate([np.zeros_like(at_entry)[np.newaxis], incidence])
    mixed = at_entry + (1 - at_entry) * reached >= p * (1 - 1e-12)
    quantile = np.where(mixed.any(axis=0), since[np.argmax(mixed, axis=0)], np.inf)
    return np.where(np.isnan(at_entry), np.nan, quantile)
