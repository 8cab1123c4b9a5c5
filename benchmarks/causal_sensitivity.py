"""Sobol indices of P(output U) of architecture 1, against those of the methods page.

    python benchmarks/causal_sensitivity.py [RUNS]    # default 300

Seven parameters, 64 base points, 576 points of RUNS runs each, sub-step 0.2 s, fixed weights;
11 s on one core, and again with another seed to show what chance there is. The page (causal
analysis, section 8) gives total indices with half-widths of 95 %. Nothing is asserted.
"""

from __future__ import annotations

import sys
import time

from sbas.fusion.architecture.model import (
    Accelerometer,
    Architecture,
    Missing,
    Odometer,
    SatelliteReceiver,
)
from sbas.fusion.importance.parameter_sensitivity import (
    Parameter,
    sensitivity_to_parameters,
    unacceptable_share,
)

ARCHITECTURE = Architecture(
    "architecture 1",
    (
        Odometer("odometer"),
        Accelerometer("accelerometer"),
        SatelliteReceiver("gps", missing=Missing("extrapolate", "odometer")),
    ),
    weights="fixed",
    fixed_weights=(0.359, 0.159, 0.482),
    substep_s=0.2,
)
PAGE = {
    Parameter("gps.multipath.largest", 3.0, 12.0): ".42 +- .20",
    Parameter("gps.multipath.rate_per_s", 0.005, 0.05): ".34 +- .16",
    Parameter("odometer.slip.largest", 0.02, 0.12): ".16 +- .08",
    Parameter("odometer.slip.rate_per_s", 0.005, 0.04): ".09 +- .05",
    Parameter("odometer.scale_sd", 2e-4, 2e-3): "< .01",
    Parameter("accelerometer.bias_mps2", 1e-4, 1e-3): "< .01",
    Parameter("accelerometer.noise_mps2_per_rthz", 1e-3, 6e-3): "< .01",
}
"""Ranges and total indices of the page."""


def main(runs: int) -> None:
    for seed in (0, 1):
        start = time.perf_counter()
        found = sensitivity_to_parameters(
            ARCHITECTURE,
            tuple(PAGE),
            simulate=unacceptable_share(runs=runs, seed=seed),
            base_points=64,
            seed=seed,
        )
        print(found)
        for row, page in zip(found.rows, PAGE.values(), strict=True):
            ours = f"{row.total:.3f} +- {row.total_half_width:.3f}"
            print(f"  {row.path:36} ST {ours:16} page {page}")
        print(f"{time.perf_counter() - start:.0f} s\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
