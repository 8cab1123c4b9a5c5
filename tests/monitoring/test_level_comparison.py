from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from sbas.exceptions import InputError
from sbas.monitoring.level_comparison import hpl_risk, raim_against_sbas
from sbas.monitoring.recording_monitor import raim
from sbas.recording import Flag, Recording
from tests.monitoring.recordings import START, noisy, recording_of
from tests.monitoring.skies import CASES


def test_the_risk_of_the_published_factors() -> None:
    # Filip, Bazant, Mocek 2010, section 2.1: 5e-9 and 2e-9 per sample.
    assert hpl_risk(6.18) == pytest.approx(5e-9, rel=0.03)
    assert hpl_risk(6.0) == pytest.approx(2 * norm.sf(6.0), rel=1e-12)
    assert hpl_risk(6.0) == pytest.approx(2e-9, rel=0.03)


def test_the_statement_follows_the_figures() -> None:
    recording = noisy(1, 8, 50, hpl_m=1.0, hdop=np.full(50, 1.0))
    found = raim_against_sbas(recording)
    assert found.herl_is_usually_larger is True
    assert "50 of 50" in found.statement()
    assert "holds here" in found.statement()
    other = raim_against_sbas(noisy(1, 8, 50, hpl_m=1e4))
    assert other.herl_is_usually_larger is False
    assert "does not hold" in other.statement()
    assert other.herl_hdop_correlation is None
    json.dumps(other.to_dict(), allow_nan=False)


def test_the_statement_turns_at_the_shift_of_equal_levels() -> None:
    recording = noisy(2, 9, 20, hpl_m=10.0)
    found = raim_against_sbas(recording)
    even = found.even_shift
    assert even is not None
    for missed, larger in ((0.3, False), (1e-9, True)):
        other = raim_against_sbas(recording, missed_detection=missed)
        assert other.raim.design is not None
        assert (other.raim.design.shift > even) is larger
        assert other.herl_is_usually_larger is larger
        assert other.even_shift == pytest.approx(even, rel=1e-9)


def test_the_level_like_the_hpl_has_its_risk() -> None:
    recording = noisy(2, 8, 10, hpl_m=20.0)
    found = raim_against_sbas(recording)
    assert found.risk == pytest.approx(np.exp(-(6.18**2) / 2), rel=1e-12)
    assert found.risk is not None
    own = raim(recording, risk=found.risk).epochs["hpl_separation_m"].to_numpy()
    assert found.levels["like_hpl_m"].to_numpy() == pytest.approx(own, rel=1e-12)
    assert (found.levels["like_hpl_m"] > found.levels["sigma_major_m"] * 5).all()


def test_availability_is_counted_by_satellites_and_against_sbas() -> None:
    full = noisy(4, 7, 40)
    side = full.side_tables["satellites"]
    elevation, azimuth, sigma, residual = (
        side[name].to_numpy().reshape(7, 40)
        for name in ("elevation_deg", "azimuth_deg", "sigma_m", "residual_m")
    )
    elevation = elevation.copy()
    elevation[4:, :10] = np.nan
    elevation[5:, 10:20] = np.nan
    hpl = np.where(np.arange(40) < 35, 15.0, np.nan)
    found = raim_against_sbas(recording_of(elevation, azimuth, sigma, residual, hpl_m=hpl))
    rows = found.by_satellites
    assert rows.loc[4, ["epochs", "fix", "tested", "available"]].tolist() == [10, 10, 0, 0]
    assert rows.loc[5, ["epochs", "fix", "tested", "identifies"]].tolist() == [10, 10, 10, 0]
    assert rows.loc[7, "identifies"] == 20
    assert found.both[1, 0] == 10
    assert found.both[0].sum() == 5
    assert found.both.sum() == 40
    assert np.isnan(found.levels["herl_m"].iloc[:10]).all()
    strict = raim_against_sbas(
        full.replace(table=full.table.assign(hpl_m=15.0)), alert_limit_m=1e-3
    )
    assert strict.both.tolist() == [[40, 0], [0, 0]]


def test_what_cannot_be_compared_is_refused() -> None:
    with pytest.raises(InputError, match="no HPL"):
        raim_against_sbas(noisy(1, 6, 2))
    with pytest.raises(InputError, match="alert limit"):
        raim_against_sbas(noisy(1, 6, 2, hpl_m=1.0), alert_limit_m=0.0)


def test_ratios_are_of_levels_that_are_finite_and_above_zero() -> None:
    hpl = np.array([10.0, np.inf, 0.0, -5.0, np.nan, 20.0])
    found = raim_against_sbas(noisy(1, 8, 6, hpl_m=hpl))
    herl = found.levels["herl_m"].to_numpy()
    assert found.ratio("herl_m") == pytest.approx([herl[0] / 10, herl[5] / 20], rel=1e-12)
    assert found.to_dict()["over_hpl"]["herl"]["epochs"] == 2
    # A level of 0 or below protects nobody.
    assert found.both.sum(axis=1).tolist() == [4, 2]


def test_the_findings_of_raim_are_part_of_the_answer() -> None:
    recording = noisy(1, 8, 50, hpl_m=12.0)
    side = recording.side_tables["satellites"]
    side = side.assign(sigma_m=100 * side["sigma_m"])
    found = raim_against_sbas(recording.replace(side_tables={"satellites": side}))
    assert "E08" in [finding["code"] for finding in found.to_dict()["findings"]]


def test_a_fault_that_would_not_show_makes_herl_infinite_not_absent() -> None:
    """Case A, whose satellite in the zenith is replaced by one that alone holds the east."""
    azimuth = np.array([0.0, 0.0, 180.0, 180.0, 90.0])[:, None]
    elevation = np.array([20.0, 60.0, 20.0, 60.0, 10.0])[:, None]
    found = raim_against_sbas(recording_of(elevation, azimuth, 1.0, np.zeros((5, 1)), hpl_m=9.0))
    assert found.raim.available == 0
    assert found.levels["herl_m"].tolist() == [np.inf]
    assert found.ratio("herl_m").size == 0


def test_ranges_that_are_not_known_have_a_line_of_their_own() -> None:
    recording = noisy(1, 8, 10, hpl_m=12.0)
    side = recording.side_tables["satellites"].copy()
    side.loc[side["time"] == recording.time[3], "azimuth_deg"] = np.nan
    found = raim_against_sbas(recording.replace(side_tables={"satellites": side}))
    assert found.by_satellites["epochs"].to_dict() == {-1: 1, 8: 9}
    assert found.to_dict()["by_satellites"]["unknown"]["fix"] == 0


def test_an_exclusion_leaves_an_epoch_under_the_number_of_all_its_ranges() -> None:
    azimuth, elevation = (np.repeat(np.array(v, float)[:, None], 3, 1) for v in CASES["B"])
    # A seventh satellite lets the fault of the first be told apart.
    azimuth, elevation = (
        np.vstack([values, np.full((1, 3), one)])
        for values, one in ((azimuth, 30.0), (elevation, 35.0))
    )
    y = np.zeros((7, 3))
    y[0] = 60.0
    found = raim_against_sbas(recording_of(elevation, azimuth, 1.0, y, hpl_m=12.0))
    assert found.raim.excluded == 3
    assert found.by_satellites["identifies"].to_dict() == {7: 3}


def logged() -> Recording:
    """Three epochs of a receiver whose HERL lies above the alert limit of the tests."""
    index = pd.DatetimeIndex(START + np.arange(3) * np.timedelta64(1, "s"), name="time")
    flags = np.array([Flag.RAIM_PASSED, Flag.RAIM_FAILED, Flag.RAIM_PASSED], "u4")
    return Recording(
        pd.DataFrame({"flags": flags, "herl_m": 60.0, "hpl_m": [20.0, 20.0, 50.0]}, index=index)
    )


def test_raim_without_a_level_of_its_own_is_available_by_its_verdict() -> None:
    found = raim_against_sbas(logged(), alert_limit_m=25.0)
    assert found.both.tolist() == [[0, 1], [1, 1]]
    assert "verdict" in found.to_dict()["raim_available_where"]
    assert "below 25 m" in raim_against_sbas(noisy(1, 8, 3, hpl_m=1.0), alert_limit_m=25).raim_words


def test_settings_of_ranges_are_refused_for_a_receivers_own_herl() -> None:
    for settings in ({"risk": 1e-7}, {"prior": 1e-4}, {"false_alarm": 1e-2}, {"sigma": 1.0},
                     {"outlier_alarm": 1e-3}, {"elevation_mask_deg": 5.0}):  # fmt: skip
        with pytest.raises(InputError):
            raim_against_sbas(logged(), **settings)


def test_a_mask_takes_part_in_the_comparison() -> None:
    recording = noisy(2, 9, 5, hpl_m=12.0)
    masked = raim_against_sbas(recording, elevation_mask_deg=25.0)
    own = raim(recording, elevation_mask_deg=25.0).epochs
    assert masked.levels["n_sv"].tolist() == own["n_sv"].tolist()
    assert masked.levels["n_sv"].max() < 9
