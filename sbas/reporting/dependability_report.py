"""The report on a localisation unit: its sections in order, and one HTML file of them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from sbas.dependability.analysis.architectures import ArchitectureLadder
from sbas.dependability.analysis.importance import Importances
from sbas.dependability.questions import Dependability
from sbas.dependability.receiver.state_estimation import ReceiverStates
from sbas.dependability.receiver.thinned_states import StateStrip
from sbas.estimate import Refusal
from sbas.numerals import hours
from sbas.reporting.content import Section
from sbas.reporting.document import Report, write_page
from sbas.reporting.sections import (
    architectures,
    input_findings,
    model_definition,
    receiver_chain,
    simulation_check,
    unit_measures,
    unit_verdict,
    what_matters,
)  # fmt: skip


def dependability_report_of(
    answer: Dependability,
    *,
    states: ReceiverStates | None = None,
    strip: StateStrip | None = None,
    importances: Importances | Refusal | None = None,
    ladder: ArchitectureLadder | None = None,
) -> Report:
    """The report on an answer of `depend` as data, pictures drawn; arguments as there."""
    if states is not None:
        both = dict.fromkeys((*answer.findings, *states.findings))
        answer = replace(answer, findings=tuple(both))
    models = [solution.model for solution in answer.solutions.values()]
    one = len(models) == 1
    sections: list[Section] = [unit_verdict.section(answer), *unit_measures.sections(answer)]
    if importances is not None:
        sections.append(what_matters.section(importances))
    if ladder is not None:
        sections.append(architectures.section(ladder))
    if states is not None:
        sections.append(receiver_chain.section(states, strip))
    sections += [
        simulation_check.section(answer),
        input_findings.section(answer),
        model_definition.section(answer),
    ]
    spans = dict.fromkeys(
        f"{hours(model.mission_s / 3600)} in epochs of {model.step_s:g} s" for model in models
    )
    mission = f"mission{'s' * (len(spans) > 1)} of {', '.join(spans)}"
    return Report(
        "Dependability of " + (models[0].name if one else f"{len(models)} environments"),
        mission[0].upper() + mission[1:] if one else f"{', '.join(answer.solutions)}; {mission}",
        tuple(sections),
        "Dependability report",
    )


def dependability_report(
    answer: Dependability,
    path: str | os.PathLike[str],
    *,
    states: ReceiverStates | None = None,
    strip: StateStrip | None = None,
    importances: Importances | Refusal | None = None,
    ladder: ArchitectureLadder | None = None,
) -> Path:
    """Write the report on a localisation unit as one self-contained HTML file.

    Parameters
    ----------
    answer : result of `sbas.dependability.depend`.
    path : the file to write; one that exists is replaced.
    states : of the recording that its receiver comes from.
    strip : the same states along time.
    importances : of the events and components of one of its models, or why there are none.
    ladder : architectures compared.

    Returns
    -------
    The path. The same arguments give the same bytes: no clock is read.

    Raises
    ------
    InputError : the file cannot be written.
    """
    document = dependability_report_of(
        answer, states=states, strip=strip, importances=importances, ladder=ladder
    )
    return write_page(document, path)
