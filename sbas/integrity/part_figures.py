"""From counts to figures: of a whole record, and of each part of it by the same lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from sbas.findings import Finding
from sbas.input_check import CheckResult
from sbas.integrity.availability import availability
from sbas.integrity.environments.part_events import PartEvents, events_in
from sbas.integrity.environments.record_part import RecordPart
from sbas.integrity.error_process import ErrorProcess
from sbas.integrity.events import Events, Runs, find_events
from sbas.integrity.modelled_rates import modelled_event_rate
from sbas.integrity.part_tally import LEVEL_GRID_M, PartTally
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
from sbas.integrity.tallies import CURVE_LIMITS_M, LIMIT_KINDS, RecordTally
from sbas.recording import RecordingMeta
from sbas.timescales import NS_PER_S
from sbas.truth import Truth

_HOUR_NS = 3600 * NS_PER_S


@dataclass(frozen=True, eq=False)
class EvaluatedRecord:
    """What the figures of a record and of its parts share.

    Parameters
    ----------
    meta, settings, input, truth, merge_s : as in Evaluation.
    tally : of the whole record: its runs are those of every part.
    tau_known : False where the merge time could not be taken from a decorrelation time.
    """

    meta: RecordingMeta
    settings: EvaluationSettings
    input: CheckResult
    truth: Truth | None
    tally: RecordTally
    merge_s: float
    tau_known: bool
    _down: dict[float, Runs] = field(default_factory=dict)
    _found: dict[tuple[EventKind, float, float], tuple[Runs, Events]] = field(default_factory=dict)

    def evaluation(
        self,
        counts: PartTally,
        process: ErrorProcess,
        findings: Iterable[Finding],
        *,
        label: str = "",
        part: RecordPart | None = None,
        environments: Mapping[str, Evaluation] | None = None,
    ) -> Evaluation:
        """The figures of a part, None for the whole record.

        Parameters
        ----------
        counts, process : of the part's epochs.
        findings : about them.
        label, environments : as in Evaluation.
        part : which epochs they are.
        """
        survey, settings, truth = self.input.survey, self.settings, self.truth
        hpe = Summary.of(counts.hpe)
        exposure = self._exposure(counts, part)
        levels = counts.levels.result()

        def rate(kind: EventKind, limit: float) -> RateEvidence:
            seen = self._events(kind, limit, self.merge_s, part)
            judged = exposure.error_hours if kind == "exceeds_al" else exposure.judged_hours
            return rate_evidence(
                kind,
                limit,
                events=len(seen.events),
                runs=seen.runs,
                event_hours=seen.within_s / 3600,
                merge_hours=self.merge_s / 3600,
                judged_hours=judged - seen.after_others_s / 3600,
                confidence=settings.confidence,
                lower_bound=truth is not None and truth.lower_bound,
                modelled=modelled_event_rate(
                    kind, limit, process=process, levels=levels, confidence=settings.confidence
                ),
                caveats=self._caveats(),
            )

        limits = []
        for al in settings.alert_limits_m:
            up = availability(
                self._down_runs(al),
                survey.gaps,
                up_ns=counts.covered_ns - counts.down_ns[al],
                down_ns=counts.down_ns[al],
                interval_ns=survey.interval_ns,
                confidence=settings.confidence,
                tau_s=process.tau_upper_s,
                part=part,
            )
            if truth is None:
                limits.append(AlertLimitResult(al, up, None, {}, {}))
                continue
            regions = dict(zip(REGIONS, counts.regions[al].tolist(), strict=True))
            events = {
                kind: self._events(kind, al, settings.reset_s, part).events for kind in EVENT_KINDS
            }
            rates = {kind: rate(kind, al) for kind in EVENT_KINDS}
            limits.append(AlertLimitResult(al, up, regions, events, rates))

        def along_curve(kind: EventKind) -> tuple[RateEvidence, ...]:
            return () if truth is None else tuple(rate(kind, al) for al in CURVE_LIMITS_M)

        curves = Curves(
            level_grid_m=np.array(LEVEL_GRID_M),
            available_fraction=counts.levels_below() / max(counts.epochs, 1),
            rates={kind: along_curve(kind) for kind in LIMIT_KINDS},
            ratio_grid=counts.RATIO_GRID,
            ratio_exceeded_fraction=counts.ratio_exceeded(),
            stanford_cell_m=counts.stanford_cell_m,
            stanford_counts=counts.stanford,
        )
        assert counts.begin_ns is not None
        assert counts.end_ns is not None
        return Evaluation(
            meta=self.meta,
            settings=settings,
            input=self.input,
            findings=tuple(findings),
            truth=truth,
            epochs=counts.epochs,
            begin_ns=counts.begin_ns,
            end_ns=counts.end_ns,
            hours=exposure.recorded_hours,
            exposure=exposure,
            hpe_m=hpe,
            vpe_m=Summary.of(counts.vpe),
            hpl_m=Summary.of(counts.hpl),
            vpl_m=Summary.of(counts.vpl),
            truth_sigma_h_m=counts.truth_sigma_h_m if hpe else None,
            ellipse=ErrorEllipse(*counts.moments()) if hpe else None,
            modes=counts.modes,
            mi_epochs=counts.mi_epochs if truth is not None else None,
            alert_limits=tuple(limits),
            curves=curves,
            strips=counts.strips,
            scatter=counts.scatter,
            levels=levels,
            process=process,
            merge_s=self.merge_s,
            label=label,
            environments=environments or {},
        )

    def _exposure(self, counts: PartTally, part: RecordPart | None) -> ExposureHours:
        gaps = self.input.survey.gaps
        missing_ns = gaps.missing_ns(self.input.survey.interval_ns)
        if part is not None:
            missing_ns = missing_ns[part.holds(gaps.row - 1)]
        return ExposureHours(
            recorded_hours=counts.covered_ns / _HOUR_NS,
            gap_hours=float(missing_ns.sum()) / _HOUR_NS,
            without_error_hours=(counts.covered_ns - counts.error_ns) / _HOUR_NS,
            without_level_hours=(counts.covered_ns - counts.level_ns) / _HOUR_NS,
            judged_hours=counts.judged_ns / _HOUR_NS,
            error_hours=counts.error_ns / _HOUR_NS,
        )

    def _caveats(self) -> tuple[str, ...]:
        if self.settings.merge_s is not None or self.tau_known:
            return ()
        return (f"the decorrelation time is not known: runs were merged over {self.merge_s:g} s",)

    def _down_runs(self, alert_limit_m: float) -> Runs:
        if alert_limit_m not in self._down:
            self._down[alert_limit_m] = self.tally.down[alert_limit_m].whole()
        return self._down[alert_limit_m]

    def _events(
        self, kind: EventKind, limit: float, merge_s: float, part: RecordPart | None
    ) -> PartEvents:
        key = (kind, 0.0 if kind == "mi" else limit, merge_s)
        if key not in self._found:
            runs = self.tally.bad_runs(kind, limit)
            found = find_events(
                runs,
                interval_ns=self.tally.interval_ns,
                merge_s=merge_s,
                minimum_s=self.settings.time_to_alert_s if kind == "hmi" else 0.0,
            )
            self._found[key] = runs, found
        runs, found = self._found[key]
        return events_in(runs, found, merge_s=merge_s, part=part)
