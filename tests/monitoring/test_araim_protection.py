"""ARAIM: Appendix D of its description, a slow reference, and what must hold whatever is given."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbas.exceptions import InputError
from sbas.monitoring.araim_dual_frequency import dual_frequency_ranges
from sbas.monitoring.araim_geometry import AraimGeometry
from sbas.monitoring.araim_protection import araim_levels, araim_modes
from sbas.monitoring.araim_result import UNMONITORED, AraimResult
from sbas.monitoring.araim_roots import TOLERANCE_M
from sbas.monitoring.araim_settings import AraimSettings
from sbas.monitoring.normal_equations import GeometryReason
from tests.monitoring.araim_reference import Answer, appendix_d, quantile, solve


def sky(seed: int, letters: str, epochs: int = 1) -> dict[str, Any]:
    """Directions and errors drawn at random, epochs x satellites."""
    rng = np.random.default_rng(seed)
    shape = epochs, len(letters)
    sigma = rng.uniform(0.7, 2.5, shape)
    return {
        "elevation_deg": np.rad2deg(np.arcsin(rng.uniform(0.09, 1.0, shape))),
        "azimuth_deg": rng.uniform(0, 360, shape),
        "constellation": np.array(list(letters)),
        "sigma_int_m": sigma,
        "sigma_acc_m": sigma * rng.uniform(0.6, 1.0, shape),
        "b_nom_m": rng.uniform(0, 1, shape),
    }


def reference(given: dict[str, Any], epoch: int = 0, **options: Any) -> Answer:
    def row(name: str) -> np.ndarray:
        return np.atleast_2d(given[name])[epoch]

    return solve(
        row("elevation_deg"), row("azimuth_deg"), list(given["constellation"]),
        row("sigma_int_m"), row("sigma_acc_m"), row("b_nom_m"), **options,
    )  # fmt: skip


def levels(given: dict[str, Any], **options: Any) -> AraimResult:
    return araim_levels(AraimGeometry(**given), **options)


# --- Appendix D -------------------------------------------------------------------------------


def test_appendix_d_to_its_printed_digits() -> None:
    r = levels(appendix_d())
    assert r.vpl_m[0] == pytest.approx(19.2, abs=0.05)
    assert r.emt_m[0] == pytest.approx(7.8, abs=0.05)
    assert r.sigma_v_acc_m[0] == pytest.approx(1.47, abs=0.005)
    assert r.k_alarm[0, 2] == pytest.approx(5.1083, abs=5e-5)
    # The reference halves its bracket to 0.05 m on each axis and takes the upper end.
    assert 14.4 <= r.hpl_m[0] < 14.5


def test_intermediate_values_of_appendix_d() -> None:
    r = levels(appendix_d())
    assert (r.faults[0], r.modes[0], r.modes_not_monitored[0], r.satellites[0]) == (1, 12, 0, 10)
    # P(two faults or more) is the sum over all pairs of priors but for 1e-4 of itself:
    # 45 x 1e-10 + 20 x 1e-9 + 1e-8 = 3.45e-8.
    assert r.p_not_monitored[0] == pytest.approx(3.45e-8, rel=1e-3)
    assert r.k_alarm[0] == pytest.approx(
        [float(quantile(mp.mpf(p) / 12)) for p in ("2.25e-8", "2.25e-8", "1.95e-6")], rel=1e-13
    )


def test_every_mode_of_appendix_d_against_loops() -> None:
    expected = reference(appendix_d())
    table = araim_modes(AraimGeometry(**appendix_d()))
    assert len(table) == 13
    # The table counts constellations as they first occur, the reference by letter.
    modes = {(mode.satellites, "".join(mode.letters)): mode for mode in expected.modes}
    modes[(), ""] = expected.fix
    assert len(modes) == 13
    for _, row in table.iterrows():
        mode = modes[row["satellites"], row["constellations"]]
        for q, axis in enumerate(("east", "north", "up")):
            assert row[f"sigma_{axis}_m"] == pytest.approx(mode.sigma[q], rel=1e-10)
            assert row[f"bias_{axis}_m"] == pytest.approx(mode.bias[q], rel=1e-10)
            if mode is expected.fix:
                continue
            spread = mode.spread[q]
            assert row[f"sigma_separation_{axis}_m"] == pytest.approx(spread, rel=1e-9)
            threshold = float(expected.k_alarm[q]) * spread
            assert row[f"threshold_{axis}_m"] == pytest.approx(threshold, rel=1e-9)


# --- against the slow reference ---------------------------------------------------------------


def assert_same(r: AraimResult, epoch: int, expected: Answer) -> None:
    assert r.faults[epoch] == expected.faults
    assert r.modes[epoch] == len(expected.modes)
    assert r.p_not_monitored[epoch] == pytest.approx(float(expected.p_not_monitored), rel=1e-11)
    assert r.sigma_acc_m[epoch, :3] == pytest.approx(expected.accuracy[:3], rel=1e-9)
    for q in range(len(expected.levels)):
        level = float(expected.levels[q])
        assert r.level_m[epoch, q] == pytest.approx(level, rel=1e-9, abs=3 * TOLERANCE_M)
        assert np.isinf(level) == np.isinf(r.level_m[epoch, q])
    if expected.modes:
        assert r.k_alarm[epoch] == pytest.approx([float(k) for k in expected.k_alarm], rel=1e-12)
        assert r.emt_m[epoch] == pytest.approx(expected.emt, rel=1e-8)


@pytest.mark.parametrize(
    ("letters", "seed"),
    [("GGGGGGEEEEEE", 1), ("GGGGGGEEEEEE", 2), ("GGGGGRRRRREEEEE", 3), ("GGGGEEEE", 4)],
)
def test_one_fault_at_a_time_against_loops(letters: str, seed: int) -> None:
    given = sky(seed, letters, epochs=3)
    options = {"p_sat": 2e-6, "p_con": 3e-5, "thres": 2e-8}
    r = levels(given, settings=AraimSettings(p_satellite=2e-6, p_constellation=3e-5, p_thres=2e-8))
    assert (r.faults == 1).all()
    for epoch in range(3):
        assert_same(r, epoch, reference(given, epoch, **options))


@pytest.mark.parametrize(("p_sat", "faults"), [(1e-4, 2), (2e-3, 3)])
def test_two_and_three_faults_at_a_time_against_loops(p_sat: float, faults: int) -> None:
    given = sky(11, "GGGGGEEEEE", epochs=1)
    r = levels(given, settings=AraimSettings(p_satellite=p_sat, p_constellation=1e-6))
    expected = reference(given, p_sat=p_sat, p_con=1e-6)
    assert expected.faults == faults
    assert_same(r, 0, expected)


def test_budgets_and_priors_down_to_1e_15_against_loops() -> None:
    given = sky(5, "GGGGGGEEEEEE")
    s = AraimSettings(
        p_satellite=1e-9, p_constellation=1e-8, phmi_v=9e-16, phmi_h=1e-16, pfa_v=1e-14,
        pfa_h=1e-15, p_thres=1e-16, p_emt=1e-9,
    )  # fmt: skip
    expected = reference(
        given, p_sat=1e-9, p_con=1e-8, phmi=(5e-17, 5e-17, 9e-16), total=1e-15,
        alarm_tail=(2.5e-16, 2.5e-16, 5e-15), thres=1e-16, p_emt=1e-9,
    )  # fmt: skip
    r = levels(given, settings=s)
    assert 0 < r.p_not_monitored[0] < 1e-15
    assert np.isfinite(r.level_m).all()
    assert_same(r, 0, expected)


def test_single_constellation_against_loops() -> None:
    given = sky(6, "GGGGGGGGG")
    r = levels(given, settings=AraimSettings(p_constellation=1e-9))
    assert_same(r, 0, reference(given, p_con=1e-9))
    assert r.modes_not_monitored[0] == 1
    assert np.isfinite(r.level_m).all()


@pytest.mark.parametrize("budget", ["along", "split"])
def test_along_and_across_against_loops(budget: Any) -> None:
    given = sky(7, "GGGGGGEEEEEE", epochs=2)
    heading = np.array([30.0, 251.0])
    r = levels(given, heading_deg=heading, settings=AraimSettings(axis_budget=budget))
    share = 2e-9 if budget == "along" else 1e-9
    tail = 4.5e-8 if budget == "along" else 2.25e-8
    for epoch, h in enumerate(np.deg2rad(heading)):
        axes = np.array(
            [[1, 0, 0], [0, 1, 0], [0, 0, 1], [np.sin(h), np.cos(h), 0], [np.cos(h), -np.sin(h), 0]]
        )
        expected = reference(
            given, epoch, axes=axes, phmi=(1e-9, 1e-9, 9.8e-8, share, share),
            alarm_tail=(2.25e-8, 2.25e-8, 1.95e-6, tail, tail),
        )  # fmt: skip
        assert_same(r, epoch, expected)
    assert (r.on("along") == r.level_m[:, 3]).all()
    with pytest.raises(InputError, match="heading_deg"):
        levels(given).on("along")


# --- what must hold ---------------------------------------------------------------------------

seeds = st.integers(0, 10**6)


@given(seeds)
@settings(max_examples=25)
def test_without_faults_the_closed_form(seed: int) -> None:
    given = sky(seed, "GGGGGEEEEE")
    r = levels(given, settings=AraimSettings(p_satellite=0.0, p_constellation=0.0))
    if r.reason[0]:
        return
    fix = reference(given, p_sat=0.0, p_con=0.0).fix
    for q, share in enumerate((1e-9, 1e-9, 9.8e-8)):
        exact = fix.bias[q] + float(quantile(mp.mpf(share) / 2)) * fix.sigma[q]
        assert r.level_m[0, q] == pytest.approx(exact, rel=1e-9)
    assert np.isnan(r.emt_m[0])
    assert r.modes[0] == 0


@given(seeds, st.floats(1.0, 4.0))
@settings(max_examples=25)
def test_levels_grow_with_priors_biases_sigmas_and_what_is_unmonitored(
    seed: int, factor: float
) -> None:
    given = sky(seed, "GGGGGGEEEEEE")
    base = AraimSettings(p_satellite=2e-6, p_constellation=3e-5, most_faults=1)
    first = levels(given, settings=base).level_m
    wider = given | {name: factor * given[name] for name in ("sigma_int_m", "sigma_acc_m")}
    worse = (
        levels(given, settings=replace(base, p_satellite=factor * 2e-6)),
        levels(given, settings=replace(base, p_constellation=factor * 3e-5)),
        levels(given, settings=replace(base, phmi_v=9.8e-8 / factor, phmi_h=2e-9 / factor)),
        levels(given, settings=replace(base, pfa_v=3.9e-6 / factor, pfa_h=9e-8 / factor)),
        levels(given | {"b_nom_m": factor * given["b_nom_m"]}, settings=base),
        levels(wider, settings=base),
    )
    for r in worse:
        assert (r.level_m >= first - 2 * TOLERANCE_M).all()


@given(seeds)
@settings(max_examples=25)
def test_order_empty_slots_and_a_lonely_satellite_change_nothing(seed: int) -> None:
    given = sky(seed, "GGGGGGEEEEEE", epochs=2)
    first = levels(given)
    order = np.random.default_rng(seed).permutation(12)
    more = {"constellation": np.array([*"GRE"]), "elevation_deg": [np.nan, 40.0, 50.0]}
    more |= {"azimuth_deg": [1.0, 200.0, 300.0], "sigma_int_m": [1.0, 1.0, np.inf]}
    more |= {"sigma_acc_m": [1.0, 1.0, 1.0], "b_nom_m": [0.5, 0.5, 0.5]}
    changed: dict[str, Any] = {}
    for name, value in given.items():
        added = np.asarray(more[name])
        if value.ndim == 2:
            added = np.tile(added, (2, 1))
        changed[name] = np.concatenate([value[..., order], added], axis=-1)
    second = levels(changed)
    finite = np.isfinite(first.level_m)
    assert (finite == np.isfinite(second.level_m)).all()
    assert second.level_m[finite] == pytest.approx(first.level_m[finite], rel=1e-8)
    assert second.p_not_monitored == pytest.approx(first.p_not_monitored, rel=1e-12, nan_ok=True)
    assert (second.satellites == 12).all()
    assert sum(second.ranges_left_out.values()) == 6
    assert any("alone" in words for words in second.ranges_left_out)


def test_epochs_do_not_depend_on_the_chunk_they_are_in() -> None:
    given = sky(21, "GGGGGGGGEEEEEEEE", epochs=260)
    together = levels(given, heading_deg=10.0)
    for epoch in (0, 1, 77, 130, 259):
        one = {k: v if v.ndim == 1 else v[epoch : epoch + 1] for k, v in given.items()}
        alone = levels(one, heading_deg=10.0)
        assert alone.level_m[0] == pytest.approx(together.level_m[epoch], abs=3 * TOLERANCE_M)
        assert alone.emt_m[0] == pytest.approx(together.emt_m[epoch], rel=1e-12)


@given(seeds, st.floats(0, 360))
@settings(max_examples=25)
def test_turning_the_sky_and_the_track_together_changes_nothing(seed: int, turn: float) -> None:
    given = sky(seed, "GGGGGGEEEEEE")
    first = levels(given, heading_deg=33.0)
    turned = given | {"azimuth_deg": np.mod(given["azimuth_deg"] + turn, 360.0)}
    second = levels(turned, heading_deg=33.0 + turn)
    assert second.level_m[0, 2:] == pytest.approx(first.level_m[0, 2:], rel=1e-8)


def test_a_track_to_the_north_or_east_has_the_levels_of_these_axes_when_split() -> None:
    given = sky(8, "GGGGGGEEEEEE")
    split = AraimSettings(axis_budget="split")
    north = levels(given, heading_deg=0.0, settings=split)
    east = levels(given, heading_deg=90.0, settings=split)
    assert north.on("along")[0] == pytest.approx(north.level_m[0, 1], abs=2 * TOLERANCE_M)
    assert north.on("across")[0] == pytest.approx(north.level_m[0, 0], abs=2 * TOLERANCE_M)
    assert east.on("along")[0] == pytest.approx(north.level_m[0, 0], abs=2 * TOLERANCE_M)
    assert (levels(given, heading_deg=0.0).on("along") < north.on("along")).all()


def test_one_fault_looked_at_where_two_are_asked_for_is_charged_to_the_budget() -> None:
    given = sky(9, "GGGGGGEEEEEE")
    s = AraimSettings(p_satellite=2e-5, p_constellation=1e-4)
    two = levels(given, settings=s)
    one = levels(given, settings=replace(s, most_faults=1))
    assert (two.faults[0], one.faults[0]) == (2, 1)
    assert one.p_not_monitored[0] > two.p_not_monitored[0]


# --- the separation test ----------------------------------------------------------------------


def test_a_fault_is_detected_when_its_separation_passes_the_threshold() -> None:
    given = sky(10, "GGGGGGEEEEEE", epochs=2)
    quiet = np.zeros((2, 12))
    assert levels(given, residual_m=quiet).alarm_ratio == pytest.approx([0.0, 0.0], abs=1e-12)
    bias = quiet.copy()
    bias[1, 4] = 1.0
    unit = levels(given, residual_m=bias).alarm_ratio[1]
    table = araim_modes(AraimGeometry(**given), 1, residual_m=bias)
    ratios = [
        (table[f"separation_{axis}_m"].abs() / table[f"threshold_{axis}_m"]).max()
        for axis in ("east", "north", "up")
    ]
    assert unit == pytest.approx(max(ratios), rel=1e-12)
    for factor, detected in ((0.999, False), (1.001, True)):
        r = levels(given, residual_m=bias * factor / unit)
        assert (r.alarm_ratio > 1).tolist() == [False, detected]


# Faults of all ranges at once, kept below every threshold east, north and up by a linear
# programme: on a track to the north-east the separation is 1.7 times its threshold.
HIDDEN: dict[str, Any] = {
    "elevation_deg": [19.6589, 44.5097, 7.5564, 44.2974, 79.7143, 10.3328, 12.431, 47.9727,
                      74.8986, 46.7293, 77.1427, 28.9039],
    "azimuth_deg": [356.9582, 76.3291, 278.2764, 120.7734, 300.6366, 12.8178, 112.4202, 332.6021,
                    278.2647, 174.598, 136.0674, 339.9336],
    "constellation": np.array(list("GGGGGGEEEEEE")),
    "sigma_int_m": np.full(12, 1.5),
    "sigma_acc_m": np.full(12, 1.5),
    "b_nom_m": 0.5,
}  # fmt: skip
HIDDEN_RESIDUAL = [[-100.0, 54.8364, -100.0, 100.0, 3.38217, -84.35351, 100.0, -70.24463,
                    -19.2749, 67.61929, 37.14311, -100.0]]  # fmt: skip


def test_a_track_is_tested_with_the_threshold_that_its_level_contains() -> None:
    plain = levels(HIDDEN, residual_m=HIDDEN_RESIDUAL)
    assert plain.alarm_ratio[0] == pytest.approx(0.999, abs=1e-4)
    assert plain.available[0]
    table = araim_modes(AraimGeometry(**HIDDEN), heading_deg=45.0, residual_m=HIDDEN_RESIDUAL)
    along = (table["separation_along_m"].abs() / table["threshold_along_m"]).max()
    track = levels(HIDDEN, heading_deg=45.0, residual_m=HIDDEN_RESIDUAL)
    assert along > 1.6
    assert track.alarm_ratio[0] == pytest.approx(along, rel=1e-12)
    assert track.detected[0]
    assert not track.available[0]


def test_an_unknown_heading_tests_east_north_and_up_only() -> None:
    twice = HIDDEN | {
        name: np.tile(HIDDEN[name], (2, 1)) for name in ("elevation_deg", "azimuth_deg")
    }
    residual = np.tile(HIDDEN_RESIDUAL, (2, 1))
    r = levels(twice, heading_deg=[np.nan, 45.0], residual_m=residual)
    plain = levels(HIDDEN, residual_m=HIDDEN_RESIDUAL)
    assert r.alarm_ratio[0] == pytest.approx(plain.alarm_ratio[0], rel=1e-12)
    assert r.available.tolist() == [True, False]


@pytest.mark.parametrize("size", [1e200, 1.7e308])
def test_residuals_and_biases_beyond_all_sense_pass_nothing(size: float) -> None:
    given = sky(10, "GGGGGGEEEEEE")
    residual = np.zeros((1, 12))
    residual[0, 3:6] = size, -size, size
    assert not levels(given, residual_m=residual, heading_deg=3.0).available[0]
    wide = levels(given | {"b_nom_m": size}, residual_m=np.zeros((1, 12)), heading_deg=3.0)
    assert np.isinf(wide.level_m).all()
    assert not wide.available[0]


def test_accuracies_beyond_all_sense_are_no_sigma() -> None:
    r = levels(sky(10, "GGGGGGEEEEEE") | {"sigma_acc_m": 1e160})
    assert r.ranges_left_out == {"no sigma above 0": 12}


def test_a_range_without_bound_of_its_bias_says_so() -> None:
    given = sky(13, "GGGGGGEEEEEE")
    given["b_nom_m"][0, :2] = np.nan, np.inf
    r = levels(given)
    assert r.ranges_left_out == {"no finite bound of its nominal bias": 2}
    assert r.satellites[0] == 10


def test_an_sbas_satellite_has_the_clock_of_gps() -> None:
    given = sky(13, "GGGGGGEEEEES")
    r = levels(given)
    assert (r.satellites[0], r.ranges_left_out) == (12, {})
    as_gps = given | {"constellation": np.array(list("GGGGGGEEEEEG"))}
    assert r.level_m == pytest.approx(levels(as_gps).level_m, rel=1e-12)


def test_an_error_of_a_whole_constellation_is_its_clock() -> None:
    given = sky(10, "GGGGGGEEEEEE")
    shift = np.where(given["constellation"] == "E", 1000.0, 0.0)[None]
    assert levels(given, residual_m=shift).alarm_ratio[0] < 1e-9


def test_false_alarms_do_not_exceed_their_budget() -> None:
    rng = np.random.default_rng(1)
    n = 4000
    given = {k: np.tile(v, (n, 1)) if v.ndim == 2 else v for k, v in sky(12, "GGGGGEEEE").items()}
    s = AraimSettings(pfa_v=0.04, pfa_h=0.04, most_faults=1)
    noise = rng.normal(0, given["sigma_acc_m"])
    share = float(np.mean(levels(given, residual_m=noise, settings=s).alarm_ratio > 1))
    # A union bound: below 0.08, by more than chance cannot; far below it the tests are lost.
    assert 0.015 < share < 0.08 + 4 * (0.08 / n) ** 0.5


def test_a_range_without_residual_takes_no_part() -> None:
    given = sky(13, "GGGGGGEEEEEE")
    residual = np.zeros((1, 12))
    residual[0, 2] = np.nan
    used = np.arange(12) != 2
    r = levels(given, residual_m=residual)
    assert r.level_m == pytest.approx(levels(given | {"used": used}).level_m, rel=1e-12)
    assert r.satellites[0] == 11
    assert r.ranges_left_out == {"no residual": 1}


# --- no level, and why ------------------------------------------------------------------------


def test_a_single_constellation_that_may_fail_has_no_level() -> None:
    r = levels(sky(14, "GGGGGGGGG"))
    assert np.isinf(r.level_m).all()
    assert r.reason[0] == UNMONITORED
    assert "exhaust" in r.reasons[0]
    assert not r.available[0]
    assert r.p_not_monitored[0] == pytest.approx(1e-4, rel=1e-3)


@pytest.mark.parametrize(
    ("letters", "reason"),
    [
        ("GGG", GeometryReason.TOO_FEW),
        ("GGGG", GeometryReason.NO_REDUNDANCY),
        ("GGGEE", GeometryReason.NO_REDUNDANCY),
        ("GGEE", GeometryReason.TOO_FEW),
    ],
)
def test_too_few_satellites(letters: str, reason: GeometryReason) -> None:
    r = levels(sky(15, letters))
    assert np.isinf(r.level_m).all()
    assert r.reason[0] == reason
    assert r.reasons[0] == reason.words
    assert np.isnan(r.emt_m[0])


def test_degenerate_epochs_are_masked_and_leave_the_others_alone() -> None:
    given = sky(16, "GGGGGGEEEEEE", epochs=6)
    sound = levels(given)
    given["elevation_deg"][1] = 30.0  # a cone: height and clock are one
    given["elevation_deg"][2, :] = np.nan
    given["sigma_int_m"][3, 2:] = np.inf  # weight 0
    given["sigma_int_m"][4, :] = 0.0
    given["sigma_acc_m"][5, :3] = np.nan
    r = levels(given)
    assert r.level_m[0] == pytest.approx(sound.level_m[0], abs=2 * TOLERANCE_M)
    assert np.isinf(r.level_m[1:5]).all()
    assert r.reason[:5].tolist() == [
        GeometryReason.SOUND, GeometryReason.DEGENERATE, *[GeometryReason.TOO_FEW] * 3,
    ]  # fmt: skip
    assert r.satellites.tolist() == [12, 12, 0, 2, 0, 9]
    assert np.isnan(r.sigma_acc_m[1:5]).all()
    assert sum(r.ranges_left_out.values()) == 12 + 10 + 12 + 3


def test_two_equal_satellites_are_no_redundancy() -> None:
    given = sky(17, "GGGGGGEEEEEE")
    for name in ("elevation_deg", "azimuth_deg"):
        given[name][0, 1] = given[name][0, 0]
    r = levels(given)
    assert r.reason[0] == GeometryReason.TWICE
    assert np.isinf(r.level_m).all()


def test_a_critical_satellite_counts_as_unmonitored() -> None:
    # Without the one in the zenith height and clock are one: its fault cannot be monitored.
    geometry = AraimGeometry([30, 30, 30, 30, 90], [0, 90, 180, 270, 0], ["G"] * 5, 1.0, 1.0, 0.0)
    r = araim_levels(geometry, settings=AraimSettings(p_satellite=1e-8, p_constellation=0.0))
    assert (r.modes[0], r.modes_not_monitored[0]) == (4, 1)
    assert r.p_not_monitored[0] == pytest.approx(1e-8, rel=1e-6)
    assert np.isfinite(r.level_m).all()


def test_no_vertical_budget_no_vertical_level() -> None:
    r = levels(appendix_d(), settings=AraimSettings(phmi_v=0.0, phmi_h=1e-7))
    assert np.isinf(r.vpl_m[0])
    assert r.has_level[0]
    assert r.hpl_m[0] < 14.4


def test_an_unknown_heading_leaves_the_track_levels_unknown() -> None:
    given = sky(18, "GGGGGGEEEEEE", epochs=2)
    r = levels(given, heading_deg=[np.nan, 20.0])
    assert np.isnan(r.level_m).tolist() == [[False] * 3 + [True] * 2, [False] * 5]


@pytest.mark.parametrize("epochs", [0, 2])
def test_nothing_given_nothing_claimed(epochs: int) -> None:
    empty = np.full((epochs, 4), np.nan)
    r = araim_levels(AraimGeometry(empty, empty, [""] * 4, empty, empty, empty), heading_deg=1.0)
    assert r.level_m.shape == (epochs, 5)
    assert np.isinf(r.level_m).all()
    assert len(r.summary()) == epochs


def test_shapes_and_priors_that_do_not_fit_are_refused() -> None:
    given = sky(19, "GGGGGGEEEEEE", epochs=2)
    with pytest.raises(InputError, match="heading_deg does not fit"):
        levels(given, heading_deg=[1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="residual_m does not fit"):
        levels(given, residual_m=np.zeros((2, 11)))
    with pytest.raises(InputError, match="residual_m must be numbers"):
        levels(given, residual_m="a")
    for epoch in (2, -3, 1.0, "a", True):
        with pytest.raises(InputError, match="no epoch"):
            araim_modes(AraimGeometry(**given), epoch)  # type: ignore[arg-type]
    assert araim_modes(AraimGeometry(**given), -1).equals(araim_modes(AraimGeometry(**given), 1))
    with pytest.raises(InputError, match="no p_satellite for constellation E"):
        levels(given, settings=AraimSettings(p_satellite={"G": 1e-5}))


def test_summary_and_modes_of_dual_frequency_ranges() -> None:
    example = appendix_d()
    geometry = dual_frequency_ranges(
        example["elevation_deg"], example["azimuth_deg"], example["constellation"]
    )
    # Galileo's own user errors are smaller than those of Appendix D.
    r = araim_levels(geometry)
    assert r.vpl_m[0] < levels(example).vpl_m[0]
    frame = r.summary()
    assert frame.loc[0, "hpl_m"] == r.hpl_m[0]
    assert frame.loc[0, "reason"].startswith("no test ran")
