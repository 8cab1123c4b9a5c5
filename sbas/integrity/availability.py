"""Availability, continuity, and the times between losses and to recovery."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Counted, Estimate
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.environments.record_part import RecordPart, shared
from sbas.integrity.events import Runs
from sbas.integrity.shares.block_bootstrap import share_estimate
from sbas.integrity.shares.time_spans import Spans, spans_of_runs
from sbas.recording_survey import Gaps
from sbas.timescales import NS_PER_S

Ints = NDArray[np.int64]

NOT_INFERRED = (
    "describes this recording: epochs are correlated, and without a decorrelation time no "
    "interval follows from their number"
)


_NEVER_UP = "the service was lost on entry and never up here"


@dataclass(frozen=True)
class Availability:
    """How often and how long the service was up.

    `availability` counts gaps as down, `availability_excluding_gaps` leaves them out of the
    denominator; both with a lower bound where the decorrelation time is known. `mttf` and `mttr`
    are Estimates in hours: mean up time to a loss and mean time to recovery; with no loss seen,
    `mttf` is its own lower bound. `continuity_risk` is P(service lost within the window | up
    now), again with gaps as losses and without.
    """

    availability: Estimate
    availability_excluding_gaps: Estimate
    up_hours: float
    down_hours: float
    gap_hours: float
    losses: int
    recoveries: int
    mttf: Estimate
    mttr: Estimate | None
    continuity_risk: float
    continuity_risk_excluding_gaps: float
    continuity_window_epochs: int


def continuity_risk(
    first: Ints, stop: Ints, rows: int, window: int, part: RecordPart | None = None
) -> float:
    """Probability to lose the service within a window, given that it is up now.

    Parameters
    ----------
    first, stop : (k,) rows where down time begins and ends (exclusive), in order and disjoint;
        equal for a gap, which has no rows.
    rows : epochs in all.
    window : W [epochs].
    part : count epochs of this part only, wherever the service is lost; None counts all.

    Returns
    -------
    For every loss min(W, length of the up run before it) epochs are at risk; the result is
    their share among the up epochs, and 1 when there is none. Source: gLAB 6 `core/filter.c`
    (definition only), the wording of Navipedia, EGNOS Performances.
    """
    previous = np.concatenate([[0], stop[:-1]])
    at_risk = np.minimum(first - previous, window)
    if part is None:
        up = rows - int(np.sum(stop - first))
    else:
        at_risk = part.rows_between(first - at_risk, first)
        up = part.rows - int(np.sum(part.rows_between(first, stop)))
    return float(at_risk.sum()) / up if up else 1.0


def availability(
    down: Runs,
    gaps: Gaps,
    *,
    up_ns: int,
    down_ns: int,
    interval_ns: int,
    confidence: float,
    tau_s: float | None,
    window_epochs: int = 15,
    part: RecordPart | None = None,
) -> Availability:
    """Availability figures from the runs of down epochs and the gaps of a record.

    Parameters
    ----------
    down : runs of epochs without service (no fix, level missing, or level >= alert limit).
    gaps : gaps of the record.
    up_ns, down_ns : time that up and down epochs of the part cover [ns].
    interval_ns : sampling interval [ns].
    confidence : one-sided, for every bound.
    tau_s : upper limit of the decorrelation time [s]; None gives availability no bound.
    window_epochs : W of the continuity risk.
    part : figures of this part of the record, such as one environment; None: of all of it.

    Notes
    -----
    A loss is a transition from up to down. Down at the record's start is no loss; down at its
    end is no recovery. In a part a loss counts where the service is first down, a recovery where
    it is last down, a gap with the epoch before it; coming from another part, or leaving for
    one, is neither: over parts, losses and recoveries sum to those of the record.
    MTTF = up time / losses, MTTR = down time / recoveries; their bounds
    take losses and recoveries as Poisson events (methods: integrity statistics, 4.3). Bounds of
    availability: `sbas.integrity.shares.block_bootstrap.share_estimate`.
    """
    hour_ns = 3600 * NS_PER_S
    record = RecordPart.of_all(down, interval_ns)
    here = record if part is None else part
    up_rows = here.rows - int(here.rows_between(down.first, down.last + 1).sum())
    up_h = up_ns / hour_ns
    # The row before a gap tells whose it is: no gap stands before the first row.
    gap_h = float(gaps.missing_ns(interval_ns)[here.holds(gaps.row - 1)].sum()) / hour_ns
    down_h = down_ns / hour_ns
    first, stop = _fused(
        np.concatenate([down.first, gaps.row]), np.concatenate([down.last + 1, gaps.row])
    )
    lost_at = first - np.isin(first, gaps.row)
    losses = int(np.sum(here.holds(lost_at)[first > 0]))
    recoveries = int(np.sum(here.holds(stop - 1)[stop < down.rows]))
    loss_rate = poisson_bounds(losses, up_h, confidence) if up_h else None
    if losses and loss_rate:
        mttf = Estimate(
            up_h / losses, 1 / _upper(loss_rate), None, confidence, "h",
            Counted(losses, up_h, "losses of service"), "lower",
        )  # fmt: skip
    else:
        bound = 1 / _upper(loss_rate) if loss_rate else 0.0
        unseen = "no loss of service was seen: the value is the lower bound itself"
        mttf = Estimate(
            bound, bound, None, confidence, "h", Counted(losses, up_h, "losses of service"),
            "lower", (_NEVER_UP if losses else unseen,),
        )  # fmt: skip
    mttr = None
    if recoveries:
        out_h = down_h + gap_h
        lowest = poisson_bounds(recoveries, out_h, confidence, sided="lower").lower
        mttr = Estimate(
            out_h / recoveries, None, 1 / lowest if lowest else None, confidence, "h",
            Counted(recoveries, out_h, "recoveries"), "upper",
        )  # fmt: skip
    rows_first, rows_stop = _fused(down.first, down.last + 1)
    recorded = _recorded(down, gaps, interval_ns)
    up = recorded.without(spans_of_runs(down, interval_ns=interval_ns))
    if part is not None:
        recorded, up = shared(recorded, part.spans), shared(up, part.spans)

    def fraction(hours: float, observed: Spans) -> Estimate:
        share = up_h / hours if hours else 0.0
        if tau_s is not None and hours:
            found = share_estimate(
                up, observed, tau_s=tau_s, confidence=confidence, sided="lower",
                interval_s=interval_ns / NS_PER_S, of="spans of service",
            )  # fmt: skip
            if isinstance(found, Estimate) and found.lower is not None:
                return replace(found, value=share, lower=min(found.lower, share))
        basis = Counted(up_rows, hours, "available epochs")
        return Estimate(share, None, None, None, "1", basis, "lower", (NOT_INFERRED,))

    return Availability(
        fraction(up_h + down_h + gap_h, here.spans),
        fraction(up_h + down_h, recorded),
        up_h,
        down_h,
        gap_h,
        losses,
        recoveries,
        mttf,
        mttr,
        continuity_risk(first, stop, down.rows, window_epochs, part),
        continuity_risk(rows_first, rows_stop, down.rows, window_epochs, part),
        window_epochs,
    )


def _recorded(down: Runs, gaps: Gaps, interval_ns: int) -> Spans:
    """The time of all epochs: the record without its gaps."""
    return Spans(
        np.append(down.begin_ns, gaps.after_ns),
        np.append(gaps.before_ns, down.end_ns) + interval_ns,
    )


def _upper(rate: Estimate) -> float:
    assert rate.upper is not None
    return rate.upper


def _fused(first: Ints, stop: Ints) -> tuple[Ints, Ints]:
    """Down intervals in rows, sorted, with those that touch made one."""
    order = np.lexsort((stop, first))
    first, stop = first[order], stop[order]
    if first.size == 0:
        return first, stop
    reach = np.maximum.accumulate(stop)
    heads = np.concatenate([[0], np.flatnonzero(first[1:] > reach[:-1]) + 1])
    tails = np.concatenate([heads[1:] - 1, [first.size - 1]])
    return first[heads], reach[tails]
