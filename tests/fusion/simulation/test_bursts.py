"""Bursts drawn by sojourn times against the exact law of the chain stepped through."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from sbas.fusion.architecture.model import Bursts, CommonCause, Odometer, SatelliteReceiver
from sbas.fusion.simulation.bursts import (
    BurstRuns,
    draw_amplitudes,
    draw_bursts,
    draw_shared_bursts,
)

SLIP = Odometer("odo").slip
GNSS = SatelliteReceiver("gps")
STANDARD_ERRORS = 4.5
"""Seeds are fixed; a bound that one of 150 000 correct draws misses."""


def switching_probabilities(bursts: Bursts, step_s: float) -> tuple[float, float]:
    """Probabilities that the chain goes on, and off, in one step."""
    duration_s = bursts.mean_duration_s
    off = 1 - math.exp(-step_s / duration_s) if duration_s else 1.0
    return 1 - math.exp(-bursts.rate_per_s * step_s), off


def on_share(bursts: Bursts, step_s: float) -> float:
    """Share of steps with a burst in the long run."""
    on, off = switching_probabilities(bursts, step_s)
    return on / (on + off)


def chain_law(bursts: Bursts, step_s: float, steps: int) -> np.ndarray:
    """P(on) at each step, by powers of the transition matrix, off before the first step."""
    on, off = switching_probabilities(bursts, step_s)
    matrix = np.array([[1 - on, on], [off, 1 - off]])
    law = [np.linalg.matrix_power(matrix, k)[0, 1] for k in range(1, steps + 1)]
    return np.array(law)


def burst_runs(run: list[int], start: list[int], stop: list[int]) -> BurstRuns:
    return BurstRuns(6, 3, *(np.array(part, dtype=np.int64) for part in (run, start, stop)))


def test_shares_of_the_defaults() -> None:
    """Page causal-analysis, section 11: slip, multipath, outage in the long run."""
    expected = ((SLIP, 0.1, 0.05744), (GNSS.multipath, 1.0, 0.08356), (GNSS.outage, 1.0, 0.04149))
    for bursts, step_s, share in expected:
        assert on_share(bursts, step_s) == pytest.approx(share, abs=5e-6)
        steps = 400_000
        rng = np.random.default_rng(8)
        on = draw_bursts(bursts, step_s=step_s, steps=steps, runs=1, rng=rng).on()
        # A burst of mean length m steps: the share scatters by about sqrt(2 p m / steps).
        scatter = math.sqrt(2 * share * bursts.mean_duration_s / step_s / steps)
        assert on.mean() == pytest.approx(share, abs=STANDARD_ERRORS * scatter)


def test_every_pattern_has_the_probability_of_the_chain() -> None:
    """All 32 courses of 5 steps: products of switching probabilities."""
    bursts, runs = Bursts(0.5, 1.5, 0.0, 1.0), 200_000
    on, off = switching_probabilities(bursts, 1.0)
    mask = draw_bursts(bursts, step_s=1.0, steps=5, runs=runs, rng=np.random.default_rng(1)).on()
    counts = np.bincount(2 ** np.arange(5) @ mask, minlength=32)
    for pattern in itertools.product((0, 1), repeat=5):
        chance, state = 1.0, 0
        for step in pattern:
            leaves = off if state else on
            chance *= leaves if step != state else 1 - leaves
            state = step
        seen = counts[sum(step << k for k, step in enumerate(pattern))]
        assert abs(seen - runs * chance) < STANDARD_ERRORS * math.sqrt(runs * chance), pattern


@pytest.mark.parametrize(
    ("bursts", "step_s"), [(SLIP, 0.1), (SLIP, 0.2), (GNSS.multipath, 1.0), (GNSS.outage, 1.0)]
)
def test_share_at_each_step(bursts: Bursts, step_s: float) -> None:
    steps, runs = round(60 / step_s), 20_000
    mask = draw_bursts(
        bursts, step_s=step_s, steps=steps, runs=runs, rng=np.random.default_rng(2)
    ).on()
    law = chain_law(bursts, step_s, steps)
    assert (np.abs(mask.mean(axis=1) - law) < STANDARD_ERRORS * np.sqrt(law / runs)).all()
    a_run = mask.mean(axis=0)
    assert abs(a_run.mean() - law.mean()) < STANDARD_ERRORS * a_run.std() / math.sqrt(runs)


def test_sojourns_of_a_long_run_are_geometric() -> None:
    """Means 1 / p, variances (1 - p) / p^2; a burst is followed by one step or more without."""
    drawn = draw_bursts(SLIP, step_s=0.1, steps=2_000_000, runs=1, rng=np.random.default_rng(3))
    on, off = switching_probabilities(SLIP, 0.1)
    stretches = {on: drawn.start[1:] - drawn.stop[:-1], off: (drawn.stop - drawn.start)[:-1]}
    for p, lengths in stretches.items():
        assert lengths.min() == 1
        sd = math.sqrt(1 - p) / p
        assert abs(lengths.mean() - 1 / p) < STANDARD_ERRORS * sd / math.sqrt(lengths.size)
        assert lengths.std() == pytest.approx(sd, rel=0.05)


def test_no_bursts_without_a_rate() -> None:
    none = Bursts(0.0, 3.0, 1.0, 1.0)
    drawn = draw_bursts(none, step_s=0.1, steps=50, runs=7, rng=np.random.default_rng(4))
    assert drawn.run.size == 0
    assert drawn.grid(np.empty(0)).shape == (50, 7)
    assert not drawn.on().any()


def test_bursts_of_no_duration_last_a_step() -> None:
    short = Bursts(0.3, 0.0, 1.0, 1.0)
    drawn = draw_bursts(short, step_s=1.0, steps=40, runs=500, rng=np.random.default_rng(5))
    assert drawn.run.size > 0
    assert (drawn.stop - drawn.start == 1).all()
    assert switching_probabilities(short, 1.0)[1] == 1.0


def test_grid_by_hand() -> None:
    """Where bursts overlap the larger one counts, whatever their order and sign."""
    drawn = burst_runs([0, 2, 2, 1], [1, 0, 1, 5], [3, 3, 6, 6])
    expected = np.zeros((6, 3))
    expected[1:3, 0] = 5.0
    expected[0:3, 2] = -3.0
    expected[3:6, 2] = 2.0
    expected[5, 1] = 1.0
    assert (drawn.grid(np.array([5.0, -3.0, 2.0, 1.0])) == expected).all()
    back = burst_runs([1, 2, 2, 0], [5, 1, 0, 1], [6, 6, 3, 3])
    assert (back.grid(np.array([1.0, 2.0, -3.0, 5.0])) == expected).all()
    assert (drawn.on() == (expected != 0)).all()


def test_amplitudes() -> None:
    rng = np.random.default_rng(6)
    drawn = draw_amplitudes(SLIP, 20_000, rng)
    assert ((drawn >= 0.01) & (drawn <= 0.06)).all()
    assert drawn.mean() == pytest.approx(0.035, abs=4.5 * 0.05 / math.sqrt(12 * 20_000))
    signed = draw_amplitudes(GNSS.multipath, 20_000, rng, either_sign=True)
    assert ((np.abs(signed) >= 1.5) & (np.abs(signed) <= 8.0)).all()
    assert abs((signed > 0).mean() - 0.5) < 4.5 * 0.5 / math.sqrt(20_000)


class TestCommonCauses:
    """Two sensors of one group, 3000 runs of 400 steps."""

    bursts = Bursts(0.05, 4.0, 1.0, 1.0)
    steps, runs = 400, 3000

    def pair(self, common_cause: CommonCause, share: float) -> tuple[np.ndarray, np.ndarray]:
        def one(seed: int) -> np.ndarray:
            options: dict[str, Any] = {"common_cause": common_cause, "share": share}
            return draw_shared_bursts(
                self.bursts, **options, step_s=1.0, steps=self.steps, runs=self.runs,
                own=np.random.default_rng(seed), common=np.random.default_rng(99),
                coin=np.random.default_rng(98).random(self.runs),
            ).on()  # fmt: skip

        return one(1), one(2)

    def both_on(self, pair: tuple[np.ndarray, np.ndarray]) -> tuple[float, float]:
        """Share of steps from the 100th on at which both are on, and its standard error."""
        a_run = (pair[0] & pair[1])[100:].mean(axis=0)
        return a_run.mean(), a_run.std() / math.sqrt(self.runs)

    def test_independent(self) -> None:
        pi = on_share(self.bursts, 1.0)
        seen, error = self.both_on(self.pair("independent", 0.5))
        assert abs(seen - pi**2) < STANDARD_ERRORS * error

    @pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
    def test_per_run(self, share: float) -> None:
        """The law of one sensor does not change; both are on with share pi + (1 - share) pi^2."""
        pi = on_share(self.bursts, 1.0)
        pair = self.pair("per_run", share)
        law = chain_law(self.bursts, 1.0, self.steps)
        for mask in pair:
            error = np.sqrt(law / self.runs)
            assert (np.abs(mask.mean(axis=1) - law) < STANDARD_ERRORS * error).all()
        seen, error = self.both_on(pair)
        assert abs(seen - (share * pi + (1 - share) * pi**2)) < STANDARD_ERRORS * error
        alike = (pair[0] == pair[1]).all(axis=0).mean()
        assert abs(alike - share) < STANDARD_ERRORS * 0.5 / math.sqrt(self.runs) + 1e-3

    @pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
    def test_beta_factor(self, share: float) -> None:
        """On alone: 1 - (1 - c)(1 - i); both: c + (1 - c) i^2, with the shares c and i of each."""
        common, own = (
            on_share(Bursts(part * 0.05, 4.0, 1.0, 1.0), 1.0) for part in (share, 1 - share)
        )
        pair = self.pair("beta_factor", share)
        a_run = pair[0][100:].mean(axis=0)
        error = a_run.std() / math.sqrt(self.runs)
        expected = common + (1 - common) * own
        assert abs(a_run.mean() - expected) < STANDARD_ERRORS * error
        seen, error = self.both_on(pair)
        assert abs(seen - (common + (1 - common) * own**2)) < STANDARD_ERRORS * error
