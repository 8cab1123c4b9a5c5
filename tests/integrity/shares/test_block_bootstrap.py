from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.estimate import Counted, Estimate, Refusal
from sbas.exceptions import InputError
from sbas.integrity.shares.block_bootstrap import (
    merge_time_s,
    quantile_estimate,
    share_difference,
    share_estimate,
)
from sbas.integrity.shares.time_spans import Spans
from tests.integrity.shares.test_time_spans import S, on_grid, spans

WHOLE_S = 300_000


def whole(seconds: int = WHOLE_S) -> Spans:
    return spans((0, seconds))


def outages(count: int, length_s: int, seconds: int = WHOLE_S, seed: int = 0) -> Spans:
    """Outages of one length at random places of a regular raster, 200 s or more apart."""
    slots = seconds // (length_s + 200)
    places = np.sort(np.random.default_rng(seed).choice(slots, count, replace=False))
    start = places * (length_s + 200) * S
    return Spans(start, start + length_s * S)


def estimate(found: Estimate | Refusal) -> Estimate:
    assert isinstance(found, Estimate)
    return found


@pytest.mark.parametrize(("tau", "merge"), [(10.0, 60.0), (120.0, 60.0), (360.0, 180.0)])
def test_merge_time_is_half_a_tau_and_at_least_a_minute(tau: float, merge: float) -> None:
    assert merge_time_s(tau) == merge


def test_few_clusters_take_the_exact_binomial_limits() -> None:
    """3 of 20: 0.0320709 to 0.3789268 (Clopper and Pearson; R, binom.test(3, 20))."""
    tau = 360
    inside = spans(*((i * 2000, i * 2000 + tau) for i in (1, 2, 3)))
    found = estimate(share_estimate(inside, whole(20 * tau), tau_s=tau))
    assert found.value == pytest.approx(0.15)
    assert found.lower == pytest.approx(0.0320709, abs=1e-7)
    assert found.upper == pytest.approx(0.3789268, abs=1e-7)
    assert found.evidence == "demonstrated"
    assert isinstance(found.basis, Counted)
    assert found.basis.events == 3


def test_a_state_never_seen_is_bounded_by_the_effective_samples() -> None:
    """(1 - p)^n = 0.025 at n = T/tau = 10."""
    found = estimate(share_estimate(spans(), whole(3600), tau_s=360))
    assert (found.value, found.lower) == (0, 0)
    assert found.upper == pytest.approx(1 - 0.025**0.1, rel=1e-12)
    assert "no longer than tau" in found.caveats[-1]


def test_one_long_outage_is_one_event_and_not_many_samples() -> None:
    """Two hours of a day: T/tau would make 20 of 240 samples of it; it is 1 of 12."""
    found = estimate(share_estimate(spans((36_000, 43_200)), whole(86_400), tau_s=360))
    assert found.lower is not None
    assert found.upper is not None
    # Clopper-Pearson for 1 of 12, R: binom.test(1, 12).
    assert found.lower == pytest.approx(0.0021076, abs=1e-7)
    assert found.upper == pytest.approx(0.3847965, abs=1e-6)


@pytest.mark.parametrize("count", [3, 120])
def test_up_and_down_are_two_views_of_the_same_interval(count: int) -> None:
    down = outages(count, 60)
    of_down = estimate(share_estimate(down, whole(), tau_s=360))
    of_up = estimate(share_estimate(whole().without(down), whole(), tau_s=360))
    assert of_up.value == pytest.approx(1 - of_down.value, abs=1e-12)
    assert of_up.lower == pytest.approx(1 - of_down.upper, abs=2e-5)  # type: ignore[operator]
    assert of_up.upper == pytest.approx(1 - of_down.lower, abs=2e-5)  # type: ignore[operator]


def test_the_bootstrap_agrees_with_one_that_resamples_epochs() -> None:
    """Two ways: blocks of epochs drawn and counted, and differences of cumulative time."""
    rng = np.random.default_rng(4)
    state = np.zeros(60_000, bool)
    for start in rng.choice(590, 150, replace=False) * 100:
        state[start : start + rng.integers(5, 40)] = True
    found = estimate(share_estimate(on_grid(state), whole(60_000), tau_s=60, confidence=0.68))
    block, blocks = 600, 100
    sums = np.concatenate([[0], np.cumsum(np.concatenate([state, state[:block]]))])
    start = rng.integers(0, state.size, (4000, blocks))
    shares = (sums[start + block] - sums[start]).sum(axis=1) / (block * blocks)
    low, high = np.quantile(shares, [0.16, 0.84])
    assert found.caveats[0].startswith("block bootstrap")
    # 2000 replicates: a percentile's standard error is some 3 % of the half width.
    width = high - low
    assert found.lower == pytest.approx(low, abs=0.06 * width)
    assert found.upper == pytest.approx(high, abs=0.06 * width)


def test_independent_outages_give_the_poisson_width() -> None:
    """n outages of d s at random: the share's standard error is near d sqrt(n)/T."""
    inside = outages(150, 60, 600_000)
    found = estimate(share_estimate(inside, whole(600_000), tau_s=30, confidence=0.95))
    assert found.lower is not None
    assert found.upper is not None
    # 150 of 2307 places: hypergeometric, 0.967 of the Poisson error.
    error = 60 * math.sqrt(150 * (1 - 150 / 2307)) / 600_000
    assert found.upper - found.lower == pytest.approx(2 * 1.96 * error, rel=0.12)


def test_gaps_are_no_part_of_the_share() -> None:
    observed = spans((0, 1000), (5000, 8000))
    found = estimate(share_estimate(spans((5000, 6000)), observed, tau_s=100))
    assert found.value == 0.25


def test_sides() -> None:
    state = outages(100, 60)
    two = estimate(share_estimate(state, whole(), tau_s=360, confidence=0.9))
    lower = estimate(share_estimate(state, whole(), tau_s=360, confidence=0.95, sided="lower"))
    upper = estimate(share_estimate(state, whole(), tau_s=360, confidence=0.95, sided="upper"))
    assert lower.lower == pytest.approx(two.lower, rel=1e-12)
    assert upper.upper == pytest.approx(two.upper, rel=1e-12)
    assert lower.upper is upper.lower is None


def test_nothing_observed_is_refused_and_wrong_arguments_are_errors() -> None:
    assert isinstance(share_estimate(spans(), spans(), tau_s=360), Refusal)
    with pytest.raises(InputError, match="tau_s"):
        share_estimate(spans(), whole(), tau_s=0)
    with pytest.raises(InputError, match="within"):
        share_estimate(spans((0, 10)), spans((5, 20)), tau_s=360)


def test_a_difference_needs_fifty_clusters() -> None:
    few = share_difference(outages(49, 60), spans(), whole(), tau_s=60)
    assert isinstance(few, Refusal)
    assert "49 clusters" in few.reason
    found = estimate(share_difference(outages(200, 60), spans(), whole(), tau_s=60))
    assert found.value == pytest.approx(200 * 60 / WHOLE_S)
    assert found.lower is not None
    assert found.lower > 0


def test_a_difference_changes_sign_with_its_sides() -> None:
    places = outages(240, 60)
    a = Spans(places.start_ns[::3], places.end_ns[::3])
    b = Spans(np.delete(places.start_ns, np.s_[::3]), np.delete(places.end_ns, np.s_[::3]))
    ab = estimate(share_difference(a, b, whole(), tau_s=60))
    ba = estimate(share_difference(b, a, whole(), tau_s=60))
    assert ab.value == -ba.value < 0
    assert ab.lower == pytest.approx(-ba.upper, rel=0.02)  # type: ignore[operator]


def test_the_median_of_twenty_lies_between_its_order_statistics() -> None:
    """10 of 20: 0.2719578 to 0.7280422 (R, binom.test(10, 20))."""
    values = np.linspace(0, 1, 2001)
    found = quantile_estimate(values, 0.5, n_effective=20, hours=1, confidence=0.95, unit="m")
    assert (found.value, found.sided) == (0.5, "two")
    assert found.lower == pytest.approx(0.2719578, abs=1e-6)
    assert found.upper == pytest.approx(0.7280422, abs=1e-6)


def test_too_few_values_bound_a_high_quantile_on_one_side_only() -> None:
    """0.95^n > 0.025 until n = ln 0.025/ln 0.95 = 71.9."""
    values = np.linspace(0, 1, 2001)

    def p95(n: float) -> Estimate:
        return quantile_estimate(values, 0.95, n_effective=n, hours=1, confidence=0.95, unit="m")

    assert (p95(71).upper, p95(71).sided, p95(71).confidence) == (None, "lower", 0.975)
    assert p95(72.5).upper is not None
    none = p95(0.5)
    assert (none.lower, none.upper, none.confidence) == (None, None, None)


@given(st.integers(0, 40), st.integers(1, 4000), st.floats(1, 1e5), st.integers(0, 5))
def test_every_interval_holds_its_value(count: int, length: int, tau: float, seed: int) -> None:
    slots = WHOLE_S // (length + 200)
    state = outages(min(count, slots), length, seed=seed)
    found = estimate(share_estimate(state, whole(), tau_s=tau))
    assert found.lower is not None
    assert found.upper is not None
    assert 0 <= found.lower <= found.value <= found.upper <= 1


def test_coverage_on_simulated_outages() -> None:
    """60 records, 60 to 130 outages each: 95 % less three standard errors is 87 %."""
    held = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        gaps = rng.exponential(2970.0, 140)
        lengths = rng.exponential(30.0, 140)
        edges = np.cumsum(np.column_stack([gaps, lengths]).ravel())
        start = (edges[::2] * S).astype(np.int64)
        end = (edges[1::2] * S).astype(np.int64)
        inside = (end < WHOLE_S * S) & (end > start)
        found = estimate(share_estimate(Spans(start[inside], end[inside]), whole(), tau_s=60))
        assert found.lower is not None
        assert found.upper is not None
        held += found.lower <= 0.01 <= found.upper
    assert held >= 52
