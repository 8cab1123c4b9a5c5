"""Check values of the method page, 40-digit arithmetic, and every path of random trees."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest

from sbas.dependability.exact.exact import solve
from sbas.dependability.tree.model import (
    And,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    HybridFaultTree,
    InState,
    MarkovSource,
    Not,
    Options,
    Or,
    Pand,
    Stage,
)
from sbas.exceptions import InputError, ModelError
from tests.dependability.paper_models import URBAN_EXACT, check_unit, localisation_unit
from tests.dependability.path_enumeration import by_paths, random_model

# --- every path of a small tree ---------------------------------------------------------------


@pytest.mark.parametrize("block", range(8))
def test_random_nested_trees_against_every_path(block: int) -> None:
    for seed in range(25 * block, 25 * block + 25):
        model = random_model(seed)
        solution = solve(model, first_passage=True, curve=True)
        for name, paths in by_paths(model).items():
            row = solution.rows[name]
            where = f"seed {seed}, {name}, by {row.method}"
            np.testing.assert_allclose(
                solution.curves[name], paths.on, rtol=0, atol=1e-12, err_msg=where
            )
            assert row.at_least_once == pytest.approx(paths.once, abs=1e-12), where
            assert row.occurrences == pytest.approx(paths.occurrences, abs=1e-12), where


def test_the_random_trees_take_every_way() -> None:
    rows = [row for seed in range(60) for row in solve(random_model(seed)).rows.values()]
    assert {row.method for row in rows} == {"chain", "window", "look-back", "product", "modules"}


# --- the non-rare check set -------------------------------------------------------------------

CHECK_SET = {
    # row: mean, point at 1 h, F, W
    "IE1": (0.0198948915, 0.0251467251, 0.5113853807, 4.0656164),
    "IE2": (0.1598464517, 0.1877105205, 0.9182663815, 2.0895146),
    "IE5": (0.0347991524, 0.0336791338, 0.9999005258, 56.4160888),
    "IE6": (0.0113802117, 0.0130658610, 0.5029835723, 18.4881251),
    "BE1": (0.0527592647, 0.0623961527, 0.3294565926, 0.3785666),
    "BE2": (0.1003816068, 0.1175160265, 0.5503715277, 0.7190415),
    "B": (0.1626304541, 0.1909083977, 0.9592676203, 5.8355406),
    "C": (0.0427527765, 0.0428083586, 0.9999027860, 69.3281439),
    "TOP": (0.2466654844, 0.2815298826, 1.0, 71.4747344),
}


def test_check_set_in_all_measures() -> None:
    solution = solve(check_unit(), first_passage=True)
    for name, (mean, end, once, occurrences) in CHECK_SET.items():
        row = solution.rows[name]
        assert row.mean_unavailability == pytest.approx(mean, abs=6e-11), name
        assert row.at_end == pytest.approx(end, abs=6e-11), name
        assert row.at_least_once == pytest.approx(once, abs=1.1e-10), name
        assert row.occurrences == pytest.approx(occurrences, rel=2e-9, abs=6e-8), name
    correct = solution.rows["correct output"]
    assert correct.mean_unavailability == pytest.approx(0.5030784347, abs=6e-11)
    assert correct.at_end == pytest.approx(0.4863145905, abs=6e-11)
    assert solution.availability == pytest.approx(1 - 0.2466654844, abs=6e-11)


def test_check_set_at_40_s() -> None:
    solution = solve(check_unit(mission_s=40.0), first_passage=True)
    assert solution.top.at_least_once == pytest.approx(0.5570164102, abs=6e-11)
    unit = check_unit(mission_s=40.0)
    rest = replace(unit, gates=(*unit.gates, Or("B or C", ("B", "C"))), top="B or C")
    assert solve(rest, first_passage=True).top.at_least_once == pytest.approx(
        0.5550448597, abs=6e-11
    )


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("count", {"IE1": 0.0217419796, "IE2": 0.1606285813, "TOP": 0.2490471515}),
        ("strict", {"IE1": 0.0187655536, "IE2": 0.1592660310, "TOP": 0.2451332897}),
    ],
)
def test_check_set_by_other_delay_rules(rule: Any, expected: dict[str, float]) -> None:
    solution = solve(check_unit(options=Options(dur_rule=rule)), names=list(expected))
    for name, mean in expected.items():
        assert solution.rows[name].mean_unavailability == pytest.approx(mean, abs=6e-11)


def test_check_set_with_other_readings_of_ie6() -> None:
    unit = check_unit()
    gates = (
        And("and", ("BE2", "l wrong")), And("both", ("BE2", "BE6")), Con("joint", 2, "both"),
    )  # fmt: skip
    rows = solve(replace(unit, gates=(*unit.gates, *gates)), names=["and", "joint"]).rows
    assert rows["and"].mean_unavailability == pytest.approx(0.0114082749, abs=6e-11)
    assert rows["joint"].mean_unavailability == pytest.approx(0.0113852361, abs=6e-11)


@pytest.mark.parametrize(("restart", "top"), [("first", 0.2465681903), ("row1", 0.2466126760)])
def test_check_set_with_other_restarts(restart: str, top: float) -> None:
    solution = solve(check_unit(restart=restart), names=[])
    assert solution.top.mean_unavailability == pytest.approx(top, abs=6e-11)


# --- the paper --------------------------------------------------------------------------------


def test_urban_table() -> None:
    solution = solve(localisation_unit(), first_passage=True)
    fitted = {"IE1": 8.34e-11, "IE6": 1.63e-8, "IE5": 1.57e-4, "correct output": 0.9388}
    for name, mean in fitted.items():
        # The single-GNSS row starts correct, hence not quite its stationary share.
        tolerance = 1e-9 if name != "correct output" else 1e-5
        assert solution.rows[name].mean_unavailability == pytest.approx(mean, rel=tolerance)
    assert solution.rows["IE2"].mean_unavailability == pytest.approx(3.8599143e-6, abs=6e-14)
    measures = {
        "A": (5.9354675e-6, 2.9891698e-6, 6.0599466e-6, 6.0599468e-6),
        "B": (7.7955453e-6, 3.8599926e-6, 8.1514077e-6, 8.1669742e-6),
        "C": (1.5726635e-4, 1.5701615e-4, 0.3222799, 0.3887700),
        "TOP": (1.7099638e-4, 1.6386482e-4, 0.3222906, 0.3887831),
    }
    for name, (end, mean, once, occurrences) in measures.items():
        row = solution.rows[name]
        assert row.at_end == pytest.approx(end, rel=4e-8), name
        assert row.mean_unavailability == pytest.approx(mean, rel=4e-8), name
        assert row.at_least_once == pytest.approx(once, rel=2e-7), name
        assert row.occurrences == pytest.approx(occurrences, rel=2e-7), name
    assert 100 * solution.availability == pytest.approx(99.9836, abs=5e-5)
    assert solution.rows["IE5"].mean_duration_s == pytest.approx(1.454, abs=5e-4)


def test_urban_top_as_printed_with_k_2_and_l_6() -> None:
    solution = solve(localisation_unit(k=2, l=6), names=["TOP"])
    assert solution.top.mean_unavailability == pytest.approx(1.65e-2, rel=3e-3)


def test_ie1_without_antenna_and_receiver_failures() -> None:
    perfect = {"antenna": 0.0, "receiver": 0.0, "ecs": 2e-6, "fusion": 6.06e-6}
    row = solve(localisation_unit(rates=perfect), names=["IE1"]).rows["IE1"]
    assert row.mean_unavailability == pytest.approx(7.818e-11, rel=1e-4)


@pytest.mark.parametrize(
    ("component", "point", "integral", "epochs"),
    [
        ("ecs", 1.958904113459721e-6, 9.862539367777e-7, 9.865260062686e-7),
        ("fusion", 5.935467498451149e-6, 2.988345412215681e-6, 2.989169781111e-6),
    ],
)
def test_hardware_to_all_digits(
    component: str, point: float, integral: float, epochs: float
) -> None:
    unit = localisation_unit()
    row = {"ecs": "BE2", "fusion": "BE1"}[component]
    solved = solve(unit, names=[row]).rows[row]
    assert solved.at_end == pytest.approx(point, rel=1e-12)
    assert solved.mean_unavailability == pytest.approx(epochs, rel=1e-12)
    held = replace(unit, options=Options(mean_rule="integral"))
    assert solve(held, names=[row]).rows[row].mean_unavailability == pytest.approx(
        integral, rel=1e-12
    )


def test_fusion_by_the_left_rule() -> None:
    unit = localisation_unit(options=Options(mean_rule="left"))
    assert solve(unit, names=["BE1"]).rows["BE1"].mean_unavailability == pytest.approx(
        2.98752104e-6, abs=6e-15
    )


# --- other exact figures ----------------------------------------------------------------------


def micro(gates: tuple[Any, ...], **changes: Any) -> HybridFaultTree:
    """The micro model: two components given by what they do in an epoch."""

    def rates(fail: float, repair: float) -> tuple[float, float]:
        s = -np.log1p(-(fail + repair))
        return s * fail / (fail + repair), s * repair / (fail + repair)

    settings: dict[str, Any] = {
        "components": (Component("a", *rates(0.02, 0.3)), Component("b", *rates(0.05, 0.4))),
        "events": (Failed("a failed", "a"), Failed("b failed", "b")),
        "top": "t",
    }
    return HybridFaultTree(
        "micro", 3600.0, 50 * 3600.0, sources=(), gates=gates, **{**settings, **changes}
    )


DUR_OR_CON = (
    Dur("long", 2 * 3600.0, "a failed"), Con("twice", 2, "b failed"), Or("t", ("long", "twice")),
)  # fmt: skip


def test_micro_model() -> None:
    solution = solve(micro(DUR_OR_CON), first_passage=True)
    rows = solution.rows
    assert rows["long"].mean_unavailability == pytest.approx(0.0280984375, abs=6e-11)
    assert rows["twice"].mean_unavailability == pytest.approx(0.0637037037, abs=6e-11)
    assert rows["t"].mean_unavailability == pytest.approx(0.0899429435, abs=6e-11)
    assert rows["t"].at_least_once == pytest.approx(0.8546483909, abs=6e-11)
    assert rows["t"].occurrences == pytest.approx(1.6797117580, abs=6e-11)


def test_first_run_of_twelve_to_fifteen_digits() -> None:
    model = HybridFaultTree(
        "run", 1.0, 3600.0, (),
        (MarkovSource("s", ("x", "y"), ((0.999, 0.001), (0.95, 0.05)), (1.0, 0.0)),),
        (InState("on", "s", ("y",)),), (Con("run", 12, "on"),), "run",
    )  # fmt: skip
    once = solve(model, first_passage=True).top.at_least_once
    assert once == pytest.approx(1.75059921070166569e-14, rel=1e-12)


def test_not_moves_inwards() -> None:
    model = micro((And("both", ("a failed", "b failed")), Not("t", "both")))
    row = solve(model).top
    assert row.method == "modules"
    both = solve(model).rows["both"].mean_unavailability
    assert row.mean_unavailability == pytest.approx(1.0 - both, rel=1e-14)


def test_parts_that_are_nearly_certain_take_false_as_a_class() -> None:
    gates = (Not("a up", "a failed"), Not("b up", "b failed"), Or("t", ("a up", "b up")))
    rare = (Component("a", 1e-9, 0.3), Component("b", 0.05, 0.4))
    model = replace(micro(gates, components=rare), mission_s=4 * 3600.0)
    row = solve(model).top
    assert (row.method, row.states) == ("modules", 2)
    # A rise from both failed; the wanted digits are below 1 ulp of the parts' 1 - p.
    assert row.occurrences == pytest.approx(by_paths(model)["t"].occurrences, rel=1e-12)
    assert 0.0 < row.occurrences < 1e-9


def test_stages_hold_up_to_their_end() -> None:
    sure, never = ((0.0, 1.0), (0.0, 1.0)), ((1.0, 0.0), (1.0, 0.0))
    source = MarkovSource(
        "s", ("x", "y"), never, (1.0, 0.0),
        stages=(Stage("a", 2.0, never), Stage("b", 3.0, sure), Stage("c", 1.0, never)),
    )  # fmt: skip
    model = HybridFaultTree(
        "profile", 1.0, 8.0, (), (source,), (InState("on", "s", ("y",)),), (), "on"
    )
    curve = solve(model, curve=True).curves["on"]
    assert curve.tolist() == [0, 0, 0, 1, 1, 1, 0, 0, 0]


def test_delays_longer_than_the_mission() -> None:
    gates = (Dur("never", 1e12, "a failed"), Pand("t", ("a failed", "never")))
    for model in (micro(gates), micro(gates[:1], top="never")):
        row = solve(model, first_passage=True).top
        assert (row.mean_unavailability, row.at_least_once, row.occurrences) == (0.0, 0.0, 0.0)
        assert row.mean_duration_s is None


def test_a_refusal_names_the_gates_and_the_way_out() -> None:
    gates = (
        Dur("long a", 900 * 3600.0, "a failed"), Dur("long b", 900 * 3600.0, "b failed"),
        Pand("t", ("long a", "long b")),
    )  # fmt: skip
    with pytest.raises(InputError) as refused:
        solve(replace(micro(gates), mission_s=2000 * 3600.0), max_states=20_000)
    text = str(refused.value)
    for words in ("long a (902 values)", "long b (902 values)", "simulation", "max_states"):
        assert words in text


def test_missions_too_long_to_keep() -> None:
    with pytest.raises(InputError, match="too many epochs"):
        solve(replace(micro(DUR_OR_CON), mission_s=1e8 * 3600.0), curve=True)


def test_unknown_names_and_models_that_mean_nothing() -> None:
    with pytest.raises(InputError, match="no event or gate"):
        solve(micro(DUR_OR_CON), names=["nobody"])
    with pytest.raises(ModelError):
        solve(micro((Or("t", ("t",)),)))


def test_summary_and_plain_values() -> None:
    solution = solve(micro(DUR_OR_CON))
    assert solution.summary().loc["t", "method"] == "modules"
    assert {row["name"] for row in solution.to_dict()["rows"]} == set(solution.rows)
    assert solution.occurrences_per_h("t") == pytest.approx(1.6797117580 / 50, rel=1e-9)


# --- 40 digits --------------------------------------------------------------------------------

RARE_ROWS = ((0.9998, 1e-4, 1e-4), (0.999, 5e-4, 5e-4), (0.99, 2e-3, 8e-3))
EPOCHS = 16


def rare_unit() -> HybridFaultTree:
    """Rows from 1e-7 down to 1e-30: ECS, a signal, and all kinds of gates with memory."""
    return HybridFaultTree(
        "rare", 1.0, float(EPOCHS), (Component("ecs", 2e-6, 1 / 24),),
        (MarkovSource("s", ("good", "wrong", "missing"), RARE_ROWS, (1.0, 0.0, 0.0)),),
        (Failed("e", "ecs"), InState("w", "s", ("wrong",)), InState("m", "s", ("missing",))),
        (
            CausalAnd("joint", 3.0, ("e", "m")), Con("run", 9, "w"), Con("l", 2, "w"),
            Pand("order", ("e", "l")), And("both", ("e", "run")),
            Or("top", ("joint", "run", "order")),
        ), "top",
    )  # fmt: skip


def in_40_digits() -> dict[str, tuple[Any, Any, Any, Any]]:
    """Point, mean, F, W by run lengths without end, in 40 digits."""
    mpf = mpmath.mpf
    alpha, mu = mpf(2e-6), mpf(1 / 24)
    s = alpha + mu
    moved = -mpmath.expm1(-s / 3600)
    fail, repair = alpha / s * moved, mu / s * moved
    hardware = ((1 - fail, fail), (repair, 1 - repair))
    rows = []
    for row in RARE_ROWS:
        _, *rest = (mpf(p) for p in row)
        rows.append([1 - sum(rest), *rest])

    def truth(e: int, _o: int, run_e: int, run_w: int, run_j: int) -> dict[str, bool]:
        joint, run = run_j >= 4, run_w >= 9
        # The run of "l" began at the second epoch of the run of "w".
        order = e == 1 and run_w >= 2 and run_e >= run_w - 1
        return {
            "joint": joint, "run": run, "order": order, "both": e == 1 and run,
            "top": joint or run or order,
        }  # fmt: skip

    law = {((0, 0, 0, 0, 0), frozenset()): mpf(1)}
    names = list(truth(0, 0, 0, 0, 0))
    mean, rise, once = ({n: mpf(0) for n in names} for _ in range(3))
    for _ in range(EPOCHS):
        new: dict[Any, Any] = defaultdict(lambda: mpf(0))
        for ((e, o, run_e, run_w, run_j), hit), p in law.items():
            before = truth(e, o, run_e, run_w, run_j)
            for e2 in (0, 1):
                for o2 in (0, 1, 2):
                    q = p * hardware[e][e2] * rows[o][o2]
                    state = (
                        e2, o2, run_e + 1 if e2 else 0, run_w + 1 if o2 == 1 else 0,
                        run_j + 1 if e2 and o2 == 2 else 0,
                    )  # fmt: skip
                    now = truth(*state)
                    for n in names:
                        if now[n]:
                            mean[n] += q / EPOCHS
                            rise[n] += q if not before[n] else 0
                            once[n] += q if n not in hit else 0
                    new[state, hit | {n for n in names if now[n]}] += q
        law = new
    end = {n: sum((p for (s_, _), p in law.items() if truth(*s_)[n]), mpf(0)) for n in names}
    return {n: (end[n], mean[n], once[n], rise[n]) for n in names}


def test_against_40_digits_down_to_1e_30() -> None:
    with mpmath.workdps(40):
        exact = in_40_digits()
        rows = solve(rare_unit(), first_passage=True).rows
        assert min(exact[n][0] for n in exact) < 1e-38
        for name, values in exact.items():
            row = rows[name]
            got = (row.at_end, row.mean_unavailability, row.at_least_once, row.occurrences)
            for mine, other in zip(got, values, strict=True):
                assert mine is not None
                assert abs(mpmath.mpf(mine) / other - 1) < 1e-12, name


def test_windows_and_the_whole_product_agree_to_1e_11() -> None:
    profile = (Stage("all along", 600.0, URBAN_EXACT),) * 2
    short = localisation_unit(mission_s=600.0)
    names = ["IE1", "IE2", "IE5", "IE6", "B", "C", "TOP"]
    windows = solve(short, names=names)
    whole = solve(localisation_unit(mission_s=600.0, stages=profile), names=names)
    assert windows.rows["C"].method == "window"
    for name in names:
        a, b = windows.rows[name], whole.rows[name]
        assert a.at_end == pytest.approx(b.at_end, rel=1e-11)
        assert a.mean_unavailability == pytest.approx(b.mean_unavailability, rel=1e-11)
        assert a.occurrences == pytest.approx(b.occurrences, rel=1e-11)
