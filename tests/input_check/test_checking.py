"""Each finding is provoked by a recording, and its cure cures it; good ones are left in peace."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sbas
from sbas.exceptions import InputError
from sbas.findings import CODES, Finding, refuse_on_errors
from sbas.input_check import Repairs, accept, check, fix, repair
from sbas.laboratory import simulate
from sbas.recording import Recording
from sbas.truth import FixedPoint
from tests.conftest import ROOT
from tests.examples import quiet, recording
from tests.input_check.damages import Damage, damages
from tests.input_check.journeys import POINT, TODAY, checked, journey, said, standing

DAMAGES = damages()
ELSEWHERE = {"E01", "E10", "E16", "E17", "E18", "E19", "E20", "E21", "E24", "E25", "E26",
             "E28"}  # fmt: skip
"""Codes that readers, repairs, analyses and fault trees give."""


def named(damage: Damage) -> str:
    return damage.name.replace(" ", "-")


@pytest.mark.parametrize("damage", DAMAGES, ids=named)
def test_each_damage_gets_its_finding_and_its_repair(damage: Damage) -> None:
    before = said(checked(damage.good, damage.truth))
    assert damage.code not in [code for code, _ in before]
    result = checked(damage.bad, damage.truth)
    assert (damage.code, damage.severity) in said(result)
    found = next(f for f in result.findings if f.code == damage.code)
    assert found.evidence or found.where
    assert found.cure
    assert result.repairs.named() == (damage.repair or {})


@pytest.mark.parametrize("damage", [d for d in DAMAGES if d.repair], ids=named)
def test_what_the_check_proposes_makes_the_recording_clean_and_whole(damage: Damage) -> None:
    fixed, result = fix(damage.bad, truth=damage.truth, today=TODAY)
    assert {code for code, severity in said(result) if severity != "info"} <= {"E04"}
    assert "E26" in {code for code, _ in said(result)}
    assert result.repairs == Repairs()
    assert "repairs" in fixed.meta.options
    if damage.restores:
        pd.testing.assert_frame_equal(fixed.table, damage.good.table, rtol=1e-12)
    again, _ = fix(fixed, truth=damage.truth, today=TODAY)
    pd.testing.assert_frame_equal(again.table, fixed.table)


@pytest.mark.parametrize("damage", DAMAGES, ids=named)
def test_no_cut_of_the_batches_changes_a_word(
    damage: Damage, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = checked(damage.bad, damage.truth)
    for size in (61, 599) if len(damage.bad) < 3000 else (997,):
        monkeypatch.setattr("sbas.recording.BATCH_ROWS", size)
        parts = checked(damage.bad, damage.truth)
        assert parts.findings == whole.findings
        assert parts.repairs == whole.repairs


def test_every_code_of_the_check_is_provoked_and_documented() -> None:
    assert {d.code for d in DAMAGES} == set(CODES) - ELSEWHERE
    text = (ROOT / "docs/formats.md").read_text(encoding="utf-8")
    for damage in DAMAGES:
        (line,) = [row for row in text.splitlines() if row.startswith(f"| {damage.code} ")]
        for name in damage.repair or {}:
            assert f"--{name.removesuffix('_m').replace('_', '-')}" in line, (damage.code, name)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("n", [300, 1200])
def test_good_recordings_have_no_finding(n: int, seed: int) -> None:
    assert said(checked(standing(n, seed))) == []
    assert said(checked(standing(n, seed), POINT)) == []
    for step_s in (1.0, 0.2):
        train, track = journey(n, seed, step_s=step_s)
        assert said(checked(train, track)) == []


def test_the_laboratory_recording_is_clean() -> None:
    r = simulate(hours=6, seed=5)
    truth = FixedPoint(50.03, 15.77, 289.4, frame="WGS 84, simulated")
    assert {f.code for f in check(r, truth=truth).findings} <= {"E04"}


def test_real_egnos_levels_are_clean(reference_data: Path) -> None:
    r = sbas.read(reference_data / "data/egnos_debrecen_2016194/debr194m.pos")
    point = FixedPoint(*check(r).survey.median_position, frame="itself")
    assert check(r).findings == r.meta.findings
    assert check(r, truth=point).findings == r.meta.findings


def test_errors_can_be_accepted_by_name_only() -> None:
    damage = Finding("E24", "error", "2 % of the bytes belong to no block", cure="--accept E24")
    with pytest.raises(InputError, match="E24"):
        refuse_on_errors([damage])
    (accepted,) = accept([damage], ["E24"])
    assert accepted.severity == "warning"
    assert "accepted" in accepted.message
    with pytest.raises(InputError, match="cannot be accepted"):
        accept([damage], ["E14"])


def test_the_result_as_plain_values_names_the_repairs() -> None:
    r = standing(100)
    result = check(r.replace(table=r.table.iloc[::-1]), today=TODAY)
    plain = result.to_dict()
    assert not plain["usable"]
    assert plain["repairs"] == {"sort": True}
    assert checked(r).to_dict()["repairs"] == {}


def test_gaps_are_a_warning_with_their_size() -> None:
    time = np.concatenate([np.arange(100), np.arange(160, 200)])
    r = recording(*np.zeros((2, 140)), np.full(140, 11.0), time_s=time)
    (gap,) = checked(r).findings
    assert (gap.code, gap.severity) == ("E04", "warning")
    assert "1 gap: lost 60 s" in gap.message
    assert "longest 60 s" in gap.evidence


def test_all_epochs_at_one_time_have_no_interval() -> None:
    r = recording(*np.zeros((2, 5)), np.full(5, 11.0), time_s=np.zeros(5))
    assert {c for c, s in said(checked(r)) if s == "error"} == {"E05", "E14"}


def test_no_epoch_at_all_is_too_few() -> None:
    r = quiet(10)
    assert said(checked(r.replace(table=r.table.iloc[:0]), POINT)) == [("E15", "error")]


def test_nothing_but_times_is_no_crash() -> None:
    r = standing(100)
    bare: Recording = r.replace(table=r.table[[]])
    assert said(checked(bare, POINT)) == []
    assert said(checked(bare, journey(100)[1])) == []


def test_analyses_refuse_on_what_the_check_finds() -> None:
    r = standing(100)
    swapped = r.replace(
        table=r.table.assign(lat_deg=r.table["lon_deg"], lon_deg=r.table["lat_deg"])
    )
    with pytest.raises(InputError, match="E12"):
        sbas.evaluate(swapped, truth=POINT)
    cured = repair(swapped, swap_latlon=True)
    assert sbas.evaluate(cured, truth=POINT).hpe_m.median < 5  # type: ignore[union-attr]
