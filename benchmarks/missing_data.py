"""The treatments of missing data of Railways 2014, Table 1, at the end of an outage.

    python -m benchmarks.missing_data

Architecture 1 with its fault-free weights, 20000 runs, seed 1. Prints for each treatment the mean
size of the fused error at 100 s with its 95 % half-width, and the middle 95 % of single runs,
after an outage of 10 and 40 s, without and with slips of the odometer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sbas.fusion import load_architecture, simulate_runs
from sbas.fusion.architecture.model import Bursts, Missing

RUNS, EPOCHS = 20_000, 100
FAULT_FREE = (0.3575, 0.1513, 0.4912)
TREATMENTS = {
    "removed, weights of the others kept": Missing("remove", renormalise=False),
    "removed, weights add up to 1": Missing("remove"),
    "last value held": Missing("hold"),
    "odometer's value": Missing("substitute", "odo"),
    "accelerometer's value": Missing("substitute", "acc"),
    "extrapolated by the odometer": Missing("extrapolate", "odo"),
}


def main() -> None:
    arch1 = load_architecture("arch1")
    slipping, acc, gps = arch1.sensors
    steady = replace(slipping, slip=Bursts(0.0, 3.0))  # type: ignore[call-arg]
    for words, odo in (("no slips", steady), ("slips", slipping)):
        for outage_s in (10, 40):

            def fixes(
                rng: np.random.Generator, runs: int, last: int = EPOCHS - outage_s
            ) -> NDArray[np.float64]:
                error = np.sqrt(0.5) * rng.standard_normal((EPOCHS, runs))
                error[last:] = np.nan
                return error

            for name, policy in TREATMENTS.items():
                case = replace(
                    arch1,
                    sensors=(odo, acc, replace(gps, missing=policy)),  # type: ignore[call-arg]
                    weights="fixed",
                    fixed_weights=FAULT_FREE,
                )
                found = simulate_runs(case, runs=RUNS, seed=1, sources={"gps": fixes})
                size = np.abs(found.output_error_m[-1])
                low, high = np.quantile(size, (0.025, 0.975))
                print(
                    f"{outage_s} s, {words}, {name}: {size.mean():.3f} "
                    f"± {1.96 * size.std() / np.sqrt(RUNS):.3f} m; {low:.2f} to {high:.2f} m"
                )


if __name__ == "__main__":
    main()
