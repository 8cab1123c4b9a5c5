"""Clusters counted over the time at risk."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import optimize, signal

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.integrity.counting import garwood_limits
from sbas.integrity.exposure.gauss_markov_sampled import extremal_index, sampled_risk
from sbas.integrity.tails.declustering import (
    count_clusters,
    count_exceedances,
    demonstrated_rate,
    merge_time_s,
)


def test_merge_time_is_half_of_tau_but_a_minute_at_least() -> None:
    assert merge_time_s(None) == 60
    assert merge_time_s(100) == 60
    assert merge_time_s(360) == 180
    with pytest.raises(InputError, match="tau_s"):
        merge_time_s(0)


def test_runs_of_the_method_page_merge() -> None:
    # Page, section 9: bad 3-5, 10, 12, 13, 30-36 at 1 s; merged at 3 s.
    found = count_clusters([3, 10, 12, 30], [6, 11, 14, 37], exposed_s=100, merge_s=3)
    np.testing.assert_array_equal(found.start_s, [3, 10, 30])
    np.testing.assert_array_equal(found.end_s, [6, 14, 37])
    assert found.clusters == 3
    # 3 + 4 + 7 s within clusters, 3 s after each.
    assert found.at_risk_s == 100 - 14 - 9


def test_runs_exactly_the_merge_time_apart_are_one() -> None:
    assert count_clusters([0, 60], [1, 61], exposed_s=1e4, merge_s=59).clusters == 1
    assert count_clusters([0, 60], [1, 61], exposed_s=1e4, merge_s=58.9).clusters == 2


def test_exceedances_give_the_same_as_their_runs_and_ferro_segers_beside() -> None:
    # Page, section 9: these exceedances are 3 clusters by Ferro and Segers.
    positions = [10, 11, 13, 50, 52, 200]
    found = count_exceedances(positions, interval_s=1.0, exposed_s=1000, merge_s=0.5)
    runs = count_clusters([10, 13, 50, 52, 200], [12, 14, 51, 53, 201], exposed_s=1000, merge_s=0.5)
    np.testing.assert_array_equal(found.start_s, runs.start_s)
    assert found.at_risk_s == runs.at_risk_s
    assert found.ferro_segers == 3


@pytest.mark.parametrize("interval", [0.1, 0.2, 0.7, 1 / 3])
def test_neighbours_touch_at_any_interval(interval: float) -> None:
    found = count_exceedances(np.arange(1000), interval_s=interval, exposed_s=1e5, merge_s=0.0)
    assert found.clusters == 1


def test_no_event_in_the_papers_record() -> None:
    # -ln(0.05)/83.33 h: Filip, Bazant, Mocek 2010 recorded 3e5 s.
    nothing = count_exceedances([], interval_s=1.0, exposed_s=3e5, merge_s=180)
    rate = demonstrated_rate(nothing, 0.95)
    assert isinstance(rate, Estimate)
    assert rate.upper == pytest.approx(3.595e-2, rel=1e-4)
    assert rate.evidence == "demonstrated"


def test_events_that_fill_the_record_are_no_rate() -> None:
    crowded = count_clusters([0, 200, 400], [100, 300, 500], exposed_s=600, merge_s=60)
    assert isinstance(demonstrated_rate(crowded, 0.95), Refusal)


def test_nothing_exposed_is_no_rate() -> None:
    assert isinstance(
        demonstrated_rate(count_clusters([], [], exposed_s=0, merge_s=60), 0.95), Refusal
    )


@pytest.mark.parametrize(
    ("start", "end"),
    [([5], [4]), ([0, 3], [4, 6]), ([0], [1, 2]), ([3, 0], [4, 1]), ([0], [math.inf])],
)
def test_impossible_runs_are_refused(start: list[float], end: list[float]) -> None:
    with pytest.raises(InputError, match="runs are not"):
        count_clusters(start, end, exposed_s=100, merge_s=1)


@pytest.mark.parametrize("share_of_tau", [0.1, 0.5, 1.0, 3.0])
def test_the_rate_at_risk_is_never_below_the_hazard(share_of_tau: float) -> None:
    """Exact: (risk of n + 1 samples - risk of n)/(1 - risk of n) is the expected rate at risk."""
    tau, k = 50.0, 2.0
    correlation = math.exp(-1 / tau)
    hazard = extremal_index(k, correlation=correlation) * math.exp(-k * k / 2)
    quiet = round(share_of_tau * tau) + 1
    before = sampled_risk(k, correlation=correlation, samples=quiet)
    after = sampled_risk(k, correlation=correlation, samples=quiet + 1)
    merged = after - before
    assert merged / (1 - before) >= hazard * (1 - 1e-6)
    if share_of_tau == 3.0:
        # Over the whole time the same count would be far too low.
        assert merged < 0.7 * hazard


def test_the_bound_covers_where_events_are_close() -> None:
    """61 events expected in 200 tau: merging at tau/2 over the whole time would cover in 60 %."""
    tau, samples, records, expected = 30.0, 6000, 400, 61.0
    r = math.exp(-1 / tau)
    k = optimize.brentq(
        lambda k: extremal_index(k, correlation=r) * math.exp(-k * k / 2) * samples - expected,
        1.0,
        4.0,
    )
    generator = np.random.default_rng(3)
    drawn = generator.standard_normal((records, 2, samples))
    drawn[..., 1:] *= math.sqrt(1 - r * r)
    error = np.hypot(*np.moveaxis(signal.lfilter([1.0], [1.0, -r], drawn, axis=-1), 1, 0))
    held, plain = 0, 0
    for row in error:
        found = count_exceedances(
            np.flatnonzero(row >= k), interval_s=1.0, exposed_s=samples, merge_s=tau / 2
        )
        rate = demonstrated_rate(found, 0.95)
        assert isinstance(rate, Estimate)
        assert rate.upper is not None
        held += rate.upper >= expected / samples * 3600
        plain += garwood_limits(found.clusters, 0.95)[1] >= expected
    # 400 records: 0.95 has a standard error of 0.011.
    assert held / records >= 0.935
    assert plain / records < 0.8
