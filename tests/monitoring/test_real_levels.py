"""HERL, RAIM's levels and the HPL on the same epochs of the real cases."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from sbas.augmentation import read_messages
from sbas.monitoring.level_comparison import LevelComparison, raim_against_sbas
from sbas.positioning.protected_recording import protect
from sbas.recording import Recording
from sbas.satellite_table import SIDE_TABLE
from tests.monitoring.skies import design_of

CASES = ("vehicle, pa", "vehicle, npa", "kamakura, pa", "kamakura, npa")
K_H = {"pa": 6.0, "npa": 6.18}


@cache
def recorded(data: Path, case: str) -> Recording:
    place, mode = case.split(", ")
    if place == "vehicle":
        folder, geo, log = data / "msas_vehicle_2008147", 129, "msas_129.ems"
        files = folder / "cres_20080526.obs", [folder / "cres_20080526.nav", folder / "all.nav"]
    else:
        folder, geo, log = data / "msas_kamakura_2025046", 137, "msas137_2025046.ems"
        files = (
            folder / "kamakura_synthetic_ranges.obs.gz",
            [folder / "gps_lnav_12-15h_rinex3.nav"],
        )
    messages = read_messages(folder / log, prn=geo)
    return protect(*files, messages, geo=geo, mode=mode)  # type: ignore[arg-type]


@cache
def compared(data: Path, case: str) -> LevelComparison:
    return raim_against_sbas(recorded(data, case))


@pytest.mark.parametrize("case", CASES)
def test_both_levels_are_of_the_same_fixes(case: str, reference_data: Path) -> None:
    levels = compared(reference_data / "data", case).levels
    rows = levels["available"].to_numpy()
    assert rows.sum() > 200
    # HPL = K_H d_major (Filip, Bazant, Mocek 2010, eq. 1): the receiver's HPL and RAIM's own
    # covariance come from the same satellites and sigmas by two different ways.
    expected = K_H[case.split(", ")[1]] * levels["sigma_major_m"][rows]
    assert levels["hpl_m"][rows].to_numpy() == pytest.approx(expected.to_numpy(), rel=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_herl_is_that_of_the_satellite_table_by_decomposition(
    case: str, reference_data: Path
) -> None:
    comparison = compared(reference_data / "data", case)
    side = recorded(reference_data / "data", case).side_tables[SIDE_TABLE]
    used = side[side["used"]]
    # alpha = beta = 1e-4: Baarda's delta0 from the normal distribution.
    shift = norm.isf(5e-5) + norm.isf(1e-4)
    levels = comparison.levels[comparison.levels["available"]]
    for time, level in levels.iloc[:: len(levels) // 20].iterrows():
        own = used[used["time"] == time]
        sigma = own["sigma_m"].to_numpy()
        rows = design_of(own["elevation_deg"], own["azimuth_deg"], np.zeros(len(own)))
        q, r = np.linalg.qr(rows / sigma[:, None])
        gain = np.linalg.solve(r, q.T)[:2] / sigma
        detectable = shift * sigma / np.sqrt(1 - (q**2).sum(axis=1))
        assert level["herl_m"] == pytest.approx((np.hypot(*gain) * detectable).max(), rel=1e-9)


@pytest.mark.parametrize(
    ("case", "larger", "epochs"),
    [
        ("vehicle, pa", 239, 239),
        ("vehicle, npa", 310, 310),
        ("kamakura, pa", 8870, 10599),
        ("kamakura, npa", 8699, 10636),
    ],
)
def test_the_papers_statement_holds_with_one_setting_and_fails_with_another(
    case: str, larger: int, epochs: int, reference_data: Path
) -> None:
    """Counts of this package: a change of them is a change of the documented statement."""
    comparison = compared(reference_data / "data", case)
    ratio = comparison.ratio("herl_m")
    assert ((ratio > 1).sum(), ratio.size) == (larger, epochs)
    assert comparison.herl_is_usually_larger is True
    assert (comparison.ratio("like_hpl_m") > 1).all()
    classical = raim_against_sbas(
        recorded(reference_data / "data", case), outlier_alarm=1e-3, missed_detection=0.2
    )
    assert classical.herl_is_usually_larger is False
