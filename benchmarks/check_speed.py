"""Time of `sbas check` on 3e5 epochs, the whole process from a file, and of its parts.

Run: python benchmarks/check_speed.py. Prints the best of three and the target.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

import sbas
from sbas.input_check import check
from sbas.laboratory import bundled_settings
from sbas.logs.registry import formats
from sbas.recording_survey import survey

EPOCHS = 300_000
TARGET_S = 3.0


def best_of_three(run: Callable[[], object]) -> float:
    times = []
    for _ in range(3):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def whole_process(path: Path) -> None:
    code = (
        f"import sys; sys.argv = ['sbas', 'check', {str(path)!r}]; import sbas.cli; sbas.cli.main()"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def main() -> None:
    settings = replace(bundled_settings(), hours=EPOCHS / 3600)
    recording = sbas.simulate(settings)
    point = sbas.FixedPoint(settings.lat_deg, settings.lon_deg, settings.height_m, frame="its own")
    way = recording.table[["lat_deg", "lon_deg", "height_m"]]
    # A trajectory that moves: the worst case for the search of a lag.
    east = np.cumsum(np.full(len(way), 2e-4)) % 0.5
    moving = recording.replace(table=recording.table.assign(lon_deg=way["lon_deg"] + east))
    track = sbas.Trajectory(way.assign(lon_deg=way["lon_deg"] + east), frame="its own")
    for what, run in (
        ("survey alone", lambda: survey(recording)),
        ("check", lambda: check(recording)),
        ("check, fixed point", lambda: check(recording, truth=point)),
        ("check, trajectory", lambda: check(moving, truth=track)),
    ):
        print(f"{what:24s} {best_of_three(run):6.2f} s in memory")
    with tempfile.TemporaryDirectory() as folder:
        for form in formats():
            if form.write is None:
                continue
            path = Path(folder) / f"lab{form.extensions[0]}"
            form.write([recording], path)
            print(f"{form.name:24s} {best_of_three(lambda p=path: whole_process(p)):6.2f} s "  # type: ignore[misc]
                  f"whole process, target {TARGET_S:g} s")  # fmt: skip


if __name__ == "__main__":
    main()
