from __future__ import annotations

import numpy as np

from sbas.monitoring.raim_result import alarm_runs
from sbas.monitoring.recording_monitor import raim
from tests.monitoring.recordings import START, noisy


def test_runs_end_at_gaps_of_the_record() -> None:
    seconds = np.array([0, 1, 2, 3, 10, 11, 12])
    time = START + seconds * np.timedelta64(1, "s")
    event = np.array([True, True, False, True, True, True, False])
    assert alarm_runs(event, time) == 3
    assert alarm_runs(np.zeros(0, bool), time[:0]) == 0
    assert alarm_runs(np.ones(1, bool), time[:1]) == 1


def test_words_say_counts_and_levels() -> None:
    text = repr(raim(noisy(1, 8, 20)))
    assert "20 epochs, from the ranges" in text
    assert "herl_m" in text
    assert "passed" in text
