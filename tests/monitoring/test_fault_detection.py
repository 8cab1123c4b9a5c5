from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.stats import chi2

from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.fault_detection import Detection, detect, w_test
from sbas.monitoring.normal_equations import adjust, geometry, ranges
from sbas.monitoring.slopes import bias_per_shift_m
from sbas.monitoring.verdicts import MonitorReason, Verdict
from tests.monitoring.skies import CASES, design_of, random_sky, refit, sky

PAGE = MonitorDesign(false_alarm=6.666667e-5, missed_detection=0.2, outlier_alarm=1e-3)
EPOCHS = 1_000_000
CHUNK = 1 << 13


def faulty(case: str, slot: int, bias_m: float) -> Detection:
    y = np.zeros(len(CASES[case][0]))
    y[slot] = bias_m
    return detect(sky(case, y), y[:, None], PAGE)


def test_five_satellites_detect_and_cannot_identify() -> None:
    found = faulty("A", 0, 10.0)
    assert found.statistic[0] == pytest.approx(25, rel=1e-9)
    assert found.w[:4, 0] == pytest.approx([5, -5, 5, -5], rel=1e-9)
    assert np.isnan(found.w[4, 0])
    assert found.verdict[0] == Verdict.DETECTED
    assert found.reason[0] == MonitorReason.ONE_SPARE
    assert found.detected[0]


def test_a_fault_that_does_not_show_is_not_passed_vertically() -> None:
    found = faulty("A", 4, 1000.0)
    assert found.statistic[0] == pytest.approx(0, abs=1e-18)
    assert found.adjustment.step_m[2, 0] == pytest.approx(-2000, rel=1e-9)
    assert found.verdict[0] == Verdict.PASSED
    assert not found.available_up[0]


def test_two_ranges_that_cannot_be_told_apart_are_both_kept() -> None:
    found = faulty("B", 0, 12.0)
    assert found.statistic[0] == pytest.approx(20.28718708, abs=5e-9)
    expected = [4.504130, -2.252065, -2.252065, -2.252065, 4.504130, -2.252065]
    assert found.w[:, 0] == pytest.approx(expected, abs=5e-7)
    assert found.verdict[0] == Verdict.AMBIGUOUS
    assert (found.excluded == -1).all()


def test_the_faulty_range_of_seven_is_removed() -> None:
    found = faulty("C", 0, 10.0)
    assert found.statistic[0] == pytest.approx(35.45735832, abs=5e-9)
    expected = [
        5.95460816,
        -4.19842907,
        2.44224998,
        -4.19842907,
        -2.28663053,
        3.12359539,
        -0.83696486,
    ]
    assert found.w[:, 0] == pytest.approx(expected, abs=5e-9)
    assert found.verdict[0] == Verdict.PASSED_AFTER_EXCLUSION
    assert found.excluded[0, 0] == 0
    assert found.adjustment.statistic[0] == pytest.approx(0, abs=1e-18)
    assert found.geometry.satellites[0] == 6
    assert found.available_up[0]


def test_without_leave_to_exclude_a_fault_is_only_detected() -> None:
    y = np.zeros((7, 1))
    y[0] = 10.0
    design = MonitorDesign(6.666667e-5, 0.2, 1e-3, exclusions=0)
    found = detect(sky("C", y[:, 0]), y, design)
    assert found.verdict[0] == Verdict.DETECTED
    assert (found.excluded == -1).all()


@pytest.mark.parametrize("satellites", [0, 3, 4])
def test_fewer_than_five_satellites_never_pass(satellites: int) -> None:
    rng = np.random.default_rng(satellites)
    e, a, s = random_sky(rng, satellites, 20)
    y = rng.normal(size=e.shape) * 1000
    found = detect(ranges(e, a, s, residual_m=y), y, MonitorDesign())
    assert (found.verdict == Verdict.NOT_AVAILABLE).all()
    assert (found.reason != MonitorReason.NONE).all()
    assert not found.detected.any()
    assert not found.available_up.any()


def test_a_second_constellation_needs_one_satellite_more() -> None:
    e, a, s = random_sky(np.random.default_rng(1), 5, 1)
    clock = np.array([0, 0, 0, 1, 1])[:, None]
    y = np.zeros((5, 1))
    two = detect(ranges(e, a, s, clock=clock, residual_m=y), y, MonitorDesign())
    assert two.verdict[0] == Verdict.NOT_AVAILABLE
    assert detect(ranges(e, a, s, residual_m=y), y, MonitorDesign()).verdict[0] == Verdict.PASSED


def test_exclusion_picks_what_brute_force_picks() -> None:
    """The smallest sum of squares of all subsets that lack one satellite, by refitting each."""
    rng = np.random.default_rng(12)
    s, n = 8, 120
    e, a, sigma = random_sky(rng, s, n)
    y = rng.normal(size=(s, n)) * sigma
    y[rng.integers(0, s, n), np.arange(n)] += rng.choice([-40.0, 40.0], n)
    design = MonitorDesign(largest_correlation=1.0, rival=1.0)
    found = detect(ranges(e, a, sigma, residual_m=y), y, design)
    excluded = np.flatnonzero(found.verdict == Verdict.PASSED_AFTER_EXCLUSION)
    assert excluded.size > 60
    for t in excluded:
        rows = design_of(e[:, t], a[:, t], np.zeros(s))
        sums = []
        for i in range(s):
            keep = np.arange(s) != i
            sums.append(refit(rows[keep], sigma[keep, t], y[keep, t])[1])
        assert found.excluded[0, t] == int(np.argmin(sums))
        assert found.adjustment.statistic[t] == pytest.approx(min(sums), rel=1e-8, abs=1e-9)
        assert min(sums) < chi2.isf(1e-3, 3)


def test_two_exclusions_leave_a_fix_that_passes() -> None:
    rng = np.random.default_rng(13)
    s, n = 10, 200
    e, a, sigma = random_sky(rng, s, n)
    y = rng.normal(size=(s, n)) * sigma * 0.3
    y[1], y[6] = y[1] + 60, y[6] - 45
    given = ranges(e, a, sigma, residual_m=y)
    one = detect(given, y, MonitorDesign(exclusions=1))
    two = detect(given, y, MonitorDesign(exclusions=2))
    passed = two.verdict == Verdict.PASSED_AFTER_EXCLUSION
    assert passed.sum() > (one.verdict == Verdict.PASSED_AFTER_EXCLUSION).sum()
    pairs = passed & (two.excluded[1] >= 0)
    assert pairs.sum() > 100
    for t in np.flatnonzero(pairs)[:20]:
        keep = ~np.isin(np.arange(s), two.excluded[:, t])
        rows = design_of(e[keep, t], a[keep, t], np.zeros(s - 2))
        statistic = refit(rows, sigma[keep, t], y[keep, t])[1]
        assert two.adjustment.statistic[t] == pytest.approx(statistic, rel=1e-7, abs=1e-9)
        assert statistic < chi2.isf(1e-3, 4)
    # The true pair is the best of all pairs far more often than not.
    right = (np.sort(two.excluded[:, pairs], axis=0) == [[1], [6]]).all(axis=0)
    assert right.mean() > 0.9
    assert len(list(combinations(range(s), 2))) == 45


def test_what_stays_faulty_has_failed_and_keeps_its_ranges() -> None:
    rng = np.random.default_rng(14)
    e, a, sigma = random_sky(rng, 9, 100)
    y = rng.normal(size=(9, 100)) * sigma * 30
    found = detect(ranges(e, a, sigma, residual_m=y), y, MonitorDesign())
    failed = np.isin(found.verdict, (Verdict.FAILED, Verdict.AMBIGUOUS))
    assert failed.sum() > 80
    assert (found.excluded[:, failed] == -1).all()
    assert (found.geometry.satellites[failed] == 9).all()
    assert found.detected[failed].all()


def many(rng: np.random.Generator, s: int, bias: str, design: MonitorDesign) -> tuple[int, int]:
    """Overall alarms and rejections of range 0 among 1e6 epochs of noise and a bias on it."""
    alarms = rejected = 0
    for low in range(0, EPOCHS, CHUNK):
        n = min(CHUNK, EPOCHS - low)
        # Skies repeat, noise does not.
        e, a, sigma = (np.tile(v, n // 1024 + 1)[:, :n] for v in random_sky(rng, s, 1024))
        g = geometry(ranges(e, a, sigma))
        y = rng.standard_normal((s, n)) * sigma
        if bias:
            size = design.shift if bias == "w" else float(design.bias(s - 4))
            y[0] += size * bias_per_shift_m(g)[0]
        found = adjust(g, y)
        alarms += int((found.statistic >= design.threshold(g.dof)).sum())
        rejected += int((np.abs(w_test(g, found)[0]) >= design.outlier_threshold).sum())
    return alarms, rejected


def within(count: int, share: float) -> bool:
    return abs(count - EPOCHS * share) < 4 * np.sqrt(EPOCHS * share * (1 - share))


@pytest.mark.parametrize("satellites", [5, 9])
def test_false_alarms_are_as_frequent_as_designed(satellites: int) -> None:
    design = MonitorDesign(false_alarm=1e-3, outlier_alarm=1e-3)
    alarms, rejected = many(np.random.default_rng(satellites), satellites, "", design)
    assert within(alarms, 1e-3)
    assert within(rejected, 1e-3)


def test_faults_of_the_stated_size_are_missed_as_often_as_designed() -> None:
    design = MonitorDesign(false_alarm=1e-3, missed_detection=0.01, outlier_alarm=1e-3)
    _, rejected = many(np.random.default_rng(21), 7, "w", design)
    assert within(EPOCHS - rejected, 0.01)
    alarms, _ = many(np.random.default_rng(22), 7, "overall", design)
    assert within(EPOCHS - alarms, 0.01)
