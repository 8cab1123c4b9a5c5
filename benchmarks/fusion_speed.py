"""How many runs of 100 s with 1000 sub-steps the sensors and the Kalman filter make in a second.

    python -m benchmarks.fusion_speed

One core, architecture 1 with its defaults: odometer, accelerometer, GNSS. Prints runs per second
(the best of several batches) of the sensors' errors, of the batch filter with and without
outages, of whole simulations, and of numpy's normal numbers at the same moment: the sensors need
3200 of these a run and cannot be faster. Targets: the filter alone 30000 runs/s; 4000 runs/s for
sensors, weighted mean and states together.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    FilterTuning,
    Odometer,
    SatelliteReceiver,
)
from sbas.fusion.simulation.batch_filter import filtered_errors
from sbas.fusion.simulation.sensor_errors import draw_sensors
from sbas.fusion.simulation.simulated_runs import simulate_runs

ARCHITECTURE = Architecture(
    "arch1", (Odometer("odometer"), Accelerometer("accelerometer"), SatelliteReceiver("gnss"))
)
NORMALS_A_RUN = 3200
BATCHES = 7


def runs_per_s(runs: int, work: Callable[[], object]) -> float:
    best = 0.0
    for _ in range(BATCHES):
        begin = time.perf_counter()
        work()
        best = max(best, runs / (time.perf_counter() - begin))
    return best


def main() -> None:
    seed = np.random.SeedSequence(1)
    rng = np.random.default_rng(1)
    for runs in (1000, 2000):
        normals = np.empty((NORMALS_A_RUN, runs))
        limit = runs_per_s(runs, lambda out=normals: rng.standard_normal(out=out))  # type: ignore[misc]
        sensors = runs_per_s(runs, lambda n=runs: draw_sensors(ARCHITECTURE, n, seed))  # type: ignore[misc]
        print(
            f"{runs} runs a batch: sensors {sensors:.0f} runs/s "
            f"({1e6 / sensors:.0f} us a run; the normal numbers alone {1e6 / limit:.0f} us)"
        )
    for runs in (1000, 2000, 5000):
        drawn = draw_sensors(ARCHITECTURE, runs, seed)
        acceleration = drawn["accelerometer"].acceleration_error_mps2
        speed = drawn["odometer"].speed_error_mps
        assert acceleration is not None
        assert speed is not None
        fix = drawn["gnss"].error_m[0]
        for words, errors, gate in (
            ("outages", fix, None),
            ("outages and gate", fix, 6.63),
            ("a fix each second", np.nan_to_num(fix), None),
        ):
            tuning = FilterTuning(gate=gate)
            rate = runs_per_s(
                runs,
                lambda e=errors, u=tuning, a=acceleration, v=speed: filtered_errors(  # type: ignore[misc]
                    a, v, e, tuning=u, substep_s=0.1, substeps=10
                ),
            )
            print(f"{runs} runs a batch: filter, {words}: {rate:.0f} runs/s")
    rate = runs_per_s(4000, lambda: simulate_runs(ARCHITECTURE, runs=4000))
    print(f"weighted mean, the whole of simulate_runs: {rate:.0f} runs/s")


if __name__ == "__main__":
    main()
