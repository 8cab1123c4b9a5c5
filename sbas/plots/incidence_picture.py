"""How fast combinations of sensor states spoil the output: cumulative incidence over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sbas.exceptions import InputError
from sbas.fusion.critical.combination_figures import FEW_EVENTS
from sbas.fusion.critical.critical_times import CriticalTimes
from sbas.numerals import number
from sbas.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    HALF_WIDTH,
    ORANGE,
    PURPLE,
    VERMILION,
    Sheet,
    drawing,
    sentence,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(HALF_WIDTH, 4.1, bottom=1.2)
_LOOKS = (
    (VERMILION, "-"), (BLUE, (0, (6, 1.5))), (GREEN, (0, (3, 1))), (PURPLE, (0, (6, 1, 1, 1))),
    (ORANGE, (0, (1, 0.8))), (BLACK, (0, (4, 1, 1, 1, 1, 1))),
)  # fmt: skip
MOST = len(_LOOKS)
"""Curves that can be told apart."""


def incidence_curve(
    critical: CriticalTimes,
    combinations: Sequence[str] | None = None,
    *,
    ax: Axes | None = None,
) -> Axes:
    """Probability that the output has got to the target state, by time in a combination.

    Parameters
    ----------
    critical : result of `sbas.fusion.critical.critical_times.critical_times`.
    combinations : which, such as ("UUN", "NNU"), at most 6; None for those of the highest
        incidence, critical ones first.
    ax : axes to draw on; a new figure without them.

    Returns
    -------
    The axes: steps with a band at 95 % for each combination. The curves are of episodes that
    did not begin in the target state; the share that did stands in the legend.

    Raises
    ------
    InputError : a combination that did not occur or has fewer than 5 events, or more than 6.
    """
    chosen = _usual(critical) if combinations is None else tuple(combinations)
    _check(critical, chosen)
    word = {"U": "U", "DA": "DA or worse"}[critical.target]
    with drawing(None if ax is None else [ax], SHEET) as (ax,):
        ax.set_xlabel("time in the combination [s]")
        ax.set_ylabel(f"output has got to {word} [1]")
        if not chosen:
            sentence(ax, f"no combination with {FEW_EVENTS} events")
            return ax
        right = _right(critical, chosen)
        for name, (colour, dashes) in zip(chosen, _LOOKS, strict=False):
            curve = critical.curves[name]
            time = np.concatenate([[0.0], curve.time_s, [max(right, curve.time_s[-1])]])
            value, lower, upper = (
                np.concatenate([[0.0], y, y[-1:]])
                for y in (curve.incidence, curve.lower, curve.upper)
            )
            ax.fill_between(time, lower, upper, step="post", color=colour, alpha=0.1, linewidth=0)
            ax.step(
                time, value, where="post", color=colour, linestyle=dashes, linewidth=1.2,
                label=f"{name}, and {number(100 * curve.at_entry, 2)} % at entry",
            )  # fmt: skip
        ax.set_xlim(0, right)
        ax.set_ylim(bottom=0)
        ax.legend(
            title=f"{', '.join(critical.names)}; modelled, {critical.runs:,} runs; "
            f"step {critical.step_s:g} s",
            title_fontsize=7, loc="upper center", bbox_to_anchor=(0.46, -0.15), ncols=2,
            borderaxespad=0, handlelength=2.6, columnspacing=1.2,
        )  # fmt: skip
        return ax


def _usual(critical: CriticalTimes) -> tuple[str, ...]:
    table = critical.table.loc[list(critical.curves)]
    first = table.assign(_critical=table["verdict"] == "critical")
    ordered = first.sort_values(["_critical", "incidence"], ascending=False, kind="stable")
    return tuple(ordered.index[:MOST])


def _check(critical: CriticalTimes, chosen: tuple[str, ...]) -> None:
    unknown = [name for name in chosen if name not in critical.curves]
    if unknown:
        raise InputError(
            f"no incidence of {', '.join(unknown)}",
            where="combinations",
            evidence=f"it did not occur, or had fewer than {FEW_EVENTS} events",
            cure=f"some of {', '.join(critical.curves)}" if critical.curves else "more runs",
        )
    if len(chosen) > MOST:
        raise InputError(f"more than {MOST} curves", where="combinations", cure="fewer at a time")


def _right(critical: CriticalTimes, chosen: tuple[str, ...]) -> float:
    """Time by which each curve is at 98 % of where it ends."""
    ends = []
    for name in chosen:
        curve = critical.curves[name]
        near = np.argmax(curve.incidence >= 0.98 * curve.incidence[-1])
        ends.append(float(curve.time_s[near]))
    return max(1.15 * max(ends), 3 * critical.step_s)
