"""Availability and continuity: the method page's exact cases and a count by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.integrity.availability import Availability, availability, continuity_risk
from sbas.integrity.events import Runs, Stretch, find_runs
from sbas.recording_survey import Gaps

S = 1_000_000_000


def of_seconds(down: Runs, gaps: Gaps) -> Availability:
    """Availability of a 1 Hz record."""
    rows = int(np.sum(down.last - down.first + 1))
    return availability(
        down,
        gaps,
        up_ns=(down.rows - rows) * S,
        down_ns=rows * S,
        interval_ns=S,
        confidence=0.95,
        tau_s=None,
    )


def down_rows(up: str) -> tuple[np.ndarray, np.ndarray, int]:
    down = np.array([c == "0" for c in up])
    stretch = Stretch(np.arange(down.size) * S, int(1.5 * S))
    runs = find_runs(np.flatnonzero(down), stretch)
    return runs.first, runs.last + 1, down.size


@pytest.mark.parametrize(
    ("up", "risk"), [("11101111110011", 7 / 11), ("111011111100110", 9 / 11), ("000", 1.0)]
)
def test_continuity_risk_of_the_page_window_4(up: str, risk: float) -> None:
    first, stop, rows = down_rows(up)
    assert continuity_risk(first, stop, rows, 4) == pytest.approx(risk, rel=1e-15)


def test_continuity_risk_is_the_share_of_epochs_followed_by_a_loss_within_the_window() -> None:
    rng = np.random.default_rng(5)
    up = rng.random(2000) < 0.97
    window = 15
    # P(lost within W | up now), counted epoch by epoch.
    at_risk = sum(not up[i : i + window + 1].all() for i in np.flatnonzero(up))
    text = "".join("1" if u else "0" for u in up)
    first, stop, rows = down_rows(text)
    assert continuity_risk(first, stop, rows, window) == pytest.approx(
        at_risk / up.sum(), rel=1e-14
    )


def test_gaps_count_as_down_or_not_at_all() -> None:
    # 10 up, gap of 5 s, 4 up, 2 down, 4 up
    time = np.concatenate([np.arange(10), np.arange(15, 25)]) * S
    runs = find_runs(np.array([14, 15]), Stretch(time, int(1.5 * S)))
    gaps = Gaps(np.array([10]), np.array([9 * S]), np.array([15 * S]))
    result = of_seconds(runs, gaps)
    assert result.availability.value == pytest.approx(18 / 25)
    assert result.availability_excluding_gaps.value == pytest.approx(18 / 20)
    assert (result.losses, result.recoveries) == (2, 2)
    assert result.mttf.value == pytest.approx(18 / 3600 / 2)
    assert result.mttr is not None
    assert result.mttr.value == pytest.approx(7 / 3600 / 2)
    assert result.availability.evidence == "demonstrated"


def test_without_a_loss_the_mttf_is_its_lower_bound() -> None:
    stretch = Stretch(np.arange(7200) * S, int(1.5 * S))
    none = np.empty(0, np.int64)
    up = of_seconds(find_runs(none, stretch), Gaps(none, none, none))
    # ln 20 = 2.9957 expected losses would have shown one with 95 %.
    assert up.mttf.value == pytest.approx(2.0 / np.log(20), rel=1e-12)
    assert up.mttf.lower == up.mttf.value
    assert up.mttr is None


def test_a_gap_within_down_time_is_one_loss() -> None:
    time = np.array([0, 1, 2, 10, 11, 12]) * S
    runs = find_runs(np.array([2, 3]), Stretch(time, int(1.5 * S)))
    gaps = Gaps(np.array([3]), np.array([2 * S]), np.array([10 * S]))
    result = of_seconds(runs, gaps)
    assert (result.losses, result.recoveries) == (1, 1)


def test_never_down_is_bounded_by_the_effective_samples_of_the_record() -> None:
    # Clopper-Pearson with no failure in n = T/tau: lower limit alpha^(1/n), exact.
    first, stop, rows = np.empty(0, np.int64), np.empty(0, np.int64), 36_000
    stretch = Stretch(np.arange(rows) * S, int(1.5 * S))
    gaps = Gaps(first, stop, stop)
    runs = find_runs(first, stretch)
    found = availability(
        runs, gaps, up_ns=rows * S, down_ns=0, interval_ns=S, confidence=0.95, tau_s=360.0
    )
    for share in (found.availability, found.availability_excluding_gaps):
        assert share.value == 1.0
        assert share.lower == pytest.approx(0.05 ** (1 / 100), rel=1e-12)
        assert share.evidence == "demonstrated"


def test_gaps_lower_the_bound_that_counts_them_as_down() -> None:
    time = np.arange(36_000) * S
    time[20_000:] += 3600 * S
    stretch = Stretch(time, int(1.5 * S))
    gaps = Gaps(np.array([20_000]), time[19_999:20_000], time[20_000:20_001])
    runs = find_runs(np.arange(500, 530), stretch)
    found = availability(
        runs, gaps, up_ns=35_970 * S, down_ns=30 * S, interval_ns=S, confidence=0.95, tau_s=60.0
    )
    whole, without = found.availability, found.availability_excluding_gaps
    assert whole.value == pytest.approx(35_970 / 39_600, rel=1e-12)
    assert without.value == pytest.approx(35_970 / 36_000, rel=1e-12)
    assert whole.lower is not None
    assert without.lower is not None
    assert whole.lower < whole.value < without.lower < without.value
