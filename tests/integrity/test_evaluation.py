"""The evaluation against counts made by hand, and against itself cut into pieces."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.integrity.evaluation import evaluate
from sbas.integrity.position_error import position_errors
from sbas.integrity.stanford import REGIONS, stanford_regions
from sbas.recording import Flag, Recording
from sbas.truth import FixedPoint, Trajectory
from tests.examples import POINT, quiet, recording


def eventful(n: int = 4000, seed: int = 3) -> Recording:
    """White errors with two HMI events, one MI epoch, an HPL outlier, gaps and missing levels."""
    rng = np.random.default_rng(seed)
    east, north = rng.normal(0, 0.5, (2, n))
    hpl = 11 + rng.normal(0, 0.2, n)
    east[500:530] = 60.0  # HMI for AL 20, 25 and 50
    north[1500:1512] = 22.0  # HMI for AL 20 only
    north[1800:1804] = 30.0  # too short for the time to alert
    east[2000] = 13.0  # MI, below every limit
    hpl[2500:2540] = 80.0  # unavailable
    hpl[3000:3010] = np.nan
    time = np.arange(n) + np.where(np.arange(n) >= 3500, 120, 0)
    return recording(east, north, hpl, time_s=time)


def test_regions_are_those_of_the_raw_epochs() -> None:
    r = eventful()
    result = evaluate(r, truth=POINT)
    hpe = position_errors(r, POINT)["hpe_m"].to_numpy()
    hpl = r.table["hpl_m"].to_numpy()
    for al in (50.0, 25.0, 20.0):
        regions = result.at(al).regions
        assert regions is not None
        counts = np.bincount(stanford_regions(hpe, hpl, al), minlength=len(REGIONS))
        assert list(regions.values()) == counts.tolist()
        assert sum(regions.values()) == len(r)
    assert result.mi_epochs == 30 + 12 + 4 + 1


def test_events_and_rates_by_hand() -> None:
    result = evaluate(eventful(), truth=POINT)
    at = {al: result.at(al) for al in (50.0, 25.0, 20.0)}
    assert [len(at[al].events["hmi"]) for al in at] == [1, 1, 2]
    assert at[25.0].events["hmi"].duration_s.tolist() == [30.0]
    assert at[20.0].events["hmi"].duration_s.tolist() == [30.0, 12.0]
    assert [len(at[al].events["exceeds_al"]) for al in at] == [1, 2, 3]
    assert len(at[50.0].events["mi"]) == 4
    rate = at[20.0].rates["hmi"]
    assert rate.events == 2
    # Ten epochs have no level; none begins in the two events of 42 s, nor in 60 s after each.
    assert rate.event_hours == pytest.approx(42 / 3600)
    assert rate.hours == pytest.approx((4000 - 10 - 42 - 120) / 3600)
    assert isinstance(rate.demonstrated, Estimate)
    # Two events, one-sided 95 %: chi-square 0.95 quantile with 6 degrees of freedom is 12.59159.
    assert rate.demonstrated.upper == pytest.approx(12.591587243743977 / 2 / rate.hours, rel=1e-9)
    assert isinstance(rate.modelled, Refusal)
    assert isinstance(rate.claimed, Estimate)
    assert rate.claimed.evidence == "claimed"
    assert isinstance(at[20.0].rates["exceeds_al"].claimed, Refusal)


def test_availability_with_and_without_gaps() -> None:
    up = evaluate(eventful(), truth=POINT).at(50.0).availability
    assert up.availability.value == pytest.approx((4000 - 50) / 4120)
    assert up.availability_excluding_gaps.value == pytest.approx((4000 - 50) / 4000)
    assert up.losses == 3
    curve = evaluate(eventful(), truth=POINT).curves
    at_50 = curve.available_fraction[curve.level_grid_m == 50.0]
    assert at_50[0] == pytest.approx((4000 - 50) / 4000)


def test_order_statistics_are_those_of_the_array() -> None:
    r = eventful()
    result = evaluate(r, truth=POINT)
    hpe = position_errors(r, POINT)["hpe_m"]
    assert result.hpe_m is not None
    assert result.hpe_m.median == pytest.approx(hpe.median(), rel=1e-14)
    assert result.hpe_m.p95 == pytest.approx(hpe.quantile(0.95), rel=1e-14)
    assert result.hpl_m is not None
    assert result.hpl_m.max == r.table["hpl_m"].max()
    assert result.hpl_m.epochs == 3990


def test_pieces_give_the_same_answer_as_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = evaluate(eventful(), truth=POINT).to_dict()
    monkeypatch.setattr("sbas.recording.BATCH_ROWS", 313)
    parts = evaluate(eventful(), truth=POINT).to_dict()
    for summary in ("hpe_m", "vpe_m", "hpl_m", "vpl_m"):
        assert parts[summary].pop("mean") == pytest.approx(whole[summary].pop("mean"), rel=1e-12)
    assert parts == whole


def test_ties_are_unsafe() -> None:
    n = 100
    hpl = np.full(n, 30.0)
    r = recording(np.zeros(n), np.zeros(n), hpl)
    hpe = position_errors(r, POINT)["hpe_m"].to_numpy()
    tie = r.replace(table=r.table.assign(hpl_m=np.maximum(hpe, 1e-12)))
    assert evaluate(tie, truth=POINT).mi_epochs == n
    assert evaluate(r, truth=POINT, alert_limits_m=[30.0]).at(30.0).availability.up_hours == 0


def test_without_truth_a_static_recording_gives_a_lower_bound_and_no_rate() -> None:
    result = evaluate(quiet(4000))
    assert result.errors_are_lower_bound
    assert result.hpe_m is not None
    assert result.hpe_m.median == pytest.approx(0.5 * np.sqrt(2 * np.log(2)), rel=0.05)
    refused = result.at(50.0).rates["hmi"].demonstrated
    assert isinstance(refused, Refusal)
    assert "not demonstrated" in refused.reason
    assert ("E01", "warning") in [(f.code, f.severity) for f in result.findings]


def test_without_truth_a_moving_recording_gives_levels_only() -> None:
    n = 1000
    r = recording(np.arange(n) * 10.0, np.zeros(n), np.full(n, 11.0))
    result = evaluate(r)
    assert result.hpe_m is None
    assert result.hpl_m is not None
    assert result.at(50.0).regions is None
    assert result.at(50.0).availability.availability.value == 1.0


@pytest.mark.parametrize("truth", [None, POINT])
def test_levels_without_any_position_are_judged_alone(truth: FixedPoint | None) -> None:
    whole = quiet(1000)
    hpl = np.where(np.arange(1000) < 250, 60.0, whole.table["hpl_m"])
    table = whole.table.assign(lat_deg=np.nan, lon_deg=np.nan, height_m=np.nan, hpl_m=hpl)
    result = evaluate(whole.replace(table=table), truth=truth)
    assert result.at(50.0).availability.availability.value == 0.75
    (said,) = (f for f in result.findings if f.code == "E01" and "level alone" in f.evidence)
    assert "no position" in said.message or "no epoch has a position" in said.message
    # One position is enough: then an epoch without one is down.
    table = whole.table.assign(lat_deg=whole.table["lat_deg"].where(np.arange(1000) < 500))
    result = evaluate(whole.replace(table=table), truth=truth)
    assert result.at(50.0).availability.availability.value == 0.5


def test_levels_outside_sbas_mode_are_no_levels() -> None:
    flags = np.zeros(1000, np.uint32)
    flags[100:200] = Flag.PL_OUTSIDE_SBAS
    result = evaluate(quiet(1000, flags=flags), truth=POINT)
    assert result.hpl_m is not None
    assert result.hpl_m.epochs == 900
    regions = result.at(50.0).regions
    assert regions is not None
    assert regions["missing"] == 100
    assert "E23" in [f.code for f in result.findings]


def test_an_unstated_frame_is_said() -> None:
    truth = type(POINT)(POINT.lat_deg, POINT.lon_deg, POINT.height_m)
    result = evaluate(quiet(100), truth=truth)
    assert "E09" in [f.code for f in result.findings]
    assert result.truth_sigma_h_m == pytest.approx(np.hypot(0.02, 1.0))


def test_json_holds_no_nan_and_the_agreed_keys() -> None:
    for r, truth in ((eventful(), POINT), (quiet(100), None)):
        plain = json.loads(json.dumps(evaluate(r, truth=truth).to_dict(), allow_nan=False))
        assert {"epochs", "hours", "hpe_m", "hpl_m", "alert_limits"} <= plain.keys()
        assert {"min", "median", "p95", "max"} <= plain["hpe_m"].keys()
        assert list(plain["alert_limits"]) == ["50", "25", "20"]
        for limit in plain["alert_limits"].values():
            assert {"availability", "regions", "events", "rates"} <= limit.keys()
            assert list(limit["regions"]) == list(REGIONS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"alert_limits_m": []}, "alert limits"),
        ({"alert_limits_m": [0]}, "alert limits"),
        ({"alert_limits_m": [float("nan")]}, "alert limits"),
        ({"alert_limits_m": [20, 20]}, "twice"),
        ({"confidence": 1.0}, "confidence"),
        ({"time_to_alert_s": -1}, "time_to_alert_s"),
        ({"accept_findings": ["E14"]}, "cannot be accepted"),
    ],
)
def test_impossible_questions_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        evaluate(quiet(100), truth=POINT, **options)  # type: ignore[arg-type]


def test_an_input_that_check_refuses_is_refused() -> None:
    r = quiet(100)
    back = r.replace(table=pd.concat([r.table.iloc[50:], r.table.iloc[:50]]))
    with pytest.raises(InputError, match="E14"):
        evaluate(back, truth=POINT)


def test_a_recording_without_levels_or_positions_is_unavailable_not_nominal() -> None:
    r = quiet(100)
    bare = r.replace(table=r.table[["hdop", "n_sv"]])
    result = evaluate(bare, truth=POINT)
    assert (result.hpe_m, result.hpl_m) == (None, None)
    at = result.at(50.0)
    assert at.availability.availability.value == 0.0
    assert at.regions is not None
    assert at.regions["missing"] == 100
    assert isinstance(at.rates["hmi"].demonstrated, Refusal)


def test_the_error_ellipse_is_the_sample_covariance() -> None:
    rng = np.random.default_rng(8)
    east = rng.normal(0.3, 2.0, 3000)
    north = 0.5 * east + rng.normal(0, 0.5, 3000)
    ellipse = evaluate(recording(east, north, np.full(3000, 11.0)), truth=POINT).ellipse
    assert ellipse is not None
    cov = np.cov(east, north, bias=True)
    assert ellipse.var_e_m2 == pytest.approx(cov[0, 0], rel=1e-5)
    assert ellipse.cov_en_m2 == pytest.approx(cov[0, 1], rel=1e-5)
    major, minor, azimuth = ellipse.axes()
    assert (major**2, minor**2) == pytest.approx(np.linalg.eigvalsh(cov)[::-1].tolist(), rel=1e-5)
    assert azimuth == pytest.approx(np.degrees(np.arctan2(2.0, 1.0)), abs=2)


def test_no_rate_of_recording_makes_more_hours_than_have_passed() -> None:
    time = np.concatenate([np.arange(6000), 6000 + np.arange(5000) / 10])
    zero = np.zeros(time.size)
    result = evaluate(recording(zero, zero, zero + 11.0, time_s=time), truth=POINT)
    passed = (time[-1] + 1) / 3600
    assert result.hours == pytest.approx(passed, rel=1e-12)
    assert result.at(50.0).rates["hmi"].hours == pytest.approx(passed, rel=1e-12)
    assert "E27" in [f.code for f in result.findings]


def test_a_record_that_misleads_throughout_demonstrates_nothing() -> None:
    n = 3600
    result = evaluate(recording(np.full(n, 60.0), np.zeros(n), np.full(n, 10.0)), truth=POINT)
    assert isinstance(result.at(50.0).rates["hmi"].demonstrated, Refusal)


def test_flicker_that_is_merged_is_said() -> None:
    east = np.zeros(6000)
    east[np.arange(6000) % 100 < 50] = 60.0
    rate = evaluate(recording(east, np.zeros(6000), np.full(6000, 10.0)), truth=POINT).at(50.0)
    assert rate.rates["hmi"].events == 1
    assert rate.rates["hmi"].runs == 60
    assert len(rate.events["hmi"]) == 60


def test_the_time_to_alert_is_reached_in_spite_of_jitter() -> None:
    time = np.arange(100) + 0.0
    east = np.zeros(100)
    east[40:50] = 60.0
    time[49] -= 0.05
    result = evaluate(recording(east, np.zeros(100), np.full(100, 10.0), time_s=time), truth=POINT)
    assert result.at(50.0).rates["hmi"].events == 1


def test_close_alert_limits_keep_their_results() -> None:
    limits = [25.0000001, 25.0, 24.9999]
    plain = evaluate(quiet(100), truth=POINT, alert_limits_m=limits).to_dict()["alert_limits"]
    assert [entry["alert_limit_m"] for entry in plain.values()] == limits


def test_a_level_beside_another_mode_is_left_out_though_no_flag_says_so() -> None:
    zero = np.zeros(100)
    r = recording(zero, zero, zero + 11.0, mode="standalone")
    assert "flags" not in r.table
    result = evaluate(r, truth=POINT)
    assert result.hpl_m is None
    assert result.at(50.0).availability.availability.value == 0.0


def test_a_truth_that_ends_early_is_said() -> None:
    r = quiet(200)
    track = r.table[["lat_deg", "lon_deg", "height_m"]].iloc[:120]
    findings = evaluate(r, truth=Trajectory(track, frame="x")).findings
    assert any("120 of 200" in f.message for f in findings)
    assert any("every error is zero" in f.message for f in findings)
