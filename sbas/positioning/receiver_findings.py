"""What a reader of the software receiver's figures must know of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from sbas.augmentation.messages import SbasMessages
from sbas.augmentation.reasons import WORDS, Reason
from sbas.augmentation.reception import MOST_LOST
from sbas.augmentation.tables import Mode
from sbas.augmentation.timeline import CorrectionTimeline
from sbas.findings import Finding
from sbas.positioning.mode_choice import CONTRADICTING, EPOCH_WORDS, UNSETTLED, usual_reason
from sbas.positioning.orbits import length
from sbas.positioning.receiver_noise import CLASS_2
from sbas.positioning.receiver_settings import ReceiverSettings
from sbas.positioning.software_receiver import Fixes

Floats = NDArray[np.float64]

FAR_FROM_PLACE_M = 30.0
"""Beyond it a wrong place, and not the ranges' own errors, moves fixes away."""
OUTSIDE_SERVICE = (Reason.OUTSIDE_GRID, Reason.IONO_NOT_MONITORED, Reason.NOT_A_GRID_POINT)


def receiver_findings(
    settings: ReceiverSettings,
    timeline: CorrectionTimeline,
    fixes: Mapping[Mode, Fixes],
    heard: SbasMessages,
    *,
    no_klobuchar: bool,
) -> Iterator[Finding]:
    """Findings on settings, messages and the fixes made of them."""
    yield from _of_settings(settings, no_klobuchar)
    yield from _of_messages(timeline, heard)
    yield from _of_fixes(settings, fixes)


def _of_settings(settings: ReceiverSettings, no_klobuchar: bool) -> Iterator[Finding]:
    if not settings.smoothing:
        yield Finding(
            "E23",
            "warning",
            "ranges are not smoothed: sigma_air presumes 100 s of carrier smoothing",
            evidence="levels are the same, errors are larger than the model's",
            cure="--smoothing, for recordings well above 360 s",
        )
    if settings.noise == CLASS_2:
        yield Finding(
            "E23",
            "info",
            "sigma_air is that of an airborne receiver (class 2): it does not bound multipath at "
            "a train",
            cure="protect(noise=ReceiverNoise(...)) with your own model",
        )
    if settings.mode != "pa":
        if no_klobuchar:
            yield Finding(
                "E25",
                "warning",
                "no navigation file has Klobuchar coefficients: where the grid gives no delay "
                "the broadcast model is its night value",
                cure="--nav with a file that has them (IONOSPHERIC CORR)",
            )
        yield Finding(
            "E23",
            "info",
            "DO-229 defines no VPL for non-precision approach; it is given with the K of "
            "precision approach",
        )
    if settings.geo_ranging:
        yield Finding(
            "E23",
            "info",
            "the SBAS satellite's own range is used, with the noise of DO-229's SBAS ranging",
        )


def _of_messages(timeline: CorrectionTimeline, heard: SbasMessages) -> Iterator[Finding]:
    if timeline.alarms_ignored:
        yield Finding(
            "E23",
            "warning",
            f"{timeline.alarms_ignored:,} messages of type 0 were not taken as alarms: the signal "
            "is in test mode, and so is every figure",
        )
    if timeline.contradicted_s.size:
        yield Finding(
            "E24",
            "warning",
            f"{timeline.contradicted_s.size:,} masks came with the issue of another content: all "
            "that was heard before them is void",
            evidence=f"first at GPS second {int(timeline.contradicted_s[0])}; a gap of hours, or "
            "messages of two days or satellites joined",
            cure="give messages of one time without long gaps",
        )
    if timeline.void:
        listed = ", ".join(f"type {kind}: {n:,}" for kind, n in sorted(timeline.void.items()))
        yield Finding(
            "E24",
            "warning",
            "messages with contents that are not allowed were left out",
            evidence=listed,
        )
    gaps = np.diff(heard.time_s) - 1
    if gaps.max(initial=0) > 0:
        voiding = int((gaps >= MOST_LOST).sum())
        yield Finding(
            "E04",
            "info",
            f"{int(gaps.sum()):,} messages are missing in {int((gaps > 0).sum()):,} places",
            evidence=f"longest {int(gaps.max()):,} s; {voiding:,} gaps of {MOST_LOST} s or more "
            "void the fast corrections",
        )


def _of_fixes(settings: ReceiverSettings, fixes: Mapping[Mode, Fixes]) -> Iterator[Finding]:
    for name, words in (
        ("contradicting", EPOCH_WORDS[CONTRADICTING]),
        ("unsettled", EPOCH_WORDS[UNSETTLED]),
    ):
        epochs = max(int(getattr(fix, name).sum()) for fix in fixes.values())
        if epochs:
            yield Finding("E10", "warning", f"{epochs:,} epochs have no fix: {words}")
    last = list(fixes.values())[-1]
    solved = last.solved
    if not solved.any():
        reason = usual_reason(last)
        what = EPOCH_WORDS[CONTRADICTING] if last.contradicting.any() else WORDS[reason]
        if reason in OUTSIDE_SERVICE:
            what += ": the receiver is outside the service area of this SBAS"
        yield Finding(
            "E15",
            "error",
            f"no epoch has a fix, mostly: {what}",
            evidence=f"{solved.size:,} epochs, {len(last.measured):,} ranges",
            cure="check that messages, navigation and observations are of the same place and time"
            + (", and --position" if settings.place_m is not None else ""),
        )
    elif settings.place_m is not None:
        off_m = float(np.median(length(last.receiver_m[solved] - np.array(settings.place_m))))
        if off_m > FAR_FROM_PLACE_M:
            yield Finding(
                "E12",
                "error",
                "the ranges were not measured at the place given: geometry and levels are those "
                "of another place",
                evidence=f"fixes lie {off_m:,.0f} m from it (median)",
                cure="leave out --position, or give the antenna's own",
            )
