"""What monitoring says of an epoch, and why: numbers with words."""

from __future__ import annotations

from enum import IntEnum

from sbas.monitoring.normal_equations import GeometryReason


class Verdict(IntEnum):
    """Outcome of an epoch. Only `PASSED` and `PASSED_AFTER_EXCLUSION` are available."""

    NOT_AVAILABLE = 0
    PASSED = 1
    PASSED_AFTER_EXCLUSION = 2
    DETECTED = 3
    AMBIGUOUS = 4
    FAILED = 5

    @property
    def words(self) -> str:
        return _VERDICTS[self]


_VERDICTS = {
    Verdict.NOT_AVAILABLE: "not available",
    Verdict.PASSED: "passed",
    Verdict.PASSED_AFTER_EXCLUSION: "passed after exclusion",
    Verdict.DETECTED: "detected",
    Verdict.AMBIGUOUS: "detected, ambiguous",
    Verdict.FAILED: "failed",
}


class MonitorReason(IntEnum):
    """Why an epoch is not available, or why a fault was not removed; the first five are those of
    GeometryReason."""

    NONE = 0
    TOO_FEW = 1
    NO_REDUNDANCY = 2
    DEGENERATE = 3
    TWICE = 4
    CRITICAL = 5
    NO_SATELLITES = 6
    INCOMPLETE = 7
    NO_RESIDUALS = 8
    TIME_TWICE = 9
    NO_OUTLIER = 10
    RIVALS = 11
    STILL_FAULTY = 12
    ONE_SPARE = 13
    RECEIVER = 14
    NOT_STATED = 15

    @property
    def words(self) -> str:
        return _REASONS[self]


_REASONS = {
    **{MonitorReason(reason): reason.words for reason in GeometryReason},
    MonitorReason.CRITICAL: "a fault of one satellite would not show",
    MonitorReason.NO_SATELLITES: "no satellites are given",
    MonitorReason.INCOMPLETE: "a satellite of the fix has no direction, sigma or residual",
    MonitorReason.NO_RESIDUALS: "no residuals: the geometry alone tests nothing",
    MonitorReason.TIME_TWICE: "the epoch stands in the recording twice",
    MonitorReason.NO_OUTLIER: "inconsistent, yet no single range is an outlier",
    MonitorReason.RIVALS: "two ranges cannot be told apart: nobody knows which is at fault",
    MonitorReason.STILL_FAULTY: "a fault remains, and no further range may be excluded",
    MonitorReason.ONE_SPARE: "one spare satellite detects and cannot identify",
    MonitorReason.RECEIVER: "the recording's flag says so",
    MonitorReason.NOT_STATED: "no flag of the recording says",
}
