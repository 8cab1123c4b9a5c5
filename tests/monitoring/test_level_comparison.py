from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.stats import norm

from sbas.exceptions import InputError
from sbas.monitoring.level_comparison import hpl_risk, raim_against_sbas
from sbas.monitoring.recording_monitor import raim
from tests.monitoring.recordings import noisy, recording_of


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
