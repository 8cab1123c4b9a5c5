"""Rates against the alert limit: demonstrated, modelled, claimed, and what SIL needs."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

from sbas.estimate import Estimate, Refusal
from sbas.integrity.rate_evidence import NPA_CLAIM, EventKind, RateEvidence
from sbas.integrity.results import Evaluation
from sbas.integrity.sil import SIL_BANDS_PER_H
from sbas.integrity.tallies import CURVE_LIMITS_M
from sbas.numerals import percent
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    INK,
    MUTED,
    SKY,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    sentence,
)  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 3.75, left=0.58, right=0.5, bottom=1.0)

_LOWEST_PER_H, _LOWEST_MODELLED_PER_H = 3e-10, 1e-12
"""Foot of the axis, and how far modelled rates may lower it."""

_DRAWN: tuple[tuple[EventKind, str, str], ...] = (
    ("exceeds_al", BLUE, "HPE ≥ AL"),
    ("hmi", VERMILION, "HMI"),
)


def rate_curve(evaluation: Evaluation, *, ax: Axes | None = None) -> Axes:
    """Demonstrated, modelled and claimed rates of events per hour against the alert limit.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    ax : axes to draw on; a new figure without them. Triangles are one-sided upper bounds,
        circles the counted rates where events were seen; diamonds on broken lines are modelled
        rates, thin dotted lines their upper bounds. Where no rate is demonstrated, the picture
        says why; where none is modelled, nothing is drawn of it.

    References
    ----------
    Bands: IEC 61508-1, 7.6.2 (high demand); claimed: Filip, Bazant, Mocek 2010, 2.1.2.
    """
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        curves, settings = evaluation.curves, evaluation.settings
        ax.set_xlabel("horizontal alert limit [m]")
        ax.set_ylabel("rate of events [1/h]")
        rates = curves.rates
        given = [r.demonstrated for rs in rates.values() for r in rs]
        bounds = [e.upper for e in given if isinstance(e, Estimate) and e.upper is not None]
        limits = [*settings.alert_limits_m, *CURVE_LIMITS_M]
        log_axis(ax, "x", min(limits) * 0.85, max(limits) * 1.2)
        drawn = (r.modelled for kind, _, _ in _DRAWN for r in rates[kind])
        tails = [e for e in drawn if isinstance(e, Estimate)]
        bounds += [e.value if e.upper is None else e.upper for e in tails]
        log_axis(ax, "y", _foot(tails), max([10.0, *(3 * b for b in bounds)]))
        _bands(ax)
        for limit in settings.alert_limits_m:
            ax.axvline(limit, color=INK, linewidth=0.6, linestyle=(0, (4, 2)))
        for kind, colour, name in _DRAWN:
            # Where both agree, the smaller mark of the worse event lies on the larger one.
            size = 4.0 if kind == "hmi" else 6.5
            _points(ax, rates[kind], colour, name, settings.confidence, size)
        for kind, colour, name in _DRAWN:
            _modelled(ax, rates[kind], colour, name)
        claims = [r.claimed for r in rates["hmi"] if isinstance(r.claimed, Estimate)]
        for claim in dict.fromkeys(claims or [NPA_CLAIM]):
            ax.axhline(
                claim.value, color=INK, linewidth=1.2, linestyle=(0, (1, 1.2)),
                label=f"{claim.evidence}: {claim.value:g}/h, {claim.basis}",
            )  # fmt: skip
        refusals = {e.reason: None for e in given if isinstance(e, Refusal)}
        if evaluation.truth is None:
            refusals["not demonstrated: no truth, so no error was formed"] = None
        if refusals:
            sentence(ax, "\n".join(reason.replace(": ", ":\n") for reason in refusals))
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.135), ncols=2, columnspacing=1.2)
        return ax


def _points(
    ax: Axes,
    rates: tuple[RateEvidence, ...],
    colour: str,
    name: str,
    confidence: float,
    size: float,
) -> None:
    shown = [(r.alert_limit_m, r.demonstrated) for r in rates]
    bounded = [(al, e.upper) for al, e in shown if isinstance(e, Estimate) and e.upper is not None]
    if not bounded:
        return
    ax.plot(
        *zip(*bounded, strict=True), "v-", color=colour, linewidth=0.9, markersize=size,
        label=f"demonstrated: {name}, upper bound at {percent(confidence)}",
    )  # fmt: skip
    seen = [(al, e.value) for al, e in shown if isinstance(e, Estimate) and e.value > 0]
    if seen:
        ax.plot(
            *zip(*seen, strict=True), "o", color=colour, markerfacecolor="white", markersize=size,
            label=f"demonstrated: {name}, counted rate",
        )  # fmt: skip


def _foot(tails: list[Estimate]) -> float:
    """Foot of the rate axis [1/h]: lower only where modelled rates lie there."""
    lowest = min((e.value / 3 for e in tails), default=_LOWEST_PER_H)
    return min(_LOWEST_PER_H, max(lowest, _LOWEST_MODELLED_PER_H))


def _modelled(ax: Axes, rates: tuple[RateEvidence, ...], colour: str, name: str) -> None:
    given = [e if isinstance(e := r.modelled, Estimate) else None for r in rates]
    if not any(given):
        return
    limits = [r.alert_limit_m for r in rates]
    label = f"modelled: {name}, rate"
    bounded = [e for e in given if e is not None and e.upper is not None]
    if bounded:
        upper = [math.nan if e is None or e.upper is None else e.upper for e in given]
        ax.plot(limits, upper, color=colour, linewidth=0.8, linestyle=(0, (1, 1)))
        label += f" (dotted: upper bound at {percent(bounded[0].confidence or 0.0)})"
    # A rate too small for a double still lies below the axis: its line must lead there. Where
    # a limit is refused the line is broken.
    values = [math.nan if e is None else max(e.value, sys.float_info.min) for e in given]
    ax.plot(
        limits, values, "D", color=colour, markerfacecolor="white", markersize=3.5,
        linestyle=(0, (5, 2)), linewidth=0.9, label=label,
    )  # fmt: skip


def _bands(ax: Axes) -> None:
    for level, low, high in SIL_BANDS_PER_H:
        ax.axhspan(low, high, color=SKY, alpha=0.06 + 0.07 * level, linewidth=0)
        ax.text(
            1.006, (low * high) ** 0.5, f"SIL {level}", transform=ax.get_yaxis_transform(),
            fontsize=7, va="center", color=MUTED,
        )  # fmt: skip
