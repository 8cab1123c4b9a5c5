"""The system of Nguyen, Beugin, Marais 2013 with any figures, for tests and benchmarks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sbas.dependability.tree.model import (
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    HybridFaultTree,
    InState,
    MarkovSource,
    Options,
    Or,
    Pand,
)

Rows = tuple[tuple[float, ...], ...]

URBAN: Rows = (
    (0.9549983983, 0.0383925705, 0.0066090312),
    (0.6816736700, 0.3123126308, 0.0060136991),
    (0.7455557479, 0.0420252194, 0.2124190327),
)
"""The calibrated chain as printed."""

CHECK_ROWS: Rows = (
    (0.7794117647, 0.1580882353, 0.0625),
    (0.36, 0.55, 0.09),
    (0.2823529412, 0.1176470588, 0.6),
)

PAPER_RATES = {"antenna": 4e-6, "receiver": 4.08e-6, "ecs": 2e-6, "fusion": 6.06e-6}
CHECK_RATES = {"antenna": 0.5, "receiver": 0.7, "ecs": 0.8, "fusion": 0.4}


def default_rows(pi2: float, a: float, pi3: float, b: float) -> Rows:
    """Chain with stationary pi2, pi3 and stays a, b, moves in proportion to the other masses."""
    pi1 = 1.0 - pi2 - pi3
    p23, p32 = (1 - a) * pi3 / (pi1 + pi3), (1 - b) * pi2 / (pi1 + pi2)
    p12 = (pi2 * (1 - a) - pi3 * p32) / pi1
    p13 = (pi3 * (1 - b) - pi2 * p23) / pi1
    return (
        (1 - p12 - p13, p12, p13),
        (1 - a - p23, a, p23),
        (1 - b - p32, p32, b),
    )


URBAN_EXACT = default_rows(
    0.0529179421875292, 0.31231263084320343, 0.008282057812470829, 0.21241903271273882
)
CHECK_EXACT = default_rows(0.25, 0.55, 0.15, 0.6)


def localisation_unit(
    rows: Rows = URBAN_EXACT,
    *,
    rates: Mapping[str, float] = PAPER_RATES,
    repair_rate_per_h: float = 1 / 24,
    t1_s: float = 3.0,
    t2_s: float = 60.0,
    k: int = 6,
    l: int = 2,  # noqa: E741
    first_fix_s: float = 180.0,
    mission_s: float = 3600.0,
    step_s: float = 1.0,
    options: Options | None = None,
    **receiver: Any,
) -> HybridFaultTree:
    """Antenna, receiver, ECS and fusion; cases A, B, C; rows IE1 to IE6."""
    source = MarkovSource(
        "output",
        ("correct", "wrong", "missing"),
        rows,
        (1.0, 0.0, 0.0),
        guard=("antenna", "receiver"),
        first_fix_s=first_fix_s,
        **receiver,
    )
    return HybridFaultTree(
        "localisation unit",
        step_s,
        mission_s,
        tuple(Component(n, r, repair_rate_per_h) for n, r in rates.items()),
        (source,),
        (
            Failed("BE1", "fusion"),
            Failed("BE2", "ecs"),
            Failed("BE3", "antenna"),
            Failed("BE4", "receiver"),
            InState("BE5", "output", ("missing",)),
            InState("BE6", "output", ("wrong",)),
            InState("IE3", "output", ("missing", "down")),
            InState("correct output", "output", ("correct",)),
        ),
        (
            Or("IE4", ("BE3", "BE4")),
            CausalAnd("IE1", t1_s, ("BE2", "IE3")),
            Dur("IE2", t2_s, "IE3"),
            Con("IE5", k, "BE6"),
            Con("l wrong", l, "BE6"),
            Pand("IE6", ("BE2", "l wrong")),
            Or("A", ("BE1",)),
            Or("B", ("IE1", "IE2")),
            Or("C", ("IE5", "IE6")),
            Or("TOP", ("A", "B", "C")),
        ),
        "TOP",
        ("A", "B", "C"),
        options or Options(),
    )


def check_unit(**changes: Any) -> HybridFaultTree:
    """The check set in which nothing is rare."""
    figures: dict[str, Any] = {
        "rows": CHECK_EXACT, "rates": CHECK_RATES, "repair_rate_per_h": 6.0, "t2_s": 10.0,
        "k": 4, "first_fix_s": 60.0,
    }  # fmt: skip
    return localisation_unit(**{**figures, **changes})
