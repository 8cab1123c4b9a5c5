"""The question as a whole: `sbas.multisensor` from an architecture to figures others rely on."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import mpmath  # type: ignore[import-untyped]
import numpy as np
import pandas as pd
import pytest

import sbas
from sbas.dependability import depend
from sbas.exceptions import InputError, ModelError
from sbas.fusion import CausalAnalysis, load_architecture, multisensor, presets
from sbas.fusion.architecture.model import (
    Architecture,
    Odometer,
    SatelliteReceiver,
    Unmodelled,
)
from sbas.fusion.critical.critical_times import critical_times
from sbas.fusion.states import DA, NO_DATA, N, U, states_of
from sbas.laboratory.settings import LaboratorySettings
from sbas.recording import Recording
from sbas.truth import FixedPoint

SIMULATED = ("arch1", "arch1bis", "arch1ter", "arch2")
TRUTH = FixedPoint(50.03, 15.77, 289.4, frame="ITRF2005 2009.7")
FEW: dict[str, Any] = {"runs": 300, "replicates": 100}


@cache
def found(model: str = "arch1", seed: int = 0, target: Any = "U") -> CausalAnalysis:
    return multisensor(model, seed=seed, target=target, **FEW)


@cache
def laboratory() -> Recording:
    """18 minutes of large errors that last, with unacceptable ones among them."""
    return sbas.simulate(
        LaboratorySettings(hours=0.3, seed=3, error_scale=1.0, decorrelation_time_s=60.0)
    )


def of_laboratory(model: str = "arch1", **options: Any) -> CausalAnalysis:
    given: dict[str, Any] = {"recording": laboratory(), "truth": TRUTH, "azimuth_deg": 90.0}
    return multisensor(model, **{**FEW, **given, **options})


# --- figures that others rely on --------------------------------------------------------------


@pytest.mark.parametrize("model", SIMULATED)
def test_the_keys_that_others_rely_on(model: str) -> None:
    answer = json.loads(json.dumps(found(model).to_dict(), allow_nan=False))
    rows = {row["combination"]: row for row in answer["combinations"]}
    assert len(rows) == len(answer["combinations"])
    assert sum(row["epochs"] for row in rows.values()) == 300 * 100
    assert answer["critical"] == [n for n, row in rows.items() if row["verdict"] == "critical"]
    assert list(answer["critical_time_s"]) == answer["critical"]
    for name, times in answer["critical_time_s"].items():
        assert times["event_q05_s"] <= times["event_median_s"]
        assert all(times[key] == rows[name][key] for key in times)
    assert (answer["architecture"], answer["seed"], answer["target"]) == (model, 0, "U")
    assert answer["evidence"] == "modelled"
    assert answer["output"]["epochs"] == answer["runs"] * answer["epochs"] == 30_000


def by_hand(found: CausalAnalysis, worst: int) -> Mapping[str, tuple[int, int, int]]:
    """Episodes, those there at entry, and events, by walking through every run."""
    states, output = found.runs.sensor_state, found.runs.output_state
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    letters = {N: "N", DA: "D", U: "U", NO_DATA: "-"}
    for run in range(found.runs.runs):
        names = ["".join(letters[int(s)] for s in epoch) for epoch in states[:, :, run].T]
        reached = output[:, run] >= worst
        before, there, event = "", False, False
        for name, now in zip(names, reached, strict=True):
            if name != before:
                before, there, event = name, bool(now), False
                counts[name][0] += 1
                counts[name][1] += there
            elif now and not there and not event:
                event = True
                counts[name][2] += 1
    return {name: (n, entry, events) for name, (n, entry, events) in counts.items()}


@pytest.mark.parametrize("target", ["U", "DA"])
def test_events_are_those_of_a_walk_through_the_runs(target: Any) -> None:
    answer = found("arch1", 0, target)
    walked = by_hand(answer, U if target == "U" else DA)
    table = answer.critical.table
    assert set(table.index) == set(walked)
    for name, (episodes, there, events) in walked.items():
        row = table.loc[name]
        assert (row["episodes"], row["at_risk"], row["events"]) == (
            episodes, episodes - there, events,
        )  # fmt: skip
        assert row[f"p_{target.lower()}_at_entry"] == pytest.approx(there / episodes)
    assert sum(events for _, _, events in walked.values()) > 20
    assert f"reaches {target} in" in str(answer)


def test_a_degraded_output_is_reached_no_later_than_an_unacceptable_one() -> None:
    worse, milder = found().critical, found("arch1", 0, "DA").critical
    there = worse.table["p_u_at_entry"] <= milder.table["p_da_at_entry"]
    assert there.all()
    assert len(milder.critical) > len(worse.critical)


def test_the_same_seed_gives_the_same_digits_and_another_seed_others() -> None:
    once, again = found(), multisensor("arch1", seed=0, **FEW)
    assert once.to_dict() == again.to_dict()
    assert str(once) == str(again)
    assert once.to_dict() != found("arch1", 1).to_dict()


def test_the_answer_is_modelled_and_says_that_its_step_is_too_long() -> None:
    answer = found()
    assert "modelled" in str(answer).splitlines()[0]
    (step,) = [f for f in answer.findings if "not shorter than the critical times" in f.message]
    assert (step.code, step.where) == ("E28", "step_s")
    assert str(step) in str(answer)
    assert len(set(answer.findings)) == len(answer.findings)


# --- which architectures ----------------------------------------------------------------------


@pytest.mark.parametrize("name", presets())
def test_every_preset_is_simulated_or_refused_with_each_sensor_that_has_no_model(name: str) -> None:
    silent = [s.name for s in load_architecture(name).sensors if isinstance(s, Unmodelled)]
    assert bool(silent) == (name not in SIMULATED)
    if not silent:
        assert found(name).architecture.name == name
        return
    with pytest.raises(ModelError) as refused:
        multisensor(name, **FEW)
    assert all(sensor in refused.value.what for sensor in silent)
    assert all(f"sensors.{sensor}.kind" in refused.value.where for sensor in silent)
    assert "write kinds with a model" in refused.value.cure


def test_a_recording_is_no_model_of_the_other_sensors() -> None:
    with pytest.raises(ModelError, match="no error model for ins, tacho"):
        of_laboratory("3insat")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"runs": 1}, "several runs"),
        ({"seed": -1}, "seed must be 0"),
        ({"target": "X"}, "target"),
        ({"replicates": 5}, "replicates"),
        ({"resampling": "bootstrap"}, "replay or block_bootstrap"),
        ({"truth": TRUTH}, "truth without a recording"),
        ({"azimuth_deg": 90.0, "receiver": "gps"}, "azimuth_deg, receiver without a recording"),
    ],
)
def test_what_has_no_meaning_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as refused:
        multisensor("arch1", **{**FEW, **options})
    assert words in str(refused.value)
    assert refused.value.cure


# --- time to alert ----------------------------------------------------------------------------


def with_states(sensor: list[int], output: list[int], runs: int = 40) -> CausalAnalysis:
    """One sensor, half a second a step, every run the same."""
    states = np.tile(np.array(sensor, np.int8)[None, :, None], (1, 1, runs))
    fused = np.tile(np.array(output, np.int8)[:, None], (1, runs))
    critical = critical_times(states, fused, names=("gps",), step_s=0.5, replicates=100)
    return replace(found(), critical=critical)


def test_the_time_to_alert_is_the_shortest_of_all_combinations() -> None:
    # U lasts from epoch 2; the output follows at epoch 5: three steps of 0.5 s, in every run.
    late = with_states([N, N, U, U, U, U, U], [N, N, N, DA, DA, U, U])
    assert late.critical.critical == ("U",)
    assert late.time_to_alert_s == pytest.approx(1.5)
    # D comes first, for two steps.
    both = with_states([D := DA, D, D, U, U, U, U], [N, N, U, N, DA, DA, U])
    assert both.time_to_alert_s == pytest.approx(1.0)


def test_no_time_is_left_where_episodes_begin_unacceptable() -> None:
    # Never better than U: "always there", which is not critical, and leaves no time all the same.
    there = with_states([N, N, U, U], [N, N, U, U])
    assert there.critical.critical == ()
    assert there.critical.table.loc["U", "verdict"] == "always there"
    assert there.time_to_alert_s == 0


def test_there_is_no_time_to_alert_where_nothing_becomes_unacceptable() -> None:
    calm = with_states([N, N, DA, DA], [N, N, DA, DA])
    assert calm.time_to_alert_s is None
    assert calm.to_dict()["time_to_alert_s"] is None


# --- hardware ---------------------------------------------------------------------------------


def with_rates(answer: CausalAnalysis, rates: tuple[float, ...]) -> CausalAnalysis:
    """The answer on sensors whose hardware fails at these rates per hour."""
    sensors: Any = answer.architecture.sensors
    failing = tuple(
        replace(sensor, failure_rate_per_h=rate)
        for sensor, rate in zip(sensors, rates, strict=True)
    )
    return replace(answer, architecture=replace(answer.architecture, sensors=failing))


@pytest.mark.parametrize("rates", [(0.0, 0.0, 0.0), (1e-9, 2e-9, 4e-9), (1.0, 0.0, 30.0)])
def test_hardware_is_added_exactly(rates: tuple[float, ...]) -> None:
    """P(hazard or failed) = h + (1 - h)(1 - exp(-sum lambda T)), T = 100 s."""
    answer = found()
    failing = with_rates(answer, rates)
    with mpmath.workdps(40):
        one = [float(-mpmath.expm1(-mpmath.mpf(rate) * 100 / 3600)) for rate in rates]
        hazard = mpmath.mpf(answer.shares.hazard)
        survive = mpmath.exp(-mpmath.fsum(map(mpmath.mpf, rates)) * 100 / 3600)
        exact = float(1 - (1 - hazard) * survive)
    assert list(failing.hardware.values()) == pytest.approx(one, rel=1e-13, abs=0)
    assert failing.hazard_with_hardware == pytest.approx(exact, rel=1e-13)
    assert failing.hazard_with_hardware >= answer.shares.hazard > 0


# --- the fault tree ---------------------------------------------------------------------------


def frequent_faults() -> Architecture:
    """Architecture 1 with faults so frequent that few runs know the joint states well."""
    calm = load_architecture("arch1")
    sensors: Any = calm.sensors
    odometer, accelerometer, receiver = sensors
    return replace(
        calm,
        sensors=(
            replace(odometer, noise_mps=0.3, slip=replace(odometer.slip, rate_per_s=0.05)),
            replace(accelerometer, bias_mps2=2e-3),
            replace(receiver, multipath=replace(receiver.multipath, rate_per_s=0.05)),
        ),
    )


def test_the_tree_has_the_share_of_the_simulated_joint_states() -> None:
    """Within 5 %: ten stages and the prior of the rows are all that parts them."""
    answer = multisensor(frequent_faults(), runs=600, replicates=100)
    states = answer.runs.sensor_state
    lost = (states == U) | (states == NO_DATA)
    simulated = {
        "isU": lost.all(axis=0).mean(),
        "notN": (lost.any(axis=0) | (states != N).all(axis=0)).mean(),
    }
    assert simulated["isU"] > 0.01
    for condition, share in simulated.items():
        tree = answer.fault_tree(condition=condition, critical_at=None)  # type: ignore[arg-type]
        solution = depend(tree).solutions[tree.name]
        assert tree.top == condition
        assert solution.top.mean_unavailability == pytest.approx(share, rel=0.05)


def test_critical_combinations_become_gates_that_can_only_add() -> None:
    answer = found()
    assert answer.critical.critical
    tree = answer.fault_tree()
    rows = depend(tree).solutions[tree.name].rows
    lasting = [f"{name} or worse lasts" for name in answer.critical.critical]
    assert set(tree.cases) == {"isU", *lasting}
    for part in tree.cases:
        assert rows["TOP"].mean_unavailability >= rows[part].mean_unavailability
    at_entry = answer.fault_tree(critical_at="event_q05_s")
    assert depend(at_entry).solutions[tree.name].top.mean_unavailability <= rows[
        "TOP"
    ].mean_unavailability * (1 + 1e-12)


def test_a_tree_of_what_never_happened_is_refused() -> None:
    with pytest.raises(InputError, match="would mean not seen"):
        multisensor("arch1", runs=2, replicates=100).fault_tree(critical_at=None)


# --- a recording as the receiver --------------------------------------------------------------


def test_a_recording_takes_the_place_of_the_receiver() -> None:
    answer = of_laboratory()
    assert answer.recorded is not None
    recorded = states_of(answer.recorded.along_m)
    windows = np.lib.stride_tricks.sliding_window_view(recorded, 100)
    receiver = answer.runs.sensor_state[answer.runs.names.index("gps")]
    for run in receiver.T:
        assert (windows == run).all(axis=1).any(), "a run is no window of the recording"
    assert (receiver == U).any()
    # The other sensors draw as they did without a recording.
    others = [k for k, name in enumerate(answer.runs.names) if name != "gps"]
    np.testing.assert_array_equal(
        answer.runs.sensor_state[others], found().runs.sensor_state[others]
    )
    assert "errors along the track of laboratory, replay" in str(answer)
    assert json.loads(json.dumps(answer.to_dict(), allow_nan=False))["resampled"]["kind"] == (
        "replay"
    )


def test_unacceptable_is_what_the_receiver_states_call_wrong() -> None:
    answer = of_laboratory()
    assert answer.recorded is not None
    limit = answer.architecture.thresholds.alert_limit_m
    states = sbas.receiver_states(laboratory(), truth=TRUTH, threshold_m=limit)
    counts = answer.recorded.counts
    assert states.epochs["wrong"] == counts.hazard + counts.detected + counts.no_level_u > 100
    assert states.epochs["correct"] == counts.acceptable > 500
    assert states.epochs["missing"] == counts.no_data


@pytest.mark.parametrize("model", ["arch1bis", "arch2"])
def test_a_recording_serves_the_filter_and_three_axes(model: str) -> None:
    answer = of_laboratory(model, resampling="block_bootstrap", runs=50)
    assert answer.resampled is not None
    assert answer.resampled.kind == "block_bootstrap"
    assert len(answer.resampled.values) == answer.architecture.axes
    assert answer.shares.epochs == 5_000


@pytest.mark.parametrize(
    ("missing", "words"),
    [
        ({"truth": None}, ("no truth", "--truth")),
        ({"azimuth_deg": None}, ("direction of travel", "--azimuth")),
        ({"receiver": "odo"}, ("one satellite receiver", "--receiver gps")),
        ({"truth": None, "azimuth_deg": None}, ("no truth", "--truth")),
    ],
)
def test_errors_without_sign_are_refused_with_a_cure(
    missing: dict[str, Any], words: tuple[str, str]
) -> None:
    with pytest.raises(InputError) as refused:
        of_laboratory(**missing)
    assert words[0] in refused.value.what
    assert words[1] in refused.value.cure


def test_of_two_receivers_one_must_be_named() -> None:
    calm: Any = load_architecture("arch1")
    twin = replace(calm, sensors=(*calm.sensors, replace(calm.sensors[2], name="gps2")))
    options: dict[str, Any] = {
        **FEW, "recording": laboratory(), "truth": TRUTH, "azimuth_deg": 90.0,
    }  # fmt: skip
    with pytest.raises(InputError, match="one satellite receiver"):
        multisensor(twin, **options)
    assert multisensor(twin, receiver="gps2", **options).recorded is not None


def test_a_window_of_a_recording_begins_inside_what_lasts_there() -> None:
    answer = of_laboratory()
    runs, critical = answer.runs, answer.critical
    seen = critical_times(
        runs.sensor_state, runs.output_state, names=runs.names, step_s=runs.step_s,
        starts_fresh=False, replicates=100, convex=True,
    )  # fmt: skip
    assert critical.table["episodes"].tolist() == seen.table["episodes"].tolist()
    whole = critical_times(
        runs.sensor_state, runs.output_state, names=runs.names, step_s=runs.step_s, replicates=100
    )
    # One episode of each run is that with which it begins.
    assert whole.table["episodes"].sum() - critical.table["episodes"].sum() == answer.runs.runs


def test_the_tree_of_times_to_da_has_not_n_at_its_top() -> None:
    tree = found(target="DA").fault_tree(critical_at=None)
    assert tree.top == "notN"
    assert found().fault_tree(critical_at=None).top == "isU"


def test_a_condition_that_was_never_met_makes_no_tree() -> None:
    calm = replace(load_architecture("arch1"), duration_s=3.0)
    answer = multisensor(calm, runs=20, replicates=100)
    with pytest.raises(InputError, match="never"):
        answer.fault_tree()


def test_a_receiver_that_is_never_there_stops_nothing_but_importance() -> None:
    silent = replace(SatelliteReceiver("gps"), interval_s=200.0)
    arch1 = load_architecture("arch1")
    tunnel = replace(arch1, sensors=(*arch1.sensors[:2], silent))
    answer = multisensor(tunnel, **FEW)
    assert answer.importance is None
    assert answer.shares.no_data == 0
    assert [f.where for f in answer.findings if "importance" in f.message] == ["gps"]
    assert all(name.endswith("-") for name in answer.critical.table.index)
    assert json.loads(json.dumps(answer.to_dict(), allow_nan=False))["importance"] is None


def test_a_recording_tells_what_it_does_to_the_weights() -> None:
    answer = of_laboratory()
    told = [f.evidence for f in answer.findings if "weights of the fusion" in f.message]
    weights = dict(zip(answer.runs.names, answer.runs.weights[0], strict=True))
    assert told == [", ".join(f"{name} {weight:.3f}" for name, weight in weights.items())]
    assert weights["gps"] < found().runs.weights[0, 2]
    assert sum(weights.values()) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("sensors", "runs", "words"),
    [(13, 2, "at most 12 sensors"), (3, 100_000_000, "do not fit into the memory")],
)
def test_what_has_no_room_is_refused_before_it_is_simulated(
    sensors: int, runs: int, words: str
) -> None:
    many = tuple(Odometer(f"o{i}") for i in range(sensors - 1))
    with pytest.raises(InputError, match=words) as refused:
        multisensor(Architecture("wide", (*many, SatelliteReceiver("gps"))), runs=runs)
    assert refused.value.cure


def test_hardware_is_in_the_printed_answer_where_it_can_fail() -> None:
    arch1 = load_architecture("arch1")
    assert "hardware" not in str(found())
    fragile = replace(
        arch1, sensors=(replace(arch1.sensors[0], failure_rate_per_h=1.0), *arch1.sensors[1:])
    )
    answer = multisensor(fragile, **FEW)
    assert f"at most {answer.hazard_with_hardware:.2}"[:12] in str(answer)


def test_errors_of_a_recording_may_be_accepted_by_name() -> None:
    far = FixedPoint(50.04, 15.77, 289.4, frame="ITRF2005 2009.7")
    with pytest.raises(InputError) as refused:
        of_laboratory(truth=far)
    assert refused.value.code == "E12"
    answer = of_laboratory(truth=far, accept_findings=["E12"])
    assert answer.recorded is not None
    assert answer.recorded.counts.hazard + answer.recorded.counts.detected > 1000


def test_labels_do_not_part_a_replay_and_that_is_said() -> None:
    usual = laboratory()
    labels = pd.Categorical(["open"] * 500 + ["cutting"] * (len(usual) - 500))
    labelled = usual.replace(table=usual.table.assign(environment=labels))
    told = [f for f in of_laboratory(recording=labelled).findings if "environments" in f.message]
    assert [(f.code, set(f.evidence.split(", "))) for f in told] == [("E28", {"open", "cutting"})]
    assert not [f for f in of_laboratory().findings if "environments" in f.message]
