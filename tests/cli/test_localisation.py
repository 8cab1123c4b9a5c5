"""The verbs states and depend as their users and programs meet them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from sbas.logs.arrow import parquet
from tests.cli.test_verbs import Answer
from tests.plots.synthetic import synthetic_recording

TRUTH = ("--truth", "50.03,15.77,289.4", "--frame", "ITRF2014")


@pytest.fixture
def roof(tmp_path: Path) -> Path:
    parquet.write([synthetic_recording(4000)], tmp_path / "roof.parquet")
    return tmp_path / "roof.parquet"


def test_states_of_a_recording_go_into_the_fault_tree(
    capsys: pytest.CaptureFixture[str], roof: Path, tmp_path: Path
) -> None:
    answer = Answer(capsys, "states", roof, *TRUTH, "--threshold-m", "1.0", "--json")
    assert answer.code == 0
    assert set(answer.json) >= {"states", "transition", "markov_test"}
    states = tmp_path / "states.json"
    states.write_text(answer.out)
    refused = Answer(capsys, "depend", "galoroi", "--receiver", states)
    assert refused.code == 2
    assert "posterior" in refused.err
    solved = Answer(
        capsys, "depend", "galoroi", "--receiver", states, "--estimate", "posterior",
        "--mission", "10min", "--json",
    )  # fmt: skip
    assert solved.code == 0
    assert solved.json["mission_s"] == 600.0
    assert 0 < solved.json["top"]["mean_unavailability"] < 1
    assert any("receiver O" in note for note in solved.json["notes"])
    text = Answer(capsys, "states", roof, *TRUTH, "--threshold-m", "1.0").out
    assert "probability of the next state" in text


def test_states_without_truth_are_refused(capsys: pytest.CaptureFixture[str], roof: Path) -> None:
    answer = Answer(capsys, "states", roof, "--threshold-m", "1.0")
    assert answer.code == 2
    assert "--truth" in answer.err


def test_the_paper_in_all_environments(capsys: pytest.CaptureFixture[str]) -> None:
    plain = Answer(capsys, "depend", "galoroi", "--json").json
    tops = {
        name: environment["top"]["mean_unavailability"]
        for name, environment in plain["environments"].items()
    }
    # Nguyen, Beugin, Marais 2013, Table II; Monte Carlo there, exact here.
    assert tops == pytest.approx(
        {"urban": 1.65e-4, "tunnel": 1.53e-2, "woody": 7.59e-2, "cutting": 7.17e-4}, rel=0.008
    )
    assert any("printed" in finding["message"] for finding in plain["findings"])


def test_first_passage_and_simulation(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("depend", "galoroi", "--environment", "woody", "--mission", "2min", "--first-passage")
    answer = Answer(capsys, *asked, "--check", "simulate", "--histories", "20000")
    assert answer.code == 0
    assert "simulation of 20,000 histories agrees" in answer.out
    assert "at least once" in answer.out


def test_the_misprint_is_refused_unless_wanted(capsys: pytest.CaptureFixture[str]) -> None:
    misprint = ("depend", "galoroi", "--environment", "urban", "--set", "k=2", "--set", "l=6")
    answer = Answer(capsys, *misprint)
    assert answer.code == 2
    assert "Table I" in answer.err
    overridden = Answer(capsys, *misprint, "--override-rules", "--json")
    assert overridden.code == 0
    # As printed, the urban unit fails 1.65e-2 of the time instead of 1.65e-4.
    assert overridden.json["top"]["mean_unavailability"] == pytest.approx(1.65e-2, rel=0.01)


@pytest.mark.parametrize(
    "arguments",
    [
        ("nowhere.toml",), ("galoroi", "--environment", "moon"), ("galoroi", "--set", "k"),
        ("galoroi", "--mission", "soon"), ("galoroi", "--mission", "-1h"),
        ("galoroi", "--set", "unknown=3"), ("galoroi", "--receiver", "states-not-there.json"),
    ],
)  # fmt: skip
def test_impossible_questions_end_in_exit_2(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...]
) -> None:
    answer = Answer(capsys, "depend", *arguments)
    assert answer.code == 2
    assert answer.err


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"threshold_m": "x"}', "\x00"])
def test_states_that_are_none_end_in_exit_2(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, content: str
) -> None:
    file = tmp_path / "states.json"
    file.write_text(content)
    assert Answer(capsys, "depend", "galoroi", "--receiver", file).code == 2


def test_static_trees_use_the_same_keys(
    capsys: pytest.CaptureFixture[str], reference_data: Path
) -> None:
    tree = reference_data / "reference/fault_trees/chinese.xml"
    plain = Answer(capsys, "depend", tree, "--json").json
    # Exact by another BDD program; published 1.17058e-3 (Aralia).
    assert plain["top"]["at_end"] == pytest.approx(0.0011705818107586692, rel=1e-12)
    assert json.dumps(plain["events"])
