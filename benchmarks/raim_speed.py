"""Rate of RAIM: detection, HERL and slopes of 1e5 epochs x 12 satellites.

    python benchmarks/raim_speed.py

Best of five, after imports: wall time of this process, one core. Nothing is asserted.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.fault_detection import detect
from sbas.monitoring.levels import external_levels_m, level_columns
from sbas.monitoring.normal_equations import ranges
from sbas.monitoring.recording_monitor import CHUNK_EPOCHS
from sbas.monitoring.separation import SeparationBudget

EPOCHS, SATELLITES = 100_000, 12
DESIGN, BUDGET = MonitorDesign(), SeparationBudget()


def best(work: Callable[[], None], times: int = 5) -> float:
    """Shortest wall time [s]."""
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        taken.append(time.perf_counter() - start)
    return min(taken)


def main() -> None:
    rng = np.random.default_rng(0)
    shape = (SATELLITES, EPOCHS)
    elevation = np.rad2deg(np.arcsin(rng.uniform(0.09, 1, shape)))
    azimuth, sigma = rng.uniform(0, 360, shape), rng.uniform(0.5, 3, shape)
    residual = rng.normal(size=shape) * sigma
    clocks = {
        "one clock": np.zeros((SATELLITES, 1), int),
        "two clocks": np.arange(SATELLITES)[:, None] % 2,
    }

    def run(clock: NDArray[np.int64], *, everything: bool) -> None:
        for low in range(0, EPOCHS, CHUNK_EPOCHS):
            cut = slice(low, low + CHUNK_EPOCHS)
            y = residual[:, cut]
            given = ranges(
                elevation[:, cut], azimuth[:, cut], sigma[:, cut], clock=clock, residual_m=y
            )
            g = detect(given, y, DESIGN).geometry
            if everything:
                level_columns(g, DESIGN, BUDGET, 30.0)
            else:
                external_levels_m(g, DESIGN.shift)

    print(f"{EPOCHS:,} epochs x {SATELLITES} satellites")
    for name, clock in clocks.items():
        for everything, what in (
            (False, "detection, exclusion, HERL, VERL"),
            (True, "and slope, separation, along and across"),
        ):
            seconds = best(partial(run, clock, everything=everything))
            print(f"  {name}, {what}: {seconds:.3f} s")


if __name__ == "__main__":
    main()
