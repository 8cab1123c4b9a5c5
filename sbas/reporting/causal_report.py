"""The report on an architecture of sensors: its sections in order, and one HTML file of them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sbas.fusion.architecture.architecture_fields import to_table
from sbas.fusion.causal_analysis import CausalAnalysis
from sbas.numerals import count, number, upward
from sbas.reporting.content import Callout, Cell, Section, Table, Tile, table
from sbas.reporting.document import Report, write_page
from sbas.reporting.sections import input_findings, sensor_combinations, sensor_importance

NAMED = 6
"""Combinations that a sentence names."""


def causal_report_of(found: CausalAnalysis) -> Report:
    """The report on an answer of `sbas.multisensor` as data, pictures drawn."""
    sections = [
        _verdict(found),
        sensor_combinations.section(found),
        sensor_importance.section(found),
        *([_recorded(found)] if found.recorded is not None else []),
        input_findings.section(found),
        _model(found),
    ]
    return Report(
        f"Causal analysis of {found.architecture.name}",
        f"{count(found.runs.runs)} runs of {found.architecture.duration_s:g} s in steps of "
        f"{found.runs.step_s:g} s, seed {found.seed}",
        tuple(sections),
        "Causal analysis",
    )


def causal_report(found: CausalAnalysis, path: str | os.PathLike[str]) -> Path:
    """Write the report on an architecture as one self-contained HTML file.

    Parameters
    ----------
    found : result of `sbas.multisensor`.
    path : the file to write; one that exists is replaced.

    Returns
    -------
    The path. The same arguments give the same bytes: no clock is read.

    Raises
    ------
    InputError : the file cannot be written.
    """
    return write_page(causal_report_of(found), path)


def _verdict(found: CausalAnalysis) -> Section:
    out = found.shares
    errors = (
        "the receiver's errors are those of a recording, the other sensors' those of error models"
        if found.recorded is not None
        else "every figure says what the error models imply"
    )
    critical = ", ".join(found.critical.critical) or "none"
    return Section(
        "verdict",
        "Verdict",
        callouts=(
            Callout(
                "modelled",
                "Modelled, not demonstrated",
                (
                    f"Nothing here was counted on a train: {errors}. Critical combinations: "
                    f"{critical}.",
                    _alert(found),
                ),
            ),
        ),
        tiles=(
            Tile("Available", f"{100 * out.available:.2f} %", "output N or DA, detected or not"),
            Tile("Safe", f"{100 * out.safe:.2f} %", "output N and declared usable"),
            Tile("Hazard", f"{100 * out.hazard:.2f} %",
                 f"output U and declared usable{_interval(found)}"),
            Tile("Critical combinations",
                 count(sum("-" not in name for name in found.critical.critical)),
                 f"of {3 ** len(found.runs.names)}"),
        ),
        tables=(_output(found), _hardware(found)),
    )  # fmt: skip


def _alert(found: CausalAnalysis) -> str:
    alert, target = found.time_to_alert_s, found.critical.target
    if alert is None:
        return (
            f"In no combination were 5 % of the episodes seen to become {target}: these runs tell "
            "no time within which an alert must come."
        )
    times = found.critical.table["reach_q05_s"]
    first = list(times.index[times == alert])
    names = ", ".join(first[:NAMED]) + (" and others" if len(first) > NAMED else "")
    has = "no time, since so many begin so" if alert == 0 else f"{alert:.4g} s"
    return (
        f"An alert that must come before 5 % of the episodes of any combination are {target} has "
        f"{has}: {names}."
    )


def _interval(found: CausalAnalysis) -> str:
    """Interval of P(U) by whole runs, where there is one."""
    if found.importance is None:
        return ""
    return f"; P(U) {found.importance.top('simulated', 'isU')}"


def _output(found: CausalAnalysis) -> Table:
    out = found.shares
    rows: list[tuple[Cell | str, ...]] = [
        ("N", count(out.nominal), count(out.nominal_usable)),
        ("DA", count(out.degraded), count(out.degraded_usable)),
        ("U", count(out.unacceptable), count(out.unacceptable_usable)),
        ("no data", count(out.no_data), "-"),
    ]
    return table(
        "Output",
        "State|#Epochs|#Declared usable",
        rows,
        "U declared usable is the hazard; N or DA declared unusable a false alarm.",
    )


def _hardware(found: CausalAnalysis) -> Table:
    rows: list[tuple[Cell | str, ...]] = [
        (name, upward(p, 3) if p else "none given") for name, p in found.hardware.items()
    ]
    return table(
        "Hardware",
        "Sensor|#Failed within a run [1]",
        rows,
        "Added exactly, since no simulation of some minutes sees hardware fail. Hazard or any "
        f"sensor failed: at most {upward(found.hazard_with_hardware, 4)}.",
    )


def _recorded(found: CausalAnalysis) -> Section:
    assert found.recorded is not None
    counts = found.recorded.counts
    rows: list[tuple[Cell | str, ...]] = [
        ("N", count(counts.safe), count(counts.false_alarm_n), count(counts.no_level_n)),
        ("DA", count(counts.available), count(counts.false_alarm_da), count(counts.no_level_da)),
        ("U", Cell(count(counts.hazard), "bad" if counts.hazard else ""), count(counts.detected),
         count(counts.no_level_u)),
    ]  # fmt: skip
    drawn = found.resampled
    words = "" if drawn is None else (
        f"Its errors along the track were drawn by {drawn.kind.replace('_', ' ')}; U along the "
        f"track: {number(drawn.recorded_u_share, 3)} recorded, {number(drawn.drawn_u_share, 3)} "
        "drawn."
    )  # fmt: skip
    return Section(
        "recorded",
        "The recorded receiver",
        paragraphs=(words,),
        tables=(
            table(
                "States of the recording by what its level declared",
                "State|#HPL below the alert limit|#HPL at or above it|#No level",
                rows,
                f"{count(counts.misleading)} epochs are misleading without hazard (error above "
                f"HPL, both below the alert limit); {count(counts.no_data)} without data, of which "
                f"RAIM failed {count(counts.raim_failed)}; {count(counts.unknown)} unknown.",
            ),
        ),
    )


def _model(found: CausalAnalysis) -> Section:
    architecture = found.architecture
    rows: list[tuple[Cell | str, ...]] = [
        (key, value) for key, value in _flat("", to_table(architecture)) if key != "reported"
    ]
    return Section(
        "model",
        "Architecture",
        paragraphs=(
            "Every key of the model file, defaults written out; its own documents report:",
            *architecture.reported,
        )
        if architecture.reported
        else ("Every key of the model file, defaults written out.",),
        tables=(table("Model", "Key|Value", rows),),
    )


def _flat(path: str, value: Any) -> Iterator[tuple[str, str]]:
    """Keys of nested tables and lists, dotted, with their values as text."""
    if isinstance(value, dict):
        for key, part in value.items():
            name = part.get("name", "") if isinstance(part, dict) else ""
            yield from _flat(f"{path}.{name or key}" if path else str(name or key), part)
    elif isinstance(value, list) and any(isinstance(part, dict) for part in value):
        named = {str(part.get("name", i)): part for i, part in enumerate(value)}
        yield from _flat(path, named)
    else:
        yield path, ", ".join(map(str, value)) if isinstance(value, list) else str(value)
