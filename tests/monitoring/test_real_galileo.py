"""RAIM of Galileo, and of GPS with Galileo.

Of real receivers the reference data have Galileo ranges with the orbits of their day for one
station only (CEDA, 2018-07-29, orbits of ELKO), without GPS. CEBR (2018-07-19) has both, but no
navigation of that day is there: GPS and Galileo together run on made ranges.
"""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pandas as pd
import pymap3d
import pytest

from sbas.monitoring.recording_monitor import raim
from sbas.monitoring.verdicts import Verdict
from sbas.positioning.unaugmented_recording import unaugmented
from sbas.recording import Recording
from sbas.rinex.navigation_file import read_navigation
from tests.positioning.test_unaugmented_recording import MIXED, written

RANGES = "data/rinex/CEDA00USA_R_20182100000_23H_15S_MO.rnx.gz"
STATION_M = (-1882182.8402, -4464343.6597, 4136557.1040)
"""Approximate position in the header of the observations."""
LATE_S = 2.983
"""By which the time tags of the station are early: found as the common offset in time that makes
the ranges of four satellites agree with one place. This receiver logs no GPS."""


def retagged(source: Path, target: Path, later_s: float) -> Path:
    """The observations with later time tags; ranges are as they were."""
    lines = gzip.decompress(source.read_bytes()).decode("ascii").splitlines()
    for row, line in enumerate(lines):
        if line.startswith(">"):
            year, month, day, hour, minute, second = line[1:29].split()
            time = pd.Timestamp(int(year), int(month), int(day), int(hour), int(minute))
            time += pd.Timedelta(seconds=float(second) + later_s)
            fraction = time.second + time.microsecond / 1e6
            lines[row] = f"> {time:%Y %m %d %H %M}{fraction:11.7f}{line[29:]}"
    target.write_text("\n".join(lines) + "\n", encoding="ascii")
    return target


def from_station_m(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Horizontal and vertical distance from the header's position [m]."""
    at = pymap3d.ecef2geodetic(*STATION_M)
    place = (recording.table[name].to_numpy() for name in ("lat_deg", "lon_deg", "height_m"))
    east, north, up = pymap3d.geodetic2enu(*place, *at)
    return np.hypot(east, north), np.abs(up)


def test_real_galileo_ranges_with_wrong_time_tags_never_pass(reference_data: Path) -> None:
    recording = unaugmented(reference_data / RANGES, reference_data / MIXED, systems="E")
    result = raim(recording)
    distance, _ = from_station_m(recording)
    assert np.nanmedian(distance) > 2000
    fixes = np.isfinite(distance)
    tested = result.epochs["dof"].to_numpy() == 1
    # Five satellites detect; with four nothing is said, and nothing has passed.
    assert tested.sum() == result.count(Verdict.DETECTED) == 155
    assert result.count(Verdict.NOT_AVAILABLE) == len(recording) - 155
    assert (fixes & ~tested).sum() > 290
    assert result.available == 0


def test_the_same_ranges_pass_with_the_time_set_right(reference_data: Path, tmp_path: Path) -> None:
    observations = retagged(reference_data / RANGES, tmp_path / "ceda.obs", LATE_S)
    recording = unaugmented(observations, reference_data / MIXED, systems="E")
    result = raim(recording)
    passed = result.epochs["available"].to_numpy()
    assert passed.sum() == result.count(Verdict.PASSED) == 155
    across, up = from_station_m(recording)
    # The orbits and clocks are right to metres on real ranges; the header is an approximation.
    assert across[passed].max() < 6
    assert up[passed].max() < 6
    assert np.isnan(result.epochs["herl_m"].to_numpy()[~passed]).all()


@pytest.mark.parametrize("systems", ["G", "GE"])
def test_two_constellations_cost_a_clock(
    systems: str, reference_data: Path, tmp_path: Path
) -> None:
    observations = written(tmp_path / "mixed.obs", read_navigation(reference_data / MIXED))
    recording = unaugmented(observations, reference_data / MIXED, systems=systems)  # type: ignore[arg-type]
    result = raim(recording).epochs.dropna(subset=["statistic"])
    assert len(result) >= 3
    assert (result["dof"] == result["n_sv"] - 3 - len(systems)).all()
    alone = raim(unaugmented(observations, reference_data / MIXED, systems="G")).epochs
    shared = result.index.intersection(alone.index[alone["available"]])
    assert len(shared) >= 3
    more = result.loc[shared, "herl_m"] < alone.loc[shared, "herl_m"]
    assert more.all() if systems == "GE" else not more.any()
