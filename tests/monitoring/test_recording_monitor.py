from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from sbas.exceptions import InputError
from sbas.monitoring.receiver_flags import with_raim_flags
from sbas.monitoring.recording_monitor import raim
from sbas.monitoring.verdicts import MonitorReason, Verdict
from sbas.satellite_table import SIDE_TABLE
from tests.monitoring.recordings import noisy, recording_of
from tests.monitoring.skies import CASES, design_of, random_sky, refit


def test_the_statistic_is_that_of_a_fit_of_the_recorded_residuals() -> None:
    rng = np.random.default_rng(0)
    e, a, s = random_sky(rng, 7, 5)
    y = rng.normal(size=(7, 5)) * s
    result = raim(recording_of(e, a, s, y))
    for t in range(5):
        rows = design_of(e[:, t], a[:, t], np.zeros(7))
        statistic = refit(rows, s[:, t], y[:, t])[1]
        assert result.epochs["statistic"].iloc[t] == pytest.approx(statistic, rel=1e-8)
    assert result.epochs["threshold"].to_numpy() == pytest.approx(chi2.isf(1e-3, 3), rel=1e-10)


def test_a_fault_is_named_and_its_epochs_are_runs() -> None:
    recording = noisy(3, 9, 60)
    side = recording.side_tables[SIDE_TABLE].copy()
    wrong = (side["satellite"] == "G04") & (side["time"] >= recording.time[10])
    wrong &= side["time"] < recording.time[20]
    side.loc[wrong, "residual_m"] += 200.0
    result = raim(recording.replace(side_tables={SIDE_TABLE: side}))
    rows = result.epochs.iloc[10:20]
    assert (rows["verdict"] == Verdict.PASSED_AFTER_EXCLUSION.words).all()
    assert (rows["excluded"] == "G04").all()
    assert rows["available"].all()
    assert rows["detected"].all()
    assert result.detected == 10
    assert result.alarm_runs == 1
    assert result.excluded == 10
    assert (rows["n_sv"] == 9).all()
    assert (rows["n_sv_left"] == 8).all()
    assert (result.epochs["n_sv_left"].iloc[:10] == 9).all()
    plain = result.to_dict()
    assert plain["detected"] == 10
    assert plain["available"] == 60
    assert plain["herl_m"]["median"] == pytest.approx(float(result.epochs["herl_m"].median()))
    json.dumps(plain, allow_nan=False)


def test_four_satellites_are_not_available() -> None:
    result = raim(noisy(3, 4, 10))
    assert result.available == 0
    assert result.count(Verdict.NOT_AVAILABLE) == 10
    assert np.isnan(result.epochs["herl_m"]).all()
    assert list(result.reasons().values()) == [10]
    assert result.variance_factor is None
    json.dumps(result.to_dict(), allow_nan=False)


def test_without_residuals_the_geometry_speaks_and_nothing_has_passed() -> None:
    recording = noisy(3, 8, 10)
    side = recording.side_tables[SIDE_TABLE].drop(columns="residual_m")
    result = raim(recording.replace(side_tables={SIDE_TABLE: side}))
    assert result.available == 0
    assert result.epochs["herl_m"].to_numpy() == pytest.approx(
        raim(recording).epochs["herl_m"].to_numpy(), rel=1e-12
    )


def test_a_critical_satellite_leaves_the_vertical_unavailable() -> None:
    azimuth, elevation = (np.array(v, float)[:, None] for v in CASES["A"])
    recording = recording_of(elevation, azimuth, 1.0, np.zeros((5, 1)))
    result = raim(recording, outlier_alarm=1e-3, missed_detection=0.2, track_azimuth_deg=30.0)
    assert result.available == 1
    assert not result.epochs["available_vertical"].any()
    assert np.isinf(result.epochs["verl_m"].iloc[0])
    assert result.epochs["erl_along_m"].iloc[0] == pytest.approx(4.13214797, abs=5e-8)
    assert result.to_dict()["verl_m"]["infinite"] == 1


def test_noise_of_the_stated_sigmas_has_a_variance_factor_near_one() -> None:
    result = raim(noisy(5, 9, 5000))
    # The median of 5000 chi-square values scatters by about one percent.
    assert result.variance_factor == pytest.approx(1.0, abs=0.06)
    assert result.findings == () or {f.code for f in result.findings} <= {"E25"}


def test_chunks_do_not_show(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = noisy(6, 8, 100)
    whole = raim(recording).epochs
    monkeypatch.setattr("sbas.monitoring.recording_monitor.CHUNK_EPOCHS", 7)
    assert raim(recording).epochs.equals(whole)


def test_residuals_of_another_fix_are_noticed() -> None:
    assert "E25" in {f.code for f in raim(noisy(7, 8, 5)).findings}


def test_two_faults_at_once_are_a_risk_that_is_named() -> None:
    result = raim(noisy(8, 12, 3), risk=1e-9, prior=1e-4)
    assert "E28" in {f.code for f in result.findings}
    assert "E28" not in {f.code for f in raim(noisy(8, 12, 3)).findings}


def test_what_makes_no_test_is_refused() -> None:
    with pytest.raises(InputError):
        raim(noisy(1, 6, 2), false_alarm=0.0)
    with pytest.raises(InputError):
        raim(noisy(1, 6, 2), track_azimuth_deg=float("nan"))
    with pytest.raises(InputError):
        raim(noisy(1, 6, 2), source="else")  # type: ignore[arg-type]
    with pytest.raises(InputError):
        raim(noisy(1, 6, 2).replace(side_tables={}))


def test_an_empty_recording_has_no_epoch() -> None:
    recording = noisy(1, 6, 2)
    side = recording.side_tables[SIDE_TABLE][:0]
    empty = recording.replace(table=recording.table[:0], side_tables={SIDE_TABLE: side})
    assert raim(empty).to_dict()["epochs"] == 0


def test_an_excluded_epoch_keeps_the_test_of_all_its_ranges() -> None:
    """Case C of the methods page with 10 m on satellite 1: T 35.457358, three degrees."""
    azimuth, elevation = (np.repeat(np.array(v, float)[:, None], 3, 1) for v in CASES["C"])
    y = np.zeros((7, 3))
    y[0] = 10.0
    result = raim(recording_of(elevation, azimuth, 1.0, y), outlier_alarm=1e-3)
    epochs = result.epochs
    assert result.excluded == 3
    assert epochs["statistic"].to_numpy() == pytest.approx(35.45735832, abs=5e-8)
    assert epochs["dof"].tolist() == [3, 3, 3]
    assert epochs["threshold"].to_numpy() == pytest.approx(chi2.isf(1e-3, 3), rel=1e-10)
    assert epochs["n_sv"].tolist() == [7, 7, 7]
    assert epochs["n_sv_left"].tolist() == [6, 6, 6]
    assert result.variance_factor == pytest.approx(35.45735832 / chi2.median(3), rel=1e-8)
    left = recording_of(elevation[1:], azimuth[1:], 1.0, y[1:])
    assert epochs["herl_m"].to_numpy() == pytest.approx(
        raim(left, outlier_alarm=1e-3).epochs["herl_m"].to_numpy(), rel=1e-9
    )


def test_ranges_that_are_not_those_of_the_fix_have_no_number() -> None:
    recording = noisy(3, 8, 4)
    side = recording.side_tables[SIDE_TABLE].copy()
    side.loc[(side["satellite"] == "G03") & (side["time"] == recording.time[1]), "sigma_m"] = np.nan
    side = side[side["time"] != recording.time[2]]
    epochs = raim(recording.replace(side_tables={SIDE_TABLE: side})).epochs
    assert epochs["n_sv"].tolist() == [8, -1, 0, 8]
    assert epochs["reason"].iloc[1] == MonitorReason.INCOMPLETE.words


@pytest.mark.parametrize("mask", [float("nan"), -20.0, 90.0, 500.0, "5"])
def test_a_mask_that_is_none_is_refused(mask: Any) -> None:
    with pytest.raises(InputError, match="elevation mask"):
        raim(noisy(7, 8, 5), elevation_mask_deg=mask)


@pytest.mark.parametrize(
    "settings",
    [
        {"track_azimuth_deg": 361.0}, {"track_azimuth_deg": -1e9}, {"track_azimuth_deg": "north"},
        {"exclusions": True}, {"exclusions": 1.0}, {"exclusions": 3}, {"false_alarm": "x"},
        {"missed_detection": True}, {"outlier_alarm": None}, {"risk": "1e-7"}, {"prior": [1e-5]},
    ],
)  # fmt: skip
def test_settings_of_another_kind_are_refused(settings: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        raim(noisy(1, 6, 2), **settings)


def test_settings_are_part_of_the_result() -> None:
    result = raim(noisy(7, 8, 5), sigma=(1.0, 2.0), elevation_mask_deg=0)
    assert (result.sigma, result.elevation_mask_deg) == ((1.0, 2.0), 0)
    assert result.to_dict()["elevation_mask_deg"] == 0


def test_ranges_without_sigma_give_way_to_the_recordings_own_raim() -> None:
    recording = noisy(7, 8, 5)
    side = recording.side_tables[SIDE_TABLE].drop(columns="sigma_m")
    both = with_raim_flags(recording, raim(recording)).replace(side_tables={SIDE_TABLE: side})
    assert raim(both).source == "written"
    assert raim(both, sigma=2.0).source == "ranges"
