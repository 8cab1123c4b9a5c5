"""What is wrong with the data, how serious it is, and what cures it."""

from __future__ import annotations

from sbas.dependability.questions import Dependability
from sbas.fusion.causal_analysis import CausalAnalysis
from sbas.integrity.results import Evaluation
from sbas.reporting.content import Cell, Section, Tone, table

_TONES: dict[str, Tone] = {"error": "bad", "warning": "warning", "info": ""}


def section(evaluation: Evaluation | Dependability | CausalAnalysis) -> Section:
    """Every finding of reader, input check and evaluation, or of the check of models."""
    rows: list[tuple[Cell | str, ...]] = [
        (
            f.code, Cell(f.severity, _TONES[f.severity]), f.message,
            Cell("; ".join(part for part in (f.where, f.evidence) if part), breaks=True), f.cure,
        )
        for f in evaluation.findings
    ]  # fmt: skip
    if not rows:
        return Section("findings", "Findings", paragraphs=("Nothing was found in the input.",))
    return Section(
        "findings",
        "Findings",
        paragraphs=("Nothing is repaired silently: each conversion and defect is listed.",),
        tables=(table("Findings", "Code|Severity|Finding|Evidence|Cure", rows),),
    )
