"""The verb multisensor as its users and programs meet it."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

import sbas
from sbas.bundled import bundled
from sbas.fusion import architecture_table, load_architecture, multisensor, presets
from sbas.fusion.architecture.architecture_fields import from_table
from sbas.fusion.architecture.architecture_files import dump_architecture
from sbas.fusion.states import NO_DATA, U
from sbas.laboratory.settings import LaboratorySettings
from tests.cli.test_verbs import Answer, stored
from tests.fusion.test_causal_analysis import SIMULATED, frequent_faults

Capture = pytest.CaptureFixture[str]
TRUTH = ("--truth", "50.03,15.77,289.4", "--frame", "ITRF2005 2009.7")
FEW = ("--runs", "60")


@pytest.fixture(scope="module")
def roof(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("roof") / "roof.parquet"
    settings = LaboratorySettings(hours=0.3, seed=3, error_scale=1.0, decorrelation_time_s=60.0)
    return stored(path, sbas.simulate(settings))


# --- the answer -------------------------------------------------------------------------------


def test_the_keys_that_others_rely_on(capsys: Capture) -> None:
    first = Answer(capsys, "multisensor", "arch1", *FEW, "--json", "--quiet")
    assert first.code == 0
    answer = first.json
    assert set(answer) >= {"combinations", "critical", "critical_time_s"}
    names = [row["combination"] for row in answer["combinations"]]
    assert set(answer["critical"]) == set(answer["critical_time_s"]) <= set(names)
    assert (answer["report"], answer["tree"]) == (None, None)
    library = multisensor("arch1", runs=60).to_dict()
    assert {key: answer[key] for key in library} == json.loads(json.dumps(library))
    again = Answer(capsys, "multisensor", "arch1", *FEW, "--json", "--quiet")
    assert again.out == first.out
    other = Answer(capsys, "multisensor", "arch1", *FEW, "--json", "--quiet", "--seed", "1")
    assert other.json["combinations"] != answer["combinations"]


def test_the_text_says_what_was_asked_and_what_is_wrong(capsys: Capture) -> None:
    answer = Answer(capsys, "multisensor", "arch1", "--runs", "300", "--seed", "3")
    assert answer.code == 0
    assert "300 runs of 100 s, step 1 s, seed 3; modelled" in answer.out
    assert "reaches U in" in answer.out
    assert "the step of 1 s is not shorter than the critical times found" in answer.out
    milder = Answer(capsys, "multisensor", "arch1", *FEW, "--target", "DA").out
    assert "reaches DA in" in milder
    assert "reaches U in" not in milder


# --- presets ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", presets())
def test_every_preset_is_described(name: str, capsys: Capture) -> None:
    answer = Answer(capsys, "multisensor", name, "--describe")
    assert answer.code == 0
    architecture = load_architecture(name)
    lines = answer.out.splitlines()
    assert lines[0] == architecture.name
    assert all(any(line.startswith(f"  {s}: ") for line in lines) for s in architecture.names)
    assert all(statement in answer.out for statement in architecture.reported)
    assert ("without an error model" in answer.out) == (name not in SIMULATED)
    table = Answer(capsys, "multisensor", name, "--describe", "--json").json
    assert from_table(table) == architecture


@pytest.mark.parametrize("name", sorted(set(presets()) - set(SIMULATED)))
def test_presets_without_a_model_are_refused_by_each_sensor(name: str, capsys: Capture) -> None:
    table = tomllib.loads(bundled("architectures", f"{name}.toml").read_text(encoding="utf-8"))
    modelled = {"odometer", "accelerometer", "imu", "gnss"}
    silent = [s["name"] for s in table["sensors"] if s["kind"] not in modelled]
    answer = Answer(capsys, "multisensor", name, *FEW)
    assert (answer.code, answer.out) == (2, "")
    assert "cannot be simulated" in answer.err
    assert silent
    assert all(f"sensors.{sensor}.kind" in "".join(answer.err.split("\n")) for sensor in silent)
    assert "cure:" in answer.err


# --- models that are wrong --------------------------------------------------------------------


def sensor(table: Any, name: str) -> Any:
    return next(s for s in table["sensors"] if s["name"] == name)


def unknown_sensor(table: Any) -> None:
    sensor(table, "gps")["missing"]["by"] = "odometre"


def weights(table: Any) -> None:
    table |= {"weights": "fixed", "fixed_weights": [0.5, 0.3, 0.1]}


def no_variance(table: Any) -> None:
    sensor(table, "acc").update(bias_mps2=0.0, walk_mps2_per_rts=0.0, noise_mps2_per_rthz=0.0)


def step(table: Any) -> None:
    table["step_s"] = 0.3


def substep(table: Any) -> None:
    table["substep_s"] = 0.3


def limits(table: Any) -> None:
    table["thresholds"]["nominal_m"] = 2.5


def unknown_key(table: Any) -> None:
    table["weight"] = "fault_free"


def no_receiver_kind(table: Any) -> None:
    sensor(table, "gps")["kind"] = "gps"


WRONG: dict[str, tuple[Any, tuple[str, ...]]] = {
    "a policy by an unknown sensor": (
        unknown_sensor, ("unknown sensor", "sensors.gps.missing.by", "odometre", "odo")),
    "weights that do not add up": (
        weights, ("do not add up to 1", "sum 0.9", "fixed_weights = [0.555555555556, ")),
    "zero variance": (
        no_variance, ("zero variance", "sensors.acc.", "noise_mps2_per_rthz above 0")),
    "a step that does not fit a second": (
        step, ("a second is not a multiple of the step", "step_s = 0.333333333333")),
    "a sub-step that does not fit": (substep, ("not a multiple of the sub-step", "substep_s =")),
    "a nominal bound at the alert limit": (limits, ("thresholds.nominal_m", "1.0 and 2.5")),
    "an unknown key": (unknown_key, ("unknown key", "weights")),
    "an unknown kind": (no_receiver_kind, ("unknown kind", "sensors.gps.kind", "gnss")),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_model_is_told_what_to_write(case: str, tmp_path: Path, capsys: Capture) -> None:
    spoil, words = WRONG[case]
    table = architecture_table(load_architecture("arch1"))
    spoil(table)
    path = tmp_path / "wrong.toml"
    path.write_text(toml(table), encoding="utf-8")
    answer = Answer(capsys, "multisensor", path, *FEW)
    assert (answer.code, answer.out) == (2, "")
    said = " ".join(answer.err.split())
    assert "wrong.toml" in said
    assert "cure: " in said
    for word in words:
        assert word in said


def toml(table: Any) -> str:
    """Plain tables as TOML, which is what `dump_architecture` would not write of a wrong one."""

    def value(item: Any) -> str:
        if isinstance(item, dict):
            return "{" + ", ".join(f"{k} = {value(v)}" for k, v in item.items()) + "}"
        if isinstance(item, list):
            return "[" + ", ".join(map(value, item)) + "]"
        return json.dumps(item)

    return "\n".join(f"{key} = {value(item)}" for key, item in table.items())


def test_no_file_no_preset_no_toml(tmp_path: Path, capsys: Capture) -> None:
    nearest = Answer(capsys, "multisensor", "arch1bi")
    assert nearest.code == 2
    assert "arch1bis" in nearest.err
    absent = Answer(capsys, "multisensor", tmp_path / "absent.toml")
    assert absent.code == 2
    assert "cannot be read" in absent.err
    (tmp_path / "broken.toml").write_text("schema = [", encoding="utf-8")
    broken = Answer(capsys, "multisensor", tmp_path / "broken.toml")
    assert broken.code == 2
    assert "no TOML" in broken.err
    assert Answer(capsys, "multisensor", "arch1", "--runs", "1").code == 2


# --- the fault tree ---------------------------------------------------------------------------


def test_the_tree_is_one_that_depend_loads(tmp_path: Path, capsys: Capture) -> None:
    """Its isU has the share of the simulated joint states within 5 %."""
    model, tree = tmp_path / "frequent.toml", tmp_path / "frequent.json"
    dump_architecture(frequent_faults(), model)
    written = Answer(capsys, "multisensor", model, "--runs", "600", "--tree", tree)
    assert written.code == 0
    assert f"tree  {tree}" in written.out
    solved = Answer(capsys, "depend", tree, "--json")
    assert solved.code == 0
    states = multisensor(frequent_faults(), runs=600, replicates=100).runs.sensor_state
    joint = ((states == U) | (states == NO_DATA)).all(axis=0).mean()
    events = solved.json["events"]
    assert events["isU"]["mean_unavailability"] == pytest.approx(joint, rel=0.05)
    assert solved.json["top"]["mean_unavailability"] >= events["isU"]["mean_unavailability"]


def test_outputs_that_would_be_lost_are_refused_before_the_simulation(
    roof: Path, tmp_path: Path, capsys: Capture
) -> None:
    model = tmp_path / "own.toml"
    dump_architecture(load_architecture("arch1"), model)
    page = tmp_path / "page.json"
    truth = tmp_path / "truth.csv"
    truth.write_text("time,lat_deg,lon_deg,height_m\n", encoding="utf-8")
    recorded = ("--recording", roof, "--azimuth", "90")
    for options, words in (
        (("--report", model), "overwrite an input"),
        ((*recorded, *TRUTH, "--report", roof), "overwrite an input"),
        ((*recorded, "--truth", truth, "--report", truth), "overwrite an input"),
        (("--tree", tmp_path / "tree.xml"), "tree.json"),
        (("--tree", page, "--report", page), "name two files"),
    ):
        before = {path: path.read_bytes() for path in (model, roof, truth)}
        answer = Answer(capsys, "multisensor", model, *FEW, *options)
        assert (answer.code, answer.out) == (2, "")
        assert words in answer.err
        assert {path: path.read_bytes() for path in before} == before
    assert not page.exists()
    nowhere = Answer(
        capsys, "multisensor", "arch1", "--runs", "300", "--tree", tmp_path / "a" / "tree.json"
    )
    assert nowhere.code == 2
    assert "folder that exists" in nowhere.err


# --- a receiver of one's own ------------------------------------------------------------------


def test_a_recording_stands_for_the_receiver(roof: Path, tmp_path: Path, capsys: Capture) -> None:
    page = tmp_path / "roof.html"
    asked = ("multisensor", "arch1bis", *FEW, "--recording", roof, *TRUTH, "--azimuth", "90")
    answer = Answer(capsys, *asked, "--json", "--quiet", "--report", page)
    assert answer.code == 0
    counts = answer.json["recorded"]["counts"]
    states = Answer(capsys, "states", roof, *TRUTH, "--threshold-m", "2.5", "--json").json
    wrong = counts["hazard"] + counts["detected"] + counts["no_level_u"]
    assert states["states"]["wrong"]["epochs"] == wrong > 50
    assert answer.json["resampled"]["kind"] == "replay"
    assert answer.json["resampled"]["recorded_u_share"] > 0
    assert answer.json["report"] == str(page)
    assert "The recorded receiver" in page.read_text(encoding="utf-8")
    blocks = Answer(capsys, *asked, "--resampling", "block_bootstrap")
    assert blocks.code == 0
    assert "block bootstrap" in blocks.out
    assert "roof.parquet" in blocks.out


def test_errors_without_sign_are_refused(roof: Path, capsys: Capture) -> None:
    recorded = ("multisensor", "arch1", *FEW, "--recording", roof)
    without_truth = Answer(capsys, *recorded, "--azimuth", "90")
    assert (without_truth.code, without_truth.out) == (2, "")
    assert "--truth LAT,LON,HEIGHT" in without_truth.err
    without_azimuth = Answer(capsys, *recorded, *TRUTH)
    assert (without_azimuth.code, without_azimuth.out) == (2, "")
    assert "direction of travel" in without_azimuth.err
    assert "azimuth" in without_azimuth.err.split("cure:")[1]


@pytest.mark.parametrize(
    "options", [TRUTH, ("--azimuth", "90"), ("--direction-above", "1"), ("--environments", "x.csv")]
)
def test_what_belongs_to_a_recording_is_refused_without_one(
    options: tuple[str, ...], capsys: Capture
) -> None:
    answer = Answer(capsys, "multisensor", "arch1", *FEW, *options)
    assert (answer.code, answer.out) == (2, "")
    assert "--recording FILE" in answer.err


def test_help_names_an_example(capsys: Capture) -> None:
    assert "Example:" in Answer(capsys, "multisensor", "--help").out


def test_what_cannot_be_written_is_refused_before_the_simulation(
    tmp_path: Path, capsys: Capture
) -> None:
    for option, name in (("--tree", "t.json"), ("--report", "r.html")):
        lost = Answer(capsys, "multisensor", "arch1", *FEW, option, tmp_path / "no" / name)
        assert lost.code == 2
        assert "no such folder" in lost.err
    (tmp_path / "a").mkdir()
    same = Answer(
        capsys, "multisensor", "arch1", *FEW, "--tree", tmp_path / "a" / ".." / "t.json",
        "--report", tmp_path / "t.json",
    )  # fmt: skip
    assert same.code == 2
    assert "one file" in same.err
    assert Answer(capsys, "multisensor", "arch1", *FEW, "--accept", "E12").code == 2
