"""Detection, identification and exclusion of a faulty range, all epochs at once.

Five satellites detect, six identify and exclude; with fewer than five nothing is tested (one
constellation; each further one needs one more). Source: Filip, Bazant, Mocek 2010, section 4;
W. Baarda, "A testing procedure for use in geodetic networks", 1968 (w-test); the overall model
test is the chi-square test of the weighted sum of squared residuals.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from sbas.monitoring.detection_constants import MonitorDesign
from sbas.monitoring.leave_one_out import correlation
from sbas.monitoring.normal_equations import (
    Adjustment,
    Bools,
    Floats,
    Geometry,
    Ints,
    Ranges,
    adjust,
    geometry,
)
from sbas.monitoring.slopes import critical
from sbas.monitoring.verdicts import MonitorReason, Verdict

Kind = TypeVar("Kind", Ranges, Geometry, Adjustment)


@dataclass(frozen=True, eq=False)
class Detection:
    """Tests of (n,) epochs.

    `statistic`, `threshold` (n,) of the overall model test of all ranges; `w` (s, n) w-tests of
    all ranges, NaN where one has no redundancy; `verdict` of Verdict and `reason` of
    MonitorReason, horizontally; `available_up` the verdict that stands vertically as well;
    `excluded` (e, n) slots in the order of exclusion, -1 where none was; `geometry` and
    `adjustment` after the exclusions of epochs that passed thereby, before them elsewhere.
    """

    statistic: Floats
    threshold: Floats
    w: Floats
    verdict: Ints
    reason: Ints
    available_up: Bools
    excluded: Ints
    geometry: Geometry
    adjustment: Adjustment

    @property
    def detected(self) -> Bools:
        """(n,) True where the overall test of all ranges found a fault."""
        found: Bools = self.statistic >= self.threshold
        return found


def w_test(g: Geometry, a: Adjustment) -> Floats:
    """(s, n) e_i / (sigma_i sqrt(r_i)), standard normal without fault; NaN without redundancy."""
    r = np.where(g.redundancy >= g.least_redundancy, g.redundancy, np.nan)
    w: Floats = a.residual_m * np.sqrt(g.weight / r)
    return w


def detect(given: Ranges, residual_m: Floats, design: MonitorDesign) -> Detection:
    """Test, identify and exclude.

    Parameters
    ----------
    given : ranges of (s, n) made with `residual_m`, so that one without takes no part.
    residual_m : (s, n) observed less computed [m], of the fix or of any place near it.

    Notes
    -----
    A statistic that reaches its threshold is a detection. `PASSED` needs a test that every
    single fault would move: with a critical satellite the epoch is not available. An exclusion
    is kept only if what is left passes.
    """
    g = geometry(given)
    a = adjust(g, residual_m)
    w = w_test(g, a)
    n = g.dof.size
    threshold = np.where(g.solved, design.threshold(g.dof), np.nan)
    verdict, reason = _verdicts(g, a, threshold)
    excluded = np.full((max(design.exclusions, 1), n), -1, np.int64)
    # Exclusions are written into the adjustment: the statistic of all ranges is kept apart.
    found = Detection(
        a.statistic.copy(), threshold, w, verdict, reason, np.zeros(n, bool), excluded, g, a
    )
    # What is being tried: epochs, and their ranges with the outliers left out.
    epochs = np.flatnonzero(verdict == Verdict.FAILED)
    now = _Trial(given, residual_m, g, a, w).some(epochs)
    out = np.full((excluded.shape[0], epochs.size), -1, np.int64)
    for number in range(design.exclusions + 1):
        if not epochs.size:
            break
        at, verdict, reason = _identify(now, design)
        if number == design.exclusions:
            late = reason == MonitorReason.NONE
            verdict = np.where(late, Verdict.FAILED if number else Verdict.DETECTED, verdict)
            reason = np.where(late, MonitorReason.STILL_FAULTY, reason)
        found.verdict[epochs], found.reason[epochs] = verdict, reason
        going = np.flatnonzero(reason == MonitorReason.NONE)
        epochs, out = epochs[going], out[:, going]
        if not epochs.size:
            break
        now = now.some(going).without(at[going])
        out[number] = at[going]
        threshold = np.where(now.g.solved, design.threshold(now.g.dof), np.nan)
        verdict, reason = _verdicts(now.g, now.a, threshold)
        passed = verdict == Verdict.PASSED
        # A fault was found: what can no longer be tested does not make the epoch unknown.
        lost = verdict == Verdict.NOT_AVAILABLE
        found.verdict[epochs] = np.where(lost, Verdict.FAILED, Verdict.PASSED_AFTER_EXCLUSION)
        found.reason[epochs] = np.where(lost, reason, MonitorReason.NONE)
        kept = epochs[passed]
        found.excluded[:, kept] = out[:, passed]
        _put(found.geometry, kept, now.g, passed)
        _put(found.adjustment, kept, now.a, passed)
        going = np.flatnonzero(verdict == Verdict.FAILED)
        spare = verdict == Verdict.DETECTED
        found.verdict[epochs[spare]] = Verdict.FAILED
        found.reason[epochs[spare]] = MonitorReason.STILL_FAULTY
        epochs, out, now = epochs[going], out[:, going], now.some(going)
    up = np.array([0.0, 0.0, 1.0])
    passed = np.isin(found.verdict, (Verdict.PASSED, Verdict.PASSED_AFTER_EXCLUSION))
    unknown = (found.verdict == Verdict.NOT_AVAILABLE) & (found.reason == MonitorReason.CRITICAL)
    below = unknown & (found.statistic < found.threshold)
    vertical = (passed | below) & ~critical(found.geometry, up)
    return replace(found, available_up=vertical)


def _verdicts(g: Geometry, a: Adjustment, threshold: Floats) -> tuple[Ints, Ints]:
    """(n,) verdicts and reasons before identification: FAILED where that is to be tried."""
    n = g.dof.size
    verdict = np.full(n, Verdict.NOT_AVAILABLE, np.int8)
    reason = g.reason.astype(np.int8)
    tested = g.solved & (g.dof >= 1)
    reached = tested & ~(a.statistic < threshold)
    below = tested & ~reached
    hidden = below & critical(g)
    verdict[below & ~hidden] = Verdict.PASSED
    reason[hidden] = MonitorReason.CRITICAL
    verdict[reached] = np.where(g.dof[reached] == 1, Verdict.DETECTED, Verdict.FAILED)
    reason[reached] = np.where(g.dof[reached] == 1, MonitorReason.ONE_SPARE, MonitorReason.NONE)
    return verdict, reason


@dataclass(frozen=True, eq=False)
class _Trial:
    """Epochs under identification."""

    given: Ranges
    residual_m: Floats
    g: Geometry
    a: Adjustment
    w: Floats

    def some(self, epochs: Ints) -> _Trial:
        return _Trial(
            _take(self.given, epochs), self.residual_m[:, epochs], _take(self.g, epochs),
            _take(self.a, epochs), self.w[:, epochs],
        )  # fmt: skip

    def without(self, at: Ints) -> _Trial:
        """The same without range `at` (n,) of each epoch."""
        here = np.arange(at.size)
        weight, rows = self.given.weight.copy(), self.given.rows.copy()
        weight[at, here], rows[:, at, here] = 0.0, 0.0
        given = replace(self.given, weight=weight, rows=rows)
        g = geometry(given)
        a = adjust(g, self.residual_m)
        return _Trial(given, self.residual_m, g, a, w_test(g, a))


def _identify(now: _Trial, design: MonitorDesign) -> tuple[Ints, Ints, Ints]:
    """(n,) slot of the largest w-test, and verdict and reason where it must not be excluded."""
    n = now.w.shape[1]
    size = np.abs(now.w)
    size = np.where(np.isnan(size), -1.0, size)
    at = size.argmax(axis=0)
    largest = size.max(axis=0)
    rho = np.abs(correlation(now.g, at))
    rival = (rho > design.largest_correlation) & (size >= design.rival * largest)
    rival[at, np.arange(n)] = False
    none = largest < design.outlier_threshold
    ambiguous = ~none & rival.any(axis=0)
    verdict = np.where(ambiguous, Verdict.AMBIGUOUS, Verdict.FAILED).astype(np.int8)
    reason = np.where(ambiguous, MonitorReason.RIVALS, MonitorReason.NONE)
    reason = np.where(none, MonitorReason.NO_OUTLIER, reason).astype(np.int8)
    return at, verdict, reason


def _take(whole: Kind, epochs: Ints) -> Kind:
    """Some epochs of a value whose arrays all end in epochs."""
    values: dict[str, Any] = {f.name: getattr(whole, f.name) for f in fields(whole)}
    for name, value in values.items():
        if isinstance(value, np.ndarray):
            values[name] = value[..., epochs]
    return replace(whole, **values)


def _put(whole: Kind, epochs: Ints, part: Kind, rows: Bools) -> None:
    """Write some epochs of `part` into a value that this module made and has not given away."""
    for f in fields(whole):
        getattr(whole, f.name)[..., epochs] = getattr(part, f.name)[..., rows]
