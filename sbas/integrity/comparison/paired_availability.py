"""Availability of two recordings at the same epochs, and the time in which just one was up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Estimate
from sbas.integrity.comparison.comparison_results import AvailabilityComparison
from sbas.integrity.comparison.pairing import CommonEpochs
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.events import Stretch, find_events, find_runs
from sbas.integrity.shares.block_bootstrap import merge_time_s, share_difference, share_estimate
from sbas.integrity.shares.time_spans import Spans, spans_of_runs
from sbas.recording_survey import GAP_STEPS
from sbas.timescales import NS_PER_S

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def up_at_common_epochs(fix: Bools, hpl_m: Floats, alert_limit_m: float, row: Ints) -> Bools:
    """(n,) whether a recording is up at the common epochs; at one that it lacks it is down.

    Parameters
    ----------
    fix, hpl_m : (r,) of the recording's epochs: position known, level [m] or NaN.
    alert_limit_m : alert limit [m]; a level that reaches it is down.
    row : (n,) the recording's row at each common epoch, -1 where it has none.
    """
    return (row >= 0) & fix[row] & (hpl_m[row] < alert_limit_m)


def availability_comparison(
    alert_limit_m: float,
    up_a: Bools,
    up_b: Bools,
    common: CommonEpochs,
    *,
    tau_s: float,
    confidence: float,
) -> AvailabilityComparison:
    """Availability of both, its difference, and the events in which just one was up.

    Parameters
    ----------
    alert_limit_m : alert limit [m].
    up_a, up_b : (n,) at the common epochs.
    common : the common epochs.
    tau_s, confidence : as for `compare`.

    References
    ----------
    Integrity statistics, 7: discordant events; Garwood 1936 for the two rates.
    """
    interval_ns = common.interval_ns
    interval_s = interval_ns / NS_PER_S
    stretch = Stretch(common.time_ns, int(GAP_STEPS * interval_ns))

    def spans(state: Bools) -> Spans:
        return spans_of_runs(find_runs(np.flatnonzero(state), stretch), interval_ns=interval_ns)

    observed = spans(np.ones(up_a.size, bool))

    def rate(state: Bools, whose: str) -> Estimate:
        runs = find_runs(np.flatnonzero(state), stretch)
        events = find_events(runs, interval_ns=interval_ns, merge_s=merge_time_s(tau_s))
        return poisson_bounds(
            len(events),
            observed.total_s / 3600,
            confidence,
            sided="two",
            of=f"events with only {whose} up",
        )

    def share(state: Bools, whose: str) -> Estimate:
        found = share_estimate(
            spans(state),
            observed,
            tau_s=tau_s,
            confidence=confidence,
            interval_s=interval_s,
            of=f"spans of {whose}",
        )
        # There is a common epoch, so that time was observed.
        assert isinstance(found, Estimate)
        return found

    alone_a, alone_b = up_a & ~up_b, up_b & ~up_a
    only_a, only_b = spans(alone_a), spans(alone_b)
    paired = common.paired
    return AvailabilityComparison(
        alert_limit_m=alert_limit_m,
        availability_a=share(up_a, "A"),
        availability_b=share(up_b, "B"),
        recorded_both_a=float(up_a[paired].mean()),
        recorded_both_b=float(up_b[paired].mean()),
        difference=share_difference(
            only_a, only_b, observed, tau_s=tau_s, confidence=confidence, interval_s=interval_s
        ),
        only_a=rate(alone_a, "A"),
        only_b=rate(alone_b, "B"),
        only_a_s=only_a.total_s,
        only_b_s=only_b.total_s,
    )
