"""Can this recording be trusted? Every sign of damaged or misunderstood input, with its cure.

`check` looks at the epochs twice, at their times and then at all the rest, in batches: each
watch keeps what its judgement needs, and says the same however the recording was cut. Nothing is
repaired here; what the check would repair without a doubt is in `CheckResult.repairs`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sbas.exceptions import InputError
from sbas.findings import Finding
from sbas.input_check import (
    against_truth,
    coordinates,
    dates,
    frozen_values,
    protection_levels,
    time_order,
)
from sbas.input_check.against_truth import Comparison
from sbas.input_check.alternation import Alternation
from sbas.input_check.coordinates import CoordinateRanges
from sbas.input_check.frozen_values import FrozenRuns
from sbas.input_check.judgement import Judged
from sbas.input_check.leap_steps import LeapSteps
from sbas.input_check.protection_levels import LevelModes
from sbas.input_check.receivers import Seams
from sbas.input_check.repairs import Repairs
from sbas.input_check.sampled_epochs import SampledEpochs
from sbas.input_check.time_lag import early_fits, time_lag
from sbas.input_check.time_order import TimeOrder
from sbas.recording import EpochSource
from sbas.recording_survey import Survey, sampling_interval_ns, survey
from sbas.timescales import NS_PER_S
from sbas.track import TrackLine
from sbas.truth import Trajectory, Truth

ACCEPTABLE = ("E06", "E10", "E12", "E24")
"""Errors that a user may accept by name; the others would make figures meaningless."""


@dataclass(frozen=True)
class CheckResult:
    """What the input check found; `repairs` are those that cure findings beyond doubt."""

    survey: Survey
    findings: tuple[Finding, ...]
    format: str
    repairs: Repairs = field(default_factory=Repairs)

    @property
    def epochs(self) -> int:
        return self.survey.epochs

    @property
    def usable(self) -> bool:
        return all(f.severity != "error" for f in self.findings)

    def to_dict(self) -> dict[str, Any]:
        return {
            "epochs": self.epochs,
            "format": self.format,
            "interval_s": self.survey.interval_ns / NS_PER_S if self.epochs > 1 else None,
            "hours": self.survey.hours,
            "gaps": len(self.survey.gaps),
            "static": self.survey.static,
            "usable": self.usable,
            "findings": [f.to_dict() for f in self.findings],
            "repairs": self.repairs.named(),
        }


class _Watches:
    """Everybody who looks at the epochs along with the survey."""

    def __init__(self, interval_ns: int, files: int) -> None:
        self.order = TimeOrder()
        self.leaps = LeapSteps(interval_ns)
        self.ranges = CoordinateRanges()
        self.modes = LevelModes()
        self.levels = FrozenRuns(("hpl_m",))
        self.positions = FrozenRuns(("lat_deg", "lon_deg"))
        self.alternation = Alternation()
        self.seams = Seams(interval_ns, files)
        self.sample = SampledEpochs()

    def all(self) -> tuple[Any, ...]:
        return tuple(vars(self).values())


def check(
    source: EpochSource, *, truth: Truth | None = None, today: np.datetime64 | None = None
) -> CheckResult:
    """The findings of a recording: its reader's, and those of its structure and values.

    Parameters
    ----------
    source : a Recording or another EpochSource.
    truth : where the antenna was, if known: it shows exchanged coordinates, times in another
        scale, units, heights and frames.
    today : the date from which on dates lie in the future; by default the clock's.

    Returns
    -------
    CheckResult; with an "error" among its findings, analyses refuse. Source: docs/formats.md,
    findings, with every code and its threshold.
    """
    interval_ns = sampling_interval_ns(source)
    watches = _Watches(interval_ns, len(source.meta.sources))
    facts = survey(source, interval_ns=interval_ns, watches=watches.all())
    date = np.datetime64("today") if today is None else today
    found = tuple(_judgements(source, facts, watches, truth, date))
    proposed: dict[str, Any] = {}
    for one in found:
        for name, value in one.repair.items():
            both = name == "unit" and name in proposed
            proposed[name] = {**proposed[name], **value} if both else value
    formats = sorted({s.format for s in source.meta.sources})
    return CheckResult(
        facts,
        (*source.meta.findings, *(one.finding for one in found)),
        ", ".join(formats),
        Repairs(**proposed),
    )


def _judgements(
    source: EpochSource,
    facts: Survey,
    watches: _Watches,
    truth: Truth | None,
    today: np.datetime64,
) -> Iterator[Judged]:
    meta, order = source.meta, watches.order
    if facts.epochs < 2:
        yield from time_order.too_few(facts)
        return
    leaps = watches.leaps.steps
    slips = frozenset(step.row for step in leaps)
    alternating = tuple(watches.alternation.judgements())
    yield from time_order.backward(facts, order, slips)
    repeating = sum(step.before_ns == step.after_ns for step in leaps)
    yield from time_order.repeated(facts, repeating, bool(alternating))
    pair = None
    if truth is not None and not isinstance(truth, TrackLine) and watches.sample.time_ns.size:
        pair = Comparison.of(watches.sample, truth)
    early = False
    if leaps and pair is not None and isinstance(truth, Trajectory):
        early = early_fits(pair, watches.sample.row, leaps[0].row, leaps[-1].row)
    yield from watches.leaps.judgements(early)
    shifted = tuple(
        dates.dates(
            facts,
            min_ns=order.min_ns,
            max_ns=order.max_ns,
            leap_seconds=meta.leap_seconds,
            truth=truth,
            today=today,
        )
    )
    yield from shifted
    yield from time_order.rates(facts)
    yield from time_order.lost(facts, slips)
    yield from alternating
    yield from watches.seams.judgements(facts)
    if isinstance(truth, TrackLine):
        yield from against_truth.against_track(watches.sample, truth)
    misread = tuple(_coordinates(facts, watches, pair))
    yield from misread
    errors_m = {}
    if pair is not None and not misread:
        far = tuple(against_truth.far_away(facts, pair))
        yield from far
        if not far:
            # Over a corrected leap second there is no one lag; the next check finds what is left.
            one_lag = isinstance(truth, Trajectory) and not shifted and not leaps
            lagging = tuple(time_lag(pair)) if one_lag else ()
            yield from lagging
            tall = tuple(against_truth.heights_in_another_unit(pair)) or tuple(
                coordinates.heights(watches.ranges)
            )
            yield from tall
            if not tall and all(one.finding.severity != "error" for one in lagging):
                yield from against_truth.constant_offsets(pair, {s.format for s in meta.sources})
            errors_m = _median_errors_m(pair)
    yield from protection_levels.not_positive(facts)
    yield from frozen_values.frozen_levels(watches.levels)
    yield from frozen_values.frozen_positions(watches.positions)
    yield from protection_levels.definition(watches.modes, meta.pl, meta.findings)
    yield from protection_levels.stand_ins(watches.modes)
    yield from protection_levels.unit(watches.modes, meta.pl, errors_m=errors_m)


def _median_errors_m(pair: Comparison) -> dict[str, float]:
    """Median sizes of the errors by the level that bounds them."""
    east, north, up = pair.errors_m()
    sizes = {"hpl_m": np.hypot(east, north), "vpl_m": np.abs(up)}
    known = {name: size[np.isfinite(size)] for name, size in sizes.items()}
    return {name: float(np.median(size)) for name, size in known.items() if size.size}


def _coordinates(facts: Survey, watches: _Watches, pair: Comparison | None) -> Iterator[Judged]:
    """E03, E08 and E12 of the coordinates themselves, a truth permitting."""
    if pair is None or against_truth.looks_like_radians(pair) is not False:
        yield from coordinates.radians(facts)
    fitting = []
    if pair is not None and facts.out_of_range:
        fitting = against_truth.fitting_units(pair, watches.ranges)
    yield from coordinates.outside(facts, watches.ranges, fitting)
    if pair is None:
        yield from coordinates.heights(watches.ranges)


def accept(findings: Iterable[Finding], codes: Iterable[str]) -> tuple[Finding, ...]:
    """Findings with the errors of the named codes turned into warnings that say so.

    Raises
    ------
    InputError : a code that cannot be accepted.
    """
    codes = tuple(codes)
    for code in codes:
        if code not in ACCEPTABLE:
            raise InputError(
                f"finding {code} cannot be accepted",
                cure=f"these can: {', '.join(ACCEPTABLE)}; cure the others",
            )
    return tuple(
        replace(f, severity="warning", message=f"{f.message} (accepted by the user)")
        if f.severity == "error" and f.code in codes
        else f
        for f in findings
    )
