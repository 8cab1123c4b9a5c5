"""Alternating receivers are found in noise and in motion; noise and motion alone are none."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.input_check.alternation import Alternation
from sbas.recording import Recording
from sbas.recording_survey import epoch_rows
from tests.input_check.damages import changed, rows, timed
from tests.input_check.journeys import journey, standing


def alternates(recording: Recording) -> bool:
    watch = Alternation()
    for part in epoch_rows(recording, watch.COLUMNS):
        watch.update(part)
    return bool(list(watch.judgements()))


@pytest.mark.parametrize("sigma_m", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("step_s", [1.0, 0.1])
def test_noise_of_any_size_is_no_second_receiver(sigma_m: float, step_s: float) -> None:
    for seed in range(5):
        train, _ = journey(1500, seed, step_s=step_s)
        rng, t, n = np.random.default_rng(seed), train.table, len(train)
        lat, lon = rng.normal(0, sigma_m, (2, n)) / 111_195
        noisy = changed(
            train, lat_deg=t["lat_deg"] + lat, lon_deg=t["lon_deg"] + lon,
            hpl_m=t["hpl_m"] * np.exp(rng.normal(0, 0.3, n)),
            hdop=(t["hdop"] * np.exp(rng.normal(0, 0.2, n))).round(1),
            n_sv=rng.integers(8, 12, n).astype("i2"),
        )  # fmt: skip
        assert not alternates(noisy)


@pytest.mark.parametrize("rounded_ms", [100, 1000])
def test_rounded_times_of_one_receiver_in_motion_are_no_second_one(rounded_ms: int) -> None:
    """Four epochs a second, written to a tenth of a second or to whole ones."""
    train, _ = journey(1500, step_s=0.25)
    ms = train.time.astype("M8[ms]").astype(np.int64) // rounded_ms * rounded_ms
    assert not alternates(timed(train, ms.astype("M8[ms]")))


def test_epochs_written_twice_are_no_second_receiver() -> None:
    train, _ = journey(600)
    assert not alternates(rows(train, np.repeat(np.arange(600), 2)))


@pytest.mark.parametrize("sigma_m", [0.05, 0.7])
def test_other_digits_and_another_level_are_two_receivers(sigma_m: float) -> None:
    roof = standing(600)
    other = np.arange(600) % 2 == 1
    lat = roof.table["lat_deg"] + np.random.default_rng(1).normal(0, sigma_m, 600) / 111_195
    hpl = roof.table["hpl_m"] * np.where(other, 1.2, 1.0)
    assert not alternates(changed(roof, lat_deg=lat, hpl_m=hpl))
    mixed = changed(roof, lat_deg=lat.where(~other, lat.round(6)).round(9), hpl_m=hpl)
    assert alternates(mixed)


def test_epochs_that_are_missing_here_and_there_hide_nothing() -> None:
    n = 1200
    roof = standing(n)
    aside = changed(roof, lat_deg=roof.table["lat_deg"] + (np.arange(n) % 2) * 20 / 111_195)
    lost = np.arange(n) % 97 == 50
    assert alternates(rows(aside, np.flatnonzero(~lost)))
