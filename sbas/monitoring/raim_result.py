"""What RAIM says of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.findings import Finding
from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.normal_equations import Floats
from sbas.monitoring.separation import SeparationBudget
from sbas.monitoring.verdicts import MonitorReason, Verdict

LevelSource = Literal["ranges", "receiver"]

LEVEL_NAMES = (
    "herl_m", "verl_m", "erl_along_m", "erl_across_m", "hpl_slope_m", "vpl_slope_m",
    "pl_along_slope_m", "pl_across_slope_m", "hpl_separation_m", "vpl_separation_m",
    "pl_along_separation_m", "pl_across_separation_m",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class RaimResult:
    """Monitoring of every epoch of a recording.

    Parameters
    ----------
    epochs : table by time, in the recording's order: `verdict` and `reason` in words,
        `available`, `available_vertical` (there is a test, it passes, and no fault of a single
        range would escape it), `detected` (the overall test found a fault), `excluded`
        (satellites left out), `n_sv` ranges that take part, `dof`, `statistic` and `threshold` of
        the overall test, and levels [m], NaN where nothing is tested and infinite where a fault
        would not show.
    source : "ranges" where computed here, "receiver" where the receiver's own are summarised.
    design, budget : how; None with the receiver's own.
    alarm_runs : runs of successive epochs with a fault detected.
    variance_factor : median of statistic over median of chi-square, 1 where the sigmas are those
        of the errors; None without residuals.
    masked : ranges below the elevation mask.
    """

    epochs: pd.DataFrame
    source: LevelSource
    design: MonitorDesign | None
    budget: SeparationBudget | None
    track_azimuth_deg: float | None
    alarm_runs: int
    variance_factor: float | None
    masked: int
    findings: tuple[Finding, ...]

    def count(self, verdict: Verdict) -> int:
        """Epochs with a verdict."""
        return int((self.epochs["verdict"] == verdict.words).sum())

    @property
    def available(self) -> int:
        return int(self.epochs["available"].sum())

    @property
    def detected(self) -> int:
        return int(self.epochs["detected"].sum())

    @property
    def excluded(self) -> int:
        """Epochs that passed after an exclusion."""
        return self.count(Verdict.PASSED_AFTER_EXCLUSION)

    def reasons(self) -> dict[str, int]:
        """Epochs by reason, those with one."""
        counts = self.epochs["reason"].value_counts()
        return {
            r.words: int(counts[r.words])
            for r in MonitorReason
            if r.words and counts.get(r.words, 0)
        }

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; infinite levels are counted, not written."""
        n = len(self.epochs)
        levels = {
            name: spread_of(self.epochs[name].to_numpy())
            for name in LEVEL_NAMES
            if name in self.epochs.columns
        }
        return {
            "epochs": n,
            "source": self.source,
            "available": self.available,
            "available_share": self.available / n if n else None,
            "available_vertical": int(self.epochs["available_vertical"].sum()),
            "detected": self.detected,
            "alarm_runs": self.alarm_runs,
            "excluded": self.excluded,
            "verdicts": {verdict.words: self.count(verdict) for verdict in Verdict},
            "reasons": self.reasons(),
            "variance_factor": self.variance_factor,
            "masked_ranges": self.masked,
            **levels,
            "track_azimuth_deg": self.track_azimuth_deg,
            "design": None if self.design is None else dict(vars(self.design)),
            "budget": None if self.budget is None else dict(vars(self.budget)),
            "findings": [f.to_dict() for f in self.findings],
        }

    def __repr__(self) -> str:
        n = len(self.epochs)
        lines = [f"RAIM of {n:,} epochs, from the {self.source}"]
        lines += [
            f"  {verdict.words:24s}{count:,}"
            for verdict in Verdict
            if (count := self.count(verdict))
        ]
        lines += [f"    {words}: {count:,}" for words, count in self.reasons().items()]
        for name in LEVEL_NAMES:
            if name in self.epochs.columns:
                spread = spread_of(self.epochs[name].to_numpy())
                if spread["median"] is not None:
                    text = f"median {spread['median']:.4g}, 95 % {spread['p95']:.4g}"
                    lines.append(f"  {name:24s}{text} ({spread['epochs']:,} epochs)")
        lines += [str(finding) for finding in self.findings]
        return "\n".join(lines)


def spread_of(values: Floats) -> dict[str, Any]:
    """Order statistics of finite levels, and how many are infinite; None where there is none."""
    finite = values[np.isfinite(values)]
    figures: dict[str, Any] = {
        "epochs": int(finite.size),
        "infinite": int(np.isinf(values).sum()),
    }
    for name, share in (("median", 0.5), ("p95", 0.95), ("max", 1.0)):
        figures[name] = float(np.quantile(finite, share)) if finite.size else None
    return figures


def worded_table(columns: dict[str, NDArray[Any]], names: tuple[str, ...]) -> pd.DataFrame:
    """The table with words for numbers and names for slots."""
    data: dict[str, Any] = dict(columns)
    for name, kind in (("verdict", Verdict), ("reason", MonitorReason)):
        data[name] = pd.Categorical.from_codes(columns[name], categories=[k.words for k in kind])
    slots = [data.pop(name) for name in list(data) if name.startswith("excluded")]
    lookup = np.array([*names, ""], dtype=object)
    text = lookup[slots[0]]
    for slot in slots[1:]:
        second = lookup[slot]
        text = text + np.where(second != "", " ", "") + second
    data["excluded"] = pd.Categorical(text.astype(str))
    order = ["verdict", "reason", "available", "available_vertical", "detected", "excluded"]
    return pd.DataFrame({**{name: data[name] for name in order}, **data}, copy=False)


def alarm_runs(event: NDArray[np.bool_], time: NDArray[np.datetime64]) -> int:
    """Runs of successive epochs; a time step above one and a half of the usual one ends a run."""
    step = np.diff(time.astype("M8[ns]").astype(np.int64))
    usual = float(np.median(step)) if step.size else 0.0
    joined = event[1:] & event[:-1] & (np.abs(step) <= 1.5 * usual)
    return int(event.sum() - joined.sum())
