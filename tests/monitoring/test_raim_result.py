from __future__ import annotations

import numpy as np
import pytest

from sbas.monitoring.raim_result import alarm_runs, level_quantile, spread_of
from sbas.monitoring.recording_monitor import raim
from tests.monitoring.recordings import START, noisy, recording_of
from tests.monitoring.skies import CASES


def test_runs_end_at_gaps_of_the_record() -> None:
    seconds = np.array([0, 1, 2, 3, 10, 11, 12])
    time = START + seconds * np.timedelta64(1, "s")
    event = np.array([True, True, False, True, True, True, False])
    assert alarm_runs(event, time) == 3
    assert alarm_runs(np.zeros(0, bool), time[:0]) == 0
    assert alarm_runs(np.ones(1, bool), time[:1]) == 1


def test_words_say_counts_and_levels() -> None:
    text = repr(raim(noisy(1, 8, 20)))
    assert "20 epochs, computed here from the ranges" in text
    assert "herl_m" in text
    assert "passed" in text


def test_infinite_levels_are_never_left_out() -> None:
    """Five satellites of which the one in the zenith is critical: the height is unguarded."""
    azimuth, elevation = (np.repeat(np.array(v, float)[:, None], 3, 1) for v in CASES["A"])
    result = raim(recording_of(elevation, azimuth, 1.0, np.zeros((5, 3))))
    text = repr(result)
    assert "3 horizontally, 0 vertically" in text
    line = next(line for line in text.splitlines() if line.lstrip().startswith("verl_m"))
    assert "median infinite" in line
    assert "infinite at 3" in line
    plain = result.to_dict()
    assert (plain["available"], plain["available_vertical"]) == (3, 0)
    assert plain["verl_m"] == {"epochs": 3, "infinite": 3, "median": None, "p95": None, "max": None}


def test_quantiles_count_infinite_levels() -> None:
    values = np.array([1.0, np.inf, 3.0, np.nan, 2.0])
    assert level_quantile(values, 0.5) == 3.0  # of 1, 2, 3, inf: between 2 and 3 the larger
    assert level_quantile(values, 0.95) == np.inf
    assert level_quantile(np.array([1.0, 2.0, np.nan]), 0.5) == pytest.approx(1.5)
    assert np.isnan(level_quantile(np.array([np.nan]), 0.5))
    assert spread_of(values) == {"epochs": 4, "infinite": 1, "median": 3.0, "p95": None,
                                 "max": None}  # fmt: skip
