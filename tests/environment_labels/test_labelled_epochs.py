"""Labels of epochs: by time, by place on the track, and where the place is not known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pymap3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.environment_labels import (
    EnvironmentSegments,
    TimeSegment,
    TrackSegment,
    label_epochs,
)
from sbas.environment_labels.labelled_epochs import MOST_BRIDGED_S
from sbas.exceptions import InputError
from sbas.integrity.evaluation import evaluate
from sbas.recording import EpochSource, Recording, RecordingMeta, with_columns
from sbas.track import Track, TrackLine
from sbas.truth import FixedPoint, Trajectory
from tests.examples import POINT, quiet, recording

SECOND = np.timedelta64(1, "s")


def line(length_m: float = 5000.0, north_m: float = 0.0, **options: object) -> Track:
    """A line to the east of POINT."""
    ends = [
        pymap3d.enu2geodetic(x, north_m, 0.0, POINT.lat_deg, POINT.lon_deg, POINT.height_m)
        for x in np.linspace(0, length_m, 51)
    ]
    return Track((np.array(ends),), frame="ITRF2014", **options)  # type: ignore[arg-type]


SEGMENTS = EnvironmentSegments(
    (
        TrackSegment(0, 1000, "open"),
        TrackSegment(1000, 2000, "tunnel"),
        TrackSegment(2000, 5000, "open"),
    )
)


def ride(east_m: Sequence[float], north_m: float = 0.0) -> Recording:
    """One epoch a second at the given places; NaN: no fix."""
    east = np.array(east_m, float)
    n = east.size
    r = recording(np.nan_to_num(east), np.full(n, north_m), np.full(n, 11.0))
    missing = np.isnan(east)
    return r.replace(
        table=r.table.assign(
            lat_deg=r.table["lat_deg"].mask(missing), lon_deg=r.table["lon_deg"].mask(missing)
        )
    )


def names(source: EpochSource) -> list[str | None]:
    found: list[str | None] = []
    for batch in source.batches(("environment",)):
        found += [None if pd.isna(x) else x for x in batch["environment"]]
    return found


@dataclass(frozen=True, eq=False)
class Pieces:
    """A source that streams a recording in pieces of given lengths."""

    whole: Recording
    lengths: tuple[int, ...]

    @property
    def meta(self) -> RecordingMeta:
        return self.whole.meta

    @property
    def columns(self) -> tuple[str, ...]:
        return self.whole.columns

    def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
        first = 0
        for length in (*self.lengths, len(self.whole)):
            yield with_columns(self.whole.table.iloc[first : first + length], columns)
            first += length


def test_by_time() -> None:
    r = quiet(10)
    t = r.time
    segments = EnvironmentSegments(
        (TimeSegment(t[2], t[5], "urban"), TimeSegment(t[5], t[6], "woody"))
    )
    labelled = label_epochs(r, segments)
    assert names(labelled) == [None, None, "urban", "urban", "urban", "woody", *[None] * 4]
    assert isinstance(labelled, Recording)
    assert labelled.meta.options["environment"] == "2 segments by time: urban, woody"
    assert list(labelled.table["environment"].cat.categories) == ["urban", "woody"]


def test_a_streaming_source_stays_one_and_gives_only_what_is_asked() -> None:
    r = quiet(10)
    segments = EnvironmentSegments((TimeSegment(r.time[3], r.time[8], "urban"),))
    view = label_epochs(Pieces(r, (2, 0, 4)), segments)
    assert not isinstance(view, Recording)
    assert "environment" in view.columns
    batches = list(view.batches(("hpl_m", "environment", "lat_deg")))
    assert [len(b) for b in batches] == [2, 0, 4, 4]
    assert all(list(b) == ["hpl_m", "environment", "lat_deg"] for b in batches)
    assert names(view) == [None] * 3 + ["urban"] * 5 + [None] * 2
    assert [list(b) for b in view.batches(("hpl_m",))] == [["hpl_m"]] * 4


def test_by_the_recorded_place_on_the_track() -> None:
    r = ride([-50, 0.5, 999, 1001, 1999, 2001, 4999, 5050])
    assert names(label_epochs(r, SEGMENTS, track=line())) == [
        None, "open", "open", "tunnel", "tunnel", "open", "open", None,
    ]  # fmt: skip
    assert names(label_epochs(r, SEGMENTS, truth=TrackLine(line(sigma_m=0.5)))) == names(
        label_epochs(r, SEGMENTS, track=line())
    )


def test_the_true_place_counts_where_it_is_known() -> None:
    r = ride([900, 1100, 1100, 1100])
    true = ride([1100, 900, 900, 900]).table
    truth = Trajectory(true.iloc[:2][["lat_deg", "lon_deg", "height_m"]], frame="ITRF2014")
    found = label_epochs(r, SEGMENTS, track=line(), truth=truth)
    # Where the trajectory has ended, the recorded place is all there is.
    assert names(found) == ["tunnel", "open", "tunnel", "tunnel"]
    lat, lon, height = pymap3d.enu2geodetic(1500, 0, 0, POINT.lat_deg, POINT.lon_deg, 289.4)
    point = FixedPoint(float(lat), float(lon), float(height), frame="ITRF2014")
    assert names(label_epochs(r, SEGMENTS, track=line(), truth=point)) == ["tunnel"] * 4


def test_without_a_fix_in_the_tunnel_an_epoch_is_in_the_tunnel() -> None:
    missing = [np.nan] * 9
    r = ride([np.nan, 900, *missing, 2100, np.nan])
    # 900 m to 2100 m in 10 steps of 120 m: 1020 m to 1980 m lie in the tunnel.
    expected = [None, "open", *["tunnel"] * 9, "open", None]
    assert names(label_epochs(r, SEGMENTS, track=line())) == expected


def test_off_the_track_the_place_is_that_between_the_neighbours() -> None:
    r = ride([900, 950, 1050, 1100])
    far = r.table["lat_deg"] + np.array([0, 0.01, 0.01, 0])  # 1.1 km to the north
    r = r.replace(table=r.table.assign(lat_deg=far))
    assert names(label_epochs(r, SEGMENTS, track=line())) == ["open", "open", "tunnel", "tunnel"]


def test_nothing_is_bridged_for_longer_than_a_train_can_be_trusted() -> None:
    for pause, label in ((MOST_BRIDGED_S, "tunnel"), (MOST_BRIDGED_S + 1, None)):
        r = ride([900, np.nan, 2100])
        time = r.time[0] + np.array([0, pause / 2, pause]) * SECOND
        r = r.replace(table=r.table.set_axis(pd.DatetimeIndex(time, name="time"), axis=0))
        assert names(label_epochs(r, SEGMENTS, track=line())) == ["open", label, "open"]


def test_nothing_is_bridged_from_one_part_of_a_track_to_another() -> None:
    first, second = line(900.0).parts[0], line(5000.0).parts[0]
    track = Track((first, second[30:]), kp_start_m=(0.0, 3000.0), frame="ITRF2014")
    r = ride([500, np.nan, np.nan, 3500])
    assert names(label_epochs(r, SEGMENTS, track=track)) == ["open", None, None, "open"]


@settings(max_examples=40)
@given(
    st.lists(st.one_of(st.floats(0, 5000), st.just(np.nan)), min_size=1, max_size=25),
    st.lists(st.integers(0, 6), max_size=8),
    st.integers(1, 900),
)
def test_batches_change_no_label(places: list[float], lengths: list[int], step_s: int) -> None:
    r = ride(places)
    time = r.time[0] + np.arange(len(r)) * step_s * SECOND
    r = r.replace(table=r.table.set_axis(pd.DatetimeIndex(time, name="time"), axis=0))
    whole = label_epochs(r, SEGMENTS, track=line())
    assert names(label_epochs(Pieces(r, tuple(lengths)), SEGMENTS, track=line())) == names(whole)


def test_a_batch_waits_only_while_its_end_may_be_bridged() -> None:
    n = 4000
    r = ride([100.0, *[np.nan] * (n - 1)])
    taken: list[int] = []

    @dataclass(frozen=True, eq=False)
    class Counted(Pieces):
        def batches(self, columns: Sequence[str]) -> Iterator[pd.DataFrame]:
            for i, batch in enumerate(super().batches(columns)):
                taken.append(i)
                yield batch

    view = label_epochs(Counted(r, (100,) * 40), SEGMENTS, track=line())
    next(iter(view.batches(("environment",))))
    # 1800 s without a place are 18 batches of 100 s.
    assert len(taken) == 19


def test_own_labels_are_replaced_and_a_finding_says_so() -> None:
    r = quiet(10)
    own = r.replace(table=r.table.assign(environment=pd.Categorical(["open"] * 10)))
    segments = EnvironmentSegments((TimeSegment(r.time[0], r.time[5], "urban"),))
    found = label_epochs(own, segments)
    assert names(found) == ["urban"] * 5 + [None] * 5
    assert [f.code for f in found.meta.findings] == ["E26"]
    assert list(label_epochs(Pieces(own, (4,)), segments).columns).count("environment") == 1
    assert label_epochs(r, segments).meta.findings == ()


def test_by_distance_a_track_is_needed() -> None:
    with pytest.raises(InputError, match="need the track"):
        label_epochs(quiet(3), SEGMENTS)


def test_the_view_can_be_evaluated() -> None:
    n = 1000
    r = recording(np.linspace(0, 4000, n), np.zeros(n), np.full(n, 11.0))
    truth = Trajectory(r.table[["lat_deg", "lon_deg", "height_m"]], frame="ITRF2014")
    view = label_epochs(Pieces(r, (300, 300)), SEGMENTS, track=line(), truth=truth)
    found = evaluate(view, truth=truth)
    epochs = {label: e.epochs for label, e in found.environments.items()}
    # Places are 4000/999 m apart: rows 250 to 499 lie in [1000, 2000).
    assert epochs == {"open": 750, "tunnel": 250}
    assert found.environments["tunnel"].at(50.0).availability.availability.value == 1.0
