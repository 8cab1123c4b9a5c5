"""Epochs a second of ARAIM on one core.

    python benchmarks/araim_speed.py [EPOCHS]    # default 6000

24 satellites (12 GPS, 12 Galileo) in drawn directions, another geometry every epoch, airborne
dual-frequency sigmas. One fault at a time: 24 satellites and 2 constellations, 26 modes; two at
a time: 326 modes. Best of three, CPU time of this process, whatever threads it has. Nothing is
asserted.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from sbas.monitoring.araim_dual_frequency import dual_frequency_ranges
from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_protection import araim_levels
from sbas.monitoring.araim_settings import AraimSettings

SATELLITES = 24


def drawn(epochs: int) -> AraimGeometry:
    """Directions spread evenly over the sky above 5 deg."""
    rng = np.random.default_rng(20171115)
    height = rng.uniform(np.sin(np.deg2rad(5.0)), 1.0, (epochs, SATELLITES))
    return dual_frequency_ranges(
        np.rad2deg(np.arcsin(height)),
        rng.uniform(0.0, 360.0, (epochs, SATELLITES)),
        np.repeat(["G", "E"], SATELLITES // 2),
    )


def measured(
    label: str, geometry: AraimGeometry, settings: AraimSettings, **options: float
) -> None:
    best, result = np.inf, None
    for _ in range(3):
        start = time.process_time()
        result = araim_levels(geometry, settings=settings, **options)
        best = min(best, time.process_time() - start)
    assert result is not None
    print(
        f"{label:34} {geometry.shape[0] / best:8.0f} epochs/s, {int(np.median(result.modes)):4d} "
        f"modes, HPL {np.median(result.hpl_m):.2f} m, VPL {np.median(result.vpl_m):.2f} m"
    )


def main() -> None:
    epochs = int(sys.argv[1]) if len(sys.argv) > 1 else 6000
    geometry = drawn(epochs)
    one = AraimSettings(p_thres=1e-7)
    measured("one fault at a time", geometry, one)
    measured("one fault, along and across as well", geometry, one, heading_deg=30.0)
    few = drawn(max(epochs // 10, 1))
    measured("two faults at a time", few, AraimSettings())


if __name__ == "__main__":
    main()
