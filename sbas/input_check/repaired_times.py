"""Repairs of times: scale, rollover, wrapped dates, corrected leap seconds, shift, order."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from sbas.findings import Finding
from sbas.input_check.judgement import counted, stamp
from sbas.input_check.leap_steps import LeapStep, LeapSteps
from sbas.input_check.time_order import DAY_NS, WEEK_NS, wraps
from sbas.recording import Recording
from sbas.recording_survey import Ints, epoch_rows, sampling_interval_ns
from sbas.timescales import (
    NS_PER_S,
    TimeScale,
    gps_to_utc,
    gpst_minus_utc_s,
    to_gps,
    utc_to_gps,
)

Repaired = tuple[Recording, list[Finding]]

_WAS_UTC = re.compile(r"(from (UTC|GLONASST|JST) to|in (UTC|GLONASST), now in) GPS time")
"""What readers (E25) and `from_scale` (E26) say of times that hang on the leap seconds."""


def from_scale(recording: Recording, scale: TimeScale) -> Repaired:
    """Stamps of another scale, taken for GPS time, as GPS time.

    Where stamps repeat the second of an inserted leap second, those before the step back have
    the old offset and those from it on the new one, whichever second was repeated.
    """
    if scale in ("GPST", "GST", "QZSST"):
        return recording, []
    inserted = [step for step in _leap_steps(recording) if step.inserted and scale == "UTC"]

    def convert(label_ns: Ints, cuts: list[int]) -> Ints:
        time = to_gps(label_ns.view("M8[ns]"), scale).astype(np.int64)
        for step, cut in zip(inserted, cuts, strict=True):
            around = np.array([step.before_ns - 3 * NS_PER_S, step.after_ns + 3 * NS_PER_S])
            old, new = gpst_minus_utc_s(around.view("M8[ns]")) * NS_PER_S
            near = np.abs(label_ns - step.after_ns) <= 2 * NS_PER_S
            offset = np.where(np.arange(label_ns.size) < cut, old, new)
            time = np.where(near, label_ns + offset, time)
        return np.asarray(time)

    changed = _with_times(recording, convert, inserted)
    added = sorted({int(s) for s in (changed.time - recording.time) / np.timedelta64(1, "s")})
    text = f"{counted(len(recording), 'epoch')} had stamps in {scale}, now in GPS time (--time)"
    evidence = f"added {', '.join(map(str, added))} s"
    return changed, [Finding("E26", "info", text, evidence=evidence)]


def weeks_later(recording: Recording, weeks: int) -> Repaired:
    """Every time moved by whole weeks, on the scale of its stamps.

    Stamps that were UTC came to GPS time by the leap seconds of the wrong date: they go back, are
    moved, and come to GPS time by those of the right one.
    """
    text = f"{counted(len(recording), 'epoch')} moved by {weeks:+d} weeks (--week-rollover)"
    if not any(_WAS_UTC.search(f.message) for f in recording.meta.findings):
        changed = _with_times(recording, lambda label, _: label + weeks * WEEK_NS)
        return changed, [Finding("E26", "info", text)]

    def convert(label_ns: Ints, _: list[int]) -> Ints:
        utc = gps_to_utc(label_ns.view("M8[ns]"))
        return utc_to_gps(utc + np.timedelta64(weeks * WEEK_NS, "ns")).astype(np.int64)

    changed = _with_times(recording, convert)
    if not len(recording):
        return changed, [Finding("E26", "info", text)]
    before, after = (int(gpst_minus_utc_s(gps_to_utc(r.time[:1]))[0]) for r in (recording, changed))
    evidence = (
        f"the stamps were UTC: GPST - UTC is {after} s on the new date, was {before} s on the old; "
        f"{after - before:+d} s beside the weeks"
    )
    changed = changed.replace(meta=replace(changed.meta, leap_seconds=after))
    return changed, [Finding("E26", "info", text, evidence=evidence)]


def shifted(recording: Recording, shift_s: float) -> Repaired:
    """Every time moved by a number of seconds, to the nanosecond."""
    shift_ns = round(shift_s * NS_PER_S)
    changed = _with_times(recording, lambda label, _: label + shift_ns)
    text = f"{counted(len(recording), 'epoch')} moved by {shift_s:+.9g} s (--shift-s)"
    return changed, [Finding("E26", "info", text)]


def unwrapped(recording: Recording, period: str) -> Repaired:
    """A day, or a week, added from each place on where time falls back by one."""
    period_ns = {"day": DAY_NS, "week": WEEK_NS}[period]
    count = 0

    def convert(label_ns: Ints, _: list[int]) -> Ints:
        nonlocal count
        fallen = wraps(np.diff(label_ns, prepend=label_ns[:1]), period_ns)
        count = max(count, int(fallen.sum()))
        return np.asarray(label_ns + np.cumsum(fallen) * period_ns)

    changed = _with_times(recording, convert)
    if not count:
        return recording, []
    text = f"time fell back by one {period} {counted(count, 'time')}: added there (--unwrap)"
    return changed, [Finding("E26", "info", text)]


def without_leap_steps(recording: Recording, how: str) -> Repaired:
    """Times on one side of each step that E11 found moved so that the step is one interval.

    "fix" moves those before it, as a receiver knows the leap seconds better later; "fix-after"
    those behind it.
    """
    late = how == "fix-after"
    steps = [step for step in _leap_steps(recording) if not step.inserted]
    if not steps:
        return recording, []

    def convert(label_ns: Ints, cuts: list[int]) -> Ints:
        moved = label_ns.copy()
        for step, cut in zip(steps, cuts, strict=True):
            if late:
                moved[cut:] -= step.seconds * NS_PER_S
            else:
                moved[:cut] += step.seconds * NS_PER_S
        return moved

    return _with_times(recording, convert, steps), [
        Finding(
            "E26", "info",
            f"{counted(len(recording) - step.row, 'epoch')} from {stamp(step.after_ns)} on moved "
            f"by {-step.seconds:+d} s (--leap-slip)"
            if late else
            f"{counted(step.row, 'epoch')} before {stamp(step.after_ns)} moved by "
            f"{step.seconds:+d} s (--leap-slip)",
        )
        for step in steps
    ]  # fmt: skip


def sorted_epochs(recording: Recording, _: bool) -> Repaired:
    """Epochs in the order of their times, equal ones as they stood."""
    table = recording.table
    if table.index.is_monotonic_increasing:
        return recording, []
    time = table.index.to_numpy()
    moved = int(np.sum(np.argsort(time, kind="stable") != np.arange(time.size)))
    text = f"{moved} epochs put in the order of time (--sort)"
    changed = recording.replace(table=table.sort_index(kind="stable"))
    return changed, [Finding("E26", "info", text)]


def _leap_steps(recording: Recording) -> tuple[LeapStep, ...]:
    watch = LeapSteps(sampling_interval_ns(recording))
    for rows in epoch_rows(recording, LeapSteps.COLUMNS):
        watch.update(rows)
    return watch.steps


def _with_times(
    recording: Recording,
    convert: Callable[[Ints, list[int]], Ints],
    steps: Sequence[LeapStep] = (),
) -> Recording:
    """The recording with the times of its epochs and of its side tables converted.

    `convert` gets (n,) times in file order and how many of them stand before each of `steps`.
    """
    time_ns = convert(recording.time.astype(np.int64), [step.row for step in steps])
    table = recording.table.set_axis(pd.DatetimeIndex(time_ns.view("M8[ns]"), name="time"))
    sides = {}
    for name, side in recording.side_tables.items():
        label_ns = side["time"].to_numpy().astype("M8[ns]").astype(np.int64)
        moved = convert(label_ns, [_rows_before(label_ns, step) for step in steps])
        sides[name] = side.assign(time=moved.view("M8[ns]"))
    return recording.replace(table=table, side_tables=sides)


def _rows_before(label_ns: Ints, step: LeapStep) -> int:
    """Number of rows of a side table, in file order, that stand before a step of the epochs."""
    if step.after_ns > step.before_ns:
        return int(np.searchsorted(label_ns, step.after_ns))
    fallen = np.flatnonzero(np.diff(label_ns) < 0) + 1
    inside = (label_ns[fallen] >= step.after_ns) & (label_ns[fallen] <= step.before_ns)
    if inside.any():
        return int(fallen[inside][0])
    # Rows of both sides have one time: the earlier half stands before the step.
    begin, end = np.searchsorted(label_ns, [step.after_ns, step.before_ns + 1]).tolist()
    return int(begin + (end - begin + 1) // 2)
