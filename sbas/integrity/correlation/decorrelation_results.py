"""What the question of the decorrelation time answers: frozen data, with text, table and JSON."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import pandas as pd

from sbas.estimate import Estimate, Refusal
from sbas.findings import Finding
from sbas.integrity.correlation.autocorrelation import Floats
from sbas.integrity.correlation.two_processes import TwoProcesses, seconds_text

ASSUMED_TAU_S = 360.0
"""What ten independent samples an hour suppose (RTCA DO-229; Filip, Bazant, Mocek 2010, 2.1.2)."""
CONFIRMING_RATIO = 1.5
"""An interval that holds 360 s confirms it only if its ends are at most this factor apart."""

Misfit = Literal["gm1", "smooth", "mixture", "mostly_white", "record_too_short"]
Verdict = Literal["confirmed", "longer", "shorter", "cannot_be_told"]

MISFITS: dict[Misfit, str] = {
    "gm1": "one Gauss-Markov process (with white noise) describes it",
    "smooth": "smoother than a Gauss-Markov process: exceedances are rarer than tau says",
    "mixture": "a mixture: one time constant does not describe it",
    "mostly_white": "most of the variance is white at this step",
    "record_too_short": "the record is too short for its correlation",
}
"""How well one Gauss-Markov process describes a record, in words."""

DEFINITIONS = {
    "robust_fit_s": "exponential fit of r from 0.9 to 0.3, not corrected for its bias",
    "first_1_over_e_s": "first lag with r below 1/e",
    "crossing_0_05_third_s": "a third of the first lag with r below 0.05",
    "integrated_s": "integral of r up to its first zero",
    "ar1_lag1_s": "-step/ln r(step), which white noise shortens",
    "first_zero_s": "first lag with r below 0: no decorrelation time at all",
}
"""Other times that are called decorrelation time; they are not interchangeable."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Autocorrelation that a picture draws: lags [s], mean of the components, and each of them.

    `sigma` (m,) is the sampling error about the fitted process; empty without a tau.
    """

    lag_s: Floats
    r: Floats
    components: Floats
    sigma: Floats


@dataclass(frozen=True, eq=False)
class Decorrelation:
    """How long errors stay correlated.

    Parameters
    ----------
    label : of the piece of the recording; "" for the whole.
    tau_s : median-unbiased 1/e time of the errors' correlation with its two-sided interval [s],
        or why there is none.
    tau_low_s, tau_high_s : ends of the interval [s]; a high end of None beside a low end says
        that the record does not bound it.
    confidence : of the interval.
    misfit : whether one Gauss-Markov process describes the record; None without correlation.
    nugget : white share of the variance at this step.
    short_lag_exponent : alpha, near 1 for Gauss-Markov, 2 for a smooth process.
    late_over_early : tau of the late part of the correlation over that of the early one.
    two_processes : the parts of a mixture, else None.
    component_tau_s : robust fit of each component [s]; None where it does not end.
    definitions : other times by name, see `DEFINITIONS` [s].
    cross_correlation : of east and north at lag 0.
    step_s, samples, span_s, recorded_s : step, known epochs, length with and without gaps.
    clipped : epochs clipped as outliers.
    curve : for the picture, None without correlation.
    findings : what a reader of the figures must know about the data.
    pieces : the same by segment, where segments were asked for.
    """

    label: str
    tau_s: Estimate | Refusal
    tau_low_s: float | None
    tau_high_s: float | None
    confidence: float
    misfit: Misfit | None = None
    nugget: float | None = None
    short_lag_exponent: float | None = None
    late_over_early: float | None = None
    two_processes: TwoProcesses | None = None
    component_tau_s: dict[str, float | None] | None = None
    definitions: dict[str, float | None] | None = None
    cross_correlation: float | None = None
    step_s: float | None = None
    samples: int = 0
    span_s: float | None = None
    recorded_s: float | None = None
    clipped: int = 0
    curve: Curve | None = None
    findings: tuple[Finding, ...] = ()
    pieces: tuple[Decorrelation, ...] = ()

    @property
    def white_share(self) -> float:
        """Largest white share of the variance that the first lag allows, beside tau.

        1 - r(dt) exp(dt/tau), at least 0: what tau does not explain of the fall within one step.
        It never takes an error for slower than it is, as the nugget of a fit can; 0 without tau.
        """
        if self.curve is None or isinstance(self.tau_s, Refusal) or self.step_s is None:
            return 0.0
        r1 = float(self.curve.r[1])
        return min(max(0.0, 1 - r1 * math.exp(self.step_s / self.tau_s.value)), 0.99)

    @property
    def verdict_on_360_s(self) -> Verdict:
        """Is the decorrelation time the 360 s that K = 6.18 supposes?"""
        low, high = self.tau_low_s, self.tau_high_s
        if self.misfit == "mixture" or low is None:
            return "cannot_be_told"
        if low > ASSUMED_TAU_S:
            return "longer"
        if high is not None and high < ASSUMED_TAU_S:
            return "shorter"
        narrow = high is not None and high <= CONFIRMING_RATIO * low
        return "confirmed" if narrow and isinstance(self.tau_s, Estimate) else "cannot_be_told"

    @property
    def interval_text(self) -> str:
        """The interval in words."""
        if self.tau_low_s is None:
            return "no interval"
        at = f"at {100 * self.confidence:.12g} %"
        if self.tau_high_s is None:
            return f"from {seconds_text(self.tau_low_s)} without an upper limit {at}"
        return f"from {seconds_text(self.tau_low_s)} to {seconds_text(self.tau_high_s)} {at}"

    @property
    def verdict_text(self) -> str:
        """The verdict on 360 s in a sentence."""
        verdict, interval = self.verdict_on_360_s, self.interval_text
        if self.misfit == "mixture":
            parts = "" if self.two_processes is None else f" ({self.two_processes})"
            return f"one time constant does not describe this record{parts}: 360 s is no answer"
        if self.misfit is None or self.tau_low_s is None:
            return "whether the errors decorrelate in 360 s cannot be told from this record"
        if verdict == "cannot_be_told":
            return f"the record is too short to confirm or reject 360 s: tau lies {interval}"
        if verdict == "confirmed":
            return f"360 s is confirmed: tau lies {interval}"
        scarce = ", though the record is too short for a figure" if self._refused else ""
        return f"the errors stay correlated {verdict} than 360 s: tau lies {interval}{scarce}"

    @property
    def _refused(self) -> bool:
        return isinstance(self.tau_s, Refusal)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; missing is None."""
        return {
            "label": self.label,
            "tau_s": None if isinstance(self.tau_s, Refusal) else self.tau_s.value,
            "tau_low_s": self.tau_low_s,
            "tau_high_s": self.tau_high_s,
            "confidence": self.confidence,
            "estimate": self.tau_s.to_dict(),
            "misfit": self.misfit,
            "misfit_text": None if self.misfit is None else MISFITS[self.misfit],
            "verdict_on_360_s": self.verdict_on_360_s,
            "verdict": self.verdict_text,
            "nugget": self.nugget,
            "white_share": self.white_share,
            "short_lag_exponent": self.short_lag_exponent,
            "late_over_early": self.late_over_early,
            "two_processes": None if self.two_processes is None else self.two_processes.to_dict(),
            "component_tau_s": self.component_tau_s,
            "definitions": self.definitions,
            "cross_correlation": self.cross_correlation,
            "step_s": self.step_s,
            "samples": self.samples,
            "span_s": self.span_s,
            "recorded_s": self.recorded_s,
            "clipped": self.clipped,
            "findings": [f.to_dict() for f in self.findings],
            "pieces": [piece.to_dict() for piece in self.pieces],
        }

    def summary(self) -> pd.DataFrame:
        """A row a figure, for the whole and every piece: value, ends, unit and meaning."""
        rows = [row for part in (self, *self.pieces) for row in part._rows()]
        columns = ["piece", "figure", "value", "lower", "upper", "unit", "meaning"]
        return pd.DataFrame(rows, columns=columns).set_index(["piece", "figure"])

    def _rows(self) -> list[tuple[Any, ...]]:
        value = None if isinstance(self.tau_s, Refusal) else self.tau_s.value
        meaning = str(self.tau_s) if self._refused else "1/e time of the correlation"
        name = self.label or "whole"
        rows = [
            (name, "tau_s", value, self.tau_low_s, self.tau_high_s, "s", meaning),
            (name, "nugget", self.nugget, None, None, "1", "white share of the variance"),
        ]
        for key, seconds in (self.component_tau_s or {}).items():
            rows.append((name, f"tau_{key}_s", seconds, None, None, "s", f"robust fit, {key}"))
        for key, seconds in (self.definitions or {}).items():
            rows.append((name, key, seconds, None, None, "s", DEFINITIONS[key]))
        return rows

    def __str__(self) -> str:
        head = f"Decorrelation of {self.label or 'the recording'}"
        if self.samples and self.step_s:
            head += f": {self.samples:,} epochs, {self.step_s:.6g} s apart"
        lines = [head, f"  tau      {self.tau_s}", f"  interval {self.interval_text}"]
        if self.misfit is not None:
            lines.append(f"  process  {self.misfit}: {MISFITS[self.misfit]}")
        lines.append(f"  360 s    {self.verdict_text}")
        for key, seconds in (self.definitions or {}).items():
            text = "not reached" if seconds is None else f"{seconds:.4g} s"
            lines.append(f"  {key:22s}{text:12s}{DEFINITIONS[key]}")
        lines += [f"  {f.code} {f.severity}: {f.message}" for f in self.findings]
        lines += [str(piece) for piece in self.pieces]
        return "\n".join(lines)
