"""Figures of one combination by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.fusion.critical.combination_figures import figures_of
from sbas.fusion.critical.episodes import extract_episodes
from sbas.fusion.critical.run_bootstrap import drawn_runs

# A run a column: T = 1, 1, 2, 2, 3, 3 with outcomes event, left, event, ended, left, event. The
# fourth is entered an epoch late, and its record ends two steps on.
SENSOR = ["DDDD", "DNNN", "DDDD", "NDDD", "DDDN", "DDDD"]
OUTPUT = ["NUUU", "NNNN", "NNUN", "NNNN", "NNNN", "NNNU"]
CODES = {"N": 0, "D": 1, "U": 2}


def figures(copies: int) -> tuple[dict[str, float], object]:
    sensor, output = (
        np.array([[CODES[c] for c in row] for row in rows * copies], np.int8).T
        for rows in (SENSOR, OUTPUT)
    )
    found = extract_episodes(sensor[np.newaxis], output, step_s=0.5)
    weights = drawn_runs(found.runs, replicates=200, seed=0)
    return figures_of(found, np.flatnonzero(found.key == 2), weights)


def test_the_hand_case_as_states() -> None:
    """F = 1/6, 1/3, 7/12 at 1, 2, 3 steps of 0.5 s; crude incidence 3/6 (by hand)."""
    row, curve = figures(copies=10)
    assert curve is not None
    np.testing.assert_allclose(curve.time_s, [0.5, 1.0, 1.5])
    np.testing.assert_allclose(curve.incidence, [1 / 6, 1 / 3, 7 / 12], rtol=1e-12)
    assert np.all(curve.lower < curve.incidence)
    assert np.all(curve.upper > curve.incidence)
    assert row["f_1s"] == pytest.approx(1 / 3)
    assert row["f_2s"] == pytest.approx(7 / 12), "by 1.5 s everything has come or left"
    assert (row["at_risk"], row["events"], row["episodes"]) == (60, 30, 60)
    assert row["incidence"] == 0.5
    # Epochs with output U while D lasts: 3 + 1 + 1 of 4 + 1 + 4 + 3 + 3 + 4.
    assert row["epochs"] == 190
    assert row["share_u"] == pytest.approx(5 / 19)
    # Times 0.5, 1, 1.5 s in equal shares.
    assert (row["event_q05_s"], row["event_median_s"], row["event_mean_s"]) == (0.5, 1.0, 1.0)
    assert row["reach_q05_s"] == 0.5
    assert row["event_mean_s_lower"] < 1.0 < row["event_mean_s_upper"]


def test_three_events_are_too_few() -> None:
    row, curve = figures(copies=1)
    assert curve is None
    assert row["events"] == 3
    assert np.isnan(row["event_mean_s"])
    assert np.isnan(row["reach_q05_s"])
    # Clopper-Pearson, 3 of 6: 0.118 and 0.882 (printed in tables).
    assert row["incidence_lower"] == pytest.approx(0.1181, abs=1e-4)
    assert row["incidence_upper"] == pytest.approx(0.8819, abs=1e-4)
