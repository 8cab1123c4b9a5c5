"""Why: each HPL spike, misleading or nearly misleading event, and its likeliest cause."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sbas.exceptions import InputError
from sbas.findings import Finding, refuse_on_errors
from sbas.input_check import accept, check
from sbas.integrity.causes.cause_checks import CAUSES, Cause, explain_misleading, explain_spike
from sbas.integrity.causes.event_context import Context, EpochArrays, rise_begins
from sbas.integrity.causes.running_level import running_level
from sbas.integrity.epoch_levels import k_of_epochs, mode_codes, whole_table
from sbas.integrity.events import Events, Stretch, find_events, find_runs
from sbas.integrity.exposure.exposure import require
from sbas.integrity.position_error import position_errors
from sbas.numerals import stamp
from sbas.recording import MODES, EpochSource, Flag
from sbas.recording_survey import GAP_STEPS
from sbas.timescales import NS_PER_S
from sbas.truth import Truth

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
EventName = Literal["hpl_spike", "mi", "near_mi"]

COLUMNS = (
    "lat_deg", "lon_deg", "height_m", "hpl_m", "hdop", "n_sv", "mode", "geo_prn", "flags",
    "correction_age_s", "environment",
)  # fmt: skip
_SPIKE_FOOT = 1.25
"""A spike's rise is followed back to this many times the usual level."""


@dataclass(frozen=True)
class ExplainedEvent:
    """One event and its likeliest cause.

    Parameters
    ----------
    kind : "hpl_spike", "mi" (HPE >= HPL) or "near_mi".
    start_ns, peak_ns : GPS times of its first and of its worst epoch [ns].
    duration_s : [first epoch, last + dt) [s]; a lower bound where `censored`.
    hpl_m, usual_hpl_m : level at the worst epoch and the usual one there [m].
    hpe_m : horizontal error there [m]; NaN without truth.
    ratio : HPL over its usual value for a spike, else HPE over HPL.
    misleading : HPE >= HPL at some epoch: else a spike concerns availability only.
    cause, share, settled, shares, evidence : see `Explanation`.
    """

    kind: EventName
    start_ns: int
    peak_ns: int
    duration_s: float
    censored: bool
    hpl_m: float
    usual_hpl_m: float
    hpe_m: float
    ratio: float
    misleading: bool
    cause: Cause
    share: float
    settled: bool
    shares: dict[str, float]
    evidence: str

    def to_dict(self) -> dict[str, Any]:
        plain = {name: _or_none(value) for name, value in vars(self).items()}
        plain |= {
            "start_gpst": _gpst(plain.pop("start_ns")),
            "peak_gpst": _gpst(plain.pop("peak_ns")),
            "shares": {name: _or_none(value) for name, value in self.shares.items()},
        }
        return plain

    def __str__(self) -> str:
        sure = f"{100 * self.share:.0f} %" if math.isfinite(self.share) else "no share"
        name = {"hpl_spike": "HPL spike", "mi": "MI", "near_mi": "near-MI"}[self.kind]
        of = "x usual" if self.kind == "hpl_spike" else "x HPL"
        return (
            f"{stamp(self.start_ns)}  {name} {self.ratio:.3g} {of}, {self.duration_s:g} s: "
            f"{self.cause}{'' if self.settled else '?'} ({sure}): {self.evidence}"
        )


@dataclass(frozen=True, eq=False)
class Causes:
    """The answer of `explain`: events in the order of time."""

    events: tuple[ExplainedEvent, ...]
    hours: float
    truth: Truth | None
    window_s: float
    spike_ratio: float
    near_ratio: float
    merge_s: float
    findings: tuple[Finding, ...]

    def counts(self) -> dict[EventName, dict[Cause, int]]:
        """Events of each kind by cause, the most frequent first."""
        kinds: tuple[EventName, ...] = ("hpl_spike", "mi", "near_mi")
        return {
            kind: dict(Counter(e.cause for e in self.events if e.kind == kind).most_common())
            for kind in kinds
        }

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "hours": self.hours,
            "truth": None if self.truth is None else self.truth.label,
            "window_s": self.window_s,
            "spike_ratio": self.spike_ratio,
            "near_ratio": self.near_ratio,
            "merge_s": self.merge_s,
            "counts": self.counts(),
            "events": [event.to_dict() for event in self.events],
            "findings": [f.to_dict() for f in self.findings],
        }

    def summary(self) -> Any:
        """A DataFrame of the events: a row each."""
        names = ("kind", "start_gpst", "duration_s", "hpl_m", "usual_hpl_m", "hpe_m", "ratio",
                 "cause", "share", "settled", "evidence")  # fmt: skip
        rows = [event.to_dict() for event in self.events]
        return pd.DataFrame(rows, columns=list(names))

    def __str__(self) -> str:
        lines = []
        for kind, causes in self.counts().items():
            if kind != "hpl_spike" and self.truth is None:
                lines.append(f"{kind}: not judged without truth")
                continue
            listed = ", ".join(f"{count} {cause}" for cause, count in causes.items())
            lines.append(f"{kind}: {sum(causes.values())}" + (f" ({listed})" if listed else ""))
        return "\n".join([*lines, *(f"  {event}" for event in self.events)])


def explain(
    source: EpochSource,
    *,
    truth: Truth | None = None,
    window_s: float = 600.0,
    spike_ratio: float = 3.0,
    near_ratio: float = 0.75,
    merge_s: float = 10.0,
    accept_findings: Iterable[str] = (),
) -> Causes:
    """Every HPL spike, MI and near-MI event of a recording with its likeliest cause.

    Parameters
    ----------
    source : a recording, wholly in memory.
    truth : where the antenna was; without it only spikes are found.
    window_s : of the running median that says which HPL is usual [s].
    spike_ratio : a spike is HPL above this many times that median.
    near_ratio : near-MI is HPE/HPL from here up to 1.
    merge_s : runs at most this far apart are one event [s].
    accept_findings : codes of errors in the input to accept as warnings.

    Returns
    -------
    Causes. A cause is the likeliest by what the columns show, not a proof; "unexplained" where
    none holds half of the event's log ratio.

    Raises
    ------
    InputError : the input check found an error, no epoch has a level, or an argument is out of
        range.

    References
    ----------
    Filip, Bazant, Mocek 2010, section 3; definitions and order: integrity statistics, 7;
    near-MI from 0.75: the "safety index" of EGNOS performance monitoring (unverified).
    """
    require("window_s", window_s, above=0)
    require("spike_ratio", spike_ratio, above=1)
    require("near_ratio", near_ratio, above=0, below=1)
    require("merge_s", merge_s, least=0)
    checked = check(source, truth=truth)
    findings = accept(checked.findings, tuple(accept_findings))
    refuse_on_errors(findings)
    survey = checked.survey
    table = whole_table(source, COLUMNS)
    invalid = (table["flags"].to_numpy() & Flag.PL_DECLARED_INVALID) != 0
    # Levels outside SBAS are kept: that such a level was reported is itself an explanation.
    hpl = np.where(invalid, np.nan, table["hpl_m"].to_numpy())
    if not np.isfinite(hpl).any():
        raise InputError(
            "no epoch has a protection level", where="hpl_m",
            cure="record blocks or columns with HPL; without levels there is nothing to explain",
        )  # fmt: skip
    time = table.index.to_numpy().astype(np.int64)
    hpe = np.full(time.size, np.nan)
    if truth is not None:
        hpe = position_errors(table, truth)["hpe_m"].to_numpy()
    reference, spike = running_level(time, hpl, window_s=window_s, ratio=spike_ratio)
    outside = (table["flags"].to_numpy() & Flag.PL_OUTSIDE_SBAS) != 0
    ratio = np.where(outside, np.nan, hpe / hpl)
    misled, near = ratio >= 1, ratio >= near_ratio
    codes = mode_codes(table).astype(np.int64)
    arrays = EpochArrays(
        time_ns=time,
        interval_ns=survey.interval_ns,
        hpl_m=hpl,
        hpe_m=hpe,
        reference_m=reference,
        hdop=table["hdop"].to_numpy(),
        n_sv=table["n_sv"].to_numpy().astype(np.int64),
        # Without a fix there is no mode to change from.
        mode=np.where(codes == MODES.index("none"), -1, codes),
        k=k_of_epochs(table, source.meta.pl),
        geo_prn=table["geo_prn"].to_numpy().astype(np.int64),
        age_s=table["correction_age_s"].to_numpy(),
        environment=table["environment"].cat.codes.to_numpy().astype(np.int64),
        calm=np.isfinite(hpl) & ~(spike | near),
    )
    found = [
        *_explained("hpl_spike", spike, hpl / reference, arrays, misled, merge_s),
        *_explained("mi", misled, ratio, arrays, misled, merge_s, near_ratio),
        *_explained("near_mi", near, ratio, arrays, misled, merge_s, near_ratio),
    ]
    return Causes(
        tuple(sorted(found, key=lambda event: (event.start_ns, event.kind))),
        survey.hours,
        truth,
        window_s,
        spike_ratio,
        near_ratio,
        merge_s,
        tuple(findings),
    )


def _explained(
    kind: EventName,
    state: Bools,
    signal: Floats,
    arrays: EpochArrays,
    misled: Bools,
    merge_s: float,
    near_ratio: float = 1.0,
) -> Iterable[ExplainedEvent]:
    time = arrays.time_ns
    judged = np.isfinite(signal)
    stretch = Stretch(time, int(GAP_STEPS * arrays.interval_ns))
    runs = find_runs(np.flatnonzero(state), stretch, judged)
    events: Events = find_events(runs, interval_ns=arrays.interval_ns, merge_s=merge_s)
    first = np.searchsorted(time, events.start_ns)
    last = np.searchsorted(time, events.end_ns - arrays.interval_ns, side="right") - 1
    for i in range(len(events)):
        rows = slice(int(first[i]), int(last[i]) + 1)
        misleading = bool(misled[rows].any())
        if kind == "near_mi" and misleading:
            continue
        peak = rows.start + int(np.nanargmax(signal[rows]))
        calm_below = _SPIKE_FOOT if kind == "hpl_spike" else near_ratio / 2
        foot = rise_begins(signal, rows.start, arrays, calm_below=calm_below)
        context = Context(arrays, foot, rows.start, rows.stop - 1, peak)
        why = explain_spike(context) if kind == "hpl_spike" else explain_misleading(context)
        yield ExplainedEvent(
            kind=kind,
            start_ns=int(events.start_ns[i]),
            peak_ns=int(time[peak]),
            duration_s=float(events.end_ns[i] - events.start_ns[i]) / NS_PER_S,
            censored=bool(events.censored[i]),
            hpl_m=float(arrays.hpl_m[peak]),
            usual_hpl_m=float(arrays.reference_m[peak]),
            hpe_m=float(arrays.hpe_m[peak]),
            ratio=float(signal[peak]),
            misleading=misleading,
            cause=why.cause,
            share=why.share,
            settled=why.settled,
            shares=why.shares,
            evidence=why.evidence,
        )


def _or_none(value: Any) -> Any:
    """NaN is not JSON."""
    return None if isinstance(value, float) and math.isnan(value) else value


def _gpst(ns: int) -> str:
    return str(np.datetime64(ns, "ns"))


__all__ = ["CAUSES", "Causes", "ExplainedEvent", "explain"]
