from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from sbas.exceptions import InputError
from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.normal_equations import geometry, ranges
from sbas.monitoring.range_faults import injected_faults
from sbas.monitoring.recorded_ranges import recorded_ranges
from tests.monitoring.recordings import noisy


def test_steps_are_found_as_often_as_the_noncentral_distribution_says() -> None:
    recording = noisy(4, 8, 50)
    given = recorded_ranges(recording)
    g = geometry(
        ranges(*(v[:, [0]] for v in (given.elevation_deg, given.azimuth_deg, given.sigma_m)))
    )
    design = MonitorDesign(false_alarm=1e-3)
    trials = 20_000
    found = injected_faults(
        recording, kinds=("step",), sizes_m=(8.0, 15.0), trials=trials, noise="modelled",
        design=design,
    ).table  # fmt: skip
    for size, row in zip((8.0, 15.0), found.itertuples(), strict=True):
        shift = size**2 * (g.weight * g.redundancy)[:, 0]
        share = ncx2.sf(chi2.isf(1e-3, 4), 4, shift).mean()
        assert row.detected / trials == pytest.approx(
            share, abs=4 * np.sqrt(share * (1 - share) / trials)
        )


def test_large_steps_are_excluded_and_small_ones_are_missed() -> None:
    found = injected_faults(noisy(5, 10, 100), kinds=("step",), sizes_m=(0.01, 500.0), trials=500)
    small, large = found.table.itertuples()
    assert small.missed > 480
    assert large.missed == 0
    assert large.detected == 500
    assert large.excluded_right > 400
    assert large.excluded_right + large.excluded_wrong <= 500


def test_two_faults_are_never_removed_by_one_exclusion() -> None:
    recording = noisy(6, 11, 100)
    one = injected_faults(recording, kinds=("two",), sizes_m=(80.0,), trials=300)
    assert one.table["excluded_right"].tolist() == [0]
    two = injected_faults(
        recording, kinds=("two",), sizes_m=(80.0,), trials=300, design=MonitorDesign(exclusions=2)
    )
    assert two.table["excluded_right"].iloc[0] > 100


def test_faster_ramps_are_found_sooner() -> None:
    table = injected_faults(
        noisy(7, 9, 200), kinds=("ramp",), rates_mps=(0.5, 5.0), trials=200, noise="modelled"
    ).table
    slow, fast = table["delay_median_s"]
    assert fast < slow
    assert table["detected"].iloc[1] > 150
    assert (table["trials"] <= 200).all()


def test_the_same_seed_gives_the_same_table() -> None:
    recording = noisy(8, 8, 40)
    first, again = (injected_faults(recording, trials=50, seed=7) for _ in range(2))
    assert first.table.equals(again.table)
    assert not first.table.equals(injected_faults(recording, trials=50, seed=8).table)
    json.dumps(first.to_dict(), allow_nan=False)


def test_recordings_that_test_nothing_are_refused() -> None:
    with pytest.raises(InputError, match="no epoch has a test"):
        injected_faults(noisy(1, 4, 5))
    for wrong in (
        {"kinds": ("else",)}, {"sizes_m": (0.0,)}, {"trials": 0}, {"noise": "none"},
    ):  # fmt: skip
        with pytest.raises(InputError):
            injected_faults(noisy(1, 8, 5), **wrong)  # type: ignore[arg-type]
