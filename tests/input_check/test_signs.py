"""What the single signs need, and what must not set them off."""

from __future__ import annotations

import inspect
from dataclasses import replace

import numpy as np
import pytest

from sbas.input_check import repair
from sbas.input_check.against_truth import KNOW_GEOID
from sbas.input_check.sampled_epochs import MOST_SAMPLES, SampledEpochs
from sbas.logs.registry import formats
from sbas.recording import MODES, mode_categories
from sbas.recording_survey import Rows
from tests.input_check.damages import changed, joined, rows, timed
from tests.input_check.journeys import (
    POINT,
    START,
    checked,
    journey,
    moved,
    receiver,
    said,
    standing,
)

N = 1200
SECONDS = np.arange(N) * 1.0


def test_a_level_in_whole_metres_may_stand_still() -> None:
    roof = standing(20_000)
    assert said(checked(changed(roof, hpl_m=np.rint(roof.table["hpl_m"])))) == []


def test_a_position_in_coarse_digits_may_stand_still() -> None:
    roof = standing()
    coarse = changed(roof, lat_deg=roof.table["lat_deg"].round(4),
                     lon_deg=roof.table["lon_deg"].round(4))  # fmt: skip
    assert said(checked(coarse)) == []


def test_a_level_of_no_use_may_stand_still() -> None:
    roof = standing()
    hpl = roof.table["hpl_m"].to_numpy().copy()
    hpl[600:] = 5000.0
    assert ("E13", "error") not in said(checked(changed(roof, hpl_m=hpl)))


def test_a_level_that_never_changes_is_frozen_only_when_the_geometry_does() -> None:
    n = 4000
    fixed = changed(standing(n), hpl_m=np.full(n, 11.37))
    assert said(checked(fixed)) == [("E13", "error")]
    still = changed(fixed, hdop=np.full(n, 1.1), n_sv=np.full(n, 9, np.int16))
    assert said(checked(still)) == []


def test_a_tunnel_is_a_warning_at_most() -> None:
    """Levels, satellites and place differ before and after, as they may for one receiver."""
    train, track = journey(2 * N)
    n_sv = train.table["n_sv"].to_numpy().copy()
    hpl = train.table["hpl_m"].to_numpy().copy()
    n_sv[:N], hpl[:N] = 5, 2 * hpl[:N]
    dark = rows(changed(train, n_sv=n_sv, hpl_m=hpl), np.r_[: N - 60, N + 60 : 2 * N])
    assert {c for c, s in said(checked(dark, track))} <= {"E04"}


def test_an_hour_without_power_is_only_a_gap() -> None:
    roof = joined(standing(), moved(standing(seed=5), N + 3600))
    assert said(checked(roof)) == [("E04", "warning")]


@pytest.mark.parametrize(
    "change",
    [{"lat_deg": lambda t: t["lat_deg"].round(6)}, {"hdop": lambda t: np.nan * t["hdop"]},
     {"n_sv": lambda t: np.full(len(t), -1, np.int16)}],
    ids=["digits", "no-hdop", "no-satellites"],
)  # fmt: skip
def test_one_thing_that_no_receiver_changes_and_another_level_make_two_receivers(
    change: dict[str, object],
) -> None:
    other = moved(standing(seed=5), N + 3600)
    other = changed(other, **{name: make(other.table) for name, make in change.items()},  # type: ignore[operator]
                    hpl_m=2 * other.table["hpl_m"])  # fmt: skip
    assert ("E06", "error") in said(checked(joined(standing(), other)))


def test_two_signs_that_may_change_by_themselves_make_an_error_with_another_level() -> None:
    other = receiver(np.full(N, 40.0), np.zeros(N), SECONDS, 5)
    modes = mode_categories(np.full(N, MODES.index("sbas_pa")))
    other = changed(other, hpl_m=2 * other.table["hpl_m"], mode=modes)
    assert ("E06", "error") in said(checked(joined(standing(), moved(other, N + 3600))))


def test_alternation_in_a_part_of_the_record_is_found_where_it_is() -> None:
    roof = standing()
    east = np.where((SECONDS > 400) & (SECONDS < 600) & (SECONDS % 2 == 0), 30.0, 0.0)
    result = checked(receiver(east, np.zeros(N), SECONDS, 1))
    assert said(result) == [("E06", "error")]
    assert "row 40" in result.findings[0].where
    assert said(checked(roof)) == []


@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_levels_far_from_the_usual_are_no_unit(factor: float) -> None:
    roof = standing()
    assert said(checked(changed(roof, hpl_m=roof.table["hpl_m"] * factor))) == []


def test_levels_of_other_modes_are_in_no_unit() -> None:
    roof = standing()
    fixed = changed(roof, hpl_m=roof.table["hpl_m"] / 1000,
                    mode=mode_categories(np.full(N, MODES.index("rtk"))))  # fmt: skip
    assert said(checked(fixed)) == [("E23", "warning")]


def test_a_point_in_the_gulf_of_guinea_is_no_radian_when_the_truth_is_there() -> None:
    roof = standing()
    gulf = changed(roof, lat_deg=roof.table["lat_deg"] - 49.5, lon_deg=roof.table["lon_deg"] - 15)
    assert ("E03", "error") in said(checked(gulf))
    point = replace(POINT, lat_deg=POINT.lat_deg - 49.5, lon_deg=POINT.lon_deg - 15)
    assert ("E03", "error") not in said(checked(gulf, point))


@pytest.mark.parametrize("size", [1, 100, 4096, 50_000])
def test_the_sample_is_bounded_and_hangs_on_no_cut(size: int) -> None:
    n = 50_000 if size > 1 else 3000
    values = {name: np.arange(n, dtype=float) for name in SampledEpochs.COLUMNS}
    values["lat_deg"][::7] = np.nan
    whole = Rows(0, np.arange(n), values)
    one, many = SampledEpochs(), SampledEpochs()
    one.update(whole)
    for begin in range(0, n, size):
        many.update(whole.part(begin, min(begin + size, n)))
    assert many.time_ns.tolist() == one.time_ns.tolist()
    assert min(n, MOST_SAMPLES) / 3 < many.time_ns.size <= MOST_SAMPLES
    assert not np.isnan(many.values()[0]).any()


def test_a_date_inside_the_day_after_tomorrow_is_no_future() -> None:
    roof = standing()
    today = np.datetime64("2026-03-01T00:00", "ns")
    assert said(checked(timed(roof, today + np.timedelta64(40, "h") + (roof.time - START)))) == []
    assert said(checked(timed(roof, today + np.timedelta64(48, "h") + (roof.time - START)))) == [
        ("E22", "error")
    ]


def test_the_geoid_cure_names_options_that_its_format_knows() -> None:
    roof = standing()
    low = changed(roof, height_m=roof.table["height_m"] - 44.5)
    known = {
        f.name for f in formats()
        if f.name in KNOW_GEOID and "geoid" in inspect.signature(f.read).parameters
    }  # fmt: skip
    assert known == KNOW_GEOID
    for name in ("csv", "ublox_ubx"):
        source = replace(low.meta.sources[0], format=name)
        of_format = low.replace(meta=replace(low.meta, sources=(source,)))
        (found,) = checked(of_format, POINT).findings
        assert "--height-offset UNDULATION" in found.cure
        assert ("--geoid UNDULATION" in found.cure.replace("--truth-geoid", "")) == (name == "csv")
        assert said(checked(repair(of_format, height_offset_m=44.5), POINT)) == [("E26", "info")]


def test_a_few_large_levels_are_no_stand_ins() -> None:
    roof = standing()
    hpl = roof.table["hpl_m"].to_numpy().copy()
    hpl[3] = 9999.0
    assert said(checked(changed(roof, hpl_m=hpl))) == []
    hpl[[30, 31]] = 9999.0, 3000.0
    assert said(checked(changed(roof, hpl_m=hpl))) == []


def test_one_far_position_is_no_other_receiver() -> None:
    roof = standing()
    lat = roof.table["lat_deg"].to_numpy().copy()
    lat[700] += 5.0
    assert "E06" not in [c for c, _ in said(checked(changed(roof, lat_deg=lat)))]
