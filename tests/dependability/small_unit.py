"""A small localisation unit with the paper's case names, quick to solve, for tests of output."""

from __future__ import annotations

from sbas.dependability.tree.model import (
    Component,
    Con,
    Dur,
    Failed,
    HybridFaultTree,
    InState,
    MarkovSource,
    Or,
    Pand,
)

ROWS = ((0.9, 0.08, 0.02), (0.5, 0.5, 0.0), (0.3, 0.0, 0.7))


def small_unit(
    *, hazard_per_h: float = 1e-3, runs: bool = True, mission_s: float = 60.0
) -> HybridFaultTree:
    """Case A: no output for 5 s. Case C: the monitor fails and, with `runs`, 3 wrong epochs."""
    wrong = ("Monitor", "Run") if runs else ("Monitor",)
    return HybridFaultTree(
        name="small unit",
        step_s=1.0,
        mission_s=mission_s,
        components=(Component("monitor", hazard_per_h, source="claimed by its maker"),),
        sources=(
            MarkovSource(
                "gnss", ("correct", "wrong", "missing"), ROWS, (1.0, 0.0, 0.0), source="made up"
            ),
        ),
        events=(
            Failed("Monitor", "monitor"),
            InState("Wrong", "gnss", ("wrong",)),
            InState("Missing", "gnss", ("missing",)),
        ),
        gates=(
            Dur("Silent", 5.0, "Missing"),
            Con("Run", 3, "Wrong"),
            Pand("Unaware", ("Monitor", "Run")),
            Or("Case A", ("Silent",)),
            Or("Case C", ("Unaware",) if runs else wrong),
            Or("TOP", ("Case A", "Case C", "Run")),
        ),
        top="TOP",
        cases=("Case A", "Case C"),
        notes=("the rows are made up",),
    )
