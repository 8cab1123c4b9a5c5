"""Receiver states of recordings with known states: counts, cuts, labels, refusals."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sbas.dependability.receiver import state_tally
from sbas.dependability.receiver.markov_tests import MarkovTest
from sbas.dependability.receiver.state_estimation import ReceiverStates, receiver_states
from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.position_error import position_errors
from sbas.recording import Flag, Recording
from sbas.truth import FixedPoint
from tests.dependability.state_recordings import TRUTH, chain_states, state_recording

RECORD = "1112213331122211131112211333311123311"
URBAN = ((0.95500, 0.03839, 0.00661), (0.68168, 0.31231, 0.00601), (0.74556, 0.04202, 0.21242))


def states_of(states: Any, *, threshold_m: float = 50.0, **options: Any) -> ReceiverStates:
    recorded = {k: options.pop(k) for k in ("labels", "seconds") if k in options}
    return receiver_states(
        state_recording(states, **recorded), truth=TRUTH, threshold_m=threshold_m, **options
    )


def test_the_record_of_the_reference_page() -> None:
    found = states_of(RECORD)
    assert found.chain.counts == ((11, 4, 3), (3, 4, 1), (4, 0, 6))
    assert isinstance(found.chain.order, MarkovTest)
    assert found.chain.order.statistic == pytest.approx(15.593090743, abs=5e-10)
    assert sum(n for _, n in found.chain.runs[1].completed) == 4
    assert found.chain.epochs[1] == 8
    assert found.chain.stay(1) == 0.5
    assert found.epochs == {
        "correct": 19, "wrong": 8, "missing": 10, "hardware": 0, "first_fix_wait": 0, "unknown": 0,
    }  # fmt: skip


def test_a_tie_with_the_threshold_is_wrong() -> None:
    recording = state_recording("1211")
    east_north = receiver_states(recording, truth=TRUTH, threshold_m=1.0)
    assert east_north.epochs["wrong"] == 1
    hpe = float(position_errors(recording, TRUTH)["hpe_m"].iloc[1])
    assert 100 < hpe < 120
    at = receiver_states(recording, truth=TRUTH, threshold_m=hpe)
    above = receiver_states(recording, truth=TRUTH, threshold_m=np.nextafter(hpe, np.inf))
    assert (at.epochs["wrong"], above.epochs["wrong"]) == (1, 0)


def test_a_logger_gap_is_cut_and_never_filled() -> None:
    seconds = [0, 1, 2, 3, 10, 11, 12, 13]
    found = states_of("11211121", seconds=seconds)
    assert found.cuts == 1
    assert found.chain.counts == ((2, 2, 0), (2, 0, 0), (0, 0, 0))
    assert found.epochs["missing"] == 0
    assert sum(np.ravel(found.chain.triples)) == 4


def test_hardware_faults_and_the_wait_after_them_are_no_states_of_the_chain() -> None:
    found = states_of("113144433313411")
    assert found.epochs["hardware"] == 4
    assert found.epochs["first_fix_wait"] == 3
    assert found.epochs["missing"] == 2
    assert found.chain.counts == ((2, 0, 2), (0, 0, 0), (1, 0, 0))
    # The wait goes on behind a gap, until a fix is seen.
    assert states_of("14311", seconds=[0, 1, 9, 10, 11]).epochs["first_fix_wait"] == 1


def test_unknown_epochs_and_declared_fixes() -> None:
    found = states_of("1151161")
    assert found.epochs["unknown"] == 1
    assert found.epochs["missing"] == 1
    assert found.chain.counts == ((2, 0, 1), (0, 0, 0), (1, 0, 0))
    assert {"E10", "E07"} <= {f.code for f in found.findings}


def test_a_fault_that_raim_found_is_missing_neither_correct_nor_wrong() -> None:
    recording = state_recording("1122" * 20)
    flags = recording.table["flags"].to_numpy().copy()
    flags[[1, 3]] |= np.uint32(Flag.RAIM_FAILED)
    found = receiver_states(
        recording.replace(table=recording.table.assign(flags=flags)), truth=TRUTH, threshold_m=50
    )
    assert "hence missing" in " ".join(f.message for f in found.findings)
    assert (found.epochs["correct"], found.epochs["wrong"], found.epochs["missing"]) == (39, 39, 2)


def test_missing_at_the_begin_is_told() -> None:
    found = states_of("3311333311", seconds=[0, 1, 2, 3, 20, 21, 22, 23, 24, 25])
    told = [f for f in found.findings if "without a fix open the record" in f.message]
    assert told
    assert told[0].message.startswith("6 epochs")
    assert not [f for f in states_of("1133").findings if "without a fix open" in f.message]


def test_environments_and_their_boundaries() -> None:
    states, labels = "1122113311", ["open"] * 5 + ["town"] * 5
    dropped = states_of(states, labels=labels)
    moved = states_of(states, labels=labels, boundary="destination")
    assert dropped.across_labels == moved.across_labels == 1
    assert dropped.chain_of("open").counts == ((1, 1, 0), (1, 1, 0), (0, 0, 0))
    assert dropped.chain_of("town").counts == ((1, 0, 1), (0, 0, 0), (1, 0, 1))
    assert moved.chain_of("open").counts == dropped.chain_of("open").counts
    assert moved.chain_of("town").counts == ((2, 0, 1), (0, 0, 0), (1, 0, 1))
    assert [np.sum(x.chain.counts) for x in (dropped, moved)] == [8, 9]
    assert [np.sum(x.chain.triples) for x in (dropped, moved)] == [6, 8]
    with pytest.raises(InputError, match="no environment 'wood'"):
        dropped.chain_of("wood")


def test_epochs_without_a_label_are_an_environment_of_their_own() -> None:
    found = states_of("111111", labels=["open", "open", "open", None, None, None])
    assert [c.label for c in found.environments] == ["(unlabelled)", "open"]
    assert [c.epochs[0] for c in found.environments] == [3, 3]
    assert any("no environment label" in f.message for f in found.findings)


def test_pooling_is_rejected_where_environments_differ() -> None:
    woody = ((0.819, 0.170, 0.011), (0.270, 0.724, 0.006), (0.385, 0.245, 0.370))
    states = [*chain_states(URBAN, 20_000, 1), *chain_states(woody, 20_000, 2)]
    labels = ["urban"] * 20_000 + ["woody"] * 20_000
    found = states_of(states, labels=labels)
    assert found.pooling_rejected
    assert found.chains == found.environments
    same = states_of(
        [*chain_states(URBAN, 20_000, 3), *chain_states(URBAN, 20_000, 4)], labels=labels
    )
    assert isinstance(same.pooling, MarkovTest)
    assert same.pooling.df == 6
    assert not same.pooling_rejected


def test_a_simulated_chain_is_recovered() -> None:
    found = states_of(chain_states(URBAN, 300_000, 11))
    for i, row in enumerate(found.chain.probabilities):
        assert row is not None
        for p, true in zip(row, URBAN[i], strict=True):
            assert abs(p - true) < 4 * np.sqrt(true * (1 - true) / found.chain.totals[i])
    assert not found.rejected
    law = found.chain.stationary()
    assert not isinstance(law, Refusal)
    assert law == pytest.approx(np.array([0.9388, 0.0529, 0.0083]), rel=0.06)


def test_the_answer_does_not_depend_on_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    states = chain_states(((0.7, 0.2, 0.1), (0.3, 0.5, 0.2), (0.3, 0.2, 0.5)), 300, 5)
    states[::97] = 4
    states[50::131] = 5
    seconds = np.arange(300) + np.cumsum(np.arange(300) % 113 == 60)
    labels = np.where(np.arange(300) // 70 % 2, "open", "town")
    whole = states_of(states, seconds=seconds, labels=labels)
    for rows in (2, 7, 64):
        monkeypatch.setattr("sbas.recording.BATCH_ROWS", rows)
        assert states_of(states, seconds=seconds, labels=labels) == whole


def test_rooms_beyond_the_cap_are_kept_as_the_cap(monkeypatch: pytest.MonkeyPatch) -> None:
    states = chain_states(((0.7, 0.2, 0.1), (0.3, 0.5, 0.2), (0.3, 0.2, 0.5)), 3000, 6)
    whole = states_of(states)
    monkeypatch.setattr(state_tally, "ROOM_CAP", 200)
    monkeypatch.setattr("sbas.recording.BATCH_ROWS", 50)
    assert states_of(states) == whole


@given(
    st.lists(st.integers(1, 5), min_size=2, max_size=60),
    st.lists(st.booleans(), min_size=60, max_size=60),
    st.lists(st.sampled_from(["a", "b"]), min_size=60, max_size=60),
    st.sampled_from(["drop", "destination"]),
)
def test_random_records_against_counting_by_hand(
    states: list[int], gaps: list[bool], labels: list[str], boundary: Any
) -> None:
    n = len(states)
    # An interval must be the median: gaps at every third epoch at most.
    gap = [g and i % 3 == 2 for i, g in enumerate(gaps[:n])]
    seconds = np.arange(n) + 5 * np.cumsum(gap)
    recording = state_recording(states, seconds=seconds, labels=labels[:n])
    known, waiting = [], False
    for s in states:
        waiting = s == 4 or (waiting and s in (3, 5))
        known.append(s if s in (1, 2) or (s == 3 and not waiting) else 0)
    if not any(known):
        with pytest.raises(InputError, match="no epoch has a known state"):
            receiver_states(recording, truth=TRUTH, threshold_m=50.0, boundary=boundary)
        return
    found = receiver_states(recording, truth=TRUTH, threshold_m=50.0, boundary=boundary)
    pairs, triples, chained = np.zeros((3, 3)), np.zeros((3, 3, 3)), 0
    for i in range(1, n):
        linked = known[i] and known[i - 1] and not gap[i]
        linked = linked and (boundary == "destination" or labels[i] == labels[i - 1])
        chained = chained + 1 if linked else 0
        if linked:
            pairs[known[i - 1] - 1, known[i] - 1] += 1
        if chained > 1:
            triples[known[i - 2] - 1, known[i - 1] - 1, known[i] - 1] += 1
    assert np.array_equal(found.chain.counts, pairs)
    assert np.array_equal(found.chain.triples, triples)
    assert sum(found.epochs.values()) == n
    assert sum(np.sum(c.counts) for c in found.environments) == pairs.sum()
    _check_runs(found, known, gap, labels)


def _check_runs(found: ReceiverStates, known: list[int], gap: list[bool], labels: Any) -> None:
    n = len(known)

    def linked(i: int) -> bool:
        return bool(
            0 < i < n and known[i] and known[i - 1] and not gap[i] and labels[i] == labels[i - 1]
        )

    ends: list[tuple[int, int]] = []
    cut: list[tuple[int, int]] = []
    for i in range(n):
        if linked(i) and known[i] != known[i - 1]:
            j = i + 1
            while linked(j) and known[j] == known[i]:
                j += 1
            (ends if linked(j) else cut).append((known[i], j - i))
    for kind, runs in (("completed", ends), ("censored", cut)):
        for state in (1, 2, 3):
            lengths = sorted(r for s, r in runs if s == state)
            counted = getattr(found.chain.runs[state - 1], kind)
            assert [r for r, c in counted for _ in range(c)] == lengths


def test_json_there_and_back() -> None:
    found = states_of(RECORD, labels=["a"] * 20 + ["b"] * 17)
    text = json.dumps(found.to_dict(), allow_nan=False)
    assert {"states", "transition", "markov_test"} <= set(json.loads(text))
    assert ReceiverStates.from_dict(json.loads(text)) == found
    broken = json.loads(text)
    broken["transition"]["counts"][0] = [1, -2, 3]
    with pytest.raises(InputError, match="no receiver states"):
        ReceiverStates.from_dict(broken)
    with pytest.raises(InputError, match="no receiver states"):
        ReceiverStates.from_dict({"states": 3})


def test_words_and_table() -> None:
    found = states_of(RECORD)
    assert "wrong 0 (up to 0.2589)" in str(found)
    table = found.summary()
    assert len(table) == 9
    assert table.loc[("all", "missing", "wrong"), "count"] == 0
    assert "never left" in str(states_of("1111"))


def test_without_truth_no_states() -> None:
    recording = state_recording("1121")
    own = FixedPoint(50.0, 15.0, 300.0, lower_bound=True)
    for truth in (None, own):
        with pytest.raises(InputError, match="E01") as error:
            receiver_states(recording, truth=truth, threshold_m=50.0)
        assert "lower bound" in str(error.value)


def test_a_recording_that_cannot_be_trusted_is_refused() -> None:
    recording = state_recording("1121", seconds=[0, 1, 1, 2])
    with pytest.raises(InputError, match="E05"):
        receiver_states(recording, truth=TRUTH, threshold_m=50.0)


def test_columns_that_the_source_lacks() -> None:
    table = state_recording("1121").table[["lat_deg", "lon_deg", "height_m"]]
    found = receiver_states(Recording(table), truth=TRUTH, threshold_m=50.0)
    assert any("no column hardware_fault" in f.message for f in found.findings)
    assert found.environments == ()


@pytest.mark.parametrize(
    "options",
    [
        {"threshold_m": 0.0}, {"threshold_m": float("nan")}, {"threshold_m": True},
        {"confidence": 1.0}, {"boundary": "share"}, {"tail_runs": 1}, {"tail_runs": 2.5},
    ],
)  # fmt: skip
def test_arguments_out_of_range(options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="out of range"):
        states_of("1121", **options)
