"""The command line as its users and their programs meet it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sbas.cli import main
from sbas.logs.arrow import parquet
from sbas.recording import Recording
from tests.examples import quiet, recording

TRUTH = ("--truth", "50.03,15.77,289.4", "--frame", "ITRF2014")


class Answer:
    """Exit code and output of one command."""

    def __init__(self, capsys: pytest.CaptureFixture[str], *arguments: object) -> None:
        with pytest.raises(SystemExit) as stop:
            main([str(a) for a in arguments])
        self.code = stop.value.code or 0
        self.out, self.err = capsys.readouterr()
        assert "Traceback" not in self.out + self.err
        assert "internal error" not in self.err

    @property
    def json(self) -> Any:
        return json.loads(self.out, parse_constant=lambda text: pytest.fail(f"{text} in JSON"))


@pytest.fixture
def roof(tmp_path: Path) -> Path:
    """A quiet hour."""
    return stored(tmp_path / "roof.parquet", quiet(3600))


def stored(path: Path, content: Recording) -> Path:
    parquet.write([content], path)
    return path


def test_kfactor(capsys: pytest.CaptureFixture[str]) -> None:
    answer = Answer(capsys, "kfactor", "--risk", "5e-9", "--json")
    assert answer.code == 0
    assert answer.json["k"] == pytest.approx(6.182851756998919, rel=1e-12)
    assert answer.json["per_sample_risk"] == 5e-9
    assert "6.18285" in Answer(capsys, "kfactor", "--risk", "5e-9").out
    two_sided = Answer(
        capsys, "kfactor", "--risk", "2e-9", "--distribution", "gaussian", "--json"
    ).json["k"]
    assert two_sided == pytest.approx(5.997807015, rel=1e-9)
    ellipse = Answer(
        capsys, "kfactor", "--risk", "5e-9", "--distribution", "ellipse", "--axis-ratio", "0.5",
        "--json",
    ).json["k"]  # fmt: skip
    assert ellipse == pytest.approx(5.871837, rel=1e-6)


@pytest.mark.parametrize(
    "arguments",
    [
        ("--risk", "0"),
        ("--risk", "nan"),
        ("--risk", "2"),
        ("--risk", "x"),
        ("--risk", "1e-9", "--distribution", "cauchy"),
        ("--risk", "1e-9", "--distribution", "ellipse"),
        ("--risk", "1e-9", "--dim", "2"),
        ("--allocation", "nowhere.toml"),
        (),
    ],
)
def test_kfactor_refuses_the_impossible(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...]
) -> None:
    answer = Answer(capsys, "kfactor", *arguments)
    assert answer.code == 2
    assert answer.out == ""
    assert answer.err


def test_the_allocation_trees(capsys: pytest.CaptureFixture[str]) -> None:
    text = Answer(capsys, "kfactor", "--allocation", "npa_do229").out
    assert "6.1828517" in text
    leaves = Answer(capsys, "kfactor", "--allocation", "pa_do229", "--json").json["leaves"]
    assert sorted(leaf["k"] for leaf in leaves) == pytest.approx([5.330393852, 5.997807015])


def test_plan(capsys: pytest.CaptureFixture[str]) -> None:
    answer = Answer(capsys, "plan", "--rate", "1e-7", "--confidence", "0.95", "--json")
    assert answer.json["hours"] == pytest.approx(2.99573e7, rel=1e-5)
    assert Answer(capsys, "plan", "--rate", "-1").code == 2


def test_evaluate(capsys: pytest.CaptureFixture[str], roof: Path, tmp_path: Path) -> None:
    page = tmp_path / "roof.html"
    answer = Answer(capsys, "evaluate", roof, *TRUTH, "--json", "--report", page)
    assert answer.code == 0
    plain = answer.json
    assert plain["epochs"] == 3600
    assert plain["hours"] == 1.0
    assert plain["report"] == str(page)
    assert page.read_text("utf-8").startswith("<!DOCTYPE html>")
    assert set(plain["alert_limits"]) == {"50", "25", "20"}
    at_25 = plain["alert_limits"]["25"]
    assert at_25["availability"] == 1.0
    assert at_25["regions"]["nominal"] == 3600
    upper = at_25["rates"]["hmi"]["demonstrated"]["upper_per_h"]
    assert upper == pytest.approx(np.log(20), rel=1e-12)
    text = Answer(capsys, "evaluate", roof, *TRUTH).out
    assert "3,600 epochs" in text
    assert "2.996" in text


def test_evaluate_without_truth_says_lower_bound(
    capsys: pytest.CaptureFixture[str], roof: Path
) -> None:
    answer = Answer(capsys, "evaluate", roof)
    assert answer.code == 0
    assert "lower bound" in answer.out
    assert "not demonstrated" in answer.out


def test_rate_and_its_exit_codes(capsys: pytest.CaptureFixture[str], roof: Path) -> None:
    asked = ("rate", roof, *TRUTH, "--alert-limit", "25")
    met = Answer(capsys, *asked, "--target-per-h", "4")
    missed = Answer(capsys, *asked, "--target-per-h", "1e-7", "--json")
    assert (met.code, missed.code) == (0, 1)
    plain = missed.json
    assert {"event", "hours", "demonstrated", "modelled", "claimed"} <= plain.keys()
    assert plain["demonstrated"]["upper_per_h"] == pytest.approx(np.log(20), rel=1e-12)
    assert plain["claimed"]["value_per_h"] == 1e-7
    assert "refused" in plain["modelled"]
    refused = Answer(capsys, "rate", roof, "--alert-limit", "25", "--json")
    assert refused.code == 1
    assert "lower bound" in refused.json["demonstrated"]["refused"]


def test_simulate_check_and_evaluate_hang_together(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for name in ("lab.sbf", "lab.parquet"):
        out = tmp_path / name
        made = Answer(capsys, "simulate", "--hours", "0.5", "--seed", "3", "--out", out, "--json")
        assert made.json["epochs"] == 1800
        checked = Answer(capsys, "check", out, "--json")
        assert checked.json["epochs"] == 1800
        assert checked.code == 0
        found = Answer(capsys, "evaluate", out, "--truth", made.json["truth"], "--json").json
        assert found["epochs"] == 1800
    assert Answer(capsys, "simulate", "--out", tmp_path / "lab.xyz").code == 2


def test_several_files_are_one_recording(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    whole = quiet(1000)
    late = stored(tmp_path / "a.parquet", whole.replace(table=whole.table.iloc[600:]))
    early = stored(tmp_path / "b.parquet", whole.replace(table=whole.table.iloc[:600]))
    one = stored(tmp_path / "c.parquet", whole)
    joined = Answer(capsys, "evaluate", late, early, *TRUTH, "--json").json
    alone = Answer(capsys, "evaluate", one, *TRUTH, "--json").json
    for key in ("hpe_m", "hpl_m"):
        assert joined[key].pop("mean") == pytest.approx(alone[key].pop("mean"), rel=1e-12)
    for key in ("epochs", "hpe_m", "hpl_m", "alert_limits"):
        assert joined[key] == alone[key]
    read = [s["path"] for s in joined["sources"] if s["format"] == "parquet"]
    assert read == [str(early), str(late)]
    overlapping = Answer(capsys, "evaluate", one, early, *TRUTH)
    assert overlapping.code == 2
    assert "E14" in overlapping.err


def bad_files(folder: Path) -> dict[str, Path]:
    rng = np.random.default_rng(1)
    good = quiet(300)
    table = good.table
    contents: dict[str, bytes] = {
        "empty.sbf": b"",
        "noise.sbf": rng.bytes(100_000),
        "noise.csv": rng.bytes(5_000),
        "words.pos": b"nothing that anyone could read\n" * 100,
        "header.csv": b"time,lat_deg,lon_deg,height_m,hpl_m\n",
        "nul.csv": b"\0" * 5_000,
    }
    parquet.write([good], folder / "whole.parquet")
    whole = (folder / "whole.parquet").read_bytes()
    contents["cut.parquet"] = whole[: len(whole) // 2]
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    backward = table.iloc[np.r_[100:300, 0:100]]
    stored(folder / "backward.parquet", good.replace(table=backward))
    twice = table.iloc[np.repeat(np.arange(300), 2)]
    stored(folder / "twice.parquet", good.replace(table=twice))
    stored(folder / "one.parquet", good.replace(table=table.iloc[:1]))
    stored(folder / "none.parquet", good.replace(table=table.iloc[:0]))
    stored(folder / "zero.parquet", good.replace(table=table.assign(hpl_m=0.0)))
    radians = table.assign(
        lat_deg=np.radians(table["lat_deg"]), lon_deg=np.radians(table["lon_deg"])
    )
    stored(folder / "radians.parquet", good.replace(table=radians))
    return {p.name: p for p in folder.iterdir() if p.name != "whole.parquet"}


def test_bad_input_ends_in_exit_2_with_a_cure(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    files = bad_files(tmp_path)
    assert len(files) == 13
    files["missing"] = tmp_path / "missing.sbf"
    files["folder"] = tmp_path
    for name, path in files.items():
        for verb in (("evaluate",), ("rate", "--alert-limit", "25")):
            answer = Answer(capsys, *verb, path, *TRUTH)
            assert answer.code == 2, name
            assert answer.out == "", name
            assert "cure:" in answer.err, (name, answer.err)
        checked = Answer(capsys, "check", path)
        assert checked.code == 2, name
        assert "cure:" in checked.out + checked.err, name


def test_the_named_cures_cure(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    files = bad_files(tmp_path)
    for name, cure in (
        ("backward.parquet", ("--sort",)),
        ("twice.parquet", ("--duplicates", "first")),
        ("zero.parquet", ("--pl-zero", "missing")),
    ):
        answer = Answer(capsys, "evaluate", files[name], *TRUTH, *cure, "--json")
        assert answer.code == 0, name
        assert "E26" in [f["code"] for f in answer.json["findings"]], name


@pytest.mark.parametrize(
    "arguments",
    [
        ("--truth", "50,15"),
        ("--truth", "91,0,0"),
        ("--truth", "nowhere.csv"),
        (*TRUTH, "--alert-limit", "fifty"),
        (*TRUTH, "--alert-limit", "-1"),
        (*TRUTH, "--confidence", "1.5"),
        (*TRUTH, "--accept", "E14"),
        (*TRUTH, "--duplicates", "all"),
        (*TRUTH, "--format", "sbx"),
        (*TRUTH, "--mode-map", "3"),
        ("--truth", "15.77,50.03,289.4"),
    ],
)
def test_impossible_questions_end_in_exit_2(
    capsys: pytest.CaptureFixture[str], roof: Path, arguments: tuple[str, ...]
) -> None:
    answer = Answer(capsys, "evaluate", roof, *arguments)
    assert answer.code == 2
    assert answer.err


def test_a_moving_recording_without_truth_gives_levels_but_no_rate(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    n = 600
    path = stored(
        tmp_path / "car.parquet", recording(np.arange(n) * 10.0, np.zeros(n), np.full(n, 11.0))
    )
    levels = Answer(capsys, "evaluate", path, "--json")
    assert levels.code == 0
    assert levels.json["hpe_m"] is None
    assert levels.json["hpl_m"]["median"] == 11.0
    assert Answer(capsys, "rate", path, "--alert-limit", "25").code == 2


@pytest.mark.parametrize(
    "verb",
    [
        "demo",
        "simulate",
        "check",
        "evaluate",
        "kfactor",
        "rate",
        "plan",
        "decorrelation",
        "compare",
        "states",
        "depend",
    ],
)
def test_every_verb_has_help_with_an_example(capsys: pytest.CaptureFixture[str], verb: str) -> None:
    answer = Answer(capsys, verb, "--help")
    assert answer.code == 0
    assert f"sbas {verb}" in answer.out


def test_the_real_egnos_hour(capsys: pytest.CaptureFixture[str], reference_data: Path) -> None:
    path = reference_data / "data/egnos_debrecen_2016194/debr194m.pos"
    plain = Answer(capsys, "evaluate", path, "--json").json
    assert plain["epochs"] == 3467
    hpl = plain["hpl_m"]
    assert (hpl["min"], hpl["median"], hpl["max"]) == (7.09, 7.86, 27.39)
    assert plain["errors_are_lower_bound"]
    for limit in plain["alert_limits"].values():
        assert "refused" in limit["rates"]["hmi"]["demonstrated"]


@pytest.mark.parametrize(
    ("name", "epochs"),
    [
        ("pygpsdata_x5_pvtextra.log", 1),
        ("pygpsdata_x5_pvtgeod.log", 1),
        ("pygpsdata_x5_rawnav.log", 0),
        ("pygpsdata_x5_constellations.log", 0),
    ],
)
def test_the_real_sbf_files_read_and_every_analysis_refuses(
    capsys: pytest.CaptureFixture[str], reference_data: Path, name: str, epochs: int
) -> None:
    path = reference_data / "data/sbf_pysbf2" / name
    checked = Answer(capsys, "check", path, "--json")
    assert checked.code == 2
    assert checked.json["epochs"] == epochs
    assert "E15" in [f["code"] for f in checked.json["findings"]]
    for verb in (("evaluate",), ("rate", "--alert-limit", "25")):
        assert Answer(capsys, *verb, path).code == 2


def test_a_report_never_overwrites_an_input(capsys: pytest.CaptureFixture[str], roof: Path) -> None:
    before = roof.read_bytes()
    assert Answer(capsys, "evaluate", roof, *TRUTH, "--report", roof).code == 2
    assert roof.read_bytes() == before


def test_kfactor_over_an_exposure(capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("kfactor", "--risk", "5e-8", "--exposure-s", "3600", "--tau-s", "360")
    plain = Answer(capsys, *asked, "--interval-s", "1", "--json").json
    assert plain["k"] == pytest.approx(6.7236, rel=1e-4)
    assert set(plain["models"]) == {"naive", "ar1", "ou", "ou_dt", "rice"}
    assert plain["models"]["naive"]["k"] == pytest.approx(6.1829, rel=1e-4)
    assert plain["models"]["rice"]["k"] == pytest.approx(6.4562, rel=1e-4)
    assert {"k", "n_es", "hourly_risk_of_6_18"} <= plain["models"]["ar1"].keys()
    assert "6.723" in Answer(capsys, *asked).out
    for wrong in (("--tau-s", "0.5"), ("--nugget", "2"), ("--one-sided",)):
        assert Answer(capsys, *asked, *wrong).code == 2
    assert Answer(capsys, "kfactor", "--risk", "5e-8", "--tau-s", "360").code == 2


def test_options_of_times_and_heights_reach_the_truth(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rows = [f"2025-05-23 14:{m:02d}:{s:02d};50,5;15,5;" for m in range(2) for s in range(60)]
    log, truth = tmp_path / "log.csv", tmp_path / "truth.csv"
    log.write_text("time;lat;lon;alt;hpl\n" + "".join(f"{row}245,0;11,5\n" for row in rows))
    truth.write_text("time;lat;lon;alt\n" + "".join(f"{row}245,0\n" for row in rows))
    options = ("--time-scale", "UTC", "--geoid", "44.5", "--truth", truth, "--json", "--quiet")
    result = Answer(capsys, "evaluate", log, *options).json
    assert result["hpe_m"]["max"] < 1e-6
    assert result["vpe_m"]["max"] < 1e-6
    assert Answer(capsys, "check", log, *options).code == 0
    rate = Answer(capsys, "rate", log, "--alert-limit", "25", *options)
    assert rate.json["hours"] > 0


def test_decorrelation_of_the_real_hour_is_too_short_to_tell(
    capsys: pytest.CaptureFixture[str], reference_data: Path
) -> None:
    path = reference_data / "data/egnos_debrecen_2016194/debr194m.pos"
    plain = Answer(capsys, "decorrelation", path, "--json").json
    assert plain["tau_s"] is None
    assert plain["tau_low_s"] < 360
    assert plain["tau_high_s"] is None or plain["tau_high_s"] > 360
    assert plain["misfit"] == "record_too_short"
    assert "too short" in plain["verdict"]


def test_decorrelation_refuses_in_words(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    few = stored(tmp_path / "few.parquet", quiet(10))
    answer = Answer(capsys, "decorrelation", few, *TRUTH)
    assert "not given" in answer.out
    twice = quiet(300)
    table = twice.table.iloc[np.repeat(np.arange(300), 2)]
    again = stored(tmp_path / "twice.parquet", twice.replace(table=table))
    assert Answer(capsys, "decorrelation", again, *TRUTH).code == 2
    assert Answer(capsys, "decorrelation", few, "--segments", "hourly").code == 2


def test_compare_two_receivers(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    one = stored(tmp_path / "a.parquet", quiet(3600, seed=1))
    two = stored(tmp_path / "b.parquet", quiet(3600, seed=2))
    answer = Answer(capsys, "compare", one, two, *TRUTH, "--json")
    assert answer.code == 0
    plain = answer.json
    # The difference of two independent errors of 0.5 m an axis has a median of
    # 0.5 sqrt(2) sqrt(2 ln 2) = 0.833 m.
    assert plain["difference_m"]["median"] == pytest.approx(0.833, rel=0.05)
    assert plain["availability_a"]["50"] == plain["availability_b"]["50"] == 1.0
    assert "epochs" in Answer(capsys, "compare", one, two).out
    late = quiet(100)
    later = late.replace(table=late.table.set_axis(late.table.index + np.timedelta64(9, "D")))
    apart = stored(tmp_path / "c.parquet", later)
    assert Answer(capsys, "compare", one, apart).code == 2
