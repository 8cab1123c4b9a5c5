"""Every event and gate of one environment, and the tree with its numbers."""

from __future__ import annotations

from collections.abc import Iterator

from sbas.dependability.exact.solution import Solution
from sbas.dependability.questions import Dependability
from sbas.dependability.tree.model import Event, Gate
from sbas.numerals import number
from sbas.plots import fault_tree_picture, probability_over_mission
from sbas.reporting.content import Cell, Picture, Section, Table, table
from sbas.reporting.drawn import drawn


def sections(answer: Dependability) -> Iterator[Section]:
    """A section an environment; the numbers in the keys keep the anchors apart."""
    several = len(answer.solutions) > 1
    for i, (name, solution) in enumerate(answer.solutions.items()):
        yield Section(
            f"measures-{i}",
            f"Measures: {name}" if several else "Measures",
            tables=(_measures(solution),),
            pictures=_pictures(solution, f"{i}"),
        )


def _measures(solution: Solution) -> Table:
    model = solution.model
    things: tuple[Event | Gate, ...] = (*reversed(model.gates), *model.events)
    order = dict.fromkeys((model.top, *model.cases, *(thing.name for thing in things)))
    kinds = {gate.name: fault_tree_picture.gate_label(gate) for gate in model.gates}
    rows: list[tuple[Cell | str, ...]] = []
    for name in order:
        row = solution.rows.get(name)
        if row is None:
            continue
        once, lasts = row.at_least_once, row.mean_duration_s
        rows.append(
            (
                name, kinds.get(name, "event"), number(row.mean_unavailability, 5),
                number(row.at_end, 5), "not asked" if once is None else number(once, 5),
                number(solution.occurrences_per_h(name), 5),
                "never true" if lasts is None else number(lasts),
            )
        )  # fmt: skip
    return table(
        "Events and gates",
        "Name|Kind|#Mean [1]|#At the end [1]|#At least once [1]|#Times per hour [1/h]|#Lasts [s]",
        rows,
        "Mean: expected share of the mission in which it is true (mean unavailability). At least "
        "once: probability to become true in the mission. Times per hour: expected onsets. Lasts: "
        "mean over times. The same event, four different figures: none stands for another.",
    )


def _pictures(solution: Solution, key: str) -> tuple[Picture, ...]:
    model = solution.model
    found = [
        drawn(
            f"tree-{key}", "Fault tree", fault_tree_picture.tree_sheet(model),
            lambda axes: fault_tree_picture.tree_picture(model, solution, ax=axes[0]),
            f"Fault tree of {model.name} with the mean unavailability of each event and gate.",
            "Follow the largest numbers from the top: they carry the failure. What an orange gate "
            "makes of its inputs depends on how long they last, not on their share alone.",
            wide=True,
        )
    ]  # fmt: skip
    if solution.curves:
        found.append(
            drawn(
                f"curve-{key}", "Over the mission", probability_over_mission.SHEET,
                lambda axes: probability_over_mission.probability_curve(solution, ax=axes[0]),
                "Probability of the top and the cases at each epoch of the mission, log scale.",
                "A curve that still climbs at the end makes the mean of a longer mission larger.",
            )
        )  # fmt: skip
    return tuple(found)
