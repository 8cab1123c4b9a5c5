"""The hours that the figures rest on, and why others do not count."""

from __future__ import annotations

from sbas.integrity.results import Evaluation
from sbas.numerals import count, number
from sbas.reporting.content import Section, table


def section(evaluation: Evaluation) -> Section:
    """Recorded time, and what is taken from it for each kind of figure."""
    hours = evaluation.exposure
    gaps = len(evaluation.input.survey.gaps)
    rows = [
        (
            "recorded",
            hours.recorded_hours,
            f"{count(evaluation.epochs)} epochs, each its step, at most the interval",
        ),
        ("in gaps", hours.gap_hours, f"gaps: {count(gaps)}; not recorded, part of no rate"),
        ("without error", hours.without_error_hours, "no fix, or no truth at the epoch"),
        ("without level", hours.without_level_hours, "HPL missing, invalid or outside SBAS mode"),
        ("with error", hours.error_hours, "exposure of HPE ≥ AL"),
        (
            "judged",
            hours.judged_hours,
            "with error and level; a rate takes off its events and the merge time after each",
        ),
    ]
    return Section(
        "exposure",
        "Exposure",
        paragraphs=("A rate is events per hour of exposure: time in which one could be seen.",),
        tables=(
            table(
                "Hours and their reasons",
                "Time|#Hours [h]|Reason",
                [(name, number(value, 6), why) for name, value, why in rows],
            ),
        ),
    )
