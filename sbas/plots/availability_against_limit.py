"""Availability of the service against the alert limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sbas.integrity.results import Evaluation
from sbas.plots.style import (
    BLUE,
    HALF_HEIGHT,
    HALF_WIDTH,
    INK,
    Sheet,
    decades,
    drawing,
    log_axis,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, HALF_HEIGHT)


def availability_curve(evaluation: Evaluation, *, ax: Axes | None = None) -> Axes:
    """Availability against the alert limit, on a log scale of what is missing from 100 %.

    Parameters
    ----------
    evaluation : result of `sbas.evaluate`.
    ax : axes to draw on; a new figure without them. The line leaves gaps out; at the asked
        limits both ways are marked, gaps as down (filled) and left out (open).
    """
    grid, up = evaluation.curves.level_grid_m, evaluation.curves.available_fraction
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("horizontal alert limit [m]")
        ax.set_ylabel("availability, log scale of the rest to 100 %")
        if evaluation.hpl_m is None:
            sentence(ax, "no protection level in this recording:\nthe service counts as down")
            return ax
        # One epoch is the least that can be missing; no loss at all is drawn on the floor.
        floor = 0.3 / evaluation.epochs
        limits = evaluation.settings.alert_limits_m
        shown = (grid >= min(evaluation.hpl_m.min / 1.5, min(limits) / 1.2)) & (
            grid <= 3 * max(*limits, min(evaluation.hpl_m.max, grid[-1]))
        )
        log_axis(ax, "x", grid[shown][0], grid[shown][-1])
        ax.set_yscale("log")
        ax.set_ylim(1.6, floor / 1.6)
        exponents = decades(floor * 2, 1.0, at_most=7)
        ticks = [10.0**e for e in exponents]
        ax.set_yticks([*ticks, floor], [*map(_percent, exponents), "100 %"], minor=False)
        ax.set_yticks([], minor=True)
        ax.step(
            grid[shown], np.maximum(1 - up[shown], floor), where="post", color=BLUE,
            label="gaps left out",
        )  # fmt: skip
        for limit in limits:
            ax.axvline(limit, color=INK, linewidth=0.6, linestyle=(0, (4, 2)))
        results = [r.availability for r in evaluation.alert_limits]
        at = [r.alert_limit_m for r in evaluation.alert_limits]
        out = [max(1 - r.availability_excluding_gaps.value, floor) for r in results]
        down = [max(1 - r.availability.value, floor) for r in results]
        ax.plot(at, out, "o", color=BLUE, markerfacecolor="white", label="asked, gaps left out")
        ax.plot(at, down, "o", color=BLUE, label="asked, gaps count as down")
        ax.legend(loc="lower right", title="demonstrated", title_fontsize=7)
        return ax


def _percent(exponent: int) -> str:
    """100 % less a power of ten, with all its nines."""
    decimals = max(-int(exponent) - 2, 0)
    return f"{100 * (1 - 10.0**exponent):.{decimals}f} %"
