"""The closed rows against figures that a product automaton and a 40 000-history simulation gave,
and against enumeration of every history of a short mission."""

from __future__ import annotations

from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from sbas.dependability.receiver.state_chain import stationary_law
from sbas.dependability.receiver.unit_numbers import UnitNumbers, unit_numbers
from sbas.dependability.receiver.window_rows import (
    UnitRows,
    hardware_curves,
    mean_over_mission,
    unit_rows,
)
from tests.dependability.galoroi_tree import galoroi_tree

# Reference page, 10.3: pi2 0.25, a 0.55, pi3 0.15, b 0.6 with the default split.
CHAIN = np.array([
    [0.6 - 0.1317647058823529 + 0.3111764705882353, 0.1580882352941176, 0.0625],
    [0.36, 0.55, 0.09],
    [0.2823529411764706, 0.1176470588235294, 0.6],
])  # fmt: skip
CHAIN[0, 0] = 1 - CHAIN[0, 1] - CHAIN[0, 2]
FREQUENT = {
    "rates_per_h": (0.5, 0.7, 0.8, 0.4),
    "repair_per_h": 6.0,
    "t2_s": 10.0,
    "k": 4,
    "first_fix_s": 60.0,
}


def rows_of(**changes: Any) -> UnitRows:
    numbers = unit_numbers(galoroi_tree(**{**FREQUENT, **changes}))
    return unit_rows(numbers, hardware_curves(numbers), CHAIN, stationary(CHAIN))


def stationary(chain: Any) -> Any:
    law = stationary_law(chain)
    assert isinstance(law, tuple)
    return np.array(law)


def test_every_row_of_the_frequent_failures() -> None:
    rows = rows_of()
    expected = {
        "ie1": 0.0198948915, "ie2": 0.1598464517, "ie5": 0.0347991524, "ie6": 0.0113802117,
        "be1": 0.0527592647, "be2": 0.1003816068, "top": 0.2466654844, "correct": 0.5030784347,
    }  # fmt: skip
    assert vars(rows) == pytest.approx(expected, abs=6e-11)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"dur_rule": "count"}, {"ie1": 0.0217419796, "ie2": 0.1606285813, "top": 0.2490471515}),
        ({"dur_rule": "strict"}, {"ie1": 0.0187655536, "ie2": 0.1592660310, "top": 0.2451332897}),
        ({"ie6": "and"}, {"ie6": 0.0114082749}),
        ({"ie6": "joint"}, {"ie6": 0.0113852361}),
        ({"restart": "first"}, {"top": 0.2465681903}),
        ({"restart": "row1"}, {"top": 0.2466126760}),
    ],
)
def test_variants_of_the_open_points(changes: dict[str, Any], expected: dict[str, float]) -> None:
    rows = vars(rows_of(**changes))
    assert {name: rows[name] for name in expected} == pytest.approx(expected, abs=6e-11)


def test_fusion_hardware_over_an_hour() -> None:
    rows = rows_of(rates_per_h=(0.5, 0.7, 2e-6, 6.06e-6), repair_per_h=1 / 24)
    assert rows.be1 == pytest.approx(2.989169781111e-6, rel=1e-12)
    assert rows.be2 == pytest.approx(9.865260062686e-7, rel=1e-12)
    left = rows_of(rates_per_h=(0.5, 0.7, 2e-6, 6.06e-6), repair_per_h=1 / 24, mean_rule="left")
    assert left.be1 == pytest.approx(2.98752104e-6, rel=1e-8)


def test_means() -> None:
    curve = np.array([1.0, 2.0, 4.0, 8.0])
    assert mean_over_mission(curve, "epochs") == 14 / 3
    assert mean_over_mission(curve, "left") == 7 / 3
    assert mean_over_mission(curve, "trapezoid") == 10.5 / 3


@pytest.mark.parametrize("ie6", ["pand", "pand_exclusive", "and", "joint"])
@pytest.mark.parametrize("wait", [0, 1, 2])
@pytest.mark.parametrize("restart", ["stationary", "first", (0.2, 0.5, 0.3)])
def test_all_histories_of_a_short_mission(ie6: str, wait: int, restart: Any) -> None:
    """Sum over every history of five epochs, gates evaluated by their definitions."""
    tree = galoroi_tree(
        rates_per_h=(600.0, 0.0, 900.0, 300.0), repair_per_h=1200.0, mission_s=4.0, t1_s=1.0,
        t2_s=2.0, k=3, run=2, first_fix_s=float(wait), restart=restart, rows=_plain(CHAIN),
        ie6=ie6.split("_")[0], pand_exclusive=ie6.endswith("exclusive"),
    )  # fmt: skip
    numbers = unit_numbers(tree)
    # One component guards: fewer histories.
    numbers = UnitNumbers(**{**vars(numbers), "guard": numbers.guard[:1]})
    pi = stationary(CHAIN)
    rows = unit_rows(numbers, hardware_curves(numbers), CHAIN, pi)
    expected = _enumerated(numbers, pi)
    found = {name: getattr(rows, name) for name in expected}
    assert found == pytest.approx(expected, rel=1e-12)


def _plain(chain: Any) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in chain.tolist())


def _enumerated(numbers: UnitNumbers, pi: Any) -> dict[str, float]:
    """Means of the rows by walking all histories of guard and output, and of the sensors."""
    n = numbers.epochs
    restart = numbers.source.restart
    named = {"stationary": pi, "first": np.eye(3)[0]}
    law = named[restart] if isinstance(restart, str) else np.array(restart)
    outputs = _outputs(numbers, law, n)
    sensors = {
        name: _hardware(component, numbers.step_s, n)
        for name, component in (("ecs", numbers.ecs), ("fusion", numbers.fusion))
    }
    total = dict.fromkeys(("ie1", "ie2", "ie5", "ie6", "top", "correct"), 0.0)
    for output, weight in outputs.items():
        wrong = [o == 1 for o in output]
        gone = [o >= 2 for o in output]
        ie5, ie2 = _run(wrong, numbers.k), _run(gone, numbers.d2)
        run_l = _run(wrong, numbers.l)
        total["ie2"] += weight * sum(ie2[1:]) / n
        total["ie5"] += weight * sum(ie5[1:]) / n
        total["correct"] += weight * sum(o == 0 for o in output[1:]) / n
        for ecs, ecs_weight in sensors["ecs"].items():
            both = weight * ecs_weight
            ie1 = _run([e and g for e, g in zip(ecs, gone, strict=True)], numbers.d1)
            ie6 = _ie6(numbers, ecs, wrong, run_l)
            total["ie1"] += both * sum(ie1[1:]) / n
            total["ie6"] += both * sum(ie6[1:]) / n
            signal = [any(x) for x in zip(ie1, ie2, ie5, ie6, strict=True)]
            for fusion, fusion_weight in sensors["fusion"].items():
                top = sum(a or b for a, b in zip(signal[1:], fusion[1:], strict=True))
                total["top"] += both * fusion_weight * top / n
    return total


def _ie6(numbers: UnitNumbers, ecs: Any, wrong: list[bool], run: list[bool]) -> list[bool]:
    if numbers.ie6 == "and":
        return [e and r for e, r in zip(ecs, run, strict=True)]
    if numbers.ie6 == "joint":
        return _run([e and w for e, w in zip(ecs, wrong, strict=True)], numbers.l)
    return _pand(ecs, run, numbers.ie6 == "pand_exclusive")


def _outputs(numbers: UnitNumbers, law: Any, n: int) -> dict[tuple[int, ...], float]:
    """Probabilities of outputs 0, 1, 2 (missing signals) and 3 (hardware or wait)."""
    component = numbers.guard[0]
    found: dict[tuple[int, ...], float] = {}
    for failed, weight in _hardware(component, numbers.step_s, n).items():
        paths: dict[tuple[int, ...], float] = {(0,): weight}
        left = 0
        for m in range(1, n + 1):
            grown: dict[tuple[int, ...], float] = {}
            if failed[m]:
                moves: Any = [(3, 1.0)]
                left = -1
            else:
                if left == -1:
                    left = numbers.wait
                elif left > 0:
                    left -= 1
                redraw = all(p[-1] == 3 for p in paths) and left == 0
                moves = [(3, 1.0)] if left > 0 else (list(enumerate(law)) if redraw else None)
            for path, p in paths.items():
                for state, q in moves or enumerate(CHAIN[path[-1]]):
                    if q:
                        key = (*path, state)
                        grown[key] = grown.get(key, 0.0) + p * q
            paths = grown
        for path, p in paths.items():
            found[path] = found.get(path, 0.0) + p
    return found


def _hardware(component: Any, step_s: float, n: int) -> dict[tuple[bool, ...], float]:
    total = component.failure_rate_per_h + component.repair_rate_per_h
    moved = -np.expm1(-total * step_s / 3600)
    fail, mend = (
        rate / total * moved for rate in (component.failure_rate_per_h, component.repair_rate_per_h)
    )
    found = {}
    for tail in product((False, True), repeat=n):
        path = (False, *tail)
        p = 1.0
        for before, after in pairwise(path):
            p *= (mend if not after else 1 - mend) if before else (fail if after else 1 - fail)
        found[path] = p
    return found


def _run(signal: list[bool], d: int) -> list[bool]:
    return [m + 1 >= d and all(signal[m - d + 1 : m + 1]) for m in range(len(signal))]


def _onset(signal: list[bool] | tuple[bool, ...], m: int) -> int:
    while m > 0 and signal[m - 1]:
        m -= 1
    return m


def _pand(x: Any, y: list[bool], exclusive: bool) -> list[bool]:
    out = []
    for m in range(len(y)):
        early = x[m] and y[m] and _onset(x, m) <= _onset(y, m) - exclusive
        out.append(bool(early))
    return out
