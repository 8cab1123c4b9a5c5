"""Critical combinations and times: by hand, against closed forms, and the page's simulations."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from sbas.exceptions import InputError
from sbas.fusion.architecture.architecture_files import load_architecture
from sbas.fusion.architecture.model import Architecture, Odometer, Thresholds
from sbas.fusion.critical.critical_times import (
    CriticalTimes,
    convexity_holds,
    critical_times,
    overlap_probability,
)
from sbas.fusion.simulation.simulated_runs import simulate_runs
from sbas.fusion.states import states_of

P, Q = 0.05, 0.15


def memoryless(runs: int, *, epochs: int = 40, p: float = P, q: float = Q, seed: int = 0,
               there: float = 0.0) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """One sensor enters U at the first epoch; at each step the output gets U with probability
    p, or the sensor leaves for good with q. A share `there` begins with the output in U."""
    rng = np.random.default_rng(seed)
    lot = rng.random((epochs, runs))
    lot[0] = np.where(rng.random(runs) < there, 0.0, 1.0)
    reached, left = lot < p, (lot >= p) & (lot < p + q)
    first_reached, first_left = (
        np.where(m.any(axis=0), m.argmax(axis=0), epochs) for m in (reached, left)
    )
    k = np.arange(epochs)[:, np.newaxis]
    sensor = np.where(k < first_left, 2, 0).astype(np.int8)
    output = np.where((k >= first_reached) & (first_reached < first_left), 2, 0).astype(np.int8)
    return sensor[np.newaxis], output


def analysed(sensor: np.ndarray, output: np.ndarray, **options: object) -> CriticalTimes:
    names = tuple("abcdefgh"[: len(sensor)])
    return critical_times(sensor, output, **({"names": names, "step_s": 1.0} | options))  # type: ignore[arg-type]


def test_a_memoryless_combination_has_its_closed_form() -> None:
    """F(k) = p (1 - s^k)/(p + q), s = 1 - p - q; mean time 1/(p + q) = 5 s; median 4 s, the
    first k with 1 - 0.8^k >= 1/2 (all exact). 20000 runs: standard errors 0.3 % and 0.06 s."""
    row = analysed(*memoryless(20_000), convex=False).table.loc["U"]
    assert row["at_risk"] == 20_000
    for horizon in (1, 2, 5, 20):
        exact = P * (1 - (1 - P - Q) ** horizon) / (P + Q)
        assert row[f"f_{horizon}s"] == pytest.approx(exact, abs=0.01)
        assert row[f"f_{horizon}s_lower"] - 0.002 < exact < row[f"f_{horizon}s_upper"] + 0.002
    assert row["event_mean_s"] == pytest.approx(5.0, abs=0.25)
    assert row["event_mean_s_lower"] < 5.0 < row["event_mean_s_upper"]
    assert row["event_median_s"] == 4
    assert row["event_q05_s"] == 1
    # F(1) = 0.05 exactly: sampling decides between 1 and 2 s.
    assert row["reach_q05_s"] in (1, 2)
    assert row["verdict"] == "critical"
    # The bootstrap's width is that of a share of independent runs.
    sd = np.sqrt(0.25 * 0.75 / 20_000)
    assert row["incidence_upper"] - row["incidence_lower"] == pytest.approx(2 * 1.96 * sd, rel=0.15)


def test_the_end_of_the_record_does_not_lower_the_incidence() -> None:
    """Entries spread over a record of 10 epochs: still F(1 s) = 0.05, F(2 s) = 0.09 (exact). An
    episode that began at the last epoch was never at risk; counted as if it had been, it would
    give 0.045. 40000 runs: standard error 0.1 % and 0.2 %."""
    sensor, output = memoryless(40_000, epochs=10)
    k = np.arange(10)[:, np.newaxis] - np.arange(40_000) % 10
    shifted = [np.take_along_axis(a, np.maximum(k, 0), axis=0) for a in (sensor[0], output)]
    late_sensor, late_output = (np.where(k < 0, 0, a).astype(np.int8) for a in shifted)
    table = analysed(late_sensor[np.newaxis], late_output).table
    assert table.loc["U", "f_1s"] == pytest.approx(0.05, abs=0.003)
    assert table.loc["U", "f_2s"] == pytest.approx(0.09, abs=0.005)
    assert np.isnan(table.loc["U", "f_20s"]), "nothing was seen for 20 s"


def test_those_there_at_entry_are_a_figure_of_their_own() -> None:
    row = analysed(*memoryless(5_000, there=0.3)).table.loc["U"]
    assert row["p_u_at_entry"] == pytest.approx(0.3, abs=0.03)
    assert row["at_risk"] + round(row["p_u_at_entry"] * row["episodes"]) == row["episodes"]
    assert row["reach_q05_s"] == 0
    assert row["f_5s"] == pytest.approx(P * (1 - 0.8**5) / (P + Q), abs=0.02)


def test_long_episodes_are_counted_right() -> None:
    """Times beyond 127 steps, and 400 different ones: one event at each."""
    epochs = 401
    sensor = np.full((1, epochs, 400), 2, np.int8)
    output = (np.arange(epochs)[:, np.newaxis] > np.arange(400)).astype(np.int8) * 2
    result = analysed(sensor, output, replicates=50)
    row = result.table.loc["U"]
    assert row["events"] == 400
    assert row["incidence"] == 1
    assert (row["event_q05_s"], row["event_median_s"], row["event_mean_s"]) == (20, 200, 200.5)
    np.testing.assert_allclose(result.curves["U"].incidence, np.arange(1, 401) / 400, rtol=1e-12)


def rarely(events: int, runs: int = 200) -> CriticalTimes:
    """Every run is in D for 3 epochs after one in N; some get U at the last."""
    sensor = np.array([0, 1, 1, 1], np.int8)[np.newaxis, :, np.newaxis].repeat(runs, axis=2)
    output = np.zeros((4, runs), np.int8)
    output[3, :events] = 2
    return analysed(sensor, output)


def test_fewer_than_five_events_give_no_time() -> None:
    four, five = rarely(4).table.loc["D"], rarely(5).table.loc["D"]
    times = ["event_q05_s", "event_median_s", "event_mean_s"]
    assert four[times].isna().all()
    assert four["verdict"] == "undecided"
    assert (five[times] == 2).all()
    assert rarely(4).curves.keys() == set()
    assert set(rarely(5).curves) == {"D"}


@pytest.mark.parametrize(
    ("events", "runs", "verdict"),
    # Clopper-Pearson upper bounds: 0 of 368 gives 0.998 %, 0 of 367 gives 1.0001 %.
    [
        (0, 368, "not critical"),
        (0, 367, "undecided"),
        (40, 200, "critical"),
        (5, 1000, "not critical"),
    ],
)
def test_verdicts(events: int, runs: int, verdict: str) -> None:
    assert rarely(events, runs).table.loc["D", "verdict"] == verdict
    assert ("D" in rarely(events, runs).critical) == (verdict == "critical")


def test_an_output_that_was_never_better_is_said_so() -> None:
    sensor = np.full((1, 5, 30), 2, np.int8)
    row = analysed(sensor, sensor[0]).table.loc["U"]
    assert row["verdict"] == "always there"
    assert row["p_u_at_entry"] == 1
    assert row["at_risk"] == 0
    assert np.isnan(row["incidence"])
    assert row["reach_q05_s"] == 0


def test_what_is_never_reached_is_known_only_from_enough_episodes() -> None:
    """Upper bound 1 - 0.025^(1/n) below 5 % from n = 72 on (exact)."""
    assert np.isinf(rarely(0, 72).table.loc["D", "reach_q05_s"])
    assert np.isnan(rarely(0, 71).table.loc["D", "reach_q05_s"])


def test_a_step_as_long_as_the_critical_times_is_a_finding() -> None:
    sensor, output = memoryless(2000, p=0.4, q=0.1)
    (finding,) = analysed(sensor, output).findings
    assert finding.severity == "warning"
    assert "half of them or more: U" in finding.evidence
    slow_sensor, slow_output = (np.repeat(a, 30, axis=-2) for a in (sensor, output))
    assert analysed(slow_sensor, slow_output, step_s=1 / 30).findings == ()


def test_horizons_shorter_than_a_step_have_no_figure() -> None:
    table = analysed(*memoryless(500), step_s=2.0).table
    assert np.isnan(table.loc["U", "f_1s"])
    assert table.loc["U", "f_2s"] > 0


def test_what_the_entry_of_a_record_hides_is_left_out() -> None:
    sensor, output = memoryless(500)
    table = analysed(sensor, output, starts_fresh=False).table
    assert table.loc["U", "episodes"] == 0
    assert table.loc["U", "epochs"] == np.count_nonzero(sensor == 2)


def test_degraded_as_target_names_its_own_columns() -> None:
    sensor, output = memoryless(300, there=0.5)
    table = analysed(sensor, np.minimum(output, 1).astype(np.int8), target="DA").table
    assert table.loc["U", "p_da_at_entry"] == pytest.approx(0.5, abs=0.1)
    assert table.loc["U", "verdict"] == "critical"


def test_silent_sensors_have_rows_of_their_own_after_the_others() -> None:
    rng = np.random.default_rng(2)
    sensor = rng.integers(-1, 3, (2, 20, 50)).astype(np.int8)
    table = analysed(sensor, rng.integers(-1, 3, (20, 50)).astype(np.int8)).table
    assert list(table.index[:3]) == ["NN", "ND", "NU"]
    assert ["-" in name for name in table.index] == [False] * 9 + [True] * 7
    assert table["epochs"].sum() == 1000
    shares = table[["share_n", "share_da", "share_u", "share_no_data"]]
    np.testing.assert_allclose(shares.sum(axis=1), 1)


def test_plain_values_are_json() -> None:
    result = analysed(*memoryless(300))
    values = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert values["critical"] == ["U"]
    assert values["evidence"] == "modelled"
    assert (
        values["critical_time_s"]["U"]["event_median_s"] == result.table.loc["U", "event_median_s"]
    )
    assert values["combinations_possible"] == 3
    assert [row["combination"] for row in values["combinations"]] == ["N", "U"]


def test_same_seed_same_digits() -> None:
    first, second, other = (analysed(*memoryless(300), seed=s).table for s in (1, 1, 2))
    assert first.equals(second)
    assert not first.equals(other)
    assert first["incidence"].equals(other["incidence"])


# --- convexity --------------------------------------------------------------------------------


@given(st.integers(2, 4), st.integers(0, 10_000))
def test_a_weighted_mean_of_acceptable_positions_is_acceptable(n: int, seed: int) -> None:
    """The theorem, on random errors and weights: the check never finds a fault in it."""
    rng = np.random.default_rng(seed)
    errors = rng.normal(0, 2.0, (n, 10, 5))
    weights = rng.dirichlet(np.ones(n))
    limits = Thresholds()
    sensor = np.stack([states_of(e, limits) for e in errors])
    output = states_of(np.einsum("i,itr->tr", weights, errors), limits)
    table = analysed(sensor, output, convex=True, replicates=5).table
    without_u = [name for name in table.index if "U" not in name]
    assert (table.loc[without_u, "share_u"] == 0).all()
    assert (table.loc[without_u, "verdict"] == "impossible").all()


def test_what_contradicts_the_theorem_is_refused() -> None:
    sensor = np.ones((2, 6, 3), np.int8)
    output = np.zeros((6, 3), np.int8)
    output[4, 1] = 2
    assert analysed(sensor, output).table.loc["DD", "events"] == 1
    with pytest.raises(InputError, match="cannot be") as caught:
        analysed(sensor, output, convex=True)
    assert "DD, run 1" in caught.value.where
    sensor[0, 4, 1] = -1  # the value in its place is unknown here
    analysed(sensor, output, convex=True)


def test_for_which_architectures_the_theorem_holds() -> None:
    """The norm: acc (0, 2.4, 0), GPS (0, 0, 2.4), weight 1 on one axis each: 3.39 (page)."""
    mean = Architecture("a", (Odometer("odo"),))
    assert convexity_holds(mean)
    per_axis = replace(mean, operator="per_axis")
    assert convexity_holds(per_axis)
    assert not convexity_holds(replace(per_axis, axis_rule="norm"))
    assert not convexity_holds(replace(mean, operator="kalman"))
    assert not convexity_holds(replace(mean, thresholds=Thresholds(hysteresis_m=0.2)))
    assert not convexity_holds(replace(mean, thresholds=Thresholds(min_dwell_s=2.0)))


# --- overlap with published rows --------------------------------------------------------------


@given(st.integers(0, 27), st.integers(0, 27), st.integers(-1, 27))
def test_overlap_equals_the_peers(critical: int, rows: int, found: int) -> None:
    expected = stats.hypergeom.sf(found - 1, 27, critical, rows)
    p = overlap_probability(found=found, critical=critical, rows=rows, combinations=27)
    assert p == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("found", "critical", "rows", "p"),
    [(4, 12, 8, 0.52), (9, 10, 9, 2e-6), (5, 15, 8, 0.48), (5, 13, 8, 0.29)],
)
def test_overlaps_of_the_page(found: int, critical: int, rows: int, p: float) -> None:
    """Rounded as the causal-analysis page prints them."""
    value = overlap_probability(found=found, critical=critical, rows=rows, combinations=27)
    assert value == pytest.approx(p, rel=0.07)


def test_impossible_numbers_are_refused() -> None:
    with pytest.raises(InputError):
        overlap_probability(found=1, critical=28, rows=8, combinations=27)
    with pytest.raises(InputError):
        analysed(*memoryless(5), names=("a", "b"))


# --- against another simulation ---------------------------------------------------------------


@cache
def architecture_1(weights: tuple[float, ...] = ()) -> CriticalTimes:
    arch = load_architecture("arch1")
    if weights:
        arch = replace(arch, weights="fixed", fixed_weights=weights)
    fused = simulate_runs(arch, runs=20_000, seed=1)
    return critical_times(
        fused.sensor_state, fused.output_state, names=fused.names, step_s=fused.step_s,
        convex=convexity_holds(arch),
    )  # fmt: skip


def test_the_critical_set_of_architecture_1() -> None:
    """That of another implementation, 20000 runs at 3 seeds; one run meets 6.8 combinations."""
    others = "NNU NDU NUU DNU DDU DUU UNN UNU UDN UDU UUN UUU"
    assert " ".join(architecture_1().critical) == others
    assert architecture_1().visited_per_run == pytest.approx(6.8, abs=0.1)


@pytest.mark.parametrize(
    ("row", "lower", "upper"),
    [("DNU", 0.102, 0.128), ("NDU", 0.097, 0.131), ("UDN", 0.028, 0.036), ("UUN", 0.036, 0.049)],
)
def test_incidences_of_architecture_1(row: str, lower: float, upper: float) -> None:
    """Intervals of the other implementation and ours overlap."""
    ours = architecture_1().table.loc[row]
    assert ours["incidence_lower"] < upper
    assert ours["incidence_upper"] > lower


def test_incidence_of_uun_at_equal_weights() -> None:
    """F(20 s) = 0.107, F(1 s) = 0.023 in the other implementation, which keeps an episode in
    the risk set one step after it was last seen and so finds slightly less."""
    row = architecture_1((1 / 3,) * 3).table.loc["UUN"]
    assert row["f_20s_lower"] < 0.107 < row["f_20s_upper"]
    assert row["f_1s_lower"] < 0.023 * 1.05 < row["f_1s_upper"]


def test_the_analysis_loads_neither_drawing_nor_scipy_stats() -> None:
    """They take longer to load than most analyses here take to run."""
    code = (
        "import sys, sbas.fusion; "
        "print([m for m in ('matplotlib', 'scipy.stats') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
