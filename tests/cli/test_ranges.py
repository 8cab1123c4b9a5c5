"""The verb on ranges: protect, from files to a recording that every other verb takes."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.cli.test_verbs import Answer

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
