"""Whether an independent simulation agrees with the exact solution, figure by figure."""

from __future__ import annotations

from sbas.dependability.questions import Dependability
from sbas.dependability.simulation.agreement import Agreement
from sbas.numerals import count, number
from sbas.reporting.content import Cell, Section, Table, Tone, table

_TONES: dict[str, Tone] = {"agrees": "good", "disagrees": "bad", "not tested": ""}
_MEASURES = {"mean": "mean", "first_passage": "at least once"}


def section(answer: Dependability) -> Section:
    """A table an environment, or that nobody asked for a simulation."""
    return Section(
        "simulation",
        "Simulation",
        paragraphs=()
        if answer.agreements
        else ("No simulation was asked for (--check simulate): the exact solution stands alone.",),
        tables=tuple(_table(name, found) for name, found in answer.agreements.items()),
    )


def _table(environment: str, found: Agreement) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (
            c.name, _MEASURES[c.measure], number(c.exact, 5), number(c.simulated, 5),
            number(c.standard_error, 2), "-" if c.z is None else f"{c.z:+.2f}", count(c.hits),
            Cell(c.verdict, _TONES[c.verdict]),
        )
        for c in found.comparisons
    ]  # fmt: skip
    again = ", repeated after a first disagreement" if found.repeated else ""
    return table(
        f"{environment}: {count(found.histories)} histories{again}",
        "Name|Figure|#Exact [1]|#Simulated [1]|#Standard error [1]|#z|#Histories with it|Verdict",
        rows,
        f"z: (simulated − exact) / standard error; agrees up to |z| = {found.limit:.2f}, at which "
        "right figures fail once in 1000 checks. Not tested: too few histories for z.",
    )
