from __future__ import annotations

import json

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_protection import araim_levels
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.recorded_araim import araim_of_recording
from sbas.monitoring.verdicts import MonitorReason
from sbas.satellite_table import SIDE_TABLE
from tests.monitoring.recordings import noisy

TWO = [f"G{i:02d}" for i in range(1, 8)] + [f"E{i:02d}" for i in range(1, 8)]
RARE = AraimSettings(p_constellation=1e-12)


def test_levels_are_those_of_the_arrays_behind_the_table() -> None:
    recording = noisy(5, 14, 8, names=TWO)
    side = recording.side_tables[SIDE_TABLE]
    sky = side.pivot(index="time", columns="satellite", values="elevation_deg")[TWO].to_numpy()
    turn = side.pivot(index="time", columns="satellite", values="azimuth_deg")[TWO].to_numpy()
    spread = side.pivot(index="time", columns="satellite", values="sigma_m")[TWO].to_numpy()
    plain = araim_levels(
        AraimGeometry(sky, turn, np.array([n[:1] for n in TWO]), spread, 0.8 * spread, 0.3)
    )
    ours = araim_of_recording(recording, b_nom_m=0.3, accuracy_share=0.8)
    assert np.isfinite(plain.hpl_m).all()
    assert ours.hpl_m == pytest.approx(plain.hpl_m, rel=1e-12)
    assert ours.vpl_m == pytest.approx(plain.vpl_m, rel=1e-12)
    assert np.isnan(plain.alarm_ratio).all()
    assert (ours.alarm_ratio < 1).all()


def test_a_single_constellation_has_a_level_only_with_a_rare_constellation_fault() -> None:
    recording = noisy(5, 9, 4)
    shut = araim_of_recording(recording)
    assert not shut.available.any()
    assert shut.to_dict()["reasons"] == {
        "faults that cannot be monitored exhaust the integrity budget": 4
    }
    assert shut.to_dict()["hpl_m"]["median"] is None
    open_ = araim_of_recording(recording, settings=RARE)
    assert open_.available.all()
    assert "4 available" in str(open_)
    json.dumps(shut.to_dict(), allow_nan=False)
    json.dumps(open_.to_dict(), allow_nan=False)


def test_a_detected_fault_is_not_available() -> None:
    recording = noisy(5, 14, 6, names=TWO)
    side = recording.side_tables[SIDE_TABLE].copy()
    wrong = (side["satellite"] == "G03") & (side["time"] >= recording.time[3])
    side.loc[wrong, "residual_m"] += 300.0
    found = araim_of_recording(recording.replace(side_tables={SIDE_TABLE: side}))
    assert found.detected.tolist() == [False] * 3 + [True] * 3
    assert found.available.tolist() == [True] * 3 + [False] * 3
    assert found.to_dict()["available"] == 3


def test_a_fix_with_an_unknown_range_has_no_level() -> None:
    recording = noisy(5, 14, 3, names=TWO)
    side = recording.side_tables[SIDE_TABLE].copy()
    side.loc[(side["satellite"] == "E02") & (side["time"] == recording.time[1]), "sigma_m"] = np.nan
    found = araim_of_recording(recording.replace(side_tables={SIDE_TABLE: side}))
    assert found.available.tolist() == [True, False, True]
    assert found.reason.tolist() == [0, MonitorReason.INCOMPLETE, 0]
    assert found.to_dict()["reasons"] == {MonitorReason.INCOMPLETE.words: 1}
    assert MonitorReason.INCOMPLETE.words in str(found)


def test_without_residuals_there_are_levels_and_no_available_epoch() -> None:
    recording = noisy(5, 14, 3, names=TWO)
    side = recording.side_tables[SIDE_TABLE].drop(columns="residual_m")
    found = araim_of_recording(recording.replace(side_tables={SIDE_TABLE: side}))
    assert found.has_level.all()
    assert not found.available.any()
    assert found.to_dict()["available"] == 0
    assert "0 available" in str(found)


def test_findings_and_masked_ranges_are_kept() -> None:
    recording = noisy(5, 14, 3, names=TWO)
    side = recording.side_tables[SIDE_TABLE].copy()
    side["sigma_m"] *= 100.0
    found = araim_of_recording(
        recording.replace(side_tables={SIDE_TABLE: side}), elevation_mask_deg=20.0
    )
    assert found.masked == int((side["elevation_deg"] < 20).sum()) > 0
    assert [f.code for f in found.findings] == ["E08"]
    plain = found.to_dict()
    assert plain["masked_ranges"] == found.masked
    assert plain["findings"][0]["code"] == "E08"
    assert "unusual" in str(found)
    assert "below the elevation mask" in str(found)


def test_the_track_of_a_recording_is_tested() -> None:
    recording = noisy(5, 14, 200, names=TWO)
    heading = np.where(np.arange(200) % 2, 30.0, np.nan)
    # Hardly any alarm up, which would otherwise be the largest of all.
    horizontal = AraimSettings(pfa_v=1e-60)
    more = araim_of_recording(recording, heading_deg=heading, settings=horizontal).alarm_ratio
    plain = araim_of_recording(recording, settings=horizontal).alarm_ratio
    assert more[::2] == pytest.approx(plain[::2], rel=1e-12)
    assert (more >= plain * (1 - 1e-12)).all()
    assert (more > 1.01 * plain).any()


def test_an_sbas_satellite_of_a_recording_has_the_clock_of_gps() -> None:
    names = ["G01", "G02", "G03", "G04", "G05", "S36", "E01", "E02", "E03", "E04", "E05"]
    found = araim_of_recording(noisy(5, 11, 2, names=names))
    assert found.satellites.tolist() == [11, 11]


@pytest.mark.parametrize("epochs", [0, 4])
def test_no_epochs_with_satellites_or_without_give_an_empty_result(epochs: int) -> None:
    recording = noisy(5, 8, 4)
    side = recording.side_tables[SIDE_TABLE]
    none = recording.replace(
        table=recording.table[:0], side_tables={SIDE_TABLE: side[: 8 * epochs]}
    )
    assert araim_of_recording(none).to_dict()["epochs"] == 0


@pytest.mark.parametrize("bound", [np.nan, np.inf, -0.1, "a"])
def test_a_bound_of_the_nominal_bias_is_a_length(bound: float) -> None:
    with pytest.raises(InputError, match="nominal bias"):
        araim_of_recording(noisy(5, 6, 1), b_nom_m=bound)


def test_a_recording_without_satellites_used_has_no_level() -> None:
    recording = noisy(5, 6, 3)
    side = recording.side_tables[SIDE_TABLE].copy()
    side["used"] = False
    found = araim_of_recording(recording.replace(side_tables={SIDE_TABLE: side}))
    assert not found.available.any()
    assert found.to_dict()["epochs"] == 3


@pytest.mark.parametrize("share", [0.0, 1.5, np.nan])
def test_a_share_of_accuracy_is_one(share: float) -> None:
    with pytest.raises(InputError, match="share"):
        araim_of_recording(noisy(5, 6, 1), accuracy_share=share)
