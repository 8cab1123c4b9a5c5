"""Environments side by side: sizes of errors and levels, and the rate of HMI in each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sbas.estimate import Estimate, Refusal
from sbas.integrity.rate_evidence import NPA_CLAIM
from sbas.integrity.results import Evaluation, Summary
from sbas.numerals import hours, percent
from sbas.plots.style import (
    BLUE,
    FULL_WIDTH,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    VERMILION,
    Sheet,
    drawing,
    log_axis,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(FULL_WIDTH, 4.9, left=0.62, right=1.55, bottom=0.62, rows=2)
"""For both pictures, one above the other."""

_ALONE = Sheet(FULL_WIDTH, 3.0, left=0.62, right=1.55, bottom=0.62)
_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILION)
_LONGEST_NAME = 12
_MOST_UPRIGHT = 9
"""With more names they are turned, so that they stay apart."""


def environment_sizes(evaluation: Evaluation, *, ax: Axes | None = None) -> Axes:
    """Median, 95 % value and maximum of HPE and HPL in each environment.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    ax : axes to draw on; a new figure without them. A bar reaches from the median to the 95 %
        value, a line on to the maximum; broken lines are the alert limits.
    """
    with drawing(None if ax is None else [ax], _ALONE) as (ax,):
        parts = evaluation.environments
        ax.set_ylabel("HPE, HPL [m]")
        quantities = (("HPE", "hpe_m", VERMILION, -0.17), ("HPL", "hpl_m", BLUE, 0.17))
        sizes = {
            name: [getattr(part, name) for part in parts.values()] for _, name, _, _ in quantities
        }
        known = [s for column in sizes.values() for s in column if s is not None]
        if not parts or not known:
            sentence(ax, "no environment labels" if not parts else "no error and no level")
            return ax
        limits = evaluation.settings.alert_limits_m
        # An error of zero has no place on a log axis; its bar then begins at the foot.
        foot = min(max(s.median, 1e-3) for s in known) / 2
        log_axis(ax, "y", foot, 1.6 * max(*limits, *(s.max for s in known)))
        for label, name, colour, shift in quantities:
            _bars(ax, sizes[name], colour, shift, label, foot)
        for limit in limits:
            ax.axhline(limit, color=INK, linewidth=0.6, linestyle=(0, (4, 2)))
        ax.plot(
            [], [], color=INK, linewidth=0.6, linestyle=(0, (4, 2)),
            label=f"AL {', '.join(f'{limit:g}' for limit in limits)} m",
        )  # fmt: skip
        _names(ax, evaluation)
        ax.legend(
            loc="upper left", bbox_to_anchor=(1.01, 1.0), title="median to 95 %,\nline to maximum",
            title_fontsize=7, alignment="left",
        )  # fmt: skip
        return ax


def _bars(
    ax: Axes, sizes: list[Summary | None], colour: str, shift: float, label: str, foot: float
) -> None:
    known = [(i + shift, s) for i, s in enumerate(sizes) if s is not None]
    if not known:
        return
    at = [x for x, _ in known]
    medians = [max(s.median, foot) for _, s in known]
    ends = [max(s.p95, foot) for _, s in known]
    ax.vlines(at, ends, [max(s.max, foot) for _, s in known], color=colour, linewidth=1.0)
    ax.bar(
        at, [b - a for a, b in zip(medians, ends, strict=True)], width=0.26, bottom=medians,
        color=colour, alpha=0.55, linewidth=0.8, edgecolor=colour, label=label,
    )  # fmt: skip
    ax.hlines(medians, [x - 0.13 for x in at], [x + 0.13 for x in at], color=colour, linewidth=1.8)


def environment_rates(evaluation: Evaluation, *, ax: Axes | None = None) -> Axes:
    """Demonstrated rate of HMI per hour in each environment.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    ax : axes to draw on; a new figure without them. Triangles are one-sided upper bounds, one an
        alert limit, circles counted rates where events were seen. Where a rate is not
        demonstrated, the picture says so.
    """
    with drawing(None if ax is None else [ax], _ALONE) as (ax,):
        parts, settings = evaluation.environments, evaluation.settings
        ax.set_ylabel("rate of HMI [1/h]")
        if not parts or evaluation.truth is None:
            sentence(ax, "no environment labels" if not parts else "no truth: no error was formed")
            return ax
        rates = [
            [part.at(al).rates["hmi"].demonstrated for al in settings.alert_limits_m]
            for part in parts.values()
        ]
        uppers = [
            e.upper for row in rates for e in row if isinstance(e, Estimate) and e.upper is not None
        ]
        log_axis(ax, "y", NPA_CLAIM.value / 5, 5 * max([1.0, *uppers]))
        many = len(settings.alert_limits_m)
        for j, limit in enumerate(settings.alert_limits_m):
            shift = 0.5 * ((j + 0.5) / many - 0.5)
            given = [(i + shift, row[j]) for i, row in enumerate(rates)]
            _rates_at(ax, given, _COLOURS[j % len(_COLOURS)], f"AL {limit:g} m")
        for i, row in enumerate(rates):
            if not any(isinstance(e, Estimate) for e in row):
                ax.annotate(
                    "not\ndemonstrated", (i, 0.5), xycoords=("data", "axes fraction"), fontsize=7,
                    ha="center", va="center", color=MUTED,
                )  # fmt: skip
        ax.axhline(
            NPA_CLAIM.value, color=INK, linewidth=1.2, linestyle=(0, (1, 1.2)),
            label=f"claimed: {NPA_CLAIM.value:g}/h",
        )  # fmt: skip
        _names(ax, evaluation)
        ax.legend(
            loc="upper left", bbox_to_anchor=(1.01, 1.0), alignment="left", title_fontsize=7,
            title="demonstrated: triangle\n"
            f"upper bound at {percent(settings.confidence)},\ncircle counted rate",
        )  # fmt: skip
        return ax


def _rates_at(
    ax: Axes, given: list[tuple[float, Estimate | Refusal]], colour: str, label: str
) -> None:
    known = [(x, e) for x, e in given if isinstance(e, Estimate)]
    bounded = [(x, e.upper) for x, e in known if e.upper is not None]
    seen = [(x, e.value) for x, e in known if e.value > 0]
    if bounded:
        ax.plot(*zip(*bounded, strict=True), "v", color=colour, markersize=5, label=label)
    if seen:
        ax.plot(*zip(*seen, strict=True), "o", color=colour, markerfacecolor="white", markersize=5)


def _names(ax: Axes, evaluation: Evaluation) -> None:
    parts = evaluation.environments
    names = [f"{_short(name)}\n{hours(part.hours)}" for name, part in parts.items()]
    ax.set_xlim(-0.6, len(parts) - 0.4)
    turned = 90 if len(parts) > _MOST_UPRIGHT else 0
    ax.set_xticks(range(len(parts)), names, fontsize=7, rotation=turned)
    ax.grid(visible=False, axis="x")


def _short(name: str) -> str:
    words = " ".join(name.split())
    return words if len(words) <= _LONGEST_NAME else f"{words[: _LONGEST_NAME - 1]}…"
