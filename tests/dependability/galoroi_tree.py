"""The paper's tree (Nguyen, Beugin, Marais 2013, Fig. 2), with any numbers, for tests."""

from __future__ import annotations

from typing import Any

from sbas.dependability.tree.model import (
    And,
    CausalAnd,
    Component,
    Con,
    Dur,
    Failed,
    Gate,
    HybridFaultTree,
    InState,
    MarkovSource,
    Options,
    Or,
    Pand,
    Undeveloped,
)

STAY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def galoroi_tree(
    *,
    rates_per_h: tuple[float, float, float, float] = (4e-6, 4.08e-6, 2e-6, 6.06e-6),
    repair_per_h: float = 1 / 24,
    rows: Any = STAY,
    restart: Any = "stationary",
    t1_s: float = 3.0,
    t2_s: float = 60.0,
    k: int = 6,
    run: int = 2,
    first_fix_s: float = 180.0,
    ie6: str = "pand",
    mission_s: float = 3600.0,
    **options: Any,
) -> HybridFaultTree:
    """Rates: antenna, receiver, ECS, fusion; `run` is l, `ie6` "pand", "and" or "joint"."""
    names = ("antenna", "receiver", "ecs", "fusion")
    components = tuple(
        Component(name, rate, repair_per_h) for name, rate in zip(names, rates_per_h, strict=True)
    )
    gnss = MarkovSource(
        "gnss", ("correct", "wrong", "missing"), rows, (1.0, 0.0, 0.0), ("antenna", "receiver"),
        first_fix_s=first_fix_s, restart=restart,
    )  # fmt: skip
    kinds: dict[str, tuple[Gate, ...]] = {
        "pand": (Con("RUN", run, "BE6"), Pand("IE6", ("BE2", "RUN"))),
        "and": (Con("RUN", run, "BE6"), And("IE6", ("BE2", "RUN"))),
        "joint": (And("BOTH", ("BE2", "BE6")), Con("IE6", run, "BOTH")),
    }
    return HybridFaultTree(
        name="unit",
        step_s=1.0,
        mission_s=mission_s,
        components=components,
        sources=(gnss,),
        events=(
            Failed("BE1", "fusion"),
            Failed("BE2", "ecs"),
            Failed("BE3", "antenna"),
            Failed("BE4", "receiver"),
            InState("BE5", "gnss", ("missing", "down")),
            InState("BE6", "gnss", ("wrong",)),
            Undeveloped("UE"),
        ),
        gates=(
            Or("IE4", ("BE3", "BE4")),
            Or("IE3", ("BE5", "IE4")),
            CausalAnd("IE1", t1_s, ("BE2", "IE3")),
            Dur("IE2", t2_s, "IE3"),
            Con("IE5", k, "BE6"),
            *kinds[ie6],
            Or("A", ("BE1", "UE")),
            Or("B", ("IE1", "IE2")),
            Or("C", ("IE5", "IE6")),
            Or("TOP", ("A", "B", "C")),
        ),
        top="TOP",
        cases=("A", "B", "C"),
        options=Options(**options),
    )
