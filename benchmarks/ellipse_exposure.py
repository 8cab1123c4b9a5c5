"""Risk of an exposure for unequal axes: the corrected asymptotic form against simulation.

    python benchmarks/ellipse_exposure.py

60 000 Gauss-Markov records a case, fixed seed, about 15 s. Prints the simulated risk, its
relative standard error, and the relative deviations of `ar1_risk` and `siegmund_risk`.
"""

from __future__ import annotations

import math

import numpy as np

from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.gauss_markov import siegmund_risk
from sbas.integrity.exposure.gauss_markov_sampled import ar1_risk

RECORDS = 60_000
CASES = ((3, 36, 360), (3, 100, 42), (3.5, 36, 360), (3, 5, 360))


def simulated_risk(
    k: float, tau: float, samples: int, axis_ratio: float, rng: np.random.Generator
) -> float:
    """Share of records whose horizontal error reaches K major axes at least once."""
    correlation = math.exp(-1 / tau)
    step = math.sqrt(1 - correlation**2)
    x, y = rng.standard_normal((2, RECORDS))
    hit = np.hypot(x, axis_ratio * y) >= k
    for _ in range(samples - 1):
        x = correlation * x + step * rng.standard_normal(RECORDS)
        y = correlation * y + step * rng.standard_normal(RECORDS)
        hit |= np.hypot(x, axis_ratio * y) >= k
    return float(hit.mean())


def main() -> None:
    rng = np.random.default_rng(1)
    print("axis_ratio   K  tau/dt  samples  simulated  rel_se     ar1  siegmund")
    for axis_ratio in (0.3, 0.5, 0.8, 0.95):
        for k, tau, samples in CASES:
            share = simulated_risk(k, tau, samples, axis_ratio, rng)
            error = math.sqrt((1 - share) / (share * RECORDS))
            exposure = Exposure(samples, tau, 1, axis_ratio=axis_ratio)
            off = [f(k, exposure) / share - 1 for f in (ar1_risk, siegmund_risk)]
            print(
                f"{axis_ratio:10g} {k:3g} {tau:7g} {samples:8d} {share:10.4f} {error:7.3f} "
                f"{off[0]:+7.3f} {off[1]:+9.3f}"
            )


if __name__ == "__main__":
    main()
