"""Coverage of the intervals of a share of time: 95 %, two-sided, simulated records.

    python benchmarks/shares.py [RECORDS]

State 1: a two-dimensional Gauss-Markov error (tau, step 5 s, 3e5 s) exceeds K; the true share is
exp(-K^2/2). State 2: outages begin at random and last exponentially (mean D, longer than tau).
Prints how often the interval holds the true share, and the median of upper bound over truth.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from scipy.signal import lfilter

from sbas.estimate import Estimate
from sbas.integrity.events import Stretch, find_runs
from sbas.integrity.shares.block_bootstrap import share_estimate
from sbas.integrity.shares.time_spans import Spans, spans_of_runs

STEP_S, SPAN_S = 5.0, 3e5


def exceedance(k: float, tau_s: float, rng: np.random.Generator) -> np.ndarray:
    rho, n = math.exp(-STEP_S / tau_s), round(SPAN_S / STEP_S)
    noise = rng.standard_normal((2, n)) * math.sqrt(1 - rho**2)
    noise[:, 0] /= math.sqrt(1 - rho**2)
    return np.hypot(*lfilter([1.0], [1.0, -rho], noise)) >= k


def outages(mean_s: float, share: float, rng: np.random.Generator) -> np.ndarray:
    """Alternating exponential up and down times, begun in its stationary state."""
    n = round(SPAN_S / STEP_S)
    down, at = np.zeros(n, bool), 0.0
    is_down = rng.random() < share
    while at < SPAN_S:
        length = rng.exponential(mean_s if is_down else mean_s * (1 - share) / share)
        down[round(at / STEP_S) : round((at + length) / STEP_S)] = is_down
        at, is_down = at + length, not is_down
    return down


def estimate(state: np.ndarray, tau_s: float) -> Estimate:
    interval = round(STEP_S * 1e9)
    stretch = Stretch(np.arange(state.size) * interval, interval)
    whole = Spans(np.array([0]), np.array([state.size * interval]))
    runs = find_runs(np.flatnonzero(state), stretch)
    found = share_estimate(spans_of_runs(runs, interval_ns=interval), whole, tau_s=tau_s)
    assert isinstance(found, Estimate)
    return found


def main() -> None:
    records = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    cases = [
        (f"error, tau {tau:g} s, share {p:g}", p, tau, ("error", tau))
        for tau in (360.0, 1500.0)
        for p in (1e-3, 0.01, 0.1, 0.5, 0.9)
    ]
    cases += [
        (f"outages of {mean:g} s, share {p:g}", p, 360.0, ("outage", mean))
        for mean in (30.0, 2000.0)
        for p in (0.01, 0.1, 0.4)
    ]
    for name, p, tau, (kind, size) in cases:
        found = []
        for seed in range(records):
            rng = np.random.default_rng(seed)
            state = (
                exceedance(math.sqrt(-2 * math.log(p)), size, rng)
                if kind == "error"
                else outages(size, p, rng)
            )
            found.append(estimate(state, tau))
        held = np.mean([e.lower <= p <= e.upper for e in found])
        upper = np.median([e.upper for e in found]) / p
        lower = np.median([e.lower for e in found]) / p
        clusters = np.median([e.basis.events for e in found])
        boot = np.mean(["bootstrap" in e.caveats[0] for e in found])
        print(
            f"shares {name}: {clusters:g} clusters, bootstrap in {100 * boot:.0f} %; holds the "
            f"truth in {100 * held:.1f} %; median bounds {lower:.2f} to {upper:.2f} x truth"
        )


if __name__ == "__main__":
    main()
