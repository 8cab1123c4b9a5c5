from __future__ import annotations

import json

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_protection import araim_levels
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.recorded_araim import araim_of_recording
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
