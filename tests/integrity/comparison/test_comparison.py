from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from sbas.estimate import Counted, Estimate, Refusal
from sbas.exceptions import InputError
from sbas.integrity.comparison.comparison import compare
from sbas.integrity.comparison.comparison_results import Differences, LevelRatio
from sbas.laboratory import LaboratorySettings, simulate
from sbas.recording import MODES, ProtectionLevelMeta, Recording, mode_categories
from sbas.truth import FixedPoint
from tests.examples import POINT, quiet, recording


def pair(n: int = 4000, **changes: Any) -> tuple[Recording, Recording]:
    """PA with K 6.0 and NPA with 6.18 of the same sigmas; A's columns changed as given."""
    still = np.zeros(n)
    level = 11 + np.sin(np.arange(n) / 500)
    a = recording(still, still, level * 6.0 / 6.18, mode="sbas_pa")
    b = recording(still, still, level, mode="sbas_npa")
    return a.replace(table=a.table.assign(**changes)), b


def level_ratio(ratio: LevelRatio | Refusal) -> LevelRatio:
    assert isinstance(ratio, LevelRatio)
    return ratio


def test_differences_by_hand() -> None:
    """3-4-5: 0.5 m at 94 of 100 epochs, 5 m at 5 and 2.5 m at one."""
    still = np.zeros(100)
    size = np.full(100, 0.1)
    size[10:15], size[50] = 1.0, 0.5
    a = recording(3 * size, -4 * size, still + 11)
    result = compare(a, recording(still, still, still + 11))
    found = result.difference
    assert isinstance(found, Differences)
    assert (found.epochs, result.paired) == (100, 100)
    assert found.median.value == pytest.approx(0.5, abs=1e-5)
    # Linear between order statistics 94 and 95 of 0..99: position 94.05, values 2.5 and 5 m.
    assert found.p95.value == pytest.approx(2.5 + 0.05 * 2.5, abs=1e-4)
    assert found.max == pytest.approx(5.0, abs=1e-4)
    assert np.datetime64(found.max_time_ns, "ns") == np.datetime64("2009-09-19T00:00:10")
    assert found.east.median == pytest.approx(0.3, abs=1e-5)
    assert found.north.median == pytest.approx(-0.4, abs=1e-5)
    assert found.up is not None
    assert found.up.max < 1e-5


def test_equal_sigmas_give_the_ratio_of_the_k_factors() -> None:
    """6.0/6.18 = 0.970874 (Filip, Bazant, Mocek 2010, 2.1)."""
    ratio = level_ratio(compare(*pair()).hpl_ratio)
    assert ratio.expected == pytest.approx(0.9708738, abs=1e-7)
    assert ratio.median.value == pytest.approx(0.9708738, abs=1e-7)
    assert isinstance(ratio.sigma_ratio, Estimate)
    assert ratio.sigma_ratio.value == pytest.approx(1.0, abs=1e-12)
    verdict = compare(*pair()).verdict[1]
    assert "0.9709" in verdict
    assert "No difference of the sigmas" in verdict


def test_a_larger_sigma_is_seen_behind_the_k_factors() -> None:
    a, b = pair()
    larger = a.replace(table=a.table.assign(hpl_m=a.table["hpl_m"] * 1.2))
    result = compare(larger, b, tau_s=60)
    ratio = level_ratio(result.hpl_ratio)
    assert isinstance(ratio.sigma_ratio, Estimate)
    assert ratio.sigma_ratio.value == pytest.approx(1.2)
    assert "A (PA)'s model sigma is 20.0 % larger" in result.verdict[1]


def test_levels_that_are_not_of_do_229_have_no_k() -> None:
    a, b = pair()
    own = b.replace(meta=b.meta.__class__(pl=ProtectionLevelMeta(kind="receiver")))
    ratio = level_ratio(compare(a, own).hpl_ratio)
    assert isinstance(ratio.expected, Refusal)
    assert isinstance(ratio.sigma_ratio, Refusal)
    assert "K factor" in ratio.expected.reason


def test_availability_and_discordant_events_by_hand() -> None:
    """A down for 20 s and 10 s more 5 min later, B down for 40 s; 30 s of them together."""
    n = 4000
    a, b = pair(n)
    level_a, level_b = np.full(n, 11.0), np.full(n, 11.0)
    level_a[1000:1020] = level_a[1300:1310] = 25.0
    level_b[1015:1055] = 40.0
    a = a.replace(table=a.table.assign(hpl_m=level_a))
    b = b.replace(table=b.table.assign(hpl_m=level_b))
    result = compare(a, b, alert_limits_m=(50, 25, 20))
    at_50, at_25, at_20 = result.alert_limits
    assert at_50.availability_a.value == at_50.availability_b.value == 1
    assert at_50.only_a_s == at_50.only_b_s == 0
    assert "never was one up without the other" in result.verdict[2]
    # A level at the alert limit is down.
    for limit in (at_25, at_20):
        assert limit.availability_a.value == pytest.approx(1 - 30 / n)
        assert limit.availability_b.value == pytest.approx(1 - 40 / n)
        assert (limit.only_a_s, limit.only_b_s) == (35, 25)
        assert isinstance(limit.only_a.basis, Counted)
        assert isinstance(limit.only_b.basis, Counted)
        assert (limit.only_a.basis.events, limit.only_b.basis.events) == (1, 2)
        assert isinstance(limit.difference, Refusal)
        # Garwood, two-sided 95 %, one event: 0.02531781 to 5.571643.
        hours = n / 3600
        assert limit.only_a.lower == pytest.approx(0.02531781 / hours, rel=1e-6)
        assert limit.only_a.upper == pytest.approx(5.571643 / hours, rel=1e-6)
    assert "No difference is demonstrated" in result.verdict[4]


def test_what_one_receiver_did_not_record_is_down_for_it() -> None:
    a, b = quiet(1000), quiet(1000, seed=2)
    holed = a.replace(table=a.table.drop(a.table.index[400:500]))
    result = compare(holed, b)
    limit = result.alert_limits[0]
    assert limit.availability_a.value == pytest.approx(0.9)
    assert limit.availability_b.value == 1
    assert (limit.recorded_both_a, limit.recorded_both_b) == (1, 1)
    assert limit.only_b_s == 100
    assert (result.paired, result.unpaired_a, result.unpaired_b) == (900, 0, 100)
    assert any("A (NPA) lacks 100 epochs" in text for text in result.caveats)


def test_levels_without_a_fix_missing_or_invalid_are_down() -> None:
    a, b = pair(1000)
    level = a.table["hpl_m"].to_numpy().copy()
    level[:10] = np.nan
    lat = a.table["lat_deg"].to_numpy().copy()
    lat[20:25] = np.nan
    flags = np.zeros(1000, np.uint32)
    flags[30:33] = 8
    a = a.replace(table=a.table.assign(hpl_m=level, lat_deg=lat, flags=flags))
    assert compare(a, b).alert_limits[0].availability_a.value == pytest.approx(1 - 18 / 1000)


def test_many_discordant_events_give_an_interval_and_a_verdict() -> None:
    n = 200_000
    a, b = pair(n)
    rng = np.random.default_rng(0)
    level = np.full(n, 11.0)
    for start in rng.choice(n // 400 - 1, 200, replace=False) * 400:
        level[start : start + 20] = 60.0
    a = a.replace(table=a.table.assign(hpl_m=level))
    result = compare(a, b, alert_limits_m=(50,), tau_s=60)
    difference = result.alert_limits[0].difference
    assert isinstance(difference, Estimate)
    assert difference.value == pytest.approx(-0.02)
    assert difference.lower is not None
    assert difference.upper is not None
    # 200 outages of 20 s: standard error near 20 sqrt(200)/T (at random, without replacement).
    assert difference.upper - difference.lower == pytest.approx(
        2 * 1.96 * 20 * np.sqrt(200 * 0.6) / n, rel=0.15
    )
    assert "B (NPA) is available more often" in result.verdict[2]


def test_a_receiver_that_never_is_up_is_told_from_one_that_always_is() -> None:
    """One discordant event only, but the two shares' intervals lie far apart."""
    a, b = pair(20_000)
    b = b.replace(table=b.table.assign(hpl_m=1000.0))
    result = compare(a, b, alert_limits_m=(50,))
    assert "A (PA) alone in 1 event (20,000 s)" in result.verdict[2]
    assert "A (PA) is available more often" in result.verdict[2]
    short = compare(*(r.replace(table=r.table.iloc[:300]) for r in (a, b)), alert_limits_m=(50,))
    assert "No difference is demonstrated" in short.verdict[2]


def test_the_plain_answer_is_json_with_the_keys_that_others_rely_on() -> None:
    plain = compare(*pair(), truth=POINT).to_dict()
    text = json.dumps(plain, allow_nan=False)
    assert {"median", "p95", "max"} <= set(plain["difference_m"])
    assert plain["availability_a"] == plain["availability_b"] == {"50": 1.0, "25": 1.0, "20": 1.0}
    assert plain["settings"]["tau_s"] == 360.0
    assert "the paper's assumption" in text
    assert "no evidence of integrity" in text


def test_errors_of_both_with_truth() -> None:
    a, b = quiet(2000), quiet(2000, seed=2)
    east = a.table["lat_deg"].to_numpy().copy()
    east[5] += 3e-4
    a = a.replace(table=a.table.assign(lat_deg=east))
    result = compare(a, b, truth=POINT)
    assert result.error_a is not None
    assert result.error_b is not None
    assert (result.error_a.mi_epochs, result.error_b.mi_epochs) == (1, 0)
    # 3e-4 degrees of latitude: 33.4 m (meridian radius 6 372 955 m at 50.03 degrees).
    assert result.error_a.max == pytest.approx(3e-4 * np.pi / 180 * 6_372_955, abs=2)
    # Rayleigh, sigma 0.5 m: median 1.177 sigma.
    assert result.error_b.median == pytest.approx(0.5 * 1.17741, rel=0.05)


def test_drop_outs_from_pa_are_events_with_what_can_be_seen() -> None:
    n = 4000
    codes = np.full(n, MODES.index("sbas_pa"))
    codes[500:520] = codes[560:570] = MODES.index("sbas_npa")
    codes[2000:2003] = MODES.index("none")
    satellites = np.full(n, 9, np.int16)
    satellites[2000:2003] = 3
    geo = np.full(n, 120, np.int16)
    codes[3000:3005] = MODES.index("sbas_npa")
    geo[3000:] = 124
    result = compare(*pair(mode=mode_categories(codes), n_sv=satellites, geo_prn=geo))
    found = result.drop_outs_a
    assert found is not None
    assert result.drop_outs_b is None
    # 520 and 560 are nearer than max(tau/2, 60 s) = 180 s: one event.
    assert found.events.duration_s.tolist() == [70, 3, 5]
    assert found.to_mode == ("sbas_npa", "none", "sbas_npa")
    assert [text.split(":")[0] for text in found.condition] == ["not logged", "10", "9"]
    assert isinstance(found.rate.basis, Counted)
    assert found.rate.basis.hours == pytest.approx((n - 38) / 3600)
    assert "A (PA) left PA 3 times, for 78 s in all" in "\n".join(result.verdict)


def test_laboratory_pa_against_npa() -> None:
    """The same sky and sigmas, other noise: distances are those of two independent errors."""
    settings = LaboratorySettings(hours=6.0, sbas_frames=False, decorrelation_time_s=30.0)
    a = simulate(LaboratorySettings(**{**vars(settings), "mode": "pa", "seed": 1}))
    b = simulate(LaboratorySettings(**{**vars(settings), "seed": 2}))
    truth = FixedPoint(settings.lat_deg, settings.lon_deg, settings.height_m, frame="simulated")
    result = compare(a, b, truth=truth, tau_s=30)
    ratio = level_ratio(result.hpl_ratio)
    assert ratio.median.value == pytest.approx(6.0 / 6.18, rel=1e-9)
    assert isinstance(result.difference, Differences)
    assert result.error_a is not None
    assert result.error_b is not None
    # Variances add: sqrt(2) times one receiver's own.
    own = (result.error_a.median + result.error_b.median) / 2
    median = result.difference.median
    assert median.lower is not None
    assert median.upper is not None
    assert median.lower < np.sqrt(2) * own < median.upper
    assert result.offset is None


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        (quiet(100), quiet(100).replace(table=quiet(100).table.iloc[:0]), "no epoch"),
        (quiet(1), quiet(100), "has 1 epoch"),
        (
            quiet(100),
            recording(np.zeros(50), np.zeros(50), np.ones(50), time_s=np.arange(50) + 86400),
            "share no time",
        ),
        (
            quiet(100),
            quiet(100).replace(table=quiet(100).table.iloc[::-1]),
            "time goes backward",
        ),
    ],
)
def test_what_cannot_be_compared_is_refused_with_a_cure(
    a: Recording, b: Recording, words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        compare(a, b)
    assert caught.value.cure


@pytest.mark.parametrize(
    "options", [{"tau_s": 0}, {"confidence": 1.0}, {"alert_limits_m": ()}, {"tau_s": float("nan")}]
)
def test_arguments_out_of_range_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        compare(quiet(100), quiet(100), **options)


def test_one_recording_given_twice_is_told() -> None:
    result = compare(quiet(300), quiet(300))
    assert any("one recording given twice" in text for text in result.caveats)


def test_without_levels_or_positions_the_rest_is_given() -> None:
    a, b = quiet(300), quiet(300, seed=2)
    bare = a.replace(table=a.table[["hpl_m"]])
    result = compare(bare, b)
    assert isinstance(result.difference, Refusal)
    assert isinstance(result.hpl_ratio, LevelRatio)
    assert result.alert_limits[0].availability_a.value == 0
    no_level = a.replace(table=a.table.drop(columns="hpl_m"))
    assert isinstance(compare(no_level, b).hpl_ratio, Refusal)
    assert str(compare(no_level, b))
    assert not compare(no_level, b).summary().empty
