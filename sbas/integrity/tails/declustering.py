"""Demonstrated rates from correlated errors: clusters counted over the time at risk.

Exceedances of a Gauss-Markov error come in clusters; runs merged up to a time count each cluster
once. While a cluster lasts, and until the merge time has passed after it, no new one can begin:
this time is no exposure. Left in, it makes the rate too low wherever the merge time is not short
against the time between events.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.integrity.counting import Sided, poisson_bounds
from sbas.integrity.exposure.exposure import require
from sbas.integrity.exposure.extremal_clusters import ferro_segers_clusters

LEAST_MERGE_S = 60.0


def merge_time_s(tau_s: float | None) -> float:
    """Time up to which runs of exceedances are one event of a rate.

    Parameters
    ----------
    tau_s : 1/e time of the errors' correlation [s], or None where it is not known.

    Returns
    -------
    float [s]: max(tau/2, 60 s); 60 s without tau. Convention of this package.

    Raises
    ------
    InputError : a tau that is not above 0.
    """
    if tau_s is None:
        return LEAST_MERGE_S
    require("tau_s", tau_s, above=0)
    return max(tau_s / 2, LEAST_MERGE_S)


@dataclass(frozen=True, eq=False)
class ClusterCount:
    """Clusters of runs, and the time in which they could have begun.

    Parameters
    ----------
    start_s, end_s : (k,) begin of the first and end of the last run of each cluster [s].
    exposed_s : length of the record without its gaps [s].
    at_risk_s : the same less the clusters and the merge time after each [s].
    merge_s : merge time [s].
    ferro_segers : clusters that the intervals method finds, for comparison; None where the
        positions of the single exceedances are not known.
    """

    start_s: NDArray[np.float64]
    end_s: NDArray[np.float64]
    exposed_s: float
    at_risk_s: float
    merge_s: float
    ferro_segers: int | None = None

    @property
    def clusters(self) -> int:
        return int(self.start_s.size)


def count_clusters(
    start_s: ArrayLike, end_s: ArrayLike, *, exposed_s: float, merge_s: float
) -> ClusterCount:
    """Clusters of runs, and the time at risk, from the begin and end of each run.

    Parameters
    ----------
    start_s, end_s : (m,) begin and end [s] of each run, increasing; the end is the time of the
        last exceedance plus one interval.
    exposed_s : recorded time without gaps in which an event could have been seen [s].
    merge_s : runs no further apart than this are one cluster [s].

    Returns
    -------
    ClusterCount. Dead time after a cluster that falls into a gap or beyond the record's end was
    no exposure to begin with, but is subtracted all the same: the safe side.

    Raises
    ------
    InputError : runs that overlap or run backwards, or times that are not finite.

    Notes
    -----
    Runs merged up to r come at the rate E(r), the chance per time that an exceedance follows r
    without one; it falls with r below the hazard h as exp(-h r). Divided by the share of time
    that has been quiet for r, it is the hazard of the process killed at its first exceedance.
    For a reversible process that is a falling function of r with limit h: the estimate is never
    low in expectation, whatever r. (Keilson 1979, Markov Chain Models, chapter 3: complete
    monotonicity.)
    """
    require("exposed_s", exposed_s, least=0)
    require("merge_s", merge_s, least=0)
    start, end = np.asarray(start_s, dtype=np.float64), np.asarray(end_s, dtype=np.float64)
    ordered = start.ndim == 1 and start.shape == end.shape
    if ordered and start.size:
        ordered = bool(np.all(end > start) and np.all(start[1:] >= end[:-1]))
        ordered &= bool(np.isfinite([start[0], end[-1]]).all())
    if not ordered:
        raise InputError(
            "runs are not begins and ends in increasing order",
            where="start_s, end_s",
            evidence=f"shapes {start.shape} and {end.shape}",
        )
    if start.size:
        parts = start[1:] - end[:-1] > merge_s
        start = start[np.concatenate(([True], parts))]
        end = end[np.concatenate((parts, [True]))]
    dead = float((end - start).sum()) + start.size * merge_s
    return ClusterCount(start, end, exposed_s, max(0.0, exposed_s - dead), merge_s)


def count_exceedances(
    positions: ArrayLike, *, interval_s: float, exposed_s: float, merge_s: float
) -> ClusterCount:
    """Clusters and time at risk from the sample numbers of single exceedances.

    Parameters
    ----------
    positions : (m,) strictly increasing sample numbers, as of
        `sbas.integrity.exposure.extremal_clusters.exceedance_positions`.
    interval_s : time between samples [s].
    exposed_s, merge_s : as in `count_clusters`.

    Returns
    -------
    ClusterCount, with the clusters of Ferro and Segers beside.

    Raises
    ------
    InputError : positions that do not increase, or an argument out of range.
    """
    require("interval_s", interval_s, above=0)
    theirs = ferro_segers_clusters(positions)
    begin = np.asarray(positions, dtype=np.float64) * interval_s
    # (i + 1) * dt, not i * dt + dt: neighbours must touch exactly.
    end = (np.asarray(positions, dtype=np.float64) + 1) * interval_s
    mine = count_clusters(begin, end, exposed_s=exposed_s, merge_s=merge_s)
    return replace(mine, ferro_segers=theirs.count)


def demonstrated_rate(
    count: ClusterCount, confidence: float, *, sided: Sided = "upper", of: str = "events"
) -> Estimate | Refusal:
    """Rate of clusters per hour at risk, with exact Poisson bounds: `demonstrated` evidence.

    Parameters
    ----------
    count : clusters and time at risk.
    confidence, sided, of : as in `sbas.integrity.counting.poisson_bounds`.

    Returns
    -------
    Estimate in "per_h". Without events the time at risk is the whole exposure. A Refusal where
    less than half of the exposure is at risk: events are then no rare points in time.

    Raises
    ------
    InputError : a confidence out of range.

    References
    ----------
    Garwood 1936, Biometrika 28, 437; time at risk: `count_clusters`.
    """
    if count.at_risk_s <= count.exposed_s / 2:
        return Refusal(
            f"{count.clusters} {of} with their merge time fill more than half of the "
            f"{count.exposed_s / 3600:.4g} h: no rate of rare events",
            "report the share of time instead",
        )
    rate = poisson_bounds(count.clusters, count.at_risk_s / 3600, confidence, sided=sided, of=of)
    if count.clusters == 0:
        return rate
    lost_h = (count.exposed_s - count.at_risk_s) / 3600
    note = (
        f"{lost_h:.4g} h within events and {count.merge_s:g} s after each are no exposure: "
        "no new event could begin"
    )
    return replace(rate, caveats=(*rate.caveats, note))
