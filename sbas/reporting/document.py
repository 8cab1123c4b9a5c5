"""The report of an evaluation: its sections in order, and one HTML file of them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.integrity.causes.causes import Causes
from sbas.integrity.results import Evaluation
from sbas.monitoring.level_comparison import LevelComparison
from sbas.numerals import count, hours, stamp
from sbas.reporting.content import Section
from sbas.reporting.sections import (
    decorrelation_and_k,
    environments,
    error_tail,
    event_list,
    exposure_hours,
    glossary,
    input_files,
    input_findings,
    likely_causes,
    method_trace,
    parameters,
    pictures,
    range_monitoring,
    results,
    verdict,
)  # fmt: skip

_SECTIONS = (
    verdict.section,
    results.section,
    pictures.section,
    decorrelation_and_k.section,
    error_tail.section,
    exposure_hours.section,
    input_files.section,
    input_findings.section,
    event_list.section,
    parameters.section,
    method_trace.section,
    glossary.section,
)

NOT_EXPLAINED = Refusal("sbas.explain was not asked", "sbas.report(..., causes=sbas.explain(...))")


@dataclass(frozen=True)
class Report:
    """A title, one line about what was evaluated, the sections in order, and the kind of report."""

    title: str
    subtitle: str
    sections: tuple[Section, ...]
    kind: str = "Integrity report"

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "title": self.title,
            "subtitle": self.subtitle,
            "sections": [section.to_dict() for section in self.sections],
        }


def report_of(
    evaluation: Evaluation,
    *,
    causes: Causes | Refusal = NOT_EXPLAINED,
    raim: LevelComparison | Refusal | None = None,
) -> Report:
    """The report of an evaluation as data, pictures drawn."""
    names = [PurePath(source.path).name or source.path for source in evaluation.meta.sources]
    title = ", ".join(names[:2]) or "recording without a file"
    if len(names) > 2:
        title += f" and {len(names) - 2} more"
    survey = evaluation.input.survey
    subtitle = (
        f"{count(evaluation.epochs)} epochs, {hours(evaluation.hours)} recorded, "
        f"{stamp(survey.begin_ns)} to {stamp(survey.end_ns)} GPST"
    )
    sections = [section(evaluation) for section in _SECTIONS]
    sections.insert(_after("events", sections), likely_causes.section(causes))
    if evaluation.environments:
        sections.insert(_after("figures", sections), environments.section(evaluation))
    if raim is not None:
        sections.insert(_after("pictures", sections), range_monitoring.section(raim))
    return Report(title, subtitle, tuple(sections))


def _after(key: str, sections: list[Section]) -> int:
    return 1 + next(i for i, section in enumerate(sections) if section.key == key)


def render_html(document: Report) -> str:
    """The report as one HTML page that refers to nothing outside itself."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    # File headers and names are hostile text: everything is escaped but the drawn SVG.
    environment = Environment(
        loader=PackageLoader("sbas.reporting"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html").render(report=document)


def report(
    evaluation: Evaluation,
    path: str | os.PathLike[str],
    *,
    causes: Causes | Refusal = NOT_EXPLAINED,
    raim: LevelComparison | Refusal | None = None,
) -> Path:
    """Write the report of an evaluation as one self-contained HTML file.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    path : the file to write; one that exists is replaced.
    causes : result of `sbas.explain` for the same recording.
    raim : result of `sbas.raim_against_sbas` for the same recording; without it the report has no
        section on RAIM.

    Returns
    -------
    The path. The same evaluation gives the same bytes: no clock is read.

    Raises
    ------
    InputError : the file cannot be written.
    """
    return write_page(report_of(evaluation, causes=causes, raim=raim), path)


def write_page(document: Report, path: str | os.PathLike[str]) -> Path:
    """Write a report as one HTML file; raises InputError where it cannot be written."""
    target = Path(path)
    page = render_html(document)
    try:
        target.write_text(page, encoding="utf-8", errors="backslashreplace", newline="\n")
    except OSError as error:
        raise InputError(
            "the report cannot be written",
            where=str(target),
            evidence=error.strerror or str(error),
            cure="name a file in a folder that exists and may be written to",
        ) from error
    return target
