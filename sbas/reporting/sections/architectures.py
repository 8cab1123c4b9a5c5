"""Architectures side by side against the tolerable hazard rate."""

from __future__ import annotations

from sbas.dependability.analysis.architectures import ArchitectureLadder, ArchitectureRow
from sbas.numerals import number, share, upward
from sbas.plots import architectures_against_target
from sbas.reporting.content import Cell, Section, table
from sbas.reporting.drawn import drawn
from sbas.reporting.sections.unit_verdict import band_words


def section(ladder: ArchitectureLadder) -> Section:
    """A table and the ladder; what was too large to solve says so."""
    thr = ladder.thr_per_h
    target = "THR" if thr is None else f"THR of {number(thr)}/h"
    refused = [f"{row.name}: {row.refused.splitlines()[0]}." for row in ladder.rows if row.refused]
    return Section(
        "architectures",
        "Architectures",
        tables=(
            table(
                f"By the rate of {ladder.hazard}",
                "Architecture|#Availability|#Hazard: mean [1]|#At least once [1]|"
                f"#Times per hour [1/h]|SIL band|Below the {target}",
                [_row(row) for row in ladder.rows],
                "All figures are modelled: a band or a THR that is met here is met by the model, "
                "and demonstrated by nothing.",
                *refused,
            ),
        ),
        pictures=(
            drawn(
                "architectures", "Architectures against the tolerable rate",
                architectures_against_target.ladder_sheet(ladder),
                lambda axes: architectures_against_target.architecture_ladder(ladder, ax=axes[0]),
                f"Rate of {ladder.hazard} for each architecture with the SIL bands.",
                "Each step to the left is ten times rarer. Open circles do not meet the tolerable "
                "rate.",
                wide=True,
            ),
        ),
    )  # fmt: skip


def _row(row: ArchitectureRow) -> tuple[Cell | str, ...]:
    verdict = row.verdict
    if verdict is None or row.unavailability is None or row.hazard_unavailability is None:
        return (row.name, *("no figures",) * 6)
    meets: dict[bool | None, Cell | str] = {
        None: "no THR given",
        True: Cell("yes", "modelled"),
        False: Cell("no", "bad"),
    }
    return (
        row.name,
        share(1.0 - row.unavailability),
        number(row.hazard_unavailability),
        "not asked" if row.at_least_once is None else number(row.at_least_once),
        upward(verdict.rate_per_h),
        band_words(verdict.rate_per_h),
        meets[verdict.meets],
    )
