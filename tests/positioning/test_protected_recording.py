"""`protect` from files to a Recording: what it holds, what it refuses, what bad input becomes."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import sbas
from sbas.augmentation import SbasMessages
from sbas.augmentation.reasons import WORDS, Reason
from sbas.exceptions import InputError
from sbas.logs.arrow.parquet_writer import write
from sbas.positioning import protect
from sbas.positioning.measurements import Measurements, measurements
from sbas.positioning.protection_levels import horizontal_level_m, vertical_level_m
from sbas.positioning.software_receiver import Fixes
from sbas.satellite_table import SIDE_TABLE
from tests.positioning.reference_cases import (
    CASES,
    KAMAKURA_M,
    between,
    inputs,
    rules,
    solved,
)


def files(folder: Path, name: str) -> dict[str, Any]:
    case, data = CASES[name], folder / "data"
    return {
        "observations": data / case.observations,
        "navigation": [data / path for path in case.navigation],
        "messages": data / case.messages,
        "geo": case.geo,
        "place_m": case.place_m,
    }


@pytest.fixture(scope="module")
def vehicle(reference_data: Path) -> sbas.Recording:
    return protect(**files(reference_data, "vehicle"), mode="auto")


def test_the_recording(vehicle: sbas.Recording, reference_data: Path) -> None:
    table = vehicle.table
    assert len(table) == 312
    fixed = table["hpl_m"].notna()
    assert (fixed == (table["mode"] != "none")).all()
    for name in ("lat_deg", "height_m", "vpl_m", "sigma_e_m", "hdop", "pdop"):
        assert (table[name].notna() == fixed).all()
    assert (table.loc[fixed, "n_sv"] >= 4).all()
    assert (table.loc[~fixed, "n_sv"] == 0).all()
    assert set(table.loc[fixed, "geo_prn"]) == {129}
    assert set(table.loc[~fixed, "geo_prn"]) == {-1}
    axis = sbas.recording.major_semi_axis_m(
        *(table[name].to_numpy() for name in ("sigma_e_m", "sigma_n_m", "cov_en_m2"))
    )
    factor = np.where(table["mode"] == "sbas_pa", 6.0, 6.18)
    assert table["hpl_m"].to_numpy() == pytest.approx(factor * axis, nan_ok=True)
    assert [Path(s.path).name for s in vehicle.meta.sources] == [
        "cres_20080526.obs", "cres_20080526.nav", "all.nav", "msas_129.ems",
    ]  # fmt: skip
    assert all(s.sha256 and s.bytes for s in vehicle.meta.sources)
    assert vehicle.meta.leap_seconds in (None, 14)


def test_satellites_say_why(vehicle: sbas.Recording) -> None:
    side = vehicle.side_tables[SIDE_TABLE]
    assert (side["used"] == side["reason"].isna()).all()
    assert set(side["reason"].dropna()) <= set(WORDS.values())
    used = side[side["used"]]
    parts = ["sigma_flt_m", "sigma_uire_m", "sigma_air_m", "sigma_tropo_m"]
    total = np.sqrt((used[parts] ** 2).sum(axis=1))
    assert used["sigma_m"].to_numpy() == pytest.approx(total.to_numpy())
    counts = used.groupby("time").size()
    with_fix = vehicle.table[vehicle.table["mode"] != "none"]
    assert counts.tolist() == with_fix["n_sv"].tolist()
    assert counts.index.tolist() == with_fix.index.tolist()


def test_mode_auto_is_precision_approach_where_that_has_a_fix(
    vehicle: sbas.Recording, reference_data: Path
) -> None:
    pa, npa = (protect(**files(reference_data, "vehicle"), mode=mode) for mode in ("pa", "npa"))
    expected = pa.table["hpl_m"].fillna(npa.table["hpl_m"])
    assert vehicle.table["hpl_m"].to_numpy() == pytest.approx(expected.to_numpy(), nan_ok=True)
    fallen = (vehicle.table["mode"] == "sbas_npa").to_numpy()
    assert (fallen == (pa.table["hpl_m"].isna() & npa.table["hpl_m"].notna())).all()
    assert fallen.any()
    reasons = vehicle.table["x_reason"]
    assert (reasons[fallen] == WORDS[Reason.IONO_NOT_MONITORED]).any()
    assert ((reasons == "") == pa.table["hpl_m"].notna()).all()
    assert (pa.table["x_reason"] == reasons).all()
    assert (npa.table.loc[npa.table["hpl_m"].isna(), "x_reason"] != "").all()


def test_a_level_at_its_limit_falls_too(reference_data: Path) -> None:
    given_files = files(reference_data, "vehicle")
    pa = protect(**given_files, mode="pa").table
    hal = float(pa["hpl_m"].median())
    auto = protect(**given_files, mode="auto", hal_m=hal).table
    high = (pa["hpl_m"] >= hal).to_numpy()
    assert set(auto.loc[high, "mode"]) == {"sbas_npa"}
    assert set(auto.loc[pa["hpl_m"] < hal, "mode"]) == {"sbas_pa"}
    words = set(auto.loc[high, "x_reason"])
    assert words == {"protection level of precision approach at or above the alert limit"}
    val = float(pa["vpl_m"].min())
    assert not (protect(**given_files, mode="auto", val_m=val).table["mode"] == "sbas_pa").any()


def test_tracks_and_factors_of_ones_own(reference_data: Path) -> None:
    given_files = files(reference_data, "vehicle")
    usual = protect(**given_files, track_azimuth_deg=30.0).table
    along = usual["x_level_along_m"]
    assert (along.dropna() <= usual["hpl_m"].dropna() * (1 + 1e-12)).all()
    a = np.radians(30.0)
    variance = (
        usual["sigma_e_m"] ** 2 * np.sin(a) ** 2 + usual["sigma_n_m"] ** 2 * np.cos(a) ** 2
        + 2 * usual["cov_en_m2"] * np.sin(a) * np.cos(a)
    )  # fmt: skip
    assert along.to_numpy() == pytest.approx(6.0 * np.sqrt(variance.to_numpy()), nan_ok=True)
    own = protect(**given_files, k_h=3.0, k_v=2.0)
    assert own.table["hpl_m"].to_numpy() == pytest.approx(
        usual["hpl_m"].to_numpy() / 2, nan_ok=True
    )
    assert (own.meta.pl.k_h, own.meta.pl.k_v) == (3.0, 2.0)


def test_its_output_goes_through_the_other_questions(
    vehicle: sbas.Recording, reference_data: Path, tmp_path: Path
) -> None:
    assert not [f for f in sbas.check(vehicle).findings if f.severity == "error"]
    esa = sbas.positioning.stanford_esa(
        vehicle,
        sbas.FixedPoint(35.87291, 138.38982, 999.0, frame="ITRF2005"),
        k_h=6.18,
    )
    assert esa.subsets > 10_000
    again = sbas.positioning.levels_from_satellites(vehicle, k_h=6.0, k_v=5.33)
    precise = (vehicle.table["mode"] == "sbas_pa").to_numpy()
    assert again.table["hpl_m"].to_numpy()[precise] == pytest.approx(
        vehicle.table["hpl_m"].to_numpy()[precise], rel=1e-9
    )


def test_profiles_differ_only_as_they_say(reference_data: Path) -> None:
    given_files = files(reference_data, "vehicle")
    mops, glab = (protect(**given_files, profile=profile).table for profile in ("mops", "glab"))
    both = mops["hpl_m"].notna() & glab["hpl_m"].notna()
    assert both.sum() >= 239
    assert (mops["hpl_m"] - glab["hpl_m"])[both].abs().max() < 0.05
    # Relativity of the broadcast elements instead of the motion: 12 mm in a range.
    moved = np.hypot(
        (mops["lat_deg"] - glab["lat_deg"]) * 111_000,
        (mops["lon_deg"] - glab["lon_deg"]) * 111_000 * np.cos(np.radians(35.9)),
    )
    assert 1e-4 < moved[both].max() < 0.1


def test_smoothing_waits_for_six_minutes(reference_data: Path) -> None:
    given_files = files(reference_data, "vehicle")
    smoothed = protect(**given_files, mode="npa", smoothing=True)
    assert smoothed.table["hpl_m"].isna().all()  # the log has 312 epochs
    assert any("arc too short" in f.message for f in smoothed.meta.findings)


def test_files_that_do_not_belong_together(reference_data: Path) -> None:
    given_files = files(reference_data, "vehicle")
    other = files(reference_data, "kamakura")
    with pytest.raises(InputError, match="not of the same time"):
        protect(**{**given_files, "messages": other["messages"], "geo": 137})
    with pytest.raises(InputError):
        protect(**{**given_files, "geo": 131})
    foreign_orbits = protect(**{**given_files, "navigation": other["navigation"]})
    assert foreign_orbits.table["hpl_m"].isna().all()
    (error,) = [f for f in foreign_orbits.meta.findings if f.severity == "error"]
    assert "no ephemeris" in error.message
    assert set(foreign_orbits.table["x_reason"].iloc[2:]) == {WORDS[Reason.NO_EPHEMERIS]}


def test_a_receiver_outside_the_service_area_is_told_so(reference_data: Path) -> None:
    """A grid that never gets a delay is one that does not reach the receiver."""
    given_files = files(reference_data, "vehicle")
    _, _, messages = inputs(reference_data, "vehicle")
    silent = _without_kind(messages, 26)
    recording = protect(**{**given_files, "messages": silent}, profile="glab")
    assert recording.table["hpl_m"].isna().all()
    (error,) = [f for f in recording.meta.findings if f.severity == "error"]
    assert "outside the service area" in error.message


def _without_kind(messages: SbasMessages, *kinds: int) -> SbasMessages:
    return _some(messages, ~np.isin(messages.kind, kinds))


def _some(messages: SbasMessages, rows: np.ndarray) -> SbasMessages:
    names = ("time_s", "prn", "kind", "frame", "crc_checked")
    return replace(messages, **{name: getattr(messages, name)[rows] for name in names})


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        (1, Reason.NO_MASK), (7, Reason.NO_FAST_DEGRADATION), (10, Reason.NO_DEGRADATION),
        (18, Reason.NO_IONO_MASK), (25, Reason.NO_LONG_TERM),
    ],
)  # fmt: skip
def test_without_a_type_no_precision_approach(
    reference_data: Path, kind: int, reason: Reason
) -> None:
    _, _, messages = inputs(reference_data, "vehicle")
    silent = _without_kind(messages, *((24, 25) if kind == 25 else (kind,)))
    given_files = {**files(reference_data, "vehicle"), "messages": silent}
    table = protect(**given_files).table
    assert table["hpl_m"].isna().all()
    assert set(table["x_reason"].iloc[2:]) == {WORDS[reason]}


def test_observations_without_code(tmp_path: Path, reference_data: Path) -> None:
    given_files = files(reference_data, "vehicle")
    text = Path(given_files["observations"]).read_text()
    renamed = tmp_path / "p_code.obs"
    renamed.write_text(text.replace("C1C", "C1W"))
    with pytest.raises(InputError, match="no GPS C/A code"):
        protect(**{**given_files, "observations": renamed})
    given_files = files(reference_data, "kamakura")
    with pytest.raises(InputError, match="no range of the SBAS satellite"):
        protect(**given_files, geo_ranging=True)


def test_the_real_range_of_the_sbas_satellite(reference_data: Path) -> None:
    """MSAS PRN 129 in 2008, UDREI 12: of no use in precision approach, else with 15 m and more."""
    given_files = files(reference_data, "vehicle")
    side = protect(**given_files, mode="npa", geo_ranging=True).side_tables[SIDE_TABLE]
    own = side[(side["satellite"] == "S29") & side["used"]]
    assert len(own) == 310
    assert own["sigma_m"].min() > 15.1
    # Its orbit and clock of type 9 put it where the receiver heard it, 38,000 km away.
    assert own["residual_m"].abs().max() < 15.0
    assert own["elevation_deg"].between(48.2, 48.3).all()
    precise = protect(**given_files, geo_ranging=True).side_tables[SIDE_TABLE]
    assert not precise["used"][precise["satellite"] == "S29"].any()


@pytest.mark.parametrize(("off_m", "code"), [(0.0, None), (35.0, "E12"), (3000.0, "E15")])
def test_a_place_that_is_another_one_is_an_error(
    reference_data: Path, off_m: float, code: str | None
) -> None:
    place = (KAMAKURA_M[0] + off_m, *KAMAKURA_M[1:])
    given_files = {**files(reference_data, "kamakura"), "place_m": place}
    far = protect(**given_files)
    errors = [f for f in far.meta.findings if f.severity == "error"]
    assert [f.code for f in errors] == ([] if code is None else [code])
    assert all("--position" in f.cure for f in errors)


def test_truncated_observations_keep_their_epochs(tmp_path: Path, reference_data: Path) -> None:
    given_files = files(reference_data, "kamakura")
    text = gzip.decompress(Path(given_files["observations"]).read_bytes())
    cut = tmp_path / "cut.obs"
    cut.write_bytes(text[: len(text) // 60])
    whole = protect(**{**given_files, "observations": cut})
    assert 100 < len(whole) < 400
    assert whole.table["hpl_m"].notna().sum() > 50


@pytest.mark.parametrize(
    "options",
    [
        {"mode": "lpv"}, {"profile": "do"}, {"k_h": 0.0}, {"k_v": np.nan}, {"alarms": "no"},
        {"elevation_mask_deg": 90.0}, {"place_m": (1.0, 2.0, 3.0)}, {"hal_m": 40.0},
        {"mode": "auto", "val_m": -1.0}, {"track_azimuth_deg": np.nan},
    ],
)  # fmt: skip
def test_settings_that_make_no_sense(options: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        protect("a.obs", "a.nav", "a.ems", geo=120, **options)


@st.composite
def damages(draw: st.DrawFn) -> dict[str, Any]:
    """What may go wrong with ranges and messages of some epochs."""
    return {
        "seed": draw(st.integers(0, 10**6)),
        "ranges": draw(st.sampled_from([0.0, 0.05, 0.3, 0.7])),
        "wild": draw(st.sampled_from([0.0, 0.0, 0.02, 0.2])),
        "messages": draw(st.sampled_from([0.0, 0.0, 0.05, 0.5])),
        "mode": draw(st.sampled_from(["pa", "npa"])),
        "known": draw(st.booleans()),
    }


def _damaged(
    ranges: Measurements, messages: SbasMessages, damage: dict[str, Any]
) -> tuple[Measurements, SbasMessages]:
    rng = np.random.default_rng(damage["seed"])
    kept = ranges.some(np.flatnonzero(rng.random(len(ranges)) >= damage["ranges"]))
    wild = np.where(rng.random(len(kept)) < damage["wild"], rng.normal(0, 1e5, len(kept)), 0.0)
    kept = replace(kept, code_m=kept.code_m + wild, raw_code_m=kept.raw_code_m + wild)
    return kept, _some(messages, rng.random(len(messages)) >= damage["messages"])


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(damage=damages())
def test_degraded_input_is_withheld_with_a_reason(
    reference_data: Path, damage: dict[str, Any]
) -> None:
    """No fix without four sound ranges, no range left out without a word, and never a smaller
    level than with everything there."""
    observed, navigation, messages = inputs(reference_data, "kamakura")
    ranges = measurements(between(observed, 3000, 3040), smoothing=False)
    start = int(ranges.time_ns[0] // 10**9)
    messages = _some(messages, np.abs(messages.time_s - start) < 700)
    budget = rules(damage["mode"], navigation)
    place = KAMAKURA_M if damage["known"] else None
    sound = solved(ranges, messages, navigation, budget, place)
    got = solved(*_damaged(ranges, messages, damage), navigation, budget, place)
    _consistent(got)
    both = sound.solved & got.solved
    if damage["messages"] == 0 and damage["wild"] == 0:
        assert not (got.solved & ~sound.solved).any()
        for level in (horizontal_level_m, vertical_level_m):
            less = level(got.covariance_m2, 6.0) < level(sound.covariance_m2, 6.0) * (1 - 1e-4)
            assert not less[both].any()
    if damage["wild"] > 0 and damage["messages"] == 0:
        # A wild range is found out or its epoch withheld, unless no range is there to tell.
        told = np.bincount(got.measured.epoch[got.used], minlength=both.size) > 4
        moved = np.linalg.norm(got.receiver_m - sound.receiver_m, axis=1)
        assert (moved[both & told] < 400).all()


def _consistent(fixes: Fixes) -> None:
    m = fixes.measured
    count = np.bincount(m.epoch[fixes.used], minlength=fixes.solved.size)
    assert (count[fixes.solved] >= 4).all()
    assert (count[~fixes.solved] == 0).all()
    assert ((fixes.reason == 0) == fixes.used).all()
    for values in (fixes.receiver_m, fixes.covariance_m2, fixes.dop):
        finite = np.isfinite(values).reshape(len(values), -1)
        assert finite[fixes.solved].all()
    assert np.isnan(fixes.receiver_m[~fixes.solved]).all()
    assert (fixes.budget.sigma_m[fixes.used] > 0).all()


def test_the_table_is_a_valid_one(vehicle: sbas.Recording, tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    write([vehicle], path)
    again = sbas.read(path)
    pd.testing.assert_frame_equal(again.table, vehicle.table, check_freq=False)
    assert len(again.side_tables[SIDE_TABLE]) == len(vehicle.side_tables[SIDE_TABLE])
