"""What an evaluation answers: frozen data, with text, a table and JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.estimate import Refusal
from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.input_check import CheckResult
from sbas.integrity.availability import Availability
from sbas.integrity.counting import checked_alpha
from sbas.integrity.error_process import ErrorProcess
from sbas.integrity.events import Events
from sbas.integrity.level_counts import LevelCounts
from sbas.integrity.rate_evidence import EventKind, RateEvidence
from sbas.numerals import key
from sbas.recording import RecordingMeta
from sbas.streaming import DensityGrid, Distribution, ThinnedSeries
from sbas.timescales import NS_PER_S
from sbas.track import TrackLine
from sbas.truth import Truth

if TYPE_CHECKING:
    from sbas.integrity.railway_judgement import RailwayJudgement


_LONGEST_S = 1e9


@dataclass(frozen=True)
class EvaluationSettings:
    """What an evaluation is asked; every default is echoed in its result.

    Parameters
    ----------
    alert_limits_m : horizontal alert limits [m].
    time_to_alert_s : an HMI event lasts at least this [s]; 10 s is NPA's, 6 s PA's
        (Navipedia, EGNOS Performances).
    merge_s : runs closer than this are one event of a rate [s]; None is max(tau/2, 60 s) of the
        measured decorrelation time. Runs are merged before the time to alert is asked of them,
        so that flicker counts as one lasting event.
    reset_s : merge time of the event list: what the user system needs to be reset [s].
    confidence : of every one-sided bound.
    accept : finding codes that the user accepts.
    """

    alert_limits_m: tuple[float, ...] = (50.0, 25.0, 20.0)
    time_to_alert_s: float = 10.0
    merge_s: float | None = None
    reset_s: float = 0.0
    confidence: float = 0.95
    accept: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        limits = self.alert_limits_m
        if not limits or not all(0 < al < math.inf for al in limits):
            raise InputError(
                "alert limits are metres above 0",
                evidence=f"got {limits}",
                cure="--alert-limit 50,25,20",
            )
        if len(set(limits)) < len(limits):
            raise InputError("an alert limit is given twice", evidence=f"got {limits}")
        for name in ("time_to_alert_s", "merge_s", "reset_s"):
            value = getattr(self, name)
            if value is not None and not 0 <= value <= _LONGEST_S:
                raise InputError(f"{name} must be 0 s to {_LONGEST_S:g} s", evidence=f"{value}")
        checked_alpha(self.confidence)


@dataclass(frozen=True)
class Summary:
    """Order statistics of a quantity over its known epochs [m].

    `resolution_m` bounds the error of median and 95 % value: 0 while they are exact.
    """

    min: float
    median: float
    p95: float
    max: float
    mean: float
    epochs: int
    resolution_m: float

    @classmethod
    def of(cls, seen: Distribution) -> Summary | None:
        """None when no value has come."""
        if seen.count == 0:
            return None
        median, p95 = seen.quantile(0.5), seen.quantile(0.95)
        return cls(seen.min, median, p95, seen.max, seen.mean, seen.count, seen.error)


@dataclass(frozen=True)
class ErrorEllipse:
    """First and second moments of the horizontal error: mean [m] and covariance [m2]."""

    mean_e_m: float
    mean_n_m: float
    var_e_m2: float
    var_n_m2: float
    cov_en_m2: float

    def axes(self) -> tuple[float, float, float]:
        """1-sigma major and minor semi-axis [m] and the major one's azimuth from north [deg]."""
        matrix = [[self.var_e_m2, self.cov_en_m2], [self.cov_en_m2, self.var_n_m2]]
        values, vectors = np.linalg.eigh(np.array(matrix))
        minor, major = np.sqrt(np.maximum(values, 0.0))
        azimuth = float(np.degrees(np.arctan2(vectors[0, 1], vectors[1, 1]))) % 180
        return float(major), float(minor), azimuth


@dataclass(frozen=True)
class ExposureHours:
    """The hours that figures rest on, and why the others do not count [h]."""

    recorded_hours: float
    gap_hours: float
    without_error_hours: float
    without_level_hours: float
    judged_hours: float
    error_hours: float


@dataclass(frozen=True)
class AlertLimitResult:
    """Everything that depends on one alert limit."""

    alert_limit_m: float
    availability: Availability
    regions: dict[str, int] | None
    events: dict[EventKind, Events]
    rates: dict[EventKind, RateEvidence]


@dataclass(frozen=True, eq=False)
class Curves:
    """What is drawn against the alert limit, and the density of the Stanford diagram.

    `available_fraction` (g,) at `level_grid_m`; `rates` a kind of event along rising alert
    limits, empty without truth; `ratio_exceeded_fraction` (r,), share of judged epochs with
    HPE/HPL >= `ratio_grid`;
    `stanford_counts` (rows HPL, columns HPE) in cells of `stanford_cell_m`, the last ones open.
    """

    level_grid_m: NDArray[np.float64]
    available_fraction: NDArray[np.float64]
    rates: dict[EventKind, tuple[RateEvidence, ...]]
    ratio_grid: NDArray[np.float64]
    ratio_exceeded_fraction: NDArray[np.float64]
    stanford_cell_m: float
    stanford_counts: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The answer of `evaluate`: of a record, and by environment where its epochs have labels.

    Parameters
    ----------
    input : check of the whole record.
    begin_ns, end_ns : GPS times of the first and the last epoch [ns].
    merge_s : merge time of the events of rates [s]: as set, else from the decorrelation time of
        the whole record, also in an environment.
    label : the environment that the figures are of; empty for the whole record.
    environments : the same figures by label, in order of first appearance, epochs without one
        under "unlabelled"; empty where no epoch has a label. Epochs and hours of all sum to
        those of the record; what happens at their borders: docs/methods/environments.md.
    """

    meta: RecordingMeta
    settings: EvaluationSettings
    input: CheckResult
    findings: tuple[Finding, ...]
    truth: Truth | None
    epochs: int
    begin_ns: int
    end_ns: int
    hours: float
    exposure: ExposureHours
    hpe_m: Summary | None
    vpe_m: Summary | None
    hpl_m: Summary | None
    vpl_m: Summary | None
    truth_sigma_h_m: float | None
    ellipse: ErrorEllipse | None
    modes: dict[str, int]
    mi_epochs: int | None
    alert_limits: tuple[AlertLimitResult, ...]
    curves: Curves
    strips: ThinnedSeries
    scatter: DensityGrid
    levels: LevelCounts
    process: ErrorProcess
    merge_s: float
    label: str = ""
    environments: Mapping[str, Evaluation] = field(default_factory=dict)

    @cached_property
    def railway(self) -> RailwayJudgement | Refusal:
        """What K the measured errors need for 5e-8 per hour, and the verdict on 6.18."""
        from sbas.integrity.railway_judgement import railway_judgement  # it reads this class

        return railway_judgement(self)

    @property
    def errors_are_lower_bound(self) -> bool:
        return self.truth is not None and self.truth.lower_bound

    @property
    def lower_bound_words(self) -> str:
        """Why the errors are too small, where they are."""
        if isinstance(self.truth, TrackLine):
            return "a lower bound: only their part across the track is seen"
        return "a lower bound: formed against the recording's own median"

    def at(self, alert_limit_m: float) -> AlertLimitResult:
        """The result at one of the alert limits."""
        for result in self.alert_limits:
            if result.alert_limit_m == alert_limit_m:
                return result
        raise KeyError(alert_limit_m)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "epochs": self.epochs,
            "hours": self.hours,
            "begin_gpst": _stamp(self.begin_ns),
            "end_gpst": _stamp(self.end_ns),
            "interval_s": self.input.survey.interval_ns / NS_PER_S,
            "truth": None if self.truth is None else self.truth.label,
            "errors_are_lower_bound": self.errors_are_lower_bound,
            "truth_sigma_h_m": self.truth_sigma_h_m,
            **{name: _plain(getattr(self, name)) for name in ("hpe_m", "vpe_m", "hpl_m", "vpl_m")},
            "mi_epochs": self.mi_epochs,
            "modes": self.modes,
            "exposure": dict(vars(self.exposure)),
            "settings": dict(vars(self.settings)),
            "merge_s": self.merge_s,
            "decorrelation": self.process.decorrelation.to_dict(),
            "sigma_ratio": self.process.sigma_ratio,
            "railway": self.railway.to_dict(),
            "alert_limits": {key(r.alert_limit_m): _limit_dict(r) for r in self.alert_limits},
            "findings": [f.to_dict() for f in self.findings],
            "sources": [dict(vars(s)) for s in self.meta.sources],
            "environments": {name: e.to_dict() for name, e in self.environments.items()},
        }

    def summary(self) -> Any:
        """A DataFrame of the rates: a row an event kind and alert limit."""
        rows = [
            {
                "alert_limit_m": limit.alert_limit_m,
                "event": kind,
                "events": rate.events,
                "hours": rate.hours,
                "upper_per_h": getattr(rate.demonstrated, "upper", None),
                "demonstrated": str(rate.demonstrated),
                "modelled": str(rate.modelled),
                "availability": limit.availability.availability.value,
            }
            for limit in self.alert_limits
            for kind, rate in limit.rates.items()
        ]
        heads = ("alert_limit_m", "event", "events", "hours", "upper_per_h", "demonstrated",
                 "availability")  # fmt: skip
        return pd.DataFrame(rows, columns=heads).set_index(["alert_limit_m", "event"])

    def __str__(self) -> str:
        lines = [f"{self.epochs:,} epochs, {self.hours:.6g} h recorded"]
        for name, label in (("hpe_m", "HPE"), ("hpl_m", "HPL")):
            seen: Summary | None = getattr(self, name)
            if seen:
                lines.append(
                    f"{label} min/median/95 %/max {seen.min:.3f}/{seen.median:.3f}/"
                    f"{seen.p95:.3f}/{seen.max:.3f} m over {seen.epochs:,} epochs"
                )
        return "\n".join(lines)


def _plain(summary: Summary | None) -> dict[str, Any] | None:
    return None if summary is None else dict(vars(summary))


def _limit_dict(result: AlertLimitResult) -> dict[str, Any]:
    up = result.availability
    return {
        "alert_limit_m": result.alert_limit_m,
        "availability": up.availability.value,
        "availability_excluding_gaps": up.availability_excluding_gaps.value,
        "availability_estimate": up.availability.to_dict(),
        "mttf": up.mttf.to_dict(),
        "mttr": None if up.mttr is None else up.mttr.to_dict(),
        "losses": up.losses,
        "continuity_risk": up.continuity_risk,
        "continuity_risk_excluding_gaps": up.continuity_risk_excluding_gaps,
        "continuity_window_epochs": up.continuity_window_epochs,
        "regions": result.regions,
        "events": {
            kind: [
                {
                    "start_gpst": _stamp(int(start)),
                    "duration_s": float(duration),
                    "censored": bool(cut),
                }
                for start, duration, cut in zip(
                    events.start_ns, events.duration_s, events.censored, strict=True
                )
            ]
            for kind, events in result.events.items()
        },
        "rates": {kind: rate.to_dict() for kind, rate in result.rates.items()},
    }


def _stamp(ns: int) -> str:
    return str(np.datetime64(ns, "ns"))
