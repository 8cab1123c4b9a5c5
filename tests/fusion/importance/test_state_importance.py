"""Importance of state levels: the page's figures, hand arithmetic, and what runs cannot tell."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from sbas.exceptions import InputError
from sbas.fusion.critical.run_bootstrap import resampled
from sbas.fusion.fused_runs import FusedRuns
from sbas.fusion.importance.importance_results import LEAST_RUNS, Bounded
from sbas.fusion.importance.state_importance import importance_by_state, independent_importance
from sbas.fusion.logic.published_tables import figure_9

D = np.array([0.2, 0.2, 0.15])
U = np.array([0.1, 0.07, 0.07])
MARGINALS = np.stack([[0.7, 0.73, 0.78], D, U], axis=1)


def drawn_runs(runs: int, *, seed: int = 1, epochs: int = 20, common: float = 0.0) -> FusedRuns:
    """Independent states by MARGINALS, a share of the runs all U in epoch 0; the output is that of
    the corrected Figure 9, but U wherever GPS is U."""
    rng = np.random.default_rng(seed)
    edges = MARGINALS.cumsum(axis=1)[:, :2]
    u = rng.random((3, epochs, runs))
    states = (u[..., None] > edges[:, None, None, :]).sum(axis=-1).astype(np.int8)
    states[:, 0, rng.random(runs) < common] = 2
    output = figure_9().outcomes[9 * states[0].astype(int) + 3 * states[1] + states[2]]
    output = np.where(states[2] == 2, 2, output).astype(np.int8)
    return FusedRuns(("Odo", "Acc", "GPS"), 1.0, states, output, np.zeros(output.shape), output < 2)


def test_page_values_of_independent_sensors() -> None:
    # Page section 11 [C].
    found = independent_importance(figure_9(), MARGINALS)
    assert found.top("independent", "isU").value == pytest.approx(4.9e-4, rel=1e-12)
    assert found.top("independent", "notN").value == pytest.approx(0.22759, abs=1e-12)
    for top, level, value in (("isU", "U", 0.0049), ("notN", "U", 0.8649), ("notN", "DA", 0.03)):
        row = found.of("independent", top, "Odo", level)  # type: ignore[arg-type]
        assert row.birnbaum.value == pytest.approx(value, abs=1e-12)
        assert not row.birnbaum.bounded
        assert row.note == ""
    # D and U of a sensor taken as independent events give another, wrong figure.
    wrong = 1 - (1 - U).prod() * (1 - (D + U).prod())
    assert wrong == pytest.approx(0.2355, abs=5e-5)


def test_other_measures_by_hand() -> None:
    found = independent_importance(figure_9(), MARGINALS)
    p = 0.22759
    u_row, d_row = (found.of("independent", "notN", "Odo", level) for level in ("U", "DA"))
    # Given odometer U the output is never N; given DA: any other U, or both DA.
    assert u_row.raw.value == pytest.approx(1 / p)
    given_n, given_da = 1 - 0.93**2, 1 - 0.93**2 + 0.2 * 0.15
    assert d_row.raw.value == pytest.approx(given_da / p)
    # Level repaired to N: its probability moves there.
    assert u_row.rrw.value == pytest.approx(p / (0.8 * given_n + 0.2 * given_da))
    assert d_row.rrw.value == pytest.approx(p / (0.9 * given_n + 0.1))
    # Minimal cuts: (U, -, -) holds with 0.1; (D, D, D) where all are D or worse.
    assert u_row.fussell_vesely.value == pytest.approx(0.1 / p)
    assert d_row.fussell_vesely.value == pytest.approx(0.3 * 0.27 * 0.22 / p)
    # isU has the one cut (U, U, U): without U of the odometer it never is.
    u_row, d_row = (found.of("independent", "isU", "Odo", level) for level in ("U", "DA"))
    assert (u_row.fussell_vesely.value, d_row.fussell_vesely.value) == (1.0, 0.0)
    assert u_row.raw.value == pytest.approx(10)
    assert (u_row.rrw.value, d_row.rrw.value) == (math.inf, 1.0)
    assert "infinite" not in json.dumps(found.to_dict(), allow_nan=False)


def test_birnbaum_is_the_derivative() -> None:
    # P(top) is multilinear: moving 1e-3 from N to a level changes it by 1e-3 I, exactly.
    found = independent_importance(figure_9("printed"), MARGINALS)
    for sensor, name in enumerate(("Odo", "Acc", "GPS")):
        for level, word in ((1, "DA"), (2, "U")):
            moved = MARGINALS.copy()
            moved[sensor, [0, level]] += (-1e-3, 1e-3)
            other = independent_importance(figure_9("printed"), moved)
            for top in ("notN", "isU"):
                rise = other.top("independent", top).value - found.top("independent", top).value  # type: ignore[arg-type]
                row = found.of("independent", top, name, word)  # type: ignore[arg-type]
                assert rise == pytest.approx(1e-3 * row.birnbaum.value, abs=1e-15)


def test_not_monotone_table_has_no_minimal_cuts() -> None:
    found = independent_importance(figure_9("printed"), MARGINALS)
    row = found.of("independent", "notN", "Odo", "U")
    assert math.isnan(row.fussell_vesely.value)
    assert "worse sensor" in row.note
    assert found.of("independent", "isU", "Odo", "U").fussell_vesely.value == 1.0


def test_laws_agree_where_they_should() -> None:
    # States drawn independent: the joint law is the independent one within its interval, and of
    # notN also the simulated output is the table's.
    runs = drawn_runs(2000)
    found = importance_by_state(figure_9(), runs, replicates=300)
    exact = independent_importance(figure_9(), MARGINALS)
    assert found.epochs == 40_000
    assert found.epochs_left_out == 0
    for sensor in ("Odo", "Acc", "GPS"):
        for level in ("DA", "U"):
            truth = exact.of("independent", "notN", sensor, level).birnbaum.value
            row = found.of("joint", "notN", sensor, level)
            # Binomial scatter of the two shares; 5 sigma.
            tolerance = 5 * math.sqrt(0.25 / row.epochs + 0.2 / 28_000)  # type: ignore[operator]
            assert row.birnbaum.value == pytest.approx(truth, abs=tolerance)
            assert row.birnbaum.lower <= row.birnbaum.value <= row.birnbaum.upper
            simulated = found.of("simulated", "notN", sensor, level)
            assert simulated.birnbaum.value == row.birnbaum.value
    # notN given U of a sensor is certain by the table: the interval is that of the other share.
    row = found.of("joint", "notN", "GPS", "U")
    assert row.given_level == 1.0
    assert row.birnbaum.bounded
    # In the simulation a share of 1 in all runs is not known to be 1: no interval.
    row = found.of("simulated", "notN", "GPS", "U")
    assert (row.given_level, row.birnbaum.bounded) == (1.0, False)
    assert not any("notN" in text for text in found.warnings)


def test_simulated_output_that_is_not_the_tables() -> None:
    found = importance_by_state(figure_9(), drawn_runs(2000), replicates=300)
    assert found.of("simulated", "isU", "GPS", "U").birnbaum.value == 1.0
    assert found.top("simulated", "isU").value == pytest.approx(0.07, abs=0.01)
    warning = next(text for text in found.warnings if "understates" in text)
    assert "P(isU)" in warning
    # U of GPS with the output U: its cut (U, U, U) holds only in few of these epochs.
    fv = found.of("simulated", "isU", "GPS", "U").fussell_vesely
    assert fv.value == pytest.approx(0.1 * 0.07, abs=0.005)
    assert found.agreement == pytest.approx(1 - (0.07 - 4.9e-4), abs=0.01)
    assert "warning: " in str(found)


def test_dependence_is_said() -> None:
    found = importance_by_state(figure_9(), drawn_runs(2000, common=0.1), replicates=300)
    assert found.top("joint", "isU").value == pytest.approx(4.9e-4 + 0.1 / 20, rel=0.3)
    assert any("not independent" in text and "isU" in text for text in found.warnings)


def test_interval_covers_and_widens_with_correlation() -> None:
    # 20 equal epochs a run are worth one: the interval is about sqrt(20) times as wide.
    spread = drawn_runs(1000, seed=4)
    single = drawn_runs(1000, seed=4, epochs=1)
    held = replace(
        single,
        sensor_state=np.repeat(single.sensor_state, 20, axis=1),
        output_state=np.repeat(single.output_state, 20, axis=0),
    )
    wide, narrow = (
        importance_by_state(figure_9(), r, replicates=400).top("joint", "notN")
        for r in (held, spread)
    )
    ratio = (wide.upper - wide.lower) / (narrow.upper - narrow.lower)
    assert ratio == pytest.approx(math.sqrt(20), rel=0.3)
    # The binomial interval of 1000 runs: 2 * 1.96 * sqrt(p q/1000).
    p = wide.value
    assert wide.upper - wide.lower == pytest.approx(3.92 * math.sqrt(p * (1 - p) / 1000), rel=0.2)


def test_intervals_cover_the_truth_from_twenty_runs() -> None:
    # A top in bursts of 5 epochs on average, in so many of 500 runs on average: how often the
    # interval of its share holds the true one. What LEAST_RUNS states; 400 draws, 3 sigma.
    rng = np.random.default_rng(11)
    for expected, covered in ((5, 0.84), (LEAST_RUNS, 0.91)):
        caught = 0
        for draw in range(400):
            bursts = np.where(rng.random(500) < expected / 500, rng.geometric(0.2, 500), 0)
            shares = resampled(500, 200, np.random.default_rng(draw)).astype(float) @ bursts / 500
            low, high = np.quantile(shares, [0.025, 0.975])
            caught += low <= 5 * expected / 500 <= high
        assert caught / 400 == pytest.approx(
            covered, abs=3 * math.sqrt(covered * (1 - covered) / 400)
        )


def test_level_never_seen_is_not_estimable() -> None:
    runs = drawn_runs(300)
    states = runs.sensor_state.copy()
    states[1][states[1] == 2] = 1
    found = importance_by_state(figure_9(), replace(runs, sensor_state=states), replicates=100)
    for law in ("joint", "simulated"):
        row = found.of(law, "notN", "Acc", "U")  # type: ignore[arg-type]
        assert (row.epochs, row.runs) == (0, 0)
        assert math.isnan(row.birnbaum.value)
        assert str(row.birnbaum) == "not estimable"
        assert "U never seen" in row.note
    # Under independence it stays a figure of the other sensors' states.
    assert found.of("independent", "notN", "Acc", "U").birnbaum.value > 0.5
    frame = found.summary()
    assert math.isnan(frame.loc[("joint", "notN", "Acc", "U"), "birnbaum"])
    rows = found.to_dict()["rows"]
    row = next(r for r in rows if (r["law"], r["sensor"], r["level"]) == ("joint", "Acc", "U"))
    assert row["birnbaum"] is None
    json.dumps(found.to_dict(), allow_nan=False)


def test_few_runs_give_no_interval() -> None:
    found = importance_by_state(figure_9(), drawn_runs(15), replicates=100)
    assert not any(
        row.birnbaum.bounded for row in found.rows if row.level == "U" and row.top == "isU"
    )
    row = found.of("simulated", "notN", "Odo", "DA")
    assert not row.birnbaum.bounded
    assert "fewer than 20 runs" in row.note
    assert any("cannot be compared" in text for text in found.warnings)
    # No U of all three in 300 epochs: a share of 0 has no interval that says it is exact.
    none = found.top("joint", "isU")
    assert (none.value, none.bounded) == (0.0, False)
    assert "the top never happens" in found.of("joint", "isU", "Odo", "U").note


def test_epochs_without_data_are_counted() -> None:
    runs = drawn_runs(200)
    states, output = runs.sensor_state.copy(), runs.output_state.copy()
    states[2, 3, :50] = -1
    output[5, :10] = -1
    holes = replace(runs, sensor_state=states, output_state=output)
    found = importance_by_state(figure_9(), holes, replicates=100)
    assert found.epochs == 4000 - 60
    assert found.epochs_left_out == 60
    assert "60 without data left out" in str(found)
    silent = replace(runs, output_state=np.full_like(output, -1))
    with pytest.raises(InputError, match="no epoch"):
        importance_by_state(figure_9(), silent)


def test_same_seed_same_digits() -> None:
    runs = drawn_runs(100)
    first, second, other = (
        importance_by_state(figure_9(), runs, replicates=100, seed=seed).to_dict()
        for seed in (0, 0, 1)
    )
    assert first == second
    assert first != other


@pytest.mark.parametrize(
    ("change", "options", "where"),
    [
        ({"names": ("Acc", "Odo", "GPS")}, {}, "table"),
        ({}, {"confidence": 1.0}, "confidence"),
        ({}, {"replicates": 10}, "replicates"),
    ],
)
def test_refusals(change: dict[str, object], options: dict[str, float], where: str) -> None:
    with pytest.raises(InputError) as caught:
        importance_by_state(figure_9(), replace(drawn_runs(5), **change), **options)  # type: ignore[arg-type]
    assert caught.value.where == where


def test_bounds_are_written_outward() -> None:
    assert str(Bounded(0.12345, 0.11119, 0.13331)) == "0.123 [0.111, 0.134]"
    assert str(Bounded(0.12345)) == "0.123"
    assert str(Bounded(math.inf, 2.0, math.inf)) == "infinite [2, infinite]"
