"""Degradation parameters at epochs."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import correction_timeline
from tests.augmentation import encoding as enc


@pytest.mark.parametrize(("mode", "limit"), [("pa", 240), ("npa", 360)])
def test_parameters_time_out_at_their_exact_second(mode: Mode, limit: int) -> None:
    line = correction_timeline(enc.hourly({10: enc.degradation(c_er=6, rss_iono=1)}, 600))
    instants = line.reception.instants(enc.epochs_ns(10, 11, 10.12 + limit, 10.13 + limit))
    found = line.degradation(instants, mode=mode)
    assert found.missing.tolist() == [True, False, False, False]
    assert found.expired.tolist() == [False, False, False, True]
    assert found.valid.tolist() == [False, True, True, False]
    assert found.c_er_m.tolist() == [0, 3, 3, 0]
    assert found.rss_iono.tolist() == [0, 1, 1, 0]
    assert found.some(np.array([1, 3])).c_er_m.tolist() == [3, 0]


def test_without_type_10_everything_is_zero() -> None:
    line = correction_timeline(enc.hourly({}, 30))
    found = line.degradation(line.reception.instants(enc.epochs_ns(5, 6)), mode="pa")
    assert found.missing.all()
    assert not found.expired.any()
    assert found.c_iono_ramp_mps.tolist() == [0, 0]


def test_an_alarm_wipes_parameters_out() -> None:
    line = correction_timeline(enc.hourly({10: enc.degradation(c_er=6), 20: enc.alarm()}, 120))
    found = line.degradation(line.reception.instants(enc.epochs_ns(20, 21, 100)), mode="pa")
    assert found.missing.tolist() == [False, True, True]
