from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sbas.exceptions import InputError
from sbas.monitoring.receiver_flags import with_raim_flags
from sbas.monitoring.recording_monitor import raim
from sbas.monitoring.verdicts import Verdict
from sbas.recording import Flag, Recording
from sbas.satellite_table import SIDE_TABLE
from tests.monitoring.recordings import START, noisy


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
