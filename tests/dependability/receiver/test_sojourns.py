"""Sources from recordings: the phases reproduce the law of the runs exactly."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sbas.dependability.exact.exact import solve
from sbas.dependability.receiver.sojourns import markov_source, semi_markov_source, sojourn_hazards
from sbas.dependability.receiver.state_estimation import ReceiverStates, receiver_states
from sbas.dependability.tree.model import MarkovSource
from sbas.exceptions import InputError
from tests.dependability.galoroi_tree import galoroi_tree
from tests.dependability.state_recordings import TRUTH, chain_states, state_recording

RECORD = "1112213331122211131112211333311123311"
ROWS = ((0.9, 0.08, 0.02), (0.5, 0.45, 0.05), (0.3, 0.1, 0.6))


def states_of(states: Any, **options: Any) -> ReceiverStates:
    return receiver_states(state_recording(states, **options), truth=TRUTH, threshold_m=50.0)


def sojourn_law(source: MarkovSource, state: str, longest: int) -> np.ndarray:
    """P(L = r), r = 1..longest, from the state's first phase, by the chain alone."""
    rows = np.array(source.rows)
    own = np.array([s == state for s in source.states])
    x = np.zeros(own.size)
    x[int(np.argmax(own))] = 1.0
    law = []
    for _ in range(longest):
        x = x @ rows
        law.append(float(x[~own].sum()))
        x[~own] = 0.0
    return np.array(law)


def test_phases_reproduce_the_runs_exactly() -> None:
    rng = np.random.default_rng(8)
    # Runs that no chain has: wrong lasts 1 or 7, missing 2 to 5, correct 3 or 20.
    states: list[int] = [3]
    for _ in range(400):
        states += [1] * int(rng.choice([3, 20])) + [2] * int(rng.choice([1, 7]))
        states += [3] * int(rng.integers(2, 6))
    states += [1]
    found = states_of(states)
    source = semi_markov_source(found, "gnss", step_s=1.0)
    assert np.array(source.rows).sum(axis=1) == pytest.approx(np.ones(len(source.states)))
    for i, name in enumerate(("correct", "wrong", "missing")):
        runs = found.chain.runs[i]
        total = sum(n for _, n in runs.completed)
        law = np.zeros(25)
        for length, n in runs.completed:
            law[length - 1] = n / total
        assert sojourn_law(source, name, 25) == pytest.approx(law, abs=1e-14)
    assert found.rejected
    # The jump matrix is the share of exits: correct always goes to wrong here.
    rows = np.array(source.rows)
    last_correct = source.states.count("correct") - 1
    assert rows[last_correct, source.states.index("wrong")] == 1.0
    # Share of time: mean runs 11.5, 4, 3.5 in turn.
    shares = [source.restart[source.states.index(s)] for s in ("correct", "wrong", "missing")]
    means = [
        sum(r * n for r, n in run.completed) / sum(n for _, n in run.completed)
        for run in found.chain.runs
    ]
    assert shares == pytest.approx([m / sum(means) for m in means], rel=1e-12)
    assert sum(source.restart) == pytest.approx(1.0)  # type: ignore[arg-type]


def test_beyond_the_last_phase_the_mean_is_kept() -> None:
    found = states_of(chain_states(ROWS, 5000, 2))
    runs = found.chain.runs[0].completed
    source = semi_markov_source(found, "gnss", step_s=1.0, ages=4)
    assert source.states.count("correct") == 4
    law = sojourn_law(source, "correct", 2000)
    total = sum(n for _, n in runs)
    for length in (1, 2, 3):
        seen = sum(n for r, n in runs if r == length) / total
        assert law[length - 1] == pytest.approx(seen, rel=1e-2)
    # One run was cut by the record's end, so the hazards are not quite the shares.
    mean = float(np.arange(1, 2001) @ law)
    assert mean == pytest.approx(sum(r * n for r, n in runs) / total, rel=1e-2)


def test_a_cut_run_counts_as_long_as_it_was_seen() -> None:
    """Wrong: ends after 1, after 3, and one cut after 2: at risk 3, 1, 1 epochs by age."""
    found = states_of("12112221122", seconds=[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10])
    assert found.chain.runs[1].censored == ((2, 1),)
    assert sojourn_hazards(found.chain, 1, 60) == pytest.approx([1 / 3, 0, 1])
    assert sojourn_hazards(found.chain, 1, 2) == pytest.approx([1 / 3, 1 / 2])


def test_a_markov_record_gives_about_the_same_chain_both_ways() -> None:
    found = states_of(chain_states(ROWS, 200_000, 9))
    source = semi_markov_source(found, "gnss", step_s=1.0, ages=5)
    chain = markov_source(found, "gnss", step_s=1.0)
    a = chain.rows[1][1]
    expected = (1 - a) * a ** np.arange(4)
    assert sojourn_law(source, "wrong", 4) == pytest.approx(expected, rel=0.05)


def test_the_first_order_source() -> None:
    found = states_of(RECORD)
    source = markov_source(
        found, "gnss", step_s=1.0, guard=("antenna",), first_fix_s=180.0, down="hardware"
    )
    assert source.states == ("correct", "wrong", "missing")
    assert source.rows[1] == (3 / 8, 4 / 8, 1 / 8)
    assert (source.guard, source.first_fix_s, source.down) == (("antenna",), 180.0, "hardware")
    posterior = markov_source(found, "gnss", step_s=1.0, estimate="posterior")
    assert posterior.rows[2] == pytest.approx((4.5 / 11.5, 0.5 / 11.5, 6.5 / 11.5))


def test_a_profile_of_environments() -> None:
    labels = ["open"] * 19 + ["town"] * 18
    found = states_of(RECORD, labels=labels)
    source = markov_source(
        found, "gnss", step_s=1.0, profile=[("town", 60.0), ("open", 30.0)], estimate="posterior"
    )
    assert [(s.label, s.seconds) for s in source.stages] == [("town", 60.0), ("open", 30.0)]
    assert source.stages[0].rows == source.rows
    town = markov_source(found, "g", step_s=1.0, environment="town", estimate="posterior")
    assert town.rows == source.rows
    assert source.rows != source.stages[1].rows


def test_what_is_refused() -> None:
    found = states_of(RECORD)
    with pytest.raises(InputError, match="consecutive epochs would mean another time"):
        markov_source(found, "g", step_s=0.5)
    with pytest.raises(InputError, match="at least one phase"):
        semi_markov_source(found, "g", step_s=1.0, ages=0)
    with pytest.raises(InputError, match="never seen to go on"):
        markov_source(states_of("1111"), "g", step_s=1.0)
    with pytest.raises(InputError, match="unknown estimate"):
        markov_source(found, "g", step_s=1.0, estimate="prior")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="from its begin to its end"):
        semi_markov_source(states_of("1122"), "g", step_s=1.0)
    with pytest.raises(InputError, match="names the environments itself"):
        markov_source(found, "g", step_s=1.0, environment="a", profile=[("a", 1.0)])


def test_runs_that_never_reach_k_give_no_ie5() -> None:
    """Wrong lasts 1 or 5 epochs: the first-order chain sees runs of 6, the record has none."""
    rng = np.random.default_rng(3)
    states = [3]
    for _ in range(300):
        states += [1] * int(rng.integers(1, 9)) + [2] * int(rng.choice([1, 5]))
        states += [3] * int(rng.integers(1, 3))
    found = states_of([*states, 1])
    means = []
    for make in (semi_markov_source, markov_source):
        source = make(found, "gnss", step_s=1.0, guard=("antenna", "receiver"), first_fix_s=180.0)
        tree = replace(galoroi_tree(), sources=(source,))
        means.append(solve(tree, names=("IE5",)).rows["IE5"].mean_unavailability)
    assert means[0] == 0.0
    assert means[1] > 1e-3
