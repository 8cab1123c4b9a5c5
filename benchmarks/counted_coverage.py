"""Coverage of the demonstrated bound: 1000 simulated records with a known rate of failures.

    python benchmarks/counted_coverage.py [RECORDS]

Prints, for each true rate, how often the one-sided 95 % upper bound of the HMI rate holds the
truth, its median width, and what counting epochs instead of events would have given.
"""

from __future__ import annotations

import sys

import numpy as np

from sbas.estimate import Estimate
from sbas.integrity.counting import poisson_bounds
from sbas.integrity.evaluation import evaluate
from sbas.laboratory import LaboratorySettings, simulate
from sbas.truth import FixedPoint

HOURS, INTERVAL_S = 20.0, 5.0


def bounds(rate_per_h: float, records: int) -> tuple[np.ndarray, np.ndarray]:
    """(records, 2) upper bounds from events and from epochs, and (records,) event counts."""
    uppers, counts = [], []
    for seed in range(records):
        settings = LaboratorySettings(
            hours=HOURS,
            interval_s=INTERVAL_S,
            seed=seed,
            failure_rate_per_h=rate_per_h,
            sbas_frames=False,
        )
        truth = FixedPoint(settings.lat_deg, settings.lon_deg, settings.height_m, frame="simulated")
        result = evaluate(simulate(settings), truth=truth, alert_limits_m=(25.0,)).at(25.0)
        rate = result.rates["hmi"]
        assert isinstance(rate.demonstrated, Estimate)
        assert result.regions is not None
        by_epochs = poisson_bounds(result.regions["hmi"], rate.hours, 0.95)
        uppers.append((rate.demonstrated.upper, by_epochs.upper))
        counts.append(rate.events)
    return np.array(uppers), np.array(counts)


def main() -> None:
    records = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print(
        f"coverage {records} records of {HOURS:g} h every {INTERVAL_S:g} s, seeds 0..{records - 1}"
    )
    for rate in (0.025, 0.15, 0.8):
        upper, events = bounds(rate, records)
        held = np.mean(upper >= rate, axis=0)
        width = np.median(upper / rate, axis=0)
        print(
            f"coverage rate {rate:g}/h ({rate * HOURS:g} expected, {events.mean():.3f} found): "
            f"events {100 * held[0]:.1f} %, width {width[0]:.2f} x truth; "
            f"epochs {100 * held[1]:.1f} %, width {width[1]:.2f} x truth"
        )


if __name__ == "__main__":
    main()
