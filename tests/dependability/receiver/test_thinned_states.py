"""States along time: every epoch in its bin, the worst one seen, gaps empty."""

from __future__ import annotations

import numpy as np
import pytest

from sbas.dependability.receiver.state_estimation import receiver_states
from sbas.dependability.receiver.state_tally import CODES
from sbas.dependability.receiver.thinned_states import WORST_FIRST, state_strip
from sbas.exceptions import InputError
from tests.dependability.state_recordings import TRUTH, chain_states, state_recording

ROWS = [[0.97, 0.02, 0.01], [0.5, 0.45, 0.05], [0.1, 0.0, 0.9]]


def test_the_bins_hold_the_epochs_of_the_states_of_the_chain() -> None:
    recording = state_recording(chain_states(ROWS, 5000, 1))
    strip = state_strip(recording, truth=TRUTH, threshold_m=50)
    assert len(strip.counts) == 1000  # 5 s each: 1200 bins are the most
    assert np.all(strip.counts.sum(axis=1) == 5)
    whole = receiver_states(recording, truth=TRUTH, threshold_m=50)
    assert {name: strip.epochs(name) for name in WORST_FIRST} == dict(whole.epochs)


def test_each_epoch_by_hand() -> None:
    # correct, wrong, no fix, hardware, wait after it, correct, lost by the logger.
    strip = state_strip(state_recording("1234315"), truth=TRUTH, threshold_m=50)
    seen = [CODES[row.argmax()] for row in strip.counts]
    assert seen == ["correct", "wrong", "missing", "hardware", "first_fix_wait", "correct",
                    "unknown"]  # fmt: skip
    assert [WORST_FIRST[i] for i in strip.worst] == seen
    two = state_strip(state_recording("1234315"), truth=TRUTH, threshold_m=50, bins=2)
    assert [WORST_FIRST[i] for i in two.worst] == ["wrong", "first_fix_wait"]
    assert two.share("correct").tolist() == pytest.approx([1 / 4, 1 / 3])
    assert (two.end_ns - two.begin_ns) / 1e9 == 8


def test_a_gap_is_empty_and_one_wrong_epoch_is_not_lost() -> None:
    seconds = np.r_[0:5000, 9000:14000]
    states = np.ones(10_000, int)
    states[7777] = 2
    strip = state_strip(state_recording(states, seconds=seconds), truth=TRUTH, threshold_m=50)
    begin = np.arange(len(strip.counts)) * (strip.end_ns - strip.begin_ns) / 1e9 / len(strip.counts)
    assert np.array_equal(strip.worst < 0, (begin >= 5000) & (begin < 8989))
    assert np.isnan(strip.share("wrong")[strip.worst < 0]).all()
    (hit,) = np.flatnonzero(strip.worst == WORST_FIRST.index("wrong"))
    assert begin[hit] <= 11_777 < begin[hit + 1]


def test_without_truth_there_are_no_states() -> None:
    with pytest.raises(InputError, match="no truth"):
        state_strip(state_recording("12"), truth=None, threshold_m=50)
    with pytest.raises(InputError, match="threshold"):
        state_strip(state_recording("12"), truth=TRUTH, threshold_m=0)
