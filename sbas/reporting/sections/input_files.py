"""What was evaluated: files, receiver, protection levels and truth."""

from __future__ import annotations

from sbas.integrity.results import Evaluation
from sbas.numerals import count, metres, number
from sbas.reporting.content import Cell, Section, table
from sbas.timescales import NS_PER_S
from sbas.truth import FixedPoint

UNSTATED = "not stated"


def section(evaluation: Evaluation) -> Section:
    """Files with size and SHA-256, then what the recording and its truth say of themselves."""
    meta, survey, truth = evaluation.meta, evaluation.input.survey, evaluation.truth
    files: list[tuple[Cell | str, ...]] = [
        (
            Cell(s.path, breaks=True), count(s.bytes) if s.bytes else UNSTATED,
            Cell(s.sha256 or UNSTATED, breaks=True), s.format or UNSTATED,
            s.reader_version or UNSTATED,
        )
        for s in meta.sources
    ]  # fmt: skip
    level = meta.pl
    modes = ", ".join(f"{mode} {count(n)}" for mode, n in evaluation.modes.items() if n)
    rows: list[tuple[Cell | str, ...]] = [
        ("receiver", _joined(meta.receiver, meta.firmware)),
        ("antenna", meta.antenna or UNSTATED),
        ("time scale", f"{meta.time_scale}, leap seconds {_or(meta.leap_seconds)}"),
        ("interval", f"{number(survey.interval_ns / NS_PER_S, 6)} s (median step)"),
        ("reference frame", _joined(meta.frame, meta.frame_epoch)),
        ("heights", _joined(meta.height_reference, meta.geoid)),
        ("modes [epochs]", modes or UNSTATED),
        ("protection levels", f"kind {level.kind}; K_H {_or(level.k_h)}, K_V {_or(level.k_v)}; "
                              f"risk {_or(level.risk)} {level.risk_per}".strip()),
        ("truth", "none" if truth is None else truth.label),
    ]  # fmt: skip
    if truth is not None and not (isinstance(truth, FixedPoint) and truth.lower_bound):
        sigma = evaluation.truth_sigma_h_m
        rows += [
            ("frame of the truth", truth.frame or f"{UNSTATED}; 1 m is allowed for it"),
            ("sigma of the truth", "no error formed" if sigma is None else
             f"{metres(sigma)} m horizontal, 1-sigma, largest used"),
        ]  # fmt: skip
    return Section(
        "inputs",
        "Inputs",
        tables=(
            table("Files", "Path|#Bytes|SHA-256|Format|Reader", files),
            table("The recording and its truth", "What|Value", rows),
        ),
    )


def _joined(*parts: str) -> str:
    return " ".join(part for part in parts if part) or UNSTATED


def _or(value: float | None) -> str:
    return UNSTATED if value is None else f"{value:g}"
