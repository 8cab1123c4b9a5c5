"""The demonstrated bound holds the true rate as often as it says, from simulation to verdict."""

from __future__ import annotations

import numpy as np

from sbas.estimate import Estimate
from sbas.integrity.failure_rates import failure_rate
from sbas.laboratory import LaboratorySettings, simulate
from sbas.truth import FixedPoint

RECORDS, RATE_PER_H = 100, 0.15


def test_the_upper_bound_covers_in_records_with_injected_failures() -> None:
    uppers, events = [], []
    for seed in range(RECORDS):
        lab = LaboratorySettings(
            hours=20.0,
            interval_s=15.0,
            seed=seed,
            failure_rate_per_h=RATE_PER_H,
            failure_duration_s=(30.0, 30.0),
            # Short: the bound counts events and needs no tau, whose simulation is the cost here.
            decorrelation_time_s=4.0,
            sbas_frames=False,
        )
        truth = FixedPoint(lab.lat_deg, lab.lon_deg, lab.height_m, frame="simulated")
        found = failure_rate(simulate(lab), truth=truth, alert_limit_m=25.0).evidence
        assert isinstance(found.demonstrated, Estimate)
        uppers.append(found.demonstrated.upper)
        events.append(found.events)
    upper = np.array(uppers, float)
    # Three failures are expected; the mean of 100 counts has a standard error of 0.17.
    assert abs(np.mean(events) - 3.0) < 0.5
    assert np.mean(upper >= RATE_PER_H) >= 0.935
    # A bound that covers by being endless would be worthless: for three events it is 2.6 times.
    assert np.median(upper / RATE_PER_H) < 3.0
