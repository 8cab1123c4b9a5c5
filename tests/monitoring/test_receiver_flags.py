from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sbas
from sbas.cli.writing import write_recording
from sbas.exceptions import InputError
from sbas.monitoring.receiver_flags import with_raim_flags
from sbas.monitoring.recording_monitor import raim
from sbas.monitoring.verdicts import Verdict
from sbas.recording import Flag, Recording
from sbas.satellite_table import SIDE_TABLE
from tests.monitoring.recordings import START, noisy, recording_of
from tests.monitoring.skies import CASES


def logged(flags: list[int], herl: list[float]) -> Recording:
    time = START + np.arange(len(flags)) * np.timedelta64(1, "s")
    table = pd.DataFrame(
        {"flags": np.array(flags, "u4"), "herl_m": herl, "verl_m": herl},
        index=pd.DatetimeIndex(time, name="time"),
    )
    return Recording(table)


def test_the_receivers_own_levels_are_summarised_as_its_own() -> None:
    result = raim(
        logged(
            [Flag.RAIM_PASSED, Flag.RAIM_FAILED, Flag.RAIM_NOT_AVAILABLE, 0,
             Flag.RAIM_PASSED | Flag.RAIM_NOT_AVAILABLE, Flag.RAIM_PASSED | Flag.RAIM_FAILED],
            [5.0, 6.0, 7.0, 8.0, 9.0, 4.0],
        )
    )  # fmt: skip
    assert result.source == "receiver"
    assert result.epochs["verdict"].tolist() == [
        Verdict.PASSED.words, Verdict.FAILED.words, *3 * [Verdict.NOT_AVAILABLE.words],
        Verdict.FAILED.words,
    ]  # fmt: skip
    assert result.epochs["herl_m"].tolist()[:2] == [5.0, 6.0]
    assert np.isnan(result.epochs["herl_m"].iloc[2:5]).all()
    assert result.available == 1
    assert result.detected == 2


def test_a_mark_for_no_level_is_none() -> None:
    result = raim(logged([Flag.RAIM_PASSED], [-2e10]))
    assert np.isnan(result.epochs["herl_m"]).all()


def test_without_ranges_and_receiver_levels_there_is_nothing_to_say() -> None:
    recording = logged([0], [1.0])
    bare = recording.replace(table=pd.DataFrame(index=recording.table.index))
    with pytest.raises(InputError, match="which satellites"):
        raim(bare)
    with pytest.raises(InputError, match="neither"):
        raim(bare, source="receiver")


def test_flags_mark_the_recorded_position_also_after_an_exclusion() -> None:
    recording = noisy(3, 9, 6)
    side = recording.side_tables[SIDE_TABLE].copy()
    first, none = recording.time[[1, 2]]
    side.loc[(side["satellite"] == "G04") & (side["time"] == first), "residual_m"] += 200.0
    side = side[side["time"] != none]
    recording = recording.replace(
        table=recording.table.assign(
            flags=np.full(6, Flag.AFTER_GAP | Flag.RAIM_PASSED, np.uint32)
        ),
        side_tables={SIDE_TABLE: side},
    )
    result = raim(recording)
    assert result.epochs["verdict"].iloc[1] == Verdict.PASSED_AFTER_EXCLUSION.words
    flagged = with_raim_flags(recording, result)
    own = Flag.RAIM_PASSED | Flag.RAIM_FAILED | Flag.RAIM_NOT_AVAILABLE
    assert (flagged.table["flags"].to_numpy() & np.uint32(own)).tolist() == [
        Flag.RAIM_PASSED, Flag.RAIM_FAILED, Flag.RAIM_NOT_AVAILABLE, *3 * [Flag.RAIM_PASSED],
    ]  # fmt: skip
    assert ((flagged.table["flags"].to_numpy() & np.uint32(Flag.AFTER_GAP)) != 0).all()
    assert np.isnan(flagged.table["herl_m"].iloc[2])
    assert flagged.table["herl_m"].iloc[0] == result.epochs["herl_m"].iloc[0]
    # Read back as a receiver's own, the flags say the same.
    again = raim(flagged, source="receiver")
    assert again.count(Verdict.FAILED) == 1
    assert again.available == 4


def test_a_result_of_another_recording_is_refused() -> None:
    with pytest.raises(InputError, match="another recording"):
        with_raim_flags(noisy(1, 6, 3), raim(noisy(1, 6, 4)))


def test_levels_without_a_vertical_one_are_not_available_vertically() -> None:
    recording = logged([Flag.RAIM_PASSED] * 3, [5.0, 6.0, 7.0])
    table = recording.table.assign(verl_m=[8.0, np.nan, -2e10])
    result = raim(recording.replace(table=table))
    assert result.epochs["available"].all()
    assert result.epochs["available_vertical"].tolist() == [True, False, False]


def test_a_critical_satellite_stays_critical_when_written() -> None:
    azimuth, elevation = (np.array(v, float)[:, None] for v in CASES["A"])
    recording = recording_of(elevation, azimuth, 1.0, np.zeros((5, 1)))
    first = raim(recording)
    again = raim(with_raim_flags(recording, first), source="receiver")
    assert (first.available, first.available_vertical) == (1, 0)
    assert (again.available, again.available_vertical) == (1, 0)


def test_who_computed_the_flags_is_kept_in_the_file(tmp_path: Path) -> None:
    recording = noisy(3, 9, 20)
    made = raim(recording, false_alarm=1e-2, track_azimuth_deg=30.0, sigma=(1.0, 2.0),
                elevation_mask_deg=1.0)  # fmt: skip
    write_recording(tmp_path / "raim.parquet", [with_raim_flags(recording, made)])
    read = sbas.read(tmp_path / "raim.parquet")
    again = raim(read.replace(side_tables={}))
    assert again.source == "written"
    assert again.design == made.design
    assert again.budget == made.budget
    assert (again.track_azimuth_deg, again.sigma, again.elevation_mask_deg) == (
        30.0, (1.0, 2.0), 1.0,
    )  # fmt: skip
    assert "no receiver reported it" in repr(again)
    assert again.to_dict()["source"] == "written"


def test_a_mark_that_cannot_be_read_is_still_a_mark() -> None:
    recording = noisy(3, 9, 2)
    marked = with_raim_flags(recording, raim(recording)).replace(side_tables={})
    for text in ("", "[]", "{}", '{"design": {"false_alarm": 2}}', '{"design": 1}'):
        spoilt = marked.replace(meta=replace(marked.meta, options={"raim": text}))
        again = raim(spoilt)
        assert again.source == "written"
        assert again.design is None


def test_replacing_a_receivers_own_raim_is_counted() -> None:
    recording = noisy(3, 9, 6)
    own = recording.replace(
        table=recording.table.assign(flags=np.full(6, Flag.RAIM_PASSED, np.uint32), herl_m=5.0)
    )
    result = raim(own)
    flagged = with_raim_flags(own, result)
    finding = flagged.meta.findings[-1]
    assert finding.code == "E26"
    assert "6 epochs of 6" in finding.evidence
    # Nothing of a receiver is lost the second time, or where there was none.
    assert with_raim_flags(flagged, result).meta.findings == flagged.meta.findings
    assert not with_raim_flags(recording, raim(recording)).meta.findings
    # A receiver's own stays its own.
    bare = own.replace(side_tables={})
    assert raim(with_raim_flags(bare, raim(bare))).source == "receiver"


def test_settings_of_ranges_are_refused_for_levels_that_were_recorded() -> None:
    recording = logged([Flag.RAIM_PASSED], [5.0])
    for settings in ({"false_alarm": 1e-2}, {"sigma": 2.0}, {"elevation_mask_deg": 5.0},
                     {"track_azimuth_deg": 0.0}, {"risk": 1e-9}):  # fmt: skip
        with pytest.raises(InputError, match="change nothing"):
            raim(recording, **settings)  # type: ignore[arg-type]


def test_levels_of_untested_epochs_are_not_written() -> None:
    recording = noisy(3, 8, 10)
    side = recording.side_tables[SIDE_TABLE].drop(columns="residual_m")
    untested = raim(recording.replace(side_tables={SIDE_TABLE: side}))
    assert np.isfinite(untested.epochs["herl_m"]).all()
    written = with_raim_flags(recording, untested).table
    assert written[["herl_m", "verl_m"]].isna().all(axis=None)
