"""Which rate of dangerous failures per hour a recording lets its user claim."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sbas.estimate import Estimate, Refusal
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.integrity.evaluation import evaluation_of
from sbas.integrity.rate_evidence import EVENT_KINDS, EventKind, RateEvidence
from sbas.integrity.results import EvaluationSettings
from sbas.integrity.sil import SilVerdict, TargetVerdict, meets, sil_verdict
from sbas.logs.format import Progress
from sbas.recording import EpochSource
from sbas.truth import Truth


@dataclass(frozen=True)
class FailureRate:
    """A rate in its evidence classes, with the verdict that its upper bound allows.

    `environment` is the label that it is restricted to; None for the whole recording.
    """

    evidence: RateEvidence
    confidence: float
    sil: SilVerdict | Refusal
    target: TargetVerdict | Refusal | None
    findings: tuple[Finding, ...]
    environment: str | None = None

    @property
    def demonstrated(self) -> bool:
        """True when what was asked is demonstrated: the target, or without one any rate at all."""
        if self.target is None:
            return isinstance(self.evidence.demonstrated, Estimate)
        return isinstance(self.target, TargetVerdict) and self.target.demonstrated

    def to_dict(self) -> dict[str, Any]:
        return {
            **self.evidence.to_dict(),
            "confidence": self.confidence,
            "sil": self.sil.to_dict(),
            "target": None if self.target is None else self.target.to_dict(),
            "environment": self.environment,
            "findings": [f.to_dict() for f in self.findings],
        }


def failure_rate(
    source: EpochSource,
    *,
    truth: Truth | None,
    alert_limit_m: float,
    confidence: float = 0.95,
    event: EventKind = "hmi",
    target_per_h: float | None = None,
    environment: str | None = None,
    time_to_alert_s: float = EvaluationSettings.time_to_alert_s,
    merge_s: float | None = EvaluationSettings.merge_s,
    accept_findings: Iterable[str] = (),
    progress: Progress | None = None,
) -> FailureRate:
    """The rate of dangerous events per hour of exposure, and what it demonstrates.

    Parameters
    ----------
    source, truth, time_to_alert_s, merge_s, accept_findings, progress : as for `evaluate`.
    alert_limit_m : horizontal alert limit [m].
    confidence : of the one-sided upper bound.
    event : "hmi" (HPE >= AL and HPL < AL for the time to alert), "mi" (HPE >= HPL) or
        "exceeds_al" (HPE >= AL whatever the HPL).
    target_per_h : rate to be demonstrated [1/h]; only the upper bound decides.
    environment : count the epochs with this label only, see docs/methods/environments.md.

    Raises
    ------
    InputError : the input check found an error, a moving recording has no truth (E01), or no
        epoch has the label.

    References
    ----------
    F. Garwood, Biometrika 28 (1936) 437; IEC 61508-1, 7.6.2; Filip, Bazant, Mocek 2010, 2.2.
    """
    if event not in EVENT_KINDS:
        raise InputError(
            f"unknown event {event!r}", cure=f"--event with one of {', '.join(EVENT_KINDS)}"
        )
    settings = EvaluationSettings(
        (float(alert_limit_m),),
        time_to_alert_s,
        merge_s,
        EvaluationSettings.reset_s,
        confidence,
        tuple(accept_findings),
    )
    labels = () if environment is None else (environment,)
    evaluation = evaluation_of(source, settings, truth=truth, labels=labels, progress=progress)
    if evaluation.truth is None:
        raise InputError(
            "no truth, and the recording's own median cannot serve: no error rate",
            code="E01",
            evidence="; ".join(f.message for f in evaluation.findings if f.code == "E01"),
            cure="--truth LAT,LON,HEIGHT or --truth TRAJECTORY.csv",
        )
    findings = evaluation.findings
    if environment is not None:
        evaluation = evaluation.environments[environment]
        findings = (*findings, *evaluation.findings)
    evidence = evaluation.at(float(alert_limit_m)).rates[event]
    sil: SilVerdict | Refusal
    target: TargetVerdict | Refusal | None = None
    if isinstance(evidence.demonstrated, Refusal):
        sil = evidence.demonstrated
        target = None if target_per_h is None else evidence.demonstrated
    else:
        sil = sil_verdict(evidence.demonstrated)
        if target_per_h is not None:
            target = meets(evidence.demonstrated, target_per_h)
    return FailureRate(evidence, confidence, sil, target, findings, environment)
