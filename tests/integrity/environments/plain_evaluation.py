"""The figures of an environment counted epoch by epoch, without any code of the package."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Epochs:
    """A record as lists: times [s], errors and levels [m] (NaN if missing), fixes, labels."""

    time_s: list[float]
    hpe_m: list[float]
    hpl_m: list[float]
    fix: list[bool]
    label: list[str]
    step_s: float

    def __len__(self) -> int:
        return len(self.time_s)

    def gap_before(self, i: int) -> bool:
        return i > 0 and self.time_s[i] - self.time_s[i - 1] > 1.5 * self.step_s

    def covers_s(self, i: int) -> float:
        return self.step_s if i == 0 else min(self.time_s[i] - self.time_s[i - 1], self.step_s)

    def up(self, i: int, limit_m: float) -> bool:
        return self.fix[i] and self.hpl_m[i] < limit_m

    def until_next_s(self, i: int) -> float:
        """End of the time that belongs to an epoch: the next one's time."""
        return self.time_s[i] + self.step_s if i + 1 == len(self) else self.time_s[i + 1]

    def within_s(self, label: str, start_s: float, end_s: float) -> float:
        """Time in [start, end) that belongs to epochs of a label."""
        return sum(
            max(0.0, min(end_s, self.until_next_s(i)) - max(start_s, self.time_s[i]))
            for i in range(len(self))
            if self.label[i] == label
        )


def sizes(e: Epochs, label: str) -> dict[str, float]:
    """Epochs and hours of a label."""
    mine = [i for i in range(len(e)) if e.label[i] == label]
    judged = [i for i in mine if math.isfinite(e.hpe_m[i]) and math.isfinite(e.hpl_m[i])]
    gaps = [i for i in range(1, len(e)) if e.gap_before(i) and e.label[i - 1] == label]
    return {
        "epochs": len(mine),
        "recorded_s": sum(e.covers_s(i) for i in mine),
        "judged_s": sum(e.covers_s(i) for i in judged),
        "error_s": sum(e.covers_s(i) for i in mine if math.isfinite(e.hpe_m[i])),
        "level_s": sum(e.covers_s(i) for i in mine if math.isfinite(e.hpl_m[i])),
        "gap_s": sum(e.time_s[i] - e.time_s[i - 1] - e.step_s for i in gaps),
    }


def service(e: Epochs, label: str, limit_m: float, window: int = 15) -> dict[str, float]:
    """Availability figures of a label: a walk along epochs and gaps."""
    losses = recoveries = 0
    state, place = None, ""
    for i in range(len(e)):
        walk = [(False, e.label[i - 1])] if e.gap_before(i) else []
        for up, here in [*walk, (e.up(i, limit_m), e.label[i])]:
            losses += state is True and not up and here == label
            recoveries += state is False and up and place == label
            state, place = up, here
    mine = [i for i in range(len(e)) if e.label[i] == label]
    up_s = sum(e.covers_s(i) for i in mine if e.up(i, limit_m))
    down_s = sum(e.covers_s(i) for i in mine if not e.up(i, limit_m))
    gap_s = sizes(e, label)["gap_s"]
    ups = [i for i in mine if e.up(i, limit_m)]
    risks = []
    for with_gaps in (True, False):
        lost = 0
        for i in ups:
            ahead = range(i + 1, min(i + window + 1, len(e)))
            lost += any(not e.up(j, limit_m) or (with_gaps and e.gap_before(j)) for j in ahead)
        risks.append(lost / len(ups) if ups else 1.0)
    return {
        "availability": up_s / (up_s + down_s + gap_s),
        "excluding_gaps": up_s / (up_s + down_s),
        "losses": losses,
        "recoveries": recoveries,
        "risk": risks[0],
        "risk_excluding_gaps": risks[1],
    }


def bad_epochs(e: Epochs, kind: str, limit_m: float) -> tuple[list[bool], list[bool]]:
    """Which epochs satisfy the event's condition, and at which it could be judged."""
    bad, seen = [], []
    for hpe, hpl in zip(e.hpe_m, e.hpl_m, strict=True):
        if kind == "exceeds_al":
            seen.append(math.isfinite(hpe))
            bad.append(hpe >= limit_m)
            continue
        seen.append(math.isfinite(hpe) and math.isfinite(hpl))
        bad.append(hpe >= hpl if kind == "mi" else hpe >= limit_m and hpl < limit_m)
    return bad, seen


@dataclass
class Event:
    start_s: float
    end_s: float
    cut: bool
    labels: set[str]


def runs_of(e: Epochs, kind: str, limit_m: float) -> list[Event]:
    bad, seen = bad_epochs(e, kind, limit_m)
    runs: list[Event] = []
    for i in range(len(e)):
        if not bad[i]:
            continue
        ends = i + 1 == len(e) or e.gap_before(i + 1) or not seen[i + 1]
        if i and bad[i - 1] and not e.gap_before(i):
            runs[-1].end_s = e.time_s[i] + e.step_s
            runs[-1].labels.add(e.label[i])
        else:
            cut = i == 0 or e.gap_before(i) or not seen[i - 1]
            runs.append(Event(e.time_s[i], e.time_s[i] + e.step_s, cut, {e.label[i]}))
        runs[-1].cut |= ends
    return runs


def events_of(runs: list[Event], *, merge_s: float, least_s: float, step_s: float) -> list[Event]:
    """Events of the whole record."""
    merged: list[Event] = []
    for run in runs:
        if merged and run.start_s - merged[-1].end_s <= merge_s:
            merged[-1].end_s = run.end_s
            merged[-1].cut |= run.cut
            merged[-1].labels |= run.labels
        else:
            merged.append(Event(run.start_s, run.end_s, run.cut, set(run.labels)))
    return [x for x in merged if x.cut or x.end_s - x.start_s + step_s / 2 >= least_s]


def rate(
    e: Epochs, label: str, kind: str, limit_m: float, *, merge_s: float, least_s: float
) -> dict[str, float]:
    """Count and hours behind the demonstrated rate of a label."""
    runs = runs_of(e, kind, limit_m)
    least = least_s if kind == "hmi" else 0.0
    events = events_of(runs, merge_s=merge_s, least_s=least, step_s=e.step_s)
    mine = [x for x in events if label in x.labels]
    within = sum(e.within_s(label, x.start_s, x.end_s) for x in events)
    others = sum(
        e.within_s(label, x.end_s, x.end_s + merge_s) for x in events if label not in x.labels
    )
    judged = sizes(e, label)["error_s" if kind == "exceeds_al" else "judged_s"]
    return {
        "events": len(mine),
        "runs": sum(label in run.labels for run in runs),
        "event_s": within,
        "hours_s": max(0.0, judged - others - within - len(mine) * merge_s),
    }
