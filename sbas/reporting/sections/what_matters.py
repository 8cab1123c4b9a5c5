"""Which event or component the failure hangs on."""

from __future__ import annotations

import math

from sbas.dependability.analysis.importance import Importances
from sbas.estimate import Refusal
from sbas.numerals import number
from sbas.plots import importance_picture
from sbas.reporting.content import Cell, Section, table
from sbas.reporting.drawn import drawn

_MEASURES = {"mean": "mean unavailability", "at_end": "probability at the end"}


def section(importances: Importances | Refusal) -> Section:
    """A table of all measures, and their bars; or why there are none."""
    if isinstance(importances, Refusal):
        said = f"Not given: {importances.reason} (cure: {importances.cure})."
        return Section("importance", "Importance", paragraphs=(said,))
    rows: list[tuple[Cell | str, ...]] = [
        (
            row.name, row.kind, number(row.probability), _figure(row.birnbaum),
            _figure(row.criticality), _figure(row.diagnostic, "too large"), number(row.raw),
            number(row.rrw) if math.isfinite(row.rrw) else "infinite",
            _figure(row.fussell_vesely, "-"),
        )
        for row in importances.rows
    ]  # fmt: skip
    measure = _MEASURES[importances.measure]
    return Section(
        "importance",
        "Importance",
        tables=(
            table(
                f"For the {measure} of {importances.of}, P = {number(importances.probability)}",
                "Name|Kind|#p [1]|#Birnbaum B [1]|#Criticality p·B/P [1]|#Diagnostic [1]|#RAW [1]|"
                "#RRW [1]|#Fussell-Vesely [1]",
                rows,
                "Forced for all epochs: B is P with the event true throughout minus P with it "
                "false throughout. RAW: P with it true over P; RRW: P over P with it false. "
                "Diagnostic: share of P during which the event is true as well.",
                "Where gates count how long an event lasts, forcing it makes runs that it never "
                "makes of itself: a criticality above 1 is no share of P. There the diagnostic "
                "share and 1 − 1/RRW tell.",
            ),
        ),
        pictures=(
            drawn(
                "importance", "What the failure hangs on",
                importance_picture.importance_sheet(importances),
                lambda axes: importance_picture.importance_bars(importances, ax=axes[0]),
                f"Criticality of each basic event and component for {importances.of}.",
                "Each step to the left is ten times less. Diamonds: share of the failure during "
                "which the event is true as well. Right of 1 the criticality is no share.",
            ),
        ),
    )  # fmt: skip


def _figure(value: float | None, absent: str = "rounding only") -> str:
    return absent if value is None else number(value)
