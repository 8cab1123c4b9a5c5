"""Verbs on ranges: protect, from files to a recording that every other verb takes, and raim."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sbas.cli.writing import write_recording
from sbas.laboratory import bundled_settings, simulate_pieces
from sbas.monitoring import raim, raim_against_sbas
from tests.cli.test_verbs import Answer
from tests.monitoring.recordings import noisy

VEHICLE = "data/msas_vehicle_2008147"


@pytest.fixture
def arguments(reference_data: Path) -> tuple[object, ...]:
    folder = reference_data / VEHICLE
    return (
        "--obs", folder / "cres_20080526.obs", "--nav", folder / "cres_20080526.nav",
        "--nav", folder / "all.nav", "--messages", folder / "msas_129.ems", "--geo", 129,
    )  # fmt: skip


def test_a_vehicle_from_ranges_to_an_evaluation(
    arguments: tuple[object, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "pa.parquet"
    answer = Answer(
        capsys, "protect", *arguments, "--mode", "pa", "--profile", "glab", "--out", out, "--json"
    ).json
    # gLAB 6.0.0 solves 240 epochs, the first of them without being in precision approach.
    assert (answer["epochs"], answer["fixes"]) == (312, 239)
    table = pd.read_parquet(out)
    assert table.index.name == "time"
    at = table.loc["2008-05-26T06:03:20"]  # gLAB: HPL 19.6583 m, VPL 68.6417 m, 7 satellites
    assert at["hpl_m"] == pytest.approx(19.6583, abs=1e-3)
    assert at["vpl_m"] == pytest.approx(68.6417, abs=1e-3)
    assert at["n_sv"] == 7
    assert Answer(capsys, "check", out).code == 0
    assert Answer(capsys, "evaluate", out, "--json").json["hpl_m"]["epochs"] == 239
    npa = tmp_path / "npa.parquet"
    assert Answer(capsys, "protect", *arguments, "--mode", "npa", "--out", npa).code == 0
    compared = Answer(capsys, "compare", out, npa, "--json")
    assert compared.code == 0


def test_bad_input(
    arguments: tuple[object, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ("--out", tmp_path / "x.parquet")
    silent = Answer(capsys, "protect", *arguments[:-1], 131, *out)
    assert silent.code == 2
    assert "129" in silent.err
    nowhere = Answer(capsys, "protect", *arguments, *out, "--position", "1,2,3")
    assert nowhere.code == 2
    assert "no place on Earth" in nowhere.err
    over = Answer(capsys, "protect", *arguments, "--out", arguments[1])
    assert over.code == 2
    assert "overwrite" in over.err


def test_raim_of_the_same_epochs(
    arguments: tuple[object, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "raim.parquet"
    corrected = Answer(capsys, "raim", *arguments, "--out", out, "--json").json
    assert corrected["epochs"] == 312
    assert 0 < corrected["available"] <= 310
    assert corrected["herl_m"]["median"] > 10
    assert pd.read_parquet(out)["herl_m"].notna().any()
    alone = Answer(capsys, "raim", *arguments[:6], "--json").json
    assert alone["available"] > 0
    assert Answer(capsys, "raim", *arguments[:8]).code == 2  # messages without --geo


def test_araim_of_one_constellation_asks_for_a_rare_constellation_fault(
    arguments: tuple[object, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    usual = Answer(capsys, "raim", *arguments, "--araim", "--json").json["araim"]
    assert usual["available"] == 0
    assert usual["reasons"]["faults that cannot be monitored exhaust the integrity budget"] > 300
    rare = Answer(
        capsys, "raim", *arguments, "--araim", "--prior-constellation", "1e-12", "--json"
    ).json["araim"]
    assert rare["available"] > 200
    assert rare["hpl_m"]["median"] > 10


def test_help_names_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    answer = Answer(capsys, "protect", "--help")
    assert "Example:" in answer.out


def test_raim_of_a_recording_beside_its_hpl(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = noisy(4, 9, 60, hpl_m=12.0)
    write_recording(tmp_path / "pa.parquet", [recording])
    given = (tmp_path / "pa.parquet", "--alert-limit", 25, "--false-alarm", 0.01)
    answer = Answer(capsys, "raim", *given, "--json").json
    own = raim(recording, false_alarm=0.01)
    assert answer["available"] == own.available
    assert answer["detected"] == own.detected
    assert answer["herl_m"]["median"] == pytest.approx(float(own.epochs["herl_m"].median()))
    compared = raim_against_sbas(recording, false_alarm=0.01, alert_limit_m=25.0)
    assert answer["against_sbas"] == compared.to_dict()
    assert answer["ranges_corrected_by_sbas"] is None
    text = Answer(capsys, "raim", *given).out
    assert compared.statement() in text
    assert "not stated" in text
    masked = Answer(capsys, "raim", tmp_path / "pa.parquet", "--elevation", 25, "--json").json
    assert masked["masked_ranges"] > 0
    assert masked["against_sbas"]["by_satellites"].keys() != compared.to_dict()["by_satellites"]


def test_raim_of_a_receivers_own_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = dataclasses.replace(bundled_settings(), hours=0.05)
    log = tmp_path / "roof.sbf"
    write_recording(log, simulate_pieces(settings))
    answer = Answer(capsys, "raim", log, "--alert-limit", 25, "--json").json
    assert answer["source"] == "receiver"
    assert answer["available"] > 0
    assert answer["herl_m"]["median"] > 0
    assert "verdict" in answer["against_sbas"]["raim_available_where"]
    assert "HERL is larger than HPL at" in Answer(capsys, "raim", log).out
    ignored = Answer(capsys, "raim", log, "--false-alarm", "1e-3")
    assert ignored.code == 2
    assert "false_alarm" in ignored.err
    assert Answer(capsys, "raim", log, "--araim").code == 2


def test_a_recording_without_raim_says_what_was_lost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "pa.parquet"
    write_recording(out, [noisy(4, 9, 60, hpl_m=12.0)])
    (tmp_path / "pa.satellites.parquet").unlink()
    answer = Answer(capsys, "raim", out)
    assert answer.code == 2
    assert "side table satellites is missing" in answer.err
    write_recording(out, [noisy(4, 9, 60)])
    assert "against_sbas" not in Answer(capsys, "raim", out, "--json").json
    assert Answer(capsys, "raim", out, "--alert-limit", 25).code == 2


def test_findings_of_the_recording_reach_the_answer(
    arguments: tuple[object, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.obs"
    whole = Path(str(arguments[1])).read_bytes()
    cut.write_bytes(whole[: len(whole) * 2 // 5])
    answer = Answer(capsys, "raim", "--obs", cut, *arguments[2:6])
    assert answer.code == 0
    assert "cut or unreadable" in answer.out
    assert "not corrected by SBAS" in answer.out
    plain = Answer(capsys, "raim", "--obs", cut, *arguments[2:6], "--json").json
    assert "E10" in [finding["code"] for finding in plain["findings"]]
    assert plain["ranges_corrected_by_sbas"] is False
    assert Answer(capsys, "raim", *arguments, "--json").json["ranges_corrected_by_sbas"] is True


def test_without_a_fix_there_is_an_error_and_its_cure(
    arguments: tuple[object, ...], reference_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhen = reference_data / "data/msas_kamakura_2025046/gps_lnav_12-15h_rinex3.nav"
    answer = Answer(capsys, "raim", "--obs", arguments[1], "--nav", elsewhen)
    assert answer.code == 2
    assert "E15 error: no epoch has a fix, mostly: no valid broadcast ephemeris" in answer.out
    assert "cure" in answer.out
    plain = Answer(capsys, "raim", "--obs", arguments[1], "--nav", elsewhen, "--json")
    assert plain.code == 2
    assert plain.json["findings"][-1]["code"] == "E15"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--geo", 129), "--geo"),
        (("--mode", "npa"), "--mode"),
        (("--prior-satellite", "1e-5"), "--araim"),
        (("--prior-constellation", "1e-4"), "--araim"),
        (("--elevation", "nan"), "mask"),
        (("--elevation", -20), "mask"),
        (("--elevation", 500), "mask"),
        (("--track-azimuth", 400), "azimuth"),
        (("--sigma", "a"), "--sigma"),
        (("--format", "sbf"), "FILE"),
        (("--accept", "E14"), "FILE"),
        (("--out", "raim.sbf"), "metadata"),
    ],
)
def test_options_that_would_do_nothing_are_refused(
    options: tuple[object, ...],
    said: str,
    arguments: tuple[object, ...],
    capsys: pytest.CaptureFixture[str],
) -> None:
    answer = Answer(capsys, "raim", *arguments[:6], *options)
    assert answer.code == 2
    assert said in answer.err


def test_ranges_or_a_recording(
    arguments: tuple[object, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert Answer(capsys, "raim").code == 2
    assert "only one of" in Answer(capsys, "raim", *arguments[:2]).err
    out = tmp_path / "pa.parquet"
    write_recording(out, [noisy(4, 9, 5)])
    both = Answer(capsys, "raim", out, *arguments)
    assert both.code == 2
    assert "--obs, --nav, --messages, --geo" in both.err
    protected = Answer(
        capsys, "protect", *arguments, "--elevation", "nan", "--out", tmp_path / "x.parquet"
    )
    assert protected.code == 2


def test_a_sigma_stands_for_the_ranges_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = noisy(4, 9, 20)
    out = tmp_path / "pa.parquet"
    write_recording(out, [recording])
    for text, sigma in (("2", 2.0), ("1,2", (1.0, 2.0))):
        answer = Answer(capsys, "raim", out, "--sigma", text, "--json").json
        median = float(np.median(raim(recording, sigma=sigma).epochs["herl_m"]))
        assert answer["herl_m"]["median"] == pytest.approx(median)


def test_a_recording_without_epochs_is_no_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = noisy(4, 9, 5)
    out = tmp_path / "pa.parquet"
    write_recording(out, [recording.replace(table=recording.table[:0])])
    answer = Answer(capsys, "raim", out)
    assert answer.code == 2
    assert "E15" in answer.out


def test_galileo_alone_is_monitored_and_messages_are_for_gps(
    arguments: tuple[object, ...], reference_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = reference_data / "data/rinex"
    galileo = (
        "raim", "--obs", folder / "CEDA00USA_R_20182100000_23H_15S_MO.rnx.gz", "--nav",
        folder / "ELKO00USA_R_20182100000_01D_MN.rnx.gz",
    )  # fmt: skip
    found = Answer(capsys, *galileo, "--systems", "E", "--json").json
    # Time tags of this file are wrong: every epoch that can be tested shows it.
    assert found["detected"] == found["verdicts"]["detected"] == 155
    assert found["available"] == 0
    assert found["ranges_corrected_by_sbas"] is False
    corrected = Answer(capsys, "raim", *arguments, "--systems", "GE")
    assert corrected.code == 2
    assert "GPS alone" in corrected.err
