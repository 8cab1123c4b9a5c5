from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from sbas.exceptions import InputError
from sbas.monitoring import range_faults
from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.fault_detection import Detection, detect
from sbas.monitoring.normal_equations import Floats, Ranges, geometry, ranges
from sbas.monitoring.range_faults import injected_faults
from sbas.monitoring.recorded_ranges import recorded_ranges
from sbas.monitoring.verdicts import Verdict
from tests.monitoring.recordings import noisy, recording_of


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
    assert large.excluded_right + large.excluded_good <= 500
    # Of one faulty range there is no part.
    assert (small.excluded_part, large.excluded_part) == (0, 0)


def test_two_faults_are_never_removed_by_one_exclusion() -> None:
    recording = noisy(6, 11, 100)
    one = injected_faults(recording, kinds=("two",), sizes_m=(80.0,), trials=300)
    assert one.table["excluded_right"].tolist() == [0]
    # Whichever range goes, 80 m are left in: most of these trials do not pass.
    assert one.table["excluded_part"].iloc[0] + one.table["excluded_good"].iloc[0] < 150
    two = injected_faults(
        recording, kinds=("two",), sizes_m=(80.0,), trials=300, design=MonitorDesign(exclusions=2)
    )
    assert two.table["excluded_right"].iloc[0] > 100


@pytest.mark.parametrize("exclusions", [1, 2])
def test_exclusions_are_sorted_by_whom_they_hit(
    exclusions: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Counted again one trial at a time; without noise the residuals are the faults."""
    tried: list[tuple[set[int], set[int], bool]] = []

    def watched(given: Ranges, residual_m: Floats, design: MonitorDesign) -> Detection:
        found = detect(given, residual_m, design)
        for t, verdict in enumerate(found.verdict):
            faulty = {s for s, y in enumerate(residual_m[:, t]) if np.isfinite(y) and y != 0}
            out = {int(s) for s in found.excluded[:, t] if s >= 0}
            tried.append((faulty, out, bool(verdict == Verdict.PASSED_AFTER_EXCLUSION)))
        return found

    monkeypatch.setattr(range_faults, "detect", watched)
    side = noisy(9, 8, 60).side_tables["satellites"]
    elevation, azimuth, sigma = (
        side[name].to_numpy().reshape(8, 60) for name in ("elevation_deg", "azimuth_deg", "sigma_m")
    )
    row = injected_faults(
        recording_of(elevation, azimuth, sigma, np.zeros((8, 60))),
        kinds=("two",), sizes_m=(15.0,), trials=600, design=MonitorDesign(exclusions=exclusions),
    ).table.iloc[0]  # fmt: skip
    assert all(len(faulty) == 2 for faulty, _, _ in tried)
    after = [(faulty, out) for faulty, out, passed in tried if passed]
    right = sum(out == faulty for faulty, out in after)
    part = sum(out < faulty for faulty, out in after)
    good = sum(bool(out - faulty) for faulty, out in after)
    assert part > 20
    assert good > 20
    assert (right > 0) == (exclusions == 2)
    assert (row["excluded_right"], row["excluded_part"], row["excluded_good"]) == (
        right, part, good,
    )  # fmt: skip
    assert right + part + good == len(after)


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
    plain = json.loads(json.dumps(first.to_dict(), allow_nan=False))
    for row in plain["faults"]:
        told = ("excluded_right", "excluded_part", "excluded_good", "missed", "unavailable")
        assert sum(row[name] for name in told) <= row["trials"]


def test_recordings_that_test_nothing_are_refused() -> None:
    with pytest.raises(InputError, match="no epoch has a test"):
        injected_faults(noisy(1, 4, 5))
    for wrong in (
        {"kinds": ("else",)}, {"sizes_m": (0.0,)}, {"trials": 0}, {"noise": "none"},
    ):  # fmt: skip
        with pytest.raises(InputError):
            injected_faults(noisy(1, 8, 5), **wrong)  # type: ignore[arg-type]
