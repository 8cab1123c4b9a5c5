"""Seconds for one exact exposure risk and one K factor.

python benchmarks/exposure_speed.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

from sbas.integrity.exposure.exposure import Exposure
from sbas.integrity.exposure.exposure_models import exposure_k, exposure_risk


def fastest(question: Callable[[], float]) -> float:
    """Least seconds of three runs."""
    seconds = []
    for _ in range(3):
        begin = time.perf_counter()
        question()
        seconds.append(time.perf_counter() - begin)
    return min(seconds)


def main() -> None:
    for tau_s in (360.0, 1500.0):
        hour = Exposure(3600.0, tau_s, 1.0)
        risk = fastest(partial(exposure_risk, 6.18, hour))
        k = fastest(partial(exposure_k, 5e-8, hour))
        print(f"exposure tau {tau_s:g} s: one exact risk {risk:.3f} s, one exact K {k:.3f} s")


if __name__ == "__main__":
    main()
