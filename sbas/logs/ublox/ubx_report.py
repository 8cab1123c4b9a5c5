"""What a UBX log said about itself, and what the reader removed, missed or left over."""

from __future__ import annotations

from collections import Counter

from sbas.findings import Finding
from sbas.logs.sentinels import removed_findings
from sbas.logs.ublox.ubx_levels import LevelCounts
from sbas.logs.ublox.ubx_stream import Seen
from sbas.recording import ProtectionLevelMeta, RecordingMeta

_FRAME_AGE_MS = 2000
"""Frames come once a second: epochs further apart say little about when a frame came."""


def meta_of(seen: Seen, horizontal: str) -> RecordingMeta:
    """Metadata of a reading, with its findings."""
    levels = seen.tally.levels
    left_over = () if seen.leftovers is None else seen.leftovers.findings(seen.end)
    pl = ProtectionLevelMeta()
    if levels.messages:
        pl = ProtectionLevelMeta("tmir", risk=levels.risk, risk_per="epoch")
    return RecordingMeta(
        leap_seconds=seen.last_leap_s,
        pl=pl,
        findings=(
            *_of_messages(seen),
            *_of_levels(levels, horizontal),
            *_of_clock(seen),
            *_of_frames(seen),
            *left_over,
        ),
        options={"ubx_pl": horizontal} if levels.messages else {},
    )


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{number:,} {name}" for name, number in sorted(counts.items()))


def _of_messages(seen: Seen) -> list[Finding]:
    tally = seen.tally
    found = list(removed_findings(tally.removed))
    if tally.without_time:
        found.append(
            Finding(
                "E10",
                "warning",
                "messages carry no usable time and were left out",
                evidence=_listed(tally.without_time),
                cure="usual before the first fix; log from when the receiver knows the time",
            )
        )
    if seen.short:
        found.append(
            Finding(
                "E10",
                "warning",
                "messages are shorter than their kind and were left out",
                evidence=_listed(seen.short),
            )
        )
    if tally.incomplete:
        found.append(
            Finding(
                "E10",
                "warning",
                "epochs lack a message that other epochs have; flag EPOCH_INCOMPLETE",
                evidence=f"{tally.incomplete:,} of {tally.rows:,} epochs",
                cure="log all messages at one rate; missing values stay missing",
            )
        )
    if not tally.rows and seen.positions_not_read:
        found.append(
            Finding(
                "E10",
                "warning",
                "the positions of this log are in messages that are not read",
                evidence=_listed(seen.positions_not_read),
                cure="log NAV-PVT",
            )
        )
    return found


def _of_levels(levels: LevelCounts, horizontal: str) -> list[Finding]:
    found = []
    risk = levels.risk
    if levels.risks and risk is not None:
        of_two = "root of the sum of squares" if horizontal == "norm" else "larger"
        found.append(
            Finding(
                "E23",
                "warning",
                "protection levels are those of NAV-PL, one an axis for the receiver's own risk "
                "an epoch, not those of DO-229",
                evidence=f"{levels.risks[risk]:,} epochs with a risk of {risk:g} an "
                f"epoch; hpl_m is the {of_two} of the two horizontal levels",
                cure="judge them by their own risk; --ubx-pl norm or --ubx-pl max",
            )
        )
    if levels.invalid:
        found.append(
            Finding(
                "E23",
                "warning",
                "the receiver declared protection levels invalid, or they cannot be used; made "
                "missing, flag PL_DECLARED_INVALID",
                evidence=f"{levels.invalid.total():,} of {levels.messages:,} NAV-PL: "
                + "; ".join(f"{n:,} x {reason}" for reason, n in levels.invalid.most_common()),
                cure="finish the set-up that the receiver asks for, or judge without these levels",
            )
        )
    others = {other: n for other, n in levels.risks.items() if other != risk}
    if others and risk is not None:
        found.append(
            Finding(
                "E23",
                "warning",
                "protection levels of another risk than most were made missing, flag "
                "PL_DECLARED_INVALID: levels of several risks are never pooled",
                evidence=f"kept {levels.risks[risk]:,} of {risk:g} an epoch; left out "
                + ", ".join(f"{n:,} of {other:g}" for other, n in sorted(others.items())),
                cure="split the log where the risk was changed, and read the parts one by one",
            )
        )
    return found


def _of_clock(seen: Seen) -> list[Finding]:
    found = []
    if seen.tally.inferred:
        found.append(
            Finding(
                "E10",
                "info",
                "epochs without NAV-PVT and NAV-TIMEGPS took the week of the epoch before; flag "
                "DATE_INFERRED",
                evidence=f"{seen.tally.inferred:,} of {seen.tally.rows:,} epochs",
            )
        )
    if seen.contradicting:
        off = seen.contradicting.most_common(3)
        found.append(
            Finding(
                "E25",
                "warning",
                "UTC and GPS time of week of NAV-PVT contradict each other; times follow the time "
                "of week",
                evidence=", ".join(f"{n:,} epochs by {seconds:,} s" for seconds, n in off)
                + (", and others" if len(seen.contradicting) > len(off) else ""),
                cure="a few seconds are an old leap second count, which does no harm; else check "
                "the dates",
            )
        )
    if seen.tally.disagreeing:
        found.append(
            Finding(
                "E25",
                "warning",
                "NAV-TIMEGPS and the date of NAV-PVT give different weeks; NAV-TIMEGPS was taken",
                evidence=f"{seen.tally.disagreeing:,} epochs",
                cure="check the dates, and for a week rollover of old firmware",
            )
        )
    if len(seen.leap_s) > 1:
        found.append(
            Finding(
                "E25",
                "warning",
                "the receiver states several differences between GPS time and UTC",
                evidence=", ".join(f"{value} s" for value in sorted(seen.leap_s)),
                cure="GPS times are not affected; mind it when comparing with UTC",
            )
        )
    return found


def _of_frames(seen: Seen) -> list[Finding]:
    found = []
    if seen.frames and seen.first_ms < 0:
        found.append(
            Finding(
                "E10",
                "warning",
                "SBAS frames have no time: the log holds no message that states it",
                evidence=f"{seen.frames:,} frames",
                cure="log NAV-TIMEGPS or NAV-PVT beside them",
            )
        )
    elif seen.frames:
        sparse = seen.longest_step_ms > _FRAME_AGE_MS
        found.append(
            Finding(
                "E25",
                "warning" if sparse else "info",
                "UBX gives SBAS frames no time: each has that of the last epoch before it in the "
                "log",
                evidence=f"{seen.frames:,} frames, {seen.frames_before_time:,} before the first "
                f"epoch with that one's time; epochs at most {seen.longest_step_ms / 1000:g} s "
                "apart",
                cure="log NAV-TIMEGPS once a second" if sparse else "",
            )
        )
    if seen.other_signals:
        found.append(
            Finding(
                "E25",
                "warning",
                "SBAS frames of a signal that is not L1 C/A have no signal in sbas_frames",
                evidence=f"{seen.other_signals:,} of {seen.frames:,} frames",
            )
        )
    if seen.other_frames:
        found.append(
            Finding(
                "E10",
                "warning",
                "RXM-SFRBX of SBAS satellites without the 8 words of a frame were left out",
                evidence=f"{seen.other_frames:,} messages",
            )
        )
    return found
