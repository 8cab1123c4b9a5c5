"""What a comparison of two recordings answers: frozen data, words and JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from sbas.estimate import Estimate, Refusal
from sbas.findings import Finding
from sbas.integrity.comparison.paired_differences import ConstantOffset
from sbas.integrity.events import Events
from sbas.numerals import key
from sbas.streaming import ThinnedSeries
from sbas.truth import Truth

PAPER_TAU_S = 360.0
"""Decorrelation time behind the "10 independent samples per hour"; Filip, Bazant, Mocek 2010,
2.2: an assumption there, and called several times too short."""


@dataclass(frozen=True)
class ComparisonSettings:
    """What a comparison was asked; see `compare`."""

    alert_limits_m: tuple[float, ...]
    tau_s: float
    merge_s: float
    confidence: float
    accept: tuple[str, ...]


@dataclass(frozen=True)
class Spread:
    """A signed difference over its known epochs [m]: median, and 95 % and largest size."""

    median: float
    p95: float
    max: float
    epochs: int


@dataclass(frozen=True)
class Differences:
    """Position of A less that of B at the same instant [m].

    `median` and `p95` are of the horizontal distance, with their intervals; `max` is its
    largest value, `max_time_ns` when. `east`, `north`, `up` are signed.
    """

    epochs: int
    median: Estimate
    p95: Estimate
    max: float
    max_time_ns: int
    east: Spread
    north: Spread
    up: Spread | None
    interpolated: int
    max_shift_s: float


@dataclass(frozen=True)
class LevelRatio:
    """HPL of A over HPL of B at the same epochs.

    `expected` is the ratio of the K factors, which equal sigmas would give; `sigma_ratio` is the
    median of d_major = HPL/K of A over B. Both are Refusals where a K is not known.
    """

    median: Estimate
    expected: float | Refusal
    sigma_ratio: Estimate | Refusal


@dataclass(frozen=True)
class ErrorSummary:
    """Horizontal errors of one recording at the paired epochs [m], and its MI epochs."""

    median: float
    p95: float
    max: float
    mi_epochs: int
    epochs: int


@dataclass(frozen=True)
class AvailabilityComparison:
    """Both availabilities at one alert limit, and the time in which just one was up.

    An epoch that a recording lacks within the shared span counts as down for it; the
    `recorded_both` shares leave such epochs out. `difference` is A less B; `only_a`, `only_b`
    are the discordant events as rates per hour, with two-sided exact Poisson limits.
    """

    alert_limit_m: float
    availability_a: Estimate
    availability_b: Estimate
    recorded_both_a: float
    recorded_both_b: float
    difference: Estimate | Refusal
    only_a: Estimate
    only_b: Estimate
    only_a_s: float
    only_b_s: float


@dataclass(frozen=True, eq=False)
class DropOuts:
    """Events in which a recording left the PA mode.

    `to_mode` and `condition` are one a event: the mode after, and the PA condition of FBM 2.3.1
    that the columns show violated, if any.
    """

    events: Events
    to_mode: tuple[str, ...]
    condition: tuple[str, ...]
    rate: Estimate

    def to_dict(self) -> dict[str, Any]:
        rows = zip(
            self.events.start_ns, self.events.duration_s, self.events.censored, self.to_mode,
            self.condition, strict=True,
        )  # fmt: skip
        return {
            "rate": self.rate.to_dict(),
            "events": [
                {
                    "start_gpst": _stamp(int(start)),
                    "duration_s": float(duration),
                    "censored": bool(cut),
                    "to_mode": mode,
                    "condition": condition,
                }
                for start, duration, cut, mode, condition in rows
            ],
        }


@dataclass(frozen=True, eq=False)
class Comparison:
    """The answer of `compare`.

    `epochs_a`, `epochs_b` are all epochs, `outside_*` those beyond the shared span, `unpaired_*`
    those within it without a partner, of which `between_*` only because the other recording is
    coarser. `strips` holds both recordings' speed, HDOP and satellites and their distance.
    """

    settings: ComparisonSettings
    label_a: str
    label_b: str
    truth: Truth | None
    static: bool
    interval_s: float
    begin_ns: int
    end_ns: int
    epochs_a: int
    epochs_b: int
    paired: int
    outside_a: int
    outside_b: int
    unpaired_a: int
    unpaired_b: int
    between_a: int
    between_b: int
    max_offset_s: float
    difference: Differences | Refusal
    offset: ConstantOffset | None
    hpl_ratio: LevelRatio | Refusal
    error_a: ErrorSummary | None
    error_b: ErrorSummary | None
    alert_limits: tuple[AvailabilityComparison, ...]
    drop_outs_a: DropOuts | None
    drop_outs_b: DropOuts | None
    verdict: tuple[str, ...]
    caveats: tuple[str, ...]
    findings: tuple[Finding, ...]
    strips: ThinnedSeries

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        counts = (
            "epochs_a", "epochs_b", "paired", "outside_a", "outside_b", "unpaired_a",
            "unpaired_b", "between_a", "between_b",
        )  # fmt: skip
        offset = self.offset
        return {
            "label_a": self.label_a,
            "label_b": self.label_b,
            "truth": None if self.truth is None else self.truth.label,
            "static": self.static,
            "begin_gpst": _stamp(self.begin_ns),
            "end_gpst": _stamp(self.end_ns),
            "interval_s": self.interval_s,
            **{name: getattr(self, name) for name in counts},
            "max_offset_s": self.max_offset_s,
            "difference_m": _difference_dict(self.difference),
            "constant_offset": None
            if offset is None
            else {
                "frame": offset.frame,
                "offset_m": list(offset.offset_m),
                "scatter_m": list(offset.scatter_m),
                "delay_s": offset.delay_s,
                "effective": offset.effective,
                "text": str(offset),
            },
            "hpl_ratio": _ratio_dict(self.hpl_ratio),
            "error_a_m": None if self.error_a is None else dict(vars(self.error_a)),
            "error_b_m": None if self.error_b is None else dict(vars(self.error_b)),
            "availability_a": {
                key(r.alert_limit_m): r.availability_a.value for r in self.alert_limits
            },
            "availability_b": {
                key(r.alert_limit_m): r.availability_b.value for r in self.alert_limits
            },
            "alert_limits": {key(r.alert_limit_m): _limit_dict(r) for r in self.alert_limits},
            "drop_outs_a": None if self.drop_outs_a is None else self.drop_outs_a.to_dict(),
            "drop_outs_b": None if self.drop_outs_b is None else self.drop_outs_b.to_dict(),
            "verdict": list(self.verdict),
            "caveats": list(self.caveats),
            "settings": dict(vars(self.settings)),
            "findings": [f.to_dict() for f in self.findings],
        }

    def summary(self) -> Any:
        """A DataFrame of the availabilities: a row an alert limit."""
        rows = [
            {
                "alert_limit_m": r.alert_limit_m,
                "availability_a": str(r.availability_a),
                "availability_b": str(r.availability_b),
                "difference": str(r.difference),
                "only_a": str(r.only_a),
                "only_b": str(r.only_b),
            }
            for r in self.alert_limits
        ]
        return pd.DataFrame(rows).set_index("alert_limit_m")

    def __str__(self) -> str:
        return "\n".join((*self.verdict, *(f"  note: {text}" for text in self.caveats)))


def _difference_dict(found: Differences | Refusal) -> dict[str, Any]:
    if isinstance(found, Refusal):
        return found.to_dict()
    return {
        "median": found.median.value,
        "p95": found.p95.value,
        "max": found.max,
        "max_gpst": _stamp(found.max_time_ns),
        "epochs": found.epochs,
        "median_estimate": found.median.to_dict(),
        "p95_estimate": found.p95.to_dict(),
        "east": dict(vars(found.east)),
        "north": dict(vars(found.north)),
        "up": None if found.up is None else dict(vars(found.up)),
        "interpolated": found.interpolated,
        "max_shift_s": found.max_shift_s,
    }


def _ratio_dict(ratio: LevelRatio | Refusal) -> dict[str, Any]:
    if isinstance(ratio, Refusal):
        return ratio.to_dict()
    expected = ratio.expected
    return {
        "median": ratio.median.value,
        "median_estimate": ratio.median.to_dict(),
        "expected_at_equal_sigma": expected.to_dict()
        if isinstance(expected, Refusal)
        else expected,
        "sigma_ratio": ratio.sigma_ratio.to_dict(),
    }


def _limit_dict(result: AvailabilityComparison) -> dict[str, Any]:
    plain = ("alert_limit_m", "recorded_both_a", "recorded_both_b", "only_a_s", "only_b_s")
    figures = ("availability_a", "availability_b", "difference", "only_a", "only_b")
    return {
        **{name: getattr(result, name) for name in plain},
        **{name: getattr(result, name).to_dict() for name in figures},
    }


def _stamp(ns: int) -> str:
    return str(np.datetime64(ns, "ns"))
