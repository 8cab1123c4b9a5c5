"""Each finding is provoked by a recording, and its cure cures it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sbas.exceptions import InputError
from sbas.findings import Finding, refuse_on_errors
from sbas.input_check import accept, check, repair
from sbas.recording import Recording
from sbas.recording_survey import sampling_interval_ns, survey
from sbas.truth import FixedPoint
from tests.examples import POINT, quiet, recording

S = 1_000_000_000


def codes(r: Recording, truth: FixedPoint | None = None) -> list[tuple[str, str]]:
    return [(f.code, f.severity) for f in check(r, truth=truth).findings]


def test_a_clean_recording_has_no_finding_and_its_facts_are_right() -> None:
    facts = survey(quiet(600))
    assert check(quiet(600), truth=POINT).findings == ()
    assert (facts.epochs, facts.interval_ns, facts.positions) == (600, S, 600)
    assert facts.static
    assert facts.hours == pytest.approx(600 / 3600)
    lat, lon, height = facts.median_position
    # Medians of 600 white errors of 0.5 m: standard error 0.026 m, so 0.15 m is beyond 5 sigma.
    assert abs(lat - POINT.lat_deg) * 111_000 < 0.15
    assert abs(lon - POINT.lon_deg) * 72_000 < 0.15
    assert height == pytest.approx(POINT.height_m, abs=0.01)


def test_batches_of_any_size_give_the_same_facts(monkeypatch: pytest.MonkeyPatch) -> None:
    time = np.concatenate([np.arange(100), np.arange(150, 300), np.arange(299, 350)])
    r = recording(*(np.sin(time / k) for k in (7, 9)), np.full(time.size, 11.0), time_s=time)
    whole = survey(r)
    monkeypatch.setattr("sbas.recording.BATCH_ROWS", 17)
    parts = survey(r)
    for name in ("epochs", "interval_ns", "repeated", "backward", "first_repeated_row",
                 "first_backward_row", "positions"):  # fmt: skip
        assert getattr(parts, name) == getattr(whole, name), name
    assert parts.gaps.row.tolist() == whole.gaps.row.tolist() == [100]
    assert (whole.repeated, whole.first_repeated_row) == (1, 250)
    assert parts.median_position == pytest.approx(whole.median_position, rel=1e-12)


def test_the_interval_is_the_median_step() -> None:
    time = np.cumsum([0, 1, 1, 1, 5, 1, 0.5])
    r = recording(*np.zeros((2, 7)), np.full(7, 11.0), time_s=time)
    assert sampling_interval_ns(r) == S


def test_time_backward_and_its_cure() -> None:
    r = quiet(100)
    mixed = r.replace(table=pd.concat([r.table.iloc[50:], r.table.iloc[:50]]))
    assert ("E14", "error") in codes(mixed)
    cured = repair(mixed, sort=True)
    assert codes(cured) == [("E26", "info")]
    pd.testing.assert_frame_equal(cured.table, r.table)
    assert "100 epochs" in cured.meta.findings[0].message


@pytest.mark.parametrize("keep", ["first", "last"])
def test_repeated_times_and_their_cure(keep: str) -> None:
    r = quiet(100)
    again = r.table.iloc[[10]].assign(hpl_m=99.0)
    twice = r.replace(table=pd.concat([r.table.iloc[:11], again, r.table.iloc[11:]]))
    found = check(twice).findings
    assert [(f.code, f.severity) for f in found] == [("E05", "error")]
    assert "1 of them with other values" in found[0].evidence
    assert "row 11" in found[0].where
    cured = repair(twice, duplicates=keep)  # type: ignore[arg-type]
    assert len(cured) == 100
    assert (cured.table["hpl_m"].iloc[10] == 99.0) == (keep == "last")
    assert codes(cured) == [("E26", "info")]


def test_levels_of_zero_are_refused_until_made_missing() -> None:
    r = quiet(100)
    hpl = r.table["hpl_m"].to_numpy().copy()
    hpl[[3, 5]] = [0.0, -1.0]
    wrong = r.replace(table=r.table.assign(hpl_m=hpl))
    assert codes(wrong) == [("E13", "error")]
    cured = repair(wrong, pl_zero="missing")
    assert cured.table["hpl_m"].isna().sum() == 2
    assert codes(cured) == [("E26", "info")]


def test_gaps_are_a_warning_with_their_size() -> None:
    time = np.concatenate([np.arange(100), np.arange(160, 200)])
    r = recording(*np.zeros((2, 140)), np.full(140, 11.0), time_s=time)
    (gap,) = check(r).findings
    assert (gap.code, gap.severity) == ("E04", "warning")
    assert "1 gap: lost 60 s" in gap.message
    assert "longest 60 s" in gap.evidence


@pytest.mark.parametrize("n", [0, 1])
def test_too_few_epochs(n: int) -> None:
    r = quiet(10)
    assert codes(r.replace(table=r.table.iloc[:n])) == [("E15", "error")]


def test_all_epochs_at_one_time_have_no_interval() -> None:
    r = recording(*np.zeros((2, 5)), np.full(5, 11.0), time_s=np.zeros(5))
    assert {c for c, s in codes(r) if s == "error"} == {"E05", "E14"}


def test_radians_and_positions_out_of_range() -> None:
    r = quiet(50)
    radians = r.table.assign(
        lat_deg=np.radians(r.table["lat_deg"]), lon_deg=np.radians(r.table["lon_deg"])
    )
    assert ("E03", "error") in codes(r.replace(table=radians))
    scaled = r.table.assign(lat_deg=r.table["lat_deg"] * 1e7)
    assert ("E08", "error") in codes(r.replace(table=scaled))


def test_swapped_coordinates_show_all_four_distances() -> None:
    r = quiet(50)
    swapped = r.table.assign(lat_deg=r.table["lon_deg"], lon_deg=r.table["lat_deg"])
    found = [f for f in check(r.replace(table=swapped), truth=POINT).findings if f.code == "E12"]
    assert found[0].severity == "error"
    assert (
        "swapped 0." in found[0].evidence
        or "swapped 1e" in found[0].evidence
        or ("swapped" in found[0].evidence)
    )


def test_a_moving_recording_is_not_static() -> None:
    n = 600
    assert not survey(recording(np.arange(n) * 1.0, np.zeros(n), np.full(n, 11.0))).static
    spike = np.zeros(n)
    spike[300:320] = 100.0
    assert survey(recording(spike, np.zeros(n), np.full(n, 11.0))).static


def test_errors_can_be_accepted_by_name_only() -> None:
    damage = Finding("E24", "error", "2 % of the bytes belong to no block", cure="--accept E24")
    with pytest.raises(InputError, match="E24"):
        refuse_on_errors([damage])
    (accepted,) = accept([damage], ["E24"])
    assert accepted.severity == "warning"
    assert "accepted" in accepted.message
    with pytest.raises(InputError, match="cannot be accepted"):
        accept([damage], ["E14"])


def test_static_does_not_hang_on_the_cut_nor_on_shortness(monkeypatch: pytest.MonkeyPatch) -> None:
    n = 2001
    east = np.zeros(n)
    east[-1] = 35.0
    late_spike = recording(east, np.zeros(n), np.full(n, 11.0))
    for rows in (2000, 400, 7):
        monkeypatch.setattr("sbas.recording.BATCH_ROWS", rows)
        assert survey(late_spike).static
    short = recording(np.arange(59) * 40.0, np.zeros(59), np.full(59, 11.0))
    assert not survey(short).static
    slow = np.arange(60)
    far_apart = recording(slow * 800.0, slow * 0.0, slow * 0 + 11.0, time_s=slow * 10)
    assert not survey(far_apart).static
    r = quiet(200)
    assert not survey(r.replace(table=r.table.assign(speed_mps=20.0))).static


def test_jittered_stamps_keep_their_interval_and_bounded_memory() -> None:
    rng = np.random.default_rng(4)
    n = 200_000
    time = np.arange(n) + rng.normal(0, 1e-3, n)
    r = recording(np.zeros(n), np.zeros(n), np.full(n, 11.0), time_s=time)
    assert sampling_interval_ns(r) == pytest.approx(S, rel=1e-4)


def test_two_halves_of_one_epoch_become_whole() -> None:
    r = quiet(50)
    table = r.table.copy()
    first, second = table.iloc[[20]].copy(), table.iloc[[20]].copy()
    first["hpl_m"] = np.nan
    first["n_sv"] = np.int16(-1)
    second[["lat_deg", "lon_deg", "height_m"]] = np.nan
    split = pd.concat([table.iloc[:20], first, second, table.iloc[21:]])
    for keep in ("first", "last"):
        cured = repair(r.replace(table=split), duplicates=keep)  # type: ignore[arg-type]
        pd.testing.assert_frame_equal(cured.table, table)
    second["hpl_m"] = 50.0
    first["hpl_m"] = 11.0
    contradicting = pd.concat([table.iloc[:20], first, second, table.iloc[21:]])
    kept = repair(r.replace(table=contradicting), duplicates="last").table
    assert kept["hpl_m"].iloc[20] == 50.0
    assert np.isnan(kept["lat_deg"].iloc[20])
