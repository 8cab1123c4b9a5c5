"""The main question: errors, Stanford regions, events, availability and rates of a recording."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.findings import Finding, refuse_on_errors
from sbas.frames import decimal_year
from sbas.input_check import CheckResult, accept, check
from sbas.integrity.correlation.error_grid import ErrorGrid, GridFiller
from sbas.integrity.environments.label_tallies import MOST_LABELS
from sbas.integrity.environments.record_part import RecordPart
from sbas.integrity.epoch_levels import MODE_K_H, k_of_modes
from sbas.integrity.error_process import ErrorProcess, error_process
from sbas.integrity.part_figures import EvaluatedRecord
from sbas.integrity.part_tally import PartTally
from sbas.integrity.results import Evaluation, EvaluationSettings, Summary
from sbas.integrity.tallies import RecordTally
from sbas.logs.format import Progress
from sbas.recording import MODES, EpochSource, RecordingMeta
from sbas.truth import FixedPoint, Truth, frame_findings

Floats = NDArray[np.float64]

LARGEST_LEVEL_M = 1e5
"""No service gives levels from here on: receivers write such numbers for none."""
MOST_MISSING = 0.01
"""Share of epochs without a level, or without a position, above which a finding says so."""


def evaluate(
    source: EpochSource,
    *,
    truth: Truth | None = None,
    alert_limits_m: Sequence[float] = EvaluationSettings.alert_limits_m,
    time_to_alert_s: float = EvaluationSettings.time_to_alert_s,
    merge_s: float | None = EvaluationSettings.merge_s,
    reset_s: float = EvaluationSettings.reset_s,
    confidence: float = EvaluationSettings.confidence,
    accept_findings: Iterable[str] = (),
    progress: Progress | None = None,
) -> Evaluation:
    """Errors, Stanford regions, events, availability and rates of a recording.

    Parameters
    ----------
    source : a Recording, or a source of `sbas.scan` that streams. Where its epochs have
        environment labels (`sbas.environment_labels.label_epochs`), every figure is given by
        label as well.
    truth : where the antenna was. Without it a static recording is held against its own median
        position: errors are then a lower bound and demonstrated rates are refused in words; a
        moving one gives levels and availability only.
    alert_limits_m, time_to_alert_s, merge_s, reset_s, confidence : see EvaluationSettings.
    accept_findings : codes of errors in the input to accept as warnings.
    progress : called with (epochs done, epochs in all).

    Returns
    -------
    Evaluation.

    Raises
    ------
    InputError : the input check found an error; its text names the cure.

    References
    ----------
    RTCA DO-229D, 1.7 and J.1; EN 50126-1 (dangerous failure rates);
    Filip, Bazant, Mocek 2010, section 3.
    """
    settings = EvaluationSettings(
        tuple(float(al) for al in alert_limits_m),
        time_to_alert_s,
        merge_s,
        reset_s,
        confidence,
        tuple(accept_findings),
    )
    return evaluation_of(source, settings, truth=truth, progress=progress)


def evaluation_of(
    source: EpochSource,
    settings: EvaluationSettings,
    *,
    truth: Truth | None,
    labels: Collection[str] | None = None,
    progress: Progress | None = None,
) -> Evaluation:
    """`evaluate` with the figures of some environments only, which is faster.

    Parameters
    ----------
    source, truth, progress : as for `evaluate`.
    settings : what is asked.
    labels : environments to give figures of; None for all.

    Raises
    ------
    InputError : as `evaluate`, or no epoch has one of the labels.
    """
    checked = check(source, truth=truth)
    survey = checked.survey
    year = float(decimal_year(np.datetime64(survey.begin_ns, "ns"))) if survey.epochs else None
    found = (*checked.findings, *frame_findings(source.meta, truth, year=year))
    findings = list(accept(found, settings.accept))
    refuse_on_errors(findings)
    if truth is None:
        truth, remark = _own_median(checked)
        findings.append(remark)

    labelled = "environment" in source.columns and (labels is None or len(labels) > 0)
    tally = RecordTally(survey, truth, settings.alert_limits_m, labelled=labelled)
    done = 0
    for batch in source.batches(tally.columns):
        tally.update(batch)
        done += len(batch)
        if progress is not None:
            progress(done, survey.epochs)
    return _evaluation(source.meta, settings, checked, findings, truth, tally, labels)


def _evaluation(
    meta: RecordingMeta,
    settings: EvaluationSettings,
    checked: CheckResult,
    findings: list[Finding],
    truth: Truth | None,
    tally: RecordTally,
    labels: Collection[str] | None,
) -> Evaluation:
    lower_bound = truth is not None and truth.lower_bound
    findings += _remarks(settings, truth, tally.all)
    grid: ErrorGrid | Refusal
    if isinstance(tally.grid, GridFiller):
        grid, remarks = tally.grid.result()
        findings += remarks
    else:
        grid = tally.grid
    k_of_mode, assumed = _k_of_mode(meta, tally.all)
    findings += assumed

    def process_of(errors: ErrorGrid | Refusal) -> ErrorProcess:
        return error_process(
            errors, k_of_mode=k_of_mode, confidence=settings.confidence, lower_bound=lower_bound
        )

    process = process_of(grid)
    findings += process.decorrelation.findings
    record = EvaluatedRecord(
        meta=meta,
        settings=settings,
        input=checked,
        truth=truth,
        tally=tally,
        merge_s=process.merge_s if settings.merge_s is None else settings.merge_s,
        tau_known=not isinstance(process.decorrelation.tau_s, Refusal),
    )
    environments = {}
    for label, (counts, part) in _parts(tally, labels).items():
        own = process_of(grid if isinstance(grid, Refusal) else part.grid_of(grid))
        remarks = (*_remarks(settings, truth, counts), *own.decorrelation.findings)
        environments[label] = record.evaluation(counts, own, remarks, label=label, part=part)
    if tally.labels is not None and tally.labels.too_many:
        findings.append(
            Finding(
                "E25", "warning",
                f"more than {MOST_LABELS} environment labels: no figures by environment",
                evidence="the figures of the whole record are not touched",
                cure="label with few words, such as open, urban, woody, cutting, tunnel",
            )
        )  # fmt: skip
    return record.evaluation(tally.all, process, findings, environments=environments)


def _parts(
    tally: RecordTally, wanted: Collection[str] | None
) -> dict[str, tuple[PartTally, RecordPart]]:
    found = {} if tally.labels is None else tally.labels.parts(tally.interval_ns)
    if wanted is None:
        return found
    known = f"labels are {', '.join(found)}" if found else "no epoch has a label"
    if tally.labels is not None and tally.labels.too_many:
        known = f"there are more than {MOST_LABELS} labels"
    for label in wanted:
        if label not in found:
            raise InputError(
                f"no figures for the environment {label!r}", evidence=known,
                cure="name one of few labels, from segments or a column environment",
            )  # fmt: skip
    return {label: found[label] for label in wanted}


def _own_median(checked: CheckResult) -> tuple[FixedPoint | None, Finding]:
    survey = checked.survey
    lat, lon, height = survey.median_position
    if not survey.static:
        alone = "; without positions availability is that of the level alone"
        what = "has no positions" if survey.positions == 0 else f"moves ({survey.extent_m:.3g} m)"
        return None, Finding(
            "E01", "warning", f"no truth, and the recording {what}: no errors, no error rates",
            evidence="protection levels and availability are given"
            + alone * (survey.positions == 0),
            cure="--truth LAT,LON,HEIGHT or --truth TRAJECTORY.csv",
        )  # fmt: skip
    point = FixedPoint(
        lat, lon, height if math.isfinite(height) else 0.0, sigma_h_m=0.0, sigma_v_m=0.0,
        lower_bound=True,
    )  # fmt: skip
    return point, Finding(
        "E01", "warning",
        "no truth: errors are formed against the recording's own median and are a lower bound",
        evidence=f"median {lat:.9f}, {lon:.9f}, {height:.4f} m; extent {survey.extent_m:.3g} m",
        cure="--truth LAT,LON,HEIGHT of the antenna",
    )  # fmt: skip


def _k_of_mode(meta: RecordingMeta, tally: PartTally) -> tuple[Floats, list[Finding]]:
    """K behind each mode's levels; where nothing states it, that of the non-precision approach."""
    names = (*MODES, "unknown")
    usual = max(range(len(names)), key=lambda i: tally.modes[names[i]])
    k = k_of_modes(meta.pl, -1 if names[usual] == "unknown" else usual)
    levels = tally.levels.result().counts.sum(axis=1)
    open_ = [i for i in (MODES.index("sbas"), -1) if np.isnan(k[i])]
    assumed = int(levels[open_].sum())
    if meta.pl.kind not in ("do229", "unknown") or not assumed:
        return k, []
    k[open_] = MODE_K_H["sbas_npa"]
    return k, [
        Finding(
            "E23", "info",
            f"{assumed:,} levels state neither mode nor K: sigma is taken as HPL/6.18 "
            "(non-precision approach)",
            evidence="used by modelled rates and the railway HPL, by no count",
            cure="--mode-map, or a column mode with sbas_pa and sbas_npa",
        )
    ]  # fmt: skip


def _remarks(
    settings: EvaluationSettings,
    truth: Truth | None,
    tally: PartTally,
) -> list[Finding]:
    """What only the errors and levels themselves can show to be wrong with the input."""
    hpe, hpl = Summary.of(tally.hpe), Summary.of(tally.hpl)
    found = []
    if tally.levels_left_out:
        found.append(
            Finding(
                "E23",
                "warning",
                f"{tally.levels_left_out} epochs have a protection level outside SBAS mode, "
                "declared invalid or infinite: counted as without level",
            )
        )
    if hpl and hpl.max >= LARGEST_LEVEL_M:
        found.append(
            Finding(
                "E23",
                "warning",
                f"protection levels of {LARGEST_LEVEL_M / 1000:g} km or more: a sentinel?",
                evidence=f"largest HPL {hpl.max:.6g} m",
                cure="make the values of the receiver's documentation for 'none' missing",
            )
        )
    for name, number in (("level", hpl), ("position", None)):
        have = tally.positions if number is None else number.epochs
        if 0 < have < (1 - MOST_MISSING) * tally.epochs:
            found.append(
                Finding(
                    "E10",
                    "warning",
                    f"{tally.epochs - have:,} of {tally.epochs:,} epochs have no {name}",
                    evidence="they count as down; rates rest on the others",
                    cure="record levels at the rate of positions, or evaluate one rate alone",
                )
            )
    if hpe and hpl and hpe.median > 10 * hpl.median:
        found.append(
            Finding(
                "E08",
                "warning",
                "errors are far larger than the levels: a wrong unit or truth?",
                evidence=f"HPE median {hpe.median:.4g} m, HPL median {hpl.median:.4g} m",
                cure="check the truth, and the units in the file's header",
            )
        )
    if hpe and hpe.max < 1e-6:
        found.append(
            Finding(
                "E12",
                "warning",
                "every error is zero: is the truth the recording itself?",
                cure="give a truth that was measured independently",
            )
        )
    if hpe and hpe.epochs < tally.positions:
        found.append(
            Finding(
                "E01",
                "warning",
                f"the truth covers {hpe.epochs:,} of {tally.positions:,} epochs with a position",
                evidence="the others are in no error and in no exposure",
                cure="give a truth for the whole record, or --truth-max-step",
            )
        )
    if truth is not None and not hpe:
        covers = "the truth covers no epoch that has a position"
        found.append(
            Finding(
                "E01",
                "warning",
                f"{covers if tally.positions else 'no epoch has a position'}: no error was formed",
                evidence="availability is that of the level alone" * tally.level_alone,
                cure="check the times and the steps of the trajectory" if tally.positions else "",
            )
        )
    if tally.truth_sigma_h_m > 0.1 * min(settings.alert_limits_m):
        found.append(
            Finding(
                "E09",
                "warning",
                f"the truth is uncertain by up to {tally.truth_sigma_h_m:.3g} m (1-sigma), more "
                f"than a tenth of the alert limit {min(settings.alert_limits_m):g} m",
                cure="give a better truth",
            )
        )
    return found
