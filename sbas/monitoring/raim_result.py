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
from sbas.monitoring.recorded_ranges import Sigma
from sbas.monitoring.separation import SeparationBudget
from sbas.monitoring.verdicts import MonitorReason, Verdict

LevelSource = Literal["ranges", "receiver"]
ResultSource = Literal["ranges", "receiver", "written"]

SOURCE_WORDS: dict[ResultSource, str] = {
    "ranges": "computed here from the ranges of each fix",
    "receiver": "as the recording has it: flags and herl_m of its receiver, or of whoever wrote "
    "the file; their settings are not stated",
    "written": "as sbas computed it earlier from ranges and wrote it into the recording: no "
    "receiver reported it",
}
"""Who made the verdicts and levels."""

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
        (satellites left out), `n_sv` ranges that take part (-1 where they are not those of the
        fix, or not known), `dof`, `statistic` and `threshold` of the overall test of all of them,
        `n_sv_left` ranges after an exclusion, and levels [m], NaN where nothing is tested and
        infinite where a fault would not show. Levels of an epoch that passed after an exclusion
        are those of the ranges left, without the risk of a wrong exclusion.
    source : "ranges" where computed here; "receiver" where the recording's own flags and levels
        are summarised; "written" where these were computed and written by `with_raim_flags`.
    design, budget, track_azimuth_deg, sigma, elevation_mask_deg : how; of "written" as it was
        written, of "receiver" none is known.
    alarm_runs : runs of successive epochs with a fault detected.
    variance_factor : median of statistic over median of chi-square, 1 where the sigmas are those
        of the errors; None without residuals.
    masked : ranges below the elevation mask.
    """

    epochs: pd.DataFrame
    source: ResultSource
    design: MonitorDesign | None
    budget: SeparationBudget | None
    track_azimuth_deg: float | None
    alarm_runs: int
    variance_factor: float | None
    masked: int
    findings: tuple[Finding, ...]
    sigma: Sigma = None
    elevation_mask_deg: float | None = None

    def count(self, verdict: Verdict) -> int:
        """Epochs with a verdict."""
        return int((self.epochs["verdict"] == verdict.words).sum())

    @property
    def available(self) -> int:
        return int(self.epochs["available"].sum())

    @property
    def available_vertical(self) -> int:
        return int(self.epochs["available_vertical"].sum())

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
        """Plain values for JSON; an infinite level is counted, and null where it would stand."""
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
            "available_vertical": self.available_vertical,
            "detected": self.detected,
            "alarm_runs": self.alarm_runs,
            "excluded": self.excluded,
            "verdicts": {verdict.words: self.count(verdict) for verdict in Verdict},
            "reasons": self.reasons(),
            "variance_factor": self.variance_factor,
            "masked_ranges": self.masked,
            **levels,
            "track_azimuth_deg": self.track_azimuth_deg,
            "sigma": self.sigma,
            "elevation_mask_deg": self.elevation_mask_deg,
            "design": None if self.design is None else dict(vars(self.design)),
            "budget": None if self.budget is None else dict(vars(self.budget)),
            "findings": [f.to_dict() for f in self.findings],
        }

    def __repr__(self) -> str:
        n = len(self.epochs)
        lines = [f"RAIM of {n:,} epochs, {SOURCE_WORDS[self.source]}"]
        lines += [
            f"  {verdict.words:24s}{count:,}"
            for verdict in Verdict
            if (count := self.count(verdict))
        ]
        lines += [f"    {words}: {count:,}" for words, count in self.reasons().items()]
        lines += [
            f"  {'available':24s}{self.available:,} horizontally, "
            f"{self.available_vertical:,} vertically"
        ]
        for name in LEVEL_NAMES:
            if name in self.epochs.columns:
                lines.append(f"  {name:24s}{_level_words(self.epochs[name].to_numpy())}")
        lines += [str(finding) for finding in self.findings]
        return "\n".join(lines)


def _level_words(values: Floats) -> str:
    spread = spread_of(values)
    if not spread["epochs"]:
        return "none"
    median, p95 = (
        "infinite" if spread[name] is None else f"{spread[name]:.4g}" for name in ("median", "p95")
    )
    infinite = f", infinite at {spread['infinite']:,}" if spread["infinite"] else ""
    return f"median {median}, 95 % {p95} ({spread['epochs']:,} epochs{infinite})"


def spread_of(values: Floats) -> dict[str, Any]:
    """Order statistics of levels [m], infinite ones among them; None where there is none, or
    where it is infinite. `epochs` have a level, `infinite` of them an infinite one."""
    infinite = int(np.isinf(values).sum())
    figures: dict[str, Any] = {"epochs": int((~np.isnan(values)).sum()), "infinite": infinite}
    for name, share in (("median", 0.5), ("p95", 0.95), ("max", 1.0)):
        level = level_quantile(values, share)
        figures[name] = level if np.isfinite(level) else None
    return figures


def level_quantile(values: Floats, share: float) -> float:
    """The quantile of levels that are not NaN, infinite ones among them; NaN where there is none.

    Between a finite and an infinite level nothing can be interpolated: the larger one counts.
    """
    known = values[~np.isnan(values)]
    if not known.size:
        return float("nan")
    if np.isinf(known).any():
        return float(np.sort(known)[int(np.ceil(share * (known.size - 1)))])
    return float(np.quantile(known, share))


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
