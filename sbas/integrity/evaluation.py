"""The main question: errors, Stanford regions, events, availability and rates of a recording."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.findings import Finding, refuse_on_errors
from sbas.input_check import CheckResult, accept, check
from sbas.integrity.availability import availability
from sbas.integrity.correlation.error_grid import ErrorGrid, GridFiller
from sbas.integrity.epoch_levels import MODE_K_H, k_of_modes
from sbas.integrity.error_process import error_process
from sbas.integrity.events import Events, find_events
from sbas.integrity.modelled_rates import modelled_event_rate
from sbas.integrity.rate_evidence import EVENT_KINDS, EventKind, RateEvidence, rate_evidence
from sbas.integrity.results import (
    AlertLimitResult,
    Curves,
    ErrorEllipse,
    Evaluation,
    EvaluationSettings,
    ExposureHours,
    Summary,
)
from sbas.integrity.stanford import REGIONS
from sbas.integrity.tallies import CURVE_LIMITS_M, LEVEL_GRID_M, LIMIT_KINDS, RecordTally
from sbas.logs.format import Progress
from sbas.recording import MODES, EpochSource, RecordingMeta
from sbas.timescales import NS_PER_S
from sbas.truth import FixedPoint, Truth

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
    source : a Recording, or a source of `sbas.scan` that streams.
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
    checked = check(source, truth=truth)
    findings = list(accept(checked.findings, settings.accept))
    refuse_on_errors(findings)
    survey = checked.survey
    if truth is None:
        truth, remark = _own_median(checked)
        findings.append(remark)
    elif not truth.frame:
        findings.append(
            Finding(
                "E09",
                "warning",
                "the truth's reference frame is not stated: errors may be wrong by some 1 m",
                evidence="ITRF and ETRS89 part by about 2.5 cm a year since 1989; the 1 m is in "
                "truth_sigma_h_m, no error and no count is changed by it",
                cure="--frame, such as --frame 'ITRF2014 2010.0'",
            )
        )

    tally = RecordTally(survey, truth, settings.alert_limits_m)
    done = 0
    for batch in source.batches(RecordTally.COLUMNS):
        tally.update(batch)
        done += len(batch)
        if progress is not None:
            progress(done, survey.epochs)
    return _evaluation(source.meta, settings, checked, findings, truth, tally)


def _own_median(checked: CheckResult) -> tuple[FixedPoint | None, Finding]:
    survey = checked.survey
    lat, lon, height = survey.median_position
    if not survey.static:
        what = "has no positions" if survey.positions == 0 else f"moves ({survey.extent_m:.3g} m)"
        return None, Finding(
            "E01", "warning", f"no truth, and the recording {what}: no errors, no error rates",
            evidence="protection levels and availability are given",
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


def _k_of_mode(meta: RecordingMeta, tally: RecordTally) -> tuple[Floats, list[Finding]]:
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
    tally: RecordTally,
    hpe: Summary | None,
    hpl: Summary | None,
) -> list[Finding]:
    """What only the errors and levels themselves can show to be wrong with the input."""
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
        found.append(
            Finding(
                "E01",
                "warning",
                "the truth covers no epoch that has a position: no error was formed",
                cure="check the times and the steps of the trajectory",
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


def _evaluation(
    meta: RecordingMeta,
    settings: EvaluationSettings,
    checked: CheckResult,
    findings: list[Finding],
    truth: Truth | None,
    tally: RecordTally,
) -> Evaluation:
    survey = checked.survey
    interval_ns = survey.interval_ns
    hour_ns = 3600 * NS_PER_S
    exposure = ExposureHours(
        recorded_hours=tally.covered_ns / hour_ns,
        gap_hours=float(survey.gaps.missing_ns(interval_ns).sum()) / hour_ns,
        without_error_hours=(tally.covered_ns - tally.error_ns) / hour_ns,
        without_level_hours=(tally.covered_ns - tally.level_ns) / hour_ns,
        judged_hours=tally.judged_ns / hour_ns,
        error_hours=tally.error_ns / hour_ns,
    )
    hpe, hpl = Summary.of(tally.hpe), Summary.of(tally.hpl)
    findings += _remarks(settings, truth, tally, hpe, hpl)
    lower_bound = truth is not None and truth.lower_bound
    grid: ErrorGrid | Refusal
    if isinstance(tally.grid, GridFiller):
        grid, remarks = tally.grid.result()
        findings += remarks
    else:
        grid = tally.grid
    k_of_mode, assumed = _k_of_mode(meta, tally)
    findings += assumed
    process = error_process(
        grid, k_of_mode=k_of_mode, confidence=settings.confidence, lower_bound=lower_bound
    )
    findings += process.decorrelation.findings
    levels = tally.levels.result()
    merge_s = process.merge_s if settings.merge_s is None else settings.merge_s
    unknown_tau = isinstance(process.decorrelation.tau_s, Refusal)
    caveats: tuple[str, ...] = ()
    if settings.merge_s is None and unknown_tau:
        caveats = (f"the decorrelation time is not known: runs were merged over {merge_s:g} s",)

    def counted(kind: EventKind, limit: float, merge_s: float) -> Events:
        runs = tally.mi.whole() if kind == "mi" else tally.at_limit(kind, limit)
        minimum = settings.time_to_alert_s if kind == "hmi" else 0.0
        return find_events(runs, interval_ns=interval_ns, merge_s=merge_s, minimum_s=minimum)

    def rate(kind: EventKind, limit: float) -> RateEvidence:
        events = counted(kind, limit, merge_s)
        return rate_evidence(
            kind,
            limit,
            events=len(events),
            runs=len(tally.mi.whole() if kind == "mi" else tally.at_limit(kind, limit)),
            event_hours=float(events.duration_s.sum()) / 3600,
            merge_hours=merge_s / 3600,
            judged_hours=(exposure.error_hours if kind == "exceeds_al" else exposure.judged_hours),
            confidence=settings.confidence,
            lower_bound=lower_bound,
            modelled=modelled_event_rate(
                kind, limit, process=process, levels=levels, confidence=settings.confidence
            ),
            caveats=caveats,
        )

    limits = []
    for al in settings.alert_limits_m:
        up = availability(
            tally.down[al].whole(),
            survey.gaps,
            up_ns=tally.covered_ns - tally.down_ns[al],
            down_ns=tally.down_ns[al],
            interval_ns=interval_ns,
            confidence=settings.confidence,
            tau_s=process.tau_upper_s,
        )
        if truth is None:
            limits.append(AlertLimitResult(al, up, None, {}, {}))
            continue
        regions = dict(zip(REGIONS, tally.regions[al].tolist(), strict=True))
        events = {kind: counted(kind, al, settings.reset_s) for kind in EVENT_KINDS}
        rates = {kind: rate(kind, al) for kind in EVENT_KINDS}
        limits.append(AlertLimitResult(al, up, regions, events, rates))

    def along_curve(kind: EventKind) -> tuple[RateEvidence, ...]:
        return () if truth is None else tuple(rate(kind, al) for al in CURVE_LIMITS_M)

    curves = Curves(
        level_grid_m=np.array(LEVEL_GRID_M),
        available_fraction=tally.levels_below() / max(tally.epochs, 1),
        rates={kind: along_curve(kind) for kind in LIMIT_KINDS},
        ratio_grid=tally.RATIO_GRID,
        ratio_exceeded_fraction=tally.ratio_exceeded(),
        stanford_cell_m=tally.stanford_cell_m,
        stanford_counts=tally.stanford,
    )
    return Evaluation(
        meta=meta,
        settings=settings,
        input=checked,
        findings=tuple(findings),
        truth=truth,
        epochs=tally.epochs,
        hours=exposure.recorded_hours,
        exposure=exposure,
        hpe_m=hpe,
        vpe_m=Summary.of(tally.vpe),
        hpl_m=hpl,
        vpl_m=Summary.of(tally.vpl),
        truth_sigma_h_m=tally.truth_sigma_h_m if hpe else None,
        ellipse=ErrorEllipse(*tally.moments()) if hpe else None,
        modes=tally.modes,
        mi_epochs=tally.mi_epochs if truth is not None else None,
        alert_limits=tuple(limits),
        curves=curves,
        strips=tally.strips,
        scatter=tally.scatter,
        levels=levels,
        process=process,
    )
