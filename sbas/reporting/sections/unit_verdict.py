"""What the model of a localisation unit says, first and in words: modelled, never demonstrated."""

from __future__ import annotations

from collections.abc import Mapping

from sbas.dependability.analysis.hazard_verdict import hazard_verdict
from sbas.dependability.exact.solution import Solution
from sbas.dependability.questions import Dependability
from sbas.dependability.tree.model import HybridFaultTree
from sbas.integrity.sil import sil_band
from sbas.numerals import hours, number, share, upward
from sbas.reporting.content import Callout, Cell, Section, Table, Tile, Tone, table

SAFETY_CASE = "Case C"
"""Wrong and not recognised, in the models of this package; what a tolerable rate is about."""

NO_RATE = "never true in this model"


def section(answer: Dependability) -> Section:
    """Callouts, the worst figures as tiles, and a table that compares the environments."""
    solutions = answer.solutions
    tables = (_comparison(answer),) if len(solutions) > 1 else ()
    return Section(
        "verdict",
        "Verdict",
        (_modelled(answer), *_simulated(answer), *_remarks(answer)),
        _tiles(solutions),
        tables=tables,
    )


def safety_event(model: HybridFaultTree) -> str:
    """The event whose rate is compared with a tolerable hazard rate: case C, else the top."""
    return SAFETY_CASE if SAFETY_CASE in model.cases else model.top


def hazard_rate_per_h(solution: Solution) -> float:
    """Occurrences of the safety event [1/h]; one that is there at the start counts."""
    return hazard_verdict(solution, safety_event(solution.model)).rate_per_h


def rate_words(rate: float) -> str:
    """Occurrences per hour, not rounded down; a rate of zero is said to be the model's doing."""
    return f"begins {upward(rate)} times per hour" if rate > 0 else f"is {NO_RATE}"


def band_words(rate_per_h: float) -> str:
    """The SIL band that holds a rate; none for a rate of zero, which no band describes."""
    if rate_per_h == 0:
        return NO_RATE
    level = sil_band(rate_per_h)
    if level is None:
        return "no SIL: 10⁻⁵ per hour or more"
    return f"band of SIL {level}"


def _modelled(answer: Dependability) -> Callout:
    solutions = answer.solutions
    rates = {name: hazard_rate_per_h(s) for name, s in solutions.items()}
    worst = max(rates, key=rates.__getitem__)
    solution = solutions[worst]
    event = safety_event(solution.model)
    several = len(solutions) > 1
    among = f", worst of {len(solutions)} environments ({worst})" if several else ""
    lines = []
    if event == SAFETY_CASE:
        lines.append(
            f"{event} is the safety case: a position that is wrong and not recognised as such. "
            f"It {rate_words(rates[worst])} in the mission of "
            f"{hours(solution.model.mission_s / 3600)}{among}; {band_words(rates[worst])}."
        )
    else:
        lines.append(
            f"The model names no {SAFETY_CASE}; judged is {event}. It "
            f"{rate_words(rates[worst])}{among}; {band_words(rates[worst])}."
        )
    for name, each in solutions.items():
        prefix = f"{name}: " if several else ""
        lines.append(
            f"{prefix}{each.model.top} is true in a mean share of "
            f"{number(each.top.mean_unavailability)} of the mission: availability "
            f"{share(each.availability)}."
        )
    lines.append(
        "These figures are exact for the model. They are modelled, not demonstrated: they hold as "
        "far as its rates, its receiver and its independence do, and no count stands behind a SIL "
        "band. Section Model lists what each number rests on."
    )
    # Never green: a model cannot demonstrate.
    tone: Tone = "bad" if sil_band(rates[worst]) is None else "warning"
    title = f"MODELLED: {event} {rate_words(rates[worst])}"
    return Callout(tone, title, tuple(lines))


def _simulated(answer: Dependability) -> tuple[Callout, ...]:
    apart = [name for name, found in answer.agreements.items() if not found.agrees]
    if not apart:
        return ()
    return (
        Callout(
            "bad",
            "The simulation does not confirm the exact solution",
            (f"In {', '.join(apart)}: figures disagree, or nothing could be tested. Do not use "
             "these results; see section Simulation.",),
        ),
    )  # fmt: skip


def _remarks(answer: Dependability) -> tuple[Callout, ...]:
    notes = dict.fromkeys(n for s in answer.solutions.values() for n in s.model.notes)
    serious = [f for f in answer.findings if f.severity != "info"]
    found = []
    if notes:
        found.append(Callout("claimed", "What the model takes for granted", tuple(notes)))
    if serious:
        lines = tuple(f"{f.message}: {f.evidence}" if f.evidence else f.message for f in serious)
        found.append(
            Callout(
                "warning",
                f"{len(serious)} finding{'s' * (len(serious) > 1)} about model and input",
                lines,
            )
        )  # fmt: skip
    return tuple(found)


def _tiles(solutions: Mapping[str, Solution]) -> tuple[Tile, ...]:
    """Each figure of the environment in which it is worst."""
    means = {name: s.top.mean_unavailability for name, s in solutions.items()}
    rates = {name: hazard_rate_per_h(s) for name, s in solutions.items()}
    least, worst = (max(v, key=v.__getitem__) for v in (means, rates))
    several = len(solutions) > 1
    missions = [s.model.mission_s / 3600 for s in solutions.values()]
    steps = dict.fromkeys(f"{s.model.step_s:g} s" for s in solutions.values())
    event = safety_event(solutions[worst].model)
    return (
        Tile(f"{solutions[least].model.top}, mean unavailability", number(means[least]),
             f"largest: {least}" if several else "share of the mission"),
        Tile("availability", share(solutions[least].availability),
             f"least: {least}" if several else "modelled, rounded down"),
        Tile(f"{event} per hour", upward(rates[worst]),
             (f"worst: {worst}; " if several else "") + band_words(rates[worst])),
        Tile("mission", hours(min(missions)) + (
            f" to {hours(max(missions))}" if min(missions) < max(missions) else ""),
             f"in epochs of {', '.join(steps)}"),
    )  # fmt: skip


def _comparison(answer: Dependability) -> Table:
    rows: list[tuple[Cell | str, ...]] = []
    for name, solution in answer.solutions.items():
        event = safety_event(solution.model)
        rate = hazard_rate_per_h(solution)
        once = solution.rows[event].at_least_once
        rows.append(
            (
                name, number(solution.top.mean_unavailability), share(solution.availability),
                event, number(solution.rows[event].mean_unavailability),
                "not asked" if once is None else number(once), upward(rate), band_words(rate),
                Cell("modelled", "modelled"),
            )
        )  # fmt: skip
    return table(
        "Environments compared",
        "Environment|#Top: mean [1]|#Availability|Judged|#Its mean [1]|#At least once [1]|"
        "#Times per hour [1/h]|SIL band|Evidence",
        rows,
        "A mean of an hour hides how often: compare times per hour with a tolerable hazard rate, "
        "not the mean. Bands: EN 50129, table A.1; IEC 61508-1, 7.6.2.",
    )
