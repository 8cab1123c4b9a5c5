"""Fixes against gLAB 6.0.0 on real messages, and what becomes of bad ranges (page sections 9, 14
and 15)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sbas.augmentation.reasons import Reason
from sbas.augmentation.tables import Mode
from sbas.positioning.lines_of_sight import horizons
from sbas.positioning.measurements import measurements
from sbas.positioning.protection_levels import K_V, horizontal_level_m, vertical_level_m
from sbas.positioning.software_receiver import Fixes
from tests.positioning.reference_cases import (
    KAMAKURA_M,
    SOLUTIONS,
    between,
    case_fixes,
    glab_solutions,
    gps_second,
    inputs,
    rules,
    solved,
    used_sets,
)

K_H = {"pa": 6.0, "npa": 6.18}


@pytest.mark.parametrize(("name", "mode", "output"), SOLUTIONS)
def test_levels_satellites_and_places_are_those_of_glab(
    reference_data: Path, name: str, mode: Mode, output: str
) -> None:
    fixes = case_fixes(reference_data, name, mode)
    reference = glab_solutions(reference_data, output)
    second = fixes.measured.time_ns / 1e9
    mine = np.flatnonzero(fixes.solved)
    common = np.isin(second[mine], reference.index)
    # Its first fix of the vehicle in precision approach rests on the broadcast ionosphere.
    assert common.all()
    assert len(reference) - len(mine) == (1 if (name, mode) == ("vehicle", "pa") else 0)
    theirs = reference.loc[second[mine]]
    hpl = horizontal_level_m(fixes.covariance_m2[mine], K_H[mode])
    vpl = vertical_level_m(fixes.covariance_m2[mine], K_V)
    assert np.abs(hpl - theirs["hpl_m"]).max() < 0.001
    assert np.abs(vpl - theirs["vpl_m"]).max() < 0.001
    sets = used_sets(fixes)
    assert [sets[row] for row in mine] == theirs["used"].tolist()
    offset = fixes.receiver_m[mine] - theirs[["x_m", "y_m", "z_m"]].to_numpy()
    enu = np.einsum("nij,nj->ni", horizons(fixes.receiver_m[mine]).axes, offset)
    assert np.hypot(enu[:, 0], enu[:, 1]).max() < 0.002
    assert np.abs(enu[:, 2]).max() < 0.01


@pytest.mark.parametrize(
    ("name", "mode", "time", "hpl_m", "vpl_m", "used"),
    [
        ("stanford", "pa", "2019-12-31T23:56:47", 9.9062, 19.7422, 8),
        ("stanford", "pa", "2020-01-01T00:05:00", 9.1591, 17.7154, 9),
        ("stanford", "pa", "2020-01-01T00:30:00", 8.8705, 15.9077, 10),
        ("stanford", "pa", "2020-01-01T01:00:00", 10.7187, 17.3352, 9),
        ("kamakura", "pa", "2025-02-15T12:02:04", 36.0236, 50.7735, 6),
        ("kamakura", "pa", "2025-02-15T12:30:00", 34.8906, 26.0557, 9),
        ("kamakura", "pa", "2025-02-15T13:30:00", 13.9342, 22.4487, 9),
        ("kamakura", "npa", "2025-02-15T12:01:02", 303.3721, 610.1057, 8),
        ("kamakura", "npa", "2025-02-15T12:30:00", 35.7122, 25.9849, 10),
        ("kamakura", "npa", "2025-02-15T14:30:00", 13.4349, 24.0586, 9),
        ("vehicle", "pa", "2008-05-26T06:03:20", 19.6583, 68.6417, 7),
        ("vehicle", "pa", "2008-05-26T06:06:40", 16.7381, 51.2502, 8),
        ("vehicle", "npa", "2008-05-26T06:03:20", 18.1790, 55.8755, 8),
        ("vehicle", "npa", "2008-05-26T06:06:40", 17.2402, 51.2502, 8),
    ],
)
def test_published_epochs(
    reference_data: Path,
    name: str,
    mode: Mode,
    time: str,
    hpl_m: float,
    vpl_m: float,
    used: int,
) -> None:
    fixes = case_fixes(reference_data, name, mode)
    row = int(np.flatnonzero(fixes.measured.time_ns // 10**9 == gps_second(time))[0])
    covariance = fixes.covariance_m2[[row]]
    assert horizontal_level_m(covariance, K_H[mode])[0] == pytest.approx(hpl_m, abs=6e-4)
    assert vertical_level_m(covariance, K_V)[0] == pytest.approx(vpl_m, abs=6e-4)
    assert np.count_nonzero(fixes.used & (fixes.measured.epoch == row)) == used


def test_first_epochs_with_a_fix(reference_data: Path) -> None:
    for name, mode, first, count in (
        ("stanford", "pa", "2019-12-31T23:56:47", 4034),
        ("kamakura", "pa", "2025-02-15T12:02:04", 10617),
        ("kamakura", "npa", "2025-02-15T12:01:02", 10679),
    ):
        fixes = case_fixes(reference_data, name, mode)  # type: ignore[arg-type]
        assert fixes.measured.time_ns[fixes.solved][0] // 10**9 == gps_second(first)
        assert fixes.solved.sum() == count


def test_precision_satellites_are_among_those_of_the_other_mode(reference_data: Path) -> None:
    for name in ("kamakura", "vehicle"):
        pa, npa = (case_fixes(reference_data, name, mode) for mode in ("pa", "npa"))
        assert not (pa.used & ~npa.used).any()
        assert not (pa.solved & ~npa.solved).any()


def short_case(folder: Path, **changes: object) -> Fixes:
    """Twenty epochs of Kamakura, ranges changed by name and epoch."""
    observed, navigation, messages = inputs(folder, "kamakura")
    ranges = measurements(between(observed, 4000, 4020), smoothing=False)
    added = np.zeros(len(ranges))
    for satellite, metres in changes.items():
        added[ranges.satellite == ranges.names.index(satellite)] = metres  # type: ignore[assignment]
    ranges = replace(ranges, code_m=ranges.code_m + added)
    return solved(ranges, messages, navigation, rules("pa", navigation), KAMAKURA_M)


def names_used(fixes: Fixes, epoch: int = 10) -> set[str]:
    return set(used_sets(fixes)[epoch].split())


def test_one_range_far_off_is_left_out_with_its_reason(reference_data: Path) -> None:
    sound = short_case(reference_data)
    name = sorted(names_used(sound))[0]
    bad = short_case(reference_data, **{name: 60.0})
    assert names_used(bad) == names_used(sound) - {name}
    rows = (bad.measured.satellite == bad.measured.names.index(name)) & (bad.measured.epoch >= 2)
    assert set(bad.reason[rows]) == {Reason.OUTLIER}
    level = [horizontal_level_m(f.covariance_m2[10:], 6.0) for f in (sound, bad)]
    assert (level[1] > level[0]).all()
    kept = short_case(reference_data, **{name: 39.0})
    assert names_used(kept) == names_used(sound)


def test_ranges_that_contradict_each_other_give_no_fix(reference_data: Path) -> None:
    sound = short_case(reference_data)
    names = sorted(names_used(sound))
    half = {name: 100.0 * (i + 1) for i, name in enumerate(names[: (len(names) + 1) // 2])}
    bad = short_case(reference_data, **half)
    assert bad.contradicting[2:].all()
    assert not bad.solved.any()
    assert not bad.used.any()
    assert (bad.reason > 0).all()


def test_an_offset_common_to_all_ranges_is_the_clock(reference_data: Path) -> None:
    sound = short_case(reference_data)
    shifted = short_case(reference_data, **dict.fromkeys(sound.measured.names, 250.0))
    assert shifted.clock_m[10] - sound.clock_m[10] == pytest.approx(250.0, abs=1e-5)
    assert np.abs(shifted.receiver_m - sound.receiver_m)[2:].max() < 1e-5


def test_place_unknown_gives_the_levels_of_the_place_known(reference_data: Path) -> None:
    observed, navigation, messages = inputs(reference_data, "kamakura")
    ranges = measurements(between(observed, 4000, 4030), smoothing=False)
    known, found = (
        solved(ranges, messages, navigation, rules("pa", navigation), place)
        for place in (KAMAKURA_M, None)
    )
    assert (found.solved == known.solved).all()
    difference = [
        horizontal_level_m(fixes.covariance_m2, 6.0)[known.solved] for fixes in (known, found)
    ]
    assert np.abs(difference[0] - difference[1]).max() < 1e-3
    # The model is that of another place, some metres away.
    assert np.abs(found.receiver_m - known.receiver_m)[known.solved].max() < 0.01


def test_without_ephemerides_every_range_says_so(reference_data: Path) -> None:
    observed, navigation, messages = inputs(reference_data, "kamakura")
    ranges = measurements(between(observed, 4000, 4010), smoothing=False)
    empty = replace(
        navigation,
        gps=type(navigation.gps)(*(values[:0] for values in vars(navigation.gps).values())),
    )
    for place in (KAMAKURA_M, None):
        for mode in ("pa", "npa"):
            fixes = solved(ranges, messages, empty, rules(mode, navigation), place)  # type: ignore[arg-type]
            assert not fixes.solved.any()
            assert np.isnan(fixes.receiver_m).all()
            late = ranges.epoch >= 2
            assert set(fixes.reason[late]) == {Reason.NO_EPHEMERIS}


def test_fewer_than_four_satellites_give_no_fix(reference_data: Path) -> None:
    observed, navigation, messages = inputs(reference_data, "kamakura")
    ranges = measurements(between(observed, 4000, 4010), smoothing=False)
    sound = solved(ranges, messages, navigation, rules("pa", navigation), KAMAKURA_M)
    three = [ranges.names.index(name) for name in sorted(names_used(sound, 5))[:3]]
    few = ranges.some(np.isin(ranges.satellite, three))
    for place in (KAMAKURA_M, None):
        fixes = solved(few, messages, navigation, rules("pa", navigation), place)
        assert not fixes.solved.any()
        assert np.isnan(fixes.covariance_m2).all()
        assert set(fixes.reason[few.epoch >= 2]) == {Reason.NO_SOLUTION}


def test_a_range_that_is_no_distance_does_not_move_the_others(reference_data: Path) -> None:
    observed, navigation, messages = inputs(reference_data, "kamakura")
    ranges = measurements(between(observed, 4000, 4010), smoothing=False)
    sound = solved(ranges, messages, navigation, rules("pa", navigation), None)
    name = sorted(names_used(sound, 5))[0]
    rows = ranges.satellite == ranges.names.index(name)
    code = np.where(rows, 7.0, ranges.code_m)
    bad = solved(
        replace(ranges, code_m=code, raw_code_m=code), messages, navigation,
        rules("pa", navigation), None,
    )  # fmt: skip
    assert names_used(bad, 5) == names_used(sound, 5) - {name}
    assert (bad.solved == sound.solved).all()
